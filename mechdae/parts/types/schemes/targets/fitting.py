"""Descent of errors at targets: one unknown vector beside the dimensions, one error vector."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import fields
from typing import Any

import numpy as np

from mechdae.parts.types.schemes.aims import Aim
from mechdae.parts.types.schemes.closure import SchemeTurn, turned
from mechdae.parts.types.schemes.descent import Descent, moved_by
from mechdae.parts.types.schemes.scheme import Scheme
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Matrices, Points

BETWEEN = 72
"""Crank angles beside those of the targets at which sines of dyads are kept, on a turn; on less of
it fewer."""
POWERS = (2, 4, 8, 16, 32)
"""Of errors whose largest one counts: the first for `EVERY` iterations, and so on."""
ROUNDING = 1e-12
"""Errors below which their size is no scale."""


@dataclass
class ErrorsAt:
    """Errors of a batch and their derivatives.

    ``errors`` (b, k) complex or real. ``slopes`` (b, k, p + e): by the dimensions and by what is
    not a dimension. ``turn``: where sines are least, with slopes.
    """

    errors: Complexes
    slopes: Matrices
    turn: SchemeTurn


@dataclass
class _Fit:
    """Where each set of a batch is."""

    places: Any
    extra: Any
    merit: Floats
    errors: Complexes
    rates: Any
    excess: Points
    slopes: Any


class Fitting(Descent):
    """A batch of sets of one scheme, towards targets."""

    def __init__(
        self, scheme: Scheme, places: Complexes, aim: Aim, limits: Floats, least: Floats
    ) -> None:
        super().__init__(scheme, places, limits, least)
        self.aim = aim
        self.weights = np.array(aim.weights, float)
        self.extra: Any = None
        self._size: Any = None
        self._power, self._round = POWERS[0], 0
        share = 1.0 if aim.turns else 0.5
        self.count = int(BETWEEN * share)

    @abstractmethod
    def _placed(self) -> None:
        """Find anew what is not a dimension: change `places` and `extra`."""

    @abstractmethod
    def _errors(self, places: Complexes, extra: Floats) -> ErrorsAt:
        """Return errors at the targets."""

    def _allowed(self, extra: Floats) -> Booleans:
        """Return which sets (b,) keep the order of their targets."""
        return np.ones(len(extra), bool)

    def _begun(self, state: Any) -> _Fit:
        if state is not None:
            self.places, self.extra = state.places, state.extra
        self._placed()
        if self.aim.minimax:
            self._power, self._round = POWERS[min(self._round, len(POWERS) - 1)], self._round + 1
        found = self._errors(self.places, self.extra)
        # errors of high powers are measured by the largest one
        largest = np.nan_to_num(np.abs(found.errors)).max(axis=1)
        self._size = np.maximum(largest, ROUNDING)
        return self._at(self.places, self.extra, found)

    def _stepped(self, state: _Fit, step: Floats) -> _Fit:
        split = 2 * (self.scheme.size - 1)
        places = moved_by(state.places, step[:, :split])
        extra = state.extra + step[:, split:]
        return self._at(places, extra, self._errors(places, extra))

    def _at(self, places: Complexes, extra: Floats, found: ErrorsAt) -> _Fit:
        root = np.sqrt(self.weights)
        errors, rates = found.errors, found.slopes
        # a step that is too long is not taken, however large its errors are
        with np.errstate(over="ignore", invalid="ignore"):
            if self._power > 2:
                errors, rates = self._raised(errors, rates)
            errors, rates = root * errors, root[:, None] * rates
            merit = (np.abs(errors) ** 2).sum(axis=1)
        merit, excess, slopes = self._judged(places, found.turn, merit)
        rates = np.where(np.isfinite(rates), rates, 0.0)
        errors = np.where(np.isfinite(merit)[:, None], errors, 0.0)
        merit = np.where(self._allowed(extra), merit, np.inf)
        more = np.zeros((*slopes.shape[:2], extra.shape[1]))
        slopes = np.concatenate([slopes, more], axis=2)
        return _Fit(places, extra, merit, errors, rates, excess, slopes)

    def _raised(self, errors: Complexes, rates: Any) -> tuple[Any, Any]:
        """Return errors to half the power, in units of the largest one, of which squares count."""
        half = self._power / 2
        size = self._size[:, None]
        far = np.abs(errors)
        share = (far / size) ** (half - 1)
        with np.errstate(invalid="ignore", divide="ignore"):
            way = np.where(far > 0, errors / far, 0.0)
        along = (np.conj(way)[:, :, None] * rates).real
        raised = share[:, :, None] * (rates + (half - 1) * way[:, :, None] * along)
        return errors * share, raised

    def _normal(self, state: _Fit) -> tuple[Any, Any]:
        hessian, slope = 0.0, 0.0
        parts = [(state.rates.real, state.errors.real)]
        if np.iscomplexobj(state.errors):
            parts.append((state.rates.imag, state.errors.imag))
        for part, error in (*parts, (state.slopes, state.excess)):
            rows = np.ascontiguousarray(part)
            hessian = hessian + np.matmul(rows.transpose(0, 2, 1), rows)
            slope = slope + np.einsum("bmp,bm->bp", rows, error)
        return hessian, slope

    def _chosen(self, taken: Booleans, one: _Fit, other: _Fit) -> _Fit:
        found = []
        for entry in fields(_Fit):
            a, b = getattr(one, entry.name), getattr(other, entry.name)
            found.append(np.where(taken.reshape([-1] + [1] * (a.ndim - 1)), a, b))
        return _Fit(*found)

    def turned_at(self, places: Complexes) -> SchemeTurn:
        """Return a batch at the angles of the targets, and between them."""
        return turned(self.scheme, places, self.aim.nodes(self.count), derivatives=True)

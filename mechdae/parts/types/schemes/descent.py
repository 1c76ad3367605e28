"""Descent of many sets of dimensions of one scheme at once: Levenberg and Marquardt, batched.

Squares are made small, plus squares of what limits are exceeded by: material, sines of dyads. Of a
closed curve it is the mean distance from the wanted one, smooth near zero (`SOFT`), with weights of
iterated least squares. Derivatives are exact, those of the lengths of bars and of the resampling at
equal arc length too.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import fields
from typing import Any

import numpy as np

from mechdae.parts.types.schemes.aims import Aim
from mechdae.parts.types.schemes.closure import SchemeTurn, material, shortest, turned
from mechdae.parts.types.schemes.losses import LossAsked, loss_slopes, losses
from mechdae.parts.types.schemes.scheme import MIDDLES, Scheme
from mechdae.parts.types.schemes.shape import Resampled, centred, fitted, resampled
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Matrices, Matrix, Points

ROOM = 1.6
"""Sines of dyads are pushed away from so many times the least ones that are allowed."""
PUSH, PRESS = 0.3, 8.0
"""Weights of sines below that, and of material above its limit."""
TIGHT = 0.994
"""Material is pressed below this share of its limit, because a penalty leaves a little above."""
SHORT = 0.05
"""Least length of crank and bars of dyads, in radii of what is wanted."""
FAR = 1e6
"""By how much a loss exceeds its limit at most: it grows beyond bounds where a dyad locks."""
EVERY = 6
"""Iterations after which what is not a dimension is found again."""
BETWEEN = 72
"""Crank angles beside those of the targets at which sines of dyads are kept, on a turn; on less of
it fewer."""
POWERS = (2, 4, 8, 16, 32)
"""Of errors whose largest one counts: the first for `EVERY` iterations, and so on."""
ROUNDING = 1e-12
"""Errors below which their size is no scale."""
ANGLES, POINTS = 120, 100
"""Crank angles and points at equal arc length while dimensions are refined."""
SOFT = 0.01
"""Distance, in radii of the wanted curve, below which squares are counted."""
TURN = 2 * np.pi


class Descent(ABC):
    """A batch of sets of one scheme.

    `places` (b, n) complex: in radii of what is wanted. `limits` (b,): most material of each; inf:
    any. `least` (b,): sine of its dyads that each set keeps at all angles.
    """

    def __init__(self, scheme: Scheme, places: Complexes, limits: Floats, least: Floats) -> None:
        self.scheme = scheme
        self.limits, self.least = np.asarray(limits, float), np.asarray(least, float)
        self.places: Complexes = np.array(places, complex)
        self._rubbing: tuple[Aim, LossAsked, Floats] | None = None
        self.middles: list[int] = [
            k for k, (kind, *_) in enumerate(scheme.points) if kind in MIDDLES
        ]

    def lose(self, aim: Aim, rubbing: LossAsked, limits: Floats) -> None:
        """Keep each set within its limit of loss (b,) [W]; inf: any."""
        if np.isfinite(limits).any():
            self._rubbing = aim, rubbing, np.asarray(limits, float)

    def run(self, iterations: int) -> Complexes:
        """Return the places (b, n) after so many iterations."""
        damping = np.full(len(self.places), 1e-2)
        growth = np.full(len(self.places), 2.0)
        state: Any = None
        for k in range(iterations):
            if k % EVERY == 0 or state is None:
                state = self._begun(state)
            hessian, slope = self._normal(state)
            scale = np.einsum("bpp->bp", hessian)
            scale = scale + 1e-9 * (1e-9 + scale.max(axis=1, keepdims=True))
            lifted = hessian + (damping[:, None] * scale)[:, :, None] * np.eye(scale.shape[1])
            step = -np.linalg.solve(lifted, slope[:, :, None])[:, :, 0]
            other = self._stepped(state, step)
            taken = other.merit < state.merit
            damping = np.where(taken, np.maximum(damping / 3, 1e-9), damping * growth)
            damping = np.minimum(damping, 1e9)
            growth = np.where(taken, 2.0, np.minimum(2 * growth, 64.0))
            state = rows_of(taken, other, state)
            self.places = state.places
        return self._finished(state)

    def _finished(self, state: _State | _Fit) -> Complexes:
        """Return the places that are the answer."""
        return self.places

    @abstractmethod
    def _begun(self, state: object) -> Any:
        """Return the state of `places`, all that is not a dimension found again."""

    @abstractmethod
    def _stepped(self, state: Any, step: Floats) -> Any:
        """Return the state after a step (b, p) of all unknowns."""

    @abstractmethod
    def _normal(self, state: Any) -> tuple[Matrices, Floats]:
        """Return approximate Hessian (b, p, p) and gradient (b, p) of the merit."""

    def _judged(
        self, places: Complexes, turn: SchemeTurn, merit: Floats
    ) -> tuple[Floats, Points, Matrices]:
        """Return merit with limits, by how much they are exceeded, and slopes of that.

        The merit is infinite where a set does not assemble with the sines it has to keep.
        """
        excess, slopes = self._limits(places, turn)
        merit = merit + (excess**2).sum(axis=1)
        lost = ~(turn.least >= self.least) | (shortest(self.scheme, places) < SHORT)
        lost |= ~np.isfinite(merit)
        return np.where(lost, np.inf, merit), excess, slopes

    def _limits(self, places: Complexes, turn: SchemeTurn) -> tuple[Points, Matrices]:
        """Return by how much limits are exceeded (b, k), weighted, and derivatives (b, k, p)."""
        excess, slopes = [], []
        assert turn.slopes is not None
        for k in self.middles:
            at, rates = turn.slopes[k]
            sine = turn.sines[k][np.arange(len(at)), at]
            room = np.minimum(ROOM * self.least, (1 + self.least) / 2)
            short = np.maximum(1 - sine / room, 0.0)
            excess.append(PUSH * short)
            slopes.append(np.where((short > 0)[:, None], -PUSH / room[:, None] * rates, 0.0))
        amount, slope = material(self.scheme, places, slopes=True, turn=turn)
        limits = TIGHT * self.limits
        over = np.maximum(amount / limits - 1, 0.0)
        excess.append(PRESS * over)
        share = np.where(over > 0, PRESS / limits, 0.0)
        slopes.append(share[:, None] * slope)
        if self._rubbing is not None:
            over, slope = self._lost(places)
            excess.append(over)
            slopes.append(slope)
        return np.nan_to_num(np.stack(excess, axis=1)), np.nan_to_num(np.stack(slopes, axis=1))

    def _lost(self, places: Complexes) -> tuple[Floats, Matrix]:
        """Return by how much limits of loss are exceeded, weighted, and derivatives."""
        assert self._rubbing is not None
        aim, rubbing, limits = self._rubbing
        limits = TIGHT * limits
        found = losses(self.scheme, places, aim, rubbing)
        with np.errstate(invalid="ignore"):
            over = np.clip(found / limits - 1, 0.0, FAR)
        slope = loss_slopes(self.scheme, places, aim, rubbing)
        share = np.where(over > 0, PRESS / limits, 0.0)
        return PRESS * over, share[:, None] * slope


def rows_of(taken: Booleans, one: Any, other: Any) -> Any:
    """Return the rows of one state where they are `taken` (b,), else those of another."""
    if isinstance(one, np.ndarray):
        return np.where(taken.reshape([-1] + [1] * (one.ndim - 1)), one, other)
    pairs = ((getattr(one, entry.name), getattr(other, entry.name)) for entry in fields(one))
    return type(one)(*(rows_of(taken, *pair) for pair in pairs))


def moved_by(places: Complexes, step: Floats) -> Complexes:
    """Return places (b, n) after a step (b, 2 n - 2) of all but the first."""
    trial = places.copy()
    trial[:, 1:] += step[:, 0::2] + 1j * step[:, 1::2]
    return trial


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

    places: Complexes
    extra: Floats
    merit: Floats
    errors: Complexes
    rates: Any
    excess: Points
    slopes: Matrices


class Fitting(Descent):
    """A batch of sets of one scheme, towards targets."""

    def __init__(
        self, scheme: Scheme, places: Complexes, aim: Aim, limits: Floats, least: Floats
    ) -> None:
        super().__init__(scheme, places, limits, least)
        self.aim = aim
        self.weights: Floats = np.array(aim.weights, float)
        self.extra: Any = None
        self._size: Any = None
        self._power, self._round = POWERS[0], 0
        share = 1.0 if aim.turns else 0.5
        self.count: int = int(BETWEEN * share)

    @abstractmethod
    def _placed(self) -> None:
        """Find again what is not a dimension: change `places` and `extra`."""

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

    def _raised(self, errors: Complexes, rates: Matrices) -> tuple[Complexes, Matrices]:
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

    def turned_at(self, places: Complexes) -> SchemeTurn:
        """Return a batch at the angles of the targets, and between them."""
        return turned(self.scheme, places, self.aim.nodes(self.count), derivatives=True)


@dataclass
class _State:
    """Where each set of a batch is."""

    places: Complexes
    rates: Any
    curve: Resampled
    gaps: Complexes
    merit: Floats
    excess: Points
    slopes: Floats


class Refinement(Descent):
    """A batch of sets of one scheme, towards a closed curve.

    `places` (b, n) complex: in radii of the wanted curve. `wanted` (`POINTS`,): the wanted curve,
    centred. `limits` (b,): most material of each; inf: any. `least` (b,): sine of its dyads that
    each set keeps at all angles.
    """

    def __init__(
        self, scheme: Scheme, places: Complexes, wanted: Complexes, limits: Floats, least: Floats
    ) -> None:
        super().__init__(scheme, places, limits, least)
        self.wanted = wanted
        self.angles: Floats = TURN * np.arange(ANGLES) / ANGLES
        self._targets: Any = None

    def _begun(self, state: object) -> _State:
        self.places, self._targets = self._aligned(self.places)
        return self._at(self.places, self._targets)

    def _stepped(self, state: _State, step: Floats) -> _State:
        return self._at(moved_by(state.places, step), self._targets)

    def _aligned(self, places: Complexes) -> tuple[Complexes, Complexes]:
        """Return the places turned so that the curves lie on the wanted one, and its points."""
        turn = turned(self.scheme, places, self.angles)
        curve = centred(resampled(_finite(turn.x[self.scheme.trace]), POINTS).points)
        fit = fitted(curve, self.wanted)
        factor = np.where(np.isfinite(fit.factor), fit.factor, 1.0)
        return places * factor[:, None], fit.targets(self.wanted)

    def _at(self, places: Complexes, targets: Complexes) -> _State:
        turn = turned(self.scheme, places, self.angles, derivatives=True)
        curve = resampled(_finite(turn.x[self.scheme.trace]), POINTS)
        gaps = centred(curve.points) - targets
        far = np.sqrt(np.abs(gaps) ** 2 + SOFT**2) - SOFT
        merit, excess, slopes = self._judged(places, turn, far.mean(axis=1))
        return _State(places, turn.derivatives, curve, gaps, merit, excess, slopes)

    def _normal(self, state: _State) -> tuple[Matrices, Floats]:
        rates = state.curve.derivatives(np.nan_to_num(state.rates))
        rates = rates - rates.mean(axis=1, keepdims=True)
        weight = 1 / np.sqrt(np.abs(state.gaps) ** 2 + SOFT**2) / POINTS
        root = np.sqrt(weight)[:, :, None]
        hessian, slope = 0.0, 0.0
        # parts small enough that linear algebra stays on one thread: the same bits everywhere
        for part, gap in ((rates.real, state.gaps.real), (rates.imag, state.gaps.imag)):
            rows = np.ascontiguousarray(root * part)
            hessian = hessian + np.matmul(rows.transpose(0, 2, 1), rows)
            slope = slope + np.einsum("bmp,bm->bp", part, weight * gap)
        slopes = state.slopes
        hessian = hessian + 2 * np.einsum("bkp,bkq->bpq", slopes, slopes)
        slope = slope + 2 * np.einsum("bkp,bk->bp", slopes, state.excess)
        return hessian, slope


def _finite(curves: Complexes) -> Complexes:
    """Return curves without gaps: what does not assemble is lost anyway."""
    return np.nan_to_num(curves)

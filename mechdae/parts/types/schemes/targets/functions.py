"""An output that is a function of the crank's angle: of a link on the frame, or of a block on it.

The scheme's tracing point says which: the link from its pivot to this point turns, or the block
at this point slides. Values begin anywhere, so an offset is always the best one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.parts.types.schemes.aims import ANGLE, Aim
from mechdae.parts.types.schemes.closure import SchemeTurn, turned
from mechdae.parts.types.schemes.descent import ErrorsAt, Fitting
from mechdae.parts.types.schemes.scheme import Scheme, output_points, pivot_of
from mechdae.types import Complexes, Floats, Matrices, Matrix, Points

FINE = 181
"""Crank angles beside the targets at which a set is measured."""


def outputs(scheme: Scheme, turn: SchemeTurn, places: Complexes, aim: Aim, angles: Floats) -> Any:
    """Return the output (b, t) at angles (t,), the first one zero; an angle without jumps."""
    start = np.asarray(places, complex)
    if aim.what != ANGLE:
        k, g = scheme.trace, pivot_of(scheme)
        way = start[:, k] - start[:, g]
        return ((turn.x[k] - turn.x[g]) * np.conj(way / np.abs(way))[:, None]).real
    i, k = output_points(scheme)
    spin = (turn.x[k] - turn.x[i]) / (start[:, k] - start[:, i])[:, None]
    order = np.argsort(angles, kind="stable")
    found = np.empty(spin.shape)
    found[:, order] = np.unwrap(np.angle(np.nan_to_num(spin[:, order], nan=1.0)), axis=1)
    # the first angle is that of the places
    return found - 2 * np.pi * np.round(found[:, :1] / (2 * np.pi))


def _rates(scheme: Scheme, turn: SchemeTurn, places: Complexes, aim: Aim) -> Any:
    """Return the derivatives (b, t, p) of the output."""
    start = np.asarray(places, complex)
    assert turn.every is not None
    size = 2 * (scheme.size - 1)

    def own(k: int) -> Complexes:
        found = np.zeros(size, complex)
        if k:
            found[2 * k - 2], found[2 * k - 1] = 1.0, 1j
        return found

    if aim.what != ANGLE:
        k, g = scheme.trace, pivot_of(scheme)
        way = start[:, k] - start[:, g]
        way = np.conj(way / np.abs(way))[:, None, None]
        return (way * (turn.every[k] - own(g))).real
    i, k = output_points(scheme)
    gap, first = turn.x[k] - turn.x[i], start[:, k] - start[:, i]
    # sets that do not assemble are lost anyway
    with np.errstate(invalid="ignore", divide="ignore"):
        now = ((turn.every[k] - turn.every[i]) / gap[:, :, None]).imag
    before = ((own(k) - own(i))[None, :] / first[:, None]).imag
    return now - before[:, None, :]


class FunctionFitting(Fitting):
    """A batch of sets of one scheme whose output is to be a function of the crank's angle."""

    def __init__(
        self, scheme: Scheme, places: Complexes, aim: Aim, limits: Any, least: Any
    ) -> None:
        super().__init__(scheme, places, aim, limits, least)
        self.target: Floats = np.array(aim.targets, float)
        self.extra: Floats = np.zeros((len(self.places), 1))

    def _placed(self) -> None:
        self.places: Complexes = based(self.scheme, self.places, self.aim)
        angles = np.array(self.aim.angles)
        turn = turned(self.scheme, self.places, angles)
        found = outputs(self.scheme, turn, self.places, self.aim, angles)
        gaps = np.nan_to_num(self.target - found)
        self.extra = (self.weights * gaps).sum(axis=1)[:, None]

    def _errors(self, places: Complexes, extra: Floats) -> ErrorsAt:
        count = len(self.target)
        turn = self.turned_at(places)
        nodes = self.aim.nodes(self.count)
        found = outputs(self.scheme, turn, places, self.aim, nodes)[:, :count]
        rates = _rates(self.scheme, turn, places, self.aim)[:, :count]
        slopes = np.concatenate([rates, np.ones((*rates.shape[:2], 1))], axis=2)
        if self.aim.what == ANGLE:  # the frame is as long as it is
            k = pivot_of(self.scheme)
            slopes[:, :, 2 * k - 2 : 2 * k] = 0.0
        return ErrorsAt(found + extra - self.target, slopes, turn)

    def _limits(self, places: Complexes, turn: SchemeTurn) -> tuple[Points, Matrices]:
        excess, slopes = super()._limits(places, turn)
        if self.aim.what == ANGLE:
            k = pivot_of(self.scheme)
            slopes[:, :, 2 * k - 2 : 2 * k] = 0.0
        return excess, slopes


def based(scheme: Scheme, places: Complexes, aim: Aim) -> Complexes:
    """Return places with the crank's pivot at zero; where only angles count with that of the
    output at one.
    """
    places = places - places[:, :1]
    if aim.what != ANGLE:
        return places
    return places / places[:, pivot_of(scheme)][:, None]


def function_errors(scheme: Scheme, places: Complexes, aim: Aim) -> tuple[Floats, Floats]:
    """Return the measure (b,) of sets, and the offset (b,) that the output has."""
    angles = aim.nodes(FINE)
    turn = turned(scheme, places, angles)
    found = outputs(scheme, turn, places, aim, angles)[:, : len(aim.targets)]
    return measured_gaps(np.array(aim.targets) - found, aim)


def measured_gaps(gaps: Matrix, aim: Aim) -> tuple[Floats, Floats]:
    """Return the measure (b,) of gaps (b, k) up to an offset, and the offset (b,)."""
    if aim.minimax:
        low, high = gaps.min(axis=1), gaps.max(axis=1)
        return (high - low) / 2, (high + low) / 2
    weights = np.array(aim.weights)
    offset = (weights * gaps).sum(axis=1)
    return np.sqrt((weights * (gaps - offset[:, None]) ** 2).sum(axis=1)), offset

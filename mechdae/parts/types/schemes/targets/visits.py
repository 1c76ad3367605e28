"""A tracing point that visits places: at given angles of the crank, in order, or in any order.

The mechanism may lie anywhere, so a translation is always the best one; rotation and size are in
the dimensions. Where angles are free each target has its own as an unknown.

An output that is a function of the crank's angle: of a link on the frame, or of a block on it.

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
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Integers, Matrices, Matrix, Points

GRID = 96
"""Crank angles among which those of targets are looked for."""
BEGINNINGS = 12
"""Of them that are tried for the first target."""
POLISH = 8
"""Steps of Newton for the angles of targets when a set is measured."""
APART = 1e-6
"""Between angles of targets that follow each other, at least [rad]."""
TURN = 2 * np.pi


def assigned(curves: Complexes, aim: Aim) -> tuple[Integers, Floats]:
    """Return at which of the crank angles each target is met best.

    `curves` (b, n): places of the tracing point at equal angles of a turn, where the targets are.

    Returns
    -------
    places
        (b, k) numbers of angles; beyond n or below zero where the turn goes on.
    senses
        (b,) 1 where the targets are visited as the crank turns forward, -1 backward.
    """
    target, weights = np.array(aim.targets), np.array(aim.weights)
    cost = weights[None, :, None] * np.abs(curves[:, None, :] - target[None, :, None]) ** 2
    cost = np.nan_to_num(cost, nan=1e9)
    if not aim.ordered:
        return cost.argmin(axis=2), np.ones(len(curves))
    found = [_in_order(cost), _in_order(np.roll(cost[:, :, ::-1], 1, axis=2))]
    better = found[1][1] < found[0][1]
    places = np.where(better[:, None], -found[1][0], found[0][0])
    return places, np.where(better, -1.0, 1.0)


def _in_order(cost: Matrices) -> tuple[Integers, Floats]:
    """Return the numbers (b, k), growing within a turn, of the least sum of costs (b, k, n)."""
    count, targets, size = cost.shape
    rows = np.arange(count)
    begin = np.argsort(cost[:, 0], axis=1, kind="stable")[:, : min(BEGINNINGS, size)]
    at = (begin[:, :, None] + np.arange(size)) % size  # (b, s, n) from each beginning on
    sums = np.full(at.shape, np.inf)
    sums[:, :, 0] = np.take_along_axis(cost[:, 0], begin, axis=1)
    back = np.zeros((targets, *at.shape), np.int16)
    for k in range(1, targets):
        # the best of all before
        least = np.minimum.accumulate(sums, axis=2)
        new = np.where(sums <= least, np.arange(size), 0)
        where = np.maximum.accumulate(new, axis=2)
        costs = np.take_along_axis(cost[:, None, k], at, axis=2)
        sums = np.full(at.shape, np.inf)
        sums[:, :, 1:] = least[:, :, :-1] + costs[:, :, 1:]
        back[k, :, :, 1:] = where[:, :, :-1]
    flat = sums.reshape(count, -1).argmin(axis=1)
    which, last = flat // size, flat % size
    value = sums.reshape(count, -1)[rows, flat]
    steps = np.empty((count, targets), int)
    for k in range(targets - 1, -1, -1):
        steps[:, k] = last
        last = back[k, rows, which, last]
    return begin[rows, which][:, None] + steps, value


class VisitFitting(Fitting):
    """A batch of sets of one scheme whose point is to visit targets."""

    def __init__(
        self, scheme: Scheme, places: Complexes, aim: Aim, limits: Floats, least: Floats
    ) -> None:
        super().__init__(scheme, places, aim, limits, least)
        self.target: Points = np.array(aim.targets)
        self.free: bool = not aim.angles
        self.senses: Floats = np.ones(len(self.places))
        self.extra: Floats = np.zeros((len(self.places), 2 + self.free * len(self.target)))
        self._known = False

    def _placed(self) -> None:
        shift = self.extra[:, 0] + 1j * self.extra[:, 1]
        self.places = self.places + shift[:, None]
        self.extra = self.extra.copy()
        self.extra[:, :2] = 0.0
        if self.free and not self._known:
            angles = TURN * np.arange(GRID) / GRID
            curves = turned(self.scheme, self.places, angles).x[self.scheme.trace]
            numbers, self.senses = assigned(curves, self.aim)
            self.extra[:, 2:] = TURN * numbers / GRID
            self._known = True

    def _errors(self, places: Complexes, extra: Floats) -> ErrorsAt:
        trace, count = self.scheme.trace, len(self.target)
        size = 2 * (self.scheme.size - 1)
        whole = self.turned_at(places)
        slopes = np.zeros((len(places), count, size + extra.shape[1]), complex)
        if self.free:
            turn = turned(self.scheme, places, extra[:, 2:], derivatives=True, by_angle=True)
            at, rates = turn.x[trace], turn.derivatives
            slopes[:, np.arange(count), size + 2 + np.arange(count)] = rates[:, :, -1]
            slopes[:, :, :size] = rates[:, :, :-1]
        else:
            at, slopes[:, :, :size] = whole.x[trace][:, :count], whole.derivatives[:, :count]
        slopes[:, :, size], slopes[:, :, size + 1] = 1.0, 1j
        shift = (extra[:, 0] + 1j * extra[:, 1])[:, None]
        return ErrorsAt(at + shift - self.target, slopes, whole)

    def _allowed(self, extra: Floats) -> Booleans:
        if not (self.free and self.aim.ordered):
            return super()._allowed(extra)
        return in_order(self.senses[:, None] * extra[:, 2:])

    def _finished(self, state: Any) -> Any:
        shift = state.extra[:, 0] + 1j * state.extra[:, 1]
        return state.places + shift[:, None]


def in_order(angles: Floats) -> Booleans:
    """Return which rows (b,) grow, within a turn."""
    whole = angles[:, -1] - angles[:, 0] < TURN - APART
    return whole & (np.diff(angles, axis=1) > APART).all(axis=1)


@dataclass
class TargetsMet:
    """How sets meet their targets.

    ``angles`` (b, k): of the crank at each target, from the pose of the places. ``factor``,
    ``shift`` (b,) complex: with points times factor plus shift on the targets best. ``error`` (b,):
    the measure: root of the weighted mean square distance, or the largest one.
    """

    angles: Floats
    factor: Complexes
    shift: Complexes
    error: Floats


def visited(scheme: Scheme, places: Complexes, aim: Aim) -> TargetsMet:
    """Return how sets of places (b, n) that lie by the targets meet them."""
    target, weights = np.array(aim.targets), np.array(aim.weights)
    if aim.angles:
        angles = np.broadcast_to(np.array(aim.angles), (len(places), len(target)))
        found = turned(scheme, places, np.array(aim.angles)).x[scheme.trace]
    else:
        angles, found = _met(scheme, places, aim, target)
    mean = (weights * found).sum(axis=1)
    middle = (weights * target).sum()
    product = (weights * (target - middle) * np.conj(found - mean[:, None])).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        factor = product / np.abs(product)
    shift = middle - factor * mean
    error = errors_of(factor[:, None] * found + shift[:, None] - target, aim)
    return TargetsMet(angles, factor, shift, error)


def errors_of(gaps: Complexes, aim: Aim) -> Any:
    """Return the measure (b,) of gaps (b, k)."""
    far = np.abs(gaps)
    if aim.minimax:
        return far.max(axis=1)
    return np.sqrt((np.array(aim.weights) * far**2).sum(axis=1))


def _met(
    scheme: Scheme, places: Complexes, aim: Aim, target: Complexes
) -> tuple[Floats, Complexes]:
    """Return crank angles at which free targets are met best, and the places there (b, k)."""
    grid = TURN * np.arange(4 * GRID) / (4 * GRID)
    numbers, senses = assigned(turned(scheme, places, grid).x[scheme.trace], aim)
    angles = TURN * numbers / (4 * GRID)
    step = TURN / (4 * GRID)
    for _ in range(POLISH):
        turn = turned(scheme, places, angles, derivatives=True, by_angle=True)
        rate = np.nan_to_num(turn.derivatives[:, :, -1])
        gap = np.nan_to_num(turn.x[scheme.trace] - target)
        size = np.maximum(np.abs(rate) ** 2, 1e-300)
        trial = angles - np.clip((np.conj(rate) * gap).real / size, -step, step)
        if aim.ordered:
            remaining = in_order(senses[:, None] * trial)
            trial = np.where(remaining[:, None], trial, angles)
        angles = trial
    return angles, turned(scheme, places, angles).x[scheme.trace]


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

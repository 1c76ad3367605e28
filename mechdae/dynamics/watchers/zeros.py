"""Zeros of functions along accepted steps: all of them, also two within one step.

Coordinates and rates inside a step are the polynomial through both of its ends, the time is exact.
A function over them is fitted on Chebyshev's places, the step divided until the fits converge, and
every zero of a fit and every dip towards zero is looked at by repeating the step with other sizes,
so that what is found is as exact as the integration, and nothing is found that is not there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.dynamics.integrate import Integrator, Nodes
from mechdae.records import dataclass
from mechdae.types import Floats, Integers

if TYPE_CHECKING:
    from mechdae.kernels.graphs.stepper import Layout


DEGREE = 8
RESOLVED = 1e-4
"""Last coefficients of a fit, over the largest, from which it counts as converged."""
CROWD = 8
"""Open parts of steps, over the steps, from which a function counts as rounding."""
DEPTH = 12
"""Times that a step is halved at most."""
PLACES = 33
"""Places of a fit at which its sign is looked at."""
NEAR = 0.02
"""Least value between two of them, over the largest of the fit, from which a dip is looked into."""
FRESH = 1e-9
"""Value at the beginning, over the largest of the step, of what begins at zero."""
LOOKS = 5
"""Places of a dip that are looked at first, by repeating the step."""
FINER = 12
"""Steps to the bottom of a dip after that."""
SURE = 0.5
"""Bottom of the parabola through three values, over the least, from which a dip stays short."""
BACK = 8
"""Widths of a place, each twice the last, by which it is left where its beginning is past zero."""
AHEAD = 40
"""Times that the first time of a step is halved for a place above zero."""

_NODES = (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2
_GRID = np.linspace(0.0, 1.0, PLACES)
_FIT = np.linalg.inv(np.polynomial.chebyshev.chebvander(2 * _NODES - 1, DEGREE))
_VALUES = np.polynomial.chebyshev.chebvander(2 * _GRID - 1, DEGREE) @ _FIT
_SLOPES = (
    2
    * np.polynomial.chebyshev.chebvander(2 * _GRID - 1, DEGREE - 1)
    @ np.polynomial.chebyshev.chebder(np.eye(DEGREE + 1))
    @ _FIT
)


@dataclass(frozen=True)
class Sign:
    """A place of a step at which a function may change its sign.

    ``row`` is the step, ``which`` the function, ``low`` and ``high`` shares of the step, ``before``
    the sign at ``low``; a ``dip`` has the same sign at both.
    """

    row: int
    low: float
    high: float
    which: int
    before: float
    dip: bool


def inside(
    lay: Layout, states: Floats, rows: Integers, shares: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return t, x and v (n, .) inside steps: the quintics through both ends of them."""
    first, last = states[rows], states[np.asarray(rows) + 1]
    s = np.asarray(shares, float)[:, None]
    t, h = lay.of(first, "t")[:, None], (lay.of(last, "t") - lay.of(first, "t"))[:, None]
    x, v, a = (lay.of(first, name) for name in "xva")
    v, a = h * v, h * h * a
    gap = lay.of(last, "x") - x - v - a / 2
    rate = h * lay.of(last, "v") - v - a
    bend = h * h * lay.of(last, "a") - a
    third, fourth = 10 * gap - 4 * rate + bend / 2, -15 * gap + 7 * rate - bend
    fifth = 6 * gap - 3 * rate + bend / 2
    place = x + s * (v + s * (a / 2 + s * (third + s * (fourth + s * fifth))))
    speed = v + s * (a + s * (3 * third + s * (4 * fourth + 5 * s * fifth)))
    return t + s * h, place, speed / np.where(h > 0, h, 1.0)


Values = Callable[[Floats, Floats, Floats], Floats]
"""(t (n, 1), x, v) -> (n, k)."""


def fitted(lay: Layout, nodes: Nodes, values: Values) -> tuple[Integers, Floats, Floats, Floats]:
    """Return the parts of accepted steps over which fits of functions converge.

    Returns
    -------
    rows, lows, highs, samples
        Step and shares of it (n,), values at Chebyshev's places (n, DEGREE + 1, k).
    """
    count = len(nodes.states) - 1
    rows = np.arange(count)
    lows, highs = np.zeros(count), np.ones(count)
    found: list[tuple[Integers, Floats, Floats, Floats]] = []
    for depth in range(DEPTH + 1):
        samples = _sampled(lay, nodes, values, rows, lows, highs)
        terms = np.abs(np.einsum("ij,njk->nik", _FIT, samples))
        top = terms.max(axis=1, initial=0.0)
        good = (terms[:, -2:].max(axis=1) <= RESOLVED * top) | ~np.isfinite(top)
        done = good.all(axis=1) | (depth == DEPTH)
        found.append((rows[done], lows[done], highs[done], samples[done]))
        rows, lows, highs = rows[~done], lows[~done], highs[~done]
        if not len(rows):
            break
        if len(rows) > CROWD * count + PLACES:  # nothing smooth: rounding
            found.append((rows, lows, highs, samples[~done]))
            break
        middle = (lows + highs) / 2
        rows = np.repeat(rows, 2)
        lows, highs = np.column_stack([lows, middle]), np.column_stack([middle, highs])
        lows, highs = lows.ravel(), highs.ravel()
    stacked: list[Any] = [np.concatenate(parts) for parts in zip(*found, strict=True)]
    order = np.lexsort((stacked[1], stacked[0]))
    return tuple(part[order] for part in stacked)


def _sampled(
    lay: Layout, nodes: Nodes, values: Values, rows: Integers, lows: Floats, highs: Floats
) -> Floats:
    """Return values at Chebyshev's places of parts of steps."""
    shares = lows[:, None] + (highs - lows)[:, None] * _NODES
    at = np.repeat(rows, DEGREE + 1)
    samples = values(*inside(lay, nodes.states, at, shares.ravel()))
    return samples.reshape(len(rows), DEGREE + 1, -1)


def changes(lay: Layout, nodes: Nodes, values: Values, falls: bool = False) -> list[Sign]:
    """Return where functions may change their signs in accepted steps, in the order of time.

    With ``falls`` only changes from above zero and dips of what is above; what begins at zero
    begins above it.
    """
    rows, lows, highs, samples = fitted(lay, nodes, values)
    if not len(rows):
        return []
    heights = np.einsum("ij,njk->nik", _VALUES, samples)
    slopes = np.einsum("ij,njk->nik", _SLOPES, samples)
    heights[:, 0], heights[:, -1] = samples[:, 0], samples[:, -1]  # as they are
    top = np.abs(heights).max(axis=1, keepdims=True)
    sides = np.sign(heights)
    fresh = (rows == 0)[:, None] & (lows == 0)[:, None]
    fresh = fresh & (np.abs(heights[:, 0]) <= FRESH * top[:, 0])
    if falls:
        first = sides[:, 0]
        first[fresh] = 1.0
    before, after = sides[:, :-1], sides[:, 1:]
    turned = (before > 0) & (after <= 0) if falls else ((before != 0) & (after != before))
    # a dip: the slope leads towards zero at one place, and away from it at the next
    width = 1 / (PLACES - 1)
    toward, away = slopes[:, :-1] * before, slopes[:, 1:] * after
    dips = (before == after) & (before != 0) & (toward < 0) & (away > 0)
    dips &= np.isfinite(toward) & np.isfinite(away)
    toward, away = np.where(dips, toward, 0.0), np.where(dips, away, 1.0)
    least = np.abs(heights[:, :-1]) - toward * (toward / (away - toward)) * width / 2
    dips &= least < NEAR * top
    dips[:, 0] &= ~fresh
    if falls:
        dips &= before > 0
    found = []
    for mask, dip in ((turned, False), (dips, True)):
        for n, j, k in zip(*np.nonzero(mask), strict=True):
            low, high = (lows[n] + (highs[n] - lows[n]) * _GRID[[j, j + 1]]).tolist()
            side = float(before[n, j, k])
            found.append(Sign(int(rows[n]), low, high, int(k), side, dip))
    return sorted(found, key=lambda sign: (sign.row, sign.low, sign.high))


class Looker:
    """Finds the states at which functions change their signs, by repeating steps.

    `values`: (t (n, 1), x, v) -> (n, k), or some of them only, by `some`.
    """

    def __init__(
        self,
        integrator: Integrator,
        nodes: Nodes,
        values: Values,
        some: Callable[[int], Values] | None = None,
    ) -> None:
        self.integrator, self.nodes, self.values, self.some = integrator, nodes, values, some
        self.lay: Layout = integrator.layout
        self._known: dict[tuple[int, float], Floats] = {}

    def value(self, state: Floats, which: int) -> float:
        t, x, v = (self.lay.of(state, name) for name in ("t", "x", "v"))
        at = (np.reshape(t, (1, 1)), x[None, :], v[None, :])
        if self.some is not None:
            return float(self.some(which)(*at)[0, 0])
        return float(self.values(*at)[0, which])

    def _step(self, row: int) -> tuple[Floats, float]:
        states = self.nodes.states
        return states[row], float(self.lay.of(states[row + 1], "t") - self.lay.of(states[row], "t"))

    def at(self, row: int, share: float) -> Any:
        """Return the state at a share of a step."""
        begin, h = self._step(row)
        if share <= 0:
            return begin
        if share >= 1:
            return self.nodes.states[row + 1]
        if (row, share) not in self._known:
            self._known[row, share] = self.integrator.stepped(begin, share * h, self.nodes.signs)
        return self._known[row, share]

    def states(self, sign: Sign) -> list[tuple[Floats, float]]:
        """Return the states at which a function changes its sign, with the sign before."""
        low, high = sign.low, sign.high
        one, other = (self._own(sign, share) for share in (low, high))
        if sign.before * one > 0 and sign.before * other <= 0:
            return [(self.located(sign, low, high), sign.before)]
        if low == 0 and sign.row == 0 and not sign.dip and sign.before * other <= 0:
            return self._ahead(sign)
        width = high - low
        if not sign.dip and sign.before * other <= 0:  # a fit over a kink is off by some widths
            for k in range(BACK):
                earlier = max(low - width * 2**k, 0.0)
                if sign.before * self._own(sign, earlier) > 0:
                    return [(self.located(sign, earlier, low), sign.before)]
        reach = (max(low - width, 0.0), min(high + width, 1.0))
        if not sign.dip:
            low, high = reach
        least = self._bottom(sign, low, high)
        if least is None:
            return []
        found = []
        if sign.before * self._own(sign, low) > 0:
            found.append((self.located(sign, low, least), sign.before))
        if sign.before * self._own(sign, high) > 0:
            found.append((self.located(sign, least, high), -sign.before))
        return found

    def _own(self, sign: Sign, share: float) -> float:
        return self.value(self.at(sign.row, share), sign.which)

    def located(self, sign: Sign, low: float, high: float) -> Floats:
        """Return the state between two shares of a step at which a function is zero."""
        begin, h = self._step(sign.row)
        one, two = ((share * h, self.at(sign.row, share)) for share in (low, high))
        return self.integrator.met(
            begin, one, two, self.nodes.signs, lambda state: self.value(state, sign.which)
        )

    def _ahead(self, sign: Sign) -> list[tuple[Floats, float]]:
        """Return where what begins at zero comes back to it; at once if it is never above."""
        share = sign.high
        for _ in range(AHEAD):
            share /= 2
            if sign.before * self._own(sign, share) > 0:
                return [(self.located(sign, share, sign.high), sign.before)]
        return [(self.at(sign.row, 0.0), sign.before)]

    def _bottom(self, sign: Sign, low: float, high: float) -> float | None:
        """Return a share of the step at which a dip is past zero, None where it stays short."""
        shares = np.linspace(low, high, LOOKS).tolist()
        heights = [sign.before * self._own(sign, share) for share in shares]
        for _ in range(FINER):
            place = int(np.argmin(heights))
            if heights[place] <= 0:
                return float(shares[place])
            place = min(max(place, 1), len(shares) - 2)
            three, three_heights = shares[place - 1 : place + 2], heights[place - 1 : place + 2]
            share, least = _bottom(three, three_heights)
            if least >= SURE * min(three_heights):
                return None
            at = int(np.searchsorted(shares, share))
            shares.insert(at, share)
            heights.insert(at, sign.before * self._own(sign, share))
        return None


def _bottom(places: list[float], heights: list[float]) -> tuple[float, float]:
    """Return where the parabola through three values is least, inside them, and that value."""
    a, b, c = places
    first, last = (heights[0] - heights[1]) / (a - b), (heights[2] - heights[1]) / (c - b)
    bend = (last - first) / (c - a)
    slope = first + bend * (b - a)  # at the middle one
    if not bend > 0:
        return (a + b) / 2 if heights[0] < heights[2] else (b + c) / 2, -np.inf
    margin = 0.02 * (c - a)
    place = min(max(b - slope / (2 * bend), a + margin), c - margin)
    if abs(place - b) < margin / 4:
        place = b + margin / 2 if c - b > b - a else b - margin / 2
    return place, heights[1] - slope**2 / (4 * bend)

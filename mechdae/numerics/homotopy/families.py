"""Families F(x; p) = 0 with complex p: ways and round trips, ends at infinity, the trace test.

The trace test: whether all points of a curve on a hyperplane are known.

The hyperplanes of a pencil, s = value / scale with two linear forms of the coordinates of a curve,
meet an irreducible curve in points whose coordinates, divided by the second form, add up to a
linear function of s. The sum over a part of the points is none: going round in s leads from known
points to unknown ones, and the sum is not the same again. So three parallel hyperplanes decide
(Sommese, Verschelde & Wampler 2002; Leykin, Rodriguez & Sottile 2018).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from mechdae.numerics.homotopy.tracker import System, track
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats

if TYPE_CHECKING:
    from numpy.random import Generator

CLOSE = 1e-8
"""Last Newton step of an end that is a simple solution, by its size."""
SAME = 1e-6
"""Largest relative difference of keys that are one."""


class Family(Protocol):
    """Square equations that are analytic in unknowns and numbers."""

    def rows(self, x: Complexes, p: Complexes, rate: Any) -> tuple[Any, Any, Any]:
        """Return F (n, k), its Jacobian (n, k, k), and its derivative along a `rate` of p.

        x is (n, k), p and its rate are (n, m) or (1, m).
        """

    def drawn(self, generator: Generator) -> tuple[Any, Any]:
        """Return generic complex numbers (m,) and one solution (k,) of theirs."""

    def numbers(self, generator: Any) -> Any:
        """Return generic complex numbers (m,)."""

    def key(self, x: Complexes) -> Any:
        """Return what tells solutions (n, k) apart, as rows of numbers."""


def way(family: Family, start: Complexes, end: Complexes, bend: Complexes | None = None) -> System:
    """Return the equations along the numbers start + t (end - start) + t (1 - t) bend."""

    def system(x: Complexes, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
        t = t[:, None]
        p, rate = start + t * (end - start), np.broadcast_to(end - start, (len(x), len(start)))
        if bend is not None:
            p, rate = p + t * (1 - t) * bend, rate + (1 - 2 * t) * bend
        return family.rows(x, p, rate)

    return system


def arrived(system: System, x: Complexes) -> Complexes:
    """Return where solutions lead to; rows of `nan` where paths were lost or end in no simple one.

    `system`: at t = 0 with the solutions x (n, k).
    """
    ends = track(system, x, relative=True)
    with np.errstate(all="ignore"):
        good = ends.followed & (ends.step <= CLOSE * (1 + np.abs(ends.x).max(axis=1)))
    return np.where(good[:, None], ends.x, np.nan)


def there(x: Complexes) -> Complexes:
    """Return the rows that are solutions."""
    return x[np.isfinite(x).all(axis=1)]


def united(family: Family, known: Complexes, more: Complexes) -> Complexes:
    """Return known solutions and the new ones among others, each once."""
    every = np.concatenate([known, more])
    remaining = list(range(len(known)))
    keys = family.key(every)
    bounded = keys / (1 + np.abs(keys))
    for row in range(len(known), len(every)):
        gaps = np.abs(bounded[remaining] - bounded[row]).max(axis=1)
        if not remaining or not gaps.min() <= SAME:
            remaining.append(row)
    return every[remaining]


def round_trip(family: Family, p: Complexes, x: Complexes, generator: Generator) -> Complexes:
    """Return what is known (n, k) at numbers p after a way through others and back."""
    middle, bend = family.numbers(generator), family.numbers(generator)
    out = there(arrived(way(family, p, middle), x))
    if not len(out):
        return x
    return united(family, x, there(arrived(way(family, middle, p, bend), out)))


LINEAR = 1e-6
"""Largest second difference of a linear trace, by the largest change of its points."""
TRIES = 4


@dataclass(frozen=True)
class TraceTest:
    """How many points were ``followed`` to both hyperplanes, and how ``bent`` their trace is.

    ``bent`` is the second difference by the sum of the sizes of its points; 1 where paths were
    lost.
    """

    followed: int
    bent: float

    @property
    def linear(self) -> bool:
        """Whether the points are all there are."""
        return self.bent <= LINEAR


def trace_test(
    pencil: Callable[[complex, complex], System],
    x: Complexes,
    coordinates: Callable[[Any], Any],
    generator: Generator,
    step: float = 1.0,
) -> TraceTest:
    """Test whether the points (n, k) of a curve at s = 0 are all.

    `pencil`: (s0, s1) -> equations with hyperplanes from s0 to s1. `coordinates`: of points (n, k):
    general linear forms (n, q) by the second form of the pencil. `step`: size of s.
    """
    best = TraceTest(0, 1.0)
    for _ in range(TRIES):
        s = step * np.exp(2j * np.pi * generator.random())
        sides = [arrived(pencil(0, side), x) for side in (s, -s)]
        good = np.isfinite(np.concatenate(sides, axis=1)).all(axis=1)
        if int(good.sum()) < len(x):
            best = max(best, TraceTest(int(good.sum()), 1.0), key=lambda test: test.followed)
            continue
        values = [coordinates(points) for points in (sides[0], x, sides[1])]
        second = np.abs(values[0].sum(axis=0) - 2 * values[1].sum(axis=0) + values[2].sum(axis=0))
        sizes = sum(np.abs(value - values[1]).sum(axis=0) for value in (values[0], values[2]))
        return TraceTest(len(x), float((second / sizes).max()))
    return best


DECADES = (3, 4, 5, 6)
"""The way is followed to 1 - 10^-k of its length."""
LEAST = 0.04
"""Least power of what is left with which a solution grows that goes to infinity."""
STEADY = 0.25
"""Share by which that power may change from one decade to the next."""
NEAR = 1e-2
"""Change in a decade, by its size, below which a solution stays finite."""


@dataclass(frozen=True)
class FarEnds:
    """Of paths that do not arrive: which go to infinity, which to a finite solution; (n,) each.

    Paths that are neither are lost.
    """

    infinite: Booleans
    finite: Booleans


def far_ends(system: System, x: Complexes) -> FarEnds:
    """Return where paths of solutions (n, k) at t = 0 go that do not arrive at t = 1.

    Two steady powers in a row are evidence, no proof.
    """
    places, good, begun = [], np.ones(len(x), bool), 0.0
    for k in DECADES:
        stop = 1 - 10.0**-k
        ends = track(_part(system, begun, stop), x, relative=True)
        good &= ends.followed
        x, begun = np.where(good[:, None], ends.x, x), stop
        places.append(x)
    with np.errstate(all="ignore"):
        sizes = np.array([np.abs(place).max(axis=1) for place in places])
        powers = np.diff(np.log10(sizes), axis=0)
        steady = np.abs(powers[2] - powers[1]) <= STEADY * powers[2]
        change = np.abs(places[3] - places[2]).max(axis=1) / (1 + sizes[3])
    infinite = good & (powers[1:] >= LEAST).all(axis=0) & steady
    return FarEnds(infinite, good & ~infinite & (change < NEAR))


def _part(system: System, start: float, end: float) -> System:
    """Return a part of a way, from t = 0 to 1."""

    def part(x: Complexes, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
        F, J, rate = system(x, start + t * (end - start))
        return F, J, rate * (end - start)

    return part

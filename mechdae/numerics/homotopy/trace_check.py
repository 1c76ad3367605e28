"""The trace test: whether all points of a curve on a hyperplane are known.

The hyperplanes of a pencil, s = value / scale with two linear forms of the coordinates of a curve,
meet an irreducible curve in points whose coordinates, divided by the second form, add up to a
linear function of s. The sum over a part of the points is none: going round in s leads from known
points to unknown ones, and the sum is not the same again. So three parallel hyperplanes decide
(Sommese, Verschelde & Wampler 2002; Leykin, Rodriguez & Sottile 2018).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.numerics.homotopy.families import arrived
from mechdae.numerics.homotopy.tracker import System
from mechdae.records import dataclass
from mechdae.types import Complexes

if TYPE_CHECKING:
    from numpy.random import Generator


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

"""Modes in space whose count follows from boxes: all places of a group are looked at.

All equations count, redundant ones included: what meets them is near a mode, or excluded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

from flint import arb, arb_mat

from .arithmetic import ZERO, Json, need
from .space import SpatialMechanism, dot

MOST_BOXES = 200_000
MET = 1e-9
"""How far equations may be off, of the size, that count as met."""
NEAR = 1e-6
"""What meets the equations is so near a mode."""
WIDER = 1.25
"""How much wider than a box another one is that a mode may lie in."""
ALONE = 0.9
"""Bound of |1 - Y J| below which there is one solution in a box."""
SHRUNK = 0.7
"""A box that shrinks by less is halved."""

Box = tuple[int, list[float], list[float]]
"""Chart, middle and half widths."""


def length(values: Iterable[arb]) -> arb:
    """Return an upper bound of the length of a vector."""
    return sum((v * v for v in values), ZERO).sqrt().abs_upper()


def identity(n: int) -> arb_mat:
    return arb_mat(n, n) + 1


class Boxes(ABC):
    """All places of `n` unknowns x of a group, looked at box by box.

    A kind of group has its unknowns in charts: `first` are boxes of all, `at` the equations F and
    their derivatives J in the middle of one, `rests` how much each of combinations W F may differ
    from its tangent in a box, by terms of degree 2 to `order`.
    """

    n: int
    weights: list[float]
    """Of each unknown: the widest by them is halved."""
    order = 2
    met = MET

    def __init__(
        self, m: SpatialMechanism, group: list[str], joints: list[Json], known: set[str], z: Any
    ) -> None:
        self.m, self.group = m, group

    @abstractmethod
    def first(self) -> list[Box]:
        """Return boxes that hold all places."""

    @abstractmethod
    def at(self, chart: int, middle: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        """Return F and its derivatives by each unknown."""

    @abstractmethod
    def rests(self, W: arb_mat, middle: list[float], h: list[arb]) -> list[arb]:
        """Return how much combinations W F differ from their tangents at most."""

    @abstractmethod
    def mode(self, z: list[arb]) -> list[arb]:
        """Return the place of a mode in balls."""

    @abstractmethod
    def inside(self, mode: list[arb], box: Box) -> bool:
        """Whether a mode is in a box that is `WIDER`."""

    def look(self, boxes: list[Box], modes: list[list[arb]]) -> int:
        """Return in how many boxes there is nothing but the modes."""
        count = 0
        while boxes:
            (chart, middle, half), count = boxes.pop(), count + 1
            left = self.shrunk((chart, middle, half), modes)
            if left is None:
                continue
            if min(a / b for a, b in zip(left[2], half, strict=True)) <= SHRUNK:
                boxes.append(left)
                continue
            chart, middle, half = left
            k = max(range(self.n), key=lambda i: half[i] * self.weights[i])
            open_ = count > MOST_BOXES or half[k] < NEAR / 10
            need(not open_, "modes", f"{self.group} may be near {middle}: {count} boxes")
            halved = [r * (0.5 + 1e-9 if i == k else 1) for i, r in enumerate(half)]
            for step in (half[k] / 2, -half[k] / 2):
                moved = [v + step * (i == k) for i, v in enumerate(middle)]
                boxes.append((chart, moved, halved))
        return count

    def shrunk(self, box: Box, modes: list[list[arb]]) -> Box | None:
        """Return a box of all that is left in a box, None where that is nothing or a mode."""
        chart, middle, half = box
        n, h, (F, J) = self.n, [arb(v) for v in half], self.at(chart, middle)
        W = self._combinations(arb_mat(J).mid())
        values, slopes = (W * arb_mat(len(F), 1, F)).entries(), W * arb_mat(J).transpose()
        rows = zip(W.tolist(), values, slopes.tolist(), self.rests(W, middle, h), strict=True)
        alone, ends = True, list[tuple[float, float]]()
        for i, (w, value, slope, rest) in enumerate(rows):
            off = sum(map(abs, w), ZERO) * self.met
            if abs(value) > dot(map(abs, slope), h) + rest + off:
                return None
            if i < n:  # of the rows of Y
                slope[i] -= 1
                loss, moved = dot(map(abs, slope), h), rest * self.order * WIDER ** (self.order - 1)
                near = off * max(half) < h[i] * (1 - ALONE) * NEAR / 2
                alone = alone and bool(loss + moved < h[i] * ALONE and near)
                reach = arb(0, (loss + rest + off).upper()) - value
                low, high = float(reach.lower()) - 1e-12, float(reach.upper()) + 1e-12
                ends.append((max(-half[i], low), min(half[i], high)))
        if alone and any(self.inside(mode, box) for mode in modes):
            return None
        return (
            chart,
            [c + (a + b) / 2 for c, (a, b) in zip(middle, ends, strict=True)],
            [(b - a) / 2 * (1 + 1e-9) + 1e-14 for a, b in ends],
        )

    def _combinations(self, T: arb_mat) -> arb_mat:
        """Return rows W: of Y near the inverse of J, of all equations, of 1 - J Y."""
        Y = (T * T.transpose() + identity(self.n) * arb(1e-9)).inv() * T
        every = identity(T.ncols())
        blocks = (Y, every, every - T.transpose() * Y)
        return arb_mat([row for block in blocks for row in block.mid().tolist()])

"""Solutions of blocks that are no two turning links: linear ones, lengths, slides, high degrees."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.kernels.run.high_precision import PI, NoDecimals
from mechdae.motion.assembly.closure import Gap
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Graph, Points, Unknowns

NEAR_FOLD = 1e-9
"""Distance of a cosine from 1, or of a discriminant from 0, that is looked at in 50 digits."""
DOUBLE = Decimal("1e-40")
"""Discriminant that is zero in 50 digits."""
ROLLS = 1e-11
"""Share of an equation by which it may miss a straight line: rounding of what cancels."""


@dataclass(frozen=True)
class Solutions:
    """Solutions of a block: ``x`` (k, n); ``proven`` when there are no others.

    ``gap`` is the smallest residual over all angles when nothing solves the block (in the
    residual's unit); ``infinite`` tells that a ratio is not rational, ``free`` that every
    angle solves it; ``gap_at`` names unit and joint of the gap of a redundant block.
    """

    x: Unknowns
    proven: bool
    gap: float = 0.0
    infinite: bool = False
    free: bool = False
    gap_at: Gap | None = None


def zero(a: Floats) -> Decimal | float:
    """Return 0 in the digits of an array."""
    return Decimal(0) if a.dtype == object else 0.0


class OtherForms:
    """The part of a block's solver for other forms than two links; the rest is that of the heir."""

    graph: BlockGraph
    n: int
    size: float
    p: Floats
    angle: list[bool]
    turns: list[tuple[int, int] | None]
    F: Callable[..., Any]
    period: Callable[[int], float]
    _F: Graph
    _exact: bool
    _scale: float
    _roots: Callable[..., Solutions]

    def rolls(self) -> bool:
        """Return whether a single angle enters linearly: a wheel on a rack.

        With the wheel's place told by another point than its centre, sines and cosines cancel.
        """
        rng, a = np.random.default_rng(1), np.array([0.0, 1.0, 2.3, -4.1, 7.7])
        z = self.size * rng.uniform(-1, 1, len(self.graph.uses))
        value = self.F(a[:, None], z, rng.uniform(-1, 1, self._F.size1_in(2)))[:, 0]
        slope = value[1] - value[0]
        miss = np.abs(value - value[0] - slope * a).max()
        return bool(miss <= ROLLS * np.abs(value).max() and abs(slope) > 1e3 * miss)

    def unwinds_turns(self) -> bool:
        """Return whether whole turns, which move no body, change the equations."""
        turned = [j for j in range(self.n) if self.angle[j] and self.turns[j]]
        if not turned:
            return False
        rng = np.random.default_rng(1)
        x = rng.uniform(-1, 1, self.n) * np.where(self.angle, 3.0, self.size)
        x = x + np.zeros((len(turned) + 1, 1))
        for k, j in enumerate(turned):
            x[k + 1, j] += self.period(j)
        z = self.size * rng.uniform(-1, 1, len(self.graph.uses))
        value = self.F(x, z, rng.uniform(-1, 1, self._F.size1_in(2)))
        return bool(np.abs(value[1:] - value[0]).max() > ROLLS * np.abs(value).max())

    def _linear(self, z: Unknowns, u: Floats) -> Solutions:
        points = np.vstack([np.zeros(self.n), np.eye(self.n)])
        values = self.F(points, z, u)
        J = (values[1:] - values[0]).T
        if np.linalg.matrix_rank(J) < self.n:
            return Solutions(np.zeros((0, self.n)), False)
        return Solutions(np.linalg.solve(J, -values[0])[None, :], True)

    def _lengths(self, z: Unknowns, u: Floats) -> Solutions | None:
        """Solve for unknown lengths: all equations but one linear, that one quadratic."""
        J, x = self.graph.shape.J, self.graph.shape.x
        bent = [i for i in range(self.n) if ca.jacobian(J[i, :].T, x).nnz()]
        if len(bent) != 1:
            return None
        start, along = np.zeros(self.n), np.ones(1)
        if self.n > 1:
            points = np.vstack([np.zeros(self.n), np.eye(self.n)])
            values = np.delete(self.F(points, z, u), bent[0], axis=1)
            slope = (values[1:] - values[0]).T
            start = np.linalg.lstsq(slope, -values[0])[0]
            along = np.linalg.svd(slope)[2][-1]
        size = self.size
        places = start + size * np.array([-1.0, 0.0, 1.0, 2.0])[:, None] * along
        f = self.F(places, z, u)[:, bent[0]]
        a, b, c = (f[0] + f[2]) / 2 - f[1], (f[2] - f[0]) / 2, f[1]
        if abs(4 * a + 2 * b + c - f[3]) > 1e-9 * (abs(a) + abs(b) + abs(c)):
            return None
        root, big = b * b - 4 * a * c, b * b + abs(4 * a * c)
        if a == 0 or root < -1e-14 * big:
            gap = abs(c - b * b / (4 * a)) if a else abs(c)
            return Solutions(np.zeros((0, self.n)), True, float(gap))
        # the larger root first, the other by Vieta's rule
        q = -(b + math.copysign(math.sqrt(max(root, 0.0)), b)) / 2
        t = sorted({q / a, c / q if q else -q / a})
        return Solutions(start + size * np.array(t)[:, None] * along, root > NEAR_FOLD * big)

    def _turning(self, alpha: int, beta: int, z: Unknowns, u: Floats) -> Solutions | None:
        """Eliminate unknown `beta` that turns a vector whose length depends on `alpha`.

        F = k + R(+-beta) w(alpha) has roots where |w| = |k|: an inclined cylinder of given
        length, seen in the frame of the cylinder.
        """
        if not (self.angle[alpha] and self.angle[beta]) or self.turns[beta] != (1, 1):
            return None

        def at(a: Floats, b: Any) -> Any:
            x = np.empty((len(a), 2), a.dtype)
            x[:, alpha], x[:, beta] = a, b
            return self.F(x, z, u)

        probes = np.array([0.0, 0.7, 2.0, 4.1])
        middle = (at(probes, 0.0) + at(probes, np.pi)) / 2
        k = middle[0]
        w, quarter = at(probes, 0.0) - k, at(probes, np.pi / 2) - k
        turn = np.stack([-w[:, 1], w[:, 0]], axis=1)
        size = float(np.abs(w).max() + np.abs(k).max())
        self._scale = size
        senses = [s for s in (1.0, -1.0) if np.abs(quarter - s * turn).max() <= 1e-12 * size]
        if np.abs(middle - k).max() > 1e-12 * size or not senses:
            return None

        def close(a: Floats) -> Any:
            middle = k if a.dtype == float else ((at(a, zero(a)) + at(a, PI)) / 2)[0]
            return np.sum((at(a, zero(a)) - middle) ** 2, axis=1) - middle @ middle

        def complete(a: Floats) -> Points:
            here = at(a, 0.0) - k
            b = np.arctan2(-k[1], -k[0]) - np.arctan2(here[:, 1], here[:, 0])
            x = np.empty((len(a), 2))
            x[:, alpha], x[:, beta] = a, senses[0] * b
            return x

        return self._roots(close, alpha, complete, doubled=2)

    def _slide(self, alpha: int, beta: int, z: Unknowns, u: Floats) -> Solutions | None:
        """Eliminate an unknown that enters linearly with a coefficient that turns."""

        def parts(a: Floats) -> tuple[Floats, Floats]:
            x = np.zeros((len(a), 2), a.dtype)
            x[:, alpha], x[:, beta] = a, 0 * a
            fixed = self.F(x, z, u)
            x[:, beta] = 0 * a + 1
            return fixed, self.F(x, z, u) - fixed

        def cross(a: Floats) -> Floats:
            fixed, slope = parts(a)
            return fixed[:, 0] * slope[:, 1] - fixed[:, 1] * slope[:, 0]

        def complete(a: Floats) -> Floats:
            fixed, slope = parts(a)
            x = np.zeros((len(a), 2))
            x[:, alpha] = a
            x[:, beta] = -np.sum(fixed * slope, axis=1) / np.sum(slope * slope, axis=1)
            return x

        return self._roots(cross, alpha, complete, doubled=2)

    def _higher(
        self,
        c: Complexes,
        g: Callable[[Floats], Floats],
        alpha: int,
        complete: Callable[[Floats], Floats],
        values: Floats,
    ) -> Solutions:
        """Return the solutions at the roots of a polynomial of a degree above one."""
        turns = self.turns[alpha]
        assert turns is not None
        w = np.roots(c[::-1])
        off = np.abs(np.abs(w) - 1)
        near = w[off < 1e-4]
        roots = np.sort(np.angle(near) * turns[0])
        x, sure = self._distinct(complete(roots), g, alpha)
        doubtful = np.sum(off < 1e-4) != len(x)
        gap = float(np.abs(values).min()) if not len(x) else 0.0
        return Solutions(x, bool(sure and not doubtful), gap)

    def _near_fold(self, g: Any, m: int, middle: float, half: float) -> tuple[float, float, bool]:
        """Return the middle of two roots, half their distance, 0 or pi for one, and whether sure.

        g is c0 + A cos(alpha/m) + B sin(alpha/m); near a limit position its discriminant is less
        than the rounding of doubles, and 50 digits tell whether there are two roots.
        """
        if not self._exact:
            return middle, half, False
        turn = PI * m
        try:
            first, opposite, quarter = g(np.array([0 * turn, turn, turn / 2], object))
        except NoDecimals:
            return middle, half, False
        least = (first + opposite) / 2
        A, B = first - least, quarter - least
        left = A * A + B * B - least * least
        if abs(left) <= DOUBLE * (A * A + B * B):  # one root, at a limit position
            return math.atan2(B, A), math.pi if least > 0 else 0.0, True
        if left < 0:  # none for these very numbers, one for others as near as rounding
            return middle, math.pi if least > 0 else 0.0, False
        return math.atan2(B, A), math.atan2(left.sqrt(), -least), True

    def _distinct(self, x: Unknowns, g: Any, alpha: int) -> tuple[Floats, bool]:
        """Polish roots by the secant method and drop those that are not real roots."""
        distinct: list[Floats] = []
        sure = True
        for row in x:
            a = row[alpha]
            step = 1e-6
            slope = float(g(np.array([a + step]))[0] - g(np.array([a - step]))[0]) / (2 * step)
            value = float(g(np.array([a]))[0])
            for _ in range(20):
                if slope == 0 or not math.isfinite(value):
                    break
                change = value / slope
                a -= change
                value = float(g(np.array([a]))[0])
                if abs(change) < 1e-15 * (1 + abs(a)):
                    break
            if slope == 0 or abs(value / slope) > 1e-9 or abs(a - row[alpha]) > 1e-2:
                sure = False
                continue
            new = row.copy()
            new[alpha] = a
            period = self.period(alpha)
            if any(abs(math.remainder(a - other[alpha], period)) < 1e-8 for other in distinct):
                sure = False
                continue
            distinct.append(new)
        return np.array(distinct).reshape(-1, self.n), sure

"""All solutions of one numerical block, by eliminating all but one unknown.

A block of an Assur dyad is a trigonometric polynomial in one angle once the other unknown
is eliminated: a second link's angle enters as the turning of a vector of constant length,
a slide enters linearly. The polynomial g(alpha) = sum c_k exp(i k alpha / m) is sampled,
its coefficients follow from a discrete Fourier transform and its real roots from a
polynomial in exp(i alpha / m); m > 1 where gears let bodies turn by fractions.
"""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.equations.reduction import Scene
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.kernels.run.batch import Batch
from mechdae.kernels.run.call import Call
from mechdae.kernels.run.high_precision import PI, NoDecimals, decimals
from mechdae.motion.assembly.closure import Gap
from mechdae.records import dataclass
from mechdae.types import Floats, Graph, Points, Unknowns

MAX_DENOMINATOR = 1000
MAX_DEGREE = 4000
ROLLS = 1e-11
"""Share of an equation by which it may miss a straight line: rounding of what cancels."""


NEAR_FOLD = 1e-9
"""Distance of a cosine from 1, or of a discriminant from 0, that is looked at in 50 digits."""
DOUBLE = Decimal("1e-40")
"""Discriminant that is zero in 50 digits."""


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


def angle_slopes(scene: Scene, p: Floats) -> dict[int, list[float]]:
    """Return by unknown how fast the bodies' angles turn with it, zeros left out."""

    def make() -> tuple[list[int], Call]:
        angles = [scene.recover[c.key] for c in scene.recovered if c.kind is ANGLE]
        jacobian = ca.jacobian(ca.vertcat(*angles), scene.x)
        entries = ca.densify(ca.SX(ca.vertcat(ca.SX(0, 1), *jacobian.nonzeros())))
        function = ca.Function("k", [scene.model.p], [entries])
        return jacobian.sparsity().get_col(), Call(function)

    columns, values = scene.cache("slopes", make)
    slopes: dict[int, list[float]] = {}
    for i, value in zip(columns, values(p)[0].tolist(), strict=True):
        slopes.setdefault(i, []).append(value)
    return slopes


def rational(value: float) -> Fraction | None:
    """Return the ratio of small whole numbers that a value is, None where it is none."""
    exact = Fraction(value).limit_denominator(MAX_DENOMINATOR)
    return exact if abs(float(exact) - value) <= 4e-15 * max(1.0, abs(value)) else None


def _turns(slopes: list[float]) -> tuple[int, int] | None:
    """Return m and the highest multiple of alpha/m with which bodies turn; None: infinite."""
    ratios = {Fraction(1)}
    for value in {value for value in slopes if abs(value) != 1.0}:
        exact = rational(value)
        if exact is None:
            return None
        ratios.add(exact)
    m = math.lcm(*[ratio.denominator for ratio in ratios])
    highest = max(abs(int(ratio * m)) for ratio in ratios)
    return (m, highest) if m * highest <= MAX_DEGREE else None


def _zero(a: Any) -> Any:
    """Return 0 in the digits of an array."""
    return Decimal(0) if a.dtype == object else 0.0


def _half_turn(a: Floats) -> Any:
    """Return pi in the digits of an array."""
    return PI if a.dtype == object else np.pi


def _equations(graph: BlockGraph) -> tuple[list[list[bool]], Graph, Batch]:
    """Return which columns of J hold which unknowns not, and F for one pose and for many."""
    J, x = graph.shape.J, graph.shape.x
    bent = [ca.jacobian(J[:, j], x).sparsity() for j in range(graph.size)]
    constant = [[i not in own.get_col() for i in range(graph.size)] for own in bent]
    return constant, graph.function, Batch(graph.function, [1, 2, 3], straight=lambda: None)


class BlockSolver:
    """Finds all solutions of one block for given earlier unknowns and driver values.

    `size` is a length of the mechanism [m], `slopes` what `angle_slopes` returns.
    """

    def __init__(
        self,
        scene: Scene,
        graph: BlockGraph,
        p: Floats,
        size: float,
        slopes: dict[int, list[float]],
    ) -> None:
        self.graph, self.p, self.n, self.size = graph, p[graph.params], graph.size, size
        self.values, self.scene = p, scene
        self.angle = [scene.unknowns[i].kind is ANGLE for i in graph.own]
        self.constant, self._F, self._batch = graph.cache("eliminate", lambda: _equations(graph))
        self.linear = all(all(row) for row in self.constant)
        self.turns = [_turns(slopes.get(i, [])) for i in graph.own]
        self._scale, self._exact = 0.0, False
        self.linear = self.linear or self._rolls()
        self.unwinds = not self.linear and self._unwinds()
        """Whether turns of the angles change the equations: wheels on racks among trigonometry."""

    def period(self, j: int) -> float:
        """Return the period of unknown `j` [rad]; 0 for a length, or where there is none."""
        turns = self.turns[j]
        return 2 * np.pi * turns[0] if self.angle[j] and turns else 0.0

    @property
    def turning(self) -> list[float]:
        """The periods of the unknowns by which the equations come back; 0 for lengths."""
        if self.linear or self.unwinds:
            return [0.0] * self.n
        return [self.period(j) if angle else 0.0 for j, angle in enumerate(self.angle)]

    def with_tangents(self, x: Unknowns) -> Floats:
        """Return unknowns (k, n) as they are: no curve is in the block."""
        return x

    def _rolls(self) -> bool:
        """Return whether a single angle enters linearly: a wheel on a rack.

        With the wheel's place told by another point than its centre, sines and cosines cancel.
        """
        if self.n != 1 or not self.angle[0] or self.graph.redundant:
            return False
        rng, a = np.random.default_rng(1), np.array([0.0, 1.0, 2.3, -4.1, 7.7])
        z = self.size * rng.uniform(-1, 1, len(self.graph.uses))
        value = self.F(a[:, None], z, rng.uniform(-1, 1, self._F.size1_in(2)))[:, 0]
        slope = value[1] - value[0]
        miss = np.abs(value - value[0] - slope * a).max()
        return bool(miss <= ROLLS * np.abs(value).max() and abs(slope) > 1e3 * miss)

    def _unwinds(self) -> bool:
        """Return whether whole turns, which move no body, change the equations."""
        turned = [j for j in range(self.n) if self.angle[j] and self.turns[j]]
        if not turned or self.graph.redundant or self.graph.shape.turns_alone:
            return False
        rng = np.random.default_rng(1)
        x = rng.uniform(-1, 1, self.n) * np.where(self.angle, 3.0, self.size)
        x = x + np.zeros((len(turned) + 1, 1))
        for k, j in enumerate(turned):
            x[k + 1, j] += self.period(j)
        z = self.size * rng.uniform(-1, 1, len(self.graph.uses))
        value = self.F(x, z, rng.uniform(-1, 1, self._F.size1_in(2)))
        return bool(np.abs(value[1:] - value[0]).max() > ROLLS * np.abs(value).max())

    def F(self, x: Unknowns, z: Unknowns, u: Floats) -> Any:
        """Return residuals (k, n) at points `x` (k, n), in 50 digits where these are decimals."""
        if np.asarray(x).dtype == object:
            return np.array([decimals(self._F, [list(row), z, u, self.p]) for row in x], object)
        return self._batch(x, z, u, self.p)[0]

    def solve(self, z: Unknowns, u: Floats) -> Solutions | None:
        """Return all solutions, None where the block has no closed form."""
        if any(turns is None for turns, angle in zip(self.turns, self.angle, strict=True) if angle):
            return Solutions(np.zeros((0, self.n)), False, infinite=True)
        if self.linear:
            return self._linear(z, u)
        if self.unwinds:
            return None
        if not any(self.angle):
            return self._lengths(z, u)
        self._exact = not len(z)  # the unknowns of other blocks are known but for rounding
        if self.n == 1:  # doubled: a distance multiplies the directions of two bodies

            def residual(a: Floats) -> Any:
                return self.F(a[:, None], z, u)[:, 0]

            return self._roots(residual, 0, lambda a: a[:, None], doubled=2)
        if self.n == 2:
            for eliminate in (self._pair, self._turning):
                for beta in (1, 0):
                    found = eliminate(1 - beta, beta, z, u)
                    if found is not None:
                        return found
        return None

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

    def _pair(self, alpha: int, beta: int, z: Unknowns, u: Floats) -> Solutions | None:
        """Eliminate unknown `beta` of two; None where it does not separate."""
        if not self.angle[alpha]:
            return None
        if self.constant[beta][beta]:
            return self._slide(alpha, beta, z, u)
        if not self.constant[beta][alpha] or self.turns[beta] != (1, 1):
            return None

        def at(a: Floats, b: Any) -> Any:
            x = np.empty((len(a), 2), a.dtype)
            x[:, alpha], x[:, beta] = a, b
            return self.F(x, z, u)

        ahead, back, left, right = at(np.zeros(4), np.array([0.0, np.pi, np.pi / 2, -np.pi / 2]))
        arm, quarter = (ahead - back) / 2, (left - right) / 2
        turn = np.array([-arm[1], arm[0]])
        size = float(np.hypot(*arm))
        self._scale = size
        if min(np.abs(quarter - turn).max(), np.abs(quarter + turn).max()) > 1e-12 * size:
            return None
        sense = 1.0 if np.abs(quarter - turn).max() <= np.abs(quarter + turn).max() else -1.0

        def rest(a: Floats) -> Any:
            ends = [np.full_like(a, end) for end in (_zero(a), _half_turn(a))]
            both = at(np.append(a, a), np.concatenate(ends))
            return (both[: len(a)] + both[len(a) :]) / 2

        def close(a: Any) -> Any:
            far = size**2
            if a.dtype == object:
                far = np.sum((at(a[:1], _zero(a)) - at(a[:1], PI)) ** 2) / 4
            return np.sum(rest(a) ** 2, axis=1) - far

        def complete(a: Floats) -> Points:
            G = rest(a)
            b = np.arctan2(-G[:, 1], -G[:, 0]) - np.arctan2(arm[1], arm[0])
            x = np.empty((len(a), 2))
            x[:, alpha], x[:, beta] = a, sense * b
            return x

        found = self._roots(close, alpha, complete, doubled=2)
        if not len(found.x) and not found.free:
            angles = np.linspace(0, self.period(alpha), 721)
            reach = np.hypot(*rest(angles).T)
            return Solutions(found.x, found.proven, float(np.abs(reach - size).min()))
        return found

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

        def close(a: Any) -> Any:
            middle = k if a.dtype == float else ((at(a, _zero(a)) + at(a, PI)) / 2)[0]
            return np.sum((at(a, _zero(a)) - middle) ** 2, axis=1) - middle @ middle

        def complete(a: Floats) -> Points:
            here = at(a, 0.0) - k
            b = np.arctan2(-k[1], -k[0]) - np.arctan2(here[:, 1], here[:, 0])
            x = np.empty((len(a), 2))
            x[:, alpha], x[:, beta] = a, senses[0] * b
            return x

        return self._roots(close, alpha, complete, doubled=2)

    def _slide(self, alpha: int, beta: int, z: Unknowns, u: Floats) -> Solutions | None:
        """Eliminate an unknown that enters linearly with a coefficient that turns."""

        def parts(a: Floats) -> tuple[Any, Any]:
            x = np.zeros((len(a), 2), a.dtype)
            x[:, alpha], x[:, beta] = a, 0 * a
            fixed = self.F(x, z, u)
            x[:, beta] = 0 * a + 1
            return fixed, self.F(x, z, u) - fixed

        def cross(a: Floats) -> Any:
            fixed, slope = parts(a)
            return fixed[:, 0] * slope[:, 1] - fixed[:, 1] * slope[:, 0]

        def complete(a: Floats) -> Any:
            fixed, slope = parts(a)
            x = np.zeros((len(a), 2))
            x[:, alpha] = a
            x[:, beta] = -np.sum(fixed * slope, axis=1) / np.sum(slope * slope, axis=1)
            return x

        return self._roots(cross, alpha, complete, doubled=2)

    def _roots(self, g: Any, alpha: int, complete: Any, doubled: int = 1) -> Solutions:
        turns = self.turns[alpha]
        assert turns is not None
        m, highest = turns
        degree = doubled * highest
        count = 4 * degree + 4
        angles = 2 * np.pi * m * np.arange(count) / count
        values = g(angles)
        size = float(np.abs(values).max())
        spectrum = np.fft.fft(values) / count
        c = np.concatenate([spectrum[-degree:], spectrum[: degree + 1]])  # k = -degree..degree
        noise = 64 * np.finfo(float).eps * size
        while degree > 0 and abs(c[0]) <= noise and abs(c[-1]) <= noise:
            c, degree = c[1:-1], degree - 1
        empty = np.zeros((0, self.n))
        if size <= self._noise(alpha):
            return Solutions(empty, False, free=True)
        if degree == 0:
            return Solutions(empty, True, float(np.abs(values).min()))
        if degree == 1:
            ratio = -c[1].real / (2 * abs(c[2]))
            if abs(ratio) > 1 + 8 * np.finfo(float).eps:
                return Solutions(empty, True, float(2 * abs(c[2]) * (abs(ratio) - 1)))
            half = math.acos(min(1.0, max(-1.0, ratio)))
            middle, sure = -float(np.angle(c[2])), True
            if 1 - abs(ratio) < NEAR_FOLD:
                middle, half, sure = self._near_fold(g, m, middle, half)
            both = [middle - half, middle + half] if 0 < half < math.pi else [middle + half]
            return Solutions(complete(np.array(both) * m), sure)
        w = np.roots(c[::-1])
        off = np.abs(np.abs(w) - 1)
        near = w[off < 1e-4]
        roots = np.sort(np.angle(near) * m)
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

    def _noise(self, alpha: int) -> float:
        """Return the size below which g is zero for all angles: rounding of its terms."""
        return self._scale**2 * 256 * np.finfo(float).eps if self.n == 2 else 0.0

    def _distinct(self, x: Unknowns, g: Any, alpha: int) -> tuple[Floats, bool]:
        """Polish roots by the secant method and drop those that are not real roots."""
        kept: list[Floats] = []
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
            if any(abs(math.remainder(a - other[alpha], period)) < 1e-8 for other in kept):
                sure = False
                continue
            kept.append(new)
        return np.array(kept).reshape(-1, self.n), sure

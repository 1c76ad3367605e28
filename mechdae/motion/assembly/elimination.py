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
from mechdae.kernels.run.functions import Batch, Call
from mechdae.kernels.run.high_precision import PI, decimals
from mechdae.motion.assembly.other_forms import (
    NEAR_FOLD,
    OtherForms,
    Solutions,
)
from mechdae.types import Floats, Graph, Points, Unknowns

MAX_DENOMINATOR = 1000
MAX_DEGREE = 4000


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


def _half_turn(a: Floats) -> tuple[Any, Any]:
    """Return the ends of a half turn, 0 and pi, in the digits of an array."""
    return (Decimal(0), PI) if a.dtype == object else (0.0, np.pi)


def _equations(graph: BlockGraph) -> tuple[list[list[bool]], Graph, Batch]:
    """Return which columns of J hold which unknowns not, and F for one pose and for many."""
    J, x = graph.shape.J, graph.shape.x
    bent = [ca.jacobian(J[:, j], x).sparsity() for j in range(graph.size)]
    constant = [[i not in bend.get_col() for i in range(graph.size)] for bend in bent]
    return constant, graph.function, Batch(graph.function, [1, 2, 3], straight=lambda: None)


class BlockSolver(OtherForms):
    """Finds all solutions of one block for given earlier unknowns and driver values.

    `size` is a length of the mechanism [m], `slopes` what `angle_slopes` returns.
    """

    constant: list[list[bool]]

    def __init__(
        self,
        scene: Scene,
        graph: BlockGraph,
        p: Floats,
        size: float,
        slopes: dict[int, list[float]],
    ) -> None:
        self.graph: BlockGraph = graph
        self.p: Floats = p[graph.params]
        self.n: int = graph.size
        self.size: float = size
        self.values: Floats = p
        self.scene: Scene = scene
        self.angle: list[bool] = [scene.unknowns[i].kind is ANGLE for i in graph.own]
        self.constant, self._F, self._batch = graph.cache("eliminate", lambda: _equations(graph))
        self.linear: bool = all(all(row) for row in self.constant)
        self.turns: list[tuple[int, int] | None] = [_turns(slopes.get(i, [])) for i in graph.own]
        self._scale, self._exact = 0.0, False
        self.linear = self.linear or (self._may_roll and self.rolls())
        self.unwinds: bool = not (self.linear or self._turns_alone) and self.unwinds_turns()
        """Whether turns of the angles change the equations: wheels on racks among trigonometry."""

    @property
    def _may_roll(self) -> bool:
        return self.n == 1 and self.angle[0] and not self.graph.redundant

    @property
    def _turns_alone(self) -> bool:
        return self.graph.redundant or self.graph.shape.turns_alone

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

            def residual(a: Any) -> Any:
                return self.F(a[:, None], z, u)[:, 0]

            return self._roots(residual, 0, lambda a: a[:, None], doubled=2)
        if self.n == 2:
            for eliminate in (self._pair, self._turning):
                for beta in (1, 0):
                    found = eliminate(1 - beta, beta, z, u)
                    if found is not None:
                        return found
        return None

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
            ends = [np.full_like(a, end) for end in _half_turn(a)]
            both = at(np.append(a, a), np.concatenate(ends))
            return (both[: len(a)] + both[len(a) :]) / 2

        def close(a: Any) -> Any:
            far = size**2
            if a.dtype == object:
                far = np.sum((at(a[:1], Decimal(0)) - at(a[:1], PI)) ** 2) / 4
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
        if size <= self._noise():
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
        return self._higher(c, g, alpha, complete, values)

    def _noise(self) -> float:
        """Return the size below which g is zero for all angles: rounding of its terms."""
        return self._scale**2 * 256 * np.finfo(float).eps if self.n == 2 else 0.0

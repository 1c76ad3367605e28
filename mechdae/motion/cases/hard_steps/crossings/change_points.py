"""Change points: poses at which two smooth branches of a block cross.

There the driver's push lies in the range of the singular Jacobian. With null vectors v, w
of J and t0 a solution of J t0 = -push, the tangents are t0 + alpha v with

    A alpha^2 + 2 B alpha + C = 0,   A = w.D2F[v, v],  B = w.D2F[t0, v],  C = w.D2F[t0, t0]

(the driver's share included in t0), two real ones for B^2 > A C; A = 0 gives a branch on
which the driver stands still. The second derivative along a branch follows from the third
derivative of F in the same way (Keller, Numerical Methods in Bifurcation Problems, 1987, 5).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.kernels.bounds.walk import ROUNDOFF
from mechdae.kernels.graphs.singular import crossing, jets
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Call
from mechdae.motion.cases.hard_steps.crossings.missed import LEAST, Missed
from mechdae.motion.cases.hard_steps.crossings.residuals import Residuals
from mechdae.motion.continuation.interpolate import upper_coefficients
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.types import Floats, Jacobian, Unknowns

ITERATIONS = 12
"""Most steps towards a crossing: they converge quadratically, in eight at most of 374 found."""
SLOW = 0.25
"""Share of the step before that a step, after the fifth, must not exceed."""
WELL = 1e-6
"""Share of its terms that a determinant must be for equations to be solved by it."""
SEARCH = 8.0
"""How far ahead a crossing may lie, in largest steps of the path."""
MEANT = 8 * ROUNDOFF
"""Residual that numbers rounded to double may leave where a crossing is meant."""
DOUBTFUL = 1e-10
"""Residual up to which nearly crossing branches are mentioned with their distance."""
EXCLUDED = 1e-6
"""Share of the second derivatives by which a branch may miss redundant equations."""
FLAT = 1e-9
RANK = 1e-7
"""Least singular value of all equations of a redundant block, as a share of the largest, above
which its pose is regular."""
UNLIKE = 0.2
"""Share of the angle between the tangents by which the path may miss its own."""

Piece = Callable[[float], tuple[Any, Any, Any, Any]]
"""Unknowns of a block and their first three derivatives at s."""


@dataclass(frozen=True, eq=False)
class Scaling:
    """Units of a block's unknowns (n,) and equations (m,).

    ``mix`` (n, m) makes n equations of those of a redundant block: along the left singular
    vectors of its Jacobian near the pose, so that nothing but the rank of the block counts.
    """

    columns: Any
    rows: Floats
    mix: Floats | None = None

    def equations(self, values: Floats) -> Floats:
        """Return residuals (m,) or a Jacobian (m, n) in units of the equations, mixed."""
        scaled = values / (self.rows if values.ndim == 1 else self.rows[:, None])
        return scaled if self.mix is None else self.mix @ scaled

    @property
    def vectors(self) -> tuple[Floats, Floats, Floats]:
        """Inputs of the kernels: columns, rows, mix."""
        mix = np.zeros(0) if self.mix is None else self.mix.ravel(order="F")
        return self.columns, self.rows, mix


@dataclass(frozen=True, eq=False)
class Branch:
    """One of the two branches through a crossing: x' and x'' (n,) of the block's unknowns."""

    slope: Floats
    bend: Floats


@dataclass(frozen=True, eq=False)
class Crossing:
    """A change point of one block.

    ``x`` (n,) are its unknowns there; ``other`` is None where the driver stands still on the
    other branch, which leaves along ``still``, or redundant equations have ``excluded`` it.
    ``residual`` is by how much the block's equations miss a crossing, in lengths of the
    mechanism, and ``gap`` how far apart the branches then are [rad or lengths]; both are zero
    when they cross for the float64 numbers given. Where these decide that they do not, ``missed``
    tells how they pass each other.
    """

    s: float
    block: int
    group: int
    x: Floats
    own: Branch
    other: Branch | None
    still: Floats
    residual: float = 0.0
    gap: float = 0.0
    excluded: bool = False
    missed: Missed | None = None

    @property
    def exact(self) -> bool:
        """Whether the branches cross for the numbers given."""
        return self.residual == 0.0

    @property
    def meant(self) -> bool:
        """Whether they cross up to the rounding of numbers to double precision."""
        return self.residual <= MEANT

    @property
    def passable(self) -> bool:
        """Whether there is a way past it: they are meant to cross, or known not to."""
        return self.meant or self.missed is not None


@dataclass(frozen=True, eq=False)
class _Form:
    """The quadratic form of a crossing, ``tangent`` t0 and null vector ``v`` (n,)."""

    A: float
    B: float
    C: float
    tangent: Floats
    v: Floats

    @property
    def size(self) -> float:
        return max(abs(self.A), abs(self.B), abs(self.C))


def _quotient(J: Jacobian, F: Floats) -> Any:
    """Return the solution of J z = F, in the sense of least squares."""
    if J.shape == (1, 1) and J[0, 0]:
        return F / J[0, 0]
    if J.shape == (2, 2):
        (a, b), (c, d) = J.tolist()
        det = a * d - b * c
        if abs(det) > WELL * (abs(a * d) + abs(b * c)):
            f, g = F.tolist()
            return np.array([(d * f - b * g) / det, (a * g - c * f) / det])
    return np.linalg.lstsq(J, F)[0]


class CrossingFinder:
    """Finds change points of a scene's blocks ahead of a solved pose.

    Parameters
    ----------
    graphs
        Kernels of the scene.
    constants
        Numbers of the scene.
    drivers
        The function s -> u, u', u'', u''' (nd,).
    largest
        Largest step of the path in s.
    """

    def __init__(
        self,
        graphs: Graphs,
        constants: Constants,
        drivers: Callable[[float], list[Floats]],
        largest: float,
    ) -> None:
        self.graphs: Graphs = graphs
        self.p: Floats = constants.p
        self.scale: float = constants.scale
        self.drivers: Callable[[float], list[Floats]] = drivers
        self.largest: float = largest
        self.residuals: Residuals = Residuals(graphs, constants.p, self.u)

    @property
    def unit(self) -> float:
        """A radian of the driver, or a length of the mechanism."""
        return self.largest * NODES_PER_TURN / (2 * np.pi)

    def columns(self, b: int) -> Floats:
        """Return the units of a block's unknowns, their natural sizes."""
        return self.graphs.scene.unknowns.sizes(self.scale)[self.graphs.blocks[b].own]

    def rows(self, b: int) -> Floats:
        units = self.graphs.blocks[b].block.units
        return np.array([self.scale if unit == "m" else 1.0 for unit in units])

    def scaling(self, b: int, J: Jacobian) -> Scaling:
        """Return the units of a block; `J` (m, n) is its Jacobian near the pose."""
        columns, rows = self.columns(b), self.rows(b)
        if not self.graphs.blocks[b].redundant:
            return Scaling(columns, rows)
        left = np.linalg.svd(J * columns / rows[:, None])[0]
        return Scaling(columns, rows, left[:, : len(columns)].T)

    def u(self, s: float) -> Any:
        """Return the drivers' values (nd,) at s."""
        return self.drivers(s)[0]

    def jet(
        self, b: int, s: float, x: Unknowns, rates: Sequence[Floats], z: list[Unknowns]
    ) -> tuple[Floats, ...]:
        """Return F, J, f', f'', f''' of a block for x, (x', x'') and (z, z', z'', z''')."""
        g = self.graphs
        call = g.cache(("jets", b), lambda: Call(jets(g.scene, g.blocks[b])))
        F, J, *rest = call(x, *rates, *z, *self.drivers(s), self.p)
        return (F, J.reshape(len(F), -1), *rest)

    def _system(self, b: int) -> Call:
        g = self.graphs
        return g.cache(("crossing", b), lambda: Call(crossing(g.scene, g.blocks[b])))

    # -- unknowns of earlier blocks ----------------------------------------------------------

    def follow(
        self, blocks: list[int], s: float, x: Unknowns, known: Mapping[int, Piece]
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Return x, x', x'', x''' (nx,) of `blocks` (in solve order) at s, from a guess `x`.

        `known` holds blocks that are singular there, as polynomials in s.
        """
        g = self.graphs
        result = [x.copy(), *(np.zeros(g.nx) for _ in range(3))]
        for k in blocks:
            graph = g.blocks[k]
            unknowns, nothing = graph.own, np.zeros(graph.size)
            if k in known:
                for array, value in zip(result, known[k](s), strict=True):
                    array[unknowns] = value
                continue
            z = [array[graph.uses] for array in result]
            for _ in range(6):
                F, J, *_ = self.jet(k, s, result[0][unknowns], (nothing, nothing), z)
                step = _quotient(J, F)
                result[0][unknowns] -= step
                if np.abs(step).max() <= 1e-15 * (1 + np.abs(result[0][unknowns]).max()):
                    break
            rates = [nothing, nothing]
            for order in range(3):
                parts = self.jet(k, s, result[0][unknowns], rates, z)
                value = -_quotient(parts[1], parts[2 + order])
                result[order + 1][unknowns] = value
                if order < 2:
                    rates[order] = value
        return result[0], result[1], result[2], result[3]

    # -- the crossing ------------------------------------------------------------------------

    def find(
        self,
        b: int,
        s: float,
        state: Floats,
        sense: float,
        known: Mapping[int, Piece],
        behind: float = 0.0,
    ) -> Crossing | None:
        """Return the crossing of block `b` ahead of the path's node `state` at s, or None.

        `behind` allows for one that the path has just passed. Branches that only come near
        each other are found too: see `Crossing.exact`.
        """
        g = self.graphs
        n, graph, earlier = g.nx, g.blocks[b], g.ancestors(b)[:-1]
        x, v, a = state[:n], state[n : 2 * n], state[2 * n : 3 * n]
        unknowns = graph.own
        equations = self._system(b)

        def upstream(place: float) -> tuple[Floats, list[Floats]]:
            ds = place - s
            guess = x + v * ds + a * ds * ds / 2
            whole = self.follow(earlier, place, guess, known)
            return whole[0], [array[graph.uses] for array in whole]

        here, whole, z = s, x, [array[graph.uses] for array in (x, v, a, np.zeros(n))]
        if any(k in known for k in earlier):  # singular there: the node does not tell their rates
            whole, z = upstream(s)
        _, J, *_ = self.jet(b, s, x[unknowns], (np.zeros(graph.size),) * 2, z)
        scaling = self.scaling(b, J)
        w = np.linalg.svd(scaling.equations(J * scaling.columns))[0][:, -1]
        y = np.concatenate([x[unknowns] / scaling.columns, [0.0], w])
        count, unit = graph.size, self.unit
        moved = np.inf
        for k in range(ITERATIONS):
            u, u1, u2, _ = self.drivers(here)
            at = [z[0], z[1] * unit, z[2] * unit**2, u, u1 * unit, u2 * unit**2]
            system, slope = equations(y, *at, self.p, *scaling.vectors)
            if not (np.isfinite(system).all() and np.isfinite(slope).all()):
                return None
            change = np.linalg.lstsq(slope, -system)[0]
            y = y + change
            here += float(y[count]) * unit
            y[count] = 0.0
            if not abs(here - s) <= 2 * SEARCH * self.largest:
                return None
            whole, z = upstream(here)
            before, moved = moved, float(np.max(np.abs(change)))
            if moved <= 1e-14 or (moved < 1e-9 and moved >= before):
                break
            if k > 4 and moved > max(1e-9, SLOW * before):
                return None
        else:
            return None
        if abs(here) < 1e-15 * unit:
            here = 0.0
        if not -behind < sense * (here - s) <= SEARCH * self.largest:
            return None
        if np.linalg.norm(system[:-1]) > DOUBTFUL:
            return None
        coming = None if behind else v[unknowns] + a[unknowns] * (here - s)
        found = self._branches(b, here, y, z, coming, scaling)
        if found is None:
            return None
        return self._judged(found, (b, here, y, slope), whole, z, known, scaling)

    def _judged(
        self,
        found: tuple[Crossing, _Form, Floats],
        at: tuple[int, float, Floats, Floats],
        whole: Floats,
        z: list[Unknowns],
        known: Mapping[int, Piece],
        scaling: Scaling,
    ) -> Crossing:
        """Return a crossing with what is known of whether its branches meet.

        `at` are its block, s, and y with the derivative of the system of the crossing there.
        """
        (result, form, w), (b, here, y, slope) = found, at
        unit, earlier = self.unit, self.graphs.ancestors(b)[:-1]
        residual, missed = None, None
        if not any(k in known for k in earlier):
            u, u1, u2, _ = self.drivers(here)
            driven = (z[1] * unit, z[2] * unit**2, u, u1 * unit, u2 * unit**2)
            own_system = (y, self._system(b).function, slope, driven, scaling)
            signed = self.residuals.precise(b, whole, earlier, *own_system)
            if signed is not None:
                residual = abs(signed)
                signed *= np.sign(float(w @ y[len(y) - len(w) :]))
                missed = self._missed(b, here, result.x, whole, earlier, form, signed, w, scaling)
        if residual is None:
            sharp = [k for k in earlier if k not in known]
            residual = self.residuals.wide(b, here, result.x, whole, sharp, w, scaling)
        if result.excluded:
            residual, missed = 0.0, None  # the path cannot leave its branch
        gap = float(np.sqrt(2 * residual / form.size))
        return replace(result, residual=residual, gap=gap, missed=missed)

    def _missed(
        self,
        b: int,
        s: float,
        x: Unknowns,
        whole: Floats,
        earlier: list[int],
        form: _Form,
        residual: float,
        w: Floats,
        scaling: Scaling,
    ) -> Missed | None:
        """Return how branches pass each other that miss a crossing by a residual.

        None where they cross, and where the last places of the numbers given leave that open.
        """
        near = np.sqrt(2 * abs(residual) / form.size) < LEAST
        if near or abs(form.A) <= FLAT * form.size or scaling.mix is not None:
            return None
        there = np.array(whole, float)
        there[self.graphs.blocks[b].own] = x
        if not self.residuals.decides(residual, b, s, there, earlier, w, scaling):
            return None
        return Missed(form.A, form.B, form.C, residual, form.tangent, form.v, self.unit)

    def _branches(
        self, b: int, s: float, y: Floats, z: list[Unknowns], slope: Floats | None, scaling: Scaling
    ) -> tuple[Crossing, _Form, Floats] | None:
        """Return the crossing with its two branches, A, B, C, and w.

        `slope` is that of the path's branch as far as it is known. None where no branches
        cross, or where the path comes on neither of them.
        """
        graph = self.graphs.blocks[b]
        columns = scaling.columns
        x, nothing = y[: graph.size] * columns, np.zeros(graph.size)

        def second(slope: Floats) -> Floats:
            return scaling.equations(self.jet(b, s, x, (slope, nothing), z)[3])

        F, J, push, *_ = self.jet(b, s, x, (nothing, nothing), z)
        del F
        if graph.redundant:  # the equations that were mixed may be singular where all are not
            sigma = np.linalg.svd(J * columns / self.rows(b)[:, None])[1]
            if sigma[-1] > RANK * sigma[0]:
                return None
        scaled = scaling.equations(J * columns)
        left, _, right = np.linalg.svd(scaled)
        w, v = left[:, -1], right[-1] * columns
        t0 = self._solve(scaled, -scaling.equations(push)) * columns
        ahead, behind, C = (float(w @ second(t0 + c * v)) for c in (1.0, -1.0, 0.0))
        A, B = (ahead + behind) / 2 - C, (ahead - behind) / 4
        B, C = B * self.unit, C * self.unit**2
        size = max(abs(A), abs(B), abs(C))
        root = B * B - A * C
        if root <= 1e-6 * size * size or size == 0:
            return None  # the branches touch, or the pose is isolated
        q = -(B + np.copysign(np.sqrt(root), B))
        alphas = [C / q if q else 0.0, q / A if abs(A) > FLAT * size else None]

        real = [alpha for alpha in alphas if alpha is not None]
        along = real[0]
        if slope is not None:
            along = float(right[-1] @ ((slope - t0) / columns)) * self.unit
        nearest = min(real, key=lambda alpha: abs(alpha - along))
        other = next((alpha for alpha in real if alpha != nearest), None)
        apart = abs(nearest - other) if other is not None else 1.0 + abs(nearest)
        if abs(along - nearest) > UNLIKE * apart:
            return None
        excluded = False
        if scaling.mix is not None:
            left = np.linalg.svd(J * columns / scaling.rows[:, None])[0][:, graph.size - 1 :]

            def missed(slope: Floats) -> Floats:
                return left.T @ (self.jet(b, s, x, (slope, nothing), z)[3] / scaling.rows)

            if other is None:
                load = (missed(t0 + v) + missed(t0 - v)) / 2 - missed(t0)
            else:
                load = missed(t0 + other / self.unit * v) * self.unit**2
            excluded = bool(np.linalg.norm(load) > EXCLUDED * size)
            other = None if excluded else other
        branches = [
            self._branch(b, s, x, t0 + alpha / self.unit * v, scaled, w, v, z, scaling)
            if alpha is not None
            else None
            for alpha in (nearest, other)
        ]
        if branches[0] is None or (other is not None and branches[1] is None):
            return None
        group = graph.block.group
        found = Crossing(s, b, group, x, branches[0], branches[1], v, excluded=excluded)
        return found, _Form(A, B, C, t0, v), w

    def _branch(
        self,
        b: int,
        s: float,
        x: Unknowns,
        slope: Floats,
        scaled: Floats,
        w: Floats,
        v: Floats,
        z: list[Unknowns],
        scaling: Scaling,
    ) -> Branch | None:
        """Return a branch with its second derivative, by the condition of third order.

        None where rounding leaves nothing of that condition.
        """
        nothing = np.zeros(len(x))
        second = scaling.equations(self.jet(b, s, x, (slope, nothing), z)[3])
        bend = self._solve(scaled, -second) * scaling.columns
        rest = float(w @ scaling.equations(self.jet(b, s, x, (slope, bend), z)[4]))
        more = float(w @ scaling.equations(self.jet(b, s, x, (slope, bend + v), z)[4]))
        return Branch(slope, bend - rest / (more - rest) * v) if more != rest else None

    @staticmethod
    def _solve(scaled: Floats, right: Floats) -> Any:
        """Return the least solution of the singular system."""
        left, sigma, turned = np.linalg.svd(scaled)
        remaining = sigma[:-1]
        return turned[:-1].T @ ((left[:, :-1].T @ right) / remaining)


def piece(
    a: float, b: float, at_a: tuple[Floats, ...], at_b: tuple[Floats, Floats, Floats]
) -> Piece:
    """Return the polynomial of degree five through (x, x', x'') at a and b, with derivatives."""
    h = b - a
    (x0, v0, a0), (x1, v1, a1) = at_a, at_b
    v0, v1, a0, a1 = v0 * h, v1 * h, a0 * h * h, a1 * h * h
    c = [x0, v0, a0 / 2, *upper_coefficients(x1 - x0, v0, v1, a0, a1)]

    def at(s: float) -> tuple[Any, Any, Any, Any]:
        t = (s - a) / h
        value, first, second, third = (
            sum(
                coefficient * (np.prod(range(k - order + 1, k + 1)) * t ** (k - order))
                for k, coefficient in enumerate(c)
                if k >= order
            )
            for order in range(4)
        )
        return value, first / h, second / h**2, third / h**3

    return at

"""All poses of a mechanism of dyads in closed form, as one casadi function.

A dyad's equations are those of one angle a once its other unknown is eliminated,

    A cos a + B sin a + C = 0,

because a link turns a vector of constant length and a slide enters linearly. It has two
solutions where D = A^2 + B^2 - C^2 is positive, told apart by the sign of the determinant
of the dyad's Jacobian, and none where D is negative. Blocks that are linear in their unknowns have
one solution.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.kernels.bounds.walk import with_trig
from mechdae.kernels.graphs.blocks import BlockGraph, column, inverse, placed
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Graph, Sym

SX = ca.SX
SAMPLES = 4
"""Poses with numbers at random at which a closed form is compared with the equations."""
AGREES = 1e-9
NEAR = 0.1
"""Share by which the numbers of samples differ from the mechanism's own."""


@dataclass(frozen=True)
class BlockForm:
    """The closed form of a block: the function and whether the sign of the determinant chooses.

    (x, sin x, cos x, u, p, sign) -> unknowns, their sines and cosines, D over A^2 + B^2 (1 where
    there is one solution); `x` holds all unknowns of the scene, those of earlier blocks are used.
    """

    function: Graph
    branches: bool


class ClosedForm:
    """The poses of a scene of dyads.

    Attributes
    ----------
    branches : (nb,) array of bool
        Blocks with two solutions.
    """

    def __init__(self, graphs: Graphs, forms: list[BlockForm]) -> None:
        self.graphs: Graphs = graphs
        self.forms: list[BlockForm] = forms
        self.branches: Booleans = np.array([form.branches for form in forms], bool)
        u, sign = SX.sym("u", graphs.nu), SX.sym("sign", graphs.nb)
        x, _, _, depth = self.symbolic(u, sign)
        results = [ca.densify(part) for part in (x, depth)]
        function = without_repeats("closed", [u, sign, graphs.p], results)
        self.poses: Batch = Batch(function)

    def symbolic(self, u: Sym, sign: Sym) -> tuple[Sym, Sym, Sym, Sym]:
        """Return unknowns, their sines and cosines, and D over A^2 + B^2 of each block."""
        g = self.graphs
        x, sines, cosines = SX.zeros(g.nx), SX.zeros(g.nx), SX.zeros(g.nx)
        depths = []
        for b, (graph, form) in enumerate(zip(g.blocks, self.forms, strict=True)):
            solution, s, c, depth = form.function(x, sines, cosines, u, g.p, sign[b])
            x = placed(x, graph.own, solution)
            sines, cosines = placed(sines, graph.own, s), placed(cosines, graph.own, c)
            depths.append(depth)
        return x, sines, cosines, column(depths)


def closed_form(graphs: Graphs, p: Floats) -> ClosedForm | list[int]:
    """Return the closed form of a scene, or the blocks that have none.

    `p` are numbers of a mechanism: what is derived is compared with the equations near them.
    """
    known = graphs.cache("closed form", lambda: _derived(graphs, p))
    return known


def _derived(graphs: Graphs, p: Floats) -> ClosedForm | list[int]:
    forms = [_form(graphs, graph, p) for graph in graphs.blocks]
    without = [b for b, form in enumerate(forms) if form is None]
    return without or ClosedForm(graphs, [form for form in forms if form is not None])


def _form(graphs: Graphs, graph: BlockGraph, p: Floats) -> BlockForm | None:
    """Return the closed form of a block, None where it is not one of those known here."""
    scene = graphs.scene
    if graph.redundant or graphs.contacts:
        return None
    angle = [scene.unknowns[i].kind is ANGLE for i in graph.own]
    length = [bool(scene.unknowns.lengths[i]) for i in graph.own]
    if not all(a or b for a, b in zip(angle, length, strict=True)):
        return None
    block = _Block(graphs, graph)
    for derive in (block.linear, block.one_angle, block.angle_and_slide, block.two_angles):
        form = derive(angle)
        if form is not None and _agrees(graphs, graph, form, p):
            return form
    return None


class _Block:
    """The equations of a block with sines and cosines as symbols."""

    def __init__(self, graphs: Graphs, graph: BlockGraph) -> None:
        self.graphs, self.graph, scene = graphs, graph, graphs.scene
        n = graphs.nx
        self.s, self.c = SX.sym("s", n), SX.sym("c", n)
        self.x, self.sign = scene.x, SX.sym("sign")
        turning = [i for i in range(n) if scene.unknowns[i].kind is ANGLE]
        angles = scene.x[turning] if turning else SX(0, 1)
        trig = [v[turning] if turning else SX(0, 1) for v in (self.s, self.c)]
        (self.F,) = with_trig([graph.F], angles, *trig)
        self.J = graph.J

    def _with(self, solution: Sym, s: Sym, c: Sym, depth: Sym, branches: bool) -> BlockForm:
        scene = self.graphs.scene
        inputs = [self.x, self.s, self.c, scene.u, scene.model.p, self.sign]
        results = [ca.densify(SX(part)) for part in (solution, s, c, depth)]
        return BlockForm(ca.Function("form", inputs, results), branches)

    def _without(self, expression: Sym, *places: int) -> Sym:
        """Return an expression with some own unknowns, their sines and cosines at zero."""
        held = ca.vertcat(*[v[i] for i in places for v in (self.x, self.s, self.c)])
        return ca.substitute(expression, held, SX.zeros(held.numel()))

    def _free(self, expression: Sym, *places: int) -> bool:
        held = ca.vertcat(*[v[i] for i in places for v in (self.x, self.s, self.c)])
        return not ca.depends_on(expression, held)

    def linear(self, angle: list[bool]) -> BlockForm | None:
        """Lengths (or wheels on racks) that the equations hold linearly."""
        unknowns = self.graph.own
        slope = ca.jacobian(self.F, self.x[unknowns])
        trig = ca.vertcat(self.s[unknowns], self.c[unknowns])
        if ca.depends_on(slope, self.x[unknowns]) or ca.depends_on(self.F, trig):
            return None
        value = -inverse(ca.densify(slope))[0] @ self._without(self.F, *unknowns)
        return self._with(value, ca.sin(value), ca.cos(value), SX(1), False)

    def one_angle(self, angle: list[bool]) -> BlockForm | None:
        """A single angle."""
        if self.graph.size != 1 or not angle[0]:
            return None
        i = self.graph.own[0]
        a, b = ca.jacobian(self.F, self.c[i]), ca.jacobian(self.F, self.s[i])
        rest = self._without(self.F, i)
        s, c, depth = self._solved(a, b, rest, -self.sign)
        return self._with(ca.atan2(s, c), s, c, depth, True)

    def angle_and_slide(self, angle: list[bool]) -> BlockForm | None:
        """An angle and a length, along a direction that may turn with the angle."""
        if self.graph.size != 2 or sum(angle) != 1:
            return None
        first = angle.index(True)
        i, j = self.graph.own[first], self.graph.own[1 - first]
        slope = ca.densify(ca.jacobian(self.F, self.x[j]))
        if not self._free(slope, j):
            return None
        rest = self._without(self.F, j)
        (d0, d1, d2), (f0, f1, f2) = self._parts(slope, i), self._parts(rest, i)
        a = _cross(d1, f0) + _cross(d0, f1)
        b = _cross(d2, f0) + _cross(d0, f2)
        free = _cross(d0, f0) + _cross(d1, f1)
        way = self.sign if first == 0 else -self.sign
        s, c, depth = self._solved(a, b, free, way)
        d, f = (v0 + v1 * c + v2 * s for v0, v1, v2 in ((d0, d1, d2), (f0, f1, f2)))
        slide = -ca.dot(d, f) / ca.sumsqr(d)
        pairs = [(ca.atan2(s, c), s, c), (slide, ca.sin(slide), ca.cos(slide))]
        ordered = pairs if first == 0 else pairs[::-1]
        solution, sines, cosines = (ca.vertcat(*column) for column in zip(*ordered, strict=True))
        return self._with(solution, sines, cosines, depth, True)

    def two_angles(self, angle: list[bool]) -> BlockForm | None:
        """Two links, each the turning of a vector of constant length."""
        if self.graph.size != 2 or not all(angle):
            return None
        i, j = self.graph.own
        g0, g1, g2 = self._parts(self.F, j)
        if not (self._free(g1, i) and self._free(g2, i)):
            return None
        f0, f1, f2 = self._parts(g0, i)
        square = ca.sumsqr(g1)
        a, b = 2 * ca.dot(f0, f1), 2 * ca.dot(f0, f2)
        s, c, depth = self._solved(a, b, ca.sumsqr(f0) + ca.sumsqr(f1) - square, self.sign)
        f = f0 + f1 * c + f2 * s
        c2, s2 = -ca.dot(g1, f) / square, -ca.dot(g2, f) / square
        angles = ca.vertcat(ca.atan2(s, c), ca.atan2(s2, c2))
        return self._with(angles, ca.vertcat(s, s2), ca.vertcat(c, c2), depth, True)

    def _parts(self, expression: Sym, i: int) -> tuple[Sym, Sym, Sym]:
        """Return v0, v1, v2 of v0 + v1 cos + v2 sin of an unknown."""
        parts = [ca.jacobian(expression, v[i]) for v in (self.c, self.s)]
        return self._without(expression, i), *[ca.densify(part) for part in parts]

    @staticmethod
    def _solved(a: Sym, b: Sym, free: Sym, way: Sym) -> tuple[Sym, Sym, Sym]:
        """Return sine, cosine and D over A^2 + B^2; the slope of the equation is -way sqrt(D)."""
        square = a * a + b * b
        depth = 1 - free * free / square
        root, share = way * ca.sqrt(depth / square), free / square
        return -b * share + a * root, -a * share - b * root, depth


def _cross(a: Sym, b: Sym) -> Any:
    return a[0] * b[1] - a[1] * b[0]


def _agrees(graphs: Graphs, graph: BlockGraph, form: BlockForm, p: Floats) -> bool:
    """Return whether a form solves the equations, with determinants of the signs asked for."""
    rng, scene = np.random.default_rng(1), graphs.scene
    scale = float(np.abs(p).max(initial=0.0)) or 1.0
    seen = {-1.0: 0, 1.0: 0}
    for _ in range(64):
        numbers = p * (1 + NEAR * rng.uniform(-1, 1, len(p)))
        x = rng.uniform(-1, 1, graphs.nx) * np.where(scene.unknowns.turns, np.pi, scale)
        u = rng.uniform(-1, 1, graphs.nu)
        for sign in (-1.0, 1.0):
            solution = form.function(x, np.sin(x), np.cos(x), u, numbers, sign)[0]
            solution = np.array(solution).ravel()
            if not np.isfinite(solution).all():
                continue
            there = x.copy()
            there[graph.own] = solution
            F, J, _ = graph.value_at(there, u, numbers)
            size = np.abs(J) @ np.maximum(np.abs(solution), 1.0) + scale
            if not np.all(np.abs(F) <= AGREES * size):
                return False
            if form.branches and np.sign(np.linalg.det(J)) != sign:
                return False
            seen[sign] += 1
        if min(seen.values()) >= SAMPLES:
            return True
    return False

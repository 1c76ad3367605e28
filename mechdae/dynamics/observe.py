"""States of a motion as what is reported: absolute coordinates, forces, energies, gaps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.equations.forces.joint_reactions import reactions_of
from mechdae.equations.motion_equations import row_size
from mechdae.equations.structure_cache import structure_property
from mechdae.kernels.graphs.linear import recovered
from mechdae.kernels.run.functions import Batch
from mechdae.records import dataclass
from mechdae.types import Floats, Graph, Integers, Matrix, Reactions, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.model import Model
    from mechdae.equations.motion_equations import Released
    from mechdae.equations.structure_cache import StructureCache
    from mechdae.kernels.graphs.equations_of_motion import Kernel

SX = ca.SX


@dataclass
class States:
    """States at the times of output, rows are times: x, v, a, multipliers, works."""

    t: Any
    x: Matrix
    v: Floats
    a: Matrix
    lam: Floats
    w: Matrix
    signs: Matrix


def alike(patterns: Any, rows: Integers | None = None) -> Iterator[tuple[Any, Integers]]:
    """Yield each pattern (n, k) among some rows with the rows that have it."""
    rows = np.arange(len(patterns)) if rows is None else rows
    while len(rows):
        same = (patterns[rows] == patterns[rows[0]]).all(axis=1)
        yield patterns[rows[0]], rows[same]
        rows = rows[~same]


class Observer:
    """Functions of states."""

    def __init__(self, setup: MotionProblem) -> None:
        self.setup: MotionProblem = setup
        self.r: Released = setup.loaded
        self.kernel: Kernel = setup.force_kernel
        self.model: Model = setup.model
        self.cache: StructureCache = self.kernel.cache
        self.p: Floats = self.model.p_values

    def many(self, name: str, made: Callable[[], tuple[list[Any], list[Any]]]) -> Any:
        """Return a function of (t, x, v, signs, ...); signs have one row for each state."""

        def function() -> Graph:
            results, more = made()
            return self.kernel.function(name, [ca.densify(e) for e in results], more)

        return self.kernel.batch(name, function, ())

    def absolute(self, s: States) -> tuple[Floats, Floats, Floats]:
        """Return absolute coordinates with their rates and accelerations, (n, nq) each."""
        r = self.r

        def build() -> tuple[list[Sym], list[Sym]]:
            a = SX.sym("a", r.x.numel())
            return [r.q, r.qd, r.bias + r.V @ a], [a]

        q, v, a = self.many("absolute", build)(s.t[:, None], s.x, s.v, s.signs, s.a)
        return q, v, a

    def energies(self, s: States) -> tuple[Floats, dict[str, Floats]]:
        """Return the kinetic energy (n,) and the potential ones by load."""
        r = self.r
        energies = self.many("energies", lambda: ([ca.vertcat(r.kinetic, *r.stores.values())], []))
        found = energies(s.t[:, None], s.x, s.v, s.signs)[0]
        stores = {name: found[:, k + 1] for k, name in enumerate(r.stores)}
        return found[:, 0], stores

    @structure_property
    def _gaps(self) -> Batch:
        model, r = self.model, self.r
        rows = ca.vertcat(*[row.expression for row in r.rows]) if r.rows else SX(0, 1)
        rate = ca.jtimes(rows, ca.vertcat(model.q, r.t), ca.vertcat(model.velocity, SX(1)))
        inputs = [model.q, model.velocity, r.t, r.signs, model.p]
        function = ca.Function("gaps", inputs, [ca.densify(rows), ca.densify(rate)])
        return Batch(function, [4], straight=lambda: None)

    def gaps(self, s: States, q: Unknowns, v: Floats) -> tuple[Floats, Floats]:
        """Return the largest gap of all equations at each state, and that of their rates."""
        if not self.r.rows:
            return np.zeros(len(s.t)), np.zeros(len(s.t))
        length = self.setup.length
        sizes = np.array([row_size(row.unit, length) for row in self.r.rows])
        gaps, rates = self._gaps(q, v, s.t[:, None], s.signs, self.p)
        return np.max(np.abs(gaps / sizes), axis=1), np.max(np.abs(rates / sizes), axis=1)

    # -- multipliers -----------------------------------------------------------------------

    def complete(self, s: States) -> States:
        """Return states with the multipliers and sizes of all forces, those of teeth too."""
        if self.kernel is self.setup.kernel:
            return s
        self.kernel.scale(float(s.t[0]), s.x[0], s.v[0], self.setup.loose)
        rates = self.kernel.batch("rhs", lambda: self.kernel.rhs)
        lam = np.full((len(s.t), self.kernel.inner), np.nan)
        for signs, rows in alike(s.signs, np.flatnonzero(np.isfinite(s.a).all(axis=1))):
            lam[rows] = rates(s.t[rows, None], s.x[rows], s.v[rows], signs)[1]
        return replace(s, lam=lam)

    def _multipliers(self) -> tuple[list[Sym], list[Sym]]:
        """(..., a, lambda of what is left, forces of locks, sizes) -> multipliers of all."""
        r, k = self.r, self.kernel
        a, inner = SX.sym("a", r.x.numel()), SX.sym("lam", k.inner)
        push = r.push - r.mass @ (r.V @ a)
        if k.slips:
            push -= r.held_back @ inner[k.m : k.m + k.slips]
        if k.rubs:
            push += r.rubbed @ inner[k.m + k.slips :]
        return [recovered(r, push, inner[: k.m])], [a, inner]

    def multipliers(self, s: States) -> Floats:
        """Return the multipliers of all equations, (n, rows)."""
        if not self.r.rows:
            return np.zeros((len(s.t), 0))
        inner = self._inner(s)
        multipliers = self.many("multipliers", self._multipliers)
        found: Floats = multipliers(s.t[:, None], s.x, s.v, s.signs, s.a, inner)[0]
        return found

    def _inner(self, s: States) -> Floats:
        inner = np.zeros((len(s.t), self.kernel.inner))
        inner[:, : s.lam.shape[1]] = s.lam
        return inner

    def loads(self, s: States) -> float:
        """Return the largest load on a body over the states, times a length of the mechanism."""
        sizes = self.r.acting_sizes(self.setup.length)
        applied = self.many("loads", lambda: ([self.r.acting], []))
        found = np.abs(applied(s.t[:, None], s.x, s.v, s.signs)[0]) * sizes
        return float(np.max(found, initial=0.0, where=np.isfinite(found)))

    # -- reactions -------------------------------------------------------------------------

    def reactions(self, s: States, lam: Floats) -> dict[str, Reactions]:
        """Return force and moment about the second body's point, on the second body, by joint.

        (n, 3), in space (n, 6); friction of the joint is in them. Beside contacts whose forces are
        not known there are none.
        """
        joints, width = list(self.model.mechanism.joints), self.model.space.freedoms
        if not set(self.model.mesh_names) <= self.r.rubbing.meshes.keys():
            return {name: np.full((len(s.t), width), np.nan) for name in joints}
        r, k = self.r, self.kernel

        def build() -> tuple[list[Any], list[Any]]:
            a, every = SX.sym("a", r.x.numel()), SX.sym("lam", len(r.rows))
            inner = SX.sym("inner", k.inner)
            _, held, sizes = ca.vertsplit(inner, [0, k.m, k.m + k.slips, k.inner])
            return [reactions_of(r, joints, a, every, held, sizes)], [a, every, inner]

        states = (s.t[:, None], s.x, s.v, s.signs, s.a, lam, self._inner(s))
        flat = self.many("reactions", build)(*states)[0].reshape(len(s.t), -1, width)
        return {name: flat[:, i] for i, name in enumerate(joints)}

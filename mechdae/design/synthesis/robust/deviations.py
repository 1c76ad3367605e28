"""How poses and what is asked of them deviate when parameters do, to first order.

With F(x, u, p) = 0 at a pose and values a(x, u, p) the implicit function theorem has, block by
block, dx/dp = -J^-1 (F_p + F_z dz/dp) and da/dp = a_x dx/dp + a_p. Derivatives are expressions of
the pose and of the free parameters, so that those of an NLP stay exact.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.design.derivatives.composed import slopes_of_unknowns
from mechdae.design.synthesis.poses import FreePoses
from mechdae.design.synthesis.space import DesignSpace
from mechdae.equations.parameters import parameters_of
from mechdae.kernels.run.functions import without_repeats
from mechdae.types import Floats, Graph, Sym

SX = ca.SX
PROBES = 9
"""Poses at random from which sizes of deviations are taken."""


class Deviations:
    """Deviations by independent parameters, in steps of one standard deviation of each.

    `tolerances`: half widths by name: a parameter lies evenly in its value -+ its half width, so
    that its standard deviation is the half width by the root of three. ``others``: those of them
    that are not free.
    """

    def __init__(self, poses: FreePoses, tolerances: Mapping[str, float], factor: float) -> None:
        self.poses: FreePoses = poses
        self.factor: float = factor
        self.names: list[str] = list(tolerances)
        self.sigmas: Floats = np.array(list(tolerances.values())) / np.sqrt(3)
        self.others: list[str] = [name for name in self.names if name not in poses.free]

    @property
    def count(self) -> int:
        """How many parameters deviate."""
        return len(self.names)

    def deviated(self, d: Sym, steps: Sym) -> Sym:
        """Return free parameters and `others` that have deviated by so many standard deviations."""
        poses = self.poses
        p = parameters_of(poses.model, poses.free, d)
        rest = [p[poses.model.p_names.index(name)] for name in self.others]
        found = ca.vertcat(d, *rest)
        every = [*poses.free, *self.others]
        for k, name in enumerate(self.names):
            found[every.index(name)] += float(self.sigmas[k]) * steps[k]
        return found

    @cached_property
    def _symbols(self) -> tuple[Sym, Sym, Sym]:
        """d, steps, and the parameter vector over both."""
        poses = self.poses
        d, steps = SX.sym("d", len(poses.free)), SX.sym("steps", self.count)
        every = [*poses.free, *self.others]
        return d, steps, parameters_of(poses.model, every, self.deviated(d, steps))

    @cached_property
    def of_pose(self) -> Graph:
        """(x, u, d) -> deviations (nx, nt) of the unknowns of a pose."""
        g, (d, steps, p) = self.poses.graphs, self._symbols
        x, u = SX.sym("x", g.nx), SX.sym("u")
        slopes = slopes_of_unknowns(g, ca.vertcat(x, u, p, 1), steps)
        slopes = ca.substitute(slopes, steps, SX.zeros(self.count))
        return without_repeats("of_pose", [x, u, d], [ca.densify(slopes)])

    @cached_property
    def function(self) -> Graph:
        """(x, u, d) -> deviations (na, nt) of the asked values."""
        g, (d, steps, p) = self.poses.graphs, self._symbols
        x, u = SX.sym("x", g.nx), SX.sym("u")
        limits = self.poses.inside(x, u, p)[2]
        moved = ca.jacobian(limits, x) @ self.of_pose(x, u, d) if g.nx else SX.zeros(limits.numel())
        found = ca.substitute(moved + ca.jacobian(limits, steps), steps, SX.zeros(self.count))
        return without_repeats("deviations", [x, u, d], [ca.densify(found)])

    def of(self, name: str, x: Sym, u: Sym, d: Sym) -> Sym:
        """Return the deviations (w, nt) of one asked value at a pose."""
        return self.function(x, u, d)[self.poses.span(name), :]

    def typical(self, function: Any, space: DesignSpace) -> float:
        """Return what products of deviations are about, from poses at random.

        `function`: (x, u, d) -> deviations (m, nt), which need no closed pose.
        """
        generator = np.random.default_rng(0)
        low, high = space.box.T
        rest = space.middle[len(low) :]
        found = []
        for _ in range(PROBES):
            d = np.concatenate([generator.uniform(low, high), rest])
            x = generator.uniform(-2, 2, self.poses.nx) * space.natural
            A = np.array(function(x, generator.uniform(0, 6), d))
            found.append(np.sum(A**2) / self.count)
        value = float(np.median(found))
        return value if np.isfinite(value) and value > 0 else 1.0

    @cached_property
    def unmoved(self) -> list[str]:
        """Names of parameters that deviate without any effect on what is asked."""
        _, steps, p = self._symbols
        x, u = SX.sym("x", self.poses.graphs.nx), SX.sym("u")
        parts = ca.vertcat(*self.poses.inside(x, u, p))
        used = np.array(ca.DM(ca.jacobian_sparsity(parts, steps), 1)).any(axis=0)
        return [n for n, has in zip(self.names, np.atleast_1d(used), strict=True) if not has]

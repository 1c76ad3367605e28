"""The poses of a design as variables of an NLP: closure, branch, points, all from the Model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.mechanism import Mechanism
from mechdae.errors import UnavailableError
from mechdae.kernels.blocks import inverse
from mechdae.kernels.graphs import Graphs
from mechdae.model.model import Model
from mechdae.model.parameters import parameters_of
from mechdae.model.reduction import Scene, scene

SX = ca.SX


class Poses:
    """Poses of a mechanism over free parameters.

    Parameters
    ----------
    mechanism
        The description; its values are the middle of what is searched.
    driver
        Coordinate of the driver.
    free
        Names of the free parameters.
    bodies
        Bodies whose motion is asked for; others are not solved.
    asks
        model -> expressions over its coordinates by name, to be evaluated at poses.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        driver: str,
        free: Sequence[str],
        bodies: Sequence[str],
        asks: Callable[[Model], Mapping[str, Any]],
    ) -> None:
        self.mechanism, self.free = mechanism, list(free)
        self.model = Model(mechanism, free=free)
        c = coordinate(mechanism, driver)
        self.scene: Scene = scene(self.model, (c,), tuple(bodies))
        for group in self.scene.redundant:
            raise UnavailableError(
                f"group {group.name} has superfluous constraints, its dimensions cannot be searched"
            )
        self.graphs = Graphs(self.scene, SX(0, 1), 0)
        self.nx = self.graphs.nx
        self.asked = {name: SX(e) for name, e in asks(self.model).items()}
        g = self.graphs
        values = SX.sym("free", len(self.free))
        p = parameters_of(self.model, self.free, values)
        residuals, signs = [], []
        for graph in g.blocks:
            F, J, _ = graph.value(g.x, g.u, g.p)
            residuals.append(F)
            columns = [ca.sqrt(ca.sumsqr(J[:, k])) for k in range(graph.size)]
            size = SX(1)
            for column in columns:
                size *= column
            det = inverse(J)[1] if graph.size <= 4 else ca.det(J)
            signs.append(det / size)
        names, parts = list(self.asked), list(self.asked.values())
        asked = ca.substitute(
            self.scene.expression(ca.vertcat(*parts) if parts else SX(0, 1)),
            ca.vertcat(self.scene.x, self.scene.u), ca.vertcat(g.x, g.u),
        )  # fmt: skip
        self._spans, start = {}, 0
        for name, part in zip(names, parts, strict=True):
            self._spans[name] = slice(start, start + part.numel())
            start += part.numel()
        columns = [ca.vertcat(*residuals), ca.vertcat(*signs), asked]
        inside = ca.Function("inside", [g.x, g.u, g.p], columns)
        results = list(inside(g.x, g.u, p))
        self.function = ca.Function("pose", [g.x, g.u, values], results, {"cse": True})
        self.nb = len(g.blocks)

    def part(self, stacked: Any, name: str) -> Any:
        """Return one of the asked values out of all, stacked along the last axis of arrays."""
        span = self._spans[name]
        return stacked[..., span] if isinstance(stacked, np.ndarray) else stacked[span]

    @cached_property
    def rates(self) -> Any:
        """(x, u, free, v) -> what is left of the rate of closure, rates of the asked values.

        Rates by the driver; v are those of x.
        """
        x, u, d = SX.sym("x", self.nx), SX.sym("u"), SX.sym("d", len(self.free))
        v = SX.sym("v", self.nx)
        F, _, asked = self.function(x, u, d)
        both = [
            ca.jtimes(part, x, v) + ca.jacobian(part, u) if part.numel() else part
            for part in (F, asked)
        ]
        return ca.Function("rates", [x, u, d, v], [ca.densify(part) for part in both])

    @cached_property
    def recovered(self) -> Any:
        """(x, u, free) -> all coordinates of the scene in the order of `names`."""
        g = self.graphs
        d = SX.sym("d", len(self.free))
        p = parameters_of(self.model, self.free, d)
        stacked = ca.vertcat(*self.scene.recover.values())
        old = ca.vertcat(self.scene.x, self.scene.u, self.model.p)
        stacked = ca.substitute(stacked, old, ca.vertcat(g.x, g.u, p))
        return ca.Function("recovered", [g.x, g.u, d], [stacked])

    @property
    def names(self) -> list[tuple[str, str]]:
        """(body, coordinate) of all coordinates of the scene."""
        return list(self.scene.recover)

    @property
    def x_names(self) -> list[tuple[str, str]]:
        """(body, coordinate) of each unknown of a pose."""
        return self.scene.x_names

    def block_of(self, bodies: Sequence[str]) -> int | None:
        """Return the place among the branches of the dyad that bodies belong to."""
        for k, block in enumerate(self.scene.blocks):
            group = self.scene.groups[block.group]
            held = {b for name in group.joints for b in self.mechanism.joints[name].bodies}
            if group.is_dyad and set(bodies) <= held and set(bodies) & set(group.bodies):
                return k
        return None

"""The poses of a design as variables of an NLP: closure, branch, points, all from the Model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import build, names_in
from mechdae.describe.mechanism import Mechanism
from mechdae.kernels.blocks import inverse
from mechdae.kernels.graphs import Graphs
from mechdae.model.model import FUNCTIONS, Model
from mechdae.model.reduction import Scene, scene

SX = ca.SX


def parameters_of(model: Model, names: Sequence[str], values: Any) -> Any:
    """Return p (np,) with some entries replaced by `values`; what depends on them follows."""
    own = dict(zip(names, ca.vertsplit(values), strict=True)) if len(names) else {}
    known = dict(zip(model.p_names, model.p_values.tolist(), strict=True))
    numbers = model.mechanism.parameters
    done: dict[str, Any] = {}

    def value(name: str) -> Any:
        if name not in done:
            number = numbers.get(name)
            if name in own:
                done[name] = own[name]
            elif isinstance(number, str):
                others = {other: value(other) for other in names_in(number)}
                done[name] = SX(build(number, others, FUNCTIONS))
            else:
                done[name] = SX(known[name])
        return done[name]

    return ca.vertcat(*[value(name) for name in model.p_names])


@dataclass(frozen=True)
class Pose:
    """Symbols of one pose: residuals (m,), branch measures (nb,) in [-1, 1], asked values."""

    residual: Any
    branch: Any
    values: Any


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
    outputs
        Points ``body.point`` and coordinates whose values are asked for.

    Attributes
    ----------
    nx
        Unknowns of a pose.
    function
        (x, u, free) -> residuals, branch measures, values.
    """

    def __init__(
        self, mechanism: Mechanism, driver: str, free: Sequence[str], outputs: Sequence[str]
    ) -> None:
        self.mechanism, self.free, self.outputs = mechanism, list(free), list(outputs)
        self.model = Model(mechanism, free=free)
        c = coordinate(mechanism, driver)
        bodies = tuple(dict.fromkeys(self._part(text) for text in outputs))
        self.scene: Scene = scene(self.model, (c,), bodies)
        self.graphs = Graphs(self.scene, SX(0, 1), 0)
        self.nx = self.graphs.nx
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
        asked = ca.vertcat(*[self._value(text) for text in outputs])
        asked = ca.substitute(
            self.scene.expression(asked), ca.vertcat(self.scene.x, self.scene.u),
            ca.vertcat(g.x, g.u),
        )  # fmt: skip
        parts = [ca.vertcat(*residuals), ca.vertcat(*signs), asked]
        inside = ca.Function("inside", [g.x, g.u, g.p], parts)
        self.function = ca.Function(
            "pose", [g.x, g.u, values], list(inside(g.x, g.u, p)), {"cse": True}
        )
        self.nb = len(g.blocks)

    def _part(self, text: str) -> str:
        return text.split(".")[0]

    def _value(self, text: str) -> Any:
        if text.count(".") == 1 and text.split(".")[1] not in ("angle", "slide"):
            return self.model.point(text)
        return self.model.coordinate(coordinate(self.mechanism, text))

    @property
    def x_names(self) -> list[tuple[str, str]]:
        """(body, coordinate) of each unknown of a pose."""
        return self.scene.x_names


def values_at(function: Any, x: Any, u: Any, free: Any) -> list[Any]:
    """Return results (k, ...) of a pose function at many poses."""
    count = len(u)
    mapped = function.map(count)
    results = mapped(np.atleast_2d(x).T, np.atleast_2d(u), ca.repmat(ca.DM(free), 1, count))
    return [np.array(part).T for part in results]

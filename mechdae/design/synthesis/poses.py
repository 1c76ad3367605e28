"""The poses of a design as variables of an NLP: closure, branch, points, all from the Model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.model import Model
from mechdae.equations.parameters import parameters_of
from mechdae.equations.reduction import Scene, model_of, scene
from mechdae.errors import UnavailableError
from mechdae.kernels.graphs.blocks import inverse
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import without_repeats
from mechdae.motion.measures.bars import driven_by_bars
from mechdae.motion.measures.transmission import Dyad, dyads
from mechdae.types import Floats, Graph, Sym

SX = ca.SX
SINE = "sine of "
"""Prefix of the asked value that is the sine of a dyad's transmission angle."""


def dimensions(free: Floats, given: Mapping[str, Floats | float]) -> Floats:
    """Return free and chosen parameters at a point of an NLP."""
    return np.concatenate([free, np.atleast_1d(given["choice"])])


class FreePoses:
    """Poses of a mechanism over free parameters.

    `asks`: model -> expressions over its coordinates by name, to be evaluated at poses.
    `tolerated`: names of parameters that deviate, free or not: they are symbols even where they are
    zero.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        driver: str,
        free: Sequence[str],
        bodies: Sequence[str],
        asks: Callable[[Model], Mapping[str, Any]],
        tolerated: Iterable[str] = (),
    ) -> None:
        self.mechanism: Mechanism = mechanism
        self.free: list[str] = list(free)
        c = coordinate(mechanism, driver)
        self.model: Model = model_of(mechanism, (c,), [*free, *tolerated])
        self.scene: Scene = scene(self.model, (c,), tuple(bodies))
        for group in self.scene.redundant:
            raise UnavailableError(
                f"group {group.name} has redundant constraints, its dimensions cannot be searched"
            )
        self.graphs: Graphs = Graphs(self.scene, SX(0, 1), 0)
        self.nx: int = self.graphs.nx
        g = self.graphs
        values = SX.sym("free", len(self.free))
        p = parameters_of(self.model, self.free, values)
        within: Any = dyads if mechanism.dimension == 2 else driven_by_bars
        self.dyads: list[Dyad] = within(self.scene)
        self.asked: dict[str, Sym] = {name: SX(e) for name, e in asks(self.model).items()}
        self.asked |= {SINE + d.joint: d.sine for d in self.dyads if self.branch_of(d) is None}
        residuals, signs = [], []
        for k, graph in enumerate(g.blocks):
            F, J, _ = graph.value(g.x, g.u)
            residuals.append(F)
            dyad = self._dyad_of(k)
            if dyad is not None and not (graph.size == 2 and dyad.group.kind == "RRR"):
                signs.append(self._over_graphs(dyad.sine))
                continue
            columns = [ca.sqrt(ca.sumsqr(J[:, k])) for k in range(graph.size)]
            size = SX(1)
            for column in columns:
                size *= column
            det = inverse(J)[1] if graph.size <= 4 else ca.det(J)
            signs.append(det / size)
        self.senses: slice = slice(len(signs), None)
        """Places among the branches of what is positive at every pose: senses of axes."""
        signs += [self._over_graphs(value) for value in self._senses()]
        names, parts = list(self.asked), list(self.asked.values())
        limits = self._over_graphs(ca.vertcat(*parts) if parts else SX(0, 1))
        self._spans, start = {}, 0
        for name, part in zip(names, parts, strict=True):
            self._spans[name] = slice(start, start + part.numel())
            start += part.numel()
        columns = [ca.vertcat(*residuals), ca.vertcat(*signs), limits]
        self.inside: Graph = ca.Function("inside", [g.x, g.u, g.p], columns)
        """(x, u, p) -> closure, branches and asked values."""
        results = list(self.inside(g.x, g.u, p))
        self.function: Graph = without_repeats("pose", [g.x, g.u, values], results)
        self.nb: int = len(signs)

    def _senses(self) -> list[Any]:
        """Return what is positive at a pose in space: cut joints hold with half turns too."""
        joints = {name for group in self.scene.groups for name in group.joints}
        every: list[tuple[str, Any]] = getattr(self.model, "senses", [])
        return [value for name, value in every if name in joints]

    @cached_property
    def margins(self) -> Floats:
        """Which branches (nb,) are determinants, that keep off zero; the others are senses."""
        found = np.ones(self.nb)
        found[self.senses] = 0.0
        return found

    def span(self, name: str) -> slice:
        """Return where one of the asked values is among all of them."""
        return self._spans[name]

    def part(self, stacked: Sym, name: str) -> Sym:
        """Return one of the asked values out of all, stacked along the last axis of arrays."""
        span = self._spans[name]
        return stacked[..., span] if isinstance(stacked, np.ndarray) else stacked[span]

    @cached_property
    def rates(self) -> Graph:
        """(x, u, free, v) -> what is left of the rate of closure, rates of the asked values."""
        x, u, d = SX.sym("x", self.nx), SX.sym("u"), SX.sym("d", len(self.free))
        v = SX.sym("v", self.nx)
        F, _, limits = self.function(x, u, d)
        both = [
            ca.jtimes(part, x, v) + ca.jacobian(part, u) if part.numel() else part
            for part in (F, limits)
        ]
        return ca.Function("rates", [x, u, d, v], [ca.densify(part) for part in both])

    @cached_property
    def recovered(self) -> Graph:
        """(x, u, p) -> all coordinates of the scene in the order of `names`."""
        scene = self.scene
        stacked = ca.vertcat(*scene.recover.values())
        return ca.Function("recovered", [scene.x, scene.u, self.model.p], [stacked])

    @property
    def names(self) -> list[tuple[str, str]]:
        """(body, coordinate) of all coordinates of the scene."""
        return list(self.scene.recover)

    @property
    def x_names(self) -> list[tuple[str, str]]:
        """(body, coordinate) of each unknown of a pose."""
        return self.scene.x_names

    def branch(self, x: Floats, u: float, d: Floats) -> Any:
        """Return the branch (nb,) of a pose."""
        return np.sign(np.array(self.function(x, u, d)[1]).ravel())

    # -- transmission angles -----------------------------------------------------------------

    def _over_graphs(self, expression: Sym) -> Sym:
        """Return an expression of the model over the symbols of the graphs."""
        g = self.graphs
        old, new = ca.vertcat(self.scene.x, self.scene.u), ca.vertcat(g.x, g.u)
        return ca.substitute(self.scene.expression(expression), old, new)

    def _dyad_of(self, k: int) -> Dyad | None:
        """Return the dyad whose branch a block alone decides; its sine is the branch then."""
        group = self.scene.groups[self.scene.blocks[k].group]
        dyads = [dyad for dyad in self.dyads if dyad.group is group and group.is_dyad]
        alone = sum(self.scene.groups[b.group] is group for b in self.scene.blocks) == 1
        return dyads[0] if dyads and alone else None

    def branch_of(self, dyad: Dyad) -> int | None:
        """Return the place among the branches of a dyad's sine, None where it is not there."""
        places = range(len(self.scene.blocks))
        return next((k for k in places if self._dyad_of(k) is dyad), None)

    def sine(self, dyad: Dyad, branch: Sym, values: Sym, sigma: Sym) -> Sym:
        """Return the sine of a dyad's transmission angle at a pose of `function`."""
        k = self.branch_of(dyad)
        return ca.fabs(self.sine_of(dyad, values)) if k is None else sigma[k] * branch[k]

    def sine_of(self, dyad: Dyad, values: Sym) -> Any:
        """Return the signed sine of a dyad that no branch tells, out of the asked values."""
        found = self.part(values, SINE + dyad.joint)
        return found[..., 0] if isinstance(found, np.ndarray) else found

"""Whether the redundant equations of redundant groups hold, and how large their gaps are.

Blocks with more equations than unknowns are checked by the kernels themselves, pose by pose
(see `Graphs.rates`); here are the equations left without unknowns, and the figures of both.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from mechdae.equations.groups import Group
from mechdae.kernels.graphs.pose import CLOSURE
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch
from mechdae.motion.assembly.closure import Gap, NoPose, bar_lengths, straight, worst
from mechdae.motion.assembly.mode_labels import Assembling, Chooser
from mechdae.motion.setup.scales import Constants
from mechdae.types import Booleans, Floats, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.reduction import Check, Scene

UNITS = {"m": "length", "rad": "angle", "1": "parameter"}


class Closing:
    """The equations of a scene's redundant groups.

    Parameters
    ----------
    graphs
        Kernels of the scene.
    """

    def __init__(self, graphs: Graphs) -> None:
        self.graphs: Graphs = graphs
        self.scene: Scene = graphs.scene
        self.checks: list[Check] = self.scene.checks
        self.blocks: list[int] = [b for b, graph in enumerate(graphs.blocks) if graph.redundant]
        groups = [group.index for group in self.scene.groups]
        self.check_group: list[int] = [groups.index(check.group) for check in self.checks]

    # -- equations without unknowns ----------------------------------------------------------

    @cached_property
    def _still(self) -> Booleans:
        """Angles that parameters alone decide: whole turns do not count."""
        moving = ca.vertcat(self.scene.x, self.scene.u)
        return np.array(
            [
                check.unit == "rad" and not ca.depends_on(check.residual, moving)
                for check in self.checks
            ],
            bool,
        )

    def _equations(self) -> Batch:
        scene, residuals = self.scene, [check.residual for check in self.checks]
        rows = [*residuals, *(self.graphs.blocks[b].F for b in self.blocks)]
        stacked = ca.densify(ca.vertcat(*rows)) if rows else ca.SX(0, 1)
        function = ca.Function("rows", [scene.x, scene.u, scene.model.p], [stacked])
        return Batch(function, shared=[2])

    def residuals(self, x: Unknowns, u: Floats, p: Floats) -> Floats:
        """Return the values of all equations, checks first, at poses (n, nx), (n, nu)."""
        values = self.graphs.cache("closing", self._equations)(x, u, p)[0]
        checks = values[:, : len(self.checks)]
        turns = np.where(self._still, 2 * np.pi * np.round(checks / (2 * np.pi)), 0.0)
        values[:, : len(self.checks)] -= turns
        return values

    def open(self, x: Unknowns, u: Floats, error: Floats, constants: Constants) -> Booleans:
        """Return which checks stay open at poses with the given bounds `error`, (n, nc)."""
        sizes = (constants.size_x, constants.size_u, constants.p, constants.scale, constants.floors)
        slope, rounding = (
            np.array(part) for part in self.graphs.check_bounds(*sizes, *constants.boxes)
        )
        shape = (len(self.checks), constants.boxes[0].shape[1])
        slope = slope.reshape(*shape, self.graphs.nx).max(axis=1)
        rounding = rounding.reshape(shape).max(axis=1)
        values = np.abs(self.residuals(x, u, constants.p)[:, : len(self.checks)])
        result = np.empty(values.shape, bool)
        for k, row in enumerate(slope):
            used = np.flatnonzero(row)  # other unknowns need not have a value
            allowed = rounding[k] + error[:, used] @ row[used]
            with np.errstate(invalid="ignore"):
                result[:, k] = ~(values[:, k] <= CLOSURE * allowed)
        return result

    # -- one pose ----------------------------------------------------------------------------

    def gap(self, b: int | None, group: int, x: Unknowns, u: Floats) -> Gap | None:
        """Return what stays open in block `b` (in the checks of a group, None) at a solved pose."""
        g = self.graphs
        constants = Constants(g, np.abs(u))
        rates = [] if g.single else [np.zeros(g.nu) for _ in g.driven]
        results = g.pose(x, u, *rates, constants.consts)
        error = np.array(results[1]).ravel()
        if b is not None:
            graph = g.blocks[b]
            F, _, Fz = graph.value_at(x, u, constants.p)
            r = g.units(constants.scale, constants.p)[1][b]
            noise = constants.rho[b]
            if graph.uses:
                noise += np.linalg.norm(np.abs(Fz) @ error[graph.uses] / r)
            if np.linalg.norm(F / r) <= CLOSURE * noise:
                return None
            size = np.array([constants.scale if v == "m" else 1.0 for v in graph.block.units])
            lengths = bar_lengths(self.scene.model.mechanism, graph.block.owners)
            gap = worst(straight(F, lengths)[0] / size, graph.block, constants.scale)
            return replace(gap, whole=float(np.linalg.norm(F / r)) * constants.scale)
        checked = np.array([check.group == group for check in self.checks], bool)
        if (
            not checked.any()
            or not self.open(x[None], u[None], error[None], constants)[0][checked].any()
        ):
            return None
        residuals = self.residuals(x[None], u[None], constants.p)[0][: len(checked)]
        owners = [check.owner for check in self.checks]
        residuals = straight(residuals, bar_lengths(self.scene.model.mechanism, owners))[0]
        values = np.where(checked, np.abs(residuals), 0.0)
        check = self.checks[int(np.argmax(values))]
        sizes = np.array([1.0 if each.unit == "m" else constants.scale for each in self.checks])
        return Gap(
            float(values.max()), check.unit, check.owner, whole=float((values * sizes).max())
        )

    # -- all poses ---------------------------------------------------------------------------

    def largest(self, x: Unknowns, u: Floats, p: Floats) -> dict[str, float]:
        """Return the largest residual by "length" [m] and "angle" [rad] over poses."""
        units = [check.unit for check in self.checks]
        units += [unit for b in self.blocks for unit in self.graphs.blocks[b].block.units]
        values = np.abs(self.residuals(x, u, p))
        found = {}
        for unit in dict.fromkeys(units):
            of_unit = values[:, [k for k, other in enumerate(units) if other == unit]]
            found[UNITS[unit]] = float(np.fmax.reduce(of_unit, axis=None, initial=0.0))
        return found


class ClosedPoses(Chooser):
    """Poses at which redundant equations hold."""

    def __init__(self, assembler: Assembling) -> None:
        self.closing: Closing = Closing(assembler.graphs)

    def after_block(
        self, group: Group, b: int | None, poses: list[Unknowns], u: Floats
    ) -> tuple[list[Floats], NoPose | None]:
        """Return the poses at which redundant equations hold, and the smallest gap if none.

        They are those of block `b`, or the group's equations without unknowns.
        """
        checked = [check for check in self.closing.checks if check.group == group.index]
        if not (checked if b is None else self.closing.graphs.blocks[b].redundant):
            return poses, None
        gaps = [self.closing.gap(b, group.index, x, u) for x in poses]
        closed = [x for x, gap in zip(poses, gaps, strict=True) if gap is None]
        left = [gap for gap in gaps if gap is not None]
        if closed or not left:
            return closed, None
        least = min(left, key=lambda gap: gap.size)
        return [], NoPose(group, least.size, at=least)

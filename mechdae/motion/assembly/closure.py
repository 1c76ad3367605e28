"""Whether the superfluous equations of redundant groups hold, and how large their gaps are.

Blocks with more equations than unknowns are checked by the kernels themselves, pose by pose
(see `Graphs.rates`); here are the equations left without unknowns, and the figures of both.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import Mechanism
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Block
from mechdae.kernels.graphs.pose import CLOSURE
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.batch import Batch
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Unknowns

UNITS = {"m": "length", "rad": "angle", "1": "parameter"}
MEANT = 1e-4
"""Share of its size up to which dimensions of a mechanism may be off though they should agree."""


@dataclass(frozen=True)
class Gap:
    """By how much a joint (or driver) stays open; ``unit`` is m or rad.

    ``superfluous`` tells that the group closes without some of its equations, ``whole`` is what
    stays open of all of them [m], angles over the size of the mechanism, nan: not known. ``reach``
    says how long links are to be.
    """

    size: float
    unit: str
    joint: str
    superfluous: bool = True
    whole: float = math.nan
    reach: str = ""

    def tolerance(self, size: float) -> float | None:
        """Return a tolerance that would do in a mechanism of that size, None: none is meant."""
        return closing_tolerance(self.whole, size)


def closing_tolerance(whole: float, size: float) -> float | None:
    """Return a tolerance for what stays open in all [m] in a mechanism of a size; None if none is.

    What is open by more than a ten-thousandth of the mechanism is no noise.
    """
    return float(f"1e{math.ceil(math.log10(2 * whole))}") if 0 < whole < MEANT * size else None


@dataclass(frozen=True)
class NoPose:
    """A group that has no pose here, and the gap; `starts` of a search that found none.

    ``at`` tells which equation of a redundant group stays open, ``free`` that none does: the
    group has a freedom of its own.
    """

    group: Group
    gap: float
    infinite: bool = False
    starts: int = 0
    at: Gap | None = None
    free: bool = False


class Closing:
    """The equations of a scene's redundant groups.

    Parameters
    ----------
    graphs
        Kernels of the scene.
    """

    def __init__(self, graphs: Graphs) -> None:
        self.graphs, self.scene = graphs, graphs.scene
        self.checks = self.scene.checks
        self.blocks = [b for b, graph in enumerate(graphs.blocks) if graph.redundant]
        groups = [group.index for group in self.scene.groups]
        self.check_group = [groups.index(check.group) for check in self.checks]

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

    @property
    def _residuals(self) -> Batch:
        batch: Batch = self.graphs.cache("closing", self._equations)
        return batch

    def _equations(self) -> Batch:
        scene, own = self.scene, [check.residual for check in self.checks]
        rows = [*own, *(self.graphs.blocks[b].F for b in self.blocks)]
        stacked = ca.densify(ca.vertcat(*rows)) if rows else ca.SX(0, 1)
        function = ca.Function("rows", [scene.x, scene.u, scene.model.p], [stacked])
        return Batch(function, shared=[2])

    def residuals(self, x: Unknowns, u: Floats, p: Floats) -> Floats:
        """Return the values of all equations, checks first, at poses (n, nx), (n, nu)."""
        values = self._residuals(x, u, p)[0]
        own = values[:, : len(self.checks)]
        turns = np.where(self._still, 2 * np.pi * np.round(own / (2 * np.pi)), 0.0)
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
        for k, own in enumerate(slope):
            used = np.flatnonzero(own)  # other unknowns need not have a value
            allowed = rounding[k] + error[:, used] @ own[used]
            with np.errstate(invalid="ignore"):
                result[:, k] = ~(values[:, k] <= CLOSURE * allowed)
        return result

    # -- one pose ----------------------------------------------------------------------------

    def gap(self, b: int | None, group: int, x: Unknowns, u: Floats) -> Gap | None:
        """Return what stays open in block `b` (in the checks of a group, None) at a solved pose."""
        g = self.graphs
        constants = Constants(g, np.abs(u))
        rates = [] if g.single else [np.zeros(g.nu) for _ in g.driven]
        results = g.pose(x, u, *rates, constants.vector())
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
        own = np.array([check.group == group for check in self.checks], bool)
        if not own.any() or not self.open(x[None], u[None], error[None], constants)[0][own].any():
            return None
        residuals = self.residuals(x[None], u[None], constants.p)[0][: len(own)]
        owners = [check.owner for check in self.checks]
        residuals = straight(residuals, bar_lengths(self.scene.model.mechanism, owners))[0]
        values = np.where(own, np.abs(residuals), 0.0)
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
            own = values[:, [k for k, other in enumerate(units) if other == unit]]
            found[UNITS[unit]] = float(np.fmax.reduce(own, axis=None, initial=0.0))
        return found


def bar_lengths(mechanism: Mechanism, owners: Iterable[str]) -> Floats:
    """Return the lengths of the `distance` joints that equations belong to, inf elsewhere."""
    bars = {name for name, joint in mechanism.joints.items() if joint.bar}
    values = mechanism.values() if bars else {}
    return np.array([values[f"{own}.length"] if own in bars else np.inf for own in owners])


def straight(F: Floats, lengths: Floats) -> tuple[Floats, Floats]:
    """Return equations in which (d^2/l - l)/2 is d - l, a gap in metres.

    And by what their derivatives are to be multiplied.
    """
    with np.errstate(invalid="ignore"):
        share = np.sqrt(np.maximum(1 + 2 * F / lengths, 0.0))
        changed = np.where(np.isfinite(lengths), lengths * (share - 1), F)
    slope = np.where(np.isfinite(lengths), 1 / np.maximum(share, 1e-3), 1.0)
    return changed, slope


def worst(F: Floats, block: Block, size: float) -> Gap:
    """Return the joint of a block's equations that stays open most.

    `F` are the residuals, lengths divided by `size`; lengths of quaternions are no gaps of joints.
    """
    rows = list(zip(F, zip(block.owners, block.units, strict=True), strict=True))
    open_by: dict[tuple[str, str], float] = {}
    for value, key in [row for row in rows if row[1][1] != "1"] or rows:
        open_by[key] = float(np.hypot(open_by.get(key, 0.0), value))
    (joint, unit), most = max(open_by.items(), key=lambda item: item[1])
    return Gap(most * (size if unit == "m" else 1.0), unit, joint)

"""Assembly modes: all poses at one value of the drivers, group by group.

Dyads (geared ones included) and platforms on three legs are solved by elimination, and their
count is proven; larger groups by Newton's method from many starts, and their count is only "found".
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.mechanism import GROUND
from mechdae.equations.groups import Group
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Local, local
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.elimination import BlockSolver, angle_slopes
from mechdae.motion.assembly.mode_labels import Chooser, ModeLabels
from mechdae.motion.assembly.nearest_mode import Nearest, Sketched
from mechdae.motion.assembly.turns.block_turns import BlockTurns, put
from mechdae.motion.setup.drivers import Sketch
from mechdae.types import Floats, Jacobian, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.reduction import Scene
    from mechdae.motion.assembly.group_search import GroupSearch
    from mechdae.motion.assembly.mode_tree import ModeTree


class Assembler:
    """Finds poses of a scene at given driver values.

    Parameters
    ----------
    graphs
        Kernels of the scene.
    sketch
        A rough pose; used to choose modes and whole turns.
    """

    def __init__(self, graphs: Graphs, sketch: Sketch) -> None:
        self.graphs: Graphs = graphs
        self.scene: Scene = graphs.scene
        inside = {GROUND, *(name for group in self.scene.groups for name in group.bodies)}
        joints = self.scene.model.mechanism.joints
        self.sketch: dict[str, float] = dict(sketch.angles)
        for angles in self.scene.cases("sketched angles"):
            self.sketch |= angles(self.scene, sketch)
        self.places: dict[NamedCoordinate, float] = {
            c: value
            for c, value in sketch.places.items()
            if self.scene.model.knows(c)
            if set(joints[c.part].bodies if c.part in joints else (c.part,)) <= inside
        }
        self.p: Floats = self.scene.model.p_values
        self.size: float = self.scene.model.mechanism.scale
        slopes = angle_slopes(self.scene, self.p) if graphs.blocks else {}
        self.solvers: list[BlockSolver] = [self._solver(graph, slopes) for graph in graphs.blocks]
        self.natural: Floats = self.scene.unknowns.sizes(self.size)
        self.turns: BlockTurns = BlockTurns(
            self.scene, graphs.blocks, self.solvers, self.sketch, self.places, self.natural
        )
        self.choosers: list[Chooser] = [make(self) for make in self.scene.cases("choosers")]
        self.labels: ModeLabels = ModeLabels(self)
        self.shortened = False
        """Whether the sketch was taken for a pose of its own, where other modes were not sought."""
        self._blocks_of: dict[int, list[int]] = {group.index: [] for group in self.scene.groups}
        for b, graph in enumerate(graphs.blocks):
            self._blocks_of[graph.block.group].append(b)

    def _solver(self, graph: BlockGraph, slopes: dict[int, list[float]]) -> BlockSolver:
        for make in self.scene.cases("block solvers"):
            found: BlockSolver | None = make(self.scene, graph, self.p, self.size, slopes)
            if found is not None:
                return found
        return BlockSolver(self.scene, graph, self.p, self.size, slopes)

    def blocks_of(self, group: Group) -> list[int]:
        return self._blocks_of[group.index]

    @property
    def endless_groups(self) -> list[Group]:
        """The groups of blocks whose turns move bodies solved later without end."""
        solvers = {
            self.scene.blocks[b].group for b, endless in enumerate(self.turns.endless) if endless
        }
        return [group for group in self.scene.groups if group.index in solvers]

    def labelled(self, group: Group) -> bool:
        """Return whether a group's modes have a label: not the driven link itself, not a weld."""
        return bool(self.blocks_of(group)) or not (group.driven or group.kind == "weld")

    # -- absolute coordinates --------------------------------------------------------------

    def coordinates(self, x: Unknowns, u: Floats) -> dict[tuple[str, str], float]:
        """Return all absolute coordinates at a pose."""
        recover = self.scene.recover
        values = self._local("q", lambda: ca.vertcat(*recover.values()))(x, u, self.p)
        return dict(zip(recover, values.ravel().tolist(), strict=True))

    def _local(self, key: Hashable, make: Callable[[], Sym]) -> Local:
        """Return the function of the expression over q that `make` gives; made once."""
        return local(self.scene, key, make)

    def group_jacobian(self, x: Unknowns, u: Floats, group: Group) -> Jacobian:
        """Return the group's share of the absolute Jacobian at a pose, in declared order."""

        def make() -> Sym:
            phi = ca.vertcat(*[self.scene.rows[i].expression for i in group.rows])
            return ca.jacobian(phi, self.scene.model.q[list(group.columns)])

        return self._local(("jacobian", group.index), make)(x, u, self.p)

    # -- one group -------------------------------------------------------------------------

    def candidates(
        self, group: Group, x: Unknowns, u: Floats, nearby: bool = False, search: bool = True,
        measured: bool = True, drawn: bool = False,
    ) -> tuple[list[Floats], bool, NoPose | None]:  # fmt: skip
        """Return all poses of a group for solved earlier groups, and whether that is proven.

        With `nearby`, a group of infinitely many modes (a gear ratio that is not rational)
        gives the one that Newton's method finds from the sketch. Without `search` a group that
        has no closed form gives nothing. By how much a group stays open is looked for only where
        that is to be `measured`: it costs many times what the poses do. With `drawn`, a block
        whose nearest mode the sketch is but for rounding is not searched for others.
        """
        poses, failure = self._possible(group, None, [x.copy()], u)
        if failure is not None:
            return [], True, failure
        proven, others = True, None
        for b in self.blocks_of(group):
            graph, solver, ahead = self.graphs.blocks[b], self.solvers[b], []
            for start in poses:
                z = start[graph.uses] if graph.uses else np.zeros(0)
                result = solver.solve(z, u)
                if result is not None and result.proven and len(result.x):
                    ahead += self.turned(b, result.x, start, u)
                else:
                    if others is None:
                        how = (nearby, search, measured, drawn)
                        others = self.search.of_group(group, x, u, *how)
                    ahead += others.poses(b, start, result, proven)
                    if others.answer is not None:
                        return others.answer
                    proven &= others.proven
                proven &= not self.turns.endless[b]
            if nearby:
                ahead = self.turns.further(b, ahead)
            poses, missed = self._possible(group, b, ahead, u)
            failure = missed or failure
        if others is not None:
            poses, failure = others.with_those_of_whole(poses), failure or others.failure
        left = poses
        for chooser in self.choosers:
            left = chooser.of_group(group, left, u)
        if poses and not left:
            failure = NoPose(group, 0.0)
        return left, proven, failure if not left else None

    def _possible(
        self, group: Group, b: int | None, poses: list[Floats], u: Floats
    ) -> tuple[list[Floats], NoPose | None]:
        """Return the poses that may be some after block `b`, None before the first."""
        failure = None
        for chooser in self.choosers:
            poses, missed = chooser.after_block(group, b, poses, u)
            failure = missed or failure
        return poses, failure

    def turned(
        self, b: int, solutions: Floats | Sequence[Floats], x: Floats, u: Floats
    ) -> list[Floats]:
        """Return the poses of solutions of block `b`, with their whole turns."""
        unknowns = self.graphs.blocks[b].own
        every = [turned for one in solutions for turned in self.turns.turned(b, one, x, u)]
        return self.turns.distinct(
            b, [self.polish(b, put(x, unknowns, one), u) for one in every], u
        )

    def polish(self, b: int, x: Unknowns, u: Floats) -> Floats:
        """Return x after a few Newton steps in block `b`; kept as it is at a fold."""
        graph = self.graphs.blocks[b]
        result, best = x.copy(), np.inf
        for _ in range(4):
            try:
                step = graph.step_at(result, u, self.p)
            except np.linalg.LinAlgError:
                return x
            size = float(np.abs(step).max())
            if not size < best:
                break
            best = size
            result[graph.own] -= step
        return result if np.abs(result - x).max() < 1e-3 else x

    # -- whole scene -----------------------------------------------------------------------

    def modes(self, u: Floats, by_paths: bool = False) -> ModeTree:
        """Return all modes at driver values `u`.

        With `by_paths` larger groups are solved by paths through complex dimensions too: only
        these can prove that a search has missed none.
        """
        from mechdae.motion.assembly.mode_tree import ModeTree

        self.search.by_paths = by_paths
        return ModeTree(self, u)

    @cached_property
    def search(self) -> GroupSearch:
        """What finds poses of groups that elimination has none of."""
        from mechdae.motion.assembly.group_search import GroupSearch

        return GroupSearch(self)

    @cached_property
    def sketched(self) -> Sketched:
        """What the sketch says about the groups."""
        return Sketched(self)

    def from_sketch(self, u: Floats) -> Nearest:
        """Return the pose of the whole mechanism nearest to the sketch at driver values `u`."""
        return self.sketched.nearest(u)

    def _coordinate(self, c: NamedCoordinate, x: Unknowns, u: Floats) -> float:
        """Return the value of a coordinate at a pose."""
        function = self._local(c.text, lambda: self.scene.model.coordinate(c))
        return float(function(x, u, self.p).item())

    def slides(self, group: Group, x: Unknowns, u: Floats) -> dict[str, float]:
        """Return the slides of a group's sliding joints [m], and s of its contacts."""
        mechanism = self.scene.model.mechanism
        found = {}
        for name in group.joints:
            if mechanism.joints[name].slides:
                c = coordinate(mechanism, f"{name}.slide")
                found[name] = self._coordinate(c, x, u)
        for chooser in self.choosers:
            found |= chooser.places(group, x, u)
        return {name: found[name] for name in group.joints if name in found}

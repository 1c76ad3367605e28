"""Assembly modes: all poses at one value of the drivers, group by group.

Dyads (geared ones included) and platforms on three legs are solved by elimination, and their
count is proven; larger groups by Newton's method from many starts, and their count is only "found".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import LENGTH
from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.mechanism import GROUND
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene, own_freedom
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.local import Local, local
from mechdae.motion.assembly.closure import Closing, Gap, NoPose
from mechdae.motion.assembly.contacts import Contacts, ContactSolver
from mechdae.motion.assembly.elimination import BlockSolver, Solutions, angle_slopes
from mechdae.motion.assembly.idle_freedom import free_poses, moving
from mechdae.motion.assembly.mode_labels import ModeLabels
from mechdae.motion.assembly.nearest_mode import Nearest, Sketched
from mechdae.motion.assembly.orientation_checks import OrientationChecks, angles_from_sketch
from mechdae.motion.assembly.turns.block_turns import BlockTurns, put
from mechdae.motion.assembly.turns.whole_turns import WholeTurns
from mechdae.motion.setup.drivers import Sketch
from mechdae.numerics.least_squares import solve
from mechdae.numerics.null_space import dependent
from mechdae.types import Floats, Jacobian, Json, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.assembly.linkage.linkage_group import LinkageGroup
    from mechdae.motion.assembly.linkage.rigid_parts import GroupPoses
    from mechdae.motion.assembly.mode_tree import ModeTree
    from mechdae.motion.assembly.multistart import BlockSearch, BlockSolutions
    from mechdae.motion.assembly.three_legs import Truss

REMEMBERED = 15
"""Earlier searches whose solutions are kept beside the last one's."""


def _three_legs(scene: Scene, group: Group, p: Floats) -> Truss | None:
    from mechdae.motion.assembly.three_legs import truss

    return truss(scene, group, p)


def _linkage(scene: Scene, group: Group, p: Floats) -> LinkageGroup | None:
    from mechdae.motion.assembly.linkage.linkage_group import linkage_group

    return linkage_group(scene, group, p)


def _in_space(scene: Scene, group: Group, p: Any) -> Any:
    from mechdae.motion.assembly.spatial.spatial_group import spatial_group

    return spatial_group(scene, group, p)


WAYS = (_three_legs, _linkage, _in_space)
"""Ways to find all poses of a group whose blocks have no closed form, tried in this order."""


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
        self.graphs, self.scene = graphs, graphs.scene
        inside = {GROUND, *(name for group in self.scene.groups for name in group.bodies)}
        joints = self.scene.model.mechanism.joints
        self.sketch = dict(sketch.angles) | angles_from_sketch(self.scene, sketch)
        self.places = {
            c: value
            for c, value in sketch.places.items()
            if self.scene.model.knows(c)
            if set(joints[c.part].bodies if c.part in joints else (c.part,)) <= inside
        }
        self.p = self.scene.model.p_values
        self.size = self.scene.model.mechanism.scale
        whole = WholeTurns(self.scene, self.sketch, self.p)
        slopes = angle_slopes(self.scene, self.p) if graphs.blocks else {}
        self.solvers = [
            self._solver(graph, slopes, any(self.scene.unknowns.places[graph.own]))
            for graph in graphs.blocks
        ]
        self.natural = self.scene.unknowns.sizes(self.size)
        self.turns = BlockTurns(
            self.scene, graphs.blocks, self.solvers, whole, self.sketch, self.places, self.natural
        )
        self.contacts = Contacts(self.scene, self.p)
        self.closing = Closing(graphs)
        self.senses = OrientationChecks(self.scene)
        self.labels = ModeLabels(self)
        self.shortened = False
        """Whether the sketch was taken for a pose of its own, where other modes were not sought."""
        self.by_paths = False
        """Whether larger groups are solved by paths too: all modes are asked for."""
        self._ways: dict[tuple[int, bool], tuple[Any, ...]] = {}
        self.counted: dict[int, list[GroupPoses]] = {}
        """What paths through complex dimensions found, by group."""
        self._searches: dict[int, BlockSearch] = {}
        self._looked_for: dict[Any, Any] = {}
        self.searched: dict[int, list[BlockSolutions]] = {}
        """What searches from many starts found, by group."""
        self.looked_at: dict[int, list[int]] = {}
        """Boxes after which it is known that they have missed none; 0: it is not."""
        self._blocks_of: dict[int, list[int]] = {group.index: [] for group in self.scene.groups}
        for b, graph in enumerate(graphs.blocks):
            self._blocks_of[graph.block.group].append(b)
        self.free: list[Group] = []
        """Groups met with a freedom of their own."""

    def _solver(
        self, graph: BlockGraph, slopes: dict[int, list[float]], contact: bool
    ) -> BlockSolver:
        if graph.redundant:
            from mechdae.motion.assembly.redundant import RedundantSolver

            return RedundantSolver(self.scene, graph, self.p, self.size, slopes)
        solver = BlockSolver(self.scene, graph, self.p, self.size, slopes)
        if not contact or solver.linear:
            return solver
        return ContactSolver(self.scene, graph, self.p, self.size, slopes)

    def blocks_of(self, group: Group) -> list[int]:
        return self._blocks_of[group.index]

    @property
    def endless_groups(self) -> list[Group]:
        """The groups of blocks whose turns move bodies solved later without end."""
        own = {
            self.scene.blocks[b].group for b, endless in enumerate(self.turns.endless) if endless
        }
        return [group for group in self.scene.groups if group.index in own]

    def labelled(self, group: Group) -> bool:
        """Return whether a group's modes have a label: not the driven link itself, not a weld."""
        return bool(self.blocks_of(group)) or not (group.driven or group.kind == "weld")

    # -- absolute coordinates --------------------------------------------------------------

    def coordinates(self, x: Unknowns, u: Floats) -> dict[tuple[str, str], float]:
        """Return all absolute coordinates at a pose."""
        recover = self.scene.recover
        values = self._local("q", lambda: ca.vertcat(*recover.values()))(x, u, self.p)
        return dict(zip(recover, values.ravel().tolist(), strict=True))

    def _local(self, key: Any, make: Callable[[], Any]) -> Local:
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
        found, failure = self._closed(group, None, [x.copy()], u)
        if failure is not None:
            return [], True, failure
        proven = True
        also: list[Any] | None = None
        for b in self.blocks_of(group):
            graph, solver = self.graphs.blocks[b], self.solvers[b]
            ahead = []
            for start in found:
                z = start[graph.uses] if graph.uses else np.zeros(0)
                result = solver.solve(z, u) or self._of_loop(b, start, u)
                lone = self._drawn(b, start, u) if result is None and drawn else None
                if lone is not None and lone[1]:
                    self.shortened = True
                    ahead += self._turned(b, [lone[0]], start, u)
                    proven = False
                    continue
                if result is None and search and also is None:
                    listed = self._of_whole(group, x, u, nearby, measured)
                    if listed is not None and listed[1]:
                        return listed[0], listed[2], listed[3]
                    also = listed[0] if listed is not None else []
                at = None
                if result is None and not search:
                    return [], False, None
                if result is None or (nearby and result.infinite):
                    most = 1 if result is not None else None
                    self._check_freedom(group, b, start, u)
                    solutions, gap, infinite = self._search(b, start, u, most), 0.0, False
                    sure = proven and most is None and self._no_others(group, b, start, u)
                else:
                    solutions, sure = result.x, result.proven
                    gap, infinite, at = result.gap, result.infinite, result.gap_at
                    if solver.linear and not len(solutions):
                        self._check_freedom(group, b, start, u)
                proven &= sure and not self.turns.endless[b]
                if result is not None and result.free:
                    self.free.append(group)
                if not len(solutions):
                    starts = 0 if result is not None else self.searched[group.index][-1].starts
                    free = group in self.free if result is None else result.free
                    if (gap > 0 or starts) and at is None and measured:
                        at = self._opening(b, start, u)
                        gap = at.size
                    failure = NoPose(group, gap, infinite, starts, at, free)
                own = self._turned(b, solutions, start, u)
                if nearby and not sure and not (result is not None and result.free):
                    exact = self._own_pose(b, start, u, not len(solutions))
                    if exact is not None and not any(self.turns.same(b, exact, x) for x in own):
                        own, failure = [*own, exact], None
                ahead += own
            ahead = self.senses.without_wrong_sense(group, b, ahead, u)
            found, missed = self._closed(group, b, ahead, u)
            failure = missed or failure
        found = [*found, *(pose for pose in also or () if not self._among(group, pose, found))]
        touching = [pose for pose in found if self.contacts.touch(group, pose, u)]
        touching = self.senses.met(group, touching, u)
        if found and not touching:
            failure = NoPose(group, 0.0)
        return touching, proven, failure if not touching else None

    def _turned(self, b: int, solutions: Any, x: Unknowns, u: Any) -> list[Floats]:
        """Return the poses of solutions of block `b`, with their whole turns."""
        own = self.graphs.blocks[b].own
        every = [turned for one in solutions for turned in self.turns.turned(b, one, x, u)]
        return self.turns.distinct(b, [self._polish(b, put(x, own, one), u) for one in every], u)

    def _drawn(self, b: int, x: Unknowns, u: Floats) -> tuple[Floats, bool] | None:
        """Return the solution of a spatial block that the sketch is but for rounding, or None.

        The second value tells whether no other mode is as near to the sketch.
        """
        if self.scene.model.mechanism.dimension == 2:
            return None
        from mechdae.motion.assembly.spatial.drawn_pose import drawn_pose

        return drawn_pose(self.sketched, b, x, u)

    def _own_pose(self, b: int, x: Unknowns, u: Floats, alone: bool) -> Unknowns | None:
        """Return x with the solution of a block that the sketch is but for rounding, or None.

        `alone` tells that no other was found: all that is said of a block in space is fitted then.
        """
        if self.scene.model.mechanism.dimension == 2:
            return self.sketched.own_pose(b, x, u)
        found = self._drawn(b, x, u)
        if found is not None:
            return put(x, self.graphs.blocks[b].own, found[0])
        if not alone:
            return None
        from mechdae.motion.assembly.spatial.fitted_start import fitted_start

        start = fitted_start(self.sketched, b, x, u)
        return None if start is None else self.sketched.own_pose(b, x, u, start)

    def _closed(
        self, group: Group, b: int | None, poses: list[Unknowns], u: Floats
    ) -> tuple[list[Floats], NoPose | None]:
        """Return the poses at which superfluous equations hold, and the smallest gap if none.

        They are those of block `b`, or the group's equations without unknowns.
        """
        checked = [check for check in self.scene.checks if check.group == group.index]
        if not (checked if b is None else self.graphs.blocks[b].redundant):
            return poses, None
        gaps = [self.closing.gap(b, group.index, x, u) for x in poses]
        closed = [x for x, gap in zip(poses, gaps, strict=True) if gap is None]
        left = [gap for gap in gaps if gap is not None]
        if closed or not left:
            return closed, None
        least = min(left, key=lambda gap: gap.size)
        return [], NoPose(group, least.size, at=least)

    def _check_freedom(self, group: Group, b: int, x: Unknowns, u: Floats) -> None:
        """Raise when a group moves by itself at the pose that Newton's method finds first."""
        graph = self.graphs.blocks[b]
        sketch = [self.turns.wanted(i, x, u) for i in graph.own]
        sizes = self.natural[graph.own]
        found = free_poses(graph, put(x, graph.own, sketch), u, self.p, sizes, self.size)
        if found is None:
            return
        q, moved = (self.coordinates(pose, u) for pose in found)
        bodies = [
            c.owner
            for c in self.scene.recovered
            if abs(moved[c.key] - q[c.key]) > 1e-6 * (self.size if c.kind is LENGTH else 1.0)
        ]
        raise own_freedom(group, bodies, self.dependent(group, found[0], u))

    def superfluous(self, x: Unknowns, u: Floats) -> list[Json]:
        """Return joints and number of superfluous equations of each redundant group."""
        return [
            {"joints": self.dependent(group, x, u), "count": group.superfluous}
            for group in self.scene.redundant
        ]

    def dependent(self, group: Group, x: Unknowns, u: Floats) -> list[str]:
        """Return joints and drivers of a group whose equations depend on each other at a pose."""
        lengths = self.scene.model.coordinates.lengths[list(group.columns)]
        weights = np.where(lengths, self.size, 1.0)
        rows = np.flatnonzero(dependent(self.group_jacobian(x, u, group) * weights))
        owners = list(dict.fromkeys(self.scene.rows[group.rows[k]].owner for k in rows))
        return self.scene.model.sharing(owners)

    def _of_loop(self, b: int, x: Unknowns, u: Floats) -> Solutions | None:
        """Return the solutions of a block that is a module of a vector loop, None for others."""
        mechanism = self.scene.model.mechanism
        if mechanism.dimension == 2 or mechanism.closure is None:
            return None
        from mechdae.motion.assembly.vector_loops import of_loop

        known, values = self.coordinates(x, u), mechanism.values()
        for name, joint in mechanism.joints.items():
            known |= {(name, word): values[f"{name}.{word}"] for word, _ in joint.numbers()}
        graph = self.graphs.blocks[b]
        z = x[graph.uses] if graph.uses else np.zeros(0)
        return of_loop(self.solvers[b], z, u, known)

    def _of_whole(
        self, group: Group, x: Unknowns, u: Floats, nearby: bool, measured: bool
    ) -> tuple[list[Floats], bool, bool, NoPose | None] | None:
        """Return all poses of a group by one of `WAYS`, None where there is none for it.

        They are poses, whether these are all that can be looked for, whether that is proven, and
        what is known when there is no pose.
        """
        for shape in self._shapes(group):
            found = shape.solve(self.coordinates(x, u), u)
            if found is None:
                continue
            if found.generic:
                self.counted.setdefault(group.index, []).append(found)
            if found.free:
                self.free.append(group)
                own = self.blocks_of(group)
                if nearby and len(own) == 1:
                    self._check_freedom(group, own[0], x, u)
            poses = self._placed(group, found.poses, x, u)
            whole = found.proven or not found.generic
            sure = found.proven and not any(self.turns.endless[b] for b in self.blocks_of(group))
            failure = None
            if not poses and whole:
                at = self._opened(group, x, u) if found.generic and measured else None
                gap = found.gap if at is None else at.size
                failure = NoPose(group, gap, at=at, free=found.free)
            return poses, whole, sure, failure
        return None

    def _shapes(self, group: Group) -> tuple[Any, ...]:
        """Return the ways to find all poses of a group at once."""
        key = (group.index, self.by_paths)
        if key not in self._ways:
            ways = WAYS if self.by_paths else WAYS[:1]
            shapes = (way(self.scene, group, self.p) for way in ways)
            self._ways[key] = tuple(shape for shape in shapes if shape is not None)
        return self._ways[key]

    def _opened(self, group: Group, x: Unknowns, u: Any) -> Gap | None:
        """Return which joint of a group of one block stays open and by how much."""
        own = self.blocks_of(group)
        return self._opening(own[0], x, u) if len(own) == 1 else None

    def _opening(self, b: int, x: Unknowns, u: Floats) -> Gap:
        from mechdae.motion.assembly.least_gap import opening, reach

        model, group = self.scene.model, self.scene.blocks[b].group
        gap = opening(self.solvers[b], model, x, u)

        def place(point: str) -> Floats:
            return self._local(("point", point), lambda: model.point(point))(x, u, self.p).ravel()

        own = next(one for one in self.scene.groups if one.index == group)
        return replace(gap, reach=reach(model.mechanism, own, place))

    def _placed(
        self, group: Group, poses: list[dict[tuple[str, str], float]], x: Unknowns, u: Floats
    ) -> list[Floats]:
        """Return poses given as coordinates of bodies as unknowns, with their whole turns."""
        found = []
        for q in poses:
            ahead = [x]
            for b in self.blocks_of(group):
                own = self.graphs.blocks[b].own
                solution = np.array([q[self.scene.x_names[i]] for i in own])
                turned = [
                    [
                        self._polish(b, put(y, own, s), u)
                        for s in self.turns.turned(b, solution, y, u, True)
                    ]
                    for y in ahead
                ]
                ahead = [pose for poses in turned for pose in self.turns.distinct(b, poses, u)]
            found += ahead
        return found

    def _polish(self, b: int, x: Unknowns, u: Floats) -> Floats:
        """Return x after a few Newton steps in block `b`; kept as it is at a fold."""
        graph = self.graphs.blocks[b]
        result, best = x.copy(), np.inf
        for _ in range(4):
            F, J, _ = graph.value_at(result, u, self.p)
            try:
                step = solve(J, F)
            except np.linalg.LinAlgError:
                return x
            size = float(np.abs(step).max())
            if not size < best:
                break
            best = size
            result[graph.own] -= step
        return result if np.abs(result - x).max() < 1e-3 else x

    def _among(self, group: Group, x: Unknowns, poses: list[Unknowns]) -> bool:
        """Return whether a pose of a group is one of others."""
        own = self.blocks_of(group)
        return any(all(self.turns.same(b, x, y) for b in own) for y in poses)

    def _search(self, b: int, x: Unknowns, u: Floats, most: int | None = None) -> Any:
        """Return the distinct solutions that Newton's method finds, the sketch its first start."""
        from mechdae.motion.assembly.multistart import CROWD, MOST, BlockSearch

        graph, solver = self.graphs.blocks[b], self.solvers[b]
        if b not in self._searches:
            sizes = self.natural[graph.own]
            self._searches[b] = BlockSearch(solver, sizes, self.turns.lattices[b])
        angles = dict(zip(graph.own, solver.angle, strict=True))
        hint = [self.turns.whole.start(i, x, u) if angle else np.nan for i, angle in angles.items()]
        z = x[graph.uses] if graph.uses else np.zeros(0)
        counts = [run.generic for run in self.counted.get(graph.block.group, ()) if run.bounded]
        crowd = min([*counts, CROWD])
        asked = (b, z.tobytes(), np.asarray(u).tobytes(), repr(hint), most or MOST, crowd)
        known = self._looked_for.get(asked)
        if known is None:  # a mode is labelled where it was looked for
            found = self._searches[b](z, u, np.array(hint), most or MOST, crowd)
            sizes = self.natural[graph.own]
            free = moving(graph, found.x, x, u, self.p, sizes, self.size)
            if free.any():  # axes of the other sense are no pose of the group
                every = [put(x, graph.own, own) for own in found.x]
                fine = {id(pose) for pose in self.senses.possible(b, every, u)}
                kept = np.array([id(pose) in fine for pose in every])
                found, free = found.only(kept), free[kept]
            known = (found, free)
            self._looked_for = {asked: known, **dict(list(self._looked_for.items())[:REMEMBERED])}
        found, free = known
        self.searched.setdefault(graph.block.group, []).append(found)
        if free.any():
            self.free += [group for group in self.scene.groups if group.index == graph.block.group]
        return found.x[~free]

    def _no_others(self, group: Group, b: int, x: Unknowns, u: Floats) -> bool:
        """Return whether the last search of a block has missed no solution; only for all modes."""
        from mechdae.motion.assembly.no_others import no_others

        found = self.searched[group.index][-1]
        if not self.by_paths or group.index in self.counted or group in self.free:
            return False
        z = x[self.graphs.blocks[b].uses] if self.graphs.blocks[b].uses else np.zeros(0)
        boxes = no_others(self._searches[b], found.x, z, u, (self.senses, b))
        self.looked_at.setdefault(group.index, []).append(boxes)
        return boxes > 0

    def searches(self) -> list[Json]:
        """Return what was searched for: group, starts, solutions, fewest starts that led to one."""
        names = {group.index: group.name for group in self.scene.groups}
        return [
            {
                "group": names[index],
                "starts": sum(found.starts for found in runs),
                "found": sum(len(found.x) for found in runs),
                "least_hits": min((int(n) for found in runs for n in found.hits), default=0),
            }
            for index, runs in self.searched.items()
        ]

    def basis(self) -> str:
        """Return why there are no other modes than those listed, group by group."""
        names = {group.index: group.name for group in self.scene.groups}
        lines = []
        for index, runs in self.counted.items():
            texts = dict.fromkeys(run.basis or run.partly for run in runs)
            lines += [f"{names[index]}: {text}" for text in texts]
        for index in self.searched:
            boxes = self.looked_at.get(index, [0])
            text = f", no others in {sum(boxes)} boxes" if all(boxes) else ""
            lines.append(f"{names[index]}: search from many starts{text}")
        return "; ".join(lines) or "elimination"

    @property
    def singular_paths(self) -> int:
        """Paths that ended in singular poses or at infinity, of all groups."""
        return sum(run.singular for runs in self.counted.values() for run in runs)

    # -- whole scene -----------------------------------------------------------------------

    def modes(self, u: Floats, by_paths: bool = False) -> ModeTree:
        """Return all modes at driver values `u`.

        With `by_paths` larger groups are solved by paths through complex dimensions too: only
        these can prove that a search has missed none.
        """
        from mechdae.motion.assembly.mode_tree import ModeTree

        self.by_paths = by_paths
        return ModeTree(self, u)

    @cached_property
    def sketched(self) -> Sketched:
        """What the sketch says about the groups."""
        return Sketched(self)

    def from_sketch(self, u: Floats) -> Nearest:
        """Return the pose of the whole mechanism nearest to the sketch at driver values `u`."""
        return self.sketched.nearest(u)

    def _coordinate(self, c: NamedCoordinate, x: Unknowns, u: Floats) -> float:
        """Return the value of a coordinate at a pose."""
        function = self._local(c, lambda: self.scene.model.coordinate(c))
        return float(function(x, u, self.p).item())

    def slides(self, group: Group, x: Unknowns, u: Floats) -> dict[str, float]:
        """Return the slides of a group's sliding joints [m], and s of its contacts."""
        mechanism = self.scene.model.mechanism
        found = {}
        for name in group.joints:
            if mechanism.joints[name].slides:
                c = coordinate(mechanism, f"{name}.slide")
                found[name] = self._coordinate(c, x, u)
            if mechanism.joints[name].on_curve:
                found[name] = self.contacts.place(name, x, u)
        return found

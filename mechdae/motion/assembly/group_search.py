"""Poses of groups that elimination has none of: by other shapes, many starts, the sketch itself.

What is tried, in this order: a module of a vector loop, a group solved at once (three legs, by
paths other linkages and spatial ones), Newton's method from many starts; last the sketch, where
it is a pose but for rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from mechdae.additions import of_cases
from mechdae.describe.coordinate_kinds import LENGTH
from mechdae.equations.groups import Group, own_freedom
from mechdae.kernels.run.functions import local
from mechdae.motion.assembly.closure import Gap, NoPose
from mechdae.motion.assembly.idle_freedom import free_poses, moving
from mechdae.motion.assembly.mode_labels import Assembling
from mechdae.motion.assembly.nearest_mode import Sketched
from mechdae.motion.assembly.other_forms import Solutions
from mechdae.motion.assembly.sketch_as_pose import own_pose
from mechdae.motion.assembly.turns.block_turns import put
from mechdae.numerics.null_space import dependent
from mechdae.records import dataclass
from mechdae.types import Floats, Json, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.reduction import Scene
    from mechdae.kernels.graphs.blocks import BlockGraph
    from mechdae.motion.assembly.multistart import BlockSearch, BlockSolutions
    from mechdae.motion.assembly.turns.block_turns import BlockTurns
    from mechdae.motion.cases.larger_groups.rigid_parts import GroupPoses

REMEMBERED = 15
"""Earlier searches whose solutions are kept beside the last one's."""


class SketchedAssembling(Assembling, Protocol):
    """One that knows what the sketch says of its groups too."""

    @property
    def sketched(self) -> Sketched: ...


class GroupSearch:
    """What is tried beyond elimination, and what was found by it.

    Attributes
    ----------
    by_paths
        Whether larger groups are solved by paths too: all modes are asked for.
    counted, searched
        What paths through complex dimensions, and searches from many starts found, by group.
    looked_at
        Boxes after which it is known that a search has missed none; 0: it is not.
    free
        Groups met with a freedom of their own.
    """

    def __init__(self, assembler: SketchedAssembling) -> None:
        self.assembler: SketchedAssembling = assembler
        self.scene: Scene = assembler.scene
        self.p: Floats = assembler.p
        self.size: float = assembler.size
        self.blocks: list[BlockGraph] = assembler.graphs.blocks
        self.turns: BlockTurns = assembler.turns
        self.blocks_of: Callable[[Group], list[int]] = assembler.blocks_of
        self.by_paths = False
        self._ways: dict[tuple[int, bool], tuple[Any, ...]] = {}
        self.counted: dict[int, list[GroupPoses]] = {}
        self._searches: dict[int, BlockSearch] = {}
        self._looked_for: dict[Any, Any] = {}
        self.searched: dict[int, list[BlockSolutions]] = {}
        self.looked_at: dict[int, list[int]] = {}
        self.free: list[Group] = []

    def of_group(
        self,
        group: Group,
        x: Floats,
        u: Floats,
        nearby: bool,
        search: bool,
        measured: bool,
        drawn: bool,
    ) -> OtherPoses:
        """Return what finds the poses of a group; the rest as of `Assembler.candidates`."""
        return OtherPoses(self, group, x, u, nearby, search, measured, drawn)

    def _with_senses(self, b: int, poses: list[Floats], u: Floats) -> list[Floats]:
        """Return the poses that may be some as far as what is positive in a block tells."""
        for chooser in self.assembler.choosers:
            poses = chooser.possible(b, poses, u)
        return poses

    def drawn(self, b: int, x: Unknowns, u: Floats) -> tuple[Floats, bool] | None:
        """Return the solution of a spatial block that the sketch is but for rounding, or None.

        The second value tells whether no other mode is as near to the sketch.
        """
        if self.scene.model.mechanism.dimension == 2:
            return None
        from mechdae.motion.assembly.spatial.drawn_pose import drawn_pose

        return drawn_pose(self.assembler.sketched, b, x, u)

    def own_pose(self, b: int, x: Floats, u: Floats, alone: bool) -> Floats | None:
        """Return x with the solution of a block that the sketch is but for rounding, or None.

        `alone` tells that no other was found: all that is said of a block in space is fitted then.
        """
        if self.scene.model.mechanism.dimension == 2:
            return own_pose(self.assembler.sketched, b, x, u)
        found = self.drawn(b, x, u)
        if found is not None:
            return put(x, self.blocks[b].own, found[0])
        if not alone:
            return None
        from mechdae.motion.assembly.spatial.drawn_pose import fitted_start

        start = fitted_start(self.assembler.sketched, b, x, u)
        return None if start is None else own_pose(self.assembler.sketched, b, x, u, start)

    def check_freedom(self, group: Group, b: int, x: Unknowns, u: Floats) -> None:
        """Raise when a group moves by itself at the pose that Newton's method finds first."""
        graph = self.blocks[b]
        sketch = [self.turns.wanted(i, x, u) for i in graph.own]
        sizes = self.assembler.natural[graph.own]
        found = free_poses(graph, put(x, graph.own, sketch), u, self.p, sizes, self.size)
        if found is None:
            return
        q, moved = (self.assembler.coordinates(pose, u) for pose in found)
        bodies = [
            c.owner
            for c in self.scene.recovered
            if abs(moved[c.key] - q[c.key]) > 1e-6 * (self.size if c.kind is LENGTH else 1.0)
        ]
        raise own_freedom(group, bodies, self.dependent(group, found[0], u))

    def superfluous(self, x: Unknowns, u: Floats) -> list[Json]:
        """Return joints and number of redundant equations of each redundant group."""
        return [
            {"joints": self.dependent(group, x, u), "count": group.superfluous}
            for group in self.scene.redundant
        ]

    def dependent(self, group: Group, x: Unknowns, u: Floats) -> list[str]:
        """Return joints and drivers of a group whose equations depend on each other at a pose."""
        lengths = self.scene.model.coordinates.lengths[list(group.columns)]
        weights = np.where(lengths, self.size, 1.0)
        rows = np.flatnonzero(dependent(self.assembler.group_jacobian(x, u, group) * weights))
        owners = list(dict.fromkeys(self.scene.rows[group.rows[k]].owner for k in rows))
        return self.scene.model.sharing(owners)

    def of_loop(self, b: int, x: Unknowns, u: Floats) -> Solutions | None:
        """Return the solutions of a block that is a module of a vector loop, None for others."""
        mechanism = self.scene.model.mechanism
        if mechanism.dimension == 2 or mechanism.closure is None:
            return None
        from mechdae.motion.assembly.vector_loops import of_loop

        known, values = self.assembler.coordinates(x, u), mechanism.values()
        for name, joint in mechanism.joints.items():
            known |= {(name, word): values[f"{name}.{word}"] for word, _ in joint.numbers()}
        graph = self.blocks[b]
        z = x[graph.uses] if graph.uses else np.zeros(0)
        return of_loop(self.assembler.solvers[b], z, u, known)

    def of_whole(
        self, group: Group, x: Unknowns, u: Floats, nearby: bool, measured: bool
    ) -> tuple[list[Floats], bool, bool, NoPose | None] | None:
        """Return all poses of a group by a case that has a finder, None where there is none for it.

        They are poses, whether these are all that can be looked for, whether that is proven, and
        what is known when there is no pose.
        """
        for shape in self._shapes(group):
            found = shape.solve(self.assembler.coordinates(x, u), u)
            if found is None:
                continue
            if found.generic:
                self.counted.setdefault(group.index, []).append(found)
            if found.free:
                self.free.append(group)
                blocks = self.blocks_of(group)
                if nearby and len(blocks) == 1:
                    self.check_freedom(group, blocks[0], x, u)
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
            questions = ("finders", "finders by paths") if self.by_paths else ("finders",)
            ways = (way for question in questions for way in of_cases(question))
            shapes = (way(self.scene, group, self.p) for way in ways)
            self._ways[key] = tuple(shape for shape in shapes if shape is not None)
        return self._ways[key]

    def _opened(self, group: Group, x: Unknowns, u: Floats) -> Gap | None:
        """Return which joint of a group of one block stays open and by how much."""
        blocks = self.blocks_of(group)
        return self.opening(blocks[0], x, u) if len(blocks) == 1 else None

    def opening(self, b: int, x: Unknowns, u: Floats) -> Gap:
        from mechdae.motion.assembly.least_gap import opening, reach

        model, group = self.scene.model, self.scene.blocks[b].group
        gap = opening(self.assembler.solvers[b], model, x, u)

        def place(point: str) -> Floats:
            return local(self.scene, ("point", point), lambda: model.point(point))(
                x, u, self.p
            ).ravel()

        chosen = next(one for one in self.scene.groups if one.index == group)
        return replace(gap, reach=reach(model.mechanism, chosen, place))

    def _placed(
        self, group: Group, poses: list[dict[tuple[str, str], float]], x: Unknowns, u: Floats
    ) -> list[Floats]:
        """Return poses given as coordinates of bodies as unknowns, with their whole turns."""
        found = []
        for q in poses:
            ahead = [x]
            for b in self.blocks_of(group):
                unknowns = self.blocks[b].own
                solution = np.array([q[self.scene.x_names[i]] for i in unknowns])
                turned = [
                    [
                        self.assembler.polish(b, put(y, unknowns, s), u)
                        for s in self.turns.turned(b, solution, y, u, True)
                    ]
                    for y in ahead
                ]
                ahead = [pose for poses in turned for pose in self.turns.distinct(b, poses, u)]
            found += ahead
        return found

    def among(self, group: Group, x: Unknowns, poses: list[Unknowns]) -> bool:
        """Return whether a pose of a group is one of others."""
        blocks = self.blocks_of(group)
        return any(all(self.turns.same(b, x, y) for b in blocks) for y in poses)

    def from_starts(self, b: int, x: Unknowns, u: Floats, most: int | None = None) -> Floats:
        """Return the distinct solutions that Newton's method finds, the sketch its first start."""
        from mechdae.motion.assembly.multistart import CROWD, MOST, BlockSearch

        graph, solver = self.blocks[b], self.assembler.solvers[b]
        if b not in self._searches:
            sizes = self.assembler.natural[graph.own]
            self._searches[b] = BlockSearch(solver, sizes, self.turns.lattices[b])
        angles = dict(zip(graph.own, solver.angle, strict=True))
        hint = [self.turns.whole.start(i, x, u) if angle else np.nan for i, angle in angles.items()]
        z = x[graph.uses] if graph.uses else np.zeros(0)
        counts = [run.generic for run in self.counted.get(graph.block.group, ()) if run.bounded]
        crowd = min([*counts, CROWD])
        query = (b, z.tobytes(), np.asarray(u).tobytes(), repr(hint), most or MOST, crowd)
        known = self._looked_for.get(query)
        if known is None:  # a mode is labelled where it was looked for
            found = self._searches[b](z, u, np.array(hint), most or MOST, crowd)
            sizes = self.assembler.natural[graph.own]
            free = moving(graph, found.x, x, u, self.p, sizes, self.size)
            if free.any():  # axes of the other sense are no pose of the group
                every = [put(x, graph.own, solution) for solution in found.x]
                fine = {id(pose) for pose in self._with_senses(b, every, u)}
                positive = np.array([id(pose) in fine for pose in every])
                found, free = found.only(positive), free[positive]
            known = (found, free)
            self._looked_for = {query: known, **dict(list(self._looked_for.items())[:REMEMBERED])}
        found, free = known
        self.searched.setdefault(graph.block.group, []).append(found)
        if free.any():
            self.free += [group for group in self.scene.groups if group.index == graph.block.group]
        return found.x[~free]

    def no_others(self, group: Group, b: int, x: Floats, u: Floats) -> bool:
        """Return whether the last search of a block has missed no solution; only for all modes."""
        from mechdae.motion.assembly.no_others import no_others

        found = self.searched[group.index][-1]
        if not self.by_paths or group.index in self.counted or group in self.free:
            return False
        z = x[self.blocks[b].uses] if self.blocks[b].uses else np.zeros(0)
        senses = [chooser for chooser in self.assembler.choosers if chooser.positive(b)]
        orientation = (senses[0], b) if senses else None
        boxes = no_others(self._searches[b], found.x, z, u, orientation)
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


@dataclass(eq=False)
class OtherPoses:
    """The poses of one group beyond those that elimination proves.

    Attributes
    ----------
    answer
        That of the whole group, where a way to solve it at once has one.
    failure
        Why there is no pose, as it is known last.
    """

    search: GroupSearch
    group: Group
    x: Floats
    u: Floats
    nearby: bool
    searched: bool
    measured: bool
    drawn: bool
    answer: tuple[list[Floats], bool, NoPose | None] | None = None
    failure: NoPose | None = None
    proven: bool = True
    _of_whole: list[Floats] | None = None

    def poses(self, b: int, start: Floats, result: Solutions | None, proven: bool) -> list[Floats]:
        """Return the poses after block `b`, from one of the blocks before it.

        `result` are solutions that are none, or not proven to be all; None: there is no closed
        form. `proven` tells that those of the blocks before are all.
        """
        search, group, u = self.search, self.group, self.u
        result = result or search.of_loop(b, start, u)
        if result is None and self.drawn:
            lone = search.drawn(b, start, u)
            if lone is not None and lone[1]:
                search.assembler.shortened, self.proven = True, False
                return search.assembler.turned(b, [lone[0]], start, u)
        if result is None and not self._search_for_whole():
            return []
        if result is None or (self.nearby and result.infinite):
            most = 1 if result is not None else None
            search.check_freedom(group, b, start, u)
            solutions = search.from_starts(b, start, u, most)
            self.proven = proven and most is None and search.no_others(group, b, start, u)
            result = None
        else:
            solutions, self.proven = result.x, result.proven
            if search.assembler.solvers[b].linear and not len(solutions):
                search.check_freedom(group, b, start, u)
        free = result is not None and result.free
        if free:
            search.free.append(group)
        if not len(solutions):
            self.failure = self._no_pose(b, start, result)
        poses = search.assembler.turned(b, solutions, start, u)
        if self.nearby and not self.proven and not free:
            same = search.turns.same
            exact = search.own_pose(b, start, u, not len(solutions))
            if exact is not None and not any(same(b, exact, x) for x in poses):
                poses, self.failure = [*poses, exact], None
        return poses

    def _search_for_whole(self) -> bool:
        """Look for all poses of the group at once; return whether others are to be looked for."""
        if not self.searched:
            self.answer = [], False, None
        elif self._of_whole is None:
            found = self.search.of_whole(self.group, self.x, self.u, self.nearby, self.measured)
            self._of_whole = found[0] if found is not None else []
            if found is not None and found[1]:
                self.answer = found[0], found[2], found[3]
        return self.answer is None

    def _no_pose(self, b: int, start: Floats, result: Solutions | None) -> NoPose:
        """Return what is known of a block without a solution, by search where `result` is None."""
        search, group = self.search, self.group
        if result is not None:
            starts, free = 0, result.free
            gap, infinite, at = result.gap, result.infinite, result.gap_at
        else:
            starts, free = search.searched[group.index][-1].starts, group in search.free
            gap, infinite, at = 0.0, False, None
        if (gap > 0 or starts) and at is None and self.measured:
            at = search.opening(b, start, self.u)
            gap = at.size
        return NoPose(group, gap, infinite, starts, at, free)

    def with_those_of_whole(self, poses: list[Floats]) -> list[Floats]:
        """Return the poses, and those of the group at once that are not among them."""
        more = self._of_whole or ()
        among = self.search.among
        return [*poses, *(pose for pose in more if not among(self.group, pose, poses))]

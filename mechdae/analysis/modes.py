"""Assembly modes: all poses at one value of the drivers, group by group.

Dyads (geared ones included) and platforms on three legs are solved by elimination, and their
count is proven; larger groups by Newton's method from many starts, and their count is only "found".
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.analysis.closing import Closing, Gap
from mechdae.analysis.contact_solver import Contacts, ContactSolver
from mechdae.analysis.eliminant import BlockSolver, angle_slopes
from mechdae.analysis.freedom import dependent, free_poses
from mechdae.analysis.limits import solve
from mechdae.analysis.numbers import driver_size, mechanism_scale, natural_sizes, periods
from mechdae.analysis.plan import Sketch
from mechdae.analysis.redundant import RedundantSolver
from mechdae.analysis.search import MOST, Found, Search
from mechdae.analysis.truss import Truss, truss
from mechdae.analysis.turns import WholeTurns
from mechdae.describe.coordinates import Coordinate, coordinate
from mechdae.kernels.blocks import BlockGraph
from mechdae.kernels.graphs import Graphs
from mechdae.kernels.local import Local
from mechdae.model.reduction import own_freedom
from mechdae.model.structure import Group


@dataclass(frozen=True)
class Mode:
    """One assembly mode: unknowns, labels of the groups in the order of the formula."""

    x: Any
    labels: tuple[str, ...]

    @property
    def label(self) -> str:
        return ",".join(self.labels)


@dataclass(frozen=True)
class Failure:
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
        self.sketch, self.places = dict(sketch.angles), dict(sketch.places)
        self.p = self.scene.model.p_values
        self.size = mechanism_scale(self.scene.model.mechanism)
        self.turns = WholeTurns(self.scene, self.sketch, self.p)
        slopes = angle_slopes(self.scene, self.p) if graphs.blocks else {}
        self.solvers = [
            self._solver(graph, slopes, any(self.scene.x_names[i][1] == "s" for i in graph.own))
            for graph in graphs.blocks
        ]
        self.contacts = Contacts(self.scene, self.p)
        self.closing = Closing(graphs)
        period = periods(self.scene)
        self.turn = np.where(period > 0, period, 2 * np.pi)
        self._trusses: dict[int, Truss | None] = {}
        self._searches: dict[int, Search] = {}
        self.searched: dict[int, list[Found]] = {}
        """What searches from many starts found, by group."""
        self._blocks_of: dict[int, list[int]] = {group.index: [] for group in self.scene.groups}
        for b, graph in enumerate(graphs.blocks):
            self._blocks_of[graph.block.group].append(b)
        self._functions: dict[Any, Local] = {}
        self.free: list[Group] = []
        """Groups met with a freedom of their own: their outer pins coincide."""

    def _solver(self, graph: BlockGraph, slopes: Any, contact: bool) -> BlockSolver:
        if graph.redundant:
            return RedundantSolver(self.scene, graph, self.p, self.size, slopes)
        solver = BlockSolver(self.scene, graph, self.p, self.size, slopes)
        if not contact or solver.linear:
            return solver
        return ContactSolver(self.scene, graph, self.p, self.size, slopes)

    def blocks_of(self, group: Group) -> list[int]:
        return self._blocks_of[group.index]

    def names(self, b: int) -> list[str]:
        """Return what a block's unknowns are: x, y, angle."""
        return [self.scene.x_names[i][1] for i in self.graphs.blocks[b].own]

    def labelled(self, group: Group) -> bool:
        """Return whether a group's modes have a label: not the driven link itself, not a weld."""
        return bool(self.blocks_of(group)) or not (group.driven or group.kind == "weld")

    # -- absolute coordinates --------------------------------------------------------------

    @cached_property
    def _absolute(self) -> tuple[list[tuple[str, str]], Any]:
        names = list(self.scene.recover)
        values = ca.vertcat(*self.scene.recover.values())
        inputs = [self.scene.x, self.scene.u, self.scene.model.p]
        return names, ca.Function("q", inputs, [values])

    def coordinates(self, x: Any, u: Any) -> dict[tuple[str, str], float]:
        """Return all absolute coordinates at a pose."""
        names, function = self._absolute
        return dict(zip(names, np.array(function(x, u, self.p)).ravel().tolist(), strict=True))

    def _local(self, key: Any, make: Callable[[], Any]) -> Local:
        """Return the function of the expression over q that `make` gives; made once."""
        if key not in self._functions:
            self._functions[key] = Local(self.scene, self.scene.expression(make()))
        return self._functions[key]

    def _angles(self, group: Group, x: Any, u: Any) -> dict[str, float]:
        """Return the angles of a group's bodies at a pose."""
        frame = self.scene.model.frame
        function = self._local(
            ("angles", group.index), lambda: ca.vertcat(*[frame(b).angle for b in group.bodies])
        )
        return dict(zip(group.bodies, function(x, u, self.p).ravel().tolist(), strict=True))

    def group_jacobian(self, x: Any, u: Any, group: Group) -> Any:
        """Return the group's share of the absolute Jacobian at a pose, in declared order."""

        def make() -> Any:
            phi = ca.vertcat(*[self.scene.rows[i].expression for i in group.rows])
            return ca.jacobian(phi, self.scene.model.q[list(group.columns)])

        return self._local(("jacobian", group.index), make)(x, u, self.p)

    # -- one group -------------------------------------------------------------------------

    def candidates(
        self, group: Group, x: Any, u: Any, nearby: bool = False, search: bool = True
    ) -> tuple[list[Any], bool, Failure | None]:
        """Return all poses of a group for solved earlier groups, and whether that is proven.

        With `nearby`, a group of infinitely many modes (a gear ratio that is not rational)
        gives the one that Newton's method finds from the sketch. Without `search` a group that
        has no closed form gives nothing.
        """
        found = [x.copy()]
        proven = True
        failure: Failure | None = None
        for b in self.blocks_of(group):
            graph, solver = self.graphs.blocks[b], self.solvers[b]
            ahead = []
            for start in found:
                z = start[graph.uses] if graph.uses else np.zeros(0)
                result = solver.solve(z, u)
                if result is None and (shape := self._truss(group)) is not None and search:
                    return self._of_truss(shape, x, u, nearby)
                at = None
                if result is None and not search:
                    return [], False, None
                if result is None or (nearby and result.infinite):
                    most = 1 if result is not None else MOST
                    self._check_freedom(group, b, start, u)
                    solutions, sure, gap = self._search(b, start, u, most), False, 0.0
                    infinite = False
                else:
                    solutions, sure = result.x, result.proven
                    gap, infinite, at = result.gap, result.infinite, result.gap_at
                    if solver.linear and not len(solutions):
                        self._check_freedom(group, b, start, u)
                proven &= sure
                if result is not None and result.free:
                    self.free.append(group)
                if not len(solutions):
                    starts = 0 if result is not None else self.searched[group.index][-1].starts
                    free = result is not None and result.free
                    failure = Failure(group, gap, infinite, starts, at, free)
                for solution in solutions:
                    new = put(start, graph.own, self._nearest_turn(b, solution, start, u))
                    ahead.append(self._polish(b, new, u))
            found, missed = self._closed(group, b, ahead, u)
            failure = missed or failure
        found, missed = self._closed(group, None, found, u)
        failure = missed or failure
        touching = [pose for pose in found if self.contacts.touch(group, pose, u)]
        if found and not touching:
            failure = Failure(group, 0.0)
        return touching, proven, failure if not touching else None

    def _closed(
        self, group: Group, b: int | None, poses: list[Any], u: Any
    ) -> tuple[list[Any], Failure | None]:
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
        return [], Failure(group, least.size, at=least)

    def _check_freedom(self, group: Group, b: int, x: Any, u: Any) -> None:
        """Raise when a group moves by itself at the pose that Newton's method finds first."""
        graph = self.graphs.blocks[b]
        sketch = [self._wanted(i, x, u) for i in graph.own]
        sizes = natural_sizes(self.scene, self.size)[graph.own]
        found = free_poses(graph, put(x, graph.own, sketch), u, self.p, sizes, self.size)
        if found is None:
            return
        q, moved = (self.coordinates(pose, u) for pose in found)
        size = {"x": self.size, "y": self.size}
        bodies = [n[0] for n in q if abs(moved[n] - q[n]) > 1e-6 * size.get(n[1], 1.0)]
        raise own_freedom(group, bodies, self.dependent(group, found[0], u))

    def superfluous(self, x: Any, u: Any) -> list[dict[str, Any]]:
        """Return joints and number of superfluous equations of each redundant group."""
        return [
            {"joints": self.dependent(group, x, u), "count": group.superfluous}
            for group in self.scene.redundant
        ]

    def dependent(self, group: Group, x: Any, u: Any) -> list[str]:
        """Return joints and drivers of a group whose equations depend on each other at a pose."""
        names = [self.scene.model.q_names[j][1] for j in group.columns]
        weights = np.array([1.0 if name in ("angle", "s") else self.size for name in names])
        rows = np.flatnonzero(dependent(self.group_jacobian(x, u, group) * weights))
        return list(dict.fromkeys(self.scene.rows[group.rows[k]].owner for k in rows))

    def _truss(self, group: Group) -> Truss | None:
        """Return the group as a platform on three legs, None when it is none."""
        if group.index not in self._trusses:
            shape = None if group.superfluous else truss(self.scene, group, self.p)
            self._trusses[group.index] = shape
        return self._trusses[group.index]

    def _of_truss(
        self, shape: Truss, x: Any, u: Any, nearby: bool
    ) -> tuple[list[Any], bool, Failure | None]:
        """Return all poses of a platform on three legs."""
        group = shape.group
        poses, closed = shape.solve(self.coordinates(x, u), u)
        if closed.free:
            self.free.append(group)
            own = self.blocks_of(group)
            if nearby and len(own) == 1:
                self._check_freedom(group, own[0], x, u)
        found = []
        for q in poses:
            ahead = [x]
            for b in self.blocks_of(group):
                own = self.graphs.blocks[b].own
                solution = np.array([q[self.scene.x_names[i]] for i in own])
                ahead = [
                    self._polish(b, put(y, own, s), u)
                    for y in ahead
                    for s in self._turned(b, solution, y, u)
                ]
            found += ahead
        return found, closed.proven, None if found else Failure(group, closed.gap, free=closed.free)

    def _turned(self, b: int, solution: Any, x: Any, u: Any) -> list[Any]:
        """Return the solution with all whole turns of its angles that gears tell apart."""
        solver = self.solvers[b]
        counts = [max(round(solver.period(j) / (2 * np.pi)), 1) for j in range(len(solution))]
        turns = itertools.product(*[range(count) for count in counts])
        return [self._nearest_turn(b, solution + 2 * np.pi * np.array(k), x, u) for k in turns]

    def _polish(self, b: int, x: Any, u: Any) -> Any:
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

    def _nearest_turn(self, b: int, solution: Any, x: Any, u: Any) -> Any:
        """Return the solution with whole turns added to come nearest to the sketch."""
        graph, solver = self.graphs.blocks[b], self.solvers[b]
        result = np.array(solution, float)
        pose = put(x, graph.own, result)
        for j, i in enumerate(graph.own):
            period = solver.period(j)
            if period:
                wanted = self._wanted(i, pose, u)
                result[j] -= period * np.round((result[j] - wanted) / period)
        return result

    def _wanted(self, i: int, x: Any, u: Any) -> float:
        """Return the sketched value of an unknown that has a period, in its absence a middle."""
        owner, name = self.scene.x_names[i]
        if name == "s":
            middle = sum(self.scene.model.contacts[owner].range) / 2
            places = {c.part: value for c, value in self.places.items() if c.kind == "curve"}
            return places.get(owner, middle)
        return self.turns.wanted(i, x, u) if name == "angle" else self.sketch.get(owner, 0.0)

    def _search(self, b: int, x: Any, u: Any, most: int = MOST) -> Any:
        """Return the distinct solutions that Newton's method finds, the sketch its first start."""
        graph, solver = self.graphs.blocks[b], self.solvers[b]
        if b not in self._searches:
            sizes = natural_sizes(self.scene, self.size)[graph.own]
            self._searches[b] = Search(solver, self.scene.u, sizes)
        angles = dict(zip(graph.own, solver.angle, strict=True))
        hint = [self.turns.start(i, x, u) if angle else np.nan for i, angle in angles.items()]
        z = x[graph.uses] if graph.uses else np.zeros(0)
        found = self._searches[b](z, u, np.array(hint), most)
        self.searched.setdefault(graph.block.group, []).append(found)
        return found.x

    def searches(self) -> list[dict[str, Any]]:
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

    # -- labels ----------------------------------------------------------------------------

    def sign(self, group: Group, x: Any, u: Any) -> str:
        """Return + or -: orientation of the triangle of an RRR dyad, else sign of the Jacobian.

        A redundant group has no determinant, its sign is always +.
        """
        if group.superfluous:
            return "+"
        if group.kind == "RRR" and len(group.bodies) == 2 and group.higher_pairs == 0:
            value = self._orientation(group, x, u)
        else:
            value = float(np.linalg.slogdet(self.group_jacobian(x, u, group))[0])
        return "+" if value > 0 else "-" if value < 0 else "0"

    def _orientation(self, group: Group, x: Any, u: Any) -> float:
        def make() -> Any:
            joints = self.scene.model.mechanism.joints
            inner = joints[group.inner[0]]
            first = group.bodies[0]
            outer = [joints[name] for name in group.joints if name != inner.name]
            outer.sort(key=lambda joint: first not in joint.bodies)
            pins = (outer[0].second, inner.second, outer[1].second)
            return ca.horzcat(*[self.scene.model.point(pin) for pin in pins])

        a, b, c = self._local(("triangle", group.index), make)(x, u, self.p).T
        return float((b - a)[0] * (c - b)[1] - (b - a)[1] * (c - b)[0])

    def group_labels(self, group: Group, poses: list[Any], u: Any) -> list[str]:
        """Return the labels of all poses of one group: sign, and rank where it is no dyad.

        Whole turns of a dyad's body, which gears tell apart, are counted from the sketch.
        """
        signs = [self.sign(group, x, u) for x in poses]
        if self._signs_tell(group):
            return [sign + self._whole(group, x, u) for sign, x in zip(signs, poses, strict=True)]
        first = self.contacts.first if self.contacts.of(group) else self._first_angle
        # a body that only slides has one angle in all modes: then the unknowns tell
        own = [i for b in self.blocks_of(group) for i in self.graphs.blocks[b].own]
        size = np.array([1.0 if self.scene.x_names[i][1] == "angle" else self.size for i in own])
        order = [(round(first(group, x, u), 9), *np.round(x[own] / size, 9)) for x in poses]
        labels = []
        for k, sign in enumerate(signs):
            rank = 1 + sum(other == sign and order[i] < order[k] for i, other in enumerate(signs))
            labels.append(f"{sign}{rank}")
        return labels

    def label(self, x: Any, u: Any) -> str:
        """Return the label of a solved pose among the modes at `u`."""
        labels = []
        for group in self.scene.groups:
            if not self.labelled(group):
                continue
            sign = self.sign(group, x, u)
            if self._signs_tell(group):
                labels.append(sign + self._whole(group, x, u))
                continue
            poses, _, _ = self.candidates(group, x, u)
            names = self.group_labels(group, poses, u)
            own = [i for b in self.blocks_of(group) for i in self.graphs.blocks[b].own]
            turn = self.turn[own]
            gaps = [
                np.abs(np.sin((pose[own] - x[own]) * np.pi / turn)).max() if own else 0.0
                for pose in poses
            ]
            labels.append(names[int(np.argmin(gaps))] if gaps else sign)
        return ",".join(labels)

    def _whole(self, group: Group, x: Any, u: Any) -> str:
        """Return the whole turns that a pose is away from the sketch as text, if there are any."""
        numbers = [
            self.turns.number(i, x, u)
            for b in self.blocks_of(group)
            for j, i in enumerate(self.graphs.blocks[b].own)
            if self.solvers[b].period(j) > 3 * np.pi
        ]
        return "".join(f":{number}" for number in numbers) if any(numbers) else ""

    def _signs_tell(self, group: Group) -> bool:
        """Return whether the sign, with whole turns, tells the modes of a group apart."""
        return group.is_dyad or all(self.solvers[b].linear for b in self.blocks_of(group))

    def _first_angle(self, group: Group, x: Any, u: Any) -> float:
        angle = self._angles(group, x, u)[group.bodies[0]]
        period = 2 * np.pi
        for b in self.blocks_of(group):
            for j, i in enumerate(self.graphs.blocks[b].own):
                if self.scene.x_names[i] == (group.bodies[0], "angle"):
                    period = self.solvers[b].period(j) or period
        return angle - period * float(np.ceil(angle / period - 0.5))

    # -- whole scene -----------------------------------------------------------------------

    def modes(self, u: Any, limit: int | None = None) -> tuple[list[Mode], bool, Failure | None]:
        """Return all modes, whether the count is proven, and the group that failed last."""
        found = [Mode(np.zeros(self.graphs.nx), ())]
        proven, failure = True, None
        for group in self.scene.groups:
            ahead = []
            for mode in found:
                poses, sure, failed = self.candidates(group, mode.x, u)
                proven &= sure
                failure = failed or failure
                labels = self.group_labels(group, poses, u)
                for x, label in zip(poses, labels, strict=True):
                    own = (label,) if self.labelled(group) else ()
                    ahead.append(Mode(x, mode.labels + own))
            found = ahead
        found.sort(key=lambda mode: [(text[0] != "+", len(text), text) for text in mode.labels])
        return found[:limit], proven, failure if not found else None

    def from_sketch(self, u: Any) -> tuple[Any, Failure | None, list[Group]]:
        """Return the pose nearest to the sketch, group by group.

        Returns
        -------
        x : (nx,) array
        failure
            The group that cannot be assembled at `u`, None when all are.
        doubtful
            Groups whose mode the sketch does not tell.
        """
        x = np.zeros(self.graphs.nx)
        doubtful: list[Group] = []
        for group in self.scene.groups:
            poses, _, failure = self.candidates(group, x, u, nearby=True)
            if failure is not None:
                return x, failure, doubtful
            distances = [self.distance(group, pose, u) for pose in poses]
            near = [k for k, far in enumerate(distances) if far - min(distances) < 1e-6]
            if len(near) > 1:  # the same but for whole turns, which a gear tells apart
                whole = [self.distance(group, poses[k], u, unwound=True) for k in near]
                near = [near[int(i)] for i in np.argsort(whole)]
                whole.sort()
                if whole[1] - whole[0] < 1e-6:
                    doubtful.append(group)
            x = poses[near[0]]
        return x, None, doubtful

    def distance(self, group: Group, x: Any, u: Any, unwound: bool = False) -> float:
        """Return how far the group's angles are from the sketch [rad], whole turns if `unwound`."""
        angles = self._angles(group, x, u)
        bodies = [body for body in group.bodies if body in self.sketch]
        decided: list[float] = []
        for i in [i for b in self.blocks_of(group) for i in self.graphs.blocks[b].own]:
            if unwound and (own := self.turns.gaps(i, x, u)):
                decided += own
                bodies = [body for body in bodies if not self.turns.turned_with(i, body)]
        gaps = [angles[body] - self.sketch[body] for body in bodies]
        if not unwound:
            gaps = [np.remainder(gap + np.pi, 2 * np.pi) - np.pi for gap in gaps]
        gaps += decided
        for c, wanted in self.places.items():
            if set(self._bodies(c)) & set(group.bodies):
                value = self._coordinate(c, x, u)
                gap = (value - wanted) / driver_size(self.scene.model, c, self.size)
                turns = c.is_angle or (c.kind == "curve" and self.contacts.closed(c.part))
                gaps.append(np.remainder(gap + np.pi, 2 * np.pi) - np.pi if turns else gap)
        return float(np.sqrt(np.sum(np.square(gaps)))) if gaps else 0.0

    def _bodies(self, c: Coordinate) -> tuple[str, ...]:
        joints = self.scene.model.mechanism.joints
        return joints[c.part].bodies if c.part in joints else (c.part,)

    def _coordinate(self, c: Coordinate, x: Any, u: Any) -> float:
        """Return the value of a coordinate at a pose."""
        function = self._local(c, lambda: self.scene.model.coordinate(c))
        return float(function(x, u, self.p).item())

    def slides(self, group: Group, x: Any, u: Any) -> dict[str, float]:
        """Return the slides of a group's sliding joints [m], and s of its contacts."""
        mechanism = self.scene.model.mechanism
        found = {}
        for name in group.joints:
            if mechanism.joints[name].kind == "prismatic":
                c = coordinate(mechanism, f"{name}.slide")
                found[name] = self._coordinate(c, x, u)
            if mechanism.joints[name].kind == "curve":
                found[name] = self.contacts.place(name, x, u)
        return found

    def hint(self, group: Group, x: Any, u: Any) -> list[str]:
        """Return the sketch keys by which the modes of a group differ."""
        poses, _, _ = self.candidates(group, x, u)
        angles = [self._angles(group, pose, u) for pose in poses]
        turned = [np.exp(1j * np.array([a[b] for a in angles])) for b in group.bodies]
        keys = [
            f"{body}_deg"
            for body, t in zip(group.bodies, turned, strict=True)
            if np.abs(t - t[0]).max() > 1e-6
        ]
        return keys or list(self.slides(group, poses[0], u))


def put(x: Any, own: list[int], values: Any) -> Any:
    """Return x with the unknowns of a block replaced."""
    result = x.copy()
    result[own] = values
    return result

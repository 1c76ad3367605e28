"""A mechanism as closed vector loops: the inverse of `from_loops`."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property

from mechdae.describe.expression import evaluate
from mechdae.describe.file.load import Source, given
from mechdae.describe.file.problem import Problem
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Body, Ground, Mechanism
from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.describe.values import Number, Table
from mechdae.describe.vectors.expand import FRICTION, from_loops, slide_of
from mechdae.describe.vectors.loops_in_space import SpatialLoops, bare, joined, shortest_cycles
from mechdae.describe.vectors.nodes import HEAD, TAIL, Merged, in_order, meeting, signed
from mechdae.describe.vectors.translation import Translation, renamed
from mechdae.describe.vectors.values import Node, Vector, add, less, negative
from mechdae.errors import InputError, MechdaeError
from mechdae.records import dataclass, public
from mechdae.types import Json

SAME = 1e-12
"""Share of the mechanism's size within which two points of a link are one place."""
Point = tuple[str, str]
"""A body and one of its points."""


@public
def loops_of(problem: Source, *, set: Mapping[str, Number] | None = None) -> Problem:
    """Return a problem with ``[vectors]`` and ``[loops]`` in place of its bodies and joints.

    Each link of a loop is a vector from joint to joint, each slide a vector of unknown length. What
    is in no loop stays as it is. Links keep their names but for blocks, which are called after
    their slide.

    Parameters
    ----------
    problem
        A mechanism with loops: in the plane of revolute and prismatic joints, pins in slots and
        bars; in space with bars between balls, or points that slide on the ground. A problem, the
        name of a predefined one, a file, a mechanism, or a result.
    set
        Numbers to change, as of `md.solve`.

    Returns
    -------
    Problem
        With the same motion.

    Raises
    ------
    InputError
        It has no loop, or a task that is not translated.
    UnavailableError
        A spatial mechanism whose loops are closed by axes.

    Examples
    --------
    >>> loops = md.loops_of(md.load("four-bar-crank-rocker"))
    >>> loops.mechanism.closure.loops["loop_1"]
    ('crank', 'coupler', '-rocker', '-ground_AD')
    """
    whole, _ = given(problem, set=set)
    mechanism = whole.mechanism
    if mechanism.closure is not None:
        return whole
    if mechanism.dimension == 2:
        return Written(whole).problem
    spatial = SpatialLoops(whole)
    made = spatial.mechanism
    return rewritten(whole, Translation(mechanism, made, points=spatial.points(made)), spatial.gone)


def rewritten(base: Problem, translation: Translation, gone: Collection[str] = ()) -> Problem:
    """Return a problem with the mechanism of a translation, and all else translated to it.

    What the sketch says of links that are gone is left out.
    """
    mechanism = base.mechanism
    made = replace(translation.made, sketch=Table(_sketch(mechanism, translation, gone)))
    loads = {name: translation.load(load) for name, load in mechanism.loads.items()}
    outputs = {name: translation.expression(text) for name, text in mechanism.outputs.items()}
    made = replace(made, loads=Table(loads), outputs=Table(outputs))
    tasks = {name: _task(name, task, translation) for name, task in base.tasks.items()}
    return replace(base, mechanism=made, tasks=Table(tasks), expected=(), pattern=None)


@dataclass(frozen=True)
class LoopVectors:
    """The vectors of a mechanism with their ends, points ``body.point`` of it, and its loops.

    ``still`` are the vectors whose direction is given, ``beside`` further points of the ground.
    """

    vectors: Mapping[str, Vector]
    ends: Mapping[str, tuple[str, str]]
    loops: Mapping[str, Sequence[str]]
    beside: Mapping[str, Sequence[float]] = field(default_factory=dict)

    @cached_property
    def still(self) -> set[str]:
        return {name for name in self.vectors if self._given(name)}

    def among(self, names: Collection[str]) -> LoopVectors:
        """Return the loops all of whose vectors are among some, with these."""
        loops = {name: loop for name, loop in self.loops.items()
                 if {signed(entry)[0] for entry in loop} <= set(names)}  # fmt: skip
        vectors = {name: self.vectors[name] for name in in_order(loops)}
        ends = {name: self.ends[name] for name in vectors}
        return replace(self, vectors=vectors, ends=ends, loops=loops)

    def _given(self, name: str) -> bool:
        vector = self.vectors[name]
        if vector.along is not None and vector.along in self.vectors:
            return self._given(vector.along)
        spatial = vector.elevation is not None and vector.azimuth is not None
        return vector.angle is not None or vector.body == GROUND or spatial


def drawn_vectors(mechanism: Mechanism) -> LoopVectors:
    """Return the vectors of a mechanism: those that describe it, or those of `loops_of`."""
    closure = mechanism.closure
    if closure is not None:
        return LoopVectors(closure.vectors, closure.ends, closure.loops)
    if mechanism.dimension == 3:
        spatial = SpatialLoops(Problem(mechanism))
        known = mechanism.parameter_values
        beside = {f"{GROUND}.{name}": [evaluate(number, known) for number in place]
                  for name, place in spatial.beside.items()}  # fmt: skip
        return LoopVectors(spatial.vectors, spatial.ends, spatial.loops, beside)
    written = Written(Problem(mechanism))
    ends = {name: (".".join(a), ".".join(b)) for name, (a, b) in written.ends.items()}
    return LoopVectors(written.vectors, ends, written.loops)


@dataclass
class _Direction:
    """Links joined by guides: one direction, told from the vector ``root``.

    ``bodies`` are the angles of links from the first of them, ``turn`` is that of the root.
    """

    bodies: dict[str, Number]
    root: str = ""
    turn: Number = 0.0


@dataclass
class Written:
    """A problem as it is written by loops: ``problem``, with the names of what has another one.

    ``called`` are blocks and rails, ``points`` those of links.
    """

    base: Problem
    vectors: dict[str, Vector] = field(default_factory=dict)
    ends: dict[str, tuple[Point, Point]] = field(default_factory=dict)
    loops: dict[str, list[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        mechanism = self.base.mechanism
        self.values: Table[float] = mechanism.values()
        joints = {name: joint for name, joint in mechanism.joints.items() if _in_loops(joint)}
        pairs = {name: (joint.first_body, joint.second_body) for name, joint in joints.items()}
        cycles = shortest_cycles(pairs, GROUND)
        if not cycles:
            raise InputError(
                "it has no loop: an open chain is no closed vector loop", where="joints"
            )
        inside = {name for cycle in cycles for name, _ in cycle}
        self.joints: dict[str, Joint] = {
            name: joint for name, joint in joints.items() if name in inside
        }
        self.directions: dict[str, _Direction] = self._directions()
        self._name_nodes()
        for body in self.directions:
            self._segments(body)
        for joint in self.joints.values():
            if not joint.hinge:
                self._slide(joint)
        edges = {name: (self._node(tail), self._node(head))
                 for name, (tail, head) in self.ends.items()}  # fmt: skip
        start = next((self._node(p) for p in self._used if p[0] == GROUND), "")
        found = joined(shortest_cycles(edges, start), edges)
        for k, cycle in enumerate(found, start=1):
            self.loops[f"loop_{k}"] = [name if way else f"-{name}" for name, way in cycle]
        self.merged: Merged = meeting(self.vectors, self.loops)

    @property
    def problem(self) -> Problem:
        """The problem written by loops."""
        mechanism = self.base.mechanism
        bodies = [self._body(body) for body in mechanism.bodies.values()]
        ground = mechanism.ground
        if not self._bound(ground):
            ground = replace(ground, points=self._rest(GROUND, (0.0, 0.0)))
        rest = [joint for name, joint in mechanism.joints.items()
                if name not in self.joints or self._apart(joint)]  # fmt: skip
        joints = [renamed(joint, self.called, self.points) for joint in rest]
        made = from_loops(
            self.vectors,
            self.loops,
            self._nodes(),
            ground=ground,
            bodies=Table({body.name: body for body in bodies if _says(body) or self._bound(body)}),
            joints=Table({joint.name: joint for joint in joints}),
            parameters=mechanism.parameters,
            gravity=mechanism.gravity,
            closure_tolerance=mechanism.closure_tolerance,
        )
        slides = {name: slide_of(name) for name in self.vectors if self.vectors[name].slides}
        return rewritten(self.base, Translation(mechanism, made, self.called, slides, self.points))

    # -- directions ---------------------------------------------------------------------------

    def _directions(self) -> dict[str, _Direction]:
        """Return the direction of each link in a loop, shared by those that guides join."""
        found: dict[str, _Direction] = {}
        joints = self.joints.values()
        names = dict.fromkeys(b for joint in joints for b in (joint.first_body, joint.second_body))
        single = {name: len(self._apart_points(name)) == 1 for name in names}
        for name in sorted(names, key=lambda body: (body != GROUND, single[body])):
            if name in found:
                continue
            direction = _Direction({name: 0.0})
            front = [name]
            for body in front:  # grows while it is read
                for joint in joints:
                    if not joint.guide:
                        continue
                    turn: Number = getattr(joint, "turn", 0.0)
                    first, second = joint.first_body, joint.second_body
                    if first == body and second not in direction.bodies:
                        direction.bodies[second] = add(direction.bodies[first], turn)
                        front.append(second)
                    elif second == body and first not in direction.bodies:
                        direction.bodies[first] = less(direction.bodies[second], turn)
                        front.append(first)
            found |= dict.fromkeys(direction.bodies, direction)
        return found

    def _along(self, name: str, body: str, angle: Number) -> Json:
        """Return the keys of a vector at an angle in a body: its angle, or what it runs along."""
        direction = self.directions[body]
        turn = add(direction.bodies[body], angle)
        if GROUND in direction.bodies:
            return {"angle": turn}
        if not direction.root:
            direction.root, direction.turn = name, turn
            return {}
        offset = less(turn, direction.turn)
        along: Json = {"along": direction.root}
        return along | ({"offset": offset} if offset != 0 else {})

    # -- vectors ------------------------------------------------------------------------------

    def _segments(self, body: str) -> None:
        """Make the vectors of a link, from its first place to each of the others."""
        places = self._apart_points(body)
        direction = self.directions[body]
        for head in places[1:]:
            tail, name = places[0], f"{body}_{places[0][1]}{head[1]}"
            if len(places) == 2 and self._straight(head, tail):
                tail, head = head, tail
            if len(places) == 2 and self._plain(tail, head):
                name = body
                length = self._place(head)[0]
                self.vectors[name] = Vector(name, length=length, **self._along(name, body, 0.0))
            elif next(iter(direction.bodies)) == body:
                self.vectors[name] = Vector(name, from_=".".join(tail), to=".".join(head))
                if not direction.root and body != GROUND:
                    direction.root, direction.turn = name, self._polar(tail, head)[1]
            else:
                name = name if body in self.vectors else body
                length, angle = self._polar(tail, head)
                given = self._along(name, body, angle)
                self.vectors[name] = Vector(name, length=length, **given)
            self.ends[name] = tail, head

    def _apart_points(self, body: str) -> list[Point]:
        """Return points of a link at which joints of loops are, one for each place."""
        points = [point for point in self._used if point[0] == body]
        return [p for k, p in enumerate(points) if not any(self._same(p, q) for q in points[:k])]

    def _polar(self, tail: Point, head: Point) -> tuple[Number, Number]:
        if self._straight(tail, head):
            return self._place(head)[0], 0.0
        (x1, y1), (x2, y2) = self._place(tail), self._place(head)
        return _polar(less(x2, x1), less(y2, y1))

    def _slide(self, joint: Joint) -> None:
        """Make the vector of a slide or a bar."""
        name, given = joint.name, {}
        if joint.bar:
            self.vectors[name] = Vector(name, length=joint.length)  # type: ignore[attr-defined]
        else:
            words = (*FRICTION, "contact_length", "pin_radius", "one_sided")
            given = {w: getattr(joint, w) for w in words if getattr(joint, w, None) is not None}
            given["pair"] = "pin-in-slot" if joint.slot else "block"
            given |= self._along(name, joint.first_body, joint.axis)  # type: ignore[attr-defined]
            self.vectors[name] = Vector(name, **given)
        self.ends[name] = _point(joint, "first"), _point(joint, "second")

    def _plain(self, tail: Point, head: Point) -> bool:
        """Return whether a link is the vector of two points by itself, with the body's frame."""
        body = tail[0]
        if body == GROUND or len(self.directions[body].bodies) > 1:
            return False
        return self._straight(tail, head) and all(self.named.get(self._node(point)) == point[1]
                   for point in self._used if point[0] == body)  # fmt: skip

    def _straight(self, tail: Point, head: Point) -> bool:
        """Return whether one point is the origin of a link and the other is on its x axis."""
        (x1, y1), (x2, y2) = self._place(tail), self._place(head)
        return x1 == 0 and y1 == 0 and y2 == 0 and self._value(x2) > 0

    # -- places -------------------------------------------------------------------------------

    @cached_property
    def _used(self) -> list[Point]:
        """The points at which joints of loops are."""
        joints = self.joints.values()
        points = [_point(joint, side) for joint in joints for side in ("first", "second")]
        return list(dict.fromkeys(points))

    @cached_property
    def _places(self) -> Merged:
        """Points that hinges join, and points of one link at one place."""
        merged = Merged(".".join(point) for point in self._used)
        for joint in self.joints.values():
            if joint.hinge:
                merged.merge(joint.first, joint.second)
        for k, one in enumerate(self._used):
            for other in self._used[:k]:
                if self._same(one, other):
                    merged.merge(".".join(one), ".".join(other))
        return merged

    def _node(self, point: Point) -> str:
        return self._places.first(".".join(point))

    def _name_nodes(self) -> None:
        """Name the places of loops: after the only hinge there, or after a point there."""
        hinges: dict[str, list[Joint]] = {}
        for joint in self.joints.values():
            if joint.hinge:
                hinges.setdefault(self._node(_point(joint, "first")), []).append(joint)
        self.hinges = hinges
        self.named: dict[str, str] = {}
        mechanism = self.base.mechanism
        for node in dict.fromkeys(self._node(point) for point in self._used):
            points = list(dict.fromkeys(p[1] for p in self._used if self._node(p) == node))
            joints = hinges.get(node, [])
            if len(joints) == 1:
                self.named[node] = joints[0].name
                continue
            name = points[0]
            while name in {*mechanism.joints, *mechanism.bodies, *self.named.values()}:
                name += "_"
            self.named[node] = name

    def _place(self, point: Point) -> tuple[Number, ...]:
        return self.base.mechanism.body(point[0]).points[point[1]]

    def _value(self, number: Number) -> float:
        return evaluate(number, self.base.mechanism.parameter_values)

    def _same(self, one: Point, other: Point) -> bool:
        if one[0] != other[0]:
            return False
        gaps = [self.values[f"{one[0]}.{one[1]}.{a}"] - self.values[f"{other[0]}.{other[1]}.{a}"]
                for a in "xy"]  # fmt: skip
        return math.hypot(*gaps) <= SAME * self.base.mechanism.scale

    # -- what is written ----------------------------------------------------------------------

    def _apart(self, joint: Joint) -> bool:
        """Return whether a hinge is written by itself: of several there, or where no loop turns."""
        if not joint.hinge:
            return False
        node = self._node(_point(joint, "first"))
        meet = [
            {self.merged.first(f"{name}.{side}") for name, pair in self.ends.items()
             for side, point in zip((TAIL, HEAD), pair, strict=True)
             if point[0] == body and self._node(point) == node}
            for body in (joint.first_body, joint.second_body)
        ]  # fmt: skip
        return len(self.hinges[node]) > 1 or not meet[0] & meet[1]

    def _nodes(self) -> list[Node]:
        """Return the names of places, with the friction of their only hinge."""
        made = []
        for node, name in self.named.items():
            end = next((f"{vector}.{side}" for vector, pair in self.ends.items()
                        for side, point in zip((TAIL, HEAD), pair, strict=True)
                        if self._node(point) == node), None)  # fmt: skip
            joints = self.hinges.get(node, [])
            only = joints[0] if len(joints) == 1 else None
            words = (*FRICTION, "pin_radius")
            given = {w: getattr(only, w) for w in words if getattr(only, w, None) is not None}
            if end is not None:
                made.append(Node(name, end, **given))
        return made

    @cached_property
    def called(self) -> dict[str, str]:
        """Blocks and rails that have one place only: what they are called after their slides."""
        found: dict[str, str] = {}
        for name in in_order(self.loops):
            joint = self.joints.get(name)
            if joint is None or not joint.straight:
                continue
            for body, text in ((joint.first_body, name), (joint.second_body, f"{name}_block")):
                pin = joint.slot and body == joint.second_body
                if body != GROUND and not pin and len(self._apart_points(body)) == 1:
                    found.setdefault(body, text)
        return found

    @cached_property
    def points(self) -> dict[str, str]:
        """Points of links that vectors make, by what they are called there."""
        found = {}
        for point in self._used:
            node, body = self._node(point), point[0]
            if node in self.named and not self._bound(self.base.mechanism.body(body)):
                found[".".join(point)] = f"{self.called.get(body, body)}.{self.named[node]}"
        return found

    def _bound(self, body: Body | Ground) -> bool:
        """Return whether vectors run between points of a body as it is, or none does."""
        name = body.name if isinstance(body, Body) else GROUND
        vectors = self.vectors.values()
        if name == GROUND and all(v.angle is None and v.body != GROUND for v in vectors):
            return True
        return name not in self.directions or any(v.body == name for v in vectors)

    def _body(self, body: Body) -> Body:
        """Return what is written of a body: all, or what vectors do not say of it."""
        if self._bound(body):
            return body
        name = self.called.get(body.name, body.name)
        self._keep_frame(body.name, name)
        origin = next(point for point in self._used if point[0] == body.name)
        if body.name in self.ends:
            origin = self.ends[body.name][0]
        place, center = self._place(origin), body.center
        if center is not None:
            center = tuple(less(c, x) for c, x in zip(center, place, strict=True))
        return replace(body, name=name, points=self._rest(body.name, place), center=center)

    def _keep_frame(self, body: str, name: str) -> None:
        """Give the vector that makes a link its direction in the frame that the link had."""
        direction = self.directions[body]
        old, vector = direction.bodies[body], name.removesuffix("_block")
        joint = self.joints.get(vector)
        if joint is None:
            angle = add(old, self._polar(*self.ends[vector])[1])
        else:
            angle = add(direction.bodies[joint.first_body], joint.axis)  # type: ignore[attr-defined]
        root = self.vectors.get(direction.root)
        bound = GROUND in direction.bodies or (root is not None and root.from_ is not None)
        new = direction.bodies[next(iter(direction.bodies))] if bound else angle
        if abs(math.remainder(self._value(less(new, old)), 2 * math.pi)) > SAME:
            word = "axis" if name == vector else "block_axis"
            given: Json = {word: less(angle, old)}
            self.vectors[vector] = replace(self.vectors[vector], **given)

    def _rest(self, body: str, origin: tuple[Number, ...]) -> Table[tuple[Number, ...]]:
        """Return the points of a body at which no loop passes, from an origin."""
        points = self.base.mechanism.body(body).points
        return Table({
            name: tuple(less(x, o) for x, o in zip(place, origin, strict=True))
            for name, place in points.items() if (body, name) not in self._used
        })  # fmt: skip


def _in_loops(joint: Joint) -> bool:
    """Return whether a joint is one of vectors: a hinge, a slide, or a bare bar."""
    if joint.hinge or joint.guide or joint.slot:
        return True
    return joint.bar and bare(joint)


def _point(joint: Joint, side: str) -> Point:
    body, _, point = str(getattr(joint, side)).partition(".")
    return body, point


def _says(body: Body) -> bool:
    """Return whether a body has more than a name and joints."""
    return bool(body.points) or body.mass is not None or body.number is not None


def _polar(x: Number, y: Number) -> tuple[Number, Number]:
    """Return length and angle of components; those along the axes are exact."""
    if y == 0 and isinstance(x, float):
        return abs(x), 0.0 if x > 0 else math.pi
    if x == 0 and isinstance(y, float):
        return abs(y), math.copysign(math.pi / 2, y)
    if isinstance(x, float) and isinstance(y, float):
        return math.hypot(x, y), math.atan2(y, x)
    return f"hypot({x}, {y})", f"atan2({y}, {x})"


def _sketch(
    mechanism: Mechanism, translation: Translation, gone: Collection[str]
) -> dict[str, Number]:
    found: dict[str, Number] = {}
    for name, value in mechanism.sketch.items():
        text = name
        if "." in name and name.split(".")[0] in mechanism.bodies:
            text = translation.point(name)
            if (text == name and name.split(".")[0] in gone) or text.startswith(f"{GROUND}."):
                continue
        elif name in mechanism.bodies:
            text = translation.link(name)
        elif name in mechanism.joints:
            joint = mechanism.joints[name]
            text, sign = translation.coordinate(f"{name}.{joint.usual}")
            value = negative(value) if sign < 0 else value
        found[text] = value
    return found


def _task(name: str, task: Task, translation: Translation) -> Task:
    """Return a task with the new names of its drivers and outputs."""
    if not isinstance(task, Driven):
        return task
    try:
        drivers = tuple(driver for driver, _ in translation.drivers(task.all_drivers))
        changes: Json = {"driver": drivers[0]} if task.driver is not None else {"drivers": drivers}
        outputs = getattr(task, "outputs", None)
        if outputs is not None:
            changes["outputs"] = translation.outputs(outputs)
        searches = getattr(task, "find", None)
        if searches is not None:
            changes["find"] = tuple(
                replace(search, output=translation.expression(search.output)) for search in searches
            )
        return replace(task, **changes)
    except MechdaeError as error:
        raise error.inside(f"tasks.{name}") from None

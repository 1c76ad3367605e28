"""Vector loops in space: nodes become points, vectors pairs of points, beside bodies and joints.

Nodes may be points of bodies, and joints name nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from mechdae.describe.expression import evaluate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.spatial import OF_VECTORS, Pointer, Spherical
from mechdae.describe.mechanism import GROUND, Body, Ground
from mechdae.describe.values import Number, Table
from mechdae.describe.vectors.nodes import (
    HEAD,
    TAIL,
    Merged,
    check_loops,
    check_meeting,
    check_names,
    check_node,
    check_tied,
    in_order,
    nodes_of,
    place_of,
    reached,
)
from mechdae.describe.vectors.values import Closure, Vector, add, components, less
from mechdae.errors import InputError, UnavailableError, UnknownName


def points_on_bodies(closure: Closure, merged: Merged) -> dict[str, list[str]]:
    """Return node -> the points of bodies that lie there (``crank.B``), by ``from`` and ``to``.

    Raises
    ------
    InputError
        A body or a point that is not there.
    """
    found: dict[str, list[str]] = {}
    for name, vector in closure.vectors.items():
        for end, word, text in ((TAIL, "from", vector.from_), (HEAD, "to", vector.to)):
            if text is None:
                continue
            body, point = text.split(".")
            place = place_of(text, closure, f"vectors.{name}.{word}")
            if len(place) != 3:
                where = "ground" if body == GROUND else f"bodies.{body}"
                raise InputError(
                    f"3 coordinates are needed, not {len(place)}",
                    where=f"{where}.points.{point}",
                )
            ends = found.setdefault(merged.first(f"{name}.{end}"), [])
            if text not in ends:
                ends.append(text)
    for joint in closure.joints.values():  # what hangs on the ground at a node is there
        for here, there in ((joint.first, joint.second), (joint.second, joint.first)):
            body, point = there.split(".")
            if joint.coincide and body == GROUND and point in closure.ground.points:
                for ends in found.values():
                    if here in ends and there not in ends:
                        ends.append(there)
    return found


def referred(joint: Joint, closure: Closure, merged: Merged, at: Mapping[str, str]) -> Joint:
    """Return a joint with ends of vectors and names of nodes as points of the mechanism.

    Parameters
    ----------
    at
        Node -> the point it is.

    Raises
    ------
    InputError
        The end of a vector in a joint that holds more than a point.
    """
    ends = {}
    for side in ("first", "second"):
        text = getattr(joint, side)
        body, point = text.split(".")
        if body == GROUND or (body in closure.bodies and point in closure.bodies[body].points):
            continue
        node = None
        if body in closure.vectors:
            if point not in (TAIL, HEAD):
                known = [f"{body}.{TAIL}", f"{body}.{HEAD}"]
                raise UnknownName("end", text, known, where=f"joints.{joint.name}.between")
            node = merged.first(text)
        elif body in closure.nodes and point == body:
            node = merged.first(closure.nodes[body].at)
        if node is None:
            continue
        ends[side] = at[node]
        owner = at[node].split(".")[0]
        unturned = owner not in closure.bodies or not closure.bodies[owner].points
        if not (joint.ball or joint.bar) and owner != GROUND and unturned:
            raise InputError(
                f"'{text}' is a point that does not turn: a {joint.kind} joint needs a body",
                where=f"joints.{joint.name}.between",
                hint="a spherical joint, or a body with the vector between two of its points: "
                'v = { from = "body.A", to = "body.B" }',
            )
    return replace(joint, **ends) if ends else joint


def ties(
    on_bodies: Mapping[str, list[str]], joints: Mapping[str, Joint], names: Mapping[str, str]
) -> Iterator[Spherical]:
    """Yield a ball joint for each point of a body at a node that no joint ties to the first one."""
    for node, points in on_bodies.items():
        together = Merged(points)
        for joint in joints.values():
            if joint.coincide and joint.first in points and joint.second in points:
                together.merge(joint.first, joint.second)
        first, *others = points
        loose = list(dict.fromkeys(together.first(point) for point in others))
        loose = [point for point in loose if point != together.first(first)]
        for point in loose:
            name = names[node] if len(loose) == 1 else f"{names[node]}_{point.split('.')[0]}"
            if name in joints:
                raise InputError(
                    f"the vectors tie {first} and {point} by a joint of their own",
                    where=f"joints.{name}",
                    hint="rename it, or let it join these two points",
                )
            yield Spherical(name, first, point)


PLANAR = (
    "angle", "along", "offset", "axis", "block_axis", "contact_length", "pin_radius", "one_sided",
)  # fmt: skip
FRICTION = ("friction", "friction_static")
Place = tuple[Number, ...]


def span(vector: Vector) -> Place:
    """Return the components of a vector that is given."""
    assert vector.length is not None
    assert vector.elevation is not None
    assert vector.azimuth is not None
    level, y = components(vector.length, vector.elevation)
    x, z = components(level, vector.azimuth)
    return x, y, z


class PointLoops:
    """The points and pairs of spatial loops, among bodies and joints that are described as such.

    A node is a point of a body where a vector with ``from`` and ``to`` ends there, a point of the
    ground where given vectors lead to it, else a body of its own that does not turn.

    Raises
    ------
    InputError
        Keys of planar vectors, loops that do not close or do not hang together.
    """

    def __init__(self, closure: Closure, known: Mapping[str, float]) -> None:
        self.closure = closure
        self.known = known
        self._check()
        check_loops(closure.vectors, closure.loops)
        self.merged: Merged = nodes_of(closure.vectors, closure.loops)
        self.on_bodies: dict[str, list[str]] = points_on_bodies(closure, self.merged)
        self.order: list[str] = in_order(closure.loops)
        self.ends: dict[str, tuple[str, str]] = {
            name: (self.merged.first(f"{name}.{TAIL}"), self.merged.first(f"{name}.{HEAD}"))
            for name in self.order
        }
        self.places: dict[str, tuple[float | str, ...]] = self._fixed()
        self._names = self._called()
        nodes = dict.fromkeys(node for pair in self.ends.values() for node in pair)
        self._at = {node: self._point(node) for node in nodes}
        self.typed: Table[Joint] = Table({
            name: referred(joint, closure, self.merged, self._at)
            for name, joint in closure.joints.items()
        })  # fmt: skip
        self._check_connected()
        self.ground, self.bodies = self._ground(), self._bodies()
        self.spans: Table[tuple[str, str]] = Table({
            name: (self._at[tail], self._at[head]) for name, (tail, head) in self.ends.items()
        })  # fmt: skip
        self.joints: Table[Joint] = self._joints()

    def _point(self, node: str) -> str:
        """Return the point of the mechanism that a node is."""
        name, bound = self._names[node], self.on_bodies.get(node, [])
        if node in self.places:
            fixed = next((text for text in bound if text.startswith(f"{GROUND}.")), None)
            return fixed or f"{GROUND}.{name}"
        return bound[0] if bound else f"{name}.{name}"

    def _ground(self) -> Ground:
        points = dict(self.closure.ground.points)
        for node, place in self.places.items():
            name = self._at[node].split(".")[1]
            if name in points and self._at[node] not in self.on_bodies.get(node, ()):
                raise InputError(
                    f"the vectors give the point '{name}' already",
                    where=f"ground.points.{name}",
                    hint="rename it, or name it by a vector: "
                    f'v = {{ from = "{GROUND}.{name}", to = ... }}',
                )
            points.setdefault(name, place)
        return Ground(points=Table(points))

    def _bodies(self) -> Table[Body]:
        typed = self.closure.bodies
        moving = [
            self._names[node]
            for node, at in self._at.items()
            if at.split(".")[0] == self._names[node]
        ]
        found: dict[str, Body] = {}
        for name in moving:
            given = typed.get(name)
            for word in ("center", "inertia", "points"):
                if given is not None and getattr(given, word):
                    raise InputError(
                        f"'{name}' is a point: it has a mass and no {word}",
                        where=f"bodies.{name}.{word}",
                    )
            place: Table[Place] = Table({name: (0.0, 0.0, 0.0)})
            found[name] = Body(name, place, mass=given.mass if given is not None else None)
        for name, given in typed.items():
            if name not in found and not given.points:
                raise InputError(
                    f"'{name}' has no point that a joint could hold",
                    where=f"bodies.{name}.points",
                    hint=f"nodes that move and may have a mass: {', '.join(moving)}",
                )
        return Table(
            {**{name: value for name, value in typed.items() if name not in found}, **found}
        )

    def _joints(self) -> Table[Joint]:
        closure, found = self.closure, dict(self.typed)
        bound = {
            node: [self._at[node], *(text for text in points if text != self._at[node])]
            for node, points in self.on_bodies.items()
        }
        found |= {joint.name: joint for joint in ties(bound, found, self._names)}
        for name, vector in closure.vectors.items():
            if vector.from_ is not None:
                continue
            if not set(self.ends[name]) <= set(self.places) or self._given(name) != OF_VECTORS:
                found[name] = self._pointer(name)
        return Table(found)

    def _check(self) -> None:
        closure = self.closure
        check_names(closure, "joint", "body", "fixed link")
        for name in closure.nodes:
            if name in closure.joints:
                raise InputError(
                    f"a joint is called '{name}' too", where=f"nodes.{name}",
                    hint="rename one of them",
                )  # fmt: skip
        for name, vector in closure.vectors.items():
            for word in PLANAR:
                if getattr(vector, word) is not None:
                    raise UnavailableError(
                        f"'{word.rstrip('_')}' is a key of vectors in the plane",
                        where=f"vectors.{name}.{word.rstrip('_')}",
                        hint="in space: length, elevation, azimuth",
                    )
            for word in FRICTION:
                if getattr(vector, word) is not None and self._given(name) != OF_VECTORS[1:]:
                    raise InputError(
                        f"'{name}' does not slide along a direction that is given",
                        where=f"vectors.{name}.{word}",
                        hint="friction is of vectors of which the length alone is unknown",
                    )
        for name, node in closure.nodes.items():
            for word in ("friction", "friction_static", "pin_radius"):
                if getattr(node, word) is not None:
                    raise UnavailableError(
                        "nodes in space are points without friction", where=f"nodes.{name}.{word}"
                    )

    def _given(self, name: str) -> tuple[str, ...]:
        vector = self.closure.vectors[name]
        return tuple(word for word in OF_VECTORS if getattr(vector, word) is not None)

    def _of_ground(self) -> dict[str, Place]:
        """Return the places of nodes at points of the ground."""
        places: dict[str, Place] = {}
        for node, points in self.on_bodies.items():
            fixed = [text for text in points if text.startswith(f"{GROUND}.")]
            for text in fixed:
                place = self.closure.ground.points[text.split(".")[1]]
                if node not in places:
                    places[node] = place
                    continue
                gaps = [
                    evaluate(a, self.known) - evaluate(b, self.known)
                    for a, b in zip(places[node], place, strict=True)
                ]
                if any(gaps):
                    raise InputError(
                        f"{fixed[0]} and {text} are two places, the loops say one",
                        where="loops",
                        hint="correct a loop, or the points",
                    )
        return places

    def _fixed(self) -> dict[str, Place]:
        """Return the places of the nodes that given vectors join to the origin."""
        still = [name for name in self.order if self._given(name) == OF_VECTORS]
        entry = next(iter(self.closure.loops.values()))[0]
        start = self.ends[entry.lstrip("-").strip()][entry.startswith("-")]
        pairs = [self.ends[name] for name in still]
        if still and start not in reached([pairs[0][0]], pairs):
            start = pairs[0][0]
        places = self._of_ground()
        if not places and not self.on_bodies:
            places = {start: (0.0, 0.0, 0.0)}
        left = list(still)
        while True:
            name = next((n for n in left if set(self.ends[n]) & set(places)), None)
            if name is None:
                return places
            left.remove(name)
            (tail, head), way = self.ends[name], span(self.closure.vectors[name])
            if tail in places:
                place = tuple(add(a, b) for a, b in zip(places[tail], way, strict=True))
                if head in places:
                    check_meeting(self.closure.vectors[name], places[head], place, self.known)
                places.setdefault(head, place)
            else:
                places[tail] = tuple(less(a, b) for a, b in zip(places[head], way, strict=True))

    def _check_connected(self) -> None:
        bodies = [
            (node, "@" + text.split(".")[0])
            for node, points in self.on_bodies.items()
            for text in points
        ]
        bodies += [(node, "@" + text.split(".")[0]) for node, text in self._at.items()]
        joints = [(f"@{j.first_body}", f"@{j.second_body}") for j in self.typed.values()]
        tied = reached([f"@{GROUND}"], [*self.ends.values(), *bodies, *joints])
        check_tied(self.closure.loops, {name: texts[0] for name, texts in self.ends.items()}, tied)

    def _called(self) -> dict[str, str]:
        """Return node -> name."""
        names: dict[str, str] = {}
        for name, node in self.closure.nodes.items():
            check_node(name, node, self.closure.vectors)
            if name in self.closure.vectors or name == GROUND:
                raise InputError(f"a vector is called '{name}' too", where=f"nodes.{name}")
            if self.merged.first(node.at) in self.on_bodies and name in self.closure.bodies:
                raise InputError(f"a body is called '{name}' too", where=f"nodes.{name}")
            place = self.merged.first(node.at)
            if place in names:
                raise InputError(f"'{names[place]}' is the same place", where=f"nodes.{name}.at")
            names[place] = name
        for pair in self.ends.values():
            for place in pair:
                names.setdefault(place, place.replace(".", "_"))
        return names

    def _pointer(self, name: str) -> Pointer:
        vector = self.closure.vectors[name]
        tail, head = (self._at[node] for node in self.ends[name])
        one, other = (text.split(".")[0] for text in (tail, head))
        if one == other:
            fixed = one == GROUND
            raise InputError(
                f"both ends of '{name}' are "
                + ("fixed by given vectors" if fixed else f"points of {one}"),
                where=f"vectors.{name}",
                hint="leave it out of the loops" if fixed else f'from = "{tail}", to = "{head}"',
            )
        return Pointer(
            name, tail, head,
            length=vector.length, elevation=vector.elevation, azimuth=vector.azimuth,
            friction=vector.friction, friction_static=vector.friction_static,
        )  # fmt: skip


def planar_only(vector: Vector) -> None:
    """Raise for keys of space in the plane."""
    for word in ("elevation", "azimuth"):
        if getattr(vector, word) is not None:
            raise InputError(
                f"'{word}' is a key of vectors in space",
                where=f"vectors.{vector.name}.{word}",
                hint="dimension = 3 above the tables, or 'angle'",
            )

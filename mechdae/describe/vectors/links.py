"""Which vectors are one link: one direction, joined by lengths that are given.

A direction is that of the fixed frame (""), of a body that has points of its own (its name), or of
the first vector that has it. Nodes joined by vectors of one direction and given length belong to
one link; a vector of unknown length is a sliding pair of two links of its direction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from mechdae.describe.mechanism import GROUND
from mechdae.describe.values import Number
from mechdae.describe.vectors.nodes import (
    HEAD,
    TAIL,
    Merged,
    check_meeting,
    in_order,
    place_of,
    reached,
)
from mechdae.describe.vectors.values import Closure, Vector, add, components, less, plain
from mechdae.errors import InputError, UnknownName
from mechdae.records import dataclass

FIXED = ""
"""The direction of what does not turn."""
Place = tuple[Number, Number]


@dataclass
class Link:
    """A body that vectors make: its direction, the angle of its frame from it, places of nodes.

    ``own`` is the vector that gives it name and frame, ``name`` is empty until there is one.
    """

    direction: str
    nodes: list[str]
    name: str = ""
    own: str = ""
    turn: Number = 0.0
    places: dict[str, Place] = field(default_factory=dict)


class VectorDirections:
    """The direction of each vector: what it goes by, and the angle from that."""

    def __init__(self, closure: Closure) -> None:
        self.closure = closure
        self.vectors: Mapping[str, Vector] = closure.vectors
        self._known: dict[str, tuple[str, Number]] = {}
        for name in self.vectors:
            self._find(name, ())

    def __getitem__(self, name: str) -> tuple[str, Number]:
        return self._known[name]

    def _find(self, name: str, before: tuple[str, ...]) -> tuple[str, Number]:
        if name in before:
            circle = " -> ".join([*before[before.index(name) :], name])
            raise InputError(f"vectors run along each other in a circle: {circle}")
        if name not in self._known:
            vector, place = self.vectors[name], f"vectors.{name}"
            if vector.from_ is not None and vector.to is not None:
                self._known[name] = self._segment(vector, place)
            elif vector.along is not None:
                if vector.along not in self.vectors:
                    raise UnknownName("vector", vector.along, self.vectors, where=f"{place}.along")
                direction, angle = self._find(vector.along, (*before, name))
                self._known[name] = direction, add(angle, vector.offset or 0.0)
            elif vector.angle is not None:
                self._known[name] = FIXED, plain(vector.angle)
            else:
                self._known[name] = name, 0.0
        return self._known[name]

    def _segment(self, vector: Vector, place: str) -> tuple[str, Number]:
        ends = (("from", str(vector.from_)), ("to", str(vector.to)))
        places = [place_of(text, self.closure, f"{place}.{word}") for word, text in ends]
        (x1, y1), (x2, y2) = places
        x, y = less(x2, x1), less(y2, y1)
        angle = 0.0 if y == 0 and isinstance(x, float) and x > 0 else f"atan2({y}, {x})"
        return FIXED if vector.body == GROUND else f"@{vector.body}", plain(angle)


class VectorLinks:
    """The links of loops, with the places of nodes on them.

    Loops without a fixed vector are ``held`` by joints that are described beside them.
    """

    def __init__(
        self,
        directions: VectorDirections,
        loops: Mapping[str, tuple[str, ...]],
        merged: Merged,
        known: Mapping[str, float],
        held: bool = False,
    ) -> None:
        self.directions = directions
        self.merged = merged
        self.known = known
        self.held = held
        self.vectors: Mapping[str, Vector] = directions.vectors
        self.order: list[str] = in_order(loops)
        self.origin: str = self._origin(loops)
        self._of: dict[tuple[str, str], Link] = {}
        self.all: list[Link] = []
        for name in self.order:
            for end in (TAIL, HEAD):
                self._make(directions[name][0], self.node(f"{name}.{end}"))
        self._name()
        for link in self.all:
            self._place(link)

    def node(self, end: str) -> str:
        """Return the node at ``rod.head`` or at the point ``@rod.B`` of a body."""
        return self.merged.first(end)

    def at(self, vector: str, end: str) -> Link:
        """Return the link on which an end of a vector lies."""
        return self._of[self.directions[vector][0], self.node(f"{vector}.{end}")]

    def on(self, node: str) -> list[Link]:
        """Return the links that a node joins, the fixed one first."""
        found = [link for link in self.all if node in link.nodes]
        return sorted(found, key=lambda link: link.name != GROUND)

    def _rigid(self, direction: str) -> list[str]:
        """Return the vectors of given length that have a direction."""
        return [
            name
            for name in self.order
            if self.directions[name][0] == direction and not self.vectors[name].slides
        ]

    def bound(self, direction: str) -> dict[str, tuple[str, Place]]:
        """Return node -> (point, place) of the body that a direction belongs to."""
        body = GROUND if direction == FIXED else direction.removeprefix("@")
        if direction != FIXED and not direction.startswith("@"):
            return {}
        found = {}
        for name in self.order:
            vector = self.vectors[name]
            for end, text in ((TAIL, vector.from_), (HEAD, vector.to)):
                if text is not None and vector.body == body:
                    point = text.split(".")[1]
                    x, y = self.directions.closure.points(body)[point]
                    found[self.node(f"{name}.{end}")] = (point, (x, y))
        return found

    def _origin(self, loops: Mapping[str, tuple[str, ...]]) -> str:
        """Return the node at the origin, or any on the ground where its points are given."""
        bound = self.bound(FIXED)
        if bound:
            return next(iter(bound))
        still = [name for name in self.order if self.directions[name][0] == FIXED]
        if not still and self.held:
            return f"@{GROUND}"
        if not still:
            raise InputError(
                "no vector is fixed",
                where="vectors",
                hint="give the angle of a guide, or length and angle of the frame",
            )
        rigid = [name for name in still if not self.vectors[name].slides]
        tail = self.node(f"{(rigid or still)[0]}.{TAIL}")
        pairs = self._pairs(FIXED)
        entry = next(iter(loops.values()))[0]
        end = f"{entry[1:].strip()}.{HEAD}" if entry.startswith("-") else f"{entry}.{TAIL}"
        return self.node(end) if self.node(end) in reached([tail], pairs) else tail

    def _pairs(self, direction: str) -> list[tuple[str, str]]:
        """Return the pairs of nodes that one link of a direction joins."""
        pairs = [
            (self.node(f"{name}.{TAIL}"), self.node(f"{name}.{HEAD}"))
            for name in self._rigid(direction)
        ]
        bound = list(self.bound(direction))
        return [*pairs, *((bound[0], other) for other in bound[1:])]

    def _make(self, direction: str, node: str) -> None:
        if (direction, node) in self._of:
            return
        link = Link(direction, reached([node], self._pairs(direction)))
        self.all.append(link)
        self._of |= dict.fromkeys(((direction, other) for other in link.nodes), link)

    def _name(self) -> None:
        """Give each link its name and its frame: those of a body, of a vector, of a block."""
        for link in self.all:
            if link.direction == FIXED and self.origin in link.nodes:
                link.name = GROUND
            elif link.direction.startswith("@") and set(link.nodes) & set(
                self.bound(link.direction)
            ):
                link.name = link.direction.removeprefix("@")
        for link in self.all:
            inside = [
                name
                for name in self._rigid(link.direction)
                if self.node(f"{name}.{TAIL}") in link.nodes
            ]
            if not link.name and inside:
                member = link.direction if link.direction in inside else inside[0]
                self._call(link, member, member, self.vectors[member].axis)
        for name in self.order:
            if not self.vectors[name].slides:
                continue
            guide, block = self.at(name, TAIL), self.at(name, HEAD)
            if guide is block:
                raise InputError(
                    f"the length of '{name}' is unknown, but vectors of its direction give it",
                    where=f"vectors.{name}",
                    hint="give its length, or leave it out",
                )
            if not guide.name:
                self._call(guide, name, name, self.vectors[name].axis)
            if not block.name:
                self._call(block, f"{name}_block", name, self.vectors[name].block_axis)

    def _call(self, link: Link, name: str, own: str, axis: Number | None) -> None:
        link.name, link.own = name, own
        turns = link.direction != FIXED and not link.direction.startswith("@")
        if turns or axis is not None:
            link.turn = less(self.directions[own][1], axis or 0.0)

    def _place(self, link: Link) -> None:
        """Find the places of the nodes of a link, in its frame."""
        if link.name == link.direction.removeprefix("@") or link.name == GROUND:
            link.places = {node: place for node, (_, place) in self.bound(link.direction).items()}
        if not link.places:
            tail_node = self.node(f"{link.own}.{TAIL}") if link.own else self.origin
            start = self.origin if link.name == GROUND else tail_node
            link.places[start if start in link.nodes else next(iter(link.nodes))] = (0.0, 0.0)
        steps = [name for name in self._rigid(link.direction) if self.vectors[name].body is None]
        left = [name for name in steps if self.node(f"{name}.{TAIL}") in link.nodes]
        while left:
            name = next(n for n in left if self._ends(n) & set(link.places))
            left.remove(name)
            self._step(link, name)

    def _ends(self, name: str) -> set[str]:
        return {self.node(f"{name}.{end}") for end in (TAIL, HEAD)}

    def _step(self, link: Link, name: str) -> None:
        """Place the other end of a vector of given length."""
        length = self.vectors[name].length
        assert length is not None
        x, y = components(length, less(self.directions[name][1], link.turn))
        tail, head = (self.node(f"{name}.{end}") for end in (TAIL, HEAD))
        if tail in link.places:
            tail_place = link.places[tail]
            place = (add(tail_place[0], x), add(tail_place[1], y))
            if head in link.places:
                check_meeting(self.vectors[name], link.places[head], place, self.known)
            else:
                link.places[head] = place
        else:
            tail_place = link.places[head]
            link.places[tail] = (less(tail_place[0], x), less(tail_place[1], y))

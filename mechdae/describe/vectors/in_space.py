"""Vector loops in space: nodes become points, vectors pairs of points."""

from __future__ import annotations

from collections.abc import Mapping

from mechdae.describe.expression import evaluate
from mechdae.describe.mechanism import GROUND, Body, Ground
from mechdae.describe.table import Table
from mechdae.describe.values import Number
from mechdae.describe.vectors.closure import Closure
from mechdae.describe.vectors.nodes import (
    HEAD,
    TAIL,
    check_loops,
    check_node,
    check_tied,
    in_order,
    nodes_of,
    reached,
)
from mechdae.describe.vectors.numbers import add, components, less
from mechdae.describe.vectors.pointers import WORDS, Pointer
from mechdae.describe.vectors.values import Vector
from mechdae.errors import InputError, UnavailableError

PLANAR = ("angle", "along", "offset", "from_", "to", "contact_length", "pin_radius", "one_sided")
FRICTION = ("friction", "friction_static")
GAP = 1e-9
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
    """The points and pairs of spatial loops.

    Raises
    ------
    InputError
        Keys of planar vectors, loops that do not close or do not hang together.
    """

    def __init__(self, closure: Closure, known: Mapping[str, float]) -> None:
        self.closure, self.known = closure, known
        self._check()
        check_loops(closure.vectors, closure.loops)
        self.merged = nodes_of(closure.vectors, closure.loops)
        self.order = in_order(closure.loops)
        self.ends = {
            name: tuple(self.merged.first(f"{name}.{end}") for end in (TAIL, HEAD))
            for name in self.order
        }
        self.places = self._fixed()
        self._check_connected()
        self._names = self._called()
        points = {self._names[node]: place for node, place in self.places.items()}
        self.ground = Ground(points=Table({**closure.ground.points, **points}))
        nodes = dict.fromkeys(node for pair in self.ends.values() for node in pair)
        moving = [self._names[node] for node in nodes if node not in self.places]
        masses = self._masses(moving)
        self.bodies: Table[Body] = Table({
            name: Body(name, Table({name: (0.0, 0.0, 0.0)}), mass=masses.get(name))
            for name in moving
        })  # fmt: skip
        self.joints: Table[Pointer] = Table({
            name: self._pointer(name)
            for name in closure.vectors
            if not set(self.ends[name]) <= set(self.places) or self._given(name) != WORDS
        })  # fmt: skip

    def _check(self) -> None:
        closure = self.closure
        if closure.joints or closure.ground.points:
            raise UnavailableError(
                "joints and points beside vector loops are not computed in space by this version",
                where="joints" if closure.joints else "ground",
            )
        for name, vector in closure.vectors.items():
            for word in PLANAR:
                if getattr(vector, word) is not None:
                    raise UnavailableError(
                        f"'{word.rstrip('_')}' is a key of vectors in the plane",
                        where=f"vectors.{name}.{word.rstrip('_')}",
                        hint="in space: length, elevation, azimuth",
                    )
            for word in FRICTION:
                if getattr(vector, word) is not None and self._given(name) != WORDS[1:]:
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

    def _masses(self, moving: list[str]) -> dict[str, Number | None]:
        """Return the masses of nodes: a point has nothing else."""
        for name, body in self.closure.bodies.items():
            if name not in moving:
                raise UnavailableError(
                    "bodies beside vector loops are not computed in space by this version: a node "
                    "that moves may have a mass",
                    where=f"bodies.{name}",
                    hint=f"nodes that move: {', '.join(moving)}",
                )
            for word in ("center", "inertia", "points"):
                if getattr(body, word):
                    raise InputError(
                        f"'{name}' is a point: it has a mass and no {word}",
                        where=f"bodies.{name}.{word}",
                    )
        return {name: body.mass for name, body in self.closure.bodies.items()}

    def _given(self, name: str) -> tuple[str, ...]:
        vector = self.closure.vectors[name]
        return tuple(word for word in WORDS if getattr(vector, word) is not None)

    def _fixed(self) -> dict[str, Place]:
        """Return the places of the nodes that given vectors join to the origin."""
        still = [name for name in self.order if self._given(name) == WORDS]
        entry = next(iter(self.closure.loops.values()))[0]
        start = self.ends[entry.lstrip("-").strip()][entry.startswith("-")]
        pairs = [self.ends[name] for name in still]
        if still and start not in reached([pairs[0][0]], pairs):  # type: ignore[arg-type]
            start = pairs[0][0]
        places: dict[str, Place] = {start: (0.0, 0.0, 0.0)}
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
                    self._check_meeting(name, places[head], place)
                places.setdefault(head, place)
            else:
                places[tail] = tuple(less(a, b) for a, b in zip(places[head], way, strict=True))

    def _check_meeting(self, name: str, first: Place, second: Place) -> None:
        gap = max(
            abs(evaluate(a, self.known) - evaluate(b, self.known))
            for a, b in zip(first, second, strict=True)
        )
        if gap > GAP * abs(evaluate(self.closure.vectors[name].length or 0.0, self.known)):
            raise InputError(
                f"given vectors do not close: '{name}' ends {gap:.6g} m from where others put it",
                where=f"vectors.{name}",
                hint="correct one of them, or leave out what the loop has to find",
            )

    def _check_connected(self) -> None:
        tied = reached(self.places, self.ends.values())  # type: ignore[arg-type]
        check_tied(self.closure.loops, {name: own[0] for name, own in self.ends.items()}, tied)

    def _called(self) -> dict[str, str]:
        """Return node -> name."""
        names: dict[str, str] = {}
        for name, node in self.closure.nodes.items():
            check_node(name, node, self.closure.vectors)
            if name in self.closure.vectors or name == GROUND:
                raise InputError(f"a vector is called '{name}' too", where=f"nodes.{name}")
            own = self.merged.first(node.at)
            if own in names:
                raise InputError(f"'{names[own]}' is the same place", where=f"nodes.{name}.at")
            names[own] = name
        for pair in self.ends.values():
            for place in pair:
                names.setdefault(place, place.replace(".", "_"))
        return names

    def _pointer(self, name: str) -> Pointer:
        vector = self.closure.vectors[name]
        tail, head = (
            f"{GROUND if node in self.places else self._names[node]}.{self._names[node]}"
            for node in self.ends[name]
        )
        if tail.startswith(f"{GROUND}.") and head.startswith(f"{GROUND}."):
            raise InputError(
                f"both ends of '{name}' are fixed by given vectors",
                where=f"vectors.{name}",
                hint="leave it out of the loops",
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

"""What a structure of spatial vector loops is: places, vectors, joints, ties, and their names."""

from __future__ import annotations

from dataclasses import dataclass, field

from tests.attack.spatial_structures import WORDS, Joint
from tests.reference.vector_nets import WORDS as TRIPLE

LETTERS = dict(zip("lab", TRIPLE, strict=True))
"""Letters of what is unknown of a vector: length, elevation (a), azimuth (b)."""


@dataclass(frozen=True)
class Place:
    """A point: the bodies that have it, with its names there; of none it is free."""

    owners: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True)
class Line:
    """A vector from place to place and the letters of what is unknown of it."""

    tail: int
    head: int
    unknown: str = ""


@dataclass
class Net:
    """A structure: a joint of each body, 1, 2, ..., places, vectors, ties, loops.

    ``ties`` are ("bar" or "ball", place, place). An entry of a loop is a vector's number and its
    sense, or a body with two points of it. ``driven`` is the number of a joint, or of a vector
    after them, and a word.
    """

    joints: list[Joint]
    places: list[Place]
    lines: list[Line]
    ties: list[tuple[str, int, int]]
    loops: list[list[tuple[int, str, str]]] = field(default_factory=list)
    driven: tuple[int, str] = (0, "")
    named: set[int] = field(default_factory=set)
    order: int = 0
    name: str = ""

    @property
    def bodies(self) -> int:
        return len(self.joints)

    @property
    def driver(self) -> str:
        k, word = self.driven
        return f"J{k}.{word}" if k < len(self.joints) else f"v{k - len(self.joints)}.{word}"

    @property
    def words(self) -> list[tuple[str, ...]]:
        """The words of the coordinates of joints, then of vectors."""
        return [
            *(WORDS.get(joint.letter, ()) for joint in self.joints),
            *(tuple(LETTERS[x] for x in line.unknown) for line in self.lines),
        ]

    def label(self, place: int) -> str:
        """Return what a free point is called in results: after its first end, or as a node."""
        if place in self.named:
            return f"N{place}"
        for i, line in enumerate(self.lines):
            for end, own in (("tail", line.tail), ("head", line.head)):
                if own == place:
                    return f"v{i}_{end}"
        raise KeyError(place)

    def point(self, place: int) -> str:
        """Return the name of a point in results and joints."""
        owners = self.places[place].owners
        if not owners:
            return f"{self.label(place)}.{self.label(place)}"
        body, name = owners[-1]
        return f"b{body}.{name}" if body else f"ground.{name}"

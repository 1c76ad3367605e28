"""Vectors and nodes of closed loops; sums and components of numbers that may be expressions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import Any

from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.joints.joint import SIDES, Joint
from mechdae.describe.values import NAME, Number, Table, Value
from mechdae.errors import InputError
from mechdae.records import dataclass, key, optional

PAIRS = ("block", "pin-in-slot")


@dataclass(frozen=True)
class Vector(Value):
    """A directed segment of a loop: length and angle; what is absent is unknown or driven.

    ``along`` names a vector of the same direction, less ``offset``: they belong to one link.
    ``from`` and ``to`` make it the segment between two points of one body. A vector of unknown
    length slides: its head is a block with a pin of its own, or a pin in the slot itself. ``axis``
    and ``block_axis`` turn the frames of the link and of the block that are called after it.

    Examples
    --------
    >>> crank, slot = md.Vector("crank", length=0.08), md.Vector("slot")
    >>> crank.slides, slot.slides
    (False, True)
    """

    name: str = key("name")
    length: Number | None = optional("number", doc="absent: unknown or driven", unit="m")
    angle: Number | None = optional("number", doc="from x; absent: unknown or driven", unit="rad")
    elevation: Number | None = optional("number", unit="rad")
    azimuth: Number | None = optional("number", unit="rad")
    along: str | None = optional("name", doc="vector of the same link with the same direction")
    offset: Number | None = optional("number", doc="angle from that vector", unit="rad")
    axis: Number | None = optional("number", doc="direction in its link's frame", unit="rad")
    block_axis: Number | None = optional("number", doc="the same of its block", unit="rad")
    from_: str | None = optional("reference", doc="tail: point of a body")
    to: str | None = optional("reference", doc="head: point of the same body")
    pair: str = optional("text", "block", choices=PAIRS, doc="how an unknown length slides")
    friction: Number | None = optional("number", doc="in its sliding pair", unit="1")
    friction_static: Number | None = optional("number", unit="1")
    contact_length: Number | None = optional("number", doc="of its block", unit="m")
    pin_radius: Number | None = optional("number", doc="of a pin in the slot", unit="m")
    one_sided: str | None = optional("text", choices=SIDES, doc="side of the pin or block")
    parallel: bool = optional("flag", False, doc="a guide keeps its link in its direction")

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.from_ is None) != (self.to is None):
            missing = "to" if self.to is None else "from"
            raise InputError(f"the key '{missing}' is missing: a segment has two ends")
        if self.from_ is not None and self.to is not None:
            self._check_segment(self.from_, self.to)
        if self.along is not None and self.angle is not None:
            raise InputError(
                "'angle' and 'along' contradict each other",
                hint="keep one; offset = angle from the other vector",
            )
        if self.offset is not None and self.along is None:
            raise InputError("'offset' is the angle from the vector that 'along' names, not given")
        if self.block_axis is not None and (self.in_slot or not self.slides):
            raise InputError("a vector without a block has no 'block_axis'", where="block_axis")
        words: tuple[str, ...]
        if self.slides:
            words = ("friction_static", "contact_length") if self.in_slot else ("pin_radius",)
        else:
            words = ("friction", "friction_static", "contact_length", "pin_radius", "one_sided")
        for word in words:
            if getattr(self, word) is not None:
                kind = f"a {self.pair}" if self.slides else "a vector that does not slide"
                raise InputError(f"{kind} has no '{word}'", where=word)

    def _check_segment(self, tail: str, head: str) -> None:
        if tail.split(".")[0] != head.split(".")[0]:
            raise InputError("'from' and 'to' are points of one body", where="to")
        if tail == head:
            raise InputError("'from' and 'to' are the same point", where="to")
        for word in ("length", "angle", "along", "axis", "elevation", "azimuth"):
            if getattr(self, word) is not None:
                raise InputError(f"'{word}' contradicts 'from' and 'to', which give it", where=word)

    @property
    def slides(self) -> bool:
        """Its length is unknown or driven."""
        return self.length is None and self.from_ is None

    @property
    def in_slot(self) -> bool:
        return self.pair == "pin-in-slot"

    @property
    def body(self) -> str | None:
        """The body whose two points it connects."""
        return None if self.from_ is None else self.from_.split(".")[0]


@dataclass(frozen=True)
class Node(Value):
    """A name for the head or the tail of a vector: its point and its turning joint.

    Examples
    --------
    >>> md.Node("A", at="crank.head", friction=0.1, pin_radius=0.008).at
    'crank.head'
    """

    name: str = key("name")
    at: str = key("reference", doc="VECTOR.head or VECTOR.tail")
    friction: Number | None = optional("number", doc="in its pins", unit="1")
    friction_static: Number | None = optional("number", unit="1")
    pin_radius: Number | None = optional("number", unit="m")


@dataclass(frozen=True)
class Closure:
    """Vectors, loops and nodes as typed, with the bodies and joints that were typed beside them.

    ``ends`` are tail and head of each vector as points of the mechanism.
    ``aliases`` are the coordinates of vectors (``slot.length``, ``slot.angle``, ``slot`` for its
    angle) by the names they have in the mechanism; ``directions`` tell the body that a vector turns
    with, "" for none, and its angle in that body.
    """

    vectors: Table[Vector]
    loops: Table[tuple[str, ...]]
    nodes: Table[Node]
    ground: Any
    bodies: Table[Any]
    joints: Table[Joint]
    ends: Table[tuple[str, str]] = field(default_factory=Table)
    aliases: Table[str] = field(default_factory=Table)
    directions: Table[tuple[str, Number]] = field(default_factory=Table)

    def points(self, body: str) -> Mapping[str, tuple[Number, ...]]:
        """Return the points of a body, or of the ground, that is described by itself."""
        points: Mapping[str, tuple[Number, ...]] = (self.bodies.get(body) or self.ground).points
        return points


RIGHT_ANGLE = math.pi / 2
CLOSE = 4e-16
"""How near to a multiple of a right angle, by itself, an angle is one: `90` in degrees."""


def plain(number: Number) -> Number:
    """Return the value of an expression without names, anything else as it is."""
    if isinstance(number, str) and not names_in(number):
        return evaluate(number, {})
    return number


def _inside(number: Number) -> str:
    """Return a number as a factor."""
    if isinstance(number, str):
        return number if NAME.match(number) else f"({number})"
    return f"({number!r})" if number < 0 else repr(number)


def add(first: Number, second: Number) -> Number:
    """Return the sum; zeros leave no trace."""
    if isinstance(first, float) and isinstance(second, float):
        return first + second
    if second == 0:
        return first
    if first == 0:
        return second
    if isinstance(second, str) and second.startswith("-") and NAME.match(second[1:]):
        return f"{_term(first)} - {second[1:]}"
    return f"{_term(first)} + {_inside(second)}"


def _term(number: Number) -> str:
    return number if isinstance(number, str) else repr(number)


def negative(number: Number) -> Number:
    if isinstance(number, float):
        return -number if number else 0.0
    return f"-{_inside(number)}"


def less(first: Number, second: Number) -> Number:
    """Return the difference; equal expressions leave zero."""
    return 0.0 if first == second else add(first, negative(second))


def times(first: Number, second: Number) -> Number:
    """Return the product; zero and one leave no trace."""
    if isinstance(first, float) and isinstance(second, float):
        return first * second
    for one, other in ((first, second), (second, first)):
        if one == 0:
            return 0.0
        if one == 1:
            return other
        if one == -1:
            return negative(other)
    return f"{_inside(first)}*{_inside(second)}"


def components(length: Number, angle: Number) -> tuple[Number, Number]:
    """Return x and y of a vector; multiples of a right angle are exact."""
    angle = plain(angle)
    if isinstance(angle, str):
        return times(length, f"cos({angle})"), times(length, f"sin({angle})")
    turns = round(angle / RIGHT_ANGLE)
    if abs(angle - turns * RIGHT_ANGLE) <= CLOSE * abs(turns):
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[turns % 4]
    else:
        cos, sin = math.cos(angle), math.sin(angle)
    return times(plain(length), cos), times(plain(length), sin)

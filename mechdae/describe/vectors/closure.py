"""What a mechanism keeps of the vector loops it was made from."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from mechdae.describe.joints.joint import Joint
from mechdae.describe.table import Table
from mechdae.describe.values import Number
from mechdae.describe.vectors.values import Node, Vector
from mechdae.records import dataclass


@dataclass(frozen=True)
class Closure:
    """Vectors, loops and nodes as typed, with the bodies and joints that were typed beside them.

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
    aliases: Table[str] = field(default_factory=Table)
    directions: Table[tuple[str, Number]] = field(default_factory=Table)

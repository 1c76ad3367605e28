"""What of a mechanism decides its equations: everything but the values of its numbers.

Two mechanisms of one structure have the same equations with other values of the parameters. A
number that is literally zero belongs to the structure: what it multiplies is not there. So do
expressions, tables, and the range of a curve.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from mechdae.describe.mechanism import Mechanism


class Structure:
    """What mechanisms of one structure have in common, compared by one number mostly."""

    __slots__ = ("_hash", "_parts")

    def __init__(self, parts: Hashable) -> None:
        self._parts, self._hash = parts, hash(parts)

    def __reduce__(self) -> Any:
        return Structure, (self._parts,)  # hashes of texts are those of one process

    def __hash__(self) -> int:
        return self._hash

    def __repr__(self) -> str:
        return f"Structure({self._parts!r})"  # names kernels on disk: all of it

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Structure):
            return NotImplemented
        return self is other or (self._hash == other._hash and self._parts == other._parts)


def structure_of(mechanism: Mechanism, free: frozenset[str] = frozenset()) -> Structure:
    """Return a value that mechanisms of one structure have in common.

    Numbers that are `free` are symbols even where they are zero.
    """
    known: dict[frozenset[str], Structure] = mechanism.structures
    found = known.get(free)
    if found is None:
        found = known[free] = Structure(_structure(mechanism, free))
    return found


def _structure(mechanism: Mechanism, free: frozenset[str]) -> Hashable:
    numbers = tuple(
        (name, number if isinstance(number, str) else number == 0 and name not in free)
        for name, number in mechanism.numbers()
    )
    parameters = tuple(
        (name, number if isinstance(number, str) else None)
        for name, number in mechanism.parameters.items()
    )
    bodies = tuple((name, body.number, body.outline) for name, body in mechanism.bodies.items())
    values = mechanism.values()
    joints = tuple([joint.structure(values, free) for joint in mechanism.joints.values()])
    loads = tuple(load.settled() for load in mechanism.loads.values())
    outputs = tuple(mechanism.outputs.items())
    aliases = tuple(mechanism.aliases.items())
    space = (mechanism.dimension, _in_space(mechanism) if mechanism.dimension == 3 else None)
    return (numbers, parameters, bodies, joints, loads, outputs, aliases, space)


def _in_space(mechanism: Mechanism) -> Hashable:
    from mechdae.describe.spinning_links import on_lines

    return mechanism.order, on_lines(mechanism)


def cylinders(mechanism: Mechanism) -> list[str]:
    """Return the sliding joints between two bodies that have a pin or a ball each and no more."""
    others: dict[str, list[str]] = {}
    for name, joint in mechanism.joints.items():
        for body in joint.bodies:
            others.setdefault(body, []).append(name)
    joints = mechanism.joints
    return [
        name
        for name, joint in joints.items()
        if joint.straight
        and (joint.keeps_angle or (joint.spatial and not joint.winds))
        and all(
            body in mechanism.bodies
            and len(others[body]) == 2
            and all(joints[other].hinge for other in others[body] if other != name)
            for body in joint.bodies
        )
    ]

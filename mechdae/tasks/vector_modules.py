"""Which module of the vector method each Assur group is, and the loops it closes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import TYPE_CHECKING

from mechdae.describe.mechanism import Mechanism
from mechdae.describe.vectors.expand import slide_of
from mechdae.describe.vectors.nodes import signed
from mechdae.describe.vectors.values import Closure
from mechdae.equations.groups import Group
from mechdae.motion.modules.catalogue import MODULES, PLANE

if TYPE_CHECKING:
    from mechdae.types import Json


LETTERS = {"length": "l", "angle": "a", "elevation": "a", "azimuth": "b"}
SHOWN = {"l": "l", "a": "\u03b1", "b": "\u03b2"}
Unknown = tuple[str, str]
"""A vector and what of it is unknown: its length, or the angle of its direction."""


def modules(
    mechanism: Mechanism, groups: Sequence[Group], drivers: Sequence[str]
) -> list[Json | None]:
    """Return the module of each group, in the order of computation; None for those without one.

    ``unknown`` has vector -> its unknowns, ``loops`` the loops that the group closes, ``name`` the
    module of the catalogue where it is one: one loop and two unknowns.
    """
    closure = mechanism.closure
    if closure is None:
        return [None] * len(groups)
    space = mechanism.dimension == 3
    known = {_driven(mechanism, text) for text in drivers}
    pending = {name: _unknowns(mechanism, entries) for name, entries in closure.loops.items()}
    result: list[Json | None] = []
    for group in groups:
        unknowns = [
            entry
            for entry in dict.fromkeys(u for unknowns in pending.values() for u in unknowns)
            if entry not in known and _found_by(mechanism, group, entry)
        ]
        known |= set(unknowns)
        closed = [name for name, unknown in pending.items() if set(unknown) <= known]
        for name in closed:
            del pending[name]
        result.append(_module(unknowns, closed, space) if unknowns else None)
    return result


def _module(unknowns: Sequence[Unknown], closed: list[str], space: bool) -> Json:
    unknown: dict[str, list[str]] = {}
    for word in LETTERS:
        for vector, quantity in unknowns:
            if quantity == word:
                unknown.setdefault(vector, []).append(word)
    letters = ["".join(LETTERS[word] for word in words) for words in unknown.values()]
    orders = ("-".join(order) for order in permutations(letters)) if len(closed) == 1 else ()
    known = MODULES if space else PLANE
    text = ", ".join(
        f"{', '.join(SHOWN[letter] for letter in chosen)} of {vector}"
        for vector, chosen in zip(unknown, letters, strict=True)
    )
    return {
        "name": next((name for name in orders if name in known), None),
        "unknown": unknown,
        "loops": closed,
        "text": text,
    }


def _unknowns(mechanism: Mechanism, entries: Sequence[str]) -> list[Unknown]:
    """Return what a loop leaves open, directions under the vector that they go by."""
    found: list[Unknown] = []
    closure = mechanism.closure
    assert closure is not None
    for vector in (signed(entry)[0] for entry in entries):
        if mechanism.dimension == 3:
            joint = mechanism.joints.get(vector)
            found += [(vector, word) for word in (joint.coordinates if joint else ())]
            continue
        if closure.vectors[vector].slides:
            found.append((vector, "length"))
        if closure.directions[vector][0]:
            found.append((_root(closure, vector), "angle"))
    return list(dict.fromkeys(found))


def _root(closure: Closure, vector: str) -> str:
    """Return the vector that a direction goes by: the one that others run along."""
    along = closure.vectors[vector].along
    while along is not None:
        vector, along = along, closure.vectors[along].along
    body = closure.vectors[vector].body
    if body is not None:
        return next(name for name, other in closure.vectors.items() if other.body == body)
    return vector


def _driven(mechanism: Mechanism, text: str) -> Unknown:
    """Return the unknown that a driver gives."""
    closure = mechanism.closure
    assert closure is not None
    if mechanism.dimension == 3:
        vector, _, word = text.partition(".")
        return vector, word
    for vector in closure.vectors:
        if closure.aliases.get(f"{vector}.length", "") == closure.aliases.get(text, text):
            return vector, "length"
    part = closure.aliases.get(text, text).split(".")[0]
    owner = next((v for v, (body, _) in closure.directions.items() if body == part), "")
    return (_root(closure, owner), "angle") if owner else (text, "")


def _found_by(mechanism: Mechanism, group: Group, unknown: Unknown) -> bool:
    closure = mechanism.closure
    assert closure is not None
    vector, quantity = unknown
    if mechanism.dimension == 3:
        return vector in group.joints
    if quantity == "length":
        return slide_of(vector) in group.joints
    return closure.directions[vector][0] in group.bodies

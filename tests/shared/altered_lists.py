"""Certificates of which one list is altered: an entry less, twice, elsewhere."""

from __future__ import annotations

import copy
import random
from collections.abc import Iterator
from typing import Any

SETS = ("modes", "complex", "superfluous", "unknown")
"""Lists whose order says nothing; so do the harmonics of a motion."""
PARTS = (
    *("mechanism", "path", "poses", "modes", "complex", "groups", "bodies", "joints", "drivers"),
    *("steps", "through", "points", "signs", "superfluous", "unknown", "motion", "sums", "axis"),
    *("orientations", "low", "high", "x", "y"),
)
Place = tuple[Any, ...]


def lists(data: Any, place: Place = ()) -> Iterator[Place]:
    """Yield the places of all lists."""
    if isinstance(data, list):
        yield place
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in entries:
        if isinstance(value, dict | list):
            yield from lists(value, (*place, key))


def at(content: Any, place: Place) -> Any:
    for key in place:
        content = content[key]
    return content


def altered(content: Any, place: Place, how: str, rng: random.Random) -> Any:
    """Return a certificate with one list altered, None where that would change nothing."""
    changed = copy.deepcopy(content)
    here = at(changed, place)
    if not here:
        return None
    k = rng.randrange(len(here))
    if how == "less" and "motion" in place and here[k][:2] == ["0", "0"]:
        return None  # a harmonic that vanishes: b sin 0 s
    if how == "less":
        del here[k]
    elif how == "twice":
        here.insert(k, copy.deepcopy(here[k]))
    else:
        here.insert(rng.choice([i for i in range(len(here)) if i != k] or [k]), here.pop(k))
    return None if changed == content else changed


def kinds_of_lists(content: Any) -> dict[Place, list[Place]]:
    """Return the places of all lists by their kind, names of bodies and the like aside."""
    kinds: dict[Place, list[Place]] = {}
    for place in lists(content):
        kind = tuple(key if isinstance(key, str) and key in PARTS else "-" for key in place)[:5]
        kinds.setdefault(kind, []).append(place)
    return kinds


def alterations_of_lists(
    content: Any, rng: random.Random, picked: int = 1, every: bool = True
) -> Iterator[tuple[Place, str, Any]]:
    """Yield place, what is done, and the altered content, of `picked` lists of each kind.

    With not `every` list those of numbers are left out.
    """
    for places in kinds_of_lists(content).values():
        for place in rng.sample(places, min(picked, len(places))):
            if not every and place[-1] not in ("poses", "steps", *SETS):
                continue
            for how in ("less", "twice", "moved"):
                other = altered(content, place, how, rng)
                if other is not None and (how != "moved" or _order_counts(content, place)):
                    yield place, how, other


def _order_counts(content: Any, place: Place) -> bool:
    """Whether the order of a list is of names or tables: that of numbers is another number's."""
    named = isinstance(place[-1], str) and place[-1] in SETS
    return named or not any(isinstance(value, str) for value in at(content, place))


def is_set(place: Place) -> bool:
    """Whether a list means the same in any order."""
    inside = place[0] == "groups" and len(place) > 1
    return inside or bool({*SETS} & {place[-1], *place[:1]}) or "motion" in place


OPEN = "of others nothing is claimed"
NOT_ALL = "that there are no others is not claimed"


def is_fault(sentence: str, unaltered: str, place: Place, how: str) -> bool:
    """Whether an altered certificate is said to prove what it does not."""
    if how == "moved" and is_set(place):
        return sentence != unaltered
    return sentence == unaltered or not (OPEN in sentence or NOT_ALL in sentence)

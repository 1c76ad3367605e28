"""Certificates with one planted alteration that makes a claim false."""

from __future__ import annotations

import copy
import random
import re
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

KINDS = (
    *("number", "step", "label", "mode", "complex", "limit", "order", "pose", "joint", "body"),
    *("bound", "law"),
)
"""One number by 1e-6, a step left out, signs of a mode turned, a mode or a complex pose left out, a
limit moved by 1e-10, two steps exchanged, a pose that is said to be reached or not, a joint or a
body left out, the bounds of a pose smaller than any error, the law of a driver moved by 1e-6."""
WEAKER = ("bound", "axis", "zero", "axis2", "zero2")
"""Claims that are still true when a number grows; directions, whose length does not count."""
NUMBER = re.compile("-?[0-9]+(/[0-9]+)?")
SMALL = 1e-9
MOVED = Fraction(1, 10**10)


def numbers(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the places of all exact numbers whose change makes a claim false."""
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in entries:
        if isinstance(value, dict | list) and key not in WEAKER:
            yield from numbers(value, (*path, key))
        elif isinstance(value, str) and "signs" not in path and NUMBER.fullmatch(value):
            yield (*path, key)


def entry(data: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        data = data[key]
    return data


def alter(content: dict[str, Any], kind: str, rng: random.Random) -> tuple[dict[str, Any], str]:
    """Return a certificate with an alteration of a kind, and what it is ("": none can be)."""
    own = copy.deepcopy(content)
    steps, poses, modes = (
        own.get("path", {}).get("steps", []),
        own.get("poses", []),
        own.get("modes", []),
    )
    if kind == "number":
        place = rng.choice(list(numbers(own)))
        value = Fraction(entry(own, place))
        changed = value + (abs(value) if abs(value) > SMALL else 1) * Fraction(
            rng.choice((-1, 1)), 10**6
        )
        entry(own, place[:-1])[place[-1]] = str(changed)
        return own, "/".join(map(str, place))
    if kind in ("step", "order") and len(steps) > 1:
        k = rng.randrange(len(steps) - 1)
        step = steps.pop(k)
        if kind == "order":
            steps.insert(k + 1, step)
        return own, f"path/steps/{k}"
    if kind == "pose" and poses:
        k = rng.choice([k for k, pose in enumerate(poses) if pose["status"] != "limit"])
        told = poses[k]["status"]
        poses[k] |= {"status": "ok" if told == "unassembled" else "unassembled"}
        return own, f"poses/{k}"
    if kind == "limit":
        for word in ("low", "high"):
            if word in own.get("path", {}):
                moved = Fraction(own["path"][word]["at"]) + rng.choice((-1, 1)) * MOVED
                own["path"][word]["at"] = str(moved)
                return own, f"path/{word}"
    if kind == "label" and len(modes) > 1 and "signs" in modes[0]:
        k = rng.randrange(len(modes))
        signs = list(zip(*(mode["signs"] for mode in modes), strict=True))
        turned = [g for g, own_signs in enumerate(signs) if len(set(own_signs)) > 1]
        if not turned:
            return own, ""  # of redundant groups signs tell nothing
        g = rng.choice(turned)
        modes[k]["signs"][g] = str(-int(modes[k]["signs"][g]))
        return own, f"modes/{k}/signs/{g}"
    if kind in ("mode", "complex") and own.get("modes" if kind == "mode" else kind):
        listed = own["modes" if kind == "mode" else kind]
        k = rng.randrange(len(listed))
        del listed[k]
        return own, f"{kind} {k}"
    if kind == "bound":
        claims = modes or [pose for pose in poses if pose["status"] == "ok"]
        if not any(claim["points"] for claim in claims):
            return own, ""  # of vectors in space no place is told that a bound is of
        k = rng.randrange(len(claims))
        claims[k]["bound"] = dict.fromkeys(claims[k]["bound"], "0")
        return own, f"bound {k}"
    if kind == "law":
        laws = own["mechanism"]["drivers"]
        name = rng.choice(sorted(laws))
        laws[name] = ["+", "1/1000000", laws[name]]
        return own, f"drivers/{name}"
    if kind in ("joint", "body"):
        table = own["mechanism"]["joints" if kind == "joint" else "bodies"]
        name = rng.choice(sorted(table))
        del table[name]
        return own, f"{kind} {name}"
    return own, ""

"""Vectors of spatial loops: from their tail to their head by length, elevation and azimuth."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from mechdae.describe.joints.joint import Joint
from mechdae.types import Sym

WORDS = ("length", "elevation", "azimuth")


def span(joint: Joint, numbers: Mapping[str, Sym], symbols: Mapping[str, Sym]) -> Sym:
    """Return head less tail (3,): what is no number of the mechanism is a coordinate."""
    length, e, a = (symbols.get(w, numbers.get(f"{joint.name}.{w}")) for w in WORDS)
    level = length * ca.cos(e)
    return ca.vertcat(level * ca.cos(a), length * ca.sin(e), level * ca.sin(a))


def told(joint: Joint, numbers: Mapping[str, Sym], way: Sym) -> dict[str, object]:
    """Return the coordinates of a vector that is `way` (3,), the usual one of equal triples."""
    length, e, a = (numbers.get(f"{joint.name}.{w}") for w in WORDS)
    x, y, z = ca.vertsplit(way)
    size = ca.norm_2(way)
    if length is None and e is not None:
        if a is not None:
            along = ca.vertcat(ca.cos(e) * ca.cos(a), ca.sin(e), ca.cos(e) * ca.sin(a))
            length = ca.dot(way, along)
        else:
            length = ca.if_else(y * ca.sin(e) < 0, -size, size)
    length = size if length is None else length
    sense = ca.if_else(length < 0, -1, 1)
    found: dict[str, object] = {"length": length}
    if e is None:
        level = ca.sqrt(x**2 + z**2) if a is None else sense * (x * ca.cos(a) + z * ca.sin(a))
        found["elevation"] = ca.atan2(sense * y, level)
        e = 0
    if a is None:
        sense = sense * ca.if_else(ca.cos(e) < 0, -1, 1)
        found["azimuth"] = ca.atan2(sense * z, sense * x)
    return {word: value for word, value in found.items() if word in joint.coordinates}


def structure_rows(joint: Joint, gap: Sym) -> list[tuple[str, Sym, str]]:
    """Return as many equations between the two points as the vector takes freedoms.

    For the structure: only which coordinates are in them counts.
    """
    weights = ((1.0, 1.3, 0.7), (0.4, 1.1, 1.9), (1.6, 0.3, 0.8))
    count = 3 - len(joint.coordinates)
    return [
        (axis, ca.dot(ca.DM(list(w)), gap) - k * ca.sumsqr(gap), "m")
        for k, (axis, w) in enumerate(zip("xyz", weights[:count], strict=False))
    ]

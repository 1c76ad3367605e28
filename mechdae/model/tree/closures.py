"""Equations of joints that are cut open, and of the norms of quaternions.

In the fixed frame A1 = [n1 m1 a1] and A2 are the frames of the two sides, g the gap of the points.
Equations of directions are pure numbers, which count as radians. Those of revolute, prismatic and
other pairs hold for axes of opposite sense too: what must be positive is listed beside them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi as ca

Rows = list[tuple[str, Any, str]]


@dataclass(frozen=True)
class CutJoint:
    """A joint between two placed bodies.

    ``gap`` (3,), ``A1`` and ``A2`` (3, 3), its ``own`` coordinates by name (angles that are asked
    for), ``length`` of a distance and ``lead`` of a screw.
    """

    gap: Any
    A1: Any
    A2: Any
    own: Mapping[str, Any] = field(default_factory=dict)
    length: Any = None
    lead: Any = None

    def n(self, side: int) -> Any:
        return (self.A1, self.A2)[side - 1][:, 0]

    def m(self, side: int) -> Any:
        return (self.A1, self.A2)[side - 1][:, 1]

    def a(self, side: int) -> Any:
        return (self.A1, self.A2)[side - 1][:, 2]


def together(cut: CutJoint) -> Rows:
    """P2 - P1 = 0."""
    return [(axis, cut.gap[i], "m") for i, axis in enumerate("xyz")]


def on_axis(cut: CutJoint) -> Rows:
    """The second point on the axis of the first."""
    return [
        ("n", ca.dot(cut.n(1), cut.gap), "m"),
        ("m", ca.dot(cut.m(1), cut.gap), "m"),
    ]


def in_plane(cut: CutJoint) -> Rows:
    """The second point in the plane across the axis of the first."""
    return [("a", ca.dot(cut.a(1), cut.gap), "m")]


def parallel(cut: CutJoint) -> Rows:
    """n1 . a2 = m1 . a2 = 0."""
    return [
        ("tilt_n", ca.dot(cut.n(1), cut.a(2)), "rad"),
        ("tilt_m", ca.dot(cut.m(1), cut.a(2)), "rad"),
    ]


def unturned(cut: CutJoint) -> Rows:
    """n1 . m2 = 0."""
    return [("turn", ca.dot(cut.n(1), cut.m(2)), "rad")]


def crossing(cut: CutJoint) -> Rows:
    """The pins of a universal joint are normal to each other: a1 . n2 = 0."""
    return [("cross", ca.dot(cut.a(1), cut.n(2)), "rad")]


def pitched(cut: CutJoint) -> Rows:
    """a1 . g = lead angle."""
    return [("pitch", ca.dot(cut.a(1), cut.gap) - cut.lead * cut.own["angle"], "m")]


def apart(cut: CutJoint) -> Rows:
    """|g|^2 - length^2 = 0, divided by 2 length: a length again."""
    return [("l", (ca.sumsqr(cut.gap) / cut.length - cut.length) / 2, "m")]


ROWS: dict[str, tuple[Callable[[CutJoint], Rows], ...]] = {
    "revolute": (together, parallel),
    "prismatic": (on_axis, parallel, unturned),
    "cylindrical": (on_axis, parallel),
    "screw": (on_axis, parallel, pitched),
    "universal": (together, crossing),
    "spherical": (together,),
    "planar": (in_plane, parallel),
    "weld": (together, parallel, unturned),
    "distance": (apart,),
}


def rows_of(kind: str, cut: CutJoint) -> Rows:
    """Return the equations of a cut joint."""
    return [row for part in ROWS[kind] for row in part(cut)]


def angles_of(cut: CutJoint, crossed: bool) -> list[tuple[str, Any, Any]]:
    """Return sine and cosine of the angles that a cut joint has, by the coordinate's name."""
    if not crossed:
        return [("angle", ca.dot(cut.m(1), cut.n(2)), ca.dot(cut.n(1), cut.n(2)))]
    return [
        ("angle", ca.dot(cut.m(1), cut.n(2)), ca.dot(cut.n(1), cut.n(2))),
        ("angle2", ca.dot(cut.m(2), cut.a(1)), ca.dot(cut.a(2), cut.a(1))),
    ]


def turned(angle: Any, sine: Any, cosine: Any) -> tuple[Any, Any]:
    """Return the equation of an angle with that sine and cosine, and what must be positive."""
    s, c = ca.sin(angle), ca.cos(angle)
    return cosine * s - sine * c, cosine * c + sine * s


def senses(parts: tuple[Any, ...], cut: CutJoint) -> list[Any]:
    """Return what must be positive where a cut joint is closed."""
    found = []
    if parallel in parts:
        found.append(ca.dot(cut.a(1), cut.a(2)))
    if unturned in parts:
        found.append(ca.dot(cut.n(1), cut.n(2)))
    return found

"""Equations of joints that are cut open, and of the norms of quaternions.

In the fixed frame A1 = [n1 m1 a1] and A2 are the frames of the two sides, g the gap of the points.
Equations of directions are pure numbers, which count as radians. Those of revolute, prismatic and
other pairs hold for axes of opposite sense too: what must be positive is listed beside them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca

from mechdae.equations.tree.joint_chains import (
    Freedom,
    Way,
    WayProduct,
    WayProducts,
    X,
    Z,
    back,
    joined,
)
from mechdae.equations.tree.spatial_frames import placed
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX

UNIT = tuple(SX([float(i == k) for i in range(3)]) for k in range(3))


class Closed(NamedTuple):
    """One equation of a joint: part, expression, unit, and what bounds are made of."""

    part: str
    expression: Any
    unit: str
    reach: WayProducts | None = None


Rows = list[Closed]


@dataclass(frozen=True)
class CutJoint:
    """A joint between two placed bodies.

    ``gap`` (3,), ``A1`` and ``A2`` (3, 3), its ``own`` coordinates by name (angles that are asked
    for), ``length`` of a distance and ``lead`` of a screw. ``ways`` lead from one frame to both
    sides. ``hung`` are the parts of the gap that a quaternion turns, with their senses and lengths.
    """

    gap: Sym
    A1: Sym
    A2: Sym
    own: Mapping[str, Sym] = field(default_factory=dict)
    length: Any = None
    lead: Any = None
    ways: tuple[Way, Way] | None = None
    hung: tuple[tuple[float, Sym, Sym], ...] = ()

    def n(self, side: int) -> Sym:
        return (self.A1, self.A2)[side - 1][:, 0]

    def m(self, side: int) -> Sym:
        return (self.A1, self.A2)[side - 1][:, 1]

    def a(self, side: int) -> Sym:
        return (self.A1, self.A2)[side - 1][:, 2]

    @cached_property
    def way(self) -> Way | None:
        """The way from the first side to the second."""
        return None if self.ways is None else joined(back(self.ways[0]), self.ways[1])

    def reach(self, start: int, tip: int | None = None, rest: Sym = 0) -> WayProducts | None:
        """Return that of a column of the first side and one of the second, None: the point."""
        if self.way is None:
            return None
        end = None if tip is None else UNIT[tip]
        return WayProducts((WayProduct(self.way, UNIT[start], end),), SX(rest))

    @property
    def turned(self) -> bool:
        """Whether a quaternion turns a part of the gap."""
        return bool(self.hung) or (self.way is not None and self._inside)

    @property
    def _inside(self) -> bool:
        """Whether quaternions turn more of the gap than what is hung on its ends."""
        words = [part.word for part in self.way or () if isinstance(part, Freedom)]
        return "ball" in words[1:-1] or words.count("ball") != len(self.hung)

    @cached_property
    def half_square(self) -> Sym:
        """Half the square of the gap; quaternions turn their parts of it, whatever their norm."""
        if self.way is not None and self._inside:
            return half_square_of(self.way)
        rest = self.gap - sum((sense * part for sense, part, _ in self.hung), SX(3, 1))
        total = ca.sumsqr(rest) / 2
        for k, (sense, part, length) in enumerate(self.hung):
            total += ca.sumsqr(length) / 2 + sense * ca.dot(rest, part)
            total += sum(sense * other * ca.dot(part, axis) for other, axis, _ in self.hung[:k])
        return total

    def square_reach(self, factor: Sym, rest: Sym) -> WayProducts | None:
        """Return that of half the square of the gap."""
        if self.way is None:
            return None
        return WayProducts((WayProduct(self.way, None, None, factor),), SX(rest))


def half_square_of(way: Way) -> Sym:
    """Return half the square of the length of a way: what a quaternion turns stays as long.

    Of two parts v and R(e) w it is |v|^2 / 2 + v.R(e) w + |w|^2 / 2, and so on for those of w.
    """
    for k, part in enumerate(way):
        if isinstance(part, Freedom) and part.word == "ball":
            v, w = placed(way[:k])[0], placed(way[k + 1 :])[0]
            A = placed(way[: k + 1])[1]
            return ca.sumsqr(v) / 2 + ca.dot(v, A @ w) + half_square_of(way[k + 1 :])
    return ca.sumsqr(placed(way)[0]) / 2


def together(cut: CutJoint) -> Rows:
    """P2 - P1 = 0."""
    reaches: list[WayProducts | None] = [None] * 3
    if cut.ways is not None:
        one, other = map(joined, cut.ways)
        reaches = [
            WayProducts((WayProduct(other, e), WayProduct(one, e, None, -1.0))) for e in UNIT
        ]
    return [Closed(axis, cut.gap[i], "m", reaches[i]) for i, axis in enumerate("xyz")]


def on_axis(cut: CutJoint) -> Rows:
    """The second point on the axis of the first."""
    return [
        Closed("n", ca.dot(cut.n(1), cut.gap), "m", cut.reach(0)),
        Closed("m", ca.dot(cut.m(1), cut.gap), "m", cut.reach(1)),
    ]


def in_plane(cut: CutJoint) -> Rows:
    """The second point in the plane across the axis of the first."""
    return [Closed("a", ca.dot(cut.a(1), cut.gap), "m", cut.reach(2))]


def parallel(cut: CutJoint) -> Rows:
    """n1 . a2 = m1 . a2 = 0."""
    return [
        Closed("tilt_n", ca.dot(cut.n(1), cut.a(2)), "rad", cut.reach(0, 2)),
        Closed("tilt_m", ca.dot(cut.m(1), cut.a(2)), "rad", cut.reach(1, 2)),
    ]


def unturned(cut: CutJoint) -> Rows:
    """n1 . m2 = 0."""
    return [Closed("turn", ca.dot(cut.n(1), cut.m(2)), "rad", cut.reach(0, 1))]


def crossing(cut: CutJoint) -> Rows:
    """The pins of a universal joint are normal to each other: a1 . n2 = 0."""
    return [Closed("cross", ca.dot(cut.a(1), cut.n(2)), "rad", cut.reach(2, 0))]


def pitched(cut: CutJoint) -> Rows:
    """a1 . g = lead angle."""
    shift = cut.lead * cut.own["angle"]
    reach = cut.reach(2, None, -shift)
    return [Closed("pitch", ca.dot(cut.a(1), cut.gap) - shift, "m", reach)]


def at_distance(cut: CutJoint) -> Rows:
    """|g|^2 - length^2 = 0, divided by 2 length: a length again."""
    reach = cut.square_reach(1 / cut.length, -cut.length / 2)
    if not cut.turned:
        return [Closed("l", (ca.sumsqr(cut.gap) / cut.length - cut.length) / 2, "m", reach)]
    return [Closed("l", cut.half_square / cut.length - cut.length / 2, "m", reach)]


ROWS: dict[str, tuple[Callable[[CutJoint], Rows], ...]] = {
    "revolute": (together, parallel),
    "prismatic": (on_axis, parallel, unturned),
    "cylindrical": (on_axis, parallel),
    "screw": (on_axis, parallel, pitched),
    "universal": (together, crossing),
    "spherical": (together,),
    "planar": (in_plane, parallel),
    "weld": (together, parallel, unturned),
    "distance": (at_distance,),
}


def rows_of(kind: str, cut: CutJoint) -> Rows:
    """Return the equations of a cut joint."""
    return [row for part in ROWS[kind] for row in part(cut)]


def angles_of(cut: CutJoint, crossed: bool) -> list[tuple[str, Sym, Sym]]:
    """Return sine and cosine of the angles that a cut joint has, by the coordinate's name."""
    if not crossed:
        return [("angle", ca.dot(cut.m(1), cut.n(2)), ca.dot(cut.n(1), cut.n(2)))]
    return [
        ("angle", ca.dot(cut.m(1), cut.n(2)), ca.dot(cut.n(1), cut.n(2))),
        ("angle2", ca.dot(cut.m(2), cut.a(1)), ca.dot(cut.a(2), cut.a(1))),
    ]


def turned(cut: CutJoint, word: str, sine: Sym, cosine: Sym) -> tuple[Closed, Sym]:
    """Return the equation of an angle with that sine and cosine, and what must be positive."""
    angle = cut.own[word]
    s, c = ca.sin(angle), ca.cos(angle)
    reach = None
    if cut.way is not None:
        first = word == "angle"
        turning = Freedom("turn", (angle,), Z if first else X)
        way = (turning, *cut.way) if first else (*cut.way, turning)
        reach = WayProducts((WayProduct(way, UNIT[1 if first else 2], UNIT[0 if first else 1]),))
    return Closed(word, cosine * s - sine * c, "rad", reach), cosine * c + sine * s


def senses(parts: tuple[object, ...], cut: CutJoint) -> list[Sym]:
    """Return what must be positive where a cut joint is closed."""
    found = []
    if parallel in parts:
        found.append(ca.dot(cut.a(1), cut.a(2)))
    if unturned in parts:
        found.append(ca.dot(cut.n(1), cut.n(2)))
    return found

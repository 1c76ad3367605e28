"""Frames of bodies along the edges of a tree of joints, and vectors of spatial loops.

The orientation of a body is held as that of its joint's frame, R = B C^T with a constant C, so that
constant rotations are multiplied with each other and not with what moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import casadi as ca

from mechdae.describe.joints.joint import Joint
from mechdae.equations.coordinates import QUATERNION
from mechdae.equations.tree.joint_chains import Freedom, RigidPart, Way, X, back, freedoms
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX


@dataclass(frozen=True)
class TreeFrame:
    """Placement of one body: ``r`` (3,) its anchor, ``basis`` (3, 3) and the constant ``turn``.

    ``way`` leads from the ground to the basis; None: it is not known.
    """

    r: Sym
    basis: Sym
    turn: Sym
    way: Way | None = None

    @cached_property
    def R(self) -> Sym:
        """The rotation matrix of the body."""
        return self.basis @ self.turn.T

    def point(self, s: Sym) -> Sym:
        """Return the place of a point with coordinates `s` from the anchor."""
        return self.r + self.direction(s)

    def direction(self, d: Sym) -> Sym:
        """Return a body-fixed direction in the fixed frame."""
        return self.basis @ ca.sparsify(self.turn.T @ d)

    def side(self, C: Sym) -> Sym:
        """Return a body-fixed rotation in the fixed frame."""
        return self.basis @ ca.sparsify(self.turn.T @ C)

    @property
    def on_ball(self) -> bool:
        """Whether the body is turned by a quaternion of its own last."""
        last = self.way[-1] if self.way else None
        return isinstance(last, Freedom) and last.word == "ball"

    def to(self, s: Sym, C: Sym) -> Way | None:
        """Return the way from the ground to a point of the body, and to a frame C there."""
        if self.way is None:
            return None
        link = RigidPart(ca.sparsify(self.turn.T @ s), ca.sparsify(self.turn.T @ C))
        return (*self.way, link)


def about_z(angle: Sym) -> Sym:
    """Return the rotation about the third axis."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, SX(1)))


def about_x(angle: Sym) -> Sym:
    """Return the rotation about the first axis."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(SX(1), 0, 0), ca.horzcat(0, c, -s), ca.horzcat(0, s, c))


def by_quaternion(e: Sym) -> Sym:
    """Return the rotation by a unit quaternion (4,), its real part first."""
    w, x, y, z = ca.vertsplit(e)
    return ca.vertcat(
        ca.horzcat(w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )


@dataclass(frozen=True)
class JointMotion:
    """What a joint does: its coordinates by name, crossed pins, the lead of a screw a radian."""

    at: Mapping[str, Sym]
    crossed: bool = False
    lead: Any = None

    @cached_property
    def moved(self) -> tuple[Sym, Sym]:
        """Rotation Q (3, 3) and shift t (3,) in the joint's first frame."""
        at, zero = self.at, SX(3, 1)
        if "e0" in at:
            return by_quaternion(ca.vertcat(*[at[name] for name in QUATERNION])), zero
        Q = about_z(at["angle"]) if "angle" in at else SX.eye(3)
        if self.crossed:
            Q = Q @ about_x(at["angle2"])
        if self.lead is not None:
            return ca.sparsify(Q), ca.vertcat(0, 0, self.lead * at["angle"])
        shift = [at.get(name, SX(0)) for name in ("x", "y", "slide")]
        return ca.sparsify(Q), ca.sparsify(ca.vertcat(*shift))

    def way(self, side: Way | None, forward: bool) -> Way | None:
        """Return the way to the joint's first frame, or back, led on through it."""
        if side is None:
            return None
        found = freedoms(self.at, self.crossed, self.lead)
        return (*side, *(found if forward else back(found)))


def forward(first: TreeFrame, s1: Sym, C1: Sym, C2: Sym, play: JointMotion) -> TreeFrame:
    """Return the frame of the second body of a joint; its anchor is the joint's point."""
    Q, t = play.moved
    A = first.side(C1)
    return TreeFrame(first.point(s1) + A @ t, A @ Q, C2, play.way(first.to(s1, C1), True))


def backward(second: TreeFrame, s2: Sym, C1: Sym, C2: Sym, play: JointMotion) -> TreeFrame:
    """Return the frame of the first body of a joint; its anchor is the joint's point."""
    Q, t = play.moved
    A = second.side(C2) @ Q.T
    return TreeFrame(second.point(s2) - A @ t, A, C1, play.way(second.to(s2, C2), False))


def placed(way: Way) -> tuple[Sym, Sym]:
    """Return place (3,) and rotation (3, 3) of the end of a way, seen from its start."""
    r, A = SX(3, 1), SX.eye(3)
    for part in way:
        if isinstance(part, RigidPart):
            r, A = r + A @ part.place, A @ part.turn
            continue
        at, sense = part.symbols[0], part.sense
        if part.word == "ball":
            turn = by_quaternion(ca.vertcat(*part.symbols))
            A = A @ (turn if sense > 0 else turn.T)
            continue
        slide = at if part.word == "slide" else part.lead * at
        Q = SX.eye(3)
        if part.turns:
            Q = about_x(at) if part.axis == X else about_z(at)
        if sense < 0:
            A = A @ Q.T
        r = r + sense * A[:, part.axis] * slide if part.slides else r
        if sense > 0:
            A = A @ Q
    return r, A


WORDS = ("length", "elevation", "azimuth")


def span(joint: Joint, numbers: Mapping[str, Sym], symbols: Mapping[str, Sym]) -> Sym:
    """Return head less tail (3,): what is no number of the mechanism is a coordinate."""
    length, e, a = (symbols.get(w, numbers.get(f"{joint.name}.{w}")) for w in WORDS)
    level = length * ca.cos(e)
    return ca.vertcat(level * ca.cos(a), length * ca.sin(e), level * ca.sin(a))


def spherical(joint: Joint, numbers: Mapping[str, Sym], way: Sym) -> dict[str, object]:
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

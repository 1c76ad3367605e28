"""Frames of bodies along the edges of a tree of joints.

The orientation of a body is held as that of its joint's frame, R = B C^T with a constant C, so that
constant rotations are multiplied with each other and not with what moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

SX = ca.SX


@dataclass(frozen=True)
class TreeFrame:
    """Placement of one body: ``r`` (3,) its anchor, ``basis`` (3, 3) and the constant ``turn``."""

    r: Any
    basis: Any
    turn: Any

    @cached_property
    def R(self) -> Any:
        """The rotation matrix of the body."""
        return self.basis @ self.turn.T

    def point(self, s: Any) -> Any:
        """Return the place of a point with coordinates `s` from the anchor."""
        return self.r + self.direction(s)

    def direction(self, d: Any) -> Any:
        """Return a body-fixed direction in the fixed frame."""
        return self.basis @ ca.sparsify(self.turn.T @ d)

    def side(self, C: Any) -> Any:
        """Return a body-fixed rotation in the fixed frame."""
        return self.basis @ ca.sparsify(self.turn.T @ C)


def about_z(angle: Any) -> Any:
    """Return the rotation about the third axis."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, SX(1)))


def about_x(angle: Any) -> Any:
    """Return the rotation about the first axis."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(SX(1), 0, 0), ca.horzcat(0, c, -s), ca.horzcat(0, s, c))


def by_quaternion(e: Any) -> Any:
    """Return the rotation by a unit quaternion (4,), its real part first."""
    w, x, y, z = ca.vertsplit(e)
    return ca.vertcat(
        ca.horzcat(w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )


QUATERNION = ("e0", "e1", "e2", "e3")


def moved(at: Mapping[str, Any], crossed: bool = False, lead: Any = None) -> tuple[Any, Any]:
    """Return rotation Q (3, 3) and shift t (3,) of a joint in its first frame.

    Parameters
    ----------
    at
        The joint's coordinates by their names.
    crossed
        The second angle turns about the second pin.
    lead
        Slide a radian of a screw.
    """
    zero = SX(3, 1)
    if "e0" in at:
        return by_quaternion(ca.vertcat(*[at[name] for name in QUATERNION])), zero
    Q = about_z(at["angle"]) if "angle" in at else SX.eye(3)
    if crossed:
        Q = Q @ about_x(at["angle2"])
    if lead is not None:
        return ca.sparsify(Q), ca.vertcat(0, 0, lead * at["angle"])
    shift = [at.get(name, SX(0)) for name in ("x", "y", "slide")]
    return ca.sparsify(Q), ca.sparsify(ca.vertcat(*shift))


def forward(first: TreeFrame, s1: Any, C1: Any, C2: Any, motion: tuple[Any, Any]) -> TreeFrame:
    """Return the frame of the second body of a joint; its anchor is the joint's point."""
    Q, t = motion
    A = first.side(C1)
    return TreeFrame(first.point(s1) + A @ t, A @ Q, C2)


def backward(second: TreeFrame, s2: Any, C1: Any, C2: Any, motion: tuple[Any, Any]) -> TreeFrame:
    """Return the frame of the first body of a joint; its anchor is the joint's point."""
    Q, t = motion
    A = second.side(C2) @ Q.T
    return TreeFrame(second.point(s2) - A @ t, A, C1)

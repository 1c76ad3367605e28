"""Residuals of the joints: one short function for each kind, second minus first.

Each takes the joint, the frames of its bodies and the symbols of its numbers, and returns
its rows as (suffix, expression, unit), the unit "m" or "rad". Multiplying a row's
multiplier by -1 gives the reaction on the second body in world axes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca

from mechdae.describe.joints.joint import Joint
from mechdae.equations.coordinates import Frame
from mechdae.errors import UnavailableError
from mechdae.types import Sym

if TYPE_CHECKING:
    from mechdae.equations.cases.curve_contacts import Contact

Rows = list[tuple[str, Any, str]]


class Ends:
    """The two points of a joint and what its residual may ask for."""

    def __init__(
        self,
        joint: Joint,
        frame: Callable[[str], Frame],
        point: Callable[[str], Any],
        number: Mapping[str, Sym],
        contact: Contact | None = None,
    ) -> None:
        self.contact = contact
        self._frame, self._number = frame, number
        self.joint: Joint = joint
        self.first: Frame = frame(joint.first_body)
        self.second: Frame = frame(joint.second_body)
        self.p1: Sym = point(joint.first)
        self.p2: Sym = point(joint.second)
        self.gap: Sym = self.p2 - self.p1

    def number(self, entry: str) -> Sym:
        """Return the symbol of one of the joint's numbers."""
        return self._number[f"{self.joint.name}.{entry}"]

    @property
    def carrier_angle(self) -> Sym:
        """Angle of the carrier; zero on the ground."""
        carrier = getattr(self.joint, "carrier", None)
        return self._frame(carrier).angle if carrier else ca.SX(0)

    def axis(self) -> Sym:
        """Direction of the guide in the fixed frame."""
        a = self.number("axis")
        return self.first.direction(ca.vertcat(ca.cos(a), ca.sin(a)))

    def normal(self) -> Sym:
        """Normal of the guide in the fixed frame, left of the axis."""
        a = self.number("axis")
        return self.first.direction(ca.vertcat(-ca.sin(a), ca.cos(a)))


def coincide(ends: Ends) -> Rows:
    """P2 - P1 = 0."""
    axes = "xyz"[: ends.gap.numel()]
    return [(axis, ends.gap[i], "m") for i, axis in enumerate(axes)]


def same_turn(ends: Ends) -> Rows:
    """theta2 - theta1 = turn."""
    return [("turn", ends.second.angle - ends.first.angle - ends.number("turn"), "rad")]


def on_line(ends: Ends) -> Rows:
    """N . (P2 - P1) = 0."""
    return [("n", ca.dot(ends.normal(), ends.gap), "m")]


def distance(ends: Ends) -> Rows:
    """|P2 - P1|^2 - length^2 = 0, divided by 2 length: a length again."""
    length = ends.number("length")
    return [("l", (ca.sumsqr(ends.gap) / length - length) / 2, "m")]


def gear(ends: Ends) -> Rows:
    """Ratio (theta2 - thetac) + phase - (theta1 - thetac) = 0, angles unwrapped."""
    carrier = ends.carrier_angle
    turned = ends.number("ratio") * (ends.second.angle - carrier) + ends.number("phase")
    return [("mesh", turned - (ends.first.angle - carrier), "rad")]


def rack(ends: Ends) -> Rows:
    """axis2 . (P2 - P1) - radius (theta1 - thetac) - phase = 0, angles unwrapped."""
    a = ends.number("axis")
    axis = ends.second.direction(ca.vertcat(ca.cos(a), ca.sin(a)))
    rolled = ends.number("radius") * (ends.first.angle - ends.carrier_angle)
    return [("mesh", ca.dot(axis, ends.gap) - rolled - ends.number("phase"), "m")]


def belt(ends: Ends) -> Rows:
    """+-ratio (theta2 - thetac) + phase - (theta1 - thetac) = 0; minus when crossed."""
    carrier = ends.carrier_angle
    ratio = ends.joint.sense * ends.number("ratio")
    turned = ratio * (ends.second.angle - carrier) + ends.number("phase")
    return [("belt", turned - (ends.first.angle - carrier), "rad")]


def friction_wheel(ends: Ends) -> Rows:
    """r1 (theta1 - thetac - phase) -+ r2 (theta2 - thetac) = 0, second less first."""
    carrier, sense = ends.carrier_angle, ends.joint.sense
    first = ends.number("radius") * (ends.first.angle - carrier - ends.number("phase"))
    second = sense * ends.number("second_radius") * (ends.second.angle - carrier)
    return [("contact", second - first, "m")]


def curve(ends: Ends) -> Rows:
    """P2 - P1 - R1 (c(s) + rho n) = 0; with a roller turn c'(s) x (cos psi, sin psi) = 0."""
    contact = ends.contact
    assert contact is not None
    place, touch = contact.point, []
    if contact.rolls:
        place = place + ends.number("roller_radius") * contact.normal
        (dx, dy), along = ca.vertsplit(contact.tangent), contact.direction
        touch = [("tangent", dx * along[1] - dy * along[0], "m")]
    gap = ends.gap - ends.first.direction(place)
    return [("x", gap[0], "m"), ("y", gap[1], "m"), *touch]


RESIDUALS: dict[str, tuple[Callable[[Ends], Rows], ...]] = {
    "revolute": (coincide,),
    "prismatic": (on_line, same_turn),
    "pin-in-slot": (on_line,),
    "weld": (coincide, same_turn),
    "distance": (distance,),
    "gear": (gear,),
    "rack": (rack,),
    "belt": (belt,),
    "friction-wheel": (friction_wheel,),
    "curve": (curve,),
}


def rows_of(ends: Ends) -> Rows:
    """Return all rows of a joint.

    Raises
    ------
    UnavailableError
        A joint kind that this version does not compute.
    """
    kind = ends.joint.kind
    if kind not in RESIDUALS:
        raise UnavailableError(
            f"joints of kind '{kind}' are not computed by this version",
            where=f"joints.{ends.joint.name}",
            hint=f"available: {', '.join(RESIDUALS)}",
        )
    return [row for part in RESIDUALS[kind] for row in part(ends)]

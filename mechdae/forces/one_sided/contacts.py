"""Contacts that can push and not pull, or the other way round: the force by which they hold.

A joint with the key ``one_sided`` keeps both of its bodies together whatever acts; a real
contact parts where the force would have to change its sign.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import casadi as ca

from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.joint import Joint
from mechdae.equations.forces.friction import tangent_of
from mechdae.equations.joints import Ends
from mechdae.equations.model import Model
from mechdae.equations.space import left
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX
POSITIVE = ("left", "positive", "push")


@dataclass(frozen=True)
class OneSided:
    """A one-sided contact.

    ``form`` (3,), in space (6,), is an expression of the coordinates; times the joint's reaction
    (force, and moment about the second point) it is the force [N], of a gear the moment [N m], by
    which the contact holds. Where ``half`` is given the moment over it is taken off: a block of
    that half length tips before it lifts.
    """

    name: str
    unit: str
    form: Sym
    half: Any = None


def one_sided(model: Model, among: Iterable[str]) -> list[OneSided]:
    """Return the contacts among some joints that are declared one-sided."""
    result = []
    for name in among:
        joint = model.mechanism.joints[name]
        side = getattr(joint, "one_sided", None)
        if side is None:
            continue
        sign = 1.0 if side in POSITIVE else -1.0
        unit = "N m" if joint.wheels == 2 else "N"
        if model.space.behind:
            result.append(OneSided(name, unit, sign * IN_SPACE[joint.kind](model, joint)))
            continue
        ends = model.ends[name]
        form = sign * FORMS[joint.kind](ends)
        tilts = getattr(joint, "contact_length", None) is not None
        half = ends.number("contact_length") / 2 if tilts else None
        result.append(OneSided(name, unit, form, half))
    return result


def _across(ends: Ends) -> Any:
    return ca.vertcat(ends.normal(), SX(0))


def _beside(ends: Ends) -> Sym:
    return ca.vertcat(left(tangent_of(ends)), SX(0))


def _turning(ends: Ends) -> Any:
    return SX([0, 0, 1])


def _along_rack(ends: Ends) -> Any:
    a = ends.number("axis")
    return ca.vertcat(ends.second.direction(ca.vertcat(ca.cos(a), ca.sin(a))), SX(0))


def _apart(ends: Ends) -> Sym:
    return ca.vertcat(ends.gap / ca.sqrt(ca.sumsqr(ends.gap)), SX(0))


FORMS = {
    "prismatic": _across,
    "pin-in-slot": _across,
    "curve": _beside,
    "gear": _turning,
    "rack": _along_rack,
    "distance": _apart,
}
"""By kind: what of the reaction on the second body is positive towards its left, its positive
sense, or away from the first body."""


def _gap_in_space(model: Any, joint: Joint) -> Sym:
    gap = model.point(joint.second) - model.point(joint.first)
    return ca.vertcat(gap / ca.norm_2(gap), SX(3, 1))


def _off_plane(model: Any, joint: Joint) -> Sym:
    return ca.vertcat(model.axes_of(joint.name)[0][:, 2], SX(3, 1))


def _on_carrier(model: Any, joint: Joint) -> Sym:
    """Return the axis of the second member on the carrier and, of a wheel, its moment about it."""
    bearing = bearings(model.mechanism, joint)[1]
    axis = bearing.sense * model.axes_of(bearing.joint)[0][:, 2]
    if joint.wheels == 1:
        return ca.vertcat(axis, SX(3, 1))
    arm = model.point(joint.second) - model.point(model.mechanism.joints[bearing.joint].second)
    return ca.vertcat(ca.cross(axis, arm), axis)


IN_SPACE = {
    "distance": _gap_in_space,
    "planar": _off_plane,
    "gear": _on_carrier,
    "rack": _on_carrier,
}
"""The same in space: away from the first body, along the normal of the plane, in the positive
sense on the carrier."""

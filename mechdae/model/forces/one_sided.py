"""Contacts that can push and not pull, or the other way round: the force by which they hold.

A joint with the key ``one_sided`` keeps both of its bodies together whatever acts; a real
contact parts where the force would have to change its sign.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import casadi as ca

from mechdae.model.forces.friction import tangent_of
from mechdae.model.joints import Ends
from mechdae.model.model import Model
from mechdae.model.space import left
from mechdae.records import dataclass

SX = ca.SX
POSITIVE = ("left", "positive", "push")


@dataclass(frozen=True)
class OneSided:
    """A one-sided contact.

    ``form`` (3,) is an expression of the coordinates; times the joint's reaction (force, and
    moment about the second point) it is the force [N], of a gear the moment [N m], by which the
    contact holds. Where ``half`` is given the moment over it is taken off: a block of that half
    length tips before it lifts.
    """

    name: str
    unit: str
    form: Any
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
        ends = model.ends[name]
        form = sign * FORMS[joint.kind](ends)
        tilts = getattr(joint, "contact_length", None) is not None
        half = ends.number("contact_length") / 2 if tilts else None
        result.append(OneSided(name, "N m" if joint.wheels == 2 else "N", form, half))
    return result


def _across(ends: Ends) -> Any:
    return ca.vertcat(ends.normal(), SX(0))


def _beside(ends: Ends) -> Any:
    return ca.vertcat(left(tangent_of(ends)), SX(0))


def _turning(ends: Ends) -> Any:
    return SX([0, 0, 1])


def _along_rack(ends: Ends) -> Any:
    a = ends.number("axis")
    return ca.vertcat(ends.second.direction(ca.vertcat(ca.cos(a), ca.sin(a))), SX(0))


def _apart(ends: Ends) -> Any:
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

"""The gaps of joints in motions: what keeps a joint within its limits, a pin in its bush.

The gap of a pin in a bush with the clearance c is (c^2 - e^2) / (2 c) for an offset e of their
centres. Where they touch it has the gradient of c - |e|, and it is smooth everywhere.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from mechdae.describe.coordinates import coordinate
from mechdae.describe.joints.joint import GAPS, LIMITS
from mechdae.describe.joints.limits import check_size, in_gaps, limited
from mechdae.dynamics.equations import MotionProblem, setup
from mechdae.dynamics.start import Start, start
from mechdae.equations.forces.feedback import Unilateral
from mechdae.equations.forces.generalised import times
from mechdae.equations.gaps import opened
from mechdae.equations.gradients import gradients
from mechdae.equations.model import Model
from mechdae.equations.space import left
from mechdae.errors import InconsistentStartError, MechanismError

STOPS = (("low", 1.0), ("high", -1.0))
SIDES = (("right", 1.0), ("left", -1.0))
FLANKS = (("flank 1", 1.0), ("flank 2", -1.0))
"""Ends that push along what the joint measures, then those that push back."""
BUSH = "bush"
"""End of a joint that is round: where it is touched depends on the offset."""


def unilateral(model: Model) -> list[Unilateral]:
    """Return the contacts of joints with a restitution: at stops, and in gaps."""
    return [*stops(model), *inside(model)]


def stops(model: Model) -> list[Unilateral]:
    """Return the contacts at the limits of joints, the least of each before the greatest."""
    found = []
    for joint in limited(model.mechanism.joints):
        if getattr(joint, "restitution", None) is None:
            continue
        named = coordinate(model.mechanism, f"{joint.name}.{joint.ranged}")
        value, column = model.coordinate(named), model.gradient(named)
        for limit, (end, sign) in zip(LIMITS, STOPS, strict=True):
            gap = sign * (value - model.numbers[f"{joint.name}.{limit}"])
            found.append(Unilateral(joint.name, gap, named.unit, times(sign, column), end, sign))
    return found


def open_joints(model: Model) -> None:
    """Leave out the equations of joints that move in their gaps.

    Raises
    ------
    MechanismError
        A gap of a joint in space.
    """
    mechanism = model.mechanism
    values = mechanism.values()
    names = in_gaps(mechanism.joints, values)
    if names and mechanism.dimension == 3:
        raise MechanismError(
            "motions in gaps are planar", where=f"joints.{names[0]}", hint="leave clearance out"
        )
    tilts = {name for name in names if f"{name}.contact_length" in values}
    model.in_gaps, model.opened = frozenset(names), tuple(
        row for row in model.rows
        if row.owner in names and (row.part != "turn" or row.owner in tilts)
    )  # fmt: skip
    model.rows = [row for row in model.rows if row not in model.opened]


def inside(model: Model) -> list[Unilateral]:
    """Return the contacts that hold joints with opened equations together.

    A pin in its bush, teeth with two flanks, a pin in a slot with two sides; a block in a guide is
    touched by its ends, on either side.
    """
    found = list[Unilateral]()
    for name in dict.fromkeys(row.owner for row in model.opened):
        joint = model.mechanism.joints[name]
        rows = {row.part: row.expression for row in model.opened if row.owner == name}
        if joint.hinge:
            c = model.numbers[f"{name}.clearance"]
            gap = (c - ca.sumsqr(model.ends[name].gap) / c) / 2
            column, normal = gradients(gap, model.q)[0], -model.ends[name].gap / c
            place = model.ends[name].p1
            if f"{name}.pin_radius" in model.numbers:  # the first body carries the pin
                place = place + model.numbers[f"{name}.pin_radius"] * normal
            more = {"axis": left(normal), "place": place}
            found.append(Unilateral(name, gap, "m", column, BUSH, **more))
            continue
        key = next(key for key in GAPS if f"{name}.{key}" in model.numbers)
        half, *_ = opened(joint, key, model.numbers, ca.norm_2(model.ends[name].gap)).values()
        unit = "rad" if joint.wheels == 2 else "m"
        forms = {"": rows["mesh"] if joint.meshes else rows["n"]}
        if "turn" in rows:
            reach = model.numbers[f"{name}.contact_length"] / 2 * ca.sin(rows["turn"])
            forms = {"front ": forms[""] + reach, "back ": forms[""] - reach}
        for word, form in forms.items():
            for end, sign in FLANKS if joint.meshes else SIDES:
                column = times(sign, gradients(form, model.q)[0])
                found.append(Unilateral(name, half + sign * form, unit, column, word + end, sign))
    return found


def start_in_gaps(whole: MotionProblem) -> Start:
    """Return the start with joints in the middle of their gaps if what is given agrees with that.

    Otherwise the pose of the sketch without gaps is moved to what is given.
    """
    mechanism = whole.problem.mechanism
    values = mechanism.values()
    for name in in_gaps(mechanism.joints, values):
        for key in GAPS:
            if values.get(f"{name}.{key}"):
                check_size(mechanism, mechanism.joints[name], key, values[f"{name}.{key}"])
    closed = setup(whole.problem, replace(whole.task, clearance=None))
    try:
        return start(closed)
    except InconsistentStartError:
        closed.task = replace(closed.task, start=None, start_speed=None)
        return start(whole, start(closed).q)

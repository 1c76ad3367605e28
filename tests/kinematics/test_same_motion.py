"""Four-bars that are the same but for scale, side, order of bodies or ends of joints move alike."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import mechdae as md
from tests.shared.strategies import (
    bounded,
    crank_rockers,
    mirrored,
    ordered,
    orders,
    scaled,
    scales,
    turned_round,
)

TURN = md.Driver("crank.angle", from_=0.5, to=0.5 + 2 * math.pi)


def turn(mechanism: md.Mechanism, sign: float = 1.0) -> md.Result:
    driver = md.Driver("crank.angle", from_=sign * TURN.from_, to=sign * TURN.to, speed=sign)
    outputs = ("coupler.C", "rocker.angle", "C.angle")
    result = md.solve(mechanism, md.Sweep(driver, poses=13, outputs=outputs))
    assert set(result.status) == {"ok"}
    return result


def agree(one: object, other: object) -> bool:
    """Whether series agree, to rounding of numbers near one."""
    return bool(np.abs(np.subtract(one, other)).max() < 1e-11)


@bounded
@given(crank_rockers(), scales)
def test_of_any_size(mechanism: md.Mechanism, scale: float) -> None:
    one, other = turn(mechanism), turn(scaled(mechanism, scale))
    for word in ("position", "velocity", "acceleration"):
        assert agree(one.points["coupler.C"][word], other.points["coupler.C"][word] / scale), word
    assert agree(one.bodies["rocker"].angle, other.bodies["rocker"].angle)
    share = other.bound["length"].max() / scale / one.bound["length"].max()
    assert 0.2 < share < 5.0  # a bound is a share of the size, it has no metres of its own


@bounded
@given(crank_rockers())
def test_mirrored(mechanism: md.Mechanism) -> None:
    one, other = turn(mechanism), turn(mirrored(mechanism), -1.0)
    for word in ("position", "velocity", "acceleration"):
        image = other.points["coupler.C"][word] * (1.0, -1.0)
        assert agree(one.points["coupler.C"][word], image), word
    for word in ("angle", "angular_velocity", "angular_acceleration"):
        assert agree(one.bodies["rocker"][word], -other.bodies["rocker"][word]), word
    flipped = {"+": "-", "-": "+"}
    assert other.summary["mode"] == "".join(flipped[sign] for sign in one.summary["mode"])


@bounded
@given(crank_rockers(), orders("crank coupler rocker"))
def test_in_any_order(mechanism: md.Mechanism, order: tuple[str, ...]) -> None:
    one, other = turn(mechanism), turn(ordered(mechanism, order))
    assert list(other.mechanism.bodies) == list(order)
    assert agree(one.points["coupler.C"].acceleration, other.points["coupler.C"].acceleration)
    assert agree(one.bodies["rocker"].angle, other.bodies["rocker"].angle)


@bounded
@given(crank_rockers(), st.floats(-2.0, 2.0))
def test_with_joints_the_other_way_round(mechanism: md.Mechanism, moment: float) -> None:
    """Relative coordinates and reactions are second less first, on the second: they change sign."""
    task = md.Reactions(TURN, poses=13)
    load = md.Torque("load", "rocker", value=moment)
    one, other = (
        md.solve(md.Mechanism(
            ground=m.ground, bodies=list(m.bodies.values()), joints=list(m.joints.values()),
            loads=[load], sketch=dict(m.sketch.items()),
        ), task)
        for m in (mechanism, turned_round(mechanism))
    )  # fmt: skip
    assert agree(one.bodies["rocker"].angle, other.bodies["rocker"].angle)
    assert agree(one.efforts["crank.angle"], other.efforts["crank.angle"])
    for name in "ABCD":
        assert agree(one.joints[name].reaction, -other.joints[name].reaction), name
        assert agree(one.joints[name].angle, -other.joints[name].angle), name

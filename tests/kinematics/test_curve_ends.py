"""Curve joints: where a slot ends, where a curve closes, where a curve is driven."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from mechdae.errors import AssemblyError
from tests.shared.cams import PI
from tests.shared.mechanisms import cam, rod_and_slot


def test_the_motion_ends_where_the_slot_does() -> None:
    """A straight slot (s is eliminated): a slider-crank with a stop."""
    mechanism = rod_and_slot(x="s", y=0, range=(0.055, 0.09))
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=9))
    stops = [math.acos((0.03**2 + stop**2 - 0.08**2) / (2 * 0.03 * stop)) for stop in (0.09, 0.055)]
    assert result.summary["limits"] == pytest.approx(stops, rel=1e-13)
    assert set(result.status) == {"ok"}
    assert result.joints["slot"].s[[0, -1]] == pytest.approx([0.09, 0.055], rel=1e-14)
    assert [event["kind"] for event in result.events] == ["end_of_curve"] * 2
    assert {event["joint"] for event in result.events} == {"slot"}
    beyond = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", from_=1.0, to=3.0), poses=21))
    u = beyond.drivers["crank.angle"].position
    inside = (u >= stops[0]) & (u <= stops[1])
    assert np.array_equal(beyond.status == "ok", inside)
    assert "the contact of joint slot is at the end of its curve" in str(beyond.fault)
    assert beyond.summary["failed"][0]["joint"] == "slot"
    assert np.isnan(beyond.points["rod.B"].position[~inside]).all()


def test_a_stop_between_two_steps_is_not_passed() -> None:
    """The end is crossed and crossed again within a fiftieth of a step."""
    turn_back = 5e-4
    end = 0.03 * math.cos(turn_back) + math.sqrt(0.08**2 - (0.03 * math.sin(turn_back)) ** 2)
    mechanism = rod_and_slot(x="s", y="0*s", range=(0.04, end))
    mechanism = replace(mechanism, sketch=Table({"crank": -1.0, "rod": 0.3}))
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", from_=-1.0, to=1.0), poses=5))
    # what lies behind the stop is reached by turning the other way round
    assert list(result.status) == ["ok", "ok", "unassembled", "ok", "ok"]
    low, high = (event["at"] for event in result.events)
    assert high == pytest.approx(-turn_back, rel=1e-7)  # flat: s is stationary nearby
    assert low == pytest.approx(turn_back - 2 * PI, abs=1e-7 * turn_back)


def test_a_contact_that_is_no_unknown_ends_as_well() -> None:
    """A yoke with a bent slot: all is explicit, s = r sin u."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0), "A": (0.05, 0)}), md.Body("yoke", {"S": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Curve("slot", "yoke.S", "crank.A", x="2*s**2", y="s", range=(-0.04, 0.03)),
            md.Prismatic("guide", "ground.O", "yoke.S"),
        ],
        sketch={"crank": 0.2},
    )
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=9))
    assert result.summary["work"]["unknowns"] == 0
    ends = [math.asin(-0.8), math.asin(0.6)]
    assert result.summary["limits"] == pytest.approx(ends, rel=1e-13)
    u = result.drivers["crank.angle"].position
    slide = 0.05 * np.cos(u) - 2 * (0.05 * np.sin(u)) ** 2
    assert np.abs(result.joints["guide"].slide - slide).max() < 1e-17
    task = md.Sweep(md.Driver("crank.angle", from_=0.0, to=1.0), poses=11)
    beyond = md.solve(mechanism, task)
    places = beyond.drivers["crank.angle"].position
    assert np.array_equal(beyond.status == "ok", places <= ends[1])
    with pytest.raises(AssemblyError, match="joint slot stays open"):
        md.solve(replace(mechanism, sketch=Table({"crank": 1.2})), task)


def test_both_ends_of_a_rod_on_curves_are_a_four_bar() -> None:
    """Two contacts in one block; circles are cranks."""
    a, b, c, d = 0.03, 0.08, 0.07, 0.09
    circle = "{}*cos(s)", "{}*sin(s)"
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (d, 0)}),
        bodies=[md.Body("rod", {"B": (0, 0), "C": (b, 0)})],
        joints=[
            md.Curve(
                n,
                f"ground.{p}",
                f"rod.{q}",
                x=circle[0].format(r),
                y=circle[1].format(r),
                closed=True,
            )
            for n, p, q, r in (("one", "A", "B", a), ("two", "D", "C", c))
        ],
        sketch={"one": 0.5, "two": 1.5, "rod": 0.5},
    )
    task = md.Sweep(md.Driver("one.s", range="assembled"), poses=13)
    result = md.solve(mechanism, task)
    assert result.summary["limits"] == [None, None]
    u = result.joints["two"].s
    gap = d + c * np.exp(1j * u) - a * np.exp(1j * result.drivers["one.s"].position)
    assert np.abs(np.abs(gap) - b).max() < 3e-17
    assert np.abs(np.exp(1j * result.bodies["rod"].angle) - gap / b).max() < 1e-15
    modes = md.solve(mechanism, md.Modes(md.Driver("rod.angle", at=[0.5])))
    assert modes.summary["count"] == 2


def test_the_end_of_a_bent_slot() -> None:
    """B at the end of the parabola y = 4 s^2: the law of cosines about O."""
    result = md.solve(
        rod_and_slot(x="0.02 + s", y="4*s**2 - 0.01", range=(0, 0.07)),
        md.Sweep(md.Driver("crank.angle", range="assembled"), poses=5),
    )
    end = complex(0.09, 4 * 0.07**2 - 0.01)
    half = math.acos((0.03**2 + abs(end) ** 2 - 0.08**2) / (2 * 0.03 * abs(end)))
    middle = math.atan2(end.imag, end.real)
    assert result.summary["limits"] == pytest.approx(
        [middle + half, middle - half + 2 * PI], rel=1e-12
    )
    assert result.joints["slot"].s[[0, -1]] == pytest.approx([0.07, 0.07], rel=1e-12)


def test_the_curve_itself_can_be_driven() -> None:
    mechanism = rod_and_slot(x="0.02 + s", y="4*s**2 - 0.01", range=(0, 0.07))
    mechanism = replace(mechanism, sketch=Table({"slot": 0.05, "crank": 1.6}))
    task = md.Sweep(md.Driver("slot.s", from_=0.05, to=0.09, speed=2.0), poses=9)
    result = md.solve(mechanism, task)
    assert list(result.status) == ["ok"] * 5 + ["unassembled"] * 4
    s = result.drivers["slot.s"].position[:5]
    B = result.points["rod.B"]
    assert np.abs(B.position[:5] - np.stack([0.02 + s, 4 * s**2 - 0.01], axis=1)).max() < 1e-16
    assert np.abs(B.velocity[:5] - np.stack([2 + 0 * s, 16 * s], axis=1)).max() < 1e-14
    assert result.unit("drivers", "slot.s", "velocity") == "1/s"
    closed = cam("0.01 + 0.03*cos(s)", "0.03*sin(s)", 0.008)
    closed = replace(closed, sketch=Table({"profile": 1.5, "guide": 0.04}))
    task = md.Sweep(md.Driver("profile.s", range="assembled"), poses=13)
    result = md.solve(closed, task)
    assert result.summary["limits"] == [None, None]
    assert result.bodies["cam"].angle[-1] - result.bodies["cam"].angle[0] == pytest.approx(-2 * PI)

"""Curve joints: cams with point and roller followers against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.problem import Problem
from mechdae.describe.values import Table
from mechdae.tasks.check import validate
from tests.shared.cams import LONG, PI, largest, slider_crank, turn
from tests.shared.mechanisms import SPEED, cam, rod_and_slot


@pytest.mark.parametrize("roller", [0.008, None])
def test_an_eccentric_circle_is_a_slider_crank(roller: float | None) -> None:
    """Circle and roller keep their centres apart by the sum of the radii: a rod."""
    radius = 0.038 - (roller or 0.0)
    result = md.solve(cam(f"0.01 + {radius}*cos(s)", f"{radius}*sin(s)", roller), turn())
    assert set(result.status) == {"ok"}
    assert result.summary["bound"] == "proved"
    u = result.drivers["cam.angle"].position
    y, dy, ddy = slider_crank(0.01, 0.038, u)
    point = result.points["follower.N"]
    gap = np.abs(point.position[:, 1] - y).astype(float)
    assert np.all(gap <= result.bound.length)
    assert gap.max() < 2e-17
    assert largest(point.velocity[:, 1], dy) < 1e-15 * SPEED
    assert largest(point.acceleration[:, 1], ddy) < 1e-15 * SPEED**2
    # the contact lies on the rod: s is its angle in the cam
    s = np.arctan2(y - LONG(0.01) * np.sin(u.astype(LONG)), -LONG(0.01) * np.cos(u.astype(LONG)))
    off = np.exp(1j * (result.joints["profile"].s - (s - u).astype(float)))
    assert np.abs(off - 1).max() < 1e-14


def test_a_roller_on_a_lever_is_a_four_bar() -> None:
    e, radius, roller, lever, d = (LONG(v) for v in ("0.012", "0.03", "0.01", "0.09", "0.1"))
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "D": ("d", 0)}),
        bodies=[
            md.Body("cam", {"O": (0, 0)}),
            md.Body("lever", {"D": (0, 0), "N": ("lever_length", 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "cam.O"),
            md.Revolute("D", "ground.D", "lever.D"),
            md.Curve(
                "profile",
                "cam.O",
                "lever.N",
                x="e + r*cos(s)",
                y="r*sin(s)",
                closed=True,
                roller_radius="rho",
            ),
        ],
        parameters={"e": 0.012, "r": 0.03, "rho": 0.01, "lever_length": 0.09, "d": 0.1},
        sketch={"cam": 0.2, "lever": 2.6},
    )
    result = md.solve(mechanism, turn())
    assert set(result.status) == {"ok"}
    assert result.summary["formula"] == "I(1) -> II cam(2)"
    u = np.asarray(result.drivers["cam.angle"].position, LONG)
    rod = radius + roller
    a = e * np.exp(1j * u)
    # lever: |d + lever exp(i t) - a| = rod, the upper solution
    gap = a - d
    size, direction = np.abs(gap), np.angle(gap)
    t = direction - np.arccos((size**2 + lever**2 - rod**2) / (2 * size * lever))
    ours = result.bodies["lever"]
    assert np.abs(np.exp(1j * (ours.angle - t)) - 1).max() < 2e-15
    arm, link = lever * np.exp(1j * t), d + lever * np.exp(1j * t) - a
    dot = lambda v, w: (v * np.conj(w)).real  # noqa: E731
    v = 1j * a * LONG(SPEED)
    omega = dot(v, link) / dot(1j * arm, link)
    rate = 1j * arm * omega - v
    push = -a * LONG(SPEED) ** 2 + arm * omega**2
    alpha = (dot(push, link) - dot(rate, rate)) / dot(1j * arm, link)
    assert largest(ours.angular_velocity, omega) < 1e-14
    assert largest(ours.angular_acceleration, alpha) < 1e-13


LAW = "(0.03 + 0.004*sin(2*s) - 0.003*cos(3*s))"


def test_a_point_on_a_radial_guide_reads_the_law() -> None:
    result = md.solve(cam(f"{LAW}*cos(s)", f"{LAW}*sin(s)"), turn(-7.0, 7.0, 57))
    u = np.asarray(result.drivers["cam.angle"].position, LONG)
    s = LONG(PI) / 2 - u
    wide = [LONG(value) for value in ("0.03", "0.004", "0.003")]
    y = wide[0] + wide[1] * np.sin(2 * s) - wide[2] * np.cos(3 * s)
    dy = -(2 * wide[1] * np.cos(2 * s) + 3 * wide[2] * np.sin(3 * s)) * SPEED
    ddy = (-4 * wide[1] * np.sin(2 * s) + 9 * wide[2] * np.cos(3 * s)) * SPEED**2
    point = result.points["follower.N"]
    assert np.all(np.abs(point.position[:, 1] - y).astype(float) <= result.bound.length)
    assert largest(point.position[:, 1], y) < 1e-16
    assert largest(point.velocity[:, 1], dy) < 2e-15
    assert largest(point.acceleration[:, 1], ddy) < 2e-14
    contact = result.joints["profile"]
    turns = (contact.s - (PI / 2 - result.drivers["cam.angle"].position)) / (2 * PI)
    assert np.abs(turns - turns[0]).max() < 1e-14, "s grows on through whole turns"
    assert np.abs(contact.s_velocity + SPEED).max() < 1e-13
    assert np.abs(contact.s_acceleration).max() < 1e-12


@pytest.mark.parametrize("scale", [1e-6, 1e3])
def test_micrometres_and_kilometres_give_the_same_digits(scale: float) -> None:
    base = md.load("cam-roller-follower")
    names = ("base", "h", "rho", "offset", "stem")
    values = base.mechanism.values()
    scaled = base.with_values({name: values[name] * scale for name in names})
    mechanism = scaled.mechanism
    sketch = {**mechanism.sketch, "guide": 0.075 * scale}
    scaled = replace(scaled, mechanism=replace(mechanism, sketch=Table(sketch)))
    one, other = (md.solve(problem, "turn", poses=25) for problem in (base, scaled))
    assert set(other.status) == {"ok"}
    for name in ("position", "velocity", "acceleration"):
        a, b = one.points["follower.R"][name], other.points["follower.R"][name] / scale
        assert np.abs(a - b).max() < 1e-14 * np.abs(a).max()
    assert np.abs(one.joints["profile"].s - other.joints["profile"].s).max() < 1e-13
    assert other.bound.length.max() == pytest.approx(one.bound.length.max() * scale, rel=1e-6)
    assert one.summary["work"]["path_steps"] == other.summary["work"]["path_steps"]


@pytest.mark.parametrize("unit", [1e-4, 1.0, 1e5])
def test_the_unit_of_s_does_not_matter(unit: float) -> None:
    """s may be an angle, an arc length, a share of the curve."""
    mechanism = cam(
        f"0.01 + 0.03*cos(s*{1 / unit!r})",
        f"0.03*sin(s*{1 / unit!r})",
        0.008,
        range=(0.0, 2 * PI * unit),
    )
    result = md.solve(mechanism, turn())
    y = slider_crank(0.01, 0.038, result.drivers["cam.angle"].position)[0]
    assert set(result.status) == {"ok"}
    assert largest(result.points["follower.N"].position[:, 1], y) < 1e-16
    assert result.bound.length.max() < 4e-15
    assert result.summary["work"]["path_steps"] < 200


def test_the_cam_follows_where_the_follower_drives() -> None:
    result = md.solve(
        cam("0.01 + 0.03*cos(s)", "0.03*sin(s)", 0.008),
        md.Sweep(md.Driver("guide.slide", range="assembled"), poses=7),
    )
    assert result.summary["limits"] == pytest.approx([0.028, 0.048], abs=1e-15)
    assert list(result.status) == ["limit", *["ok"] * 5, "limit"]
    back = slider_crank(0.01, 0.038, result.bodies["cam"].angle)[0]
    assert largest(back, result.drivers["guide.slide"].position) < 1e-9  # flat at the limits
    assert largest(back[1:-1], result.drivers["guide.slide"].position[1:-1]) < 1e-16


def test_outputs_of_a_contact() -> None:
    problem = md.load("hypocycloid-drive")
    task = replace(problem.tasks["turns"], outputs=("lobes",), poses=5)
    result = md.solve(problem, task)
    assert set(result.joints["lobes"]) == {"s", "s_velocity", "s_acceleration"}
    assert result.summary["not_in_scene"] == ["cross", "output"]
    units = {name: unit for name, unit, _ in result.columns()}
    assert units["lobes.s"] == "1"
    assert units["lobes.s_acceleration"] == "1/s2"


@pytest.mark.parametrize("roller", [0.008, None])
def test_the_pressure_angle_is_that_of_the_slider_crank(roller: float | None) -> None:
    """Its complement, the transmission angle: acos(e |cos u| / rod)."""
    radius = 0.038 - (roller or 0.0)
    mechanism = cam(f"0.01 + {radius}*cos(s)", f"{radius}*sin(s)", roller)
    result = md.solve(mechanism, replace(turn(0.0, 2.0, 9), measures=("transmission",)))
    u = result.drivers["cam.angle"].position
    angle = result.joints["profile"].transmission_angle
    assert np.abs(angle - np.arccos(0.01 * np.abs(np.cos(u)) / 0.038)).max() < 1e-14
    found = result.summary["transmission"]["profile"]
    assert (found["min"], found["max"]) == pytest.approx((math.acos(0.01 / 0.038), PI / 2))
    assert (found["at"], found["max_at"]) == pytest.approx((0.0, PI / 2), abs=1e-12)


def test_a_study_of_a_cam_follows_each_set_alone() -> None:
    problem = md.load("cam-roller-follower")
    problem = problem.with_task("turn", replace(problem.tasks["turn"], poses=3))
    path = "points/follower.R/position"
    study = md.Study(of="turn", vary={"h": [0.01, 0.014, 2]}, outputs=(path,))
    table = md.solve(problem, study).table[path]
    for k, h in enumerate((0.01, 0.014)):
        alone = md.solve(problem, "turn", set={"h": h})
        assert np.array_equal(table[k], alone.points["follower.R"].position)


def test_a_contact_beyond_the_ends_does_not_assemble() -> None:
    mechanism = rod_and_slot(x="s", y=0, range=(0.2, 0.3))
    task = md.Sweep(md.Driver("crank.angle", from_=0.0, to=1.0))
    (error,) = validate(Problem(mechanism, Table({"a": task})))
    assert "group II cam(2) cannot be assembled" in str(error)

"""Reactions of the other joints: cams, belts, welds, bars, short guides, several drivers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from mechdae.results.tables import table
from tests.reference.closed_forms import circle_line
from tests.reference.force_truth import (
    LONG,
    Couple,
    Guide,
    Mass,
    Pin,
    Scene,
    Slot,
    circle,
    course,
    mass_of,
    panels,
    place,
    rate,
)
from tests.reference.force_truth import slider_crank as free_slider_crank
from tests.reference.jets import unit
from tests.shared.force_cases import S1, reactions, slider_crank

REL = 1e-12


# -- cams ------------------------------------------------------------------------------------------

ECCENTRIC, CAM = 0.02, 0.05


def cam(roller: float | None, friction: float | None) -> md.Mechanism:
    """Return an eccentric disc under a follower that a weight and a force press on it."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("cam", {"O": (0, 0)}),
            md.Body("follower", {"F": (0, 0)}, mass=2.0),
        ],
        joints=[
            md.Revolute("O", "ground.O", "cam.O"),
            md.Prismatic(
                "guide", "ground.O", "follower.F", axis=math.pi / 2, turn=0, friction=friction
            ),
            md.Curve(
                "contact",
                "cam.O",
                "follower.F",
                x=f"{ECCENTRIC} + {CAM}*cos(s)",
                y=f"{CAM}*sin(s)",
                closed=True,
                roller_radius=roller,
                friction=friction,
            ),
        ],
        loads=[md.Force("press", "follower.F", (0, -300))],
        gravity=(0, -9.81),
        sketch={"cam": 0.3, "guide": 0.05, "contact": 1.3},
    )


def free_cam(theta: Any, omega: float, roller: float, f: float) -> Scene:
    u = course(theta, omega)
    K = unit(u) * LONG(ECCENTRIC)
    F, lift = circle_line(K, LONG(CAM) + LONG(roller), 0j, 1j, 1)
    normal = place(F) - place(K)
    normal = normal / np.abs(normal)
    contact = place(K) + LONG(CAM) * normal
    tangent = -1j * normal
    slip = 1j * rate(lift) - 1j * omega * contact
    return Scene(
        len(place(u)),
        {"cam": Mass(), "follower": mass_of(2.0, 0.0, F)},
        {
            "O": Pin("ground", "cam", 0j, rate(u)),
            "guide": Guide("ground", "follower", place(F), 1j + 0 * normal, rate(lift), f),
            "contact": Slot(
                "cam", "follower", contact, tangent, np.real(np.conj(tangent) * slip), f=f
            ),
            "T": Couple("ground", "cam"),
        },
        [("follower", place(F), -300j, 0.0)],
        -9.81j,
    )


@pytest.mark.parametrize("roller", [None, 0.012])
@pytest.mark.parametrize("friction", [None, 0.15])
def test_forces_of_a_cam(roller: float | None, friction: float | None) -> None:
    at = np.array([0.3, 1.2, 2.9, 4.4, 5.9])
    mode = "coupled" if friction else "none"
    result = md.solve(cam(roller, friction), reactions("cam.angle", at=at, speed=12, friction=mode))
    assert list(result.status) == ["ok"] * len(at)
    scene = free_cam(at, 12.0, roller or 0.0, friction or 0.0)
    found = scene.solve(friction=bool(friction))
    follower = scene.joints["guide"].at
    assert result.points["follower.F"].position[:, 1] == pytest.approx(
        np.imag(follower).astype(float), rel=REL
    )
    assert result.efforts["cam.angle"] == pytest.approx(found["T"].astype(float), rel=1e-11)
    for name, about in (("O", None), ("guide", None), ("contact", follower)):
        theirs = found.reaction(name, about).astype(float)
        size = np.hypot(theirs[:, 0], theirs[:, 1])[:, None] + 1e-9
        gap = np.abs(result.joints[name].reaction - theirs) / size
        assert gap.max() < 1e-11, name
        if friction and name != "O":
            assert result.joints[name].loss == pytest.approx(
                found.loss(name).astype(float), rel=1e-11, abs=1e-11
            )


# -- belts -----------------------------------------------------------------------------------------


def belt(crossed: bool, torque: float, radius: float | None, pretension: float | None):
    keys = {"radius": radius, "pretension": pretension}
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "Q": (0.3, 0)}),
        bodies=[md.Body("small", {"O": (0, 0)}), md.Body("large", {"Q": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "small.O"),
            md.Revolute("Q", "ground.Q", "large.Q"),
            md.Belt(
                "belt",
                "small.O",
                "large.Q",
                ratio=2,
                crossed=crossed,
                **{name: value for name, value in keys.items() if value is not None},
            ),
        ],
        loads=[md.Torque("load", "large", torque)],
        sketch={"small": 0.0},
    )


def strands(crossed: bool, r1: float, r2: float, d: float) -> list[tuple[complex, complex]]:
    """Return for both strands the contact on the first wheel and the direction to the second."""
    other = -r2 if crossed else r2
    x = (r1 - other) / d
    result = []
    for side in (1, -1):
        normal = complex(x, side * math.sqrt(1 - x * x))
        line = d + (other - r1) * normal
        result.append((r1 * normal, line / abs(line)))
    return result


@pytest.mark.parametrize("crossed", [False, True])
@pytest.mark.parametrize("torque", [30.0, -30.0])
@pytest.mark.parametrize("pretension", [None, 900.0])
def test_strands_of_a_belt_load_the_bearings(crossed, torque, pretension) -> None:
    r1, r2, d = 0.05, 0.10, 0.3
    result = md.solve(
        belt(crossed, torque, r1, pretension), reactions("small.angle", at=[0.4], speed=5)
    )
    turn = torque / (2 if not crossed else -2)
    assert result.efforts["small.angle"][0] == pytest.approx(-turn, rel=REL)
    # the belt turns the small wheel by +turn: the difference of the strands' pulls
    pulls = []
    for contact, line in strands(crossed, r1, r2, d):
        arm = (contact.conjugate() * line).imag
        assert abs(arm) == pytest.approx(r1, rel=1e-14)
        share = turn / arm  # difference of this strand against the other
        base = pretension if pretension is not None else abs(turn) / r1 / 2
        pulls.append((base + share / 2) * line)
    bearing = -sum(pulls)
    found = result.joints["O"].reaction[0]
    assert complex(*found[:2]) == pytest.approx(bearing, rel=REL)
    assert complex(*result.joints["Q"].reaction[0, :2]) == pytest.approx(-bearing, rel=REL)
    assert result.joints["belt"].reaction[0, 2] == pytest.approx(-torque, rel=REL)


def test_sets_of_a_study_in_which_a_belt_goes_slack_are_named() -> None:
    """A pull of 300 N needs a pretension of 150 N in each strand."""
    task = reactions("small.angle", at=[0.4], speed=5)
    plain = md.Problem(belt(False, 30.0, 0.05, 900.0), Table({"run": task}))
    study = md.Study(
        samples={"belt.pretension": [140.0, 160.0]}, of="run", outputs=("efforts/small.angle",)
    )
    result = md.solve(plain, study)
    assert list(result.status) == ["ok", "ok"]
    assert [entry["set"] for entry in result.summary["faults"]] == [0]
    assert "pretension of 150 N" in result.summary["faults"][0]["fault"]
    assert "fault     belt.pretension = 140: belt belt goes slack" in table(result)


def test_a_belt_without_radius_is_a_couple_and_says_so() -> None:
    result = md.solve(belt(False, 30.0, None, None), reactions("small.angle", at=[0.4], speed=5))
    assert result.efforts["small.angle"][0] == pytest.approx(-15, rel=REL)
    for name in "OQ":
        assert result.joints[name].reaction[0] == pytest.approx([0, 0, 0], abs=1e-11)
    assert any("belt" in sentence for sentence in result.summary["assumptions"])


# -- bars and welds --------------------------------------------------------------------------------


def test_a_bar_that_is_no_body_carries_a_force_along_itself() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0), "B": (0.1, 0)}), md.Body("slider", {"C": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Distance("bar", "crank.B", "slider.C", length=0.3),
            md.Prismatic("slide", "ground.O", "slider.C"),
        ],
        loads=[md.Resistance("work", "slide.slide", negative=1000, positive=200)],
        sketch={"crank": 1.0, "slide": 0.34},
    )
    at = np.array([0.5, 1.0, 2.0, 4.0])
    result = md.solve(mechanism, reactions(at=at, speed=10))
    scene, _ = free_slider_crank(at, 10.0, 0.1, 0.3, lambda v: np.where(v < 0, 1000, -200))
    found = scene.solve(friction=False)
    assert result.efforts["crank.angle"] == pytest.approx(found["T"].astype(float), rel=REL)
    force = found["C"].astype(complex)
    bar = result.joints["bar"].reaction
    assert bar[:, 0] + 1j * bar[:, 1] == pytest.approx(force, rel=REL)
    assert bar[:, 2] == pytest.approx(np.zeros(4), abs=1e-11)


def test_a_weld_carries_force_and_moment() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("arm", {"O": (0, 0), "E": (0.5, 0)}),
            md.Body("tool", {"E": (0, 0), "P": (0.2, 0)}, mass=3, center=(0.1, 0), inertia=0.05),
        ],
        joints=[
            md.Revolute("O", "ground.O", "arm.O"),
            md.Weld("seam", "arm.E", "tool.E", turn=math.pi / 2),
        ],
        loads=[md.Force("cut", "tool.P", (-20, 5))],
        gravity=(0, -10),
        sketch={"arm": 0.4},
    )
    at = np.array([0.4, 1.5])
    w, alpha = 2.0, 3.0
    result = md.solve(mechanism, reactions("arm.angle", at=at, speed=w, acceleration=alpha))
    u = np.exp(1j * at)
    center, tip = 0.5 * u + 0.1j * u, 0.5 * u + 0.2j * u
    inertial = 3 * ((1j * alpha - w * w) * center + 10j)
    force = inertial - (-20 + 5j)
    arm = center - 0.5 * u
    turn = (
        0.05 * alpha
        + np.imag(np.conj(arm) * inertial)
        - np.imag(np.conj(tip - 0.5 * u) * (-20 + 5j))
    )
    seam = result.joints["seam"].reaction
    assert seam[:, 0] + 1j * seam[:, 1] == pytest.approx(force, rel=REL)
    assert seam[:, 2] == pytest.approx(turn, rel=REL)
    effort = turn + np.imag(np.conj(0.5 * u) * force)
    assert result.efforts["arm.angle"] == pytest.approx(effort, rel=REL)


# -- short guides ----------------------------------------------------------------------------------


@pytest.mark.parametrize("length", [0.02, 0.012])
def test_a_short_guide_that_tilts(length: float) -> None:
    """Friction in C tilts the slider: two contacts carry more than their difference."""
    at = np.radians(np.arange(3.0, 360, 7.0))
    changes = {"f": 0.2, "f_slide": 0.25}
    result = md.solve(
        slider_crank(contact_length=length, Q_return=1000, **changes),
        reactions(at=at, speed=10, friction="coupled"),
    )
    assert set(result.status) == {"ok"}
    rho = tuple(circle(S1[name], 0.2) for name in ("r_O", "r_B", "r_C"))
    scene, _ = free_slider_crank(
        at, 10.0, 0.1, 0.3, lambda v: -1000 * np.sign(v), rho, 0.25, LONG(length) / 2
    )
    found = scene.solve()
    normal, tilt = found["slide"]
    tilting = np.abs(tilt) > np.abs(normal) * length / 2
    assert 0 < tilting.sum() < len(at)  # both laws govern somewhere
    size = np.abs(found["C"])
    gap = np.abs(result.joints["slide"].reaction - found.reaction("slide")) / size[:, None]
    assert gap.max() < 1e-11
    assert result.efforts["crank.angle"] == pytest.approx(found["T"].astype(float), rel=1e-11)
    assert result.joints["slide"].loss == pytest.approx(
        found.loss("slide").astype(float), rel=1e-11
    )


# -- several drivers -------------------------------------------------------------------------------


def test_torques_of_a_robot_arm() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("upper", {"O": (0, 0), "E": (0.4, 0)}, mass=3, center=(0.15, 0), inertia=0.04),
            md.Body("fore", {"E": (0, 0), "T": (0.3, 0)}, mass=2, center=(0.2, 0), inertia=0.02),
        ],
        joints=[
            md.Revolute("shoulder", "ground.O", "upper.O"),
            md.Revolute("elbow", "upper.E", "fore.E"),
        ],
        gravity=(0, -9.81),
        sketch={"upper": 0.3, "fore": 1.0},
    )
    first, bend = np.array([0.3, 0.8, 1.4]), np.array([0.7, 0.2, -0.5])
    w1, w2, a1, a2 = 1.5, -2.0, 4.0, 3.0
    task = md.Reactions(
        drivers=[
            md.Driver("upper.angle", at=tuple(first), speed=w1, acceleration=a1),
            md.Driver("elbow.angle", at=tuple(bend), speed=w2, acceleration=a2),
        ]
    )
    result = md.solve(mechanism, task)
    assert list(result.status) == ["ok"] * 3
    u, v = np.exp(1j * first), np.exp(1j * (first + bend))
    turning = (1j * a1 - w1**2) * u
    swing = (1j * (a1 + a2) - (w1 + w2) ** 2) * v
    outer = 2 * (0.4 * turning + 0.2 * swing + 9.81j)
    inner = 3 * (0.15 * turning + 9.81j)
    elbow = 0.02 * (a1 + a2) + np.imag(np.conj(0.2 * v) * outer)
    shoulder = (
        0.04 * a1 + np.imag(np.conj(0.15 * u) * inner) + np.imag(np.conj(0.4 * u) * outer) + elbow
    )
    assert result.efforts["elbow.angle"] == pytest.approx(elbow, rel=REL)
    assert result.efforts["upper.angle"] == pytest.approx(shoulder, rel=REL)
    pin = result.joints["elbow"].reaction
    assert pin[:, 0] + 1j * pin[:, 1] == pytest.approx(outer, rel=REL)


# -- poses without forces --------------------------------------------------------------------------


def test_a_reaction_is_nowhere_where_there_is_no_pose() -> None:
    mechanism = slider_crank(l=0.08, sketch={"crank": 0.3, "rod": -0.3})
    end = math.asin(0.8)
    result = md.solve(mechanism, reactions(at=[0.3, end + 0.1], speed=1, friction="coupled"))
    assert list(result.status) == ["ok", "unassembled"]
    assert np.isfinite(result.efforts["crank.angle"][0])
    assert np.isnan(result.efforts["crank.angle"][1])
    assert result.to_dict()["joints"]["B"]["reaction"][1] in (None, [None] * 3)


def test_a_task_of_reactions_moves_like_a_sweep() -> None:
    at = np.array([0.3, 1.0, 2.0])
    forces = md.solve(slider_crank(), reactions(at=at, speed=10, friction="coupled"))
    swept = md.solve(slider_crank(), md.Sweep(md.Driver("crank.angle", at=tuple(at), speed=10)))
    assert forces.kind == "reactions"
    for name, series in swept.points.items():
        for key, array in series.items():
            assert np.array_equal(forces.points[name][key], array), (name, key)
    assert set(forces.joints["O"]) >= {"reaction", "loss", "reaction_uncoupled", "loss_uncoupled"}
    plain = md.solve(slider_crank(), reactions(at=at, speed=10, friction="none"))
    assert "loss" not in plain.joints["O"]
    assert "reaction_uncoupled" not in plain.joints["O"]


# -- both directions -------------------------------------------------------------------------------


def test_figures_of_the_other_direction() -> None:
    cycle: dict[str, Any] = {
        "from_": 0,
        "to": 2 * math.pi,
        "speed": 10,
        "poses": 13,
        "friction": "coupled",
        "cycle": True,
    }
    both = md.solve(slider_crank(), reactions(direction="both", **cycle))
    turned = md.solve(slider_crank(), reactions(direction="load", **cycle))
    ahead = md.solve(slider_crank(), reactions(**cycle))
    assert both.efforts["crank.angle"] == pytest.approx(ahead.efforts["crank.angle"], rel=REL)
    for name in ("useful", "loss", "input", "efficiency"):
        assert both.summary[name] == pytest.approx(ahead.summary[name], rel=1e-10)
        assert both.summary["reverse"][name] == pytest.approx(turned.summary[name], rel=1e-10)
    # the load pushes with 1000 N on the way in, 200 N on the way out: 0.2 m each
    rho = tuple(circle(S1[name], 0.1) for name in ("r_O", "r_B", "r_C"))

    def forces(at):
        load = lambda v: np.where(v < 0, -1000, 200)  # noqa: E731
        return free_slider_crank(at, 10.0, 0.1, 0.3, load, rho, 0.12)[0].solve()

    # friction in C alone presses the slider near the dead centres: N changes its sign there
    grid = np.linspace(0, 2 * math.pi, 1001) + 1e-7
    normal = forces(grid)["slide"][0]
    places = np.flatnonzero(normal[:-1] * normal[1:] < 0)
    low, high = grid[places], grid[places + 1]
    for _ in range(45):
        middle = (low + high) / 2
        same = forces(middle)["slide"][0] * normal[places] > 0
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    turns = sorted([*(k * math.pi / 2 for k in range(5)), *(float(x) for x in low)])
    at, weights = panels(turns, 3, 30)
    found = forces(at)
    output = -float((found["T"] * 10) @ weights)
    lost = sum(float(found.loss(name) @ weights) for name in ("O", "B", "C", "slide"))
    given = 0.2 * 1200 / (2 * math.pi / 10)
    assert output + lost == pytest.approx(given, rel=1e-10)
    assert turned.summary["input"] == pytest.approx(given, rel=1e-9)
    assert turned.summary["loss"] == pytest.approx(lost, rel=1e-9)
    assert turned.summary["useful"] == pytest.approx(output, rel=1e-9)
    assert turned.summary["efficiency"] == pytest.approx(output / given, rel=1e-9)


# -- the typical estimate --------------------------------------------------------------------------


@pytest.mark.parametrize("radius", ["exact", "article"])
def test_the_estimate_leaves_the_reactions_as_they_are(radius: str) -> None:
    at = np.array([0.4, 1.0, 4.0])
    keys = {"at": at, "speed": 10, "friction_radius": radius}
    estimate = md.solve(slider_crank(), reactions(friction="article", **keys))
    coupled = md.solve(slider_crank(), reactions(friction="coupled", **keys))
    plain = md.solve(slider_crank(), reactions(friction="none", **keys))
    assert np.array_equal(estimate.efforts["crank.angle"], plain.efforts["crank.angle"])
    for name in ("O", "B", "C", "slide"):
        assert np.array_equal(estimate.joints[name].reaction, plain.joints[name].reaction)
        assert estimate.joints[name].loss == pytest.approx(
            coupled.joints[name].loss_uncoupled, rel=1e-14
        )


def test_the_estimate_over_a_cycle() -> None:
    task = reactions(
        from_=0,
        to=2 * math.pi,
        poses=9,
        speed=10,
        friction="article",
        friction_radius="article",
        cycle=True,
    )
    summary = md.solve(slider_crank(), task).summary
    # the reference with rho = r f
    assert summary["efficiency_formula_10"] == pytest.approx(0.907101827841818, rel=1e-9)
    assert summary["efficiency_uncoupled"] == pytest.approx(0.914998327817922, rel=1e-9)
    assert summary["useful"] == pytest.approx(381.971863420549, rel=1e-9)


# -- what a task leaves out ------------------------------------------------------------------------


def test_outputs_do_not_change_the_effort() -> None:
    keys = {"at": [math.pi / 3], "speed": 10, "friction": "coupled"}
    pruned = md.solve(slider_crank(), reactions(outputs=("crank",), **keys))
    assert pruned.efforts["crank.angle"] == pytest.approx([109.87320990514], rel=1e-11)
    one = md.solve(slider_crank(), reactions(outputs=("B",), **keys))
    assert set(one.joints) == {"B"}
    assert np.hypot(*one.joints["B"].reaction[0, :2]) == pytest.approx(1087.65640016506, rel=1e-11)


def test_limits_of_the_motion_have_no_reactions() -> None:
    # a double rocker between its limits, pulled by a weight
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (7, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (5, 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (3, 0)}),
            md.Body("rocker", {"D": (0, 0), "C": (4.5, 0)}, mass=2, center=(2, 0)),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        gravity=(0, -9.81),
        sketch={"crank": 0.5, "coupler": 0.9, "rocker": 2.0},
    )
    driver = md.Driver("crank.angle", range="assembled")
    result = md.solve(mechanism, md.Reactions(driver, poses=9))
    assert list(result.status) == ["limit", *["ok"] * 7, "limit"]
    assert np.isfinite(result.efforts["crank.angle"][1:-1]).all()
    assert np.isnan(result.efforts["crank.angle"][[0, -1]]).all()
    assert np.isnan(result.joints["B"].reaction[[0, -1]]).all()


def test_a_load_that_depends_on_time() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0), "A": (0.2, 0)})],
        joints=[md.Revolute("O", "ground.O", "crank.O")],
        loads=[md.Torque("pulse", "crank", "3*sin(4*t)")],
        sketch={"crank": 0.0},
    )
    # constant speed: time counts from the first pose
    result = md.solve(mechanism, reactions(from_=0.5, to=2.5, poses=5, speed=2))
    t = np.array([0, 0.25, 0.5, 0.75, 1.0])
    assert result.efforts["crank.angle"] == pytest.approx(-3 * np.sin(4 * t), rel=REL, abs=1e-14)
    law = md.Driver("crank.angle", law="t**2", from_=0, to=1)
    result = md.solve(mechanism, md.Reactions(law, poses=5))
    assert result.efforts["crank.angle"] == pytest.approx(-3 * np.sin(4 * t), rel=REL, abs=1e-14)


# -- losses of racks and belts ---------------------------------------------------------------------


@pytest.mark.parametrize("speed", [2.0, -2.0])
@pytest.mark.parametrize("load", [300.0, -300.0])
def test_loss_of_a_rack(load: float, speed: float) -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (0, -0.05)}),
        bodies=[md.Body("pinion", {"O": (0, 0)}), md.Body("rack", {"R": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "pinion.O"),
            md.Prismatic("guide", "ground.G", "rack.R"),
            md.Rack("mesh", "pinion.O", "rack.R", radius=0.05, mesh_loss=0.04),
        ],
        loads=[md.Force("load", "rack.R", (load, 0))],
        sketch={"pinion": 0.0},
    )
    result = md.solve(mechanism, reactions("pinion.angle", at=[0.3], speed=speed))
    given = load * 0.05 * speed  # what the load puts in
    expected = -given / 0.96 if given < 0 else -given * 0.96
    power = result.efforts["pinion.angle"][0] * speed
    assert power == pytest.approx(expected, rel=REL)
    assert result.joints["mesh"].loss[0] == pytest.approx(power + given, rel=1e-11)


@pytest.mark.parametrize("crossed", [False, True])
@pytest.mark.parametrize("torque", [30.0, -30.0])
@pytest.mark.parametrize("radius", [None, 0.05])
def test_loss_of_a_belt(crossed: bool, torque: float, radius: float | None) -> None:
    mechanism = belt(crossed, torque, radius, None)
    joints = [
        md.Belt("belt", j.first, j.second, ratio=2, crossed=crossed, mesh_loss=0.05, radius=radius)
        if j.name == "belt"
        else j
        for j in mechanism.joints.values()
    ]
    mechanism = md.Mechanism(
        ground=mechanism.ground,
        bodies=list(mechanism.bodies.values()),
        joints=joints,
        loads=list(mechanism.loads.values()),
        sketch=mechanism.sketch,
    )
    result = md.solve(mechanism, reactions("small.angle", at=[0.4], speed=5))
    given = torque * 2.5 * (-1 if crossed else 1)
    expected = -given / 0.95 if given < 0 else -given * 0.95
    power = result.efforts["small.angle"][0] * 5
    assert power == pytest.approx(expected, rel=REL)
    assert result.joints["belt"].loss[0] == pytest.approx(power + given, rel=1e-11)


def test_normal_force_of_a_curve() -> None:
    """A disc cam with an eccentric pin: the roller is pressed along the line of centres."""
    r, e, rho, load = 0.05, 0.02, 0.01, 40.0
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("cam", {"O": (0, 0)}), md.Body("follower", {"R": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "cam.O"),
            md.Prismatic("guide", "ground.O", "follower.R", axis=math.pi / 2),
            md.Curve(
                "contact", "cam.O", "follower.R", x=f"{e} + {r}*cos(s)", y=f"{r}*sin(s)",
                closed=True, roller_radius=rho,
            ),
        ],
        loads=[md.Force("down", "follower.R", (0, -load))],
        sketch={"cam": 0.3, "guide": 0.06, "contact": 1.2},
    )  # fmt: skip
    turns = np.array([0.3, 1.0, 2.5])
    result = md.solve(mechanism, md.Reactions(md.Driver("cam.angle", at=turns), friction="none"))
    lean = np.arcsin(e * np.cos(turns) / (r + rho))  # of the line of centres from the vertical
    # the roller is on the right of a curve that runs counter-clockwise
    assert result.joints["contact"].normal == pytest.approx(-load / np.cos(lean), rel=1e-12)
    size = np.hypot(*result.joints["contact"].reaction[:, :2].T)
    assert size == pytest.approx(load / np.cos(lean), rel=1e-12)

"""Laws of forces against hand calculation: levers, springs, redundant pins, scales.

Expected values are closed forms written here, or free bodies (`force_truth`).
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.reference.force_truth import four_bar as free_four_bar
from tests.reference.force_truth import place, rate, second
from tests.shared.force_cases import cranks_and_beam, reactions, scaled_four_bar
from tests.shared.paths import DATA

REL = 1e-12


def reference(name: str) -> dict[str, Any]:
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))


def lever(
    *loads: md.Force | md.Torque | md.Resistance | md.Spring,
    gravity: tuple[float, float] | None = None,
    **mass: Any,
) -> md.Mechanism:
    """Return a lever on a pin: 0.3 m to A, 0.1 m to the other side, to B."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "P": (0.2, 0.4)}),
        bodies=[md.Body("lever", {"O": (0, 0), "A": (0.3, 0), "B": (-0.1, 0)}, **mass)],
        joints=[md.Revolute("O", "ground.O", "lever.O")],
        loads=list(loads),
        gravity=gravity,
        sketch={"lever": 0.3},
    )


def turned(mechanism: md.Mechanism, at: Any, **keys: Any) -> md.Result:
    result = md.solve(mechanism, reactions("lever.angle", at=at, **keys))
    assert set(result.status) == {"ok"}
    for size in result.checks.values():
        assert size < 1e-13
    return result


AT = np.array([-1.2, 0.0, 0.3, 1.0, 2.5])


# -- loads -----------------------------------------------------------------------------------------


def test_lever_with_two_forces() -> None:
    result = turned(
        lever(md.Force("a", "lever.A", (3, -40)), md.Force("b", "lever.B", (0, -120))), AT
    )
    torque = -(0.3 * (-40 * np.cos(AT) - 3 * np.sin(AT)) + 0.1 * 120 * np.cos(AT))
    assert result.efforts["lever.angle"] == pytest.approx(torque, rel=REL, abs=1e-12)
    expected = np.tile([-3, 160, 0], (len(AT), 1))
    assert result.joints["O"].reaction == pytest.approx(expected, rel=REL, abs=1e-12)


def test_a_force_that_turns_with_its_body() -> None:
    result = turned(lever(md.Force("a", "lever.A", (5, -7), frame="lever")), AT)
    assert result.efforts["lever.angle"] == pytest.approx(np.full(len(AT), 2.1), rel=REL)
    force = (-5 + 7j) * np.exp(1j * AT)
    reaction = result.joints["O"].reaction
    assert reaction[:, 0] + 1j * reaction[:, 1] == pytest.approx(force, rel=REL)


def test_a_force_in_the_frame_of_another_body() -> None:
    mechanism = scaled_four_bar(1.0, 1.0, g=0.0)
    load = md.Force("push", "rocker.B", (0, 6), frame="crank")
    bodies = [md.Body(b.name, b.points) for b in mechanism.bodies.values()]
    mechanism = md.Mechanism(
        ground=mechanism.ground,
        bodies=bodies,
        joints=list(mechanism.joints.values()),
        loads=[load],
        parameters=mechanism.parameters,
        sketch=mechanism.sketch,
    )
    result = md.solve(mechanism, reactions(at=[1.0], speed=2))
    _, motion = free_four_bar(1.0, 2.0, 1.0, 1.0)
    power = np.real(np.conj(rate(motion["B"])) * 6j * np.exp(1j * place(motion["crank"])))
    assert result.efforts["crank.angle"] == pytest.approx(-power / 2, rel=REL)


def test_forces_by_expressions_of_coordinates_and_speeds() -> None:
    force = md.Force("a", "lever.A", ("2 - 3*lever.A.y", "-4*lever.angle.speed*lever.angle"))
    result = turned(lever(force), AT, speed=1.5)
    fx, fy = 2 - 3 * 0.3 * np.sin(AT), -4 * 1.5 * AT
    torque = -0.3 * (np.cos(AT) * fy - np.sin(AT) * fx)
    assert result.efforts["lever.angle"] == pytest.approx(torque, rel=REL, abs=1e-13)


def test_torque_and_resistance_on_an_angle() -> None:
    for speed in (2.0, -2.0):
        result = turned(
            lever(
                md.Torque("t", "lever", "4*cos(lever.angle)"),
                md.Resistance("r", "lever.angle", negative=5, positive=7),
            ),
            AT,
            speed=speed,
        )
        against = 7 if speed > 0 else -5
        assert result.efforts["lever.angle"] == pytest.approx(
            against - 4 * np.cos(AT), rel=REL, abs=1e-12
        )
        assert result.joints["O"].reaction == pytest.approx(np.zeros((len(AT), 3)), abs=1e-12)


def test_spring_between_points_with_damper_and_preload() -> None:
    spring = md.Spring(
        "s",
        between=("ground.P", "lever.A"),
        stiffness=800,
        free_length=0.25,
        preload=6,
        damping=30,
    )
    w = 1.7
    result = turned(lever(spring), AT, speed=w)
    end = 0.3 * np.exp(1j * AT)
    line = end - (0.2 + 0.4j)
    length = np.abs(line)
    towards = line / length
    stretch = np.real(np.conj(towards) * 1j * w * end)
    tension = 6 + 800 * (length - 0.25) + 30 * stretch
    force = -tension * towards
    assert result.efforts["lever.angle"] == pytest.approx(
        -np.imag(np.conj(end) * force), rel=REL, abs=1e-11
    )
    reaction = result.joints["O"].reaction
    assert reaction[:, 0] + 1j * reaction[:, 1] == pytest.approx(-force, rel=REL)


def test_spring_and_damper_on_a_coordinate() -> None:
    for name in ("lever.angle", "O.angle"):
        spring = md.Spring(
            "s", coordinate=name, stiffness=9, free_length=0.4, preload=1, damping=0.5
        )
        result = turned(lever(spring), AT, speed=3)
        assert result.efforts["lever.angle"] == pytest.approx(1 + 9 * (AT - 0.4) + 1.5, rel=REL)
        assert result.joints["O"].reaction == pytest.approx(np.zeros((len(AT), 3)), abs=1e-12)


def test_spring_on_the_height_of_a_point() -> None:
    spring = md.Spring("s", coordinate="lever.A.y", stiffness=100, free_length=0.1)
    result = turned(lever(spring), AT)
    force = -100 * (0.3 * np.sin(AT) - 0.1)
    assert result.efforts["lever.angle"] == pytest.approx(
        -0.3 * np.cos(AT) * force, rel=REL, abs=1e-13
    )


def test_table_along_a_coordinate(tmp_path: Path) -> None:
    path = tmp_path / "table.toml"
    (tmp_path / "work.csv").write_text("angle,other,force\n-2,0,10\n0,9,30\n1,9,20\n3,0,50\n")
    path.write_text(
        """
schema = 1
title = "lever"
[ground]
points = { O = [0, 0] }
[bodies.lever]
points = { O = [0, 0], A = [0.3, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "lever.O"] }
[sketch]
lever = 0.3
[loads.work]
kind = "table"
coordinate = "lever.angle"
file = "work.csv"
columns = ["angle", "force"]
factor = 2
along = "lever.A.y"
[loads.twist]
kind = "table"
coordinate = "lever.angle"
file = "work.csv"
body = "lever"
[tasks.turn]
kind = "reactions"
driver = { coordinate = "lever.angle", at = [-1.2, 0.0, 0.3, 1.0, 2.5] }
"""
    )
    result = md.solve(path, "turn")
    force = 2 * np.interp(AT, [-2, 0, 1, 3], [10, 30, 20, 50])
    twist = np.interp(AT, [-2, 0, 1, 3], [0, 9, 9, 0])
    assert result.efforts["lever.angle"] == pytest.approx(
        -0.3 * np.cos(AT) * force - twist, rel=REL
    )


# -- weight and inertia ----------------------------------------------------------------------------


def test_weight_and_inertia_of_a_turning_body() -> None:
    w, alpha = 3.0, -2.0
    body = {"mass": 2.5, "center": (0.12, 0.05), "inertia": 0.04}
    mechanism = lever(gravity=(0, -9.81), **body)
    result = turned(mechanism, AT, speed=w, acceleration=alpha, parts=("static", "inertial"))
    c = complex(0.12, 0.05) * np.exp(1j * AT)
    acceleration = (1j * alpha - w * w) * c
    torque = 2.5 * 9.81 * c.real + (0.04 + 2.5 * abs(complex(0.12, 0.05)) ** 2) * alpha
    force = 2.5 * (acceleration + 9.81j)
    assert result.efforts["lever.angle"] == pytest.approx(torque, rel=REL, abs=1e-12)
    found = result.joints["O"]
    assert found.reaction[:, 0] + 1j * found.reaction[:, 1] == pytest.approx(force, rel=REL)
    still = np.array(result.value("efforts_static/lever.angle"))
    assert still == pytest.approx(2.5 * 9.81 * c.real, rel=REL, abs=1e-12)
    moving = np.array(result.value("efforts_inertial/lever.angle"))
    assert still + moving == pytest.approx(torque, rel=REL, abs=1e-12)
    moved = found.reaction_inertial
    assert moved[:, 0] + 1j * moved[:, 1] == pytest.approx(2.5 * acceleration, rel=REL)
    weight = np.tile([0, 2.5 * 9.81, 0], (len(AT), 1))
    assert found.reaction_static == pytest.approx(weight, rel=REL, abs=1e-12)


def test_body_axes_and_radial_axes() -> None:
    mechanism = lever(md.Force("a", "lever.A", (3, -40)))
    found = turned(mechanism, AT, axes=("body", "radial")).joints["O"]
    world = found.reaction[:, 0] + 1j * found.reaction[:, 1]
    body = found.reaction_body[:, 0] + 1j * found.reaction_body[:, 1]
    assert body == pytest.approx(world * np.exp(-1j * AT), rel=REL)
    assert np.hypot(*found.reaction_radial[:, :2].T) == pytest.approx(np.abs(world), rel=REL)


def test_mass_without_centre_and_inertia_is_a_point_at_the_origin_of_the_body() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("bob", {"O": (0, -0.5), "M": (0, 0)}, mass=3)],
        joints=[md.Revolute("O", "ground.O", "bob.O")],
        gravity=(0, -9.81),
        sketch={"bob": 0.2},
    )
    result = md.solve(mechanism, reactions("bob.angle", at=AT, speed=2, acceleration=1.5))
    # the origin of the frame hangs 0.5 m above the pin
    arm = 0.5j * np.exp(1j * AT)
    torque = 3 * 0.25 * 1.5 + 3 * 9.81 * arm.real
    assert result.efforts["bob.angle"] == pytest.approx(torque, rel=REL, abs=1e-12)


def test_inertia_without_mass_is_a_flywheel() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("wheel", {"O": (0, 0)}, inertia=2)],
        joints=[md.Revolute("O", "ground.O", "wheel.O")],
        sketch={"wheel": 0.0},
    )
    # accelerations are there although the task asks for none
    task = reactions("wheel.angle", at=[0.0], speed=1, acceleration=3, derivatives=0)
    result = md.solve(mechanism, task)
    assert result.efforts["wheel.angle"] == pytest.approx([6], rel=REL)
    assert result.joints["O"].reaction == pytest.approx(np.zeros((1, 3)), abs=1e-14)


def test_driven_slide_has_a_force_for_effort() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("lift", {"C": (0, 0), "M": (0.4, 0)}, mass=7, center=(0.4, 0))],
        joints=[md.Prismatic("guide", "ground.O", "lift.C", axis=math.pi / 2, turn=0)],
        gravity=(0, -10),
        sketch={"guide": 0.3},
    )
    result = md.solve(mechanism, reactions("guide.slide", at=[0.1, 0.2], speed=1, acceleration=2))
    assert result.efforts["guide.slide"] == pytest.approx([84, 84], rel=REL)
    # the driver carries the weight, the guide holds the moment of what hangs beside it
    assert result.joints["guide"].reaction == pytest.approx(
        np.tile([0, 0, 7 * 12 * 0.4], (2, 1)), rel=REL, abs=1e-11
    )


# -- scales ----------------------------------------------------------------------------------------

SCALES = reference("fourbar_scale")["rows"]


def scale_id(row: dict) -> str:
    return f"s={row['s']},rho={row['rho']},w={row['omega']}"


@pytest.mark.parametrize("row", SCALES, ids=scale_id)
def test_free_bodies_reproduce_the_scales(row: dict) -> None:
    scene, motion = free_four_bar(1.0, float(row["omega"]), float(row["s"]), float(row["rho"]))
    found = scene.solve(friction=False)
    assert float(found["T"][0]) == pytest.approx(float(row["T"]), rel=1e-15)
    for name in "OABD":
        force = found[name][0]
        assert [float(force.real), float(force.imag)] == pytest.approx(
            [float(x) for x in row[name]], rel=1e-14
        )
    assert float(second(motion["rocker"])[0]) == pytest.approx(float(row["al4"]), rel=1e-15)


@pytest.mark.parametrize("row", SCALES, ids=scale_id)
def test_twelve_digits_at_every_scale(row: dict) -> None:
    mechanism = scaled_four_bar(float(row["s"]), float(row["rho"]))
    result = md.solve(mechanism, reactions(at=[1.0], speed=float(row["omega"])))
    assert list(result.status) == ["ok"]
    assert result.efforts["crank.angle"][0] == pytest.approx(float(row["T"]), rel=REL)
    for name in "OABD":
        force = result.joints[name].reaction[0]
        expected = [float(x) for x in row[name]]
        size = math.hypot(*expected)
        assert force[:2] == pytest.approx(expected, abs=REL * size)
        assert abs(force[2]) <= REL * size * float(row["s"])
    # rates do not know the scale
    rocker = result.bodies["rocker"]
    assert rocker.angular_velocity[0] == pytest.approx(float(row["w4"]), rel=REL)
    assert rocker.angular_acceleration[0] == pytest.approx(float(row["al4"]), rel=REL)
    for size in result.checks.values():
        assert 0 <= size < 1e-12


@pytest.mark.parametrize("row", SCALES, ids=scale_id)
def test_power_of_the_effort_is_the_growth_of_energy(row: dict) -> None:
    s, density, w = float(row["s"]), float(row["rho"]), float(row["omega"])
    at = np.linspace(0.2, 6.0, 8)
    result = md.solve(scaled_four_bar(s, density), reactions(at=at, speed=w))
    _, motion = free_four_bar(at, w, s, density)
    ends = {
        "crank": (0, motion["A"]),
        "coupler": (motion["A"], motion["B"]),
        "rocker": (None, None),
    }
    power = np.zeros(len(at), np.longdouble)
    weight = np.zeros(len(at), np.longdouble)
    for name, length in (("crank", 1.0), ("coupler", 3.0), ("rocker", 2.5)):
        mass = np.longdouble(density) * np.longdouble(length) * np.longdouble(s)
        long = np.longdouble(length) * np.longdouble(s)
        angle = motion[name]
        if name == "rocker":
            center = (motion["B"] + np.longdouble(3.2) * np.longdouble(s)) * 0.5
        else:
            center = (ends[name][0] + ends[name][1]) * 0.5
        speed, acceleration = rate(center), second(center)
        growth = mass * np.real(np.conj(speed) * acceleration)
        growth = growth + mass * long**2 / 12 * rate(angle) * second(angle)
        lift = mass * np.longdouble(9.81) * np.imag(speed)
        power, weight = power + growth + lift, weight + np.abs(growth) + np.abs(lift)
    gap = np.abs(result.efforts["crank.angle"] * w - power)
    assert np.all(gap <= REL * weight)


# -- redundant constraints -------------------------------------------------------------------------

PARALLEL = reference("five_loop_parallelogram")


def crank_forces(phi: float, w: float, alpha: float, effort: float) -> tuple[float, float]:
    """Return the transverse forces of a crank on the beam and of the ground on the crank."""
    tip = alpha / 3 + 9.81 / 2 * math.cos(phi) - effort  # on the crank at its tip, m = L = 1
    foot = alpha / 2 + 9.81 * math.cos(phi) - tip
    return -tip, foot


def beam_effort(phi: float, alpha: float) -> float:
    """Return the torque on one of the six cranks that gives the acceleration alpha."""
    # energy: (6/3 + 6) alpha L^2 = T - (6/2 + 6) g L cos phi
    return 8 * alpha + 9 * 9.81 * math.cos(phi)


def test_the_parallelogram_in_closed_form() -> None:
    alpha = PARALLEL["phi_dd"]
    assert beam_effort(1.0, alpha) == pytest.approx(0, abs=1e-13)
    assert crank_forces(1.0, 2.0, alpha, 0.0)[0] == pytest.approx(
        PARALLEL["transverse_force_on_beam_each"], rel=1e-13
    )
    total = 6 * (-4 + 9.81 * math.sin(1.0))
    assert total == pytest.approx(PARALLEL["sum_axial_on_beam"], rel=1e-13)


@pytest.mark.parametrize("alpha", [PARALLEL["phi_dd"], 0.0, 5.0])
def test_what_is_unique_in_a_redundant_parallelogram(alpha: float) -> None:
    task = reactions("crank0.angle", at=[1.0, 1.3], speed=2, acceleration=alpha)
    result = md.solve(cranks_and_beam(), task)
    assert list(result.status) == ["ok", "ok"]
    data = result.to_dict()
    for pose, phi in enumerate((1.0, 1.3)):
        effort = beam_effort(phi, alpha)
        assert result.efforts["crank0.angle"][pose] == pytest.approx(effort, rel=REL, abs=1e-11)
        for k in range(6):
            beam, foot = crank_forces(phi, 2.0, alpha, effort if k == 0 else 0.0)
            for name, value in ((f"beam{k}", beam), (f"ground{k}", foot)):
                joint = data["joints"][name]
                assert joint["reaction"] == [[None] * 3] * 2, name
                assert transverse(joint["unique"], pose, phi, result) == pytest.approx(
                    value, rel=REL, abs=1e-11
                ), name
    for size in result.checks.values():
        assert size < 1e-12
    if alpha == PARALLEL["phi_dd"]:
        # what the file gives for the sum along the cranks
        (beam,) = (own for own in result.summary["unique_sums"] if own["body"] == "beam")
        along = beam["force"][0] @ [math.cos(1.0), math.sin(1.0)]
        assert along == pytest.approx(PARALLEL["sum_axial_on_beam"], rel=REL)


def transverse(unique: dict[str, Any], pose: int, phi: float, result: md.Result) -> float:
    """Return the one unique component of a pin's force, across its crank."""
    directions = np.asarray(unique["directions"], float)
    values = np.asarray(unique["values"], float)[pose]
    if directions.ndim == 3:  # a direction for each pose
        directions = directions[pose]
    forces = [(d, v) for d, v in zip(directions, values, strict=True) if np.hypot(*d[:2]) > 1e-9]
    assert len(forces) == 1
    (direction, value) = forces[0]
    frame = unique.get("frame", "world")
    angle = 0.0 if frame == "world" else result.bodies[frame].angle[pose]
    along = complex(*direction[:2]) * np.exp(1j * angle)
    across = 1j * np.exp(1j * phi)
    share = (along * np.conj(across)).real
    assert abs(abs(share) - np.hypot(*direction[:2])) < 1e-12  # across, and nothing else
    return float(value / share)


def test_the_effort_is_unique_whatever_crank_is_driven() -> None:
    for k in (0, 3):
        task = reactions(f"crank{k}.angle", at=[0.4, 1.0], speed=2, acceleration=1)
        result = md.solve(cranks_and_beam(), task)
        expected = [beam_effort(phi, 1.0) for phi in (0.4, 1.0)]
        assert result.efforts[f"crank{k}.angle"] == pytest.approx(expected, rel=REL)


@pytest.mark.parametrize("joint", ["ground0", "beam0", "ground4"])
def test_friction_in_one_pin_of_a_redundant_mechanism_is_refused(joint: str) -> None:
    """Also in the pin of the driven crank: the beam's force on it is not unique."""
    mechanism = cranks_and_beam()
    joints = [
        replace(own, friction=0.1, pin_radius=0.01) if own.name == joint else own
        for own in mechanism.joints.values()
    ]
    with pytest.raises(md.MechdaeError, match=joint):
        md.solve(
            replace(mechanism, joints=joints),
            reactions("crank0.angle", at=[1.0], speed=2, friction="coupled"),
        )


def test_friction_where_the_force_is_unique_beside_a_redundant_mechanism() -> None:
    # a pendulum of its own on the first ground pin: two degrees of freedom, two drivers
    mechanism = cranks_and_beam()
    bob = md.Body("bob", {"O": (0, 0)}, mass=2, center=(0.3, 0), inertia=0)
    pin = md.Revolute("pivot", "ground.O3", "bob.O", friction=0.2, pin_radius=0.02)
    mechanism = replace(
        mechanism,
        bodies=[*mechanism.bodies.values(), bob],
        joints=[*mechanism.joints.values(), pin],
        sketch={**mechanism.sketch, "bob": 0.5},
    )
    task = md.Reactions(
        drivers=[
            md.Driver("crank0.angle", at=(1.0,), speed=2),
            md.Driver("bob.angle", at=(0.5,), speed=3, acceleration=1),
        ],
        friction="coupled",
    )
    result = md.solve(mechanism, task)
    force = 2 * (0.3 * (1j - 9) * np.exp(0.5j) + 9.81j)
    rho = 0.02 * 0.2 / math.sqrt(1.04)
    torque = 2 * 0.09 * 1 + 2 * 9.81 * 0.3 * math.cos(0.5) + rho * abs(force)
    assert result.efforts["bob.angle"] == pytest.approx([torque], rel=REL)
    assert result.joints["pivot"].loss == pytest.approx([3 * rho * abs(force)], rel=REL)
    assert result.efforts["crank0.angle"] == pytest.approx([beam_effort(1.0, 0.0)], rel=REL)


def test_friction_in_redundant_pins_is_refused() -> None:
    with pytest.raises(md.MechdaeError, match="unique") as caught:
        md.solve(
            cranks_and_beam(friction=0.1),
            reactions("crank0.angle", at=[1.0], speed=2, friction="coupled"),
        )
    assert "beam" in str(caught.value)


# -- mean values -----------------------------------------------------------------------------------


def test_mean_power_against_a_table_over_a_turn() -> None:
    rows = ((0.0, 3.0), (1.0, 8.0), (1.5, -2.0), (4.0, 5.0), (2 * math.pi, 3.0))
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0)}, mass=2, center=(0.1, 0))],
        joints=[md.Revolute("O", "ground.O", "crank.O", friction=0.2, pin_radius=0.01)],
        loads=[md.TableLoad("t", coordinate="crank.angle", rows=rows, body="crank", periodic=True)],
        gravity=(0, -9.81),
        sketch={"crank": 0.0},
    )
    task = reactions(from_=0, to=4 * math.pi, poses=9, speed=5, cycle=True)
    summary = md.solve(mechanism, task).summary
    x, y = np.array(rows).T
    mean = float(np.sum(np.diff(x) * (y[1:] + y[:-1]) / 2) / (2 * math.pi))
    # the table drives, the weight gives and takes the same
    assert summary["input"] == pytest.approx(5 * mean, rel=1e-9)
    # the pin carries |m (a - g)|, a = -w^2 c: the mean length of a vector that turns
    at = np.linspace(0, 2 * math.pi, 4001)[:-1]
    force = np.abs(2 * (-25 * 0.1 * np.exp(1j * at) + 9.81j)).mean()
    rho = 0.01 * 0.2 / math.sqrt(1.04)
    assert summary["loss"] == pytest.approx(5 * rho * force, rel=1e-9)
    assert summary["useful"] == pytest.approx(5 * mean - summary["loss"], rel=1e-9)

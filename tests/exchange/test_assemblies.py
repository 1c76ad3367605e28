"""Assemblies of Ondsel and FreeCAD: ten of them, imported, solved, compared with closed forms."""

from __future__ import annotations

import math
import random
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.expression import evaluate
from mechdae.parts.exchange.assemblies import asmt_read
from mechdae.parts.exchange.assemblies.asmt_read import (
    AsmtFrame,
    AsmtJoint,
    AsmtNode,
    joined,
    read_assembly,
)
from mechdae.parts.exchange.assemblies.assembly_in_plane import mechanism_of_plane, plane_of
from mechdae.parts.exchange.assemblies.from_assembly import DOUBLE, problem_of_assembly
from tests.shared.paths import DATA

SAMPLES = sorted((DATA / "asmt").glob("*.asmt"))


@cache
def solved(name: str) -> Any:
    problem = md.read_drawing(DATA / "asmt" / f"{name}.asmt")
    return md.solve(problem, next(iter(problem.tasks)))


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_ten_samples_are_imported_and_solved(path: Path, tmp_path: Path) -> None:
    assert len(SAMPLES) == 10
    problem = md.read_drawing(path)
    md.dump(problem, tmp_path / "back.toml")
    assert md.load(tmp_path / "back.toml").mechanism == problem.mechanism
    result = solved(path.stem)
    assert result.fault is None
    assert set(result.status) == {"ok"}


def test_pendulum_swings_by_its_law() -> None:
    result = solved("pendulum")
    t = result.time
    assert result.bodies["bar"].angle == pytest.approx(0.5 * np.sin(2 * np.pi * t) - 0.5, abs=1e-13)
    mechanism = result.mechanism
    assert mechanism.gravity == (0.0, -9.81)
    assert (mechanism.bodies["bar"].mass, mechanism.bodies["bar"].inertia) == (0.8, 0.012)


def test_four_bar_of_freecad_is_in_millimetres_and_placed_roughly() -> None:
    """Freudenstein: r1 90, r2 30, r3 80, r4 70 mm, the branch that was drawn."""
    result = solved("four_bar")
    crank, rocker = result.bodies["Body001"].angle, result.bodies["Body003"].angle
    x, y = 0.09 - 0.03 * np.cos(crank), -0.03 * np.sin(crank)
    d = np.hypot(x, y)
    inner = np.arccos((d**2 + 0.07**2 - 0.08**2) / (2 * 0.07 * d))
    expected = np.arctan2(-y, -x) - inner  # at D: towards B, then to the side of C
    apart = (rocker - expected + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(apart).max() < 1e-12
    assert "base" not in result.mechanism.bodies


def test_slider_crank_turns_with_its_motion() -> None:
    result = solved("slider_crank")
    phi = math.radians(35) + 2 * np.pi * result.time
    assert result.bodies["crank"].angle == pytest.approx(phi, abs=1e-12)
    x = 0.06 * np.cos(phi) + np.sqrt(0.21**2 - (0.06 * np.sin(phi)) ** 2)
    assert result.joints["cylinder"].slide == pytest.approx(x, abs=1e-14)
    assert result.mechanism.bodies["rod"].center == (0.08, 0.0)


def test_quick_return_follows_its_block() -> None:
    result = solved("quick_return")
    phi = result.bodies["crank"].angle
    x, y = 0.05 * np.cos(phi), 0.05 * np.sin(phi) + 0.12
    assert np.unwrap(np.arctan2(y, x)) == pytest.approx(result.bodies["rocker"].angle, abs=1e-12)


def test_six_bar_stands_in_another_plane_and_turns_the_other_way() -> None:
    """Its normal is -y: the motor's law runs backwards about the normal of the plane z, x."""
    result = solved("six_bar")
    crank, t = result.bodies["crank"].angle, result.time
    assert crank[0] == pytest.approx(np.pi / 2 - math.radians(70), abs=1e-12)
    assert crank - crank[0] == pytest.approx(-6.0 * t, abs=1e-12)
    gap = result.points["coupler.C"].position - result.points["rocker.C"].position
    assert np.abs(gap).max() < 1e-13
    ends = result.points["link.E"].position, result.points["link.Q"].position
    assert np.hypot(*(ends[1] - ends[0]).T) == pytest.approx(0.09, abs=1e-13)


def test_gears_turn_by_their_radii() -> None:
    result = solved("gears")
    one, two = result.bodies["pinion"].angle, result.bodies["wheel"].angle
    assert one == pytest.approx(0.2 + 4.0 * result.time, abs=1e-12)
    assert two - two[0] == pytest.approx(-0.5 * (one - one[0]), abs=1e-12)
    assert two[0] == pytest.approx(-0.1, abs=1e-12)


def test_scotch_yoke_is_a_cosine() -> None:
    result = solved("scotch_yoke")
    x = 0.04 * np.cos(0.6 + result.time)
    assert result.joints["way"].slide == pytest.approx(x, abs=1e-14)


def test_trammel_is_pushed_in_millimetres() -> None:
    result = solved("trammel")
    x = 0.09 + 0.02 * np.sin(result.time)
    assert result.joints["Slider"].slide == pytest.approx(x, abs=1e-14)
    y = np.sqrt(0.15**2 - x**2)
    assert result.joints["Slider001"].slide == pytest.approx(y, abs=1e-13)


def test_rssr_keeps_its_bar() -> None:
    result = solved("rssr")
    phi = 0.4 + 2 * np.pi * result.time
    B = np.stack([0.05 * np.cos(phi), 0.05 * np.sin(phi), 0 * phi], axis=1)
    assert result.points["crank.B"].position == pytest.approx(B, abs=1e-13)
    C = result.points["rocker.C"].position
    assert np.linalg.norm(C - B, axis=1) == pytest.approx(0.3, abs=1e-12)
    from_pivot = C - np.array([0.1, 0.25, 0.05])
    assert from_pivot[:, 0] == pytest.approx(0, abs=1e-13)
    assert np.linalg.norm(from_pivot, axis=1) == pytest.approx(0.15, abs=1e-12)


def test_cardan_joint_has_its_uneven_speed() -> None:
    """tan out = tan in / cos bend, where the input's pin lies in the plane of the shafts at 0."""
    result = solved("cardan")
    bend, phi = math.radians(25), result.joints["in"].angle
    assert phi == pytest.approx(3.0 * result.time, abs=1e-12)
    speed = result.joints["out"].angle_velocity / 3.0
    expected = math.cos(bend) / (1 - math.sin(bend) ** 2 * np.cos(phi) ** 2)
    assert speed == pytest.approx(expected, rel=1e-9)


# -- refused ---------------------------------------------------------------------------------------


def changed(name: str, folder: Path, *pairs: tuple[str, str]) -> Path:
    text = (DATA / "asmt" / f"{name}.asmt").read_text()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "changed.asmt"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("rssr", "SphericalJoint", "ConstantVelocityJoint", "B: a ConstantVelocityJoint has no"),
        ("gears", "GearJoint", "RackPinionJoint", "mesh: a rack needs a pitchRadius"),
        ("gears", "GearJoint", "CurveCurveContact", "mesh: a CurveCurveContact has no counterpart"),
        ("pendulum", "0.5*sin(2.0*pi*time)", "2.0d-3*time", "Turn: .* is no expression of time"),
        ("pendulum", "0.5*sin(2.0*pi*time)", "2*unknown", "Turn: .* is no expression of time"),
        ("pendulum", "/Assembly1/hook", "/Assembly1/hooc", "'/Assembly1/hooc' is no marker"),
        ("pendulum", "Position3D\n\t\t0.0\t0.0", "Position3D\n\t\t0.0\tx", "3 numbers are needed"),
        ("pendulum", "1.0\t0.0\t0.0", "2.0\t0.0\t0.0", "a RotationMatrix that is no rotation"),
        ("pendulum", "1.0\t0.0\t0.0", "1.00001\t0.0\t0.0", "line [0-9]+: a RotationMatrix that"),
        ("pendulum", "OndselSolver", "Something", "is no assembly of Ondsel or FreeCAD"),
        ("pendulum", "\tParts", "\t\t\t\tParts", "indented too far"),
        ("pendulum", "RotationalMotion", "GeneralMotion", "a GeneralMotion of joint 'Pin'"),
    ],
)  # fmt: skip
def test_what_has_no_counterpart_is_refused_by_name(
    name: str, old: str, new: str, words: str, tmp_path: Path
) -> None:
    pairs = [(old, new)]
    if new == "Something":
        pairs = [("freeCAD: 3D CAD with Motion Simulation  by  askoh.com", new)]
    with pytest.raises(md.InputError, match=words) as caught:
        md.read_drawing(changed(name, tmp_path, *pairs))
    assert "changed.asmt" in str(caught.value)


def test_a_unit_of_the_lengths(tmp_path: Path) -> None:
    problem = md.read_drawing(DATA / "asmt" / "four_bar.asmt", unit="in")
    assert problem.mechanism.bodies["Body001"].points["m1"][0] == pytest.approx(30 * 0.0254)
    with pytest.raises(md.InputError, match="unknown unit 'mile'"):
        md.read_drawing(DATA / "asmt" / "four_bar.asmt", unit="mile")


# -- files that a letter or a rounding kept out ----------------------------------------------------


def case(name: str) -> tuple[md.Problem, list[str]]:
    return problem_of_assembly(DATA / "asmt-cases" / f"asmt-{name}.asmt")


def rocker_at(phi: Any, a: float = 0.3, b: float = 0.9, c: float = 0.7, d: float = 0.8) -> Any:
    """Return the rocker's angle by two triangles over the line from the crank's pin to its own."""
    x, y = a * np.cos(phi) - d, a * np.sin(phi)
    far = np.hypot(x, y)
    inner = np.arccos((far**2 + c**2 - b**2) / (2 * far * c))
    return np.unwrap(np.arctan2(y, x) - inner)


def swing(a: float = 0.3, b: float = 0.9, c: float = 0.7, d: float = 0.8) -> float:
    """Return between which dead centres the rocker swings: crank and coupler in line."""
    ends = [math.acos((c**2 + d**2 - r**2) / (2 * c * d)) for r in (b - a, b + a)]
    return abs(ends[1] - ends[0])


@pytest.mark.parametrize("name", ["law-with-d", "rotation-1e-6", "two-markers-on-one-pin"])
def test_four_bars_of_the_cases_swing_by_their_triangles(name: str) -> None:
    assert math.degrees(swing()) == pytest.approx(59.500995940788, abs=1e-10)
    own, remarks = case(name)
    result = md.solve(own, "motion")
    assert set(result.status) == {"ok"}
    assert result.summary["swing"]["rocker"] == pytest.approx(swing(), abs=1e-9)
    phi = result.bodies["crank"].angle
    assert phi - phi[0] == pytest.approx(2 * np.pi * result.time, abs=1e-12)
    angle = result.bodies["rocker"].angle
    apart = np.diff(angle - rocker_at(phi))
    other = np.diff(angle + rocker_at(-phi))
    assert min(np.abs(apart).max(), np.abs(other).max()) < 1e-11
    told = [text for text in remarks if "rotation matrices" in text]
    assert bool(told) == (name == "rotation-1e-6")
    if told:
        text = (DATA / "asmt-cases" / f"asmt-{name}.asmt").read_text().splitlines()
        (line,) = re.findall(r"line (\d+)", told[0])
        assert text[int(line) - 1].strip() == "RotationMatrix"
        assert "0.99999" in "".join(text[int(line) : int(line) + 3])


def test_markers_behind_each_other_are_one_pin() -> None:
    own, _ = case("two-markers-on-one-pin")
    points = {name: len(body.points) for name, body in own.mechanism.bodies.items()}
    assert points["rocker"] == 2
    swings = md.solve(own, "motion").summary["swing"]
    assert math.degrees(swings["out"]) == pytest.approx(48.588046, abs=1e-6)


def test_tasks_with_too_few_drivers_are_not_written() -> None:
    own, remarks = case("mobility-two")
    assert not own.tasks
    assert "mobility by count 2: tasks with drivers are left to be written" in remarks
    cranks = [
        name
        for joint in own.mechanism.joints.values()
        for name in joint.bodies
        if "ground" in joint.bodies and name != "ground"
    ]
    drivers = tuple(md.Driver(f"{name}.angle", at=(1.0,)) for name in cranks)
    assert len(drivers) == 2
    sketch = own.mechanism.sketch
    drivers = tuple(md.Driver(f"{name}.angle", at=(sketch[name],)) for name in cranks)
    assert md.solve(own.with_task("m", md.Modes(drivers=drivers)), "m").summary["count"] == 2


def test_nearest_rotations_are_taken_of_any_matrix_nearly_one(tmp_path: Path) -> None:
    """Rotations with noise below 1e-6: what is read is one to rounding, and near the file's."""
    rng = np.random.default_rng(5)
    for _ in range(30):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn))
        rough = turn + rng.uniform(-1e-6, 1e-6, (3, 3))
        node = AsmtNode("Part", 1)
        rows = [AsmtNode(" ".join(map(repr, map(float, row))), 3) for row in rough]
        node.children.append(AsmtNode("RotationMatrix", 2, rows))
        found = asmt_read._frame(node).R
        assert np.abs(found @ found.T - np.eye(3)).max() < 1e-14
        assert np.abs(found - turn).max() < 4e-6
        near = np.linalg.norm(found - rough)  # no rotation close by is nearer
        for axis in np.eye(3):
            cross = np.cross(np.eye(3), axis)
            for step in (1e-7, -1e-7):
                other = found @ (np.eye(3) + step * cross + step**2 / 2 * cross @ cross)
                assert np.linalg.norm(other - rough) > near - 1e-15


def test_smalltalk_doubles_are_numbers_and_nothing_else_is() -> None:
    rng = random.Random(4)
    for _ in range(50):
        a, b = rng.randint(1, 99), rng.uniform(0.1, 9)
        text = f"{a}d*t + sin({b:.3f}d*t)"
        value = evaluate(DOUBLE.sub(r"\1", text), {"t": 0.7})
        assert value == pytest.approx(a * 0.7 + math.sin(round(b, 3) * 0.7), rel=1e-14)
    for text in ("2.0d-3*t", "end2d", "2.0days", "x2d"):
        assert DOUBLE.sub(r"\1", text) == text


def test_a_rack_moves_as_its_wheel_rolls(tmp_path: Path) -> None:
    """x of the wheel in the rack's marker plus radius times turn is constant: x' = r turn'."""
    text = (DATA / "asmt" / "scotch_yoke.asmt").read_text()
    path = tmp_path / "rack.asmt"
    path.write_text(text)
    plain = read_assembly(path)
    slides = [joint for joint in plain.joints if joint.form == "TranslationalJoint"]
    (yoke,) = (joint for joint in slides if "block" not in (joint.first[0], joint.second[0]))
    side = yoke.first if yoke.first[0] else yoke.second
    wheel = next(j for j in plain.joints if j.form == "RevoluteJoint" and "" in (
        j.first[0], j.second[0]))  # fmt: skip
    rim = wheel.first if wheel.first[0] else wheel.second
    turned = AsmtFrame(np.zeros(3), np.eye(3))
    parts = {
        name: replace(own, markers=own.markers | {"R": turned})
        for name, own in plain.parts.items()
        if name in (side[0], rim[0])
    }
    rolling = AsmtJoint("RackPinionJoint", "roll", (side[0], "R"), rim, {"pitchRadius": 0.05})
    made = joined(replace(plain, parts=parts, joints=[wheel, yoke, rolling]), 1.0, "rack")
    mechanism, _ = mechanism_of_plane(made, plane_of(made), [])
    crank = made.bodies[rim[0]]
    task = md.Sweep(driver=md.Driver(f"{crank}.angle", from_=0.6, to=2.6), poses=9)
    result = md.solve(mechanism, task)
    moved = result.points[f"{made.bodies[side[0]]}.{made.points[(side[0], 'R')]}"].position
    turn = result.bodies[crank].angle
    assert moved[:, 0] - moved[0, 0] == pytest.approx(0.05 * (turn - turn[0]), abs=1e-13)
    assert moved[:, 1] == pytest.approx(moved[0, 1], abs=1e-14)

"""Units of parameters, from where a problem uses them."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file import library
from mechdae.describe.units import powers_of, text_of
from mechdae.draw.graphs.series import lines_of
from tests.shared.paths import PROBLEMS

TEXT = """
schema = 1
[parameters]
r_mm = 75
h_mm = 250
L = "0.135*h/r"
half = "L/2"
V_deg = 45
omega_rpm = 60
F = 2500
m = 2
J = "m*r**2/2"
k = 1e4
c = 20
f = 0.1
Lu = "sqrt(h**2 + r**2)"
unused = 3
end = 2
both = 0.5
[ground]
points = { O = [0, "h*sin(V)"], D = ["Lu", "both"] }
[bodies.crank]
points = { O = [0, 0], A = ["r", "half"] }
mass = "m"
inertia = "J"
[bodies.slider]
points = { A = [0, 0] }
mass = 1
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"], friction = "f", pin_radius = 0.01 }
A = { kind = "revolute", between = ["crank.A", "slider.A"] }
guide = { kind = "pin-in-slot", between = ["ground.D", "slider.A"], axis = "both" }
[sketch]
crank_deg = 30
[loads.push]
kind = "force"
point = "slider.A"
value = ["F*cos(omega*t)", 0]
[loads.coil]
kind = "spring"
between = ["ground.D", "slider.A"]
stiffness = "k"
damping = "c"
[tasks.turn]
kind = "sweep"
driver = { coordinate = "crank.angle", from = 0, to = 6, speed = "omega" }
[tasks.drop]
kind = "motion"
until = "end"
"""


def test_units_follow_from_uses(tmp_path: Path) -> None:
    path = tmp_path / "units.toml"
    path.write_text(TEXT)
    problem = md.load(path)
    found = parameter_units(problem.mechanism, problem.tasks.values())
    own = {name: found.get(name) for name in problem.mechanism.parameters}
    assert own == {
        "r": "m",
        "h": "m",  # L = 0.135*h/r does not make it m2: the number has a unit of its own
        "L": "m",
        "half": "m",
        "V": "rad",
        "omega": "rad/s",
        "F": "N",
        "m": "kg",
        "J": "kg m2",
        "k": "N/m",
        "c": "N s/m",
        "f": "1",
        "Lu": "m",
        "unused": None,
        "end": "s",
        "both": None,  # a length and an angle
    }
    assert found["crank.inertia"] == "kg m2"
    assert found["guide.axis"] == "rad"
    assert "unused" not in parameter_units(problem.mechanism)


@pytest.mark.parametrize("unit", ["m", "rad/s", "kg m2", "N m/rad", "m/s2", "1", "N", "1/s", "W"])
def test_units_are_read_and_written(unit: str) -> None:
    assert text_of(powers_of(unit)) == unit


def test_units_without_one_meaning() -> None:
    assert powers_of("N or N m") is None
    assert powers_of("") is None
    assert text_of((Fraction(1), Fraction(0), Fraction(-3), Fraction(1))) == "kg m/s3"


STUDY = """
[tasks.map]
kind = "study"
of = "turn"
vary = { a = [0.03, 0.04, 2], omega_rpm = [60, 120, 2] }
outputs = ["summary/swing/rocker", "summary/transmission/C/min", "points/coupler.P/velocity"]
"""


def test_maps_and_columns_carry_units(tmp_path: Path) -> None:
    text = (PROBLEMS / "four-bar-crank-rocker.toml").read_text()
    text = text.replace("[tasks.turn]", "[tasks.turn]\nmeasures = ['transmission']", 1)
    path = tmp_path / "map.toml"
    path.write_text(text + STUDY)
    problem = md.load(path)
    result = md.solve(problem, "map")
    units = {name: unit for name, unit, _ in result.columns()}
    assert units["a"] == "m"
    assert units["omega"] == "rad/s"
    assert units["summary/transmission/C/min"] == "rad"
    assert {u for n, u in units.items() if n.startswith("points/coupler.P")} == {"m/s"}
    panel = md.plot(result, of="summary/transmission/C/min")
    assert panel.get_xlabel() == "a [mm]"
    assert panel.get_ylabel() == "omega [rad/s]"
    assert panel.get_xlim() == pytest.approx((30.0, 40.0))
    assert any("transmission/C/min [deg]" in own.get_text() for own in panel.texts)
    panel = md.plot(result, along="a")
    assert panel.get_xlabel() == "a [mm]"
    assert any("omega = 6.283 rad/s" in own.get_text() for own in panel.texts)


def test_energy_and_drift_of_a_motion_are_series() -> None:
    result = md.solve("folding-slider-crank-motion", poses=20)
    assert (result.scalars["drift"] > 0).any()
    for name in ("energy", "kinetic", "potential"):
        (line,) = lines_of(result, name)
        assert line.unit == "J"
        assert line.values == pytest.approx(result.scalars[name], rel=0, abs=0)
    axes = md.plot(result, "curves", of=["energy", "kinetic", "drift"])
    first, second = axes.figure.axes
    drawn = {own.get_gid(): own.get_ydata() for own in first.lines}
    factor = 1e3 if "[mJ]" in first.get_ylabel() else 1.0
    poses = factor * result.scalars["energy"]  # the curve passes through all of them
    gaps = np.abs(np.asarray(drawn["curve-energy-"])[:, None] - poses).min(axis=0)
    assert gaps.max() < 1e-9 * np.abs(poses).max()
    assert second.get_ylabel() == "drift"
    assert second.get_yscale() == "log"
    with pytest.raises(md.UnknownName) as told:
        md.plot(result, "curves", of="enrgy")
    assert "energy" in told.value.hint


def test_work_of_loads_is_a_series() -> None:
    result = md.solve("incline-block", poses=5)
    lines = lines_of(result, "work")
    assert [line.name for line in lines] == list(result.work)
    assert {line.unit for line in lines} == {"J"}


def test_points_that_stand_still_are_not_drawn() -> None:
    """A point that does not move has two coordinates that differ from each other."""
    one = md.Body("one", points={"A": [0, 0], "B": [0.1, 0]})
    two = md.Body("two", points={"D": [0, 0], "E": [0.1, 0]})
    mechanism = md.Mechanism(
        ground=md.Ground(points={"A": [0, 0], "D": [0.3, 0]}),
        bodies=[one, two],
        joints=[
            md.Revolute("A", "ground.A", "one.A"),
            md.Revolute("D", "ground.D", "two.D"),
        ],
        sketch={"one": 0.5, "two": 0.5},
    )
    drivers = [md.Driver("one.angle", from_=0.5, to=1.5), md.Driver("two.angle", at=[0.5])]
    panel = md.plot(md.solve(mechanism, md.Sweep(drivers=drivers, poses=5)), "curves")
    drawn = {own.get_gid() for own in panel.lines if str(own.get_gid()).startswith("curve-")}
    assert drawn == {f"curve-points/one.B/position-one.B {axis}" for axis in "xy"}


@pytest.mark.parametrize("name", library.names())
def test_every_predefined_problem_has_units(name: str) -> None:
    """No part of a mechanism is one whose numbers are not known here, like a curve's range."""
    problem = md.load(name)
    found = parameter_units(problem.mechanism, problem.tasks.values())
    for joint in problem.mechanism.joints.values():
        if joint.kind == "curve":
            assert f"{joint.name}.start" not in found  # of s, which may be anything
    assert set(found) <= set(problem.mechanism.values())

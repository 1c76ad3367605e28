"""Equilibria and small motions around them against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file.load import from_dict
from mechdae.errors import InputError, SingularMassError, SolveError, UnknownName


def on_incline(**keys: Any) -> dict[str, Any]:
    return {
        "schema": 1,
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"block": {"points": {"P": [0, 0]}, "mass": 2.0}},
        "joints": {"guide": {"kind": "prismatic", "between": ["ground.O", "block.P"], "axis": 0.3}},
        "loads": {
            "s": {"kind": "spring", "coordinate": "guide.slide", "stiffness": 50.0, "damping": 3.0}
        },
        "tasks": {"e": {"kind": "equilibrium", "linearise": True, "free": ["guide"], **keys}},
    }


def test_block_on_a_spring() -> None:
    result = md.solve(from_dict(on_incline()), "e")
    place = -2 * 9.81 * math.sin(0.3) / 50
    assert result.joints["guide"].slide[0] == pytest.approx(place, rel=1e-14)
    (mode,) = result.summary["modes"]
    w, damping = 5.0, 3 / (2 * math.sqrt(100))
    assert mode["natural_frequency"] == pytest.approx(w / (2 * math.pi), rel=1e-13)
    assert mode["damping"] == pytest.approx(damping, rel=1e-13)
    assert mode["eigenvalue"] == pytest.approx([-0.75, w * math.sqrt(1 - damping**2)], rel=1e-13)
    assert result.summary["stable"] == "asymptotically stable"
    force = result.joints["guide"].reaction[0]
    across = 2 * 9.81 * math.cos(0.3)
    assert force[:2] == pytest.approx([-across * math.sin(0.3), across * math.cos(0.3)], rel=1e-13)


def test_double_pendulum_hanging_and_standing() -> None:
    """w^2 = g (2 -+ sqrt 2)/l hanging; with the upper rod up the motion grows."""
    problem = md.load("double-pendulum")
    free = ("upper.angle", "lower.angle")
    hanging = md.solve(problem, md.Equilibrium(linearise=True, free=free))
    wanted = np.sqrt(9.81 * np.array([2 - math.sqrt(2), 2 + math.sqrt(2)])) / (2 * math.pi)
    found = [mode["frequency"] for mode in hanging.summary["modes"]]
    assert found == pytest.approx(wanted, rel=1e-12)
    ratios = [mode["shape"]["upper.angle"][0] for mode in hanging.summary["modes"]]
    assert ratios == pytest.approx([math.sqrt(0.5), -math.sqrt(0.5)], rel=1e-12)
    assert hanging.summary["stable"] == "stable"
    near = {"upper.angle": 3.0, "lower.angle": 0.2}
    standing = md.solve(problem, md.Equilibrium(linearise=True, start=near))
    assert standing.summary["state"]["y1"] == pytest.approx(1.0, abs=1e-14)
    assert standing.summary["stable"] == "unstable"
    assert max(mode["eigenvalue"][0] for mode in standing.summary["modes"]) > 3


def test_closed_loops() -> None:
    """The ladder hangs down like one pendulum: w^2 = ((N + 1)/2 + N) g/((N + 1)/3 + N)."""
    near = {"crank0.angle": -1.2}
    result = md.solve("n-four-bar", md.Equilibrium(linearise=True, start=near))
    assert result.bodies["crank1"].angle[0] == pytest.approx(-math.pi / 2, abs=1e-13)
    (mode,) = result.summary["modes"]
    wanted = math.sqrt(3.5 * 9.81 / 3) / (2 * math.pi)
    assert mode["frequency"] == pytest.approx(wanted, rel=1e-12)


def test_the_pose_stays_when_let_go() -> None:
    """The beam's cranks hang down; with redundant equations too."""
    problem = md.load("five-crank-parallelogram")
    found = md.solve(problem, md.Equilibrium(start={"crank0.angle": -1.3}, linearise=True))
    assert found.bodies["crank3"].angle[0] == pytest.approx(-math.pi / 2, abs=1e-12)
    assert found.summary["stable"] == "stable"
    wanted = math.sqrt(9 / 8 * 9.81) / (2 * math.pi)
    assert found.summary["modes"][0]["frequency"] == pytest.approx(wanted, rel=1e-12)


def test_a_held_coordinate() -> None:
    problem = md.load("double-pendulum")
    held = md.Driver("upper.angle", at=[0.5])
    result = md.solve(problem, md.Equilibrium(drivers=(held,), linearise=True))
    assert result.bodies["upper"].angle[0] == pytest.approx(0.5, abs=1e-14)
    assert result.bodies["lower"].angle[0] == pytest.approx(0.0, abs=1e-14)
    wanted = math.sqrt(9.81) / (2 * math.pi)
    assert [m["frequency"] for m in result.summary["modes"]] == pytest.approx([wanted], rel=1e-12)
    # the torque that holds it is the moment of both weights
    torque = -result.summary["multipliers"]["upper.angle.law"]
    assert torque == pytest.approx(2 * 9.81 * math.sin(0.5), rel=1e-13)


def test_faults() -> None:
    data = on_incline()
    del data["loads"]["s"]
    with pytest.raises(SolveError, match="no equilibrium was found"):
        md.solve(from_dict(data), "e")
    with pytest.raises(InputError, match="1 freedoms, 2 coordinates"):
        md.solve(from_dict(on_incline(free=["guide", "block.P.x"])), "e")
    with pytest.raises(UnknownName, match="gide"):
        from_dict(on_incline(free=["gide.slide"]))
    data = on_incline()
    del data["bodies"]["block"]["mass"]
    with pytest.raises(SingularMassError):
        md.solve(from_dict(data), "e")


def test_the_command_prints_it(capsys, tmp_path) -> None:
    text = "schema = 1\ngravity = [0, -9.81]\n[ground]\npoints = { O = [0, 0] }\n"
    text += "[bodies.rod]\npoints = { O = [0, 0] }\nmass = 1\ncenter = [1, 0]\n[joints]\n"
    text += 'O = { kind = "revolute", between = ["ground.O", "rod.O"] }\n[sketch]\nrod_deg = -80\n'
    text += '[tasks.rest]\nkind = "equilibrium"\nlinearise = true\n'
    path = tmp_path / "rod.toml"
    path.write_text(text)
    assert main(["solve", str(path)]) == 0
    out = capsys.readouterr().out
    assert "stable, 1 freedom" in out
    assert "0.498" in out  # sqrt(g)/(2 pi) Hz
    assert main(["show", str(path)]) == 0
    assert "equilibrium, 3 coordinates and 2 equations -> 1 and 0" in capsys.readouterr().out


def test_a_beam_that_hangs_on_six_cranks() -> None:
    """What each crank carries along itself is open, what all of them carry is the weight."""
    problem = md.load("five-crank-parallelogram")
    task = md.Equilibrium(start={"crank0": -1.5})
    result = md.solve(problem.with_task("rest", task), "rest")
    assert result.bodies["crank3"].angle[0] == pytest.approx(-math.pi / 2, abs=1e-12)
    assert np.isnan(result.joints["beam2"].reaction).all()
    assert len(result.summary["not_unique"]) == 12
    (beam,) = [own for own in result.summary["unique_sums"] if own["body"] == "beam"]
    assert beam["force"][0] == pytest.approx([0, 6 * 9.81], abs=1e-11)
    assert result.summary["multipliers"]["beam2.y"] is None
    assert result.summary["multipliers"]["beam2.x"] == pytest.approx(0, abs=1e-11)


@pytest.mark.parametrize("start", [0.1, 0.12])
def test_a_step_along_the_circuit_may_end_on_an_equilibrium(start: float) -> None:
    """Steps are of 0.05 rad: from 0.1 they end where the spring is slack."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0]}),
        bodies=[md.Body("wheel", {"O": [0, 0]}, mass=2, inertia=0.7)],
        joints=[md.Revolute("O", "ground.O", "wheel.O")],
        loads=[md.Spring("hold", coordinate="wheel.angle", stiffness=4)],
    )
    rest = md.solve(mechanism, md.Equilibrium(linearise=True, start={"wheel": start}))
    assert rest.bodies["wheel"].angle[0] == pytest.approx(0.0, abs=1e-12)
    assert rest.summary["frequencies"][0] == pytest.approx((4 / 0.7) ** 0.5 / (2 * np.pi))

"""What a motion says about itself: S1 to S8 and F1 to F5, each provoked, with its numbers."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.problem import from_dict
from mechdae.errors import (
    InconsistentStartError,
    IndeterminateFrictionError,
    InfeasibleMotionError,
    SingularMassError,
)

G = 9.81


def slider(loads: dict[str, Any], **task: Any) -> dict[str, Any]:
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"block": {"points": {"P": [0, 0]}, "mass": 1.0}},
        "joints": {"guide": {"kind": "prismatic", "between": ["ground.O", "block.P"]}},
        "loads": loads,
        "tasks": {"m": {"kind": "motion", "until": 1.0, "tolerance": 1e-9, **task}},
    }


def pushed(value: str, **task: Any) -> dict[str, Any]:
    load = {"kind": "force", "point": "block.P", "value": [value, 0]}
    return slider({"push": load}, **task)


def slider_crank(law: str, crank_deg: float = 60.0) -> dict[str, Any]:
    """Crank 0.1, rod 0.3, its slider on a law of time: dead centre at 0.4."""
    rod = -math.degrees(math.asin(0.1 * math.sin(math.radians(crank_deg)) / 0.3))
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "crank": {"points": {"O": [0, 0], "B": [0.1, 0]}, "mass": 1.0, "inertia": 0.01},
            "rod": {"points": {"B": [0, 0], "C": [0.3, 0]}, "mass": 0.5, "inertia": 0.004},
            "slider": {"points": {"C": [0, 0]}, "mass": 2.0},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "crank.O"]},
            "B": {"kind": "revolute", "between": ["crank.B", "rod.B"]},
            "C": {"kind": "revolute", "between": ["rod.C", "slider.C"]},
            "slide": {"kind": "prismatic", "between": ["ground.O", "slider.C"]},
        },
        "sketch": {"crank_deg": crank_deg, "rod_deg": rod},
        "tasks": {
            "m": {
                "kind": "motion",
                "until": 2.0,
                "drivers": [{"coordinate": "slide.slide", "law": law}],
            }
        },
    }


def coded(result: md.Result, code: str) -> list[dict[str, Any]]:
    return [event for event in result.events if event.get("code") == code]


# -- S: singular, superfluous, inconsistent, infeasible ------------------------------------------


def test_s1_singular_pose() -> None:
    """The arms of the folding slider-crank fall onto each other at arm = pi/2."""
    result = md.solve(md.load("folding-slider-crank-motion"), "motion")
    first = coded(result, "S1")[0]
    assert (first["kind"], first["rank_drop"]) == ("singular", 1)
    problem = md.load("folding-slider-crank-motion")
    task = md.Motion(
        start=problem.tasks["motion"].start,
        start_speed=problem.tasks["motion"].start_speed,
        at=[first["time"]],
        tolerance=1e-11,
    )
    there = md.solve(problem.with_task("m", task), "m").bodies["arm"].angle[-1]
    assert math.cos(there) == pytest.approx(0.0, abs=1e-7)


def test_s2_dependent_equations_and_reactions_they_leave_open() -> None:
    """A block in two guides of one line, a pendulum on it: the pin's reaction alone is unique."""
    data = slider({})
    data["gravity"] = [0, -G]
    data["bodies"]["block"]["points"]["Q"] = [1.0, 0]
    data["bodies"]["rod"] = {"points": {"P": [0, 0]}, "mass": 1.0, "center": [0, -1]}
    data["joints"] |= {
        "other": {"kind": "prismatic", "between": ["ground.O", "block.Q"]},
        "pin": {"kind": "revolute", "between": ["block.P", "rod.P"]},
    }
    data["sketch"] = {"rod": 0.5}
    result = md.solve(from_dict(data), "m")
    found = result.summary["redundant"]
    assert found["equations"] == ["guide.n", "guide.turn", "other.n", "other.turn"]
    assert (found["not_unique"], found["unique"]) == (["guide", "other"], ["pin"])
    (note,) = [note for note in result.summary["notes"] if "S2" in note]
    assert "not unique: guide, other" in note


def test_s2_all_cranks_of_the_ladder() -> None:
    """Parallel cranks of equal length: forces along each of them are open, as Bricard's are."""
    result = md.solve(md.load("five-crank-parallelogram"), "motion")
    found = result.summary["redundant"]
    assert found["unique"] == []
    assert set(found["not_unique"]) == set(result.joints)
    single = md.solve(md.load("pendulum"), "motion")
    assert "redundant" not in single.summary


def test_s3_contradictory_start() -> None:
    data = slider_crank("0.3 + 0.01*t")
    data["tasks"]["m"]["start"] = {"crank": 1.0, "slider": {"C": {"x": 0.35}}}
    data["tasks"]["m"].pop("drivers")
    with pytest.raises(InconsistentStartError, match=r"contradict each other \(S3\)") as caught:
        md.solve(from_dict(data), "m")
    assert max(abs(value) for value in caught.value.residuals.values()) > 1e-4


def test_s4_a_law_that_goes_on_at_a_dead_point() -> None:
    """The slider runs out at 0.06 m/s and is at r + l = 0.4 at t = 1: no crank speed fits."""
    result = md.solve(from_dict(slider_crank("0.34 + 0.06*t")), "m")
    (event,) = coded(result, "S4")
    assert event["kind"] == "infeasible"
    assert event["time"] == pytest.approx(1.0, abs=1e-8)
    assert event["residual"] == pytest.approx(0.06, rel=1e-6)
    assert max(event["residuals"], key=lambda name: abs(event["residuals"][name])) == "C.x"
    assert "dead point" in (result.fault or "")
    assert "0.06 m/s" in (result.fault or "")
    assert result.time[-1] == event["time"]
    place = np.array([0.1 * np.cos(a) for a in result.bodies["crank"].angle])
    far = np.sqrt(0.09 - (0.1 * np.sin(result.bodies["crank"].angle)) ** 2)
    assert place + far == pytest.approx(0.34 + 0.06 * result.time, abs=1e-9)


def test_s4_at_the_start() -> None:
    with pytest.raises(InfeasibleMotionError, match=r"0\.1 m/s") as caught:
        md.solve(from_dict(slider_crank("0.4 + 0.1*t", crank_deg=0.5)), "m")
    assert caught.value.residuals["C.x"] == pytest.approx(0.1, rel=1e-6)
    assert caught.value.time == 0.0


def test_no_s4_where_the_law_turns_at_the_dead_point() -> None:
    result = md.solve(from_dict(slider_crank("0.4 - 0.05*(t - 1)**2")), "m")
    assert not coded(result, "S4")


def test_s5_massless_coordinates_that_feel_a_force() -> None:
    """A rod without mass hangs on a heavy block, a force at its end: the rod's angle is named."""
    data = pushed("1.0")
    data["bodies"]["rod"] = {"points": {"P": [0, 0], "Q": [1, 0]}}
    data["joints"]["pin"] = {"kind": "revolute", "between": ["block.P", "rod.P"]}
    data["loads"]["push"]["point"] = "rod.Q"
    data["loads"]["push"]["value"] = [0, 1.0]
    with pytest.raises(SingularMassError, match=r"moves with rod\.angle has .* \(S5\)"):
        md.solve(from_dict(data), "m")


# -- S7: the last good state ---------------------------------------------------------------------


def test_s7_tells_step_singular_value_coupling_and_mode() -> None:
    """A torque that ends at t = 0.5 on a slider-crank with friction in its guide."""
    data = slider_crank("0")
    data["tasks"]["m"] = {"kind": "motion", "until": 1.0, "tolerance": 1e-8}
    data["gravity"] = [0, -G]
    data["joints"]["slide"]["friction"] = 0.1
    data["loads"] = {"motor": {"kind": "torque", "body": "crank", "value": "3*sqrt(0.5 - t)"}}
    result = md.solve(from_dict(data), "m")
    (event,) = coded(result, "S7")
    assert (event["kind"], event["mode"].keys()) == ("stalled", {"slide"})
    assert event["time"] == pytest.approx(0.5, abs=1e-9)
    assert event["step"] <= 1e-12
    assert 0 < event["sigma_min"] <= 1
    crank, rod = result.bodies["crank"].angle[-1], result.bodies["rod"].angle[-1]
    assert 0.1 * math.sin(crank) + 0.3 * math.sin(rod) == pytest.approx(0.0, abs=1e-12)
    assert event["kappa"] >= 0
    assert result.time[-1] == event["time"]


@pytest.mark.parametrize("method", ["explicit", "bdf"])
def test_s7_negative_damping_that_explodes(method: str) -> None:
    """x'' = 500 x', x'(0) = 1: x' = exp(500 t), x = (x' - 1)/500."""
    data = pushed("500*guide.slide.speed", start_speed={"guide.slide": 1.0}, method=method)
    result = md.solve(from_dict(data), "m")
    (event,) = coded(result, "S7")
    assert (event["kind"], event["load"]) == ("unbounded", "push")
    assert "speeds grow without bound" in (result.fault or "")
    assert result.time[-1] == event["time"] < 0.1
    speed = result.joints["guide"].slide_velocity[-1]
    assert speed == pytest.approx(math.exp(500 * event["time"]), rel=1e-6)
    assert event["work"] == pytest.approx((speed**2 - 1) / 2, rel=1e-5)


@pytest.mark.parametrize(
    "force", ["1/(0.5 - t)", "1/(0.5 - t)**2", "log(0.5 - t)", "sqrt(0.5 - t)"]
)
def test_s7_forces_that_end_or_have_no_bound(force: str) -> None:
    result = md.solve(from_dict(pushed(force)), "m")
    (event,) = coded(result, "S7")
    assert event["kind"] == "stalled"
    assert event["time"] == pytest.approx(0.5, abs=1e-9)
    if force.startswith("sqrt"):
        assert result.joints["guide"].slide_velocity[-1] == pytest.approx(0.5**1.5 / 1.5, abs=1e-9)
    assert np.isfinite(result.points["block.P"].velocity).all()


def test_partial_results_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 1, and the states up to there are printed and written."""
    path = tmp_path / "dead.toml"
    md.dump(from_dict(slider_crank("0.34 + 0.06*t")), path)
    code = main(["solve", str(path), "--json", "--out", str(tmp_path / "out")])
    printed = json.loads(capsys.readouterr().out)["tasks"]["m"]
    assert code == 1
    assert printed["time"][-1] == pytest.approx(1.0, abs=1e-8)
    assert printed["events"][-1]["code"] == "S4"
    assert len(printed["bodies"]["crank"]["angle"]) == len(printed["time"]) > 10
    assert list((tmp_path / "out").glob("*.csv"))
    assert main(["solve", str(path)]) == 1
    assert "infeasible t = 1" in capsys.readouterr().out


def test_s8_energy_audit() -> None:
    """Gravity alone: the gap of the energy over what moves, at two tolerances."""
    gaps = []
    for tolerance in (1e-5, 1e-10):
        result = md.solve(md.load("pendulum"), "motion", set={"tol": tolerance})
        energy = result.scalars.energy
        gap = np.max(np.abs(energy - energy[0])) / np.max(result.scalars.kinetic)
        assert result.checks["energy"] == pytest.approx(gap, rel=1e-4)
        gaps.append(gap)
    assert gaps[1] < 1e-8 < gaps[0]


# -- F -------------------------------------------------------------------------------------------


def test_f1_and_f2_name_joints_coupling_and_solutions() -> None:
    """Two contacts at a distance L, the centre of mass at h: kappa = 2 mu h/L = 1.6."""
    problem = md.load("eccentric-slider")
    two = md.solve(problem.with_values({"mu": 0.4}), "motion")
    (event,) = coded(two, "F2")
    assert (event["kind"], event["joints"]) == ("ambiguous", ["guide"])
    assert event["kappa"] == pytest.approx(1.6, rel=1e-12)
    assert event["share"] == pytest.approx(0.625, rel=1e-12)
    found = sorted(own["block.x"] for own in event["solutions"])
    assert found == pytest.approx([-5 / 3, 3.4615384615384615], rel=1e-12)
    none = md.solve(problem.with_values({"mu": 0.4, "side": -1}), "motion")
    (event,) = coded(none, "F1")
    assert (event["kind"], event["solutions"]) == ("jammed", [])
    assert event["kappa"] == pytest.approx(1.6, rel=1e-12)


def test_f3_friction_on_an_open_force() -> None:
    data = slider({})
    data["bodies"]["block"]["points"]["Q"] = [1.0, 0]
    data["joints"]["guide"]["friction"] = 0.1
    data["joints"]["other"] = {"kind": "prismatic", "between": ["ground.O", "block.Q"]}
    with pytest.raises(IndeterminateFrictionError, match=r"friction \(F3\)"):
        md.solve(from_dict(data), "m")


def test_f4_events_that_crowd() -> None:
    """Less friction at rest than in motion: what starts at t = 0.2 cannot go on, ever again."""
    data = pushed("10*t")
    data["gravity"] = [0, -10.0]
    data["joints"]["guide"] |= {"friction": 0.4, "friction_static": 0.2}
    result = md.solve(from_dict(data), "m")
    (event,) = coded(result, "F4")
    assert (event["kind"], event["joints"]) == ("chatter", ["guide"])
    assert event["time"] == pytest.approx(0.2, abs=2e-6)
    assert event["count"] >= 20
    assert "(F4) of guide" in (result.fault or "")
    assert result.time[-1] == event["time"]
    assert result.joints["guide"].slide[-1] == pytest.approx(0.0, abs=1e-12)

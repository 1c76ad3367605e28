"""What a motion says about itself: S1 to S8 and F1 to F5, each provoked, with its numbers."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file.load import from_dict
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


# -- S: singular, redundant, inconsistent, infeasible ------------------------------------------


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
    # speeds grow like 1/sqrt(1 - t): behind the last states they are not met any more
    assert 1 - 1e-5 < result.time[-1] < event["time"]
    assert result.summary["drift_of_speeds"] <= 1e-9
    place = np.array([0.1 * np.cos(a) for a in result.bodies["crank"].angle])
    far = np.sqrt(0.09 - (0.1 * np.sin(result.bodies["crank"].angle)) ** 2)
    assert place + far == pytest.approx(0.34 + 0.06 * result.time, abs=1e-9)


def test_s4_before_the_first_time_of_output_keeps_a_state() -> None:
    data = slider_crank("0.34 + 0.06*t")
    data["tasks"]["m"] |= {"at": [1.5]}
    result = md.solve(from_dict(data), "m")
    assert coded(result, "S4")
    assert len(result.time) == 1
    assert 0 <= result.time[0] < 1


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


def test_no_s7_for_a_long_fall_and_a_long_way() -> None:
    """1e9 lengths and more: v = g t, and a block that just slides on."""
    fall = md.solve(from_dict(pushed("9.81", until=1e5)), "m")
    assert fall.fault is None
    assert fall.joints["guide"].slide[-1] == pytest.approx(9.81 * 1e10 / 2, rel=1e-12)
    on = md.solve(from_dict(pushed("0", until=1e7, start_speed={"guide.slide": 1e3})), "m")
    assert on.fault is None
    assert on.joints["guide"].slide[-1] == pytest.approx(1e10, rel=1e-12)


@pytest.mark.parametrize(("power", "end"), [(1, 1e3), (2, 300.0), (6, 20.0), (10, 8.0)])
def test_no_s7_for_powers_of_the_time(power: int, end: float) -> None:
    """x'' = power t^(power - 1): v = t^power doubles ever more slowly, which has a bound."""
    data = pushed(f"{power}*t**{power - 1}", until=end, poses=3, tolerance=1e-6)
    result = md.solve(from_dict(data), "m")
    assert result.fault is None
    speed = result.joints["guide"].slide_velocity
    assert speed[-1] == pytest.approx(end**power, rel=1e-6)


def test_no_s7_for_a_motion_that_begins_late() -> None:
    """At rest for 999 s, then 1 m/s^2: what the speed was at half the time tells nothing."""
    rows = [[0, 0], [999, 0], [1000, 1], [5000, 1]]
    table = {"kind": "table", "coordinate": "t", "along": "guide.slide", "rows": rows}
    result = md.solve(from_dict(slider({"F": table}, until=5e3, poses=2)), "m")
    assert result.fault is None
    late = 4000.0  # behind t = 1000 with x = 1/6 and v = 1/2
    assert result.joints["guide"].slide[-1] == pytest.approx(
        1 / 6 + late / 2 + late**2 / 2, rel=1e-10
    )


def test_no_s7_for_a_growth_that_ends() -> None:
    """v' = 10 v (1 - v/V), from 1e-6 to V = 1000: v = V/(1 + (V/v0 - 1) exp(-10 t))."""
    law = "10*guide.slide.speed*(1 - guide.slide.speed/1000)"
    data = pushed(law, start_speed={"guide.slide": 1e-6}, until=30.0, poses=31)
    result = md.solve(from_dict(data), "m")
    assert result.fault is None
    wanted = 1000 / (1 + (1e9 - 1) * np.exp(-10 * result.time))
    assert result.joints["guide"].slide_velocity == pytest.approx(wanted, rel=1e-5)


def test_s7_is_seen_early() -> None:
    """A motor with its sense turned round: before a hundred thousand steps, with its own energy."""
    result = md.solve("four-bar-motor", "curves", set={"w0": -30.0, "tol": 1e-7})
    (event,) = coded(result, "S7")
    assert (event["kind"], event["load"]) == ("unbounded", "motor")
    assert result.summary["steps"] < 3e4
    # T0 (1 + omega/30) over J of 2e-3 and more: no faster than exp(50 t)
    assert abs(event["speed"]) < 30 * math.exp(50 * event["time"])


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
    assert printed["time"][-1] == pytest.approx(1.0, abs=1e-5)
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


def test_f5_no_way_to_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """700 random pairs of guides at rest had a way; that none is left is put in by hand."""
    from mechdae.dynamics.watchers.sticking import Sticking

    monkeypatch.setattr(Sticking, "_fits", lambda *_: (False, -1.0))
    data = pushed("1.0")
    data["gravity"] = [0, -10.0]
    data["joints"]["guide"]["friction"] = 0.4
    result = md.solve(from_dict(data), "m")
    (event,) = coded(result, "F5")
    assert (event["kind"], event["joints"], event["time"]) == ("jammed", ["guide"], 0.0)
    assert "(F5) of guide" in (result.fault or "")


# -- in the middle of a motion -------------------------------------------------------------------


def rising(**task: Any) -> dict[str, Any]:
    """A block on two contacts L = 0.1 apart, mu = 0.4; a weight on it is lifted, 0.1 + 0.1 t.

    The common centre of mass is at 0.1 + 0.025 t above the guide: kappa = 2 mu h/L = 0.8 + 0.2 t.
    """
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0], "S": [5, 5]}},
        "bodies": {
            "block": {"points": {"A": [0, 0], "F": [0, 0.1]}, "mass": 1.5, "inertia": 0.01,
                      "center": [0, 0.1]},
            "weight": {"points": {"W": [0, 0]}, "mass": 0.5, "inertia": 0.01},
        },
        "joints": {
            "guide": {"kind": "prismatic", "between": ["ground.O", "block.A"],
                      "friction": 0.4, "contact_length": 0.1},
            "lift": {"kind": "prismatic", "between": ["block.A", "weight.W"], "axis_deg": 90},
        },
        "loads": {"push": {"kind": "force", "point": "block.F", "value": [10.0, 0]}},
        "tasks": {"m": {"kind": "motion", "until": 2.0, "tolerance": 1e-10,
                        "drivers": [{"coordinate": "lift.slide", "law": "0.1 + 0.1*t"}], **task}},
    }  # fmt: skip


@pytest.mark.parametrize("tolerance", [1e-4, 1e-10])
def test_f2_that_begins_in_a_motion_is_located(tolerance: float) -> None:
    """Pushed along: N = A/(1 + kappa) goes on through kappa = 1, a second one comes from infinity.

    x'' = (P - 2 mu N)/m with N = (h - p) P/(L (1 + kappa)), P = 10, p = 0.1, h = 0.1 + 0.025 t.
    """
    result = md.solve(from_dict(rising(start_speed={"guide.slide": 1.0}, tolerance=tolerance)), "m")
    (event,) = coded(result, "F2")
    assert event["time"] == pytest.approx(1.0, abs=1e-14)
    assert event["kappa"] == pytest.approx(1.0, abs=1e-8)
    assert result.status[-1] == "ambiguous"
    assert result.time[-1] == event["time"]
    nodes, weights = np.polynomial.legendre.leggauss(20)
    t = (1 + nodes) / 2
    slide = (10 - 0.8 * 10 * 0.025 * t / 0.1 / (1.8 + 0.2 * t)) / 2
    speed = 1 + float(np.sum(weights / 2 * slide))
    assert result.joints["guide"].slide_velocity[-1] == pytest.approx(speed, rel=1e-9)
    assert min(own["block.x"] for own in event["solutions"]) < -1e8
    assert max(own["block.x"] for own in event["solutions"]) == pytest.approx(4.5, rel=1e-9)


def test_f2_behind_a_reversal() -> None:
    """Against the push it stops first, where friction has no bound yet, and comes back."""
    result = md.solve(from_dict(rising(start_speed={"guide.slide": -5.0})), "m")
    kinds = [event["kind"] for event in result.events]
    assert kinds == ["reversal", "ambiguous"]
    assert result.events[-1]["time"] == pytest.approx(1.0, abs=1e-14)


def test_f1_that_begins_in_a_motion() -> None:
    """The weight is drawn at constant speed: the draw acts at h = 0.1 + 0.1 t above the guide.

    M = F h - 1 with F = 10 + 2 mu M/L: M (1 - 8 h) = 10 h - 1 has no bound at h = 1/8, t = 1/4.
    """
    data = rising()
    data["loads"]["push"]["value"] = [-10.0, 0]
    data["tasks"]["m"]["drivers"].append({"coordinate": "weight.W.x", "law": "t"})
    data["bodies"]["rod"] = {"points": {"S": [0, 0]}, "mass": 1.0, "inertia": 1.0,
                             "center": [0, -1]}  # fmt: skip
    data["joints"]["S"] = {"kind": "revolute", "between": ["ground.S", "rod.S"]}
    data["sketch"] = {"rod": 0.3}
    result = md.solve(from_dict(data), "m")
    (event,) = coded(result, "F1")
    assert event["time"] == pytest.approx(0.25, abs=1e-11)
    assert event["kappa"] == pytest.approx(1.0, abs=1e-6)
    assert (event["kind"], event["joints"]) == ("jammed", ["guide"])
    k = int(np.searchsorted(result.time, 0.1))
    h = 0.1 + 0.1 * result.time[k]
    moment = abs(result.joints["guide"].reaction[k, 2])
    assert moment == pytest.approx((10 * h - 1) / (1 - 8 * h), rel=1e-9)


def test_a_coupling_above_one_for_a_moment_is_not_stepped_over() -> None:
    """The weight goes up and down again: kappa = 1 + 2e-7 - 0.2 (t - 1)^2, above 1 for 2e-3 s."""
    lifted = "0.1 + 0.5*(0.2 + 2e-7 - 0.2*(t - 1)**2)"
    data = rising(start_speed={"guide.slide": 1.0}, tolerance=1e-6)
    data["tasks"]["m"]["drivers"][0]["law"] = lifted
    result = md.solve(from_dict(data), "m")
    (event,) = coded(result, "F2")
    assert event["time"] == pytest.approx(1 - 1e-3, abs=1e-9)


def test_a_start_from_rest_that_newtons_method_misses() -> None:
    """P = 8 at p = -0.06, h = 0.15, mu = 0.6: kappa = 1.8, and M = -(h - p) P + kappa |M|.

    It cannot stick, 2 mu |p| < L; it starts along the push with |M| = (h - p) P/(1 + kappa). The
    other size, (h - p) P/(kappa - 1), pushes back: from rest that is no start, and a block that
    slides already is left with both, F2.
    """
    problem = md.load("eccentric-slider")
    values = {"mu": 0.6, "h": 0.15, "p": -0.06, "P": 8.0, "side": 0.0}
    result = md.solve(problem.with_values(values), "motion")
    sizes = [0.21 * 8 / (1.8 - 1), 0.21 * 8 / (1 + 1.8)]
    wanted = [(8 - 2 * 0.6 * m / 0.1) / 2 for m in sizes]
    assert result.fault is None
    assert result.joints["guide"].slide_acceleration == pytest.approx(wanted[1], rel=1e-12)
    assert any("would move against its friction" in note for note in result.summary["notes"])
    moving = problem.with_values(values | {"side": 1.0})
    (event,) = [event for event in md.solve(moving, "motion").events if "code" in event]
    assert event["code"] == "F2"
    assert sorted(own["block.x"] for own in event["solutions"]) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("method", ["explicit", "bdf"])
def test_s7_more_steps_than_a_motion_may_take(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pendulum of ten thousand swings is left where a bound on its steps is met."""
    from mechdae.dynamics import run

    monkeypatch.setattr(run, "STEPS", 300)
    problem = md.load("pendulum")
    task = replace(problem.tasks["motion"], at=None, poses=11, until=1e4, method=method)
    result = md.solve(problem.mechanism, task)
    (event,) = coded(result, "S7")
    assert event["kind"] == "stalled"
    assert 0 < event["time"] < 1e4
    assert "more than 300 of them" in (result.fault or "")
    assert result.summary["steps"] + result.summary["rejected"] < 3000
    assert result.time[-1] == pytest.approx(event["time"])

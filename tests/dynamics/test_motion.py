"""Motion under forces against references of 34 digits and closed forms."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.errors import (
    AssemblyError,
    InconsistentStartError,
    InputError,
    SingularMassError,
    UnknownName,
)
from tests.reference.pendulums import passages
from tests.shared.paths import DATA


def reference(name: str, t: float) -> dict[str, Any]:
    data = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    return next(state for state in data["states"] if float(state["t"]) == t)


def floats(texts: Any) -> np.ndarray:
    return np.array([float(text) for text in texts])


def state(result: md.Result, names: str) -> tuple[np.ndarray, np.ndarray]:
    rows = np.array([result.summary["state"][name] for name in names.split()])
    return rows[:, 0], rows[:, 1]


ANGLES = "beta Theta gamma Phi delta Omega epsilon"


# -- the references --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tol", "digits", "most"), [(1e-6, 6, 60), (1e-9, 9, 100), (1e-12, 12, 300)]
)
def test_andrews_digits_and_steps(tol: float, digits: int, most: int) -> None:
    result = md.solve("andrews-squeezer", "motion", set={"tol": tol})
    q, _ = state(result, ANGLES)
    wanted = floats(reference("andrews", 0.03)["q"])
    assert np.max(np.abs(q - wanted) / np.abs(wanted)) <= 10.0**-digits
    assert result.summary["steps"] <= most
    assert result.summary["drift"] <= 1e-14
    assert (result.summary["coordinates"], result.summary["constraints"]) == (7, 6)
    assert result.fault is None


def test_andrews_multipliers_and_speeds() -> None:
    result = md.solve("andrews-squeezer", "motion", set={"tol": 1e-12})
    wanted = reference("andrews", 0.03)
    lam = np.array([result.summary["multipliers"][f"lam{i}"] for i in range(1, 7)])
    gap = np.abs(lam - floats(wanted["lam"])).max()
    assert gap <= 1e-11 * np.abs(floats(wanted["lam"])).max()
    _, v = state(result, ANGLES)
    assert np.max(np.abs(v - floats(wanted["v"]))) <= 1e-11 * 1425
    assert result.checks["energy"] <= 1e-11


def test_andrews_between_the_steps() -> None:
    """The dense output: states at times that are no steps."""
    problem = md.load("andrews-squeezer")
    task = md.Motion(start={"K1.angle": "beta0"}, at=[0.01, 0.02, 0.05], tolerance=1e-12)
    result = md.solve(problem.with_task("dense", task), "dense")
    assert result.time.tolist() == [0.01, 0.02, 0.05]
    for k, t in enumerate((0.01, 0.02, 0.05)):
        wanted = reference("andrews", t)
        q = np.array([result.outputs[name].value[k] for name in ANGLES.split()])
        lam = np.array([result.outputs[f"lam{i}"].value[k] for i in range(1, 7)])
        assert np.max(np.abs(q - floats(wanted["q"]))) <= 1e-11
        assert np.max(np.abs(lam - floats(wanted["lam"]))) <= 1e-10 * np.abs(lam).max()
    assert np.max(result.scalars.drift) <= 1e-14


@pytest.mark.parametrize(
    ("tol", "digits", "most"), [(1e-5, 6, 120), (1e-9, 9, 320), (1e-12, 12, 750)]
)
def test_car_axis_digits_and_steps(tol: float, digits: int, most: int) -> None:
    result = md.solve("car-axis", "motion", set={"tol": tol})
    q, _ = state(result, "xl yl xr yr")
    wanted = floats(reference("car_axis", 3.0)["q"])
    assert np.max(np.abs(q - wanted) / np.abs(wanted)) <= 10.0**-digits
    assert result.summary["steps"] <= most
    assert result.summary["drift"] <= 1e-14


def test_car_axis_multipliers() -> None:
    result = md.solve("car-axis", "motion", set={"tol": 1e-12})
    lam = np.array([result.summary["multipliers"][f"lam{i}"] for i in (1, 2)])
    wanted = floats(reference("car_axis", 3.0)["lam"])
    assert np.max(np.abs(lam - wanted)) <= 1e-11 * 10  # forces of the springs over L


@pytest.mark.parametrize("kind", ["regular", "chaotic"])
def test_double_pendulum(kind: str) -> None:
    result = md.solve("double-pendulum", kind, set={"tol": 1e-12})
    q, v = state(result, "x1 y1 x2 y2")
    wanted = reference(f"double_pendulum_{kind}", 10.0)
    assert np.max(np.abs(q - floats(wanted["q"]))) <= 1e-10
    assert np.max(np.abs(v - floats(wanted["v"]))) <= 1e-9
    assert np.max(np.abs(result.scalars.energy - result.scalars.energy[0])) <= 1e-9


def test_regular_double_pendulum_over_a_hundred_seconds() -> None:
    result = md.solve("double-pendulum", "regular", set={"tol": 1e-12, "t_end": 100.0})
    q, _ = state(result, "x1 y1 x2 y2")
    wanted = reference("double_pendulum_regular", 100.0)
    assert np.max(np.abs(q - floats(wanted["q"]))) <= 1e-9


def test_pendulum_keeps_energy_and_length() -> None:
    """As a point mass on a bar: both coordinates stay, and one constraint."""
    data = {
        "schema": 1,
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"bob": {"points": {"P": [0, 0]}, "mass": 1.0}},
        "joints": {"bar": {"kind": "distance", "between": ["ground.O", "bob.P"], "length": 1.0}},
        "sketch": {"bob.P.x": -1, "bob.P.y": 0},
        "tasks": {"m": {"kind": "motion", "at": [10.0, 100.0], "tolerance": 1e-12}},
    }
    result = md.solve(from_dict(data), "m")
    assert (result.summary["coordinates"], result.summary["constraints"]) == (2, 1)
    assert np.max(np.abs(result.scalars.energy)) <= 1e-9
    assert np.max(result.scalars.drift) <= 1e-15
    wanted = reference("iftomm_a01_pendulum", 10.0)
    place = result.points["bob.P"].position[0]
    assert np.max(np.abs(place - [float(wanted["x"]), float(wanted["y"])])) <= 1e-10
    force = result.joints["bar"].reaction[0]
    assert math.hypot(force[0], force[1]) == pytest.approx(float(wanted["tension"]), rel=1e-9)


# -- singular and redundant ------------------------------------------------------------------


def test_the_times_of_the_passages_are_those_of_the_reference() -> None:
    data = json.loads((DATA / "iftomm_a02_n40.json").read_text(encoding="utf-8"))
    assert passages(40, 2) == pytest.approx(floats(data["first_singular_times"]), abs=1e-14)


@pytest.mark.parametrize(("tol", "error"), [(1e-6, 1e-3), (1e-9, 5e-6), (1e-11, 5e-8)])
def test_ladder_passes_singular_poses(tol: float, error: float) -> None:
    result = md.solve("n-four-bar", "motion", set={"tol": tol})
    wanted = reference("iftomm_a02_n2", 10.0)
    q, _ = state(result, "B0x B0y")
    assert np.max(np.abs(q - [float(wanted["B0x"]), float(wanted["B0y"])])) <= error
    found = [event for event in result.events if event["kind"] == "singular"]
    assert len(found) == 10
    assert {event["rank_drop"] for event in found} == {2}
    if tol <= 1e-11:
        times = np.array([event["at"] for event in found])
        assert np.max(np.abs(times - passages(2, 10))) <= 1e-8


def test_ladder_from_random_starts() -> None:
    """The energy of the one angle stays, and all cranks parallel; `motion_long.py` has more."""
    draw = np.random.default_rng(2)
    problem = md.load("n-four-bar")
    for k in range(6):
        angle, speed = draw.uniform(0.2, 2.9), draw.uniform(-5, 5)
        tol = (1e-6, 1e-9, 1e-11)[k % 3]
        task = md.Motion(
            start={"crank0.angle": angle},
            start_speed={"crank0.angle": speed},
            at=[4.0],
            tolerance=tol,
        )
        result = md.solve(problem.with_task("m", task), "m")
        own = result.bodies["crank0"]
        energy = [
            3.0 * w**2 / 2 + 3.5 * 9.81 * math.sin(q)
            for q, w in ((angle, speed), (own.angle[0], own.angular_velocity[0]))
        ]
        assert abs(energy[1] - energy[0]) <= 1e3 * tol * max(1.0, abs(energy[0]))
        turned = [result.bodies[f"crank{k}"].angle[0] for k in (1, 2)]
        assert np.max(np.abs(turned - own.angle[0])) <= 1e-6
        assert result.fault is None


def test_more_loops() -> None:
    """The times of the passages tell the error of the motion before them."""
    result = md.solve("n-four-bar", "motion", set={"N": 12, "tol": 3e-10, "t_end": 1.5})
    assert (result.summary["coordinates"], result.summary["constraints"]) == (25, 24)
    times = np.array([event["at"] for event in result.events])
    assert np.max(np.abs(times - passages(12, 2))) <= 1e-8
    assert {event["rank_drop"] for event in result.events} == {12}


def test_beam_on_six_cranks() -> None:
    """24 equations of rank 20: what is unique of the forces is what equilibrium says."""
    result = md.solve("five-crank-parallelogram", "motion")
    assert result.summary["superfluous_equations"] == 4
    assert result.summary["freedoms"] == 1
    across = np.array([-math.sin(1.0), math.cos(1.0)])
    along = np.array([math.cos(1.0), math.sin(1.0)])
    for k in range(6):
        assert np.isnan(result.joints[f"beam{k}"].reaction).all()
        own = result.unique[f"beam{k}"]
        (direction,) = own["directions"]
        assert own["frame"] == f"crank{k}"
        assert direction == pytest.approx([0, 1, 0], abs=1e-12)
        assert own["values"][0, 0] == pytest.approx(-0.6625457025708068, rel=1e-11)
    (beam,) = [own for own in result.summary["unique_sums"] if own["body"] == "beam"]
    assert beam["force"][0] @ along == pytest.approx(25.52898216579279, rel=1e-11)
    assert beam["force"][0] @ across == pytest.approx(6 * -0.6625457025708068, rel=1e-11)
    assert all(value is None for value in result.summary["multipliers"].values())
    # theta(t) = pi and 2 pi: Taylor series with 25 digits
    times = [event["at"] for event in result.events if event["kind"] == "singular"]
    assert times == pytest.approx([1.342359313132415, 1.869098873140717], abs=1e-8)


def test_folding_slider_crank_finds_every_passage() -> None:
    for tol in (1e-8, 1e-10, 1e-11):
        result = md.solve("folding-slider-crank-motion", "motion", set={"tol": tol})
        assert [event["rank_drop"] for event in result.events] == [1] * 8
        q, _ = state(result, "theta slider_x")
        assert q[1] == pytest.approx(2 * math.cos(q[0]), abs=1e-9)


# -- scale -----------------------------------------------------------------------------------


LENGTHS = "xa ya xb yb xc yc rr ra d da ss sa sb sc sd e ea zt ta tb zf fa u ua ub l0".split()


@pytest.mark.parametrize(("length", "mass"), [(1e-6, 1e6), (1e3, 1e-6), (1e-6, 1e-6), (1e3, 1e6)])
def test_units_change_nothing(length: float, mass: float) -> None:
    """Lengths and masses of Andrews' mechanism scaled with its forces: the same motion."""
    problem = md.load("andrews-squeezer")
    base = md.solve(problem, "motion", set={"tol": 1e-10})
    values = problem.mechanism.values()
    changes = {name: values[name] * length for name in LENGTHS}
    changes |= {f"m{k}": values[f"m{k}"] * mass for k in range(1, 8)}
    changes |= {f"i{k}": values[f"i{k}"] * mass * length**2 for k in range(1, 8)}
    changes |= {"c0": values["c0"] * mass, "mom": values["mom"] * mass * length**2}
    other = md.solve(problem, "motion", set={**changes, "tol": 1e-10})
    assert other.summary["steps"] == base.summary["steps"]
    assert other.summary["rejected"] == base.summary["rejected"]
    gap = np.array(state(other, ANGLES)) - np.array(state(base, ANGLES))
    assert np.max(np.abs(gap[0])) <= 1e-12
    assert np.max(np.abs(gap[1])) <= 1e-12 * 1425
    assert other.summary["drift"] <= 1e-14


# -- agreement with the reactions of a sweep ---------------------------------------------------


def test_reactions_agree_with_those_of_a_sweep() -> None:
    """The multipliers of the motion and the balance of a given motion, by different code."""
    problem = md.load("andrews-squeezer")
    motion = md.solve(problem, "motion")
    k = len(motion.time) // 2
    crank = motion.bodies["K1"]
    driver = md.Driver(
        "K1.angle",
        at=[float(crank.angle[k])],
        speed=float(crank.angular_velocity[k]),
        acceleration=float(crank.angular_acceleration[k]),
    )
    sketch = {body: float(motion.bodies[body].angle[k]) for body in motion.bodies}
    from dataclasses import replace

    drawn = replace(problem, mechanism=replace(problem.mechanism, sketch=sketch))
    given = md.solve(drawn.with_task("r", md.Reactions(driver=driver)), "r")
    size = max(np.abs(motion.joints[name].reaction[k, :2]).max() for name in motion.joints)
    for name in motion.joints:
        gap = motion.joints[name].reaction[k] - given.joints[name].reaction[0]
        assert np.max(np.abs(gap[:2])) <= 1e-10 * size
    assert abs(given.efforts["K1.angle"][0]) <= 1e-10 * 0.033


# -- events and output -----------------------------------------------------------------------


def test_events_are_located() -> None:
    result = md.solve("pendulum", "curves", set={"tol": 1e-12})
    period = 2.36784194757623744930
    times = np.array([event["at"] for event in result.events])
    assert times == pytest.approx([(0.25 + k / 2) * period for k in range(4)], abs=1e-10)
    assert [event["direction"] for event in result.events] == ["up", "down", "up", "down"]


def test_an_event_stops_the_motion() -> None:
    problem = md.load("pendulum")
    events = [{"coordinate": "rod.angle.speed", "crosses": 0, "direction": "down", "stop": True}]
    task = md.Motion(start={"rod": 3.0}, until=10, tolerance=1e-12, events=events)
    result = md.solve(problem.with_task("m", task), "m")
    timed = md.Motion(start={"rod": 3.0}, at=[0.1, 10.0], tolerance=1e-12, events=events)
    other = md.solve(problem.with_task("m", timed), "m")
    assert other.time.tolist() == [0.1, other.events[-1]["at"]]
    assert other.events[-1]["at"] == pytest.approx(result.events[-1]["at"], abs=1e-12)
    assert result.events[-1]["kind"] == "crossing"
    assert result.time[-1] == result.events[-1]["at"]
    assert result.bodies["rod"].angle[-1] == pytest.approx(3 * math.pi - 3.0, abs=1e-11)


def test_order_of_event_location_and_output() -> None:
    """Errors of a located event and of states between steps follow the tolerance."""
    problem = md.load("pendulum")
    quarter = 2.36784194757623744930 / 4
    errors = []
    for tol in (1e-6, 1e-8, 1e-10):
        events = [{"coordinate": "rod.P.x", "crosses": 0, "stop": True}]
        task = md.Motion(start={"rod": math.pi}, until=2, tolerance=tol, events=events)
        result = md.solve(problem.with_task("m", task), "m")
        errors.append(abs(result.time[-1] - quarter))
    assert errors[0] <= 1e-6
    assert errors[1] <= 1e-8
    assert errors[2] <= 1e-10


def test_resistance_turns_with_the_motion() -> None:
    """A mass on a spring against a constant resistance F loses 2 F/k of its swing each time."""
    data = slider({"rub": {"kind": "resistance", "coordinate": "guide.slide",
                           "negative": 1.0, "positive": 1.0},
                   "spring": {"kind": "spring", "coordinate": "guide.slide",
                              "stiffness": 100.0}})  # fmt: skip
    data["tasks"]["m"] |= {"start": {"guide": {"slide": 0.1}}, "until": 10.0}
    result = md.solve(from_dict(data), "m")
    turns = result.events
    # 0.1 -> -0.08 -> 0.06 -> -0.04 -> 0.02 -> 0: then the spring holds less than F
    times = np.array([event["at"] for event in turns])
    assert times == pytest.approx(np.pi / 10 * np.arange(1, 6), abs=1e-9)
    assert [event["kind"] for event in turns] == ["reversal"] * 4 + ["stick"]
    assert result.fault is None
    assert result.summary["rests_from"] == times[-1]
    assert result.joints["guide"].slide[-1] == pytest.approx(0.0, abs=1e-9)
    assert result.work["rub"][-1] == pytest.approx(-0.5 * 100 * 0.1**2, rel=1e-9)


def slider(loads: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"block": {"points": {"P": [0, 0]}, "mass": 1.0, **more}},
        "joints": {"guide": {"kind": "prismatic", "between": ["ground.O", "block.P"]}},
        "loads": loads,
        "tasks": {"m": {"kind": "motion", "until": 1.0, "tolerance": 1e-11}},
    }


def test_motor_with_a_torque_speed_curve() -> None:
    """T (1 - w/w0) on a wheel: w = w0 (1 - exp(-T t/(I w0)))."""
    data = {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"wheel": {"points": {"O": [0, 0]}, "inertia": 2.0}},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "wheel.O"]}},
        "loads": {"motor": {"kind": "torque", "body": "wheel",
                            "value": "6*(1 - wheel.angle.speed/3)"}},
        "tasks": {"m": {"kind": "motion", "at": [0.5, 2.0], "tolerance": 1e-11}},
    }  # fmt: skip
    result = md.solve(from_dict(data), "m")
    wanted = 3 * (1 - np.exp(-result.time))
    assert result.bodies["wheel"].angular_velocity == pytest.approx(wanted, rel=1e-10)
    assert result.work["motor"] == pytest.approx(wanted**2, rel=1e-10)


def test_damped_spring() -> None:
    damper = {"kind": "spring", "coordinate": "guide.slide", "stiffness": 25.0, "damping": 2.0}
    data = slider({"spring": damper})
    data["tasks"]["m"] |= {"start": {"guide": {"slide": 1.0}}, "until": 3.0}
    result = md.solve(from_dict(data), "m")
    w = math.sqrt(24.0)
    t = result.time
    wanted = np.exp(-t) * (np.cos(w * t) + np.sin(w * t) / w)
    assert np.max(np.abs(result.joints["guide"].slide - wanted)) <= 1e-9
    assert np.all(np.diff(result.work["spring"]) <= 0)
    assert result.checks["energy"] <= 1e-9


def test_law_of_time_beside_free_coordinates() -> None:
    """A pendulum on a sled that follows a law: in the sled's frame g is (a, g)."""
    data = {
        "schema": 1,
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "sled": {"points": {"A": [0, 0]}, "mass": 3.0},
            "rod": {"points": {"A": [0, 0]}, "mass": 1.0, "center": [0, -1]},
        },
        "joints": {
            "guide": {"kind": "prismatic", "between": ["ground.O", "sled.A"]},
            "A": {"kind": "revolute", "between": ["sled.A", "rod.A"]},
        },
        "sketch": {"rod": 0},
        "tasks": {
            "m": {
                "kind": "motion",
                "drivers": [{"coordinate": "guide.slide", "law": "9.81*t**2/2"}],
                "start": {"rod": {"angle": -math.pi / 4}},
                "until": 2.0,
                "tolerance": 1e-11,
            }
        },
    }
    result = md.solve(from_dict(data), "m")  # hangs along the apparent gravity: stays
    assert np.max(np.abs(result.bodies["rod"].angle + math.pi / 4)) <= 1e-10
    # the sled is pushed by (3 + 1) a; the work is the kinetic energy of both
    assert result.work["drivers"][-1] == pytest.approx(4 * (9.81 * 2.0) ** 2 / 2, rel=1e-10)
    assert -result.summary["multipliers"]["guide.slide.law"] == pytest.approx(4 * 9.81, rel=1e-10)


# -- bad input -------------------------------------------------------------------------------


def test_contradictory_positions() -> None:
    problem = md.load("andrews-squeezer")
    task = md.Motion(start={"K1.angle": "beta0", "K3.angle": 0.6}, until=0.01)
    with pytest.raises(InconsistentStartError, match="contradict") as caught:
        md.solve(problem.with_task("m", task), "m")
    assert caught.value.residuals


def test_contradictory_speeds() -> None:
    problem = md.load("folding-slider-crank-motion")
    speeds = {"arm.angle": 1.0, "bar.angle": 1.0}
    task = md.Motion(start={"arm.angle": 0.7}, start_speed=speeds, until=0.01)
    with pytest.raises(InconsistentStartError, match="speeds given contradict"):
        md.solve(problem.with_task("m", task), "m")


def test_a_start_far_from_the_sketch_keeps_the_mode() -> None:
    problem = md.load("folding-slider-crank-motion")
    task = md.Motion(start={"arm.angle": 1.4}, until=0.01)
    result = md.solve(problem.with_task("m", task), "m")
    assert result.bodies["bar"].angle[0] == pytest.approx(-1.4, abs=1e-12)


def test_a_sketch_that_cannot_close() -> None:
    problem = md.load("car-axis").with_values({"L0": 0.5, "bar.length": 5.0})
    with pytest.raises((AssemblyError, InconsistentStartError)):
        md.solve(problem, "motion")


def test_a_body_without_mass_that_feels_a_force() -> None:
    data = slider({"push": {"kind": "force", "point": "block.P", "value": [1.0, 0]}})
    del data["bodies"]["block"]["mass"]
    with pytest.raises(SingularMassError, match=r"block\.x"):
        md.solve(from_dict(data), "m")


def test_friction_left_out_is_named() -> None:
    data = slider({})
    data["joints"]["guide"]["friction"] = 0.3
    data["tasks"]["m"]["friction"] = "none"
    result = md.solve(from_dict(data), "m")
    assert "friction of guide is left out" in result.summary["notes"][0]


def test_a_force_that_explodes_keeps_the_last_state() -> None:
    """x'' = x'^3 with x'(0) = 1: x' = (1 - 2 t)^(-1/2) ends at t = 1/2."""
    push = {"kind": "force", "point": "block.P", "value": ["guide.slide.speed**3", 0]}
    data = slider({"push": push})
    data["tasks"]["m"] |= {"start_speed": {"guide": {"slide": 1.0}}}
    result = md.solve(from_dict(data), "m")
    assert result.fault is not None
    assert "step size went to nothing" in result.fault
    assert result.time[-1] == pytest.approx(0.5, abs=1e-9)
    assert np.isfinite(result.points["block.P"].position).all()


@pytest.mark.parametrize(
    ("keys", "error", "text"),
    [
        ({"start": {"gide": {"slide": 1.0}}}, UnknownName, "gide"),
        ({"start": {"guide": {"slide": "width"}}}, UnknownName, "width"),
        ({"until": None}, InputError, "until"),
        ({"until": -1.0}, InputError, "above 0"),
        ({"tolerance": 1.0}, InputError, "tolerance"),
        ({"at": [0.2, 0.1]}, InputError, "grow"),
        ({"events": [{"crosses": 1}]}, InputError, "coordinate"),
        ({"events": [{"coordinate": "guide.slid"}]}, UnknownName, "slid"),
        ({"drivers": [{"coordinate": "guide.slide", "from": 0, "to": 1}]}, InputError, "law"),
    ],
)
def test_bad_keys_are_named(keys: dict[str, Any], error: type, text: str) -> None:
    data = slider({})
    data["tasks"]["m"] |= keys
    data["tasks"]["m"] = {k: v for k, v in data["tasks"]["m"].items() if v is not None}
    with pytest.raises(error, match=text):
        md.solve(from_dict(data), "m")


def test_too_many_laws() -> None:
    problem = md.load("folding-slider-crank-motion")
    drivers = (md.Driver("arm.angle", law="0.7 + t"), md.Driver("guide.slide", law="1.5 - t"))
    with pytest.raises(InconsistentStartError):
        md.solve(problem.with_task("m", md.Motion(drivers=drivers, until=0.1)), "m")


def test_a_motor_by_a_table_over_its_speed() -> None:
    """The same motor as a straight line in a table; it ends at the idle speed."""
    data = {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"wheel": {"points": {"O": [0, 0]}, "inertia": 2.0}},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "wheel.O"]}},
        "loads": {"motor": {"kind": "table", "coordinate": "wheel.angle.speed", "body": "wheel",
                            "rows": [[-1.0, 8.0], [1.0, 4.0], [4.0, -2.0]]}},
        "tasks": {
            "m": {"kind": "motion", "at": [0.5, 2.0], "tolerance": 1e-11},
            "r": {"kind": "reactions",
                  "driver": {"coordinate": "wheel.angle", "at": [0.0], "speed": 2.0}},
        },
    }  # fmt: skip
    problem = from_dict(data)
    result = md.solve(problem, "m")
    wanted = 3 * (1 - np.exp(-result.time))
    assert result.bodies["wheel"].angular_velocity == pytest.approx(wanted, rel=1e-9)
    assert md.solve(problem, "r").efforts["wheel.angle"][0] == pytest.approx(-2.0, rel=1e-13)
    data["loads"]["motor"]["coordinate"] = "wheel.angle.acceleration"
    with pytest.raises(InputError):
        from_dict(data)


@pytest.mark.parametrize(("damping", "stiff"), [(0.0, False), (1e2, False), (1e4, True)])
def test_a_stiff_damper_is_named(damping: float, stiff: bool) -> None:
    """A damper between the rods: trial steps that explode are not accepted, S6 names it."""
    data = {
        "schema": 1,
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "upper": {"points": {"O": [0, 0], "P": [0, -1]}, "mass": 1.0, "center": [0, -1]},
            "lower": {"points": {"P": [0, 0]}, "mass": 1.0, "center": [0, -1]},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "upper.O"]},
            "P": {"kind": "revolute", "between": ["upper.P", "lower.P"]},
        },
        "sketch": {"upper": 1.0, "lower": 0.5},
        "loads": {"damper": {"kind": "spring", "coordinate": "P.angle", "damping": damping}},
        "tasks": {"m": {"kind": "motion", "at": [0.2], "tolerance": 1e-8}},
    }
    result = md.solve(from_dict(data), "m")
    assert result.checks["energy"] <= 1e-8
    assert np.isfinite(result.bodies["lower"].angle).all()
    notes = " ".join(result.summary.get("notes", []))
    assert ("stiff (S6)" in notes and "load damper" in notes) == stiff
    assert result.summary["steps"] <= 2000


def test_a_table_that_ends_before_the_motion_does() -> None:
    table = {"kind": "table", "coordinate": "guide.slide", "along": "guide.slide",
             "rows": [[-0.1, 1.0], [0.2, 1.0]]}  # fmt: skip
    data = slider({"push": table})
    result = md.solve(from_dict(data), "m")
    assert result.fault is not None
    assert "the table of load push ends" in result.fault
    data["tasks"]["m"]["until"] = 0.6  # x = t^2/2 < 0.2
    assert md.solve(from_dict(data), "m").fault is None


def test_a_contact_that_leaves_its_curve() -> None:
    """A point mass slides down a parabola that ends at x = 0.5."""
    data = {
        "schema": 1,
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"bob": {"points": {"P": [0, 0]}, "mass": 1.0}},
        "joints": {"C": {"kind": "curve", "between": ["ground.O", "bob.P"], "x": "s",
                         "y": "s**2", "range": [-2.0, 0.5]}},
        "sketch": {"C": -1.0, "bob": 0},
        "tasks": {"m": {"kind": "motion", "until": 2.0, "tolerance": 1e-10}},
    }  # fmt: skip
    result = md.solve(from_dict(data), "m")
    assert result.fault is not None
    assert "the curve of joint C ends" in result.fault
    assert result.checks["energy"] <= 1e-8
    data["joints"]["C"]["range"] = [-2.0, 2.0]
    assert md.solve(from_dict(data), "m").fault is None


def test_a_force_without_a_value_at_the_start() -> None:
    push = {"kind": "force", "point": "block.P", "value": ["1/guide.slide", 0]}
    with pytest.raises(md.SolveError, match="not finite at the start"):
        md.solve(from_dict(slider({"push": push})), "m")

"""Reactions along a motion and those of a task of reactions: different code, the same numbers.

Both get the same pose, speeds and accelerations, the task by its driver. The driver has nothing
to do then.
"""

from __future__ import annotations

import copy
import tomllib
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared.paths import PROBLEMS

SPEEDS = ("angle", "angular_velocity", "angular_acceleration")


def heavy(name: str, mass: float, inertia: float, radius: float, rubs: list[str]) -> dict[str, Any]:
    """Return a predefined mechanism with masses, weights and friction in some joints."""
    data = tomllib.loads((PROBLEMS / f"{name}.toml").read_text(encoding="utf-8"))
    data.pop("expected")
    data |= {"tasks": {}, "loads": {}, "gravity": [0, -9.81]}
    for k, body in enumerate(data["bodies"].values()):
        body["mass"], body["inertia"] = mass * (1 + 0.3 * k), inertia * (1 + 0.2 * k)
        body["center"] = [0.01, 0.005]
    for joint, own in data["joints"].items():
        for key in ("friction", "mesh_loss", "pin_radius"):
            own.pop(key, None)
        if joint in rubs and own["kind"] in ("gear", "rack", "belt"):
            own["mesh_loss"] = 0.03
        elif joint in rubs:
            own["friction"] = 0.1
            if own["kind"] != "prismatic":
                own["pin_radius"] = radius
    return data


def given(data: dict[str, Any], motion: md.Result, k: int, names: list[str]) -> md.Result:
    """Return the reactions at the state k of a motion, its freedoms driven by bodies."""
    data = copy.deepcopy(data)
    data["sketch"] = {body: float(motion.bodies[body].angle[k]) for body in data["bodies"]}
    drivers = []
    for name in names:
        angle, speed, change = (float(motion.bodies[name][word][k]) for word in SPEEDS)
        drivers.append({"coordinate": f"{name}.angle", "at": [angle]})
        drivers[-1] |= {"speed": speed, "acceleration": change}
    key = {"driver": drivers[0]} if len(drivers) == 1 else {"drivers": drivers}
    data["tasks"] = {"r": {"kind": "reactions", **key}}
    return md.solve(from_dict(data), "r")


def differences(motion: md.Result, forces: md.Result, k: int) -> float:
    """Return the largest difference of a reaction over the largest force or moment."""
    assert forces.fault is None
    pairs = [(motion.joints[n].reaction[k], own.reaction[0]) for n, own in forces.joints.items()]
    force = max(np.abs(own[:2]).max() for _, own in pairs)
    moment = max(abs(own[2]) for _, own in pairs)
    worst = max(np.abs(found - own)[:2].max() / force for found, own in pairs)
    if moment:
        worst = max(worst, *(abs(found - own)[2] / moment for found, own in pairs))
    efforts = max(abs(effort[0]) for effort in forces.efforts.values())
    return float(max(worst, efforts / force))


CASES = {  # mass, inertia, radius of the pins, speeds at the start, end, joints that rub
    "jansen-leg": (0.2, 1e-4, 0.004, {"crank": 40.0}, 0.1, "O B Cu Ec"),
    "gorshkov-seven-link": (1.0, 1e-2, 0.01, {"crank": -8.0}, 0.14, "A slot BC guide"),
    "quick-return-pin": (1.0, 1e-2, 0.02, {"crank": 8.0}, 0.5, "O slot G"),
    "planetary-gear-train": (0.5, 1e-3, 0.005, {"sun": 50.0}, 0.1, ""),
    "planetary-gear-loads": (0.5, 1e-3, 0.005, {"sun": 50.0}, 0.1, "O_sun P mesh_sun mesh_ring"),
    "rack-and-pinion": (0.5, 1e-3, 0.004, {"crank": 20.0}, 0.2, "pin slide fixed top"),
    "belt-drive": (0.5, 1e-3, 0.004, {"motor": 20.0}, 0.2, "M open cross guide"),
    "geared-five-bar": (0.5, 1e-3, 0.004, {"crank": 20.0}, 0.2, ""),
    "differential": (0.5, 1e-3, 0.004, {"crank": 10.0, "wheel": 25.0}, 0.2, "A B mesh"),
}


@pytest.mark.parametrize("name", CASES)
def test_reactions_are_those_of_a_given_motion(name: str) -> None:
    mass, inertia, radius, speeds, until, rubs = CASES[name]
    data = heavy(name, mass, inertia, radius, rubs.split())
    if name == "belt-drive":
        data["joints"]["open"] |= {"radius": 0.03, "pretension": 200.0}
        data["joints"]["cross"] |= {"radius": 0.02}
    if name == "jansen-leg":  # a singular mass matrix
        for body in ("bar_f", "bar_k", "bar_j"):
            for key in ("mass", "inertia", "center"):
                del data["bodies"][body][key]
    task = {"kind": "motion", "until": until, "poses": 4, "tolerance": 1e-9}
    task["start_speed"] = {f"{body}.angle": speed for body, speed in speeds.items()}
    if name == "gorshkov-seven-link":
        task["start"] = {"crank": 0.6}
    motion = md.solve(from_dict({**data, "tasks": {"m": task}}), "m")
    assert motion.fault is None
    assert set(motion.status) == {"ok"}
    assert motion.checks["energy"] <= 1e-8
    lossy = {own for own in motion.work if own.startswith("friction.")}
    assert lossy == {f"friction.{joint}" for joint in rubs.split()}
    for k in (0, 1, 3):
        assert differences(motion, given(data, motion, k, list(speeds)), k) <= 1e-10


@pytest.mark.parametrize("name", ["coasting-slider-crank", "slider-crank-friction"])
def test_slider_cranks(name: str) -> None:
    """The slider-crank that coasts, and one whose connecting rod has no mass."""
    data = tomllib.loads((PROBLEMS / f"{name}.toml").read_text(encoding="utf-8"))
    data.pop("expected")
    if name == "slider-crank-friction":
        data["loads"] = {"push": {"kind": "torque", "body": "crank", "value": 2.0}}
        data["bodies"]["slider"]["mass"], data["bodies"]["crank"]["inertia"] = 1.5, 0.01
    data["tasks"] = {}
    task = {"kind": "motion", "until": 0.1, "poses": 5, "start": {"crank": 0.7},
            "start_speed": {"crank.angle": 15.0}}  # fmt: skip
    motion = md.solve(from_dict({**data, "tasks": {"m": task}}), "m")
    assert motion.fault is None
    for k in range(5):
        assert differences(motion, given(data, motion, k, ["crank"]), k) <= 1e-10


def test_a_differential_of_wheels_that_are_none_passes_its_torque_on() -> None:
    """Wheels whose centres move apart: no forces of teeth, as in a task of reactions."""
    data = {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "arm": {"points": {"O": [0, 0], "A": [1, 0]}, "mass": 1.0, "inertia": 0.3},
            "rod": {"points": {"A": [0, 0], "B": [1.5, 0]}, "mass": 1.0, "inertia": 0.2},
            "wheel": {"points": {"O": [0, 0]}, "inertia": 0.1},
            "far": {"points": {"B": [0, 0]}, "mass": 0.5, "inertia": 0.1},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "arm.O"]},
            "A": {"kind": "revolute", "between": ["arm.A", "rod.A"]},
            "W": {"kind": "revolute", "between": ["ground.O", "wheel.O"]},
            "B": {"kind": "revolute", "between": ["rod.B", "far.B"], "friction": 0.1,
                  "pin_radius": 0.02},
            "gear": {"kind": "gear", "between": ["wheel.O", "far.B"], "ratio": -2.0,
                     "mesh_loss": 0.03},
        },
        "sketch": {"arm": 0.3, "rod": 1.2, "wheel": 0.0},
        "gravity": [0, -9.81],
    }  # fmt: skip
    names = ["arm", "rod", "wheel"]
    task = {"kind": "motion", "until": 0.5, "poses": 3,
            "start_speed": {"arm.angle": 2.0, "rod.angle": -1.0, "wheel.angle": 4.0}}  # fmt: skip
    motion = md.solve(from_dict({**data, "tasks": {"m": task}}), "m")
    assert motion.fault is None
    assert any("gear" in note and "no bearing" in note for note in motion.summary["notes"])
    for k in range(3):
        assert differences(motion, given(data, motion, k, names), k) <= 1e-10


def test_what_is_unique_is_what_a_task_of_reactions_says() -> None:
    """A beam on six cranks: of its 24 reactions single directions and sums."""
    data = tomllib.loads((PROBLEMS / "five-crank-parallelogram.toml").read_text(encoding="utf-8"))
    data.pop("expected")
    data["tasks"]["motion"] |= {"until": 1.0, "poses": 4, "tolerance": 1e-11}
    motion = md.solve(from_dict(data), "motion")
    k = 2
    forces = given(data, motion, k, ["crank0"])
    assert motion.summary["not_unique"] == forces.summary["not_unique"] != []
    assert list(motion.unique) == list(forces.unique)
    for name, own in motion.unique.items():
        assert np.isnan(motion.joints[name].reaction).all()
        other = forces.unique[name]
        c, s = np.cos(motion.bodies["crank0"].angle[k]), np.sin(motion.bodies["crank0"].angle[k])
        (x, y, m), found = own["directions"][0], own["values"][k, 0]
        here = np.array([c * x - s * y, s * x + c * y, m])  # one pose stands still in the world
        sign = np.sign(here @ other["directions"][0])
        assert here == pytest.approx(sign * other["directions"][0], abs=1e-9)
        assert found == pytest.approx(sign * other["values"][0, 0], rel=1e-9)
    pairs = zip(motion.summary["unique_sums"], forces.summary["unique_sums"], strict=True)
    for own, other in pairs:
        assert (own["body"], own["joints"]) == (other["body"], other["joints"])
        assert own["force"][k] == pytest.approx(other["force"][0], rel=1e-9)
    plain = motion.to_dict()["joints"]["beam0"]
    assert plain["reaction"][k] == [None] * 3


def test_shares_of_superfluous_planets_are_open() -> None:
    """Two planets between sun and ring: which of them takes how much, rigid teeth do not tell."""
    teeth = {"kind": "gear", "carrier": "carrier"}
    bodies = {"sun": {"points": {"O": [0, 0]}, "inertia": 0.01},
              "carrier": {"points": {"O": [0, 0], "P0": [0.1, 0], "P1": [-0.1, 0]},
                          "inertia": 0.02}}  # fmt: skip
    joints = {
        "O_sun": {"kind": "revolute", "between": ["ground.O", "sun.O"]},
        "O_carrier": {"kind": "revolute", "between": ["ground.O", "carrier.O"]},
    }
    for k in (0, 1):
        bodies[f"p{k}"] = {"points": {"P": [0, 0]}, "mass": 0.2, "inertia": 1e-4}
        joints |= {
            f"P{k}": {"kind": "revolute", "between": [f"carrier.P{k}", f"p{k}.P"]},
            f"s{k}": {**teeth, "between": ["sun.O", f"p{k}.P"], "ratio": -1.0},
            f"r{k}": {**teeth, "between": ["ground.O", f"p{k}.P"], "ratio": 1 / 3},
        }
    data = {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": bodies,
        "joints": joints,
        "sketch": {"sun": 0.0, "carrier": 0.0},
        "loads": {"drive": {"kind": "torque", "body": "sun", "value": 2.0}},
        "tasks": {"m": {"kind": "motion", "until": 0.1, "poses": 3}},
    }
    motion = md.solve(from_dict(data), "m")
    assert motion.summary["superfluous_equations"] == 1
    lost = ["O_sun", "O_carrier", "P0", "s0", "r0", "P1", "s1", "r1"]
    assert sorted(motion.summary["not_unique"]) == sorted(lost)
    for name in lost:
        assert np.isnan(motion.joints[name].reaction[:, :2]).any()
    # kinetic energy over the sun's speed; the carrier has a quarter of it
    inertia = 0.01 + (0.02 + 2 * 0.2 * 0.01) / 16 + 2 * 1e-4 / 4
    assert motion.bodies["sun"].angular_acceleration == pytest.approx(2.0 / inertia, rel=1e-12)
    for joint in ("O_sun", "P0"):
        data["joints"][joint] |= {"friction": 0.1, "pin_radius": 0.01}
        with pytest.raises(md.IndeterminateFrictionError, match=joint):
            md.solve(from_dict(data), "m")
        del data["joints"][joint]["friction"]


@pytest.mark.parametrize(("rubs", "angle"), [("slot", 0.6), ("O slot G", 0.6), ("O slot G", 2.0)])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_pin_in_a_slot_sticks_until_its_effort_is_reached(
    rubs: str, angle: float, sense: float
) -> None:
    """A torque that grows; the start is where the coupled statics of either sense have it."""
    data = heavy("quick-return-pin", 1.0, 1e-2, 0.02, rubs.split())
    data["gravity"] = [3.0, -9.81]
    efforts = []
    for speed in (sense * 1e-9, -sense * 1e-9):
        driver = {"coordinate": "crank.angle", "at": [angle], "speed": speed}
        task = {"kind": "reactions", "driver": driver}
        one = md.solve(from_dict({**data, "tasks": {"r": task}}), "r")
        efforts.append(one.efforts["crank.angle"][0])
    wide = 0.9 * (efforts[0] - efforts[1])
    first, t = efforts[0] - wide, abs(wide) / 0.1
    data["loads"] = {"motor": {"kind": "torque", "body": "crank", "value": f"T0 + {sense}*0.1*t"}}
    data["parameters"]["T0"] = float(first)
    data["tasks"] = {"m": {"kind": "motion", "start": {"crank": angle}, "until": t + 0.3}}
    motion = md.solve(from_dict(data), "m")
    assert motion.fault is None
    start = motion.events[0]
    assert (start["kind"], start["joint"]) == ("slip", rubs.split()[0])
    assert start["at"] == pytest.approx(t, rel=1e-9)
    assert len([event for event in motion.events if event["kind"] == "slip"]) == 1
    moved = motion.bodies["crank"].angle
    assert moved[0] == angle
    assert (moved[-1] - angle) * sense > 0
    held = motion.joints["slot"].reaction[0]
    assert np.isfinite(held).all() == (rubs == "slot")  # one force of friction holds one freedom


def test_a_belt_that_goes_slack_is_a_fault() -> None:
    """The tension of the slack strand is the pretension less half of the difference."""
    data = {
        "schema": 1,
        "ground": {"points": {"O": [0, 0], "C": [0.2, 0]}},
        "bodies": {"one": {"points": {"O": [0, 0]}, "inertia": 0.02},
                   "two": {"points": {"C": [0, 0]}, "inertia": 0.05}},
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "one.O"]},
            "C": {"kind": "revolute", "between": ["ground.C", "two.C"]},
            "belt": {"kind": "belt", "between": ["one.O", "two.C"], "ratio": 2.0, "radius": 0.03,
                     "pretension": 40.0},
        },
        "sketch": {"one": 0.0},
        "loads": {"drive": {"kind": "torque", "body": "one", "value": "10*t"}},
        "tasks": {"m": {"kind": "motion", "until": 1.0, "poses": 11}},
    }  # fmt: skip
    result = md.solve(from_dict(data), "m")
    # torque on the second wheel I2 w2', with 2 w2' = w1' and 10 t = I1 w1' + I2 w2'/2
    force = 10 * result.time * 0.025 / (0.02 + 0.05 / 4) / 0.06
    sine = (0.03 - 0.06) / 0.2
    along = 2 * 40.0 * np.sqrt(1 - sine**2)
    assert result.joints["belt"].reaction[:, 2] == pytest.approx(0.06 * force, rel=1e-12, abs=1e-12)
    assert np.abs(result.joints["C"].reaction[:, 0]) == pytest.approx(along, rel=1e-12)
    across = np.abs(result.joints["C"].reaction[:, 1])
    assert across == pytest.approx(np.abs(sine) * force, rel=1e-12, abs=1e-12)
    first = result.time[np.flatnonzero(force > 80)[0]]
    assert f"belt belt goes slack, first at t = {first:.6g} s" in str(result.fault)
    assert f"{force[-1] / 2:.6g} N at least" in str(result.fault)

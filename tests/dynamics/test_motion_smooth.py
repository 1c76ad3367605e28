"""Smoothed dry friction in motion against quadratures of the smoothed law and its own bound."""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.errors import InputError

G = 9.81
SLOPE = math.radians(20)


def incline(v_s: float, **keys: Any) -> md.Result:
    problem = md.load("incline-block")
    task = dataclasses.replace(problem.tasks["motion"], friction="smooth", v_s=v_s, **keys)
    return md.solve(problem.with_task("m", task), "m")


def smoothed_way(v_s: float, end: float) -> float:
    """x(end) of x'' = -g sin - mu g cos tanh(x'/v_s), x' = 2 at first, from quadratures over x'.

    dt = dv/a and dx = v dv/a down to a speed a hair above the creeping one, which is reached
    exponentially with the slope there; nodes of Gauss and Legendre on pieces that get short.
    """
    drive, grip = G * math.sin(SLOPE), 0.5 * G * math.cos(SLOPE)
    creep = -v_s * math.atanh(drive / grip)
    nodes, weights = np.polynomial.legendre.leggauss(24)

    def rate(v: Any) -> Any:
        return -drive - grip * np.tanh(v / v_s)

    cuts = [2.0]
    while cuts[-1] - creep > 1e-7 * v_s:
        cuts.append(creep + (cuts[-1] - creep) * (0.8 if cuts[-1] > 30 * v_s else 0.93))
    t = x = 0.0
    for high, low in itertools.pairwise(cuts):
        v = (high + low) / 2 + (low - high) / 2 * nodes
        t += (low - high) / 2 * float(np.sum(weights / rate(v)))
        x += (low - high) / 2 * float(np.sum(weights * v / rate(v)))
    return x + creep * (end - t)


@pytest.mark.parametrize("v_s", [1e-2, 1e-3, 1e-4, 1e-6])
def test_incline_creeps_as_the_law_says(v_s: float) -> None:
    """9 v_s in 10 s: linear in v_s, and the printed bound is the creeping speed."""
    result = incline(v_s)
    slide = result.joints["guide"].slide
    assert slide[-1] == pytest.approx(smoothed_way(v_s, 10.0), abs=1e-9)
    stuck = 2.0**2 / (2 * G * (math.sin(SLOPE) + 0.5 * math.cos(SLOPE)))
    bound = v_s * math.atanh(math.tan(SLOPE) / 0.5)
    assert (stuck - slide[-1]) / v_s == pytest.approx(9.0, abs=0.05)
    assert 0 < stuck - slide[-1] <= 10 * bound
    found = result.summary["creep"]["guide"]
    assert found["bound"] == pytest.approx(bound, rel=1e-12)
    assert found["load"] == pytest.approx(G * math.sin(SLOPE), rel=1e-12)
    assert found["limit"] == pytest.approx(0.5 * G * math.cos(SLOPE), rel=1e-12)
    assert abs(result.joints["guide"].slide_velocity[-1]) <= bound * (1 + 1e-9)
    assert any("smooth friction of guide creeps" in note for note in result.summary["notes"])
    assert result.summary["method"] == "bdf, CVODES"
    assert result.summary["rhs"] <= 1600
    assert result.checks["energy"] <= 1e-9
    friction = result.joints["guide"].reaction[-1, :2] @ [math.cos(SLOPE), math.sin(SLOPE)]
    assert friction == pytest.approx(G * math.sin(SLOPE), rel=1e-9)


def test_creep_is_linear_in_the_slope_speed() -> None:
    ways = [incline(v_s).joints["guide"].slide[-1] for v_s in (1e-3, 2e-3, 4e-3)]
    assert ways[1] - ways[2] == pytest.approx(2 * (ways[0] - ways[1]), rel=2e-3)


def test_explicit_method_where_it_is_asked_for() -> None:
    result = incline(1e-2, method="explicit")
    assert result.joints["guide"].slide[-1] == pytest.approx(smoothed_way(1e-2, 10.0), abs=1e-8)


def test_pin_resistance_and_different_magnitudes() -> None:
    """A wheel with a friction circle and a resistance that is smaller in one sense.

    Both creep with one speed w: T = rho m g tanh(w/w1) + c tanh(w/w2).
    """
    data: dict[str, Any] = {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"wheel": {"points": {"O": [0, 0]}, "mass": 2.0, "inertia": 0.5}},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "wheel.O"],
                         "friction": 0.3, "pin_radius": 0.05}},
        "loads": {
            "motor": {"kind": "torque", "body": "wheel", "value": 0.4},
            "rub": {"kind": "resistance", "coordinate": "O.angle", "negative": 9.0,
                    "positive": 0.3},
        },
        "tasks": {"m": {"kind": "motion", "until": 5.0, "tolerance": 1e-9,
                        "friction": "smooth", "omega_s": 1e-3}},
    }  # fmt: skip
    result = md.solve(from_dict(data), "m")
    whole = 0.05 * 0.3 / math.sqrt(1.09) * 2.0 * G + 0.3
    speed = 1e-3 * math.atanh(0.4 / whole)
    assert result.bodies["wheel"].angular_velocity[-1] == pytest.approx(speed, rel=1e-7)
    found = result.summary["creep"]
    assert set(found) == {"O", "rub"}
    for name in found:
        assert found[name]["bound"] == pytest.approx(speed, rel=1e-9)
    assert found["rub"]["limit"] == pytest.approx(0.3, rel=1e-12)
    assert result.work["rub"][-1] < 0
    data["loads"]["motor"]["value"] = 2.0  # above the limit: it turns, and nothing creeps
    free = md.solve(from_dict(data), "m")
    assert free.summary["creep"] == {}
    assert free.bodies["wheel"].angular_velocity[-1] == pytest.approx(
        (2.0 - whole) / 0.5 * 5.0, rel=1e-3
    )


def test_a_mechanism_of_one_freedom_with_four_pairs() -> None:
    """Slider-crank under a torque it would hold: all pairs creep together, within their bounds."""
    pin = {"kind": "revolute", "friction": 0.3}
    data: dict[str, Any] = {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "crank": {"points": {"O": [0, 0], "B": [0.1, 0]}, "mass": 1.0, "inertia": 0.01},
            "rod": {"points": {"B": [0, 0], "C": [0.3, 0]}, "mass": 0.5, "inertia": 0.004},
            "slider": {"points": {"C": [0, 0]}, "mass": 2.0},
        },
        "joints": {
            "O": {**pin, "between": ["ground.O", "crank.O"], "pin_radius": 0.02},
            "B": {**pin, "between": ["crank.B", "rod.B"], "pin_radius": 0.015},
            "C": {**pin, "between": ["rod.C", "slider.C"], "pin_radius": 0.01},
            "slide": {"kind": "prismatic", "between": ["ground.O", "slider.C"], "friction": 0.2},
        },
        "sketch": {"crank_deg": 60, "rod_deg": -15},
        "loads": {"motor": {"kind": "torque", "body": "crank", "value": 0.5}},
        "tasks": {"m": {"kind": "motion", "start": {"crank": 1.0}, "until": 2.0, "poses": 41,
                        "tolerance": 1e-9, "friction": "smooth", "v_s": 1e-5}},
    }  # fmt: skip
    result = md.solve(from_dict(data), "m")
    assert result.fault is None
    found = result.summary["creep"]
    assert set(found) == {"O", "B", "C", "slide"}
    crank, rod = (result.bodies[name].angular_velocity for name in ("crank", "rod"))
    slide = result.joints["slide"].slide_velocity
    speeds = {"O": crank, "B": rod - crank, "C": rod, "slide": slide}
    for name, series in speeds.items():
        assert np.max(np.abs(series)) <= found[name]["bound"] * (1 + 1e-6)
        assert np.max(np.abs(series)) >= 0.5 * found[name]["bound"]
    # virtual power of the loads at the last state: friction, torque, weight of the rod at B
    shares = {
        name: math.tanh(series[-1] * (1e5 if name == "slide" else 1e5 * radius))
        for (name, series), radius in zip(speeds.items(), (0.02, 0.015, 0.01, 0), strict=True)
    }
    lost = sum(found[n]["limit"] * shares[n] * speeds[n][-1] for n in speeds)
    put = 0.5 * crank[-1] - 0.5 * G * result.points["rod.B"].velocity[-1][1]
    assert lost == pytest.approx(put, rel=2e-3)  # limits are those of the state of largest creep


def test_two_solutions_are_a_verdict_with_smooth_friction_too() -> None:
    problem = md.load("eccentric-slider")
    for side, code in ((1, "F2"), (-1, "F1")):
        task = dataclasses.replace(problem.tasks["motion"], friction="smooth", v_s=1e-3)
        own = problem.with_task("m", task).with_values({"mu": 0.4, "side": side})
        result = md.solve(own, "m")
        assert [event["code"] for event in result.events] == [code]
        assert result.fault is not None


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"friction": "smooth"}, "guide needs 'v_s'"),
        ({"friction": "smooth", "v_s": 0.0}, "above 0"),
        ({"friction": "smooth", "omega_s": 1.0}, "guide needs 'v_s'"),
        ({"v_s": 1e-3}, "belongs to friction"),
    ],
)
def test_keys_of_smooth_friction(keys: dict[str, Any], text: str) -> None:
    problem = md.load("incline-block")
    task = dataclasses.replace(problem.tasks["motion"], **keys)
    with pytest.raises(InputError, match=text):
        md.solve(problem.with_task("m", task), "m")

"""Blocks between stops, drawn at random, beside their flights in closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.dynamics.contacts import impacts

G, UNTIL = 9.81, 2.0
SLOW = 1e-3
"""Speed of an impact [m/s] at which the closed form ends."""


def hits(result: md.Result, kind: str = "impact") -> list[float]:
    return [event["at"] for event in result.events if event["kind"] == kind]


def ball(e: float, until: float, **more: Any) -> dict[str, Any]:
    """A ball of 2 kg above a floor, let go at a height of 1 m."""
    return {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"ball": {"points": {"P": [0, 0]}, "mass": 2}},
        "joints": {
            "floor": {"kind": "prismatic", "between": ["ground.O", "ball.P"],
                      "axis": math.pi / 2, "limits": [0, 10], "restitution": e}
        },
        "tasks": {"m": {"kind": "motion", "start": {"floor": 1}, "until": until, **more}},
    }  # fmt: skip


def rubbing_slope(slope: float, mu: float, e: float, until: float, **more: Any) -> dict[str, Any]:
    """The ball on a slope with friction in its guide, let go 1 m above its stop."""
    data = ball(e, until, tolerance=1e-12, **more)
    data["joints"]["floor"] |= {"axis": slope, "friction": mu}
    return data


def carriage(
    masses: Any, limits: tuple[list[float], list[float]], e: Any, **more: Any
) -> dict[str, Any]:
    """A block between walls, and a second one between stops of the first."""
    names, slots = ("one", "two"), ("wall", "slot")
    between = (["ground.O", "one.P"], ["one.P", "two.P"])
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            name: {"points": {"P": [0, 0]}, "mass": float(mass)}
            for name, mass in zip(names, masses, strict=True)
        },
        "joints": {
            name: {"kind": "prismatic", "between": pair, "limits": ends, "restitution": float(r)}
            for name, pair, ends, r in zip(slots, between, limits, e, strict=True)
        },
        "tasks": {"m": {"kind": "motion", "until": UNTIL, "tolerance": 1e-12, **more}},
    }


def wheel_and_rack(**more: Any) -> dict[str, Any]:
    """A wheel of 0.01 kg m^2 and 0.1 m, and a rack of 2 kg, with a play of 2 mm."""
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "wheel": {"points": {"O": [0, 0]}, "mass": 1, "inertia": 0.01},
            "rack": {"points": {"P": [0, 0]}, "mass": 2},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "wheel.O"]},
            "guide": {"kind": "prismatic", "between": ["ground.O", "rack.P"]},
            "mesh": {"kind": "rack", "between": ["wheel.O", "rack.P"], "radius": 0.1,
                     "backlash": 2e-3, "restitution": 0.8},
        },
        "tasks": {"m": {"kind": "motion", "clearance": "contact", "until": 0.1, **more}},
    }  # fmt: skip


def turned_rack() -> dict[str, Any]:
    """The rack above its wheel, pressed by a torque 1 - 2 t, then by its other flank."""
    data = wheel_and_rack(until=0.75, tolerance=1e-12, start={"wheel": 0.0, "guide": 1e-3})
    data["loads"] = {"T": {"kind": "torque", "body": "wheel", "value": "1 - 2*t"}}
    data["joints"]["mesh"] |= {"radius": -0.1, "restitution": 0.0}
    return data


def along_teeth(torque: Any) -> Any:
    """Return the force that a torque on the wheel leaves for the rack, along it."""
    return -torque / 0.1 * 2 / (2 + 0.01 / 0.1**2)


def disc(e: float, speed: float, until: float) -> dict[str, Any]:
    """A disc on a pin in a bush of the ground with a clearance of 1 mm, its centre off by half."""
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"disc": {"points": {"P": [0, 0]}, "mass": 3, "inertia": 0.02}},
        "joints": {"A": {"kind": "revolute", "between": ["ground.O", "disc.P"],
                         "clearance": 1e-3, "restitution": e}},
        "tasks": {"m": {"kind": "motion", "clearance": "contact", "until": until,
                        "tolerance": 1e-12, "start": {"disc.P.x": 5e-4, "disc.P.y": 0.0},
                        "start_speed": {"disc.P.x": 0.0, "disc.P.y": speed}}},
    }  # fmt: skip


def single_impacts() -> tuple[list[float], list[float]]:
    """Return speeds at a wall and in a slot behind single impacts, and those of closed form.

    A mass of 2 that touches the wall is hit by one of 1 in its slot, the wall by it, and both hit
    once more: impulses are (1 + e) times the speed over the sum of inverse masses.
    """
    G = np.array([[1 / 2, -1 / 2], [-1 / 2, 3 / 2]])
    speeds = impacts.orders(G, np.array([0.0, -1.0]), np.array([0.8, 0.3]))
    away, closing = 0.8 * 1.3 / 3, 1.8 * 1.3 / 3 - 0.3
    return np.ravel(speeds).tolist(), [away - 1.3 / 3 * closing, 0.3 * closing]


def _landing(x: float, v: float, a: float, low: float, high: float) -> tuple[float, float, float]:
    """Return when x + v t + a t^2/2 comes to a stop first, which, and the speed there."""
    found = []
    for stop in (low, high):
        roots = np.roots([a / 2, v, x - stop]) if a else np.array([(stop - x) / v if v else np.inf])
        for t in np.real(roots[np.abs(np.imag(roots)) == 0]).tolist():
            speed = v + a * t
            if t > 1e-9 and (speed > 0) == (stop == high):
                found.append((t, stop, speed))
    return min(found)


def one_block(draw: np.random.Generator) -> tuple[int, float, float]:
    """Return impacts, the largest error of their times and of the energy lost, a share."""
    e, slope, mass = draw.uniform(0.3, 1.0), draw.uniform(-1.5, 1.5), draw.uniform(0.1, 9)
    low, high = -draw.uniform(0.1, 1.0), draw.uniform(0.1, 1.0)
    x, v = draw.uniform(0.9 * low, 0.9 * high), draw.uniform(-3, 3)
    data = ball(e, UNTIL, start={"floor": x}, start_speed={"floor": v}, tolerance=1e-12)
    data["bodies"]["ball"]["mass"] = mass
    data["joints"]["floor"] |= {"axis": slope, "limits": [low, high]}
    result = md.solve(from_dict(data), "m")
    a, t, expected = -G * math.sin(slope), 0.0, list[float]()
    for _ in range(10_000):
        step, stop, speed = _landing(x, v, a, low, high)
        if t + step > UNTIL or abs(speed) < SLOW:
            break
        t, x, v = t + step, stop, -e * speed
        expected.append(t)
    return _compared(result, expected)


def two_blocks(draw: np.random.Generator) -> tuple[int, float, float]:
    """The same of two masses that hit each other and the walls, without gravity."""
    masses, width = draw.uniform(0.2, 3.0, 2), draw.uniform(0.05, 0.4)
    e = draw.uniform(0.5, 1.0, 2)
    x = np.array([draw.uniform(0.2, 0.8), draw.uniform(-0.9, 0.9) * width])
    v = draw.uniform(-2, 2, 2)  # of the first block, and of the second one in it
    lows, highs = np.array([0.0, -width]), np.array([1.0, width])
    names = ("wall", "slot")
    start = {"start": dict(zip(names, x.tolist(), strict=True))}
    start["start_speed"] = dict(zip(names, v.tolist(), strict=True))
    data = carriage(masses, ([0.0, 1.0], [-width, width]), e, poses=2, **start)
    result = md.solve(from_dict(data), "m")
    t, expected = 0.0, list[float]()
    for _ in range(60):
        ends = np.where(v > 0, highs, lows)
        left = np.where(v != 0, (ends - x) / np.where(v != 0, v, 1.0), np.inf)
        which = int(np.argmin(left))
        if t + left[which] > UNTIL or abs(v[which]) < SLOW:
            break
        t, x = t + left[which], x + v * left[which]
        expected.append(t)
        x[which] = ends[which]
        if which == 0:
            v = np.array([-e[0] * v[0], (1 + e[0]) * v[0] + v[1]])
        else:  # the momentum of both stays
            change = masses[1] / masses.sum() * (1 + e[1]) * v[1]
            v = np.array([v[0] + change, -e[1] * v[1]])
    return _compared(result, expected)


def _compared(result: md.Result, expected: list[float]) -> tuple[int, float, float]:
    found = np.array(hits(result)[: len(expected)])
    assert len(found) == len(expected)
    apart = float(np.abs(found - expected).max(initial=0.0))
    return len(expected), apart, result.checks["energy"]

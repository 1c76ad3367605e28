"""Mechanisms of vector loops beside bodies, and the laws of Newton and Euler for each body."""

from __future__ import annotations

from typing import Any

import numpy as np

import mechdae as md

ROD = {
    "arm": {"from": "crank.A", "to": "crank.B"},
    "rod": {"length": 0.3},
    "off": {"from": "ground.A", "to": "ground.S"},
    "slide": {"elevation_deg": 10, "azimuth_deg": 5},
}


def linkage(friction: float = 0.0, **more: Any) -> dict[str, Any]:
    """Return a crank, a rod and a guide as vectors, and on their node a link to a rocker."""
    slide = ROD["slide"] | ({"friction": friction} if friction else {})
    press = {"coordinate": "A.angle", "at": [0.2, 1.7, 4.0], "speed": 10, "acceleration": 7}
    data: dict[str, Any] = {
        "schema": 1,
        "title": "crank, vectors, link and rocker",
        "dimension": 3,
        "gravity": [0, 0, -9.81],
        "ground": {"points": {"A": [0, 0, 0], "S": [0.05, 0.03, 0.02], "E": [0.35, 0.3, 0.1]}},
        "bodies": {
            "crank": {"points": {"A": [0, 0, 0], "B": [0.05, 0, 0.01]}, "mass": 0.8,
                      "center": [0.02, 0.003, 0.001],
                      "inertia": [1e-4, 4e-4, 3e-4, 1e-5, 2e-5, -1e-5]},
            "C": {"mass": 0.6},
            "link": {"points": {"P": [0, 0, 0], "Q": [0.25, 0, 0]}, "mass": 0.5,
                     "center": [0.1, 0.01, -0.02], "inertia": [1e-4, 1e-3, 2e-3]},
            "rocker": {"points": {"E": [0, 0, 0], "Q": [0.15, 0, 0]}, "mass": 0.9,
                       "center": [0.08, 0, 0.01], "inertia": [1e-4, 5e-4, 5e-4]},
        },
        "joints": {
            "A": {"kind": "revolute", "between": ["ground.A", "crank.A"], "axis": [0.2, 0.1, 1]},
            "tie": {"kind": "spherical", "between": ["rod.head", "link.P"]},
            "Q": {"kind": "universal", "between": ["rocker.Q", "link.Q"], "axis": [0, 0, 1],
                  "axis2": [0, 1, 0]},
            "E": {"kind": "revolute", "between": ["ground.E", "rocker.E"], "axis": [0.1, 0.2, 1]},
        },
        "vectors": {**ROD, "slide": slide},
        "loops": {"closure": ["arm", "rod", "-slide", "-off"]},
        "nodes": {"C": {"at": "rod.head"}},
        "loads": {"push": {"kind": "force", "point": "C.C", "value": [3, -4, 5]},
                  "turn": {"kind": "torque", "body": "link", "value": [0.1, 0.2, -0.3]}},
        "sketch": {"A_deg": 0, "slide.length": 0.3, "rocker.Q": [0.38, 0.18, 0.1], "Q.angle": 2.6,
                   "Q.angle2": -0.25},
        "tasks": {
            "press": {"kind": "reactions", "driver": press},
            "turn": {"kind": "sweep", "driver": press},
            "fall": {"kind": "motion", "start": {"A.angle": 0.3}, "start_speed": {"A.angle": 4.0},
                     "at": [0, 0.1, 0.2], "tolerance": 1e-12},
            "rest": {"kind": "equilibrium"},
        },
    }  # fmt: skip
    return data | more


def hanging() -> dict[str, Any]:
    """Return a crank that carries a vector of given direction, and a rough guide on its end."""
    press = {"coordinate": "A.angle", "at": [0.1, 0.6, 1.2], "speed": 10, "acceleration": 7}
    return {
        "schema": 1,
        "title": "vectors that a crank carries",
        "dimension": 3,
        "gravity": [0, 0, -9.81],
        "ground": {"points": {"A": [0, 0, 0]}},
        "bodies": {
            "crank": {"points": {"A": [0, 0, 0], "B": [0.2, 0, 0.01]}, "mass": 0.8,
                      "center": [0.02, 0.003, 0.001], "inertia": [1e-4, 4e-4, 3e-4]},
            "N": {"mass": 1.5},
            "M": {"mass": 0.4},
        },
        "joints": {
            "A": {"kind": "revolute", "between": ["ground.A", "crank.A"], "axis": [0.2, 0.1, 1]}
        },
        "vectors": {
            "arm": {"from": "crank.A", "to": "crank.B"},
            "hang": {"length": 0.1, "elevation_deg": -30, "azimuth_deg": 20},
            "carried": {"elevation_deg": 40, "azimuth_deg": 100, "friction": 0.1},
            "tie": {"length": 0.35},
            "up": {"length": 0.2, "elevation_deg": 80, "azimuth_deg": 70},
        },
        "loops": {"one": ["arm", "hang", "carried", "-tie", "-up"]},
        "nodes": {"N": {"at": "hang.head"}, "M": {"at": "carried.head"}},
        "sketch": {"A_deg": 0, "carried.length": 0.3},
        "tasks": {
            "press": {"kind": "reactions", "driver": press},
            "fall": {"kind": "motion", "start": {"A.angle": 0.3}, "start_speed": {"A.angle": 4.0},
                     "at": [0, 0.05, 0.1], "tolerance": 1e-12},
        },
    }  # fmt: skip


def turn(e: Any) -> Any:
    w, v = e[0], np.asarray(e[1:])
    cross = np.cross(np.eye(3), v)
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def gaps(result: md.Result, mechanism: md.Mechanism, k: int) -> dict[str, float]:
    """Return what is left of Newton's and Euler's laws of each body at a pose, by its weight.

    Places, rates and reactions are those of the result, forces and moments are summed here.
    """
    values, gravity = mechanism.values(), np.array(mechanism.gravity, dtype=float)

    def place(reference: str) -> Any:
        if reference.startswith("ground."):
            return np.array([values[f"{reference}.{axis}"] for axis in "xyz"])
        return result.points[reference].position[k]

    found = {}
    for name, body in mechanism.bodies.items():
        first, mass = f"{name}.{next(iter(body.points))}", values.get(f"{name}.mass", 0.0)
        origin, a = place(first), result.points[first].acceleration[k]
        force, moment, turns = np.zeros(3), np.zeros(3), name in result.bodies
        acting: list[tuple[Any, Any, Any]] = []
        if turns:
            own = result.bodies[name]
            R, w, rate = (
                turn(own.orientation[k]), own.angular_velocity[k], own.angular_acceleration[k],
            )  # fmt: skip
            centre = np.array([values.get(f"{name}.center.{axis}", 0.0) for axis in "xyz"])
            arm = R @ (centre - [values[f"{first}.{axis}"] for axis in "xyz"])
            a = a + np.cross(rate, arm) + np.cross(w, np.cross(w, arm))
            xx, yy, zz, xy, xz, yz = (
                values.get(f"{name}.inertia.{word}", 0.0)
                for word in ("xx", "yy", "zz", "xy", "xz", "yz")
            )
            J = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
            acting.append((origin + arm, mass * (gravity - a), -J @ rate - np.cross(w, J @ w)))
        else:
            acting.append((origin, mass * (gravity - a), np.zeros(3)))
        for joint in mechanism.joints.values():
            reaction = result.joints[joint.name].reaction[k]
            for end, sense in ((joint.second, 1.0), (joint.first, -1.0)):
                if end.split(".")[0] == name:
                    at = end if joint.pointer else joint.second
                    acting.append((place(at), sense * reaction[:3], sense * reaction[3:]))
        for load in mechanism.loads.values():
            if load.kind == "force" and load.point.split(".")[0] == name:
                acting.append((place(load.point), np.array(load.value, float), np.zeros(3)))
            if load.kind == "torque" and load.body == name:
                acting.append((origin, np.zeros(3), np.array(load.value, float)))
        for at, own_force, own_moment in acting:
            force = force + own_force
            moment = moment + own_moment + np.cross(at - origin, own_force)
        if name == "crank" and "A.angle" in result.efforts:
            axis = np.array(mechanism.joints["A"].axis, dtype=float)
            moment = moment + result.efforts["A.angle"][k] * axis / np.linalg.norm(axis)
        found[name] = float(np.abs(force).max() / 9.81)
        if turns:
            found[f"{name} turning"] = float(np.abs(moment).max() / (9.81 * mechanism.scale))
    return found

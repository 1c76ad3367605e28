"""Friction of pairs in space written down once more, and mechanisms that have it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.values import Table
from tests.shared.spatial_forces import orientation_of_axis


def rubbing(mechanism: md.Mechanism, **keys: Any) -> md.Mechanism:
    """Return the mechanism with more keys of joints by name."""
    joints = {n: replace(j, **keys.get(n, {})) for n, j in mechanism.joints.items()}
    return replace(mechanism, joints=Table(joints))


def rubbed(result: md.Result, name: str, wrench: Any, k: int) -> Any:
    """Return the friction (6,) on a joint's second body for its reaction, at pose k."""
    joint = result.mechanism.joints[name]
    F, M = wrench[:3], wrench[3:]
    f, own, zero = joint.friction, result.joints[name], np.zeros(3)
    if joint.kind == "spherical":
        spins = [
            np.zeros(3) if body == "ground" else result.bodies[body].angular_velocity[k]
            for body in (joint.first_body, joint.second_body)
        ]
        spin, line = spins[1] - spins[0], F / np.linalg.norm(F)
        sliding = spin - (spin @ line) * line
        rho = joint.ball_radius * f / np.sqrt(1 + f**2)
        moment = rho * np.linalg.norm(F) * sliding / np.linalg.norm(sliding)
        return np.concatenate([zero, -moment])
    axes = [axis / np.linalg.norm(axis) for axis in orientation_of_axis(result, joint, k)]
    if joint.kind == "universal":
        speeds = (own.angle_velocity[k], own.angle2_velocity[k])
        pins = zip(axes, speeds, strict=True)
        return sum(_bearing(joint, a, F, M, speed) for a, speed in pins)
    a = axes[0]
    if joint.kind == "screw":  # the wedge that its thread is
        lead = joint.pitch / (2 * np.pi)
        slope = np.arctan2(lead, joint.thread_radius)
        N = (F @ a) * np.cos(slope) - (M @ a) / joint.thread_radius * np.sin(slope)
        back = -np.sign(own.angle_velocity[k]) * f * abs(N)
        turn = back * joint.thread_radius * np.cos(slope) * a
        return np.concatenate([back * np.sin(slope) * a, turn])
    if joint.kind == "revolute":
        return _bearing(joint, a, F, M, own.angle_velocity[k])
    N = _planes(joint, a, F, M)
    v, u = own.slide_velocity[k], joint.pin_radius * own.angle_velocity[k]
    speed = np.hypot(v, u)
    size = f * N / np.sqrt(1 + (f * u / speed) ** 2)
    return -size * np.concatenate([v / speed * a, joint.pin_radius * u / speed * a])


def _planes(joint: Any, a: Any, F: Any, M: Any) -> float:
    """Return |N1| + |N2| of a bearing."""
    across, tilt = F - (F @ a) * a, np.cross(a, M)
    if joint.contact_length is None:
        return float(np.linalg.norm(across))
    both = (across / 2 + s * tilt / joint.contact_length for s in (-1, 1))
    return sum(float(np.linalg.norm(each)) for each in both)


def _bearing(joint: Any, a: Any, F: Any, M: Any, speed: float) -> Any:
    f = joint.friction
    moment = joint.pin_radius * f / np.sqrt(1 + f**2) * _planes(joint, a, F, M)
    if joint.collar_radius is not None:
        moment += f * joint.collar_radius * abs(F @ a)
    return np.concatenate([np.zeros(3), -np.sign(speed) * moment * a])


def jack(
    f: float, radius: float = 0.02, pitch: float = 0.006, spindle: Any = None, table: Any = None
) -> md.Mechanism:
    """Return a screw in the ground that lifts a guided body of 1000 N; more keys of both."""
    axis = {"axis": [0, 0, 1]}
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"N": [0, 0, 0], "G": [0.05, 0, 0]}),
        bodies=[
            md.Body("spindle", {"N": [0, 0, 0], "R": [0, 0, 0.1]}, **(spindle or {})),
            md.Body("table", {"R": [0, 0, 0], "G": [0.05, 0, -0.1]}, **(table or {})),
        ],
        joints=[
            md.Screw(
                "nut",
                "ground.N",
                "spindle.N",
                **axis,
                pitch=pitch,
                friction=f,
                thread_radius=radius,
            ),
            md.SpatialRevolute("R", "table.R", "spindle.R", **axis),
            md.SpatialPrismatic("G", "ground.G", "table.G", **axis),
        ],
        loads=[md.Force("weight", "table.R", [0, 0, -1000])],
        sketch={"nut": 0},
    )

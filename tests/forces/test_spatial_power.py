"""The theorem of power in space, at all scales: effort and loads work as much as motion gains.

dT/dt = sum of m v.a + w.(J e + w x J w) over the bodies, of the velocities and accelerations that
are reported; the powers of effort, loads and weight are written out here.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.attack.spatial_honesty import case
from tests.reference.spatial_bodies import rotation
from tests.shared.spatial_forces import GRAVITY, massive

CLOSE = 1e-12
SPEED, ACCELERATION = 2.0, 1.3


def sized(mechanism: md.Mechanism, factor: float) -> md.Mechanism:
    """Return a mechanism with all lengths multiplied."""

    def points(own: Any) -> Any:
        return Table({name: tuple(factor * float(v) for v in p) for name, p in own.points.items()})

    joints = {
        name: replace(j, pitch=j.pitch * factor) if getattr(j, "pitch", None) is not None else j
        for name, j in mechanism.joints.items()
    }
    sketch = {
        name: value * factor if name.count(".") == 2 else value
        for name, value in mechanism.sketch.items()
    }
    bodies = {n: replace(body, points=points(body)) for n, body in mechanism.bodies.items()}
    return replace(
        mechanism, ground=md.Ground(points(mechanism.ground)), bodies=Table(bodies),
        joints=Table(joints), sketch=Table(sketch),
    )  # fmt: skip


def powers(result: md.Result, k: int, effort: float) -> list[float]:
    """Return the powers at a pose; their sum is zero."""
    mechanism, values = result.mechanism, result.mechanism.values()
    found = [effort * SPEED]
    for name in mechanism.bodies:
        own, centre = result.bodies[name], result.points[f"{name}.cm"]
        R = np.array(rotation(own.orientation[k]))
        v, a = centre.velocity[k], centre.acceleration[k]
        w, e = own.angular_velocity[k], own.angular_acceleration[k]
        m = values[f"{name}.mass"]
        xx, yy, zz, xy, xz, yz = (
            values[f"{name}.inertia.{word}"] for word in ("xx", "yy", "zz", "xy", "xz", "yz")
        )
        J = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
        found += [m * v @ GRAVITY, -m * v @ a, -w @ (J @ e + np.cross(w, J @ w))]
    for load in mechanism.loads.values():
        value = np.array([float(component) for component in load.value])
        if load.frame in mechanism.bodies:
            value = np.array(rotation(result.bodies[load.frame].orientation[k])) @ value
        if isinstance(load, md.Torque):
            found.append(value @ result.bodies[load.body].angular_velocity[k])
        else:
            found.append(value @ result.points[load.point].velocity[k])
    return [float(power) for power in found]


@pytest.mark.parametrize("loop", ["RSRC", "RHSC", "RCCC", "RUSR", "REUR"])
def test_power_at_all_scales(loop: str) -> None:
    drawn = case(np.random.default_rng(sum(map(ord, loop))), loop).mechanism
    for factor, mass in ((1e-3, 1e3), (1.0, 1.0), (1e3, 1e-3), (1e-3, 1e-6)):
        mechanism = massive(sized(drawn, factor))
        bodies = {
            name: replace(
                body, mass=body.mass * mass, inertia=tuple(v * mass for v in body.inertia)
            )
            for name, body in mechanism.bodies.items()
        }
        mechanism = replace(mechanism, bodies=Table(bodies))
        driver = md.Driver("J0.angle", at=[0.0, 0.02], speed=SPEED, acceleration=ACCELERATION)
        result = md.solve(mechanism, md.Reactions(driver=driver))
        assert result.status[0] == "ok"
        assert max(result.checks.values()) < CLOSE
        for k in np.flatnonzero(result.status == "ok"):
            found = powers(result, k, result.efforts["J0.angle"][k])
            assert abs(sum(found)) < CLOSE * max(map(abs, found))

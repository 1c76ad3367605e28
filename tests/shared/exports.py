"""Exports of predefined problems, made once, and what they are compared with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.values import Table
from mechdae.tasks.motion_of import ExportedMotion, motion_of


@cache
def motion(name: str, task: str | None = None) -> ExportedMotion:
    return motion_of(md.load(name), task)


def block() -> md.Problem:
    """Return a block of 3 kg that is moved along a guide from 0.2 to 0.4 m."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0.0, 0.0)}),
        bodies={"block": md.Body("block", {"P": (0.0, 0.0)}, mass=3.0, inertia=0.1)},
        joints={"guide": md.Prismatic("guide", "ground.O", "block.P")},
    )
    task = md.Sweep(md.Driver("guide.slide", from_=0.2, to=0.4))
    return md.Problem(mechanism, {"move": task}, name="block")


def rows(name: str, count: int = 200) -> list[int]:
    """Return up to `count` assembled poses, equally spaced."""
    every = motion(name).rows
    chosen = np.unique(np.linspace(0, len(every) - 1, count).astype(int))
    return [every[k] for k in chosen]


def in_space(place: Any) -> Any:
    found = np.zeros(3)
    found[: len(place)] = place
    return found


def coordinate(result: Any, word: str, row: int) -> float:
    """Return the value of ``O.angle``, ``slot.slide``, ``body.point.x`` in a pose."""
    part, _, quantity = word.partition(".")
    if part in result.joints:
        return float(np.asarray(result.joints[part][quantity])[row])
    if quantity == "angle":
        return float(result.bodies[part].angle[row])
    point, axis = quantity.split(".")
    return float(result.points[f"{part}.{point}"].position[row]["xyz".index(axis)])


GRAVITY = (0.0, -9.81)
Weights = Mapping[str, tuple[float, Any]]
"""Mass and place of its centre by body, or by joint of a small part between two bodies."""


def weighed(whole: ExportedMotion, weights: Weights, row: int) -> md.Mechanism:
    """Return a mechanism of the plane under gravity alone, as it stands in a row of a result.

    What has no mass gets that of a file: in the row its centre is where the file puts it.
    """
    mechanism, result = whole.mechanism, whole.result
    values, bodies = mechanism.values(), {}
    for name, body in mechanism.bodies.items():
        bodies[name] = body
        if body.mass is None:
            mass, place = weights[name]
            point = next(iter(body.points))
            x, y = np.asarray(place)[:2] - result.points[f"{name}.{point}"].position[row]
            angle = float(result.bodies[name].angle[row])
            c, s = np.cos(angle), np.sin(angle)
            shift = values[f"{name}.{point}.x"], values[f"{name}.{point}.y"]
            center = float(c * x + s * y + shift[0]), float(c * y - s * x + shift[1])
            bodies[name] = replace(body, mass=mass, center=center)
    loads = {
        name: md.Force(name, mechanism.joints[name].second, (0.0, GRAVITY[1] * mass))
        for name, (mass, _) in weights.items()
        if name not in bodies
    }
    sketch = {name: float(result.bodies[name].angle[row]) for name in bodies}
    slides = [name for name, joint in mechanism.joints.items() if joint.straight]
    sketch |= {name: float(result.joints[name].slide[row]) for name in slides}
    return replace(
        mechanism, bodies=Table(bodies), loads=Table(loads), gravity=GRAVITY, sketch=Table(sketch)
    )


def keep_for(whole: ExportedMotion, weights: Weights, row: int, at: dict[str, float]) -> Any:
    """Return the efforts with which drivers hold a mechanism of the plane against gravity."""
    drivers = [md.Driver(name, at=[value]) for name, value in at.items()]
    result = md.solve(weighed(whole, weights, row), md.Reactions(drivers=drivers, friction="none"))
    assert set(result.status) == {"ok"}
    return np.array([float(result.efforts[name][0]) for name in at])

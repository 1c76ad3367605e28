"""The shaking force and moment of a task as paths: named outputs of what the masses do.

The force is the sum of m a over all bodies, the moment that of its moments about the origin and of
I alpha: what the frame has to give to the motion, and its own bearings feel with the other sign.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Body, Mechanism
from mechdae.describe.table import Table
from mechdae.describe.values import Number
from mechdae.errors import InputError

CENTRE = "mass_center"
"""Name of the points that are added at centres of mass."""
NAMES = ("shaking_x", "shaking_y", "shaking_moment")
SHAKING: dict[str, tuple[str, ...]] = {
    "shaking/force": ("outputs/shaking_x/value", "outputs/shaking_y/value"),
    "shaking/moment": ("outputs/shaking_moment/value",),
}
"""Paths below a task, with those of the named outputs that they stand for."""


def with_shaking(problem: Problem, tasks: Iterable[str]) -> Problem:
    """Return the problem with points at the centres of mass and outputs of what shakes the frame.

    Parameters
    ----------
    tasks
        Names of sweeps that are to have these outputs.

    Raises
    ------
    InputError
        No body has a mass; a task without accelerations; a mechanism in space.
    """
    wanted = list(dict.fromkeys(tasks))
    if not wanted or set(NAMES) <= set(problem.mechanism.outputs):
        return problem
    mechanism = _with_outputs(problem.mechanism)
    changed: dict[str, Any] = dict(problem.tasks)
    for name in wanted:
        own: Any = problem.tasks[name]
        if own.derivatives < 2:
            raise InputError(
                "a shaking force needs accelerations",
                where=f"tasks.{name}.derivatives",
                hint="derivatives = 2",
            )
        if own.outputs is not None:
            changed[name] = replace(own, outputs=(*own.outputs, *NAMES))
    return replace(problem, mechanism=mechanism, tasks=Table(changed), pattern=None)


def _with_outputs(mechanism: Mechanism) -> Mechanism:
    if mechanism.dimension != 2:
        raise InputError("shaking forces in space are not computed yet", where="dimension")
    bodies: dict[str, Body] = dict(mechanism.bodies)
    outputs = dict(mechanism.outputs)
    sums: dict[str, list[str]] = {name: [] for name in NAMES}
    for name, body in mechanism.bodies.items():
        if body.mass is None:
            continue
        point = CENTRE
        while point in body.points:
            point += "_"
        place: tuple[Number, ...] = body.center or (0.0, 0.0)
        bodies[name] = replace(body, points=body.points.with_(point, place))
        x, y = (f"{name}.{point}.{axis}" for axis in "xy")
        mass = f"({body.mass})"
        turn = f" + ({body.inertia})*{name}.angle.acceleration" if body.inertia is not None else ""
        terms = {
            "shaking_x": f"{mass}*{x}.acceleration",
            "shaking_y": f"{mass}*{y}.acceleration",
            "shaking_moment": f"{mass}*({x}*{y}.acceleration - {y}*{x}.acceleration){turn}",
        }
        for word, text in terms.items():
            outputs[f"{word}_{name}"] = text
            sums[word].append(f"{word}_{name}")
    if not sums["shaking_x"]:
        raise InputError("no body has a mass: nothing shakes the frame", where="bodies")
    outputs |= {word: " + ".join(parts) for word, parts in sums.items()}
    return replace(mechanism, bodies=Table(bodies), outputs=Table(outputs))

"""What the pose of a page is led along, and the drivers that can be moved on their own.

One driver is its own way. Several drivers follow a law of time, or straight legs between their
values (from one pose of the task to the next); each of them can also be moved with the others held.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.legs import Legs, largest_step
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.results import Result
from mechdae.types import Floats, Graph, Json

LINE = "line_"
"""What names of functions begin with that are those of straight lines, beside a law's."""


def start_of(path: AnyPath) -> tuple[float, Floats]:
    """Return the place where the page begins, and the unknowns there (nx,)."""
    if isinstance(path, Legs):  # the first leg leads from the sketch to the first pose
        return 1.0, path.nodes[1]
    return path.origin


def is_law(setting: Setting) -> bool:
    """Return whether drivers follow laws of time."""
    return setting.plan.timing is not None


def followed_by(setting: Setting) -> Graphs:
    """Return the functions that the page prints: one that moves beside held ones is a line."""
    plan, graphs = setting.plan, setting.graphs
    return graphs.straight if plan.moving is not None and graphs.course else graphs


def functions(setting: Setting) -> dict[str, Graph]:
    """Return the functions of a law and of straight lines, by the names that the page knows."""
    if not is_law(setting):
        return {}
    graphs, straight = setting.graphs, setting.graphs.straight
    assert graphs.course is not None
    rates = [ca.densify(part) for part in graphs.course.values(graphs.course.s)]
    found = {"course": ca.Function("course", [graphs.course.s], rates)}
    found[f"{LINE}advance"] = straight.advance
    return found | {f"{LINE}fold{b}": straight.fold(b) for b in range(graphs.nb)}


def cornered(setting: Setting) -> bool:
    """Return whether a law has corners, at which rates jump."""
    timing = setting.plan.timing
    return timing is not None and bool(len(timing.corners) or np.any(timing.rough))


def driven(setting: Setting, result: Result) -> list[Json]:
    """Return the drivers: name, unit, whether it is an angle, what counts as a radian."""
    coordinates, sizes = setting.plan.coordinates, setting.driver_sizes
    return [
        {"name": name, "unit": c.unit, "turns": bool(c.is_angle), "size": float(size)}
        for name, c, size in zip(result.drivers, coordinates, sizes, strict=True)
    ]


def drivers_of(setting: Setting, result: Result) -> list[Json] | None:
    """Return the drivers that can be moved on their own, None where there is one."""
    plan, law = setting.plan, is_law(setting)
    if setting.graphs.single:
        return None
    rates = [np.atleast_2d(rate)[0] for rate in (plan.speed, plan.acceleration)]
    return [
        {
            **driver,
            # by a law the speed differs from moment to moment: one unit in a second
            "speed": 1.0 if law else float(rates[0][k]) or driver["size"],
            "acceleration": 0.0 if law else float(rates[1][k]),
            "usual": law or not rates[0][k],
        }
        for k, driver in enumerate(driven(setting, result))
    ]


def way_of(setting: Setting, run: Run) -> Json:
    """Return what the page's poses lie along.

    ``kind`` is "value" (of one driver), "alone" (one of several, the others held), "legs" or
    "law"; ``u`` the drivers' values where it begins.
    """
    plan, path = setting.plan, run.path
    s, _ = start_of(path)
    way: dict[str, Any] = {"u": path.drivers(np.array([s]))[0].tolist()}
    if setting.graphs.single:
        return way | {"kind": "value"}
    if plan.moving is not None:
        return way | {"kind": "alone", "driver": plan.moving, "largest": float(path.largest)}
    rates = [np.atleast_2d(rate)[0].tolist() for rate in (plan.speed, plan.acceleration)]
    if is_law(setting):
        return way | {"kind": "law", "name": "t", "unit": "s", "largest": float(path.largest)}
    whole = {"kind": "legs", "unit": "", "rates": rates}
    if isinstance(path, Legs):
        corners, name = path.corners, "pose"
    else:
        assert isinstance(path, Path)
        corners, name = np.array([path.u0, path.u0 + path.d]), "way"
    longest = largest_step(np.diff(corners, axis=0), setting.driver_sizes)
    return way | whole | {"name": name, "corners": corners.tolist(), "largest": longest.tolist()}


def pace_of(setting: Setting, run: Run) -> float:
    """Return the speed of the fastest driver in its unit: what rates are small or large beside."""
    plan = setting.plan
    if setting.graphs.single:
        size = 1.0 if setting.graphs.turns else run.path.constants.scale
        return abs(float(np.atleast_2d(plan.speed)[0, 0])) / size
    return float(np.nanmax(np.abs(np.atleast_2d(plan.speed)) / setting.driver_sizes))

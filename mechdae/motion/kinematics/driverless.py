"""A mechanism that nothing drives, assembled as if it were driven: coordinates in place of drivers.

Motions and equilibria begin where sweeps do: on the assembly mode nearest to the sketch, with the
coordinates that could be driven at their values in the sketch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate, named_coordinate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import GROUND
from mechdae.describe.tasks.kinds import Driven, Driver, Sweep
from mechdae.describe.values import Number, Table
from mechdae.motion.assembly import start
from mechdae.motion.kinematics.prepared import Setting, prepare
from mechdae.types import Floats, Matrix

INDEPENDENT = 1e-6
"""Share of a coordinate's gradient across the others from which it is independent."""


def likely_drivers(problem: Problem, names: Iterable[str]) -> Iterator[NamedCoordinate]:
    """Yield coordinates that may be driven, the likeliest first: those named, drivers of tasks."""
    mechanism = problem.mechanism
    for name in names:
        yield named_coordinate(mechanism, name)
    for task in problem.tasks.values():
        if isinstance(task, Driven):
            for driver in task.all_drivers:
                yield coordinate(mechanism, driver.coordinate)
    joints = mechanism.joints
    for ground in (True, False):
        for name, joint in joints.items():
            if (GROUND in joint.bodies) is not ground:
                continue
            if mechanism.dimension == 3:
                for word in joint.coordinates:
                    yield coordinate(mechanism, f"{name}.{word}")
                continue
            if joint.slides:
                yield coordinate(mechanism, f"{name}.slide")
            for body in joint.bodies:
                if body != GROUND:
                    yield coordinate(mechanism, f"{body}.angle")
    for body, part in mechanism.bodies.items():
        for point in part.points:
            for axis in mechanism.axes:
                yield coordinate(mechanism, f"{body}.{point}.{axis}")


def independent(
    every: Iterable[NamedCoordinate], slope: Callable[[NamedCoordinate], Any], basis: Matrix
) -> list[NamedCoordinate]:
    """Return the first coordinates that tell the freedoms apart, as many as there are if they do.

    `slope` gives the gradient (n,) of one, `basis` (n, k) is that of the freedoms.
    """
    found: list[NamedCoordinate] = []
    across = np.zeros((basis.shape[1], 0))
    for c in dict.fromkeys(every):
        if len(found) == basis.shape[1]:
            break
        gradient = slope(c)
        size = float(np.linalg.norm(gradient))
        along = basis.T @ gradient
        rest = along - across @ (across.T @ along)
        length = float(np.linalg.norm(rest))
        if size > 0 and length > INDEPENDENT * size:
            found.append(c)
            across = np.column_stack([across, rest / length])
    return found


def assembled(
    problem: Problem, sketch: Mapping[NamedCoordinate, float], driven: Iterable[NamedCoordinate]
) -> tuple[Setting, Floats, Floats]:
    """Return a sketch assembled as a sweep begins that drives some of its coordinates.

    That is the setting with its notes, driver values and unknowns.

    Raises
    ------
    MechdaeError
        As of a sweep with these drivers.
    """
    sketched: Table[Number] = Table({c.text: value for c, value in sketch.items()})
    problem = replace(problem, mechanism=replace(problem.mechanism, sketch=sketched))
    drivers = tuple(Driver(c.text, at=(sketch[c],)) for c in driven)
    setting = prepare(problem, Sweep(drivers=drivers))
    u, x = start.sketched_pose(setting.assembler, setting.plan, labelled=False)
    assembler, searched = setting.assembler, setting.assembler.sketched
    noted = (searched.ended, searched.turned)
    setting.notes[:] = start.doubts(assembler, setting.plan, x, u, *noted)
    return setting, u, x

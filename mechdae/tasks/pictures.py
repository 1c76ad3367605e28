"""The result of a task with all that a picture shows of it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import chain, combinations, islice
from typing import Any

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Driven, Driver, Sweep
from mechdae.describe.tasks.motion import Equilibrium
from mechdae.equations.mobility import count_mobility
from mechdae.errors import InputError, MechdaeError
from mechdae.motion.kinematics.driverless import likely_drivers
from mechdae.motion.setup.drivers import sketched
from mechdae.results import Result
from mechdae.tasks.show import not_in_scene
from mechdae.tasks.solve import solve

MEASURED = {
    "transmission_angle": "transmission",
    "tangent": "curve",
    "curvature": "curve",
    "centrode_fixed": "centrodes",
    "centrode_moving": "centrodes",
    "axode_fixed_direction": "axodes",
    "axode_fixed_point": "axodes",
    "axode_moving_direction": "axodes",
    "axode_moving_point": "axodes",
    "screw_pitch": "axodes",
}
"""Series that are there if a measure asks for them."""
PARTS = ("bodies", "points", "joints")
TRIED = 8
"""Choices of drivers that are tried for a picture of a sketch."""


def for_picture(
    problem: Problem,
    name: str,
    needs: Collection[str] = (),
    paths: Sequence[str] = (),
    mode: str | None = None,
    measures: Sequence[str] = (),
) -> Result:
    """Return the result of a task as a picture needs it.

    `needs`: "bodies": all of them, also where the task names outputs; those that no output depends
    on are named as not in the scene, and left out where they spoil the task, which is the only case
    in which it is solved again. "series": those of ``paths``, with measures and outputs that give
    them. "extremes": located between the poses, where the driver allows it. "small motions" of an
    equilibrium.
    """
    task = problem.task(name)
    if "small motions" in needs and isinstance(task, Equilibrium):
        problem = problem.with_task(name, replace(task, linearise=True))
        task = problem.task(name)
    if measures and isinstance(task, Sweep):
        both = tuple(dict.fromkeys((*(task.measures or ()), *measures)))
        task = replace(task, measures=both)
        problem = problem.with_task(name, task)
    if "series" in needs and isinstance(task, Sweep):
        extremes = "extremes" in needs and problem.mechanism.dimension == 2
        problem = problem.with_task(name, with_series(task, paths, extremes))
    elif "bodies" in needs and getattr(task, "outputs", None) is not None:
        return _with_all_bodies(problem, name, mode)
    return solve(problem, name, mode=mode)


def with_bodies(result: Result) -> Result:
    """Return a result with all bodies of its scene, solved again where outputs leave some out.

    Of loops of vectors in space the result stays: their equations do not close on paper.
    """
    shown = {*getattr(result, "bodies", ()), *result.summary.get("not_in_scene", ())}
    named = getattr(result.definition, "outputs", None) is not None
    in_space = result.mechanism.dimension == 3 and result.mechanism.closure is not None
    if not named or in_space or shown >= set(result.mechanism.bodies):
        return result
    whole = for_picture(result.as_problem(), result.task, ("bodies",))
    return replace(whole, units=result.units)


def with_scene(problem: Problem, name: str) -> Problem:
    """Return a problem in which a task has all bodies of its scene, where it names outputs."""
    task: Any = problem.task(name)
    if getattr(task, "outputs", None) is None:
        return problem
    outside = not_in_scene(problem, name)
    there = [body for body in problem.mechanism.bodies if body not in outside]
    outputs = tuple(dict.fromkeys((*task.outputs, *there))) if outside else None
    return problem.with_task(name, replace(task, outputs=outputs))


def with_sketch(problem: Problem) -> Problem:
    """Return a problem with a task that has a picture, where it has none: the assembled sketch.

    Driven are coordinates that the sketch gives, those on the ground first, as many as are needed.
    """
    mechanism = problem.mechanism
    if problem.tasks:
        return problem
    drawn = sketched(mechanism).coordinates(mechanism)
    why: MechdaeError | None = None
    known = [c for c in dict.fromkeys(likely_drivers(problem, ())) if c in drawn]
    counted = count_mobility(mechanism)
    count = max(counted["W"] - len(counted.get("idle", ())), 1)
    tried = (islice(combinations(known, k), TRIED) for k in (count, count + 1))
    for some in chain.from_iterable(tried):
        drivers = tuple(Driver(c.text, at=(drawn[c],)) for c in some)
        whole = problem.with_task("sketch", Sweep(drivers=drivers))
        try:
            solve(whole, "sketch")
        except MechdaeError as error:
            why = why or error
        else:
            return whole
    if why is not None:
        raise why
    raise InputError(
        f"there is no task, and the sketch gives fewer coordinates than {count}, the freedoms",
        where="sketch",
    )


def with_series(task: Sweep, paths: Sequence[str], extremes: bool) -> Sweep:
    """Return a task that computes series: measures that give them, and their parts as outputs."""
    words = [path.split("/")[-1] for path in paths]
    measures = [MEASURED[word] for word in words if word in MEASURED]
    if extremes and task.kind == "sweep" and _goes_along(task):
        measures.append("extremes")
    task = replace(task, measures=tuple(dict.fromkeys((*(task.measures or ()), *measures))) or None)
    if task.outputs is None:
        return task
    parts = [path.split("/")[1] for path in paths if path.split("/")[0] in PARTS and "/" in path]
    return replace(task, outputs=tuple(dict.fromkeys((*task.outputs, *parts))))


def _goes_along(task: Driven) -> bool:
    """Return whether extremes between the poses are defined: one driver over an interval."""
    moving = [driver for driver in task.all_drivers if driver.at is None or len(driver.at) > 1]
    return len(moving) == 1 and moving[0].law is None and moving[0].at is None


def _with_all_bodies(problem: Problem, name: str, mode: str | None) -> Result:
    task: Any = problem.task(name)
    scene = with_scene(problem, name)
    outside = not_in_scene(problem, name)
    if not outside:
        return solve(scene, name, mode=mode)
    if problem.mechanism.dimension == 3:  # loops that are not in the scene cost much
        inside = solve(scene, name, mode=mode)
        return replace(inside, summary=inside.summary.changed(not_in_scene=outside))
    try:
        whole = solve(problem.with_task(name, replace(task, outputs=None)), name, mode=mode)
    except MechdaeError:
        whole = None
    if whole is not None and not whole.fault:
        return replace(whole, summary=whole.summary.changed(not_in_scene=outside))
    inside = solve(scene, name, mode=mode)
    if whole is None or whole.fault != inside.fault:
        return inside
    return replace(whole, summary=whole.summary.changed(not_in_scene=outside))

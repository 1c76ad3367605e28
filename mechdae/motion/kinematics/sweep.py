"""Positions, velocities and accelerations along the drivers, every pose certified."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mechdae.additions import of_cases
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.motion.continuation.any_path import arc_of
from mechdae.motion.continuation.evaluate import Evaluator, in_time, swept
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.kinematics.assembled_arc import assembled, turn_back
from mechdae.motion.kinematics.extremes import Spans
from mechdae.motion.kinematics.path_events import begins_singular, limit_events
from mechdae.motion.kinematics.prepared import Run, Setting, covered, first_pose, prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.measures.measure import along_path, at_poses
from mechdae.motion.measures.measured import Measured
from mechdae.motion.setup.scales import Constants, driver_size
from mechdae.results import Summary, SweepResult
from mechdae.types import Floats


class PathRange(NamedTuple):
    """How a path is followed: the values of the drivers on it (n, nd), how far beside (nd,)."""

    begin: float
    largest: float  # step of its parameter
    span: Floats
    margin: Any


def sweep(problem: Problem, name: str, task: Sweep) -> SweepResult:
    """Return the result of a sweep.

    The mechanism is assembled at the sketch (or on the mode asked for at the first pose),
    moved to the first pose and on along the drivers. Poses that no certified motion
    reaches are ``unassembled``.

    Raises
    ------
    AssemblyError
        The sketch does not assemble at its own driver value.
    """
    setting = prepare(problem, task)
    return report(problem, name, task, setting, run(setting, task))


def run(setting: Setting, task: Sweep) -> Run:
    """Evaluate a prepared sweep."""
    u, x = first_pose(setting, task)
    result = along(setting, task, u, x) if setting.graphs.single else _led(setting, task, u, x)
    for correct in setting.scene.cases("runs"):
        correct(setting, result)
    result.poses.y = result.poses.y[: task.derivatives + 1]
    if task.find:
        from mechdae.motion.kinematics import finds

        events, notes = finds.of_sweep(setting, result, task)
        result.found.events += events
        result.found.notes += notes
    return result


def _led(setting: Setting, task: Sweep, u: Floats, x: Floats) -> Run:
    """Return the run of several drivers, or of laws."""
    for run_along in of_cases("courses"):
        found: Run = run_along(setting, task, u, x, along)
        return found
    raise NotImplementedError


def along(
    setting: Setting, task: Sweep, u: Floats, x: Floats, path_range: PathRange | None = None
) -> Run:
    """Return the poses along one parameter: the value of the driver that moves, or time.

    The path starts from unknowns `x` at drivers' values `u`; laws of time give their `path_range`.
    """
    plan, graphs, laws = setting.plan, setting.graphs, setting.plan.timing
    moving, is_angle = plan.lead, graphs.turns
    model, c = setting.scene.model, plan.coordinates[plan.lead]
    contact = model.contacts.get(c.part)
    closed = contact is not None and contact.closed
    scale = model.mechanism.scale
    size = driver_size(model, c, scale)
    span = u[None, :] if plan.values is None else np.vstack([plan.values, u])
    margin = np.zeros(len(u))
    margin[moving] = 4 * (scale if c.unit == "m" else np.pi * size)
    largest = 2 * np.pi / NODES_PER_TURN * size
    path_range = path_range or PathRange(float(u[moving]), largest, span, margin)
    evaluator = Evaluator(graphs, setting.outputs)
    summary = Summary()

    def follow(numbers: Constants) -> tuple[Path, Floats]:
        path = Path(graphs, numbers, np.zeros(graphs.nu), np.ones(graphs.nu), path_range.largest)
        path.on_change_point = setting.on_change_point
        path.begin(x, path_range.begin)
        if plan.values is None:
            turn = 2 * np.pi * size if is_angle or closed else None
            found = assembled(path, evaluator, turn, 4 * scale, plan.poses, setting.notes)
            for cut in setting.scene.cases("arcs"):
                found = cut(setting, path, evaluator, *found)
            summary["limits"] = found[1]
            return path, found[0]
        places = laws.times if laws else plan.values[:, moving]
        cover(path, evaluator, places, is_angle, laws.corners if laws else ())
        return path, places

    path, places = covered(follow, setting, path_range.span, path_range.margin, (x, u))
    rates = (plan.speed, plan.acceleration, plan.jerk)
    led = [rate[:, [moving]] for rate in rates]
    driver = None if laws else (led[0], led[1], led[2])
    measures = bool(task.measures)  # of derivatives by the driver
    poses = swept(
        evaluator, path, places, rates if laws else (), None if measures else driver, measures
    )
    low, high = float(np.min(places)), float(np.max(places))
    spans = None
    if not plan.named and task.derivatives >= 2:
        between = [*laws.dense, *laws.corners] if laws and not graphs.nx else []
        spans = Spans(evaluator, setting.outputs, path, poses, low, high, between)
        summary["swing"] = summary["stroke"] = spans.later
        if task.measures:  # they follow the path further
            spans.later.parts()
    ends = arc_of(path).ends if plan.values is None else ()
    met = [low, high, *(end for end in ends if end is not None)]
    events = []
    if path.ends or path.zones:
        events = limit_events(setting, path, min(met), max(met))
    if "limits" not in summary and not laws:
        limits = arc_of(path).ends
        if any(end is not None for end in limits):
            summary["limits"] = limits
    if any(begins_singular(setting, path, event) for event in events):
        summary.pop("limits", None)  # not known: the pose is on two branches
    values = plan.values if plan.values is not None else path.drivers(places)
    measured = Measured()
    if task.measures:
        measured = at_poses(
            setting.outputs, task, poses, 1.0 if is_angle or laws else scale, moving
        )
    if task.measures and not laws:
        along_path(setting.outputs, task, evaluator, path, places, measured, moving)
        for event in measured.events if graphs.nu > 1 else ():
            event["at"] = path.drivers(np.array([event["at"]]))[0].tolist()
        poses.y = in_time(poses.y, *led)
    return Run(path, evaluator, poses, values, places, events, summary, measured, spans)


def cover(
    path: Path, evaluator: Evaluator, values: Floats, is_angle: bool, corners: Any = ()
) -> None:
    """Follow the path over all values, and the other way round where some are not reached."""
    if not path.followed:
        return
    begin = path.origin[0]
    for place in [*[c for c in corners if c > begin], float(np.max(values))]:
        extend(path, float(place))
    for place in [*[c for c in corners[::-1] if c < begin], float(np.min(values))]:
        extend(path, float(place))
    if is_angle and path.ends:
        turn_back(path, evaluator, values)

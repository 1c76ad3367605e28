"""From evaluated poses to a result: status, series, events, what is to be known."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.equations.groups import formula
from mechdae.motion.assembly.start import noted
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.evaluate import Poses
from mechdae.motion.continuation.output_bounds import of_rows
from mechdae.motion.kinematics import faults, path_events
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.motion.setup.drivers import DriverPlan
from mechdae.results import (
    CODES,
    FINE,
    LOST,
    Event,
    LazyPart,
    Named,
    Series,
    Status,
    SweepResult,
    among,
    counts,
    events_of,
)
from mechdae.types import Floats, Json


def sorted_events(events: Iterable[Mapping[str, Any]], moving: int = 0) -> list[Mapping[str, Any]]:
    """Return events in the order of time, or of the driver that moves."""
    return sorted(events, key=lambda e: float(e.get("time", np.ravel(e["at"])[moving])))


def report(problem: Problem, name: str, task: Sweep, setting: Setting, run: Run) -> SweepResult:
    plan, poses, outputs = setting.plan, run.poses, setting.outputs
    status, found = _status(run.path, poses), run.found
    words = outputs.bound_words
    named: dict[str, Any] = outputs.named(poses.y, found.series)
    named["centres"] = Series(found.centres)
    certified = np.broadcast_to(True, len(status)) if poses.fine else among(status, FINE)
    expressions = setting.expressions
    named["outputs"], lost = Named("output", {}), list[str]()
    if expressions is not None:
        columns, time = outputs.columns(expressions.coordinates), plan.time_of(run.values)
        there = [array[:, columns] for array in poses.y]
        values, lost = expressions.evaluate(there, time, certified)
        named["outputs"], lost = expressions.reported(values), expressions.notes + lost
    some, failed = None if poses.fine else certified, list[Json]()
    if some is not None:
        poses.condition[~some] = np.nan
    if status.any() and among(status, LOST).any():
        failed = faults.failed_intervals(setting, run, status)
    status[certified & run.stopped] = CODES[Status.STOPPED]
    summary = run.summary.copy()
    summary["poses"] = len(status)
    summary["status"] = counts(status)
    summary["formula"] = formula(setting.scene.groups)
    summary["groups"] = [group.entry for group in setting.scene.groups]
    summary["mode"] = _mode(setting, run)
    notes = [*setting.notes]
    later = LazyPart(partial(noted, setting.scene.left_out, setting.doubts, notes))
    summary["not_in_scene"] = setting.scene.not_in_scene
    near = bool(run.path.zones) and run.evaluator.zones.estimated(run.path, poses.s, poses.places)
    summary["bound"] = "estimated" if near or run.path.constants.estimated else "proved"
    closing = run.evaluator.closing
    if setting.scene.redundant and closing is not None:
        summary["superfluous"] = setting.assembler.search.superfluous(*run.start)
        poses_x, p = poses.x[certified], run.path.constants.p
        summary["closure"] = closing.largest(poses_x, run.values[certified], p)
    summary |= found.summary
    if failed:
        summary["failed"] = failed
    if run.path.ends or run.path.zones:
        notes += path_events.near_crossings(setting, run.path)
    notes += lost + found.notes
    summary["notes"] = later
    opened = bool(setting.scene.redundant) and problem.mechanism.tolerance > 0
    if opened or (task.derivatives and task.untimed):
        from mechdae.describe.assumed import about_closure, about_speeds

        assumed = about_speeds(problem.mechanism, task) if task.derivatives else []
        summary["assumptions"] = assumed + (about_closure(problem.mechanism) if opened else [])
    events, rollers = list[Json](), list[Json]()
    for cut_events in setting.scene.cases("cut events"):
        events, rollers = cut_events(setting, run)
    fault: str | LazyPart | None = run.fault
    if len(status) and status[0] == CODES[Status.UNASSEMBLED]:  # its modes are looked for
        fault = LazyPart(lambda: {"fault": faults.fault(setting, run, status, failed, rollers)})
    elif failed or rollers:
        fault = faults.fault(setting, run, status, failed, rollers)
    if rollers:
        summary["undercut"] = rollers
    summary["work"] = _work(setting, run)
    return SweepResult(
        problem.name,
        name,
        task.kind,
        problem.mechanism,
        problem.title,
        drivers=_drivers(plan, run.values, task),
        status=status,
        bound=Series(dict.fromkeys(words, LazyPart(partial(of_rows, poses.bounds, some)))),
        condition=poses.condition,
        events=_in_order(setting, run, [*run.events, *events, *found.events]),
        summary=summary,
        fault=fault,
        definition=task,
        time=plan.timing.times if plan.timing else None,
        **named,
    )


def _work(setting: Setting, run: Run) -> LazyPart:
    """Return what the poses cost, with what is still to be computed when it is read."""
    counts, evaluator, spans = run.path.counts, run.evaluator, run.spans
    work: Json = {
        "unknowns": setting.graphs.nx,
        "blocks": [graph.size for graph in setting.graphs.blocks],
        "path_steps": counts.steps,
        "rejected_steps": counts.rejected,
        "pose_evaluations": evaluator.pose.evaluations,
        "refined_poses": evaluator.refined,
    }

    def whole() -> dict[str, Json]:
        if spans is None:
            return {"work": work}
        spans.later.parts()
        evaluations = work["pose_evaluations"] + spans.evaluations
        refined = work["refined_poses"] + spans.refined
        return {"work": work | {"pose_evaluations": evaluations, "refined_poses": refined}}

    return LazyPart(whole)


def _in_order(setting: Setting, run: Run, events: list[Json]) -> tuple[Event, ...]:
    """Return events in the order of the motion; along lines they are in that order."""
    graphs = run.path.graphs
    if not (graphs.single or graphs.course):
        return events_of(events)
    return events_of(sorted_events(events, setting.plan.lead))


def _status(path: AnyPath, poses: Poses) -> Any:
    """Return the statuses of the poses, one byte each."""
    status = np.zeros(len(poses.s), np.uint8)
    if poses.fine:
        return status
    dead = ~poses.alive.all(axis=1)
    status[dead] = CODES[Status.UNASSEMBLED]
    status[poses.uncertain | poses.singular] = CODES[Status.SINGULAR]
    status[poses.at_limit & ~dead] = CODES[Status.LIMIT]
    if path.zones:
        doubtful = path_events.ambiguous(path, poses.s) | path_events.ambiguous(path, poses.places)
        status[doubtful & (status == CODES[Status.OK])] = CODES[Status.AMBIGUOUS]
    return status


def _drivers(plan: DriverPlan, values: Floats, task: Sweep) -> Named:
    n = len(values)
    table = {}
    for k, c in enumerate(plan.coordinates):
        series = {"position": values[:, k]}
        if task.derivatives >= 1:
            series["velocity"] = np.broadcast_to(plan.speed[:, k], n)
        if task.derivatives >= 2:
            series["acceleration"] = np.broadcast_to(plan.acceleration[:, k], n)
        if task.derivatives >= 3:
            series["jerk"] = np.broadcast_to(plan.jerk[:, k], n)
        table[c.text] = Series(series)
    return Named("driver", table)


def _mode(setting: Setting, run: Run) -> LazyPart:
    """Return the label of the assembly mode the path starts on, which may need a search."""
    labels, begin = setting.assembler.labels, run.start
    return LazyPart(lambda: {"mode": labels.of_pose(*begin)})

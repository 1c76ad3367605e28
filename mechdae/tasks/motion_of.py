"""The task whose motion is exported: its result, and what it was computed with."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Driver, Sweep, Task
from mechdae.describe.tasks.motion import Reactions
from mechdae.errors import InputError, SolveError
from mechdae.motion.kinematics.prepared import Run, Setting, prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run as followed
from mechdae.results import Result
from mechdae.tasks.solve import solve

KINDS = ("sweep", "reactions", "motion")
"""Kinds of tasks with poses along a path, which exports are made of."""
WHOLE = 361
"""Poses of a sweep that no task has."""
GOOD = ("ok", "limit", "ambiguous", "jammed")


@dataclass(frozen=True)
class ExportedMotion:
    """A task with all bodies of its mechanism."""

    problem: Problem
    task: str
    result: Result
    setting: Setting | None = None
    run: Run | None = None

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism with its numbers."""
        return self.problem.mechanism

    @property
    def rows(self) -> list[int]:
        """The poses that are there."""
        status = self.result.status
        return [k for k in range(len(status)) if str(status[k]) in GOOD]

    @property
    def first(self) -> int:
        """The first pose in which all bodies are assembled, a limit position last."""
        rows = [k for k in self.rows if str(self.result.status[k]) != "limit"] or self.rows
        if not rows:
            raise SolveError(
                "no pose of the task assembles", where=f"tasks.{self.task}", hint="mechdae solve"
            )
        return rows[0]

    def single(self, what: str) -> tuple[Setting, Run]:
        """Return what a sweep of one driver was computed with."""
        setting, run = self.setting, self.run
        if setting is None or run is None or not setting.graphs.single:
            raise InputError(
                f"{what} is made of a task with one driver and no law of time",
                where=f"tasks.{self.task}",
                hint="a task of kind sweep with driver = { coordinate = ..., from_deg, to_deg }",
            )
        return setting, run


def motion_of(problem: Problem, name: str | None, driven: bool = False) -> ExportedMotion:
    """Return the motion of a task, by default of the first one that moves along a path.

    With ``driven`` a motion is no default; without a sweep one is made over all that the driver of
    another task reaches, or the only coordinate at which a motion starts.
    """
    if name is None:
        kinds = KINDS[:2] if driven else KINDS
        able = [name for name, task in problem.tasks.items() if task.kind in kinds]
        able.sort(key=lambda name: _rank(problem.task(name)))
        if not able and driven:
            for known in problem.tasks:
                coordinate, sketched = _coordinate(problem, problem.task(known))
                if coordinate:
                    made = Sweep(Driver(coordinate, range="assembled"), poses=WHOLE)
                    return _followed(sketched, known, made)
        if not able:
            raise InputError(
                "no task with poses along a path", where="tasks", hint="a task of kind sweep"
            )
        name = able[0]
    task: Any = problem.task(name)
    if task.kind not in KINDS:
        raise InputError(
            f"an export is made of {', '.join(KINDS)}, not of {task.kind}", where=f"tasks.{name}"
        )
    if isinstance(task, Reactions):
        task = Sweep(**{entry.name: getattr(task, entry.name) for entry in fields(Sweep)})
    if not isinstance(task, Sweep):
        task = replace(task, outputs=None)
        whole = problem.with_task(name, task)
        return ExportedMotion(whole, name, solve(whole, name))
    return _followed(problem, name, replace(task, outputs=None, measures=None))


def _coordinate(problem: Problem, task: Any) -> tuple[str, Problem]:
    """Return the coordinate that a task turns or alone starts at, "" for none; where it begins."""
    driver, start = getattr(task, "driver", None), getattr(task, "start", None) or {}
    if driver is None and len(start) != 1:
        return "", problem
    name = next(iter(start)) if driver is None else str(driver.coordinate)
    mechanism = problem.mechanism
    part, _, what = name.partition(".")
    body = mechanism.joints[part].second_body if part in mechanism.joints else part
    if what in ("", "angle") and {body, f"{body}.angle"} & {*mechanism.sketch}:
        return f"{body}.angle", problem
    sketch = {**mechanism.sketch, **start}
    return name, replace(problem, mechanism=replace(mechanism, sketch=sketch))


def _followed(problem: Problem, name: str, sweep: Sweep) -> ExportedMotion:
    task = replace(sweep, derivatives=max(2, sweep.derivatives))
    whole = problem.with_task(name, task)
    setting = prepare(whole, task)
    run = followed(setting, task)
    return ExportedMotion(whole, name, report(whole, name, task, setting, run), setting, run)


def _rank(task: Task) -> int:
    """Return how well a task suits: sweeps over a range, then single poses, then motions."""
    if not isinstance(task, Sweep):
        return 2
    return int(any(driver.at is not None for driver in task.all_drivers))


def reported(motion: ExportedMotion, kind: str, part: str, quantity: str, row: int) -> Any:
    """Return a value of one pose, an array of nan where the result has none."""
    table = getattr(motion.result, kind)
    if part not in table or quantity not in table[part]:
        return np.full(1, np.nan)
    return np.asarray(table[part][quantity])[row]

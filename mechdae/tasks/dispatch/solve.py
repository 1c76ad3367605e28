"""One task of one mechanism: what computes, shows and tries each kind; errors with places."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from mechdae.additions import Registry, TaskKind, at_home
from mechdae.describe.file.load import Source, chosen
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import MEASURES, TASKS, Task
from mechdae.describe.units import Units
from mechdae.errors import InputError, MechdaeError, UnavailableError
from mechdae.results import Result

KINDS: Registry[TaskKind] = Registry("tasks", {
    "sweep": TaskKind(
        "mechdae.describe.tasks.kinds:Sweep", run="mechdae.motion.kinematics.sweep:sweep",
        show="mechdae.motion.kinematics.show:driven_structure",
        trial="mechdae.motion.kinematics.show:tried",
    ),
}, made=lambda kind: kind)  # fmt: skip
"""Kind of task -> its functions."""


def solve(problem: Source, task: Task | str | None = None, **options: object) -> Result:
    """Return the result of one task."""
    whole, name = chosen(problem, task)
    return run(whole, name, (), **options)


def run(
    whole: Problem, name: str, units: str | Sequence[str] | Units = (), **options: object
) -> Result:
    """Return the result of the task of that name; errors are in `units`, or those of the file."""
    meant = whole.tasks[name]
    kind = KINDS.get(meant.kind)
    if kind is None:
        raise UnavailableError(
            f"tasks of kind '{meant.kind}' are not computed by this version",
            where=f"tasks.{name}.kind",
            hint=f"available: {', '.join(KINDS)}",
        )
    check_available(whole, name, meant)
    with placed(whole, name, units):
        result: Result = at_home(kind.run)(whole, name, meant, **options)
    return result


@contextmanager
def placed(problem: Problem, task: str, units: str | Sequence[str] | Units = ()) -> Iterator[None]:
    """Say of errors to which place of a problem with this task they belong, in its units."""
    try:
        yield
    except MechdaeError as error:
        if isinstance(error, InputError) and not error.where.startswith(
            ("mechanism", "bodies", "joints", "loads", "sketch", "parameters", "outputs.")
        ):
            error.inside(f"tasks.{task}")
        problem.blame(error, units)
        raise


OTHER_MEASURES = {3: ("centrodes", "instant-centres"), 2: ("axodes", "screw-axes")}
"""Measures of a sweep that mechanisms of a dimension do not have: they are of the other one."""


def available(problem: Problem, task: Task) -> bool:
    """Return whether tasks of that kind are computed of the mechanism's dimension."""
    if problem.mechanism.dimension == 2:
        return True
    inner = problem.tasks.get(getattr(task, "of", None) or "")
    return task.in_space and (inner is None or available(problem, inner))


def check_available(problem: Problem, name: str, task: Task) -> None:
    """Raise for what is not computed of a mechanism of that dimension."""
    if not available(problem, task):
        inner = problem.tasks.get(getattr(task, "of", None) or "")
        if task.in_space and inner is not None:
            task, name = inner, str(getattr(task, "of", name))
        raise UnavailableError(
            f"tasks of kind '{task.kind}' are not computed in space by this version",
            where=f"tasks.{name}.kind",
            hint=f"available: {', '.join(kind for kind in TASKS if TASKS[kind].in_space)}",
        )
    measures = getattr(task, "measures", None) or ()
    missing = OTHER_MEASURES[problem.mechanism.dimension]
    other = [word for word in measures if word in missing]
    if other:
        here, there = ("in space", "the plane")
        if problem.mechanism.dimension == 2:
            here, there = "in the plane", "space"
        raise UnavailableError(
            f"the measure '{other[0]}' is one of {there}",
            where=f"tasks.{name}.measures",
            hint=f"{here} there are {', '.join(w for w in MEASURES if w not in missing)}",
        )

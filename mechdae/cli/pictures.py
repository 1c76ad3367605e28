"""Which kind of picture a task has, and what its task has to compute for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Driven, Equilibrium, Study, Sweep
from mechdae.draw.options import DESIGNS, GRAPHS, checked, names_of
from mechdae.errors import InputError

DEFAULT = {"reactions": "curves", "motion": "curves", "study": "map", "synthesis": "design"}
"""Kind of picture by kind of task; of all others the diagram."""
FIRST = {
    "losses": ("reactions",),
    "map": ("study", "sweep"),
    "curves": ("sweep", "reactions", "motion"),
    "coupler": ("sweep", "reactions", "motion"),
    "animation": ("sweep", "reactions", "motion", "equilibrium"),
}
"""Kinds of tasks that a kind of picture is drawn of, the first that the problem has."""
MEASURED = {
    "transmission_angle": "transmission",
    "tangent": "curve",
    "curvature": "curve",
    "centrode_fixed": "centrodes",
    "centrode_moving": "centrodes",
}
"""Series that are there if a measure asks for them."""
PARTS = ("bodies", "points", "joints")


def task_for(problem: Problem, name: str | None, kind: str | None) -> str:
    """Return the name of the task to draw: the one asked for, or the first that suits the kind.

    Raises
    ------
    InputError
        The problem has no task that is computed.
    """
    if name is not None:
        return name
    drawn = [n for n, task in problem.tasks.items() if task.available]
    if not drawn:
        raise InputError("no task that this version computes", where=f"{problem.name}: tasks")
    usual = ("synthesis",) if kind in DESIGNS else ("sweep",)
    for wanted in FIRST.get(kind or "", usual):
        found = [own for own in drawn if problem.tasks[own].kind == wanted]
        lines = [own for own in found if kind in GRAPHS and _moves(problem.tasks[own])]
        if found:
            return (lines or found)[0]
    return drawn[0]


def _moves(task: Any) -> bool:
    """Return whether a driver of the task takes several values."""
    drivers = task.all_drivers if isinstance(task, Driven) else ()
    return any(own.at is None or len(own.at) > 1 for own in drivers)


def check_suits(problem: Problem, name: str, kind: str, mode: str | None) -> None:
    """Refuse kinds of pictures that a study or a synthesis does not have, and theirs for others.

    Raises
    ------
    InputError
        Says which kinds there are.
    """
    place = f"tasks.{name}"
    task = problem.task(name)
    own = task.kind
    if isinstance(task, Study) and kind != "map":
        raise InputError(
            "a study has no pose to draw", where=place, hint=f"--task {task.of} with --set"
        )
    if own == "synthesis":
        if kind not in DESIGNS:
            raise InputError(
                f"a synthesis has designs, no poses to draw as '{kind}'",
                where=place,
                hint=f"--kind {', '.join(DESIGNS)}",
            )
        if mode is not None:
            raise InputError("a synthesis starts on no assembly mode", where="--mode")
    elif kind in DESIGNS:
        raise InputError(
            f"'{kind}' is a picture of a synthesis, this is a task of kind '{own}'", where=place
        )


def kind_for(problem: Problem, name: str, asked: Mapping[str, Any]) -> str:
    """Return the kind of picture of a task: its usual one, or the diagram if that is meant.

    The diagram is meant if it has the options that were asked for and the usual kind has not.
    """
    own = problem.task(name).kind
    usual = DEFAULT.get(own, "diagram")
    if usual == "diagram" or own in ("study", "synthesis"):
        return usual
    meant = [kind for kind in (usual, "diagram") if set(asked) <= set(names_of(kind))]
    return meant[0] if meant else usual


def options_for(kind: str, asked: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of the drawing function.

    Raises
    ------
    InputError
        Options that the kind of picture does not have.
    """
    found = checked(kind, asked, "--")
    if "design" in found:
        if found["design"] < 1:
            raise InputError("a number from 1, the best one", where="--design")
        found["design"] -= 1
    return found


def left_out(problem: Problem, name: str) -> list[str]:
    """Return the bodies that no output of a task depends on, without solving anything."""
    from mechdae.tasks.show import pruned

    task = problem.task(name)
    if not isinstance(task, Driven) or task.outputs is None:
        return []
    return pruned(problem.mechanism, task).not_in_scene


def prepared(problem: Problem, name: str, kind: str, paths: Sequence[str]) -> Problem:
    """Return the problem with a task that computes what the picture shows.

    Small motions of an equilibrium that moves and series that a measure gives are asked for,
    extremes are located where the driver allows it, and outputs that the task leaves out are
    added. Nothing else is changed.
    """
    task = problem.task(name)
    if kind == "animation" and isinstance(task, Equilibrium):
        return problem.with_task(name, replace(task, linearise=True))
    if kind not in GRAPHS or not isinstance(task, Sweep):
        return problem
    words = [path.split("/")[-1] for path in paths]
    measures = [MEASURED[word] for word in words if word in MEASURED]
    if kind == "curves" and task.kind == "sweep" and _goes_along(task):
        measures.append("extremes")
    task = replace(task, measures=tuple(dict.fromkeys((*(task.measures or ()), *measures))) or None)
    if task.outputs is not None:
        parts = [
            path.split("/")[1] for path in paths if path.split("/")[0] in PARTS and "/" in path
        ]
        task = replace(task, outputs=tuple(dict.fromkeys((*task.outputs, *parts))))
    return problem.with_task(name, task)


def _goes_along(task: Driven) -> bool:
    """Return whether extremes between the poses are defined: one driver over an interval."""
    moving = [own for own in task.all_drivers if own.at is None or len(own.at) > 1]
    return len(moving) == 1 and moving[0].law is None and moving[0].at is None

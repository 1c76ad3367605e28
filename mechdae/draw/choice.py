"""Which task, and which kind of picture, shows what is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechdae.describe.tasks.kinds import Task
from mechdae.draw.catalogue import DOCUMENTS, PICTURES, checked, names_of, picture_of, usual_kind
from mechdae.errors import InputError

OF_FORCES = ("force", "friction", "lever")
"""Plans that a task of reactions has."""
WORDS: dict[tuple[str, ...], tuple[str, ...]] = {
    ("reactions", "motion"): ("effort", "reaction", "loss", "normal"),
    ("motion",): ("energy", "kinetic", "potential", "work", "drift"),
    ("sweep", "reactions"): ("transmission", "curvature", "tangent", "centr", "axode", "screw"),
}  # fmt: skip
"""Kinds of tasks that have series whose paths have a step that begins with one of these."""


def kind_and_task(
    tasks: Mapping[str, Task],
    kind: str | None,
    name: str | None,
    asked: Mapping[str, int | str | list[str]],
    where: str,
) -> tuple[str, str]:
    """Return the kind of picture and the task that are meant.

    Parameters
    ----------
    kind, name
        What is given of them.
    asked
        Options of the picture: of the kinds and tasks that are left, they choose those that
        have them.
    where
        The tasks are, for messages.

    Raises
    ------
    InputError
        There is no task that is computed.
    """
    if name is not None:
        return kind or kind_for(tasks[name].kind if name in tasks else "", asked), name
    if not tasks:
        raise InputError("no task that this version computes", where=f"{where}: tasks")
    if kind is None and not set(asked) <= set(names_of("diagram")):
        kind = next((own for own in PICTURES if set(asked) <= set(names_of(own))), None)
    shown = "diagram" if kind in (None, *DOCUMENTS) else str(kind)
    picture_of(shown)
    options = {} if kind is None else checked(shown, asked, "--")
    chosen = min(tasks, key=lambda own: _rank(tasks[own], shown, options))
    return kind or kind_for(tasks[chosen].kind, asked), chosen


def _rank(task: Task, kind: str, options: Mapping[str, Any]) -> tuple[int, ...]:
    """Return how far a task is from what is asked for; the least suits best."""
    picture = PICTURES[kind]
    suits = bool(set(picture.of) & set(task.holds))
    able = _kinds(kind, options)
    order = [*(picture.usual_of if not options.get("of") else ()), *picture.first]
    place = order.index(task.kind) if task.kind in order else len(order)
    way = -task.way if "path" in picture.of else 0
    frictionless = kind == "losses" and getattr(task, "friction", "") == "none"
    parts = {own.split("/")[0].removeprefix("efforts_") for own in options.get("of") or ()}
    lacks = len((parts & {"static", "inertial"}) - set(getattr(task, "parts", None) or ()))
    return not suits, bool(able) and task.kind not in able, lacks, frictionless, way, place


def _kinds(kind: str, options: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the kinds of tasks that have what options show, all of them: ()."""
    if options.get("polar") or options.get("which") in OF_FORCES:
        return ("reactions",)
    if options.get("shape"):
        return ("equilibrium",)
    if options.get("axodes"):
        return ("sweep",)
    steps = [step for path in options.get("of") or () for step in str(path).split("/")]
    for kinds, words in WORDS.items():
        if any(step.startswith(words) for step in steps) and kind != "losses":
            return kinds
    return ()


def kind_for(task: str, asked: Mapping[str, object]) -> str:
    """Return the kind of picture of a kind of task: its usual one, or the diagram if that is meant.

    The diagram is meant if it has the options that were asked for and the usual kind has not.
    """
    kinds = [kind for kind, picture in PICTURES.items() if task in picture.usual_of]
    if not kinds:
        return usual_kind(task)
    return next((own for own in (*kinds, "diagram") if set(asked) <= set(names_of(own))), kinds[0])

"""Which task and which kind of picture a command draws, and what the file is called."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.draw.catalogue import OPTIONS, PICTURES, checked, names_of, usual_kind
from mechdae.errors import InputError


def task_for(tasks: Mapping[str, Task], name: str | None, kind: str | None, where: str) -> str:
    """Return the name of the task to draw: the one asked for, or the first that suits the kind.

    `where` the tasks are is for messages.

    Raises
    ------
    InputError
        There is no task that is computed.
    """
    if name is not None:
        return name
    drawn = [n for n, task in tasks.items() if task.available]
    if not drawn:
        raise InputError("no task that this version computes", where=f"{where}: tasks")
    picture = PICTURES.get(kind or "diagram")
    for wanted in picture.first if picture else ("sweep",):
        suited = [own for own in drawn if tasks[own].kind == wanted]
        series = picture is not None and "series" in picture.needs
        lines = [own for own in suited if series and _moves(tasks[own])]
        if suited:
            return (lines or suited)[0]
    return drawn[0]


def _moves(task: Any) -> bool:
    """Return whether a driver of the task takes several values."""
    drivers = task.all_drivers if isinstance(task, Driven) else ()
    return any(own.at is None or len(own.at) > 1 for own in drivers)


def kind_for(task: str, asked: Mapping[str, Any]) -> str:
    """Return the kind of picture of a kind of task: its usual one, or the diagram if that is meant.

    The diagram is meant if it has the options that were asked for and the usual kind has not.
    """
    kinds = [kind for kind, picture in PICTURES.items() if task in picture.usual_of]
    if not kinds:
        return usual_kind(task)
    return next((own for own in (*kinds, "diagram") if set(asked) <= set(names_of(own))), kinds[0])


def options_for(kind: str, asked: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of the drawing function.

    Raises
    ------
    InputError
        Options that the kind of picture does not have.
    """
    options = checked(kind, asked, "--")
    if "design" in options:
        if options["design"] < 1:
            raise InputError("a number from 1, the best one", where="--design")
        options["design"] -= 1
    return options


def file_name(problem: str, task: str, kind: str, asked: Mapping[str, Any]) -> str:
    """Return the name of the file of a picture, without the ending."""
    given = {name: OPTIONS[name].file.format(value) for name, value in asked.items() if value}
    which = given.pop("which", "")
    given |= {"pose": OPTIONS["pose"].file.format(asked["pose"])} if "pose" in asked else {}
    return "-".join([problem, task, which or kind, *filter(None, given.values())])

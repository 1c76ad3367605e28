"""A variant of a mechanism, the pose that it is built in, and what it keeps of the problem."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from mechdae.describe import GROUND, Driver, Joint, Mechanism, Problem, Sweep, Table, Task, dumps
from mechdae.describe.file.load import from_dict
from mechdae.describe.loads import Load, TableLoad
from mechdae.describe.tasks.kinds import Driven, Modes
from mechdae.errors import InputError
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json


MEASURES = ("envelope", "transmission")
"""What sweeps of variants read off, so that variants can be ranked by it."""


@dataclass(frozen=True)
class Pose:
    """One assembled pose of the mechanism that is varied.

    ``angles`` [rad] of the bodies, ``points`` [m] by ``body.point``, ``slides`` [m] by joint; the
    ground has the angle 0.
    """

    angles: Mapping[str, float]
    points: Mapping[str, tuple[float, float]]
    slides: Mapping[str, float]


@dataclass(frozen=True)
class Variant:
    """One variant: a problem with the names of the one it was made from.

    ``name`` is fit for a file. ``fault`` says why it does not assemble, "" where it does; ``text``
    is its problem file, also where no mechanism can be made of it and ``problem`` is None.
    ``about`` says what was varied, ``left_out`` what of the problem has no meaning in it.
    """

    name: str
    problem: Problem | None
    about: Mapping[str, Json | int] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    fault: str = ""
    unmade: str = field(default="", repr=False)

    @property
    def text(self) -> str:
        """The text of its problem file."""
        return dumps(self.problem) if self.problem is not None else self.unmade

    def to_dict(self) -> dict[str, object]:
        """Return it as in the JSON."""
        entry: dict[str, object] = {"name": self.name, "problem": self.text}
        entry |= {"about": dict(self.about)} if self.about else {}
        entry |= {"left_out": list(self.left_out)} if self.left_out else {}
        return entry | ({"fault": self.fault} if self.fault else {})


def planar(problem: Problem, loops: bool = True) -> Problem:
    """Return the problem with its tables of loads in it, without repetition and expected values."""
    mechanism = problem.mechanism
    if mechanism.dimension != 2:
        raise InputError("variants are those of plane mechanisms", where="dimension")
    loads = {
        name: replace(load, file=None, columns=None, rows=load.points)
        if isinstance(load, TableLoad) and load.file is not None
        else load
        for name, load in mechanism.loads.items()
    }
    mechanism = replace(mechanism, loads=Table(loads))
    problem = replace(problem, mechanism=mechanism, expected=(), pattern=None)
    if loops or mechanism.closure is None:
        return problem
    open_loops = replace(mechanism.closure, loops=Table())  # no loops: it is written by its links
    text = dumps(replace(problem, mechanism=replace(mechanism, closure=open_loops)))
    return from_dict(tomllib.loads(text), problem.name)


def reach(joint: Joint, at: str) -> tuple[str, str]:
    """Return body and point of a joint on one of its sides, ``first`` or ``second``."""
    body, _, point = str(getattr(joint, at)).partition(".")
    return body, point


def made(
    problem: Problem,
    name: str,
    mechanism: Mechanism,
    title: str,
    about: Mapping[str, Any],
    driver: Callable[[Driver], Driver] = lambda driver: driver,
    left_out: tuple[str, ...] = (),
) -> Variant:
    """Return the variant with the tasks that it can have."""
    base = problem.mechanism
    out = list(left_out)
    for word in ("loads", "outputs"):
        for entry, value in getattr(base, word).items():
            table = getattr(mechanism, word).with_(entry, value)
            try:
                tried = replace(mechanism, **{word: table})
                Problem(tried)
            except InputError as error:
                out.append(f"{word}.{entry}: {error.what}")
            else:
                mechanism = tried
    tasks: dict[str, Task] = {}
    for entry, task in problem.tasks.items():
        try:
            changed = _task(task, driver)
            changed = _with_outputs(mechanism, entry, changed, out)
        except InputError as error:
            out.append(f"tasks.{entry}: {error.what}")
        else:
            tasks[entry] = changed
    whole = Problem(
        mechanism,
        Table(tasks),
        name=name,
        title=f"{problem.title}: {title}" if problem.title else title,
        source=problem.source,
    )
    return Variant(name, whole, about, tuple(out))


def _task(task: Task, driver: Callable[[Driver], Driver]) -> Task:
    """Return a task with other drivers, and with the measures by which variants are ranked."""
    if not isinstance(task, Driven):
        raise InputError(f"tasks of kind '{task.kind}' are not kept")
    changes: dict[str, Any] = {"mode": None}
    if task.driver is not None:
        changes["driver"] = driver(task.driver)
    else:
        changes["drivers"] = tuple(driver(given) for given in task.all_drivers)
    if isinstance(task, Sweep) and moves(task):
        changes["measures"] = tuple(dict.fromkeys((*(task.measures or ()), *MEASURES)))
    return replace(task, **changes)


def _with_outputs(mechanism: Mechanism, name: str, task: Task, out: list[str]) -> Task:
    try:
        Problem(mechanism, Table({name: task}))
    except InputError:
        changes: Any = task
        if getattr(task, "outputs", None) is None:
            raise
        bare: Task = replace(changes, outputs=None)
        Problem(mechanism, Table({name: bare}))
        out.append(f"tasks.{name}.outputs")
        return bare
    return task


def moves(task: Sweep) -> bool:
    """Return whether a sweep goes through an interval of one driver, not of the time."""
    if isinstance(task, Modes) or len(task.all_drivers) != 1:
        return False
    only = task.all_drivers[0]
    return only.law is None and only.table is None and (only.at is None or len(only.at) > 1)


def values_of(mechanism: Mechanism, body: str, point: str) -> tuple[float, float]:
    """Return the place of a point in its body [m]."""
    values = mechanism.values()
    return values[f"{body}.{point}.x"], values[f"{body}.{point}.y"]


__all__ = ["GROUND", "Load", "Pose", "Variant", "made", "moves", "planar", "reach", "values_of"]

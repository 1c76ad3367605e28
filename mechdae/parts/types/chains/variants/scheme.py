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
from mechdae.describe.vectors.translation import Translation
from mechdae.errors import InputError
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json


MEASURES = ("envelope", "transmission")
"""What sweeps of variants read off, so that variants can be ranked by it."""


@dataclass(frozen=True)
class Pose:
    """One assembled pose of the mechanism that is varied.

    ``angles`` [rad] of the bodies, ``points`` [m] by ``body.point``, ``slides`` [m] by joint, its
    places on curves too; the ground has the angle 0. ``moving`` are joints whose coordinate changes
    there in the motion.
    """

    angles: Mapping[str, float]
    points: Mapping[str, tuple[float, float]]
    slides: Mapping[str, float]
    moving: tuple[str, ...] = ()


@dataclass(frozen=True)
class Variant:
    """One variant: a problem with the names of the one it was made from.

    Attributes
    ----------
    name
        Fit for a file.
    problem
        Its `Problem`, None where no mechanism can be made of it; ``text`` is its file all the same.
    about, left_out
        What was varied, and what of the problem has no meaning in it.
    fault
        Why it does not assemble, "" where it does.

    Examples
    --------
    >>> variant = next(md.variants(md.four_bar(0.1, 0.04, 0.12, 0.08), "inversion"))
    >>> variant.name, dict(variant.about), variant.fault
    ('fixed-ground', {'fixed': 'ground'}, '')
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
    translation: Translation | None = None,
) -> Variant:
    """Return the variant with the loads, outputs and tasks that it can have.

    ``mechanism`` is without loads and outputs; its sketch is completed by the drivers.
    """
    base = problem.mechanism
    translation = translation or Translation(base, mechanism)
    out: list[str] = []
    changes: dict[str, Callable[[Any], Any]] = {
        "loads": translation.load, "outputs": translation.expression
    }  # fmt: skip
    for word, change in changes.items():
        for entry, value in getattr(base, word).items():
            try:
                table = getattr(mechanism, word).with_(entry, change(value))
                tried = replace(mechanism, **{word: table})
                Problem(tried)
            except InputError as error:
                out.append(f"{word}.{entry}: {error.what}")
            else:
                mechanism = tried
    tasks: dict[str, Task] = {}
    for entry, task in problem.tasks.items():
        try:
            changed = _task(task, translation, f"tasks.{entry}", out)
            mechanism = _sketched(mechanism, changed)
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


def _task(task: Task, translation: Translation, where: str, out: list[str]) -> Task:
    """Return a task with other drivers, and with the measures by which variants are ranked."""
    if not isinstance(task, Driven):
        raise InputError(f"tasks of kind '{task.kind}' are not kept")
    changes: Json = {"mode": None}
    drivers = translation.drivers(task.all_drivers)
    out += [
        f"{where}: {new.coordinate} is driven in place of {old.coordinate}"
        for old, (new, another) in zip(task.all_drivers, drivers, strict=True)
        if another
    ]
    only = tuple(driver for driver, _ in drivers)
    changes |= {"driver": only[0]} if task.driver is not None else {"drivers": only}
    outputs = getattr(task, "outputs", None)
    if outputs is not None:
        changes["outputs"] = translation.outputs(outputs) or None
    if isinstance(task, Sweep) and moves(task):
        changes["measures"] = tuple(dict.fromkeys((*(task.measures or ()), *MEASURES)))
    return replace(task, **changes)


def _sketched(mechanism: Mechanism, task: Any) -> Mechanism:
    """Return the mechanism with the drivers of a task in its sketch, by the links' angles there."""
    more: dict[str, float] = {}
    for given in task.all_drivers:
        joint = mechanism.joints.get(given.coordinate.partition(".")[0])
        if joint is None or given.coordinate != f"{joint.name}.angle":
            continue
        angles = {GROUND: 0.0, **mechanism.sketch}
        if joint.first_body in angles and joint.second_body in angles:
            first, second = (angles[body] for body in (joint.first_body, joint.second_body))
            if isinstance(first, float) and isinstance(second, float):
                more.setdefault(given.coordinate, second - first)
    new = {name: value for name, value in more.items() if name not in mechanism.sketch}
    return replace(mechanism, sketch=Table({**mechanism.sketch, **new})) if new else mechanism


def driver_of(joint: Joint, base: Joint, pose: Pose, throughout: bool) -> Driver:
    """Return a driver of a joint in place of one that has no meaning: throughout, or at the pose.

    ``base`` is that joint in the mechanism of the pose.
    """
    text = f"{joint.name}.{joint.usual}"
    if throughout:
        return Driver(text, range="assembled")
    first, second = (pose.angles.get(body, 0.0) for body in (base.first_body, base.second_body))
    return Driver(text, at=(pose.slides.get(joint.name, second - first),))


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


__all__ = [
    "GROUND",
    "Load",
    "Pose",
    "Translation",
    "Variant",
    "driver_of",
    "made",
    "moves",
    "planar",
    "reach",
    "values_of",
]

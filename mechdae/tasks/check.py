"""Verification of the values a problem file expects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.additions import at_home
from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Expected, Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import InputError, MechdaeError
from mechdae.motion.setup.likely_typos import doubts
from mechdae.records import dataclass
from mechdae.results import KINDS as SECTIONS
from mechdae.results import Result
from mechdae.tasks.dispatch.solve import KINDS
from mechdae.tasks.solve import solve
from mechdae.types import Floats

__all__ = ["Verdict", "check", "doubts", "validate"]

SERIES = (
    *SECTIONS, "efforts", "centres", "bound", "condition", "status",
    "time", "energy", "kinetic", "potential", "drift", "work",
)  # fmt: skip


NEAR = 1e-9
"""Share of a driver's value within which a pose is the one that is meant."""


@dataclass(frozen=True)
class Verdict:
    """One expected value against ours: largest deviation, allowed one, and the sentence."""

    expected: Expected
    value: Any
    deviation: float
    allowed: float
    note: str = ""

    @property
    def met(self) -> bool:
        return not self.note and self.deviation <= self.allowed


def validate(problem: Problem) -> list[MechdaeError]:
    """Return what would stop the problem's tasks: structure, sketch, driver, mode."""
    errors: list[MechdaeError] = []
    if not problem.tasks:
        errors.append(InputError("the file has no [tasks]", where="tasks"))
    for name, task in problem.tasks.items():
        try:
            kind = KINDS.get(task.kind)
            if kind is not None and kind.trial == kind.run:
                solve(problem, name)
            elif kind is not None and kind.trial:
                at_home(kind.trial)(problem, task)
        except MechdaeError as error:
            problem.blame(error)
            if str(error) not in map(str, errors):
                errors.append(error)
    return errors


def check(problem: Problem) -> list[Verdict]:
    """Return a verdict for each ``[[expected]]`` entry of the problem."""
    results: dict[str, Result | MechdaeError] = {}
    known = problem.mechanism.parameter_values
    verdicts = []
    for entry in problem.expected:
        if entry.task not in results:
            try:
                results[entry.task] = solve(problem, entry.task)
            except MechdaeError as error:
                results[entry.task] = error
        result = results[entry.task]
        if isinstance(result, MechdaeError):
            verdicts.append(Verdict(entry, None, np.inf, 0.0, str(result)))
            continue
        try:
            verdicts.append(_verdict(entry, _with_pose(problem, entry, result, known), known))
        except MechdaeError as error:
            verdicts.append(Verdict(entry, None, np.inf, 0.0, str(error)))
    return verdicts


def _with_pose(
    problem: Problem, entry: Expected, result: Result, known: Mapping[str, float]
) -> Result:
    """Return the result, or that of the pose alone which `at` names between those of a sweep."""
    task = problem.task(entry.task)
    if type(task) is not Sweep or entry.at is None or len(result) < 2:
        return result
    moving = [
        (k, series.position)
        for k, series in enumerate(result.drivers.values())
        if np.ptp(series.position) > 0
    ]
    at = evaluate(entry.at, known)
    if len(moving) != 1 or not moving[0][1].min() < at < moving[0][1].max():
        return result
    k, values = moving[0]
    if np.abs(values - at).min() <= NEAR * max(1.0, abs(at)):
        return result
    drivers = list(task.all_drivers)
    drivers[k] = replace(drivers[k], at=(at,), from_=None, to=None, range=None)
    alone = replace(task, driver=None, drivers=tuple(drivers), poses=None)
    return solve(problem, alone)


def _verdict(entry: Expected, result: Result, known: Mapping[str, float]) -> Verdict:
    found = result.value(entry.what)
    if (
        result.whole_path(entry.what).split("/")[0].partition("_")[0] in SERIES
        and isinstance(found, list)
        and not _all_modes(entry, result)
    ):
        found = found[_pose(entry, result, known)]
    if isinstance(found, dict):
        raise InputError(f"{entry.what} is a table; name one of {', '.join(found)}")
    wanted = _numbers(entry.value, known)
    if isinstance(found, bool | str) or isinstance(entry.value, bool):
        met = found == entry.value
        return Verdict(entry, found, 0.0 if met else np.inf, 0.0)
    ours = np.array(found, dtype=float)
    if ours.shape != wanted.shape:
        raise InputError(f"{entry.what} has shape {ours.shape}, expected {wanted.shape}")
    deviation = float(np.max(np.abs(ours - wanted), initial=0.0))
    deviation = deviation if np.isfinite(deviation) else np.inf
    size = float(np.max(np.abs(wanted), initial=0.0))
    allowed = max(float(entry.abs or 0.0), float(entry.rel or 0.0) * size)
    return Verdict(entry, found, deviation, allowed)


def _numbers(value: tuple[float, ...] | float, known: Mapping[str, float]) -> Floats:
    if isinstance(value, tuple):
        return np.array([_numbers(item, known) for item in value], dtype=float)
    if isinstance(value, bool):
        return np.array(0.0)
    if isinstance(value, str | int | float):
        return np.array(evaluate(value, known))
    raise InputError("an expected value is a number or a list of numbers")


def _all_modes(entry: Expected, result: Result) -> bool:
    """Return whether the value lists all assembly modes, in the order of their labels."""
    return result.kind == "modes" and entry.at is None and entry.time is None and len(result) != 1


def _pose(entry: Expected, result: Result, known: Mapping[str, float]) -> int:
    """Return the row of the pose that ``at`` or ``time`` names; the only one without them."""
    drivers = [series.position for series in result.drivers.values()]
    if not drivers and result.time is not None:
        drivers = [result.time]
    position = next((moved for moved in drivers if np.ptp(moved) > 0), drivers[0])
    if entry.time is not None:
        if result.time is None:
            raise InputError(f"{entry.what} has no times: its drivers follow no law")
        position = result.time
    if entry.at is None and entry.time is None:
        if len(position) != 1:
            raise InputError(f"{entry.what} has {len(position)} poses: say which one with 'at'")
        return 0
    named = entry.at if entry.time is None else entry.time
    assert named is not None
    at = evaluate(named, known)
    row = int(np.argmin(np.abs(position - at)))
    if abs(position[row] - at) > NEAR * max(1.0, abs(at)):
        raise InputError(f"no pose at {at:.12g}, the nearest is at {position[row]:.12g}")
    return row

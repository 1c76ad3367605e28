"""One number of a motion's time history, as a path: `last/outputs/x/value`, `peak/efforts/...`.

Between the states of a result a series is a polynomial: a Hermite polynomial of order five where
rates and accelerations are known, of order seven through eight states where they are not.
A second polynomial of lower order says how far the number may be off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.problem import Problem
from mechdae.describe.series_units import path_unit
from mechdae.describe.tasks.kinds import Sweep, Task
from mechdae.describe.tasks.motion import Equilibrium, Motion
from mechdae.errors import InputError, UnknownName
from mechdae.numerics.roots import halved
from mechdae.results import Result
from mechdae.types import Floats

FIGURES = {
    "last": "the value at the end",
    "highest": "the largest value",
    "lowest": "the smallest value",
    "peak": "the largest magnitude, of vectors the largest length",
    "fluctuation": "the largest less the smallest value, as a share of their mean",
    "settling": "the time after which the value stays within 2 % of its way to the last one",
}
"""First steps of paths that give one number of a time history."""
BAND = 0.02
"""Share of the largest distance from the last value that counts as settled."""
STATES = 2001
"""States of a motion that a figure is read from, unless the task names its own."""
SMOOTH = 1e-3
"""Share of the range by which two polynomials may differ: beside a jump the states are trusted."""
HALVINGS = 60
GOLDEN = (3 - 5**0.5) / 2
RATES = {
    "value": ("rate", "second"),
    "position": ("velocity", "acceleration"),
    "angle": ("angular_velocity", "angular_acceleration"),
    "slide": ("slide_velocity", "slide_acceleration"),
    "s": ("s_velocity", "s_acceleration"),
}
"""Rates of a series by the last step of its path."""


def is_figure(path: str) -> bool:
    """Return whether a path asks for one number of a time history."""
    return path.partition("/")[0] in FIGURES


def bases(problem: Problem) -> dict[str, Sweep | Motion | Equilibrium]:
    """Return the tasks that studies and sensitivities may be of."""
    kinds = Sweep | Motion | Equilibrium
    return {name: task for name, task in problem.tasks.items() if isinstance(task, kinds)}


def base_of(
    problem: Problem, name: str | None, what: str
) -> tuple[str, Sweep | Motion | Equilibrium]:
    """Return the task of that name; without one the only one there is, sweeps first."""
    known = bases(problem)
    if name is None:
        sweeps = {name: task for name, task in known.items() if isinstance(task, Sweep)}
        chosen = sweeps or known
        if len(chosen) != 1:
            raise InputError(f"say which task is {what}", where="of", hint=", ".join(known))
        return next(iter(chosen.items()))
    if name not in known:
        if name in problem.tasks:
            kind = problem.tasks[name].kind
            raise InputError(
                f"'{name}' is a task of kind {kind}: {what} are sweeps, reactions, motions and "
                f"equilibria",
                where="of", hint=", ".join(known),
            )  # fmt: skip
        raise UnknownName("task", name, known, where="of")
    return name, known[name]


def units_of(
    problem: Problem, name: str, parameters: Iterable[str], paths: Iterable[str]
) -> dict[str, str]:
    """Return the units of parameters and of paths of a task, as far as they are known."""
    mechanism = problem.mechanism
    given = parameter_units(mechanism, problem.tasks.values()) | parameter_units(mechanism)
    moving = getattr(problem.tasks[name], "moving_drivers", ())
    along = moving[0].coordinate if moving else ""
    found = {key: given.get(key, "") for key in parameters}
    found |= {path: path_unit(mechanism, path, along) for path in paths}
    return {key: unit for key, unit in found.items() if unit}


def prepared(problem: Problem, name: str, paths: tuple[str, ...]) -> Problem:
    """Return the problem with states enough for the figures that are asked for."""
    task: Task = problem.tasks[name]
    figures = [path for path in paths if is_figure(path) and not path.startswith("last/")]
    if not figures or not isinstance(task, Motion) or task.at is not None or task.poses is not None:
        return problem
    return problem.with_task(name, replace(task, poses=STATES))


def value(result: Result, path: str) -> list[float] | float:
    """Return what a path of a result says, plain data; of a figure the number alone."""
    return figure(result, path)[0] if is_figure(path) else result.value(path)


def figure(result: Result, path: str) -> tuple[float, float]:
    """Return a figure and how far it may be off."""
    word, _, rest = path.partition("/")
    if result.time is None:
        raise InputError(
            f"'{word}' needs a motion: {result.task} has no time history", where="outputs"
        )
    whole = result.whole_path(rest)
    given = result.value(whole)
    try:
        series = np.array(given, float)
    except (TypeError, ValueError):
        raise InputError(f"{rest} is no series over the time", where="outputs") from None
    if series.shape[:1] != result.time.shape:
        raise InputError(f"{rest} is no series over the time", where="outputs")
    if word == "last":
        return (series[-1].tolist() if series.ndim > 1 else float(series[-1])), 0.0
    course = SeriesBetween(result.time, *_with_rates(result, whole, series))
    if word == "settling":
        return _settling(course)
    if word == "peak":
        return _extreme(course, lambda y: float(np.linalg.norm(y)), 1)
    if series.ndim > 1:
        raise InputError(f"'{word}' needs one number at each time, {rest} is a vector")
    if word == "fluctuation":
        return _fluctuation(course)
    return _extreme(course, lambda y: float(y[0]), 1 if word == "highest" else -1)


def _fluctuation(course: SeriesBetween) -> tuple[float, float]:
    """Return (highest - lowest) over the mean of both, and its error."""
    (high, above), (low, below) = (_extreme(course, lambda y: float(y[0]), s) for s in (1, -1))
    mean = (high + low) / 2
    if mean == 0:
        raise InputError("the mean of highest and lowest value is zero", where="outputs")
    return (high - low) / abs(mean), (above + below) / abs(mean) * (1 + (high - low) / abs(mean))


def _with_rates(result: Result, path: str, series: Floats) -> tuple[Floats, Any]:
    """Return a series (n, k), and its rates and accelerations (2, n, k) where they are known."""
    flat = series.reshape(len(series), -1)
    head, _, last = path.rpartition("/")
    if last not in RATES or path.startswith("efforts"):
        return flat, None
    around = result.value(head)
    words = RATES[last]
    if not isinstance(around, Mapping) or not all(word in around for word in words):
        return flat, None
    rates = [np.array(around[word], float).reshape(flat.shape) for word in words]
    return flat, np.array(rates)


class SeriesBetween:
    """A series between its states.

    `t`, `y`, `rates`: times (n,), values (n, k), first and second derivatives (2, n, k) or None.
    """

    def __init__(self, t: Floats, y: Floats, rates: Any) -> None:
        remaining = np.concatenate([[True], np.diff(t) > 0]) & np.isfinite(y).all(axis=1)
        if rates is not None:
            rates = rates[:, remaining]
            rates = rates if np.isfinite(rates).all() else None
        self.t, self.y, self.rates = t[remaining], y[remaining], rates

    def __call__(self, i: int, t: float, coarse: bool = False) -> Any:
        """Return the value (k,) at a time between states i and i + 1; `coarse` of lower order."""
        if self.rates is None:
            width = min(6 if coarse else 8, len(self.t))
            first = min(max(i - width // 2 + 1, 0), len(self.t) - width)
            window = slice(first, first + width)
            return _lagrange(self.t[window], self.y[window], t)
        h = self.t[i + 1] - self.t[i]
        s = (t - self.t[i]) / h
        v = self.rates[0] * h
        y0, y1, v0, v1 = self.y[i], self.y[i + 1], v[i], v[i + 1]
        cubic = y0 + s * (v0 + s * (3 * (y1 - y0) - 2 * v0 - v1 + s * (2 * (y0 - y1) + v0 + v1)))
        if coarse:
            return cubic
        a0, a1 = (self.rates[1][k] * h * h for k in (i, i + 1))
        return cubic + s * s * (1 - s) ** 2 * self._rest((y0, y1, v0, v1, a0, a1), s)

    @staticmethod
    def _rest(ends: tuple[Any, ...], s: float) -> Any:
        """Return what accelerations at both ends add to the cubic, over s^2 (1 - s)^2."""
        y0, y1, v0, v1, a0, a1 = ends
        first = (a0 - (6 * (y1 - y0) - 4 * v0 - 2 * v1)) / 2
        second = (a1 - (6 * (y0 - y1) + 2 * v0 + 4 * v1)) / 2
        return first * (1 - s) + second * s


def _lagrange(t: Floats, y: Floats, at: float) -> Floats:
    """Return the polynomial through a few states at a time."""
    total = np.zeros(y.shape[1])
    for j in range(len(t)):
        others = np.delete(t, j)
        total += y[j] * np.prod((at - others) / (t[j] - others))
    return total


def _extreme(
    course: SeriesBetween, size: Callable[[Any], float], sense: int
) -> tuple[float, float]:
    """Return the largest (sense 1) or smallest size over the time, and its error."""
    sizes = sense * np.array([size(y) for y in course.y])
    k = int(np.argmax(sizes))
    best, error = float(sizes[k]), 0.0
    for i in (k - 1, k):
        if not 0 <= i < len(course.t) - 1:
            continue
        low, high = course.t[i], course.t[i + 1]
        for _ in range(HALVINGS):
            a, b = (low + share * (high - low) for share in (GOLDEN, 1 - GOLDEN))
            if sense * size(course(i, a)) > sense * size(course(i, b)):
                high = b
            else:
                low = a
        place = (low + high) / 2
        found = sense * size(course(i, place))
        gap = abs(found - sense * size(course(i, place, coarse=True)))
        if found > best:
            smooth = gap <= SMOOTH * float(np.ptp(sizes))
            best, error = (found, gap) if smooth else (best, max(error, found - best))
    return sense * best, error


def _settling(course: SeriesBetween) -> tuple[float, float]:
    """Return the time after which the distance from the last value stays within the band."""
    last = course.y[-1]
    far = np.linalg.norm(course.y - last, axis=1)
    band = BAND * float(far.max())
    outside = np.flatnonzero(far > band)
    if not len(outside):
        return 0.0, 0.0
    i = int(outside[-1])
    found = []
    for coarse in (False, True):

        def beyond(t: float, coarse: bool = coarse) -> bool:
            return float(np.linalg.norm(course(i, t, coarse) - last)) > band

        low, high = halved(beyond, course.t[i], course.t[i + 1])
        found.append((low + high) / 2)
    return float(found[0]), float(abs(found[0] - found[1]))

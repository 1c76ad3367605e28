"""Goals of a synthesis: what a mechanism must do, as frozen values.

The tables of the task arrive with their units resolved (SI, radians); here they are checked
against the mechanism, each error with its key path.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import evaluate
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.entries import (
    flag,
    items_of,
    kind_of,
    number,
    numbers,
    rows_of,
    tuple_of,
    word_of,
)
from mechdae.describe.tasks.kinds import Equilibrium, Motion, Sweep, Task
from mechdae.errors import InputError, MechdaeError, UnknownName

KEYS = ("input_start", "output_start")
TIMING = ("timing", "at", "steps", "closed", "measure")
GOALS: dict[str, tuple[str, ...]] = {
    "path": ("point", "targets", *TIMING, "weight"),
    "motion": ("body", "poses", *TIMING, "weight"),
    "function": (
        "input", "output", "function", "range", "input_range", "output_range", "input_start",
        "output_start", "targets", "measure", "weight",
    ),
    "rocker": ("body", "swing", "joint", "stroke", "time_ratio", "weight"),
    "straight-line": ("point", "arc", "stroke", "measure", "weight"),
    "minimise": ("of", "reduce", "weight"),
    "maximise": ("of", "reduce", "weight"),
}  # fmt: skip
"""Kinds of goals with their keys."""
MEASURES = ("least-squares", "exact", "minimax")
REDUCTIONS = ("mean", "peak", "rms", "least")


@dataclass(frozen=True)
class Visits:
    """A point visits targets (k, 2) [m], or a body poses (k, 3) [m, rad].

    ``timing`` is "free" (in order within a turn), "any" (in any order), "absolute" (values of
    the driver in ``programme``) or "steps" (increments from a free start). A ``closed`` path
    that names its first target again at the end visits it once, with double weight.
    """

    what: str
    targets: tuple[tuple[float, ...], ...]
    timing: str
    programme: tuple[float, ...]
    closed: bool
    weights: tuple[float, ...]
    measure: str

    @property
    def is_motion(self) -> bool:
        """Poses of a body, not places of a point."""
        return len(self.targets[0]) == 3


@dataclass(frozen=True)
class FunctionTargets:
    """An output coordinate follows a function of the input.

    ``points`` are pairs (input, output) [SI], or ``function`` over its ``interval`` with the
    ``spans`` of input and output that the intervals of x and y are drawn on; starts are numbers,
    names of free parameters, or None: free.
    """

    output: str
    function: str
    interval: tuple[float, float]
    points: tuple[tuple[float, ...], ...]
    spans: tuple[float, float]
    input_start: float | str | None
    output_start: float | str | None
    measure: str
    nodes: int = 41

    def scales(self, shares: Sequence[float]) -> tuple[list[float], list[float]]:
        """Return input and output from their starts, at shares of the interval."""
        if self.points:
            x0, y0 = self.points[0]
            return [x - x0 for x, _ in self.points], [y - y0 for _, y in self.points]
        low, high = self.interval
        first, last = (self.value(x) for x in self.interval)
        xs = [low + (high - low) * share for share in shares]
        inputs = [self.spans[0] * (x - low) / (high - low) for x in xs]
        outputs = [self.spans[1] * (self.value(x) - first) / (last - first) for x in xs]
        return inputs, outputs

    def value(self, x: float) -> float:
        """Return the function at a place of its interval."""
        return evaluate(self.function, {"x": x})


@dataclass(frozen=True)
class Rocker:
    """A coordinate goes to and fro: a body's angle [rad] or the slide of a joint [m].

    ``reach`` is the way between its ends, ``time_ratio`` that of the times of both strokes;
    None: free.
    """

    coordinate: str
    reach: float | None
    time_ratio: float | None


@dataclass(frozen=True)
class StraightLine:
    """A point follows a straight line while the driver runs over an arc [rad].

    ``stroke`` [m] is its way along the line, None: free.
    """

    point: str
    arc: float
    stroke: float | None = None
    nodes: int = 61


@dataclass(frozen=True)
class Extreme:
    """A quantity of another task is smallest (``sense`` 1) or largest (-1).

    ``path`` is the slash path below the task, ``reduce`` what becomes of its values over the
    task's poses.
    """

    sense: int
    task: str
    path: str
    reduce: str


Goal = Visits | FunctionTargets | Rocker | StraightLine | Extreme


def goal_of(
    mechanism: Mechanism,
    table: Any,
    place: str,
    driver: str,
    free: Sequence[str],
    tasks: Mapping[str, Task],
) -> Goal:
    """Return a goal.

    Parameters
    ----------
    driver, free
        NamedCoordinate of the driver, names of free parameters.
    tasks
        All tasks of the problem, for goals about a quantity of one of them.

    Raises
    ------
    InputError, UnknownName
        A key that is missing, unknown, or does not fit the mechanism.
    """
    kind = kind_of(table, place, GOALS, "goal")
    if kind in ("path", "motion"):
        return _visits(mechanism, table, place, kind)
    if kind == "function":
        return _function(mechanism, table, place, driver, free)
    if kind == "rocker":
        return _rocker(mechanism, table, place)
    if kind == "straight-line":
        arc = _needed(mechanism, table, "arc", place)
        if not 0 < abs(arc) <= 2 * math.pi:
            raise InputError("an arc within a turn is needed", where=f"{place}.arc")
        word_of(table.get("measure", "minimax"), ("minimax",), "measure", f"{place}.measure")
        stroke = _needed(mechanism, table, "stroke", place) if "stroke" in table else None
        if stroke is not None and stroke <= 0:
            raise InputError("a stroke is positive", where=f"{place}.stroke")
        return StraightLine(_point(mechanism, table, place), arc, stroke)
    return extreme(table, place, tasks, 1 if kind == "minimise" else -1)


def _rocker(mechanism: Mechanism, table: Mapping[str, Any], place: str) -> Rocker:
    slides = "joint" in table or "stroke" in table
    if slides and ("body" in table or "swing" in table):
        raise InputError(
            "give 'body' and 'swing' of what turns, or 'joint' and 'stroke' of what slides",
            where=place,
        )
    key = "stroke" if slides else "swing"
    reach = _needed(mechanism, table, key, place) if key in table else None
    ratio = _needed(mechanism, table, "time_ratio", place) if "time_ratio" in table else None
    if reach is None and ratio is None:
        raise InputError(f"'{key}' or 'time_ratio' is missing", where=place)
    if ratio is not None and not 0.1 < ratio < 10:
        raise InputError("a ratio of 0.1 to 10 is needed", where=f"{place}.time_ratio")
    if reach is not None and not 0 < reach < (math.inf if slides else 2 * math.pi):
        words = "a stroke is positive" if slides else "a swing within a turn is needed"
        raise InputError(words, where=f"{place}.{key}")
    if not slides:
        return Rocker(f"{_body(mechanism, table, place)}.angle", reach, ratio)
    known = [name for name, joint in mechanism.joints.items() if joint.slides]
    name = word_of(table.get("joint"), known, "joint that slides", f"{place}.joint")
    return Rocker(f"{name}.slide", reach, ratio)


def extreme(table: Mapping[str, Any], place: str, tasks: Mapping[str, Task], sense: int) -> Extreme:
    """Return a quantity of another task: ``of = "TASK/PATH"``."""
    task, _, path = str(table.get("of", "")).partition("/")
    kinds = Sweep | Motion | Equilibrium
    known = [name for name, other in tasks.items() if isinstance(other, kinds)]
    if task not in known:
        what = "sweep, reactions, motion or equilibrium task"
        raise UnknownName(what, task, known, where=f"{place}.of")
    if not path:
        raise InputError('TASK/PATH is needed, as "cycle/joints/A/loss"', where=f"{place}.of")
    if isinstance(tasks[task], Motion | Equilibrium) and "reduce" in table:
        raise InputError(
            f"a path of {task} is one number, there is nothing to reduce",
            where=f"{place}.reduce",
            hint='of = "TASK/peak/PATH", last, highest, lowest or settling',
        )
    reduce = table.get("reduce", "peak" if sense > 0 else "least")
    return Extreme(sense, task, path, word_of(reduce, REDUCTIONS, "word", f"{place}.reduce"))


def _needed(mechanism: Mechanism, table: Mapping[str, Any], key: str, place: str) -> float:
    if key not in table:
        raise InputError(f"the key '{key}' is missing", where=place)
    return number(mechanism, table[key], f"{place}.{key}")


def _point(mechanism: Mechanism, table: Mapping[str, Any], place: str) -> str:
    known = [f"{b}.{p}" for b, body in mechanism.bodies.items() for p in body.points]
    return word_of(table.get("point"), known, "point", f"{place}.point")


def _body(mechanism: Mechanism, table: Mapping[str, Any], place: str) -> str:
    return word_of(table.get("body"), list(mechanism.bodies), "body", f"{place}.body")


def _visits(mechanism: Mechanism, table: Mapping[str, Any], place: str, kind: str) -> Visits:
    if kind == "path":
        what = _point(mechanism, table, place)
        rows = rows_of(mechanism, table.get("targets"), 2, 2, f"{place}.targets")
    else:
        what = _body(mechanism, table, place)
        rows = rows_of(mechanism, table.get("poses"), 3, 2, f"{place}.poses")
    if len({row[:2] for row in rows}) == 1:
        key = "targets" if kind == "path" else "poses"
        raise InputError("all targets are at one place", where=f"{place}.{key}")
    measure = word_of(
        table.get("measure", "least-squares"), MEASURES, "measure", f"{place}.measure"
    )
    closed = flag(table.get("closed", False), f"{place}.closed")
    timing, programme = _timing(mechanism, table, place, len(rows))
    weights = [1.0] * len(rows)
    if closed and timing == "free" and rows[0] == rows[-1]:
        rows, weights = rows[:-1], [2.0, *weights[1:-1]]
    return Visits(what, rows, timing, programme, closed, tuple(weights), measure)


def _timing(
    mechanism: Mechanism, table: Mapping[str, Any], place: str, count: int
) -> tuple[str, tuple[float, ...]]:
    given = [key for key in ("timing", "at", "steps") if key in table]
    if len(given) > 1:
        raise InputError(f"'{given[0]}' and '{given[1]}' are given, one is needed", where=place)
    if not given or given[0] == "timing":
        words = ["free", "any"]
        return word_of(table.get("timing", "free"), words, "timing", f"{place}.timing"), ()
    key = given[0]
    values = numbers(mechanism, table[key], f"{place}.{key}")
    if len(values) != count:
        raise InputError(f"{len(values)} values for {count} targets", where=f"{place}.{key}")
    return ("absolute" if key == "at" else "steps"), values


def _function(
    mechanism: Mechanism, table: Mapping[str, Any], place: str, driver: str, free: Sequence[str]
) -> FunctionTargets:
    word_of(table.get("input", driver), [driver], "coordinate", f"{place}.input")
    try:
        output = coordinate(mechanism, str(table.get("output", ""))).text
    except MechdaeError as problem:
        raise problem.inside(f"{place}.output") from None
    if ("targets" in table) == ("function" in table):
        raise InputError("give either 'function' or 'targets'", where=place)
    measures = ("least-squares", "minimax")
    measure = word_of(
        table.get("measure", "least-squares"), measures, "measure", f"{place}.measure"
    )

    def start(key: str) -> float | str | None:
        value = table.get(key)
        if value is None or (isinstance(value, str) and value in free):
            return value
        return number(mechanism, value, f"{place}.{key}")

    starts = (start("input_start"), start("output_start"))
    if "targets" in table:
        points = rows_of(mechanism, table["targets"], 2, 2, f"{place}.targets")
        # targets are values of the coordinates themselves, unless a start says otherwise
        own = tuple(
            given if key in table else points[0][k]
            for k, (key, given) in enumerate(zip(KEYS, starts, strict=True))
        )
        return FunctionTargets(
            output, "", (0.0, 1.0), points, (0.0, 0.0), own[0], own[1], measure, len(points)
        )
    low, high = tuple_of(mechanism, table.get("range"), 2, f"{place}.range")
    spans = [_needed(mechanism, table, key, place) for key in ("input_range", "output_range")]
    found = FunctionTargets(
        output, str(table["function"]), (low, high), (), (spans[0], spans[1]), *starts, measure
    )
    try:
        ends = [found.value(x) for x in (low, high)]
    except MechdaeError as problem:
        raise problem.inside(f"{place}.function") from None
    if low == high or ends[0] == ends[1]:
        raise InputError("the function takes the same value at both ends of its range", where=place)
    return found


def listed_goals(task: Any) -> list[tuple[Any, str]]:
    """Return the tables of the goals with their key paths."""
    if (task.goal is None) == (task.goals is None):
        raise InputError("give either 'goal' or 'goals'", where="goal")
    if task.goal is not None:
        return [(task.goal, "goal")]
    return [(table, f"goals[{i}]") for i, table in enumerate(items_of(task.goals, "goals"))]

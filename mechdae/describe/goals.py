"""What a task of synthesis asks for: goals, freedoms and constraints as frozen values.

The tables of the task arrive with their units resolved (SI, radians); here they are checked
against the mechanism, each error with its key path.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import evaluate
from mechdae.describe.mechanism import Mechanism, evaluate_all
from mechdae.describe.tasks import Synthesis
from mechdae.errors import InputError, MechdaeError, UnavailableError, UnknownName

GOALS = {
    "path": ("point", "targets", "timing", "at", "steps", "closed", "measure", "weight"),
    "function": (
        "input", "output", "function", "range", "input_range", "output_range", "input_start",
        "output_start", "targets", "measure", "weight",
    ),
}  # fmt: skip
"""Kinds of goals that are computed, with their keys."""
PLANNED = ("motion", "rocker", "straight-line", "minimise", "maximise")
CONSTRAINTS = {
    "full-turn": ("coordinate", "margin"),
    "transmission-angle": ("between", "min"),
}
MEASURES = ("least-squares",)
LATER_MEASURES = ("exact", "minimax")


@dataclass(frozen=True)
class PathTargets:
    """A point visits targets (k, 2) [m].

    ``timing`` is "free" (in order within a turn), "absolute" (values of the driver in
    ``programme``) or "steps" (increments from a free start). A ``closed`` path that names its
    first target again at the end visits it once, with double weight.
    """

    point: str
    targets: tuple[tuple[float, float], ...]
    timing: str
    programme: tuple[float, ...]
    closed: bool
    weights: tuple[float, ...]


@dataclass(frozen=True)
class FunctionTargets:
    """An output coordinate follows a function of the input.

    ``points`` are pairs (x, y) of ``function`` over its interval, or those given; ``spans`` the
    ranges of input and output [rad, m] that the intervals of x and y are drawn on; starts are
    numbers, names of free parameters, or None: free.
    """

    output: str
    function: str
    interval: tuple[float, float]
    points: tuple[tuple[float, float], ...]
    spans: tuple[float, float]
    input_start: float | str | None
    output_start: float | str | None
    measure: str
    nodes: int = 41

    def scales(self, share: Any) -> tuple[Any, Any]:
        """Return input and output from their starts at shares (n,) of the interval."""
        import math

        if self.points:
            x0, y0 = self.points[0]
            return [x - x0 for x, _ in self.points], [y - y0 for _, y in self.points]
        low, high = self.interval
        xs = [low + (high - low) * float(part) for part in share]
        ends = [self._value(x) for x in self.interval]
        assert math.isfinite(ends[0]) and math.isfinite(ends[1])
        inputs = [self.spans[0] * (x - low) / (high - low) for x in xs]
        outputs = [self.spans[1] * (self._value(x) - ends[0]) / (ends[1] - ends[0]) for x in xs]
        return inputs, outputs

    def _value(self, x: float) -> float:
        return evaluate(self.function, {"x": x})


@dataclass(frozen=True)
class Demand:
    """Everything a task of synthesis asks for.

    ``free`` has (low, high) by name; ``full_turn`` whether the driver turns fully, ``margin``
    of its inequalities [m], ``transmission`` the least transmission angle [rad].
    """

    driver: str
    goal: PathTargets | FunctionTargets
    free: dict[str, tuple[float, float]]
    full_turn: bool
    margin: float
    transmission: float
    starts: int
    seed: int


def demand(mechanism: Mechanism, task: Synthesis) -> Demand:
    """Return what the task asks for.

    Raises
    ------
    InputError, UnknownName
        A key that is missing, unknown, or does not fit the mechanism.
    UnavailableError
        A goal or constraint that this version does not compute.
    """
    driver = _driver(mechanism, task)
    goal = _goal(mechanism, task)
    free = _free(mechanism, task)
    full, margin, angle = False, 1e-6, 0.0
    for i, entry in enumerate(_list(task.constraints, "constraints")):
        place = f"constraints[{i}]"
        kind = _kind(entry, place, CONSTRAINTS, "constraint")
        if kind == "full-turn":
            _same(entry.get("coordinate", driver), driver, f"{place}.coordinate")
            full, margin = True, _number(mechanism, entry.get("margin", 1e-6), f"{place}.margin")
        else:
            for body in _list(entry.get("between"), f"{place}.between"):
                if body not in mechanism.bodies:
                    raise UnknownName("body", str(body), mechanism.bodies, where=f"{place}.between")
            angle = _number(mechanism, entry.get("min", 0.0), f"{place}.min")
    return Demand(driver, goal, free, full, margin, angle, task.starts or 40, task.seed or 0)


def _driver(mechanism: Mechanism, task: Synthesis) -> str:
    table = task.driver
    if not isinstance(table, Mapping) or "coordinate" not in table:
        raise InputError("driver = { coordinate = ... } is needed", where="driver")
    for entry in table:
        if entry != "coordinate":
            raise UnknownName("key", str(entry), ["coordinate"], where="driver")
    try:
        return coordinate(mechanism, str(table["coordinate"])).text
    except MechdaeError as problem:
        raise problem.inside("driver.coordinate") from None


def _goal(mechanism: Mechanism, task: Synthesis) -> PathTargets | FunctionTargets:
    if (task.goal is None) == (task.goals is None):
        raise InputError("give either 'goal' or 'goals'", where="goal")
    if task.goals is not None:
        if len(_list(task.goals, "goals")) != 1:
            raise UnavailableError("several goals are not computed by this version", where="goals")
        table, place = task.goals[0], "goals[0]"
    else:
        table, place = task.goal, "goal"
    if _kind(table, place, GOALS, "goal", PLANNED) == "function":
        return _function(mechanism, task, table, place)
    return _path(mechanism, table, place)


def _function(
    mechanism: Mechanism, task: Synthesis, table: Mapping[str, Any], place: str
) -> FunctionTargets:
    driver = _driver(mechanism, task)
    _same(table.get("input", driver), driver, f"{place}.input")
    try:
        output = coordinate(mechanism, str(table.get("output", ""))).text
    except MechdaeError as problem:
        raise problem.inside(f"{place}.output") from None
    if ("targets" in table) == ("function" in table):
        raise InputError("give either 'function' or 'targets'", where=place)
    measure = table.get("measure", "least-squares")
    if measure not in ("least-squares", "minimax"):
        raise UnknownName(
            "measure", str(measure), ["least-squares", "minimax"], where=f"{place}.measure"
        )
    starts = [
        _start(mechanism, task, table, place, f"{word}_start") for word in ("input", "output")
    ]
    if "targets" in table:
        points = _pairs(mechanism, table["targets"], f"{place}.targets")
        return FunctionTargets(
            output, "", (0.0, 1.0), points, (0.0, 0.0), *starts, measure, len(points)
        )
    text = table["function"]
    interval = _pair(mechanism, table.get("range"), f"{place}.range")
    spans = []
    for word in ("input_range", "output_range"):
        if word not in table:
            raise InputError(f"the key '{word}' is missing", where=place)
        spans.append(_number(mechanism, table[word], f"{place}.{word}"))
    for x in interval:
        try:
            evaluate(str(text), {"x": x})
        except MechdaeError as problem:
            raise problem.inside(f"{place}.function") from None
    return FunctionTargets(output, str(text), interval, (), (spans[0], spans[1]), *starts, measure)


def _start(
    mechanism: Mechanism, task: Synthesis, table: Mapping[str, Any], place: str, word: str
) -> float | str | None:
    value = table.get(word)
    if value is None:
        return None
    if isinstance(value, str) and isinstance(task.free, Mapping) and value in task.free:
        return value
    return _number(mechanism, value, f"{place}.{word}")


def _pair(mechanism: Mechanism, value: Any, place: str) -> tuple[float, float]:
    items = _list(value, place)
    if len(items) != 2:
        raise InputError("two numbers [a, b] are needed", where=place)
    return _number(mechanism, items[0], place), _number(mechanism, items[1], place)


def _pairs(mechanism: Mechanism, value: Any, place: str) -> tuple[tuple[float, float], ...]:
    found = [_pair(mechanism, item, f"{place}[{i}]") for i, item in enumerate(_list(value, place))]
    if len(found) < 2:
        raise InputError("two targets at least are needed", where=place)
    return tuple(found)


def _path(mechanism: Mechanism, table: Mapping[str, Any], place: str) -> PathTargets:
    point = table.get("point")
    known = [f"{b}.{p}" for b, body in mechanism.bodies.items() for p in body.points]
    if point not in known:
        raise UnknownName("point", str(point), known, where=f"{place}.point")
    measure = table.get("measure", "least-squares")
    if measure in LATER_MEASURES:
        raise UnavailableError(
            f"measure '{measure}' is not computed by this version", where=f"{place}.measure"
        )
    if measure not in MEASURES:
        raise UnknownName("measure", str(measure), MEASURES, where=f"{place}.measure")
    targets = list(_pairs(mechanism, table.get("targets"), f"{place}.targets"))
    closed = table.get("closed", False)
    if not isinstance(closed, bool):
        raise InputError("true or false is needed", where=f"{place}.closed")
    weights = [1.0] * len(targets)
    timing, programme = _timing(mechanism, table, place, len(targets))
    if closed and timing == "free" and targets[0] == targets[-1]:
        targets.pop()
        weights.pop()
        weights[0] = 2.0
    return PathTargets(str(point), tuple(targets), timing, programme, closed, tuple(weights))


def _timing(
    mechanism: Mechanism, table: Mapping[str, Any], place: str, count: int
) -> tuple[str, tuple[float, ...]]:
    given = [key for key in ("timing", "at", "steps") if key in table]
    if len(given) > 1:
        raise InputError(f"'{given[0]}' and '{given[1]}' are given, one is needed", where=place)
    if not given or given[0] == "timing":
        if table.get("timing", "free") != "free":
            raise UnknownName("timing", str(table["timing"]), ["free"], where=f"{place}.timing")
        return "free", ()
    key = given[0]
    values = tuple(
        _number(mechanism, item, f"{place}.{key}[{i}]")
        for i, item in enumerate(_list(table[key], f"{place}.{key}"))
    )
    if len(values) != count:
        raise InputError(f"{len(values)} values for {count} targets", where=f"{place}.{key}")
    return ("absolute" if key == "at" else "steps"), values


def _free(mechanism: Mechanism, task: Synthesis) -> dict[str, tuple[float, float]]:
    if not isinstance(task.free, Mapping) or not task.free:
        raise InputError("free = { name = [low, high], ... } is needed", where="free")
    values = mechanism.values()
    found = {}
    for name, bounds in task.free.items():
        place = f"free.{name}"
        if isinstance(bounds, Mapping):
            raise UnavailableError(
                "ratios, polygons and discs are not computed by this version", where=place
            )
        if name not in values:
            raise UnknownName("parameter", name, values, where="free")
        pair = _list(bounds, place)
        if len(pair) != 2:
            raise InputError("[low, high] is needed", where=place)
        low, high = (_number(mechanism, item, place) for item in pair)
        if low >= high:
            raise InputError(f"the bounds leave nothing: {low:g} to {high:g}", where=place)
        found[name] = (low, high)
    return found


def _kind(
    table: Any, place: str, kinds: Mapping[str, Sequence[str]], word: str,
    planned: Sequence[str] = (),
) -> str:  # fmt: skip
    if not isinstance(table, Mapping):
        raise InputError("a table is needed", where=place)
    kind = str(table.get("kind", ""))
    if kind in planned:
        raise UnavailableError(
            f"{word}s of kind '{kind}' are not computed by this version", where=f"{place}.kind"
        )
    if kind not in kinds:
        raise UnknownName(f"kind of {word}", kind, [*kinds, *planned], where=f"{place}.kind")
    for entry in table:
        if entry not in ("kind", *kinds[kind]):
            raise UnknownName("key", str(entry), kinds[kind], where=place)
    return kind


def _list(value: Any, place: str) -> Sequence[Any]:
    if value is None:
        return ()
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InputError("a list is needed", where=place)
    return value


def _number(mechanism: Mechanism, value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise InputError("a number or an expression is needed", where=place)
    try:
        return evaluate(value, evaluate_all(mechanism.parameters))
    except MechdaeError as problem:
        raise problem.inside(place) from None


def _same(value: Any, wanted: str, place: str) -> None:
    if value != wanted:
        raise UnknownName("coordinate", str(value), [wanted], where=place)

"""What a task of synthesis asks for: goals with weights, freedoms, constraints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mechdae.describe.coordinates import coordinate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.entries import (
    check_keys,
    items_of,
    kind_of,
    number,
    rows_of,
    tuple_of,
    word_of,
)
from mechdae.describe.tasks.goals import Extreme, Goal, extreme, goal_of, listed_goals
from mechdae.describe.tasks.kinds import Synthesis
from mechdae.errors import InputError, MechdaeError, UnknownName

CONSTRAINTS: dict[str, tuple[str, ...]] = {
    "full-turn": ("coordinate", "margin"),
    "transmission-angle": ("between", "min", "over"),
    "box": ("points", "x", "y"),
    "ratio": ("of", "max"),
    "limit": ("of", "min", "max", "reduce"),
}
STARTS = 40
KEEP = 5
"""Designs that are reported where the task does not say how many."""
Bounds = tuple[float, float]


@dataclass(frozen=True)
class Region:
    """A convex polygon (k, 2) or a disc (x, y, r) that a point of the ground stays in [m]."""

    point: str
    polygon: tuple[tuple[float, ...], ...] = ()
    disc: tuple[float, ...] = ()


@dataclass(frozen=True)
class Box:
    """Points stay between bounds [m] while the mechanism moves."""

    points: tuple[str, ...]
    x: Bounds
    y: Bounds


@dataclass(frozen=True)
class Ratio:
    """One parameter is at most so many times another."""

    first: str
    second: str
    most: float


@dataclass(frozen=True)
class Limit:
    """A quantity of another task stays between bounds at all of its poses."""

    of: Extreme
    low: float
    high: float


@dataclass(frozen=True)
class Transmission:
    """The transmission angle of the dyad that two bodies belong to is no less than this [rad].

    Over the whole turn of a driver that makes one, or at the ``poses`` of the goals alone.
    """

    bodies: tuple[str, ...]
    least: float
    poses: bool = False
    place: str = "constraints"


@dataclass(frozen=True)
class Demand:
    """Everything a task of synthesis asks for.

    ``free`` has (low, high) by name, ``choices`` the values out of which a parameter is chosen;
    ``full_turn`` tells whether the driver turns fully, ``margin`` of its inequalities [m];
    ``keep`` designs are reported.
    """

    driver: str
    goals: tuple[tuple[Goal, float], ...]
    free: dict[str, Bounds]
    choices: dict[str, tuple[float, ...]]
    starts: int
    seed: int
    regions: tuple[Region, ...] = ()
    full_turn: bool = False
    margin: float = 1e-6
    transmission: tuple[Transmission, ...] = ()
    boxes: tuple[Box, ...] = ()
    ratios: tuple[Ratio, ...] = ()
    limits: tuple[Limit, ...] = field(default=())
    keep: int = KEEP


def demand(problem: Problem, task: Synthesis) -> Demand:
    """Return what a task asks for.

    Raises
    ------
    InputError, UnknownName
        A key that is missing, unknown, contradictory, or does not fit the mechanism.
    """
    mechanism = problem.mechanism
    driver = _driver(mechanism, task)
    free, choices, regions = _freedoms(mechanism, task)
    names = [*free, *choices]
    goals = []
    for table, place in listed_goals(task):
        goal = goal_of(mechanism, table, place, driver, names, problem.tasks)
        weight = number(mechanism, table.get("weight", 1.0), f"{place}.weight")
        if weight <= 0:
            raise InputError("a weight is positive", where=f"{place}.weight")
        goals.append((goal, weight))
    if not goals:
        raise InputError("no goal is given", where="goals")
    found = _constraints(problem, task, driver, names)
    return Demand(
        driver, tuple(goals), free, choices, task.starts or STARTS, task.seed or 0,
        regions=regions, keep=task.keep or KEEP, **found,
    )  # fmt: skip


def _driver(mechanism: Mechanism, task: Synthesis) -> str:
    table = task.driver
    if not isinstance(table, Mapping) or "coordinate" not in table:
        raise InputError("driver = { coordinate = ... } is needed", where="driver")
    check_keys(table, ["coordinate"], "driver")
    try:
        return coordinate(mechanism, str(table["coordinate"])).text
    except MechdaeError as problem:
        raise problem.inside("driver.coordinate") from None


# -- freedoms ----------------------------------------------------------------------------------


def _freedoms(
    mechanism: Mechanism, task: Synthesis
) -> tuple[dict[str, Bounds], dict[str, tuple[float, ...]], tuple[Region, ...]]:
    if not isinstance(task.free, Mapping) or not task.free:
        raise InputError("free = { name = [low, high], ... } is needed", where="free")
    values = mechanism.values()
    free: dict[str, Bounds] = {}
    choices: dict[str, tuple[float, ...]] = {}
    regions = []
    for name, bounds in task.free.items():
        place = f"free.{name}"
        if isinstance(bounds, Mapping) and "point" in bounds:
            region = _region(mechanism, bounds, place)
            regions.append(region)
            continue
        if name not in values:
            raise UnknownName("parameter", name, values, where="free")
        if isinstance(mechanism.parameters.get(name), str):
            raise InputError("this parameter follows from others, it is not free", where=place)
        if isinstance(bounds, Mapping):
            choices[name] = _choices(mechanism, bounds, place)
            continue
        low, high = tuple_of(mechanism, bounds, 2, place)
        if low >= high:
            raise InputError(f"the bounds leave nothing: {low:g} to {high:g}", where=place)
        free[name] = (low, high)
    for region in regions:
        _free_pivot(mechanism, region, free)
    if not free:
        raise InputError("no parameter is free between bounds", where="free")
    return free, choices, tuple(regions)


def _choices(mechanism: Mechanism, table: Mapping[str, Any], place: str) -> tuple[float, ...]:
    check_keys(table, ["ratios"], place)
    found = tuple(
        number(mechanism, item, f"{place}.ratios[{i}]")
        for i, item in enumerate(items_of(table.get("ratios"), f"{place}.ratios"))
    )
    if not found or 0.0 in found:
        raise InputError("ratios other than zero are needed", where=f"{place}.ratios")
    return found


def _region(mechanism: Mechanism, table: Mapping[str, Any], place: str) -> Region:
    check_keys(table, ["point", "polygon", "disc"], place)
    known = [f"{GROUND}.{name}" for name in mechanism.ground.points]
    point = table["point"]
    if point not in known:
        raise UnknownName("point of the ground", str(point), known, where=f"{place}.point")
    if ("polygon" in table) == ("disc" in table):
        raise InputError("give either 'polygon' or 'disc'", where=place)
    if "disc" in table:
        disc = tuple_of(mechanism, table["disc"], 3, f"{place}.disc")
        if disc[2] <= 0:
            raise InputError("a disc has a radius", where=f"{place}.disc")
        return Region(point, disc=disc)
    corners = rows_of(mechanism, table["polygon"], 2, 3, f"{place}.polygon")
    return Region(point, polygon=_convex(corners, f"{place}.polygon"))


def _convex(corners: tuple[tuple[float, ...], ...], place: str) -> tuple[tuple[float, ...], ...]:
    """Return the corners counter-clockwise."""
    turns = []
    for k, (x, y) in enumerate(corners):
        (a, b), (c, d) = corners[k - 1], corners[(k + 1) % len(corners)]
        turns.append((x - a) * (d - y) - (y - b) * (c - x))
    if all(turn > 0 for turn in turns):
        return corners
    if all(turn < 0 for turn in turns):
        return corners[::-1]
    raise InputError(
        "the polygon is not convex", where=place, hint="solve for its convex parts one by one"
    )


def _free_pivot(mechanism: Mechanism, region: Region, free: dict[str, Bounds]) -> None:
    """Free the coordinates of a pivot within the box around its region."""
    if region.disc:
        x, y, r = region.disc
        box = [(x - r, x + r), (y - r, y + r)]
    else:
        box = [(min(c), max(c)) for c in zip(*region.polygon, strict=True)]
    name = region.point.split(".")[1]
    for axis, bounds, value in zip("xy", box, mechanism.ground.points[name], strict=False):
        own = value if isinstance(value, str) and value in mechanism.parameters else None
        if own is None and isinstance(value, str):
            raise InputError("the pivot's coordinates follow from others", where=region.point)
        free.setdefault(own or f"{region.point}.{axis}", bounds)


# -- constraints -------------------------------------------------------------------------------


def _constraints(
    problem: Problem, task: Synthesis, driver: str, names: list[str]
) -> dict[str, Any]:
    mechanism = problem.mechanism
    found: dict[str, Any] = {}
    lists: dict[str, list[Any]] = {"transmission": [], "boxes": [], "ratios": [], "limits": []}
    for i, entry in enumerate(items_of(task.constraints, "constraints")):
        place = f"constraints[{i}]"
        kind = kind_of(entry, place, CONSTRAINTS, "constraint")
        if kind == "full-turn":
            if entry.get("coordinate", driver) != driver:
                raise UnknownName(
                    "coordinate", str(entry["coordinate"]), [driver], where=f"{place}.coordinate"
                )
            if not coordinate(mechanism, driver).is_angle:
                raise InputError(f"{driver} is no angle, it makes no turns", where=place)
            margin = number(mechanism, entry.get("margin", 1e-6), f"{place}.margin")
            found |= {"full_turn": True, "margin": margin}
        elif kind == "transmission-angle":
            lists["transmission"].append(_transmission(mechanism, entry, place))
        elif kind == "box":
            lists["boxes"].append(_box(mechanism, entry, place))
        elif kind == "ratio":
            lists["ratios"].append(_ratio(mechanism, entry, place, names))
        else:
            lists["limits"].append(_limit(problem, entry, place))
    return found | {key: tuple(value) for key, value in lists.items()}


def _transmission(mechanism: Mechanism, entry: Mapping[str, Any], place: str) -> Transmission:
    bodies = tuple(str(body) for body in items_of(entry.get("between"), f"{place}.between"))
    for body in bodies:
        known = [*mechanism.bodies, GROUND]
        if body not in known:
            raise UnknownName("body", body, known, where=f"{place}.between")
    least = number(mechanism, entry.get("min"), f"{place}.min")
    if not 0 <= least < 1.5707963:
        raise InputError("a transmission angle lies between 0 and 90 degrees", where=f"{place}.min")
    over = word_of(entry.get("over", "turn"), ("turn", "goal"), "word", f"{place}.over")
    return Transmission(bodies, least, over == "goal", place)


def _box(mechanism: Mechanism, entry: Mapping[str, Any], place: str) -> Box:
    points = items_of(entry.get("points"), f"{place}.points")
    known = [f"{b}.{p}" for b, body in mechanism.bodies.items() for p in body.points]
    for point in points:
        if point not in known:
            raise UnknownName("point", str(point), known, where=f"{place}.points")
    if not points:
        raise InputError("no point is named", where=f"{place}.points")
    if "x" not in entry and "y" not in entry:
        raise InputError("'x' or 'y' is needed", where=place)
    ends: list[Bounds] = []
    for axis in ("x", "y"):
        if axis not in entry:
            ends.append((-float("inf"), float("inf")))
            continue
        low, high = tuple_of(mechanism, entry[axis], 2, f"{place}.{axis}")
        if low >= high:
            raise InputError("the box is empty", where=f"{place}.{axis}")
        ends.append((low, high))
    return Box(tuple(points), *ends)


def _ratio(mechanism: Mechanism, entry: Mapping[str, Any], place: str, names: list[str]) -> Ratio:
    pair = items_of(entry.get("of"), f"{place}.of")
    values = mechanism.values()
    for name in pair:
        if name not in values:
            raise UnknownName("parameter", str(name), values, where=f"{place}.of")
    if len(pair) != 2 or not set(pair) & set(names):
        raise InputError("two parameters are needed, one of them free", where=f"{place}.of")
    return Ratio(pair[0], pair[1], number(mechanism, entry.get("max"), f"{place}.max"))


def _limit(problem: Problem, entry: Mapping[str, Any], place: str) -> Limit:
    ends = [
        number(problem.mechanism, entry.get(key, default), f"{place}.{key}")
        for key, default in (("min", -1e300), ("max", 1e300))
    ]
    if "min" not in entry and "max" not in entry:
        raise InputError("'min' or 'max' is needed", where=place)
    if ends[0] > ends[1]:
        raise InputError("'min' is above 'max'", where=place)
    return Limit(extreme(entry, place, problem.tasks, 1), ends[0], ends[1])

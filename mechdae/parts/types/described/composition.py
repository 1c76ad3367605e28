"""What a task of composition asks for: goal, chains, objectives, checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.describe import GROUND, Body, Ground, Mechanism, Table
from mechdae.describe.expression import evaluate
from mechdae.describe.file.reading import Nested, nest
from mechdae.describe.joints.pairs import Revolute
from mechdae.describe.tasks.goals import FunctionTargets, PathGoal, Visits
from mechdae.describe.values import Value
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.records import dataclass, optional

if TYPE_CHECKING:
    from mechdae.describe.values import EvaluatedOrNone, FloatRowsOrNone
    from mechdae.parts.types.described.scheme_goals import FunctionNodes

OBJECTIVES: Mapping[str, tuple[str, int]] = {
    "error": ("1", 1), "material": ("m", 1), "joints": ("1", 1), "points": ("1", 1),
    "transmission_angle": ("rad", -1), "loss": ("W", 1),
}  # fmt: skip
"""Name -> unit, and 1 where less is better, -1 where more is."""
USUAL = ("error", "material", "joints")
SAMPLES, STARTS, GROW, KEEP, POINTS = 3000, 24, 2, 20, 12
"""Where the task does not say: sets drawn of each scheme, sets refined, rounds of growth, designs
that are reported, points at most."""
LARGEST = 8
"""Links of the chains that are screened; larger ones grow."""
SEVERAL = 20
"""Points at most that a task may ask for."""
CORNERS = 400
"""Of a curve given by formulas."""
OPEN = 4.0
"""A closed list of points ends no further from its beginning than so many of its longest steps."""
LEAST = math.asin(0.06)
"""Transmission angle that every design keeps while it is searched for [rad]."""


@dataclass(frozen=True, kw_only=True)
class CurveGoal(Value):
    """A point of the mechanism traces a closed curve: its shape and size, wherever it lies.

    Examples
    --------
    >>> md.CurveGoal(targets=[[0, 0], [0.1, 0], [0.1, 0.05]]).closed
    True
    """

    targets: FloatRowsOrNone = optional(
        "pairs", doc="[[x, y], ...], the last one joined to the first", unit="m"
    )
    x: str | None = optional("text", doc="an expression of s [m]")
    y: str | None = optional("text", doc="an expression of s [m]")
    range: EvaluatedOrNone = optional("pair", doc="of s, [0, 2 pi]")
    closed: bool = optional("flag", True)

    kind: ClassVar[str] = "curve"


@dataclass(frozen=True, kw_only=True)
class SchemePath(PathGoal):
    """The path of a synthesis, whose point the composition chooses."""

    point: Any = optional("text", doc="left out: the composition chooses it")


@dataclass(frozen=True, kw_only=True)
class SchemeFunction(FunctionTargets):
    """The function of a synthesis, whose output is a link or a block on the frame."""

    output: Any = optional("text", choices=("angle", "slide"), doc="angle without it")


SCHEME_GOALS = {goal.kind: goal for goal in (CurveGoal, SchemePath, SchemeFunction)}
nest("scheme_goal", Nested("goal", SCHEME_GOALS))
PAIRS = ("R", "P")
"""Kinds of joints: turning and sliding pairs."""


@dataclass(frozen=True)
class CompositionDemand:
    """Everything a task of composition asks for, in plain numbers [SI, rad].

    ``corners``: of the wanted closed curve (k, 2) [m]; none where something else is wanted.
    ``objectives``, ``reference``: names, and the worst value of each that the front is measured
    from. ``rubbing``: coefficient of friction, radius of pins [m], load [N or N m]; None: no loss
    is asked for.
    """

    corners: tuple[tuple[float, float], ...]
    visits: Visits | None
    function: FunctionNodes | None
    objectives: tuple[str, ...]
    reference: tuple[float, ...] | None
    links: tuple[int, ...]
    chains: tuple[str, ...] | None
    slides: bool
    within: Mapping[str, float]
    rubbing: tuple[float, float, tuple[float, ...]] | None
    points: int
    samples: int
    starts: int
    grow: int
    seed: int
    keep: int

    @property
    def kind(self) -> str:
        return "path" if self.visits else "function" if self.function else CurveGoal.kind

    def unit(self, objective: str) -> str:
        """Return the unit of an objective; that of the error depends on the goal."""
        if objective != "error" or self.kind == CurveGoal.kind:
            return OBJECTIVES[objective][0]
        return "rad" if self.function and not self.function.slides else "m"


def asked_of(task: Any, parameters: Mapping[str, float]) -> CompositionDemand:
    if task.goal is None:
        raise InputError('goal = { kind = "curve", ... } is needed', where="goal")
    slides = _slides(task)
    corners, visits, function = _asked_goal(task, parameters, slides)
    objectives = tuple(task.objectives or USUAL)
    for k, name in enumerate(objectives):
        if name not in OBJECTIVES:
            raise UnknownName("objective", name, OBJECTIVES, where=f"objectives[{k}]")
        if name in objectives[:k]:
            raise InputError("is there twice", where=f"objectives[{k}]")
    if len(objectives) > 3:
        raise InputError("at most 3 objectives have a front", where="objectives")
    if not objectives:
        raise InputError("no objective is given", where="objectives")
    from mechdae.describe.values import evaluated

    reference = None if task.reference is None else tuple(evaluated(task.reference, parameters))
    if reference is not None and len(reference) != len(objectives):
        raise InputError(
            f"{len(objectives)} numbers are needed, one for each objective", where="reference"
        )
    less = int(function is not None or slides)  # no tracing point, or one that is no pin
    within = _within(task, parameters, LEAST_POINTS[4] - less)
    points = int(within.get("points", task.points or POINTS))
    links = _links(task, points, less)
    return CompositionDemand(
        corners, visits, function, objectives, reference, links, task.chains, slides, within,
        _rubbing(task, parameters, "loss" in (*objectives, *within), function is not None),
        points, task.samples or SAMPLES, task.starts or STARTS,
        GROW if task.grow is None else task.grow, task.seed or 0, task.keep or KEEP,
    )  # fmt: skip


def _rubbing(
    task: Any, parameters: Mapping[str, float], needed: bool, function: bool
) -> tuple[float, float, tuple[float, ...]] | None:
    """Return friction, radius of pins, and load, where a loss is asked for."""
    words = ("friction", "pin_radius", "load")
    given = [word for word in words if getattr(task, word) is not None]
    if not needed:
        if given:
            raise InputError(
                f"'{given[0]}' changes nothing where no loss is asked for", where=given[0],
                hint='"loss" among the objectives, or within = { loss = ... }',
            )  # fmt: skip
        return None
    missing = [word for word in words if word not in given]
    if missing:
        raise InputError(
            f"a loss needs friction, pin_radius and load; '{missing[0]}' is missing",
            where=missing[0],
        )
    from mechdae.describe.values import evaluated

    friction, radius = (float(evaluated(getattr(task, word), parameters)) for word in words[:2])
    for word, value in (("friction", friction), ("pin_radius", radius)):
        if not value > 0:
            raise InputError("a positive number is needed", where=word)
    load = tuple(float(number) for number in evaluated(task.load, parameters))
    count, what = (1, "one number: what resists the output") if function else (2, "[x, y], a force")
    if len(load) != count:
        raise InputError(f"{what} is needed, here are {len(load)} numbers", where="load")
    if not any(load) or (function and load[0] < 0):
        words_for = "positive" if function else "not zero"
        raise InputError(f"a load is {words_for}", where="load")
    return friction, radius, load


def _slides(task: Any) -> bool:
    """Return whether sliding pairs are allowed."""
    pairs = task.pairs if task.pairs is not None else ("R",)
    for k, pair in enumerate(pairs):
        if pair not in PAIRS:
            raise UnknownName("pair", pair, PAIRS, where=f"pairs[{k}]")
        if pair in pairs[:k]:
            raise InputError("is there twice", where=f"pairs[{k}]")
    if "R" not in pairs:
        raise InputError(
            "a crank turns, and each dyad has two turning pairs or more", where="pairs",
            hint='pairs = ["R", "P"]',
        )  # fmt: skip
    return "P" in pairs


def _asked_goal(
    task: Any, parameters: Mapping[str, float], slides: bool
) -> tuple[tuple[tuple[float, float], ...], Visits | None, FunctionNodes | None]:
    """Return the curve, the targets, or the function that is wanted."""
    from mechdae.parts.types.described.scheme_goals import asked_function, asked_path

    try:
        goal = task.goal.evaluated(parameters)
        if isinstance(goal, PathGoal):
            return (), asked_path(goal), None
        if not isinstance(goal, FunctionTargets):
            return _corners(goal), None, None
        function = asked_function(goal)
        if function.slides and not slides:
            raise InputError(
                "chains of turning pairs have no slide", where="output",
                hint='pairs = ["R", "P"], or output = "angle"',
            )  # fmt: skip
        return (), None, function
    except MechdaeError as error:
        raise error.inside("goal") from None


def _within(task: Any, parameters: Mapping[str, float], points: int) -> dict[str, float]:
    found = {}
    for name, value in (task.within or {}).items():
        if name not in OBJECTIVES:
            raise UnknownName("limit", name, OBJECTIVES, where="within")
        found[name] = float(evaluate(value, parameters))
        if not found[name] > 0:
            raise InputError("a limit is positive", where=f"within.{name}")
    least = {"joints": 4, "points": points}
    for name, low in least.items():
        if found.get(name, math.inf) < low:
            raise InputError(
                f"no chain has so few {name}: a four-bar has {low}",
                where=f"within.{name}",
                hint=f"{low} or more; points are pins and the point that traces",
            )
    if found.get("transmission_angle", 0.0) >= math.pi / 2:
        raise InputError(
            "transmission angles are below 90 degrees", where="within.transmission_angle"
        )
    return found


def _links(task: Any, points: int, less: int) -> tuple[int, ...]:
    """Return the numbers of links, each of which has a chain that is allowed."""
    if task.links is not None and task.chains is not None:
        raise InputError("'links' and 'chains' are given, one is needed", where="links")
    if task.chains is not None:
        if not task.chains:
            raise InputError("the list of chains is empty", where="chains")
        return ()
    links = task.links if task.links is not None else (4.0, 6.0)
    if not links:
        raise InputError("the list of numbers of links is empty", where="links")
    for k, number in enumerate(links):
        place = f"links[{k}]"
        if number != int(number) or number < 4 or number % 2:
            raise InputError(
                f"a chain with one freedom has 4, 6, 8, ... links, not {number:g}", where=place
            )
        if number > LARGEST:
            many = {10: "230 chains with 4506 choices of frame and crank", 12: "6856 chains"}.get(
                int(number), "hundreds of thousands of chains"
            )
            raise InputError(
                f"{number:g} links have {many}, more than are screened", where=place,
                hint=f"up to {LARGEST} links; larger schemes grow from them (grow = ...)",
            )  # fmt: skip
    least = min(map(int, links))
    fewest = LEAST_POINTS[least] - less
    if points < fewest:
        raise InputError(
            f"a scheme of {least} links has {fewest} points or more, "
            f"{points} are allowed", where="points" if task.points else "within.points",
            hint="pins and the tracing point; fewer links, or more points",
        )  # fmt: skip
    return tuple(sorted({int(number) for number in links}))


LEAST_POINTS = {4: 5, 6: 7, 8: 10}
"""Fewest points of the chains with turning pairs; without a point that traces one less."""


def _corners(goal: CurveGoal) -> tuple[tuple[float, float], ...]:
    by_formula = goal.x is not None or goal.y is not None
    if by_formula == (goal.targets is not None):
        raise InputError("give either 'targets', or 'x' and 'y' as expressions of s")
    if not goal.closed:
        raise InputError(
            "a curve that is traced by a crank is closed", where="closed",
            hint="a synthesis of kind path visits targets on an open one",
        )  # fmt: skip
    if by_formula:
        corners = _by_formula(goal)
    else:
        rows = goal.targets or ()
        corners = tuple((float(x), float(y)) for x, y in rows)
        if len(corners) > 1 and corners[0] == corners[-1]:
            corners = corners[:-1]
        if len(set(corners)) < 5:
            raise InputError("five different points or more are needed", where="targets")
        _check_closed(corners)
    spread = max(math.dist(corners[0], other) for other in corners)
    if not spread > 0:
        raise InputError(
            "all points of the curve are in one place", where="x" if by_formula else "targets"
        )
    return corners


def _by_formula(goal: CurveGoal) -> tuple[tuple[float, float], ...]:
    if goal.x is None or goal.y is None:
        raise InputError("'x' and 'y' are needed, expressions of s")
    low, high = goal.range or (0.0, 2 * math.pi)
    if not low < high:
        raise InputError(f"the range leaves nothing: {low:g} to {high:g}", where="range")

    def at(s: float) -> tuple[float, float]:
        found = []
        for name in ("x", "y"):
            try:
                value = evaluate(getattr(goal, name), {"s": s})
            except MechdaeError as error:
                raise error.inside(name) from None
            if not math.isfinite(value):
                raise InputError(f"has no value at s = {s:g}", where=name)
            found.append(float(value))
        return found[0], found[1]

    corners = tuple(at(low + (high - low) * k / CORNERS) for k in range(CORNERS))
    size = max(math.dist(corners[0], other) for other in corners)
    gap = math.dist(at(high), corners[0])
    if gap > 1e-6 * size:
        raise InputError(
            f"the curve is not closed: it ends {gap:.4g} m from where it begins", where="range",
            hint="range = [0, 6.283185307179586] of s is a whole turn",
        )  # fmt: skip
    return corners


def _check_closed(corners: tuple[tuple[float, float], ...]) -> None:
    steps = [math.dist(one, other) for one, other in pairwise(corners)]
    gap, longest = math.dist(corners[-1], corners[0]), max(steps)
    if gap > OPEN * longest:
        raise InputError(
            f"the curve is not closed: from the last point to the first it is {gap:.4g} m, "
            f"between others {longest:.4g} m at most", where="targets",
            hint="points all round the curve; the last one is joined to the first",
        )  # fmt: skip


def bare_crank() -> Mechanism:
    """Return what all schemes begin with, for files that hold nothing but tasks of composition."""
    crank = Body("crank", Table({"A": (0.0, 0.0), "B": (1.0, 0.0)}))
    return Mechanism(
        ground=Ground(Table({"A": (0.0, 0.0)})),
        bodies=Table({"crank": crank}),
        joints=Table({"A": Revolute("A", f"{GROUND}.A", "crank.A")}),
        sketch=Table({"crank": 0.0}),
    )

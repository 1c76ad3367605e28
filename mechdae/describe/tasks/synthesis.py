"""What a task of synthesis asks for: goals with weights, freedoms, constraints, checked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import names_in
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.constraints import (
    Bounds,
    Choices,
    Constraint,
    FullTurn,
    Region,
    TransmissionAngle,
    Turned,
)
from mechdae.describe.tasks.goals import (
    Asked,
    Extreme,
    GoalDescription,
    Rocker,
    Within,
    known,
    objective_unit,
)
from mechdae.describe.tasks.kinds import Sweep, Task
from mechdae.describe.tasks.motion import Equilibrium, Motion
from mechdae.describe.tasks.studies import half_widths
from mechdae.describe.values import Number, Table, evaluated
from mechdae.errors import InputError, MechdaeError
from mechdae.records import dataclass, optional

if TYPE_CHECKING:
    from mechdae.describe.values import NumbersOrNone, UnitOf
    from mechdae.records import Takes

    Goals = Takes[Sequence[GoalDescription] | None, tuple[GoalDescription, ...] | None]

STARTS = 40
KEEP, POINTS = 5, 12
"""Designs that are reported, and points of a front, where the task does not say how many."""
SINGLE = ("summary", "last", "highest", "lowest", "peak", "fluctuation", "settling")
"""First steps of paths of one number, which nothing reduces."""
MOST = 3
"""Objectives of a front at most."""
C = TypeVar("C", bound=Constraint)


@dataclass(frozen=True)
class Synthesis(Task):
    """Dimensions that do what goals and constraints say.

    Examples
    --------
    >>> goal = {"kind": "rocker", "body": "rocker", "swing": 0.8}
    >>> task = md.Synthesis({"coordinate": "crank.angle"}, goal, free={"crank": [0.02, 0.06]})
    >>> task.goal.swing
    0.8
    """

    driver: Turned | None = optional("turned", doc="what turns, and its range")
    goal: GoalDescription | None = optional("goal")
    goals: Goals = optional("goals", doc="several goals with weights")
    objectives: Goals = optional(
        "objectives", doc="two or three goals: the designs are their Pareto front"
    )
    reference: NumbersOrNone = optional(
        "numbers", doc="worst value of each objective that a front is measured from"
    )
    free: Takes[Mapping[str, Any] | None, Table[Any] | None] = optional(
        "freedoms", doc="name -> [low, high], { ratios }, or { point, polygon or disc }"
    )
    constraints: Takes[Sequence[Constraint] | None, tuple[Constraint, ...] | None] = optional(
        "constraints", doc="kinds and keys, such as a full turn"
    )
    starts: int | None = optional("whole", doc="starts of the search; absent: 40")
    seed: int | None = optional("natural")
    keep: int | None = optional("whole", doc="designs that are reported, 5; of a front points, 12")
    robust: Number | None = optional(
        "number", unit="1", doc="standard deviations by tolerances that count in the goal"
    )
    tolerances: Mapping[str, Number] | None = optional("coordinates", doc="name -> half width")

    kind: ClassVar[str] = "synthesis"
    holds: ClassVar[tuple[str, ...]] = ("designs",)

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str | None]:
        units = {objective_unit(goal, unit_of): None for goal in self.objectives or ()}
        return {"reference": " and ".join(units) if all(units) else None}


@dataclass(frozen=True)
class Demand:
    """Everything a task of synthesis asks for, in plain numbers [SI, rad].

    ``free`` has (low, high) by name, ``choices`` the values out of which a parameter is chosen;
    a pivot stays in its region; ``keep`` designs are reported. The first goals are the objectives
    of a front, `objectives` of them (0: none is asked for), measured from `reference`. Goals have
    `robust` standard deviations by ``tolerances`` (half widths by name) added, None: none is asked
    for.
    """

    driver: str
    goals: tuple[tuple[Asked, float], ...]
    free: dict[str, Bounds]
    choices: dict[str, tuple[Any, ...]]
    starts: int
    seed: int
    regions: tuple[Region, ...]
    constraints: tuple[Constraint, ...]
    keep: int
    objectives: int = 0
    reference: tuple[float, ...] | None = None
    robust: float | None = None
    tolerances: Mapping[str, float] = field(default_factory=dict)

    @property
    def full_turn(self) -> bool:
        """Whether the driver turns fully."""
        return bool(self.of(FullTurn))

    @property
    def margin(self) -> float | None:
        """Margin of the inequalities of the full turn [m]; None: by the mechanism's size."""
        given = [FullTurn(), *self.of(FullTurn)][-1].margin
        return None if given is None else float(given)

    def of(self, kind: type[C]) -> tuple[C, ...]:
        """Return the constraints of a kind."""
        return tuple(entry for entry in self.constraints if isinstance(entry, kind))


def demand(problem: Problem, task: Synthesis) -> Demand:
    """Return what a task asks for.

    Raises
    ------
    InputError, UnknownName
        A key that is missing, contradictory, or does not fit the mechanism.
    """
    mechanism, tasks = problem.mechanism, problem.tasks.items()
    if task.driver is None:
        raise InputError("driver = { coordinate = ... } is needed", where="driver")
    try:
        driver = coordinate(mechanism, task.driver.coordinate).text
    except MechdaeError as error:
        raise error.inside("driver.coordinate") from None
    within = Within(
        mechanism,
        driver,
        (),
        sampled=[name for name, other in tasks if isinstance(other, Sweep)],
        single=[name for name, other in tasks if isinstance(other, Motion | Equilibrium)],
    )
    free, choices, regions = _freedoms(within, task)
    within = replace(within, free=[*free, *choices])
    goals = tuple(_goal(goal, within, place) for goal, place in listed_goals(task))
    count = len(task.objectives or ())
    if task.objectives is not None:
        _check_objectives(task, [goal for goal, _ in goals])
    if not goals:
        raise InputError("no goal is given", where="goals")
    reference = (
        None if task.reference is None else evaluated(task.reference, mechanism.parameter_values)
    )
    if reference is not None and len(reference) != count:
        raise InputError(f"{count} numbers are needed, one for each objective", where="reference")
    constraints = tuple(_constraints(within, task))
    robust, tolerances = _robust(problem, task, [goal for goal, _ in goals])
    return Demand(
        driver, goals, free, choices, task.starts or STARTS, task.seed or 0, regions, constraints,
        task.keep or (POINTS if count else KEEP), count, reference, robust, tolerances,
    )  # fmt: skip


def listed_goals(task: Synthesis) -> list[tuple[GoalDescription, str]]:
    """Return the goals of a task with their key paths, objectives of a front first."""
    if task.goal is not None and task.goals is not None:
        raise InputError("give either 'goal' or 'goals'", where="goal")
    if task.goal is None and task.goals is None and task.objectives is None:
        raise InputError("give either 'goal' or 'goals'", where="goal")
    found = [(goal, f"objectives[{i}]") for i, goal in enumerate(task.objectives or ())]
    if task.goal is not None:
        return [*found, (task.goal, "goal")]
    return [*found, *((goal, f"goals[{i}]") for i, goal in enumerate(task.goals or ()))]


def only_constrains(goal: Asked) -> bool:
    """Return whether a goal is met or not, with nothing to be better or worse at."""
    return isinstance(goal, Rocker) or getattr(goal, "measure", "") == "exact"


def _robust(
    problem: Problem, task: Synthesis, goals: list[Asked]
) -> tuple[float | None, Mapping[str, float]]:
    """Return how many standard deviations are added, and the half widths they come from."""
    if task.robust is None:
        if task.tolerances is not None:
            raise InputError(
                "tolerances alone change nothing", where="tolerances",
                hint="robust = 3 adds three standard deviations",
            )  # fmt: skip
        return None, {}
    mechanism = problem.mechanism
    try:
        factor = float(evaluated(task.robust, mechanism.parameter_values))
    except MechdaeError as error:
        raise error.inside("robust") from None
    if not factor >= 0:
        raise InputError(
            f"a number of standard deviations is not negative, this one is {factor:g}",
            where="robust",
        )
    widths = half_widths(mechanism, problem.tasks, task.tolerances or {})
    if not any(widths.values()):
        what = "tolerances are needed" if not widths else "no tolerance is above zero"
        raise InputError(
            what, where="robust" if not widths else "tolerances",
            hint="tolerances = { name = half width }",
        )  # fmt: skip
    numbers = {**dict(mechanism.numbers()), **mechanism.parameters}
    for name in widths:
        number = numbers[name]
        if isinstance(number, str):
            raise InputError(
                f"'{name}' follows from others, it has no tolerance of its own",
                where=f"tolerances.{name}",
                hint=f"give that of {', '.join(sorted(names_in(number)))}",
            )
    if all(only_constrains(goal) for goal in goals):
        raise InputError(
            "a goal that is met or not has no error that deviations could be added to",
            where="robust", hint='measure = "least-squares" or "minimax"',
        )  # fmt: skip
    return factor, {name: width for name, width in widths.items() if width}


def _check_objectives(task: Synthesis, goals: list[Asked]) -> None:
    """Raise for objectives that make no front."""
    objectives = task.objectives or ()
    count = len(objectives)
    if count < 2:
        what = "one objective has no front" if count else "no objective is given"
        raise InputError(what, where="objectives", hint="goal = {...} for a single one")
    if count > MOST:
        raise InputError(f"at most {MOST} objectives have a front", where="objectives")
    for i, goal in enumerate(goals):
        place = f"objectives[{i}]"
        if i >= count and not only_constrains(goal):
            raise InputError(
                "beside objectives a goal must be one that is met exactly",
                where="goal" if task.goal is not None else f"goals[{i - count}]",
                hint='put it among the objectives, or give it measure = "exact"',
            )
        if i < count and only_constrains(goal):
            raise InputError(
                "this goal is met or not, there is no better or worse", where=place,
                hint="goal = {...} beside the objectives",
            )  # fmt: skip
        for j in range(min(i, count)) if i < count else ():
            if goal == goals[j]:
                raise InputError(f"is the same as objectives[{j}]", where=place)
            if _what(goal) is not None and _what(goal) == _what(goals[j]):
                raise InputError(
                    f"is the opposite of objectives[{j}]: every design is a compromise of the two",
                    where=place,
                )


def _what(goal: Asked) -> tuple[str, str] | None:
    """Return path and reduction of a quantity that is smallest or largest."""
    if not isinstance(goal, Extreme):
        return None
    one_number = goal.path.partition("/")[0] in SINGLE
    return goal.of, "" if one_number else goal.reduce


def _goal(goal: GoalDescription, within: Within, place: str) -> tuple[Asked, float]:
    try:
        plain: Any = goal.evaluated(within.mechanism.parameter_values)
        checked = plain.checked(within)
        if plain.weight <= 0:
            raise InputError("a weight is positive", where="weight")
    except MechdaeError as error:
        raise error.inside(place) from None
    return checked, plain.weight


def _constraints(within: Within, task: Synthesis) -> Iterator[Constraint]:
    for i, constraint in enumerate(task.constraints or ()):
        place = f"constraints[{i}]"
        try:
            plain = constraint.evaluated(within.mechanism.parameter_values)
            plain.check(within)
        except MechdaeError as error:
            raise error.inside(place) from None
        is_angle = isinstance(plain, TransmissionAngle)
        yield replace(plain, place=place) if is_angle else plain  # type: ignore[call-arg]


def _freedoms(
    within: Within, task: Synthesis
) -> tuple[dict[str, Bounds], dict[str, tuple[Any, ...]], tuple[Region, ...]]:
    if task.free is None:
        raise InputError("free = { name = [low, high], ... } is needed", where="free")
    mechanism = within.mechanism
    values = mechanism.parameter_values
    free: dict[str, Bounds] = {}
    choices: dict[str, tuple[Any, ...]] = {}
    regions = []
    for name, entry in task.free.items():
        place = f"free.{name}"
        try:
            if isinstance(entry, Region):
                regions.append(entry.evaluated(values).checked(within))
                continue
            known(name, mechanism.values(), "parameter", "")
            if isinstance(mechanism.parameters.get(name), str):
                raise InputError("this parameter follows from others, it is not free")
            if isinstance(entry, Choices):
                choices[name] = entry.evaluated(values).ratios
                continue
            low, high = evaluated(entry, values)
            if low >= high:
                raise InputError(f"the bounds leave nothing: {low:g} to {high:g}")
        except MechdaeError as error:
            raise error.inside(place) from None
        free[name] = (low, high)
    for region in regions:
        _free_pivot(mechanism, region, free)
    if not free:
        raise InputError("no parameter is free between bounds", where="free")
    return free, choices, tuple(regions)


def _free_pivot(mechanism: Mechanism, region: Region, free: dict[str, Bounds]) -> None:
    """Free the coordinates of a pivot within the box around its region."""
    name = region.point.split(".")[1]
    position = mechanism.ground.points[name]
    for axis, bounds, value in zip("xy", region.box, position, strict=False):
        parameter = value if isinstance(value, str) and value in mechanism.parameters else None
        if parameter is None and isinstance(value, str):
            raise InputError("the pivot's coordinates follow from others", where=region.point)
        free.setdefault(parameter or f"{region.point}.{axis}", bounds)

"""Goals of a synthesis: what a mechanism must do, as it is described and as it is searched for.

A description is checked against the mechanism by ``checked``, which returns the goal with plain
numbers [SI, rad]; errors have the key path.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import evaluate
from mechdae.describe.file.reading import Nested, nest
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.values import Number, Value
from mechdae.errors import InputError, MechdaeError, UnavailableError, UnknownName
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.values import NumberRows, NumbersOrNone, UnitOf

FITS = ("least-squares", "exact", "minimax")
UNIT_LENGTH = 1e-4
"""By how much a quaternion may differ from length 1: digits that a file left out."""
SENSES = ("given", "free")
REDUCTIONS = ("mean", "peak", "rms", "least")
Rows = tuple[tuple[float, ...], ...]


# -- as they are searched for ------------------------------------------------------------------


@dataclass(frozen=True)
class Visits:
    """A point visits targets (k, 2) or (k, 3) [m], or a body poses.

    Poses are (x, y, angle) in the plane, (x, y, z, e0, e1, e2, e3) in space: the origin of the
    body's frame and a unit quaternion, real part first.

    ``timing`` is "free" (in order within a turn), "any" (in any order), "absolute" (values of
    the driver in ``programme``) or "steps" (increments from a free start). A ``closed`` path
    that names its first target again at the end visits it once, with double weight.
    """

    what: str
    targets: Rows
    timing: str
    programme: tuple[float, ...]
    closed: bool
    weights: tuple[float, ...]
    measure: str

    @property
    def is_motion(self) -> bool:
        """Poses of a body, not places of a point."""
        return "." not in self.what

    @property
    def places(self) -> Rows:
        """The places of the point, or of the body's origin."""
        dimension = {3: 2, 7: 3}[len(self.targets[0])] if self.is_motion else len(self.targets[0])
        return tuple(row[:dimension] for row in self.targets)


# -- as they are described ---------------------------------------------------------------------


@dataclass(frozen=True)
class Within:
    """What a goal is checked against.

    ``driver`` is its coordinate, ``free`` the names of free parameters; ``sampled`` tasks of the
    problem have a path at each pose, ``single`` ones one number for a path.
    """

    mechanism: Mechanism
    driver: str
    free: Sequence[str]
    sampled: Sequence[str]
    single: Sequence[str]


@dataclass(frozen=True, kw_only=True)
class GoalDescription(Value):
    """Base of the goals of a task; ``weight`` counts where there are several."""

    weight: Number = optional("number", 1.0, unit="1")

    kind: ClassVar[str] = ""

    def checked(self, within: Within) -> Asked:
        """Return what is searched for, of a goal with plain numbers.

        Raises
        ------
        InputError, UnknownName
            With the key path: what does not fit the mechanism.
        """
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class _Visiting(GoalDescription):
    timing: str | None = optional(
        "text", choices=("free", "any"), doc="in order, the default, or in any order"
    )
    at: NumbersOrNone = optional("numbers", doc="driver value at each target")
    steps: NumbersOrNone = optional("numbers", doc="the same from a free start")
    closed: bool = optional("flag", False)
    measure: str = optional("text", "least-squares", choices=FITS)

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str | None]:
        return {"at": unit_of(""), "steps": unit_of("")}

    def visits(self, what: str, word: str, size: int) -> Visits:
        """Return what is visited, as a search reads it.

        Parameters
        ----------
        what, word
            Name of point or body, and the key with its targets.
        size
            Numbers of one target.
        """
        rows: Rows = getattr(self, word)
        if len(rows[0]) != size:
            raise InputError(f"{size} numbers are needed, here are {len(rows[0])}", where=word)
        places = Visits(what, rows, "", (), False, (), "").places
        if len(set(places)) == 1:
            raise InputError("all targets are at one place", where=word)
        ways = {"timing": self.timing, "at": self.at, "steps": self.steps}
        given = [way for way, value in ways.items() if value is not None]
        if len(given) > 1:
            raise InputError(f"'{given[0]}' and '{given[1]}' are given, one is needed")
        programme: Any = self.at or self.steps or ()
        if (self.at, self.steps) != (None, None) and len(programme) != len(rows):
            raise InputError(f"{len(programme)} values for {len(rows)} targets", where=given[0])
        timing = "absolute" if self.at else "steps" if self.steps else self.timing or "free"
        weights = [1.0] * len(rows)
        if self.closed and timing == "free" and rows[0] == rows[-1]:
            rows, weights = rows[:-1], [2.0, *weights[1:-1]]
        return Visits(what, rows, timing, programme, self.closed, tuple(weights), self.measure)


@dataclass(frozen=True, kw_only=True)
class PathGoal(_Visiting):
    """A point visits targets."""

    point: str = key("text", doc="body.point")
    targets: NumberRows = key("places", doc="[[x, y], ...], in space [[x, y, z], ...]", unit="m")

    kind: ClassVar[str] = "path"

    def checked(self, within: Within) -> Visits:
        known_point(within.mechanism, self.point, "point")
        return self.visits(self.point, "targets", within.mechanism.dimension)


@dataclass(frozen=True, kw_only=True)
class MotionGoal(_Visiting):
    """A body visits poses."""

    body: str = key("text")
    poses: NumberRows = key(
        "poses",
        doc="[[x, y, angle], ...] [m, rad], in space [[x, y, z, e0, e1, e2, e3], ...]: a unit "
        "quaternion, real part first",
    )

    kind: ClassVar[str] = "motion"

    def checked(self, within: Within) -> Visits:
        known(self.body, within.mechanism.bodies, "body", "body")
        found = self.visits(self.body, "poses", 3 if within.mechanism.dimension == 2 else 7)
        for k, row in enumerate(found.targets):
            size = math.hypot(*row[3:])
            if len(row) == 7 and not abs(size - 1) <= UNIT_LENGTH:
                raise InputError(
                    f"a quaternion has length 1, this one {size:.6g}", where=f"poses[{k}]"
                )
        return found


@dataclass(frozen=True, kw_only=True)
class FunctionTargets(GoalDescription):
    """An output coordinate is a function of the driver.

    Either ``function`` of x over ``range``, drawn on ``input_range`` and ``output_range``, or
    ``targets``. Starts are numbers, names of free parameters, or None: free. The output turns as
    its values say; with a free ``sense`` the other way round too, from where its scale starts.
    """

    input: str | None = optional("text", doc="the driver's coordinate")
    output: str = key("text", doc="a coordinate")
    function: str | None = optional("text", doc="an expression of x")
    range: Any = optional("pair", doc="of x")
    input_range: Any = optional("number")
    output_range: Any = optional("number")
    input_start: Number | None = optional("expression")
    output_start: Number | None = optional("expression")
    targets: Any = optional("pairs", doc="[[input, output], ...]")
    sense: str = optional("text", "given", choices=SENSES, doc="free: the output turns either way")
    measure: str = optional("text", "least-squares", choices=FITS)

    kind: ClassVar[str] = "function"

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str | None]:
        input_, output = unit_of(self.input or ""), unit_of(self.output)
        either = input_ if input_ == output else f"{input_} and {output}"
        return {
            **{"input_range": input_, "input_start": input_, "targets": either},
            **{"output_range": output, "output_start": output},
        }

    @property
    def senses(self) -> tuple[int, ...]:
        """The senses in which the output may turn, by that of its values."""
        return (1, -1) if self.sense == "free" else (1,)

    @property
    def nodes(self) -> int:
        """Number of places of the input."""
        return len(self.targets) if self.targets else 41

    def scales(self, shares: Sequence[float]) -> tuple[list[float], list[float]]:
        """Return input and output from their starts, at shares of the range."""
        if self.targets:
            x0, y0 = self.targets[0]
            return [x - x0 for x, _ in self.targets], [y - y0 for _, y in self.targets]
        low, high = self.range
        first, last = (self.value(x) for x in self.range)
        xs = [low + (high - low) * share for share in shares]
        inputs = [self.input_range * (x - low) / (high - low) for x in xs]
        outputs = [self.output_range * (self.value(x) - first) / (last - first) for x in xs]
        return inputs, outputs

    def value(self, x: float) -> float:
        """Return the function at a place of its range."""
        return evaluate(str(self.function), {"x": x})

    def checked(self, within: Within) -> FunctionTargets:
        known(self.input or within.driver, [within.driver], "coordinate", "input")
        try:
            output = coordinate(within.mechanism, self.output).text
        except MechdaeError as problem:
            raise problem.inside("output") from None
        self.check_given()
        starts = {word: self._start(within, word) for word in ("input_start", "output_start")}
        if self.targets is not None:
            # targets are values of the coordinates themselves, unless a start says otherwise
            firsts = zip(starts, self.targets[0], strict=True)
            starts |= {word: first for word, first in firsts if starts[word] is None}
        return replace(self, output=output, **starts)

    def check_given(self) -> None:
        """Raise for a function that is not given once, or takes one value at both ends."""
        if (self.targets is None) == (self.function is None):
            raise InputError("give either 'function' or 'targets'")
        if self.function is not None:
            self._check_range()
        if self.function is not None and self.measure == "exact":
            raise InputError(
                "a formula is met nearly, not at every value of its range", where="measure",
                hint='targets = [[input, output], ...] for "exact"',
            )  # fmt: skip

    def _check_range(self) -> None:
        for word in ("range", "input_range", "output_range"):
            if getattr(self, word) is None:
                raise InputError(f"the key '{word}' is missing", where=word)
        try:
            ends = {self.value(x) for x in self.range}
        except MechdaeError as problem:
            raise problem.inside("function") from None
        if len(set(self.range)) < 2 or len(ends) < 2:
            raise InputError("the function takes the same value at both ends of its range")

    def _start(self, within: Within, word: str) -> Any:
        value = getattr(self, word)
        if value is None or value in within.free:
            return value
        try:
            return evaluate(value, within.mechanism.parameter_values)
        except MechdaeError as problem:
            raise problem.inside(word) from None


@dataclass(frozen=True, kw_only=True)
class Rocker(GoalDescription):
    """A body swings, or a joint slides, back and forth between two ends; None: free."""

    body: str | None = optional("text")
    swing: Number | None = optional("number", doc="of the body", unit="rad")
    joint: str | None = optional("text")
    stroke: Number | None = optional("number", doc="of the joint", unit="m")
    time_ratio: float = optional("number", doc="of the slow to the fast stroke", unit="1")

    kind: ClassVar[str] = "rocker"

    @property
    def slides(self) -> bool:
        """Whether a joint slides, not a body swings."""
        return self.joint is not None or self.stroke is not None

    @property
    def coordinate(self) -> str:
        """What goes back and forth: a body's angle or the slide of a joint."""
        return f"{self.joint}.slide" if self.slides else f"{self.body}.angle"

    @property
    def reach(self) -> Any:
        """The way between its ends [rad or m]."""
        return self.stroke if self.slides else self.swing

    def checked(self, within: Within) -> Rocker:
        if not self.slides:
            planar_only(within.mechanism, "body", "a swing of a body", "bodies have no angle there")
        if self.slides and (self.body is not None or self.swing is not None):
            raise InputError(
                "give 'body' and 'swing' of what turns, or 'joint' and 'stroke' of what slides"
            )
        word, most = ("stroke", math.inf) if self.slides else ("swing", 2 * math.pi)
        reach, ratio = self.reach, self.time_ratio
        if reach is None and ratio is None:
            raise InputError(f"'{word}' or 'time_ratio' is missing")
        if ratio is not None and not 0.1 < ratio < 10:
            raise InputError("a ratio of 0.1 to 10 is needed", where="time_ratio")
        if reach is not None and not 0 < reach < most:
            words = "a stroke is positive" if self.slides else "a swing within a turn is needed"
            raise InputError(words, where=word)
        joints = within.mechanism.joints
        if self.slides:
            sliding = [name for name, joint in joints.items() if joint.slides]
            known(self.joint, sliding, "joint that slides", "joint")
        else:
            known(self.body, within.mechanism.bodies, "body", "body")
        return self


@dataclass(frozen=True, kw_only=True)
class StraightLine(GoalDescription):
    """A point follows a straight line while the driver runs over an arc."""

    point: str = key("text", doc="body.point")
    arc: float = key("number", doc="of the driver", unit="rad")
    stroke: float = optional("number", doc="way along the line; absent: free", unit="m")
    measure: str = optional("text", "minimax", choices=("minimax",))

    kind: ClassVar[str] = "straight-line"
    nodes: ClassVar[int] = 61

    def checked(self, within: Within) -> StraightLine:
        planar_only(within.mechanism, "kind", "a straight line", 'targets of a goal of kind "path"')
        if not 0 < abs(self.arc) <= 2 * math.pi:
            raise InputError("an arc within a turn is needed", where="arc")
        if self.stroke is not None and self.stroke <= 0:
            raise InputError("a stroke is positive", where="stroke")
        known_point(within.mechanism, self.point, "point")
        return self


@dataclass(frozen=True, kw_only=True)
class Extreme(GoalDescription):
    """A quantity of another task, a number or what becomes of its values over that task."""

    of: str = key("text", doc="TASK/PATH, a path below another task")
    reduce: Any = optional("text", choices=REDUCTIONS, doc="over the poses of that task")

    sense: ClassVar[int] = 1

    @property
    def task(self) -> str:
        """The other task."""
        return self.of.partition("/")[0]

    @property
    def path(self) -> str:
        """The slash path below it."""
        return self.of.partition("/")[2]

    def checked(self, within: Within) -> Extreme:
        tasks = [*within.sampled, *within.single]
        known(self.task, tasks, "sweep, reactions, motion or equilibrium task", "of")
        if not self.path:
            raise InputError('TASK/PATH is needed, as "cycle/joints/A/loss"', where="of")
        if self.task in within.single and self.reduce is not None:
            raise InputError(
                f"a path of {self.task} is one number, there is nothing to reduce",
                where="reduce",
                hint='of = "TASK/peak/PATH", last, highest, lowest, fluctuation or settling',
            )
        return replace(self, reduce=self.reduce or ("peak" if self.sense > 0 else "least"))


@dataclass(frozen=True, kw_only=True)
class Minimise(Extreme):
    """A quantity of another task is smallest."""

    kind: ClassVar[str] = "minimise"


@dataclass(frozen=True, kw_only=True)
class Maximise(Extreme):
    """A quantity of another task is largest."""

    kind: ClassVar[str] = "maximise"
    sense: ClassVar[int] = -1


def objective_unit(goal: GoalDescription | Visits, unit_of: UnitOf) -> str:
    """Return the unit of an objective's value; empty where it is not known."""
    if isinstance(goal, Extreme):
        return unit_of(goal.path) or ""
    if isinstance(goal, _Visiting | Visits):
        return "m" if goal.measure == "minimax" else "m2"
    if isinstance(goal, FunctionTargets):
        unit = unit_of(goal.output) or ""
        return unit if goal.measure == "minimax" or not unit else f"{unit}2"
    return "1"


def known(name: str | None, names: Iterable[str], what: str, place: str) -> None:
    """Raise for a name that is not among those known, or is missing."""
    if name is None:
        raise InputError(f"the key '{place}' is missing", where=place)
    if name not in names:
        raise UnknownName(what, name, names, where=place)


def planar_only(mechanism: Mechanism, place: str, what: str, hint: str = "") -> None:
    """Refuse what the plane alone has."""
    if mechanism.dimension != 2:
        raise UnavailableError(f"{what} is not available in space", where=place, hint=hint)


def known_point(mechanism: Mechanism, name: str, place: str) -> None:
    """Raise for a point that no moving body has."""
    points = [f"{b}.{p}" for b, body in mechanism.bodies.items() for p in body.points]
    known(name, points, "point", place)


Asked = Visits | FunctionTargets | Rocker | StraightLine | Extreme
GOALS: Mapping[str, type[GoalDescription]] = {
    goal.kind: goal
    for goal in (
        PathGoal, MotionGoal, FunctionTargets, Rocker, StraightLine, Minimise, Maximise,
    )
}  # fmt: skip
nest("goal", Nested("goal", GOALS))
nest("goals", Nested("goal", GOALS, 'goals = [{ kind = "..." }]', several=True))
nest("objectives", Nested("goal", GOALS, 'objectives = [{ kind = "..." }, ...]', several=True))

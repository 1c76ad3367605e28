"""What a synthesis may change, and what it must keep, as it is described."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.describe.coordinates import coordinate
from mechdae.describe.file.reading import Nested, nest, read
from mechdae.describe.mechanism import GROUND
from mechdae.describe.tasks.goals import (
    REDUCTIONS,
    Minimise,
    Within,
    known,
    known_point,
    planar_only,
)
from mechdae.describe.values import COERCE, Table, Value, describe, entries, numbers, text
from mechdae.errors import InputError
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.values import EvaluatedOrNone, FloatRowsOrNone, Names, Numbers, UnitOf

Bounds = tuple[float, float]
EVERYWHERE = (-float("inf"), float("inf"))


# -- freedoms ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Turned(Value):
    """The driver of a synthesis."""

    coordinate: str = key("text")


@dataclass(frozen=True)
class Choices(Value):
    """Values out of which a parameter is chosen."""

    ratios: Numbers = key("numbers", doc="values, none of them zero")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.ratios or 0.0 in self.ratios:
            raise InputError("ratios other than zero are needed", where="ratios")


@dataclass(frozen=True)
class Region(Value):
    """A convex polygon (k, 2) or a disc (x, y, r) that a point of the ground stays in [m]."""

    point: str = key("text", doc="a point of the ground")
    polygon: FloatRowsOrNone = optional("pairs", doc="[[x, y], ...]", unit="m")
    disc: EvaluatedOrNone = optional("numbers", doc="[x, y, radius]", unit="m")

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.polygon is None) == (self.disc is None):
            raise InputError("give either 'polygon' or 'disc'")
        if self.disc is not None and len(self.disc) != 3:
            raise InputError(f"3 numbers are needed, here are {len(self.disc)}", where="disc")
        if self.polygon is not None and len(self.polygon) < 3:
            raise InputError(
                f"3 at least are needed, here are {len(self.polygon)}", where="polygon"
            )

    def checked(self, within: Within) -> Region:
        """Return the region of plain numbers, corners counter-clockwise."""
        word = "disc" if self.disc is not None else "polygon"
        hint = 'free = { "ground.NAME.x" = [low, high] } frees a coordinate of a pivot'
        planar_only(within.mechanism, word, f"a {word} of a pivot", hint)
        points = [f"{GROUND}.{name}" for name in within.mechanism.ground.points]
        known(self.point, points, "point of the ground", "point")
        if self.disc is not None:
            if self.disc[2] <= 0:
                raise InputError("a disc has a radius", where="disc")
            return self
        corners = self.polygon or ()
        turns = []
        for k, (x, y) in enumerate(corners):
            (a, b), (c, d) = corners[k - 1], corners[(k + 1) % len(corners)]
            turns.append((x - a) * (d - y) - (y - b) * (c - x))
        if all(turn > 0 for turn in turns):
            return self
        if all(turn < 0 for turn in turns):
            return replace(self, polygon=corners[::-1])
        raise InputError(
            "the polygon is not convex", where="polygon",
            hint="solve for its convex parts one by one",
        )  # fmt: skip

    @property
    def box(self) -> list[Bounds]:
        """The bounds of x and y."""
        if self.disc is not None:
            x, y, r = self.disc
            return [(x - r, x + r), (y - r, y + r)]
        return [(min(c), max(c)) for c in zip(*(self.polygon or ()), strict=True)]


def _freedom(value: Any) -> Any:
    if isinstance(value, Choices | Region):
        return value
    if isinstance(value, Mapping):
        return read(Region if "point" in value else Choices, value, "")
    if isinstance(value, str | float | int):
        raise InputError(f"[low, high] is needed, not {describe(value)}")
    result = numbers(value)
    if len(result) != 2:
        raise InputError(f"[low, high] is needed, here are {len(result)} numbers")
    return result


def _freedoms(value: object) -> Table[Any]:
    """Return name -> bounds, `Choices`, or a `Region` of a pivot whatever its name."""
    if not isinstance(value, Mapping) or not value:
        raise InputError("free = { name = [low, high], ... } is needed")
    return Table(entries(value, _freedom, check=text))


COERCE["freedoms"] = _freedoms


# -- constraints -------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Constraint(Value):
    """Base of the constraints of a synthesis."""

    kind: ClassVar[str] = ""

    def check(self, within: Within) -> None:
        """Raise `InputError` for what does not fit the mechanism; numbers are plain."""


@dataclass(frozen=True, kw_only=True)
class FullTurn(Constraint):
    """The driver turns fully."""

    coordinate: str | None = optional("text", doc="the driver's")
    margin: float | None = optional(
        "number", doc="of the inequalities; absent: 1e-6 of the mechanism's size", unit="m"
    )

    kind: ClassVar[str] = "full-turn"

    def check(self, within: Within) -> None:
        driver = within.driver
        known(driver if self.coordinate is None else self.coordinate, [driver], "coordinate",
              "coordinate")  # fmt: skip
        if not coordinate(within.mechanism, driver).is_angle:
            raise InputError(f"{driver} is no angle, it makes no turns")


@dataclass(frozen=True, kw_only=True)
class TransmissionAngle(Constraint):
    """The transmission angle of the dyad, or bar, that two bodies belong to is at least ``min``.

    Over the whole turn of a driver that makes one, or at the poses of the goals alone.
    """

    between: Names = key("names", doc="two bodies")
    min: float = key("number", unit="rad")
    over: str = optional("text", "turn", choices=("turn", "goal"))
    place: str = field(default="constraints", compare=False)

    kind: ClassVar[str] = "transmission-angle"

    def check(self, within: Within) -> None:
        for body in self.between:
            known(body, [*within.mechanism.bodies, GROUND], "body", "between")
        if not 0 <= self.min < 1.5707963:
            raise InputError("a transmission angle lies between 0 and 90 degrees", where="min")


@dataclass(frozen=True, kw_only=True)
class Box(Constraint):
    """Points stay between bounds while the mechanism moves."""

    points: Names = key("names", doc="body.point")
    x: EvaluatedOrNone = optional("pair", doc="[low, high]", unit="m")
    y: EvaluatedOrNone = optional("pair", doc="[low, high]", unit="m")
    z: EvaluatedOrNone = optional("pair", doc="[low, high], in space", unit="m")

    kind: ClassVar[str] = "box"

    def bounds(self, axes: str) -> list[tuple[float, float]]:
        """Return low and high by axis [m], infinite where none are given."""
        return [getattr(self, axis) or EVERYWHERE for axis in axes]

    def check(self, within: Within) -> None:
        for point in self.points:
            known_point(within.mechanism, point, "points")
        if not self.points:
            raise InputError("no point is named", where="points")
        axes = within.mechanism.axes
        if self.z is not None and "z" not in axes:
            raise InputError("a planar mechanism has no z", where="z")
        if not any(getattr(self, axis) for axis in axes):
            raise InputError(f"{' or '.join(repr(axis) for axis in axes)} is needed")
        for axis, (low, high) in zip(axes, self.bounds(axes), strict=True):
            if low >= high:
                raise InputError("the box is empty", where=axis)


@dataclass(frozen=True, kw_only=True)
class RatioConstraint(Constraint):
    """The first of two parameters is at most ``max`` times the second."""

    of: Names = key("names", doc="two parameters")
    max: float | str | None = key("number", unit="1")

    kind: ClassVar[str] = "ratio"

    def check(self, within: Within) -> None:
        for name in self.of:
            known(name, within.mechanism.values(), "parameter", "of")
        if len(self.of) != 2 or not set(self.of) & set(within.free):
            raise InputError("two parameters are needed, one of them free", where="of")


@dataclass(frozen=True, kw_only=True)
class LimitConstraint(Constraint):
    """A quantity of another task stays between bounds at all of its poses."""

    of: str = key("text", doc="TASK/PATH, a path below another task")
    reduce: str | None = optional("text", choices=REDUCTIONS, doc="over the poses of that task")
    min: float | None = optional("number")
    max: float | None = optional("number")

    kind: ClassVar[str] = "limit"

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str | None]:
        return dict.fromkeys(("min", "max"), unit_of(self.quantity.path))

    @property
    def quantity(self) -> Minimise:
        """What is limited."""
        return Minimise(of=self.of, reduce=self.reduce or "peak")

    @property
    def bounds(self) -> Bounds:
        """Low and high, far away where none are given."""
        return -1e300 if self.min is None else self.min, 1e300 if self.max is None else self.max

    def check(self, within: Within) -> None:
        if self.min is None and self.max is None:
            raise InputError("'min' or 'max' is needed")
        if self.bounds[0] > self.bounds[1]:
            raise InputError("'min' is above 'max'")
        Minimise(of=self.of, reduce=self.reduce).checked(within)


CONSTRAINTS: Mapping[str, type[Constraint]] = {
    entry.kind: entry
    for entry in (FullTurn, TransmissionAngle, Box, RatioConstraint, LimitConstraint)
}
nest("turned", Nested("driver", {"": Turned}, "driver = { coordinate = ... }"))
nest(
    "constraints",
    Nested("constraint", CONSTRAINTS, 'constraints = [{ kind = "..." }]', several=True),
)

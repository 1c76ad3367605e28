"""A follower on a curve: the joint, and its curve as numbers.

Places, extent, and what makes it no curve.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, TypeGuard

from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.joints.joint import LIES, SIDES, STIFF, TURN, WIDE, Joint
from mechdae.describe.values import Number
from mechdae.errors import InputError, MechanismError, MechdaeError, UnknownName
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.values import NumbersOrNone

PARAMETER = "s"
SAMPLES = 48
CLOSES = 1e-11
"""Share of its extent by which a closed curve may miss its beginning: rounding."""
REPEATS = 1e-9
PROBES = (0.0, 0.13, 0.37, 0.61, 0.83)


@dataclass(frozen=True)
class Curve(Joint):
    """Follower point of the second body on a curve (x(s), y(s)) of the first.

    The curve lies in the first body, its origin is the first point, the axes are those of
    the body. With ``roller_radius`` the second point is the centre of a roller on the
    ``side`` of growing s: right is outside of a closed curve that runs counter-clockwise.
    Relative coordinate: s, the place of the contact on the curve.

    Examples
    --------
    >>> cam = md.Curve("cam", "cam.O", "follower.R", "r*cos(s) + e", "r*sin(s)", closed=True)
    >>> cam.x
    'r*cos(s) + e'
    """

    x: Number = key("expression", doc="expression of s and parameters", unit="m")
    y: Number = key("expression", doc="expression of s and parameters", unit="m")
    range: NumbersOrNone = optional("pair", doc="first and last s; closed: [0, 2 pi]")
    closed: bool = optional("flag", False)
    roller_radius: Number | None = optional("number", doc="absent: a point follower", unit="m")
    side: str = optional("text", "right", choices=("right", "left"), doc="of the roller, along s")
    friction: Number | None = optional("number", unit="1")
    one_sided: str | None = optional("text", choices=SIDES, doc=LIES)
    face_width: Number | None = optional("number", doc=WIDE, unit="m")
    tip_radius: Number | None = optional("number", doc="rounding of a point", unit="m")
    contact_modulus: Number | None = optional("number", doc=STIFF, unit="Pa")

    kind: ClassVar[str] = "curve"
    surfaces: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("tip_radius", "contact_modulus"), ("roller_radius", "contact_modulus")
    )  # fmt: skip
    lower: ClassVar[bool] = False
    dyad: ClassVar[str] = "cam"
    coordinates: ClassVar[tuple[str, ...]] = ("s",)
    on_curve: ClassVar[bool] = True
    smoothed: ClassVar[bool] = True
    opening: ClassVar[int] = 3

    def friction_law(self, article: bool) -> str:
        return "f |N| along the tangent"

    @property
    def ends(self) -> tuple[Number, Number]:
        """First and last value of s."""
        first, last = self.range or (0.0, TURN)
        return first, last

    def numbers(self) -> tuple[tuple[str, Number], ...]:
        return (*super().numbers(), *zip(("start", "end"), self.ends, strict=True))

    def with_number(self, entry: str, number: Number) -> Joint:
        first, last = self.ends
        if entry in ("start", "end"):
            return replace(self, range=(number, last) if entry == "start" else (first, number))
        return super().with_number(entry, number)

    def settled(self, values: Mapping[str, float]) -> tuple[Hashable, ...]:
        return span(self, values), self.closed and repeats(self, values)

    def lengths(self, values: Mapping[str, float]) -> tuple[float, ...]:
        return (extent(self, values),)

    def check_shape(self, parameters: Iterable[str], values: Mapping[str, float]) -> None:
        check_curve(self, parameters, values)

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if self.range is None and not self.closed:
            raise MechanismError(
                "the key 'range' is missing",
                where=f"joints.{self.name}.range",
                hint="range = [first s, last s], or closed = true for one turn",
            )
        if self.one_sided is not None and self.roller_radius and self.one_sided != self.side:
            raise MechanismError(
                f"the roller lies on the {self.side} of the curve, which pushes it there",
                where=f"joints.{self.name}.one_sided",
                hint=f'one_sided = "{self.side}", or another side',
            )
        if values["end"] <= values["start"]:
            raise MechanismError(
                f"range ends at {values['end']:g}, not after its start {values['start']:g}",
                where=f"joints.{self.name}.range",
            )


def follows_curve(joint: Joint) -> TypeGuard[Curve]:
    """Return whether a joint has a curve, and so the keys of one."""
    return joint.on_curve


def span(joint: Curve, values: Mapping[str, float]) -> tuple[float, float]:
    """Return the first and the last s; `values` are those of `Mechanism.values`."""
    return values[f"{joint.name}.start"], values[f"{joint.name}.end"]


def place(joint: Curve, values: Mapping[str, float], s: float) -> tuple[float, float]:
    """Return the point (x, y) of the curve in its body, from the joint's first point [m].

    Raises
    ------
    MechdaeError
        No finite real value there.
    """
    known = {**values, PARAMETER: s}
    result = []
    for axis in ("x", "y"):
        try:
            result.append(evaluate(getattr(joint, axis), known))
        except MechdaeError as problem:
            problem.what += f" at s = {s:.6g}"
            raise problem.inside(f"joints.{joint.name}.{axis}") from None
    return result[0], result[1]


def samples(joint: Curve, values: Mapping[str, float]) -> list[tuple[float, float]]:
    """Return points of the curve, both ends of the range among them [m]."""
    first, last = span(joint, values)
    grid = [first + (last - first) * k / SAMPLES for k in range(SAMPLES)]
    return [place(joint, values, s) for s in (*grid, last)]


def extent(joint: Curve, values: Mapping[str, float]) -> float:
    """Return the larger side of the box around the curve [m]."""
    return _extent(samples(joint, values))


def repeats(joint: Curve, values: Mapping[str, float]) -> bool:
    """Return whether the expressions of a closed curve have the period of its range.

    Where they do not (a law given for one turn only), s is taken modulo the range.
    """
    first, last = span(joint, values)
    allowed = REPEATS * extent(joint, values)
    try:
        pairs = [
            (place(joint, values, s), place(joint, values, s + turns * (last - first)))
            for s in (first + share * (last - first) for share in PROBES)
            for turns in (1, -1)
        ]
    except MechdaeError:
        return False
    return all(math.dist(a, b) <= allowed for a, b in pairs)


def check_curve(joint: Curve, parameters: Iterable[str], values: Mapping[str, float]) -> None:
    """Raise for a curve that is none: unknown names, no s, not finite, not closed.

    Raises
    ------
    MechdaeError
        With the key path.
    """
    where = f"joints.{joint.name}"
    known = {*parameters}
    if PARAMETER in known:
        raise MechanismError(
            f"'{PARAMETER}' is the parameter of the curve in joint {joint.name}",
            where=f"parameters.{PARAMETER}",
            hint="choose another name",
        )
    used: set[str] = set()
    for axis in ("x", "y"):
        text = getattr(joint, axis)
        for name in sorted(names_in(text)) if isinstance(text, str) else ():
            if name not in known and name != PARAMETER:
                raise UnknownName("name", name, [PARAMETER, *known], where=f"{where}.{axis}")
            used.add(name)
    if PARAMETER not in used:
        raise MechanismError(
            "neither x nor y depends on s: that is a point, no curve",
            where=f"{where}.x",
            hint='x and y are expressions of s, like x = "a*cos(s)"',
        )
    points = samples(joint, values)
    size = _extent(points)
    if size == 0:
        raise MechanismError("the curve is a single point", where=f"{where}.x")
    gap = math.dist(points[0], points[-1])
    if joint.closed and gap > CLOSES * size:
        first, last = span(joint, values)
        raise InputError(
            f"the curve is not closed: its ends, s = {first:g} and {last:g}, are {gap:.4g} m apart",
            where=f"{where}.closed",
            hint="correct range, x or y, or leave 'closed' out",
        )


def _extent(points: list[tuple[float, float]]) -> float:
    return max(
        max(point[axis] for point in points) - min(point[axis] for point in points)
        for axis in (0, 1)
    )

"""What kinematic pairs have in common.

A joint connects a point of its first body to a point of its second; its relative
coordinate is second minus first, the reaction listed for it acts on the second body.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import fields, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.describe.values import Number, Value
from mechdae.errors import MechanismError
from mechdae.records import dataclass, key

if TYPE_CHECKING:
    from mechdae.types import Floats, Json


PRESSURE_ANGLE = math.radians(20)
"""That of teeth where none is given [rad]."""


@cache
def _number_keys(kind: type[Joint]) -> tuple[str, ...]:
    """Return the keys of a kind of joint that hold numbers."""
    return tuple(entry.name for entry in fields(kind) if entry.metadata["kind"] == "number")


@dataclass(frozen=True)
class Joint(Value):
    """Base of all joints: a name and two points ``body.point``."""

    name: str = key("name")
    first: str = key("reference")
    second: str = key("reference")

    kind: ClassVar[str] = ""
    lower: ClassVar[bool] = True
    """A lower pair (surface contact, p5); otherwise a higher one (p4)."""
    letter: ClassVar[str] = ""
    """The letter of the pair in the name of an Assur group."""
    replaced: ClassVar[str] = ""
    """Letters of the lower pairs and the link that replace a higher one, the first body's first."""
    dyad: ClassVar[str] = ""
    """Name of the group of one body that a higher pair closes, where letters do not tell it."""
    coordinates: ClassVar[tuple[str, ...]] = ()
    """Relative coordinates, the one that the joint's name stands for first."""
    coincide: ClassVar[bool] = False
    """Its two points are one place."""
    keeps_angle: ClassVar[bool] = False
    """Its bodies do not turn relative to each other."""
    straight: ClassVar[bool] = False
    """The second point lies on a line of the first body, along ``axis``."""
    on_curve: ClassVar[bool] = False
    """The second point follows a curve of the first body; the joint has coordinates of its own."""
    bar: ClassVar[bool] = False
    """Its two points keep a ``length``."""
    wheels: ClassVar[int] = 0
    """How many of its bodies roll: their unwrapped angles are in its equation."""
    pivots: ClassVar[tuple[str, ...]] = ()
    """Numbers that never vanish, by which its equation may be solved for an angle."""
    keep_for: ClassVar[str] = ""
    """The number that is a force, which has to be large enough: a pretension."""
    strands: ClassVar[bool] = False
    """Its forces run in two strands instead of acting where wheels touch."""
    rim: ClassVar[bool] = False
    """Its wheels have no teeth."""
    smoothed: ClassVar[bool] = False
    """Friction in it can be smoothed."""
    opening: ClassVar[int] = 5
    """Rank among joints to be opened where a mechanism cannot be assembled: pins first."""
    pointer: ClassVar[bool] = False
    """A vector of a loop in space: its bodies are points."""
    lacking: ClassVar[Mapping[str, str]] = {}
    """Keys that others have and this one cannot have, and why."""
    spatial: ClassVar[bool] = False
    """A pair of spatial mechanisms only."""
    freedoms: ClassVar[int] = 0
    """Relative freedoms of a pair in space."""
    ball: ClassVar[bool] = False
    """Two bodies have a point in common and nothing else."""
    surfaces: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Sets of numbers of which one, with ``face_width``, gives the pressure of its contact."""

    hinge: ClassVar[bool]
    """A turning pair."""
    rigid: ClassVar[bool]
    """Two bodies that are one."""
    guide: ClassVar[bool]
    """A sliding pair."""
    slot: ClassVar[bool]
    """A pin in a slot."""
    pinned: ClassVar[bool]
    """There are pins at its points."""
    meshes: ClassVar[bool]
    """Wheels that drive each other or something else."""
    normal_force: ClassVar[bool]
    """Something slides along it, and a force presses across."""

    def __init_subclass__(cls) -> None:
        """Set the traits that follow from others."""
        cls.hinge = cls.coincide and not cls.keeps_angle
        cls.rigid = cls.coincide and cls.keeps_angle
        cls.guide = cls.straight and cls.keeps_angle
        cls.slot = cls.straight and not cls.keeps_angle
        cls.pinned, cls.meshes = cls.hinge or cls.slot or cls.bar, cls.wheels > 0
        cls.normal_force = cls.straight or cls.on_curve

    @property
    def usual(self) -> str:
        """The coordinate that the joint's name stands for."""
        return self.coordinates[0] if self.coordinates else "angle"

    @property
    def ranged(self) -> str:
        """The coordinate that its limits are of: the slide where it slides."""
        return "slide" if self.slides else self.usual

    @property
    def slides(self) -> bool:
        return "slide" in self.coordinates

    @property
    def turns(self) -> bool:
        return "angle" in self.coordinates

    @property
    def winds(self) -> bool:
        """Its turn slides it along: after a whole turn it is elsewhere."""
        return self.spatial and self.freedoms == 1 and self.turns and self.slides

    @property
    def sense(self) -> int:
        """1 of wheels that turn in one sense by their numbers, -1 of those that do not."""
        return 1

    @property
    def loaded(self) -> bool:
        """Its bodies are loaded by a force that its own numbers give."""
        return bool(self.keep_for) and getattr(self, self.keep_for) is not None

    def ends_at(self, body: str) -> tuple[str, str]:
        """Return its point on a body, and that on the other one."""
        ends = self.first, self.second
        return ends if self.first_body == body else ends[::-1]

    def turn_ratio(self, values: Mapping[str, float]) -> float:
        """Return (w1 - wc) / (w2 - wc) of two wheels, by the mechanism's numbers."""
        return self.sense * values[f"{self.name}.ratio"]

    def needed(self, values: Mapping[str, float], moment: Floats) -> Floats:
        """Return how large the force has to be that it is held by, for moments (n,) on the second.

        The moments of its reaction about the second point; nothing where none is needed.
        """
        raise NotImplementedError

    def gives_way(self, where: str, force: float) -> str:
        """Return the message about a force that is too small, and the remedy."""
        raise NotImplementedError

    @property
    def rubs(self) -> bool:
        """It may have friction."""
        return any(hasattr(self, entry) for entry in ("friction", "mesh_loss"))

    def rubs_all_ways(self, values: Mapping[str, float]) -> bool:
        """Return whether its friction has no sign, but a direction that turns with the sliding."""
        return False

    def friction_law(self, article: bool) -> str:
        """Return the law of its friction in symbols; `article`: pins with their full radius."""
        return "mesh_loss of the power"

    @cached_property
    def first_body(self) -> str:
        return self.first.split(".")[0]

    @cached_property
    def second_body(self) -> str:
        return self.second.split(".")[0]

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """The bodies whose position the joint's equations use."""
        carrier = getattr(self, "carrier", None)
        return (self.first_body, self.second_body, *((carrier,) if carrier else ()))

    def numbers(self) -> tuple[tuple[str, Number], ...]:
        """Return the joint's numbers with the last part of their automatic name."""
        kind: Any = type(self)
        given = [(name, getattr(self, name)) for name in _number_keys(kind)]
        limits = zip(LIMITS, getattr(self, "limits", None) or (), strict=False)
        return (*[(name, value) for name, value in given if value is not None], *limits)

    def structure(self, values: Mapping[str, float], free: frozenset[str]) -> Hashable:
        """Return what it is but for its numbers; directions are numbers where all are free."""
        numbers = {
            name.partition(".")[0]
            for name, _ in self.numbers()
            if "." not in name or f"{self.name}.{name}" in free
        }
        without = {*numbers, "range"}
        rest = tuple([getattr(self, e.name) for e in fields(self) if e.name not in without])
        return (self.kind, rest, *self.settled(values))

    def settled(self, values: Mapping[str, float]) -> tuple[Hashable, ...]:
        """Return what of the mechanism's values belongs to the structure."""
        return ()

    def lengths(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """Return what the mechanism is at least as large as, by its values [m]."""
        length = values.get(f"{self.name}.length") if self.bar or self.pointer else None
        return () if length is None else (length,)

    def with_number(self, entry: str, number: Number) -> Joint:
        """Return the joint with one of its numbers replaced."""
        changes: Json = {entry: number}
        if entry in LIMITS:
            changes = {"limits": tuple((dict(self.numbers()) | changes)[name] for name in LIMITS)}
        return replace(self, **changes)

    def check_shape(self, parameters: Iterable[str], values: Mapping[str, float]) -> None:
        """Raise for a shape that is none, by the values of the whole mechanism."""

    def said(self, word: str, value: float) -> str:
        """Return a value of a key with its unit, for messages."""
        unit = next(entry.metadata.get("unit") for entry in fields(self) if entry.name == word)
        return f"{value:.15g} {unit}" if unit and unit != "1" else f"{value:.6g}"

    def check(self, values: Mapping[str, float]) -> None:
        """Raise `MechanismError` for values that make no joint."""
        if values.get("mesh_loss", 0.0) >= 1:
            raise MechanismError(
                "mesh_loss is a share of the power, below 1",
                where=f"joints.{self.name}.mesh_loss",
            )
        low, high = (values.get(name) for name in LIMITS)
        if low is not None and high is not None and low >= high:
            raise MechanismError(
                f"limits end at {self.said('limits', high)}, not after their start "
                f"{self.said('limits', low)}",
                where=f"joints.{self.name}.limits",
            )
        if not 0 <= values.get("restitution", 0.0) <= 1:
            raise MechanismError(
                f"a restitution is from 0 to 1, not {values['restitution']:g}",
                where=f"joints.{self.name}.restitution",
            )
        for entry in NOT_NEGATIVE:
            if values.get(entry, 0.0) < 0:
                raise MechanismError(
                    f"{entry} is negative ({self.said(entry, values[entry])})",
                    where=f"joints.{self.name}.{entry}",
                )
        given = [entry for entry in CONTACT if entry in values]
        for entry in given:
            if values[entry] == 0:
                raise MechanismError(f"{entry} is zero", where=f"joints.{self.name}.{entry}")
        if given and not (
            "face_width" in given and any(values.keys() >= {*s} for s in self.surfaces)
        ):
            sets = ", or ".join(" and ".join(("face_width", *one)) for one in self.surfaces)
            raise MechanismError(
                f"the pressure of its contact needs {sets}", where=f"joints.{self.name}.{given[0]}"
            )


WIDE, STIFF = "width of the contact across the plane", "2/E' = (1 - nu1^2)/E1 + (1 - nu2^2)/E2"
TURN = 2 * math.pi
LIMITS = ("limits.low", "limits.high")
STOPS = "least and greatest slide"
REBOUNDS = "speed behind an impact over that before, in motions, from 0 to 1"
SIDES, SENSES = ("left", "right"), ("positive", "negative")
LIES = "side on which the second body lies, and to which alone the contact pushes it"
TURNS = "sense in which alone the teeth push the second body"
CONTACT = ("face_width", "contact_modulus", "tip_radius", "shoe_length")
"""Numbers of the contact's surfaces, which only its pressure and wear need."""
GAPS = ("clearance", "backlash", "backlash_angle")
"""Keys that give a gap."""
NOT_NEGATIVE = (
    *CONTACT,
    *GAPS,
    "friction",
    "friction_static",
    "pin_radius",
    "contact_length",
    "contact_width",
    "collar_radius",
    "thread_radius",
    "ball_radius",
    "roller_radius",
    "mesh_loss",
    "pretension",
    "press",
    "adhesion",
)

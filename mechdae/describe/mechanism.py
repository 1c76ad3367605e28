"""The mechanism as a frozen value: ground, bodies, joints, loads, parameters.

Numbers are SI and radians, floats or expressions over the named parameters. Each number
also has an automatic name (``rod.B.x``, ``slot.turn``), see `Mechanism.numbers`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, fields
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, cast

from mechdae.describe.expression import CONSTANTS, evaluate, names_in
from mechdae.describe.joints.joint import Joint
from mechdae.describe.kinds import KINDS_OF_JOINTS
from mechdae.describe.units import units_of
from mechdae.describe.values import NAME, NAME_RULE, Number, Table, Value, empty_table
from mechdae.errors import InputError, MechanismError, MechdaeError, UnavailableError, UnknownName
from mechdae.records import Record, dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.loads import Load
    from mechdae.describe.values import NamesOrNone, NumbersOrNone, NumberTable, PointTable
    from mechdae.describe.vectors.values import Closure
    from mechdae.records import Takes

GROUND = "ground"
MAX_BODIES = 3000
TOLERANCE = "closure_tolerance"
"""Its key, and its automatic name."""
RESERVED = (*CONSTANTS, "t", TOLERANCE)
WHOLE_UNITS = {"gravity": "m/s2", TOLERANCE: "m"}
"""Units of the numbers of the whole mechanism."""
BY_NAMES = ("_numbers", "_pins")
"""What mechanisms share that differ in values of parameters alone."""
MOMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
"""Moments and products of inertia, in the order they are given in."""
SETTINGS = "mechdae.describe.file.settings"
SCREEN = "mechdae.describe.file.load_checks"
"""These know mechanisms: what sets their numbers, what writes screens."""


@dataclass(frozen=True)
class Ground(Value):
    """The fixed link.

    Examples
    --------
    >>> md.Ground({"A": (0, 0), "D": (0.1, 0)}).points["D"]
    (0.1, 0.0)
    """

    points: PointTable = optional("points", Table(), unit="m")


@dataclass(frozen=True)
class Body(Value):
    """A rigid link with its own frame.

    Examples
    --------
    >>> md.Body("crank", {"A": (0, 0), "B": ("r", 0)}, mass=0.5, center=(0.02, 0)).points["B"]
    ('r', 0.0)
    """

    name: str = key("name")
    points: PointTable = optional("points", Table(), unit="m")
    number: int | None = optional("whole", doc="number in the circle on the diagram")
    mass: Number | None = optional("number", doc="absent: massless", unit="kg")
    center: NumbersOrNone = optional(
        "components", doc="centre of mass in the body's frame", unit="m"
    )
    inertia: Takes[Number | Sequence[Number] | None, Number | tuple[Number, ...] | None] = optional(
        "inertia",
        doc="about the centre of mass; in space [Ixx, Iyy, Izz] or with Ixy, Ixz, Iyz",
        unit="kg m2",
    )
    outline: NamesOrNone = optional("outline", doc="points of the polygon that is drawn")


@dataclass(frozen=True)
class Mechanism(Record):
    """Bodies, joints and loads, with their parameters and one rough pose.

    Parameters
    ----------
    ground, bodies, joints, loads
        As in a problem file; bodies, joints and loads in the order they are declared.
    parameters
        Named numbers [SI, rad], floats or expressions over other parameters.
    sketch
        A rough pose: body name -> angle [rad], joint name or coordinate -> value.
    outputs
        Named outputs: name -> expression over coordinates.
    gravity
        (gx, gy[, gz]) [m/s2] or None.
    dimension
        2: points, centres, gravity are of the plane; 3: of space, joints are those of
        `mechdae.describe.joints.spatial`, and a sketch may give rough places of points.
    closure
        The vector loops it was made from, see `from_loops`.
    frames
        "drawn": in space, points and directions of all bodies are places in one assembled pose.
        There all angles of joints are 0, and the sketch says so where it says nothing else.
    closure_tolerance
        By how much redundant equations may stay open [m], angles as what they are at its scale;
        without it they are met to the rounding of the numbers given.
    units
        What its results are shown in, ``"mm,deg"``; of a file what it is written in.

    Raises
    ------
    MechanismError
        Contradictory or dangling descriptions; the message names the part.

    Examples
    --------
    >>> pin = md.Revolute("O", "ground.O", "rod.O")
    >>> rod = md.Body("rod", {"O": (0, 0), "P": (1, 0)}, mass=2, center=(1, 0))
    >>> mechanism = md.Mechanism(md.Ground({"O": (0, 0)}), [rod], [pin], sketch={"rod": 0.3})
    >>> dict(mechanism.numbers())["rod.mass"]
    2.0
    """

    ground: Ground = field(default_factory=Ground)
    bodies: Takes[Sequence[Body] | Mapping[str, Body], Table[Body]] = empty_table()
    joints: Takes[Sequence[Joint] | Mapping[str, Joint], Table[Joint]] = empty_table()
    loads: Takes[Sequence[Load] | Mapping[str, Load], Table[Load]] = empty_table()
    parameters: NumberTable = empty_table()
    sketch: NumberTable = empty_table()
    outputs: Takes[Mapping[str, str], Table[str]] = empty_table()
    gravity: NumbersOrNone = cast("Any", None)
    dimension: int = 2
    closure: Closure | None = None
    frames: str | None = None
    closure_tolerance: Number | None = optional("number", unit="m")
    units: str = field(default="", compare=False, repr=False)

    AXES: ClassVar[str] = "xyz"
    shows: ClassVar[str] = "body numbers parameter_values scale settable values with_values"

    @cached_property
    def axes(self) -> str:
        """The axes of its space."""
        return self.AXES[: self.dimension]

    @property
    def order(self) -> float:
        """A power of two near its size, by which products of lengths are divided in space."""
        return float(2.0 ** round(math.log2(self.scale))) if self.scale > 0 else 1.0

    @cached_property
    def aliases(self) -> Mapping[str, str]:
        """Coordinates of vectors by the names they have here."""
        return self.closure.aliases if self.closure else {}

    def __post_init__(self) -> None:
        from mechdae.describe import values

        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        for name in ("bodies", "joints", "loads"):
            put(name, by_name(getattr(self, name)))
        put("outputs", Table(self.outputs))
        if self.dimension not in (2, 3):
            raise MechanismError(f"2 or 3, not {self.dimension!r}", where="dimension")
        sketched = "coordinates" if self.dimension == 2 else "rough places"
        kinds = [("parameters", "table"), ("sketch", sketched)]
        kinds += [(TOLERANCE, "number")] * (self.closure_tolerance is not None)
        for name, kind in kinds:
            try:
                put(name, values.COERCE[kind](getattr(self, name)))
            except MechdaeError as problem:
                raise problem.inside(name) from None
        if self.gravity is not None:
            try:
                put("gravity", values.components(self.gravity))
            except MechdaeError as problem:
                if isinstance(self.gravity, int | float):
                    down = ["0"] * (self.dimension - 1) + [f"{-abs(self.gravity):g}"]
                    problem.hint = f"gravity = [{', '.join(down)}]"
                raise problem.inside("gravity") from None
        if self.frames is not None:
            if self.frames != "drawn" or self.dimension != 3:
                raise MechanismError(
                    f"'drawn' in space or nothing, not {self.frames!r}", where="frames"
                )
            from mechdae.describe import drawn

            sketch = drawn.drawn_sketch(self.joints, self.bodies, self.sketch)
            put("joints", Table(drawn.drawn_joints(self.joints)))
            put("sketch", Table({**sketch, **self.sketch}))
        if self.units:
            units_of(written=self.units)
        _check(self)
        if self.frames is not None:
            drawn.check_drawn(self.joints, self.values(), self.scale)

    def _repr_html_(self) -> str:
        """Return the diagram of the sketch and its parts, for notebooks."""
        screen = import_module(SCREEN)
        text: str = screen.in_notebook(self, "\n".join(screen.mechanism_lines(self, {})))
        return text

    def body(self, name: str) -> Body | Ground:
        """Return the body of that name, or the ground."""
        if name == GROUND:
            return self.ground
        if name not in self.bodies:
            raise UnknownName("body", name, [GROUND, *self.bodies])
        return self.bodies[name]

    def numbers(self) -> Iterator[tuple[str, Number]]:
        """Return every number with its automatic name; of loads, those that are no expressions."""
        return iter(self._numbers)

    @cached_property
    def _numbers(self) -> tuple[tuple[str, Number], ...]:
        return tuple(self._listed())

    def _listed(self) -> Iterator[tuple[str, Number]]:
        parts: list[tuple[str, Body | Ground]] = [(GROUND, self.ground), *self.bodies.items()]
        for name, body in parts:
            for point, position in body.points.items():
                for axis, number in zip(self.AXES, position, strict=False):
                    yield f"{name}.{point}.{axis}", number
            if isinstance(body, Body):
                if body.mass is not None:
                    yield f"{name}.mass", body.mass
                yield from _inertia(name, body.inertia)
                for axis, number in zip(self.AXES, body.center or (), strict=False):
                    yield f"{name}.center.{axis}", number
        for joint in self.joints.values():
            for entry, number in joint.numbers():
                yield f"{joint.name}.{entry}", number
        for axis, number in zip(self.AXES, self.gravity or (), strict=False):
            yield f"gravity.{axis}", number
        if self.closure_tolerance is not None:
            yield TOLERANCE, self.closure_tolerance
        for load in self.loads.values():
            for entry, number in load.numbers():
                yield f"loads.{load.name}.{entry}", number

    @cached_property
    def settable(self) -> dict[str, Number]:
        """The numbers that can be set by name: parameters, automatic names, the tolerance."""
        return {TOLERANCE: 0.0, **dict(self._numbers), **self.parameters}

    def values(self) -> Table[float]:
        """Return all parameters and automatic names with their values [SI, rad]."""
        return self._values

    @cached_property
    def parameter_values(self) -> Mapping[str, float]:
        """The parameters' values [SI, rad], evaluated once; not to be written into."""
        return evaluate_all(self.parameters)

    @cached_property
    def _values(self) -> Table[float]:
        result = dict(self.parameter_values)
        for name, number in self.numbers():
            try:
                result[name] = evaluate(number, self.parameter_values)
            except MechdaeError as problem:
                raise problem.inside(name) from None
        return Table(result)

    @cached_property
    def scale(self) -> float:
        """A length of the mechanism [m]: the largest extent of a body or of the ground."""
        values, spans = self._values, []
        for place, points in _all_points(self):
            name = place.removeprefix("bodies.")
            if len(points) > 1:
                for axis in self.axes:
                    places = [values[f"{name}.{point}.{axis}"] for point in points]
                    spans.append(max(places) - min(places))
        for joint in self.joints.values():
            spans += joint.lengths(values)
        return max(spans, default=0.0) or 1.0

    @property
    def tolerance(self) -> float:
        """By how much redundant equations may stay open [m], 0: by rounding."""
        return self._values.get(TOLERANCE, 0.0)

    @cached_property
    def structures(self) -> dict[Any, Any]:
        """What `structure_of` found, shared with mechanisms that differ in values alone."""
        return {}

    @cached_property
    def _pins(self) -> dict[str, dict[str, str]]:
        """The points of pins of each body that has no other joints, each with a joint there."""
        pins: dict[str, dict[str, str]] = {name: {} for name in self.bodies}
        for joint in self.joints.values():
            if joint.hinge:
                for side in (joint.first, joint.second):
                    owner, point = side.split(".")
                    if owner != GROUND:
                        pins[owner].setdefault(point, joint.name)
        others = {
            body for joint in self.joints.values() if not joint.hinge for body in joint.bodies
        }
        return pins | {body: {} for body in others & pins.keys()}

    def with_values(self, changes: Mapping[str, Number]) -> Mechanism:
        """Return the mechanism with parameters or automatic names set to new numbers.

        Keys may carry a unit (``a_mm``).

        Raises
        ------
        UnknownName
            Neither a parameter nor an automatic name.
        """
        if not changes:
            return self
        changed: Mechanism = import_module(SETTINGS).renumbered(self, changes)
        return changed


def evaluate_all(parameters: Mapping[str, Number]) -> dict[str, float]:
    """Return the parameters' values; they may refer to each other in any order."""
    values: dict[str, float] = {}
    pending: list[str] = []

    def visit(name: str) -> None:
        if name in values:
            return
        if name in pending:
            circle = " -> ".join([*pending[pending.index(name) :], name])
            raise InputError(f"parameters refer to each other in a circle: {circle}")
        if len(pending) > 200:
            raise InputError("parameters refer to each other more than 200 deep")
        pending.append(name)
        number = parameters[name]
        if isinstance(number, str):
            for other in sorted(names_in(number)):
                if other not in parameters:
                    raise UnknownName("parameter", other, parameters)
                visit(other)
            number = evaluate(number, values)
        values[name] = number
        pending.pop()

    for name in parameters:
        try:
            pending.clear()
            visit(name)
        except MechdaeError as problem:
            raise problem.inside(f"parameters.{name}") from None
    return values


def by_name(items: Any) -> Table[Any]:
    """Return named values as a table of them."""
    if isinstance(items, Mapping):
        return Table(items)
    named: dict[str, Body | Joint | Load] = {}
    for item in items:
        if item.name in named:
            raise MechanismError(f"two parts are called '{item.name}'", hint="rename one of them")
        named[item.name] = item
    return Table(named)


def _inertia(
    name: str, inertia: Number | tuple[Number, ...] | None
) -> Iterator[tuple[str, Number]]:
    """Yield the moments of inertia of a body with their automatic names."""
    if isinstance(inertia, tuple):
        for word, number in zip(MOMENTS, inertia, strict=False):
            yield f"{name}.inertia.{word}", number
    elif inertia is not None:
        yield f"{name}.inertia", inertia


def _check(mechanism: Mechanism) -> None:
    """Raise for a description that cannot be a mechanism."""
    if not mechanism.bodies:
        raise MechanismError("a mechanism needs at least one body")
    if len(mechanism.bodies) > MAX_BODIES:
        raise MechanismError(f"more than {MAX_BODIES} bodies")
    for name in RESERVED:
        if name in mechanism.parameters:
            raise MechanismError(
                f"'{name}' is reserved", where=f"parameters.{name}", hint="choose another name"
            )
    for name in [*mechanism.bodies, *mechanism.joints]:
        if not NAME.match(name):
            raise MechanismError(f"'{name}' is not a name", hint=NAME_RULE)
    for name in mechanism.bodies:
        if name == GROUND:
            raise MechanismError("'ground' is the fixed link, no body may be called so")
        if name in mechanism.joints:
            raise MechanismError(
                f"'{name}' is both a body and a joint", hint="they share one namespace: rename one"
            )
    for place, points in _all_points(mechanism):
        for point, position in points.items():
            if len(position) != mechanism.dimension:
                raise MechanismError(
                    f"{mechanism.dimension} coordinates are needed, not {len(position)}",
                    where=f"{place}.points.{point}",
                )
    for name, body in mechanism.bodies.items():
        _check_size(mechanism, body.center, f"bodies.{name}.center")
        if isinstance(body.inertia, tuple) != (
            mechanism.dimension == 3 and body.inertia is not None
        ):
            need = (
                "one number is needed" if mechanism.dimension == 2 else "[Ixx, Iyy, Izz] is needed"
            )
            raise MechanismError(need, where=f"bodies.{name}.inertia")
        for point in body.outline or ():
            if point not in body.points:
                raise UnknownName("point", point, body.points, where=f"bodies.{name}.outline")
    _check_size(mechanism, mechanism.gravity, "gravity")
    _check_kinds(mechanism)
    seen: dict[tuple[str, ...], str] = {}
    for joint in mechanism.joints.values():
        _check_joint(mechanism, joint)
        ends = (joint.kind, *sorted((joint.first, joint.second)))
        if ends in seen and joint.lower and not joint.pointer:
            raise MechanismError(
                f"repeats joint {seen[ends]}: same kind, same two points",
                where=f"joints.{joint.name}",
                hint="delete one of them",
            )
        seen[ends] = joint.name
    _check_connected(mechanism)
    _check_sketch(mechanism)
    check_values(mechanism)


def _check_size(mechanism: Mechanism, items: tuple[Number, ...] | None, place: str) -> None:
    """Raise for a vector of another dimension."""
    if items is not None and len(items) != mechanism.dimension:
        count = {2: "two", 3: "three"}[mechanism.dimension]
        raise MechanismError(f"{count} numbers are needed, not {len(items)}", where=place)


def _all_points(mechanism: Mechanism) -> Iterable[tuple[str, Table[tuple[Number, ...]]]]:
    yield GROUND, mechanism.ground.points
    for name, body in mechanism.bodies.items():
        yield f"bodies.{name}", body.points


def _check_kinds(mechanism: Mechanism) -> None:
    """Raise for a joint of another dimension."""
    kinds = KINDS_OF_JOINTS[mechanism.dimension]
    known_of = {kind: kinds.get(kind) for kind in {j.kind for j in mechanism.joints.values()}}
    for joint in mechanism.joints.values():
        known, place = known_of[joint.kind], f"joints.{joint.name}"
        if known is type(joint) or joint.pointer:
            continue
        here, other = ("the plane", "space") if mechanism.dimension == 2 else ("space", "the plane")
        if known is not None:
            raise MechanismError(
                f"{type(joint).__name__} is a joint of {other}",
                where=place,
                hint=f"{known.__name__} is that of {here}",
            )
        if mechanism.dimension == 3:
            raise UnavailableError(
                f"joints of kind '{joint.kind}' are not computed in space by this version",
                where=place,
                hint=f"available: {', '.join(kinds)}",
            )
        raise MechanismError(
            f"a {joint.kind} joint is one of space", where=place, hint="dimension = 3"
        )


def _check_joint(mechanism: Mechanism, joint: Joint) -> None:
    place = f"joints.{joint.name}"
    sides = (joint.first, joint.second)
    (first, _), (second, _) = ends = [side.split(".") for side in sides]
    for side, (body, point) in zip(sides, ends, strict=True):
        if body != GROUND and body not in mechanism.bodies:
            raise UnknownName("body", body, [GROUND, *mechanism.bodies], where=f"{place}.between")
        points = mechanism.body(body).points
        if point not in points:
            listed = [f"{body}.{other}" for other in points]
            raise UnknownName("point", side, listed, where=f"{place}.between")
    if first == second:
        raise MechanismError(
            f"joins '{first}' to itself", where=place, hint="name two different bodies"
        )
    carrier = getattr(joint, "carrier", None)
    if carrier is not None and carrier != GROUND and carrier not in mechanism.bodies:
        raise UnknownName("body", carrier, [GROUND, *mechanism.bodies], where=f"{place}.carrier")
    if carrier in (first, second)[: max(joint.wheels, 1)]:
        raise MechanismError("the carrier is one of the two wheels", where=f"{place}.carrier")
    pitch = getattr(joint, "point", None)
    if pitch is not None:
        of_carrier = [f"{carrier or GROUND}.{p}" for p in mechanism.body(carrier or GROUND).points]
        if pitch not in of_carrier:
            raise UnknownName("point of the carrier", pitch, of_carrier, where=f"{place}.point")


def _check_sketch(mechanism: Mechanism) -> None:
    """Raise for a coordinate that is sketched twice, once by the name of its body or joint."""
    for name in mechanism.sketch:
        joint = mechanism.joints.get(name)
        usual = "angle" if joint is None else joint.usual
        if f"{name}.{usual}" in mechanism.sketch:
            raise MechanismError(
                f"{name} and {name}.{usual} are the same coordinate",
                where=f"sketch.{name}",
                hint="delete one of them",
            )


def _check_connected(mechanism: Mechanism) -> None:
    reached, front = {GROUND}, [GROUND]
    neighbours: dict[str, set[str]] = {}
    for joint in mechanism.joints.values():
        neighbours.setdefault(joint.first_body, set()).add(joint.second_body)
        neighbours.setdefault(joint.second_body, set()).add(joint.first_body)
    while front:
        for other in neighbours.get(front.pop(), ()):
            if other not in reached:
                reached.add(other)
                front.append(other)
    loose = [name for name in mechanism.bodies if name not in reached]
    if loose:
        raise MechanismError(
            f"no chain of joints connects {', '.join(loose[:5])} to the ground",
            where=f"bodies.{loose[0]}",
            hint="add a joint, or delete the body",
        )


def check_values(mechanism: Mechanism) -> None:
    values = mechanism.values()
    for joint in mechanism.joints.values():
        joint.check({entry: values[f"{joint.name}.{entry}"] for entry, _ in joint.numbers()})
        joint.check_shape(mechanism.parameters, values)
    if values.get(TOLERANCE, 0.0) < 0:
        raise MechanismError("is negative", where=TOLERANCE)
    pins = mechanism._pins
    for name in mechanism.bodies:
        moments = [f"inertia.{word}" for word in MOMENTS[:3]]
        for entry in ("mass", "inertia", *moments):
            if values.get(f"{name}.{entry}", 0.0) < 0:
                raise MechanismError(f"{entry} is negative", where=f"bodies.{name}.{entry}")
        if mechanism.dimension == 2:  # axes that cross in a point make a link in space
            _check_link(mechanism, name, pins[name], values)


def _check_link(
    mechanism: Mechanism, name: str, pins: Mapping[str, str], values: Mapping[str, float]
) -> None:
    """Raise for a link with pins alone (point -> joint), all of which fall on one point."""
    place = {
        point: tuple(values[f"{name}.{point}.{axis}"] for axis in mechanism.axes) for point in pins
    }
    if len(place) > 1 and len(set(place.values())) == 1:
        first, second, *_ = sorted(pins)
        raise MechanismError(
            f"link of zero length: its pins {first} and {second} (joints {pins[first]} and "
            f"{pins[second]}) are the same point",
            where=f"bodies.{name}",
            hint="correct the points, or let both joints name the same point",
        )


__all__ = ["GROUND", "Body", "Ground", "Mechanism", "evaluate_all", "fields"]

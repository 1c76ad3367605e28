"""Named outputs: expressions of coordinates, their rates, forces, parameters and the time.

``Theta = "K2.angle - K1.angle"``, ``v = "slide.slide.speed"``, ``gain = "F/cyl.effort"``; one named
output may use another one.
"""

from __future__ import annotations

from collections.abc import Iterable

from mechdae.describe.coordinate_names import coordinate_names
from mechdae.describe.coordinates import RATES, coordinate, named_coordinate, split_rate
from mechdae.describe.expression import names_in
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.values import NAME, NAME_RULE
from mechdae.errors import InputError, MechdaeError, UnknownName, shorten

TIME = "t"
COMPONENTS: dict[int, tuple[str, ...]] = {
    2: ("x", "y", "moment"),
    3: ("x", "y", "z", "moment_x", "moment_y", "moment_z"),
}
"""Of ``JOINT.reaction`` by dimension: force [N] in world axes, moment about the second body's point
[N m].
"""


FORCES = {"effort": "N", "power": "W", "normal": "N", "loss": "W"}
"""Last words of forces beside reactions: of coordinates that are driven, then of joints."""


def force_of(mechanism: Mechanism, name: str) -> tuple[str, str, str] | None:
    """Return what a name means among forces, None for others.

    ``B.reaction.x`` is ("reaction", "B", "x"), ``B.loss`` and ``guide.normal`` are of joints,
    ``cyl.effort`` and ``cyl.power`` of the coordinate ``cyl.slide``.
    """
    base, _, word = name.rpartition(".")
    joint = base.removesuffix(".reaction")
    if joint != base:
        known = joint in mechanism.joints and word in COMPONENTS[mechanism.dimension]
        return ("reaction", joint, word) if known else None
    if word in ("normal", "loss"):
        return (word, base, "") if base in mechanism.joints else None
    if word in ("effort", "power"):
        try:
            return word, named_coordinate(mechanism, base).text, ""
        except MechdaeError:
            return None
    return None


def force_unit(mechanism: Mechanism, name: str) -> str | None:
    """Return the unit of a force's name, None for others."""
    force = force_of(mechanism, name)
    if force is None:
        return None
    word, owner, axis = force
    turns = axis.startswith("moment") or (
        word == "effort" and coordinate(mechanism, owner).is_angle
    )
    return "N m" if turns else FORCES.get(word, "N")


def forces_of(mechanism: Mechanism, output: str) -> list[str]:
    """Return the forces that a named output, or an expression, uses."""
    return sorted(n for n in names_of(mechanism, output) if force_of(mechanism, n))


def force_names(mechanism: Mechanism) -> list[str]:
    """Return the names of all forces."""
    found = [f"{name}.{word}" for name in mechanism.joints for word in ("normal", "loss")]
    words = COMPONENTS[mechanism.dimension]
    found += [f"{name}.reaction.{word}" for name in mechanism.joints for word in words]
    driven = [*mechanism.bodies, *(n for n, j in mechanism.joints.items() if j.coordinates)]
    return found + [f"{name}.{word}" for name in driven for word in ("effort", "power")]


def names_of(mechanism: Mechanism, output: str) -> set[str]:
    """Return the names an output or an expression uses, those of outputs in it included."""
    result: set[str] = set()
    front, seen = [output], {output}
    while front:
        text = front.pop()
        for name in names_in(mechanism.outputs.get(text, text)):
            if name not in mechanism.outputs:
                result.add(name)
            elif name not in seen:
                seen.add(name)
                front.append(name)
    return result


def coordinates_of(mechanism: Mechanism, output: str) -> dict[str, int]:
    """Return the coordinates a named output uses, each with the highest order of its rates."""
    orders: dict[str, int] = {}
    for name in sorted(names_of(mechanism, output) - set(mechanism.parameters) - {TIME}):
        force = force_of(mechanism, name)
        if force is not None and force[0] != "power":
            continue
        base, order = (force[1], 1) if force is not None else split_rate(name)
        orders[base] = max(order, orders.get(base, 0))
    return orders


def bodies_of(mechanism: Mechanism, outputs: Iterable[str]) -> set[str]:
    """Return the bodies (the ground too) that named outputs depend on."""
    names = [name for output in outputs for name in forces_of(mechanism, output)]
    names += [base for output in outputs for base in coordinates_of(mechanism, output)]
    parts = {name.split(".")[0] for name in names}
    return {
        body
        for part in parts
        for body in (mechanism.joints[part].bodies if part in mechanism.joints else (part,))
    }


def check_expression(mechanism: Mechanism, text: object, place: str, forces: bool = False) -> None:
    """Raise for an expression with names that are no parameter, coordinate, rate or time.

    ``forces`` are allowed in outputs.
    """
    if not isinstance(text, str):
        return
    try:
        for used in sorted(names_in(text)):
            if used in mechanism.parameters and used in mechanism.outputs:
                raise InputError(
                    f"'{used}' is a parameter and a named output", hint="rename one of them"
                )
            if used == TIME or used in mechanism.parameters or used in mechanism.outputs:
                continue
            if forces and force_of(mechanism, used):
                continue
            if split_rate(used)[0] not in coordinate_names(mechanism):
                known = [*mechanism.parameters, *mechanism.outputs, *coordinate_names(mechanism)]
                rates = [name + rate for name in coordinate_names(mechanism) for rate in RATES]
                words = force_names(mechanism) if forces else []
                raise UnknownName("name", used, [*known, *rates, TIME, *words])
    except MechdaeError as problem:
        raise problem.inside(place) from None


def check_outputs(mechanism: Mechanism) -> None:
    """Raise for a named output that is no expression of the mechanism's coordinates.

    Raises
    ------
    InputError, UnknownName
        A bad name, an unknown coordinate, outputs that refer to each other in a circle.
    """
    for name, text in mechanism.outputs.items():
        place = f"outputs.{shorten(name, 30)}"
        if not NAME.match(name) or name == TIME:
            reason = "reserved" if name == TIME else "not a name"
            raise InputError(f"'{shorten(name, 30)}' is {reason}", where=place, hint=NAME_RULE)
        if not isinstance(text, str):
            raise InputError("an expression in quotes is needed", where=place)
        check_expression(mechanism, text, place, forces=True)
    for name in mechanism.outputs:
        _check_circle(mechanism, name)


def _check_circle(mechanism: Mechanism, name: str) -> None:
    way, seen = [name], set()
    front = [iter(_references(mechanism, name))]
    while front:
        following = next(front[-1], None)
        if following is None:
            front.pop()
            way.pop()
        elif following in way:
            circle = " -> ".join([*way[way.index(following) :], following])
            raise InputError(
                f"outputs refer to each other in a circle: {circle}", where=f"outputs.{name}"
            )
        elif following not in seen:
            seen.add(following)
            way.append(following)
            front.append(iter(_references(mechanism, following)))


def _references(mechanism: Mechanism, name: str) -> list[str]:
    """Return the other named outputs that one refers to."""
    return sorted(used for used in names_in(mechanism.outputs[name]) if used in mechanism.outputs)

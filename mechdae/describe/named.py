"""Named outputs: expressions of coordinates, their rates, parameters and the time.

``Theta = "K2.angle - K1.angle"``, ``v = "slide.slide.speed"``; one named output may use
another one.
"""

from __future__ import annotations

from collections.abc import Iterable

from mechdae.describe.coordinate_names import coordinate_names
from mechdae.describe.coordinates import RATES, split_rate
from mechdae.describe.expression import names_in
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.values import NAME, NAME_RULE
from mechdae.errors import InputError, MechdaeError, UnknownName, shorten

TIME = "t"
COMPONENTS = {
    2: ("x", "y", "moment"),
    3: ("x", "y", "z", "moment_x", "moment_y", "moment_z"),
}
"""Of ``JOINT.reaction`` by dimension: force [N] in world axes, moment about the second body's point
[N m].
"""


def is_reaction(mechanism: Mechanism, name: str) -> bool:
    """Return whether a name is a component of a joint's reaction, ``B.reaction.x``."""
    parts = name.split(".")
    return (
        len(parts) == 3
        and parts[0] in mechanism.joints
        and parts[1] == "reaction"
        and parts[2] in COMPONENTS[mechanism.dimension]
    )


def reactions_of(mechanism: Mechanism, output: str) -> list[str]:
    """Return the components of reactions that a named output uses."""
    return sorted(n for n in names_of(mechanism, output) if is_reaction(mechanism, n))


def names_of(mechanism: Mechanism, output: str) -> set[str]:
    """Return the names a named output uses, those of the outputs it refers to included."""
    result: set[str] = set()
    front, seen = [output], {output}
    while front:
        for name in names_in(mechanism.outputs[front.pop()]):
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
        if is_reaction(mechanism, name):
            continue
        base, order = split_rate(name)
        orders[base] = max(order, orders.get(base, 0))
    return orders


def bodies_of(mechanism: Mechanism, outputs: Iterable[str]) -> set[str]:
    """Return the bodies (the ground too) that named outputs depend on."""
    names = [name for output in outputs for name in reactions_of(mechanism, output)]
    names += [base for output in outputs for base in coordinates_of(mechanism, output)]
    parts = {name.split(".")[0] for name in names}
    return {
        body
        for part in parts
        for body in (mechanism.joints[part].bodies if part in mechanism.joints else (part,))
    }


def check_expression(
    mechanism: Mechanism, text: object, place: str, reactions: bool = False
) -> None:
    """Raise for an expression with names that are no parameter, coordinate, rate or time.

    ``reactions`` are allowed in outputs.
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
            if reactions and is_reaction(mechanism, used):
                continue
            if split_rate(used)[0] not in coordinate_names(mechanism):
                known = [*mechanism.parameters, *mechanism.outputs, *coordinate_names(mechanism)]
                rates = [name + rate for name in coordinate_names(mechanism) for rate in RATES]
                raise UnknownName("name", used, [*known, *rates, TIME])
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
        check_expression(mechanism, text, place, reactions=True)
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

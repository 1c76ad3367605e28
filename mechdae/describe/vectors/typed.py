"""From a mechanism back to the vector loops it was made from, to be written to a file."""

from __future__ import annotations

import re
from dataclasses import replace

from mechdae.describe.mechanism import Mechanism
from mechdae.describe.values import Number, Table
from mechdae.describe.vectors.expand import from_loops
from mechdae.describe.vectors.values import Closure
from mechdae.errors import MechdaeError


def typed(mechanism: Mechanism) -> Closure | None:
    """Return the loops with what stands beside them, None if they do not describe it any more.

    They do not after single numbers of links or of their joints were set.
    """
    closure = mechanism.closure
    if closure is None:
        return None
    bodies = {}
    for name, body in mechanism.bodies.items():
        closed_body = closure.bodies.get(name)
        points = closed_body.points if closed_body else {}
        own_places = {point: place for point, place in body.points.items() if point in points}
        places: Table[tuple[Number, ...]] = Table(own_places)
        rest = replace(body, points=places)
        if closed_body or rest != replace(rest, mass=None, center=None, inertia=None, number=None):
            bodies[name] = rest
    ground = mechanism.ground.points
    points = {point: ground[point] for point in closure.ground.points if point in ground}
    joints = [mechanism.joints[name] for name in closure.joints if name in mechanism.joints]
    beside = replace(
        closure,
        ground=replace(mechanism.ground, points=Table(points)),
        bodies=Table(bodies),
        joints=Table({joint.name: joint for joint in joints}),
    )
    try:
        again = from_loops(
            closure.vectors,
            closure.loops,
            closure.nodes,
            ground=beside.ground,
            bodies=beside.bodies,
            joints=beside.joints,
            parameters=mechanism.parameters,
            dimension=mechanism.dimension,
        )
    except MechdaeError:
        return None
    same = (again.ground, again.bodies, again.joints)
    return beside if same == (mechanism.ground, mechanism.bodies, mechanism.joints) else None


def without_aliases(text: str, mechanism: Mechanism) -> str:
    """Return the text of tasks with the coordinates of vectors under the names of joints."""
    aliases = {name: text for name, text in mechanism.aliases.items() if "." in name}
    if not aliases:
        return text
    words = "|".join(re.escape(name) for name in aliases)
    return re.sub(rf"(?<![\w.])({words})(?![\w])", lambda found: aliases[found[0]], text)

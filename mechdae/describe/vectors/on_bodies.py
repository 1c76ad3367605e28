"""Nodes of spatial vector loops that are points of bodies, and joints that name nodes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.spatial import Spherical
from mechdae.describe.mechanism import GROUND
from mechdae.describe.vectors.nodes import HEAD, TAIL, Merged
from mechdae.describe.vectors.values import Closure
from mechdae.errors import InputError, UnknownName


def points_on_bodies(closure: Closure, merged: Merged) -> dict[str, list[str]]:
    """Return node -> the points of bodies that lie there (``crank.B``), by ``from`` and ``to``.

    Raises
    ------
    InputError
        A body or a point that is not there.
    """
    found: dict[str, list[str]] = {}
    for name, vector in closure.vectors.items():
        for end, word, text in ((TAIL, "from", vector.from_), (HEAD, "to", vector.to)):
            if text is None:
                continue
            body, point = text.split(".")
            if body != GROUND and body not in closure.bodies:
                known = [GROUND, *closure.bodies]
                raise UnknownName("body", body, known, where=f"vectors.{name}.{word}")
            points = closure.ground.points if body == GROUND else closure.bodies[body].points
            if point not in points:
                known = [f"{body}.{other}" for other in points]
                raise UnknownName("point", text, known, where=f"vectors.{name}.{word}")
            if len(points[point]) != 3:
                place = "ground" if body == GROUND else f"bodies.{body}"
                raise InputError(
                    f"3 coordinates are needed, not {len(points[point])}",
                    where=f"{place}.points.{point}",
                )
            ends = found.setdefault(merged.first(f"{name}.{end}"), [])
            if text not in ends:
                ends.append(text)
    for joint in closure.joints.values():  # what hangs on the ground at a node is there
        for here, there in ((joint.first, joint.second), (joint.second, joint.first)):
            body, point = there.split(".")
            if joint.coincide and body == GROUND and point in closure.ground.points:
                for ends in found.values():
                    if here in ends and there not in ends:
                        ends.append(there)
    return found


def referred(joint: Joint, closure: Closure, merged: Merged, at: Mapping[str, str]) -> Joint:
    """Return a joint with ends of vectors and names of nodes as points of the mechanism.

    Parameters
    ----------
    at
        Node -> the point it is.

    Raises
    ------
    InputError
        The end of a vector in a joint that holds more than a point.
    """
    ends = {}
    for side in ("first", "second"):
        text = getattr(joint, side)
        body, point = text.split(".")
        if body == GROUND or (body in closure.bodies and point in closure.bodies[body].points):
            continue
        node = None
        if body in closure.vectors:
            if point not in (TAIL, HEAD):
                known = [f"{body}.{TAIL}", f"{body}.{HEAD}"]
                raise UnknownName("end", text, known, where=f"joints.{joint.name}.between")
            node = merged.first(text)
        elif body in closure.nodes and point == body:
            node = merged.first(closure.nodes[body].at)
        if node is None:
            continue
        ends[side] = at[node]
        own = at[node].split(".")[0]
        unturned = own not in closure.bodies or not closure.bodies[own].points
        if not (joint.ball or joint.bar) and own != GROUND and unturned:
            raise InputError(
                f"'{text}' is a point that does not turn: a {joint.kind} joint needs a body",
                where=f"joints.{joint.name}.between",
                hint="a spherical joint, or a body with the vector between two of its points: "
                'v = { from = "body.A", to = "body.B" }',
            )
    return replace(joint, **ends) if ends else joint


def ties(
    on_bodies: Mapping[str, list[str]], joints: Mapping[str, Joint], names: Mapping[str, str]
) -> Iterator[Spherical]:
    """Yield a ball joint for each point of a body at a node that no joint ties to the first one."""
    for node, points in on_bodies.items():
        together = Merged(points)
        for joint in joints.values():
            if joint.coincide and joint.first in points and joint.second in points:
                together.merge(joint.first, joint.second)
        first, *others = points
        loose = list(dict.fromkeys(together.first(point) for point in others))
        loose = [point for point in loose if point != together.first(first)]
        for point in loose:
            name = names[node] if len(loose) == 1 else f"{names[node]}_{point.split('.')[0]}"
            if name in joints:
                raise InputError(
                    f"the vectors tie {first} and {point} by a joint of their own",
                    where=f"joints.{name}",
                    hint="rename it, or let it join these two points",
                )
            yield Spherical(name, first, point)

"""Bodies in space whose turn nothing tells: links that spin freely, points of vector loops.

A link that only spins about the line of its two ball joints counts as a bar of constant length.
Others that spin about one line, alone or together, are told by `spins`: tube and rod between two
balls, a rod with a third joint on its line.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.pairs import Distance
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.values import Table
from mechdae.records import dataclass

ROUND = 1e-9
"""Share of its length by which a point, a centre or an axis may lie beside a line and count as on
it, and moments of inertia across it may differ."""
Place = tuple[float, float, float]
Line = tuple[str, ...]
"""The names of two points of a body, or of a joint."""


@dataclass(frozen=True)
class IdleLink:
    """A link between two ball joints: its two points, and the points of its neighbours there.

    ``joint`` is the name of the equation of its length.
    """

    name: str
    joint: str
    others: tuple[str, ...]
    own: tuple[str, str]
    ends: tuple[str, str]


def idle_links(mechanism: Mechanism, named: Iterable[str] = ()) -> dict[str, IdleLink]:
    """Return the links that spin freely, by name; not those whose points are `named` (driven)."""
    joints_of: dict[str, list[Joint]] = {name: [] for name in mechanism.bodies}
    for joint in mechanism.joints.values():
        for body in joint.bodies:
            if body in joints_of:
                joints_of[body].append(joint)
    found: dict[str, IdleLink] = {}
    held, taken = set(named), set[str]()
    for body, joints in joints_of.items():
        if len(joints) != 2 or not all(j.ball for j in joints) or body in held:
            continue
        near, far = zip(*(joint.ends_at(body) for joint in joints), strict=True)
        others = [end.split(".")[0] for end in far]
        if near[0] == near[1] or others[0] == others[1] or taken & set(others):
            continue
        taken.add(body)
        found[body] = IdleLink(
            body, joints[0].name, (joints[1].name,), (near[0], near[1]), (far[0], far[1])
        )
    return found


@dataclass(frozen=True)
class Spin:
    """Bodies that spin together about a line: all that leads out of them acts on its points.

    ``ends`` are its points by the joints that lead out, ball joints and bars; ``lines`` tell the
    line in each body that keeps it, whatever the bodies do among themselves: two of its points, or
    a joint on whose axis it is.
    In a ``sleeve`` on that axis the two bodies spin one by one.
    """

    bodies: tuple[str, ...]
    ends: Mapping[str, str]
    lines: Mapping[str, Line]
    sleeve: str = ""

    @property
    def joints(self) -> tuple[str, ...]:
        return tuple(self.ends)


def spins(mechanism: Mechanism, drivers: Sequence[NamedCoordinate] = ()) -> list[Spin]:
    """Return the bodies that spin freely beside the idle links, where `drivers` let them.

    Rollers on them that nothing drives hold nothing.
    """
    driven = [c for c in drivers if c.kind != "point"]
    named = [f"{c.part}.{c.point}" for c in drivers if c.kind == "point"]
    links = idle_links(mechanism, (point.split(".")[0] for point in named))
    loose = {*rollers(mechanism)} - {body for c in drivers for body in c.bodies(mechanism)}
    every = without(mechanism, links).joints.values()
    joints = [joint for joint in every if not loose & {*joint.bodies}]
    fixed = points_of(mechanism)
    part = {name: name for name in (GROUND, *mechanism.bodies) if name not in {*links, *loose}}

    def root(name: str) -> str:
        while part[name] != name:
            name = part[name]
        return name

    for joint in joints:
        if not (joint.ball or joint.bar):
            for other in joint.bodies[1:]:
                part[root(other)] = root(joint.bodies[0])
    found = []
    for leader in dict.fromkeys(root(name) for name in part):
        bodies = tuple(name for name in part if root(name) == leader)
        if GROUND not in bodies and not fixed & set(bodies):
            spin = _spin(mechanism, bodies, joints, named, {c.text for c in driven})
            found += [spin] if spin is not None else []
    return found


def on_lines(mechanism: Mechanism) -> tuple[Any, ...]:
    """Return what of bodies that spin is decided by numbers: which, and points on their lines."""
    links = idle_links(mechanism).values()
    lines: dict[str, Line] = {link.name: link.own for link in links}
    found = spins(mechanism)
    for spin in found:
        lines |= spin.lines
    points = tuple(
        point
        for body in lines
        for point in (f"{body}.{point}" for point in mechanism.bodies[body].points)
        if share_of(mechanism, lines, point) is not None
    )
    return tuple((spin.bodies, spin.joints) for spin in found), points


def _spin(
    mechanism: Mechanism,
    bodies: tuple[str, ...],
    joints: list[Joint],
    named: Sequence[str],
    driven: Collection[str],
) -> Spin | None:
    """Return the spin of bodies that balls and bars alone join to others, None without one.

    `named` are the points and `driven` the coordinates of joints that drivers hold.
    """
    ends: dict[str, str] = {}
    for joint in joints:
        inside = [side for side in (joint.first, joint.second) if side.split(".")[0] in bodies]
        if len(inside) == 1 and (joint.ball or joint.bar):
            ends[joint.name] = inside[0]
    points = list(dict.fromkeys(ends.values()))
    held = [*points, *(point for point in named if point.split(".")[0] in bodies)]
    by: dict[str, list[str]] = {}
    for point in points:
        by.setdefault(point.split(".")[0], []).append(point)
    lines = _between(mechanism, points) if len(by) == 1 else {}
    if len(by) == 2:
        lines = _along_slide(mechanism, [links[0] for links in by.values()], joints)
    if lines and all(share_of(mechanism, lines, point) is not None for point in held):
        slid = next((line[0] for line in lines.values() if len(line) == 1), "")
        apart = slid and mechanism.joints[slid].freedoms > 1 and f"{slid}.angle" not in driven
        sleeve = slid if apart else ""
        return Spin(bodies, ends, lines, sleeve)
    bent = len(by) == len(points) == 2 and set(held) == set(points) and not lines
    return Spin(bodies, ends, {}) if bent else None


def _between(mechanism: Mechanism, points: list[str]) -> dict[str, Line]:
    """Return the line through points of one body, nothing where they are one."""
    places = [place_of(mechanism, point) for point in points]
    for point, place in zip(points, places, strict=True):
        if place != places[0]:
            return {point.split(".")[0]: (points[0], point)}
    return {}


def _along_slide(mechanism: Mechanism, points: list[str], joints: list[Joint]) -> dict[str, Line]:
    """Return the line of two bodies that slide along it: it goes through a point of each."""
    bodies = [point.split(".")[0] for point in points]
    for joint in joints:
        if {joint.first_body, joint.second_body} == set(bodies) and joint.straight:
            found: dict[str, Line] = dict.fromkeys(bodies, (joint.name,))
            on_it = all(share_of(mechanism, found, point) is not None for point in points)
            return found if on_it else {}
    return {}


def places_of(mechanism: Mechanism, body: str, line: Line) -> tuple[Place, Place]:
    """Return two places on a line of a body."""
    if len(line) == 2:
        return place_of(mechanism, line[0]), place_of(mechanism, line[1])
    joint: Any = mechanism.joints[line[0]]
    values = mechanism.values()
    second = joint.second_body == body
    x, y, z = place_of(mechanism, joint.second if second else joint.first)
    axis = joint.side(second)[0]
    a, b, c = (values[f"{joint.name}.{axis}.{component}"] for component in "xyz")
    size = mechanism.scale / math.hypot(a, b, c)
    return (x, y, z), (x + size * a, y + size * b, z + size * c)


def place_of(mechanism: Mechanism, point: str) -> Place:
    """Return the place of a point in its body."""
    values = mechanism.values()
    x, y, z = (values[f"{point}.{axis}"] for axis in "xyz")
    return x, y, z


def share_of(mechanism: Mechanism, lines: Mapping[str, Line], point: str) -> float | None:
    """Return where a point lies on the line of its body, None beside it or without a line."""
    body = point.split(".")[0]
    if body not in lines:
        return None
    start, end = places_of(mechanism, body, lines[body])
    way = [b - a for a, b in zip(start, end, strict=True)]
    here = [b - a for a, b in zip(start, place_of(mechanism, point), strict=True)]
    share = sum(a * b for a, b in zip(way, here, strict=True)) / math.hypot(*way) ** 2
    beside = [b - share * a for a, b in zip(way, here, strict=True)]
    return share if math.hypot(*beside) <= ROUND * math.hypot(*way) else None


def length(mechanism: Mechanism, link: IdleLink) -> float:
    """Return the distance of the two ball joints of a link [m]."""
    values = mechanism.values()
    square = sum(
        (values[f"{link.own[1]}.{axis}"] - values[f"{link.own[0]}.{axis}"]) ** 2 for axis in "xyz"
    )
    return float(square**0.5)


def without(mechanism: Mechanism, links: dict[str, IdleLink]) -> Mechanism:
    """Return the mechanism with bars of constant length in place of links that spin freely.

    Only its structure matters: loads, outputs and sketch are left out.
    """
    joints: dict[str, Joint] = dict(mechanism.joints)
    for link in links.values():
        joints[link.joint] = Distance(
            link.joint, link.ends[0], link.ends[1], length=length(mechanism, link)
        )
        for other in link.others:
            del joints[other]
    bodies = {name: body for name, body in mechanism.bodies.items() if name not in links}
    return replace(
        mechanism,
        bodies=Table(bodies),
        joints=Table(joints),
        loads=Table(),
        outputs=Table(),
        sketch=Table(),
    )


def rollers(mechanism: Mechanism) -> list[str]:
    """Return the bodies on one pin or ball and on nothing else, and that no load names."""
    joints = list(mechanism.joints.values())
    named = {
        str(getattr(load, key, "")).split(".")[0]
        for load in mechanism.loads.values()
        for key in ("body", "point", "coordinate")
    }
    named |= {
        end.split(".")[0]
        for load in mechanism.loads.values()
        for end in getattr(load, "between", None) or ()
    }
    found = []
    for body in mechanism.bodies:
        ending = [joint for joint in joints if body in joint.bodies]
        if (
            len(ending) == 1
            and ending[0].hinge
            and body not in named
            and ending[0].name not in named
        ):
            found.append(body)
    return found


def points_of(mechanism: Mechanism) -> set[str]:
    """Return the bodies that are points at the ends of vectors: they do not turn.

    Such a body has one point and no inertia, and what is joined to it holds that point alone.
    """
    joints = mechanism.joints.values()
    ends = {body for joint in joints if joint.pointer for body in joint.bodies}
    held = {
        body
        for joint in joints
        if not (joint.pointer or joint.ball or joint.bar)
        for body in joint.bodies
    }
    return {
        name
        for name in ends - held
        if name in mechanism.bodies
        and len(mechanism.bodies[name].points) == 1
        and mechanism.bodies[name].inertia is None
        and not mechanism.bodies[name].center
    }

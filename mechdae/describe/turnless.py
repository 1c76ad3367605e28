"""Bodies in space whose turn nothing tells: links that spin freely, points of vector loops.

A link that only spins about the line of its two ball joints counts as a bar of constant length.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mechdae.describe.joints import Distance, Joint
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.table import Table
from mechdae.records import dataclass


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
        own = [j.first if j.first_body == body else j.second for j in joints]
        ends = [j.second if j.first_body == body else j.first for j in joints]
        others = [end.split(".")[0] for end in ends]
        if own[0] == own[1] or others[0] == others[1] or taken & set(others):
            continue
        taken.add(body)
        found[body] = IdleLink(
            body, joints[0].name, (joints[1].name,), (own[0], own[1]), (ends[0], ends[1])
        )
    return found


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

"""Other fixed links: the same relative motions, seen from another link."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from mechdae.describe import Body, Driver, Ground, Joint, Mechanism, Problem, Table
from mechdae.parts.types.chains.variants.scheme import GROUND, Pose, Variant, made
from mechdae.parts.types.chains.variants.symmetries import of_dimensions

FRAME = "frame"
"""Name of the link that was the fixed one."""


def choices(mechanism: Mechanism) -> list[str]:
    """Return the links that differ as the fixed one, the ground first."""
    group = of_dimensions(mechanism)
    names = [GROUND, *mechanism.bodies]
    place = {name: k for k, name in enumerate(names)}
    return [link for link in names if all(place[move[link]] >= place[link] for move in group)]


def inversions(problem: Problem, pose: Pose) -> Iterator[Variant]:
    """Yield the mechanism with each link fixed that differs from those before."""
    for link in choices(problem.mechanism):
        yield inversion(problem, pose, link)


def inversion(problem: Problem, pose: Pose, link: str) -> Variant:
    """Return the mechanism with another fixed link.

    The frame of that link becomes the fixed one, what was the ground a body called ``frame``. A
    driver that turns a body against the ground turns the joint between them.
    """
    base = problem.mechanism
    about = {"fixed": link}
    if link == GROUND:
        bare = replace(base, loads=Table(), outputs=Table())
        return made(problem, "fixed-ground", bare, "the frame fixed", about)
    frame = FRAME
    while frame in base.bodies or frame in base.joints or frame in base.parameters:
        frame += "_"
    called = {link: GROUND, GROUND: frame}
    fixed = base.bodies[link]
    bodies = {frame: Body(frame, base.ground.points)} | {
        name: body for name, body in base.bodies.items() if name != link
    }
    angles = {GROUND: 0.0, **pose.angles}
    sketch = {called.get(name, name): angles[name] - angles[link] for name in angles}
    sketch.pop(GROUND)
    sketch |= {name: value for name, value in pose.slides.items() if name in base.joints}
    mechanism = Mechanism(
        ground=Ground(fixed.points),
        bodies=Table(bodies),
        joints=Table({name: _renamed(joint, called) for name, joint in base.joints.items()}),
        parameters=base.parameters,
        sketch=Table(sketch),
        gravity=base.gravity,
        closure_tolerance=base.closure_tolerance,
    )
    drives = {f"{name}.angle": _joint_of(base, name) for name in base.bodies}

    def driver(given: Driver) -> Driver:
        joint = drives.get(given.coordinate)
        return given if joint is None else replace(given, coordinate=f"{joint}.angle")

    return made(problem, f"fixed-{link}", mechanism, f"{link} fixed", about, driver)


def _joint_of(mechanism: Mechanism, body: str) -> str | None:
    """Return the joint whose angle is that of a body: it turns the body against the ground."""
    for name, joint in mechanism.joints.items():
        if joint.turns and (joint.first_body, joint.second_body) == (GROUND, body):
            return name
    return None


def _renamed(joint: Joint, called: dict[str, str]) -> Joint:
    """Return a joint between the same links under their new names."""
    changes: dict[str, Any] = {}
    for side in ("first", "second"):
        body, _, point = str(getattr(joint, side)).partition(".")
        changes[side] = f"{called.get(body, body)}.{point}"
    if hasattr(joint, "carrier"):
        carrier = called.get(joint.carrier or GROUND, joint.carrier)
        changes["carrier"] = None if carrier == GROUND else carrier
    return replace(joint, **changes)

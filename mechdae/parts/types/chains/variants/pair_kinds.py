"""Other fixed links, and revolute or prismatic pairs at the joints, each built in one pose."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from itertools import product
from math import atan2, cos, sin

from mechdae.describe import Body, Driver, Ground, Joint, Mechanism, Problem, Table
from mechdae.describe.joints.pairs import Prismatic, Revolute
from mechdae.describe.vectors.translation import renamed
from mechdae.errors import InputError
from mechdae.parts.types.chains.variants.scheme import (
    GROUND,
    Pose,
    Translation,
    Variant,
    driver_of,
    made,
    reach,
    values_of,
)
from mechdae.parts.types.chains.variants.symmetries import of_dimensions, of_structure
from mechdae.types import Json

FRAME = "frame"
"""Name of the link that was the fixed one."""
Parts = dict[str, Body | Ground]


def fixed_links(mechanism: Mechanism) -> list[str]:
    """Return the links that differ as the fixed one, the ground first."""
    group = of_dimensions(mechanism)
    names = [GROUND, *mechanism.bodies]
    place = {name: k for k, name in enumerate(names)}
    return [link for link in names if all(place[move[link]] >= place[link] for move in group)]


def inversions(problem: Problem, pose: Pose) -> Iterator[Variant]:
    """Yield the mechanism with each link fixed that differs from those before."""
    for link in fixed_links(problem.mechanism):
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
        joints=Table({name: renamed(joint, called) for name, joint in base.joints.items()}),
        parameters=base.parameters,
        sketch=Table(sketch),
        gravity=base.gravity,
        closure_tolerance=base.closure_tolerance,
    )
    translation = Translation(
        base, mechanism, called, instead=lambda *given: _instead(mechanism, pose, base, *given)
    )
    return made(problem, f"fixed-{link}", mechanism, f"{link} fixed", about, translation)


def _instead(
    mechanism: Mechanism,
    pose: Pose,
    base: Mechanism,
    given: Driver,
    used: Collection[str],
    only: bool,
) -> Driver:
    """Return the driver of a joint for one whose coordinate is gone.

    That of the joint that it drove, or else the first that moves, those of the fixed link before
    the others.
    """
    part = given.coordinate.partition(".")[0]
    joints = mechanism.joints
    drove = [part] if part in joints else []
    drove += [name for name, joint in base.joints.items() if {GROUND, part} == {*joint.bodies}]
    moving = sorted(pose.moving or joints, key=lambda name: GROUND not in joints[name].bodies)
    for name in (*drove, *moving):
        still = given.at is not None and len(given.at) == 1
        driver = driver_of(joints[name], base.joints[name], pose, only and not still)
        if joints[name].coordinates and driver.coordinate not in used:
            return driver
    raise InputError(f"nothing can be driven in place of '{given.coordinate}'")


def varied(mechanism: Mechanism) -> list[str]:
    """Return the joints that may be revolute or prismatic."""
    found = [name for name, joint in mechanism.joints.items() if joint.hinge or joint.guide]
    if not found:
        raise InputError("no joint is revolute or prismatic", where="joints")
    return found


def count(mechanism: Mechanism) -> tuple[int, int]:
    """Return how many words of R and P there are, and how many up to symmetries of the chain."""
    pins = varied(mechanism)
    group = of_structure(mechanism, kinds=False)
    moves = [move for _, move in group if {move[name] for name in pins} == set(pins)]
    total = sum(1 << _cycles({name: move[name] for name in pins}) for move in moves)
    return 1 << len(pins), total // len(moves)


def pair_kinds(problem: Problem, pose: Pose) -> Iterator[Variant]:
    """Yield the mechanism with each choice of revolute and prismatic pairs."""
    for word in product("RP", repeat=len(varied(problem.mechanism))):
        yield with_kinds(problem, pose, "".join(word))


def with_kinds(problem: Problem, pose: Pose, word: str) -> Variant:
    """Return the mechanism with these kinds of pairs, built in a pose.

    A new prismatic pair slides along the line to the middle of the other joints of its first
    link; a new revolute one has its pin where the second link's point is.
    """
    base = problem.mechanism
    kinds = dict(zip(varied(base), word, strict=True))
    parts: Parts = {GROUND: base.ground, **base.bodies}
    joints: dict[str, Joint] = {}
    slides = {name: value for name, value in pose.slides.items() if kinds.get(name) == "P"}
    for name, joint in base.joints.items():
        if kinds.get(name) == "P" and joint.hinge:
            joints[name] = _slide(base, pose, joint)
            slides[name] = 0.0
        elif kinds.get(name) == "R" and joint.guide:
            joints[name] = _pin(parts, pose, joint)
        else:
            joints[name] = joint
    ground = parts.pop(GROUND)
    mechanism = Mechanism(
        ground=ground,  # type: ignore[arg-type]
        bodies=Table(parts),  # type: ignore[arg-type]
        joints=Table(joints),
        parameters=base.parameters,
        sketch=Table({**pose.angles, **slides}),
        gravity=base.gravity,
        closure_tolerance=base.closure_tolerance,
    )
    about = {"pairs": kinds}
    translation = Translation(
        base, mechanism, instead=lambda *given: _instead(mechanism, pose, base, *given)
    )
    return made(problem, f"pairs-{word}", mechanism, f"pairs {word}", about, translation)


def _slide(mechanism: Mechanism, pose: Pose, joint: Joint) -> Prismatic:
    body, point = reach(joint, "first")
    x, y = values_of(mechanism, body, point)
    others = [
        values_of(mechanism, body, reach(other, side)[1])
        for name, other in mechanism.joints.items()
        for side in ("first", "second")
        if name != joint.name and reach(other, side)[0] == body
    ]
    away = [other for other in others if other != (x, y)]
    dx, dy = (sum(place[a] for place in away) - len(away) * (x, y)[a] for a in (0, 1))
    angles = {GROUND: 0.0, **pose.angles}
    given: Json = {word: getattr(joint, word) for word in ("friction", "friction_static")}
    return Prismatic(
        joint.name,
        joint.first,
        joint.second,
        axis=atan2(dy, dx) if away else 0.0,
        turn=angles[joint.second_body] - angles[joint.first_body],
        **given,
    )


def _pin(parts: Parts, pose: Pose, joint: Joint) -> Revolute:
    """Return a revolute in place of a prismatic pair; its first link has a point more."""
    first, point = reach(joint, "first")
    x, y = pose.points[joint.second]
    x0, y0 = pose.points[joint.first]
    base = parts[first].points[point]
    angle = {GROUND: 0.0, **pose.angles}[first]
    dx, dy = x - x0, y - y0
    turned = (cos(angle) * dx + sin(angle) * dy, cos(angle) * dy - sin(angle) * dx)
    if max(map(abs, turned)) > 0:
        point = joint.name
        while point in parts[first].points:
            point += "_"
        place = tuple(_sum(b, o) for b, o in zip(base, turned, strict=True))
        parts[first] = replace(parts[first], points=parts[first].points.with_(point, place))
    given: Json = {}
    return Revolute(joint.name, f"{first}.{point}", joint.second, **given)


def _sum(base: float | str, offset: float) -> float | str:
    return base + offset if isinstance(base, float) else f"({base}) + ({offset!r})"


def _cycles(move: dict[str, str]) -> int:
    seen: set[str] = set()
    number = 0
    for start in move:
        number += start not in seen
        while start not in seen:
            seen.add(start)
            start = move[start]
    return number

"""A scheme with dimensions as a problem of its own, and its certificate over a whole turn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechdae.describe import (
    GROUND,
    Body,
    Driver,
    Ground,
    Joint,
    Mechanism,
    Problem,
    Sweep,
    Table,
    Task,
    dumps,
)
from mechdae.describe.joints.pairs import Prismatic, Revolute
from mechdae.describe.loads import Force, Load, Resistance
from mechdae.describe.tasks.motion import Reactions
from mechdae.errors import MechdaeError
from mechdae.parts.types.chains.mechanisms import letters
from mechdae.parts.types.schemes.aims import ANGLE, CURVE, Aim
from mechdae.parts.types.schemes.aims import PATH as PATH_AIM
from mechdae.parts.types.schemes.losses import LossAsked
from mechdae.parts.types.schemes.placed_design import PlacedDesign, output_link
from mechdae.parts.types.schemes.scheme import SLIDER, Scheme
from mechdae.records import dataclass
from mechdae.results import FINE
from mechdae.tasks.dispatch.solve import solve
from mechdae.types import Complexes

PATH = "path"
"""Task of a design's problem that moves it."""
TARGETS = "targets"
"""Task of its problem that is at the targets."""
LOSS, LOAD = "loss", "load"
"""Task with friction, and what loads the mechanism there."""
POSES = 721
"""Poses of the certified sweep over a turn."""
TURN = 2 * np.pi


def point_names(scheme: Scheme) -> list[str]:
    """Return the names of the points: letters, P for the one that traces."""
    names = iter(name for name in letters(scheme.size + 1) if name != "P")
    return ["P" if k == scheme.trace else next(names) for k in range(scheme.size)]


def tracer(scheme: Scheme) -> str:
    """Return the tracing point as `link.P`."""
    return f"{_link_names(scheme)[scheme.links_at(scheme.trace)[0]]}.P"


def output(scheme: Scheme, aim: Aim) -> str:
    """Return the coordinate that is the output of a function."""
    if aim.what == ANGLE:
        return f"{_link_names(scheme)[output_link(scheme)]}.angle"
    return f"{point_names(scheme)[scheme.trace]}_slide.slide"


def _link_names(scheme: Scheme) -> list[str]:
    return [GROUND, "crank", *(f"link{k}" for k in range(2, len(scheme.links)))]


def crank_angle(scheme: Scheme, place: PlacedDesign) -> float:
    """Return the angle of the crank in a pose [rad]."""
    spots = place.places
    return float(place.angles.get(1, np.angle(spots[1] - spots[0])))


def mechanism_of_scheme(
    scheme: Scheme, place: PlacedDesign, rubbing: LossAsked | None = None, aim: Aim | None = None
) -> Mechanism:
    """Return the mechanism that stands with its points at their places [m].

    A link has its first point as its origin and the second one on its x axis, where no angle is
    given to it; a block is turned as its guide is.
    """
    names, links = point_names(scheme), _link_names(scheme)
    spots = np.asarray(place.places, complex)
    turns = _turns(scheme, place)
    bodies, sketch = {}, {}
    for number, (link, points) in enumerate(zip(links, scheme.links, strict=True)):
        if number == 0:
            at = spots.copy()
            for k, zero in place.zeros.items():
                at[k] = zero
            frame = Ground(_points(names, points, at, 0.0, 0.0, True))
            continue
        angle = turns[number]
        natural = number not in place.angles and len(points) > 1
        table = _points(names, points, spots, complex(spots[points[0]]), angle, natural)
        bodies[link] = Body(link, table, number=number)
        sketch[link] = angle
    joints: dict[str, Joint] = {}
    guides: dict[str, Any] = {} if rubbing is None else {"friction": rubbing.friction}
    pins = guides if rubbing is None else {**guides, "pin_radius": rubbing.pin_radius}
    for k, name in enumerate(names):
        at_pin = scheme.links_at(k)
        for turn, other in enumerate(at_pin[1:], start=1):
            joint = name if turn == 1 else f"{name}{turn}"
            ends = (f"{links[at_pin[0]]}.{name}", f"{links[other]}.{name}")
            joints[joint] = Revolute(joint, *ends, **pins)
    for k, guide, block in scheme.slides:
        kind, _, j = scheme.points[k]
        base, end = (j, k) if kind == SLIDER else (k, j)
        axis = float(np.angle(spots[end] - spots[base])) - turns[guide]
        name = f"{names[k]}_slide"
        pair = (f"{links[guide]}.{names[base]}", f"{links[block]}.{names[end]}")
        joints[name] = Prismatic(name, *pair, axis=axis, **guides)
    loads = {} if rubbing is None or aim is None else _loads(scheme, rubbing, aim)
    return Mechanism(
        ground=frame, bodies=Table(bodies), joints=Table(joints), sketch=Table(sketch),
        loads=Table(loads),
    )  # fmt: skip


def _loads(scheme: Scheme, rubbing: LossAsked, aim: Aim) -> dict[str, Load]:
    """Return the load of a task: a force on the tracing point, or what resists the output."""
    if aim.what in (CURVE, PATH_AIM):
        return {LOAD: Force(LOAD, tracer(scheme), rubbing.load)}
    size = rubbing.load[0]
    return {LOAD: Resistance(LOAD, output(scheme, aim), negative=size, positive=size)}


def _turns(scheme: Scheme, place: PlacedDesign) -> list[float]:
    """Return the angle of each link in the pose."""
    spots = place.places
    found = [0.0]
    for number, points in enumerate(scheme.links[1:], start=1):
        along = 0.0 if len(points) < 2 else float(np.angle(spots[points[1]] - spots[points[0]]))
        found.append(place.angles.get(number, along))
    for _, guide, block in scheme.slides:
        found[block] = found[guide]
    return found


def _points(
    names: list[str],
    link: tuple[int, ...],
    spots: Complexes,
    origin: complex,
    angle: float,
    natural: bool,
) -> Table[tuple[Any, ...]]:
    """Return points of a link in its frame; of a natural one the second lies on the x axis."""
    found = {}
    for place, k in enumerate(link):
        local = (spots[k] - origin) * np.exp(-1j * angle) + 0.0
        y = 0.0 if natural and angle != 0.0 and place == 1 else float(local.imag)
        found[names[k]] = (float(local.real) + 0.0, y + 0.0)
    return Table(found)


def problem_of_scheme(
    scheme: Scheme, place: PlacedDesign, name: str, title: str, rubbing: LossAsked | None = None,
    aim: Aim | None = None,
) -> Problem:  # fmt: skip
    """Return the problem of a design: a turn of its crank from the pose it stands in, or less.

    Where there are targets a second task is at them, where there is friction a third one has the
    loss.
    """
    mechanism = mechanism_of_scheme(scheme, place, rubbing, aim)
    start = crank_angle(scheme, place)
    low, high = place.span
    driver = Driver("crank.angle", from_=start + low, to=start + high)
    tasks: dict[str, Task] = {PATH: Sweep(driver, poses=361, measures=("transmission",))}
    if place.at is not None:
        at = Driver("crank.angle", at=tuple((start + place.at).tolist()))
        tasks[TARGETS] = Sweep(at)
    if rubbing is not None:
        tasks[LOSS] = Reactions(driver, poses=361, cycle=True)
    return Problem(mechanism, Table(tasks), name=name, title=title)


@dataclass
class Certificate:
    """What the certified kinematics find over a whole turn, or over the span that is asked for.

    ``reasons``: why it is no design; empty where it is one. ``curve`` (t,) complex: the path of the
    tracing point; of a whole turn without its last pose. ``transmission``: least transmission angle
    of all dyads [rad].
    """

    reasons: list[str]
    curve: Any = None
    transmission: float = 0.0


def certified(problem: Problem, point: str) -> Certificate:
    """Return what a sweep of a design finds: every pose certified, one circuit, all of the span."""
    path = problem.tasks[PATH]
    assert isinstance(path, Sweep)
    driver = path.driver
    assert driver is not None
    task = Sweep(driver, poses=POSES, derivatives=2, measures=("transmission",))
    whole = Problem(problem.mechanism, Table({PATH: task}), name=problem.name)
    low, high = (float(bound) for bound in (driver.from_, driver.to) if bound is not None)
    turns = high - low > TURN * (1 - 1e-9)
    try:
        found = solve(whole, PATH)
    except MechdaeError as error:
        return Certificate([f"does not move: {error.what}"])
    lost = sum(str(word) not in FINE for word in found.status)
    if lost or (turns and found.summary.get("limits")):
        how = "fully on one circuit" if turns else "over all targets on one circuit"
        return Certificate([f"the crank does not turn {how}"])
    position = found.points[point].position
    angles = [angle["min"] for angle in found.summary.get("transmission", {}).values()]
    curve = position[:, 0] + 1j * position[:, 1]
    least = float(min(angles)) if angles else float(TURN / 4)
    if not turns:
        return Certificate([], curve, least)
    if np.abs(curve[-1] - curve[0]) > 1e-9 * np.ptp(np.abs(curve - curve.mean())) + 1e-12:
        return Certificate(["the path does not close after a turn"])
    return Certificate([], curve[:-1], least)


def at_targets(problem: Problem, coordinate: str) -> Any:
    """Return places (k, 2) of a point, or values (k,) of an angle or a slide, at the targets."""
    found = solve(problem, TARGETS)
    if any(str(word) not in FINE for word in found.status):
        return None
    owner, what = coordinate.split(".")
    if what == "slide":
        return found.joints[owner].slide
    if what == "angle":
        return found.bodies[owner].angle
    return found.points[coordinate].position


def loss_of(problem: Problem) -> float | None:
    """Return the mean loss [W] of a design with coupled friction; None: no motion."""
    found = solve(problem, LOSS)
    if any(str(word) not in FINE for word in found.status):
        return None
    return float(found.summary["loss"])


def text_of_design(problem: Problem) -> str:
    return dumps(problem)


def dimensions(mechanism: Mechanism) -> Mapping[str, float]:
    """Return the numbers of a mechanism that are dimensions, by their names."""
    return {name: float(value) for name, value in mechanism.values().items()}

"""A scheme with dimensions as a problem of its own, and its certificate over a whole turn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechdae.composition.mechanisms import letters
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.writing import dumps
from mechdae.describe.joints import Joint, Revolute
from mechdae.describe.mechanism import GROUND, Body, Ground, Mechanism
from mechdae.describe.table import Table
from mechdae.describe.tasks.kinds import Driver, Sweep, Task
from mechdae.errors import MechdaeError
from mechdae.records import dataclass
from mechdae.results import FINE
from mechdae.schemes.scheme import Scheme
from mechdae.solver.solve import solve

PATH = "path"
"""Task of a design's problem that moves it."""
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


def _link_names(scheme: Scheme) -> list[str]:
    return [GROUND, "crank", *(f"link{k}" for k in range(2, len(scheme.links)))]


def mechanism_of_scheme(scheme: Scheme, places: Any) -> Mechanism:
    """Return the mechanism that stands with its points at places (n,), complex [m].

    A link has its first point as its origin and the second one on its x axis.
    """
    names, links = point_names(scheme), _link_names(scheme)
    spots = np.asarray(places, complex)
    bodies, sketch = {}, {}
    for number, (link, own) in enumerate(zip(links, scheme.links, strict=True)):
        if number == 0:
            frame = Ground(_points(names, own, spots, 0.0, 0.0))
            continue
        angle = float(np.angle(spots[own[1]] - spots[own[0]]))
        table = _points(names, own, spots, complex(spots[own[0]]), angle)
        bodies[link] = Body(link, table, number=number)
        sketch[link] = angle
    joints: dict[str, Joint] = {}
    for k, name in enumerate(names):
        at = scheme.links_at(k)
        for turn, other in enumerate(at[1:], start=1):
            joint = name if turn == 1 else f"{name}{turn}"
            ends = (f"{links[at[0]]}.{name}", f"{links[other]}.{name}")
            joints[joint] = Revolute(joint, *ends)
    return Mechanism(ground=frame, bodies=Table(bodies), joints=Table(joints), sketch=Table(sketch))


def _points(
    names: list[str], own: tuple[int, ...], spots: Any, origin: complex, angle: float
) -> Table[tuple[Any, ...]]:
    found = {}
    for place, k in enumerate(own):
        local = (spots[k] - origin) * np.exp(-1j * angle) + 0.0
        y = 0.0 if angle != 0.0 and place == 1 else float(local.imag)
        found[names[k]] = (float(local.real) + 0.0, y + 0.0)
    return Table(found)


def problem_of_scheme(scheme: Scheme, places: Any, name: str, title: str) -> Problem:
    """Return the problem of a design: one turn of its crank from the pose it stands in."""
    mechanism = mechanism_of_scheme(scheme, places)
    start = float(mechanism.sketch["crank"])
    driver = Driver("crank.angle", from_=start, to=start + TURN)
    tasks: dict[str, Task] = {PATH: Sweep(driver, poses=361, measures=("transmission",))}
    return Problem(mechanism, Table(tasks), name=name, title=title)


@dataclass
class Certificate:
    """What the certified kinematics find over a whole turn.

    Attributes
    ----------
    reasons
        Why it is no design; empty where it is one.
    curve
        (t,) complex, the path of the tracing point, without its last pose.
    transmission
        Least transmission angle of all dyads [rad].
    """

    reasons: list[str]
    curve: Any = None
    transmission: float = 0.0


def certified(problem: Problem, point: str) -> Certificate:
    """Return what a sweep of a design finds: every pose certified, one circuit, a full turn."""
    path = problem.tasks[PATH]
    assert isinstance(path, Sweep)
    assert path.driver is not None
    task = Sweep(path.driver, poses=POSES, derivatives=2, measures=("transmission",))
    whole = Problem(problem.mechanism, Table({PATH: task}), name=problem.name)
    try:
        found = solve(whole, PATH)
    except MechdaeError as error:
        return Certificate([f"does not move: {error.what}"])
    lost = sum(str(word) not in FINE for word in found.status)
    if lost or found.summary.get("limits"):
        return Certificate(["the crank does not turn fully on one circuit"])
    position = found.points[point].position
    angles = [own["min"] for own in found.summary.get("transmission", {}).values()]
    curve = position[:, 0] + 1j * position[:, 1]
    if np.abs(curve[-1] - curve[0]) > 1e-9 * np.ptp(np.abs(curve - curve.mean())) + 1e-12:
        return Certificate(["the path does not close after a turn"])
    return Certificate([], curve[:-1], float(min(angles)) if angles else float(TURN / 4))


def text_of_design(problem: Problem) -> str:
    """Return a design as a problem file."""
    return dumps(problem)


def dimensions(mechanism: Mechanism) -> Mapping[str, float]:
    """Return the numbers of a mechanism that are dimensions, by their names."""
    return {name: float(value) for name, value in mechanism.values().items()}

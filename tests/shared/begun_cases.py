"""Random mechanisms whose tasks once began at poses of their own: by how much they do, over what is
allowed."""

from __future__ import annotations

import collections
from dataclasses import replace

import numpy as np

import mechdae as md
from mechdae.describe.values import Table
from tests.attack import first_poses
from tests.attack.exact_sketches import draw
from tests.attack.loops_of_pairs import mechanism_of, off, portion
from tests.attack.spatial_honesty import case
from tests.shared.begun import First


def slotted() -> float:
    """Modes that differ by the slide of a slot alone: sketches offered of them, designs' files."""
    return _of_linkage(109)


def told_twice() -> float:
    """A linkage whose joints are sketched beside its bodies, each off in its own way."""
    return _of_linkage(117, modes=3)


def _of_linkage(seed: int, modes: int = 1) -> float:
    linkage = draw(seed, "geared")
    for _ in range(modes):
        sketch = first_poses.rough(linkage, linkage.pose)
        drivers = {text: linkage.value(text, linkage.pose) for text in linkage.drivers}
        mechanism = first_poses.masses(linkage.mechanism(sketch))
        if First(
            mechanism, drivers, f"b0.{next(iter(linkage.points['b0']))}.x", ("design",)
        ).wrong():
            return np.inf
    return 0.0


def all_joints_told() -> float:
    """A loop whose joints are all sketched, roughly: a motion begins at the slide that drives."""
    rng = np.random.default_rng(5)
    found = case(rng, "CUS")
    told = {"J0.angle": 0.2, "J0.slide": 0.05, "J1.angle": -0.2, "J1.angle2": 0.15}
    bodies = {
        name: md.Body(name, dict(own.points), mass=1.0, center=[0.0] * 3, inertia=[0.2, 0.3, 0.4])
        for name, own in found.mechanism.bodies.items()
    }
    points = {n: v for n, v in found.mechanism.sketch.items() if n.count(".") == 2}
    mechanism = replace(found.mechanism, bodies=Table(bodies), sketch=Table(points | told))
    problem = md.Problem(mechanism, tasks={
        "sweep": md.Sweep(driver=md.Driver("J0.slide", at=[0.05])),
        "silent": md.Motion(at=[0, 1e-6]),
    })  # fmt: skip
    return abs(float(md.solve(problem, "silent").joints["J0"].slide[0]) - 0.05) / 1e-9


def two_balls_and_a_cross() -> float:
    """Two links between balls on the ground, about a cross: the pose drawn is regular."""
    rng, words = np.random.default_rng([1, *map(ord, "SUS")]), collections.Counter[str]()
    for _ in range(3):
        truth, drivers, _ = portion("SUS", 50, rng, words)
    k = 31
    task = md.Sweep(driver=md.Driver(drivers[0][0], at=[0.0]), derivatives=0)
    try:
        result = md.solve(mechanism_of(truth.cases[k]), task)
    except md.MechdaeError:
        return np.inf
    bodies = truth.places(truth.zero)[0]
    places = {"b1.P0": truth.point(0, 0, bodies)[k], "b2.P2": truth.point(2, 1, bodies)[k]}
    return off(result, 0, places) / 1e-9 if result.status[0] == "ok" else np.inf

"""Mechanisms and sweeps that tests of several measures share."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import mechdae as md

TURN = 2 * pi


def measured(name: str, *measures: str, task: str = "turn", **changes):
    problem = md.load(name)
    sweep = replace(problem.tasks[task], measures=measures, **changes)
    return md.solve(problem, sweep)


def driven(mechanism: md.Mechanism, coordinate: str, *measures: str, poses=13, **ends):
    ends = ends or {"from_": 0.0, "to": TURN}
    driver = md.Driver(coordinate, **ends)
    return md.solve(mechanism, md.Sweep(driver, poses=poses, measures=measures))


def trammel(length: float = 0.3) -> md.Mechanism:
    """A bar whose ends slide on two lines at right angles (elliptic trammel)."""
    return md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("bar", points={"X": [0, 0], "Y": [length, 0], "P": [length / 3, 0]}),
            md.Body("sx", points={"X": [0, 0]}),
            md.Body("sy", points={"Y": [0, 0]}),
        ],
        joints=[
            md.Revolute("X", "bar.X", "sx.X"),
            md.Revolute("Y", "bar.Y", "sy.Y"),
            md.Prismatic("gx", "ground.O", "sx.X"),
            md.Prismatic("gy", "ground.O", "sy.Y", axis=pi / 2),
        ],
        sketch={"bar": 2.0},
    )


def two_waves(third: float) -> md.Mechanism:
    """A slider at cos(u) + third cos(3 u): a planet's pin moves a yoke."""
    return md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("crank", points={"O": [0, 0], "A": [1, 0]}),
            md.Body("planet", points={"A": [0, 0], "Q": [third, 0]}),
            md.Body("yoke", points={"S": [0, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "planet.A"),
            md.Gear("mesh", "planet.A", "ground.O", carrier="crank", ratio=-2),
            md.Prismatic("guide", "ground.O", "yoke.S"),
            md.PinInSlot("slot", "yoke.S", "planet.Q", axis=pi / 2),
        ],
        sketch={"crank": 0.5, "planet": 1.5},
    )

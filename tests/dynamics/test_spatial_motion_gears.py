"""Motions in space beside gears: reactions, losses, friction of their bearings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.shared.spatial_forces import massive
from tests.shared.spatial_gears import planets, teeth_as_contacts, teeth_of_planets

G = 9.81


def test_a_planetary_train_that_runs_free_presses_as_its_free_bodies_do() -> None:
    start = {"start": {"C.angle": 0.3}, "start_speed": {"C.angle": 7.0}}
    result = md.solve(massive(planets(), seed=5), md.Motion(**start, until=0.2, poses=3))
    assert result.fault is None
    assert result.checks["energy"] < 1e-9
    assert result.checks["balance"] < 1e-12
    for k in range(3):
        teeth = teeth_of_planets(float(result.joints["C"].angle[k]))
        reactions, _, left = teeth_as_contacts(result, k, teeth)
        assert left < 1e-12
        size = max(float(np.abs(own).max()) for own in reactions.values())
        for name, own in reactions.items():
            assert np.abs(result.joints[name].reaction[k] - own).max() < 1e-12 * size, name


def rough_planets(space: bool, **more: Any) -> md.Mechanism:
    """Return sun, planet and carrier with losses and a rough pin, in the plane or in space."""
    d, r_s, r_p, r_r = (3 if space else 2), 0.024, 0.018, 0.06
    turn: Any = {"axis": (0, 0, 1)} if space else {}
    rough = {"friction": 0.2, "pin_radius": 0.004} | turn
    hinge: Any = md.SpatialRevolute if space else md.Revolute
    gear: Any = md.SpatialGear if space else md.Gear
    teeth = {"pressure_angle": 0.4}

    def at(x: float) -> tuple[float, ...]:
        return (x, 0.0, 0.0)[:d]

    def body(name: str, mass: float, inertia: float, **points: Any) -> md.Body:
        return md.Body(name, points, mass=mass, inertia=(inertia,) * 3 if space else inertia)

    return md.Mechanism(
        dimension=d,
        ground=md.Ground({"O": at(0)}),
        bodies=[
            body("carrier", 0.3, 1e-4, O=at(0), P=at(r_s + r_p)),
            body("sun", 0.4, 2e-4, O=at(0)),
            body("planet", 0.2, 3e-5, P=at(0)),
        ],
        joints=[
            hinge("C", "ground.O", "carrier.O", **turn),
            hinge("S", "carrier.O", "sun.O", **turn),
            hinge("Q", "carrier.P", "planet.P", **rough),
            gear("inner", *_ends(space, "sun", "planet"), carrier="carrier", ratio=-r_p / r_s,
                 mesh_loss=0.1, **teeth),
            gear("ring", *_ends(space, "ground", "planet"), carrier="carrier", ratio=r_p / r_r,
                 **teeth),
        ],
        gravity=(0, -G, 0)[:d],
        sketch={"C" if space else "carrier": 0},
        **more,
    )  # fmt: skip


def _ends(space: bool, *bodies: str) -> list[str]:
    points = {"sun": "O", "ground": "O", "planet": "P"}
    return [f"{body}.{points[body]}" for body in bodies]


def test_a_rough_planetary_train_stops_where_that_of_the_plane_does() -> None:
    start = {"start": {"C.angle": 0.2}, "start_speed": {"C.angle": 6.0}}
    plane, space = (
        md.solve(rough_planets(own), md.Motion(**start, until=20.0, tolerance=1e-11))
        for own in (False, True)
    )
    assert plane.fault is space.fault is None
    assert space.summary["rests_from"] == pytest.approx(plane.summary["rests_from"], rel=1e-9)
    assert space.joints["C"].angle[-1] == pytest.approx(plane.joints["C"].angle[-1], abs=1e-9)
    told = [[(event.kind, event.joint) for event in own.events] for own in (plane, space)]
    assert told[0] == told[1]
    assert space.checks["energy"] < 1e-9
    assert space.checks["balance"] < 1e-12
    for name in ("inner", "Q"):
        wanted = plane.joints[name].reaction[0]
        ours = space.joints[name].reaction[0][[0, 1, 5]]
        size = np.abs(wanted).max()
        assert np.abs(ours - wanted).max() < 1e-9 * size


def test_a_train_without_places_of_its_teeth_moves_and_says_so() -> None:
    problem = md.load("bevel-differential")
    keys = {"start": {"cage_pin.angle": 0.0}, "start_speed": {"cage_pin.angle": 1.0}}
    bare = {n: replace(j, radius=None) if j.meshes else j
            for n, j in problem.mechanism.joints.items()}  # fmt: skip
    heavy = massive(replace(problem.mechanism, joints=Table(bare)), seed=9)
    result = md.solve(heavy, md.Motion(**keys, until=0.1, poses=2))
    assert result.fault is None
    assert np.isnan(result.joints["cage_pin"].reaction).all()
    (said,) = (note for note in result.summary["notes"] if "forces of teeth" in note)
    assert "mean pitch radius" in said

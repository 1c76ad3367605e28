"""A sample of the random spatial loops: no pose `ok` and outside of its bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from tests.attack.spatial_honesty import LOOPS, Case, case, error_of, judged, random_turn
from tests.reference.spatial_closure import GROUND, Closure, Pair

SLOW = ("RCCC", "RRRRRRR", "RUURR")


@pytest.mark.parametrize("loop", [name for name in LOOPS if name not in SLOW])
def test_poses_are_where_the_closure_puts_them(loop: str) -> None:
    found = case(np.random.default_rng(sum(map(ord, loop))), loop)
    told = judged(found, poses=3)
    assert told["ok"] >= 1  # the planted pose is the middle one
    assert told["wrong"] == 0
    assert told["wide"] == 0


def test_the_closure_sees_a_point_that_is_off() -> None:
    """The judge of this file: a mechanism whose bar is 1e-9 longer is found out."""
    found = case(np.random.default_rng(3), "RSRC")
    points = dict(found.mechanism.bodies["b1"].points)
    x, y, z = points["P1"]
    points["P1"] = (x + 1e-9, y, z)
    longer = replace(found.mechanism.bodies["b1"], points=points)
    bodies = found.mechanism.bodies.with_("b1", longer)
    told = judged(replace(found, mechanism=replace(found.mechanism, bodies=bodies)), poses=3)
    assert told["wrong"] == told["ok"] >= 1


def platform(rng: np.random.Generator) -> Case:
    """Return a plate on six bars, the first one on a crank: a quaternion is among the unknowns."""
    r, R = np.array([0.1, 0.2, 1.0]), random_turn(rng)
    ways = 1.05 * np.arange(6)
    top = np.stack([0.5 * np.cos(ways), 0.5 * np.sin(ways), 0.1 * np.sin(3 * ways)], axis=1)
    base = np.stack([np.cos(ways + 0.3), np.sin(ways + 0.3), 0.05 * np.cos(2 * ways)], axis=1)
    pivot = base[0] - [0.2, 0, 0.1]
    points = {f"T{k}": R.T @ top[k] for k in range(6)}
    axis, zero = [0, 1, 0], [1, 0, 0]
    arm = base[0] - pivot
    joints = [md.SpatialRevolute("J0", "ground.O", "crank.O", axis=axis, zero=zero)]
    pairs = [Pair("R", GROUND, "crank", pivot, [0, 0, 0], axis, zero, axis, zero)]
    for k in range(6):
        body, foot, local = ("crank", "B0", arm) if k == 0 else (GROUND, f"B{k}", base[k])
        length = float(np.linalg.norm(r + top[k] - base[k]))
        bar = md.Distance(f"L{k}", f"{body}.{foot}", f"plate.T{k}", length=length)
        joints.append(bar)
        pairs.append(Pair("D", body, "plate", local, points[f"T{k}"], size=length))
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": pivot, **{f"B{k}": base[k] for k in range(1, 6)}}),
        bodies=[md.Body("crank", {"O": [0, 0, 0], "B0": arm}), md.Body("plate", points)],
        joints=joints,
        sketch={"J0.angle": 0.0} | {f"plate.T{k}": (r + top[k]).tolist() for k in range(6)},
    )
    planted = {f"T{k}": r + top[k] for k in range(6)}
    return Case("platform", mechanism, Closure(["crank", "plate"], pairs), planted)


def test_a_plate_on_six_bars() -> None:
    found = platform(np.random.default_rng(4))
    driver = md.Driver("J0.angle", from_=-0.04, to=0.0)
    result = md.solve(found.mechanism, md.Sweep(driver=driver, poses=3, derivatives=0))
    assert list(result.status) == ["ok"] * 3
    assert result.summary["work"]["unknowns"] == 7
    for k in range(3):
        assert error_of(found, result, k) <= result.bound.length[k] < 1e-6
    for name, place in found.planted.items():
        assert np.abs(result.points[f"plate.{name}"].position[-1] - place).max() < 1e-12


def test_a_quaternion_and_its_opposite_are_one_mode() -> None:
    found = platform(np.random.default_rng(4))
    modes = md.solve(found.mechanism, md.Modes(driver=md.Driver("J0.angle", at=[0.0])))
    places = modes.points["plate.T0"].position
    assert modes.summary["count"] == len(modes) >= 1
    for k, own in enumerate(places):
        assert all(np.abs(own - other).max() > 1e-6 for other in places[:k])

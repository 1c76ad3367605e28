"""Links that spin freely, alone and together: known, named, left out, and forces as they are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe import spinning_links as turnless
from mechdae.equations.mobility import count_mobility
from mechdae.equations.tree import tree_model
from tests.attack.idle_links import KINDS, run, tube_with_ball
from tests.shared.paths import ROOT

DATA = ROOT / "tests/data/spatial"


def loaded(name: str) -> md.Problem:
    return md.load(DATA / f"{name}.toml")


def slow(problem: md.Problem, task: str) -> md.Result:
    """Return a task of forces without inertia."""
    own = problem.tasks[task]
    still = replace(own, driver=replace(own.driver, speed=0.0))
    return md.solve(problem.mechanism, still)


def effort_of(result: md.Result, k: int, speed: float) -> float:
    """Return the effort of the cylinder at a speed: weight, and inertia about the hinge."""
    E, G, C = (result.points[n].position[k] for n in ("boom.E", "boom.G", "tube.C"))

    def size(turned: float) -> float:
        c, s = np.cos(turned), np.sin(turned)
        moved = np.array([c * E[0] + s * E[2], E[1], -s * E[0] + c * E[2]])
        return float(np.linalg.norm(moved - C))

    h = 1e-4
    slope = (size(h) - size(-h)) / (2 * h)
    bend = (size(h) - 2 * size(0.0) + size(-h)) / h**2
    turning = -bend * (speed / slope) ** 2 / slope
    return float((140 * turning - np.cross(G / 2, [0, 0, -981])[1]) / slope)


@pytest.mark.parametrize("pair", ["prismatic", "cylindrical"])
def test_a_cylinder_between_two_balls_lifts_a_boom(pair: str) -> None:
    problem = loaded("cylinder-between-two-balls")
    mechanism = problem.mechanism
    if pair == "cylindrical":
        cyl = md.Cylindrical("cyl", "tube.M", "rod.M", axis=[0.7, -0.1, 0.7])
        joints = [cyl if j.name == "cyl" else j for j in mechanism.joints.values()]
        mechanism = replace(mechanism, joints=joints)
    result = slow(replace(problem, mechanism=mechanism), "lift")
    assert list(result.status) == ["ok"] * 4
    for k in range(4):
        E, G, C = (result.points[n].position[k] for n in ("boom.E", "boom.G", "tube.C"))
        way = (E - C) / np.linalg.norm(E - C)
        lever = np.cross(E, way)[1]  # about the hinge's axis, y through A
        effort = -np.cross(G / 2, [0, 0, -981])[1] / lever
        assert result.efforts["cyl.slide"][k] == pytest.approx(effort, rel=1e-12)
        assert result.joints["E"].reaction[k][:3] == pytest.approx(effort * way, rel=1e-9)
        size = np.linalg.norm([0.7, -0.1, 0.7]) + result.drivers["cyl.slide"].position[k]
        assert np.linalg.norm(E - C) == pytest.approx(size, rel=1e-12)
    moving = md.solve(replace(problem, mechanism=mechanism), task="lift")
    told = [effort_of(result, k, 0.1) for k in range(4)]
    assert moving.efforts["cyl.slide"] == pytest.approx(told, rel=1e-6)
    assert told == pytest.approx([1744.64, 1803.03, 1840.46, 1842.62], abs=0.01)
    assert count_mobility(mechanism)["idle"] == ["tube + rod"]
    (note,) = result.summary["notes"]
    assert note.startswith("tube and rod spin freely")
    assert set(result.bodies) == {"boom"}
    assert "angle" not in result.joints["cyl"]


def test_a_damper_on_a_rod_between_balls() -> None:
    """The carrier's twist from six lengths that stay as they are."""
    problem = loaded("damper-on-a-free-rod")
    ground, bodies = problem.mechanism.ground.points, problem.mechanism.bodies

    def at(body: str, point: str) -> Any:
        points = ground if body == "ground" else bodies[body].points
        return np.array(points[point], float)

    rows, right = [], []
    for own, other in (("UF", "UF"), ("UR", "UR"), ("LF", "LF")):
        P, way = at("carrier", own), at("carrier", own) - at("ground", other)
        rows.append(np.concatenate([way, np.cross(P, way)]))
        right.append(0.0)
    P, way = at("carrier", "TR"), at("carrier", "TR") - at("rack", "T")
    rows.append(np.concatenate([way, np.cross(P, way)]))
    right.append(way[1])  # the rack moves along y with 1 m/s
    o, D = at("lr", "O"), at("lr", "D")
    share = np.linalg.norm(D - at("lr", "I")) / np.linalg.norm(o - at("lr", "I"))
    for way in (o - at("lr", "I"), share * (D - at("ground", "ST"))):
        rows.append(np.concatenate([way, np.cross(o, way)]))
        right.append(0.0)
    twist = np.linalg.solve(rows, right)
    result = md.solve(problem, task="at0")
    assert result.bodies["carrier"].angular_velocity[0] == pytest.approx(twist[3:], rel=1e-9)
    w = twist[3:]
    inclination, caster = np.degrees(np.arctan2([w[1], w[0]], [-w[2], -w[2]]))
    assert (inclination, caster) == (pytest.approx(13, abs=0.3), pytest.approx(4, abs=0.3))
    assert list(md.solve(problem, task="steer").status) == ["ok"] * 9
    assert "lr spins freely" in result.summary["notes"][0]


def test_a_point_by_hard_points_lies_on_the_line_of_a_rod() -> None:
    problem = loaded("point-on-a-bar-by-hard-points")
    result = slow(problem, "ride")
    B, C, P = (result.points[f"bar.{n}"].position for n in "BCP")
    fine = np.flatnonzero(result.status == "ok")
    assert len(fine) == 2
    assert P[fine] == pytest.approx((B + 0.9 * (C - B))[fine], abs=1e-12)
    for k in fine:
        way, S = C[k] - B[k], np.array([-0.025, 0.64, 0.64])
        force = 1000 * (S - P[k])
        ends = [result.joints["B"].reaction[k][:3], -result.joints["C"].reaction[k][:3]]
        assert sum(ends) + force == pytest.approx(np.zeros(3), abs=1e-8)
        for end, share in zip(ends, (0.1, 0.9), strict=True):
            assert np.cross(way, end + share * force) == pytest.approx(np.zeros(3), abs=1e-8)


def test_a_point_beside_the_line_has_no_place() -> None:
    problem = loaded("cylinder-between-two-balls")
    bodies = dict(problem.mechanism.bodies)
    bodies["tube"] = replace(bodies["tube"], points={**bodies["tube"].points, "X": (0, 0, 0.1)})
    mechanism = replace(problem.mechanism, bodies=bodies)
    task = md.Sweep(driver=md.Driver("cyl.slide", at=[0.0]), outputs=["tube.X"])
    with pytest.raises(md.MechdaeError, match=r"tube\.X has no place"):
        md.solve(mechanism, task)
    pull = md.Force("pull", "tube.X", [1, 0, 0])
    with pytest.raises(md.MechdaeError, match=r"tube\.X has no place"):
        md.solve(
            replace(mechanism, loads=[pull]),
            md.Reactions(driver=md.Driver("cyl.slide", at=[0.0])),
        )
    heavy = replace(bodies["tube"], mass=1.0, center=(0, 0, 0.1))
    with pytest.raises(md.MechdaeError, match="beside the line"):
        md.solve(
            replace(mechanism, bodies={**bodies, "tube": heavy}),
            md.Reactions(driver=md.Driver("cyl.slide", at=[0.0])),
        )


def test_a_roller_beside_the_line_of_a_tube_holds_no_spin() -> None:
    assert tube_with_ball("hand") == pytest.approx(tube_with_ball(""), rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_random_mechanisms_close_and_balance(kind: str) -> None:
    assert run(1, 7, (kind,)) == {"ok": 3}


def test_a_spin_that_is_not_known_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tree_model, "spins", lambda *_: [])
    assert not run(1, 7, ("cylinder",))["ok"]


def test_a_line_without_tolerance_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(turnless, "ROUND", 0.0)
    with pytest.raises(md.MechdaeError, match="has no place"):
        md.solve(loaded("point-on-a-bar-by-hard-points"), task="ride")

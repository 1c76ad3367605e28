"""Shaking forces and moments in space: free bodies, closed forms, counterweights."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file import library
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.shaking import shaking_paths, with_shaking
from mechdae.describe.values import Table
from tests.attack.spatial_honesty import case
from tests.shared.space import reference, rssr
from tests.shared.spatial_forces import massive, pose_of


def shaken(mechanism: md.Mechanism, *drivers: md.Driver) -> tuple[Any, Any, Any]:
    """Return the sweep, force and moment (n, 3)."""
    problem = Problem(mechanism, {"turn": md.Sweep(drivers=drivers)})  # type: ignore[arg-type]
    result = md.solve(with_shaking(problem, ["turn"]), "turn")
    assert set(result.status) == {"ok"}
    return result, *of(result)


def of(result: Any) -> list[Any]:
    return [
        np.stack([result.value(path) for path in shaking_paths(f"shaking/{word}", 3)], axis=1)
        for word in ("force", "moment")
    ]


@pytest.mark.parametrize("loop", ["rssr", "RERC"])
def test_loops_shake_as_their_free_bodies_need(loop: str) -> None:
    if loop == "rssr":
        mechanism = massive(rssr(reference("rssr")["params"]), bars=("bar",))
        mechanism, turn = replace(mechanism, sketch=Table({"A": 0.5, "D": -1.2})), "A.angle"
    else:
        mechanism = massive(case(np.random.default_rng(5), loop).mechanism, seed=7)
        turn = "J0.angle"
    at = [0.5, 1.0] if loop == "rssr" else [0.0, 0.05]
    result, force, moment = shaken(mechanism, md.Driver(turn, at=at, speed=3.0, acceleration=-7.0))
    for k in range(2):
        bodies = pose_of(result, k).bodies.values()
        wanted = sum(body.force for body in bodies)
        turning = sum(np.cross(body.centre, body.force) + body.moment for body in bodies)
        assert force[k] == pytest.approx(wanted, abs=1e-11 * np.abs(wanted).max())
        assert moment[k] == pytest.approx(turning, abs=1e-11 * np.abs(turning).max())


def test_nodes_of_vector_loops_are_points() -> None:
    """Their own points tell their masses: one that is added would make bodies of them."""
    data: dict[str, Any] = tomllib.loads(
        library.find("spatial-slider-crank-loops").read_text(encoding="utf-8")
    )
    del data["expected"]
    data["nodes"] = {"B": {"at": "crank.head"}, "C": {"at": "slide.head"}}
    data["bodies"] = {"B": {"mass": 0.3}, "C": {"mass": 2.0}}
    driver = md.Driver("crank.azimuth", at=[0.3, 2.0], speed=20.0)
    result, force, moment = shaken(from_dict(data, "loops").mechanism, driver)
    crank = np.array([0.3, 2.0])
    B = 0.05 * np.stack([np.cos(crank), 0 * crank, np.sin(crank)], axis=1)
    pulls = [(B, -0.3 * 400.0 * B)]  # towards the axis, with w^2 r
    slide = result.joints["slide"]
    e, a = np.deg2rad(14.3), np.deg2rad(23)
    u = np.array([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)])
    pulls.append((result.points["C.C"].position, 2.0 * np.outer(slide.length_acceleration, u)))
    assert force == pytest.approx(sum(pull for _, pull in pulls), abs=1e-11)
    assert moment == pytest.approx(sum(np.cross(*own) for own in pulls), abs=1e-11)


def rotor(**keys: Any) -> dict[str, Any]:
    """Return a rotor on an axis along z through (p, 0, 0) as a file, unbalanced in two planes."""
    return {
        "schema": 1, "title": "rotor", "dimension": 3,
        "parameters": {"p": 0.4, "x": 0.02, "y": -0.01, "xz": 0.03, "yz": 0.01, "omega": 5.0},
        "ground": {"points": {"O": ["p", 0, 0]}},
        "bodies": {"rotor": {
            "points": {"O": [0, 0, 0]}, "mass": 2.0, "center": ["x", "y", 0.3],
            "inertia": [0.5, 0.6, 0.7, 0.02, "xz", "yz"],
        }},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "rotor.O"],
                         "axis": [0, 0, 1]}},
        "tasks": {"turn": {"kind": "sweep", "poses": 13, "driver": {
            "coordinate": "O.angle", "from_deg": 0, "to_deg": 360, "speed": "omega"}}},
    } | keys  # fmt: skip


def test_a_rotor_against_the_closed_form() -> None:
    """m c and the products of inertia turn with the rotor; J_zz counts under an acceleration."""
    mechanism, w, dw = from_dict(rotor(), "rotor").mechanism, 5.0, 11.0
    result, force, moment = shaken(
        mechanism, md.Driver("O.angle", at=[0.0, 0.7], speed=w, acceleration=dw)
    )
    m, J = 2.0, np.array([[0.5, 0.02, 0.03], [0.02, 0.6, 0.01], [0.03, 0.01, 0.7]])
    for k, phi in enumerate((0.0, 0.7)):
        c, s = np.cos(phi), np.sin(phi)
        R, z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([0, 0, 1.0])
        arm, world = R @ [0.02, -0.01, 0.3], R @ J @ R.T
        a = dw * np.cross(z, arm) + w**2 * np.cross(z, np.cross(z, arm))
        turning = world @ z * dw + w**2 * np.cross(z, world @ z)
        assert force[k] == pytest.approx(m * a, abs=1e-13)
        whole = np.cross(np.array([0.4, 0, 0]) + arm, m * a) + turning
        assert moment[k] == pytest.approx(whole, abs=1e-13)
    # points on the rotor, whose inertia is told by them, and what the bearing does: no weight here
    load = md.solve(mechanism, md.Reactions(driver=result.definition.drivers[0]))
    assert load.joints["O"].reaction[:, :3] == pytest.approx(force, abs=1e-12)


def test_counterweights_leave_no_moment() -> None:
    """Static and dynamic balance of a rotor: its centre and a principal axis on the axis."""
    data = rotor()
    data["tasks"]["design"] = {
        "kind": "synthesis", "driver": {"coordinate": "O.angle"}, "starts": 1,
        "goals": [
            {"kind": "minimise", "of": f"turn/shaking/{word}", "reduce": "rms"}
            for word in ("force", "moment")
        ],
        "free": {"x": [-0.1, 0.1], "y": [-0.1, 0.1], "xz": [-0.1, 0.1], "yz": [-0.1, 0.1]},
    }  # fmt: skip
    problem = from_dict(data, "rotor")
    turn: Any = problem.tasks["turn"]
    before = [np.abs(own).max() for own in shaken(problem.mechanism, turn.driver)[1:]]
    best = md.solve(problem, "design").data["designs"][0]
    for name in ("x", "y", "xz", "yz"):
        assert abs(best["parameters"][name]) < 1e-10
    own = md.solve(from_dict(tomllib.loads(best["problem"]), "best"), "turn")
    for found, size in zip(of(own), before, strict=True):
        assert np.abs(found).max() < 1e-9 * size


def test_bars_off_their_line_and_other_bad_questions() -> None:
    data: dict[str, Any] = tomllib.loads(library.find("rssr").read_text(encoding="utf-8"))
    del data["expected"]
    data["bodies"]["bar"] |= {"mass": 1.0, "center": [0.1, "e", 0]}
    data["parameters"]["e"] = 0.0
    data["tasks"]["design"] = {
        "kind": "synthesis", "driver": {"coordinate": "A.angle"}, "starts": 1,
        "goal": {"kind": "minimise", "of": "turn/shaking/force"}, "free": {"e": [-0.1, 0.1]},
    }  # fmt: skip
    with pytest.raises(md.InputError, match="centre of bar lies beside the line"):
        md.solve(from_dict(data, "rssr"), "design")
    del data["bodies"]["bar"]["mass"], data["bodies"]["bar"]["center"]
    with pytest.raises(md.InputError, match="no body has a mass"):
        md.solve(from_dict(data, "rssr"), "design")
    data["bodies"]["rocker"]["mass"] = 1.0
    data["tasks"]["turn"]["derivatives"] = 1
    with pytest.raises(md.InputError, match="a shaking force needs accelerations"):
        md.solve(from_dict(data, "rssr"), "design")

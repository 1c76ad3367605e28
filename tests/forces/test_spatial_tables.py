"""Tables of torques on bodies in space: free bodies, motions and equilibria in closed form."""

from __future__ import annotations

import io
import json
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.values import Table
from tests.attack.spatial_honesty import case
from tests.shared.spatial_forces import massive, pose_of

INERTIA, SLOPE = 0.7, 2.0


def test_reactions_are_those_of_free_bodies() -> None:
    mechanism = massive(case(np.random.default_rng(5), "RERC").mechanism, seed=7)
    rows = [[-1.0, -40.0], [0.01, 70.0], [1.0, -30.0]]
    tables = [
        md.TableLoad("still", "J0.angle", rows=rows, body="b2", axis=[1, -2, 0.5], factor=1.5),
        md.TableLoad("taken", "J0.angle", rows=rows, body="b3", axis=[0, 3, 1], frame="b1"),
    ]
    loads = {**mechanism.loads, **{load.name: load for load in tables}}
    mechanism = replace(mechanism, loads=Table(loads))
    drivers = [md.Driver("J0.angle", at=[0.0, 0.02], speed=2.0, acceleration=1.3)]
    result = md.solve(mechanism, md.Reactions(drivers=drivers))
    for k in range(2):
        reactions, efforts, left, _ = pose_of(result, k).solve()
        size = max(float(np.abs(own).max()) for own in reactions.values())
        assert left < 1e-12
        assert abs(result.efforts["J0.angle"][k] - efforts[0]) < 1e-12 * size
        for name, own in reactions.items():
            assert np.abs(result.joints[name].reaction[k] - own).max() < 1e-12 * size
    assert max(result.checks.values()) < 1e-10


def wheel(**load: Any) -> dict[str, Any]:
    """Return a wheel that turns about z as a file, with a table of a torque on it."""
    table = {"kind": "table", "coordinate": "t", "rows": [[0, 0], [10, 10 * SLOPE]],
             "body": "wheel", "axis": [0, 0, 1]}  # fmt: skip
    return {
        "schema": 1, "title": "wheel", "dimension": 3, "parameters": {"none": 0.0},
        "ground": {"points": {"O": [0, 0, 0]}},
        "bodies": {"wheel": {"points": {"O": [0, 0, 0], "R": [0.2, 0, 0]}, "mass": 2.0,
                             "inertia": [0.4, 0.4, INERTIA]}},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "wheel.O"],
                         "axis": [0, 0, 1]}},
        "loads": {"T": {k: v for k, v in (table | load).items() if v is not None}},
        "tasks": {
            "run": {"kind": "motion", "start": {"O.angle": 0.0}, "until": 1.5,
                    "tolerance": 1e-12},
            "turn": {"kind": "reactions",
                     "driver": {"coordinate": "O.angle", "at": [0.3], "speed": 1.0}},
        },
    }  # fmt: skip


def solved(data: dict[str, Any], task: str) -> Any:
    from mechdae.describe.file.load import from_dict

    return md.solve(from_dict(data, "wheel"), task)


@pytest.mark.parametrize("frame", ["world", "wheel"])
def test_a_torque_that_grows_with_time_turns_by_the_cube_of_it(frame: str) -> None:
    """About a slanted axis: what is along the hinge turns, the hinge holds the rest."""
    axis = [0.6, 0, 0.8] if frame == "world" else [3, 0, 4]  # of any length
    motion = solved(wheel(axis=axis, frame=frame), "run")
    t = np.asarray(motion.time)
    angle = 0.8 * SLOPE * t**3 / 6 / INERTIA
    assert motion.joints["O"].angle == pytest.approx(angle, abs=1e-11)
    across = -0.6 * SLOPE * t
    turned = angle if frame == "wheel" else 0 * angle
    moment = motion.joints["O"].reaction[:, 3:5]
    assert moment[:, 0] == pytest.approx(across * np.cos(turned), abs=1e-10)
    assert moment[:, 1] == pytest.approx(across * np.sin(turned), abs=1e-10)


def test_a_table_over_its_own_angle_is_a_spring() -> None:
    rows = [[-3, 12], [3, -12], [2 * np.pi - 3, 12]]  # -4 angle up to 3 rad, then back
    data = wheel(coordinate="O.angle", rows=rows, periodic=True)
    data["loads"]["push"] = {"kind": "torque", "body": "wheel", "value": [0, 0, 1.0]}
    data["tasks"] = {"rest": {"kind": "equilibrium", "linearise": True, "start": {"O.angle": 0.1}}}
    rest = solved(data, "rest")
    assert rest.joints["O"].angle[0] == pytest.approx(0.25, abs=1e-12)
    frequency = np.sqrt(4 / INERTIA) / (2 * np.pi)
    assert rest.summary["frequencies"][0] == pytest.approx(frequency, rel=1e-12)


BAD = {
    "no axis": ({"axis": None}, "loads.T.axis: a torque in space needs the axis"),
    "two numbers": ({"axis": [0, 1]}, "loads.T.axis: three numbers are needed"),
    "no length": ({"axis": [0, 0, 0]}, "loads.T.axis: a direction needs a length"),
    "no frame": ({"frame": "whel"}, "did you mean wheel?"),
    "no body": ({"body": "whel"}, "did you mean wheel?"),
    "along": (
        {"body": None, "along": "O.angle"},
        "loads.T.axis: a force along a coordinate has no axes of its own",
    ),
    "both": ({"along": "O.angle"}, "a table needs 'along' (a coordinate) or 'body', not both"),
    "parameter": (
        {"coordinate": "O.angle", "axis": ["none", 0, 0]}, "loads.T: it has no finite value",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_input(name: str, tmp_path: Path) -> None:
    changes, message = BAD[name]
    code, said = told(wheel(**changes), tmp_path)
    assert code == 2
    assert message in said


def test_a_table_of_the_plane_has_no_axis(tmp_path: Path) -> None:
    data = wheel()
    data |= {"dimension": 2}
    data["joints"]["O"].pop("axis")
    for points in (data["ground"]["points"], data["bodies"]["wheel"]["points"]):
        points.update({name: place[:2] for name, place in points.items()})
    data["bodies"]["wheel"]["inertia"] = INERTIA
    data["tasks"] = {}
    code, said = told(data, tmp_path)
    assert code == 2
    assert "loads.T.axis: a torque of the plane has no axes of its own" in said


def told(data: dict[str, Any], folder: Path) -> tuple[int, str]:
    """Return the exit code of solving a file and what is said."""
    path = folder / "wheel.toml"
    path.write_text(toml(data), encoding="utf-8")
    out = io.StringIO()
    with redirect_stderr(out), redirect_stdout(out):
        code = main(["solve", str(path), "--task", "turn"])
    return code, " ".join(out.getvalue().split())


def toml(data: dict[str, Any]) -> str:
    """Return a file of tables in JSON's notation, which TOML shares but for ':' and null."""
    lines = [f"{key} = {json.dumps(own)}" for key, own in data.items() if not isinstance(own, dict)]

    def inline(value: Any) -> str:
        if isinstance(value, dict):
            return "{ " + ", ".join(f'"{k}" = {inline(v)}' for k, v in value.items()) + " }"
        return json.dumps(value)

    for key, own in data.items():
        if isinstance(own, dict):
            lines += [f"[{key}]", *(f'"{name}" = {inline(v)}' for name, v in own.items())]
    return "\n".join(lines)

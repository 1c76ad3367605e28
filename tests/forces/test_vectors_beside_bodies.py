"""Vector loops in space beside bodies and joints: reference data, Newton and Euler body by body."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.certificates import as_json
from mechdae.describe.file.load import from_dict
from mechdae.describe.table import Table
from mechdae.tasks.show import structure
from tests.shared.space import numbers, off, reference

ROD = {
    "arm": {"from": "crank.A", "to": "crank.B"},
    "rod": {"length": 0.3},
    "off": {"from": "ground.A", "to": "ground.S"},
    "slide": {"elevation_deg": 10, "azimuth_deg": 5},
}


def linkage(friction: float = 0.0, **more: Any) -> dict[str, Any]:
    """Return a crank, a rod and a guide as vectors, and on their node a link to a rocker."""
    slide = ROD["slide"] | ({"friction": friction} if friction else {})
    press = {"coordinate": "A.angle", "at": [0.2, 1.7, 4.0], "speed": 10, "acceleration": 7}
    data: dict[str, Any] = {
        "schema": 1,
        "title": "crank, vectors, link and rocker",
        "dimension": 3,
        "gravity": [0, 0, -9.81],
        "ground": {"points": {"A": [0, 0, 0], "S": [0.05, 0.03, 0.02], "E": [0.35, 0.3, 0.1]}},
        "bodies": {
            "crank": {"points": {"A": [0, 0, 0], "B": [0.05, 0, 0.01]}, "mass": 0.8,
                      "center": [0.02, 0.003, 0.001],
                      "inertia": [1e-4, 4e-4, 3e-4, 1e-5, 2e-5, -1e-5]},
            "C": {"mass": 0.6},
            "link": {"points": {"P": [0, 0, 0], "Q": [0.25, 0, 0]}, "mass": 0.5,
                     "center": [0.1, 0.01, -0.02], "inertia": [1e-4, 1e-3, 2e-3]},
            "rocker": {"points": {"E": [0, 0, 0], "Q": [0.15, 0, 0]}, "mass": 0.9,
                       "center": [0.08, 0, 0.01], "inertia": [1e-4, 5e-4, 5e-4]},
        },
        "joints": {
            "A": {"kind": "revolute", "between": ["ground.A", "crank.A"], "axis": [0.2, 0.1, 1]},
            "tie": {"kind": "spherical", "between": ["rod.head", "link.P"]},
            "Q": {"kind": "universal", "between": ["rocker.Q", "link.Q"], "axis": [0, 0, 1],
                  "axis2": [0, 1, 0]},
            "E": {"kind": "revolute", "between": ["ground.E", "rocker.E"], "axis": [0.1, 0.2, 1]},
        },
        "vectors": {**ROD, "slide": slide},
        "loops": {"closure": ["arm", "rod", "-slide", "-off"]},
        "nodes": {"C": {"at": "rod.head"}},
        "loads": {"push": {"kind": "force", "point": "C.C", "value": [3, -4, 5]},
                  "turn": {"kind": "torque", "body": "link", "value": [0.1, 0.2, -0.3]}},
        "sketch": {"A_deg": 0, "slide.length": 0.3, "rocker.Q": [0.38, 0.18, 0.1], "Q.angle": 2.6,
                   "Q.angle2": -0.25},
        "tasks": {
            "press": {"kind": "reactions", "driver": press},
            "turn": {"kind": "sweep", "driver": press},
            "fall": {"kind": "motion", "start": {"A.angle": 0.3}, "start_speed": {"A.angle": 4.0},
                     "at": [0, 0.1, 0.2], "tolerance": 1e-12},
            "rest": {"kind": "equilibrium"},
        },
    }  # fmt: skip
    return data | more


def hanging() -> dict[str, Any]:
    """Return a crank that carries a vector of given direction, and a rough guide on its end."""
    press = {"coordinate": "A.angle", "at": [0.1, 0.6, 1.2], "speed": 10, "acceleration": 7}
    return {
        "schema": 1,
        "title": "vectors that a crank carries",
        "dimension": 3,
        "gravity": [0, 0, -9.81],
        "ground": {"points": {"A": [0, 0, 0]}},
        "bodies": {
            "crank": {"points": {"A": [0, 0, 0], "B": [0.2, 0, 0.01]}, "mass": 0.8,
                      "center": [0.02, 0.003, 0.001], "inertia": [1e-4, 4e-4, 3e-4]},
            "N": {"mass": 1.5},
            "M": {"mass": 0.4},
        },
        "joints": {
            "A": {"kind": "revolute", "between": ["ground.A", "crank.A"], "axis": [0.2, 0.1, 1]}
        },
        "vectors": {
            "arm": {"from": "crank.A", "to": "crank.B"},
            "hang": {"length": 0.1, "elevation_deg": -30, "azimuth_deg": 20},
            "carried": {"elevation_deg": 40, "azimuth_deg": 100, "friction": 0.1},
            "tie": {"length": 0.35},
            "up": {"length": 0.2, "elevation_deg": 80, "azimuth_deg": 70},
        },
        "loops": {"one": ["arm", "hang", "carried", "-tie", "-up"]},
        "nodes": {"N": {"at": "hang.head"}, "M": {"at": "carried.head"}},
        "sketch": {"A_deg": 0, "carried.length": 0.3},
        "tasks": {
            "press": {"kind": "reactions", "driver": press},
            "fall": {"kind": "motion", "start": {"A.angle": 0.3}, "start_speed": {"A.angle": 4.0},
                     "at": [0, 0.05, 0.1], "tolerance": 1e-12},
        },
    }  # fmt: skip


def turn(e: Any) -> Any:
    w, v = e[0], np.asarray(e[1:])
    cross = np.cross(np.eye(3), v)
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def gaps(result: md.Result, mechanism: md.Mechanism, k: int) -> dict[str, float]:
    """Return what is left of Newton's and Euler's laws of each body at a pose, by its weight.

    Places, rates and reactions are those of the result, forces and moments are summed here.
    """
    values, gravity = mechanism.values(), np.array(mechanism.gravity, dtype=float)

    def place(reference: str) -> Any:
        if reference.startswith("ground."):
            return np.array([values[f"{reference}.{axis}"] for axis in "xyz"])
        return result.points[reference].position[k]

    found = {}
    for name, body in mechanism.bodies.items():
        first, mass = f"{name}.{next(iter(body.points))}", values.get(f"{name}.mass", 0.0)
        origin, a = place(first), result.points[first].acceleration[k]
        force, moment, turns = np.zeros(3), np.zeros(3), name in result.bodies
        acting: list[tuple[Any, Any, Any]] = []
        if turns:
            own = result.bodies[name]
            R, w, rate = (
                turn(own.orientation[k]), own.angular_velocity[k], own.angular_acceleration[k],
            )  # fmt: skip
            centre = np.array([values.get(f"{name}.center.{axis}", 0.0) for axis in "xyz"])
            arm = R @ (centre - [values[f"{first}.{axis}"] for axis in "xyz"])
            a = a + np.cross(rate, arm) + np.cross(w, np.cross(w, arm))
            xx, yy, zz, xy, xz, yz = (
                values.get(f"{name}.inertia.{word}", 0.0)
                for word in ("xx", "yy", "zz", "xy", "xz", "yz")
            )
            J = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
            acting.append((origin + arm, mass * (gravity - a), -J @ rate - np.cross(w, J @ w)))
        else:
            acting.append((origin, mass * (gravity - a), np.zeros(3)))
        for joint in mechanism.joints.values():
            reaction = result.joints[joint.name].reaction[k]
            for end, sense in ((joint.second, 1.0), (joint.first, -1.0)):
                if end.split(".")[0] == name:
                    at = end if joint.pointer else joint.second
                    acting.append((place(at), sense * reaction[:3], sense * reaction[3:]))
        for load in mechanism.loads.values():
            if load.kind == "force" and load.point.split(".")[0] == name:
                acting.append((place(load.point), np.array(load.value, float), np.zeros(3)))
            if load.kind == "torque" and load.body == name:
                acting.append((origin, np.zeros(3), np.array(load.value, float)))
        for at, own_force, own_moment in acting:
            force = force + own_force
            moment = moment + own_moment + np.cross(at - origin, own_force)
        if name == "crank" and "A.angle" in result.efforts:
            axis = np.array(mechanism.joints["A"].axis, dtype=float)
            moment = moment + result.efforts["A.angle"][k] * axis / np.linalg.norm(axis)
        found[name] = float(np.abs(force).max() / 9.81)
        if turns:
            found[f"{name} turning"] = float(np.abs(moment).max() / (9.81 * mechanism.scale))
    return found


@pytest.mark.parametrize("name", ["rssr", "rssr_skew"])
def test_an_rssr_closed_by_a_vector_is_that_of_the_data(name: str) -> None:
    data = reference(name)
    p = {
        key: value if isinstance(value, list) else float(value)
        for key, value in data["params"].items()
    }
    bearings = {
        side: {"kind": "revolute", "between": [f"ground.{side}", f"{body}.{side}"],
               "axis": list(numbers(p[f"axis_{side}"])), "zero": list(numbers(p[f"normal_{side}"])),
               "axis2": [0, 0, 1], "zero2": [1, 0, 0]}
        for side, body in (("A", "crank"), ("D", "rocker"))
    }  # fmt: skip
    rows = [row for row in data["rows"] if "C" in row]
    for row in rows:
        task = {"kind": "sweep", "driver": {
            "coordinate": "A.angle", "at": [float(row["u"])], "speed": float(data["driver_speed"]),
            "acceleration": float(data.get("driver_acceleration", 0.0))}}  # fmt: skip
        made = from_dict({
            "schema": 1, "title": "RSSR", "dimension": 3,
            "ground": {"points": {key: list(numbers(p[key])) for key in "AD"}},
            "bodies": {"crank": {"points": {"A": [0, 0, 0], "B": list(numbers(p["B"]))}},
                       "rocker": {"points": {"D": [0, 0, 0], "C": list(numbers(p["C"]))}}},
            "joints": bearings,
            "vectors": {"arm": {"from": "crank.A", "to": "crank.B"}, "bar": {"length": p["l"]},
                        "swing": {"from": "rocker.D", "to": "rocker.C"},
                        "base": {"from": "ground.A", "to": "ground.D"}},
            "loops": {"closure": ["arm", "bar", "-swing", "-base"]},
            "sketch": {"A": float(row["u"]), "D": float(row["rocker_angle"])},
            "tasks": {"at": task},
        })  # fmt: skip
        result = md.solve(made)
        assert list(result.status) == ["ok"]
        C, D = result.points["rocker.C"], result.joints["D"]
        assert off(C.position[0], row["C"]) < 1e-14
        assert off(C.velocity[0], row["C_velocity"]) < 1e-13
        assert off(C.acceleration[0], row["C_acceleration"]) < 1e-12
        assert off(D.angle_velocity[0], row["rocker_rate"]) < 1e-13
        assert off(D.angle_acceleration[0], row["rocker_acceleration"]) < 1e-12
        way = (numbers(row["C"]) - result.points["crank.B"].position[0]) / p["l"]
        bar = result.joints["bar"]
        assert np.sin(bar.elevation[0]) == pytest.approx(way[1], abs=1e-14)
        assert np.tan(bar.azimuth[0]) == pytest.approx(way[2] / way[0], rel=1e-12)
    assert len(rows) > 5


@pytest.mark.parametrize(("data", "task"), [
    (linkage(), "press"), (linkage(0.2), "press"), (linkage(), "fall"), (linkage(0.2), "fall"),
    (hanging(), "press"), (hanging(), "fall"),
], ids=["loop", "rough loop", "motion", "rough motion", "carried", "carried motion"])  # fmt: skip
def test_each_body_obeys_newton_and_euler(data: dict[str, Any], task: str) -> None:
    problem = from_dict(data)
    result = md.solve(problem, task)
    assert result.fault is None
    assert max(value for name, value in result.checks.items() if name != "energy") < 1e-12
    for k in range(3):
        for name, gap in gaps(result, problem.mechanism, k).items():
            assert gap < 1e-12, (name, k)
    assert not result.joints["rod" if "rod" in data["vectors"] else "hang"].reaction[:, 3:].any()
    assert result.checks["energy"] < 1e-11


def test_a_planted_moment_is_seen_by_that_test() -> None:
    problem = from_dict(linkage())
    result = md.solve(problem, "press")
    heavier = replace(problem.mechanism.bodies["rocker"], mass=0.9001)
    other = replace(
        problem.mechanism, bodies=Table({**problem.mechanism.bodies, "rocker": heavier})
    )
    assert gaps(result, other, 0)["rocker"] > 1e-6


def test_friction_takes_the_energy_that_is_gone() -> None:
    result = md.solve(from_dict(linkage(0.2)), "fall")
    assert result.work["friction.slide"][-1] < 0
    assert result.checks["energy"] < 1e-12


def test_a_body_rests_where_its_potential_is_least() -> None:
    """The equilibrium beside values of the potential energy at poses of a sweep."""
    data = linkage()
    found = md.solve(from_dict(data), "rest")
    angle = float(found.joints["A"].angle[0])
    at = [angle + step for step in (-2e-3, 0.0, 2e-3)]
    sweep = {"kind": "reactions", "driver": {"coordinate": "A.angle", "at": at, "speed": 0}}
    efforts = md.solve(from_dict(data | {"tasks": {"s": sweep}})).efforts["A.angle"]
    assert abs(efforts[1]) < 1e-9 * abs(efforts[2])
    assert efforts[0] < 0 < efforts[2]


def test_structure_names_module_node_and_mobility() -> None:
    found = structure(from_dict(linkage()))
    groups = found["groups"]
    assert [group["bodies"] for group in groups] == [["crank"], ["C"], ["link", "rocker"]]
    assert groups[1]["module"]["name"] == "ab-l"
    count = found["mobility"]
    # 6 freedoms a body, 3 a point; rod takes 1, slide 2, ball 3, cross 4, two hinges 5 each
    assert (count["n"], count["points"], count["W"]) == (3, 1, 1)


def test_written_again_and_from_python(tmp_path: Path) -> None:
    problem = from_dict(linkage(0.2))
    md.dump(problem, tmp_path / "own.toml")
    text = (tmp_path / "own.toml").read_text("utf-8")
    assert 'from = "crank.A"' in text
    assert md.load(tmp_path / "own.toml").mechanism == problem.mechanism
    own = problem.mechanism
    again = md.from_loops(
        own.closure.vectors, own.closure.loops, own.closure.nodes, ground=own.closure.ground,
        bodies=own.closure.bodies, joints=own.closure.joints, sketch=own.sketch, loads=own.loads,
        gravity=own.gravity, dimension=3,
    )  # fmt: skip
    assert again == own


def test_a_certificate_of_both_is_checked(tmp_path: Path) -> None:
    pytest.importorskip("flint")
    data = linkage(tasks={"turn": {"kind": "sweep", "poses": 3, "driver": {
        "coordinate": "A.angle", "from": 0.0, "to": 0.2}}})  # fmt: skip
    certificate = md.certify(from_dict(data), "turn")
    path = tmp_path / "own.json"
    path.write_text(as_json(certificate), "utf-8")
    md.check_certificate(path)
    certificate["mechanism"]["bodies"]["link"]["Q"][0] = "0.2500001"
    path.write_text(as_json(certificate), "utf-8")
    with pytest.raises(md.MechdaeError):
        md.check_certificate(path)


BAD = {
    "no body": ("vectors", {"arm": {"from": "crnk.A", "to": "crnk.B"}}, "vectors.arm.from",
                "did you mean crank"),
    "no point": ("vectors", {"arm": {"from": "crank.A", "to": "crank.X"}}, "vectors.arm.to",
                 "crank.X"),
    "given twice": ("vectors", {"arm": {"from": "crank.A", "to": "crank.B", "azimuth": 1}},
                    "vectors.arm.azimuth", "contradicts 'from' and 'to'"),
    "a vector and a body": ("vectors", {"crank": {"length": 1}}, "vectors.crank",
                            "a body is called 'crank' too"),
    "a node and a joint": ("nodes", {"tie": {"at": "rod.head"}}, "nodes.tie",
                           "a joint is called 'tie' too"),
    "a hinge on a node": ("joints", {"tie": {"kind": "revolute", "between": ["rod.head", "link.P"],
                                             "axis": [0, 0, 1]}}, "joints.tie.between",
                          "does not turn: a revolute joint needs a body"),
    "no end": ("joints", {"tie": {"kind": "spherical", "between": ["rod.tip", "link.P"]}},
               "joints.tie.between", "did you mean rod.tail"),
    "a point with a centre": ("bodies", {"C": {"mass": 1, "center": [1, 0, 0]}},
                              "bodies.C.center", "is a point"),
    "points of two numbers": ("ground", {"points": {"A": [0, 0], "S": [0, 0, 1]}},
                              "ground.points.A", "3 coordinates are needed"),
    "friction of a node": ("nodes", {"C": {"at": "rod.head", "friction": 0.1}},
                           "nodes.C.friction", "points without friction"),
}  # fmt: skip


def test_drawn_frames_are_refused() -> None:
    with pytest.raises(md.UnavailableError, match="beside vector loops"):
        from_dict(linkage(frames="drawn"))


@pytest.mark.parametrize("case", BAD, ids=str)
def test_what_is_refused_has_its_key(case: str) -> None:
    table, change, where, message = BAD[case]
    data = linkage()
    data[table] = {**data[table], **change} if table != "ground" else change
    with pytest.raises(md.InputError, match=message) as told:
        from_dict(data)
    assert where in str(told.value)

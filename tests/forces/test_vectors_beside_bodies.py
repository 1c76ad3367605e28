"""Vector loops in space beside bodies and joints: reference data, Newton and Euler body by body."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.values import Table
from mechdae.parts.proof import as_json
from mechdae.tasks.show import structure
from tests.shared.space import numbers, off, reference
from tests.shared.vectors_beside_bodies import gaps, hanging, linkage


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

"""What files of spatial mechanisms may not say: one message with the key."""

from __future__ import annotations

import copy
import tomllib
from typing import Any

import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared.paths import DATA, PROBLEMS

RSSR = tomllib.loads((DATA / "spatial" / "examples" / "rssr.toml").read_text("utf-8"))
PLANAR = tomllib.loads((PROBLEMS / "slider-crank.toml").read_text("utf-8"))


def changed(data: dict[str, Any], *path: str, to: Any) -> dict[str, Any]:
    """Return the tables with one entry replaced."""
    result = copy.deepcopy(data)
    table = result
    for step in path[:-1]:
        table = table.setdefault(step, {})
    table[path[-1]] = to
    return result


CASES = [
    (("joints", "A", "axis"), [0, 0, 0], "joints.A.axis", "length"),
    (("joints", "A", "axis"), [0, 1], "joints.A.axis", "three numbers"),
    (("joints", "A", "axis"), 0.3, "joints.A.axis", "list"),
    (("joints", "D", "zero"), [2, 0, 0], "joints.D.zero", "lies along axis"),
    (("joints", "D", "zero2"), [0, 0, -1], "joints.D.zero2", "lies along axis2"),
    (("bodies", "crank", "points", "B"), [0.05, 0], "bodies.crank.points.B", "3 coordinates"),
    (("gravity",), [0, -9.81], "gravity", "three numbers"),
    (("bodies", "crank", "center"), [0, 0], "bodies.crank.center", "three numbers"),
    (("bodies", "crank", "inertia"), 0.1, "bodies.crank.inertia", "Ixx"),
    (("bodies", "crank", "inertia"), [1, 2], "bodies.crank.inertia", "six numbers"),
    (("bodies", "crank", "inertia"), [1, -2, 1], "bodies.crank.inertia.yy", "negative"),
    (("joints", "B", "kind"), "curve", "joints.B", "not computed in space"),
    (("joints", "B", "friction"), 0.1, "joints.B.ball_radius", "radius of the ball"),
    (("joints", "B", "pin_radius"), 0.1, "joints.B", "unknown key"),
    (("sketch", "rocker.C"), [0.1, 0.2], "sketch.rocker.C", "three numbers"),
    (("dimension",), 4, "dimension", "2"),
    (("dimension",), 2, "joints.A.axis", "joints of space"),
]


@pytest.mark.parametrize(("path", "to", "where", "what"), CASES)
def test_one_message_with_the_key(path: Any, to: Any, where: str, what: str) -> None:
    with pytest.raises(md.InputError) as caught:
        from_dict(changed(RSSR, *path, to=to))
    assert caught.value.where == where
    assert what in str(caught.value)


def test_a_screw_needs_a_pitch() -> None:
    screw = {**RSSR["joints"]["A"], "kind": "screw", "pitch": 0}
    with pytest.raises(md.InputError, match="pitch is zero") as caught:
        from_dict(changed(RSSR, "joints", "A", to=screw))
    assert caught.value.where == "joints.A.pitch"


def test_kinds_of_space_in_the_plane() -> None:
    ball = {"kind": "spherical", "between": ["crank.A", "rod.A"]}
    with pytest.raises(md.InputError, match="one of space") as caught:
        from_dict(changed(PLANAR, "joints", "A", to=ball))
    assert "dimension = 3" in str(caught.value)


def test_three_numbers_in_the_plane() -> None:
    with pytest.raises(md.InputError, match="2 coordinates"):
        from_dict(changed(PLANAR, "bodies", "crank", "points", "A", to=[0, 0, 0]))
    with pytest.raises(md.InputError, match="two numbers"):
        from_dict(changed(PLANAR, "gravity", to=[0, 0, -9.81]))


def test_what_bodies_have_no_angle_of() -> None:
    driver = {"coordinate": "crank.angle", "at": [0.1]}
    with pytest.raises(md.InputError, match="no angle in space"):
        from_dict(changed(RSSR, "tasks", "turn", "driver", to=driver))


def test_planar_tasks_are_refused_by_name() -> None:
    turn = {**RSSR["tasks"]["turn"], "measures": ["transmission"]}
    with pytest.raises(md.UnavailableError, match="measures"):
        md.solve(from_dict(changed(RSSR, "tasks", "turn", to=turn)), "turn")


def test_motions_in_space_refuse_friction_by_name() -> None:
    data = changed(RSSR, "joints", "A", "friction", to=0.1)
    data = changed(data, "joints", "A", "pin_radius", to=0.01)
    data = changed(data, "tasks", "forces", to={"kind": "motion", "until": 1.0})
    with pytest.raises(md.UnavailableError, match="friction of A is not computed in motions"):
        md.solve(from_dict(data), "forces")
    sets = {"kind": "study", "of": "forces", "vary": {"l": [0.29, 0.31, 3]}, "outputs": ["last/A"]}
    with pytest.raises(md.InputError):
        md.solve(from_dict(changed(data, "tasks", "sets", to=sets)), "sets")


def test_joints_of_the_other_dimension_are_named() -> None:
    ground = md.Ground({"A": [0, 0, 0]})
    crank = md.Body("crank", {"A": [0, 0, 0]})
    with pytest.raises(md.MechanismError, match="Revolute is a joint of the plane") as caught:
        md.Mechanism(
            dimension=3,
            ground=ground,
            bodies=[crank],
            joints=[md.Revolute("A", "ground.A", "crank.A")],
        )
    assert "SpatialRevolute" in caught.value.hint


def test_directions_are_numbers_of_the_mechanism() -> None:
    problem = from_dict(RSSR)
    turned = problem.with_values({"D.axis.y": 0.5})
    assert turned.mechanism.joints["D"].axis == (1.0, 0.5, 0.0)
    assert from_dict(tomllib.loads(md.dumps(turned))).mechanism == turned.mechanism
    first, second = (md.solve(p, "modes").joints["D"].angle for p in (problem, turned))
    assert abs(first - second).max() > 1e-3


def test_a_free_link_is_named() -> None:
    data = copy.deepcopy(RSSR)
    del data["joints"]["D"]
    with pytest.raises(md.InputError, match="constraints missing"):
        md.solve(from_dict(data), "turn")


def test_an_idle_link_has_no_orientation() -> None:
    data = changed(RSSR, "bodies", "bar", "points", "P", to=[0.1, 0.02, 0])
    result = md.solve(from_dict(data), "turn")
    assert "bar" not in result.bodies
    assert "bar.P" not in result.points
    asked = changed(data, "tasks", "turn", "outputs", to=["bar.P"])
    with pytest.raises(md.UnavailableError, match="spins freely"):
        md.solve(from_dict(asked), "turn")

"""What files of spatial mechanisms may not say: one message with the key."""

from __future__ import annotations

import copy
import json
import tomllib
from typing import Any

import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared.command import run
from tests.shared.paths import DATA, PROBLEMS

RSSR = tomllib.loads((DATA / "spatial" / "examples" / "rssr.toml").read_text("utf-8"))
LOOPS = tomllib.loads(
    (DATA / "spatial" / "examples" / "spatial-slider-crank-loops.toml").read_text("utf-8")
)
BENNETT = tomllib.loads((DATA / "spatial" / "examples" / "bennett.toml").read_text("utf-8"))
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


def hinges(data: dict[str, Any]) -> dict[str, Any]:
    """Return four hinges that hold each other still."""
    for name, other, axis in (("B", "crank", [1, 0, 0.3]), ("C", "rocker", [0, 1, 0.2])):
        hinge = {"kind": "revolute", "between": [f"{other}.{name}", f"bar.{name}"], "axis": axis}
        data = changed(data, "joints", name, to=hinge)
    return data


GIVEN = {"length": 0.3, "elevation": 0, "azimuth": 0}
LONGER = {"slide": GIVEN | {"length": 1}}
REACTIONS = {"kind": "reactions", "driver": {"coordinate": "crank.azimuth", "at": [0.5]}}
AT_THE_TERMINAL: dict[str, tuple[dict[str, Any], str, int, str]] = {
    "axis without length": (changed(RSSR, "joints", "A", "axis", to=[0, 0, 0]), "turn", 2,
        "joints.A.axis: a direction needs a length"),
    "zero along the axis": (changed(RSSR, "joints", "D", "zero", to=[2, 0, 0]), "turn", 2,
        "joints.D.zero: zero lies along axis"),
    "two numbers in space": (changed(RSSR, "bodies", "crank", "points", "B", to=[1, 0]), "turn", 2,
        "bodies.crank.points.B: 3 coordinates are needed"),
    "loops that do not close": (
        LOOPS | {"vectors": dict.fromkeys(LOOPS["vectors"], GIVEN) | LONGER},
        "turn", 2, "given vectors do not close"),
    "no shared tail": (
        changed(LOOPS, "loops", "other", to=["a", "-b"])
        | {"vectors": LOOPS["vectors"] | {"a": {"length": 1}, "b": {"length": 1}}}, "turn", 2,
        "loops.other: the loop shares no vector and no tail"),
    "a vector twice": (changed(LOOPS, "loops", "closure", to=["crank", "rod", "-slide", "-rod"]),
        "turn", 2, "'rod' is in the loop twice"),
    "a value twice": (changed(LOOPS, "vectors", "offset", "elevation", to=1.0), "turn", 2,
        "vectors.offset: 'elevation' is given twice"),
    "a loop the other way round": (changed(LOOPS, "loops", "second", to=["crank", "-rod"]), "turn",
        2, "loops.closure: head and tail"),
    "a key of the plane": (changed(LOOPS, "vectors", "slide", "angle", to=1.0), "turn", 2,
        "vectors.slide.angle: 'angle' is a key of vectors in the plane"),
    "hinges that freeze": (hinges(RSSR), "turn", 1, "3 of the equations of its joints are redunda"),
    "hinges that nearly move": (changed(BENNETT, "parameters", "beta", to=0.5), "turn", 1,
        "holds together for special dimensions only"),
    "friction of a plane": (changed(RSSR, "joints", "B", to={
        "kind": "planar", "between": ["crank.B", "bar.B"], "axis": [0, 0, 1], "friction": 0.1
        }), "turn", 2, "joints.B.friction: friction of a planar pair"),
    "bodies beside loops": (changed(LOOPS, "bodies", "x", to={"points": {"A": [0, 0, 0]}}), "turn",
        2, "no chain of joints connects x to the ground"),
}  # fmt: skip


@pytest.mark.parametrize("name", AT_THE_TERMINAL)
def test_bad_input_at_the_terminal(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Any
) -> None:
    data, task, code, said = AT_THE_TERMINAL[name]
    path = tmp_path / "own.toml"
    path.write_text(toml({k: v for k, v in data.items() if k != "expected"}), "utf-8")
    found, out, err = run(capsys, "solve", str(path), "--task", task)
    assert found == code
    assert said in err
    assert out == ""


def toml(tables: dict[str, Any]) -> str:
    """Return tables as text, tables of tables in one line each."""
    plain = [f"{key} = {value(v)}" for key, v in tables.items() if not isinstance(v, dict)]
    for key, table in tables.items():
        if isinstance(table, dict):
            plain += [f"[{key}]", *(f'"{own}" = {value(v)}' for own, v in table.items())]
    return "\n".join(plain) + "\n"


def value(one: Any) -> str:
    if isinstance(one, dict):
        return "{" + ", ".join(f'"{key}" = {value(v)}' for key, v in one.items()) + "}"
    if isinstance(one, list | tuple):
        return "[" + ", ".join(map(value, one)) + "]"
    return json.dumps(one)


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
    turn = {**RSSR["tasks"]["turn"], "measures": ["centrodes"]}
    with pytest.raises(md.UnavailableError, match="measures"):
        md.solve(from_dict(changed(RSSR, "tasks", "turn", to=turn)), "turn")


def test_motions_in_space_refuse_friction_of_idle_links_by_name() -> None:
    data = changed(RSSR, "tasks", "forces", to={"kind": "motion", "until": 1.0})
    ball = changed(data, "joints", "B", "friction", to=0.1)
    ball = changed(ball, "joints", "B", "ball_radius", to=0.01)
    with pytest.raises(md.UnavailableError, match="bar spins freely"):
        md.solve(from_dict(ball), "forces")


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


def test_joints_that_freeze_everything_say_what_stays_open() -> None:
    """Welds in the place of the balls: the equation of D's angle vanishes for axes that cross."""
    data = changed(RSSR, "joints", "B", "kind", to="weld")
    mechanism = from_dict(changed(data, "joints", "C", "kind", to="weld")).mechanism
    driver = md.Driver("A.angle", at=[0.0])
    with pytest.raises(md.AssemblyError, match=r"joint D stays open by 57\.2958 deg; of"):
        md.solve(mechanism, md.Sweep(driver=driver, derivatives=0))


def test_an_idle_link_has_no_orientation() -> None:
    data = changed(RSSR, "bodies", "bar", "points", "P", to=[0.1, 0.02, 0])
    result = md.solve(from_dict(data), "turn")
    assert "bar" not in result.bodies
    assert "bar.P" not in result.points
    asked = changed(data, "tasks", "turn", "outputs", to=["bar.P"])
    with pytest.raises(md.UnavailableError, match="spins freely"):
        md.solve(from_dict(asked), "turn")

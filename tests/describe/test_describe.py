"""Descriptions and problem files: what is read, what is refused, and with which words."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

import mechdae as md
from mechdae.describe.expression import MAX_LENGTH, evaluate
from mechdae.describe.file import library
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.schema import schema
from mechdae.errors import InputError, MechanismError, ProblemFileError, UnknownName
from tests.shared.strategies import bounded, mechanisms

FOUR_BAR = """
schema = 1
[parameters]
a = 0.04
phi_deg = 30
[ground]
points = { A = [0, 0], D = [0.1, 0] }
[bodies.crank]
points = { A = [0, 0], B = ["a", 0] }
[bodies.coupler]
points = { B = [0, 0], C = [0.09, 0] }
[bodies.rocker]
points = { D = [0, 0], C_mm = [80, 0] }
[joints]
A = { kind = "revolute", between = ["ground.A", "crank.A"] }
B = { kind = "revolute", between = ["crank.B", "coupler.B"] }
C = { kind = "revolute", between = ["coupler.C", "rocker.C"] }
D = { kind = "revolute", between = ["ground.D", "rocker.D"] }
[sketch]
crank_deg = 60
coupler_deg = 15
rocker_deg = 80
[tasks.pose]
kind = "sweep"
driver = { coordinate = "crank.angle", at = ["phi"], speed_rpm = 60 }
"""


def load(text: str) -> md.Problem:
    return from_dict(tomllib.loads(text))


def refused(text: str, *words: str) -> None:
    with pytest.raises(InputError) as caught:
        load(text)
    message = str(caught.value)
    for word in words:
        assert word in message, message


# -- expressions -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2/3", 2 / 3),
        ("-a**2", -4.0),
        ("2*pi", 2 * math.pi),
        ("sqrt(a + 2)", 2.0),
        ("atan2(1, -1)", 3 * math.pi / 4),
        ("max(a, 3) - min(a, 3)", 1.0),
        (" ( a ) ", 2.0),
    ],
)
def test_expression(text: str, value: float) -> None:
    assert evaluate(text, {"a": 2.0}) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('id')",
        "a.__class__",
        "[x for x in (1, 2)]",
        "lambda: 1",
        "'a' * 9",
        "a if a else 1",
        "a[0]",
        "f'{a}'",
        "open('x')",
        "9**9**9**9",
        "1/0",
        "1e999",
        "(-1)**0.5",
        "sqrt(-1)",
        "sin()",
        "a b",
        "",
        "1_0j",
        "True",
        "+".join(["1"] * MAX_LENGTH),
        "-" * 100 + "1",
        "b",
        "a\x00",
    ],
)
def test_expression_is_never_executed(text: str) -> None:
    with pytest.raises(InputError):
        evaluate(text, {"a": 2.0})


# -- reading -----------------------------------------------------------------------------------


def test_units_are_not_part_of_the_name() -> None:
    problem = load(FOUR_BAR)
    values = problem.mechanism.values()
    assert values["phi"] == math.radians(30)
    assert values["rocker.C.x"] == 0.08
    assert problem.mechanism.sketch["crank"] == math.radians(60)
    assert problem.tasks["pose"].driver.speed == pytest.approx(2 * math.pi)
    for name in ("rocker.C.x_deg", "coupler.B.y_rpm"):
        with pytest.raises(InputError, match="does not fit"):
            problem.with_values({name: 1})
    assert problem.with_values({"rocker.C.x_mm": 70}).mechanism.values()["rocker.C.x"] == 0.07
    changed = problem.with_values({"phi_deg": 90, "a": "2*phi", "rocker.C.x": 0.07})
    assert changed.mechanism.values()["phi"] == math.pi / 2
    assert changed.mechanism.values()["crank.B.x"] == math.pi
    assert changed.mechanism.values()["rocker.C.x"] == 0.07
    assert problem.mechanism.values()["a"] == 0.04


GEAR = 'g = {{ kind = "gear", between = ["ground.A", "rocker.D"], {} }}\n'


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("schema = 1", "schema = 2", ["schema"]),
        ("schema = 1", "", ["schema"]),
        ("[bodies.rocker]", "[bodys.rocker]", ["bodys", "bodies"]),
        ("a = 0.04", "a = nan", ["parameters.a", "nan"]),
        ("a = 0.04", "a = inf", ["parameters.a"]),
        ("a = 0.04", "a = true", ["parameters.a"]),
        ("a = 0.04", 'a = "b"\nb = "a"', ["circle", "a -> b"]),
        ("a = 0.04", "a = 0.04\na_mm = 40", ["twice"]),
        ('["a", 0]', '["aa", 0]', ["crank.B.x", "aa", "did you mean a"]),
        ('["a", 0]', "[1, 2, 3]", ["crank", "2 coordinates"]),
        ('["a", 0]', '"x"', ["points.B", "list"]),
        ('"coupler.C"', '"coupler.Q"', ["joints.C", "coupler.C"]),
        ('"coupler.C"', '"couplr.C"', ["joints.C", "coupler"]),
        ('"coupler.C"', '"rocker.D"', ["joints.C", "itself"]),
        ('"coupler.C"', '"C"', ["joints.C", "body.point"]),
        (
            'kind = "revolute", between = ["ground.D"',
            'kind = "revolut", between = ["ground.D"',
            ["joints.D.kind", "revolute"],
        ),
        ('between = ["ground.D", "rocker.D"]', 'betwen = ["ground.D", "rocker.D"]', ["between"]),
        (
            'between = ["ground.D", "rocker.D"]',
            'between = ["ground.D", "rocker.D"], axis = 1',
            ["joints.D", "axis"],
        ),
        ('["a", 0]', "[0, 0]", ["bodies.crank", "zero length"]),
        ('kind = "sweep"', 'kind = "sweeep"', ["tasks.pose.kind", "sweep"]),
        ('at = ["phi"]', "at = []", ["tasks.pose", "empty"]),
        ('at = ["phi"]', 'at = ["psi"]', ["tasks.pose", "psi", "phi"]),
        ('at = ["phi"]', "from = 1", ["from", "to"]),
        ('at = ["phi"]', 'at = [1], range = "assembled"', ["at and range"]),
        ("crank.angle", "crank.angel", ["tasks.pose", "crank.angle"]),
        ("crank.angle", "ground.A.x", ["fixed"]),
        ("crank.angle", "A.slide", ["revolute", "A.slide"]),
        ("[bodies.rocker]", "[bodies.ground]", ["ground"]),
        ("[bodies.rocker]", "[bodies.A]", ["both a body and a joint"]),
        ("[sketch]", "[bodies.free]\npoints = { X = [0, 0] }\n[sketch]", ["free", "connects"]),
        ("[sketch]", "[repeat.cell]\ncount = -3\n[sketch]", ["repeat.cell.count", "negative"]),
        ("[sketch]", "dimension = 3\n[sketch]", ["joints.dimension"]),
        ("[tasks.pose]", '[tasks."../pose"]', ["tasks: '../pose' is not a name"]),
        ("[tasks.pose]", '[tasks.""]', ["tasks: '' is not a name"]),
        ("schema = 1", 'schema = 1\ntitle = "a\\u001b[31m"', ["title", "control characters"]),
        ("a = 0.04", 'a = "1\\u001b[31m"', ["parameters.a", "\ufffd"]),
        ("C_mm = [80, 0]", 'C = ["b*", 0]', ["bodies.rocker.points.C[0]", "expression"]),
        ("speed_rpm", "speed_mm", ["tasks.pose.driver.speed_mm", "does not fit", "speed_rpm"]),
        ('at = ["phi"]', "at_mm = [1]", ["tasks.pose.driver.at_mm", "in rad", "at_deg"]),
        ("crank_deg = 60", "crank_mm = 60", ["sketch.crank_mm", "does not fit", "crank_deg"]),
        ("C_mm = [80, 0]", "C_deg = [80, 0]", ["bodies.rocker.points.C_deg", "C_mm"]),
        ("points = { A", "points_rpm = { A", ["ground.points_rpm", "points_mm"]),
        ("[sketch]", GEAR.format("ratio_deg = 2") + "[sketch]", ["joints.g.ratio_deg", "plain"]),
        ("[sketch]", GEAR.format("ratio = 2, phase_mm = 2") + "[sketch]", ["joints.g.phase_mm"]),
        ("[sketch]", GEAR.format("phase = 1") + "[sketch]", ["joints.g: a gear needs"]),
        ("[sketch]", GEAR.format("teeth = [1, 2]") + "[sketch]", ["joints.g.mesh: 'teeth' needs"]),
    ],
)
def test_bad_file_names_the_place(old: str, new: str, words: list[str]) -> None:
    assert old in FOUR_BAR
    refused(FOUR_BAR.replace(old, new, 1), *words)


def test_file_errors_have_the_path(tmp_path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(FOUR_BAR.replace("a = 0.04", "a = nan"))
    with pytest.raises(ProblemFileError, match=r"bad\.toml: parameters\.a"):
        md.load(path)
    path.write_text("a = [")
    with pytest.raises(ProblemFileError, match="not valid TOML"):
        md.load(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ProblemFileError, match="UTF-8"):
        md.load(path)
    path.write_text("a = " + "[" * 5000 + "]" * 5000)
    with pytest.raises(ProblemFileError, match="nested"):
        md.load(path)
    with path.open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(ProblemFileError, match="MB"):
        md.load(path)
    with pytest.raises(ProblemFileError, match="no such file"):
        md.load(tmp_path / "none.toml")
    with pytest.raises(UnknownName, match="gorshkov-seven-link"):
        md.load("gorshkov")


@pytest.mark.parametrize("name", library.names())
def test_round_trip(name: str, tmp_path) -> None:
    problem = md.load(name)
    path = tmp_path / f"{name}.toml"
    md.dump(problem, path)
    assert md.load(path) == problem
    assert hash(md.load(path).mechanism) == hash(problem.mechanism)


@bounded
@given(mechanisms())
def test_what_python_builds_is_what_is_read_back(mechanism: md.Mechanism) -> None:
    """Any names and numbers, to the last bit, and the text once more."""
    text = md.dumps(md.Problem(mechanism, {}))
    again = load(text)
    assert again.mechanism == mechanism
    assert md.dumps(again) == text


def test_every_table_round_trips(tmp_path) -> None:
    text = (
        FOUR_BAR
        + """
[outputs]
mu = "rocker.angle - coupler.angle"
[loads.load]
kind = "resistance"
coordinate = "rocker.angle"
negative = 1
[loads.push]
kind = "force"
point = "coupler.C"
value = [1, "2*a"]
[tasks.force]
kind = "reactions"
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360 }
friction = "coupled"
[tasks.design]
kind = "synthesis"
driver = { coordinate = "crank.angle" }
goal = { kind = "path", point = "coupler.C", targets = [[0, 1], [1, 1]], steps_deg = [10, 20] }
free = { a = [0.01, 0.1] }
[[expected]]
task = "pose"
what = "bodies/crank/angle"
value_deg = 30
rel = 1e-12
"""
    )
    problem = load(text)
    assert problem.expected[0].value == math.radians(30)
    assert problem.tasks["design"].goal.steps == (math.radians(10), math.radians(20))
    path = tmp_path / "mechanism.toml"
    md.dump(problem, path)
    again = md.load(path)
    assert again == problem


def test_python_builds_the_same_value() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (0.1, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": ("a", 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (0.09, 0)}),
            md.Body("rocker", {"D": (0, 0), "C": (0.08, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        parameters={"a": 0.04, "phi": math.radians(30)},
        sketch={"crank": math.radians(60), "coupler": math.radians(15), "rocker": math.radians(80)},
    )
    assert mechanism == load(FOUR_BAR).mechanism
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=["phi"])))
    assert result.status[0] == "ok"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: md.Body("1a"), "name"),
        (lambda: md.Body("a", {"A": (0, float("nan"))}), "finite"),
        (lambda: md.Distance("d", "a.A", "b.B", length=-1).check({"length": -1.0}), "length"),
        (lambda: md.Gear("g", "a.A", "b.B"), "ratio"),
        (lambda: md.Gear("g", "a.A", "b.B", teeth=(10, 20)), "mesh"),
        (lambda: md.Sweep(), "driver"),
        (lambda: md.Driver("a.angle", range="all"), "assembled"),
        (lambda: md.Revolute("A", "a", "b.B"), "body.point"),
    ],
)
def test_python_values_are_checked(make, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[loads.f]\nkind = "force"\npoint = "coupler.X"\nvalue = [0, 1]', ["loads.f.point"]),
        (
            '[loads.f]\nkind = "force"\npoint = "coupler.C"\nvalue = [0, "q"]',
            ["loads.f.value", "q"],
        ),
        ('[loads.f]\nkind = "torque"\nbody = "crnk"\nvalue = 1', ["loads.f.body", "crank"]),
        ('[loads.f]\nkind = "resistance"\ncoordinate = "A.slide"', ["loads.f.coordinate"]),
        ('[loads.f]\nkind = "spring"\nstiffness = 1', ["loads.f", "between"]),
        ('[loads.f]\nkind = "wind"', ["loads.f.kind", "force"]),
        ('[outputs]\nmu = "rocker.angel"', ["outputs.mu", "rocker.angle"]),
        ("[outputs]\nmu = 3", ["outputs.mu"]),
        ("gravity = [0]", ["gravity"]),
    ],
)
def test_bad_loads_and_outputs_name_the_place(text: str, words: list[str]) -> None:
    if text.startswith("gravity"):
        refused(FOUR_BAR.replace("schema = 1", "schema = 1\n" + text), *words)
    else:
        refused(FOUR_BAR + text, *words)


def test_loads_may_use_coordinates_speeds_and_time() -> None:
    load(
        FOUR_BAR
        + '[loads.f]\nkind = "torque"\nbody = "crank"\nvalue = "-a*crank.angle.speed + sin(t)"\n'
        + '[outputs]\nmu = "rocker.angle - coupler.angle"'
    )


def test_negative_friction_is_refused() -> None:
    text = FOUR_BAR.replace('"rocker.D"] }', '"rocker.D"], friction = -0.1 }')
    with pytest.raises(MechanismError, match=r"joints\.D\.friction"):
        load(text)


def test_teeth_give_the_ratio() -> None:
    gear = md.Gear("g", "a.A", "b.B", teeth=(20, 15), mesh="external")
    assert dict(gear.numbers())["ratio"] == "-(15.0)/(20.0)"
    assert evaluate(dict(gear.numbers())["ratio"], {}) == -0.75


def test_schema_knows_every_key_of_the_problems() -> None:
    described = json.loads(json.dumps(schema()))["properties"]
    for name in library.names():
        data = tomllib.loads(library.find(name).read_text(encoding="utf-8"))
        assert set(data) <= set(described)
        entries = described["joints"]["additionalProperties"]["oneOf"]
        for joint in data.get("joints", {}).values():
            fitting = [
                entry
                for entry in entries
                if entry["properties"]["kind"]["const"] == joint["kind"]
                and set(joint) <= set(entry["properties"])
                and set(entry["required"]) <= set(joint)
            ]
            assert fitting, (name, joint)


@pytest.mark.parametrize("teeth", [(-20, 30), (20.5, 30), (0, 30)])
def test_teeth_are_counted(teeth) -> None:
    with pytest.raises(md.MechanismError, match="whole and above 0") as caught:
        md.Gear("mesh", "one.A", "two.B", teeth=teeth, mesh="external")
    assert caught.value.where == "teeth"


def test_a_coordinate_is_sketched_once() -> None:
    plain = md.load("slider-crank-friction").mechanism
    for more in ({"slide": 0.3, "slide.slide": 0.2}, {"crank.angle": 0.2}):
        with pytest.raises(md.MechanismError, match="the same coordinate"):
            replace(plain, sketch={**plain.sketch, **more})


@pytest.mark.parametrize(
    ("sketch", "hint"),
    [
        ({"B.x": 0.1}, "name the place of a point, like bar.B"),
        ({"B": 0.1}, "name the place of a point, like bar.B"),
        ({"D.slide": 0.1}, "it has D.angle"),
        ({"bar": 0.1}, "bodies have no angle in space"),
    ],
)
def test_what_cannot_be_sketched_in_space_says_what_can(sketch, hint) -> None:
    plain = md.load("rssr").mechanism
    with pytest.raises(md.MechdaeError, match=r"no coordinate|unknown body") as caught:
        md.solve(replace(plain, sketch=sketch), md.Sweep(md.Driver("A.angle", at=[0.1])))
    assert hint in str(caught.value.hint)


@pytest.mark.parametrize("value", [10**400, 1e200, np.array([1.0, 2.0])])
def test_numbers_that_are_none_are_refused_by_name(value) -> None:
    with pytest.raises(md.InputError, match="a number") as caught:
        md.solve("slider-crank-friction", set={"r": value})
    assert "r" in str(caught.value)


def test_what_is_no_table_of_values_is_refused() -> None:
    with pytest.raises(md.InputError, match="names and their numbers"):
        md.solve("slider-crank-friction", set=[1])

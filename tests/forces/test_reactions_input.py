"""What is wrong with the input of a task of kind reactions is said once, with the place."""

from __future__ import annotations

from pathlib import Path

import pytest

import mechdae as md
from mechdae.cli import main

GOOD = """
schema = 1
title = "slider-crank"
gravity = [0, -9.81]

[parameters]
r = 0.1
l = 0.3
Q = 100.0

[ground]
points = { O = [0, 0], S = [0.6, 0] }
[bodies.crank]
points = { O = [0, 0], B = ["r", 0] }
[bodies.rod]
points = { B = [0, 0], C = ["l", 0] }
mass = 1.2
center = ["l/3", 0]
inertia = 0.01
[bodies.slider]
points = { C = [0, 0] }

[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"], friction = 0.1, pin_radius = 0.02 }
B = { kind = "revolute", between = ["crank.B", "rod.B"] }
C = { kind = "revolute", between = ["rod.C", "slider.C"] }
slide = { kind = "prismatic", between = ["ground.O", "slider.C"], friction = 0.1 }

[sketch]
crank_deg = 60
rod_deg = -15

[loads.work]
kind = "resistance"
coordinate = "slide.slide"
negative = "Q"
positive = "Q"
[loads.push]
kind = "force"
point = "slider.C"
value = [-5, 0]
[loads.twist]
kind = "torque"
body = "rod"
value = 1
[loads.pull]
kind = "spring"
between = ["ground.S", "slider.C"]
stiffness = 10
free_length = 0.1
[loads.map]
kind = "table"
coordinate = "slide.slide"
file = "gas.csv"
columns = ["s", "F"]
along = "slide.slide"

[tasks.turn]
kind = "reactions"
driver = { coordinate = "crank.angle", at_deg = [60], speed = 10 }
friction = "coupled"
"""
TABLE = "s,F\n0.1,10\n0.5,20\n"


def write(folder: Path, old: str = "", new: str = "", table: str = TABLE) -> Path:
    assert old in GOOD
    path = folder / "bad.toml"
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    (folder / "gas.csv").write_text(table, encoding="utf-8")
    return path


def refused(path: Path, capsys, *parts: str) -> None:
    """Check the error in Python, and on the command line: exit code 2, no traceback."""
    with pytest.raises((md.InputError, md.SolveError)) as caught:
        md.solve(md.load(path), "turn")
    message = str(caught.value)
    for part in parts:
        assert part in message, message
    code = main(["solve", str(path), "--task", "turn", "--json"])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert "Traceback" not in captured.err
    assert captured.err.startswith("mechdae: ")
    assert captured.err.count("mechdae: ") == 1
    for part in parts:
        assert part in captured.err


def test_the_good_file_is_computed(tmp_path: Path) -> None:
    result = md.solve(write(tmp_path), "turn")
    assert list(result.status) == ["ok"]
    assert result.kind == "reactions"


JOINT_O = '"crank.O"], friction = 0.1, pin_radius = 0.02 }'
SLIDE = '"slider.C"], friction = 0.1 }'
SPRING = 'between = ["ground.S", "slider.C"]\nstiffness'
MASSES = 'mass = 1.2\ncenter = ["l/3", 0]\ninertia = 0.01\n'
PARTS = 'friction = "coupled"\nparts = ["inertial"]'

CASES = {
    "negative mass": ("mass = 1.2", "mass = -1.2", "bodies.rod.mass", "negative"),
    "negative inertia": ("inertia = 0.01", "inertia = -1", "bodies.rod.inertia", "negative"),
    "infinite mass": ("mass = 1.2", "mass = inf", "bodies.rod.mass"),
    "negative friction": (SLIDE, '"slider.C"], friction = -0.1 }', "joints.slide.friction"),
    "friction without pin": (
        JOINT_O,
        '"crank.O"], friction = 0.1 }',
        "joints.O",
        "pin_radius",
    ),
    "negative contact length": (
        SLIDE,
        '"slider.C"], friction = 0.1, contact_length = -1 }',
        "joints.slide.contact_length",
    ),
    "contact length of zero": (
        SLIDE,
        '"slider.C"], friction = 0.1, contact_length = 0 }',
        "joints.slide.contact_length",
    ),
    "unknown point": ('point = "slider.C"', 'point = "slider.D"', "loads.push", "slider.C"),
    "unknown body": ('body = "rod"', 'body = "rodd"', "loads.twist", "rod"),
    "unknown frame": (
        "value = [-5, 0]",
        'value = [-5, 0]\nframe = "slidr"',
        "loads.push.frame",
        "slider",
    ),
    "unknown name in a value": (
        "value = [-5, 0]",
        'value = ["-5*slide.slid", 0]',
        "loads.push.value",
    ),
    "unknown coordinate": (
        'coordinate = "slide.slide"\nnegative',
        'coordinate = "slide.angle"\nnegative',
        "loads.work.coordinate",
    ),
    "spring to an unknown point": (
        SPRING,
        'between = ["ground.T", "slider.C"]\nstiffness',
        "loads.pull",
        "ground.S",
    ),
    "spring on nothing": (SPRING, "stiffness", "loads.pull"),
    "spring on two things": (
        SPRING,
        'between = ["ground.S", "slider.C"]\ncoordinate = "slide.slide"\nstiffness',
        "loads.pull",
    ),
    "spring of one point": (SPRING, 'between = ["ground.S"]\nstiffness', "loads.pull.between"),
    "table on nothing": ('along = "slide.slide"\n', "", "loads.map"),
    "table along nothing": (
        'along = "slide.slide"',
        'along = "slide.glide"',
        "loads.map.along",
    ),
    "table on two things": (
        'along = "slide.slide"',
        'along = "slide.slide"\nbody = "rod"',
        "loads.map",
    ),
    "table of another folder": (
        'file = "gas.csv"',
        'file = "../gas.csv"',
        "loads.map.file",
    ),
    "table that is not there": ('file = "gas.csv"', 'file = "gaz.csv"', "loads.map.file"),
    "unknown column": ('columns = ["s", "F"]', 'columns = ["s", "G"]', "loads.map.columns", "F"),
    "one column": ('columns = ["s", "F"]', 'columns = ["s"]', "loads.map.columns"),
    "unknown friction": (
        'friction = "coupled"',
        'friction = "couplet"',
        "tasks.turn.friction",
        "coupled",
    ),
    "unknown part": (
        'friction = "coupled"',
        'friction = "coupled"\nparts = ["dynamic"]',
        "tasks.turn.parts",
        "inertial",
    ),
    "unknown direction": (
        'friction = "coupled"',
        'friction = "coupled"\ndirection = "back"',
        "tasks.turn.direction",
        "load",
    ),
    "unknown axes": (
        'friction = "coupled"',
        'friction = "coupled"\naxes = ["radical"]',
        "tasks.turn.axes",
        "radial",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_input(name: str, tmp_path: Path, capsys) -> None:
    old, new, *parts = CASES[name]
    refused(write(tmp_path, old, new), capsys, *parts)


def test_inertial_parts_without_any_mass(tmp_path: Path, capsys) -> None:
    text = GOOD.replace(MASSES, "").replace('friction = "coupled"', PARTS)
    path = write(tmp_path)
    path.write_text(text, encoding="utf-8")
    refused(path, capsys, "tasks.turn.parts", "mass")


@pytest.mark.parametrize(
    "table",
    [
        "",
        "s,F\n",
        "s,F\n0.1,10\n",
        "s,F\n0.1,10\n0.1,11\n",
        "s,F\n0.5,10\n0.1,11\n",
        "s,F\n0.1,ten\n0.5,20\n",
        "s,F\n0.1,nan\n0.5,20\n",
        "s,F\n0.1\n0.5,20\n",
    ],
    ids=["empty", "header", "row", "twice", "backwards", "text", "nan", "short"],
)
def test_bad_table(table: str, tmp_path: Path, capsys) -> None:
    refused(write(tmp_path, table=table), capsys, "loads.map")


def test_a_pose_outside_of_the_table(tmp_path: Path, capsys) -> None:
    refused(write(tmp_path, table="s,F\n0.1,10\n0.2,20\n"), capsys, "loads.map")


def test_errors_of_values_in_python() -> None:
    def crank(joint: dict[str, float], **body: float) -> md.Mechanism:
        return md.Mechanism(
            ground=md.Ground({"O": (0, 0)}),
            bodies=[md.Body("crank", {"O": (0, 0)}, **body)],
            joints=[md.Revolute("O", "ground.O", "crank.O", **joint)],
            sketch={"crank": 0.0},
        )

    turn = md.Reactions(md.Driver("crank.angle", at=(0.0,)), friction="coupled")
    with pytest.raises(md.MechanismError, match=r"joints\.O.*pin_radius"):
        md.solve(crank({"friction": 0.1}), turn)
    with pytest.raises(md.MechanismError, match=r"bodies\.crank\.mass"):
        md.solve(crank({}, mass=-1), turn)

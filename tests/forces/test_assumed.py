"""What a file leaves open and an answer depends on is said in results: a table of forces.md."""

from __future__ import annotations

import re
from typing import Any

import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared.paths import DOCS

ROW = re.compile(r"^\| (.+?) \| (.+?) \| `([^`]+)` \|$", re.M)


def rows() -> dict[str, str]:
    """Return what is not given -> what the result says, of the table in the documentation."""
    text = (DOCS / "reference/forces.md").read_text(encoding="utf-8")
    table = text.split("| not given |")[1].split("\n\n")[0]
    return {given.replace("`", ""): said for given, _, said in ROW.findall(table)}


def slider_crank(**keys: Any) -> dict[str, Any]:
    """Return a slider-crank with masses, friction in its guide, and a spring; all is given."""
    found: dict[str, Any] = {
        "schema": 1,
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0], "H": [1, 1]}},
        "bodies": {
            "crank": {"points": {"O": [0, 0], "B": [0.1, 0]}, "mass": 1, "center": [0.05, 0],
                      "inertia": 0.01},
            "rod": {"points": {"B": [0, 0], "C": [0.3, 0]}, "mass": 1, "center": [0.1, 0],
                    "inertia": 0.01},
            "slider": {"points": {"C": [0, 0]}, "mass": 1, "center": [0, 0], "inertia": 0.01},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "crank.O"], "friction": 0.1,
                  "pin_radius": 0.01, "friction_static": 0.2},
            "B": {"kind": "revolute", "between": ["crank.B", "rod.B"], "friction": 0.1,
                  "pin_radius": 0.01, "friction_static": 0.2},
            "C": {"kind": "revolute", "between": ["rod.C", "slider.C"], "friction": 0.1,
                  "pin_radius": 0.01, "friction_static": 0.2},
            "guide": {"kind": "prismatic", "between": ["ground.O", "slider.C"], "axis": 0,
                      "friction": 0.1, "contact_length": 0.1, "friction_static": 0.2},
        },
        "sketch": {"crank": 1.0, "rod": -0.3},
        "loads": {"pull": {"kind": "spring", "between": ["ground.H", "slider.C"],
                           "stiffness": 100.0, "free_length": 0.5}},
        "tasks": {
            "sweep": {"kind": "sweep", "driver": driver()},
            "forces": {"kind": "reactions", "driver": driver()},
            "motion": {"kind": "motion", "start": {"crank.angle": 1.0}, "until": 0.01},
            "rest": {"kind": "equilibrium", "friction": "none"},
        },
    }  # fmt: skip
    for path, value in keys.items():
        *places, name = path.split("__")
        table = found
        for place in places:
            table = table[place]
        if value is None:
            del table[name]
        else:
            table[name] = value
    return found


def driver() -> dict[str, Any]:
    return {"coordinate": "crank.angle", "at": [1.0], "speed": 3.0}


def wheels(**joint: Any) -> dict[str, Any]:
    """Return two wheels on the ground, coupled by a joint, one loaded."""
    points = {"points": {"O": [0, 0]}}
    turn = {"coordinate": "one.angle", "at": [0.1]}
    return {
        "schema": 1,
        "ground": {"points": {"A": [0, 0], "B": [0.3, 0]}},
        "bodies": {"one": points, "two": points},
        "joints": {
            "A": {"kind": "revolute", "between": ["ground.A", "one.O"]},
            "B": {"kind": "revolute", "between": ["ground.B", "two.O"]},
            "w": {"between": ["one.O", "two.O"], **joint},
        },
        "sketch": {"one": 0, "two": 0},
        "loads": {"m": {"kind": "torque", "body": "two", "value": 5}},
        "tasks": {"forces": {"kind": "reactions", "driver": turn}},
    }  # fmt: skip


def said(data: dict[str, Any], *tasks: str) -> list[str]:
    problem = from_dict(data)
    return [" / ".join(md.solve(problem, t).summary.get("assumptions", [])) for t in tasks]


EVERY = ("forces", "motion", "rest")
CASES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "speed, in a sweep": (slider_crank(tasks__sweep__driver__speed=None), ("sweep",)),
    "speed, in a task of forces": (slider_crank(tasks__forces__driver__speed=None), ("forces",)),
    "gravity": (slider_crank(gravity=None), EVERY),
    "mass and inertia of a body": (
        slider_crank(bodies__rod__mass=None, bodies__rod__inertia=None), EVERY
    ),
    "inertia of a body with a mass": (slider_crank(bodies__rod__inertia=None), EVERY),
    "center of a body with a mass": (slider_crank(bodies__rod__center=None), EVERY),
    "contact_length of a guide that rubs": (
        slider_crank(joints__guide__contact_length=None), ("forces",)
    ),
    "friction of a joint, where others have it": (
        slider_crank(joints__C__friction=None, joints__C__friction_static=None), ("forces",)
    ),
    "friction_static, in a motion": (
        slider_crank(joints__C__friction_static=None), ("motion",)
    ),
    "pressure_angle of teeth": (wheels(kind="gear", ratio=-2), ("forces",)),
    "pretension of a belt": (wheels(kind="belt", ratio=2, radius=0.05), ("forces",)),
    "press of friction wheels": (
        wheels(kind="friction-wheel", radius=0.1, second_radius=0.2), ("forces",)
    ),
    "radius of a belt": (wheels(kind="belt", ratio=2), ("forces",)),
    "free_length of a spring": (slider_crank(loads__pull__free_length=None), EVERY),
}  # fmt: skip


@pytest.mark.parametrize("given", sorted({*CASES, *rows()}))
def test_what_is_not_given_is_said(given: str) -> None:
    data, tasks = CASES[given]
    text = rows()[given]
    for found in said(data, *tasks):
        assert text in found


def test_what_is_given_is_not_said() -> None:
    """Nothing is assumed of a problem that says all."""
    found = said(slider_crank(), "sweep", *EVERY)
    assert found == [""] * len(found)
    gear = wheels(kind="gear", ratio=-2, pressure_angle_deg=25)
    assert "pressure" not in said(gear, "forces")[0]


def test_the_terminal_shows_it(capsys: pytest.CaptureFixture[str], tmp_path: Any) -> None:
    from mechdae.cli import main

    problem = from_dict(slider_crank(gravity=None, tasks__sweep__driver__speed=None))
    path = tmp_path / "p.toml"
    md.dump(problem, path)
    assert main(["solve", str(path)]) == 0
    text = capsys.readouterr().out
    assert "assumes   crank.angle has no speed: velocities and accelerations" in text
    assert text.count("assumes   without weight (no gravity given): crank, rod, slider") == 3


@pytest.mark.parametrize("task", ["forces", "motion"])
def test_a_block_that_is_fixed_is_told(task: str) -> None:
    """The second body of a guide is its block: a fixed one may be a slip."""
    told = "guide rubs over 0.1 m about ground.O: its block is fixed"
    ends = {"joints__guide__between": ["slider.C", "ground.O"]}
    for keys, said in (
        (ends, True),
        ({}, False),
        ({**ends, "joints__guide__contact_length": None}, False),
    ):
        result = md.solve(from_dict(slider_crank(**keys)), task)
        assert (told in result.summary.get("assumptions", [])) is said


def test_exchanged_bodies_of_a_guide_are_other_friction() -> None:
    """The same places; the moment of a force on the slider about a block that is elsewhere."""
    usual, fixed = (
        md.solve(from_dict(slider_crank(joints__guide__between=own)), "forces")
        for own in (["ground.O", "slider.C"], ["slider.C", "ground.O"])
    )
    for name, series in usual.points.items():
        assert series.position == pytest.approx(fixed.points[name].position, abs=1e-12)
    assert abs(usual.efforts["crank.angle"][0] - fixed.efforts["crank.angle"][0]) > 1e-3

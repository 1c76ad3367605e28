"""Slips of the pen are answered with what happened: units, headers, tables that show what moves."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file.load import from_dict
from mechdae.parts.exchange.formats import check_format
from mechdae.results.tables import table
from tests.shared.paths import ROOT

FOUR_BAR = (ROOT / "problems/four-bar-crank-rocker.toml").read_text(encoding="utf-8")


def refused(text: str) -> str:
    with pytest.raises(md.InputError) as caught:
        from_dict(tomllib.loads(text))
    return str(caught.value)


# -- keys below a header they do not belong to -----------------------------------------------


@pytest.mark.parametrize(
    "header",
    ["[parameters]", "[ground]", "[bodies.crank]", "[joints]", "[tasks.turn]", "[[expected]]"],
)
def test_gravity_below_a_header(header: str) -> None:
    line = "gravity = [0, -9.81]\n"
    assert "a key of the whole file" not in refused("schema = 2\n" + line)
    lines = FOUR_BAR.splitlines(keepends=True)
    at = next(i for i, text in enumerate(lines) if text.startswith(header))
    text = "".join([*lines[: at + 1], line, *lines[at + 1 :]])
    message = refused(text)
    assert "'gravity' is a key of the whole file" in message
    assert header.strip("[]") in message


def test_a_schema_below_a_header() -> None:
    text = FOUR_BAR.replace("schema = 1\n", "").replace("[ground]", "schema = 1\n[ground]", 1)
    message = refused(text)
    assert "'schema' is a key of the whole file" in message
    assert "[parameters]" in message


def test_keys_of_a_task_below_the_header_of_its_driver() -> None:
    text = FOUR_BAR.split("[tasks.turn]")[0] + (
        '[tasks.turn]\nkind = "sweep"\n[tasks.turn.driver]\ncoordinate = "crank.angle"\n'
        "at = [1]\nposes = 5\n"
    )
    message = refused(text)
    assert "'poses' is a key of [tasks.turn]" in message
    assert "[tasks.turn.driver]" in message


def test_a_misspelt_between_is_named() -> None:
    message = refused(FOUR_BAR.replace("between", "betwen", 1))
    assert "unknown key 'betwen'\n  try: did you mean between?" in message
    assert "unknown key" not in refused(re.sub(r", between = \[.*?\]", "", FOUR_BAR, count=1))


def test_names_that_resemble_none_are_listed() -> None:
    four_bar = md.load("four-bar-crank-rocker")
    with pytest.raises(md.UnknownName) as caught:
        four_bar.with_values({"xyz_mm": 130.0})
    assert caught.value.hint == f"one of {', '.join(four_bar.mechanism.parameters)}"
    with pytest.raises(md.UnknownName, match="one of dxf, mjcf"):
        check_format("zzz")


def test_a_planted_mistake_of_the_hint_is_seen(monkeypatch) -> None:
    from mechdae.describe.file import key_hints

    monkeypatch.setattr(key_hints, "explain", lambda data, error: None)
    text = FOUR_BAR.replace("[ground]", "gravity = [0, -9.81]\n[ground]", 1)
    assert "whole file" not in refused(text)


# -- lengths and angles in the wrong unit ----------------------------------------------------


def test_degrees_beside_a_suffix() -> None:
    text = FOUR_BAR.replace("to_deg = 360", "to = 360")
    problem = from_dict(tomllib.loads(text))
    notes = md.solve(problem, "turn").summary["notes"]
    assert notes == ["driver: to = 360 is in radians, 57.3 turns of crank; did you mean to_deg?"]
    for good in ("to_deg = 3600", 'to = "100*pi"', "to = 31"):
        own = from_dict(tomllib.loads(FOUR_BAR.replace("to_deg = 360", good)))
        notes = md.solve(own, "turn", poses=2000).summary.get("notes", [])
        assert not any("did you mean" in note for note in notes), good


@pytest.mark.parametrize("factor", [11.0, 1000.0])
def test_a_length_that_dwarfs_the_others(factor: float) -> None:
    """A gap of the pins beyond the links cannot close: the hint names it."""
    problem = md.load("four-bar-crank-rocker")
    far = factor * (0.04 + 0.12 + 0.08)
    with pytest.raises(md.SolveError, match="times all other lengths together") as caught:
        md.solve(problem, "turn", set={"d": far})
    assert "ground" in str(caught.value)
    with pytest.raises(md.SolveError) as caught:
        md.solve(problem, "turn", set={"d": 9 * (0.04 + 0.12 + 0.08)})
    assert "times all other lengths" not in str(caught.value)


def test_a_note_where_a_long_length_still_closes() -> None:
    """A slide is as long as it must be: the mechanism closes, and the note asks."""
    text = """
schema = 1
[ground]
points = { O = [0, 0], G = [0, -500] }
[bodies.crank]
points = { O = [0, 0], A = [0.1, 0] }
[bodies.lever]
points = { G = [0, 0], B = [0.2, 0] }
[bodies.rod]
points = { B = [0, 0], C = [0.3, 0] }
[bodies.ram]
points = { C = [0, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
A = { kind = "pin-in-slot", between = ["lever.G", "crank.A"] }
G = { kind = "revolute", between = ["ground.G", "lever.G"] }
B = { kind = "revolute", between = ["lever.B", "rod.B"] }
C = { kind = "revolute", between = ["rod.C", "ram.C"] }
slide = { kind = "prismatic", between = ["ground.G", "ram.C"] }
[sketch]
crank_deg = 0
lever_deg = 90
rod_deg = -42
[tasks.t]
kind = "sweep"
driver = { coordinate = "crank.angle", at = [0] }
"""
    notes = md.solve(from_dict(tomllib.loads(text))).summary["notes"]
    assert any("on the ground are 500 m apart, 833 times all other" in note for note in notes)
    text = text.replace("-500", "-0.5")
    assert "notes" not in md.solve(from_dict(tomllib.loads(text))).summary


def test_no_predefined_problem_is_doubted() -> None:
    from mechdae.motion.setup.likely_typos import long_length

    for path in (ROOT / "problems").glob("*.toml"):
        assert not long_length(md.load(path).mechanism), path.stem


# -- tolerances with units -------------------------------------------------------------------


def test_tolerances_with_units(capsys) -> None:
    own = []
    for word in ("a_mm=0.1", "a=0.0001"):
        words = ["sensitivity", "four-bar-crank-rocker", "--of", "summary/swing/rocker"]
        assert main([*words, "--tolerance", word]) == 0
        own.append(capsys.readouterr().out)
    assert own[0] == own[1]
    for bad, hint in (
        (["a_mm=0.1", "--tolerance", "a=1"], "given twice"),
        (["a_foo=1"], "unknown parameter"),
        (["coupler.P.x_deg=1"], "does not fit"),
        (["a_mm=-1"], "not negative"),
    ):
        words = ["sensitivity", "four-bar-crank-rocker", "--of", "summary/swing/rocker"]
        assert main([*words, "--tolerance", *bad]) == 2
        assert hint in capsys.readouterr().err


# -- studies in processes --------------------------------------------------------------------


def test_studies_are_the_same_in_several_processes() -> None:
    """Rows that do not assemble included; c + b must reach over the gap of the pins."""
    study = md.Study(
        vary={"a": [0.03, 0.15, 5]}, of="turn", outputs=("summary/swing/rocker", "summary/limits")
    )
    told: list[list[tuple[int, int]]] = [[], []]
    found = [
        md.solve("four-bar-crank-rocker", study, workers=k + 1,
                 progress=lambda done, total, k=k: told[k].append((done, total)))
        for k in range(2)
    ]  # fmt: skip
    assert str(found[0].to_dict()) == str(found[1].to_dict())
    assert {"ok", "unassembled"} <= found[1].summary["status"].keys()
    for steps in told:  # sets that are computed together are told at once
        assert steps == sorted(set(steps))
        assert steps[-1] == (5, 5)


def test_workers_on_the_command_line(tmp_path: Path, capsys) -> None:
    text = FOUR_BAR + (
        '\n[tasks.map]\nkind = "study"\nof = "turn"\nvary = { a_mm = [30, 40, 3] }\n'
        'outputs = ["summary/swing/rocker"]\n'
    )
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    assert main(["solve", str(path), "--task", "map", "--workers", "2", "--json"]) == 0
    assert main(["solve", str(path), "--task", "turn", "--workers", "2"]) == 2
    assert "only studies" in capsys.readouterr().err
    assert main(["solve", str(path), "--task", "map", "--workers", "0"]) == 2
    with pytest.raises(md.InputError, match="swing"):
        md.solve(
            path,
            md.Study(vary={"a": [0.03, 0.04, 4]}, of="turn", outputs=("summary/nothing",)),
            workers=2,
        )


# -- tables that show what moves -------------------------------------------------------------


def head(result: md.Result) -> list[str]:
    return re.split(r"  +", table(result).split("\n")[1].strip())


def test_the_output_comes_with_its_rates() -> None:
    titles = head(md.solve("four-bar-crank-rocker", "turn", poses=7))
    assert titles[:5] == [
        "status", "crank.angle [deg]", "rocker [deg]", "rocker [rad/s]", "rocker [rad/s2]"
    ]  # fmt: skip
    titles = head(md.solve("slider-crank-offset", poses=7))
    assert [t for t in titles if "slide" in t][:1] == titles[2:3]


def test_constant_coordinates_are_no_columns() -> None:
    result = md.solve("slider-crank", poses=7)
    whole = table(result)
    assert "slider.C.y" not in whole.split("\n")[1]


def test_rest_is_zero() -> None:
    """A parallelogram's coupler only translates; cos 90 degrees is no 6e-17."""
    result = md.solve("change-point-parallelogram", "arc")
    assert "coupler [deg]" not in table(result)
    single = table(md.solve("slider-crank", md.Sweep(driver=md.Driver(
        "crank.angle", at=("pi/2",), speed=1.0))))  # fmt: skip
    assert not re.search(r"e-1[5-9]|-0[ ,)]", single.split("status")[0]), single
    from mechdae.results.tables.text import cells

    assert list(cells(np.array([-0.0, 1e-17, -1e-17, 1.0]), 1.0)) == ["0", "0", "0", "1"]
    assert list(cells(np.array([-0.0, 1e-17]))) == ["0", "1e-17"]
    # nothing is hidden beside a small mechanism: the noise has its size
    tiny = md.solve("slider-crank", set={"r": 1e-9, "l": 3e-9}, poses=4)
    assert "e-09" in table(tiny)

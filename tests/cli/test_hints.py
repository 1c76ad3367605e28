"""Hints name what is there: where a name was given first, the kinds of pictures, whole paths."""

from __future__ import annotations

from pathlib import Path

import pytest

from mechdae.cli import main
from mechdae.describe.file import library

TWICE = {
    "[joints]\nA = { kind = 'gear' }\nB = 1\nA = { kind = 'gear' }\n": "A is given in line 3",
    "[ground]\n[joints]\n[ground]\n": "ground is given in line 2",
}


@pytest.mark.parametrize("text", TWICE)
def test_a_name_given_twice(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "twice.toml"
    path.write_text("schema = 1\n" + text, encoding="utf-8")
    assert main(["solve", str(path)]) == 2
    last = 1 + text.count("\n")
    assert f"{TWICE[text]} and again in line {last}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "hint"),
    [
        (["--kind", "graph"], "one of diagram, groups, animation, plans, curves"),
        (["--kind", "curves", "--of", "coupler.P"], "did you mean points/coupler.P"),
    ],
)
def test_pictures(options: list[str], hint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "four-bar-crank-rocker", *options]) == 2
    assert hint in capsys.readouterr().err


def test_a_number_that_is_set_is_one_word(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "slider-crank", "--set", "r", "0.13"]) == 2
    assert "--set NAME=VALUE, without blanks" in capsys.readouterr().err
    assert main(["solve", "slider-crank", "--set", "r=0.13", "more"]) == 2
    assert "without blanks" not in capsys.readouterr().err


def test_names_of_one_option_are_given_one_by_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "slider-crank", "--of", "bodies/rod/angle", "bodies/crank/angle"]) == 2
    assert "--of bodies/rod/angle --of bodies/crank/angle" in capsys.readouterr().err
    assert main(["plot", "slider-crank", "--pose", "1", "2"]) == 2
    assert "one for each" not in capsys.readouterr().err


def test_a_file_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "toggle.toml").write_text("schema = 1\n", encoding="utf-8")
    assert main(["solve", str(tmp_path / "togle.toml")]) == 2
    assert "did you mean toggle.toml?" in capsys.readouterr().err


def test_a_direction_in_the_plane(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, text = tmp_path / "mine.toml", library.new("slider-crank")
    path.write_text(text.replace("axis_deg = 0", "axis = [1, 0]"), encoding="utf-8")
    assert main(["solve", str(path)]) == 2
    assert "axis_deg = 0, an angle in the plane" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ('["rod", 0]', '["rod^2/rod", 0]', "a power is **: x**2"),
        ("driver = { coordinate", "drive = { coordinate", "did you mean driver"),
        (
            'driver = { coordinate = "crank.angle", at_deg = [60] }',
            "",
            'driver = { coordinate = "..."',
        ),
    ],
)
def test_slips_in_a_file(
    old: str, new: str, hint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, text = tmp_path / "mine.toml", library.new("slider-crank")
    path.write_text(text.replace(old, new), encoding="utf-8")
    assert main(["solve", str(path)]) == 2
    assert hint in capsys.readouterr().err

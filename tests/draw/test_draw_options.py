"""Options of pictures: the same names in Python and on the command line; nothing solved twice."""

from __future__ import annotations

import argparse
import importlib
import inspect
from pathlib import Path

import pytest

import mechdae as md
from mechdae.cli.commands import plot as command
from mechdae.describe.file import library
from mechdae.draw.animation import animate
from mechdae.draw.catalogue import ON_PAPER, OPTIONS, PICTURES, drawing_of, names_of
from mechdae.draw.graphs.map import Plane
from mechdae.tasks.dispatch.solve import KINDS
from tests.shared.command import run

STUDY = """
[tasks.map]
kind = "study"
of = "turn"
vary = { r = [0.1, 0.2, 3] }
outputs = ["summary/stroke/guide"]
"""


def drawing(kind: str):
    """Return the function whose keywords are the options of a kind."""
    return animate if kind == "animation" else drawing_of(kind)


@pytest.mark.parametrize("kind", PICTURES)
def test_options_are_those_of_the_drawing_functions(kind: str) -> None:
    given = inspect.signature(drawing(kind)).parameters.values()
    keywords = {own.name: own.default for own in given if own.kind is own.KEYWORD_ONLY}
    keywords = {name: default for name, default in keywords.items() if name not in ON_PAPER}
    assert set(names_of(kind)) == set(keywords)
    for name, default in keywords.items():
        assert default is {"on": False, "off": True}.get(OPTIONS[name].what, default)


def test_the_command_has_the_same_names() -> None:
    parser = argparse.ArgumentParser()
    command.arguments(parser)
    flags = {own.dest: own for own in parser._actions}
    for name, option in {**OPTIONS, **ON_PAPER}.items():
        assert name in flags
        wanted = f"--no-{name}" if option.what == "off" else f"--{option.flag or name}"
        assert flags[name].option_strings == [wanted]


def test_names_of_before_are_understood() -> None:
    result = md.solve("slider-crank-friction", "cycle", poses=7)
    for of in ({"of": "joints/B/loss"}, {"paths": ["joints/B/loss"]}):
        panel = md.plot(result, "curves", **of)
        assert [own.get_gid() for own in panel.lines] == ["curve-joints/B/loss-B"]
    first, second = (
        {own.get_gid() for own in md.plot(result, "losses", **of).get_children()}
        for of in ({"of": ["B"]}, {"joints": ["B"]})
    )
    assert first == second
    with pytest.raises(md.InputError, match="joints is for losses, not for curves"):
        md.plot(result, "curves", joints=["B"])
    with pytest.raises(md.InputError, match="twice"):
        md.plot(result, "curves", of="joints/B/loss", paths=["joints/B/loss"])
    with pytest.raises(
        md.InputError, match="pose is for diagram, groups, plans, loops, not for curves"
    ):
        md.plot(result, "curves", pose=1)
    with pytest.raises(md.UnknownName) as told:
        md.plot(result, "curves", agianst="time")
    assert "against" in told.value.hint


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "map.toml"
    path.write_text(library.find("slider-crank").read_text() + STUDY)
    return path


def test_a_study_is_drawn_as_its_map(file: Path) -> None:
    panel = md.plot(md.solve(md.load(file), "map"))
    values = next(own for own in panel.lines if own.get_gid().startswith("curve-stroke"))
    assert values.get_ydata() == pytest.approx([200.0, 300.0, 400.0])  # stroke 2 r, in mm
    assert Plane.__module__ in PICTURES["map"].module


def test_the_command_takes_every_option(file: Path, capsys, tmp_path: Path) -> None:
    words = ["plot", "four-bar-crank-rocker", "--out", str(tmp_path)]
    more = ["--kind", "curves", "--of", "bodies/rocker", "--against", "bodies/coupler"]
    code, said, err = run(capsys, *words, *more, "--no-extremes")
    assert (code, err) == (0, "")
    svg = Path(said.strip()).read_text()
    assert 'id="curve-bodies/rocker/angle-rocker"' in svg
    assert "extreme-" not in svg
    code, said, err = run(capsys, *words, "--no-traces", "--ghosts", "2")
    assert (code, err) == (0, "")
    svg = Path(said.strip()).read_text()
    assert 'id="trace-' not in svg
    assert svg.count('id="ghost"') == 2 * 5  # crank, rocker, three sides of the coupler
    code, said, err = run(capsys, *words, "--against", "bodies/coupler")  # only curves have it
    assert (code, err) == (0, "")
    assert said.strip().endswith("-curves-against-bodies-coupler.svg")
    code, said, err = run(capsys, *words, "--against", "bodies/coupler", "--kind", "diagram")
    assert (code, said) == (2, "")
    assert "--against is for curves, not for diagram" in err


def test_nothing_is_solved_twice(file: Path, capsys, tmp_path: Path, monkeypatch) -> None:
    count: list[str] = []
    inside: list[str] = []

    def counted(real):
        def run(problem, name, *given, **options):
            if not inside:  # sets of a study and designs that are verified are part of their task
                count.append(name)
            inside.append(name)
            try:
                return real(problem, name, *given, **options)
            finally:
                inside.pop()

        return run

    for kind in KINDS.values():
        module, name = kind.run.split(":")
        home = importlib.import_module(module)
        monkeypatch.setattr(home, name, counted(getattr(home, name)))
    out = ["--out", str(tmp_path)]
    text = library.find("gorshkov-seven-link").read_text()
    press = tmp_path / "press.toml"
    press.write_text(text.replace("[tasks.pose]\n", '[tasks.pose]\noutputs = ["slider.C"]\n'))
    design = ["rocker-50-1-15", "--task", "design"]
    for words, solved in (
        ([str(file), "--task", "map"], ["map"]),
        ([str(file), "--task", "turn"], ["turn"]),
        ([str(press), "--task", "pose"], ["pose"]),
        (["geared-five-bar", "--task", "turns", "--kind", "curves"], ["turns"]),
        ([*design, "--kind", "census"], ["design"]),
        ([*design, "--kind", "design"], ["design", "path"]),  # a design is a problem of its own
    ):
        count.clear()
        code, _, err = run(capsys, "plot", *words, *out)
        assert (code, err) == (0, ""), words
        assert count == solved, words

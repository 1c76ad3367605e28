"""The task and the kind of picture that show what is asked for; names of files; problems drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

import mechdae as md
from mechdae.describe.file import library
from mechdae.draw import catalogue
from mechdae.draw.catalogue import PICTURES, kind_and_task
from tests.shared.command import run

CHOSEN = (
    ("four-stroke-engine", "curves", {"polar": True}, ("curves", "cycle")),
    ("four-stroke-engine", "plans", {"which": "force"}, ("plans", "cycle")),
    ("four-stroke-engine", None, {"polar": True}, ("curves", "cycle")),
    ("four-stroke-engine", "curves", {"of": ["efforts_static"]}, ("curves", "shares")),
    ("four-stroke-engine", "losses", {}, ("losses", "cycle")),  # not the one without friction
    ("four-stroke-engine", "curves", {"of": ["bodies/rod/angle"]}, ("curves", "turns")),
    ("scotch-yoke-jam", "curves", {}, ("curves", "cycle")),  # where it jams, over the whole turn
    ("toggle-press", "curves", {}, ("curves", "cycle")),
    ("geared-five-bar-97-13", "coupler", {}, ("coupler", "turns")),  # no three poses
    ("cusp-coupler", "coupler", {}, ("coupler", "turn")),
    ("gorshkov-seven-link", "curves", {}, ("curves", "window")),
    ("gorshkov-seven-link", None, {}, ("diagram", "pose")),
    ("double-pendulum", None, {"shape": 1}, ("animation", "rest")),
)


@pytest.mark.parametrize(("name", "kind", "asked", "meant"), CHOSEN)
def test_what_suits(name: str, kind: str | None, asked: Any, meant: tuple[str, str]) -> None:
    assert kind_and_task(md.load(name).tasks, kind, None, asked, name) == meant


def unsuited(names: list[str]) -> list[str]:
    """Return pictures whose task cannot show what is asked though another one of them could."""
    found = []
    for name in names:
        tasks = md.load(name).tasks
        for kind, picture in PICTURES.items():
            suits = [own for own in tasks if set(tasks[own].holds) & set(picture.of)]
            forces = [own for own in suits if tasks[own].kind == "reactions"]
            for asked in ({}, {"polar": True}, {"which": "force"}):
                if not suits or not set(asked) <= set(picture.options):
                    continue
                _, own = kind_and_task(tasks, kind, None, asked, name)
                best = max(tasks[k].way for k in (forces if asked and forces else suits))
                if own not in suits or (asked and forces and own not in forces):
                    found.append(f"{name} {kind} {asked}: {own}")
                elif "path" in picture.of and kind != "losses" and tasks[own].way < best:
                    found.append(f"{name} {kind} {asked}: {own} of few poses")
    return found


SAMPLE = library.names()[::4]


def test_no_picture_is_of_a_task_that_cannot_show_it(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not unsuited(SAMPLE)
    monkeypatch.setattr(catalogue, "_kinds", lambda *_: ())  # planted: options do not count
    assert unsuited(["four-stroke-engine"])


def test_problems_names_and_files_are_drawn(tmp_path: Path) -> None:
    problem = md.load("slider-crank-friction")
    file = tmp_path / "own.toml"
    md.dump(problem, file)
    for own in (problem, "slider-crank-friction", file):
        assert md.plot(own, "losses", of=["B"]) is not None
        assert md.plot(own, "diagram", task="cycle", pose=3) is not None
    with pytest.raises(md.InputError, match="synthesis"):
        md.plot(problem, "design")
    plt.close("all")


def test_two_pictures_have_two_names(capsys: Any, tmp_path: Path) -> None:
    words = ["plot", "slider-crank", "--kind", "curves", "--out", str(tmp_path)]
    for of in ("bodies/rod/angle", "joints/guide/slide"):
        assert run(capsys, *words, "--of", of)[0] == 0
    assert len(list(tmp_path.iterdir())) == 2
    file = tmp_path / "deep" / "own.png"
    code, said, _ = run(capsys, "plot", "slider-crank", "--out", str(file))
    assert (code, said.strip()) == (0, str(file))
    assert file.read_bytes()[:4] == b"\x89PNG"
    code, _, err = run(capsys, "plot", "slider-crank", "--out", str(file), "--format", "svg")
    assert code == 2
    assert "--format says svg" in err

"""What commands print on a terminal of 80 columns: nothing wider, statuses and errors in colour."""

from __future__ import annotations

import contextlib
import dataclasses
import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

import mechdae as md
from mechdae.cli import COMMANDS, main
from mechdae.cli.terminal import fitted
from tests.shared.paths import ROOT

WIDTH = 80
CODES = re.compile(r"\x1b\[[0-9;]*[mK]")
URL_OR_PATH = re.compile(r"\S{20,}")
"""What is not broken: a path, an address, a structural formula of one word."""
ALWAYS = [
    ["solve", "four-bar-crank-rocker", "--poses", "30"],
    ["solve", "no-such-problem"],
    ["list"],
]
MORE = [
    ["--help"],
    ["show", "hexapod"],
    ["check", "four-bar-crank-rocker", "hexapod"],
    ["solve", "hexapod"],
    ["solve", "gorshkov-seven-link"],
    ["solve", "engine-run-up"],
    ["solve", "slider-crank-friction"],
    ["solve", "five-rod-suspension"],
    ["study", "four-bar-crank-rocker", "--vary", "a_mm=30:45:4",
     "--of", "points/coupler.P/position", "summary/swing/rocker"],
    ["sensitivity", "four-bar-crank-rocker", "--of", "points/coupler.P/position", "--wrt", "a",
     "b", "c", "d"],
    ["synthesize", "c1-line6-free", "--starts", "4"],
    ["explain", "slider-crank-friction", "--pose", "30"],
    ["rank", "four-bar-crank-rocker", "--by", "inversion"],
    ["variants", "four-bar-crank-rocker", "--by", "inversion"],
    ["chains", "--links", "6"],
    ["modules"],
    ["cache"],
    ["plot", "four-bar-crank-rocker", "--kind", "nothing"],
    ["solve", "elliptic-trammel"],
    ["solve", "toggle-clamp", "--task", "close"],
    ["solve", "play.toml"],
    ["export", "slider-crank-friction", "--format", "svg-cut", "--out", "cut.svg"],
    ["edit", "--out", "editor.html"],
    ["certify", "four-bar-crank-rocker", "--task", "turn", "--out", "turn.json"],
    ["assign", "four-bar-crank-rocker", "--vary", "a_mm=30:40", "--count", "1", "--out", "class"],
]  # fmt: skip
PLAY = """
[tasks.play]
kind = "play"
poses = 37
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360, speed_rpm = 60 }
"""
"""A task of clearances, in the folder of each command."""


def on_terminal(words: list[str], folder: Path, **environment: str) -> str:
    """Return what a command prints on a terminal of 80 columns."""
    control, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, WIDTH, 0, 0))
    given = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
    given |= {"TERM": "xterm", "PYTHONPATH": str(ROOT), **environment}
    given.pop("COLUMNS", None)
    with subprocess.Popen(
        [sys.executable, "-m", "mechdae", *words],
        stdin=terminal, stdout=terminal, stderr=terminal, cwd=folder, env=given,
    ) as process:  # fmt: skip
        os.close(terminal)
        found = b""
        with contextlib.suppress(OSError):  # the end of a terminal
            while part := os.read(control, 65536):
                found += part
        process.wait()
    os.close(control)
    return found.decode().replace("\r\n", "\n")


def too_wide(text: str) -> list[str]:
    lines = [CODES.sub("", part) for line in text.split("\n") for part in line.split("\r")]
    return [
        line for line in lines if len(line) > WIDTH and not URL_OR_PATH.search(line[WIDTH - 20 :])
    ]


@pytest.mark.parametrize("words", ALWAYS, ids=" ".join)
def test_nothing_is_wider_than_the_terminal(words: list[str], tmp_path: Path) -> None:
    text = on_terminal(words, tmp_path)
    assert len(text) > 40
    assert too_wide(text) == []


@pytest.mark.slow
@pytest.mark.parametrize("words", MORE, ids=" ".join)
def test_no_command_is_wider_than_the_terminal(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "play.toml").write_text(
        md.new("four-bar-crank-rocker").replace('"coupler.B"]', '"coupler.B"], clearance_mm = 0.02')
        + PLAY
    )
    text = on_terminal(words, tmp_path)
    assert text.strip()
    assert "Traceback" not in text
    assert too_wide(text) == []


@pytest.mark.parametrize("name", COMMANDS.whole())
def test_no_help_is_wider_than_the_terminal(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    assert main([name, "--help"]) == 0
    text = capsys.readouterr().out
    assert "options:" in text
    assert too_wide(text) == []


def test_statuses_and_errors_are_in_colour(tmp_path: Path) -> None:
    words = ["solve", "four-bar-crank-rocker", "--task", "turn", "--poses", "3", "--set", "a_mm=70"]
    shown = on_terminal(words, tmp_path)
    assert "\033[31munassembled\033[0m" in shown or "\033[33mlimit\033[0m" in shown
    assert "\033[31mmechdae:" in shown
    assert "\033[" not in on_terminal(words, tmp_path, NO_COLOR="1")
    assert "\033[" not in on_terminal(words, tmp_path, TERM="dumb")


def test_what_programs_read_is_not_folded(tmp_path: Path) -> None:
    lines = on_terminal(["list", "--json"], tmp_path).split("\n")
    assert max(map(len, lines)) > 1000


def test_lines_are_broken_at_spaces() -> None:
    assert fitted("  key       some words", 80) == "  key       some words"
    assert (
        fitted("  key       " + "word " * 20, 40).split("\n")[1] == " " * 12 + "word " * 4 + "word"
    )
    path = "/a/folder/" + "b" * 90
    assert path in fitted(f"written: {path}", 40)


# -- columns -----------------------------------------------------------------------------------


def test_columns_are_chosen_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["solve", "four-bar-crank-rocker", "--task", "turn", "--poses", "3"]
    assert main([*words, "--columns", "coupler.P.velocity.x, rocker"]) == 0
    head = capsys.readouterr().out.splitlines()[1]
    assert re.split(r" {2,}", head.strip()) == [
        "status", "crank.angle [deg]", "coupler.P.velocity.x [mm/s]", "rocker [deg]",
        "rocker [rad/s]",
    ]  # fmt: skip
    assert main([*words, "--columns", "coupler.P.velocity.x,", "rocker"]) == 0
    assert capsys.readouterr().out.splitlines()[1] == head
    assert main([*words, "--columns", "coupler.P.velocty"]) == 2
    assert "did you mean coupler.P.velocity" in capsys.readouterr().err


def test_a_result_prints_chosen_columns() -> None:
    found = md.solve("slider-crank-friction", "cycle", poses=3)
    head, row = found.table(columns=["effort"]).splitlines()[1:3]
    assert head.split() == ["status", "crank.angle", "[deg]", "effort", "[N", "m]"]
    assert float(row.split()[-1]) == pytest.approx(found.efforts["crank.angle"][0], rel=1e-5)
    assert found.table() == str(found)
    with pytest.raises(md.UnknownName, match="did you mean effort"):
        found.table("efort")
    assert dict(found.table) == {}


def test_what_a_task_lists_comes_first() -> None:
    problem = md.load("hexapod")
    task = problem.tasks["inverse"]
    legs = [f"leg{k}" for k in range(1, 7)]
    listed = md.solve(
        problem.with_task("inverse", dataclasses.replace(task, outputs=legs)), "inverse"
    )
    text = listed.table(width=80)
    assert max(map(len, text.partition("  formula")[0].splitlines()[1:])) <= WIDTH
    for name in [*legs, *(driver.coordinate.partition(".")[0] for driver in task.all_drivers)]:
        assert f" {name}." in text.partition("formula")[0], name
    motion = md.solve("engine-run-up").table()
    assert "crank [rad/s]" in motion.splitlines()[1]


# -- tables of other packages ------------------------------------------------------------------


def test_a_frame_goes_along_the_driver_or_time() -> None:
    pytest.importorskip("pandas")
    sweep = md.solve("four-bar-crank-rocker", "turn", poses=5)
    frame = sweep.frame()
    assert frame.index.name == "crank.angle [rad]"
    assert frame.index.to_list() == sweep.drivers["crank.angle"].position.tolist()
    assert sweep.in_units("deg").frame().index[-1] == pytest.approx(360.0)
    motion = md.solve("double-pendulum")
    assert motion.frame().index.name == "time [s]"
    assert motion.frame().index.to_list() == motion.time.tolist()
    assert md.solve("four-bar-crank-rocker", "modes").frame().index.to_list() == [0, 1]


def test_a_dataset_has_the_driver_as_its_dimension() -> None:
    pytest.importorskip("xarray", reason="xarray is not installed")
    sweep = md.solve("four-bar-crank-rocker", "turn", poses=361)
    data = sweep.to_xarray()
    x = data["coupler.P.position.x"]
    assert x.attrs["units"] == "m"
    assert x.dims == ("crank.angle",)
    there = x.sel({"crank.angle": 1.57}, method="nearest")
    assert float(there) == sweep.points["coupler.P"].position[90, 0]

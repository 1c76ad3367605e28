"""Another package adds a command, a task, a picture and a format, as CONTRIBUTING.md says."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.shared.paths import ROOT

GUEST = {
    "adds": """
from mechdae.additions import Added, TaskKind
ADDS = {
    "commands": {"greet": Added("guest.greet", after="plot", about="says hello")},
    "pictures": {"dots": Added("guest.dots:DOTS")},
    "tasks": {"extremes": TaskKind("guest.extremes:Extremes", run="guest.extremes:extremes")},
    "formats": {"names": Added("guest.names:names", about="names of the bodies")},
}
""",
    "greet": """
def arguments(parser):
    parser.add_argument("name")
def run(options):
    print("hello", options.name)
    return 0
""",
    "dots": """
from mechdae.draw.catalogue import Picture
DOTS = Picture("guest.dots", "dots", of=("poses",))
def draw(result, ax=None):
    return f"dots of {result.problem}"
""",
    "extremes": """
from dataclasses import replace
from typing import ClassVar
from mechdae.describe.tasks.kinds import Sweep
from mechdae.motion.kinematics.sweep import sweep
from mechdae.records import dataclass
@dataclass(frozen=True)
class Extremes(Sweep):
    kind: ClassVar[str] = "extremes"
def extremes(problem, name, task):
    return sweep(problem, name, replace(task, measures=("extremes",)))
""",
    "names": """
def names(motion):
    return {"": " ".join(motion.problem.mechanism.bodies)}
""",
}
"""Module -> its text."""
TASK = """
[tasks.far]
kind = "extremes"
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360 }
poses = 8
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the installed guest, and a problem with its task."""
    folder = tmp_path_factory.mktemp("guest")
    info = folder / "guest-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: guest\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[mechdae.parts]\nguest = guest.adds:ADDS\n")
    (folder / "guest").mkdir()
    for name, text in {"__init__": "", **GUEST}.items():
        (folder / "guest" / f"{name}.py").write_text(text)
    yoke = (ROOT / "problems/scotch-yoke.toml").read_text(encoding="utf-8")
    (folder / "yoke.toml").write_text(yoke.split("[[expected]]")[0] + TASK)
    return folder


def said(place: Path, *words: str) -> str:
    """Return what Python prints beside the guest, of a command of `mechdae` or with ``-c``."""
    command = [sys.executable, *(() if words[0] == "-c" else ("-m", "mechdae")), *words]
    paths = {**os.environ, "PYTHONPATH": f"{place}:{ROOT}"}
    done = subprocess.run(command, capture_output=True, text=True, env=paths, cwd=place)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_command(place: Path) -> None:
    lines = [line.split()[0] for line in said(place, "--help").splitlines() if line[:4] == " " * 4]
    assert lines.index("greet") == lines.index("plot") + 1
    assert said(place, "greet", "you") == "hello you\n"


def test_a_picture(place: Path) -> None:
    code = "import mechdae as md; print(md.plot(md.solve('slider-crank', 'turn'), 'dots'))"
    assert said(place, "-c", code) == "dots of slider-crank\n"


def test_a_task(place: Path) -> None:
    """From its file: solved, as JSON and as the table of poses, shown, checked."""
    result = json.loads(said(place, "solve", "yoke.toml", "--task", "far", "--json"))
    extremes = result["tasks"]["far"]["summary"]["extremes"]["guide.slide"]
    assert extremes["min"]["value"] == pytest.approx(-0.05, abs=1e-12)  # -r, between two poses
    assert extremes["max"]["value"] == pytest.approx(0.05, abs=1e-12)
    table = said(place, "solve", "yoke.toml", "--task", "far")
    assert table.startswith("yoke / far (extremes)")
    assert table.count("        ok  ") == 8
    assert "far: extremes" in said(place, "show", "yoke.toml")
    assert "valid" in said(place, "check", "yoke.toml")


def test_a_format(place: Path) -> None:
    said(place, "export", "yoke.toml", "--task", "turn", "--format", "names", "--out", "it.txt")
    assert (place / "it.txt").read_text().split() == ["crank", "yoke"]

"""What type checkers of users see: every public name, the result of each task, their slips."""

from __future__ import annotations

import dataclasses
import importlib.util
import inspect
import json
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

import mechdae
from mechdae.additions import at_home
from mechdae.tasks.dispatch.solve import KINDS
from tests.scripts import stub
from tests.shared.paths import ROOT

NAMES = [name for name in mechdae.__all__ if name[0] != "_"]
TASKS = {kind: at_home(KINDS[kind].home).__name__ for kind in KINDS}
OPEN, SHARE = 20, 0.95
"""At most so many public signatures hold `Any`, and what `pyright --verifytypes` knows at least."""
needs_pyright = pytest.mark.skipif(
    importlib.util.find_spec("pyright") is None,
    reason="pyright is not installed: pip install pyright, which fetches itself by Node.js",
)
HEAD = """import mechdae as md

mechanism = md.Mechanism(
    ground=md.Ground(points={"A": [0, 0]}),
    bodies=[md.Body("crank", points={"A": (0, 0), "B": ["2*a", 0.1]})],
    joints=[md.Revolute("A", "ground.A", "crank.A")],
    parameters={"a": 1},
    sketch={"crank": 0.7},
)
driver = md.Driver("crank.angle", at=[0, "pi/2"])
sweep = md.Sweep(driver=driver, outputs=["crank"])
"""
SLIPS = {
    "md.Mechanism(grond=md.Ground())": "grond",
    "md.Sweep(drivr=driver)": "drivr",
    'md.Revolute("A", "ground.A")': "second",
    'md.Driver(at=[1])': "coordinate",
    'md.solve(mechanism, sweep, poses="many")': "poses|solve",
    "md.solve(mechanism, sweep, pose=3)": "pose|solve",
    'md.Prismatic("P", "a.A", "b.B", axis=[1, 0])': "axis",
    'md.page("four-bar", unit="mm")': "unit",
    'md.Body("rod", points=[1, 2])': "points",
    "sweep.poses = 9": "poses",
    "sweep.pose": "pose",
    'md.solve(mechanism, sweep).point["crank.B"]': "point",
}  # fmt: skip
"""A line with a mistake, and what a checker has to name."""


def written(folder: Path) -> tuple[Path, list[str]]:
    """Return a file that uses every name, every kind of task and every slip, and its lines."""
    lines = [*HEAD.splitlines(), *(f"reveal_type(md.{name})" for name in NAMES)]
    lines += ["def ask(" + ", ".join(f"{kind}: md.{name}" for kind, name in TASKS.items()) + "):"]
    lines[-1] = lines[-1].replace("):", ") -> None:")
    lines += [f"    reveal_type(md.solve(mechanism, {kind}))" for kind in TASKS]
    lines += list(SLIPS)
    path = folder / "use.py"
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path, lines


def check(lines: list[str], revealed: Mapping[int, str], wrong: Mapping[int, str]) -> None:
    """Compare what a checker says by line: types that are revealed, and mistakes."""
    results = stub.results()
    for number, line in enumerate(lines, 1):
        if line.startswith("reveal_type"):
            assert revealed[number] not in ("Any", "Unknown"), line
        elif "reveal_type" in line:
            kind = line.removesuffix("))").rpartition(" ")[2]
            assert revealed[number].endswith(results[TASKS[kind]]), (line, revealed[number])
        if line in SLIPS:
            assert re.search(SLIPS[line], wrong.get(number, "")), f"not found: {line}"
        else:
            assert number not in wrong, (line, wrong[number])


def test_the_stub_is_what_the_table_gives() -> None:
    assert stub.main(["--check"]) == 0, "python -m tests.scripts.stub writes it"


def test_mypy_sees_names_results_and_slips(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    words = [sys.executable, "-m", "mypy", "--no-pretty", "--no-error-summary", str(path)]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)  # strict, as there
    said = [re.match(r"[^:]*use\.py:(\d+): (\w+): (.*)", line) for line in done.stdout.splitlines()]
    found = [(int(m[1]), m[2], m[3]) for m in said if m]
    assert found, done.stdout + done.stderr
    revealed = {n: text.split('"')[1] for n, word, text in found if text.startswith("Revealed")}
    wrong: dict[int, str] = {}
    for number, word, text in found:
        if word == "error":
            wrong[number] = f"{wrong.get(number, '')} {text}"
    check(lines, revealed, wrong)


@pytest.mark.slow
@needs_pyright
def test_pyright_sees_names_results_and_slips(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    words = [sys.executable, "-m", "pyright", "--pythonpath", sys.executable, str(path)]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
    pattern = re.compile(r"use\.py:(\d+):\d+ - (\w+): (.*)")
    found = [(int(m[1]), m[2], m[3]) for m in map(pattern.search, done.stdout.splitlines()) if m]
    assert found, done.stdout + done.stderr
    notes = [(n, text) for n, word, text in found if word == "information"]
    revealed = {n: text.rpartition(' is "')[2].rstrip('"') for n, text in notes}
    wrong = {n: text for n, word, text in found if word in ("error", "warning")}
    check(lines, revealed, wrong)


def signatures() -> dict[str, list[str]]:
    """Return the annotations of public functions, methods and fields."""
    found: dict[str, list[str]] = {}
    for name in NAMES:
        thing = getattr(mechdae, name)
        called = {name: thing} if inspect.isfunction(thing) else {}
        if inspect.isclass(thing):
            held = {
                f"{name}.{word}": value for word, value in vars(thing).items() if word[0] != "_"
            }
            called = {word: value for word, value in held.items() if inspect.isfunction(value)}
            noted = vars(thing).get("__annotations__", {})
            for entry in dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ():
                if entry.name in noted:
                    found[f"{name}.{entry.name}"] = [str(entry.type)]
        for word, function in called.items():
            found[word] = [str(text) for text in function.__annotations__.values()]
    return found


def test_few_public_signatures_hold_any() -> None:
    nothing = re.compile(r"\b(Any|Graph|Sym)\b")
    held = [name for name, texts in signatures().items() if any(map(nothing.search, texts))]
    assert len(held) <= OPEN, held


@pytest.mark.slow
@needs_pyright
def test_pyright_knows_all_public_types() -> None:
    words = ["--verifytypes", "mechdae", "--ignoreexternal", "--outputjson"]
    done = subprocess.run(
        [sys.executable, "-m", "pyright", *words], capture_output=True, text=True, cwd=ROOT
    )
    found = json.loads(done.stdout)["typeCompleteness"]
    public = {f"mechdae.{name}" for name in NAMES}
    known = {s["name"] for s in found["symbols"] if s["isTypeKnown"] and not s["isTypeAmbiguous"]}
    assert public <= known, public - known
    assert found["completenessScore"] >= SHARE

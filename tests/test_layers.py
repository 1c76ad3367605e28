"""Imports point one way only, and light commands stay light."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "mechdae"
# each room may import from itself and from the rooms named here
ROOMS = {
    "errors": set(),
    "describe": {"errors"},
    "model": {"describe", "errors"},
    "kernels": {"model", "describe", "errors"},
    "results": {"describe", "errors"},
    "export": {"results"},
    "tables": {"results"},
    "jobs": {"errors"},
    "analysis": {"kernels", "model", "describe", "results", "errors", "jobs"},
    "synthesis": {"analysis", "jobs", "kernels", "model", "describe", "results", "errors"},
    "draw": {"results", "describe", "errors"},
    "bench": {"analysis", "synthesis", "kernels", "model", "describe", "results", "errors"},
    "cli": {
        *("analysis", "bench", "describe", "draw", "errors", "export", "jobs", "results"),
        *("synthesis", "tables"),
    },
}


def room(module: str) -> str:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found


def module_of(path: Path) -> str:
    return ".".join(("mechdae", *path.relative_to(PACKAGE).with_suffix("").parts))


FILES = [p for p in sorted(PACKAGE.rglob("*.py")) if p.parent != PACKAGE or p.stem[0] != "_"]


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_point_to_the_left(path: Path) -> None:
    here = room(module_of(path))
    for name in imports(path):
        if name.startswith("mechdae."):
            there = room(name)
            if there.startswith("__"):
                continue
            assert there == here or there in ROOMS[here], f"{here} must not import {there}"


def test_the_description_knows_no_numerics() -> None:
    for path in (PACKAGE / "describe").glob("*.py"):
        used = {name.split(".")[0] for name in imports(path)}
        assert not used & {"casadi", "numpy", "matplotlib"}, path.name


def test_only_drawing_knows_matplotlib() -> None:
    for path in FILES:
        if "matplotlib" in {name.split(".")[0] for name in imports(path)}:
            assert room(module_of(path)) == "draw", path


def loaded(code: str) -> set[str]:
    script = f"{code}\nimport sys; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return {name.split(".")[0] for name in done.stdout.splitlines()[-1].split()}


@pytest.mark.parametrize(
    "code",
    ["import mechdae", "from mechdae.cli import main; main(['list', '--json'])"],
    ids=["import", "list"],
)
def test_light_commands_load_no_numerics(code: str) -> None:
    assert not loaded(code) & {"casadi", "matplotlib", "numpy"}


def test_solving_loads_no_drawing() -> None:
    code = "import mechdae as md; md.solve('slider-crank', 'modes')"
    assert "matplotlib" not in loaded(code)

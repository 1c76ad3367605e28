"""The tests' own house: no test imports another, and references owe the package nothing."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import pytest

from tests.shared.paths import ROOT
from tests.shared.slow import SLOW

TESTS = ROOT / "tests"
FOLDERS = ("attack", "data", "house", "reference", "scripts", "shared")
"""Folders that are not named after a room of the package."""
MAY = {
    "dense_forces": "reads results",
    "force_audit": "reads results",
    "synthesis_verdicts": "reads results",
    "three_legs": "writes what it drew as a mechanism",
    "truth/case": "writes what it drew as a mechanism",
    "truth/judging": "solves and compares",
    "truth/modes": "solves and compares",
}
"""References that import the package, and what for."""


def imported(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


@pytest.mark.parametrize("folder", sorted(p.name for p in TESTS.iterdir() if p.is_dir()))
def test_no_test_imports_another(folder: str) -> None:
    for path in (TESTS / folder).rglob("*.py"):
        for name in imported(path):
            assert not any(part.startswith("test_") for part in name.split(".")), path


def test_references_owe_the_package_nothing() -> None:
    folder = TESTS / "reference"
    may = set()
    for path in folder.rglob("*.py"):
        name = path.relative_to(folder).with_suffix("").as_posix()
        rooms = {n.split(".")[1] for n in imported(path) if n.startswith("tests.") and "." in n}
        assert rooms <= {"reference", "shared"}, path
        if any(n.split(".")[0] == "mechdae" for n in imported(path)) and path.stem[:5] != "test_":
            may.add(name)
    assert may == set(MAY)


def test_folders_are_rooms() -> None:
    rooms = {path.stem for path in (ROOT / "mechdae").rglob("*") if "." not in path.stem}
    for path in TESTS.iterdir():
        if path.is_dir() and path.name != "__pycache__":
            assert path.name in rooms or path.name in FOLDERS, path.name
        else:
            assert path.name in ("__init__.py", "__pycache__", "conftest.py"), path.name


def test_tests_need_no_package_beyond_those_of_the_second_command() -> None:
    """What other extras bring is imported where a test skips without it; scripts may need more."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = {
        name: {own.partition(">")[0] for own in packages}
        for name, packages in project["optional-dependencies"].items()
    }
    beyond = set().union(*extras.values()) - extras["dev"]
    assert {"scipy", "pymoo", "mujoco"} <= beyond
    for path in TESTS.rglob("*.py"):
        if path.is_relative_to(TESTS / "scripts"):
            continue
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [alias.name for alias in getattr(node, "names", ())]
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            if isinstance(node, ast.Import | ast.ImportFrom):
                assert not beyond & {name.split(".")[0] for name in names}, path


def test_slow_files_are_there() -> None:
    for folder, (why, names) in SLOW.items():
        assert len(why) > 10
        for name in names.split():
            assert name == "*" or (TESTS / folder / f"test_{name}.py").exists(), (folder, name)


def top_level(path: Path) -> set[str]:
    """Return the packages that a module imports as soon as it is imported."""
    found = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.split(".")[0])
    return found


def test_what_only_some_install_is_imported_where_it_is_used() -> None:
    """The README's second command installs ``dev`` alone: all tests have to be collected."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needed = {
        extra: {re.split(r"[><=\[]", entry)[0].strip() for entry in entries}
        for extra, entries in project["optional-dependencies"].items()
    }
    rare = set().union(*needed.values()) - needed["dev"]
    assert {"playwright", "mujoco", "scipy"} <= rare
    for path in TESTS.rglob("*.py"):
        assert not top_level(path) & rare, path

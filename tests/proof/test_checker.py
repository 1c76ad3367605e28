"""The checker stands alone: it imports python-flint and the standard library, also as one text."""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from tests.shared.certified import certificate
from tests.shared.command import run
from tests.shared.paths import ROOT

pytest.importorskip("flint", reason="python-flint is not installed")
FOLDER = ROOT / "mechdae" / "parts" / "proof" / "checker"
TREES = {
    path.stem: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.py"))
}
ONE_OF_EACH = (
    *("slides", "folding", "rods", "rod", "modes", "contacts", "space", "spatial modes", "turns"),
)
"""Certificates of all kinds: with change points, redundant equations, curves, boxes."""
BLIND = "import sys; sys.modules['mechdae'] = None; sys.argv[1:] = {}; import runpy; {}"
"""A process in which the package cannot be imported."""


@pytest.mark.parametrize("name", TREES)
def test_it_imports_nothing_of_the_package(name: str) -> None:
    for node in ast.walk(TREES[name]):
        if isinstance(node, ast.Import):
            assert {alias.name.split(".")[0] for alias in node.names} <= sys.stdlib_module_names
        elif isinstance(node, ast.ImportFrom) and node.level:
            assert node.level == 1
            assert (node.module or "__init__") in TREES
        elif isinstance(node, ast.ImportFrom):
            assert node.module == "flint" or node.module in sys.stdlib_module_names | {
                "collections.abc"
            }


def test_it_is_in_the_style_of_the_package() -> None:
    for path in FOLDER.glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not any(word in text for word in ("# noqa", "# ruff", "# fmt")), path


def test_its_names_are_different_in_all_modules() -> None:
    """Otherwise they could not be joined to one text."""
    names = Counter[str]()
    for tree in TREES.values():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                names[node.name] += 1
            targets = node.targets if isinstance(node, ast.Assign) else []
            targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
            for target in targets:
                names.update(n.id for n in ast.walk(target) if isinstance(n, ast.Name))
    assert [name for name, count in names.items() if count > 1] == []


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return certificates, and last one that is altered."""
    folder, found = tmp_path_factory.mktemp("certificates"), []
    contents: dict[str, Any] = {word: certificate(word) for word in ONE_OF_EACH}
    contents["altered"] = contents["modes"] | {"modes": contents["modes"]["modes"][1:]}
    for word, content in contents.items():
        found.append(folder / f"{word}.json")
        found[-1].write_text(json.dumps(content), encoding="utf-8")
    return found


def verdicts(files: list[Path], code: str, folder: Path) -> tuple[int, list[str], str]:
    """Return exit code, lines and messages of a program that checks in a process of its own."""
    arguments = [str(file) for file in files]
    call = [sys.executable, "-I", "-c", BLIND.format(arguments, code)]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True)
    return done.returncode, done.stdout.splitlines(), done.stderr


def test_alone_it_says_the_same(files: list[Path], tmp_path: Path, capsys: Any) -> None:
    """The folder, copied elsewhere, and the text of the command, without the package."""
    from mechdae.parts.proof import check_certificate

    expected = [check_certificate(file) for file in files[:-1]]
    shutil.copytree(FOLDER, tmp_path / "elsewhere" / "checker")
    text = tmp_path / "check.py"
    assert run(capsys, "certify", "--checker", str(text))[:2] == (0, f"{text}\n")
    for code in (
        "sys.path.insert(0, 'elsewhere'); runpy.run_module('checker', run_name='__main__')",
        "runpy.run_path('check.py', run_name='__main__')",
    ):
        exit_code, lines, messages = verdicts(files, code, tmp_path)
        assert (exit_code, lines) == (1, expected), messages
        assert messages.startswith("refused: modes: 1 poses are left out")


def test_the_text_is_written_alone(capsys: Any, tmp_path: Path) -> None:
    file = str(tmp_path / "check.py")
    for words in (["rssr"], ["--check", "c.json"], ["--out", "c.json"], ["--task", "modes"]):
        assert run(capsys, "certify", "--checker", file, *words)[0] == 2
    assert run(capsys, "certify", "--checker", str(tmp_path))[0] == 2
    assert not list(tmp_path.iterdir())

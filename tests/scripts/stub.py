"""Writes `mechdae/__init__.pyi`: the names of the package for type checkers, from its own table.

``python -m tests.scripts.stub``, with ``--check`` it says whether the file is what that table and
the kinds of tasks give.
"""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import mechdae
from mechdae.additions import at_home
from mechdae.tasks.dispatch.solve import KINDS
from tests.shared.paths import ROOT

STUB = ROOT / "mechdae" / "__init__.pyi"
HEAD = '''"""Written by ``python -m tests.scripts.stub``: names, and what tasks give."""

'''
OVERLOADED = "mechdae.tasks.solve:solve"
"""What returns the class of results that belongs to the class of its task."""


def homes() -> dict[str, list[str]]:
    """Return the modules of the package's table with the names that are there."""
    table: dict[str, list[str]] = {}
    for name, module in mechdae._HOME.items():
        table.setdefault(module, []).append(name)
    return table


def results() -> dict[str, str]:
    """Return the class of each kind of task with that of its results, the narrowest first."""
    kinds = [KINDS[name] for name in KINDS]
    classes = {at_home(kind.home): inspect.signature(at_home(kind.run)) for kind in kinds}
    order = sorted(classes, key=lambda task: (-len(task.__mro__), task.__name__))
    return {task.__name__: str(classes[task].return_annotation) for task in order}


def overloads(home: str) -> tuple[list[str], str]:
    """Return the imports that its annotations need, and a function once for each kind of task."""
    module, _, name = home.partition(":")
    tree = ast.parse(Path(str(import_module(module).__file__)).read_text(encoding="utf-8"))
    function = next(n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == name)
    function.body, function.decorator_list = [ast.Expr(ast.Constant(...))], []
    used = {n.id for n in ast.walk(function) if isinstance(n, ast.Name)}
    needed = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            names = [alias.name for alias in node.names if alias.name in used]
            needed += [f"from {node.module} import {', '.join(names)}"] if names else []
    plain = ast.unparse(function)
    place = next(k for k, arg in enumerate(function.args.args) if arg.arg == "task")
    (default,) = function.args.defaults  # of the task alone
    made = []
    for task, result in results().items():
        function.args.args[place].annotation = ast.Name(task)
        function.args.defaults = []
        function.returns = ast.Name(result)
        made.append(f"@overload\n{ast.unparse(function)}")
    assert default
    return needed, "\n".join([*made, f"@overload\n{plain}"])


def text() -> str:
    """Return the stub."""
    needed, solve = overloads(OVERLOADED)
    skipped = OVERLOADED.partition(":")[2]
    lines = [
        f"from {module} import {', '.join(f'{name} as {name}' for name in names)}"
        for module, names in homes().items()
        if names != [skipped]
    ]
    names = " ".join(f'"{name}",' for name in mechdae.__all__)
    public = {name for known in homes().values() for name in known}
    extra = [line for line in needed if set(line.partition(" import ")[2].split(", ")) - public]
    head = [*extra, "from typing import overload", "", *lines, "", "__version__: str"]
    tables = ["PARTS: tuple[str, ...]", "CASES: dict[str, str]"]
    return "\n".join([HEAD, *head, *tables, f"__all__ = [{names}]", "", solve, ""])


def formatted(plain: str) -> str:
    """Return the text as the linter and the formatter of this repository leave it."""
    for words in (["check", "--fix", "-q", "--select", "I,F401,RUF022"], ["format"]):
        done = subprocess.run(
            [sys.executable, "-m", "ruff", *words, "--stdin-filename", str(STUB), "-"],
            input=plain, capture_output=True, text=True, check=True, cwd=ROOT,
        )  # fmt: skip
        plain = done.stdout
    return plain


def main(words: Sequence[str]) -> int:
    """Write the stub, or say whether it is what is written."""
    plain = formatted(text())
    if "--check" in words:
        return int(STUB.read_text(encoding="utf-8") != plain)
    STUB.write_text(plain, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Annotations say what is held: `Any` only falls, arrays typed by what they hold only rise."""

from __future__ import annotations

import ast
from functools import cache

from tests.shared.paths import ROOT

PACKAGE = ROOT / "mechdae"
BARE, ARRAYS = 1_943, 4_600
"""At most so often stands `Any`, at least so often the name of an array of `mechdae/types.py`."""
SAYS_NOTHING, BINDINGS = ("own", "told", "asked", "kept", "laid"), 120
"""Names that are any thing's, and at most so often variables and arguments are called so."""


@cache
def names() -> dict[str, int]:
    """Return how often each name is read in the package, its module of names aside."""
    counts: dict[str, int] = {}
    for path in PACKAGE.rglob("*.py"):
        if path != PACKAGE / "types.py":
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Name):
                    counts[node.id] = counts.get(node.id, 0) + 1
    return counts


def arrays() -> set[str]:
    tree = ast.parse((PACKAGE / "types.py").read_text(encoding="utf-8"))
    return {
        ast.unparse(node.targets[0])
        for node in tree.body
        if isinstance(node, ast.Assign) and "NDArray" in ast.unparse(node.value)
    }


def test_variables_are_called_what_they_are() -> None:
    count = 0
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            argument = isinstance(node, ast.arg) and node.arg in SAYS_NOTHING
            stored = isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)
            count += argument or (stored and node.id in SAYS_NOTHING)
    assert count <= BINDINGS


def test_few_annotations_say_nothing() -> None:
    assert names()["Any"] <= BARE


def test_arrays_are_typed_by_what_they_hold() -> None:
    assert sum(names().get(name, 0) for name in arrays()) >= ARRAYS


def test_names_of_arrays_are_used() -> None:
    assert not {name for name in arrays() if name not in names()}

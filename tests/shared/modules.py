"""Modules of the package as their sources say them: what each imports."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

from tests.shared.paths import ROOT

PACKAGE = ROOT / "mechdae"


def for_type_checkers(tree: ast.Module) -> set[ast.AST]:
    return {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports(path: Path, strings: bool = True, typed: bool = False) -> set[str]:
    """Return what a module imports, and the modules it names in strings to import them later."""
    found = set()
    tree = parsed(path)
    unused = set() if typed else for_type_checkers(tree)
    for node in ast.walk(tree):
        if node in unused:
            continue
        if strings and isinstance(node, ast.Constant) and isinstance(node.value, str):
            found |= set(re.findall(r"^(mechdae(?:\.\w+)+)(?::\w+)?$", node.value))
        elif isinstance(node, ast.ImportFrom):
            inside = module_of(path).split(".")[: -node.level] if node.level else []
            module = ".".join([*inside, *filter(None, [node.module])])
            found |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found


def module_of(path: Path) -> str:
    return ".".join(("mechdae", *path.relative_to(PACKAGE).with_suffix("").parts))

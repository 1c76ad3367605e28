"""The checker as one text: its modules one behind the other, to be kept and run by itself."""

from __future__ import annotations

import ast
from pathlib import Path

FOLDER = Path(__file__).parent / "checker"
HEAD = '''"""Checks certificates of mechdae in ball arithmetic: python FILE CERTIFICATE...

Joined from the modules of mechdae.parts.proof.checker; needs python-flint alone.
"""
'''


def checker_text() -> str:
    """Return the modules of the checker, each behind those that it imports, as one program.

    Imports of the standard library and of python-flint stand once, at the top.
    """
    imported: dict[str, set[str]] = {"": set()}
    texts: dict[str, str] = {}
    for name in ("__init__", "__main__"):
        _add(name, imported, texts)
    lines = [f"import {name}" for name in sorted(imported.pop(""))]
    lines += [
        f"from {module} import {', '.join(sorted(names))}"
        for module, names in sorted(imported.items())
        if module != "__future__"
    ]
    head = [HEAD, "from __future__ import annotations\n", *lines]
    return "\n".join([*head, *texts.values()])


def _add(name: str, imported: dict[str, set[str]], texts: dict[str, str]) -> None:
    """Add the text of a module without its imports, behind those of modules it imports."""
    if name in texts:
        return
    source = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    lines, (head, *body) = source.splitlines(), ast.parse(source).body
    cut = {*range(head.lineno, (head.end_lineno or 0) + 1)}
    for node in body:
        if not isinstance(node, ast.Import | ast.ImportFrom):
            continue
        cut |= {*range(node.lineno, (node.end_lineno or 0) + 1)}
        names = {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom) and node.level:
            for module in [node.module] if node.module else ["__init__"]:
                _add(module, imported, texts)
        else:
            module = node.module or "" if isinstance(node, ast.ImportFrom) else ""
            imported.setdefault(module, set()).update(names)
    rest = "\n".join(line for k, line in enumerate(lines, 1) if k not in cut)
    texts[name] = f"\n\n# -- {name.strip('_')} --\n\n{rest.strip()}\n"

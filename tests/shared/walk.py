"""The way of a computation through the package: which files it enters, how much of them it runs.

``python -m tests.shared.walk`` prints the figures of a planar four-bar, from its file to a table.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

PACKAGE = Path(__file__).resolve().parents[2] / "mechdae"
ALONE = "errors, records, types, additions"
"""The modules that stand alone, above all rooms: one storey of the map."""
POSE = ["solve", "four-bar-crank-rocker", "--task", "turn", "--poses", "2"]


def statements(path: Path) -> set[int]:
    """Return the first lines of the statements inside of the functions of a file."""
    found: set[int] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        for inner in ast.walk(node):
            docstring = isinstance(inner, ast.Expr) and isinstance(inner.value, ast.Constant)
            if isinstance(inner, ast.stmt) and inner is not node and not docstring:
                found.add(inner.lineno)
    return found


def walked(run: Callable[[], object]) -> dict[str, Any]:
    """Return what a call runs of the package.

    ``files`` in the order of their first call, ``rooms``, ``changes`` of file from one call to
    the next, ``run`` statements of functions and ``share`` of those in the files.
    """
    lines: dict[str, set[int]] = {}
    order: list[str] = []
    last, changes = "", 0
    start = str(PACKAGE)

    def trace(frame: FrameType, event: str, _: object) -> Any:
        nonlocal last, changes
        file = frame.f_code.co_filename
        if not file.startswith(start) or frame.f_code.co_name == "<module>":
            return None
        if file != last:
            last, changes = file, changes + 1
        if file not in lines:
            lines[file] = set()
            order.append(file)
        seen = lines[file]

        def step(inner: FrameType, what: str, _: object) -> Any:
            if what == "line":
                seen.add(inner.f_lineno)
            return step

        return step

    sys.settrace(trace)
    try:
        run()
    finally:
        sys.settrace(None)
    known = {file: statements(Path(file)) for file in order}
    done = {file: lines[file] & known[file] for file in order}
    entered = [file for file in order if done[file]]
    names = [Path(file).relative_to(PACKAGE).as_posix() for file in entered]
    ran, all_ = (sum(len(part[file]) for file in entered) for part in (done, known))
    return {
        "files": names,
        "rooms": sorted({name.split("/")[0] if "/" in name else ALONE for name in names}),
        "changes": changes,
        "run": ran,
        "share": ran / all_,
    }


def four_bar() -> dict[str, Any]:
    """Return the way of a pose of a planar four-bar, in a process that has built nothing.

    It takes the back end that there is on every machine.
    """
    code = (
        "import json, io, contextlib\n"
        "from tests.shared.walk import POSE, walked\n"
        "from mechdae.cli import main\n"
        "import casadi, numpy\n"
        "with contextlib.redirect_stdout(io.StringIO()):\n"
        "    found = walked(lambda: main(POSE))\n"
        "print(json.dumps(found))"
    )
    root = PACKAGE.parent
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True,
        env={"PATH": "/usr/bin:/bin", "MECHDAE_CACHE": "0", "MECHDAE_BACKEND": "numpy",
             "PYTHONPATH": str(root)},
    )  # fmt: skip
    found: dict[str, Any] = json.loads(done.stdout)
    return found


if __name__ == "__main__":
    way = four_bar()
    print("\n".join(way["files"]))
    print({name: value for name, value in way.items() if name != "files"}, len(way["files"]))

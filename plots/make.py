"""Draws the gallery: every script of this folder with a ``figure()`` function becomes an SVG.

Usage: ``python plots/make.py [NAME...]`` writes ``plots/<name>.svg`` (all without names);
``python plots/make.py --check`` draws nothing and lists what does not belong together.
"""

from __future__ import annotations

import argparse
import ast
import importlib.util
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from mechdae.draw import save

FOLDER = Path(__file__).resolve().parent


def scripts(folder: Path = FOLDER) -> list[Path]:
    """Return the scripts that define ``figure()``, sorted; none of them is executed."""
    return [path for path in sorted(folder.glob("*.py")) if _defines_figure(path)]


def _defines_figure(path: Path) -> bool:
    tree = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
    return any(isinstance(node, ast.FunctionDef) and node.name == "figure" for node in tree.body)


def figure_of(path: Path) -> Callable[[], Figure]:
    """Return the ``figure`` function of a script."""
    spec = importlib.util.spec_from_file_location(f"plots_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    function: Callable[[], Figure] = module.figure
    return function


def make(path: Path, folder: Path = FOLDER) -> Path:
    """Draw one script and return the SVG written into `folder`."""
    return save(figure_of(path)(), folder / f"{path.stem}.svg")


def unmatched(folder: Path = FOLDER) -> list[str]:
    """Return a line for each script without an SVG and each SVG without a script."""
    drawn = {path.stem for path in folder.glob("*.svg")}
    written = {path.stem for path in scripts(folder)}
    return [
        *(f"{name}.py has no {name}.svg" for name in sorted(written - drawn)),
        *(f"{name}.svg has no {name}.py" for name in sorted(drawn - written)),
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(description="Draw the gallery.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="scripts, without .py")
    parser.add_argument("--check", action="store_true", help="only list what is unmatched")
    options = parser.parse_args(argv)
    if options.check:
        lines = unmatched()
        print("\n".join(lines) if lines else "every script has its SVG, every SVG its script")
        return 1 if lines else 0
    known = {path.stem: path for path in scripts()}
    for name in options.names:
        if name not in known:
            print(f"no script '{name}'; there is {', '.join(known)}", file=sys.stderr)
            return 2
    for name in options.names or known:
        print(make(known[name]).name)
    return 0


if __name__ == "__main__":
    sys.exit(main())

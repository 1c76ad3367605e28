"""Pages of the Python interface, from the docstrings of what ``mechdae`` exports."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import mechdae as md
from mechdae.describe.series_units import REACTION, SUMMARY, UNITS

PAGES = {
    "solve": (
        "Solve, draw, write",
        "What is called: from a problem to results, pictures, pages and files.",
    ),
    "mechanisms": (
        "Mechanisms",
        "Frozen values with the keys of the problem file, in metres and radians.",
    ),
    "tasks": ("Tasks, drivers, problems", "What is asked of a mechanism."),
    "results": (
        "Results",
        "Read-only arrays in SI units and radians, a row for each pose; nan where it has none.",
    ),
    "errors": ("Errors", "Each is raised on purpose, and says what to try."),
}

_HOMES = {
    "mechdae.describe.tasks": "tasks",
    "mechdae.describe.file.problem": "tasks",
    "mechdae.describe.file": "solve",
    "mechdae.describe": "mechanisms",
    "mechdae.results": "results",
    "mechdae.errors": "errors",
}
"""Page of a name by where it is written; what is nowhere here is on the first one."""


def _page(name: str) -> str:
    home = str(getattr(md, name).__module__)
    best = max((own for own in _HOMES if home.startswith(own)), key=len, default="")
    return _HOMES.get(best, "solve")


def write(target: Path) -> list[str]:
    """Write the pages into ``api/`` and return their names for the contents."""
    folder = target / "api"
    folder.mkdir(parents=True, exist_ok=True)
    names = [name for name in md.__all__ if not name.startswith("__")]
    for page, (title, words) in PAGES.items():
        own = [name for name in names if _page(name) == page]
        own.sort(key=lambda name: (inspect.isclass(getattr(md, name)), name.lower()))
        lines = [title, "=" * len(title), "", words, ""]
        if page == "results":
            lines += _quantities()
        for name in own:
            lines += _entry(name, getattr(md, name))
        (folder / f"{page}.rst").write_text("\n".join(lines), encoding="utf-8")
    listed = "\n".join(f"   {page}" for page in PAGES)
    (folder / "index.rst").write_text(
        "Python interface\n================\n\n"
        "All names of ``import mechdae as md``, from their docstrings. Used on the page "
        ":doc:`/docs/reference/python`.\n\n.. toctree::\n   :maxdepth: 2\n\n" + listed + "\n",
        encoding="utf-8",
    )
    return ["api/index.rst"]


def _entry(name: str, value: Any) -> list[str]:
    """Return the lines of one name: a heading, and its docstring."""
    home = f"mechdae.{name}"
    heading = ["", name, "-" * len(name), ""]
    if inspect.isclass(value):
        if issubclass(value, BaseException):
            return [*heading, f".. autoclass:: {home}", "   :show-inheritance:", ""]
        return [*heading, f".. autoclass:: {home}", "   :members:", ""]
    return [*heading, f".. autofunction:: {home}", ""]


SHAPES = {
    "position": "(n, 2) of points, (n,) of drivers",
    "velocity": "(n, 2) of points, (n,) of drivers",
    "acceleration": "(n, 2) of points, (n,) of drivers",
    "jerk": "(n, 2) of points, (n,) of drivers",
    "coriolis": "(n, 2)",
    "orientation": "(n, 3, 3), in space",
    "centrode_fixed": "(n, 2)",
    "centrode_moving": "(n, 2)",
}


def _quantities() -> list[str]:
    """Return the table of all series with units and shapes, from the package's own table."""
    lines = ["Quantities, units, shapes", "-" * 25, ""]
    lines += [
        "In space points have three components instead of two, and angular rates are (n, 3).",
        "",
    ]
    lines += [
        ".. list-table::",
        "   :header-rows: 1",
        "",
        "   * - series",
        "     - unit",
        "     - shape",
    ]
    for name, unit in sorted(UNITS.items()):
        lines += [f"   * - ``{name}``", f"     - {unit}", f"     - {SHAPES.get(name, '(n,)')}"]
    for name, (parts, units) in REACTION.items():
        whole = f"reaction_{name}" if name else "reaction"
        shown = ", ".join(f"{part} [{unit}]" for part, unit in zip(parts, units, strict=True))
        lines += [f"   * - ``{whole}``", f"     - {shown}", f"     - (n, {len(parts)})"]
    for name, unit in sorted(SUMMARY.items()):
        lines += [f"   * - ``summary['{name}']``", f"     - {unit}", "     - scalar or by name"]
    return [*lines, ""]

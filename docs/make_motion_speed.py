"""Writes the tables of ``docs/theory/evidence/motion.md`` from ``docs/data/motion-*.json``.

Usage: ``python docs/make_motion_speed.py``; with ``--check`` nothing is written and the exit code
tells whether the page is up to date. The data are the ``bench.json`` of ``python -m benchmarks
P --out DIR`` on one machine; ``--measure`` measures them again.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
PAGE = FOLDER / "theory/evidence/motion.md"
PROBLEMS = ("andrews-squeezer", "car-axis", "n-four-bar", "coasting-slider-crank")
BEGIN, END = "<!-- measured: docs/make_motion_speed.py -->", "<!-- end -->"
METHODS = (
    "mechdae", "scipy DOP853", "scipy Radau", "CVODES Adams", "CVODES BDF", "IDAS", "IDAS, index 1",
)  # fmt: skip
RUBBING = ("mechdae", "scipy DOP853, events")
"""Methods of motions with dry friction."""
SHOWN = (1e-6, 1e-8, 1e-10, 1e-12)
BAR = 1e-10
"""Tolerance of the bars."""
Records = dict[str, dict[tuple[str, float], dict[str, Any]]]


def data(name: str) -> Path:
    """Return the file of a problem."""
    return FOLDER / "data" / f"motion-{name}.json"


def records() -> Records:
    """Return what was measured: problem, (method, tolerance), record."""
    found: Records = {}
    for name in PROBLEMS:
        rows = json.loads(data(name).read_text(encoding="utf-8"))
        found[name] = {(row["method"], row["tolerance"]): row for row in rows}
    return found


def tables(measured: Records) -> str:
    """Return the text between the markers."""
    head = " | ".join(f"{tolerance:.0e}".replace("e-0", "e-") for tolerance in SHOWN)
    lines = [f"| | | {head} |", "|---|---|" + "---|" * len(SHOWN)]
    for name, found in measured.items():
        rubs = any(method == RUBBING[1] for method, _ in found)
        for method in RUBBING if rubs else METHODS:
            own = [found.get((method, tolerance)) for tolerance in SHOWN]
            tried = [tolerance for way, tolerance in found if way == method]
            cells = [
                f"{row['ratio']:.1f}, {row['error']:.0e}" if row else
                "" if method == "scipy Radau" and tolerance < min(tried) else "fails"
                for row, tolerance in zip(own, SHOWN, strict=True)
            ]  # fmt: skip
            lines.append(
                f"| {name if method == METHODS[0] else ''} | {method} | {' | '.join(cells)} |"
            )
    lines += ["", f"At tolerance {BAR:.0e}:", ""]
    lines += ["| | error | time / DOP853 | its error | time / IDAS | its error over ours |"]
    lines += ["|---|---|---|---|---|---|"]
    for name, found in measured.items():
        own = found["mechdae", BAR]
        scipy = found.get(("scipy DOP853", BAR)) or found["scipy DOP853, events", BAR]
        idas = [found.get((way, BAR)) for way in ("IDAS", "IDAS, index 1")]
        cells = [
            " and ".join(f"{own['ratio'] / row['ratio']:.2f}" for row in idas if row),
            " and ".join(f"{row['error'] / own['error']:.0e}" for row in idas if row),
        ]
        lines.append(
            f"| {name} | {own['error']:.1e} | {own['ratio'] / scipy['ratio']:.2f} | "
            f"{scipy['error']:.1e} | {cells[0]} | {cells[1]} |"
        )
    return "\n".join(lines)


def page(text: str) -> str:
    """Return the page with the tables between their markers."""
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    return f"{head}{BEGIN}\n\n{tables(records())}\n\n{END}{tail}"


def measure() -> None:
    """Measure all problems again."""
    sys.path.insert(0, str(FOLDER.parent))
    from benchmarks.__main__ import main as command

    for name in PROBLEMS:
        with tempfile.TemporaryDirectory() as folder:
            if command([name, "--out", folder]):
                raise SystemExit(f"{name} could not be measured")
            shutil.copy(Path(folder) / "bench.json", data(name))


def main(arguments: list[str]) -> int:
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--measure", action="store_true")
    asked = parser.parse_args(arguments)
    if asked.measure:
        measure()
    old = PAGE.read_text(encoding="utf-8")
    text = page(old)
    if asked.check:
        print("up to date" if text == old else f"{PAGE.name} is not what docs/data/motion-* say")
        return 0 if text == old else 1
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

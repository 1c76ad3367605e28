"""How far the back ends are apart on the predefined problems, in ulp of the scale.

    python -m tests.scripts.back_ends --out docs/data/back-ends.json

Each task is solved by the compiled machine and without it, nothing kept between. Compared are all
columns of its table; the scale of a column is the largest number of its unit in that table, and
its ulp the distance of that number from the next. Exit code 1 where anything is further apart
than `ALLOWED` ulp and than the bounds that both results give.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file import library as problems
from mechdae.kernels.machine import program
from mechdae.motion.kinematics.prepared import SHAPES

ALLOWED = 4.0
SLOW = ("synthesis", "study")
NOISE = ("drift", "condition", "error", "bound")
"""Columns that are errors and bounds themselves."""


@contextmanager
def without_machine() -> Iterator[None]:
    """Let casadi's machine and NumPy evaluate what is built meanwhile."""
    before = program.library
    SHAPES.clear()
    program.library = lambda: None
    try:
        yield
    finally:
        program.library = before
        SHAPES.clear()


def columns(problem: Any, task: str) -> dict[str, tuple[str, Any]]:
    """Return unit and numbers of each column of a task's table."""
    found = md.solve(problem, task).columns()
    return {
        name: (unit, np.asarray(values, float))
        for name, unit, values in found
        if np.asarray(values).dtype.kind in "fi" and not any(word in name for word in NOISE)
    }


def apart(one: dict[str, tuple[str, Any]], other: dict[str, tuple[str, Any]]) -> dict[str, float]:
    """Return how many ulp of its scale each column is from the other's; inf for other poses."""
    scales: dict[str, float] = {}
    for unit, values in one.values():
        largest = np.abs(values[np.isfinite(values)]).max(initial=0.0)
        scales[unit] = max(scales.get(unit, 0.0), float(largest))
    found = {}
    for name, (unit, values) in one.items():
        known = other.get(name, ("", np.zeros(0)))[1]
        if known.shape != values.shape or not np.array_equal(np.isnan(known), np.isnan(values)):
            found[name] = float("inf")
            continue
        far = np.nan_to_num(np.abs(values - known)).max(initial=0.0)
        found[name] = float(far / np.spacing(scales[unit])) if far else 0.0
    return found


def compared(name: str, task: str) -> dict[str, float]:
    """Return how far the columns of a task are apart."""
    problem = md.load(name)
    SHAPES.clear()
    compiled = columns(problem, task)
    with without_machine():
        return apart(columns(problem, task), compiled)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", nargs="*", default=[], metavar="PROBLEM")
    given = parser.parse_args()
    if program.library() is None:
        print("the compiled machine is not built here")
        return 2
    worst: dict[str, Any] = {}
    count = 0
    for name in given.only or problems.names():
        for task, what in md.load(name).tasks.items():
            if what.kind in SLOW:
                continue
            try:
                found = compared(name, task)
            except md.MechdaeError as error:
                print(f"{name}.{task}: {error}")
                continue
            count += len(found)
            far = {key: value for key, value in found.items() if value > ALLOWED}
            worst[f"{name}.{task}"] = {
                "columns": len(found), "largest": max(found.values(), default=0.0),
                "beyond": dict(sorted(far.items(), key=lambda item: -item[1])[:5]),
            }  # fmt: skip
            if far:
                print(
                    f"{name}.{task}: {len(far)} of {len(found)}", worst[f"{name}.{task}"]["beyond"]
                )
                sys.stdout.flush()
    beyond = [key for key, own in worst.items() if own["beyond"]]
    print(f"{len(worst)} tasks, {count} columns; beyond {ALLOWED:g} ulp: {len(beyond)} tasks")
    if given.out:
        given.out.write_text(json.dumps(worst, indent=1) + "\n", encoding="utf-8")
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())

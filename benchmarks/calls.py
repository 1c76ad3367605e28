"""What a user calls, as a whole: ``md.solve`` and ``md.Solver``, beside the yardstick.

Usage: ``python -m benchmarks.calls [--quick] [--out docs/data/calls.json]``. A call is measured
from the problem to the result, with the outputs of its task; *first* is the first one of a
mechanism in a process that has solved another, *again* the same with another value of a dimension,
*warm* a call of a solver with another value. ``ratio`` is to the closed-form four-bar in NumPy for
the same number of poses, run between.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import mechdae as md
from mechdae.bench.yardstick import yardstick

CALLS = (
    ("four-bar-crank-rocker", "turn", 361, "b"),
    ("four-bar-crank-rocker", "turn", 100_000, "b"),
    ("gorshkov-seven-link", "window", 361, "BC"),
    ("jansen-leg", "turn", 361, "b"),
    ("slider-crank-friction", "cycle", 361, "r"),
)
"""Problem, task, poses, the dimension that changes."""
SHARE = 1e-4
"""By which it changes, times the number of the call."""


def measure(repeats: int = 7, most: int = 100_000) -> list[dict[str, Any]]:
    """Return one record for each call and way."""
    md.solve("slider-crank", "turn")
    records: list[dict[str, Any]] = []
    for name, task, poses, changed in CALLS:
        if poses > most:
            continue
        problem = md.load(name)
        problem = problem.with_task(task, replace(problem.tasks[task], poses=poses))
        value = problem.mechanism.values()[changed]
        begin = time.perf_counter()
        md.solve(problem, task)
        first = time.perf_counter() - begin
        solver = md.Solver(problem, task)
        solver({changed: value})
        ways: dict[str, Callable[[dict[str, float]], Any]] = {
            "again": partial(_again, problem, task), "warm": solver,
        }  # fmt: skip
        crank = np.linspace(0.0, 2 * np.pi, poses)
        for way, function in ways.items():
            call = partial(_with, function, changed)
            ours, theirs = _interleaved(call, value, crank, repeats)
            records.append(
                {
                    "work": f"{name} {task}", "way": way, "n": poses, "seconds": ours,
                    "yardstick": theirs, "ratio": ours / theirs, "first": first,
                }
            )  # fmt: skip
    return records


def _again(problem: md.Problem, task: str, values: dict[str, float]) -> md.Result:
    return md.solve(problem, task, set=values)


def _with(function: Callable[[dict[str, float]], Any], name: str, value: float) -> None:
    function({name: value})


def _interleaved(
    call: Callable[[float], None], value: float, crank: Any, repeats: int
) -> tuple[float, float]:
    """Return medians of a call, each time with another value, and of the yardstick."""
    times: tuple[list[float], list[float]] = ([], [])
    for k in range(repeats + 1):
        begin = time.perf_counter()
        call(value * (1.0 + SHARE * (k + 1)))
        middle = time.perf_counter()
        yardstick(crank)
        times[0].append(middle - begin)
        times[1].append(time.perf_counter() - middle)
    return median(times[0][1:]), median(times[1][1:])


def table(records: list[dict[str, Any]]) -> str:
    """Return the records as a Markdown table, for the README and for docs/speed-and-error.md."""
    lines = [
        "| task | poses | first call, ms | `md.solve(set=...)` again, ms | x yardstick | "
        "warm `md.Solver`, ms | x yardstick |",
        "|---|---|---|---|---|---|---|",
    ]
    ways: dict[tuple[str, int], dict[str, dict[str, Any]]] = {}
    for record in records:
        ways.setdefault((record["work"], record["n"]), {})[record["way"]] = record
    for (work, n), own in ways.items():
        cells = [f"| {work} | {n:,} | {own['again']['first'] * 1e3:.0f} "]
        cells += [
            f"| {own[way]['seconds'] * 1e3:.1f} | {own[way]['ratio']:.1f} "
            for way in ("again", "warm")
        ]
        lines.append("".join(cells) + "|")
    return "\n".join(lines)


def main(words: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer poses and repeats")
    parser.add_argument("--out", metavar="FILE", help="write the records there")
    asked = parser.parse_args(words)
    records = measure(3, 1000) if asked.quick else measure()
    print(table(records))
    if asked.out:
        Path(asked.out).write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

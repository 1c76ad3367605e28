"""Motions against the yardstick: processor time, medians of interleaved runs, error beside it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from functools import partial
from statistics import median
from typing import Any

import numpy as np

from mechdae.describe import Problem
from mechdae.describe.tasks.motion import Motion
from mechdae.dynamics.task import motion, prepared
from mechdae.parts.bench.motion_cases import OURS, MotionWork, RubbingWork, Way
from mechdae.parts.bench.yardstick import yardstick

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
QUICK_TOLERANCES = (1e-8, 1e-10)
POSES = 10_000
"""Poses of the yardstick."""
Others = Callable[[MotionWork, tuple[float, ...], list[str]], Iterable[tuple[str, float, Way]]]
"""Other methods of a work at tolerances; they may add notes."""


def work_of(problem: Problem) -> MotionWork | None:
    """Return the first task of motion of a problem."""
    for name, task in problem.tasks.items():
        if isinstance(task, Motion):
            run, x, v = prepared(problem, task)
            rubs = run.setup.released.rubbing.slips and not run.setup.smooth
            kind = RubbingWork if rubs else MotionWork
            return kind(problem, name, run, x, v)
    return None


def measure(
    work: MotionWork,
    tolerances: tuple[float, ...] = TOLERANCES,
    repeats: int = 7,
    others: Others | None = None,
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return one record per method and tolerance, and notes on what was left out or failed.

    ``n`` is the number of right-hand sides, ``seconds`` the median processor time of an
    integration with its functions built, ``yardstick`` that of the yardstick at 10 000 poses,
    ``ratio`` their quotient. ``error`` is the largest one at the end, over natural sizes, or
    over the value where that is larger; ``drift`` the largest gap of a constraint there. ``first``
    is a whole task of the package, from the description to the result.
    """
    begin = time.process_time()
    motion(work.problem, work.key, work.run.setup.task)
    first = time.process_time() - begin
    ways, ends, notes = [], [], [*work.notes]
    tried: list[tuple[str, float, Way]] = [
        (OURS, tolerance, partial(work.ours, tolerance)) for tolerance in tolerances
    ]
    beside = others(work, tolerances, notes) if others is not None else ()
    for method, tolerance, way in (*tried, *beside):
        try:
            end = way()
        except (RuntimeError, ValueError) as problem:
            reason = str(problem).strip().splitlines()[-1].rpartition("cpp:")[2]
            notes.append(f"{method} at {tolerance:.0e} failed: {reason}")
            continue
        ways.append((method, tolerance, way))
        ends.append(end)
    crank = np.linspace(0, 2 * np.pi, POSES)
    times: list[list[float]] = [[] for _ in ways]
    sticks: list[float] = []
    for _ in range(repeats):
        for (_, _, way), kept in zip(ways, times, strict=True):
            sticks.append(_timed(partial(yardstick, crank)))
            kept.append(_timed(way))
    stick = median(sticks)
    records = []
    for (method, tolerance, _), kept, end in zip(ways, times, ends, strict=True):
        seconds = median(kept)
        record = {
            "work": work.name, "task": "motion", "method": method, "tolerance": tolerance,
            "n": end.rhs, "ratio": seconds / stick, "yardstick": stick,
            "error": work.error(end.x), "seconds": seconds, "drift": work.drift(end.x),
            "reference": work.reference,
        }  # fmt: skip
        if method == OURS:
            record["first"] = first
        records.append(record)
    return records, notes


def _timed(function: Callable[[], Any]) -> float:
    begin = time.process_time()
    function()
    return time.process_time() - begin


def table(records: list[dict[str, Any]], notes: list[str]) -> str:
    """Return the records as text."""
    lines = [
        f"{records[0]['work']:24} {'tolerance':>9} {'rhs':>7} {'ms':>8} {'x yardstick':>12} "
        f"{'error':>9} {'drift':>9}"
    ]
    lines += [
        f"  {r['method']:22} {r['tolerance']:9.0e} {r['n']:7d} {r['seconds'] * 1e3:8.2f} "
        f"{r['ratio']:12.2f} {r['error']:9.1e} {r['drift']:9.1e}"
        for r in records
    ]
    lines.append(
        f"yardstick: closed-form four-bar in NumPy at {POSES} poses, "
        f"{records[0]['yardstick'] * 1e3:.2f} ms; processor time, medians of interleaved runs"
    )
    lines.append(f"error at the end against {records[0]['reference']}; functions are built before")
    return "\n".join([*lines, *notes])

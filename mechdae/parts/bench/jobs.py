"""The starts of a synthesis in one process and in several: what workers save."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.describe import Problem
from mechdae.design.jobs.call import JobCall
from mechdae.design.synthesis.job.run import synthesize

STARTS, QUICK_STARTS = 200, 20
WORKERS = 2


def measure(
    problem: Problem, name: str, starts: int = STARTS, workers: int = WORKERS
) -> list[dict[str, object]]:
    """Return a record for one process and one for `workers`.

    ``seconds`` is from the moment the starts are drawn to the last optimum: starting the
    processes and building their NLPs is in it. ``whole`` adds drawing the starts and sweeping
    the designs, which are done in one process. ``error`` is the largest difference of a number
    in the answers.
    """
    records: list[dict[str, Any]] = []
    answers = []
    for count in (1, workers):
        moments: list[float] = []
        began = time.perf_counter()
        call = JobCall(
            starts, workers=count,
            progress=lambda *_, told=moments: told.append(time.perf_counter()),
        )  # fmt: skip
        result = synthesize(problem, name, call)
        whole = time.perf_counter() - began
        seconds = moments[-1] - moments[0]
        answers.append(_numbers(result.data["designs"]))
        yardstick = records[0]["seconds"] if records else seconds
        records.append(
            {
                "work": f"{problem.name} {name}", "task": "synthesis", "n": len(moments) - 1,
                "workers": count, "ratio": seconds / yardstick, "yardstick": "one process",
                "error": _difference(answers[0], answers[-1]), "seconds": seconds, "whole": whole,
            }
        )  # fmt: skip
    return records


def table(records: Sequence[Mapping[str, object]]) -> str:
    lines = [
        f"{'starts':>6} {'workers':>8} {'s':>8} {'x one process':>14} {'whole s':>8} {'error':>9}"
    ]
    lines += [
        f"{r['n']:6d} {r['workers']:8d} {r['seconds']:8.2f} {r['ratio']:14.3f} {r['whole']:8.2f} "
        f"{r['error']:9.1e}"
        for r in records
    ]
    return "\n".join(lines)


def _numbers(designs: list[dict[str, Any]]) -> Any:
    return np.array([[d["objective"], *d["parameters"].values()] for d in designs], float)


def _difference(first: Any, second: Any) -> float:
    if first.shape != second.shape:
        return float("inf")
    return float(np.abs(first - second).max(initial=0.0))

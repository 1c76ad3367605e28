"""Many sets of numbers: mechanisms a second, certified and screened, and how far both differ.

``python -m benchmarks.studies --out docs/data/studies.json --page PAGE`` measures and
writes its table of docs/theory/evidence/solver.md.
Seconds are those of one process; quotients are over the closed-form
four-bar in NumPy for as many poses, measured in between.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

import mechdae as md
from benchmarks.written import arguments, written
from mechdae.design.studies.rows import Computer
from mechdae.parts.bench.runs import yardstick

POSES, CHECKED = 200, 40
CASES = (
    ("four-bar-crank-rocker", "four-bars, lengths +-5 %", 0.05, "abcd", "bodies/rocker/angle"),
    ("jansen-leg", "Jansen legs, +-0.3 %", 0.003, "abcdefghijklm", "points/lower.P/position"),
    ("jansen-leg", "Jansen legs, +-5 %", 0.05, "abcdefghijklm", "points/lower.P/position"),
)


def case(name: str, share: float, letters: str, count: int) -> tuple[md.Problem, Any]:
    """Return a problem with one turn of 200 poses, and sets drawn around its numbers."""
    problem = md.load(name)
    task = next(task for task in problem.tasks.values() if type(task) is md.Sweep)
    driver = replace(task.all_drivers[0], range=None, at=None, from_=0.0, to=2 * np.pi)
    problem = problem.with_task("turn", replace(task, driver=driver, poses=POSES))
    base, rng = problem.mechanism.values(), np.random.default_rng(1)
    values = [base[n] * (1 + share * rng.uniform(-1, 1, count)) for n in letters]
    return problem, np.stack(values, axis=1)


def spent(work: Any) -> tuple[float, Any]:
    """Return processor seconds and the value of a call."""
    begun = time.process_time()
    value = work()
    return time.process_time() - begun, value


def measured(entry: tuple[str, str, float, str, str], count: int, rounds: int) -> dict[str, Any]:
    """Return the figures of one case."""
    name, title, share, letters, path = entry
    problem, sets = case(name, share, letters, count)
    angle = np.linspace(0, 2 * np.pi, 20_000)
    record: dict[str, Any] = {"work": title, "sets": count, "poses": POSES}
    rows = {}
    for word, certify in (("certified", True), ("screened", False)):
        computer = Computer(problem, "turn", (path,), tuple(letters), certify)
        size = computer.portion
        computer(sets[:300])
        seconds: list[float] = []
        units: list[float] = []
        parts: list[Any] = []
        for _ in range(rounds):
            units.append(min(spent(lambda: yardstick(angle))[0] for _ in range(5)))
            total, parts = 0.0, []
            for start in range(0, count, size):
                took, found = spent(partial(computer, sets[start : start + size]))
                total, parts = total + took, [*parts, found]
            seconds.append(total)
        unit = float(np.median(units)) * count * POSES / len(angle)
        best = float(np.median(seconds))
        record[word] = {
            "seconds": best, "per_second": count / best, "ratio": best / unit,
            "alone": count - sum(part.together for part in parts),
        }  # fmt: skip
        status = np.array([word for part in parts for word in part.status])
        rows[word] = np.concatenate([part.values[0] for part in parts]), status
    ok = (rows["certified"][1] == "ok") & (rows["screened"][1] == "ok")
    difference = np.abs(rows["certified"][0] - rows["screened"][0])[ok]
    record["ok"] = int((rows["certified"][1] == "ok").sum())
    record["screened_otherwise"] = int((rows["certified"][1] != rows["screened"][1]).sum())
    record["screened_error"] = float(difference.max())
    record["error"] = against_single(problem, sets, letters, path, *rows["certified"])
    record["peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return record


def against_single(
    problem: md.Problem, sets: Any, letters: str, path: str, table: Any, status: Any
) -> float:
    """Return by how much rows differ from their sets alone; other statuses are infinitely far."""
    largest = 0.0
    for k in range(0, len(sets), max(1, len(sets) // CHECKED)):
        result = md.solve(problem, "turn", set=dict(zip(letters, sets[k].tolist(), strict=True)))
        words = [str(word) for word in result.status if word not in ("ok", "limit")]
        if status[k] != (words[0] if words else "ok"):
            return float("inf")
        gap = np.abs(table[k] - np.array(result.value(path), float))
        largest = max(largest, float(np.nanmax(gap)))
    return largest


def records(own: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the figures of one case as records like those of other works."""
    return [
        {
            "work": own["work"], "task": "study", "method": method, "setting": "", "n": own["sets"],
            "seconds": own[word]["seconds"], "ratio": own[word]["ratio"], "error": error,
            "yardstick": own[word]["seconds"] / own[word]["ratio"],
            "alone": own[word]["alone"], "poses": POSES,
        }
        for word, method, error in (
            ("certified", "md.study", own["error"]),
            ("screened", "md.screen", own["screened_error"]),
        )
    ]  # fmt: skip


def page(records: list[dict[str, Any]]) -> str:
    """Return the table of the page."""
    heads = (
        "200 poses each, one core", "mechanisms/s, certified", "over the yardstick", "alone",
        "row against the set alone", "screened", "over the yardstick", "other status",
        "screened against certified",
    )  # fmt: skip
    lines = [_row(heads), _row(["---"] * len(heads))]
    for own in records:
        one, two = own["certified"], own["screened"]
        cells = (
            f"{own['sets']} {own['work']}",
            f"{one['per_second']:.0f}",
            f"{one['ratio']:.1f}",
            f"{100 * one['alone'] / own['sets']:.2g} %",
            f"{own['error']:.1g}",
            f"{two['per_second']:.0f}",
            f"{two['ratio']:.1f}",
            f"{own['screened_otherwise']}",
            f"{own['screened_error']:.1g}",
        )
        lines.append(_row(cells))
    return "\n".join(lines)


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=4096)
    parser.add_argument("--rounds", type=int, default=3)
    arguments(parser)
    options = parser.parse_args()
    records = [measured(entry, options.sets, options.rounds) for entry in CASES]
    written(options, records, page(records), "<!-- studies -->", "<!-- end of studies -->")


if __name__ == "__main__":
    main()

"""Whole tasks as users call them: forces, motion, assembly modes, synthesis, a study.

The error is the largest relative difference from the values that the problem's file expects, which
come from closed forms and independent computations, or of the best design from the optimum known;
that of a study is the largest difference of its rows from their sets solved alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mechdae.describe import Problem, load
from mechdae.parts.bench.kinematics import AGAIN, FIRST, WARM, calls, interleaved, sets_of, timing
from mechdae.parts.bench.runs import yardstick
from mechdae.records import dataclass
from mechdae.tasks import Solver
from mechdae.tasks.check import check
from mechdae.tasks.solve import solve
from mechdae.types import Floats, Json

POSES = 10_000
"""Poses of the yardstick."""
SETS, QUICK_SETS, SET_POSES, ALONE = 1000, 20, 200, 20
"""Mechanisms of a study, their poses, how many of them are solved alone too."""
EXACT = 1e-8
"""Relative deviation up to which an expected value says something of the digits."""


@dataclass(frozen=True)
class TaskWork:
    """A task to be measured: its title, problem and name, the number that changes, if any."""

    title: str
    problem: str
    task: str
    changed: str | None = None
    repeats: int = 7


WORKS = (
    TaskWork("reactions, coupled friction", "slider-crank-inertia", "cycle", "r"),
    TaskWork("reactions, friction in a slot", "quick-return-friction", "cycle", "OA"),
    TaskWork("motion, tolerance 1e-10", "andrews-squeezer", "motion", "rr"),
    TaskWork("all assembly modes", "gorshkov-seven-link", "modes", "BC"),
    TaskWork("all assembly modes of a triad", "triad-six-modes", "modes"),
    TaskWork("synthesis of a crank-rocker", "rocker-50-1-15", "design", repeats=2),
)
QUICK_WORKS = WORKS[:1]
BEST = {"rocker-50-1-15": np.radians(46.27204138130625)}
"""Best transmission angle of a swing of 50 degrees at a time ratio of 1.15, by a search of its own
over the one parameter that is left [rad]."""
GIVEN = {"andrews-squeezer": {"tol": 1e-10}}


def measure(works: tuple[TaskWork, ...] = WORKS, repeats: int = 7, sets: int = SETS) -> list[Json]:
    """Return records of whole tasks: work, method, n, ratio, yardstick, error, seconds.

    ``n`` counts poses, modes, steps or designs; the yardstick runs with 10 000 poses.
    """
    records: list[Json] = []
    for item in works:
        problem = load(item.problem).with_values(GIVEN.get(item.problem, {}))
        records += _of_task(item, problem, min(repeats, item.repeats))
    records.append(_of_study(sets, repeats))
    return records


def _of_task(item: TaskWork, problem: Problem, repeats: int) -> Iterator[Json]:
    result = solve(problem, item.task)
    if item.problem in BEST:
        error = abs(result.data["designs"][0]["objective"] / BEST[item.problem] - 1)
    else:
        error = off_expected(problem, item.task)
    timed = calls(problem, item.task, sets_of(problem, item.changed), _stick, repeats)
    for method, both in timed.items():
        yield {
            "work": item.title, "of": f"{item.problem} {item.task}", "task": result.kind,
            "method": method, "setting": "", "n": max(1, len(result)), "error": error,
            **timing(*both),
        }  # fmt: skip


def _stick() -> tuple[Floats, ...]:
    return yardstick(np.linspace(0, 2 * np.pi, POSES))


def off_expected(problem: Problem, task: str) -> float:
    """Return the largest deviation from what the file expects of a task, over the value's size."""
    expected = tuple(entry for entry in problem.expected if entry.task == task)
    largest = float("nan")
    for verdict in check(replace(problem, expected=expected)):
        size = np.abs(np.array(verdict.value, float)).max(initial=0.0) or 1.0
        exact = verdict.allowed <= EXACT * size
        if verdict.note or not verdict.met or exact:
            largest = float(np.nanmax([largest, verdict.deviation / size]))
    return largest


def _of_study(count: int, repeats: int) -> Json:
    """Return the record of a study: four-bars with lengths of +-5 %."""
    problem = load("four-bar-crank-rocker")
    problem = problem.with_task("turn", replace(problem.tasks["turn"], poses=SET_POSES))  # type: ignore[call-arg]
    base, random = problem.mechanism.values(), np.random.default_rng(1)
    sets = {n: (base[n] * (1 + 0.05 * random.uniform(-1, 1, count))).tolist() for n in "abcd"}
    path = "bodies/rocker/angle"
    solver = Solver(problem, "turn")
    found = solver.many(sets, [path]).table[path]
    seconds, stick = interleaved(lambda: solver.many(sets, [path]), _stick, max(1, repeats // 2))
    gaps = [
        np.abs(found[k] - solver({n: sets[n][k] for n in sets}).bodies["rocker"].angle).max()
        for k in range(0, count, max(1, count // ALONE))
    ]
    return {
        "work": f"study, {SET_POSES} poses of each four-bar", "of": "four-bar-crank-rocker turn",
        "task": "study", "method": WARM, "setting": "many", "n": count,
        "error": float(np.nanmax(gaps)), **timing(seconds, stick),
    }  # fmt: skip


def table(records: list[Json]) -> str:
    lines = [
        f"{'whole task':32} {'n':>6} {'first ms':>10} {'again ms':>9} {'md.Solver ms':>13} "
        f"{'x yardstick':>12} {'error':>9}"
    ]
    for title in dict.fromkeys(r["work"] for r in records):
        times = {r["method"]: r for r in records if r["work"] == title}
        last = times[WARM]
        cells = [
            f"{times[method]['seconds'] * 1e3:{width}.1f}" if method in times else " " * width
            for method, width in ((FIRST, 10), (AGAIN, 9), (WARM, 13))
        ]
        lines.append(
            f"{title:32} {last['n']:6d} {' '.join(cells)} {last['ratio']:12.1f} "
            f"{last['error']:9.1e}"
        )
    lines.append(
        f"yardstick: {POSES} poses; n: poses, modes, steps, designs, mechanisms; error: from the "
        "values that the files expect, a study's from its sets alone"
    )
    return "\n".join(lines)

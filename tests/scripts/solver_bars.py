"""What a warm call of `md.Solver` costs beside the yardstick, and how far it is from a fresh one.

    python -m tests.scripts.solver_bars --out docs/data/solver.json --page PAGE

Every round takes each case in turn, three calls, and the yardstick (the closed form of the
four-bar in NumPy, same number of poses) next to it; what is told are medians over the rounds, in
milliseconds of the processor and as multiples of the yardstick. Each call of a case has a value of
a dimension that no call had before. The error is the largest difference from `md.solve` with
nothing kept, relative to the largest of its series.
"""

from __future__ import annotations

import argparse
import gc
import json
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from benchmarks.forces import problem as four_bar
from mechdae.describe.tasks.studies import Sensitivity
from mechdae.motion.kinematics.prepared import SHAPES
from mechdae.parts.bench.runs import COUPLER, yardstick

BEGIN, END = "<!-- measured -->", "<!-- end of measured -->"
MANY = 100_000
STEP = 1e-6
"""Share of a dimension by which it differs from one call to the next."""


@dataclass
class Case:
    """Something to be timed: what it is, the bar in milliseconds, poses, a call with a number."""

    name: str
    bar: float | None
    poses: int
    call: Callable[[float], Any]
    fresh: Callable[[float], Any] | None = None
    times: list[float] = field(default_factory=list)
    beside: list[float] = field(default_factory=list)


def solver_case(
    label: str, name: str, task: str, key: str, bar: float, given: dict[str, float] | None = None
) -> Case:
    """Return a warm call with another value of `key`, some numbers given for good."""
    problem = md.load(name)
    problem = problem if given is None else problem.with_values(given)
    value, solver = problem.mechanism.values()[key], md.Solver(problem, task)

    def call(share: float) -> md.Result:
        return solver({key: value * (1 + share)})

    def fresh(share: float) -> md.Result:
        return md.solve(problem, task, set={key: value * (1 + share)})

    poses = getattr(problem.tasks[task], "poses", None) or 1
    return Case(label, bar, poses, call, fresh)


def forces_case(label: str, friction: str) -> Case:
    """Return reactions and the effort of many poses of the yardstick's four-bar."""
    problem = four_bar(MANY, friction)
    solver = md.Solver(problem, "forces")

    def call(share: float) -> md.Result:
        return solver({"coupler.C.x": COUPLER * (1 + share)})

    return Case(label, None, MANY, call)


def slopes_case(label: str, poses: int) -> Case:
    """Return derivatives of two outputs of a four-bar by its four lengths."""
    problem = md.load("four-bar-crank-rocker")
    problem = problem.with_task("turn", replace(problem.tasks["turn"], poses=poses))
    outputs = ("points/coupler.P/position", "bodies/rocker/angle")
    task = Sensitivity(of="turn", outputs=outputs, wrt=("a", "b", "c", "d"))
    solver = md.Solver(problem.with_task("slopes", task), "slopes")

    def call(share: float) -> md.Result:
        return solver({"b": 0.12 * (1 + share)})

    return Case(label, None, poses, call)


def cases() -> list[Case]:
    """Return what is measured."""
    four = md.load("four-bar-crank-rocker")
    solver = md.Solver(four, "turn")
    kept = md.Solver(four, "turn")
    near = float(np.radians(61.0))

    def pose(share: float) -> Any:
        return solver.poses({"b": 0.12 * (1 + share)}, near)["points/coupler.P/position"]

    def again(share: float) -> Any:
        return kept.poses({}, near + share)["points/coupler.P/position"]

    def repeated(share: float) -> Any:
        return md.solve(four, "turn", set={"b": 0.12 * (1 + share)})

    return [
        solver_case("four-bar", "four-bar-crank-rocker", "turn", "b", 3.0),
        solver_case("seven-link", "gorshkov-seven-link", "turn", "OA", 8.0),
        solver_case("seven-link, its whole arc", "gorshkov-seven-link", "window", "OA", 8.0),
        solver_case("Jansen's leg", "jansen-leg", "turn", "a", 10.0),
        Case("four-bar, `md.solve(set=...)` again", 8.0, 361, repeated, repeated),
        Case("four-bar, one pose as arrays, another dimension", 0.3, 1, pose),
        Case("four-bar, one pose as arrays, same dimensions", None, 1, again),
        solver_case("slider-crank with friction", "slider-crank-friction", "cycle", "r", 15.0),
        forces_case("four-bar, reactions and effort", "none"),
        forces_case("four-bar, reactions and effort, coupled friction", "coupled"),
        slopes_case("four-bar, sensitivity", 361),
        slopes_case("four-bar, sensitivity, many poses", MANY),
        solver_case("Andrews' squeezer, motion at 1e-10", "andrews-squeezer", "motion", "m1", 40.0),
        solver_case(
            "ladder of 40 parallelograms, 20 s at 1e-10",
            "n-four-bar",
            "motion",
            "m",
            1200.0,
            {"N": 40, "tol": 1e-10, "t_end": 20.0},
        ),
    ]


def gap(warm: md.Result, fresh: md.Result) -> float:
    """Return the largest difference of all series, relative to the largest of each."""
    worst, own, other = 0.0, warm.to_dict(), fresh.to_dict()
    for kind in ("bodies", "points", "joints"):
        for part, series in (own.get(kind) or {}).items():
            for name, values in series.items():
                a = np.array(values, float)
                b = np.array(other[kind][part][name], float)
                size = float(np.nanmax(np.abs(b), initial=0.0)) or 1.0
                worst = max(worst, float(np.nanmax(np.abs(a - b), initial=0.0)) / size)
    return worst


def timed(call: Callable[[], Any]) -> float:
    start = time.process_time()
    call()
    return 1e3 * (time.process_time() - start)


def measured(rounds: int, only: str = "") -> dict[str, Any]:
    """Return times and errors of all cases, or of those that have a text in their names."""
    every, share = [case for case in cases() if only in case.name], 0.0
    for case in every:
        case.call(0.0)
    for _ in range(rounds):
        for case in every:
            angles = np.linspace(0.0, 2 * np.pi, max(case.poses, 1))
            case.beside.append(statistics.median(timed(partial(yardstick, angles)) for _ in "abc"))
            own = []
            for _ in range(3):
                share += STEP
                own.append(timed(partial(case.call, share)))
            case.times.append(statistics.median(own))
    rows = []
    for case in every:
        row = {"case": case.name, "poses": case.poses, "bar_ms": case.bar}
        row["ms"] = round(statistics.median(case.times), 3)
        row["least_ms"] = round(min(case.times), 3)
        row["times_yardstick"] = round(row["ms"] / max(statistics.median(case.beside), 1e-3), 1)
        if case.fresh is not None:
            share += STEP
            warm = case.call(share)
            SHAPES.clear()
            row["cold_ms"] = round(timed(partial(case.fresh, share)), 1)
            row["error"] = gap(warm, case.fresh(share))
        rows.append(row)
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "rounds": rounds,
        "rows": rows,
        **({} if only else {"memory": flat()}),
    }


def flat(calls: int = 10_000) -> dict[str, int]:
    """Return the bytes of this process after warm calls, 500 and all of them."""
    solver = md.Solver("four-bar-crank-rocker", "turn")
    held = {}
    for k in range(calls + 1):
        solver(b=0.12 * (1 + 1e-7 * k))
        if k in (500, calls):
            gc.collect()
            held[str(k)] = int(Path("/proc/self/statm").read_text().split()[1]) * 4096
    return held


def table(data: dict[str, Any]) -> str:
    """Return the measured numbers as a Markdown table."""
    lines = [
        "| warm call | poses | ms (least) | yardsticks | first call, ms | off a fresh call |",
        "|---|---|---|---|---|---|",
    ]
    for row in data["rows"]:
        error = f"{row['error']:.1g}" if "error" in row else ""
        cold = f"{row['cold_ms']:g}" if "cold_ms" in row else ""
        lines.append(
            f"| {row['case']} | {row['poses']} | {row['ms']:.3g} ({row['least_ms']:.3g}) "
            f"| {row['times_yardstick']:g} | {cold} | {error} |"
        )
    return "\n".join(lines)


def written(page: str, data: dict[str, Any]) -> str:
    """Return a page with its table replaced."""
    head, _, rest = page.partition(BEGIN)
    return f"{head}{BEGIN}\n{table(data)}\n{END}{rest.partition(END)[2]}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--page", type=Path)
    parser.add_argument("--only", default="", help="cases with this text; others stay in --out")
    given = parser.parse_args()
    data = measured(given.rounds, given.only)
    if given.only and given.out:
        known = json.loads(given.out.read_text(encoding="utf-8"))
        rows = {row["case"]: row for row in (*known["rows"], *data["rows"])}
        data = {**known, "rows": list(rows.values())}
    print(table(data))
    print(data.get("memory", ""))
    if given.out:
        given.out.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    if given.page:
        page = given.page.read_text(encoding="utf-8")
        given.page.write_text(written(page, data), encoding="utf-8")


if __name__ == "__main__":
    main()

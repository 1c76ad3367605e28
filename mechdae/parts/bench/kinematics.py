"""Sweeps as users call them against the yardstick: medians of interleaved runs, error beside.

The *first* call of ``md.solve`` has nothing kept, neither in memory nor on disk; *again* is the
same with another value of a dimension, *warm* a call of an ``md.Solver`` with another value, and
*arrays* one of its ``poses``, without a report.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import count
from statistics import median
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe import Driver, Problem, Sweep, load
from mechdae.errors import InputError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.high_precision import LONG, evaluate
from mechdae.kernels.stored.folder import VARIABLE
from mechdae.motion.kinematics.prepared import SHAPES, Run, Setting, prepare
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.bench.runs import yardstick
from mechdae.records import dataclass
from mechdae.tasks import Solver
from mechdae.tasks.solve import solve
from mechdae.types import Floats, Integers, Json, Unknowns

SIZES = (1, 100, 1_000, 10_000, 100_000)
QUICK_SIZES = (100, 1_000)
COMPARED, QUICK_COMPARED = 10_000, 1_000
"""Number of poses at which slow methods are measured beside."""
SAMPLES = 400
SHARE = 1e-6
"""By which a dimension changes from call to call, as a share of it."""
FIRST, AGAIN, WARM = "md.solve, first", "md.solve, again", "md.Solver"
ARRAYS = "md.Solver.poses"
OURS = (FIRST, AGAIN, WARM, ARRAYS)
TASK = "measured"
Way = Callable[[], Any]


def true_error(graphs: Graphs, x: Floats, u: Floats, p: Floats) -> Floats:
    """Return the distance of each unknown from the exact solution, (n, nx).

    Block after block: J step = F - F_z step of earlier blocks.
    """
    scene = graphs.scene
    residual = ca.vertcat(*[graph.F for graph in graphs.blocks])
    F = ca.Function("F", [scene.x, scene.u, scene.model.p], [ca.densify(residual)])
    wide = np.tile(np.asarray(p, LONG), (len(x), 1))
    values = evaluate(F, [np.asarray(x, LONG), np.asarray(u, LONG), wide])
    steps = np.zeros((len(x), graphs.nx))
    first = 0
    for graph in graphs.blocks:
        rows = slice(first, first + graph.F.numel())
        first = rows.stop
        for k in range(len(x)):
            _, J, Fz = graph.value_at(x[k], u[k], p)
            gap = values[k, rows].astype(float) - Fz @ steps[k, graph.uses]
            square = J.shape[0] == J.shape[1]
            steps[k, graph.own] = np.linalg.solve(J, gap) if square else np.linalg.lstsq(J, gap)[0]
    return np.abs(steps)


@dataclass(frozen=True)
class Other:
    """Another way to the same poses, and the error of what it returns."""

    method: str
    setting: str
    way: Way
    error: Callable[[Any], float]


@dataclass(frozen=True)
class SweepWork:
    """A sweep to be measured: a problem, a task of it, the dimension that changes, if any."""

    name: str
    problem: Problem
    task: Sweep
    changed: str | None = None

    def of(self, n: int) -> Sweep:
        """Return the task with so many poses; a single one is a third of the way along."""
        driver = self.task.all_drivers[0]
        low, high = driver.from_, driver.to
        if n > 1 or not isinstance(low, float) or not isinstance(high, float):
            return replace(self.task, poses=n)
        alone = replace(driver, at=(low + (high - low) / 3,), from_=None, to=None)
        return replace(self.task, driver=alone, poses=None)


Others = Callable[[SweepWork, Setting, Run], Iterable[Other]]


def standard() -> list[SweepWork]:
    """Return the standard works: four-bar, seven-link, Jansen leg, with the outputs of default."""
    turn = 0.0, 2 * np.pi
    return [
        work("four-bar-crank-rocker", turn, "b", a=0.048, b=0.09, c=0.08, d=0.1),
        work("gorshkov-seven-link", (-0.8, 0.8), "BC"),
        work("jansen-leg", turn, "b"),
    ]


def spatial() -> SweepWork:
    """Return a spatial four-bar over a turn: rocker angle and the ball joint it carries.

    The frame of the bar, which spins freely, and orientations are not asked for.
    """
    driver = Driver("A.angle", from_=0.0, to=2 * np.pi, speed=1.0)
    return SweepWork("rssr", load("rssr"), Sweep(driver, outputs=("D.angle", "rocker.C")), "l")


def work(name: str, between: tuple[float, float], changed: str, **numbers: float) -> SweepWork:
    """Return the sweep of a problem between two values of its crank."""
    problem = load(name).with_values(numbers)
    driver = Driver("crank.angle", from_=between[0], to=between[1], speed=1.0)
    return SweepWork(name, problem, Sweep(driver), changed)


def work_of(problem: Problem) -> SweepWork:
    """Return the first sweep of a problem with a single driver, as it is."""
    for name, task in problem.tasks.items():
        if type(task) is Sweep and len(task.all_drivers) == 1 and task.all_drivers[0].at is None:
            return SweepWork(f"{problem.name} {name}", problem, task)
    raise InputError(f"problem '{problem.name}' has no sweep of one driver to measure")


@contextmanager
def nothing_kept() -> Any:
    """Forget what was built for structures, and let kernels on disk alone meanwhile."""
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "0"
    SHAPES.clear()
    try:
        yield
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


def sets_of(problem: Problem, changed: str | None) -> Iterator[dict[str, float]]:
    """Yield another value of a dimension for each call, nothing where none is to change."""
    value = problem.mechanism.values()[changed] if changed else 0.0
    for k in count(1):
        yield {changed: value * (1 + SHARE * k)} if changed else {}


def timed_first(way: Way) -> float:
    """Return the seconds of a call that has nothing kept."""
    with nothing_kept():
        begin = time.process_time()
        way()
        return time.process_time() - begin


def measure(
    item: SweepWork,
    sizes: tuple[int, ...],
    repeats: int = 7,
    others: Others | None = None,
) -> list[Json]:
    """Return one record per size and method: work, method, n, ratio, yardstick, error, seconds.

    ``seconds`` is that of a call from the problem to the result: path, poses, velocities,
    accelerations, certificates and bounds of all bodies and points. ``error`` is the largest
    true error of an unknown [rad, or lengths of the mechanism] over a sample of the poses,
    ``allowed`` two units in the last place of it plus 1e-15, ``bound`` the certified bound.
    `others` are measured beside.
    """
    solve(load("slider-crank"), "turn")  # imports are no part of a first call
    records: list[Json] = []
    for n in sizes:
        task = item.of(n)
        problem = item.problem.with_task(TASK, task)
        stick = partial(yardstick, np.linspace(0, 2 * np.pi, n))
        timed = calls(problem, TASK, sets_of(problem, item.changed), stick, repeats)
        setting = prepare(problem, task)
        found = run(setting, task)
        if setting.graphs.single:
            numbers = sets_of(problem, item.changed)
            timed[ARRAYS] = as_arrays(Solver(problem, TASK), numbers, found.poses.s, stick, repeats)
        poses, rows = found.poses, _sample(found.poses)
        error, allowed = unknowns_error(setting, poses.x[rows], poses.s[rows])
        common = {
            "work": item.name, "setting": "", "n": n, "error": error, "allowed": allowed,
            "not_ok": int((~poses.alive.all(axis=1)).sum()),
            "bound": max(map(float, map(np.nanmax, poses.bounds().values())), default=0.0),
        }  # fmt: skip
        records += [{**common, "method": method, **timing(*both)} for method, both in timed.items()]
        for other in others(item, setting, found) if others is not None else ():
            both = interleaved(other.way, stick, max(1, repeats // 2))
            records.append(
                {
                    "work": item.name, "method": other.method, "setting": other.setting, "n": n,
                    "error": other.error(other.way()), **timing(*both),
                }
            )  # fmt: skip
    return records


def calls(
    problem: Problem, task: str, numbers: Iterator[dict[str, Any]], stick: Way, repeats: int
) -> dict[str, tuple[float, float]]:
    """Return the medians of each way of calling a task and of the yardstick, run in turn."""
    first = timed_first(partial(solve, problem, task))
    solver = Solver(problem, task)
    again = interleaved(lambda: solve(problem, task, set=next(numbers)), stick, repeats)
    warm = interleaved(lambda: solver(next(numbers)), stick, repeats)
    return {FIRST: (first, again[1]), AGAIN: again, WARM: warm}


def as_arrays(
    solver: Solver, numbers: Iterator[dict[str, Any]], u: Floats, stick: Way, repeats: int
) -> tuple[float, float]:
    """Return the medians of a solver's poses at driver values `u` and of the yardstick."""
    solver.poses({}, u)
    return interleaved(lambda: solver.poses(next(numbers), u), stick, repeats)


def timing(seconds: float, stick: float) -> dict[str, float]:
    """Return the part of a record that is a time."""
    return {"seconds": seconds, "yardstick": stick, "ratio": seconds / stick}


def interleaved(ours: Way, theirs: Way, repeats: int) -> tuple[float, float]:
    """Return median processor seconds of two functions called in turn, each once before."""
    times: tuple[list[float], list[float]] = ([], [])
    for k in range(repeats + 1):
        for function, seconds in zip((ours, theirs), times, strict=True):
            start = time.process_time()
            function()
            if k:
                seconds.append(time.process_time() - start)
    return median(times[0]), median(times[1])


def _sample(poses: Any) -> Integers:
    rows = np.flatnonzero(poses.alive.all(axis=1) & ~poses.at_limit)
    return rows[:: max(1, len(rows) // SAMPLES)]


def unknowns_error(setting: Setting, x: Unknowns, s: Floats) -> tuple[float, float]:
    """Return the largest true error of the unknowns `x` (k, nx) at `s`, and what is allowed."""
    if not x.shape[1]:
        return 0.0, 1e-15
    angle = setting.scene.unknowns.turns
    unit = np.where(angle, 1.0, setting.scene.model.mechanism.scale)
    error = true_error(setting.graphs, x, s[:, None], setting.assembler.p) / unit
    allowed = 2 * np.spacing(np.maximum(1.0, np.abs(x / unit))) + 1e-15
    worst = np.unravel_index(np.argmax(error / allowed), error.shape)
    return float(error[worst]), float(allowed[worst])


def table(records: list[Json]) -> str:
    lines = [
        f"{'work':44} {'poses':>8} {'ms':>9} {'ns/pose':>9} {'x yardstick':>12} {'error':>9} "
        f"{'bound':>9}"
    ]
    work = ""
    for r in records:
        if r["work"] != work:
            work = r["work"]
            lines.append(work)
        name = ", ".join(word for word in (r["method"], r["setting"]) if word)
        bound = f"{r['bound']:9.1e}" if "bound" in r else ""
        lines.append(
            f"  {name:42} {r['n']:8d} {r['seconds'] * 1e3:9.2f} "
            f"{r['seconds'] / r['n'] * 1e9:9.0f} {r['ratio']:12.2f} "
            f"{r['error']:9.1e} {bound}".rstrip()
        )
    last = records[-1]
    lines.append(
        f"yardstick: closed-form four-bar in NumPy, "
        f"{last['yardstick'] / last['n'] * 1e9:.0f} ns/pose at {last['n']} poses; "
        f"medians of interleaved runs"
    )
    lines.append(
        "md.solve, md.Solver: from the problem to the result with rates, certificates and bounds; "
        "first: nothing kept, again and md.Solver: another value of a dimension"
    )
    return "\n".join(lines)

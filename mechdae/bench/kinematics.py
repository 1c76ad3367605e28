"""Sweeps against the yardstick: medians of interleaved runs, error beside time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from statistics import median
from typing import Any

import numpy as np

from mechdae.bench.extended import true_error
from mechdae.bench.yardstick import yardstick
from mechdae.describe.file.load import load
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.errors import InputError
from mechdae.kinematics.prepared import Run, Setting, prepare
from mechdae.kinematics.sweep import run

SIZES = (1_000, 10_000, 100_000)
QUICK_SIZES = (1_000, 10_000)
COMPARED, QUICK_COMPARED = 10_000, 1_000
"""Number of poses at which other methods are measured beside."""
SAMPLES = 400

Others = Callable[[Setting, Run], Iterable[tuple[str, Callable[[], Any]]]]


@dataclass(frozen=True)
class SweepWork:
    """A sweep to be measured: a problem, the interval of its driver, what is asked for."""

    name: str
    problem: Problem
    task: Sweep


def standard() -> list[SweepWork]:
    """Return the standard works: four-bar, seven-link, Jansen leg."""
    return [
        work(
            "four-bar-crank-rocker",
            "crank.angle",
            0.0,
            2 * np.pi,
            ("coupler.angle", "rocker.angle"),
        ),
        work("gorshkov-seven-link", "crank.angle", -0.8, 0.8, None),
        work("jansen-leg", "crank.angle", 0.0, 2 * np.pi, None),
    ]


def work(
    name: str, driver: str, low: float, high: float, outputs: tuple[str, ...] | None
) -> SweepWork:
    """Return the sweep of a problem; without outputs the angles of all its bodies."""
    problem = load(name)
    if outputs is None:
        outputs = tuple(
            f"{body}.angle" for body in problem.mechanism.bodies if f"{body}.angle" != driver
        )
    return SweepWork(name, problem, Sweep(Driver(driver, from_=low, to=high), outputs=outputs))


def work_of(problem: Problem) -> SweepWork:
    """Return the first sweep of a problem with a single driver, as it is."""
    for name, task in problem.tasks.items():
        if type(task) is Sweep and len(task.all_drivers) == 1 and task.all_drivers[0].at is None:
            return SweepWork(f"{problem.name} {name}", problem, task)
    raise InputError(f"problem '{problem.name}' has no sweep of one driver to measure")


def measure(
    item: SweepWork,
    sizes: tuple[int, ...],
    repeats: int = 7,
    compared: int | None = None,
    others: Others | None = None,
) -> list[dict[str, Any]]:
    """Return one record per size: work, method, n, ratio, yardstick, error, seconds.

    ``seconds`` is the median of a sweep with its kernels built: path, poses, velocities,
    accelerations, certificates and bounds. ``first`` adds the building; ``error`` is the
    largest true error of an unknown [rad, or lengths of the mechanism] over a sample of the
    poses, ``allowed`` two units in the last place of it plus 1e-15, ``bound`` the certified
    bound. At the size `compared` `others` are measured too: name and function of ways to get the
    positions, of a sweep that was prepared and followed.
    """
    records: list[dict[str, Any]] = []
    for n in sizes:
        task = replace(item.task, poses=n)
        start = time.perf_counter()
        setting = prepare(item.problem, task)
        result = run(setting, task)
        first = time.perf_counter() - start
        u = np.linspace(0, 2 * np.pi, n)
        ours, theirs = interleaved(partial(run, setting, task), partial(yardstick, u), repeats)
        poses = result.poses
        rows = _sample(poses)
        error, allowed = _error(setting, poses.x[rows], poses.s[rows])
        records.append(
            {
                "work": item.name,
                "method": "certified",
                "setting": "",
                "n": n,
                "ratio": ours / theirs,
                "yardstick": theirs,
                "error": error,
                "seconds": ours,
                "first": first,
                "allowed": allowed,
                "bound": max((float(np.nanmax(own)) for own in poses.bounds.values()), default=0.0),
                "not_ok": int((~poses.alive.all(axis=1)).sum()),
            }
        )
        if others is None or n != compared or not len(rows) or records[-1]["not_ok"]:
            continue
        for name, way in others(setting, result):
            method, _, chosen = name.partition(", ")
            ours, theirs = interleaved(way, partial(yardstick, u), max(1, repeats // 2))
            records.append(
                {
                    "work": item.name,
                    "method": method,
                    "setting": chosen,
                    "n": n,
                    "ratio": ours / theirs,
                    "yardstick": theirs,
                    "error": _error(setting, way()[rows], poses.s[rows])[0],
                    "seconds": ours,
                }
            )
    return records


def interleaved(
    ours: Callable[[], Any], theirs: Callable[[], Any], repeats: int
) -> tuple[float, float]:
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(repeats):
        for function, kept in zip((ours, theirs), times, strict=True):
            start = time.perf_counter()
            function()
            kept.append(time.perf_counter() - start)
    return median(times[0]), median(times[1])


def _sample(poses: Any) -> Any:
    rows = np.flatnonzero(poses.alive.all(axis=1) & ~poses.at_limit)
    return rows[:: max(1, len(rows) // SAMPLES)]


def _error(setting: Setting, x: Any, s: Any) -> tuple[float, float]:
    """Return the largest true error of the unknowns `x` (k, nx) at `s`, and what is allowed."""
    if not x.shape[1]:
        return 0.0, 1e-15
    angle = setting.scene.unknowns.turns
    unit = np.where(angle, 1.0, setting.scene.model.mechanism.scale)
    error = true_error(setting.graphs, x, s[:, None], setting.assembler.p) / unit
    allowed = 2 * np.spacing(np.maximum(1.0, np.abs(x / unit))) + 1e-15
    worst = np.unravel_index(np.argmax(error / allowed), error.shape)
    return float(error[worst]), float(allowed[worst])


def table(records: list[dict[str, Any]]) -> str:
    """Return the records as text."""
    lines = [
        f"{'work':44} {'poses':>8} {'ms':>9} {'ns/pose':>9} {'x yardstick':>12} "
        f"{'first ms':>9} {'error':>9} {'bound':>9}"
    ]
    for r in records:
        name = r["work"] if r["method"] == "certified" else f"  {r['method']}, {r['setting']}"
        first = f"{r['first'] * 1e3:9.1f}" if "first" in r else " " * 9
        bound = f"{r['bound']:9.1e}" if "bound" in r else ""
        lines.append(
            f"{name:44} {r['n']:8d} {r['seconds'] * 1e3:9.2f} "
            f"{r['seconds'] / r['n'] * 1e9:9.0f} {r['ratio']:12.2f} {first} "
            f"{r['error']:9.1e} {bound}".rstrip()
        )
    last = records[-1]
    if any(r["method"] != "certified" for r in records):
        lines.append("interpolated, rootfinder: positions only, without certificate")
    lines.append(
        f"yardstick: closed-form four-bar in NumPy, "
        f"{last['yardstick'] / last['n'] * 1e9:.0f} ns/pose at {last['n']} poses; "
        f"medians of interleaved runs"
    )
    lines.append(
        "each sweep: positions, velocities, accelerations, certificates and bounds, 'first' builds "
        "the kernels too"
    )
    return "\n".join(lines)

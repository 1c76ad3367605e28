"""Measures and forces of many sets at once: mechanisms a second, and how far from the set alone.

``python -m benchmarks.batches --out docs/data/batches.json --page PAGE`` measures and
writes its table of docs/theory/evidence/solver.md.
Seconds are processor time of one process; a difference is
relative to the largest number of its path in the set.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

import mechdae as md
from benchmarks.forces import problem as four_bar_with_masses
from benchmarks.written import arguments, written
from mechdae.design.studies.rows import Computer, row_of

SETS, POSES, CHECKED = 1024, 200, 24
BEGIN, END = "<!-- measures and forces -->", "<!-- end of measures and forces -->"
LENGTHS = ("crank.B.x", "coupler.C.x", "rocker.C.x", "rocker.mass")


def swept(name: str, measures: tuple[str, ...]) -> md.Problem:
    """Return a predefined problem with a turn of its driver and measures."""
    problem = md.load(name)
    task = next(task for task in problem.tasks.values() if type(task) is md.Sweep)
    driver = replace(task.all_drivers[0], range=None, at=None, from_=0.0, to=2 * np.pi)
    task = replace(task, driver=driver, poses=POSES, measures=measures)
    return md.Problem(problem.mechanism, {"task": task}, name=name)


def slider_crank() -> md.Problem:
    """Return the slider-crank with friction in its four joints, without the means of a cycle."""
    problem = md.load("slider-crank-friction")
    task = replace(problem.tasks["cycle"], poses=POSES, cycle=False)
    return md.Problem(problem.mechanism, {"task": task}, name=problem.name)


def four_bar(friction: str) -> md.Problem:
    """Return the four-bar with masses, a torque, and friction in four pins."""
    problem = four_bar_with_masses(POSES, friction)
    return md.Problem(problem.mechanism, {"task": problem.tasks["forces"]}, name="four-bar")


def cases() -> Iterable[tuple[str, md.Problem, tuple[str, ...], float, tuple[str, ...]]]:
    """Yield title, problem, varied numbers, their share, paths."""
    yield (
        "four-bars: least transmission angle, time ratio, swing",
        swept("four-bar-crank-rocker", ("transmission", "time-ratio")), tuple("abcd"), 0.05,
        ("summary/transmission/C/min", "summary/time_ratio/rocker", "summary/swing/rocker"),
    )  # fmt: skip
    yield (
        "Jansen legs: length of the foot's path, its height",
        swept("jansen-leg", ("curve", "extremes")), tuple("abcdefghijklm"), 0.003,
        ("summary/curve/lower.P/length", "summary/extremes/lower.P.y/max/value"),
    )  # fmt: skip
    forces = ("efforts/crank.angle", "joints/C/reaction")
    yield "four-bars: effort, a reaction", four_bar("none"), LENGTHS, 0.03, forces
    text = "four-bars: the same with friction in four pins, coupled"
    yield text, four_bar("coupled"), LENGTHS, 0.03, forces
    text = "slider-cranks: the same with friction in four joints, coupled"
    yield text, slider_crank(), ("r", "l", "f", "f_slide"), 0.1, forces


def measured(
    title: str, problem: md.Problem, names: tuple[str, ...], share: float, paths: tuple[str, ...]
) -> dict[str, Any]:
    """Return the figures of one case."""
    base, rng = problem.mechanism.values(), np.random.default_rng(2)
    sets = np.stack([base[n] * (1 + share * rng.uniform(-1, 1, SETS)) for n in names], axis=1)
    computer = Computer(problem, "task", paths, names)
    computer(sets[:64])
    begun = time.process_time()
    found = computer(sets)
    together = time.process_time() - begun
    chosen = range(0, SETS, SETS // CHECKED)
    row_of(problem, "task", paths, dict(zip(names, sets[0].tolist(), strict=True)))
    begun, largest = time.process_time(), 0.0
    rows = {}
    for k in chosen:
        rows[k] = row_of(problem, "task", paths, dict(zip(names, sets[k].tolist(), strict=True)))
    single = (time.process_time() - begun) / len(rows)
    for k, row in rows.items():
        if found.status[k] != row.status or row.values is None:
            largest = float("inf")
            continue
        for own, value in zip(found.values, row.values, strict=True):
            gap = np.abs(own[k] - value).max() / np.abs(value).max()
            largest = max(largest, float(gap))
    return {
        "work": title, "sets": SETS, "poses": POSES, "per_second": SETS / together,
        "one_by_one": 1 / single, "alone": SETS - found.together, "error": largest,
    }  # fmt: skip


def page(records: list[dict[str, Any]]) -> str:
    """Return the table of the page."""
    heads = (
        f"{SETS} sets, {POSES} poses each", "mechanisms/s at once", "one by one", "alone",
        "row against the set alone",
    )  # fmt: skip
    lines = [heads, ("---",) * len(heads)]
    for own in records:
        lines.append((
            own["work"], f"{own['per_second']:.0f}", f"{own['one_by_one']:.0f}",
            f"{own['alone']}", f"{own['error']:.1g}",
        ))  # fmt: skip
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def main() -> None:
    """Measure, write the figures and the table."""
    parser = argparse.ArgumentParser(description="measures and forces of many sets at once")
    arguments(parser)
    options = parser.parse_args()
    records = [measured(*case) for case in cases()]
    written(options, records, page(records), BEGIN, END)


if __name__ == "__main__":
    main()

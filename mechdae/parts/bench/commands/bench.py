"""``mechdae bench [P]``."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae.cli import message
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.describe import Problem
    from mechdae.types import Json


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("problem", nargs="?", metavar="P", help="default: the standard works")
    parser.add_argument("--quick", action="store_true", help="fewer poses and repeats")
    parser.add_argument("--out", metavar="DIR", help="write bench.json and pictures there")


@dataclass(frozen=True)
class Beside:
    """Measurements that are not part of the package, see the folder ``benchmarks``."""

    poses: Any
    motions: Any
    more: Any


def run(options: argparse.Namespace, beside: Beside | None = None) -> int:
    from mechdae.describe import load
    from mechdae.parts.bench import kinematics as bench
    from mechdae.parts.bench.runs import BenchRun

    problem = load(options.problem) if options.problem else None
    kinds = set() if problem is None else {task.kind for task in problem.tasks.values()}
    if problem is None:
        works = [*bench.standard(), bench.spatial()]
    elif "sweep" in kinds or not kinds & {"synthesis", "motion"}:
        works = [bench.work_of(problem)]
    else:
        works = []
    sizes, repeats = (bench.QUICK_SIZES, 3) if options.quick else (bench.SIZES, 7)
    measured = BenchRun(Path(options.out) / "bench.json" if options.out else None)
    moving: list[Json] = []
    for item in works:
        message(f"measuring {item.name}", options.quiet)
        planar = item.problem.mechanism.dimension == 2
        others = beside.poses if beside is not None and planar else None
        moving += measured.add(bench.measure(item, sizes, repeats, others))
    if moving:
        print(bench.table(moving))
    names = [] if problem is None else list(problem.tasks.items())
    design = next((name for name, task in names if task.kind == "synthesis"), None)
    if problem is not None and design is not None:
        measured.add(_starts(problem, design, options))
    released = []
    if problem is not None and "motion" in kinds:
        released = measured.add(_motion(problem, options, beside))
    if problem is None:
        measured.add(_tasks(options))
        measured.add(_chains(options))
        if beside is not None:
            for part in beside.more(options.quick, partial(message, quiet=options.quiet)):
                measured.add(part)
    if options.out:
        message(f"written: {measured.path}", options.quiet)
        _draw(options, moving, released)
    return 0


def _tasks(options: argparse.Namespace) -> list[dict[str, object]]:
    """Measure whole tasks, print and return the records."""
    from mechdae.parts.bench import tasks

    message("measuring whole tasks", options.quiet)
    works = tasks.QUICK_WORKS if options.quick else tasks.WORKS
    sets = tasks.QUICK_SETS if options.quick else tasks.SETS
    found = tasks.measure(works, 3 if options.quick else 7, sets)
    print(tasks.table(found))
    return found


def _draw(options: argparse.Namespace, moving: list[Json], released: list[dict[str, Any]]) -> None:
    """Write pictures of sweeps and of motions."""
    from mechdae.draw import save
    from mechdae.parts.bench.drawn.speed import draw, draw_precision

    folder = Path(options.out)
    for name, make, shown in (
        ("bench", draw, moving),
        ("bench-motion", draw_precision, released),
    ):
        if shown:
            picture = save(make(shown), folder / f"{name}.svg")
            message(f"written: {picture}", options.quiet)


def _chains(options: argparse.Namespace) -> list[dict[str, object]]:
    """Measure chains of four-bars, print and return the records."""
    from mechdae.parts.bench import chain

    message("measuring chains of four-bars", options.quiet)
    loops = chain.QUICK_LOOPS if options.quick else chain.LOOPS
    grown = chain.scaling(loops, repeats=3 if options.quick else 5)
    print(chain.table(grown))
    return grown


def _starts(problem: Problem, design: str, options: argparse.Namespace) -> list[dict[str, object]]:
    """Measure the starts of a synthesis, print and return the records."""
    from mechdae.parts.bench import jobs

    message("measuring starts in one process and in several", options.quiet)
    spread = jobs.measure(problem, design, jobs.QUICK_STARTS if options.quick else jobs.STARTS)
    print(jobs.table(spread))
    return spread


def _motion(
    problem: Problem, options: argparse.Namespace, beside: Beside | None
) -> list[dict[str, object]]:
    """Measure the first task of motion, print and return the records."""
    from mechdae.parts.bench import motions

    work = motions.work_of(problem)
    assert work is not None
    message(f"measuring {work.name}", options.quiet)
    tolerances = motions.QUICK_TOLERANCES if options.quick else motions.TOLERANCES
    repeats = 3 if options.quick else 7
    others = beside.motions if beside is not None else None
    records, notes = motions.measure(work, tolerances, repeats, others)
    print(motions.table(records, notes))
    return records

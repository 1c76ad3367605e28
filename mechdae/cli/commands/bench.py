"""``mechdae bench [P]``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae.cli import message

if TYPE_CHECKING:
    from mechdae.describe.file.problem import Problem


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("problem", nargs="?", metavar="P", help="default: the standard works")
    parser.add_argument("--quick", action="store_true", help="fewer poses and repeats")
    parser.add_argument("--out", metavar="DIR", help="write bench.json and pictures there")


def _design_task(problem: Problem | None) -> str | None:
    """Return the first task of synthesis; loads what solves it only where there is one."""
    names = [] if problem is None else list(problem.tasks.items())
    return next((name for name, task in names if task.kind == "synthesis"), None)


def run(options: argparse.Namespace) -> int:
    from mechdae.bench import chain, forces
    from mechdae.bench import kinematics as bench
    from mechdae.describe.file.load import load

    problem = load(options.problem) if options.problem else None
    design = _design_task(problem)
    kinds = set() if problem is None else {task.kind for task in problem.tasks.values()}
    if problem is None:
        works = bench.standard()
    elif "sweep" in kinds or not kinds & {"synthesis", "motion"}:
        works = [bench.work_of(problem)]
    else:
        works = []
    sizes, repeats = (bench.QUICK_SIZES, 3) if options.quick else (bench.SIZES, 7)
    compared = bench.QUICK_COMPARED if options.quick else bench.COMPARED
    records = []
    for item in works:
        message(f"measuring {item.name}", options.quiet)
        records += bench.measure(item, sizes, repeats, compared)
    if records:
        print(bench.table(records))
    if problem is not None and design is not None:
        from mechdae.bench import jobs

        message("measuring starts in one process and in several", options.quiet)
        starts = jobs.QUICK_STARTS if options.quick else jobs.STARTS
        spread = jobs.measure(problem, design, starts)
        print(jobs.table(spread))
        records += spread
    released = []
    if problem is not None and "motion" in kinds:
        released = _motion(problem, options)
        records += released
    if not options.problem:
        message("measuring chains of four-bars", options.quiet)
        loops = chain.QUICK_LOOPS if options.quick else chain.LOOPS
        grown = chain.scaling(loops, repeats=3 if options.quick else 5)
        print(chain.table(grown))
        records += grown
        message("measuring forces", options.quiet)
        loaded, notes = forces.measure(sizes, repeats, compared)
        print(forces.table(loaded, notes))
        records += loaded
    if options.out:
        folder = Path(options.out)
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "bench.json"
        path.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
        message(f"written: {path}", options.quiet)
        moving = [r for r in records if "loops" not in r and "task" not in r]
        if any(record["method"] != "certified" for record in moving):
            from mechdae.draw import save
            from mechdae.draw.speed import draw

            picture = save(draw(moving), folder / "bench.svg")
            message(f"written: {picture}", options.quiet)
        if released:
            from mechdae.draw import save
            from mechdae.draw.precision import draw as draw_motion

            picture = save(draw_motion(released), folder / "bench-motion.svg")
            message(f"written: {picture}", options.quiet)
    return 0


def _motion(problem: Problem, options: argparse.Namespace) -> list[dict[str, Any]]:
    """Measure the first task of motion, print and return the records."""
    from mechdae.bench import motions

    work = motions.work_of(problem)
    assert work is not None
    message(f"measuring {work.name}", options.quiet)
    tolerances = motions.QUICK_TOLERANCES if options.quick else motions.TOLERANCES
    records, notes = motions.measure(work, tolerances, repeats=3 if options.quick else 7)
    print(motions.table(records, notes))
    return records

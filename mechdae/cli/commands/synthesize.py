"""``mechdae synthesize P``."""

from __future__ import annotations

import argparse
import os
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae.cli import message
from mechdae.cli.options import (
    check_processes,
    problem_arguments,
    problem_of,
    process_arguments,
    units_argument,
    units_asked,
)
from mechdae.cli.progress import check_out, clear, reported, starts_progress
from mechdae.cli.progress import progress as parts_progress
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.results import Result


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument("--task", metavar="T", help="the task; default: the first of this kind")
    parser.add_argument("--starts", type=int, metavar="N", help="number of starts")
    parser.add_argument("--seed", type=int, metavar="S", help="of the random numbers")
    process_arguments(parser)
    units_argument(parser)
    parser.add_argument(
        "--out", metavar="DIR", help="write results and designs there; a broken off job goes on"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run(options: argparse.Namespace) -> int:
    for word, least in (("starts", 1), ("seed", 0)):
        value = getattr(options, word)
        if value is not None and value < least:
            raise InputError(f"a whole number, {least} or more, is needed", where=f"--{word}")
    check_processes(options)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    units = units_asked(options)
    return reported(_result(options).in_units(units), options)


def _result(options: argparse.Namespace) -> Result:
    from mechdae.design.jobs.distribute import cluster
    from mechdae.tasks.designing import designing_task, synthesize
    from mechdae.tasks.dispatch.solve import KINDS

    problem = problem_of(options)
    name, task = designing_task(problem, options.task)
    check_out(options.out, problem, name, task.kind)
    log = KINDS[task.kind].log
    word = log.partition(".")[0]
    show = starts_progress(options.quiet, word)
    starts = []

    def progress(done: int, total: int, best: float | None) -> None:
        starts.append(total)
        if show is not None:
            show(done, total, best)

    place: Any = cluster(options.cluster) if options.cluster else nullcontext()
    try:
        with place as executor:
            result = synthesize(
                problem,
                name,
                starts=options.starts,
                seed=options.seed,
                workers=options.workers,
                executor=executor,
                out=options.out,
                progress=progress,
                paths=parts_progress("parts of paths", options.quiet),
            )
    except BaseException:
        clear(show)
        if starts and options.out:
            finished = Path(options.out, log).read_bytes()
            text = f"{finished.count(10) - 1} of {starts[-1]} {word} are kept in {options.out}"
            message(f"mechdae: {text}; the same command goes on there", options.quiet)
        raise
    clear(show)
    return result

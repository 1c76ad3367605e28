"""``mechdae plot P``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of
from mechdae.errors import InputError, UnknownName

FORMATS = ("svg", "png", "pdf")


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument("--task", metavar="T", help="the task to draw (default: the first sweep)")
    parser.add_argument("--kind", default="diagram", metavar="K", help="diagram or plans")
    parser.add_argument(
        "--which",
        metavar="W",
        help="of the plans: velocity, acceleration, force, friction, lever (default: one page)",
    )
    parser.add_argument("--mode", metavar="LABEL", help="start on this assembly mode")
    parser.add_argument("--pose", type=int, metavar="K", help="number of the pose drawn, from 0")
    parser.add_argument("--out", default=".", metavar="DIR", help="folder of the picture")
    parser.add_argument("--format", default="svg", metavar="F", help=", ".join(FORMATS))


def run(options: argparse.Namespace) -> int:
    from mechdae.analysis.solve import solve
    from mechdae.draw import plot, save

    if options.format not in FORMATS:
        raise UnknownName("format", options.format, FORMATS)
    problem = problem_of(options)
    name = options.task
    if name is None:
        drawn = [n for n, task in problem.tasks.items() if task.available]
        sweeps = [n for n in drawn if problem.tasks[n].kind == "sweep"]
        if not drawn:
            raise InputError("no task that this version computes", where=f"{problem.name}: tasks")
        name = (sweeps or drawn)[0]
    kind = problem.task(name).kind
    if kind == "study":
        raise InputError(
            "a study has no pose to draw",
            where=f"tasks.{name}",
            hint=f"--task {problem.tasks[name].of} with --set",  # type: ignore[attr-defined]
        )
    result = _with_all_bodies(problem, solve(problem, name, mode=options.mode), options.mode)
    extra = {} if options.pose is None else {"pose": options.pose}
    word = options.kind
    if options.which is not None:
        if options.kind != "plans":
            raise InputError("only plans have --which", hint="--kind plans")
        extra["which"] = options.which
        word = options.which
    axes = plot(result, options.kind, **extra)
    folder = Path(options.out)
    folder.mkdir(parents=True, exist_ok=True)
    pose = "" if options.pose is None else f"-{options.pose}"
    path = folder / f"{problem.name}-{name}-{word}{pose}.{options.format}"
    save(axes, path)
    print(path)
    if result.fault:
        message(f"mechdae: task {name}: {result.fault}", False)
        return 1
    return 0


def _with_all_bodies(problem: Any, result: Any, mode: str | None) -> Any:
    """Return a result that holds every body of its scene, for a task that names outputs."""
    from dataclasses import replace

    from mechdae.analysis.solve import solve

    if result.definition.outputs is None:
        return result
    left_out = result.summary["not_in_scene"]
    bodies = tuple(body for body in problem.mechanism.bodies if body not in left_out)
    task = replace(result.definition, outputs=bodies)
    whole = problem.with_task(result.task, task)
    return solve(whole, result.task, mode=mode)

"""``mechdae plot P``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of
from mechdae.cli.pictures import DEFAULT, GRAPHS, options_for, prepared, task_for
from mechdae.errors import InputError, UnknownName

FORMATS = ("svg", "png", "pdf")


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument(
        "--task", metavar="T", help="the task to draw (default: the first that suits)"
    )
    parser.add_argument(
        "--kind",
        metavar="K",
        help="diagram, plans, curves, coupler, losses, map (default: diagram of a sweep or of "
        "modes, curves of reactions, map of a study)",
    )
    parser.add_argument(
        "--of", action="append", default=[], metavar="PATH", help="what graphs show; repeatable"
    )
    parser.add_argument("--polar", action="store_true", help="reactions in the plane")
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
    from mechdae.draw import KINDS, plot, save

    if options.format not in FORMATS:
        raise UnknownName("format", options.format, FORMATS)
    problem = problem_of(options)
    name = task_for(problem, options.task, options.kind)
    study = problem.task(name).kind == "study"
    usual = DEFAULT.get(problem.task(name).kind, "diagram")
    kind = options.kind or ("diagram" if options.pose is not None else usual)
    if kind not in KINDS:
        plot(None, kind)  # says which kinds there are
    if study and kind != "map":
        raise InputError(
            "a study has no pose to draw",
            where=f"tasks.{name}",
            hint=f"--task {problem.tasks[name].of} with --set",  # type: ignore[attr-defined]
        )
    extra = options_for(kind, options.of, options.polar)
    word = f"{kind}-polar" if options.polar else kind
    if options.which is not None:
        if kind != "plans":
            raise InputError("only plans have --which", hint="--kind plans")
        extra["which"] = word = options.which
    if options.pose is not None:
        if kind in GRAPHS:
            raise InputError(f"{kind} shows all poses", where="--pose")
        extra["pose"] = options.pose
    problem = prepared(problem, name, kind, options.of)
    result = solve(problem, name, mode=None if study else options.mode)
    if kind not in GRAPHS:
        result = _with_all_bodies(problem, result, options.mode)
    axes = plot(result, kind, **extra)
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

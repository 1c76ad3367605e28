"""``mechdae plot P``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of
from mechdae.cli.pictures import (
    DEFAULT,
    DESIGNS,
    GRAPHS,
    check_suits,
    options_for,
    prepared,
    task_for,
)
from mechdae.cli.progress import progress
from mechdae.errors import InputError, MechdaeError, UnknownName

FORMATS = ("svg", "png", "pdf")
STYLED = ("diagram", "animation")
"""Kinds with dark paper and words in other languages."""
NAMED = (*STYLED, *DESIGNS)
"""Kinds with words in other languages."""


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument(
        "--task", metavar="T", help="the task to draw (default: the first that suits)"
    )
    parser.add_argument(
        "--kind",
        metavar="K",
        help="diagram, animation, plans, curves, coupler, losses, map; of a synthesis design, "
        "compare, convergence, census (default: diagram of a sweep or of modes, curves of "
        "reactions, map of a study, design of a synthesis; diagram with --pose, --dark, --lang)",
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
    parser.add_argument(
        "--design", type=int, metavar="K", help="number of the design drawn, 1: the best"
    )
    parser.add_argument("--out", default=".", metavar="DIR", help="folder of the picture")
    parser.add_argument("--format", metavar="F", help=f"{', '.join(FORMATS)}; animations gif")
    parser.add_argument("--dark", action="store_true", help="colours for dark paper")
    parser.add_argument("--lang", default="en", metavar="L", help="language of the words: en, ru")


def run(options: argparse.Namespace) -> int:
    from mechdae.analysis.solve import solve
    from mechdae.draw import KINDS, plot, save

    moving = options.kind == "animation"
    form, formats = options.format or ("gif" if moving else "svg"), ("gif",) if moving else FORMATS
    if form not in formats:
        raise UnknownName("format", form, formats)
    if moving and options.pose is not None:
        raise InputError("an animation shows all poses", where="--pose")
    _check_folder(options.out)
    problem = problem_of(options)
    name = task_for(problem, options.task, options.kind)
    study = problem.task(name).kind == "study"
    usual = DEFAULT.get(problem.task(name).kind, "diagram")
    poses = problem.task(name).kind not in ("study", "synthesis")
    posed = options.pose is not None or (poses and _styled(options))
    kind = options.kind or ("diagram" if posed else usual)
    if kind not in KINDS:
        plot(None, kind)  # says which kinds there are
    if study and kind != "map":
        raise InputError(
            "a study has no pose to draw",
            where=f"tasks.{name}",
            hint=f"--task {problem.tasks[name].of} with --set",  # type: ignore[attr-defined]
        )
    check_suits(problem, name, kind, options.mode)
    extra = options_for(kind, options.of, options.polar)
    word = f"{kind}-polar" if options.polar else kind
    if options.which is not None:
        if kind != "plans":
            raise InputError("only plans have --which", hint="--kind plans")
        extra["which"] = word = options.which
    if options.design is not None:
        if kind != "design" or options.design < 1:
            raise InputError("a number from 1, for --kind design", where="--design")
        extra["design"] = options.design - 1
        word = f"{word}-{options.design}"
    if options.pose is not None:
        if kind in (*GRAPHS, *DESIGNS):
            raise InputError(f"{kind} shows all poses", where="--pose")
        extra["pose"] = options.pose
    problem = prepared(problem, name, kind, options.of)
    result = solve(problem, name, mode=None if study else options.mode)
    if kind == "design" and not options.kind and not result.data["designs"]:
        kind = word = "census"
        extra = {}
    if kind not in (*GRAPHS, *DESIGNS):
        result = _with_all_bodies(problem, result, options.mode)
    picture = plot(result, kind, **extra, **_style(options, kind))
    folder = Path(options.out)
    folder.mkdir(parents=True, exist_ok=True)
    pose = "" if options.pose is None else f"-{options.pose}"
    path = folder / f"{problem.name}-{name}-{word}{pose}.{form}"
    if moving:
        picture.save(path, progress("frame", options.quiet))
    else:
        save(picture, path)
    print(path)
    if result.fault:
        message(f"mechdae: task {name}: {result.fault}", False)
        return 1
    return 0


def _check_folder(out: str) -> None:
    """Raise if a folder is called like a picture: somebody meant a file."""
    ending = Path(out).suffix.lower().lstrip(".")
    if ending in (*FORMATS, "gif") and not Path(out).is_dir():
        raise InputError(
            "a folder is meant: pictures are named after problem and task",
            where=f"--out {out}",
            hint=f"--out {Path(out).parent} --format {ending}",
        )


def _styled(options: argparse.Namespace) -> bool:
    """Return whether colours or words were asked for and nothing that only graphs have."""
    graph = bool(options.of) or options.polar
    return (options.dark or options.lang != "en") and not graph


def _style(options: argparse.Namespace, kind: str) -> dict[str, Any]:
    """Return the options of colours and words that were asked for."""
    asked = {"dark": options.dark} if options.dark else {}
    asked |= {"lang": options.lang} if options.lang != "en" else {}
    kinds = STYLED if options.dark else NAMED
    if asked and kind not in kinds:
        raise InputError(
            f"pictures of kind '{kind}' have no such option",
            where=f"--{' --'.join(asked)}",
            hint=f"kinds that have: {', '.join(kinds)}",
        )
    return asked


def _with_all_bodies(problem: Any, result: Any, mode: str | None) -> Any:
    """Return a result that holds every body, for a task that names outputs.

    Bodies that no output depends on are still named as not in the scene; where they spoil
    the task they are left out.
    """
    from dataclasses import replace

    from mechdae.analysis.solve import solve

    if result.definition.outputs is None:
        return result
    left_out = result.summary["not_in_scene"]
    bodies = tuple(body for body in problem.mechanism.bodies if body not in left_out)

    def with_outputs(outputs: tuple[str, ...] | None) -> Any:
        task = replace(result.definition, outputs=outputs)
        return solve(problem.with_task(result.task, task), result.task, mode=mode)

    if left_out:
        try:
            whole = with_outputs(None)
        except MechdaeError:
            whole = None
        if whole is not None and whole.fault == result.fault:
            whole.summary["not_in_scene"] = left_out
            return whole
    return with_outputs(bodies)

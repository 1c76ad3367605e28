"""``mechdae plot P``."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of
from mechdae.cli.pictures import check_suits, kind_for, left_out, options_for, prepared, task_for
from mechdae.cli.progress import progress
from mechdae.draw.options import DESIGNS, GRAPHS, OPTIONS
from mechdae.errors import AssemblyError, InputError, MechdaeError, SolveError, UnknownName

FORMATS = ("svg", "png", "pdf")
TYPES = {"whole": int, "number": float}


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
    parser.add_argument("--mode", metavar="LABEL", help="start on this assembly mode")
    parser.add_argument("--out", default=".", metavar="DIR", help="folder of the picture")
    parser.add_argument("--format", metavar="F", help=f"{', '.join(FORMATS)}; animations gif")
    for name, option in OPTIONS.items():
        about = f"{option.about} [{', '.join(option.kinds)}]"
        if option.what in ("on", "off"):
            flag = f"--{name}" if option.what == "on" else f"--no-{name}"
            parser.add_argument(
                flag, dest=name, action="store_const", const=option.what == "on", help=about
            )
        elif option.what == "names":
            parser.add_argument(f"--{name}", action="append", metavar="NAME", help=about)
        else:
            kind = TYPES.get(option.what, str)
            parser.add_argument(f"--{name}", type=kind, metavar=option.what.upper(), help=about)


def run(options: argparse.Namespace) -> int:
    from mechdae.draw import KINDS, plot

    asked = {name: getattr(options, name) for name in OPTIONS}
    asked = {name: value for name, value in asked.items() if value is not None}
    form = _form(options)
    _check_folder(options.out)
    problem = problem_of(options)
    name = task_for(problem, options.task, options.kind)
    kind = options.kind or kind_for(problem, name, asked)
    if kind not in KINDS:
        plot(None, kind)  # says which kinds there are
    check_suits(problem, name, kind, options.mode)
    extra = options_for(kind, asked)
    problem = prepared(problem, name, kind, asked.get("of", ()))
    try:
        result = _solved(problem, name, kind, options.mode)
    except AssemblyError as error:
        return _written_open(options, problem, name, error)
    pose = extra.get("pose")
    if kind == "diagram" and _not_assembled(result, pose):
        drawn = _opened(problem, name, result, pose)
        if drawn is not None:
            del extra["pose"]
            return _written(options, drawn, kind, extra, form, f"open-{pose}")
    if kind == "design" and not options.kind and not result.data["designs"]:
        kind, extra = "census", {}
    return _written(options, result, kind, extra, form)


def _form(options: argparse.Namespace) -> str:
    """Return the format of the file."""
    moving = options.kind == "animation"
    form, formats = options.format or ("gif" if moving else "svg"), ("gif",) if moving else FORMATS
    if form not in formats:
        raise UnknownName("format", form, formats)
    return str(form)


def _written(
    options: argparse.Namespace,
    result: Any,
    kind: str,
    extra: dict[str, Any],
    form: str,
    word: str = "",
) -> int:
    """Write the picture and say where it is; return the exit code."""
    from mechdae.draw import plot, save

    picture = plot(result, kind, **extra)
    folder = Path(options.out)
    folder.mkdir(parents=True, exist_ok=True)
    words = [result.problem, result.task, word or extra.get("which") or kind]
    words += ["polar"] if extra.get("polar") else []
    words += [str(extra["design"] + 1)] if "design" in extra else []
    words += [f"shape-{extra['shape']}"] if "shape" in extra else []
    words += [str(extra["pose"])] if "pose" in extra else []
    path = folder / f"{'-'.join(words)}.{form}"
    if kind == "animation":
        picture.save(path, progress("frame", options.quiet))
    else:
        save(picture, path)
    print(path)
    if result.fault:
        message(f"mechdae: task {result.task}: {result.fault}", False)
        return 1
    return 0


def _not_assembled(result: Any, pose: int | None) -> bool:
    """Return whether a pose was asked for that does not assemble."""
    there = pose is not None and -len(result.status) <= pose < len(result.status)
    return there and str(result.status[pose]) == "unassembled"


def _written_open(
    options: argparse.Namespace, problem: Any, name: str, error: AssemblyError
) -> int:
    """Write the diagram of a mechanism that does not close, say why; return the exit code."""
    picture = _opened(problem, name, None, None)
    if picture is None:
        raise error
    print(f"mechdae: {error}", file=sys.stderr)
    style = {
        word: getattr(options, word)
        for word in ("dark", "lang")
        if getattr(options, word) is not None
    }
    form = "svg" if options.kind == "animation" else _form(options)
    return _written(options, picture, "diagram", style, form, "open")


def _opened(problem: Any, name: str, result: Any, pose: int | None) -> Any:
    """Return the pose drawn open, None where it closes or several loops are open."""
    from mechdae.assembly.open_mechanism import opened

    try:
        return opened(problem, name, result=result, pose=pose)
    except SolveError:
        return None


def _check_folder(out: str) -> None:
    """Raise if a folder is called like a picture: somebody meant a file."""
    ending = Path(out).suffix.lower().lstrip(".")
    if ending in (*FORMATS, "gif") and not Path(out).is_dir():
        raise InputError(
            "a folder is meant: pictures are named after problem and task",
            where=f"--out {out}",
            hint=f"--out {Path(out).parent} --format {ending}",
        )


def _solved(problem: Any, name: str, kind: str, mode: str | None) -> Any:
    """Return the result that is drawn, solved once.

    Pictures of poses show every body also where the task names outputs. Bodies that no output
    depends on are named as not in the scene; where they spoil the task they are left out, and
    only then it is solved again, as it is.
    """
    from mechdae.tasks.solve import solve

    task = problem.task(name)
    if kind in (*GRAPHS, *DESIGNS) or getattr(task, "outputs", None) is None:
        return solve(problem, name, mode=mode)

    def with_outputs(outputs: tuple[str, ...] | None) -> Any:
        return solve(problem.with_task(name, replace(task, outputs=outputs)), name, mode=mode)

    outside = left_out(problem, name)
    if not outside:
        return with_outputs(None)
    try:
        whole = with_outputs(None)
        whole.summary["not_in_scene"] = outside
    except MechdaeError:
        whole = None
    if whole is not None and not whole.fault:
        return whole
    bodies = tuple(body for body in problem.mechanism.bodies if body not in outside)
    inside = with_outputs(bodies)
    return whole if whole is not None and whole.fault == inside.fault else inside

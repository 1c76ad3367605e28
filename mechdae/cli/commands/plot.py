"""``mechdae plot P``."""

from __future__ import annotations

import argparse
import re
import sys
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of, units_argument, units_asked
from mechdae.cli.progress import progress
from mechdae.draw import fitting
from mechdae.draw.catalogue import (
    DOCUMENTS,
    ON_PAPER,
    OPTIONS,
    PICTURES,
    Option,
    check_suits,
    checked,
    kind_and_task,
    kinds_with,
    picture_of,
)
from mechdae.errors import AssemblyError, InputError, SolveError, UnknownName

if TYPE_CHECKING:
    from mechdae.describe.file.problem import Problem
    from mechdae.results.result import Result
    from mechdae.types import Json

LONGEST = 150
"""Letters of a file's name without its ending; longer ones are cut, with a checksum."""


def options_for(kind: str, asked: Mapping[str, int | str | list[str]]) -> Json:
    """Return the options of the drawing function."""
    options = checked(kind, asked, "--")
    if "design" in options:
        if options["design"] < 1:
            raise InputError("a number from 1, the best one", where="--design")
        options["design"] -= 1
    return options


def file_name(
    problem: str, task: str, kind: str, asked: Mapping[str, int | str | list[str]]
) -> str:
    """Return the name of the file of a picture, without the ending: it says what is asked for."""
    given = {
        name: OPTIONS[name].file.format(_in_name(value)) for name, value in asked.items() if value
    }
    which = given.pop("which", "")
    given |= {"pose": OPTIONS["pose"].file.format(asked["pose"])} if "pose" in asked else {}
    whole = "-".join([problem, task, which or kind, *filter(None, given.values())])
    if len(whole) <= LONGEST:
        return whole
    return f"{whole[:LONGEST]}-{zlib.crc32(whole.encode()):08x}"


def _in_name(value: int | str | list[str]) -> str:
    """Return the value of an option as a part of a file's name."""
    texts = value if isinstance(value, list | tuple) else [value]
    return "-".join(re.sub(r"[^\w.,+=-]+", "-", str(text)).strip("-") for text in texts)


FORMATS = ("svg", "png", "pdf")
MOVING = ("gif", "svg", "mp4", "webm")
"""Formats of animations; films need ffmpeg."""
TYPES: dict[str, type] = {"whole": int, "number": float}


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument(
        "--task", metavar="T", help="the task to draw (default: the first that suits)"
    )
    parser.add_argument(
        "--kind",
        metavar="K",
        help=f"{', '.join([*PICTURES, *DOCUMENTS])} (default: diagram of a sweep or of modes, "
        "curves of reactions and motions, map of a study, design of a synthesis; diagram with "
        "--pose, --dark, --lang)",
    )
    parser.add_argument("--mode", metavar="LABEL", help="start on this assembly mode")
    units_argument(parser)
    parser.add_argument(
        "--out", default=".", metavar="DIR", help="folder of the picture, or a file like x.svg"
    )
    formats = f"{', '.join(FORMATS)}; animations {', '.join(MOVING)}"
    parser.add_argument("--format", metavar="F", help=formats)
    parser.add_argument(
        "--text", action="store_true", help="letters of a still SVG as text, not as outlines"
    )
    for name, option in OPTIONS.items():
        _argument(parser, name, option, f"{option.about} [{', '.join(kinds_with(name))}]")
    for name, option in ON_PAPER.items():
        _argument(parser, name, option, option.about)


def _argument(parser: argparse.ArgumentParser, name: str, option: Option, about: str) -> None:
    """Add an option of pictures to a parser."""
    if option.is_flag:
        flag = f"--{name}" if option.what == "on" else f"--no-{name}"
        parser.add_argument(
            flag, dest=name, action="store_const", const=option.what == "on", help=about
        )
    elif option.what == "names":
        parser.add_argument(f"--{name}", action="append", metavar="NAME", help=about)
    else:
        kind = TYPES.get(option.what, str)
        flag = f"--{option.flag or name}"
        parser.add_argument(flag, dest=name, type=kind, metavar=option.what.upper(), help=about)


def run(options: argparse.Namespace) -> int:
    if options.kind in DOCUMENTS:
        if is_folder(options.problem):
            raise InputError(
                f"a {options.kind} solves, a folder holds what was solved",
                where=f"--kind {options.kind}", hint=f"mechdae {options.kind} P",
            )  # fmt: skip
        return DOCUMENTS[options.kind](options)
    given = {name: getattr(options, name) for name in OPTIONS}
    given = {name: value for name, value in given.items() if value is not None}
    _form(options, options.kind)
    units_asked(options)
    if is_folder(options.problem):
        return _of_folder(options, given)
    from mechdae.tasks.pictures import for_picture, with_sketch

    problem = with_sketch(problem_of(options))
    where = problem.name
    kind, name = kind_and_task(problem.tasks, options.kind, options.task, given, where)
    picture, task, form = picture_of(kind), problem.task(name), _form(options, kind)
    check_suits(kind, task.kind, "task", f"tasks.{name}", getattr(task, "of", None) or "")
    if options.mode is not None and "designs" in task.holds:
        raise InputError("a synthesis starts on no assembly mode", where="--mode")
    extra = options_for(kind, given)
    try:
        measures = ("axodes",) if given.get("axodes") else ()
        paths = given.get("of", ())
        result = for_picture(problem, name, picture.needs, paths, options.mode, measures)
    except AssemblyError as error:
        return _written_open(options, problem, name, error)
    pose = extra.get("pose")
    if kind == "diagram" and _not_assembled(result, pose):
        drawn = _opened(problem, name, result, pose)
        if drawn is not None:
            del extra["pose"], given["pose"]
            stem = file_name(drawn.problem, drawn.task, f"open-{pose}", {})
            return _written(options, drawn, kind, extra, f"{stem}.{form}")
    if not options.kind and not extra and (fits := fitting(kind, result)) != kind:
        kind, given = fits, {}
        if picture_of(kind).needs != picture.needs:
            result = for_picture(problem, name, picture_of(kind).needs, (), options.mode)
    stem = file_name(result.problem, result.task, kind, given)
    return _written(options, result, kind, extra, f"{stem}.{form}")


def is_folder(name: str) -> bool:
    """Return whether a folder with results is meant, not a predefined problem of that name."""
    from mechdae.describe.file import library

    return Path(name).is_dir() and name not in library.names()


def _of_folder(options: argparse.Namespace, asked: dict[str, Any]) -> int:
    """Draw a result that is kept in a folder; nothing is computed again."""
    from mechdae.tasks.export import read

    for word, given in (("--set", options.set), ("--mode", options.mode)):
        if given:
            hint = "mechdae plot P, which solves the task again"
            raise InputError("a result in a folder is what it is", where=word, hint=hint)
    results = read(options.problem)
    tasks = {name: result.definition for name, result in results.items() if result.definition}
    kind, name = kind_and_task(tasks, options.kind, options.task, asked, options.problem)
    result, form = results[name], _form(options, kind)
    check_suits(kind, result.kind, "result", f"{options.problem}: {name}")
    extra = options_for(kind, asked)
    if not options.kind and not extra and (fits := fitting(kind, result)) != kind:
        kind, asked = fits, {}
    try:
        stem = file_name(result.problem, result.task, kind, asked)
        return _written(options, result, kind, extra, f"{stem}.{form}")
    except UnknownName as error:
        if not error.hint:
            error.hint = f"in {options.problem} is what was computed; mechdae plot P computes more"
        raise


def _form(options: argparse.Namespace, kind: str | None) -> str:
    """Return the format of the file."""
    moving = kind == "animation"
    ending, formats = _ending(options.out), MOVING if moving else FORMATS
    form = options.format or ending or ("gif" if moving else "svg")
    if ending and form != ending:
        raise InputError(
            f"the file ends in .{ending}, --format says {form}", where=f"--out {options.out}",
            hint="one of them is enough",
        )  # fmt: skip
    if form not in formats:
        raise UnknownName("format", form, formats, where="format", listed=formats)
    if options.text and (moving or form != "svg"):
        raise InputError("letters as text are those of a still SVG", where="--text")
    return str(form)


def _written(
    options: argparse.Namespace, result: Result, kind: str, extra: dict[str, Any], file: str
) -> int:
    """Write the picture and say where it is; return the exit code."""
    from mechdae.draw import plot, save

    on_paper = {name: getattr(options, name) for name in ON_PAPER}
    on_paper = {name: value for name, value in on_paper.items() if value is not None}
    picture = plot(result.in_units(units_asked(options)), kind, **on_paper, **extra)
    out = Path(options.out)
    path = out if _ending(options.out) else out / file
    path.parent.mkdir(parents=True, exist_ok=True)
    if kind == "animation":
        picture.save(path, progress("frame", options.quiet))
    else:
        save(picture, path, options.text)
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
    options: argparse.Namespace, problem: Problem, name: str, error: AssemblyError
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
    form = "svg" if options.kind == "animation" else _form(options, "diagram")
    stem = file_name(picture.problem, picture.task, "open", {})
    return _written(options, picture, "diagram", style, f"{stem}.{form}")


def _opened(problem: Any, name: str, result: Any, pose: int | None) -> Any:
    """Return the pose drawn open, None where it closes or several loops are open."""
    from mechdae.motion.cases.open.open_mechanism import open_pose

    try:
        return open_pose(problem, name, result=result, pose=pose)
    except SolveError:
        return None


def _ending(out: str) -> str:
    """Return the ending of a file that is named instead of a folder, else ""."""
    ending = Path(out).suffix.lower().lstrip(".")
    return ending if ending in (*FORMATS, *MOVING) and not Path(out).is_dir() else ""

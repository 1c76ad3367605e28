"""The kinds of pictures and their options, in one list; nothing is drawn here.

A new kind of picture is a table of ``catalogue.toml``, or an entry of the ``ADDS`` of a part, and a
module with ``draw(result, ax, **options)``.
"""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from mechdae.additions import Registry
from mechdae.describe.tasks.kinds import TASKS, Task
from mechdae.errors import InputError, UnavailableError, UnknownName
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json

T = TypeVar("T")
Drawing = Callable[..., Any]
"""Of a result, axes and options."""
DOCUMENTS: Registry[Callable[[Any], int]] = Registry("documents", {})
"""Kinds that are no pictures on axes: what writes one for the options of ``mechdae plot``."""


@dataclass(frozen=True)
class Picture:
    """A kind of picture.

    Parameters
    ----------
    module
        Its ``draw(result, ax, **options)`` makes the picture, or the function behind a colon.
    about
        What it shows.
    of
        What a result has to hold, one of these, see ``holds`` of the descriptions of tasks.
    options
        Names of its options, see `OPTIONS`.
    needs
        What the task has to compute for it: "bodies" (all of them), "series" (those that are named
        in ``of``), "extremes" (between the poses), "small motions" (of an equilibrium).
    lacks, hint
        What is said of a task that does not hold it, and what to try.
    first
        Kinds of tasks of which it is drawn by preference.
    usual_of
        Kinds of tasks of which the command line draws it without a wish.
    shared
        Whether pictures of several variants can share axes.
    in_space
        Whether it is drawn of spatial mechanisms, too.
    """

    module: str
    about: str
    of: tuple[str, ...]
    options: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    lacks: str = ""
    hint: str = ""
    first: tuple[str, ...] = ("sweep",)
    usual_of: tuple[str, ...] = ()
    shared: bool = False
    in_space: bool = False


@dataclass(frozen=True)
class Option:
    """An option of pictures.

    Parameters
    ----------
    what
        "names" (several), "name", "whole", "number", "on" or "off": a flag that is off or on
        without it.
    about
        What it is for.
    before
        Names that it had before, which are understood too, and the kinds that had them.
    file
        What it adds to the name of the file that the command line writes, ``{}`` is its value.
    flag
        Its name on the command line, where that is not its name.
    """

    what: str
    about: str
    before: Mapping[str, tuple[str, ...]] | None = None
    file: str = ""
    flag: str = ""

    @property
    def is_flag(self) -> bool:
        return self.what in ("on", "off")


def _read(name: str, kind: Callable[..., T]) -> dict[str, T]:
    """Return the rows of a table of the catalogue by name, lists as tuples."""
    return {
        row: kind(**{k: tuple(v) if isinstance(v, list) else v for k, v in values.items()})
        for row, values in _TABLES[name].items()
    }


_TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
PICTURES: Registry[Picture] = Registry("pictures", _read("pictures", Picture))
"""Kind -> picture."""
OPTIONS: Mapping[str, Option] = _read("options", Option)
"""Name -> option."""
ON_PAPER: Mapping[str, Option] = _read("on_paper", Option)
"""How pictures of all kinds are printed."""
IN_ONE = {"view": 3, "axodes": 3, "shape": 2, "polar": 2, "angles": 2}
"""Options of pictures of mechanisms of one dimension only."""


def picture_of(kind: str) -> Picture:
    """Return a kind of picture.

    Raises
    ------
    UnavailableError
        The live page.
    UnknownName
        Not a kind of picture.
    """
    if kind not in PICTURES and kind in DOCUMENTS:
        hint = f"md.{kind}, or mechdae {kind}"
        raise UnavailableError(f"a {kind} is no picture on axes", hint=hint)
    if kind not in PICTURES:
        known = [*PICTURES, *DOCUMENTS]
        raise UnknownName("kind of picture", str(kind), known, listed=known)
    return PICTURES[kind]


def drawing_of(kind: str) -> Drawing:
    """Return the function that draws a kind of picture."""
    module, _, name = picture_of(kind).module.partition(":")
    drawing: Drawing = getattr(importlib.import_module(module), name or "draw")
    return drawing


def kinds_of(holds: str) -> list[str]:
    """Return the kinds of pictures of what a result holds."""
    return [kind for kind, picture in PICTURES.items() if holds in picture.of]


def usual_kind(task: str) -> str:
    """Return the kind of picture that is drawn of a kind of task without a wish."""
    holds = TASKS[task].holds if task in TASKS else ()
    suited = [kind for kind, picture in PICTURES.items() if set(picture.of) & set(holds)]
    return suited[0] if suited else "diagram"


def check_dimension(
    kind: str, result: object, options: Mapping[str, object] = MappingProxyType({})
) -> None:
    """Refuse pictures, and options of them, that mechanisms of a dimension do not have.

    Raises
    ------
    UnavailableError
        A kind that is drawn in the plane only.
    InputError
        An option of the other dimension.
    """
    mechanism = getattr(result, "mechanism", None)
    dimension = getattr(mechanism, "dimension", 2)
    if dimension == 3 and not picture_of(kind).in_space:
        raise UnavailableError(
            f"pictures of kind '{kind}' are not drawn of spatial mechanisms by this version",
            hint=f"available: {', '.join(k for k, each in PICTURES.items() if each.in_space)}",
        )
    for name in options:
        if IN_ONE.get(name, dimension) != dimension and options[name] is not None:
            which = "planar" if dimension == 2 else "spatial"
            raise InputError(f"pictures of {which} mechanisms have no option '{name}'", where=name)


def check_suits(
    kind: str, task: str, what: str = "result", where: str = "", repeats: str = ""
) -> None:
    """Refuse kinds of pictures that a kind of task does not have.

    ``what`` and ``where`` it is, and the name of the task that a study repeats, are for messages.

    Raises
    ------
    InputError
        Says which kinds there are.
    """
    if task not in TASKS:
        return
    picture, holds = picture_of(kind), TASKS[task].holds
    if set(picture.of) & set(holds):
        return
    for holding, made in (("designs", "synthesis"), ("schemes", "composition")):
        if holding in picture.of:
            text = f"'{kind}' is a picture of a {made}, this is a {what} of kind '{task}'"
            raise InputError(text, where=where, hint=picture.hint)
    for holding, text, part in (
        ("schemes", f"a composition has schemes, no '{kind}'", "scheme"),
        ("designs", f"a synthesis has designs, no poses to draw as '{kind}'", "design"),
    ):
        if holding in holds:
            hint = f"{', '.join(kinds_of(holding))}; or solve the problem of a {part} and draw that"
            raise InputError(text, where=where, hint=hint)
    hint, subject = picture.hint, f"a task of kind {task}"
    if "grid" in holds:
        subject = "a study"
        hint = f"--task {repeats} with --set" if repeats else "kind 'map', or solve what it repeats"
    raise InputError(f"{subject} {picture.lacks}", where=where, hint=hint)


def names_of(kind: str) -> list[str]:
    """Return the names of the options that a kind of picture has."""
    return [name for name in OPTIONS if name in PICTURES[kind].options]


def kinds_with(option: str) -> list[str]:
    """Return the kinds of pictures that have an option."""
    return [kind for kind, picture in PICTURES.items() if option in picture.options]


def checked(kind: str, given: Mapping[str, object], dashes: str = "") -> Json:
    """Return the options of a kind of picture under their names of today.

    ``dashes`` stand before the names in messages.

    Raises
    ------
    UnknownName
        No picture has an option of that name.
    InputError
        The kind of picture has none, or it is there under two names.
    """
    options: Json = {}
    for word, value in given.items():
        name = next((key for key, option in OPTIONS.items() if word in (option.before or ())), word)
        if name not in OPTIONS:
            raise UnknownName(f"option of a picture of kind '{kind}'", word, names_of(kind))
        kinds = kinds_with(name) if name == word else (OPTIONS[name].before or {})[word]
        if kind not in kinds:
            word = OPTIONS[name].flag if dashes and OPTIONS[name].flag else word
            shows_all = name == "pose" and "designs" not in PICTURES[kind].of
            shows = f": {kind} shows all poses" if shows_all else ""
            flags = ((dashes and OPTIONS[key].flag) or key for key in names_of(kind))
            known = ", ".join(f"{dashes}{flag}" for flag in flags)
            raise InputError(
                f"{dashes}{word} is for {', '.join(kinds)}, not for {kind}{shows}",
                where=f"{dashes}{word}",
                hint=f"options of {kind}: {known or 'none'}",
            )
        if name in options:
            raise InputError("this option is given twice, under two names", where=word)
        several = OPTIONS[name].what == "names"
        options[name] = [value] if several and isinstance(value, str) else value
    return options


OF_FORCES = ("force", "friction", "lever")
"""Plans that a task of reactions has."""
WORDS: dict[tuple[str, ...], tuple[str, ...]] = {
    ("reactions", "motion"): ("effort", "reaction", "loss", "normal"),
    ("motion",): ("energy", "kinetic", "potential", "work", "drift"),
    ("sweep", "reactions"): ("transmission", "curvature", "tangent", "centr", "axode", "screw"),
}  # fmt: skip
"""Kinds of tasks that have series whose paths have a step that begins with one of these."""


def kind_and_task(
    tasks: Mapping[str, Task],
    kind: str | None,
    name: str | None,
    given: Mapping[str, int | str | list[str]],
    where: str,
) -> tuple[str, str]:
    """Return the kind of picture and the task that are meant.

    Parameters
    ----------
    kind, name
        What is given of them.
    given
        Options of the picture: of the kinds and tasks that are left, they choose those that
        have them.
    where
        The tasks are, for messages.

    Raises
    ------
    InputError
        There is no task that is computed.
    """
    if name is not None:
        return kind or kind_for(tasks[name].kind if name in tasks else "", given), name
    if not tasks:
        raise InputError("no task that this version computes", where=f"{where}: tasks")
    if kind is None and not set(given) <= set(names_of("diagram")):
        kind = next((picture for picture in PICTURES if set(given) <= set(names_of(picture))), None)
    shown = "diagram" if kind in (None, *DOCUMENTS) else str(kind)
    picture_of(shown)
    options = {} if kind is None else checked(shown, given, "--")
    chosen = min(tasks, key=lambda name: _rank(tasks[name], shown, options))
    return kind or kind_for(tasks[chosen].kind, given), chosen


def _rank(task: Task, kind: str, options: Mapping[str, Any]) -> tuple[int, ...]:
    """Return how far a task is from what is asked for; the least suits best."""
    picture = PICTURES[kind]
    suits = bool(set(picture.of) & set(task.holds))
    able = _kinds(kind, options)
    order = [*(picture.usual_of if not options.get("of") else ()), *picture.first]
    place = order.index(task.kind) if task.kind in order else len(order)
    way = -task.way if "path" in picture.of else 0
    frictionless = kind == "losses" and getattr(task, "friction", "") == "none"
    parts = {series.split("/")[0].removeprefix("efforts_") for series in options.get("of") or ()}
    lacks = len((parts & {"static", "inertial"}) - set(getattr(task, "parts", None) or ()))
    return not suits, bool(able) and task.kind not in able, lacks, frictionless, way, place


def _kinds(kind: str, options: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the kinds of tasks that have what options show, all of them: ()."""
    if options.get("polar") or options.get("which") in OF_FORCES:
        return ("reactions",)
    if options.get("shape"):
        return ("equilibrium",)
    if options.get("axodes"):
        return ("sweep",)
    steps = [step for path in options.get("of") or () for step in str(path).split("/")]
    for kinds, words in WORDS.items():
        if any(step.startswith(words) for step in steps) and kind != "losses":
            return kinds
    return ()


def kind_for(task: str, given: Mapping[str, object]) -> str:
    """Return the kind of picture of a kind of task: its usual one, or the diagram if that is meant.

    The diagram is meant if it has the options that were asked for and the usual kind has not.
    """
    kinds = [kind for kind, picture in PICTURES.items() if task in picture.usual_of]
    kinds = [*kinds, "diagram"] if kinds else [usual_kind(task)]
    return next((name for name in kinds if set(given) <= set(names_of(name))), kinds[0])

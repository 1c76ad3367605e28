"""Pictures of results; matplotlib is imported when the first one is drawn."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

from mechdae.describe.file.load import Source, given
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import SI, Units
from mechdae.describe.values import Number
from mechdae.draw.catalogue import (
    PICTURES,
    Drawing,
    check_dimension,
    check_suits,
    checked,
    drawing_of,
    kind_and_task,
    picture_of,
    usual_kind,
)
from mechdae.errors import InputError, MechdaeError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mechdae.draw.animation import Animation
    from mechdae.results import Result, SweepResult
    from mechdae.types import Json


MODES = 8
"""Assembly modes that are drawn side by side."""


def plot(
    problem: Source | object,
    kind: str | None = None,
    ax: Axes | None = None,
    width: str | float | None = None,
    dpi: int | None = None,
    title: bool = True,
    *,
    task: Task | str | None = None,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    units: str | Units = SI,
    **options: object,
) -> Any:
    """Draw a result.

    Parameters
    ----------
    problem
        What `mechdae.solve` returned; of a problem, the name of a predefined one or a file the
        task ``task`` is solved, without a name the first one that suits kind and options. Of a
        mechanism, and of a problem without tasks, the sketch is assembled.
    kind
        One of `mechdae.draw.catalogue.PICTURES`, which says what each shows. Without it the
        diagram; of a study the map; of a synthesis the best design, of one with several
        objectives the front, of one without designs the census.
    ax
        Axes to draw in; without it a new figure is made. No window is opened. On axes that
        hold a diagram, curves or paths of points already, one more of that kind is drawn as a
        variant: each in its colour, to one scale, with their names (``label``) below the title.
    width
        That of a new figure on paper: ``"90mm"``, ``"9cm"``, ``"3.5in"``, or a number of mm.
        Letters keep at least 6 pt.
    dpi
        Pixels to the inch of a new figure, and of frames.
    title
        Whether a title and a line below it stand above the picture.
    task, set, mode
        What is solved, as of `md.solve`; a result is solved again where one of them is given.
    units
        What numbers are shown in.
    **options
        Options of that kind of picture, see `mechdae.draw.catalogue.OPTIONS`; the command
        line has the same ones under the same names.

    Returns
    -------
    matplotlib.axes.Axes
        For an animation an `mechdae.draw.animation.Animation`.

    Raises
    ------
    UnavailableError
        A document such as the live page, see `md.page`.
    UnknownName
        Not a kind of picture, or no option of one.
    InputError
        A kind that does not suit the result, an option that does not suit the kind.

    Examples
    --------
    >>> problem = md.four_bar(0.1, 0.04, 0.12, 0.08)
    >>> diagram = md.plot(problem)
    >>> diagram.figure.savefig("four-bar.svg")  # doctest: +SKIP
    >>> curves = md.plot(problem, "curves")
    """
    result: Any = problem
    if isinstance(problem, Problem | Mechanism | str | Path) or (task, set, mode) != (None,) * 3:
        whole, named = given(cast("Source", problem), task, set)
        result, kind = _solved(whole, named, kind, mode, options)
    result = result.in_units(units) if units else result
    kind = usual(result) if kind is None else kind
    check_suits(kind, getattr(result, "kind", ""))
    settings = checked(kind, options)
    check_dimension(kind, result, settings)
    return _pictured(result, kind, ax, settings, (width, dpi, title))


def _pictured(
    result: Result, kind: str, ax: Axes | None, settings: Json,
    paper: tuple[str | float | None, int | None, bool],
) -> Any:  # fmt: skip
    """Return a picture with settings that suit it, on new paper where no axes are given."""
    draw, (width, dpi, title) = drawing_of(kind), paper
    figure = importlib.import_module("mechdae.draw.figure")
    on = figure.print_format(width, dpi, title)
    if kind == "animation":
        if width is not None or not title:
            raise InputError("an animation has its width in pixels, and a title", hint="dpi")
        return draw(result, ax, **settings, **({} if dpi is None else {"dpi": dpi}))
    if ax is not None and (width, dpi) != (None, None):
        raise InputError("axes have a figure of their own: width and dpi are those of a new one")
    with figure.printed(on):
        drawn = _drawn(result, kind, ax, draw, settings)
    if not title:
        figure.figure_of(drawn).set_label(str(getattr(result, "title", "") or result.problem))
    return drawn


def _drawn(result: Result, kind: str, ax: Axes | None, draw: Drawing, given: Json) -> Any:
    """Return a still picture, one more variant where axes hold such pictures."""
    picture = picture_of(kind)
    if ax is None:
        drawn = draw(result, ax, **given)
        if picture.shared:
            _variants().remember(drawn, kind, result, given, None)
        return drawn
    variants = _variants()
    shared = variants.on_axes(ax, kind)
    if shared is not None:
        return variants.add(ax, shared, result, given)
    before = variants.before(ax)
    drawn = draw(result, ax, **given)
    variants.remember(ax, kind, result, given, before)
    return drawn


def _solved(
    whole: Problem, named: str | None, kind: str | None, mode: str | None, options: Json
) -> tuple[SweepResult, str]:
    """Return the result of the task that suits a kind of picture and its options, and the kind."""
    whole = whole if whole.tasks else importlib.import_module("mechdae")._with_sketch(whole)
    chosen, task = kind_and_task(whole.tasks, kind, named, options, whole.name)
    check_suits(chosen, whole.task(task).kind, "task", f"tasks.{task}")
    given = checked(chosen, options)
    solved = importlib.import_module("mechdae")._for_picture
    measures = ("axodes",) if given.get("axodes") else ()
    needs, paths = picture_of(chosen).needs, given.get("of", ())
    result = solved(whole, task, needs, paths, mode, measures)
    if kind is None and not options and (fits := fitting(chosen, result)) != chosen:
        if picture_of(fits).needs != needs:
            result = solved(whole, task, picture_of(fits).needs, (), mode)
        return result, fits
    return result, chosen


def _variants() -> ModuleType:
    return importlib.import_module("mechdae.draw.variants")


def usual(result: Result) -> str:
    """Return the kind of picture that is drawn of a result if none is asked for."""
    kind = usual_kind(getattr(result, "kind", ""))
    if kind == "design" and "front" in result.summary:
        return "front"
    return "census" if kind == "design" and not result.data["designs"] else kind


def fitting(kind: str, result: Result) -> str:
    """Return a kind that nobody wished for, or another one where a result has none of it."""
    if "bands" in picture_of(kind).of:
        bands = importlib.import_module("mechdae.draw.graphs.series").band_paths(result)
        shown = any(path.startswith("points") for path in bands)
        return kind if shown else "curves" if bands else "diagram"
    return usual(result) if kind == "design" else kind


def data_url(result: Result) -> str:
    """Return the usual picture of a result as the address of an ``<img>``, "" where it has none."""
    from mechdae.draw import figure

    try:
        if usual(result) == "diagram" and result.kind == "modes" and len(result) > 1:
            return figure.data_url(_side_by_side(result))
        return figure.data_url(plot(result))
    except MechdaeError:  # what a task did not ask for cannot be drawn
        return ""


def sketch_url(subject: Problem | Mechanism) -> str:
    """Return the diagram of a sketch as the address of an ``<img>``, "" where it has none."""
    from mechdae.draw import figure

    if isinstance(subject, Problem):
        subject = replace(subject, tasks={}, expected=())
    try:
        return figure.data_url(plot(subject, "diagram"))
    except MechdaeError:
        return ""


def _side_by_side(result: Result) -> Figure:
    """Return the diagrams of assembly modes in one picture, of many the first ones."""
    from mechdae.draw import figure

    count = min(len(result), MODES)
    whole, axes = figure.grid(count)
    for k, ax in enumerate(axes):
        plot(result, "diagram", ax, pose=k, loads=False)
    return whole


def save(picture: Axes | Figure | Animation, path: str | Path, text: bool = False) -> Path:
    """Write a picture to a file, see `mechdae.draw.figure.save`; an animation as a GIF."""
    from mechdae.draw import figure

    moving: Any = picture
    return moving.save(path) if hasattr(picture, "gif") else figure.save(moving, path, text)


__all__ = ["PICTURES", "plot", "save", "usual"]

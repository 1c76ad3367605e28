"""Several results on the same axes: variants, each in its colour, named below the title."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from mechdae.describe.dimensions import parameter_units
from mechdae.draw import style
from mechdae.draw.catalogue import PICTURES
from mechdae.draw.diagram.diagram import View, has_paths
from mechdae.draw.figure import figure_of
from mechdae.draw.graphs import coupler, curves
from mechdae.draw.graphs.scale import scale_of
from mechdae.draw.poses import seen
from mechdae.draw.words import Words
from mechdae.errors import InputError, UnavailableError
from mechdae.records import dataclass
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.draw.sheet import Sheet
    from mechdae.results import SweepResult
    from mechdae.results.result import Result


FEW = 2
"""Parameters by which variants are named at most."""


@dataclass
class Shared:
    """What was drawn on axes: kind, results with their options, axes made for panels."""

    kind: str
    entries: list[tuple[Any, dict[str, Any]]]
    marks: list[Any]
    panels: list[Axes] = field(default_factory=list)
    place: Any = None


_KNOWN: WeakKeyDictionary[Axes, Shared] = WeakKeyDictionary()


def on_axes(ax: Axes, kind: str) -> Shared | None:
    """Return what is drawn on axes, None where they are empty or were cleared.

    Raises
    ------
    InputError
        A picture of another kind, or one that variants cannot share; no axes.
    """
    if not isinstance(ax, Axes):
        raise InputError(f"matplotlib Axes are needed, not {ax!r}", where="ax")
    shared = _KNOWN.get(ax)
    if shared is None or not any(mark.axes is ax for mark in shared.marks):
        return None
    if shared.kind != kind or not PICTURES[kind].shared:
        several = [name for name, picture in PICTURES.items() if picture.shared]
        raise InputError(
            f"these axes hold a picture of kind '{shared.kind}', '{kind}' would cover it",
            where="ax",
            hint=f"other axes, or ax.clear(); pictures of one kind can share axes: "
            f"{', '.join(several)}",
        )
    return shared


def before(ax: Axes) -> tuple[Any, list[Axes]]:
    """Return place and axes of a figure before something is drawn."""
    return ax.get_position(), list(figure_of(ax).axes)


def remember(ax: Axes, kind: str, result: Result, options: Json, before: Any) -> None:
    """Remember what was drawn; ``before`` is place and axes of the figure before it was.

    A figure of its own is given None: its panels together are the place.
    """
    figure = figure_of(ax)
    whole = Bbox.union([axis.get_position() for axis in figure.axes])
    place, axes = before if before is not None else (whole, [ax])
    panels = [axis for axis in figure.axes if axis not in axes and axis is not ax]
    marks = [*ax.texts, *ax.lines, *ax.patches]
    _KNOWN[ax] = Shared(kind, [(result, options)], marks, panels, place)


def add(ax: Axes, shared: Shared, result: SweepResult, options: Json) -> Axes:
    """Draw everything on the axes once more, with another variant."""
    entries = [*shared.entries, (result, options)]
    names = variant_names(entries)
    given = {name: value for _, chosen in entries[::-1] for name, value in chosen.items()}
    given.pop("label", None)
    if given.pop("polar", False):
        raise InputError("polar diagrams of variants do not share axes", where="polar")
    place, panels = shared.place, shared.panels
    for _ in range(2):
        for panel in panels:
            panel.remove()
        ax.clear()
        ax.set_position(place)
        others = before(ax)[1]
        if shared.kind == "diagram":
            _diagrams(ax, entries, names)
        else:
            draw_all = curves.draw_all if shared.kind == "curves" else coupler.draw_all
            draw_all([drawn for drawn, _ in entries], names, ax, **given)
        panels = [each for each in before(ax)[1] if each not in others]
        marks = [*ax.texts, *ax.lines, *ax.patches]
        _KNOWN[ax] = Shared(shared.kind, entries, marks, panels, shared.place)
        lack = _cut(ax)
        if lack <= 0 or shared.kind == "diagram":
            break
        place = Bbox.from_extents(place.x0, place.y0, place.x1, place.y1 - lack)
    return ax


def _cut(ax: Axes) -> float:
    """Return by how much texts are above the figure, as a share of its height."""
    figure = figure_of(ax)
    tops = [text.get_window_extent().y1 for text in ax.texts if text.get_gid()]
    height = float(figure.get_size_inches()[1]) * figure.dpi
    return (max(tops, default=0.0) + 0.04 * figure.dpi) / height - 1.0


def variant_names(entries: Sequence[tuple[SweepResult, Json]]) -> list[str]:
    """Return the names of variants: as given, else what they differ in, else their numbers."""
    results = [result for result, _ in entries]
    values = [result.mechanism.values() for result in results]
    units, shown = parameter_units(results[0].mechanism), results[0].units
    differ = [
        name
        for name in results[0].mechanism.parameters
        if any(value.get(name) != values[0][name] for value in values)
    ]
    texts: list[str] = []
    for k, (result, options) in enumerate(entries):
        text = str(options.get("label") or "")
        if not text and 1 <= len(differ) <= FEW:
            numbers = [(n, values[k].get(n, np.nan), units.get(n, "")) for n in differ]
            rows = [(n, scale_of(unit, [value], shown), value) for n, value, unit in numbers]
            text = ", ".join(f"{n} = {scale.text(value)}" for n, scale, value in rows)
        elif not text and len({drawn.task for drawn in results}) == len(results):
            text = str(result.task)
        elif not text and len({drawn.title for drawn in results}) == len(results):
            text = str(result.title or result.problem)
        texts.append(text or f"variant {k + 1}")
    return [f"{text} ({k})" if texts.count(text) > 1 else text for k, text in enumerate(texts, 1)]


def _diagrams(ax: Axes, entries: Sequence[tuple[Any, dict[str, Any]]], names: list[str]) -> None:
    """Draw the diagrams of variants to one scale; letters and loads are those of the first."""
    rows, every = [], []
    for result, options in entries:
        if result.mechanism.dimension == 3:
            raise UnavailableError("spatial mechanisms do not share axes", where="ax")
        shown = seen(result, options.get("pose"))
        traces = options.get("traces", True) and has_paths(result, shown.scene)
        shown = shown.with_paths() if traces else shown
        rows.append((shown, traces, options))
        every.append(shown.bounds([shown.pose], traces or bool(options.get("ghosts", 0))))
    low = np.min([box[0] for box in every], axis=0)
    high = np.max([box[1] for box in every], axis=0)
    bounds = (low, high, max(box[2] for box in every))
    first = entries[0][1]
    words = Words(first.get("lang", "en"))
    base = style.DARK if first.get("dark") else style.LIGHT
    drawn: list[Sheet] = []
    for k in reversed(range(len(rows))):
        shown, traces, options = rows[k]
        color = style.color_of(k)
        theme = style.Theme({**base.colours, **dict.fromkeys(style.VARIED, color)})
        labels, loads = (k == 0 and options.get(name, True) for name in ("labels", "loads"))
        legend = () if k else tuple((name, style.color_of(n)) for n, name in enumerate(names))
        view = View(
            traces, options.get("ghosts", 0), labels, loads, bounds, scale=first.get("scale"),
            behind=tuple(drawn), bare=k > 0, paper=base, legend=legend,
        )  # fmt: skip
        drawn.append(shown.draw(ax, view, theme, words))

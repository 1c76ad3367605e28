"""A study over one parameter or two, and the workspace of two drivers."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, LinearSegmentedColormap, ListedColormap
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from mechdae.draw import style
from mechdae.draw.fonts import font
from mechdae.draw.graphs.abscissa import Abscissa, draw_axis, runs, subtitle_of
from mechdae.draw.graphs.frame import Entry, Panels, shaded
from mechdae.draw.graphs.scale import number, scale_of
from mechdae.draw.graphs.series import Array, lines_of
from mechdae.errors import InputError, UnknownName
from mechdae.records import dataclass
from mechdae.results.status import stretches
from mechdae.types import Json, Texts

if TYPE_CHECKING:
    from mechdae.results import StudyResult


HEIGHT = 300.0
LEVELS = 9
"""Steps of the values, about."""
FINE = ("ok", "limit")
LOCKED = "self-locking"
LOCK_TEXT = "self-locking: efficiency below 0"
NO_VALUE = "no value"
NOT_REACHED = "not reached on the way from pose to pose"
SAME = 1e-9
"""Share by which values of a parameter may differ and still be one row of the grid."""


@dataclass(frozen=True)
class Plane:
    """What a map shows: one or two coordinates, values and statuses, each (n,)."""

    names: tuple[str, ...]
    axes: tuple[Array, ...]
    units: tuple[str, ...]
    values: Array
    status: Any
    label: str
    unit: str
    held: str = ""
    plane: bool = False


def draw(
    result: StudyResult,
    ax: Axes | None = None,
    *,
    of: Sequence[str] | None = None,
    along: Sequence[str] | None = None,
    equal: bool = False,
) -> Axes:
    """Draw values over the parameters of a study, or over two drivers; options are the catalogue's.

    Sets that jam, do not assemble or have several solutions are shaded, hatched and named; an
    efficiency below zero is: there loads would drive, and the driver has to push too. ``of`` is a
    path of the study's table, with indices if it has several numbers,
    ``"points/P/position[0][1]"``; over one parameter several with one unit, of a workspace a path
    below the task. Parameters that are no axes stay at their first value.

    Raises
    ------
    InputError
        A result of another kind, no parameter that varies.
    UnknownName
        A path or a parameter that is not in the result.
    """
    if result.kind == "study":
        planes = _of_study(result, of, along)
    elif result.kind in ("sweep", "reactions") and len(result.drivers) == 2:
        planes = [_of_drivers(result, of)]
    else:
        raise InputError(
            f"a map is drawn of a study or of a sweep of two drivers, not of kind {result.kind}",
            hint="a task of kind study with vary = { a = [from, to, count], ... }",
        )
    if len(planes[0].axes) == 1:
        return _draw_lines(result, ax, planes)
    if len(planes) > 1:
        raise InputError("a map over two parameters shows one path", where="of")
    return _draw_map(result, ax, replace(planes[0], plane=planes[0].plane or equal))


def _of_study(
    result: StudyResult, paths: Sequence[str] | None, along: Sequence[str] | None
) -> list[Plane]:
    count = len(result.status)
    known = {
        name: (unit, array)
        for name, unit, array in result.columns()
        if name not in result.parameters and np.shape(array) == (count,)
    }
    if not known:
        raise InputError("the study has no numbers to draw", where="outputs")
    for path in paths or ():
        if path not in known:
            raise UnknownName("path of the study", path, known)
    chosen = list(paths) if paths else [next(iter(known))]
    varying = [name for name, values in result.parameters.items() if np.ptp(values) > 0]
    for name in along or ():
        if name not in result.parameters:
            raise UnknownName("parameter of the study", name, result.parameters)
    units = result.summary.get("units", {})
    names = list(along) if along else varying[:2]
    if not 1 <= len(names) <= 2:
        raise InputError("one parameter or two that vary are needed", where="along")
    rows = np.ones(count, bool)
    held = []
    for name in varying:
        if name not in names:
            values = result.parameters[name]
            rows &= values == values[0]
            scale = scale_of(units.get(name, ""), [values[0]], result.units)
            held.append(f"{name} = {scale.text(float(values[0]))}")
    axes = tuple(np.asarray(result.parameters[name], float)[rows] for name in names)
    of_axes, status = tuple(units.get(name, "") for name in names), np.asarray(result.status)[rows]
    planes = []
    for path in chosen:
        unit, array = known[path]
        values, label = np.asarray(array, float)[rows], path.removeprefix("summary/")
        planes.append(
            Plane(tuple(names), axes, of_axes, values, status, label, unit, ", ".join(held))
        )
    return planes


def _of_drivers(result: StudyResult, paths: Sequence[str] | None) -> Plane:
    lines = [line for path in paths or ["condition"] for line in lines_of(result, path)]
    if len(lines) != 1:
        raise InputError(
            "a map shows one number of each pose", where="of", hint="points/P/position/x"
        )
    line = lines[0]
    names = tuple(result.drivers)
    units = tuple(result.unit("drivers", name, "position") for name in names)
    axes = tuple(np.asarray(result.drivers[name].position, float) for name in names)
    label = f"{line.name} {line.quantity}".strip()
    places = {name.rpartition(".")[0] for name in names}
    point = len(places) == 1 and names[0].endswith(".x") and names[1].endswith(".y")
    return Plane(
        names, axes, units, line.values, np.asarray(result.status), label, line.unit, plane=point
    )


def _draw_lines(result: StudyResult, ax: Axes | None, planes: list[Plane]) -> Axes:
    """Draw values over one parameter."""
    if len({plane.unit for plane in planes}) > 1:
        raise InputError("the paths have different units", where="of")
    first = planes[0]
    scale = scale_of(first.unit, [plane.values for plane in planes], result.units)
    across = scale_of(first.units[0], [first.axes[0]], result.units)
    x = across(first.axes[0])
    order = np.argsort(x, kind="stable")
    bad = _bad(first.status)
    key = [Entry(word, area=style.ARCS[word]) for word in bad]
    labels = [plane.label for plane in planes] if len(planes) > 1 else []
    frame = Panels(ax, 1, result, _subtitle(result, first), key, labels)
    panel, ends = frame.panels[0], []
    arcs = [arc for word in bad for arc in runs(first.status, first.axes[0], word)]
    draw_axis(frame, Abscissa("driver", first.names[0], across, first.axes[0]), arcs, [])
    for k, plane in enumerate(planes):
        values, look = scale(plane.values[order]), style.line_of(k)
        look |= {"linewidth": 1.4, "marker": "o" if len(x) <= 41 else "", "markersize": 3.2}
        frame.line(panel, f"curve-{plane.label}", x[order], values, **look)
        ends.append((values, plane.label, style.color_of(k)))
    panel.margins(y=0.1)
    frame.label(panel, across.named(first.names[0]), scale.named("" if labels else first.label))
    if labels:
        frame.ends(panel, ends)
    return panel


def _draw_map(result: StudyResult, ax: Axes | None, plane: Plane) -> Axes:
    scale = scale_of(plane.unit, [plane.values], result.units)
    scales = [
        scale_of(unit, [values], result.units)
        for unit, values in zip(plane.units, plane.axes, strict=True)
    ]
    x, y = (factor(values) for factor, values in zip(scales, plane.axes, strict=True))
    good = np.isin(plane.status, FINE) | (plane.status == "ambiguous")
    values = np.where(good, scale(plane.values), np.nan)
    locked = "efficiency" in plane.label and bool((values[np.isfinite(values)] < 0).any())
    plane = replace(plane, status=np.where(good & np.isnan(values), NO_VALUE, plane.status))
    bad = _bad(plane.status)
    lost = {} if result.kind == "study" else {"unassembled": NOT_REACHED}
    key = [Entry(lost.get(word, word), area=style.ARCS[word]) for word in bad]
    if locked:
        key.append(Entry(LOCK_TEXT, area=style.ARCS[LOCKED]))
    about = _subtitle(result, plane, scale.named(plane.label))
    frame = Panels(ax, 1, result, about, key, ["8888.88"], height=HEIGHT)
    panel = frame.panels[0]
    panel.grid(False)
    grid = _grid(x, y)
    room = (0.0, 0.0) if grid is not None else (0.04, 0.04)
    for way, places in (("x", x), ("y", y)):
        frame.limits(panel, places, room, way)
    if plane.plane:
        frame.equal(panel, *np.transpose([panel.get_xlim(), panel.get_ylim()]))
    levels = _levels(values, locked)
    shades = LinearSegmentedColormap.from_list("levels", list(style.LEVELS))
    count = len(levels) - 1
    colors = ListedColormap([shades((k + 0.5) / count) for k in range(count)])
    norm = BoundaryNorm(levels, count)
    for word in bad:
        _hatch(panel, x, y, plane.status == word, grid, word)
    if grid is None:
        there = np.isfinite(values)
        panel.scatter(
            x[there], y[there], c=values[there], cmap=colors, norm=norm, s=16.0, lw=0.3,
            edgecolors=style.INK, zorder=3, gid="values",
        )  # fmt: skip
    else:
        xs, ys, index = grid
        table = values[index]
        _contours(frame, xs, ys, table, levels, colors, norm)
        if locked:
            _lock(frame, xs, ys, table)
    _bar(frame, levels, colors)
    frame.label(panel, *(each.named(n) for n, each in zip(plane.names, scales, strict=True)))
    return panel


def _bad(status: Texts) -> list[str]:
    return [word for word in style.ARCS if (status == word).any()]


def _subtitle(result: StudyResult, plane: Plane, *more: str) -> str:
    if result.kind != "study":
        return subtitle_of(result, *more)
    of = result.summary.get("of", "")
    parts = [f"{result.problem} / {of}" if of else result.problem, f"{len(plane.status)} sets"]
    return "  ·  ".join([*parts, *more, *([plane.held] if plane.held else [])])


def _grid(x: Array, y: Array) -> tuple[Array, Array, Any] | None:
    """Return the rows and columns of a full grid and the (rows, columns) index of its places."""
    xs, ys = _distinct(x), _distinct(y)
    if len(xs) * len(ys) != len(x) or len(xs) < 2 or len(ys) < 2:
        return None
    columns = np.abs(x[:, None] - xs).argmin(axis=1)
    rows = np.abs(y[:, None] - ys).argmin(axis=1)
    index = np.full((len(ys), len(xs)), -1)
    index[rows, columns] = np.arange(len(x))
    return None if (index < 0).any() else (xs, ys, index)


def _distinct(values: Array) -> Array:
    ordered = np.sort(values)
    apart = SAME * max(float(np.ptp(ordered)), 1e-300)
    levels: Array = ordered[np.concatenate([[True], np.diff(ordered) > apart])]
    return levels


def _edges(values: Array) -> Array:
    """Return the borders of places: half way to their neighbours."""
    return np.concatenate([values[:1], (values[1:] + values[:-1]) / 2, values[-1:]])


def _levels(values: Array, locked: bool) -> Array:
    """Return round levels; of an efficiency all that is below zero is one step."""
    finite = values[np.isfinite(values)]
    if locked:
        lowest, highest = float(finite.min()), max(float(finite.max()), 0.05)
        return np.concatenate([[lowest], _levels(np.array([0.0, highest]), False)])
    if not finite.size:
        return np.array([0.0, 1.0])
    low, high = float(finite.min()), float(finite.max())
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        return np.array([low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)])
    return np.asarray(MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))


def _hatch(panel: Axes, x: Array, y: Array, there: Any, grid: Any, word: str) -> None:
    """Hatch the cells of the sets for which a word holds; off a grid mark them by crosses."""
    if grid is None:
        color = style.ARCS[word][1]
        panel.plot(x[there], y[there], "x", color=color, markersize=4.5, zorder=2)
        return
    xs, ys, index = grid
    across, up = _edges(xs), _edges(ys)
    look = shaded(style.ARCS[word]) | {"zorder": 0.5, "gid": f"set-{word}"}
    for row, cells in enumerate(there[index]):
        for a, b in stretches(cells):
            sides = across[b] - across[a], up[row + 1] - up[row]
            panel.add_patch(Rectangle((across[a], up[row]), *sides, **look))


def _contours(
    frame: Panels, xs: Array, ys: Array, table: Array, levels: Array, colors: Any, norm: Any
) -> None:
    """Fill between levels and write their values on the lines."""
    masked, panel = np.ma.masked_invalid(table), frame.panels[0]
    if masked.count() < 3:
        return
    # the half cells at the border of what has values, then lines between the values
    cells = (_edges(xs), _edges(ys))
    panel.pcolormesh(*cells, masked, cmap=colors, norm=norm, zorder=0.8, linewidth=0.0)
    panel.contourf(xs, ys, masked, levels=levels, cmap=colors, norm=norm, zorder=1)
    inner = [level for level in levels if np.nanmin(table) < level < np.nanmax(table)]
    if not inner:
        return
    look: Json = {"colors": style.INK, "linewidths": 0.7 * frame.k, "linestyles": "solid"}
    lines = panel.contour(xs, ys, masked, levels=inner, zorder=2, **look)
    size = max(style.LEAST, (style.TICK - 0.5) * frame.k)
    for text in panel.clabel(lines, fmt=number, inline=True, inline_spacing=2, fontsize=size):
        text.set_fontfamily(style.NOTE_FONT)
        text.set_bbox({"facecolor": style.PAPER, "edgecolor": "none", "alpha": 0.8, "pad": 0.8})
        text.set_zorder(4)


def _lock(frame: Panels, xs: Array, ys: Array, table: Array) -> None:
    """Hatch where an efficiency is below zero."""
    masked, panel = np.ma.masked_invalid(table), frame.panels[0]
    levels, width = [float(masked.min()) - 1.0, 0.0], 1.8 * frame.k
    look: Json = {"colors": "none", "hatches": ["---"], "zorder": 2.5}
    filled = panel.contourf(xs, ys, masked, levels=levels, **look)
    filled.set(edgecolor=style.ARCS[LOCKED][1], linewidth=0.0)
    panel.contour(xs, ys, masked, levels[1:], colors=style.ARROW, linewidths=width, zorder=3)


def _bar(frame: Panels, levels: Array, colors: Any) -> None:
    """Draw the scale of values to the right of the panel."""
    k = frame.k
    x0, y0, width, height = frame.box
    left, wide = x0 + width + 10.0 * k, 9.0 * k
    small = font(style.TICK * k, style.NOTE_FONT)
    share = np.linspace(0.0, 1.0, len(levels))
    for number_of, (s, t) in enumerate(itertools.pairwise(share)):
        look = {"facecolor": colors(number_of), "edgecolor": style.INK, "linewidth": 0.4 * k}
        frame.rectangle((left, y0 + s * height), wide, (t - s) * height, **look)
    for level, s in zip(levels, share, strict=True):
        spot, text = (left + wide + 4.0 * k, y0 + s * height), number(float(level))
        frame.text(*spot, text, small, style.INK, None, va="center_baseline")

"""Series against the driver or time: a panel for each unit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from mechdae.draw import style
from mechdae.draw.graphs.abscissa import (
    BEYOND,
    Abscissa,
    abscissa_of,
    arcs_of,
    beyond_key,
    draw_axis,
    events_of,
    in_window,
    key_of,
    subtitle_of,
)
from mechdae.draw.graphs.coupler import draw_polar
from mechdae.draw.graphs.frame import Entry, Panels, Places
from mechdae.draw.graphs.poles import Clip, clip_of, cuts, joined, with_gaps
from mechdae.draw.graphs.scale import Scale, number, scale_of
from mechdae.draw.graphs.series import Array, Line, default_lines, lines_of, with_rates
from mechdae.draw.smooth import few_named, in_panel, smooth
from mechdae.draw.translated import translated
from mechdae.errors import InputError
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.results import SweepResult
    from mechdae.results.result import Result


Ends = tuple[float | None, float | None]
FEW = 25
"""Up to so many poses are marked by dots."""
QUANTITIES = {
    "rad": "angle", "m": "length", "s": "time", "kg": "mass", "N": "force", "N m": "torque",
    "J": "energy", "W": "power", "rad/s": "angular velocity", "rad/s2": "angular acceleration",
    "m/s": "velocity", "m/s2": "acceleration",
}  # fmt: skip
"""What is measured in a unit, where series of several names share a panel."""
LOGARITHMIC = ("condition", "bound", "drift")
MARGIN, EXTREMES = 0.06, 20.0
"""Room above and below curves as a share of what they span; for marked extremes [pt]."""


def draw(
    result: Result,
    ax: Axes | None = None,
    *,
    of: Sequence[str] | None = None,
    against: str | None = None,
    extremes: bool = True,
    polar: bool = False,
    start: float | None = None,
    end: float | None = None,
    label: str = "",
    lang: str = "en",
) -> Axes:
    """Draw series of a sweep or of reactions, a panel for each unit; options are the catalogue's.

    ``of`` are paths below the task, whose components are drawn one by one:
    ``"joints/O/reaction/size"`` is the length of a vector, ``"points/P/velocity/x"`` a component,
    ``"points/P"`` place, velocity and acceleration.

    Returns
    -------
    matplotlib.axes.Axes
        The upper panel; ``ax.figure.axes`` has all. Angles are in degrees, units as labelled.

    Raises
    ------
    InputError
        A result without a row of poses, or no pose between ``start`` and ``end``.
    UnknownName
        A path that is not in the result.
    """
    if polar:
        return translated(draw_polar(result, ax, of=of), lang)
    drawn = draw_all(
        [result], [label], ax, of=of, against=against, extremes=extremes, start=start, end=end
    )
    return translated(drawn, lang)


def draw_all(
    results: Sequence[Result],
    names: Sequence[str],
    ax: Axes | None,
    *,
    of: Sequence[str] | None = None,
    against: str | None = None,
    extremes: bool = True,
    start: float | None = None,
    end: float | None = None,
) -> Axes:
    """Draw the series of several variants of a task, each in its colour, see `draw`."""
    ends = (start, end)
    finest = [_smooth(result, of, against, ends) for result in results]
    axes = [_along(fine, result, against) for fine, result in zip(finest, results, strict=True)]
    lines = [replace(line, variant=k) for k, fine in enumerate(finest) for line in _lines(fine, of)]
    if ends != (None, None):
        axes, rows = zip(*(in_window(axis, *ends) for axis in axes), strict=True)
        lines = [line.at(rows[line.variant]) for line in lines]
    if not lines:
        raise InputError("there is no series to draw", hint="name some: of=[...]")
    groups = list(_panels(lines))
    several = len(results) > 1
    # what holds along one variant would be read as holding for all
    arcs = [] if several else arcs_of(finest[0], axes[0])
    events = [] if several else events_of(results[0], axes[0])
    clips = [_clip(axes, group) for group in groups]
    whole = replace(axes[0], values=np.concatenate([axis.values for axis in axes]))
    key = [*key_of(axes[0], arcs, events), *beyond_key(whole, clips)]
    if several:
        key = [Entry(name, line=_line_of(k)) for k, name in enumerate(names)] + key
    labels = [_end(line, group, names) for group in groups for line in group]
    frame = Panels(
        ax,
        len(groups),
        results[0],
        subtitle_of(results[0], *([] if several else [text for text in names if text])),
        key,
        labels,
        rows=max(len(group) for group in groups),
    )
    draw_axis(frame, whole, arcs, events)
    for panel, group, clip in zip(frame.panels, groups, clips, strict=True):
        _draw_panel(frame, panel, group, axes, results, names, extremes, clip)
    frame.label(frame.panels[-1], axes[0].scale.named(axes[0].label))
    return frame.panels[0]


def _lines(result: Result, of: Sequence[str] | None) -> list[Line]:
    if of is None:
        return default_lines(result)
    return [line for path in of for series in with_rates(result, path)
            for line in lines_of(result, series)]  # fmt: skip


def _along(finest: Result, result: Result, against: str | None) -> Abscissa:
    """Return the abscissa of a result at more poses, which are counted as those asked for."""
    axis = abscissa_of(finest, against)
    step = max((len(axis.values) - 1) // max(len(result.status) - 1, 1), 1)
    axis = replace(axis, dots=(0, step))
    if axis.kind != "pose" or len(axis.values) < 2:
        return axis
    return replace(axis, values=np.linspace(0.0, len(result.status) - 1.0, len(axis.values)))


def _smooth(
    result: Result, of: Sequence[str] | None, against: str | None, ends: Ends = (None, None)
) -> Result:
    """Return a result at poses between which its series are drawn as straight lines."""
    names = [(line.path, line.name) for line in _lines(result, of)]

    def seen(finer: Result) -> list[Array]:
        axis = _along(finer, result, against)
        axis, rows = in_window(axis, *ends) if ends != (None, None) else (axis, slice(None))
        lines = [line for line in _lines(finer, of) if line.quantity not in LOGARITHMIC]
        return [track for line in lines for track in in_panel(axis.values, line.values[rows])]

    finest = smooth(result, seen)
    same = [(line.path, line.name) for line in _lines(finest, of)] == names
    return finest if same else result


def _line_of(variant: int) -> Json:
    return {"color": style.color_of(variant), "linewidth": 1.5}


def _end(line: Line, group: Sequence[Line], names: Sequence[str]) -> str:
    """Return what stands at the end of a curve: its name, with that of its variant."""
    same = [other for other in group if other.variant == line.variant]
    if len(names) == 1:
        return _label(line, same)
    return names[line.variant] if len(same) == 1 else f"{_label(line, same)}, {names[line.variant]}"


def _panels(lines: Sequence[Line]) -> Iterator[list[Line]]:
    """Yield the lines of each unit; what grows by powers of ten has its own panel."""
    groups: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        quantity = line.quantity if line.unit in ("1", "") else ""
        quantity = line.quantity if line.quantity in LOGARITHMIC else quantity
        groups.setdefault((line.unit, quantity), []).append(line)
    yield from groups.values()


def _label(line: Line, group: Sequence[Line]) -> str:
    same = len({other.quantity for other in group}) == 1
    if same:
        return line.name or line.quantity
    words = {other.quantity for other in group if other.name == line.name}
    if len(words) > 1 or not line.quantity.startswith("reaction"):
        return f"{line.name} {line.quantity}".strip()
    return line.name


def _quantity(group: Sequence[Line], scale: Scale) -> str:
    words = list(dict.fromkeys(line.quantity.split(",")[0] for line in group if line.quantity))
    names = {line.name for line in group}
    if len(words) == 1:
        word = words[0]
    elif words and {word.split(" ")[0] for word in words} <= {"reaction", "normal"}:
        word = "force"
    else:
        word = names.pop() if len(names) == 1 and not words else QUANTITIES.get(group[0].unit, "")
    return scale.named(word)


def _clip(axes: Sequence[Abscissa], group: Sequence[Line]) -> Clip | None:
    """Return limits for a panel that poles would flatten."""
    rises = all(axis.rises for axis in axes)
    if not rises or all(line.quantity in LOGARITHMIC for line in group):
        return None
    values = [line.values for line in group]
    each = []
    for line in group:
        axis = axes[line.variant]
        each.append(clip_of(axis.values, line.values, _cuts(axis, line)))
    return joined(each, values)


def _cuts(axis: Abscissa, line: Line) -> list[int]:
    """Return the poses after which a line is not drawn on."""
    return list(line.cuts) or (cuts(line.values) if axis.rises else [])


def _draw_panel(
    frame: Panels,
    panel: Axes,
    group: list[Line],
    axes: Sequence[Abscissa],
    results: Sequence[Any],
    names: Sequence[str],
    extremes: bool,
    clip: Clip | None,
) -> None:
    axis, several = axes[0], len(results) > 1
    marked = extremes and axis.kind == "driver"
    shown = [line.values for line in group] if clip is None else [[clip.low, clip.high]]
    scale = scale_of(group[0].unit, shown, results[0].units)
    looks = _looks(group)
    logarithmic = all(line.quantity in LOGARITHMIC for line in group)
    if logarithmic:
        unit = results[0].units.of(group[0].unit)
        scale = Scale("" if unit.name == "1" else unit.name, unit.factor)
    style_of = "-" if axis.rises or axis.kind == "path" else ""
    for line, (color, dash) in zip(group, looks, strict=True):
        along, result = axes[line.variant], results[line.variant]
        variant = f"-{names[line.variant]}" if several else ""
        lined = style_of if not few_named(result) else ""
        count = len(result.status)
        track = with_gaps(along.shown, scale(line.values), _cuts(along, line))
        look: Json = {"linestyle": (dash or lined) if lined else "", "linewidth": 1.4}
        look |= {"marker": "o" if count <= FEW or not lined else "", "markersize": 3.2}
        gid = f"curve-{line.path}-{line.name}{variant}"
        frame.line(panel, gid, *track, color=color, markevery=along.dots if lined else None, **look)
    finite = [scale(line.values)[np.isfinite(line.values)] for line in group]
    everything = np.concatenate([*finite, np.zeros(0)])
    if logarithmic and (everything > 0).any():
        _decades(panel, everything[everything > 0])
    elif clip is not None:
        _limits(frame, panel, scale(np.array([clip.low, clip.high])), scale, 0.0)
        for place in clip.beyond:
            at, gid = float(axis.scale(place.at)), f"beyond-{group[0].unit}"
            frame.upright(panel, at, BEYOND, gid, style.FAINT)
    elif everything.size:
        room = EXTREMES * frame.k / float(frame.size_of(panel)[1]) if marked else MARGIN
        _limits(frame, panel, everything, scale, room)
    frame.label(panel, y=_quantity(group, scale))
    if marked:
        places = Places(frame, panel)
        for line in group:
            places.keep(axes[line.variant].shown, scale(line.values))
        for line, (color, _) in zip(group, looks, strict=True):
            owner = axes[line.variant], results[line.variant]
            _mark(frame, panel, places, line, scale, *owner, color)
    ends = [(scale(line.values), _end(line, group, names)) for line in group]
    frame.ends(panel, [(*end, color) for end, (color, _) in zip(ends, looks, strict=True)])


def _looks(group: Sequence[Line]) -> list[tuple[str, Any]]:
    """Return colour and dashes of each line; without friction those of its partner, dotted.

    Of several variants each has its colour, and each series its dashes.
    """
    several = len({line.variant for line in group}) > 1
    looks: list[tuple[str, Any]] = []
    known: dict[tuple[str, str], str] = {}
    count = Counter[int]()
    for line in group:
        name, variant = line.name.split(",")[0], line.variant * several
        partner = known.get((line.partner, name))
        if partner is not None and not several:
            looks.append((partner, style.DOTTED))
            continue
        k = count[variant]
        color = style.color_of(line.variant if several else k)
        looks.append((color, style.DASHES[k % len(style.DASHES)]))
        known[(line.path, name)] = color
        count[variant] += 1
    return looks


def _limits(frame: Panels, panel: Axes, values: Array, scale: Scale, room: float) -> None:
    same = float(np.ptp(values)) <= 1e-9 * float(np.abs(values).max())
    frame.limits(panel, values, (0.1, 0.1) if same else (room, room))
    frame.turns(panel.yaxis, scale, float(np.ptp(panel.get_ylim())) / (1 + 2 * room), 6)


def _decades(panel: Axes, values: Array) -> None:
    """Set a logarithmic scale from one power of ten to another."""
    low, high = np.floor(np.log10(values.min())), np.ceil(np.log10(values.max()))
    high = max(high, low + 1)
    panel.set_yscale("log")
    panel.set_ylim(10.0**low, 10.0**high)
    panel.yaxis.set_major_locator(LogLocator(10.0, numticks=6))
    panel.yaxis.set_minor_locator(NullLocator())


def _mark(
    frame: Panels,
    panel: Axes,
    places: Places,
    line: Line,
    scale: Scale,
    axis: Abscissa,
    result: SweepResult,
    color: str,
) -> None:
    """Mark least and greatest values where the result has them, refined between the poses."""
    first, last = axis.ends
    for word, at, value in _extremes(result, line):
        place, height = float(axis.scale(at)), float(scale(value))
        low, high = panel.get_ylim()
        if not (first <= at <= last and low <= height <= high):
            continue
        marker, gid = "v" if word == "max" else "^", f"extreme-{word}-{line.path}"
        frame.mark(panel, (place, height), marker, 6.5, color, gid)
        text = f"{number(height, 4)} at {axis.text(at, 4)}"
        places.write(place, height, text, color, above=word == "max")


def _extremes(result: SweepResult, line: Line) -> Iterator[tuple[str, float, float]]:
    known = result.summary.get("extremes", {}).get(line.extreme) or {}
    yield from ((word, known[word]["at"], known[word]["value"]) for word in known)
    angle = result.summary.get("transmission", {}).get(line.name)
    if not known and angle and line.quantity == "transmission angle":
        yield "min", angle["at"], angle["min"]
        yield "max", angle["max_at"], angle["max"]

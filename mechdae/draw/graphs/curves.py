"""Series against the driver or time: a panel for each unit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import repeat
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from mechdae.draw import style
from mechdae.draw.graphs.abscissa import (
    BEYOND,
    Abscissa,
    StatusArc,
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
from mechdae.draw.graphs.series import (
    SMALL,
    Array,
    Line,
    default_lines,
    lines_of,
    noise_of,
    with_rates,
)
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
    results: Sequence[Result], names: Sequence[str], ax: Axes | None, *,
    of: Sequence[str] | None = None, against: str | None = None, extremes: bool = True,
    start: float | None = None, end: float | None = None,
) -> Axes:  # fmt: skip
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
        lined = ({"color": style.color_of(k), "linewidth": 1.5} for k in range(len(names)))
        key = [*map(Entry, names, repeat(None), lined), *key]
    frame = CurvePanels(ax, groups, axes, results, names, key, arcs)
    draw_axis(frame, whole, arcs, events)
    for panel, group, clip in zip(frame.panels, groups, clips, strict=True):
        frame.draw(panel, group, clip, extremes)
    frame.label(frame.panels[-1], axes[0].scale.named(axes[0].label))
    return frame.panels[0]


def _lines(result: Result, of: Sequence[str] | None) -> list[Line]:
    """Return the series drawn; those of a unit that are all rounding noise are zero."""
    lines = default_lines(result) if of is None else []
    if of is not None:
        paths = [series for path in of for series in with_rates(result, path)]
        lines = [line for path in paths for line in lines_of(result, path)]
    sizes: dict[str, float] = {}
    for line in lines:
        size = np.abs(line.values[np.isfinite(line.values)]).max(initial=0.0)
        sizes[line.unit] = max(float(size), sizes.get(line.unit, 0.0))
    noisy = [unit for unit, size in sizes.items() if size <= noise_of(result, unit)]
    return [
        replace(line, values=0.0 * line.values) if line.unit in noisy else line for line in lines
    ]


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
    most = [float(np.abs(row[np.isfinite(row)]).max(initial=0.0)) for row in values]
    each = []
    for line, size in zip(group, most, strict=True):
        axis, noise = axes[line.variant], size <= SMALL * max(most)
        each.append(None if noise else clip_of(axis.values, line.values, _cuts(axis, line)))
    return joined(each, values)


def _cuts(axis: Abscissa, line: Line) -> list[int]:
    """Return the poses after which a line is not drawn on."""
    return list(line.cuts) or (cuts(line.values) if axis.rises else [])


class CurvePanels(Panels):
    """Panels of series, one for each unit; several results are variants with their names."""

    def __init__(
        self, ax: Axes | None, groups: Sequence[list[Line]], axes: Sequence[Abscissa],
        results: Sequence[Any], names: Sequence[str], key: Sequence[Entry],
        arcs: Sequence[StatusArc] = (),
    ) -> None:  # fmt: skip
        self.axes, self.results, self.names, self.arcs = axes, results, names, arcs
        self.several: bool = len(results) > 1
        ends = [self._end(line, group) for group in groups for line in group]
        about = subtitle_of(results[0], *([] if self.several else filter(None, names)))
        count, rows = len(groups), max(map(len, groups))
        super().__init__(ax, count, results[0], about, key, ends, rows=rows)

    def _end(self, line: Line, group: Sequence[Line]) -> str:
        """Return what stands at the end of a curve: its name, with that of its variant."""
        same, variant = [row for row in group if row.variant == line.variant], line.variant
        if not self.several:
            return _label(line, same)
        title = self.names[variant]
        return title if len(same) == 1 else f"{_label(line, same)}, {title}"

    def draw(self, panel: Axes, group: list[Line], clip: Clip | None, extremes: bool) -> None:
        """Draw series of one unit, within limits where poles would flatten them."""
        axis, units = self.axes[0], self.results[0].units
        marked = extremes and axis.kind == "driver"
        shown = [line.values for line in group] if clip is None else [[clip.low, clip.high]]
        scale, looks = scale_of(group[0].unit, shown, units), _looks(group)
        logarithmic = all(line.quantity in LOGARITHMIC for line in group)
        if logarithmic:
            unit = units.of(group[0].unit)
            scale = Scale("" if unit.name == "1" else unit.name, unit.factor)
        for line, (color, dash) in zip(group, looks, strict=True):
            self._curve(panel, line, scale, color, dash)
        finite = [scale(line.values[np.isfinite(line.values)]) for line in group]
        everything = np.concatenate([*finite, np.zeros(0)])
        if logarithmic and (everything > 0).any():
            _decades(panel, everything[everything > 0])
        elif clip is not None:
            _limits(self, panel, scale(np.array([clip.low, clip.high])), scale, 0.0)
            for place in clip.beyond:
                at, gid = float(axis.scale(place.at)), f"beyond-{group[0].unit}"
                self.upright(panel, at, BEYOND, gid, style.FAINT)
        elif everything.size:
            room = EXTREMES * self.k / float(self.size_of(panel)[1]) if marked else MARGIN
            _limits(self, panel, everything, scale, room)
        self.label(panel, y=_quantity(group, scale))
        if marked:
            places = Places(self, panel)
            for line in group:
                places.keep(self.axes[line.variant].shown, scale(line.values))
            for line, (color, _) in zip(group, looks, strict=True):
                self._mark(places, line, scale, color)
        shown = [self.axes[line.variant].onward(scale(line.values)) for line in group]
        ends = [(row, self._end(line, group)) for row, line in zip(shown, group, strict=True)]
        self.ends(panel, [(*end, color) for end, (color, _) in zip(ends, looks, strict=True)])

    def _curve(self, panel: Axes, line: Line, scale: Scale, color: str, dash: Any) -> None:
        along, result = self.axes[line.variant], self.results[line.variant]
        lined = (self.axes[0].rises or self.axes[0].kind == "path") and not few_named(result)
        track = with_gaps(along.shown, scale(line.values), _cuts(along, line))
        look: Json = {"linestyle": (dash or "-") if lined else "", "linewidth": 1.4}
        dots = len(result.status) <= FEW or not lined
        look |= {"marker": "o" if dots else "", "markersize": 3.2, "color": color}
        look |= {"clip_on": lined}
        variant = f"-{self.names[line.variant]}" if self.several else ""
        gid = f"curve-{line.path}-{line.name}{variant}"
        self.line(panel, gid, *track, markevery=along.dots if lined else None, **look)

    def _mark(self, places: Places, line: Line, scale: Scale, color: str) -> None:
        """Mark least and greatest values where the result has them, refined between the poses."""
        panel, axis = places.panel, self.axes[line.variant]
        first, last = axis.ends
        low, high = panel.get_ylim()
        result = self.results[line.variant]
        for word, at, value in _extremes(result, line):
            value *= abs(value) > noise_of(result, line.unit)
            place, height = float(axis.scale(at)), float(scale(value))
            away = any(arc.start < at < arc.end for arc in self.arcs if arc.word == "stopped")
            if away or not (first <= at <= last and low <= height <= high):
                continue
            marker, gid = "v" if word == "max" else "^", f"extreme-{word}-{line.path}"
            self.mark(panel, (place, height), marker, 6.5, color, gid)
            text = f"{number(height, 4)} at {axis.text(at, 4)}"
            places.write(place, height, text, color, above=word == "max")


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


def _extremes(result: SweepResult, line: Line) -> Iterator[tuple[str, float, float]]:
    known = result.summary.get("extremes", {}).get(line.extreme) or {}
    yield from ((word, known[word]["at"], known[word]["value"]) for word in known)
    angle = result.summary.get("transmission", {}).get(line.name)
    if not known and angle and line.quantity == "transmission angle":
        yield "min", angle["at"], angle["min"]
        yield "max", angle["max_at"], angle["max"]

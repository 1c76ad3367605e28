"""Panels above each other with title, key and labels, places for texts; measured in points."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MultipleLocator
from matplotlib.transforms import Affine2D
from numpy.typing import ArrayLike

from mechdae.draw import style
from mechdae.draw.diagram.heads import HINTED, fitted, in_lines
from mechdae.draw.figure import current_format, figure_of, new_figure, note
from mechdae.draw.fonts import Font, font, ink, plain
from mechdae.draw.graphs.scale import Scale, step_of
from mechdae.draw.graphs.series import Array
from mechdae.draw.labels.layout import first_free
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.records import dataclass
from mechdae.types import Floats, Json

LEFT, BOTTOM, GAP = 62.0, 40.0, 16.0
HEIGHTS = {1: 262.0, 2: 158.0}
"""Height of each panel by their number [pt]; of more panels `LOW`."""
LOW = 122.0
SWATCH = (16.0, 8.0)
LIFT, ROW = 9.0, 13.0
"""Lowest row of text above the panels, and from one row to the next [pt]."""
LARGEST = 2.0
LOWEST = 0.62
"""Least height of panels on narrow paper, over the usual one."""


SCALED = ("linewidth", "markersize", "markeredgewidth")
"""Options of lines that are smaller in a smaller figure."""


@dataclass(frozen=True)
class Entry:
    """One entry of the key: an area (face, edge, hatch), a line, or a mark, and its text."""

    text: str
    area: tuple[str, str, str] | None = None
    line: dict[str, Any] = field(default_factory=dict)


def shaded(area: tuple[str, str, str]) -> Json:
    """Return the options of a patch with face, edge and hatch."""
    return {**dict(zip(("facecolor", "edgecolor", "hatch"), area, strict=True)), "linewidth": 0.0}


class Panels:
    """Panels in a new figure, or in the place of given axes, with what stands around them.

    Parameters
    ----------
    ax
        Axes whose place is divided; None makes a new figure.
    count
        Number of panels.
    result, subtitle
        Whose title is written above, and what below it; None: neither.
    key
        Entries below the subtitle.
    names
        Labels of curves that need room to the right of the panels.
    height
        Height of all panels in a new figure [pt].
    rows
        Names that have to stand beside one panel, which is high enough for them.

    Attributes
    ----------
    k
        Points per unit of style, 1 in a new figure.
    panels
        The axes, from above; the first is the one that was given.
    """

    def __init__(
        self, ax: Axes | None, count: int, result: Any, subtitle: str = "",
        key: Sequence[Entry] = (), names: Sequence[str] = (), height: float | None = None,
        rows: int = 1,
    ) -> None:  # fmt: skip
        sheet = current_format()
        if ax is not None:
            figure = figure_of(ax)
            x0, y0, width, high = np.array(ax.get_window_extent().bounds) * 72.0 / figure.dpi
            self.k: float = float(np.clip(width / (style.GRAPH - LEFT), style.SMALLEST, LARGEST))
            start, room = x0, width
        else:
            figure, width = new_figure(), style.GRAPH * sheet.share
            self.k = min(max(sheet.share, style.SMALLEST), 1.0)
            x0, y0, start, room = self.k * np.array([LEFT, BOTTOM, 12.0, -24.0])
            room += width
        k = self.k
        small = font(style.TICK * k, style.NOTE_FONT)
        right = max((float(ink(name, small)[1][0]) for name in names), default=0.0)
        right = min(right, 0.35 * width) + (10.0 * k if names else 0.0)
        entries = _rows(key, room, k)
        title = "" if result is None else str(result.title or result.problem)
        lines = in_lines(title, 0.75 * style.TITLE * k, room, style.NOTE_FONT)
        if ax is None:
            titles = ROW + 20.0 * len(lines) if sheet.titled else 0.0
            above = k * (LIFT + ROW * len(entries) + titles)
            each = max(HEIGHTS.get(count, LOW), 10.0 * rows + 8.0)
            low = max(sheet.share, LOWEST) if sheet.width is not None else 1.0
            high = low * (height if height is not None else count * each + (count - 1) * GAP)
            figure.set_size_inches(width / 72, (high + y0 + above) / 72)
            width -= k * (LEFT + 14.0)
        self.figure: Figure = figure
        self.box: tuple[float, float, float, float] = (x0, y0, width - right, high)
        self.points = Affine2D().scale(1 / 72) + figure.dpi_scale_trans
        self.uprights: list[tuple[Axes, float]] = []
        self.panels: list[Axes] = self._panels(ax, count)
        self._write(entries, [] if result is None else lines, subtitle, start, room)

    def _panels(self, ax: Axes | None, count: int) -> list[Axes]:
        x0, y0, width, height = self.box
        gap = GAP * self.k
        each = (height - (count - 1) * gap) / count
        w, h = self.figure.get_size_inches() * 72
        panels: list[Axes] = []
        for k in range(count):
            low = y0 + height - (k + 1) * each - k * gap
            place = (x0 / w, low / h, width / w, each / h)
            if k == 0 and ax is not None:
                ax.set_position(place)
                panel = ax
            else:
                panel = self.figure.add_axes(place, sharex=panels[0] if k else None)
            panels.append(panel)
            self._plain(panel, last=k == count - 1)
        return panels

    def _plain(self, panel: Axes, last: bool) -> None:
        panel.set_facecolor(style.PAPER)
        panel.spines[["top", "right"]].set_visible(False)
        panel.spines[["left", "bottom"]].set(color=style.FAINT, linewidth=style.THIN * self.k)
        panel.grid(True, color=style.GHOST, linewidth=0.5 * self.k)
        panel.set_axisbelow(True)
        panel.tick_params(
            labelsize=style.TICK * self.k, labelfontfamily=style.NOTE_FONT[0], color=style.FAINT,
            labelcolor=style.INK, width=style.THIN * self.k, length=3.0 * self.k, labelbottom=last,
        )  # fmt: skip

    def scaled(self, look: Json) -> Json:
        """Return the options of a line with the widths and sizes that they have here."""
        return {name: size * self.k if name in SCALED else size for name, size in look.items()}

    def line(self, panel: Axes, gid: str, x: ArrayLike, y: ArrayLike, **look: Any) -> None:
        """Draw a curve or marks, whose `look` is that in a new figure."""
        panel.plot(x, y, gid=gid, **{"zorder": 3, **self.scaled(look)})

    def mark(
        self, panel: Axes, place: tuple[float, float], marker: str, size: float, color: str,
        gid: str,
    ) -> None:  # fmt: skip
        """Draw a mark of a curve, with an edge of paper."""
        look: Json = {"marker": marker, "markersize": size, "color": color, "linestyle": ""}
        look |= {"markeredgecolor": style.PAPER, "markeredgewidth": 0.6}
        look |= {"clip_on": False, "zorder": 4}
        self.line(panel, gid, [place[0]], [place[1]], **look)

    def upright(
        self, panel: Axes, x: float, dash: object, gid: str, color: str = style.INK
    ) -> None:
        """Draw an upright line through a panel."""
        self.uprights.append((panel, x))
        look: Json = {"color": color, "linewidth": style.LINE * self.k, "linestyle": dash}
        panel.axvline(x, zorder=1.6, clip_on=False, gid=gid, **look)

    def zero(self, panel: Axes) -> None:
        """Draw the line of zero."""
        panel.axhline(0.0, color=style.FAINT, linewidth=0.8 * self.k, zorder=1)

    def turns(self, axis: Axis, scale: Scale, span: float, most: int = 9) -> None:
        """Set ticks that divide a turn well on an axis that shows so many degrees."""
        if scale.unit == "deg" and span > 1:
            axis.set_major_locator(MultipleLocator(step_of(span, most)))

    def limits(
        self, panel: Axes, values: Array, room: tuple[float, float], way: str = "y",
        decades: float = np.inf,
    ) -> bool:  # fmt: skip
        """Set the limits of an axis with room below and above, as shares of what values span.

        Returns whether it is logarithmic, as for values above zero that span such a ratio.
        """
        low, high = float(values.min()), float(values.max())
        log = low > 0 and high > decades * low
        low, high = (np.log10(low), np.log10(high)) if log else (low, high)
        span = high - low
        if span <= 1e-9 * max(abs(low), abs(high)):
            span = 1.0 if log else max(abs(low), abs(high)) or 1.0
        ends = np.array([low - room[0] * span, high + room[1] * span])
        if log:
            getattr(panel, f"set_{way}scale")("log")
        getattr(panel, f"set_{way}lim")(*(10**ends if log else ends))
        return log

    def rectangle(self, corner: tuple[float, float], wide: float, tall: float, **look: Any) -> None:
        """Draw a rectangle at a place in points from the figure's corner."""
        patch = Rectangle(corner, wide, tall, transform=self.points, clip_on=False, **look)
        self.panels[0].add_artist(patch)

    def size_of(self, panel: Axes) -> Floats:
        """Return width and height of a panel [pt]."""
        return np.array(panel.get_window_extent().size) * 72.0 / self.figure.dpi

    def equal(self, panel: Axes, low: Floats, high: Floats, border: float = 0.0) -> float:
        """Set equal scales on both axes; return the size of a point [unit shown].

        ``border`` is free around what lies from `low` to `high` (2,) [pt].
        """
        size = self.size_of(panel)
        room = np.maximum(size - 2 * border * self.k, 20.0)
        unit = float(((high - low) / room).max()) or 1.0 / float(room.min())
        middle, ends = (low + high) / 2, np.array([-0.5, 0.5]) * unit
        panel.set_xlim(*(middle[0] + ends * size[0]))
        panel.set_ylim(*(middle[1] + ends * size[1]))
        panel.set_aspect("equal", adjustable="datalim")
        return unit

    def label(self, panel: Axes, x: str | None = None, y: str | None = None) -> None:
        """Write the labels of axes."""
        small = font((style.TICK + 0.5) * self.k, style.NOTE_FONT)
        if x is not None:
            panel.set_xlabel(plain(x), fontproperties=small.properties, color=style.INK)
        if y is not None:
            panel.set_ylabel(plain(y), fontproperties=small.properties, color=style.INK)
            corner = panel.get_window_extent().x0 * 72 / self.figure.dpi
            share = self.box[0] / LEFT
            ours = min(abs(share - 1.0), abs(share - self.k)) < 1e-8
            if ours and abs(corner - self.box[0]) < 1e-6:
                panel.yaxis.set_label_coords(-44.0 * share / self.box[2], 0.5)

    def _write(
        self, rows: list[list[tuple[float, Entry]]], lines: list[str], subtitle: str, start: float,
        room: float,
    ) -> None:  # fmt: skip
        k, y = self.k, self.box[1] + self.box[3] + LIFT * self.k
        for row in reversed(rows):
            for offset, entry in row:
                self._entry(start + offset, y, entry)
            y += ROW * k
        if not (lines and current_format().titled):
            return
        room *= HINTED
        text, chosen = fitted(subtitle, style.SUBTITLE * k, room, style.NOTE_FONT)
        self.text(start, y + (2.0 if rows else 0.0) * k, text, chosen, style.FAINT, "subtitle")
        y += 17.0 * k
        size = style.TITLE * (1.0 if len(lines) == 1 else 0.85) * k
        for number, line in enumerate(reversed(lines)):
            text, chosen = fitted(line, size, room, style.NOTE_FONT)
            self.text(start, y, text, chosen, style.INK, f"title-{number}")
            y += 15.0 * k

    def _entry(self, x: float, y: float, entry: Entry) -> None:
        k, panel = self.k, self.panels[0]
        width, height = SWATCH[0] * k, SWATCH[1] * k
        if entry.area is not None:
            gid = f"key-{entry.text.split(' ')[0]}"
            self.rectangle((x, y - 1.0 * k), width, height, gid=gid, **shaded(entry.area))
        else:
            upright = entry.line.get("upright", False)
            options = {name: value for name, value in entry.line.items() if name != "upright"}
            if upright:
                xs, ys = [x + width / 2] * 2, [y - 2.0 * k, y + 9.0 * k]
            else:
                xs, ys = [x, x + width], [y + 3.0 * k] * 2
            if options.get("marker"):
                xs, ys = [x + width / 2], [y + 3.0 * k]
            panel.add_artist(Line2D(xs, ys, transform=self.points, clip_on=False, **options))
        small = font(style.TICK * k, style.NOTE_FONT)
        self.text(x + width + 4.0 * k, y, entry.text, small, style.INK, None)

    def text(
        self, x: float, y: float, text: str, chosen: Font, color: str, gid: str | None, **more: Any
    ) -> None:
        """Write a text at a place in points from the figure's corner."""
        look = {"fontproperties": chosen.properties, "color": color, "gid": gid, **more}
        self.panels[0].text(x, y, plain(text), transform=self.points, clip_on=False, **look)

    def ends(self, panel: Axes, entries: Sequence[tuple[Floats, str, str]]) -> None:
        """Write names (values, text, colour) to the right of a panel, near the last values."""
        if not entries:
            return
        k, box, inch = self.k, panel.get_window_extent(), 72.0 / self.figure.dpi
        middle = [float(np.mean(panel.get_ylim()))]
        last = [[*middle, *row[0][np.isfinite(row[0])].tolist()][-1] for row in entries]
        at_end = [(panel.get_xlim()[1], value) for value in last]
        wanted = ((panel.transData.transform(at_end)[:, 1] - box.y0) * inch).tolist()
        small = font(style.TICK * k, style.NOTE_FONT)
        room = max(24.0, 0.35 * (self.box[2] + 100.0))
        spots = spread(wanted, 10.0 * k, 4.0 * k, box.height * inch - 4.0 * k)
        for y, at, value, (_, name, color) in zip(spots, wanted, last, entries, strict=True):
            text, chosen = fitted(name, small.size, room, style.NOTE_FONT)
            more = {"xycoords": panel.get_yaxis_transform(), "va": "center_baseline"}
            note(panel, plain(text), (1.0, value), (6.0 * k, y - at), chosen, color, **more)


def spread(wanted: Sequence[float], apart: float, low: float, high: float) -> list[float]:
    """Return places near the wanted ones, in their order, not nearer to each other than that."""
    order = sorted(range(len(wanted)), key=lambda i: (wanted[i], -i))
    apart = min(apart, (high - low) / max(len(wanted) - 1, 1))
    places = [0.0] * len(wanted)
    least = low
    for i in order:
        places[i] = least = max(wanted[i], least)
        least += apart
    most = high
    for i in reversed(order):
        places[i] = most = min(places[i], most)
        most -= apart
    # more than fit keep their distance and run over
    for left, right in itertools.pairwise(order):
        if places[right] - places[left] < apart - 1e-9:
            places[right] = places[left] + apart
    return places


def _rows(key: Sequence[Entry], room: float, k: float) -> list[list[tuple[float, Entry]]]:
    """Return the key's entries with their places, row by row."""
    small = font(style.TICK * k, style.NOTE_FONT)
    rows: list[list[tuple[float, Entry]]] = []
    x = 0.0
    for entry in key:
        width = (SWATCH[0] + 4.0) * k + float(ink(entry.text, small)[1][0])
        if not rows or x + width > room:
            rows.append([])
            x = 0.0
        rows[-1].append((x, entry))
        x += width + 14.0 * k
    return rows


NEAR = 2.0
"""Distance of texts from what they keep off [pt]."""
STEP = 2.5
"""Longest piece of a curve that is kept off [pt]."""


class Places:
    """What texts in one panel keep off: upright lines, curves and the texts so far [pt].

    The limits of the panel are to be final.
    """

    def __init__(self, frame: Panels, panel: Axes) -> None:
        self.frame, self.panel = frame, panel
        self.corner: Floats = np.array(panel.get_window_extent().p0)
        self.inch: float = 72.0 / frame.figure.dpi
        self.size: Floats = frame.size_of(panel)
        self.lines: Array = np.zeros((0, 5))
        self.boxes: list[tuple[float, float, float, float, float]] = []
        for beside, x in frame.uprights:
            if beside is panel:
                self.keep([x, x], panel.get_ylim())

    def at(self, x: object, y: object) -> Array:
        """Return places in points from the corner of the panel."""
        data = np.stack([np.asarray(x, float), np.asarray(y, float)], axis=-1)
        places: Array = self.panel.transData.transform(data) - self.corner
        return places * self.inch

    def keep(self, x: object, y: object) -> None:
        """Keep texts off a curve."""
        places = self.at(x, y)
        places = places[np.isfinite(places).all(axis=1)]
        if len(places) > 1:
            steps = np.hypot(*np.diff(places, axis=0).T)
            length = np.concatenate([[0.0], np.cumsum(steps)])
            fine = np.linspace(0.0, length[-1], max(int(length[-1] / STEP), 2))
            places = np.stack([np.interp(fine, length, column) for column in places.T], axis=1)
        rows = np.hstack([places[: max(len(places) - 1, 1)], places[-max(len(places) - 1, 1) :]])
        self.lines = np.vstack([self.lines, np.insert(rows, 4, 1.0, axis=1)])

    def write(
        self, x: float, y: float, text: str, color: str, *, above: bool = True,
        away: tuple[float, float] | None = None,
    ) -> bool:  # fmt: skip
        """Write a text near a place if there is room; above or below it, or `away` from it."""
        k = self.frame.k
        small = font(max(style.LEAST, style.TICK * 0.94 * k), style.NOTE_FONT)
        low, high = ink(text, small)
        width, height = float(high[0] - low[0]), style.TICK * 0.8 * k
        here = self.at(x, y)
        offsets = np.array(self._offsets(width, height, above, away))
        half = np.array([width / 2 + NEAR, height / 2 + NEAR])
        chosen = first_free(here + offsets, half, Obstacles(self.lines, self.boxes, self.size))
        if chosen is None:
            return False
        spot = here + offsets[chosen]
        self.boxes.append((*(spot - half), *(spot + half), 1.0))
        dx, dy = offsets[chosen] - (width / 2, height / 2)
        note(self.panel, plain(text), (x, y), (dx - float(low[0]), dy), small, color, zorder=5)
        return True

    def _offsets(
        self, width: float, height: float, above: bool, away: tuple[float, float] | None
    ) -> list[tuple[float, float]]:
        k = self.frame.k
        if away is not None:
            reach = [9.0 * k, 13.0 * k, 18.0 * k]
            dx, dy = away
            return [
                (dx * (r + width / 2 * abs(dx)), dy * (r + height / 2 * abs(dy))) for r in reach
            ]
        side = 1.0 if above else -1.0
        rise = [side * (height / 2 + 5.0 * k), side * (height / 2 + 9.0 * k)]
        shifts = [0.0, 0.3 * width, -0.3 * width, width / 2 + 5.0 * k, -width / 2 - 5.0 * k]
        found = [(dx, dy) for dy in rise for dx in shifts]
        found += [(dx, 0.0) for dx in (width / 2 + 7.0 * k, -width / 2 - 7.0 * k)]
        return found + [(dx, -dy) for dx, dy in found[: len(shifts)]]

"""Panels above each other with title, key and labels of curves; all measured in points."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.transforms import Affine2D

from mechdae.draw import style
from mechdae.draw.diagram.diagram import fitted, in_lines
from mechdae.draw.figure import Drawing, current_format
from mechdae.draw.fonts import Font, font, ink
from mechdae.records import dataclass

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


@dataclass(frozen=True)
class Entry:
    """One entry of the key: an area (face, edge, hatch), a line, or a mark, and its text."""

    text: str
    area: tuple[str, str, str] | None = None
    line: dict[str, Any] = field(default_factory=dict)


class Panels:
    """Panels in a new figure, or in the place of given axes, with what stands around them.

    Parameters
    ----------
    ax
        Axes whose place is divided; None makes a new figure.
    count
        Number of panels.
    title, subtitle
        Written above.
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
        self,
        ax: Axes | None,
        count: int,
        title: str,
        subtitle: str,
        key: Sequence[Entry] = (),
        names: Sequence[str] = (),
        height: float | None = None,
        rows: int = 1,
    ) -> None:
        width, sheet = style.GRAPH, current_format()
        if ax is not None:
            given = ax.get_figure(root=True)
            assert isinstance(given, Figure)
            figure = given
            box = ax.get_window_extent()
            x0, y0, width, own = np.array(box.bounds) * 72.0 / figure.dpi
            self.k: float = float(np.clip(width / (style.GRAPH - LEFT), style.SMALLEST, LARGEST))
        else:
            width *= sheet.share
            self.k = min(max(sheet.share, style.SMALLEST), 1.0)
            figure = Drawing(dpi=sheet.dpi, facecolor=style.PAPER)
            FigureCanvasAgg(figure)
        k = self.k
        small = font(style.TICK * k, style.NOTE_FONT)
        right = max((float(ink(name, small)[1][0]) for name in names), default=0.0)
        right = min(right, 0.35 * width) + (10.0 * k if names else 0.0)
        if ax is None:
            room = width - 24.0 * k
            entries = _rows(key, room, k)
            lines = in_lines(title, 0.75 * style.TITLE * k, room, style.NOTE_FONT)
            titles = ROW + 20.0 * len(lines) if sheet.titled else 0.0
            above = k * (LIFT + ROW * len(entries) + titles)
            each = max(HEIGHTS.get(count, LOW), 10.0 * rows + 8.0)
            low = max(sheet.share, LOWEST) if sheet.width is not None else 1.0
            tall = low * (height if height is not None else count * each + (count - 1) * GAP)
            x0, y0, own = k * LEFT, k * BOTTOM, tall
            figure.set_size_inches(width / 72, (tall + k * BOTTOM + above) / 72)
            width -= k * (LEFT + 14.0) + right
            start = 12.0 * k
        else:
            room, start = width, x0
            entries = _rows(key, room, k)
            lines = in_lines(title, 0.75 * style.TITLE * k, room, style.NOTE_FONT)
            width -= right
        self.figure: Figure = figure
        self.box: tuple[float, float, float, float] = (x0, y0, width, own)
        self.points = Affine2D().scale(1 / 72) + figure.dpi_scale_trans
        self.panels: list[Axes] = self._panels(ax, count)
        self._write(entries, lines, subtitle, start, room)

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
        for side in ("top", "right"):
            panel.spines[side].set_visible(False)
        for side in ("left", "bottom"):
            panel.spines[side].set_color(style.FAINT)
            panel.spines[side].set_linewidth(style.THIN * self.k)
        panel.grid(True, color=style.GHOST, linewidth=0.5 * self.k)
        panel.set_axisbelow(True)
        panel.tick_params(
            labelsize=style.TICK * self.k,
            labelfontfamily=style.NOTE_FONT[0],
            color=style.FAINT,
            labelcolor=style.INK,
            width=style.THIN * self.k,
            length=3.0 * self.k,
            labelbottom=last,
        )

    def label(self, panel: Axes, x: str | None = None, y: str | None = None) -> None:
        """Write the labels of axes."""
        small = font((style.TICK + 0.5) * self.k, style.NOTE_FONT)
        if x is not None:
            panel.set_xlabel(_plain(x), fontproperties=small.properties, color=style.INK)
        if y is not None:
            panel.set_ylabel(_plain(y), fontproperties=small.properties, color=style.INK)
            corner = panel.get_window_extent().x0 * 72 / self.figure.dpi
            share = self.box[0] / LEFT
            ours = min(abs(share - 1.0), abs(share - self.k)) < 1e-8
            if ours and abs(corner - self.box[0]) < 1e-6:
                panel.yaxis.set_label_coords(-44.0 * share / self.box[2], 0.5)

    def _write(
        self,
        rows: list[list[tuple[float, Entry]]],
        lines: list[str],
        subtitle: str,
        start: float,
        room: float,
    ) -> None:
        k, y = self.k, self.box[1] + self.box[3] + LIFT * self.k
        for row in reversed(rows):
            for offset, entry in row:
                self._entry(start + offset, y, entry)
            y += ROW * k
        if not current_format().titled:
            return
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
            face, edge, hatch = entry.area
            patch = Rectangle(
                (x, y - 1.0 * k),
                width,
                height,
                transform=self.points,
                facecolor=face,
                edgecolor=edge,
                hatch=hatch,
                linewidth=0.0,
                clip_on=False,
                gid=f"key-{entry.text.split(' ')[0]}",
            )
            panel.add_artist(patch)
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
        self.panels[0].text(
            x,
            y,
            _plain(text),
            transform=self.points,
            fontproperties=chosen.properties,
            color=color,
            gid=gid,
            clip_on=False,
            **more,
        )

    def ends(self, panel: Axes, entries: Sequence[tuple[float, str, str]]) -> None:
        """Write names (value, text, colour) to the right of a panel, near their values."""
        if not entries:
            return
        k = self.k
        box = panel.get_window_extent()
        inch = 72.0 / self.figure.dpi
        height = box.height * inch
        at_end = panel.get_xlim()[1]
        wanted = [
            float(panel.transData.transform((at_end, value))[1] - box.y0) * inch
            for value, _, _ in entries
        ]
        small = font(style.TICK * k, style.NOTE_FONT)
        room = max(24.0, 0.35 * (self.box[2] + 100.0))
        for y, at, (value, name, color) in zip(
            spread(wanted, 10.0 * k, 4.0 * k, height - 4.0 * k), wanted, entries, strict=True
        ):
            text, chosen = fitted(name, small.size, room, style.NOTE_FONT)
            panel.annotate(
                _plain(text),
                (1.0, value),
                xycoords=panel.get_yaxis_transform(),
                xytext=(6.0 * k, y - at),
                textcoords="offset points",
                va="center_baseline",
                fontproperties=chosen.properties,
                color=color,
                annotation_clip=False,
            )


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


def _plain(text: str) -> str:
    return text.replace("$", r"\$")

"""The sheet a diagram is drawn on: lengths in units, and a memory of what was drawn.

Positions on the sheet are in units from the lower left corner of the axes. Symbols and
letters have fixed sizes in units, the mechanism is scaled to fit. What must not be covered
by labels is kept as segments and boxes for `mechdae.draw.layout`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.textpath import TextPath
from numpy.typing import ArrayLike, NDArray

from mechdae.draw import style

Array = NDArray[np.float64]
SMALLEST, LARGEST = 0.6, 6.0
"""Bounds of the scale of symbols and letters: in small axes they shrink no further."""

MILLIMETRE = 72 / 25.4
"""Points (1/72 in) per millimetre."""

Dash = tuple[float, tuple[float, ...]]


class Sheet:
    """Axes with a scale, on which everything is drawn in units.

    Parameters
    ----------
    ax
        Axes to draw in; their limits, ticks and frame are set here.
    low, high
        Corners of the box [m] that the mechanism takes up.
    scale
        Metres per millimetre of paper, or a function of the smallest that the box allows,
        which is the default.
    theme
        What the colours of `mechdae.draw.style` become.
    memory
        Of the sheets of one motion: places chosen in the pose before, by name. What is
        drawn stays there if it can. Without it all places are free.

    Attributes
    ----------
    k
        Points (1/72 in) per unit.
    metre
        Units per metre.
    size
        Width and height of the axes in units.
    segments, boxes
        What labels avoid: rows (x0, y0, x1, y1, weight).
    """

    def __init__(
        self,
        ax: Axes,
        low: ArrayLike,
        high: ArrayLike,
        scale: float | Callable[[float], float] | None = None,
        theme: style.Theme = style.LIGHT,
        memory: dict[str, Array] | None = None,
    ) -> None:
        self.ax, self.theme, self.memory = ax, theme, memory
        figure = ax.get_figure(root=True)
        assert figure is not None
        extent = ax.get_window_extent()
        points = np.array([extent.width, extent.height]) * 72.0 / figure.dpi
        self.k = float(np.clip((points / style.AREA).min(), SMALLEST, LARGEST))
        self.size: Array = points / self.k
        self.segments: list[tuple[float, float, float, float, float]] = []
        self.boxes: list[tuple[float, float, float, float, float]] = []
        low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        room = np.maximum(self.size - 2 * style.MARGIN - (0.0, style.STRIP), 40.0)
        spans = (high - low) / room
        self.metre = 1.0 / float(spans.max()) if spans.max() > 0 else 1.0
        if scale is not None:
            wanted = scale(self.scale) if callable(scale) else scale
            self.metre = MILLIMETRE / (wanted * self.k)
        center = self.size / 2 + (0.0, style.STRIP / 2)
        self.corner: Array = (low + high) / 2 - center / self.metre
        far = self.corner + self.size / self.metre
        ax.set_xlim(self.corner[0], far[0])
        ax.set_ylim(self.corner[1], far[1])
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_axis_off()

    @property
    def scale(self) -> float:
        """Metres per millimetre of paper."""
        return MILLIMETRE / (self.metre * self.k)

    def at(self, position: ArrayLike) -> Array:
        """Return positions on the sheet of positions [m]."""
        result: Array = (np.asarray(position, dtype=float) - self.corner) * self.metre
        return result

    def back(self, position: ArrayLike) -> Array:
        """Return positions [m] of positions on the sheet."""
        result: Array = np.asarray(position, dtype=float) / self.metre + self.corner
        return result

    def line(
        self,
        points: ArrayLike,
        *,
        color: str = style.INK,
        width: float = style.LINE,
        z: float = style.Z_MARK,
        dash: Dash | None = None,
        gid: str | None = None,
        weight: float = style.SOLID,
    ) -> None:
        """Draw an open line; labels keep off it as strongly as `weight` says."""
        places = np.asarray(points, dtype=float)
        data = self.back(places)
        artist = Line2D(
            data[:, 0],
            data[:, 1],
            color=self.theme.paint(color),
            linewidth=width * self.k,
            linestyle=dash or "-",
            zorder=z,
            solid_capstyle="round",
            solid_joinstyle="round",
            dash_capstyle="butt",
            gid=gid,
        )
        self.ax.add_artist(artist)
        self.keep(places, weight)

    def area(
        self,
        points: ArrayLike,
        *,
        fill: str = style.PAPER,
        edge: str = style.INK,
        width: float = style.LINE,
        z: float = style.Z_MARK,
        gid: str | None = None,
        weight: float = style.SOLID,
    ) -> None:
        """Draw a filled polygon."""
        places = np.asarray(points, dtype=float)
        artist = Polygon(
            self.back(places),
            closed=True,
            facecolor=self.theme.paint(fill),
            edgecolor=self.theme.paint(edge),
            linewidth=width * self.k,
            joinstyle="round",
            zorder=z,
            gid=gid,
        )
        self.ax.add_artist(artist)
        self.keep(np.vstack([places, places[:1]]), weight)

    def circle(
        self,
        center: ArrayLike,
        radius: float,
        *,
        fill: str = "none",
        edge: str = style.INK,
        width: float = style.LINE,
        z: float = style.Z_MARK,
        dash: Dash | None = None,
        gid: str | None = None,
        weight: float = style.SOLID,
    ) -> None:
        """Draw a circle; a filled one keeps labels off its whole area."""
        middle = np.asarray(center, dtype=float)
        artist = Circle(
            tuple(self.back(middle)),
            radius / self.metre,
            facecolor=self.theme.paint(fill),
            edgecolor=self.theme.paint(edge),
            linewidth=width * self.k,
            linestyle=dash or "-",
            zorder=z,
            gid=gid,
        )
        self.ax.add_artist(artist)
        if fill == "none":
            self.keep(arc(middle, radius, 0.0, 2 * np.pi, 48), weight)
        else:
            self.box(middle - radius, middle + radius, weight)

    def text(
        self, center: ArrayLike, text: str, font: FontProperties, color: str, gid: str | None = None
    ) -> None:
        """Write a text with the middle of its ink at `center`."""
        low, high = ink(text, font)
        start = self.back(np.asarray(center, dtype=float) - (low + high) / 2)
        scaled = font.copy()
        scaled.set_size(font.get_size_in_points() * self.k)
        self.ax.text(
            start[0],
            start[1],
            text,
            fontproperties=scaled,
            color=self.theme.paint(color),
            ha="left",
            va="baseline",
            zorder=style.Z_LABEL,
            gid=gid,
        )

    def box(self, low: ArrayLike, high: ArrayLike, weight: float = style.SOLID) -> None:
        """Keep labels off a box."""
        a, b = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        self.boxes.append((float(a[0]), float(a[1]), float(b[0]), float(b[1]), weight))

    def keep(self, points: ArrayLike, weight: float = style.SOLID) -> None:
        """Keep labels off a line."""
        places = np.asarray(points, dtype=float)
        if weight > 0:
            ends = np.hstack([places[:-1], places[1:]])
            for row in ends[np.isfinite(ends).all(axis=1)].tolist():
                self.segments.append((row[0], row[1], row[2], row[3], weight))


def arc(center: ArrayLike, radius: float, start: float, end: float, count: int = 24) -> Array:
    """Return points on an arc, (count + 1, 2)."""
    angles = np.linspace(start, end, count + 1)
    result: Array = np.asarray(center, dtype=float) + radius * np.stack(
        [np.cos(angles), np.sin(angles)], axis=-1
    )
    return result


def unit(vector: ArrayLike) -> Array:
    """Return the vector with length one; zero stays zero."""
    given = np.asarray(vector, dtype=float)
    length = float(np.hypot(*given))
    return given / length if length > 0 else given


def normal(vector: ArrayLike) -> Array:
    """Return the vector turned by a quarter turn."""
    x, y = np.asarray(vector, dtype=float)
    return np.array([-y, x])


def font(
    size: float, families: Sequence[str] = tuple(style.FONT), **options: Any
) -> FontProperties:
    """Return a font of that size in units."""
    return FontProperties(family=list(families), size=size, math_fontfamily="stix", **options)


@lru_cache(maxsize=1024)
def ink(text: str, font: FontProperties) -> tuple[Array, Array]:
    """Return the corners of the ink of a text whose line starts at the origin."""
    if not text.strip():
        return np.zeros(2), np.zeros(2)
    extents = TextPath((0.0, 0.0), text, prop=font).get_extents()
    return np.array([extents.x0, extents.y0]), np.array([extents.x1, extents.y1])

"""The sheet a diagram is drawn on: lengths in units, and a memory of what was drawn.

Positions on the sheet are in units from the lower left corner of the axes. Symbols and
letters have fixed sizes in units, the mechanism is scaled to fit. What must not be covered
by labels is kept as segments and boxes for `mechdae.draw.labels.layout`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.colors import to_rgba
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D
from numpy.typing import ArrayLike, NDArray

from mechdae.draw import style

Array = NDArray[np.float64]
LARGEST = 6.0
"""Greatest scale of symbols and letters, see `mechdae.draw.style.SMALLEST`."""

INDEX = (0.7, 0.02, 0.15)
"""Size of an index, its step to the right and down, as shares of the letter's size."""
MILLIMETRE = 72 / 25.4
"""Points (1/72 in) per millimetre."""

Dash = tuple[float, tuple[float, ...]]


class _Shared:
    """An artist with the clip box of its axes: to make one for each takes longer than to draw."""

    def set_clip_path(self: Any, path: Any, transform: Any = None) -> None:
        """Clip by a path, or by the box of the axes if it is theirs."""
        if self.axes is not None and path is self.axes.patch:
            self.set_clip_box(self.axes.bbox)
        else:
            super().set_clip_path(path, transform)  # type: ignore[misc]


class _Line(_Shared, Line2D):
    pass


class _Area(_Shared, Polygon):
    pass


class _Circle(_Shared, Circle):
    pass


class _Strokes(_Shared, PathPatch):
    pass


class _Text(_Shared, Text):
    pass


class _Letters(_Text):
    """A short text, in SVG files the outlines its place was found with: found once, not twice."""

    def draw(self, renderer: RendererBase) -> None:
        """Draw the outlines in files that have outlines of texts anyway, else the text."""
        figure = self.get_figure(root=True)
        assert figure is not None
        outlined = figure.canvas.get_default_filetype() == "svg"
        outlined &= mpl.rcParams["svg.fonttype"] == "path" and not self.get_rotation()
        sides = self.get_horizontalalignment(), self.get_verticalalignment()
        if not outlined or sides != ("left", "baseline"):
            super().draw(renderer)
        elif self.get_visible():
            gc = renderer.new_gc()
            gc.set_linewidth(0.0)
            place = self.get_transform().transform(self.get_position())
            renderer.open_group("text", self.get_gid())
            renderer.draw_path(
                gc,
                outline(self.get_text(), self.get_fontproperties()),
                Affine2D().translate(*place),
                to_rgba(self.get_color(), self.get_alpha()),
            )
            renderer.close_group("text")
            gc.restore()


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
    larger
        How much larger than usual the axes are in width and height: symbols are not.

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
        larger: tuple[float, float] = style.USUAL,
    ) -> None:
        self.ax, self.theme, self.memory = ax, theme, memory
        figure = ax.get_figure(root=True)
        assert figure is not None
        extent = ax.get_window_extent()
        points = np.array([extent.width, extent.height]) * 72.0 / figure.dpi
        share = points / style.AREA / larger
        self.k = float(np.clip(share.min(), style.SMALLEST, LARGEST))
        self.size: Array = points / self.k
        self.segments: list[tuple[float, float, float, float, float]] = []
        self.boxes: list[tuple[float, float, float, float, float]] = []
        self._arrays: tuple[Array, Array] = np.zeros((0, 5)), np.zeros((0, 5))
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
        artist = _Line(
            data[:, 0],
            data[:, 1],
            color=self.theme.paint(color),
            linewidth=width * self.k,
            linestyle=dash or "-",
            solid_capstyle="round",
            solid_joinstyle="round",
            dash_capstyle="butt",
        )
        self._add(artist, z, gid)
        self.keep(places, weight)

    def strokes(
        self,
        starts: ArrayLike,
        ends: ArrayLike,
        *,
        color: str = style.INK,
        width: float = style.LINE,
        z: float = style.Z_MARK,
        gid: str | None = None,
        weight: float = 0.0,
    ) -> None:
        """Draw straight lines of one kind as one; labels may cover them without a `weight`."""
        places = np.stack([np.asarray(starts, dtype=float), np.asarray(ends, dtype=float)], axis=1)
        data = self.back(places.reshape(-1, 2))
        codes = np.tile(np.array([Path.MOVETO, Path.LINETO], dtype=Path.code_type), len(data) // 2)
        artist = _Strokes(
            Path(data, codes),
            facecolor="none",
            edgecolor=self.theme.paint(color),
            linewidth=width * self.k,
            capstyle="round",
        )
        self._add(artist, z, gid)
        if weight > 0:
            self.segments += [(*a, *b, weight) for a, b in places.tolist()]

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
        artist = _Area(
            self.back(places),
            closed=True,
            facecolor=self.theme.paint(fill),
            edgecolor=self.theme.paint(edge),
            linewidth=width * self.k,
            joinstyle="round",
        )
        self._add(artist, z, gid)
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
        artist = _Circle(
            tuple(self.back(middle)),
            radius / self.metre,
            facecolor=self.theme.paint(fill),
            edgecolor=self.theme.paint(edge),
            linewidth=width * self.k,
            linestyle=dash or "-",
        )
        self._add(artist, z, gid)
        if fill == "none":
            self.keep(arc(middle, radius, 0.0, 2 * np.pi, 48), weight)
        else:
            self.box(middle - radius, middle + radius, weight)

    def text(
        self,
        center: ArrayLike,
        text: str,
        font: FontProperties,
        color: str,
        gid: str | None = None,
        index: str | None = None,
    ) -> None:
        """Write a text with the middle of the ink at `center`.

        With an `index`, which may be empty, it is a short text with that behind it.
        """
        low, high = ink(text, font, index or "")
        start = np.asarray(center, dtype=float) - (low + high) / 2
        for part, chosen, step, name in _parts(text, font, index or "", gid):
            place = self.back(start + step)
            scaled = chosen.copy()
            scaled.set_size(chosen.get_size_in_points() * self.k)
            artist = (_Text if index is None else _Letters)(
                place[0],
                place[1],
                part,
                fontproperties=scaled,
                color=self.theme.paint(color),
            )
            self._add(artist, style.Z_LABEL, name)

    def _add(self, artist: Artist, z: float, gid: str | None) -> None:
        artist.zorder = z  # without the call for changes: nobody listens yet
        artist.set_gid(gid)
        self.ax.add_artist(artist)

    def obstacles(self) -> tuple[Array, Array]:
        """Return the segments and the boxes so far as arrays, (n, 5) each."""
        if len(self._arrays[0]) != len(self.segments):
            self._arrays = np.array(self.segments), self._arrays[1]
        if len(self._arrays[1]) != len(self.boxes):
            self._arrays = self._arrays[0], np.array(self.boxes)
        return self._arrays

    def box(self, low: ArrayLike, high: ArrayLike, weight: float = style.SOLID) -> None:
        """Keep labels off a box."""
        a, b = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        self.boxes.append((float(a[0]), float(a[1]), float(b[0]), float(b[1]), weight))

    def keep(self, points: ArrayLike, weight: float = style.SOLID) -> None:
        """Keep labels off a line."""
        places = np.asarray(points, dtype=float)
        if weight > 0:
            rows = np.hstack([places[:-1], places[1:], np.full((len(places) - 1, 1), weight)])
            if not np.isfinite(rows).all():
                rows = rows[np.isfinite(rows).all(axis=1)]
            self.segments += map(tuple, rows.tolist())


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
def outline(text: str, font: FontProperties) -> Path:
    """Return the outlines of a text whose line starts at the origin."""
    return TextPath((0.0, 0.0), text, prop=font)


@lru_cache(maxsize=1024)
def ink(text: str, font: FontProperties, index: str = "") -> tuple[Array, Array]:
    """Return the corners of the ink of a text whose line starts at the origin."""
    if index:
        rows = [(ink(part, own), step) for part, own, step, _ in _parts(text, font, index)]
        low = np.min([box[0] + step for box, step in rows], axis=0)
        return low, np.max([box[1] + step for box, step in rows], axis=0)
    if not text.strip():
        return np.zeros(2), np.zeros(2)
    extents = outline(text, font).get_extents()
    return np.array([extents.x0, extents.y0]), np.array([extents.x1, extents.y1])


def _parts(
    text: str, font: FontProperties, index: str, gid: str | None = None
) -> list[tuple[str, FontProperties, Array, str | None]]:
    """Return a text and its upright index: what, how, where from the start, name."""
    parts: list[tuple[str, FontProperties, Array, str | None]] = [(text, font, np.zeros(2), gid)]
    if index:
        small = font.copy()
        size = font.get_size_in_points()
        small.set_size(INDEX[0] * size)
        small.set_style("normal")
        step = np.array([float(ink(text, font)[1][0]) + INDEX[1] * size, -INDEX[2] * size])
        parts.append((index, small, step, None))
    return parts

"""The sheet a diagram is drawn on: primitives in units, and a memory of what labels avoid.

A primitive tells what it moves with (`Anchor`). Sheets with axes are drawn there as well, by
`mechdae.draw.artists`; those without are a scene for other writers. Positions on the sheet are in
units from the lower left corner. Symbols and letters have fixed sizes in units, the mechanism is
scaled to fit. What must not be covered by labels is kept as segments and boxes for
`mechdae.draw.labels.layout`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from mechdae.draw import style
from mechdae.draw.fonts import Font, ink, parts_of
from mechdae.draw.primitives import PAPER, Anchor, Array, Dash, Primitive

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LARGEST = 6.0
"""Greatest scale of symbols and letters, see `mechdae.draw.style.SMALLEST`."""

ASIDE = ("title", "subtitle", "note", "scale", "legend", "axis-", "gravity", "label-gravity")
"""What finds its place in a picture of any size."""
GAP = 3.0

MILLIMETRE = 72 / 25.4
"""Points (1/72 in) per millimetre."""


class LineLook(TypedDict, total=False):
    """How a line or a border is drawn: in ink, of the width of symbols, in their rank."""

    color: str
    width: float
    z: float
    dash: Dash | None
    gid: str | None


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
    margins
        Room [units] for symbols and labels left and right of the box, below and above it.

    Attributes
    ----------
    k
        Points (1/72 in) per unit.
    metre
        Units per metre.
    size
        Width and height of the axes in units,
    above
        and how much there is of the figure above them.
    segments, boxes
        What labels avoid: rows (x0, y0, x1, y1, weight).
    drawn
        Primitives in the order in which they were drawn.
    elsewhere
        Names of labels that are written in an enlarged detail.
    """

    def __init__(
        self,
        ax: Axes | None,
        low: ArrayLike,
        high: ArrayLike,
        scale: float | Callable[[float], float] | None = None,
        theme: style.Theme = style.LIGHT,
        memory: dict[str, Array] | None = None,
        larger: tuple[float, float] = style.USUAL,
        margins: style.Margins = style.MARGINS,
    ) -> None:
        self.paper: Axes | None = ax
        self.theme: style.Theme = theme
        self.memory: dict[str, Array] | None = memory
        points, above = np.array(style.AREA) * larger, style.TOP
        if ax is not None:
            figure = ax.get_figure(root=True)
            assert figure is not None
            extent = ax.get_window_extent()
            points = np.array([extent.width, extent.height]) * 72.0 / figure.dpi
            above = (figure.bbox.height - extent.y1) * 72.0 / figure.dpi
        self.drawn: list[Primitive] = []
        self.elsewhere: set[str] = set()
        self.anchor: Anchor = PAPER
        share = points / style.AREA / larger
        self.k: float = float(np.clip(share.min(), style.SMALLEST, LARGEST))
        self.size: Array = points / self.k
        self.above: float = float(above) / self.k
        self.segments: list[tuple[float, float, float, float, float]] = []
        self.boxes: list[tuple[float, float, float, float, float]] = []
        self._arrays: tuple[Array, Array] = np.zeros((0, 5)), np.zeros((0, 5))
        low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        around = np.reshape(margins, (2, 2))
        room = np.maximum(self.size - around.sum(axis=1) - (0.0, style.STRIP), 40.0)
        spans = (high - low) / room
        self.metre: float = 1.0 / float(spans.max()) if spans.max() > 0 else 1.0
        if scale is not None:
            wanted = scale(self.scale) if callable(scale) else scale
            self.metre = MILLIMETRE / (wanted * self.k)
        center = self.size / 2 + (0.0, style.STRIP / 2) + (around[:, 0] - around[:, 1]) / 2
        self.corner: Array = (low + high) / 2 - center / self.metre
        if ax is not None:
            far = self.corner + self.size / self.metre
            ax.set_xlim(self.corner[0], far[0])
            ax.set_ylim(self.corner[1], far[1])
            ax.set_aspect("equal", adjustable="datalim")
            ax.set_axis_off()

    @property
    def ax(self) -> Axes:
        """The axes that are drawn on."""
        assert self.paper is not None
        return self.paper

    def on(
        self, *points: str, turn: str = "", grow: str = "", span: bool = False,
        weight: tuple[float, ...] = (),
    ) -> AbstractContextManager[None]:  # fmt: skip
        """Tell what is drawn inside what it moves with, see `Anchor`."""
        return self.held(Anchor(points, turn, grow, span, weight))

    @contextmanager
    def held(self, anchor: Anchor) -> Iterator[None]:
        """Tell what is drawn inside what it moves with."""
        before, self.anchor = self.anchor, anchor
        yield
        self.anchor = before

    @property
    def scale(self) -> float:
        """Metres per millimetre of paper."""
        return MILLIMETRE / (self.metre * self.k)

    def at(self, position: ArrayLike) -> Array:
        """Return positions on the sheet of positions [m]."""
        return (np.asarray(position, dtype=float) - self.corner) * self.metre

    def back(self, position: ArrayLike) -> Array:
        """Return positions [m] of positions on the sheet."""
        return np.asarray(position, dtype=float) / self.metre + self.corner

    def line(
        self, points: ArrayLike, *, weight: float = style.SOLID, **look: Unpack[LineLook]
    ) -> None:
        """Draw an open line; labels keep off it as strongly as `weight` says."""
        places = np.asarray(points, dtype=float)
        self._add("line", places, **look)
        self.keep(places, weight)

    def strokes(
        self, starts: ArrayLike, ends: ArrayLike, *, weight: float = 0.0, **look: Unpack[LineLook]
    ) -> None:
        """Draw straight lines of one kind as one; labels may cover them without a `weight`."""
        places = np.stack([np.asarray(starts, dtype=float), np.asarray(ends, dtype=float)], axis=1)
        self._add("strokes", places.reshape(-1, 2), **look)
        if weight > 0:
            self.segments += [(*a, *b, weight) for a, b in places.tolist()]

    def area(
        self, points: ArrayLike, *, fill: str = style.PAPER, edge: str = style.INK,
        weight: float = style.SOLID, **look: Unpack[LineLook],
    ) -> None:  # fmt: skip
        """Draw a filled polygon."""
        places = np.asarray(points, dtype=float)
        self._add("area", places, **{"color": edge, "fill": fill, **look})
        self.keep(np.vstack([places, places[:1]]), weight)

    def circle(
        self, center: ArrayLike, radius: float, *, fill: str = "none", edge: str = style.INK,
        weight: float = style.SOLID, **look: Unpack[LineLook],
    ) -> None:  # fmt: skip
        """Draw a circle; a filled one keeps labels off its whole area."""
        middle = np.asarray(center, dtype=float)
        more = {"color": edge, "fill": fill, "radius": radius, **look}
        self._add("circle", middle[None], **more)
        if fill == "none":
            self.keep(arc(middle, radius, 0.0, 2 * np.pi, 48), weight)
        else:
            self.box(middle - radius, middle + radius, weight)

    def text(
        self,
        center: ArrayLike,
        text: str,
        font: Font,
        color: str,
        gid: str | None = None,
        index: str | None = None,
    ) -> None:
        """Write a text with the middle of the ink at `center`.

        With an `index`, which may be empty, it is a short text with that behind it.
        """
        low, high = ink(text, font, index or "")
        start = np.asarray(center, dtype=float) - (low + high) / 2
        for part, chosen, step, name in parts_of(text, font, index or "", gid):
            look = {"color": color, "text": part, "font": chosen, "short": index is not None}
            self._add("text", (start + step)[None], z=style.Z_LABEL, gid=name, width=0.0, **look)

    def write(self, start: ArrayLike, text: str, font: Font, color: str, gid: str) -> None:
        """Write a line of text that starts at a place."""
        place = np.asarray(start, dtype=float)[None]
        look = {"color": color, "text": text, "font": font, "width": 0.0}
        self._add("text", place, z=style.Z_LABEL, gid=gid, **look)

    def _add(self, kind: str, points: Array, **look: Any) -> None:
        usual = {"z": style.Z_MARK, "gid": None, "width": style.LINE}
        self.paste(Primitive(kind, points, anchor=self.anchor, **{**usual, **look}))

    def paste(self, primitive: Primitive) -> None:
        """Draw a primitive."""
        self.drawn.append(primitive)
        if self.paper is not None:
            from mechdae.draw.artists import artist_of

            self.paper.add_artist(artist_of(self, primitive))

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


def margins_of(sheet: Sheet, low: ArrayLike, high: ArrayLike) -> style.Margins:
    """Return how much room what was drawn needs around its box [m], for `Sheet`."""
    corners = [sheet.at(low), sheet.at(high)]
    for shape in sheet.drawn:
        if str(shape.gid).startswith(ASIDE):
            continue
        ends = shape.points[np.isfinite(shape.points).all(axis=1)]
        reach = shape.radius + shape.width / 2
        if shape.kind == "text":
            ends = ends + np.array(ink(shape.text, shape.font))
        corners += [ends - reach, ends + reach]
    places = np.vstack(corners)
    beyond = corners[0] - places.min(axis=0), places.max(axis=0) - corners[1]
    room = np.clip(np.array(beyond).T + GAP, GAP, style.MARGIN)
    left, right, below, above = room.ravel().tolist()
    return left, right, below, above


def arc(center: ArrayLike, radius: float, start: float, end: float, count: int = 24) -> Array:
    """Return points on an arc, (count + 1, 2)."""
    angles = np.linspace(start, end, count + 1)
    return np.asarray(center, dtype=float) + radius * np.stack(
        [np.cos(angles), np.sin(angles)], axis=-1
    )


def unit(vector: ArrayLike) -> Array:
    """Return the vector with length one; zero stays zero."""
    given = np.asarray(vector, dtype=float)
    length = float(np.hypot(*given))
    return given / length if length > 0 else given


def normal(vector: ArrayLike) -> Array:
    """Return the vector turned by a quarter turn."""
    x, y = np.asarray(vector, dtype=float)
    return np.array([-y, x])

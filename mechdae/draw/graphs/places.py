"""Places for short texts in a panel, free of curves and of each other."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from mechdae.draw import style
from mechdae.draw.fonts import font, ink
from mechdae.draw.graphs.frame import Panels
from mechdae.draw.graphs.series import Array
from mechdae.draw.labels.layout import first_free
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.types import Floats

NEAR = 2.0
"""Distance of texts from what they keep off [pt]."""
STEP = 2.5
"""Longest piece of a curve that is kept off [pt]."""


class Places:
    """What texts in one panel keep off: curves and the texts so far [pt].

    The limits of the panel are to be final.
    """

    def __init__(self, frame: Panels, panel: Axes) -> None:
        self.frame, self.panel = frame, panel
        extent = panel.get_window_extent()
        self.corner: Floats = np.array([extent.x0, extent.y0])
        self.inch: float = 72.0 / frame.figure.dpi
        self.size: Floats = np.array([extent.width, extent.height]) * self.inch
        self.lines: Array = np.zeros((0, 5))
        self.boxes: list[tuple[float, float, float, float, float]] = []

    def at(self, x: object, y: object) -> Array:
        """Return places in points from the corner of the panel."""
        data = np.stack([np.asarray(x, float), np.asarray(y, float)], axis=-1)
        shape = data.shape
        places = self.panel.transData.transform(data.reshape(-1, 2)) - self.corner
        result: Array = (places * self.inch).reshape(shape)
        return result

    def keep(self, x: object, y: object) -> None:
        """Keep texts off a curve."""
        places = self.at(x, y)
        places = places[np.isfinite(places).all(axis=1)]
        if len(places) > 1:
            steps = np.hypot(*np.diff(places, axis=0).T)
            length = np.concatenate([[0.0], np.cumsum(steps)])
            fine = np.linspace(0.0, length[-1], max(int(length[-1] / STEP), 2))
            places = np.stack([np.interp(fine, length, own) for own in places.T], axis=1)
        rows = np.hstack([places[: max(len(places) - 1, 1)], places[-max(len(places) - 1, 1) :]])
        self.lines = np.vstack([self.lines, np.insert(rows, 4, 1.0, axis=1)])

    def write(
        self,
        x: float,
        y: float,
        text: str,
        color: str,
        *,
        above: bool = True,
        away: tuple[float, float] | None = None,
    ) -> bool:
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
        self.panel.annotate(
            text.replace("$", r"\$"),
            (x, y),
            xytext=(dx - float(low[0]), dy),
            textcoords="offset points",
            fontproperties=small.properties,
            color=color,
            zorder=5,
            annotation_clip=False,
        )
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

"""Places for short texts in a panel, free of curves and of each other."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from mechdae.draw import style
from mechdae.draw.graphs.frame import Panels
from mechdae.draw.graphs.series import Array
from mechdae.draw.sheet import font, ink

NEAR = 2.0
"""Distance of texts from what they keep off [pt]."""


class Places:
    """What texts in one panel keep off: points of curves and the texts so far [pt].

    The limits of the panel are to be final.
    """

    def __init__(self, frame: Panels, panel: Axes) -> None:
        self.frame, self.panel = frame, panel
        extent = panel.get_window_extent()
        self.corner = np.array([extent.x0, extent.y0])
        self.inch = 72.0 / frame.figure.dpi
        self.size = np.array([extent.width, extent.height]) * self.inch
        self.points: list[Array] = []
        self.boxes: list[tuple[float, float, float, float]] = []

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
        if len(places) < 2:
            self.points.append(places)
            return
        steps = np.hypot(*np.diff(places, axis=0).T)
        length = np.concatenate([[0.0], np.cumsum(steps)])
        fine = np.linspace(0.0, length[-1], max(int(length[-1] / 2.5), 2))
        self.points.append(np.stack([np.interp(fine, length, own) for own in places.T], axis=1))

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
        small = font(style.TICK * 0.94 * k, style.NOTE_FONT)
        low, high = ink(text, small)
        width, height = float(high[0] - low[0]), style.TICK * 0.8 * k
        px, py = self.at(x, y)
        for dx, dy in self._offsets(width, height, above, away):
            x0, y0 = px + dx - width / 2, py + dy - height / 2
            box = (x0 - NEAR, y0 - NEAR, x0 + width + NEAR, y0 + height + NEAR)
            if self._free(box):
                self.boxes.append(box)
                self.panel.annotate(
                    text.replace("$", r"\$"),
                    (x, y),
                    xytext=(x0 - px - float(low[0]), y0 - py),
                    textcoords="offset points",
                    fontproperties=small,
                    color=color,
                    zorder=5,
                    annotation_clip=False,
                )
                return True
        return False

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

    def _free(self, box: tuple[float, float, float, float]) -> bool:
        x0, y0, x1, y1 = box
        w, h = self.size
        if x0 < 0 or y0 < 0 or x1 > w or y1 > h:
            return False
        for a0, b0, a1, b1 in self.boxes:
            if x0 < a1 and a0 < x1 and y0 < b1 and b0 < y1:
                return False
        for points in self.points:
            inside = (points > (x0, y0)) & (points < (x1, y1))
            if bool(inside.all(axis=1).any()):
                return False
        return True

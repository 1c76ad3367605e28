"""DXF of release 12 (AC1009) as text: layers, lines, polylines, circles, text; millimetres."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mechdae.types import Floats

Place = Sequence[float] | Floats
"""x and y."""
MILLIMETRE = 1000.0
LAYERS = {"LINKS": 7, "JOINTS": 5, "GROUND": 8, "GUIDES": 8, "PATHS": 1, "NAMES": 3}
"""Layers with their colours."""
DASHED = {"PATHS"}
UNDRAWN = "not drawn: "
"""Begin of the comment that names joints without a line."""
SAME = 1e-9
"""Share of the extent by which ends of a polyline that is closed may be apart."""


class DxfText:
    """A drawing in the making; places are in metres."""

    def __init__(self) -> None:
        self.entities: list[str] = []
        self.low: Floats = np.full(2, np.inf)
        self.high: Floats = np.full(2, -np.inf)

    def _put(self, *pairs: tuple[int, float | str]) -> None:
        self.entities += [f"{code:3d}\n{_value(value)}" for code, value in pairs]

    def _place(self, place: Floats, code: int = 10) -> list[tuple[int, float]]:
        x, y = (MILLIMETRE * float(v) for v in place)
        self.low, self.high = np.minimum(self.low, (x, y)), np.maximum(self.high, (x, y))
        return [(code, x), (code + 10, y), (code + 20, 0.0)]

    def line(self, layer: str, start: Floats, end: Floats) -> None:
        self._put((0, "LINE"), (8, layer), *self._place(start), *self._place(end, 11))

    def polyline(self, layer: str, places: Iterable[Floats], closed: bool = False) -> None:
        self._put((0, "POLYLINE"), (8, layer), (66, 1), (10, 0.0), (20, 0.0), (30, 0.0))
        self._put((70, int(closed)))
        for place in places:
            self._put((0, "VERTEX"), (8, layer), *self._place(place))
        self._put((0, "SEQEND"), (8, layer))

    def circle(self, layer: str, center: Floats, radius: float) -> None:
        for corner in (-radius, radius):
            self._place(np.asarray(center, float) + corner)
        self._put((0, "CIRCLE"), (8, layer), *self._place(center), (40, MILLIMETRE * radius))

    def text(self, layer: str, place: Floats, height: float, words: str) -> None:
        """Put a text whose lower left corner is at a place."""
        self._put((0, "TEXT"), (8, layer), *self._place(place))
        self._put((40, MILLIMETRE * height), (1, _plain(words)))

    def document(self, remarks: Iterable[str] = ()) -> str:
        """Return the whole file."""
        low, high = self.low, self.high
        if not np.isfinite(low).all():
            low, high = np.zeros(2), np.ones(2)
        head: list[tuple[int, Any]] = [(999, _plain(remark)) for remark in remarks]
        head += [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009")]
        head += [(9, "$EXTMIN"), (10, low[0]), (20, low[1]), (30, 0.0)]
        head += [(9, "$EXTMAX"), (10, high[0]), (20, high[1]), (30, 0.0)]
        head += [(9, "$LUNITS"), (70, 2), (9, "$LTSCALE"), (40, 1.0), (0, "ENDSEC")]
        head += [(0, "SECTION"), (2, "TABLES")]
        head += [(0, "TABLE"), (2, "LTYPE"), (70, 2)]
        head += _line_type("CONTINUOUS", "Solid line", ())
        step = max(0.01 * float(np.max(high - low)), 1e-6)
        head += _line_type("DASHED", "__ __ __", (step, -0.5 * step))
        head += [(0, "ENDTAB"), (0, "TABLE"), (2, "LAYER"), (70, len(LAYERS))]
        for name, color in LAYERS.items():
            kind = "DASHED" if name in DASHED else "CONTINUOUS"
            head += [(0, "LAYER"), (2, name), (70, 0), (62, color), (6, kind)]
        head += [(0, "ENDTAB"), (0, "TABLE"), (2, "STYLE"), (70, 1), (0, "STYLE")]
        head += [(2, "STANDARD"), (70, 0), (40, 0.0), (41, 1.0), (50, 0.0), (71, 0)]
        head += [(42, 2.5), (3, "txt"), (4, ""), (0, "ENDTAB"), (0, "ENDSEC")]
        head += [(0, "SECTION"), (2, "ENTITIES")]
        lines = [f"{code:3d}\n{_value(value)}" for code, value in head]
        lines += [*self.entities, "  0\nENDSEC", "  0\nEOF"]
        return "\n".join(lines) + "\n"


def _line_type(name: str, text: str, parts: Sequence[float]) -> list[tuple[int, Any]]:
    total = float(sum(abs(part) for part in parts))
    head = [(0, "LTYPE"), (2, name), (70, 0), (3, text), (72, 65), (73, len(parts)), (40, total)]
    return [*head, *[(49, part) for part in parts]]


def _value(value: float | str) -> str:
    if isinstance(value, str | int):
        return f"{value:6d}" if isinstance(value, int) else value
    return repr(round(float(value), 12) + 0.0)


def _plain(text: str) -> str:
    """Return a text in one line of ASCII, as release 12 has it."""
    return " ".join(text.encode("ascii", "replace").decode().split())


def distance(point: Place, start: Place, end: Place) -> float:
    """Return the distance of a point from a stretch of a line."""
    wx, wy = end[0] - start[0], end[1] - start[1]
    px, py = point[0] - start[0], point[1] - start[1]
    long = wx * wx + wy * wy
    share = min(max((wx * px + wy * py) / long, 0.0), 1.0) if long else 0.0
    return math.hypot(px - share * wx, py - share * wy)

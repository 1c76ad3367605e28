"""What a scene consists of: primitives on a sheet, and what each of them moves with."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdae.draw import style
from mechdae.records import dataclass

Array = NDArray[np.float64]
Dash = tuple[float, tuple[float, ...]]


@dataclass(frozen=True)
class Anchor:
    """What a primitive moves with.

    Parameters
    ----------
    points
        Places ``body.point`` its corners keep their way to: one for all, one for each, or with
        `span` two that they lie between.
    turn
        What this way turns with: a body, ``joint/axis``, the line ``a>b`` between two points.
    grow
        What this way is proportional to: "m" lengths of the mechanism, ``a>b`` the distance of two
        points, ``joint/radius`` a number; "" where it is a length on paper.
    span
        Whether corners keep their shares of the way from the first point to the second one.
    weight
        The shares of corners, where they are not those of their places.
    spot
        Place on the sheet of what does not turn itself: a text.
    ways
        Rows (share of the poses, x, y) of its ways from there, between which it glides.
    """

    points: tuple[str, ...] = ()
    turn: str = ""
    grow: str = ""
    span: bool = False
    weight: tuple[float, ...] = ()
    spot: tuple[float, float] | None = None
    ways: tuple[tuple[float, ...], ...] = ()


PAPER = Anchor()


@dataclass(frozen=True)
class Primitive:
    """A line, strokes, an area, a circle or a text, in units of the sheet.

    Parameters
    ----------
    kind
        "line", "strokes" (pairs of points), "area", "circle" or "text".
    points
        (n, 2); of a circle its middle, of a text where its line starts.
    z
        Rank: later above earlier.
    clip
        Middle and radius of the circle that it is drawn in, if only there.
    """

    kind: str
    points: Array
    z: float
    gid: str | None
    anchor: Anchor
    color: str = style.INK
    fill: str = "none"
    width: float = 0.0
    dash: Dash | None = None
    radius: float = 0.0
    text: str = ""
    font: Any = None
    short: bool = False
    clip: tuple[float, float, float] | None = None


def path_of(kind: str, points: Array) -> str:
    """Return lines, strokes or the border of an area as the data of an SVG path; y is down."""
    rows = [f"{round(x, 2) + 0.0:g} {round(-y, 2) + 0.0:g}" for x, y in points.tolist()]
    if kind == "strokes":
        return "".join(f"M{a}L{b}" for a, b in zip(rows[::2], rows[1::2], strict=True))
    return f"M{'L'.join(rows)}{'Z' if kind == 'area' else ''}"

"""Front, top and left view of a spatial mechanism with the axonometric one, to one scale."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mechdae.draw import style
from mechdae.draw.diagram.diagram import draw_pose
from mechdae.draw.diagram.heads import write_heads
from mechdae.draw.figure import new_figure, note
from mechdae.draw.fonts import font
from mechdae.draw.sheet import MILLIMETRE
from mechdae.draw.space.spatial_drawing import SpatialView, extent
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.draw.space.viewpoint import Array, orthographic
from mechdae.draw.words import Words
from mechdae.errors import InputError

SIZE = (10.5, 8.4)
"""Of the figure [in]."""
GAP = 0.02
SYMBOLS = 0.85
"""Size of symbols and letters, beside that of one view."""
Rectangle = tuple[float, float, float, float]


def draw_three(
    result: Any,
    scene: SpatialScene,
    index: int,
    shown: SpatialView,
    theme: style.Theme,
    words: Words,
    ax: Axes | None,
) -> Axes:
    """Draw three views in the first-angle arrangement: top below front, left view to the right.

    Returns
    -------
    matplotlib.axes.Axes
        Those of the front view; the figure has them in the order front, left, top, axonometric.

    Raises
    ------
    InputError
        Axes were given: there are four.
    """
    if ax is not None:
        raise InputError("three views have a figure of their own", where="ax")
    figure = new_figure(*SIZE, theme.paint(style.PAPER))
    views = [*orthographic(scene.mechanism).values()]
    views = [views[0], views[2], views[1], shown.viewpoint]
    bounds = [extent(scene, [index], view, shown.moved, shown.traces) for view in views]
    columns = [max(float((b[1] - b[0])[0]) for b in bounds[k::2]) for k in (0, 1)]
    rows = [max(float((b[1] - b[0])[1]) for b in bounds[k : k + 2]) for k in (0, 2)]
    places = _places(columns, rows)
    smallest = max(_smallest(place, bound) for place, bound in zip(places, bounds, strict=True))
    wanted = shown.scale(smallest) if callable(shown.scale) else shown.scale or smallest
    first: Axes | None = None
    sheets = []
    for place, view, bound in zip(places, views, bounds, strict=True):
        axes = figure.add_axes(place)
        first = first or axes
        wide, high = (_points(place) / np.array(style.AREA) / SYMBOLS).tolist()
        bare = replace(
            shown, viewpoint=view, bounds=bound, scale=wanted, bare=True, larger=(wide, high)
        )
        sheets.append(draw_pose(axes, scene, result, index, bare, theme, words))
        name = words(view.name) if view.name else words("seen from", *(
            words.number(angle, 4) for angle in (view.azimuth, view.elevation)))  # fmt: skip
        chosen, color = font(style.SUBTITLE, style.NOTE_FONT), theme.paint(style.FAINT)
        more = {"xycoords": "axes fraction", "ha": "center", "gid": f"view-{name}"}
        note(axes, name, (0.5, 0.0), (0.0, 4.0), chosen, color, **more)
    assert first is not None
    write_heads(sheets[0], scene, result, index, words, shown.label, shown.subtitle)
    return first


def _places(columns: list[float], rows: list[float]) -> list[Rectangle]:
    """Return the axes' places as shares of the figure, front first, row by row."""
    border = 0.1
    top = 1.0 - style.TOP / 72 / SIZE[1]
    wide = [max(column, 0.25 * sum(columns)) + border * sum(columns) for column in columns]
    high = [max(row, 0.25 * sum(rows)) + border * sum(rows) for row in rows]
    widths = [width / sum(wide) * (1.0 - 3 * GAP) for width in wide] if sum(wide) else [0.47, 0.47]
    heights = (
        [height / sum(high) * (top - 3 * GAP) for height in high] if sum(high) else [0.44, 0.44]
    )
    left = [GAP, 2 * GAP + widths[0]]
    low = [2 * GAP + heights[1], GAP]
    return [
        (left[k], low[j], widths[k], heights[j]) for j in (0, 1) for k in (0, 1)
    ]  # fmt: skip


def _smallest(place: Rectangle, bounds: Any) -> float:
    """Return the smallest scale [m/mm] with which bounds fit into axes."""
    room = _points(place) / SYMBOLS - 2 * style.MARGIN - np.array([0.0, style.STRIP])
    spans = (bounds[1] - bounds[0]) / np.maximum(room, 40.0)
    return float(spans.max()) * MILLIMETRE / SYMBOLS


def _points(place: Rectangle) -> Array:
    """Return width and height of axes [pt]."""
    points: Array = np.array(place[2:]) * np.array(SIZE) * 72.0
    return points

"""Texts of a picture: none is cut, none covers another."""

from __future__ import annotations

import itertools

import numpy as np
from matplotlib.figure import Figure


def texts(figure: Figure) -> list:
    figure.draw_without_rendering()
    found = []
    for panel in figure.axes:
        found += [*panel.texts, panel.xaxis.label, panel.yaxis.label]
        shown = panel.xaxis.get_tick_params()["labelbottom"]
        for axis in (panel.xaxis, panel.yaxis) if shown else (panel.yaxis,):
            low, high = np.sort(axis.get_view_interval())
            slack = 1e-9 * (high - low)
            ticks = zip(axis.get_majorticklocs(), axis.get_majorticklabels(), strict=True)
            found += [text for place, text in ticks if low - slack <= place <= high + slack]
    return [own for own in found if own.get_visible() and own.get_text().strip()]


def assert_readable(axes) -> None:
    """All texts are inside of the picture, and none covers another."""
    figure = axes.get_figure(root=True)
    boxes = [(own.get_text(), own.get_window_extent()) for own in texts(figure)]
    width, height = figure.get_size_inches() * figure.dpi
    for text, box in boxes:
        inside = min(box.x0, box.y0, width - box.x1, height - box.y1)
        assert inside >= -0.5, f"'{text}' is cut"
    for (first, a), (second, b) in itertools.combinations(boxes, 2):
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(wide, high / 3.5) <= 1.0, f"'{first}' covers '{second}'"

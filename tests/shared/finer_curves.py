"""How far drawn curves are from the same curves at 50 times as many poses."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import mechdae as md
from mechdae.draw import smooth
from mechdae.draw.catalogue import kind_and_task, picture_of
from mechdae.draw.graphs import curves
from mechdae.tasks.pictures import for_picture

HALF = 0.5
"""Pixel."""
FINER = 50
FACTORS = [10.0**k * unit for k in range(-9, 10, 3) for unit in (1.0, 180 / np.pi)]
"""From SI units to those that graphs show."""


def pixels(axes: Any, places: Any) -> Any:
    return axes.transData.transform(np.asarray(places, float))


def off(line: Any, truth: Any) -> float:
    """Return how far places of a curve are from a line through points, at most."""
    ends = line[np.isfinite(line).all(axis=1)]
    a, way = ends[:-1], np.diff(ends, axis=0)
    size = np.maximum((way**2).sum(axis=1), 1e-30)
    worst = 0.0
    for place in truth:
        t = np.clip(((place - a) * way).sum(axis=1) / size, 0.0, 1.0)
        worst = max(worst, float(np.hypot(*(place - a - t[:, None] * way).T).min()))
    return worst


def farthest(problem: str) -> float:
    """Return how far the curves of a problem are from those of many more poses [pixel]."""
    whole = md.load(problem)
    _, name = kind_and_task(whole.tasks, "curves", None, {}, problem)
    result = for_picture(whole, name, picture_of("curves").needs)
    axes = md.plot(result, "curves")
    finest = result.finer(max(FINER * smooth.FEWEST // max(len(result.status) - 1, 1), 2))
    x = curves._along(finest, result, None).shown
    series = {f"curve-{line.path}-{line.name}": line.values for line in curves._lines(finest, None)}
    worst = 0.0
    for panel in axes.get_figure(root=True).axes:
        for line in panel.lines:
            values = series.get(line.get_gid())
            if values is None or panel.get_yscale() == "log":
                continue
            drawn = np.stack([np.asarray(part, float) for part in line.get_data()], axis=1)
            share = np.nanmedian(np.abs(drawn[:, 1])) / max(np.nanmedian(np.abs(values)), 1e-300)
            factor = min(FACTORS, key=lambda unit, f=share: abs(np.log(unit / max(f, 1e-300))))
            truth = pixels(panel, np.stack([x, values * factor], axis=1))
            inside = (truth[:, 1] >= panel.bbox.y0) & (truth[:, 1] <= panel.bbox.y1)
            truth = truth[inside][:: max(int(inside.sum()) // 2000, 1)]
            worst = max(worst, off(pixels(panel, drawn), truth))
    plt.close("all")
    return worst

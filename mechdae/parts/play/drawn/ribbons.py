"""Paths of points in their bands, drawn as much wider as can be seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from mechdae.draw import style
from mechdae.draw.graphs import coupler
from mechdae.draw.graphs.scale import scale_of
from mechdae.draw.graphs.series import band_paths
from mechdae.draw.smooth import in_picture, smooth
from mechdae.errors import InputError
from mechdae.results.status import stretches
from mechdae.types import Floats, Points

if TYPE_CHECKING:
    from mechdae.results import SweepResult

SAME = 1e-6
"""Share of a path's size within which its ends are one place."""
SEEN = 0.03
"""Share of the size of the paths that the widest band has in the picture."""


def draw(
    result: SweepResult, ax: Axes | None = None, *, of: Sequence[str] | None = None,
    pivots: bool = True,
) -> Axes:  # fmt: skip
    """Draw paths of points with a band on both sides, as wide as ``distance_band``.

    Raises
    ------
    InputError
        No point has a band.
    """
    banded = [path.split("/")[1] for path in band_paths(result) if path.startswith("points/")]
    usual = [name for name in coupler.default_points(result) if name in banded]
    points = list(of or usual or banded[: coupler.MOST])
    between = smooth(result, lambda one: in_picture([one.points[p].position for p in points]))
    places = [between.points[name].position for name in points]
    bands = [between.points[name].distance_band for name in points]
    if not {*points} & {*banded}:
        hint = "kind 'curves' has bands of angles and slides"
        raise InputError("no band is proved of these points", where="of", hint=hint)
    widest = max(np.nanmax(band, initial=0.0) for band in bands)
    panel = coupler.draw(result, ax, of=points, ticks=False, pivots=pivots)
    span = max(float(np.nanmax(np.ptp(place, axis=0))) for place in places)
    wider = float(f"{max(SEEN * span / widest, 1.0):.1g}")
    scale = scale_of("m", places, result.units)
    for k, (place, band) in enumerate(zip(places, bands, strict=True)):
        _ribbon(panel, scale(place), scale(wider * band), style.color_of(k))
    note = f"bands {wider:g} times as wide" if wider > 1 else "bands in scale"
    panel.text(
        0.99, 0.01, note, transform=panel.transAxes, ha="right", va="bottom", color=style.INK,
        fontsize=panel.xaxis.get_ticklabels()[0].get_fontsize(),
    )  # fmt: skip
    return panel


def _ribbon(panel: Axes, place: Points, band: Floats, color: str) -> None:
    """Fill the ribbon around a path (n, 2), its parts where there is a band (n,)."""
    there = np.isfinite(band) & np.isfinite(place).all(axis=1)
    for first, end in stretches(there):
        if end - first < 2:
            continue
        line, half = place[first:end], band[first:end, None]
        closes = np.hypot(*(line[-1] - line[0])) <= SAME * np.ptp(line)
        around = np.concatenate([line[-2:-1], line, line[1:2]]) if closes else line
        along = np.gradient(around, axis=0)[1:-1] if closes else np.gradient(line, axis=0)
        size = np.linalg.norm(along, axis=1, keepdims=True)
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.where(size > 0, size, 1.0)
        left, right = line + half * normal, line - half * normal
        ring = np.concatenate([left, right[::-1], left[:1]])  # the last one is not drawn
        panel.add_patch(PathPatch(Path(ring, closed=True), color=color, alpha=0.2, lw=0, zorder=1))

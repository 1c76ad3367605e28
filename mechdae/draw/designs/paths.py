"""Paths over numbered targets, with equal scales on both axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdae.describe.units import SI, Units
from mechdae.draw import style
from mechdae.draw.designs.targets import Targets, enlargement
from mechdae.draw.diagram.scene import Array
from mechdae.draw.graphs.frame import Panels
from mechdae.draw.graphs.places import Places
from mechdae.draw.graphs.scale import scale_of

ROOM = 26.0
"""Free border around paths [pt]."""
NUMBER = 13.0
"""Usual distance of a number from its target [pt]."""
FAR = 0.75
"""Paths are shown up to so many sizes of the targets beside them."""
RING: dict[str, Any] = {
    "marker": "o",
    "linestyle": "",
    "markersize": 5.0,
    "markeredgewidth": 1.3,
    "markerfacecolor": style.PAPER,
    "markeredgecolor": style.INK,
}
"""Mark of a target."""


def draw_paths(
    frame: Panels,
    panel: Axes,
    paths: Sequence[Array],
    looks: Sequence[dict[str, Any]],
    targets: Targets,
    color: str = style.INK,
    errors: bool = False,
    units: Units = SI,
) -> float:
    """Draw paths and targets into a panel whose place is final; return how errors are enlarged.

    Parameters
    ----------
    paths, looks
        (n, 2) [m] each, with the options of its line.
    color
        Colour of the targets and their numbers.
    errors
        Whether lines for the errors are drawn.
    units
        Those that lengths are shown in.
    """
    k = frame.k
    scale = scale_of("m", [targets.wanted], units)
    shown = [scale(path) for path in paths]
    wanted, reached = scale(targets.wanted), scale(targets.reached)
    unit = _equal(panel, k, [wanted, *shown], wanted)
    places = Places(frame, panel)
    for number, (path, look) in enumerate(zip(shown, looks, strict=True), 1):
        panel.plot(*path.T, linewidth=1.5 * k, zorder=3, gid=f"path-{number}", **look)
        places.keep(*path.T)
    factor = enlargement((reached - wanted) / unit, wanted / unit) if errors else 0.0
    if factor:
        for number, (place, gap) in enumerate(zip(wanted, reached - wanted, strict=True), 1):
            ends = np.array([place, place + factor * gap])
            panel.plot(*ends.T, color=color, linewidth=1.5 * k, zorder=4, gid=f"error-{number}")
            places.keep(*ends.T)
    ring = {**RING, "markeredgecolor": color, "markersize": 5.0 * k}
    panel.plot(*wanted.T, zorder=5, gid="targets", **ring)
    for x, y in wanted:
        places.keep([x], [y])
    for number, ((x, y), away) in enumerate(zip(wanted, _ways(wanted, unit * k), strict=True), 1):
        for way in away:
            if places.write(x, y, str(number), color, away=way):
                break
    frame.label(panel, f"x [{scale.unit}]", f"y [{scale.unit}]")
    return factor


def _ways(targets: Array, unit: float) -> list[list[tuple[float, float]]]:
    """Return the directions in which each target may have its number, outwards first.

    A number stands nearer to its own target than to another one.
    """
    middle = targets.mean(axis=0)
    found = []
    for k, target in enumerate(targets):
        gap = target - middle
        first = float(np.arctan2(gap[1], gap[0]))
        own = []
        for turn in (0.0, np.pi, 0.5 * np.pi, -0.5 * np.pi):
            way = np.array([np.cos(first + turn), np.sin(first + turn)])
            spot = target + NUMBER * unit * way
            if int(np.argmin(np.hypot(*(targets - spot).T))) == k:
                own.append((float(way[0]), float(way[1])))
        found.append(own)
    return found


def _equal(panel: Axes, k: float, curves: Sequence[Array], targets: Array) -> float:
    """Set equal scales on both axes; return the size of a point [unit shown]."""
    everything = np.vstack(curves)
    everything = everything[np.isfinite(everything).all(axis=1)]
    # paths that run far away do not shrink the targets
    most = FAR * float(np.ptp(targets, axis=0).max())
    low = np.maximum(everything.min(axis=0), targets.min(axis=0) - most)
    high = np.minimum(everything.max(axis=0), targets.max(axis=0) + most)
    box = panel.get_window_extent()
    figure = panel.get_figure(root=True)
    assert isinstance(figure, Figure)
    size = np.array([box.width, box.height]) * 72.0 / figure.dpi
    unit = float(((high - low) / np.maximum(size - 2 * ROOM * k, 20.0)).max()) or 1.0
    middle = (low + high) / 2
    panel.set_xlim(*(middle[0] + np.array([-0.5, 0.5]) * size[0] * unit))
    panel.set_ylim(*(middle[1] + np.array([-0.5, 0.5]) * size[1] * unit))
    panel.set_aspect("equal", adjustable="datalim")
    return unit

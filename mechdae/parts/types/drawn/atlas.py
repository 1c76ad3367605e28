"""An atlas of kinematic chains: each as the graph of its links and as links with joints.

In the graph a dot is a link and a line a joint; beside it shaded polygons are links with three
joints and more, lines binary links, circles revolute and squares prismatic joints. The fixed
link is hatched (in the graph a ring), the driving joint has the colour of drivers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from mechdae.draw import style
from mechdae.parts.types.chains.mechanisms import joint_places, letters, link_places
from mechdae.types import Points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechdae.parts.types.chains.chains import KinematicChain

CELL = (2.6, 1.5)
"""Width and height of one chain [in]."""
COLUMNS = 4
MOST = 400
"""Chains on one sheet."""


def atlas(chains: Sequence[KinematicChain], title: str = "", columns: int = COLUMNS) -> Figure:
    """Return a figure with all chains, in rows of `columns`."""
    columns = max(1, min(columns, len(chains)))
    rows = -(-len(chains) // columns)
    strip = 0.4 if title else 0.1
    width, height = max(CELL[0] * columns, 4.0), CELL[1] * rows + strip
    with mpl.rc_context({"font.family": style.FONT, "svg.hashsalt": "mechdae"}):
        figure = Figure(figsize=(width, height), dpi=style.DPI, facecolor=style.PAPER)
        if title:
            figure.text(0.5, 1 - 0.2 / height, title, size=style.TITLE, ha="center", va="center")
        for k, chain in enumerate(chains):
            left = (k % columns) * CELL[0] / width
            bottom = (height - strip - (k // columns + 1) * CELL[1]) / height
            across, up = CELL[0] / width, CELL[1] / height
            figure.text(
                left + 0.02 * across, bottom + 0.9 * up, str(k + 1), size=style.SUBTITLE,
                color=style.FAINT,
            )  # fmt: skip
            _graph(figure.add_axes((left, bottom + 0.05 * up, 0.42 * across, 0.82 * up)), chain)
            _links(figure.add_axes((left + 0.44 * across, bottom, 0.54 * across, 0.96 * up)), chain)
    return figure


def _frame(ax: Axes, places: Points) -> None:
    """Show all places, to one scale in both directions."""
    low, high = places.min(axis=0), places.max(axis=0)
    room = 0.12 * max(*(high - low), 1e-9)
    ax.set_xlim(low[0] - room, high[0] + room)
    ax.set_ylim(low[1] - room, high[1] + room)
    ax.set_aspect("equal")
    ax.axis("off")


def _graph(ax: Any, chain: KinematicChain) -> None:
    places = link_places(chain)
    for k, (i, j) in enumerate(chain.joints):
        driving = k == chain.driver
        ax.plot(
            *places[[i, j]].T,
            color=style.DRIVEN if driving else style.GROUND,
            linewidth=2.0 if driving else 0.9,
            linestyle=style.DASHED if chain.pairs and chain.pairs[k] == "P" else "-",
            zorder=1,
        )
    others = [k for k in range(chain.links) if k != chain.fixed]
    ax.scatter(*places[others].T, s=16, color=style.INK, zorder=2)
    if chain.fixed is not None:
        ax.scatter(
            *places[[chain.fixed]].T, s=34, facecolor=style.PAPER, edgecolor=style.INK, zorder=2
        )
    _frame(ax, places)


def _links(ax: Axes, chain: KinematicChain) -> None:
    places = joint_places(chain)
    for link in range(chain.links):
        corners = places[[k for k, joint in enumerate(chain.joints) if link in joint]]
        fixed = link == chain.fixed
        if len(corners) == 2:
            ax.plot(
                *corners.T,
                color=style.GROUND if fixed else style.INK,
                linewidth=1.6,
                linestyle=(0, (1.5, 1.0)) if fixed else "-",
                zorder=2,
            )
            continue
        middle = corners.mean(axis=0)
        around = corners[np.argsort(np.arctan2(*(corners - middle).T[::-1]))]
        ax.add_patch(
            Polygon(
                around,
                facecolor=style.PAPER if fixed else style.FILL,
                edgecolor=style.GROUND if fixed else style.INK,
                hatch="////" if fixed else None,
                alpha=0.85,
                linewidth=1.2,
                joinstyle="round",
                zorder=1,
            )
        )
    for k, (place, name) in enumerate(zip(places, letters(len(places)), strict=True)):
        prismatic = bool(chain.pairs) and chain.pairs[k] == "P"  # type: ignore[index]
        ax.plot(
            *place,
            marker="s" if prismatic else "o",
            markersize=5.0,
            markerfacecolor=style.DRIVEN if k == chain.driver else style.PAPER,
            markeredgecolor=style.INK,
            markeredgewidth=0.9,
            zorder=3,
        )
        away = place - places.mean(axis=0)
        away = away / max(float(np.hypot(*away)), 1e-9)
        ax.annotate(
            name, place, 7.0 * away, textcoords="offset points", size=6.0, color=style.FAINT,
            ha="center", va="center", zorder=4,
        )  # fmt: skip
    _frame(ax, places)

"""A diagram with a graph below it, in a new figure or in the place of given axes."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdae.draw import style
from mechdae.draw.figure import new_axes

SIDE, RIGHT = 52.0, 14.0
"""Room beside the graph in a new figure [pt]."""
UNDER, OVER = 38.0, 4.0
"""Room below and above it."""


def above_and_below(ax: Axes | None, below: float, share: float) -> tuple[Axes, Axes]:
    """Return axes for the diagram and for the graph.

    Parameters
    ----------
    ax
        Axes whose place is divided; None makes a new figure.
    below
        Height of the graph with its labels in a new figure [pt].
    share
        Share of the place of given axes that the graph takes.
    """
    if ax is None:
        upper = new_axes()
        figure = upper.get_figure(root=True)
        assert isinstance(figure, Figure)
        width, height = style.FIGURE
        tall = height + below / 72
        box = upper.get_position()
        figure.set_size_inches(width, tall)
        part = height / tall
        upper.set_position((box.x0, 1 - (1 - box.y0) * part, box.width, box.height * part))
        left = SIDE / 72 / width
        lower = figure.add_axes(
            (
                left,
                UNDER / 72 / tall,
                1 - left - RIGHT / 72 / width,
                (below - UNDER - OVER) / 72 / tall,
            )
        )
        return upper, lower
    return ax, divided(ax, share)


def divided(ax: Axes, share: float) -> Axes:
    """Return new axes in the lower part of the place of others, which become as much lower."""
    figure = ax.get_figure(root=True)
    assert isinstance(figure, Figure)
    box = ax.get_position()
    part = share * box.height
    ax.set_position((box.x0, box.y0 + part, box.width, box.height - part))
    gap = min((UNDER + OVER) / 72 / float(figure.get_size_inches()[1]), 0.5 * part)
    return figure.add_axes((box.x0, box.y0, box.width, part - gap))

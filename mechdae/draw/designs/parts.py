"""What pictures of a synthesis share: a graph with its head, a diagram with a graph below."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdae.draw import style
from mechdae.draw.designs.drawn_design import DrawnDesign
from mechdae.draw.diagram.diagram import draw_pose
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.diagram.view import View
from mechdae.draw.figure import new_axes
from mechdae.draw.graphs.frame import Entry, Panels
from mechdae.draw.words import Words
from mechdae.results.kinds import SynthesisResult

SIDE, RIGHT = 52.0, 14.0
"""Room beside the graph in a new figure [pt]."""
UNDER, OVER = 38.0, 4.0
"""Room below and above it."""
SEPARATOR = "  ·  "
MARKS = ("o", "s", "^", "D", "v", "P", "X")


def headed(
    result: SynthesisResult, ax: Axes | None, facts: Sequence[str], key: Sequence[Entry],
    height: float,
) -> Panels:  # fmt: skip
    """Return a graph with the title of the task, facts and a key, ``height`` [pt] in a new figure.

    Parameters
    ----------
    facts
        What stands below the title.
    """
    title = str(result.title or result.problem)
    return Panels(ax, 1, title, SEPARATOR.join(facts), key, height=height)


def draw_facts(
    axes: Axes,
    scene: DrawnScene,
    design: DrawnDesign,
    words: Words,
    facts: Sequence[str],
    pose: int = 0,
    **options: Any,
) -> None:
    """Draw the diagram of a design with facts below its title; `options` are those of a `View`."""
    view = View(loads=False, subtitle=SEPARATOR.join(facts), **options)
    motion = design.motion.in_units(design.result.units)
    draw_pose(axes, scene, motion, pose, view, style.LIGHT, words)


def color_of(index: int) -> str:
    """Return the colour of a design, or of a class of them."""
    return style.SERIES[index % len(style.SERIES)]


def mark_of(index: int) -> str:
    """Return the mark of a design, or of a class of them."""
    return MARKS[index % len(MARKS)]


def line_of(index: int) -> dict[str, Any]:
    """Return colour and dashes of the curve of a design."""
    return {"color": color_of(index), "linestyle": style.DASHES[index % len(style.DASHES)] or "-"}


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

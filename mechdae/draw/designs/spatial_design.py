"""One design of a spatial synthesis: its diagram with targets, or its output and what is wanted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mechdae.describe.tasks.goals import FunctionTargets, Visits
from mechdae.draw import style
from mechdae.draw.designs import output
from mechdae.draw.designs.drawn_design import SEPARATOR, DrawnDesign, chosen, design_of
from mechdae.draw.designs.targets import Targets, draw_path, draw_targets
from mechdae.draw.figure import new_axes
from mechdae.draw.sheet import Sheet
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_drawing import SpatialView, draw_spatial_pose, extent
from mechdae.draw.space.spatial_scene import read_spatial
from mechdae.draw.space.viewpoint import Viewpoint
from mechdae.draw.words import Words


def draw(
    result: Any,
    ax: Axes | None = None,
    *,
    design: int = 0,
    labels: bool = True,
    lang: str = "en",
    view: Any = None,
) -> Axes:
    """Draw a design of a synthesis in parallel projection.

    Of a path or a motion: the kinematic diagram at the first target, the path over the whole
    sweep, the targets with their errors as they are seen. Of a function: the output with what is
    wanted, below it the structural error. Of other goals the diagram.

    Parameters
    ----------
    result
        What a task of kind synthesis gave.
    ax
        Axes to draw in; without it those of a new figure.
    design
        Index of the design, 0: the best.
    labels
        Whether joints have letters and links numbers.
    lang
        Language of the words, "en" or "ru".
    view
        ``"azimuth,elevation"`` or two numbers [deg]; without it one that is easy to read.

    Raises
    ------
    InputError
        The result is of no synthesis, no design was found, or there is none of that number.
    """
    words = Words(lang)
    drawn = design_of(result, chosen(result, design)[0])
    goal = drawn.goal
    if isinstance(goal, FunctionTargets):
        return output.draw(drawn, goal, ax, words)
    scene = read_spatial(drawn.motion)
    _, seen, moved = choose(scene, "", 0, view)
    low, high, size = extent(scene, [0], seen, moved, not isinstance(goal, Visits))
    facts = [drawn.name(words), *drawn.facts(words)]
    overlay = None
    if isinstance(goal, Visits):
        targets, overlay = _visits(drawn, goal, seen, words)
        low = np.minimum(low, targets.wanted.min(axis=0))
        high = np.maximum(high, targets.wanted.max(axis=0))
        errors = np.abs(np.array(drawn.data["errors"], float))
        worst = int(np.argmax(errors))
        facts.insert(2, words("largest at a target", words.amount(errors[worst], "m"), worst + 1))
    axes = new_axes() if ax is None else ax
    shown = SpatialView(
        not isinstance(goal, Visits), labels=labels, bounds=(low, high, size),
        subtitle=SEPARATOR.join(facts), overlay=overlay, viewpoint=seen, moved=moved,
    )  # fmt: skip
    draw_spatial_pose(axes, scene, drawn.motion, 0, shown, style.LIGHT, words)
    return axes


def _visits(
    design: DrawnDesign, goal: Visits, seen: Viewpoint, words: Words
) -> tuple[Targets, Callable[[Sheet], str]]:
    """Return the targets as they are seen, and what draws them with the path."""
    wanted = seen.flat(np.array(goal.places))
    reached = wanted
    if not design.defects:  # else it does not move through its targets
        reached = seen.flat(design.places(design.moves.at_targets, goal.what))
    path, targets = seen.flat(design.path(goal.what)), Targets(wanted, reached)

    def overlay(sheet: Sheet) -> str:
        draw_path(sheet, path, f"path-{goal.what}")
        return draw_targets(sheet, targets, words)

    return targets, overlay

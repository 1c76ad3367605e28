"""One design of a synthesis: its diagram with targets, or its output against what is wanted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from mechdae.describe.tasks.goals import FunctionTargets, Rocker, StraightLine, Visits
from mechdae.draw import style
from mechdae.draw.designs import output
from mechdae.draw.designs.drawn_design import (
    TURN,
    DesignPaper,
    DrawnDesign,
    above_and_below,
    chosen,
    design_of,
)
from mechdae.draw.designs.targets import (
    Targets,
    draw_dots,
    draw_path,
    draw_paths,
    draw_swing,
    draw_targets,
    enlarged,
)
from mechdae.draw.diagram.places import fixed_bodies
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.figure import new_axes
from mechdae.draw.graphs.frame import Panels
from mechdae.draw.poses import Eye, seen
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet
from mechdae.draw.words import Words
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.results import SynthesisResult


SMALL = 100.0
"""Targets that take less of the picture are drawn once more, enlarged [unit of the sheet]."""
BELOW, SHARE = 250.0, 0.45
"""Height of that in a new figure [pt], and its share of given axes."""
STILL = 1e-9
"""Swing or share of the mechanism's size below which a link stands still."""


def draw(
    result: SynthesisResult,
    ax: Axes | None = None,
    *,
    design: int = 0,
    labels: bool = True,
    lang: str = "en",
    view: Eye = None,
) -> Axes:
    """Draw a design of a synthesis, with the options of the catalogue; 0 is the best one.

    Of a path or a motion: the kinematic diagram at the first target, the path over the whole
    sweep, the targets with their errors. Of a function: the diagram, below it the output with
    what is wanted and the structural error. Of a straight line: the diagram, below it the
    deviation. Of a rocker, or a quantity that is least or largest: the diagram, in the plane with
    both extreme positions.

    Returns
    -------
    matplotlib.axes.Axes
        The upper axes of several.

    Raises
    ------
    InputError
        The result is of no synthesis, no design was found, or there is none of that number.
    """
    words = Words(lang)
    drawn = design_of(result, chosen(result, design)[0])
    goal = drawn.goal
    paper = DesignPaper(drawn, seen(drawn.motion, 0, view), ax, labels, words)
    if isinstance(goal, FunctionTargets):
        return output.draw_function(paper, goal)
    if isinstance(goal, StraightLine) and not paper.shown.in_space:
        return output.draw_line(paper, goal)
    if isinstance(goal, Visits):
        return _visits(paper, goal)
    axes = new_axes() if ax is None else ax
    if paper.shown.in_space:
        paper.draw(axes, drawn.facts(words))
    else:
        _swinging(paper, axes)
    return axes


def _visits(paper: DesignPaper, goal: Visits) -> Axes:
    """Draw the diagram at the first target, with all targets; small ones once more below."""
    design, shown, words = paper.design, paper.shown, paper.words
    flat, plane = shown.view.flat, not shown.in_space
    path, wanted = flat(design.path(goal.what)), flat(np.array(goal.places))
    reached = wanted
    if not design.defects:  # else it does not move through its targets
        reached = flat(design.places(design.moves.at_targets, goal.what))
    angles = np.array(goal.targets)[:, 2] if plane and goal.is_motion else None
    targets = Targets(wanted, reached, angles)
    low, high, size = shown.bounds([0], plane)
    low = np.minimum(low, targets.wanted.min(axis=0))
    high = np.maximum(high, targets.wanted.max(axis=0))
    lower = None
    if plane and _share(targets.wanted, high - low) < SMALL:
        axes, lower = above_and_below(paper.ax, BELOW, SHARE)
    else:
        axes = new_axes() if paper.ax is None else paper.ax

    def overlay(sheet: Sheet) -> str:
        draw_path(sheet, path, f"path-{goal.what}")
        if lower is None:
            return draw_targets(sheet, targets, words)
        draw_dots(sheet, targets)
        frame, units, looks = Panels(lower, 1, None), design.result.units, [{"color": style.WHEEL}]
        factor = draw_paths(frame, [path], looks, targets, units, style.ARROW, errors=True)
        return enlarged(factor, words)

    errors = np.abs(np.array(design.data["errors"], float))
    length, units = words.amount(float(errors.max()), "m"), design.result.units
    if "m" in units.by_si:
        length = (
            f"{words.number(units.of('m').factor * float(errors.max()), 4)} {units.of('m').name}"
        )
    most = [words("largest at a target", length, int(np.argmax(errors)) + 1)]
    facts = design.facts(words, *([] if design.defects else most))
    paper.draw(axes, facts, bounds=(low, high, size), overlay=overlay, traces=plane)
    return axes


def _share(targets: Array, spans: Array) -> float:
    """Return how large the targets become in a new figure [unit of the sheet]."""
    room = np.array(style.AREA) - 2 * style.MARGIN - (0.0, style.STRIP)
    size = float(np.ptp(targets, axis=0).max())
    return size * float((room / np.maximum(spans, 1e-300)).min())


def _swinging(paper: DesignPaper, axes: Axes) -> None:
    """Draw the diagram between the extreme positions of a link, and those faintly."""
    design, scene, words = paper.design, paper.shown.scene, paper.words
    rockers = [goal for goal, _ in design.demand.goals if isinstance(goal, Rocker)]
    turning = [goal.coordinate for goal in rockers if goal.coordinate.endswith(".angle")]
    end = _end_of(design, scene, turning[0].rpartition(".")[0] if turning else None)
    if end is None:
        paper.draw(axes, design.facts(words))
        return
    body, reference, series, turns = end
    low, high = int(np.argmin(series)), int(np.argmax(series))
    swing = float(series[high] - series[low])
    before = [words("swing", words.number(np.degrees(swing), 4))] * turns
    ratios = [goal.time_ratio for goal in rockers if goal.time_ratio is not None]
    before += [words("time ratio", words.number(ratio, 4)) for ratio in ratios[::-1]]
    facts = design.facts(words, before=before)

    def overlay(sheet: Sheet) -> str:
        if turns:
            others = [p for p in scene.mechanism.body(body).points if f"{body}.{p}" != reference]
            if others:
                pivot = scene.place(reference, 0)
                ends = [scene.place(f"{body}.{others[0]}", pose) for pose in (low, high)]
                angles = [float(np.arctan2(*(end - pivot)[::-1])) for end in ends]
                text = f"{words.number(np.degrees(swing), 4)}°"
                draw_swing(sheet, pivot, ends, (angles[0], angles[0] + swing), text)
        return ""

    paper.draw(axes, facts, (low + high) // 2, ghosts=(low, high), overlay=overlay)


def _end_of(
    design: DrawnDesign, scene: DrawnScene, body: str | None
) -> tuple[str, str, Array, bool] | None:
    """Return the link whose extremes are drawn, its point on the ground, its motion, if it turns.

    It is the one named, else the last one on the ground that swings or slides back and forth.
    """
    fixed = fixed_bodies(scene.mechanism)
    driver = design.demand.driver.split(".")[0]
    driven = {driver}
    if driver in scene.mechanism.joints:
        driven = set(scene.mechanism.joints[driver].bodies)
    result = None
    for joint in scene.mechanism.joints.values():
        sides = {joint.first_body: joint.first, joint.second_body: joint.second}
        moving = [side for side in sides if side not in fixed]
        if len(moving) != 1 or (body is None and moving[0] in driven):
            continue
        if body is not None and moving[0] != body:
            continue
        turns = not joint.guide
        series = scene.angles[moving[0]] if turns else scene.slide(joint)
        if float(np.ptp(series)) > STILL and (not turns or np.ptp(series) < 0.99 * TURN):
            result = moving[0], sides[moving[0]], series, turns
    if result is None and body is not None and body in scene.angles:
        raise InputError(f"'{body}' does not swing in the sweep of this design")
    return result

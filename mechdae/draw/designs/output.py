"""Functions and straight lines: what a design gives, what is wanted, below it the error."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from mechdae.describe.coordinates import coordinate
from mechdae.describe.tasks.goals import FunctionTargets, StraightLine
from mechdae.describe.units import Units
from mechdae.draw import style
from mechdae.draw.designs.drawn_design import TURN, DesignPaper, DrawnDesign, above_and_below
from mechdae.draw.designs.targets import draw_path
from mechdae.draw.formulas.notations import RAISED
from mechdae.draw.graphs.frame import Entry, Panels
from mechdae.draw.graphs.scale import Scale, scale_of
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, unit
from mechdae.draw.words import Words
from mechdae.types import Json

TINY = 0.1
"""Values smaller than this are shown as multiples of a power of ten."""
HIGH = (1.0, 0.8)
"""Size of the diagram above the graphs of a function, over the usual one."""


def draw_function(paper: DesignPaper, goal: FunctionTargets) -> Axes:
    """Draw the diagram, the output of a design over its interval, of points over the whole sweep.

    Below it stands the structural error.
    """
    design, words = paper.design, paper.words
    mechanism, units = design.problem.mechanism, design.result.units
    inputs, outputs = (coordinate(mechanism, text) for text in (design.demand.driver, goal.output))
    errors = np.array(design.data["errors"], float)
    poses = design.motion if goal.targets else design.moves.between
    at = x = design.driven(poses)
    y = design.series(poses, goal.output)
    wanted = y - errors if not goal.targets else y
    if goal.targets:
        at, wanted = _wanted(design, goal, x, y, errors)
    across, up = scale_of(inputs.unit, [x], units), scale_of(outputs.unit, [y, wanted], units)
    small = scale_of_errors(outputs.unit, errors, units)
    solid: Json = {"color": style.SERIES[0], "linewidth": 1.6}
    target: Json = {"color": style.ARROW, "linewidth": 1.4, "linestyle": style.DASHES[3]}
    if goal.targets:
        target = {"marker": "o", "markersize": 5.0, "markerfacecolor": style.PAPER,
                 "markeredgecolor": style.ARROW, "linestyle": ""}  # fmt: skip
    key = [Entry(words("of the design"), line=solid), Entry(words("wanted"), line=target)]
    diagram, below = above_and_below(paper.ax, 330.0, 0.6, over=26.0, larger=HIGH)
    facts = design.facts(words, worst_fact(outputs.unit, errors, words, units))
    paper.draw(diagram, facts, traces=False, larger=HIGH)
    frame = Panels(below, 2, None, key=key)
    upper, lower = frame.panels
    frame.line(upper, "output", across(x), up(y), zorder=2, **solid)
    frame.line(upper, "wanted", across(at), up(wanted), zorder=4, **target)
    if goal.targets:
        frame.zero(lower)
        lower.vlines(across(at), 0.0, small(errors), color=style.ARROW, linewidth=1.4 * frame.k)
        frame.line(lower, "error", across(at), small(errors), zorder=4, **target)
    else:
        draw_errors(frame, lower, across(at), small(errors), "error")
    frame.label(upper, y=up.named(goal.output))
    frame.label(lower, across.named(design.demand.driver), small.named(words("error")))
    frame.turns(upper.xaxis, across, float(np.ptp(across(x))))
    frame.limits(upper, across(x), (0.015 * bool(goal.targets),) * 2, "x")
    return diagram


def draw_errors(frame: Panels, panel: Axes, x: Array, errors: Array, gid: str) -> None:
    """Draw errors over an interval, filled from zero."""
    frame.zero(panel)
    panel.fill_between(x, errors, color=style.ARROW, alpha=0.15, linewidth=0)
    frame.line(panel, gid, x, errors, color=style.ARROW, linewidth=1.5, zorder=2)


def errors_of(design: DrawnDesign, goal: FunctionTargets) -> tuple[Array, Array]:
    """Return driver values and errors there."""
    errors = np.array(design.data["errors"], float)
    if not goal.targets:
        return design.driven(design.moves.between), errors
    return np.array(design.data["at"], float), errors


def scale_of_errors(unit: str, errors: Array, units: Units) -> Scale:
    """Return how errors are shown, a power of ten in front of the unit if they are small."""
    plain = scale_of(unit, [errors], units)
    largest = float(np.abs(plain(errors)).max(initial=0.0))
    if not 0.0 < largest < TINY:
        return plain
    power = int(np.floor(np.log10(largest) / 3)) * 3
    name = f"10{str(power).translate(RAISED)} {plain.unit}".rstrip()
    return Scale(name, plain.factor * 10.0**-power)


def worst_fact(unit: str, errors: Array, words: Words, units: Units) -> str:
    """Return what the largest error is, with its unit."""
    plain = scale_of(unit, [errors], units)
    worst = words.number(float(np.abs(plain(errors)).max()), 4)
    return words("largest error", f"{worst} {plain.unit}".rstrip())


def _wanted(
    design: DrawnDesign, goal: FunctionTargets, x: Array, y: Array, errors: Array
) -> tuple[Array, Array]:
    """Return inputs within the sweep and the outputs that are wanted there."""
    wanted = design.series(design.moves.at_targets, goal.output) - errors
    inside = design.wrapped(design.data["at"])
    if coordinate(design.problem.mechanism, goal.output).is_angle:
        order = np.argsort(x)
        near = np.interp(inside, x[order], y[order])
        wanted = wanted + TURN * np.round((near - wanted) / TURN)
    return inside, wanted


def draw_line(paper: DesignPaper, goal: StraightLine) -> Axes:
    """Draw the diagram at the beginning of the line, and the deviation along it."""
    design, words = paper.design, paper.words
    upper, lower = above_and_below(paper.ax, 150.0, 0.3)
    along, errors, places = deviation(design, goal)
    path = design.path(goal.point)

    def overlay(sheet: Sheet) -> str:
        draw_path(sheet, path, f"path-{goal.point}", style.LINE)
        points = sheet.at(places)
        sheet.line(
            points[[0, -1]], color=style.ARROW, width=style.THIN, dash=style.DASHED, gid="line"
        )
        sheet.line(points, color=style.WHEEL, width=style.BAR, gid="straight", weight=0.0)
        for k, number in ((0, 1), (-1, 2)):
            sheet.circle(points[k], 3.0, fill=style.PAPER, edge=style.ARROW, gid=f"target-{number}")
        return ""

    units = design.result.units
    across, small = scale_of("m", [along], units), scale_of_errors("m", errors, units)
    facts = design.facts(words, worst_fact("m", errors, words, units))
    paper.draw(upper, facts, overlay=overlay)
    frame = Panels(lower, 1, None)
    panel = frame.panels[0]
    draw_errors(frame, panel, across(along), small(errors), "deviation")
    frame.limits(panel, across(along), (0.0, 0.0), "x")
    names = across.named(words("along the line")), small.named(words("deviation"))
    frame.label(panel, *names)
    return upper


def deviation(design: DrawnDesign, goal: StraightLine) -> tuple[Array, Array, Array]:
    """Return way along the line, deviation from it, and the places of the point."""
    places = design.places(design.moves.between, goal.point)
    errors = np.array(design.data["errors"], float)
    # the deviation bends nothing: the way is that between the ends
    way = unit(places[-1] - places[0])
    return (places - places[0]) @ way, errors, places

"""Functions and straight lines: what a design gives, what is wanted, below it the error."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from mechdae.describe.coordinates import coordinate
from mechdae.describe.tasks.goals import FunctionTargets, StraightLine
from mechdae.describe.units import SI, Units
from mechdae.draw import style
from mechdae.draw.designs.drawn_design import TURN, DrawnDesign, above_and_below, draw_facts
from mechdae.draw.designs.targets import draw_path
from mechdae.draw.diagram.scene import Array
from mechdae.draw.graphs.frame import Entry, Panels
from mechdae.draw.graphs.scale import Scale, scale_of, step_of
from mechdae.draw.poses import Seen
from mechdae.draw.sheet import Sheet, unit
from mechdae.draw.words import Words
from mechdae.types import Json

TINY = 0.1
"""Values smaller than this are shown as multiples of a power of ten."""


def draw(design: DrawnDesign, goal: FunctionTargets, ax: Axes | None, words: Words) -> Axes:
    """Draw the output of a design over its interval; of points, over the whole sweep."""
    mechanism = design.problem.mechanism
    inputs, outputs = (coordinate(mechanism, text) for text in (design.demand.driver, goal.output))
    errors = np.array(design.data["errors"], float)
    if goal.targets:
        x = design.driven(design.motion)
        y = design.series(design.motion, goal.output)
        at, wanted = _wanted(design, goal, x, y, errors)
    else:
        at = x = design.driven(design.moves.between)
        y = design.series(design.moves.between, goal.output)
        wanted = y - errors
    units = design.result.units
    across = scale_of(inputs.unit, [x], units)
    up = scale_of(outputs.unit, [y, wanted], units)
    small, power = scale_of_errors(outputs.unit, errors, units)
    unit = unit_text(small, power)
    facts = [design.name(words), *design.facts(words)]
    facts.insert(2, words("largest error", worst_text(outputs.unit, errors, words, units)))
    solid: Json = {"color": style.SERIES[0], "linewidth": 1.6}
    target: dict[str, Any]
    if goal.targets:
        target = {"marker": "o", "markersize": 5.0, "markerfacecolor": style.PAPER,
                 "markeredgecolor": style.ARROW, "linestyle": ""}  # fmt: skip
    else:
        target = {"color": style.ARROW, "linewidth": 1.4, "linestyle": style.DASHES[3]}
    key = [Entry(words("of the design"), line=solid), Entry(words("wanted"), line=target)]
    frame = Panels(
        ax, 2, str(design.result.title or design.result.problem), "  ·  ".join(facts), key
    )
    upper, lower = frame.panels
    frame.line(upper, "output", across(x), up(y), zorder=2, **solid)
    frame.line(upper, "wanted", across(at), up(wanted), zorder=4, **target)
    if goal.targets:
        lower.axhline(0.0, color=style.FAINT, linewidth=0.8 * frame.k, zorder=1)
        lower.vlines(across(at), 0.0, small(errors), color=style.ARROW, linewidth=1.4 * frame.k)
        frame.line(lower, "error", across(at), small(errors), zorder=4, **target)
    else:
        draw_errors(frame, lower, across(at), small(errors), "error")
    frame.label(upper, y=f"{goal.output} [{up.unit}]")
    frame.label(lower, f"{design.demand.driver} [{across.unit}]", f"{words('error')} [{unit}]")
    ends = np.sort(across(x))[[0, -1]]
    if across.unit == "deg":
        upper.xaxis.set_major_locator(MultipleLocator(step_of(float(np.ptp(ends)), 9)))
    margin = 0.015 * (ends[1] - ends[0]) if goal.targets else 0.0
    upper.set_xlim(ends[0] - margin, ends[1] + margin)
    return upper


def draw_errors(frame: Panels, panel: Axes, x: Array, errors: Array, gid: str) -> None:
    """Draw errors over an interval, filled from zero."""
    panel.axhline(0.0, color=style.FAINT, linewidth=0.8 * frame.k, zorder=1)
    panel.fill_between(x, errors, color=style.ARROW, alpha=0.15, linewidth=0)
    frame.line(panel, gid, x, errors, color=style.ARROW, linewidth=1.5, zorder=2)


def errors_of(design: DrawnDesign, goal: FunctionTargets) -> tuple[Array, Array]:
    """Return driver values and errors there."""
    errors = np.array(design.data["errors"], float)
    if not goal.targets:
        return design.driven(design.moves.between), errors
    return np.array(design.data["at"], float), errors


def scale_of_errors(unit: str, errors: Any, units: Units = SI) -> tuple[Scale, int]:
    """Return how errors are shown, and the power of ten in front of the unit."""
    plain = scale_of(unit, [errors], units)
    largest = float(np.abs(plain(errors)).max(initial=0.0))
    if not 0.0 < largest < TINY:
        return plain, 0
    power = int(np.floor(np.log10(largest) / 3)) * 3
    return Scale(plain.unit, plain.factor * 10.0**-power), power


def worst_text(unit: str, errors: Array, words: Words, units: Units = SI) -> str:
    """Return the largest error with its unit."""
    plain = scale_of(unit, [errors], units)
    worst = words.number(float(np.abs(plain(errors)).max()), 4)
    return f"{worst} {plain.unit}".rstrip()


def unit_text(scale: Scale, power: int) -> str:
    """Return a unit, after its power of ten."""
    if not power:
        return scale.unit
    raised = str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"10{raised} {scale.unit}".rstrip()


def _wanted(
    design: DrawnDesign, goal: FunctionTargets, x: Array, y: Array, errors: Array
) -> tuple[Array, Array]:
    """Return inputs within the sweep and the outputs that are wanted there."""
    at = np.array(design.data["at"], float)
    reached = design.series(design.moves.at_targets, goal.output)
    wanted = reached - errors
    inside = design.wrapped(at)
    if coordinate(design.problem.mechanism, goal.output).is_angle:
        order = np.argsort(x)
        near = np.interp(inside, x[order], y[order])
        wanted = wanted + TURN * np.round((near - wanted) / TURN)
    return inside, wanted


BELOW = 150.0
"""Height of the deviation with its labels in a new figure [pt]."""
SHARE = 0.3
"""Share of given axes that the deviation takes."""


def draw_line(
    design: DrawnDesign, shown: Seen, goal: StraightLine, ax: Axes | None, labels: bool,
    words: Words,
) -> Axes:  # fmt: skip
    """Draw the diagram at the beginning of the line, and the deviation along it."""
    upper, lower = above_and_below(ax, BELOW, SHARE)
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
    small, power = scale_of_errors("m", errors, units)
    text = unit_text(small, power)
    facts = [design.name(words), *design.facts(words)]
    facts.insert(2, words("largest error", worst_text("m", errors, words, units)))
    draw_facts(upper, shown, design, words, facts, labels=labels, overlay=overlay)
    frame = Panels(lower, 1, "", "")
    panel = frame.panels[0]
    across = scale_of("m", [along], units)
    draw_errors(frame, panel, across(along), small(errors), "deviation")
    panel.set_xlim(*np.sort(across(along))[[0, -1]])
    frame.label(
        panel, f"{words('along the line')} [{across.unit}]", f"{words('deviation')} [{text}]"
    )
    return upper


def deviation(design: DrawnDesign, goal: StraightLine) -> tuple[Array, Array, Array]:
    """Return way along the line, deviation from it, and the places of the point."""
    places = design.places(design.moves.between, goal.point)
    errors = np.array(design.data["errors"], float)
    # the deviation bends nothing: the way is that between the ends
    way = unit(places[-1] - places[0])
    return (places - places[0]) @ way, errors, places

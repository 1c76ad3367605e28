"""A straight line: the diagram with the path, below it the deviation from the line."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from mechdae.describe.tasks.goals import StraightLine
from mechdae.draw import style
from mechdae.draw.designs.drawn_design import DrawnDesign
from mechdae.draw.designs.output import scale_of_errors, unit_text, worst_text
from mechdae.draw.designs.parts import above_and_below, draw_facts
from mechdae.draw.designs.targets import draw_path
from mechdae.draw.diagram.diagram import extent
from mechdae.draw.diagram.scene import Array, read_scene
from mechdae.draw.graphs.frame import Panels
from mechdae.draw.graphs.scale import scale_of
from mechdae.draw.sheet import Sheet, unit
from mechdae.draw.words import Words

BELOW = 150.0
"""Height of the deviation with its labels in a new figure [pt]."""
SHARE = 0.3
"""Share of given axes that the deviation takes."""


def draw(
    design: DrawnDesign, goal: StraightLine, ax: Axes | None, labels: bool, words: Words
) -> Axes:
    """Draw the diagram at the beginning of the line, and the deviation along it."""
    upper, lower = above_and_below(ax, BELOW, SHARE)
    along, errors, places = deviation(design, goal)
    scene = read_scene(design.motion)
    path = design.path(goal.point)

    def overlay(sheet: Sheet) -> str:
        draw_path(sheet, path, f"path-{goal.point}", style.LINE)
        points = sheet.at(places)
        sheet.line(
            points[[0, -1]],
            color=style.ARROW,
            width=style.THIN,
            dash=style.DASHED,
            z=style.Z_MARK,
            gid="line",
        )
        sheet.line(
            points, color=style.WHEEL, width=style.BAR, z=style.Z_MARK, gid="straight", weight=0.0
        )
        for k, number in ((0, 1), (-1, 2)):
            sheet.circle(points[k], 3.0, fill=style.PAPER, edge=style.ARROW, gid=f"target-{number}")
        return ""

    units = design.result.units
    small, power = scale_of_errors("m", errors, units)
    text = unit_text(small, power)
    facts = [design.name(words), *design.facts(words)]
    facts.insert(2, words("largest error", worst_text("m", errors, words, units)))
    low, high, size = extent(scene, 0, True, 0)
    draw_facts(upper, scene, design, words, facts, labels=labels, bounds=(low, high, size),
               overlay=overlay)  # fmt: skip
    frame = Panels(lower, 1, "", "")
    panel, k = frame.panels[0], frame.k
    across = scale_of("m", [along], units)
    panel.axhline(0.0, color=style.FAINT, linewidth=0.8 * k, zorder=1)
    panel.fill_between(across(along), small(errors), color=style.ARROW, alpha=0.15, linewidth=0)
    panel.plot(across(along), small(errors), color=style.ARROW, linewidth=1.5 * k, gid="deviation")
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

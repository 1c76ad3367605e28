"""All designs of a synthesis in one picture: paths over the targets, errors, outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, MultipleLocator

from mechdae.describe.coordinates import coordinate
from mechdae.describe.tasks.goals import FunctionTargets, Rocker, StraightLine, Visits
from mechdae.draw import style
from mechdae.draw.designs.drawn_design import (
    DrawnDesign,
    chosen,
    design_of,
    divided,
    headed,
    mark_of,
)
from mechdae.draw.designs.output import deviation, errors_of, scale_of_errors, unit_text
from mechdae.draw.designs.targets import MARK, Targets, draw_paths
from mechdae.draw.diagram.scene import Array
from mechdae.draw.graphs.frame import Entry, Panels
from mechdae.draw.graphs.scale import scale_of, step_of
from mechdae.draw.style import color_of, line_of
from mechdae.draw.words import Words
from mechdae.errors import InputError, UnavailableError

HEIGHT, BELOW = 330.0, 100.0
SHARE = 0.33
"""Share of the height that errors below paths take, with their gap."""


def draw(result: Any, ax: Axes | None = None, *, lang: str = "en") -> Axes:
    """Draw all designs of a synthesis over what is wanted.

    Of a path the paths over the targets; of a function the structural errors; of a straight
    line the deviations; of a rocker its angle against the driver.

    Raises
    ------
    InputError
        No design was found, or the goal is a single number.
    """
    words = Words(lang)
    designs = [design_of(result, k) for k in chosen(result, None)]
    goal = designs[0].goal
    if designs[0].problem.mechanism.dimension == 3 and not isinstance(goal, FunctionTargets):
        raise UnavailableError(
            "designs are not compared in one picture in space, but for functions",
            hint="kind design for each of them, or census",
        )
    if isinstance(goal, Visits):
        return _paths(designs, goal, ax, words)
    if isinstance(goal, FunctionTargets | StraightLine):
        return _errors(designs, goal, ax, words)
    if isinstance(goal, Rocker):
        return _angles(designs, goal, ax, words)
    raise InputError(
        "the goal is one number, designs have no curves to compare",
        hint="kinds for it: census, convergence, or design for each of them",
    )


def _frame(
    designs: Sequence[DrawnDesign],
    what: str,
    ax: Axes | None,
    words: Words,
    height: float,
    more: Sequence[Entry] = (),
    points: bool = False,
) -> Panels:
    """Return the graph, with the designs and their objectives in its key."""
    count = len(designs)
    key = []
    for k, design in enumerate(designs):
        line: dict[str, object] = {**line_of(k), "linewidth": 1.5}
        if points:
            line = {
                "color": color_of(k), "linestyle": "", "marker": mark_of(k), "markersize": 4.5,
            }  # fmt: skip
        text = f"{words('design', k + 1)}: {words.number(design.data['objective'], 4)}"
        key.append(Entry(text, line=line))
    facts = [words("compared one") if count == 1 else words("compared", count), what]
    return headed(designs[0].result, ax, facts, [*key, *more], height)


def _paths(designs: Sequence[DrawnDesign], goal: Visits, ax: Axes | None, words: Words) -> Axes:
    """Draw the paths of a point, or of a body's origin, over the targets; below, the errors."""
    wanted = np.array(goal.targets)[:, :2]
    paths = [design.path(goal.what) for design in designs]
    ring = [Entry(words("target"), line=MARK)]
    frame = _frame(designs, words("path of", goal.what), ax, words, HEIGHT + BELOW, ring)
    panel = frame.panels[0]
    _at_targets(designs, divided(panel, SHARE), words)
    draw_paths(
        frame,
        panel,
        paths,
        [*map(line_of, range(len(paths)))],
        Targets(wanted, wanted),
        units=designs[0].result.units,
    )
    return panel


def _at_targets(designs: Sequence[DrawnDesign], ax: Axes, words: Words) -> None:
    """Draw the error of each design at each target."""
    frame = Panels(ax, 1, "", "")
    panel = frame.panels[0]
    errors = [np.abs(np.array(design.data["errors"], float)) for design in designs]
    small, power = scale_of_errors("m", np.concatenate(errors), designs[0].result.units)
    for index, error in enumerate(errors):
        look = line_of(index) | {"linewidth": 1.2, "marker": mark_of(index), "markersize": 3.5}
        x = np.arange(1, len(error) + 1)
        frame.line(panel, f"errors-{index + 1}", x, small(error), zorder=2, **look)
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    panel.set_ylim(0.0, 1.08 * float(small(np.concatenate(errors)).max()) or 1.0)
    panel.margins(x=0.02)
    frame.label(panel, words("target"), f"{words('error')} [{unit_text(small, power)}]")


def _errors(
    designs: Sequence[DrawnDesign],
    goal: FunctionTargets | StraightLine,
    ax: Axes | None,
    words: Words,
) -> Axes:
    """Draw the structural errors, or the deviations from the line, over the interval."""
    mechanism, units = designs[0].problem.mechanism, designs[0].result.units
    curves: list[tuple[Array, Array]] = []
    for design in designs:
        if isinstance(goal, StraightLine):
            along, errors, _ = deviation(design, goal)
            curves.append((along, errors))
        else:
            at, errors = errors_of(design, goal)
            curves.append((at - at[0], errors))
    if isinstance(goal, StraightLine):
        unit, below, what, word = "m", "m", words("along the line"), words("deviation")
    else:
        driver = designs[0].demand.driver
        unit, below = (coordinate(mechanism, text).unit for text in (goal.output, driver))
        what, word = f"{driver} \N{MINUS SIGN} {words('start')}", words("error")
    points = isinstance(goal, FunctionTargets) and bool(goal.targets)
    frame = _frame(designs, word, ax, words, HEIGHT * 0.8, points=points)
    panel, k = frame.panels[0], frame.k
    small, power = scale_of_errors(unit, np.concatenate([errors for _, errors in curves]), units)
    across = scale_of(below, [axis for axis, _ in curves], units)
    panel.axhline(0.0, color=style.FAINT, linewidth=0.8 * k, zorder=1)
    for index, (at, errors) in enumerate(curves):
        look = line_of(index)
        if points:
            look |= {"linestyle": "", "marker": mark_of(index)}
        look |= {"linewidth": 1.5, "markersize": 4.5}
        frame.line(panel, f"errors-{index + 1}", across(at), small(errors), **look)
    panel.margins(x=0.01 if points else 0.0)
    frame.label(panel, f"{what} [{across.unit}]", f"{word} [{unit_text(small, power)}]")
    return panel


def _angles(designs: Sequence[DrawnDesign], goal: Rocker, ax: Axes | None, words: Words) -> Axes:
    """Draw what a rocker turns or slides from its first extreme, over the driver from there."""
    driver, mechanism = designs[0].demand.driver, designs[0].problem.mechanism
    frame = _frame(designs, goal.coordinate, ax, words, HEIGHT * 0.8)
    panel, units = frame.panels[0], designs[0].result.units
    across = scale_of(coordinate(mechanism, driver).unit, (), units)
    up = scale_of(coordinate(mechanism, goal.coordinate).unit, (), units)
    for index, design in enumerate(designs):
        at = design.driven(design.motion)
        angle = design.series(design.motion, goal.coordinate)
        track = across(at - at[0]), up(angle - angle[0])
        frame.line(panel, f"angle-{index + 1}", *track, linewidth=1.5, **line_of(index))
    panel.margins(x=0.0)
    if across.unit == "deg":
        span = float(across(np.ptp(designs[0].driven(designs[0].motion))))
        panel.xaxis.set_major_locator(MultipleLocator(step_of(span, 9)))
    start = f"\N{MINUS SIGN} {words('start')}"
    frame.label(
        panel, f"{driver} {start} [{across.unit}]", f"{goal.coordinate} {start} [{up.unit}]"
    )
    return panel

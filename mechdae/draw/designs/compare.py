"""All designs of a synthesis in one picture: paths over the targets, errors, outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from mechdae.describe.coordinates import coordinate
from mechdae.describe.tasks.goals import FunctionTargets, Rocker, StraightLine, Visits
from mechdae.draw.designs.drawn_design import (
    SEPARATOR,
    DrawnDesign,
    chosen,
    design_of,
    divided,
    mark_of,
)
from mechdae.draw.designs.output import deviation, errors_of, scale_of_errors
from mechdae.draw.designs.targets import MARK, Targets, draw_paths
from mechdae.draw.graphs.frame import Entry, Panels
from mechdae.draw.graphs.scale import Scale, scale_of
from mechdae.draw.primitives import Array
from mechdae.draw.style import line_of
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
    designs: Sequence[DrawnDesign], what: str, ax: Axes | None, words: Words, height: float,
    more: Sequence[Entry] = (), points: bool = False,
) -> Panels:  # fmt: skip
    """Return the graph, with the designs and their objectives in its key."""
    count = len(designs)
    key = []
    for k, design in enumerate(designs):
        line = line_of(k) | {"linewidth": 1.5}
        if points:
            line |= {"linestyle": "", "marker": mark_of(k), "markersize": 4.5}
        text = f"{words('design', k + 1)}: {words.number(design.data['objective'], 4)}"
        key.append(Entry(text, line=line))
    facts = [words("compared one") if count == 1 else words("compared", count), what]
    return Panels(ax, 1, designs[0].result, SEPARATOR.join(facts), [*key, *more], height=height)


def _curves(
    frame: Panels, word: str, curves: Sequence[tuple[Array, Array]], scales: tuple[Scale, Scale],
    labels: tuple[str, str], **look: Any,
) -> Axes:  # fmt: skip
    """Draw a curve of each design; ``marker`` is its own where there is one."""
    panel, (across, up) = frame.panels[0], scales
    for k, (x, y) in enumerate(curves):
        each = line_of(k) | {"linewidth": 1.5} | look
        each |= {"marker": mark_of(k)} if "markersize" in look else {}
        frame.line(panel, f"{word}-{k + 1}", across(x), up(y), **each)
    frame.label(panel, across.named(labels[0]), up.named(labels[1]))
    return panel


def _paths(designs: Sequence[DrawnDesign], goal: Visits, ax: Axes | None, words: Words) -> Axes:
    """Draw the paths of a point, or of a body's origin, over the targets; below, the errors."""
    wanted, units = np.array(goal.targets)[:, :2], designs[0].result.units
    paths = [design.path(goal.what) for design in designs]
    ring = [Entry(words("target"), line=MARK)]
    frame = _frame(designs, words("path of", goal.what), ax, words, HEIGHT + BELOW, ring)
    panel = frame.panels[0]
    errors = [np.abs(np.array(design.data["errors"], float)) for design in designs]
    small = scale_of_errors("m", np.concatenate(errors), units)
    curves = [(np.arange(1.0, len(error) + 1), error) for error in errors]
    below = _curves(
        Panels(divided(panel, SHARE), 1, None), "errors", curves, (Scale(""), small),
        (words("target"), words("error")), linewidth=1.2, markersize=3.5, zorder=2,
    )  # fmt: skip
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    below.set_ylim(0.0, 1.08 * float(small(np.concatenate(errors)).max()) or 1.0)
    below.margins(x=0.02)
    draw_paths(frame, paths, [*map(line_of, range(len(paths)))], Targets(wanted, wanted), units)
    return panel


def _errors(
    designs: Sequence[DrawnDesign],
    goal: FunctionTargets | StraightLine,
    ax: Axes | None,
    words: Words,
) -> Axes:
    """Draw the structural errors, or the deviations from the line, over the interval."""
    mechanism, units = designs[0].problem.mechanism, designs[0].result.units
    if isinstance(goal, StraightLine):
        curves = [deviation(design, goal)[:2] for design in designs]
        unit, below, what, word = "m", "m", words("along the line"), words("deviation")
    else:
        curves = [errors_of(design, goal) for design in designs]
        curves = [(at - at[0], errors) for at, errors in curves]
        driver = designs[0].demand.driver
        unit, below = (coordinate(mechanism, text).unit for text in (goal.output, driver))
        what, word = f"{driver} \N{MINUS SIGN} {words('start')}", words("error")
    points = isinstance(goal, FunctionTargets) and bool(goal.targets)
    frame = _frame(designs, word, ax, words, HEIGHT * 0.8, points=points)
    small = scale_of_errors(unit, np.concatenate([errors for _, errors in curves]), units)
    across = scale_of(below, [axis for axis, _ in curves], units)
    frame.zero(frame.panels[0])
    look = {"linestyle": "", "markersize": 4.5} if points else {}
    panel = _curves(frame, "errors", curves, (across, small), (what, word), **look)
    panel.margins(x=0.01 if points else 0.0)
    return panel


def _angles(designs: Sequence[DrawnDesign], goal: Rocker, ax: Axes | None, words: Words) -> Axes:
    """Draw what a rocker turns or slides from its first extreme, over the driver from there."""
    driver, mechanism = designs[0].demand.driver, designs[0].problem.mechanism
    frame, names = (
        _frame(designs, goal.coordinate, ax, words, HEIGHT * 0.8),
        (driver, goal.coordinate),
    )
    units = designs[0].result.units
    across, up = (scale_of(coordinate(mechanism, text).unit, (), units) for text in names)
    rows = [(d.driven(d.motion), d.series(d.motion, goal.coordinate)) for d in designs]
    curves = [(at - at[0], angle - angle[0]) for at, angle in rows]
    start = f"\N{MINUS SIGN} {words('start')}"
    labels = f"{driver} {start}", f"{goal.coordinate} {start}"
    panel = _curves(frame, "angle", curves, (across, up), labels)
    panel.margins(x=0.0)
    frame.turns(panel.xaxis, across, float(across(np.ptp(rows[0][0]))))
    return panel

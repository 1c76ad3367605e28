"""A sheet of the schemes of a composition: each in one pose, with its curve and what is wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from mechdae.draw import style
from mechdae.draw.graphs.scale import scale_of
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.results.kinds import SynthesisResult
from mechdae.types import Floats, Matrix

MOST = 24
"""Designs on a sheet."""
CELL = (2.5, 2.4)
"""Width and height of one of them [in]."""
COLUMNS = 4
STRIP = 0.45
"""Height of the title [in]."""
SETTINGS: Any = {"font.family": style.FONT, "svg.hashsalt": "mechdae"}


def draw(result: SynthesisResult, ax: Axes | None = None, *, lang: str = "en") -> Axes:
    """Draw the designs of a front side by side, numbered as they are; at most 24, evenly taken."""
    designs = result.data.get("designs", [])
    if not designs:
        raise InputError("there is no design to draw", hint=str(result.fault or ""))
    words = Words(lang)
    chosen = np.unique(np.linspace(0, len(designs) - 1, min(MOST, len(designs))).astype(int))
    columns = min(COLUMNS, len(chosen))
    lines = -(-len(chosen) // columns)
    with mpl.rc_context(SETTINGS):
        size = max(CELL[0] * columns, 4.0), CELL[1] * lines + STRIP
        if ax is None:
            figure = Figure(figsize=size, dpi=style.DPI, facecolor=style.PAPER)
            ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        ax.set_xlim(0, 1)
        ax.set_ylim(0, 1)
        ax.axis("off")
        top = 1 - STRIP / size[1]
        ax.text(
            0.02, 1 - 0.25 / size[1], str(result.title or result.problem), size=style.TITLE,
            color=style.INK, va="center", transform=ax.transAxes, gid="title",
        )  # fmt: skip
        summary = result.summary
        wanted = np.array(summary.get("curve", summary.get("targets", [])), float).reshape(-1, 2)
        for place, k in enumerate(chosen.tolist()):
            row, column = divmod(place, columns)
            left, low = column / columns, top * (1 - (row + 1) / lines)
            wide, high = 1 / columns, top / lines
            cell = (left + 0.05 * wide, low + 0.04 * high, 0.9 * wide, 0.82 * high)
            facts = _cell(ax.inset_axes(cell), result, designs[k], k + 1, wanted, words)
            ax.text(left + 0.05 * wide, low + 0.9 * high, facts, size=style.TICK, color=style.INK)
    return ax


def _cell(
    ax: Axes, result: SynthesisResult, design: Mapping[str, Any], number: int, wanted: Matrix,
    words: Words,
) -> str:  # fmt: skip
    """Draw one design: what is wanted pale, its own curve, links, pins; return what it is."""
    goal = result.summary["goal"]
    path = np.array(design["path"], float)
    places = {name: np.array(spot, float) for name, spot in design["places"].items()}
    every = np.vstack([wanted, path, *places.values()])
    length = scale_of("m", [wanted if len(wanted) else every], result.units)
    if goal == "curve":
        ax.plot(*np.vstack([wanted, wanted[:1]]).T, color=style.GHOST, linewidth=5.0, zorder=1)
        path = np.vstack([path, path[:1]])
    ax.plot(*path.T, color=style.ARROW, linewidth=1.3, zorder=4)
    if goal == "path":
        ax.plot(
            *wanted.T, marker="x", markersize=5.0, color=style.INK, markeredgewidth=1.0,
            linestyle="", zorder=7,
        )  # fmt: skip
    frame, *links = design["link_points"]
    for k, names in enumerate(links):
        if len(names) > 1:
            _link(ax, [places[name] for name in names], k == 0)
    size = float(np.ptp(every, axis=0).max())
    for guide in design.get("guides", ()):
        ends = np.array(guide["ends"], float)
        block = places[design["link_points"][guide["block"]][0]]
        _guide(ax, ends, block, guide["link"] == 0, 0.045 * size)
        every = np.vstack([every, ends])
    owners = [name for names in design["link_points"] for name in names]
    for name in sorted(set(owners)):
        if owners.count(name) == 1 and name != "P":
            continue  # a point that a guide passes
        fixed, traces = name in frame, name == "P"
        ax.plot(
            *places[name], marker="^" if fixed else "o", markersize=7.0 if fixed else 3.5,
            color=style.ARROW if traces else style.PAPER, markeredgecolor=style.INK,
            markeredgewidth=0.9, linestyle="", zorder=6,
        )  # fmt: skip
    errors = result.units.of(result.summary["error_unit"])
    error, unit = float(design["error"]), ""
    if goal != "curve":
        shown = length if errors.name == result.units.of("m").name else None
        error = float(shown(error)) if shown else error * errors.factor
        unit = f" {shown.unit if shown else errors.name}"
    facts = [
        f"{words('error')} {words.number(error, 3)}{unit}",
        f"{words.number(float(length(design['material'])), 3)} {length.unit}",
        f"{len(design['link_points'])}/{design['joints']}",
    ]
    _frame(ax, every)
    return f"{number}   " + "  ·  ".join(facts)


def _link(ax: Axes, spots: Sequence[Floats], crank: bool) -> None:
    color = style.DRIVEN if crank else style.INK
    if len(spots) > 2:
        middle = np.mean(spots, axis=0)
        gaps = np.array(spots) - middle
        order = np.argsort(np.arctan2(gaps[:, 1], gaps[:, 0]), kind="stable")
        ax.add_patch(
            Polygon(
                np.array(spots)[order], closed=True, facecolor=style.GHOST, edgecolor=color,
                linewidth=1.4, alpha=0.75, zorder=3,
            )
        )  # fmt: skip
    else:
        ax.plot(*np.array(spots).T, color=color, linewidth=2.2 if crank else 1.5, zorder=3.5)


def _guide(ax: Axes, ends: Any, block: Any, fixed: bool, size: float) -> None:
    """Draw a guide, dashed on the frame, and its block."""
    way = ends[1] - ends[0]
    far = float(np.hypot(*way))
    way = way / far if far > 0 else np.array([1.0, 0.0])
    beyond = np.array([ends[0] - size * way, ends[1] + size * way])
    ax.plot(
        *beyond.T, color=style.GROUND if fixed else style.INK, linewidth=1.0 if fixed else 1.5,
        linestyle="--" if fixed else "-", zorder=2 if fixed else 3.4,
    )  # fmt: skip
    across = 0.6 * np.array([-way[1], way[0]])
    corners = [block + size * (a * way + b * across) for a, b in BLOCK]
    ax.add_patch(
        Polygon(
            corners, closed=True, facecolor=style.PAPER, edgecolor=style.INK, linewidth=1.2,
            zorder=5,
        )
    )  # fmt: skip


BLOCK = ((-1, -1), (1, -1), (1, 1), (-1, 1))
"""Corners of a block along and across its guide."""


def _frame(ax: Axes, every: Matrix) -> None:
    low, high = every.min(axis=0), every.max(axis=0)
    room = 0.08 * float((high - low).max())
    ax.set_xlim(low[0] - room, high[0] + room)
    ax.set_ylim(low[1] - room, high[1] + room)
    ax.set_aspect("equal")
    ax.axis("off")

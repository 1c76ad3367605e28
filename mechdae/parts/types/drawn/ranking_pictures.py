"""Pictures of a ranking: parallel axes, the front of two criteria, a sheet of the best variants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from mechdae.draw import style
from mechdae.errors import InputError
from mechdae.types import Floats, Matrix

if TYPE_CHECKING:
    from mechdae.parts.types.ranking.rank import RankedVariant, Ranking
    from mechdae.results.result import SweepResult


MOST = 12
"""Variants on a sheet."""
CELL = (3.0, 2.45)
"""Width and height of one of them [in]."""
SETTINGS: Any = {"font.family": style.FONT, "svg.hashsalt": "mechdae"}
UNITS = {"rad/s2": "rad/s²", "m/s2": "m/s²", "N m": "N·m", "1": ""}


def parallel(ranking: Ranking) -> Figure:
    """Return parallel axes: one for each criterion in which variants differ, the best on top."""
    names, rows = _varied(ranking)
    with mpl.rc_context(SETTINGS):
        figure, ax = _figure(max(4.5, 1.25 * len(names) + 1.2), 4.2, _title(ranking))
        places = np.arange(len(names))
        table = np.array([[row.values[name] for name in names] for row in rows])
        for row, heights in zip(rows[::-1], _heights(ranking, names, table)[::-1], strict=True):
            best, front = row.name == ranking.order[0], row.pareto
            color = style.ARROW if best else style.DRIVEN if front else style.GHOST
            width = 2.4 if best else 1.2 if front else 0.7
            order = 4 if best else 3 if front else 2
            ax.plot(places, heights, color=color, linewidth=width, zorder=order, clip_on=False)
        for k, name in enumerate(names):
            ax.plot([k, k], [0, 1], color=style.GROUND, linewidth=0.8, zorder=1)
            top, bottom = _ends(ranking, name, table[:, k])
            unit = _unit(ranking, name)
            ax.text(k, 1.03, f"{top:.4g}", ha="center", va="bottom", size=style.TICK)
            ax.text(k, -0.03, f"{bottom:.4g}", ha="center", va="top", size=style.TICK)
            label = name.replace("_", "\n") + (f"\n[{unit}]" if unit else "")
            ax.text(k, -0.1, label, ha="center", va="top", size=style.TICK, color=style.FAINT)
        ax.set_xlim(-0.4, len(names) - 0.6)
        ax.set_ylim(-0.32, 1.12)
        ax.axis("off")
        _key(figure)
    return figure


def fronts(ranking: Ranking, x: str | None = None, y: str | None = None) -> Figure:
    """Return the variants over two criteria, with those that no other one beats in both.

    `x`, `y`: criteria; absent: the two of the largest weights in which variants differ.
    """
    names, rows = _varied(ranking)
    by_weight = sorted(names, key=lambda name: -ranking.weights[name])
    chosen = [name for name in (x, y) if name is not None]
    chosen += [name for name in by_weight if name not in chosen][: 2 - len(chosen)]
    if len(chosen) < 2:
        raise InputError("variants differ in one criterion, a front needs two", where="criteria")
    with mpl.rc_context(SETTINGS):
        figure, ax = _figure(5.6, 4.4, _title(ranking))
        table = np.array([[row.values[name] for name in chosen] for row in rows])
        signs = np.array([1.0 if _sense(ranking, name) == "min" else -1.0 for name in chosen])
        costs = table * signs
        at_front = np.array(
            [not ((costs <= c).all(axis=1) & (costs < c).any(axis=1)).any() for c in costs]
        )
        rest = table[~at_front]
        ax.scatter(rest[:, 0], rest[:, 1], s=18, color=style.GHOST, edgecolor=style.FAINT, lw=0.5)
        steps = np.unique(table[at_front], axis=0)
        ax.step(
            steps[:, 0],
            steps[:, 1],
            where="post" if signs[0] > 0 else "pre",
            color=style.DRIVEN,
            lw=1.0,
        )
        ax.scatter(steps[:, 0], steps[:, 1], s=30, color=style.DRIVEN, zorder=3)
        best = table[[row.name for row in rows].index(ranking.order[0])]
        ax.scatter(best[0], best[1], s=70, color="none", edgecolor=style.ARROW, lw=2, zorder=4)
        for axis, name in zip((ax.xaxis, ax.yaxis), chosen, strict=True):
            unit = _unit(ranking, name)
            better = "less is better" if _sense(ranking, name) == "min" else "more is better"
            axis.set_label_text(f"{name.replace('_', ' ')}{f' [{unit}]' if unit else ''}, {better}")
        ax.tick_params(labelsize=style.TICK)
        ax.grid(color=style.GHOST, linewidth=0.5)
        ax.margins(0.08)
        ax.set_position((0.14, 0.2, 0.82, 0.66))
        _key(figure)
    return figure


def sheet(ranking: Ranking, results: Mapping[str, SweepResult | None]) -> Figure:
    """Return the best variants side by side: diagrams, or their stacks of layers."""
    from mechdae.draw import plot

    names = list(results)[:MOST]
    columns = min(4, max(1, len(names)))
    lines = -(-len(names) // columns)
    with mpl.rc_context(SETTINGS):
        size = CELL[0] * columns, CELL[1] * lines + 0.5
        figure = Figure(figsize=size, dpi=style.DPI, facecolor=style.PAPER)
        figure.text(0.02, 1 - 0.3 / size[1], _title(ranking), size=style.TITLE, color=style.INK)
        for k, name in enumerate(names):
            left = (k % columns) * CELL[0] / size[0]
            bottom = 1 - (0.5 + CELL[1] * (k // columns + 1)) / size[1]
            across, up = CELL[0] / size[0], CELL[1] / size[1]
            place = (left + 0.03 * across, bottom + 0.02 * up, 0.94 * across, 0.84 * up)
            about = ranking.variants[name].about
            if "spans" in about:
                _stack(figure.add_axes(place), about)
            else:
                plot(results[name], "diagram", ax=figure.add_axes(place), labels=False, loads=False)
                _bare(figure.axes[-1])
            place_of = ranking.order.index(name) + 1
            figure.text(
                left + 0.05 * across, bottom + 0.9 * up,
                f"{place_of}  {name}   {ranking.score[name]:.3f}", size=style.SUBTITLE,
                color=style.INK,
            )  # fmt: skip
    return figure


def _bare(ax: Axes) -> None:
    """Take the titles of a diagram away: the sheet says what it is."""
    for text in [*ax.texts]:
        if text.get_gid():
            text.remove()


def _stack(ax: Axes, about: Mapping[str, Any]) -> None:
    """Draw layers seen along the plane: plates of the links, pins, bearings as white boxes."""
    spans, pins = about["spans"], about["pins"]
    where = {pin: float(k) for k, pin in enumerate(pins)}
    top = max(high for _, high in spans.values()) + 1
    ground: Any = {"fc": style.GHOST, "ec": style.GROUND, "hatch": "///", "lw": 0.8}
    grounded = {pin: bearing for pin, bearing in pins.items() if "ground" in bearing["links"]}
    plates = [0] + [top] * any(bearing["layers"][1] == top for bearing in grounded.values())
    for layer in plates:
        ax.add_patch(Rectangle((-0.5, layer - 0.35), len(pins), 0.7, **ground))
    for k, (link, (low, high)) in enumerate(spans.items()):
        along = [where[pin] for pin, bearing in pins.items() if link in bearing["links"]] or [0.0]
        x0, x1 = min(along) - 0.24, max(along) + 0.24
        color = style.color_of(k)
        for layer in {low, high}:
            ax.add_patch(Rectangle((x0, layer - 0.3), x1 - x0, 0.6, fc=color, ec=style.INK, lw=0.8))
        ax.text(
            x0 + 0.03, high + 0.33, link, ha="left", va="bottom", size=6.5, color=color, zorder=6
        )
    for pin, bearing in pins.items():
        x, (first, last) = where[pin], bearing["layers"]
        fork, sides = bearing["form"].removeprefix("fork on "), {first, last}
        if "ground" in bearing["links"] and fork != "overhung":
            other = next(link for link in bearing["links"] if link != "ground")
            low, high = spans[other]
            places: set[int] = sides - set(plates) if fork == "ground" else {(low + high) / 2}
            for place in places:  # a bracket, or the lug in a fork
                ax.add_patch(Rectangle((x - 0.24, place - 0.3), 0.48, 0.6, **ground))
            inner = {low, high} if fork == "ground" else places
        else:
            inner = {(first + last) / 2}
        carrier = bearing["carrier"]
        if fork == "overhung":
            at_first = 0 if carrier == "ground" and first == 0 else None
            own_span = spans.get(carrier, (plates[-1], plates[-1]) if at_first is None else (0, 0))
            bearings = {min(sides, key=lambda side: min(abs(side - end) for end in own_span))}
        else:
            bearings = sides if fork == carrier else inner
        for place in bearings:
            box = (x - 0.11, place - 0.24)
            ax.add_patch(Rectangle(box, 0.22, 0.48, fc="white", ec=style.INK, lw=0.8, zorder=2.5))
        ax.plot([x, x], [first, last], color=style.INK, lw=3, zorder=3, solid_capstyle="butt")
        ax.text(x, -0.75, pin, ha="center", va="center", size=7)
    ax.set_xlim(-0.6, len(pins) - 0.4)
    ax.set_ylim(-1.0, top + 0.9)
    ax.axis("off")


def _varied(ranking: Ranking) -> tuple[list[str], list[RankedVariant]]:
    by_name = {row.name: row for row in ranking.rows}
    rows = [by_name[name] for name in ranking.order]
    names = [criterion["name"] for criterion in ranking.criteria]
    varied = [name for name in names if len({f"{row.values[name]:.9g}" for row in rows}) > 1]
    if not varied:
        raise InputError("no two variants that are ranked differ", where="variants")
    return varied, rows


def _sense(ranking: Ranking, name: str) -> str:
    return next(str(one["sense"]) for one in ranking.criteria if one["name"] == name)


def _unit(ranking: Ranking, name: str) -> str:
    unit = next(str(one["unit"]) for one in ranking.criteria if one["name"] == name)
    return UNITS.get(unit, unit)


def _ends(ranking: Ranking, name: str, column: Floats) -> tuple[float, float]:
    """Return best and worst value."""
    low, high = float(column.min()), float(column.max())
    return (low, high) if _sense(ranking, name) == "min" else (high, low)


def _heights(ranking: Ranking, names: Sequence[str], table: Matrix) -> Any:
    ends = np.array([_ends(ranking, name, table[:, k]) for k, name in enumerate(names)])
    return (table - ends[:, 1]) / (ends[:, 0] - ends[:, 1])


def _title(ranking: Ranking) -> str:
    return f"{len(ranking.order)} of {len(ranking.rows)} variants ranked, first {ranking.order[0]}"


def _figure(width: float, height: float, title: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width, height), dpi=style.DPI, facecolor=style.PAPER)
    ax = figure.add_axes((0.03, 0.1, 0.94, 0.78))
    figure.text(0.03, 0.94, title, size=style.TITLE, color=style.INK, va="center")
    return figure, ax


def _key(figure: Figure) -> None:
    """Write what the colours mean below the picture."""
    entries = [("first place", style.ARROW), ("front", style.DRIVEN), ("others", style.FAINT)]
    for k, (text, color) in enumerate(entries):
        figure.text(0.03 + 0.17 * k, 0.03, f"— {text}", size=style.TICK, color=color)

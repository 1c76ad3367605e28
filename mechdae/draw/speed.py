"""Speed against error: records of `mechdae bench`, and of other methods, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdae.draw import style

MARKS = {"certified": "o", "interpolated": "s", "rootfinder": "^"}
COLOURS = ("#0072b2", "#d55e00", "#007a5a", "#8a4f7d", "#56b4e9", "#5f6b76")
SMALLEST = 1e-17


def draw(records: Sequence[dict[str, Any]]) -> Axes:
    """Return axes with time, as a ratio to the yardstick, over the largest error.

    One colour for each work, one mark for each method; certified sweeps for all numbers of
    poses, which stand beside the first of them. The dashed line is the rounding unit.
    """
    beside = [record["n"] for record in records if record["method"] != "certified"]
    n = max(beside or [record["n"] for record in records])
    marked = {
        method: MARKS[method] for method in MARKS if any(r["method"] == method for r in records)
    }
    figure = Figure(figsize=(7.0, 4.6), dpi=style.DPI, facecolor=style.PAPER)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.1, 0.12, 0.64, 0.76))
    works = list(dict.fromkeys(record["work"] for record in records))
    for colour, work in zip(COLOURS, works, strict=False):
        for method, mark in marked.items():
            certified = method == "certified"
            chosen = [
                r
                for r in records
                if r["work"] == work and r["method"] == method and (r["n"] == n or certified)
            ]
            if not chosen:
                continue
            chosen.sort(key=lambda record: record["n" if certified else "error"])
            axes.loglog(
                [max(record["error"], SMALLEST) for record in chosen],
                [record["ratio"] for record in chosen],
                marker=mark,
                markersize=7 if certified else 5,
                markerfacecolor=colour if certified else style.PAPER,
                color=colour,
                linewidth=style.THIN,
            )
            if certified and work == works[0]:
                for record in chosen:
                    axes.annotate(
                        f"{record['n']:,}",
                        (max(record["error"], SMALLEST), record["ratio"]),
                        (-7, 0),
                        textcoords="offset points",
                        ha="right",
                        va="center",
                        fontsize=7,
                        color=style.FAINT,
                    )
    axes.set_xlim(2e-18, None)
    axes.axvline(2.0**-52, color=style.FAINT, linewidth=style.THIN, linestyle=(0, (4, 2.5)))
    axes.axhline(1.0, color=style.FAINT, linewidth=style.THIN, linestyle=(0, (4, 2.5)))
    axes.set_xlabel("largest error of an unknown [rad, lengths of the mechanism]")
    axes.set_ylabel("time / closed-form four-bar in NumPy")
    axes.grid(True, which="major", color=style.GHOST, linewidth=0.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.set_title(
        f"Speed against error, {n} poses", loc="left", color=style.INK, fontsize=11, pad=12
    )
    shared = {"frameon": False, "fontsize": 8, "borderaxespad": 0, "alignment": "left"}
    lines = [Line2D([], [], color=c, label=work) for c, work in zip(COLOURS, works, strict=False)]
    first = axes.legend(handles=lines, loc="upper left", bbox_to_anchor=(1.03, 1.0), **shared)
    axes.add_artist(first)
    marks = [
        Line2D([], [], color=style.INK, marker=mark, linestyle="", label=WORDS[method])
        for method, mark in marked.items()
    ]
    for handle in marks[1:]:
        handle.set_markerfacecolor(style.PAPER)
    axes.legend(handles=marks, loc="upper left", bbox_to_anchor=(1.03, 0.72), **shared)
    return axes


WORDS = {
    "certified": "certified sweep,\nrates and bounds",
    "interpolated": "interpolated,\npositions only",
    "rootfinder": "casadi rootfinder,\npositions only",
}

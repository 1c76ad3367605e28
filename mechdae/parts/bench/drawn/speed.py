"""Speed against error: records of `mechdae bench`, and of other methods, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from mechdae.draw import style

if TYPE_CHECKING:
    from mechdae.types import Json

OURS, SLOWEST = "md.Solver", "rootfinder"
"""What is drawn for all numbers of poses, and what tells at which others are drawn."""
MARKS = {
    OURS: "o", "closed form in C": "D", "pylinkage": "v", "scipy fsolve": "P",
    "interpolated": "s", SLOWEST: "^",
}  # fmt: skip
COLOURS = ("#0072b2", "#d55e00", "#007a5a", "#8a4f7d", "#56b4e9", "#5f6b76")
SMALLEST = 1e-17
BESIDE: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7, "color": style.FAINT}
"""Look of numbers beside marks."""
KEY: dict[str, Any] = {"frameon": False, "fontsize": 8, "borderaxespad": 0, "alignment": "left"}
WAYS = {
    "mechdae": ("o", "#0072b2"),
    "scipy DOP853": ("s", "#d55e00"),
    "scipy DOP853, events": ("s", "#d55e00"),
    "scipy Radau": ("D", "#d55e00"),
    "CVODES Adams": ("^", "#007a5a"),
    "CVODES BDF": ("v", "#007a5a"),
    "IDAS": ("<", "#8a4f7d"),
    "IDAS, index 1": (">", "#8a4f7d"),
}
"""Mark and colour of each method; those of one library share the colour."""
WIDE = 30.0
"""Times that span so much are marked at powers of ten, others at 2 and 5 times these too."""


def empty(height: float, low: float, width: float) -> Axes:
    """Return axes of a new figure with room for a key on the right."""
    figure = Figure(figsize=(7.0, height), dpi=style.DPI, facecolor=style.PAPER)
    FigureCanvasAgg(figure)
    return figure.add_axes((0.1, low, width, 0.76))


def written(axes: Axes, title: str, across: str, up: str) -> None:
    """Write title and labels, draw the grid."""
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.grid(True, which="major", color=style.GHOST, linewidth=0.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.set_title(title, loc="left", color=style.INK, fontsize=11, pad=12)


def draw(records: Sequence[Json]) -> Axes:
    """Return axes with time, as a ratio to the yardstick, over the largest error.

    One colour for each work, one mark for each method; warm calls of a solver for all numbers of
    poses, which stand beside the first of them. The dashed line is the rounding unit.
    """
    beside = [record["n"] for record in records if record["method"] == SLOWEST]
    n = max(beside or [record["n"] for record in records])
    marked = {
        method: MARKS[method]
        for method in MARKS
        if any(r["method"] == method and (r["n"] == n or method == OURS) for r in records)
    }
    axes = empty(4.6, 0.12, 0.64)
    works = list(dict.fromkeys(record["work"] for record in records))
    for colour, work in zip(COLOURS, works, strict=False):
        for method, mark in marked.items():
            certified = method == OURS
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
                    place = (max(record["error"], SMALLEST), record["ratio"])
                    look = {**BESIDE, "ha": "right", "va": "center"}
                    axes.annotate(f"{record['n']:,}", place, (-7, 0), **look)
    axes.set_xlim(2e-18, None)
    axes.axvline(2.0**-52, color=style.FAINT, linewidth=style.THIN, linestyle=(0, (4, 2.5)))
    axes.axhline(1.0, color=style.FAINT, linewidth=style.THIN, linestyle=(0, (4, 2.5)))
    across = "largest error of an unknown [rad, lengths of the mechanism]"
    up = "time / closed-form four-bar in NumPy"
    written(axes, f"Speed against error, {n} poses", across, up)
    lines = [Line2D([], [], color=c, label=work) for c, work in zip(COLOURS, works, strict=False)]
    first = axes.legend(handles=lines, loc="upper left", bbox_to_anchor=(1.03, 1.0), **KEY)
    axes.add_artist(first)
    marks = [
        Line2D([], [], color=style.INK, marker=mark, linestyle="", label=WORDS[method])
        for method, mark in marked.items()
    ]
    for handle in marks[1:]:
        handle.set_markerfacecolor(style.PAPER)
    axes.legend(handles=marks, loc="upper left", bbox_to_anchor=(1.03, 0.72), **KEY)
    return axes


WORDS = {
    OURS: "warm md.Solver,\nrates and bounds",
    "closed form in C": "closed form in C,\nrates",
    "pylinkage": "pylinkage",
    "scipy fsolve": "scipy fsolve,\npositions only",
    "interpolated": "interpolated,\npositions only",
    SLOWEST: "casadi rootfinder,\npositions only",
}


def draw_precision(records: Sequence[dict[str, Any]]) -> Axes:
    """Return axes with time, as a ratio to the yardstick, over the error at the end.

    One line for each method, one mark for each tolerance, which stands beside those of the
    package. Lower and further left is better.
    """
    axes = empty(4.2, 0.13, 0.66)
    handles = []
    for method, (mark, colour) in WAYS.items():
        of_method = [r for r in records if r["method"] == method]
        if not of_method:
            continue
        of_method.sort(key=lambda record: -record["tolerance"])
        first = method == "mechdae"
        look: dict[str, Any] = {
            "marker": mark,
            "markersize": 7 if first else 5,
            "markerfacecolor": colour if first else style.PAPER,
            "color": colour,
            "linewidth": 1.6 if first else style.THIN,
        }
        errors = [max(record["error"], SMALLEST) for record in of_method]
        axes.loglog(errors, [record["ratio"] for record in of_method], **look)
        handles.append(Line2D([], [], label=method, **look))
        if first:
            for record, error in zip(of_method, errors, strict=True):
                text = f"{record['tolerance']:.0e}".replace("e-0", "e-")
                place, beside = (error, record["ratio"]), {**BESIDE, "ha": "center", "va": "top"}
                axes.annotate(text, place, (0, -8), **beside)
    axes.margins(y=0.12)
    low, high = axes.get_ylim()
    steps = (1.0,) if high > WIDE * low else (1.0, 2.0, 5.0)
    axes.yaxis.set_major_locator(LogLocator(subs=steps))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    across = "error at the end [natural sizes: rad, lengths of the mechanism]"
    up = "time / closed-form four-bar in NumPy, 10 000 poses"
    written(axes, f"Work against precision, {records[0]['work']}", across, up)
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.02, 1.0), **KEY)
    return axes

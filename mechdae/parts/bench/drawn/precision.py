"""Work against precision of integrators: records of `mechdae bench` of a motion as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from mechdae.draw import style
from mechdae.parts.bench.drawn.speed import BESIDE, KEY, SMALLEST, empty, written

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


def draw(records: Sequence[dict[str, Any]]) -> Axes:
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

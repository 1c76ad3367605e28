"""The front of a synthesis: its designs over their objectives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from mechdae.draw import style
from mechdae.draw.designs.drawn_design import SEPARATOR
from mechdae.draw.figure import note
from mechdae.draw.fonts import font
from mechdae.draw.graphs.frame import Panels
from mechdae.draw.graphs.scale import number, scale_of
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.types import Json, Points

if TYPE_CHECKING:
    from mechdae.results import SynthesisResult


WIDE = 30.0
"""Ratio of largest to least value from which an axis is logarithmic."""
ROOM = 0.08
"""Room around the points, as a share of the axis."""
NUMBERED = 20
"""Points that have their numbers; of more, every second or third."""


def draw(result: SynthesisResult, ax: Axes | None = None, *, lang: str = "en") -> Axes:
    """Draw the points of a front, numbered as the designs are, with what they dominate.

    Of three objectives the second and the third over the first. Returns the upper panel.

    Raises
    ------
    InputError
        The synthesis has no front.
    """
    words = Words(lang)
    front = result.summary.get("front")
    if front is None:
        raise InputError(
            "there is no front in this result", hint="objectives = [...] in the task of synthesis"
        )
    values = np.array(front["points"], float)
    facts = [
        words("front of", len(values)),
        words("hypervolume", words.number(front["hypervolume"], 4)),
    ]
    pairs = [(0, k) for k in range(1, values.shape[1])]
    height = 300.0 if len(pairs) == 1 else 210.0 * len(pairs)
    frame = Panels(ax, len(pairs), result, SEPARATOR.join(facts), height=height)
    for panel, (i, j) in zip(frame.panels, pairs, strict=True):
        _pair(frame, panel, result, front["objectives"], values, (i, j), len(pairs) == 1)
    return frame.panels[0]


def _pair(
    frame: Panels, panel: Axes, result: Any, objectives: Sequence[Mapping[str, str]],
    values: Points, pair: tuple[int, int], alone: bool,
) -> None:  # fmt: skip
    """Draw one objective over another; the stairs are the edge of what two of them dominate."""
    k = frame.k
    scales = [scale_of(objectives[m]["unit"], [values[:, m]], result.units) for m in pair]
    x, y = (scale(values[:, m]) for scale, m in zip(scales, pair, strict=True))
    logs = [frame.limits(panel, row, (ROOM, ROOM), way, WIDE) for way, row in (("x", x), ("y", y))]
    if alone:
        steps: Any = "post" if objectives[pair[0]]["sense"] == "least" else "pre"
        order = np.argsort(x, kind="stable")
        edge = {"linewidth": 0.8, "drawstyle": f"steps-{steps}", "zorder": 2}
        frame.line(panel, "front-edge", x[order], y[order], color=style.SERIES[0], **edge)
    look: Json = {"linestyle": "", "marker": "o", "markersize": 5.0, "color": style.SERIES[0]}
    look |= {"markeredgecolor": style.PAPER, "markeredgewidth": 0.7}
    frame.line(panel, "front", x, y, **look)
    every, small = -(-len(x) // NUMBERED), font(7.0 * k, style.NOTE_FONT)
    for n in range(0, len(x), every):
        spot, offset, gid = (x[n], y[n]), (5.0 * k, 4.0 * k), f"front-{n + 1}"
        note(panel, str(n + 1), spot, offset, small, style.FAINT, gid=gid)
    for axis, log, coordinate in zip("xy", logs, (x, y), strict=True):
        if log and coordinate.max() < 1e3 * coordinate.min():
            panel.minorticks_off()
            ticks = np.geomspace(coordinate.min(), coordinate.max(), 4)
            getattr(panel, f"set_{axis}ticks")(ticks, [number(tick, 2) for tick in ticks])
    labels = (each.named(objectives[m]["name"]) for m, each in zip(pair, scales, strict=True))
    frame.label(panel, *labels)

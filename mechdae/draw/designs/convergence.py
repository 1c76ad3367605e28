"""How the starts of a synthesis ended: the objective of each, the best so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from mechdae.draw import style
from mechdae.draw.designs.drawn_design import (
    class_name,
    headed,
    mark_of,
    objective_text,
    runs_of,
    sense_of,
)
from mechdae.draw.diagram.scene import Array
from mechdae.draw.graphs.frame import Entry, Panels
from mechdae.draw.style import color_of
from mechdae.draw.words import Words

DECADES = 30.0
"""Ratio of largest to least objective from which the axis is logarithmic."""
FAILED = 0.965
"""Height of the marks of starts that failed, as a share of the panel."""
HEIGHT = 270.0
BEST: dict[str, Any] = {"color": style.INK, "linewidth": 1.2}
CROSS: dict[str, Any] = {
    "marker": "x", "color": style.ARROW, "linestyle": "", "markersize": 5.5,
}  # fmt: skip


def draw(result: Any, ax: Axes | None = None, *, lang: str = "en") -> Axes:
    """Draw the objective of each start against its number, and the best so far.

    Raises
    ------
    InputError
        No start was made.
    """
    words = Words(lang)
    runs = runs_of(result)
    values = np.array(
        [np.nan if run["objective"] is None else run["objective"] for run in runs], float
    )
    there = np.isfinite(values)
    facts = [words("starts", len(runs)), words("met", int(there.sum()))]
    frame = headed(result, ax, facts, _key(runs, there, words), HEIGHT)
    panel = frame.panels[0]
    panel.set_xlim(0.3, len(runs) + 0.7)
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    if there.any():
        _limits(panel, values[there])
    else:
        panel.set_yticks([])
    _starts(frame, runs, values, (np.fmin if sense_of(result) > 0 else np.fmax))
    frame.label(panel, words("start"), objective_text(result, words) if there.any() else None)
    return panel


def _key(runs: Sequence[Mapping[str, Any]], there: Any, words: Words) -> list[Entry]:
    """Return the classes that met all constraints, the best so far, the starts that did not."""
    met = {run["class"] for run, known in zip(runs, there, strict=True) if known}
    classes = dict.fromkeys(run["class"] for run in runs)
    key = [
        Entry(class_name(name, words), line=_mark(k))
        for k, name in enumerate(classes)
        if name != "any" and name in met
    ]
    if there.any():
        key.append(Entry(words("best so far"), line=BEST))
    if not there.all():
        key.append(Entry(words("not met", int((~there).sum())), line=CROSS))
    return key


def _starts(frame: Panels, runs: Sequence[Mapping[str, Any]], values: Array, better: Any) -> None:
    """Draw the starts by their classes, the best so far, and those that failed above them."""
    panel = frame.panels[0]
    numbers, there = np.arange(1, len(runs) + 1), np.isfinite(values)
    if there.any():
        best = better.accumulate(values)
        frame.line(panel, "best", numbers, best, drawstyle="steps-post", zorder=2, **BEST)
    for index, name in enumerate(dict.fromkeys(run["class"] for run in runs)):
        own = there & np.array([run["class"] == name for run in runs])
        if own.any():
            frame.line(panel, f"starts-{name}", numbers[own], values[own], **_mark(index))
    if not there.all():
        lost = numbers[~there]
        height, above = np.full(len(lost), FAILED), panel.get_xaxis_transform()
        frame.line(panel, "failed", lost, height, transform=above, **CROSS)


def _mark(index: int) -> dict[str, Any]:
    color = color_of(index)
    return {
        "marker": mark_of(index),
        "color": color,
        "linestyle": "",
        "markersize": 5.0,
        "markerfacecolor": style.PAPER,
        "markeredgecolor": color,
        "markeredgewidth": 1.3,
    }


def _limits(panel: Axes, values: Array) -> None:
    """Set a logarithmic axis where values span decades, with room for the marks above."""
    low, high = float(values.min()), float(values.max())
    if low > 0 and high > DECADES * low:
        panel.set_yscale("log")
        span = np.log10(high / low)
        panel.set_ylim(low / 10 ** (0.06 * span), high * 10 ** (0.14 * span))
        return
    span = (high - low) or abs(high) or 1.0
    panel.set_ylim(low - 0.08 * span, high + 0.16 * span)

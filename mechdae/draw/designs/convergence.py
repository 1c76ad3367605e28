"""How the starts of a synthesis ended: the objective of each, the best so far."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from mechdae.draw import style
from mechdae.draw.designs.found import class_name, objective_text, sense_of, title_of
from mechdae.draw.graphs.frame import Entry, Panels
from mechdae.draw.words import Words
from mechdae.errors import InputError

DECADES = 30.0
"""Ratio of largest to least objective from which the axis is logarithmic."""
MARKS = ("o", "s", "^", "D", "v", "P", "X")
FAILED = 0.965
"""Height of the marks of starts that failed, as a share of the panel."""
HEIGHT = 270.0


def draw(result: Any, ax: Axes | None = None, *, lang: str = "en") -> Axes:
    """Draw the objective of each start against its number, and the best so far.

    Parameters
    ----------
    result
        What a task of kind synthesis gave.
    ax
        Axes to draw in; without it those of a new figure.
    lang
        Language of the words, "en" or "ru".

    Returns
    -------
    matplotlib.axes.Axes
        The axes.

    Raises
    ------
    InputError
        The result is of no synthesis, or no start was made.
    """
    words = Words(lang)
    runs = result.summary["runs"]
    if not runs:
        raise InputError(result.fault or "no start was made", hint="other bounds of what is free")
    numbers = np.arange(1, len(runs) + 1)
    values = np.array(
        [np.nan if run["objective"] is None else run["objective"] for run in runs], float
    )
    there = np.isfinite(values)
    classes = list(dict.fromkeys(run["class"] for run in runs))
    key = [
        Entry(class_name(name, words), line=_mark(k))
        for k, name in enumerate(classes)
        if name != "any"
        and any(run["class"] == name and run["objective"] is not None for run in runs)
    ]
    stair = {"color": style.INK, "linewidth": 1.2}
    cross: dict[str, Any] = {
        "marker": "x",
        "color": style.ARROW,
        "linestyle": "",
        "markersize": 5.5,
    }
    if there.any():
        key.append(Entry(words("best so far"), line=stair))
    if not there.all():
        key.append(Entry(words("not met", int((~there).sum())), line=cross))
    facts = [words("starts", len(runs)), words("met", int(there.sum()))]
    frame = Panels(ax, 1, title_of(result), "  ·  ".join(facts), key, height=HEIGHT)
    panel, k = frame.panels[0], frame.k
    panel.set_xlim(0.3, len(runs) + 0.7)
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    found = values[there]
    if there.any():
        _limits(panel, found)
        best = (np.fmin if sense_of(result) > 0 else np.fmax).accumulate(values)
        panel.step(
            numbers, best, where="post", color=style.INK, linewidth=1.2 * k, gid="best", zorder=2
        )
    else:
        panel.set_yticks([])
    for index, name in enumerate(classes):
        own = there & np.array([run["class"] == name for run in runs])
        if own.any():
            options = _mark(index)
            options["markersize"] *= k
            panel.plot(numbers[own], values[own], **options, zorder=3, gid=f"starts-{name}")
    if not there.all():
        lost = numbers[~there]
        cross["markersize"] = 5.5 * k
        panel.plot(
            lost,
            np.full(len(lost), FAILED),
            transform=panel.get_xaxis_transform(),
            zorder=3,
            gid="failed",
            **cross,
        )
    frame.label(panel, words("start"), objective_text(result, words) if there.any() else None)
    return panel


def _mark(index: int) -> dict[str, Any]:
    color = style.SERIES[index % len(style.SERIES)]
    return {
        "marker": MARKS[index % len(MARKS)],
        "color": color,
        "linestyle": "",
        "markersize": 5.0,
        "markerfacecolor": style.PAPER,
        "markeredgecolor": color,
        "markeredgewidth": 1.3,
    }


def _limits(panel: Axes, found: Any) -> None:
    """Set a logarithmic axis where values span decades, with room for the marks above."""
    low, high = float(found.min()), float(found.max())
    if low > 0 and high > DECADES * low:
        panel.set_yscale("log")
        span = np.log10(high / low)
        panel.set_ylim(low / 10 ** (0.06 * span), high * 10 ** (0.14 * span))
        return
    span = (high - low) or abs(high) or 1.0
    panel.set_ylim(low - 0.08 * span, high + 0.16 * span)

"""The starts of a synthesis: how each ended, its optima with their hits, why some are rejected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, MaxNLocator

from mechdae.draw import style
from mechdae.draw.designs.drawn_design import (
    SEPARATOR,
    class_name,
    mark_of,
    objective_text,
    runs_of,
    sense_of,
)
from mechdae.draw.designs.targets import MARK
from mechdae.draw.diagram.heads import fitted
from mechdae.draw.figure import note
from mechdae.draw.fonts import plain
from mechdae.draw.graphs.frame import Entry, Panels, shaded
from mechdae.draw.primitives import Array
from mechdae.draw.style import color_of
from mechdae.draw.words import Words
from mechdae.records import dataclass
from mechdae.results.kinds import SynthesisResult
from mechdae.types import Json

SAME = 1e-5
"""Share by which objectives of one optimum may differ, as in the search."""
MOST = 14
"""Rows that are drawn; what is left is counted in one more."""
ROW = 20.0
"""Height of a row [pt]."""
BARS = 0.3
"""Share of the width that bars take where reasons stand beside them."""
THICK = 0.62
REJECTED, LOST = "////", "xxxx"
"""Hatching of what its sweep rejected, and of starts that reached no optimum."""


@dataclass(frozen=True)
class Bar:
    """One bar: what it is ("design", "rejected", "further", "failed"), and what it says."""

    what: str
    label: str
    kind: str
    hits: int
    text: str


def draw_census(result: SynthesisResult, ax: Axes | None = None, *, lang: str = "en") -> Axes:
    """Draw the distinct optima of a synthesis, best first, with the starts that ended there.

    Designs are filled in the colour of their class; optima that their sweep rejected are
    hatched, with the first reason; those that are not reported, being too far from the best, are
    empty. The last rows are the starts that reached no optimum, by the word of the solver.

    Raises
    ------
    InputError
        No start was made.
    """
    words = Words(lang)
    summary, runs = result.summary, runs_of(result)
    rows = rows_of(result, words)
    classes = list(dict.fromkeys(run["class"] for run in runs))
    shown = {row.kind for row in rows}
    designs = result.data["designs"]
    lost = len(summary["rejected"]) + sum(bool(design.get("defects")) for design in designs)
    if "solutions" in summary:
        lost = summary["solutions"] - sum(not design.get("defects") for design in designs)
        facts = [words("census solutions", summary["solutions"], lost)]
    else:
        facts = [words("census", summary["starts"], summary["distinct"], lost)]
    if not designs:
        facts.insert(0, words("none found"))
    facts.append(objective_text(result, words))
    colours = {name: color_of(k) for k, name in enumerate(classes)}
    named = [name for name in classes if name in shown and name != "any"]
    key = [Entry(class_name(name, words), area=(colours[name],) * 2 + ("",)) for name in named]
    used = {row.what for row in rows}
    samples = {
        "rejected": (style.PAPER, style.INK, REJECTED),
        "failed": (style.GHOST, style.FAINT, LOST),
    }
    key += [Entry(words(word), area=sample) for word, sample in samples.items() if word in used]
    height = ROW * len(rows) + 10.0
    frame = Panels(ax, 1, result, SEPARATOR.join(facts), key, height=height)
    panel = frame.panels[0]
    _draw(frame, panel, rows, colours)
    frame.label(panel, words("hits"))
    return panel


def rows_of(result: SynthesisResult, words: Words) -> list[Bar]:
    """Return the rows of the census, best first; the hits of all add up to the starts."""
    summary, designs = result.summary, result.data["designs"]

    kinds = {run["class"] for run in summary["runs"] if run["objective"] is not None}

    def said(value: float, hits: int, kind: str, *more: str) -> str:
        counted = words("hit of") if hits == 1 else words("hits of", hits)
        named = [class_name(kind, words)] if len(kinds) > 1 else []
        return SEPARATOR.join([words.number(value, 4), counted, *named, *more])

    rows = []
    for k, design in enumerate(designs, 1):
        kind, hits, defects = design.get("class", "any"), design["hits"], design.get("defects", ())
        text = said(design["objective"], hits, kind, *defects[:1])
        rows.append(Bar("rejected" if defects else "design", str(k), kind, hits, text))
    clusters = clusters_of(summary["runs"], sense_of(result))
    looked = len(designs) + len(summary["rejected"])
    # exact designs share the objective zero, which tells nothing about their starts
    exact = all(value == 0.0 for value, _, _ in clusters)
    ranked: list[tuple[float, Bar]] = []
    rest = list(clusters)
    for rejection in summary["rejected"]:
        value, kind, hits = _nearest(rest, rejection["objective"])
        hits = 1 if exact else hits
        first, *more = rejection["reasons"]
        text = said(value, hits, kind, f"{first}; …" if more else first)
        ranked.append((value, Bar("rejected", "\N{MULTIPLICATION SIGN}", kind, hits, text)))
    for value, kind, hits in () if exact else clusters[looked:]:
        text = said(value, hits, kind, words("not reported"))
        ranked.append((value, Bar("further", "", kind, hits, text)))
    ranked.sort(key=lambda entry: entry[0] * sense_of(result))
    rows += [row for _, row in ranked]
    if len(rows) > MOST:
        left = rows[MOST - 1 :]
        hits = sum(row.hits for row in left)
        rows = [*rows[: MOST - 1], Bar("further", "…", "any", hits, words("more", len(left)))]
    lost = Counter(run["status"] for run in summary["runs"] if run["objective"] is None)
    for status, count in lost.most_common():
        text = f"{count}:  {status_text(status, words)}"
        rows.append(Bar("failed", "\N{EM DASH}", "any", count, text))
    return rows


def clusters_of(runs: Sequence[Mapping[str, Any]], sense: int) -> list[tuple[float, str, int]]:
    """Return objective, class and hits of the distinct optima, best first."""
    found = [(run["objective"], run["class"]) for run in runs if run["objective"] is not None]
    result: list[tuple[float, str, int]] = []
    for value, kind in sorted(found, key=lambda entry: entry[0] * sense):
        if result and abs(value - result[-1][0]) <= SAME * abs(result[-1][0]):
            best, first, hits = result[-1]
            result[-1] = best, first, hits + 1
        else:
            result.append((value, kind, 1))
    return result


def status_text(status: str, words: Words) -> str:
    """Return what the solver's word for a start that failed means."""
    known = "Infeasible_Problem_Detected", "Maximum_Iterations_Exceeded", "Restoration_Failed"
    return words(status) if status in known else status.replace("_", " ").lower()


def _nearest(clusters: list[tuple[float, str, int]], value: float) -> tuple[float, str, int]:
    """Return the optimum nearest to an objective, and take it out of the list."""
    nearest = min(clusters, key=lambda row: abs(row[0] - value), default=None)
    if nearest is None:
        return value, "any", 1
    clusters.remove(nearest)
    return value, *nearest[1:]


def _draw(frame: Panels, panel: Axes, rows: Sequence[Bar], colours: Mapping[str, str]) -> None:
    k = frame.k
    most = max(row.hits for row in rows)
    panel.set_xlim(0.0, most / BARS)
    panel.set_ylim(len(rows) - 0.4, -0.6)
    panel.grid(False, axis="y")
    for place, row in enumerate(rows):
        color = colours.get(row.kind, style.FAINT) if row.what != "failed" else style.FAINT
        face = {"design": color, "failed": style.GHOST}.get(row.what, style.PAPER)
        hatch = {"rejected": REJECTED, "failed": LOST}.get(row.what, "")
        look = shaded((face, color, hatch)) | {"linewidth": style.LINE * k}
        panel.barh(place, row.hits, THICK, zorder=3, gid=f"{row.what}-{place + 1}", **look)
        share = row.hits / (most / BARS)
        room = (1.0 - share) * frame.box[2] - 8.0 * k
        text, chosen = fitted(row.text, style.TICK * k, room, style.NOTE_FONT)
        more = {"va": "center_baseline", "gid": f"text-{place + 1}"}
        note(panel, plain(text), (row.hits, place), (5.0 * k, 0.0), chosen, style.INK, **more)
    panel.set_yticks(range(len(rows)), [row.label for row in rows])
    ticks = MaxNLocator(nbins=5, integer=True).tick_values(0, most)
    panel.xaxis.set_major_locator(FixedLocator([t for t in ticks if 0 <= t <= most]))


DECADES = 30.0
"""Ratio of largest to least objective from which the axis is logarithmic."""
ROOM = (0.08, 0.16)
"""Room below the objectives, and above them for the marks of what failed, as shares."""
FAILED = 0.965
"""Height of the marks of starts that failed, as a share of the panel."""
HEIGHT = 270.0
BEST: Json = {"color": style.INK, "linewidth": 1.2}
CROSS: Json = {
    "marker": "x", "color": style.ARROW, "linestyle": "", "markersize": 5.5,
}  # fmt: skip


def draw_convergence(result: Any, ax: Axes | None = None, *, lang: str = "en") -> Axes:
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
    key = _key(runs, there, words)
    frame = Panels(ax, 1, result, SEPARATOR.join(facts), key, height=HEIGHT)
    panel = frame.panels[0]
    panel.set_xlim(0.3, len(runs) + 0.7)
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    if there.any():
        frame.limits(panel, values[there], ROOM, decades=DECADES)
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
        chosen = there & np.array([run["class"] == name for run in runs])
        if chosen.any():
            frame.line(panel, f"starts-{name}", numbers[chosen], values[chosen], **_mark(index))
    if not there.all():
        lost = numbers[~there]
        height, above = np.full(len(lost), FAILED), panel.get_xaxis_transform()
        frame.line(panel, "failed", lost, height, transform=above, **CROSS)


def _mark(index: int) -> Json:
    color = color_of(index)
    look = {"marker": mark_of(index), "color": color, "markeredgecolor": color}
    return MARK | look

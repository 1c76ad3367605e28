"""A path, its targets as numbered rings, and the errors: in a diagram, or enlarged in a graph."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.describe.units import Units
from mechdae.draw import style
from mechdae.draw.diagram.heads import nice_length
from mechdae.draw.fonts import font, ink
from mechdae.draw.graphs.frame import Panels, Places
from mechdae.draw.graphs.scale import scale_of
from mechdae.draw.labels.layout import around, cheapest
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, arc, unit
from mechdae.draw.words import Words
from mechdae.records import dataclass
from mechdae.types import Json

RING, DOT = 3.0, 1.2
"""Radius of a target, and of one that is also drawn enlarged elsewhere."""
LONGEST = 15.0
"""Length that errors are enlarged to, at most."""
APART = 0.6
"""The same as a share of the usual distance between targets."""
ENOUGH = 0.7
"""Errors longer than this share of it are drawn as they are."""
NOISE = 1e-7
"""Errors below this share of the targets' spread are none."""
POINTER = 13.0
"""Length of the line that gives the direction of a pose."""
NEAR = 2.5
"""Distance of numbers from what they keep off."""


@dataclass(frozen=True)
class Targets:
    """Where a point or a body is to be, and where it is.

    Attributes
    ----------
    wanted, reached
        (k, 2) [m].
    angles
        Of poses of a body, else None.
    """

    wanted: Array
    reached: Array
    angles: Array | None = None


def draw_path(sheet: Sheet, places: Array, gid: str, width: float = style.BAR * 0.75) -> None:
    """Draw the path of a point over the whole sweep."""
    points = sheet.at(places)
    sheet.line(points, color=style.WHEEL, width=width, z=style.Z_GROUND, gid=gid, weight=0.0)
    sheet.keep(points[::3], style.PATH)


def draw_dots(sheet: Sheet, targets: Targets) -> None:
    """Draw targets so small that they do not hide the path."""
    for k, place in enumerate(sheet.at(targets.wanted)):
        gid, color = f"target-{k + 1}", style.ARROW
        sheet.circle(place, DOT, fill=color, edge=color, gid=gid, weight=style.PATH)


def enlarged(factor: float, words: Words) -> str:
    """Return what targets look like and how errors are enlarged."""
    note = f"\N{WHITE CIRCLE} {words('target')}"
    return f"{note}, {words('errors enlarged', words.number(factor))}" if factor > 1 else note


def draw_targets(sheet: Sheet, targets: Targets, words: Words) -> str:
    """Draw rings with numbers and the lines of the errors; return their scale in words."""
    wanted = sheet.at(targets.wanted)
    gaps = sheet.at(targets.reached) - wanted
    factor = enlargement(gaps, wanted)
    for k, (place, gap) in enumerate(zip(wanted, gaps, strict=True)):
        sheet.circle(place, RING, fill=style.PAPER, edge=style.ARROW, gid=f"target-{k + 1}")
        if targets.angles is not None:
            along = np.array([np.cos(targets.angles[k]), np.sin(targets.angles[k])])
            ends = [place + RING * along, place + POINTER * along]
            sheet.line(ends, color=style.ARROW, gid=f"direction-{k + 1}")
        if factor:
            ends, width, gid = [place, place + factor * gap], 1.5 * style.LINE, f"error-{k + 1}"
            sheet.line(
                ends, color=style.ARROW, width=width, z=style.Z_PIN, gid=gid, weight=style.PATH
            )
    _number(sheet, wanted)
    return enlarged(factor, words)


def enlargement(gaps: Array, places: Array) -> float:
    """Return how many times errors on the sheet are enlarged; 0 where there are none."""
    sizes = np.hypot(*gaps.T)
    longest = float(sizes[np.isfinite(sizes)].max(initial=0.0))
    if longest <= NOISE * float(np.ptp(places, axis=0).max()):
        return 0.0
    usual = float(np.median(np.hypot(*np.diff(places, axis=0).T)))
    most = min(LONGEST, max(APART * usual, 2.0 * RING))
    if longest >= ENOUGH * most:
        return 1.0
    return max(nice_length(most / longest), 1.0)


def _number(sheet: Sheet, places: Array) -> None:
    """Write numbers beside the targets, where they cover nothing."""
    chosen = font(style.NUMBER, style.NOTE_FONT)
    centre = places.mean(axis=0)
    for k, place in enumerate(places):
        text = str(k + 1)
        low, high = ink(text, chosen)
        out = unit(place - centre) if (place != centre).any() else np.array([0.0, 1.0])
        width, height = (high - low).tolist()
        label = around(place, width, height, RING + 2.5, out, (0.0, 3.5))
        spots = label.places[np.argsort(label.costs, kind="stable")]
        _write(sheet, spots, (high - low) / 2, text, f"target-number-{k + 1}")


def _write(sheet: Sheet, spots: Array, half: Array, text: str, gid: str) -> None:
    """Write a text at the first of some places where it covers least."""
    obstacles = Obstacles(*sheet.obstacles(), sheet.size)
    spot = spots[cheapest(spots, half + NEAR, obstacles)]
    sheet.text(spot, text, font(style.NUMBER, style.NOTE_FONT), style.ARROW, gid)
    sheet.box(spot - half - 1.0, spot + half + 1.0)


def draw_swing(
    sheet: Sheet, pivot: Array, ends: Sequence[Array], angles: Sequence[float], text: str
) -> None:
    """Draw the arc through which a link swings about its pivot, with the angle beside it."""
    centre = sheet.at(pivot)
    length = float(np.hypot(*(sheet.at(ends[0]) - centre)))
    radius = max(0.42 * length, 20.0)
    points = arc(centre, radius, angles[0], angles[1])
    sheet.line(points, color=style.ARROW, gid="swing", weight=style.PATH)
    chosen = font(style.NUMBER, style.NOTE_FONT)
    low, high = ink(text, chosen)
    half = (high - low) / 2
    turns = angles[0] + np.array([0.5, 0.35, 0.65, 0.2, 0.8]) * (angles[1] - angles[0])
    along = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    lift = (5.0 + np.abs(along) @ half)[:, None]
    spots = np.vstack([centre + along * (radius + sign * lift) for sign in (1.0, -1.0)])
    _write(sheet, spots, half, text, "swing-text")


ROOM = 26.0
"""Free border around paths [pt]."""
NUMBER = 13.0
"""Usual distance of a number from its target [pt]."""
FAR = 0.75
"""Paths are shown up to so many sizes of the targets beside them."""
MARK: Json = {
    "marker": "o",
    "linestyle": "",
    "markersize": 5.0,
    "markeredgewidth": 1.3,
    "markerfacecolor": style.PAPER,
    "markeredgecolor": style.INK,
}
"""Mark of a target."""


def draw_paths(
    frame: Panels, paths: Sequence[Array], looks: Sequence[Json], targets: Targets, units: Units,
    color: str = style.INK, errors: bool = False,
) -> float:  # fmt: skip
    """Draw paths and targets into the first panel; return how errors are enlarged.

    Parameters
    ----------
    paths, looks
        (n, 2) [m] each, with the options of its line.
    units
        Those that lengths are shown in.
    color
        Colour of the targets and their numbers.
    errors
        Whether lines for the errors are drawn.
    """
    scale, panel = scale_of("m", [targets.wanted], units), frame.panels[0]
    shown = [scale(path) for path in paths]
    wanted, reached = scale(targets.wanted), scale(targets.reached)
    everything = np.vstack([wanted, *shown])
    everything = everything[np.isfinite(everything).all(axis=1)]
    # paths that run far away do not shrink the targets
    most = FAR * float(np.ptp(wanted, axis=0).max())
    low = np.maximum(everything.min(axis=0), wanted.min(axis=0) - most)
    high = np.minimum(everything.max(axis=0), wanted.max(axis=0) + most)
    unit = frame.equal(panel, low, high, ROOM)
    places = Places(frame, panel)
    for number, (path, look) in enumerate(zip(shown, looks, strict=True), 1):
        frame.line(panel, f"path-{number}", *path.T, linewidth=1.5, **look)
        places.keep(*path.T)
    factor = enlargement((reached - wanted) / unit, wanted / unit) if errors else 0.0
    if factor:
        for number, (place, gap) in enumerate(zip(wanted, reached - wanted, strict=True), 1):
            ends = np.array([place, place + factor * gap])
            frame.line(panel, f"error-{number}", *ends.T, color=color, linewidth=1.5, zorder=4)
            places.keep(*ends.T)
    frame.line(panel, "targets", *wanted.T, zorder=5, **{**MARK, "markeredgecolor": color})
    for x, y in wanted:
        places.keep([x], [y])
    ways = _ways(wanted, unit * frame.k)
    for number, ((x, y), away) in enumerate(zip(wanted, ways, strict=True), 1):
        for way in away:
            if places.write(x, y, str(number), color, away=way):
                break
    frame.label(panel, scale.named("x"), scale.named("y"))
    return factor


def _ways(targets: Array, unit: float) -> list[list[tuple[float, float]]]:
    """Return the directions in which each target may have its number, outwards first.

    A number stands nearer to its own target than to another one.
    """
    middle = targets.mean(axis=0)
    found = []
    for k, target in enumerate(targets):
        gap = target - middle
        turns = np.arctan2(gap[1], gap[0]) + np.array([0.0, np.pi, 0.5 * np.pi, -0.5 * np.pi])
        ways = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        spots = target + NUMBER * unit * ways
        nearest = np.hypot(*np.moveaxis(spots[:, None] - targets, -1, 0)).argmin(axis=1)
        found.append([(*way.tolist(),) for way in ways[nearest == k]])
    return found

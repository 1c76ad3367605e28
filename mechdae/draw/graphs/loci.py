"""Curves in the plane with ticks of equal time: paths of points, hodographs, bearing loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from mechdae.draw import style
from mechdae.draw.graphs.abscissa import Abscissa, beyond_key
from mechdae.draw.graphs.frame import Entry, Panels, Places
from mechdae.draw.graphs.poles import Clip, clip_of, cuts, with_gaps
from mechdae.draw.graphs.scale import Scale, number
from mechdae.draw.graphs.series import Array
from mechdae.draw.smooth import few_named
from mechdae.records import dataclass
from mechdae.types import Floats, Integers

if TYPE_CHECKING:
    from mechdae.results import SweepResult


HEIGHT = 330.0
ROOM = 26.0
"""Free border around the curves [pt]."""
STEPS = (1, 2, 5, 10, 15, 20, 30, 45, 60, 90)
"""Steps of ticks [deg]."""
FEWEST, BEST = 8, 24
"""Ticks on a curve: at least, and as near to as can be."""
TICK = 3.4
"""Half length of a tick [pt]."""
ARROW = (7.5, 3.0)
EVEN = 1e-9


@dataclass(frozen=True)
class Locus:
    """A curve in the plane, (n, 2), with its name; in the units of the result."""

    name: str
    values: Array


@dataclass(frozen=True)
class Ticks:
    """Poses that have a tick, those that are named, and what lies between two of them."""

    poses: Any
    named: Integers
    step: str


def draw_loci(
    result: SweepResult, ax: Axes | None, loci: Sequence[Locus], axis: Abscissa, scale: Scale,
    words: tuple[str, str], *, title: str, subtitle: str, ticks: bool,
    pivots: Sequence[tuple[str, Floats]] = (), origin: bool = False, peaks: bool = False,
) -> Panels:  # fmt: skip
    """Draw curves with equal axes, ticks, arrows and fixed pivots, `peaks` with their size."""
    chosen = ticks_of(result, axis) if ticks and not few_named(result) else None
    key = [
        Entry(locus.name, line={**style.line_of(k), "linewidth": 1.5})
        for k, locus in enumerate(loci)
    ]
    if chosen is not None:
        key.append(Entry(chosen.step, line={"upright": True, "color": style.INK, "linewidth": 1.0}))
    clips = [_clips(axis, locus) for locus in loci]
    key += beyond_key(axis, [clip for pair in clips for clip in pair])
    frame = Panels(ax, 1, title, subtitle, key, height=HEIGHT)
    panel = frame.panels[0]
    point = _limits(frame, panel, loci, clips, scale, pivots, origin)
    frame.label(panel, *words)
    if origin:
        panel.axhline(0.0, color=style.FAINT, linewidth=0.6 * frame.k, zorder=1)
        panel.axvline(0.0, color=style.FAINT, linewidth=0.6 * frame.k, zorder=1)
    places = Places(frame, panel)
    for locus in loci:
        places.keep(*scale(locus.values).T)
    if origin:
        places.keep(np.array(panel.get_xlim()), np.zeros(2))
        places.keep(np.zeros(2), np.array(panel.get_ylim()))
    for k, locus in enumerate(loci):
        _draw(frame, panel, locus, scale, k, point, dots=few_named(result))
    for name, place in pivots:
        _pivot(frame, panel, places, name, scale(place), point)
    for k, locus in enumerate(loci if peaks else ()):
        _peak(frame, panel, places, locus, scale, k, axis)
    if chosen is not None:
        for k, locus in enumerate(loci):
            _ticks(frame, panel, places, locus, scale, k, point, chosen, axis)
    return frame


def ticks_of(result: SweepResult, axis: Abscissa) -> Ticks | None:
    """Return poses at equal steps of time, None where the poses are not even.

    A driver of constant speed goes through equal angles in equal times; the steps divide a
    turn well where the poses allow it.
    """
    values = axis.shown
    if len(values) < 3 or axis.kind not in ("driver", "time"):
        return None
    steps = np.diff(values)
    h = float(values[-1] - values[0]) / (len(values) - 1)
    if h == 0 or np.abs(steps - h).max() > EVEN * max(abs(values[-1]), abs(values[0]), abs(h)):
        return None
    count = len(values) - 1
    best = max(round(count / BEST), 1)
    if axis.is_angle:
        fits = [round(step / abs(h)) for step in STEPS]
        even = [
            k
            for k, step in zip(fits, STEPS, strict=True)
            if k >= 1 and abs(k * abs(h) - step) < 1e-6 and count / k >= FEWEST
        ]
        best = min(even, key=lambda k: abs(np.log(count / k / BEST)), default=best)
    poses = np.arange(0, len(values), best)
    whole = count % best == 0
    closed = axis.is_angle and abs(abs(values[-1] - values[0]) % 360.0) < 1e-6
    if whole and closed:
        poses = poses[:-1]
    every = max(round(len(poses) / 8), 1)
    if axis.is_angle:
        wide = [k for k in (1, 2, 3, 4, 6, 12) if len(poses) / k <= 12.5]
        every = wide[0] if wide else every
    return Ticks(poses, poses[::every], _step_text(result, axis, best * h))


def _step_text(result: SweepResult, axis: Abscissa, step: float) -> str:
    size = float(f"{abs(step):.6g}")
    if axis.kind == "time":
        return f"every {size:g} s"
    unit = "°" if axis.is_angle else f" {axis.scale.unit}" if axis.scale.unit else ""
    text = f"every {size:g}{unit} of {axis.label}"
    driver = result.drivers[axis.label]
    velocity = driver.get("velocity")
    if velocity is None or not len(velocity) or np.ptp(velocity) != 0 or velocity[0] == 0:
        return text
    acceleration = driver.get("acceleration")
    if acceleration is not None and np.any(acceleration):
        return text
    seconds = abs(step / axis.scale.factor / float(velocity[0]))
    return f"{text}, {seconds:.4g} s"


def _clips(axis: Abscissa, locus: Locus) -> tuple[Clip | None, Clip | None]:
    """Return the limits in x and y of a curve that runs through infinity."""
    if not axis.rises or len(axis.values) != len(locus.values):
        return None, None
    at = cuts(locus.values)
    x, y = (clip_of(axis.values, column, at) for column in locus.values.T)
    return x, y


def _within(locus: Locus, clips: tuple[Clip | None, Clip | None]) -> Array:
    """Return the places of a curve that lie within its limits."""
    inside = np.isfinite(locus.values).all(axis=1)
    for column, clip in zip(locus.values.T, clips, strict=True):
        if clip is not None:
            with np.errstate(invalid="ignore"):
                inside &= (column >= clip.low) & (column <= clip.high)
    return locus.values[inside]


def _limits(
    frame: Panels,
    panel: Axes,
    loci: Sequence[Locus],
    clips: Sequence[tuple[Clip | None, Clip | None]],
    scale: Scale,
    pivots: Sequence[tuple[str, Floats]],
    origin: bool,
) -> float:
    """Set equal scales on both axes; return the size of a point [unit shown]."""
    rows = [scale(_within(locus, clip)) for locus, clip in zip(loci, clips, strict=True)]
    rows += [np.atleast_2d(scale(place)) for _, place in pivots]
    rows += [np.zeros((1, 2))] if origin else []
    points = np.vstack(rows)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        points = np.zeros((1, 2))
    return frame.equal(panel, points.min(axis=0), points.max(axis=0), ROOM)


def _draw(
    frame: Panels, panel: Axes, locus: Locus, scale: Scale, k: int, point: float, dots: bool
) -> None:
    values = scale(locus.values)
    _, drawn = with_gaps(values[:, 0], values, cuts(values))
    look = style.line_of(k) | {"linewidth": 1.5}
    look |= {"linestyle": "", "marker": "o", "markersize": 3.0} if dots else {}
    frame.line(panel, f"locus-{locus.name}", *drawn.T, **look)
    for tip, along in () if dots else _arrows(values, point):
        length, half = ARROW[0] * frame.k * point, ARROW[1] * frame.k * point
        across = np.array([-along[1], along[0]])
        corners = [tip, tip - length * along + half * across, tip - length * along - half * across]
        head = Polygon(np.array(corners), closed=True, color=style.color_of(k), zorder=3.5, lw=0)
        panel.add_patch(head)
    there = np.flatnonzero(np.isfinite(values).all(axis=1))
    if there.size:
        first = values[there[0]]
        look = {"markerfacecolor": style.PAPER, "markeredgecolor": style.color_of(k)}
        look |= {"marker": "o", "markersize": 5.5, "linestyle": "", "zorder": 4}
        frame.line(panel, f"start-{locus.name}", first[:1], first[1:], **look)


def _arrows(values: Array, point: float) -> list[tuple[Array, Array]]:
    """Return places and directions of arrows, a quarter and three quarters along the curve."""
    whole = values[np.isfinite(values).all(axis=1)]
    if len(whole) < 3:
        return []
    steps = np.hypot(*np.diff(whole, axis=0).T)
    length = np.cumsum(steps)
    if length[-1] < 40.0 * point:
        return []
    found = []
    for share in (0.22, 0.72):
        i = min(int(np.searchsorted(length, share * length[-1])), len(steps) - 1)
        if steps[i] > 0:
            along = (whole[i + 1] - whole[i]) / steps[i]
            found.append((whole[i + 1], along))
    return found


def _ticks(
    frame: Panels,
    panel: Axes,
    places: Places,
    locus: Locus,
    scale: Scale,
    k: int,
    point: float,
    ticks: Ticks,
    axis: Abscissa,
) -> None:
    values = scale(locus.values)
    finite = values[np.isfinite(values).all(axis=1)]
    if not len(finite) or np.ptp(finite, axis=0).max() < 12.0 * point:
        return
    middle = (finite.min(axis=0) + finite.max(axis=0)) / 2
    named = set(ticks.named.tolist())
    xs, ys = [], []
    for pose in ticks.poses.tolist():
        here = values[pose]
        across = _across(values, pose)
        if across is None or not np.isfinite(here).all():
            continue
        half = TICK * frame.k * point * across * (1.5 if pose in named else 1.0)
        xs += [here[0] - half[0], here[0] + half[0], np.nan]
        ys += [here[1] - half[1], here[1] + half[1], np.nan]
    look = {"color": style.color_of(k), "linewidth": 1.0, "zorder": 3.2}
    frame.line(panel, f"ticks-{locus.name}", xs, ys, **look)
    for pose in ticks.named.tolist():
        here, across = values[pose], _across(values, pose)
        if across is None or not np.isfinite(here).all():
            continue
        side = 1.0 if across @ (here - middle) >= 0 else -1.0
        text = axis.text(axis.values[pose])
        for sign in (side, -side):
            away = (float(sign * across[0]), float(sign * across[1]))
            if places.write(float(here[0]), float(here[1]), text, style.color_of(k), away=away):
                break


def _peak(
    frame: Panels,
    panel: Axes,
    places: Places,
    locus: Locus,
    scale: Scale,
    k: int,
    axis: Abscissa,
) -> None:
    """Mark the pose that is farthest from the origin, with its distance and where it is."""
    values = scale(locus.values)
    size = np.hypot(values[:, 0], values[:, 1])
    if not np.isfinite(size).any() or np.nanmax(size) == 0:
        return
    pose = int(np.nanargmax(np.round(size / np.nanmax(size), 12)))
    x, y = (float(value) for value in values[pose])
    frame.mark(panel, (x, y), "D", 5.0, style.color_of(k), f"peak-{locus.name}")
    text = f"{number(float(size[pose]), 4)} at {axis.text(axis.values[pose])}"
    out = np.array([x, y]) / size[pose]
    side = np.array([-out[1], out[0]])
    for way in (out, side, -side, -out):
        if places.write(x, y, text, style.color_of(k), away=(float(way[0]), float(way[1]))):
            return


def _across(values: Array, pose: int) -> Array | None:
    """Return the normal of the curve at a pose, None where it stands still."""
    step = values[min(pose + 1, len(values) - 1)] - values[max(pose - 1, 0)]
    size = float(np.hypot(*step))
    if not np.isfinite(size) or size == 0:
        return None
    return np.array([-step[1], step[0]]) / size


def _pivot(
    frame: Panels, panel: Axes, places: Places, name: str, place: Floats, point: float
) -> None:
    """Draw a fixed pivot as a small triangle with its letter."""
    width, height = 4.5 * frame.k * point, 7.5 * frame.k * point
    corners = np.asarray(place) + np.array([[0.0, 0.0], [width, -height], [-width, -height]])
    look = {"facecolor": style.PAPER, "edgecolor": style.GROUND, "linewidth": style.LINE * frame.k}
    panel.add_patch(Polygon(corners, closed=True, zorder=2.5, gid=f"pivot-{name}", **look))
    low = places.at(*corners.min(axis=0))
    high = places.at(*corners.max(axis=0))
    places.boxes.append((float(low[0]), float(low[1]), float(high[0]), float(high[1]), 1.0))
    for away in ((0.0, 1.0), (1.0, 0.0), (-1.0, 0.0)):
        if places.write(float(place[0]), float(place[1]), name, style.GROUND, away=away):
            return

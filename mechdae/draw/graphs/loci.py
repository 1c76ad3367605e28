"""Curves in the plane with ticks of equal time: paths of points, hodographs, bearing loads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from mechdae.draw import style
from mechdae.draw.graphs.abscissa import Abscissa, abscissa_of, beyond_key
from mechdae.draw.graphs.frame import Entry, Panels, Places
from mechdae.draw.graphs.poles import Clip, clip_of, cuts, with_gaps
from mechdae.draw.graphs.scale import Scale, number
from mechdae.draw.graphs.series import Array
from mechdae.draw.smooth import few_named
from mechdae.records import dataclass
from mechdae.types import Floats, Integers, Json

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


class LociPanels(Panels):
    """Curves with equal axes, ticks, arrows and fixed pivots.

    Parameters
    ----------
    result
        At poses between which curves are straight.
    words
        What the axes are, without units.
    pivots
        Names and places of fixed pivots.
    origin, peaks
        Whether the axes through the origin are drawn, and the farthest places with their size.
    """

    def __init__(
        self, result: SweepResult, ax: Axes | None, loci: Sequence[Locus], scale: Scale,
        words: Sequence[str], subtitle: str, *, ticks: bool,
        pivots: Sequence[tuple[str, Floats]] = (), origin: bool = False, peaks: bool = False,
    ) -> None:  # fmt: skip
        self.axis: Abscissa = abscissa_of(result)
        dots = few_named(result)
        chosen = ticks_of(result, self.axis) if ticks and not dots else None
        key = [
            Entry(locus.name, line={**style.line_of(k), "linewidth": 1.5})
            for k, locus in enumerate(loci)
        ]
        if chosen is not None:
            line = {"upright": True, "color": style.INK, "linewidth": 1.0}
            key.append(Entry(chosen.step, line=line))
        clips = [_clips(self.axis, locus) for locus in loci]
        key += beyond_key(self.axis, [clip for pair in clips for clip in pair])
        super().__init__(ax, 1, result, subtitle, key, height=HEIGHT)
        panel = self.panels[0]
        self.panel: Axes = panel
        rows = [_within(locus, clip) for locus, clip in zip(loci, clips, strict=True)]
        rows += [place[None] for _, place in pivots] + [np.zeros((1, 2))] * origin
        points = scale(np.vstack(rows))
        points = points[np.isfinite(points).all(axis=1)] if len(points) else np.zeros((1, 2))
        self.point: float = self.equal(panel, points.min(axis=0), points.max(axis=0), ROOM)
        """Size of a point [unit shown]."""
        self.label(panel, *map(scale.named, words))
        self.places: Places = Places(self, panel)
        tracks = [scale(locus.values) for locus in loci]
        for track in tracks:
            self.places.keep(*track.T)
        if origin:
            self.zero(panel)
            panel.axvline(0.0, color=style.FAINT, linewidth=0.8 * self.k, zorder=1)
            self.places.keep(np.array(panel.get_xlim()), np.zeros(2))
            self.places.keep(np.zeros(2), np.array(panel.get_ylim()))
        for k, (locus, track) in enumerate(zip(loci, tracks, strict=True)):
            self._curve(locus.name, track, k, dots)
        for name, place in pivots:
            self._pivot(name, scale(place))
        for k, (locus, track) in enumerate(zip(loci, tracks, strict=True)):
            if peaks:
                self._peak(locus.name, track, style.color_of(k))
        for k, (locus, track) in enumerate(zip(loci, tracks, strict=True)):
            if chosen is not None:
                self._ticks(locus.name, track, style.color_of(k), chosen)

    def _curve(self, name: str, track: Array, k: int, dots: bool) -> None:
        _, drawn = with_gaps(track[:, 0], track, cuts(track))
        look, color = style.line_of(k) | {"linewidth": 1.5}, style.color_of(k)
        look |= {"linestyle": "", "marker": "o", "markersize": 3.0} if dots else {}
        self.line(self.panel, f"locus-{name}", *drawn.T, **look)
        size = np.array(ARROW) * self.k * self.point
        for tip, along in () if dots else _arrows(track, self.point):
            back, across = tip - size[0] * along, size[1] * np.array([-along[1], along[0]])
            corners = np.array([tip, back + across, back - across])
            self.panel.add_patch(Polygon(corners, closed=True, color=color, zorder=3.5, lw=0))
        for first in track[np.isfinite(track).all(axis=1)][:1]:
            look = {"markerfacecolor": style.PAPER, "markeredgecolor": color}
            look |= {"marker": "o", "markersize": 5.5, "linestyle": "", "zorder": 4}
            self.line(self.panel, f"start-{name}", first[:1], first[1:], **look)

    def _beside(self, place: Array, text: str, color: str, ways: Iterable[Array]) -> None:
        """Write a text in the first of some directions from a place that is free."""
        x, y = place.tolist()
        any(self.places.write(x, y, text, color, away=(*way.tolist(),)) for way in ways)

    def _ticks(self, name: str, track: Array, color: str, ticks: Ticks) -> None:
        finite = track[np.isfinite(track).all(axis=1)]
        if not len(finite) or np.ptp(finite, axis=0).max() < 12.0 * self.point:
            return
        middle = (finite.min(axis=0) + finite.max(axis=0)) / 2
        named = set(ticks.named.tolist())
        crossed = {pose: (track[pose], _across(track, pose)) for pose in ticks.poses.tolist()}
        crossed = {k: row for k, row in crossed.items() if np.isfinite([*row]).all()}
        strokes, gap = [np.zeros((0, 2))], np.full((1, 2), np.nan)
        for pose, (here, across) in crossed.items():
            half = TICK * self.k * self.point * across * (1.5 if pose in named else 1.0)
            strokes += [np.array([here - half, here + half]), gap]
        xs, ys = np.vstack(strokes).T
        self.line(self.panel, f"ticks-{name}", xs, ys, color=color, linewidth=1.0, zorder=3.2)
        for pose in [pose for pose in crossed if pose in named]:
            here, across = crossed[pose]
            side = across if across @ (here - middle) >= 0 else -across
            self._beside(here, self.axis.text(self.axis.values[pose]), color, (side, -side))

    def _peak(self, name: str, track: Array, color: str) -> None:
        """Mark the pose that is farthest from the origin, with its distance and where it is."""
        size = np.hypot(*track.T)
        if not np.isfinite(size).any() or np.nanmax(size) == 0:
            return
        pose = int(np.nanargmax(np.round(size / np.nanmax(size), 12)))
        self.mark(self.panel, (*track[pose].tolist(),), "D", 5.0, color, f"peak-{name}")
        text = f"{number(float(size[pose]), 4)} at {self.axis.text(self.axis.values[pose])}"
        out = track[pose] / size[pose]
        side = np.array([-out[1], out[0]])
        self._beside(track[pose], text, color, (out, side, -side, -out))

    def _pivot(self, name: str, place: Floats) -> None:
        """Draw a fixed pivot as a small triangle with its letter."""
        shape = np.array([[0.0, 0.0], [4.5, -7.5], [-4.5, -7.5]])
        corners = place + shape * self.k * self.point
        look: Json = {"facecolor": style.PAPER, "edgecolor": style.GROUND}
        look |= {"linewidth": style.LINE * self.k, "zorder": 2.5, "gid": f"pivot-{name}"}
        self.panel.add_patch(Polygon(corners, closed=True, **look))
        ends = [self.places.at(*corner).tolist() for corner in (corners.min(0), corners.max(0))]
        self.places.boxes.append((*ends[0], *ends[1], 1.0))
        self._beside(place, name, style.GROUND, np.array([[0.0, 1.0], [1.0, 0.0], [-1.0, 0.0]]))


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


def _arrows(values: Array, point: float) -> Iterator[tuple[Array, Array]]:
    """Yield places and directions of arrows, a quarter and three quarters along the curve."""
    whole = values[np.isfinite(values).all(axis=1)]
    steps = np.hypot(*np.diff(whole, axis=0).T)
    length = np.cumsum(steps)
    if len(whole) < 3 or length[-1] < 40.0 * point:
        return
    for share in (0.22, 0.72):
        i = min(int(np.searchsorted(length, share * length[-1])), len(steps) - 1)
        if steps[i] > 0:
            yield whole[i + 1], (whole[i + 1] - whole[i]) / steps[i]


def _across(values: Array, pose: int) -> Array:
    """Return the normal of the curve at a pose, nan where it stands still."""
    step = values[min(pose + 1, len(values) - 1)] - values[max(pose - 1, 0)]
    size = float(np.hypot(*step)) or np.nan
    return np.array([-step[1], step[0]]) / size

"""Numbers of the whole way of many lanes: spans, extremes, transmission angles, strokes, boxes.

What they are is defined in `mechdae.motion.measures`, module by module; here are the same numbers
for lanes that go through their whole way. A lane in which something is not regular (a quantity that
rests, a place that is not certified) is left to be solved alone.

As of `mechdae.motion.measures.curve`: the rule of Gauss and Kronrod over parts of the way that
end where the point stands still, halved until its two orders agree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from mechdae.design.studies.batches.poses import Asked, LaneNodes, LanePoses, Lanes
from mechdae.design.studies.batches.readings import WayReading
from mechdae.design.studies.batches.track import LaneTrack
from mechdae.motion.measures.along_sweep_extremes import AT_REST, TIE
from mechdae.motion.measures.curve import CLOSED as CLOSED_PATH
from mechdae.motion.measures.curve import CUSP, STEPS
from mechdae.motion.measures.strokes import CLOSED
from mechdae.motion.measures.track import SAME, TURN
from mechdae.numerics.quadrature import GAUSS, KRONROD, NOISE, PLACES, SHRINKS, TOLERANCE
from mechdae.types import Booleans, Floats, Integers

HALVINGS = 12
"""Of a part of the way; what is left then is solved alone."""
ORDERS = {"curve": 3}
STROKES = ("time_ratio", "return_angle")


def curve_facts(track: LaneTrack, columns: Sequence[int]) -> dict[str, Floats]:
    """Return ``length`` [m], ``area`` [m^2] and ``closed`` (1 or 0) of a point's path (k,).

    The area is positive counter-clockwise in the sense of the poses, and nan where the path is not
    closed, or in space; all are nan where the point does not move.
    """
    every = np.arange(len(track.scale))
    moving = (track.travel(columns) > AT_REST * track.scale).any(axis=0)
    ends = [track.column(track.at(every, s), 0, columns) for s in (track.first, track.last)]
    total = _integrals(track, columns, _parts(track, _stops(track, columns)), ends[0])
    length, area = (np.where(moving, sums, np.nan) for sums in total)
    with np.errstate(invalid="ignore"):
        closed = np.abs(ends[1] - ends[0]).max(axis=0) <= CLOSED_PATH * length
    area = np.where(closed & (len(columns) == 2), track.sense * area, np.nan)
    return {"length": length, "area": area, "closed": np.where(moving, closed, np.nan)}


def _stops(track: LaneTrack, columns: Sequence[int]) -> tuple[Integers, Floats]:
    """Return lanes and places at which the point stands still."""

    def family(y: list[Floats], lane: Integers) -> tuple[Floats, Floats]:
        """Half the rate of the squared speed, and its own rate."""
        v, a, j = (track.column(y, order, columns) for order in (1, 2, 3))
        return (v * a).sum(axis=0)[None], (a * a + v * j).sum(axis=0)[None]

    zeros = track.zeros(family)
    y = track.at(zeros.lane, zeros.s)
    speed, bend = (np.hypot.reduce(track.column(y, order, columns)) for order in (1, 2))
    unit = track.unit[zeros.lane]
    grain = np.maximum(CUSP, 8 * np.finfo(float).eps * np.abs(zeros.s) / unit)
    still = speed <= grain * unit * bend
    return zeros.lane[still], zeros.s[still]


def _parts(track: LaneTrack, stops: tuple[Integers, Floats]) -> tuple[Any, ...]:
    """Return lanes, beginnings and ends of the parts that are integrated over at first."""
    width = track.last - track.first
    step = STEPS * track.step
    count = np.maximum(np.ceil(width / step), 1).astype(int)
    lane = np.repeat(np.arange(len(width)), count)
    share = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    s = track.first[lane] + width[lane] * share / count[lane]
    inside = (stops[1] > track.first[stops[0]]) & (stops[1] < track.last[stops[0]])
    lane, s = np.concatenate([lane, stops[0][inside]]), np.concatenate([s, stops[1][inside]])
    order = np.lexsort((s, lane))
    lane, a = lane[order], s[order]
    b = np.append(a[1:], 0.0)
    final = np.append(lane[1:] != lane[:-1], True)
    b[final] = track.last[lane[final]]
    return lane[b > a], a[b > a], b[b > a]


def _integrals(
    track: LaneTrack, columns: Sequence[int], parts: tuple[Floats, ...], start: Floats
) -> Floats:
    """Return lengths and areas (2, k)."""
    k = len(track.scale)
    lane, a, b = parts
    total, allowed, count = np.zeros((2, k)), None, np.bincount(lane, minlength=k)
    before: Any = np.inf
    for halving in range(HALVINGS + 1):
        places = a[:, None] + (b - a)[:, None] * PLACES
        owners = np.repeat(lane, len(PLACES))
        y = track.at(owners, places.ravel())
        x, v = track.column(y, 0, columns) - start[:, owners], track.column(y, 1, columns)
        values = np.stack([np.hypot.reduce(v), (x[0] * v[1] - x[1] * v[0]) / 2])
        values = values.reshape(2, len(lane), -1) * (b - a)[:, None]
        fine = values @ KRONROD
        gap = np.abs(fine - values @ GAUSS)
        if allowed is None:
            length = np.bincount(lane, fine[0], k)
            size = np.stack([length, length**2])
            allowed, noise = TOLERANCE * size / np.maximum(count, 1), NOISE * size
        rounding = (gap <= noise[:, lane]) & (gap > SHRINKS * before)
        again = ((gap > allowed[:, lane]) & ~rounding).any(axis=0)
        if halving == HALVINGS:
            track.good[lane[again]] = False
            again[:] = False
        for sums, part in zip(total, fine, strict=True):
            sums += np.bincount(lane[~again], part[~again], k)
        if not again.any():
            break
        middle = (a + b)[again] / 2
        lane = np.repeat(lane[again], 2)
        a, b = (np.stack(ends, axis=1).ravel() for ends in ((a[again], middle), (middle, b[again])))
        before = np.repeat(gap[:, again], 2, axis=1)
    return total


class Ways:
    """Computes numbers of the whole way."""

    def __init__(
        self, poses: Callable[[Asked], LanePoses], readings: Sequence[WayReading], is_angle: bool,
        values: Floats,
    ) -> None:  # fmt: skip
        self.readings, self.is_angle = list(readings), is_angle
        self.low, self.high = float(values.min()), float(values.max())
        self.sense: float = 1.0 if values[-1] >= values[0] else -1.0
        orders = [(ORDERS.get(reading.kind, 2), reading.columns) for reading in self.readings]
        self.poses: LanePoses = poses(Asked(tuple(orders)))

    @property
    def strokes(self) -> bool:
        """Whether a whole turn of the driver is looked at, and a step more both ways."""
        return self.is_angle and any(reading.kind in STROKES for reading in self.readings)

    def reach(self, step: Floats) -> tuple[Any, Any]:
        """Return the ends (k,) of what lanes have to follow, `step` (k,) their largest steps."""
        if not self.strokes:
            return self.low + 0 * step, self.high + 0 * step
        return self.low - step, np.maximum(self.high, self.low + TURN + step)

    def __call__(
        self, lanes: Lanes, nodes: LaneNodes, scale: Floats, step: Floats
    ) -> tuple[list[Floats], Booleans]:
        """Return an array (k,) or (k, 4) for each reading, and which lanes (k,) they hold for."""

        def track(first: Floats, last: Floats) -> LaneTrack:
            return LaneTrack(
                self.poses, lanes, nodes, first, last, scale, step, self.is_angle, self.sense
            )

        whole = [reading for reading in self.readings if reading.kind not in STROKES]
        found: dict[WayReading, Floats] = {}
        good = np.ones(len(scale), bool)
        if whole:
            own_way = track(self.low + 0 * step, self.high + 0 * step)
            found |= dict(self._over(own_way, whole))
            good &= own_way.good
        if not self.is_angle:
            found |= {r: np.full(len(scale), np.nan) for r in self.readings if r not in whole}
        elif len(whole) < len(self.readings):
            turn = track(self.low - step, self.low + TURN + step)
            for reading in self.readings:
                if reading.kind in STROKES:
                    found[reading] = self._stroke(turn, reading, self.low)
            good &= turn.good
        return [found[reading] for reading in self.readings], good

    def _over(
        self, track: LaneTrack, readings: Sequence[WayReading]
    ) -> Iterator[tuple[WayReading, Floats]]:
        columns = sorted({
            c for reading in readings if reading.kind in ("span", "extremes", "envelope")
            for c in reading.columns
        })  # fmt: skip
        if columns:
            courses = _Courses(track, columns, self._sizes(track, columns))
        facts: dict[tuple[str, tuple[int, ...]], dict[str, Floats]] = {}
        for reading in readings:
            if reading.kind in FACTS:
                key = (reading.kind, reading.columns)
                if key not in facts:
                    facts[key] = FACTS[reading.kind](track, reading.columns)
                yield reading, facts[key][reading.what[0]]
            elif reading.kind == "span":
                yield reading, courses.most[reading.columns[0]] - courses.least[reading.columns[0]]
            elif reading.kind == "extremes":
                yield reading, courses.extreme(reading)
            else:
                yield reading, courses.box(reading.columns)

    def _sizes(self, track: LaneTrack, columns: Sequence[int]) -> Floats:
        """Return by what columns are measured, (m, k)."""
        turning = {column for r in self.readings if r.angle for column in r.columns}
        one = np.ones_like(track.scale)
        return np.stack([one if column in turning else track.scale for column in columns])

    def _stroke(self, track: LaneTrack, reading: WayReading, start: float) -> Floats:
        """Return the time ratio or the return angle of a part (k,), nan where there is none."""
        columns, k = list(reading.columns), len(track.scale)
        size = self._sizes(track, columns)
        moving = track.moves(columns, size)
        every = np.arange(k)
        ends = [track.at(every, np.full(k, s)) for s in (start, start + TURN)]
        gain = [
            (track.column(ends[1], order, columns) - track.column(ends[0], order, columns))[0]
            for order in range(3)
        ]
        turns = np.round(gain[0] / TURN) if reading.angle else np.zeros(k)
        back = np.abs(gain[0] - turns * TURN)
        back = np.maximum(back, np.maximum(np.abs(gain[1]), np.abs(gain[2])))
        regular = (back <= CLOSED * size[0]) & (turns == 0) & moving[0]
        zeros = track.zeros(_rates(track, columns), moving)
        places = {}
        for rising in (False, True):  # maxima, minima
            lane, s, up = zeros.of(0)
            places[rising], counts = _distinct(lane[up == rising], s[up == rising], start, k)
            regular &= counts == 1
        stroke = (places[True] - places[False]) % TURN
        angle = np.where(regular, np.minimum(stroke, TURN - stroke), np.nan)
        return angle if reading.kind == "return_angle" else (TURN - angle) / angle


def _rates(track: LaneTrack, columns: Sequence[int]) -> Any:
    def family(y: list[Floats], lane: Integers) -> tuple[Floats, Floats]:
        return track.column(y, 1, columns), track.column(y, 2, columns)

    return family


def _distinct(lane: Integers, s: Floats, start: float, count: int) -> tuple[Floats, Integers]:
    """Return the first of the places of each lane in a turn from `start`, and how many differ."""
    share = (s - start) % TURN
    share = np.where(share > TURN - SAME, share - TURN, share)
    order = np.lexsort((share, lane))
    lane, share = lane[order], share[order]
    new = np.ones(len(lane), bool)
    new[1:] = (lane[1:] != lane[:-1]) | (np.diff(share) > SAME)
    counts = np.bincount(lane[new], minlength=count)
    found = np.full(count, np.nan)
    found[lane[new][::-1]] = start + share[new][::-1]
    return found, counts


class _Courses:
    """Least and greatest values of columns over lanes, and where they are."""

    def __init__(self, track: LaneTrack, columns: list[int], size: Floats) -> None:
        self.track, k = track, len(track.scale)
        self.moves = dict(zip(columns, track.moves(columns, size), strict=True))
        zeros = track.zeros(_rates(track, columns))
        at = track.at(zeros.lane, zeros.s)
        values = track.column(at, 0, columns)[zeros.member, np.arange(len(zeros.s))]
        inner = np.flatnonzero(np.isin(track.s, (track.first[0], track.last[0])))
        ends = track.column(track.y, 0, columns)[:, inner]
        self.least: dict[int, Floats] = {}
        self.most: dict[int, Floats] = {}
        self.at: dict[tuple[int, str], Any] = {}
        for m, column in enumerate(columns):
            of_column = zeros.member == m
            lane = np.concatenate([track.lane[inner], zeros.lane[of_column]])
            value = np.concatenate([ends[m], values[of_column]])
            place = np.concatenate([track.s[inner], zeros.s[of_column]])
            least, most, first, last = extremes_of(lane, value, place, k)
            self.least[column], self.most[column] = least, most
            self.at[column, "min"], self.at[column, "max"] = first, last

    def extreme(self, reading: WayReading) -> Floats:
        """Return a value or its place, nan where the quantity does not move."""
        end, word = reading.what
        (column,) = reading.columns
        table = self.least if end == "min" else self.most
        value = table[column] if word == "value" else self.at[column, end]
        return np.where(self.moves[column], value, np.nan)

    def box(self, columns: Sequence[int]) -> Floats:
        """Return xmin, xmax, ymin, ymax (k, 4) of points whose x and y the columns are in turn."""
        parts = [
            (np.minimum.reduce([self.least[c] for c in chosen]),
             np.maximum.reduce([self.most[c] for c in chosen]))
            for chosen in (columns[::2], columns[1::2])
        ]  # fmt: skip
        return np.stack([end for part in parts for end in part], axis=1)


def extremes_of(
    lane: Integers, value: Floats, place: Floats, count: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return least and greatest value of each lane (count,), and the first place of each."""
    least, most = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(least, lane, value)
    np.maximum.at(most, lane, value)
    slack = TIE * (most - least)
    found = []
    for there in (value <= (least + slack)[lane], value >= (most - slack)[lane]):
        first = np.full(count, np.inf)
        np.minimum.at(first, lane[there], place[there])
        found.append(first)
    return least, most, found[0], found[1]


def _transmission(track: LaneTrack, columns: tuple[int, ...]) -> dict[str, Floats]:
    """Return the extremes of the angle between the two lines of a dyad and their places (k,)."""

    def family(y: list[Floats], lane: Integers) -> tuple[Floats, Floats]:
        """Rate of the angle times its square's size; cross product; dot product."""
        s, c = ([track.column(y, order, [column])[0] for order in range(3)] for column in columns)
        turn, rate = c[0] * s[1] - s[0] * c[1], c[0] * s[2] - s[0] * c[2]
        return np.stack([turn, s[0], c[0]]), np.stack([rate, s[1], c[1]])

    lines = track.column(track.y, 0, columns)
    size = (lines * lines).sum(axis=0)
    largest = np.abs(family(track.y, track.lane)[0])
    largest *= np.stack([track.unit[track.lane] / size, size**-0.5, size**-0.5])
    start = np.searchsorted(track.lane, np.arange(len(track.scale)))
    zeros = track.zeros(family, np.maximum.reduceat(largest, start, axis=1) > AT_REST)
    ends = np.isin(track.s, (track.first[0], track.last[0]))
    lane = np.concatenate([track.lane[ends], zeros.lane])
    place = np.concatenate([track.s[ends], zeros.s])
    at = track.column(track.at(lane, place), 0, columns)
    value = np.arctan2(np.abs(at[0]), np.abs(at[1]))
    found = extremes_of(lane, value, place, len(track.scale))
    return dict(zip(("min", "max", "at", "max_at"), found, strict=True))


FACTS: dict[str, Callable[[LaneTrack, tuple[int, ...]], dict[str, Any]]] = {
    "transmission": _transmission, "curve": curve_facts,
}  # fmt: skip
"""What gives several numbers of the same columns."""

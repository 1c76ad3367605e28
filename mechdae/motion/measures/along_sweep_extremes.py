"""Where angles, slides and coordinates of points are stationary over a sweep; their extremes."""

from __future__ import annotations

import itertools
from dataclasses import field, replace

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, KINDS
from mechdae.motion.measures.track import FINEST, SAME, Family, Piece, Sample, Track
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass
from mechdae.types import Floats

AT_REST = 1e-11
"""Share of a radian, or of a length of the mechanism, by which rounding may move what rests."""
SHORT = FINEST / 16
"""Share of the driver's unit: over less than that nothing is said to rest."""


@dataclass(frozen=True)
class Stop:
    """A stationary place of the path (`first` = `last`), or an interval of rest.

    ``before`` and ``after`` tell whether the quantity is less (-1) or more (1) than `value`
    on both sides; 0 where the piece of the path ends first.
    """

    first: float
    last: float
    value: float
    before: int
    after: int

    @property
    def rests(self) -> bool:
        return self.last > self.first

    @property
    def middle(self) -> float:
        return (self.first + self.last) / 2

    @property
    def sense(self) -> int:
        """1 at a maximum, -1 at a minimum, 0 elsewhere."""
        return -self.before if self.before == self.after else 0


def rates_of(columns: list[int]) -> Family:
    """Return the first rates of columns as functions that vanish where they are stationary."""

    def family(sample: Sample) -> tuple[Floats, Floats]:
        return sample.y[1][:, columns], sample.y[2][:, columns]

    return family


def stops(
    track: Track, piece: Piece, columns: list[int], sizes: Floats | list[float]
) -> list[list[Stop]]:
    """Return for each column where it is stationary over a piece, in the order of the path.

    `sizes` (m,) are what a quantity is measured by: a radian, or a length of the mechanism.
    Zeros of a rate within an interval of rest are rounding.
    """
    found = []
    zeros = track.zeros(piece, rates_of(columns))
    for column, size, places in zip(columns, sizes, zeros, strict=True):
        rests = _rests(track, piece, column, AT_REST * size)
        alone = [s for s in places.tolist() if not any(r.first <= s <= r.last for r in rests)]
        single = _single(track, piece, column, AT_REST * size, np.array(alone))
        found.append(sorted([*rests, *single], key=lambda stop: stop.first))
    return found


def _single(track: Track, piece: Piece, column: int, slack: float, places: Floats) -> list[Stop]:
    """Return the stops at zeros of the rate, of which the neighbours tell on which side they are.

    The second rate does it where a neighbour is too near, or beyond another zero.
    """
    sample, here = track.sample(piece), track.at(places)
    s, y = sample.s, sample.y[0][:, column]
    left = np.searchsorted(s, places - SAME * track.unit) - 1
    right = np.searchsorted(s, places + SAME * track.unit)
    found = []
    for k, (place, value) in enumerate(zip(places, here.y[0][:, column], strict=True)):
        side = -1 if here.y[2][k, column] < 0 else 1
        if left[k] >= 0 and right[k] < len(s):
            between = (places > s[left[k]]) & (places < s[right[k]])
            gaps = y[[left[k], right[k]]] - value
            if between.sum() == 1 and np.abs(gaps).min() > slack and gaps[0] * gaps[1] > 0:
                side = int(np.sign(gaps[0]))
        found.append(Stop(float(place), float(place), float(value), side, side))
    return found


def _rests(track: Track, piece: Piece, column: int, slack: float) -> list[Stop]:
    """Return the intervals over which a column changes by no more than `slack`."""
    sample = track.sample(piece)
    s, y = sample.s, sample.y[0][:, column]
    with np.errstate(invalid="ignore"):
        still = np.flatnonzero((np.abs(np.diff(y)) <= slack) & (np.diff(s) > SHORT * track.unit))
    middles = track.at((s[still] + s[still + 1]) / 2).y[0][:, column]
    still = still[np.abs(middles - y[still]) <= slack]
    found = []
    for run in np.split(still, np.flatnonzero(np.diff(still) > 1) + 1) if still.size else ():
        first, last = int(run[0]), int(run[-1]) + 1
        value = float(np.median(y[first : last + 1]))
        before, low = _edge(track, column, s, y, range(first, -1, -1), value, slack)
        after, high = _edge(track, column, s, y, range(last, len(s)), value, slack)
        found.append(Stop(low, high, value, before, after))
    return _apart(found)


def _apart(rests: list[Stop]) -> list[Stop]:
    """Return intervals of rest that do not overlap: runs that short steps part reach as far."""
    found: list[Stop] = []
    for rest in rests:
        if found and rest.first <= found[-1].last:
            last = max(found[-1].last, rest.last)
            found[-1] = replace(found[-1], last=last, after=rest.after)
        else:
            found.append(rest)
    return found


def _edge(
    track: Track, column: int, s: Floats, y: Floats, rows: range, value: float, slack: float
) -> tuple[int, float]:
    """Return on which side of its value a rest is left, and where, going on over `rows`."""
    for inner, outer in itertools.pairwise(rows):
        gap = y[outer] - value
        if np.isfinite(gap) and abs(gap) <= slack:
            continue
        if not np.isfinite(gap):
            return 0, float(s[inner])
        side = 1 if gap > 0 else -1
        level = value + side * slack

        def family(sample: Sample, level: float = level) -> tuple[Floats, Floats]:
            return sample.y[0][:, [column]] - level, sample.y[1][:, [column]]

        a, b = sorted((s[inner], s[outer]))
        rising = (outer > inner) == (side > 0)
        place = track.refine(family, np.zeros(1, int), [a], [b], np.array([rising]))[0]
        return side, float(place if np.isfinite(place) else s[inner])
    return 0, float(s[rows[-1]])


TIE = 1e-12
"""Share of the range within which two extremes are the same; the first one is named."""


@dataclass(frozen=True)
class ReportedScalar:
    """A scalar that is reported: ``rocker.angle``, ``guide.slide``, ``coupler.P.x``."""

    name: str
    part: str
    column: int
    alone: bool = True
    """Whether it is the only coordinate of its body or joint."""

    @property
    def label(self) -> str:
        """Its body or joint; the coordinate too where that has several."""
        return self.part if self.alone else self.name

    @property
    def is_angle(self) -> bool:
        return KINDS.get(self.name.rpartition(".")[2]) is ANGLE

    @property
    def is_output(self) -> bool:
        """Whether it is of a body or a joint: coordinates of links, not of points."""
        return "." not in self.part


def quantities(outputs: Outputs) -> list[ReportedScalar]:
    """Return bodies' angles, slides and coordinates of points that a sweep reports.

    In space bodies have no angle, and all coordinates of joints are there.
    """
    found, in_space = [], outputs.scene.model.mechanism.dimension == 3
    for entry in outputs.entries:
        if entry.name == "position":
            for axis, column in zip("xyz", entry.columns, strict=False):
                found.append(ReportedScalar(f"{entry.part}.{axis}", entry.part, column))
        elif entry.is_output or (in_space and entry.kind == "joints" and entry.quantity):
            name = f"{entry.part}.{entry.name}"
            beside = [e for e in outputs.entries if (e.kind, e.part) == (entry.kind, entry.part)]
            alone = not in_space or len(beside) == 1
            found.append(ReportedScalar(name, entry.part, entry.columns[0], alone))
    return found


def travel(sample: Sample, columns: list[int]) -> Floats:
    """Return greatest less least value of columns, 0 for those without values."""
    values = sample.y[0][:, columns]
    known = np.isfinite(values)
    top = np.where(known, values, -np.inf).max(axis=0, initial=-np.inf)
    bottom = np.where(known, values, np.inf).min(axis=0, initial=np.inf)
    return np.where(known.any(axis=0), top - bottom, 0.0)


@dataclass(frozen=True)
class ValueAt:
    """A value and the driver's value there."""

    at: float
    value: float
    place: float
    """Where on the path that is: `at` less whole turns."""
    sense: int = 0
    """1 at a maximum, -1 at a minimum, 0 at an end."""
    rest: tuple[float, float] | None = None
    """The driver's values between which the quantity rests."""


@dataclass
class Course:
    """A quantity over the sweep: where it is stationary and what it is at the ends."""

    quantity: ReportedScalar
    moves: bool = False
    stationary: list[ValueAt] = field(default_factory=list)
    ends: list[ValueAt] = field(default_factory=list)

    @property
    def places(self) -> list[ValueAt]:
        return sorted([*self.stationary, *self.ends], key=lambda place: place.at)

    def extreme(self, sense: int) -> ValueAt | None:
        """Return the greatest (1) or least (-1) value, the first one of equal ones."""
        places = self.places
        if not places:
            return None
        values = [place.value for place in places]
        best = max(sense * value for value in values)
        slack = TIE * (max(values) - min(values))
        return next(place for place in places if sense * place.value >= best - slack)

    @property
    def range(self) -> float:
        """Greatest less least value."""
        values = [place.value for place in self.places]
        return max(values) - min(values) if values else 0.0


def courses(track: Track, wanted: list[ReportedScalar]) -> dict[str, Course]:
    """Return the courses of quantities by name."""
    found = {quantity.name: Course(quantity) for quantity in wanted}
    if found:
        _follow(track, list(found.values()))
    return found


def _follow(track: Track, members: list[Course]) -> None:
    """Fill in the courses of quantities."""
    columns = [course.quantity.column for course in members]
    size = np.array([1.0 if c.quantity.is_angle else track.scale for c in members])
    pieces = track.pieces(track.low - track.margin, track.high + track.margin)
    moving = np.zeros(len(members), bool)
    for piece in pieces:
        moving |= travel(track.sample(piece), columns) > AT_REST * size
    for course, moves in zip(members, moving, strict=True):
        course.moves = bool(moves)
    slack, rows = SAME * track.unit, np.flatnonzero(moving).tolist()
    for piece in pieces:
        found = stops(track, piece, [columns[k] for k in rows], size[rows])
        for k, stop in ((k, stop) for k, each in zip(rows, found, strict=True) for stop in each):
            first, last = (float(s + piece.shift) for s in (stop.first, stop.last))
            if stop.sense and last >= track.low - slack and first <= track.high + slack:
                at = float(np.clip((first + last) / 2, track.low, track.high))
                rest = (first, last) if stop.rests else None
                place = ValueAt(at, stop.value, float(stop.first), stop.sense, rest)
                members[k].stationary.append(place)
    for piece in track.pieces(track.low, track.high):
        ends = np.array([piece.low, piece.high])
        poses = track.at(ends)
        for course, column in zip(members, columns, strict=True):
            for s, value in zip(ends, poses.y[0][:, column], strict=True):
                if np.isfinite(value):
                    at = float(np.clip(s + piece.shift, track.low, track.high))
                    course.ends.append(ValueAt(at, float(value), float(s)))

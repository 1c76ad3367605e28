"""How angles, slides and coordinates of points go over a sweep: stationary values, extremes."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, KINDS
from mechdae.motion.measures.stationary_places import AT_REST, stops
from mechdae.motion.measures.track import SAME, Sample, Track
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass
from mechdae.types import Floats

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

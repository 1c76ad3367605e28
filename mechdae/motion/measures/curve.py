"""Paths of points: length, area, tangent, curvature, cusps."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from mechdae.motion.measures.along_sweep_extremes import AT_REST, travel
from mechdae.motion.measures.track import KNOWN, SAME, Family, Piece, Sample, Track
from mechdae.motion.setup.outputs import Outputs, ReportedQuantity
from mechdae.numerics.quadrature import KRONROD, PLACES, Substitution, integrate
from mechdae.types import Booleans, Floats, Json, Matrix, Points

CUSP = 1e-12
"""Way of the driver, in its unit, to where the velocity vanishes: nearer is there."""
RESTING, LOOKED_AT = 1e-12, 17
"""Share of the mechanism's size that is no motion, and places looked at between two stops."""
BESIDE = 1e-6
"""Sine of the angle between acceleration and jerk below which the path turns back on itself."""
STEPS = 8
"""Largest steps of the path in one panel of the quadrature."""
CLOSED = 1e-9
SHIFTED = 4
"""Units in the last place by which a limit position may be off."""
ROUNDING = 8 * float(np.finfo(float).eps)
"""Share of a length that the rounding of speeds may add up to."""


def directions(outputs: Outputs, values: list[Floats], unit: float) -> dict[str, dict[str, Floats]]:
    """Return ``tangent`` [rad] and ``curvature`` [1/m] of each point at given poses.

    `values` are y and its derivatives, three in space. Both are nan where the velocity vanishes. In
    space the tangent is ``direction`` (n, 3), a unit vector, and there is ``torsion`` [1/m], nan
    where the path is straight.
    """
    found = {}
    for entry in _points(outputs):
        v, a = (array[:, entry.columns] for array in values[1:3])
        speed = _size(v)
        there = speed > CUSP * unit * _size(a)
        if v.shape[1] == 3:
            found[entry.part] = _in_space(v, a, values[3][:, entry.columns], there)
            continue
        with np.errstate(invalid="ignore", divide="ignore"):
            across = v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0]
            found[entry.part] = {
                "tangent": np.where(there, np.arctan2(v[:, 1], v[:, 0]), np.nan),
                "curvature": np.where(there, across / speed**3, np.nan),
            }
    return found


def _in_space(v: Floats, a: Floats, jerk: Floats, there: Booleans) -> dict[str, Floats]:
    """Return Frenet's tangent, curvature and torsion; `there` tells where the point moves."""
    across, speed = np.cross(v, a), _size(v)
    turn = _size(across)
    bent = there & (turn > CUSP * speed * _size(a))
    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "direction": np.where(there[:, None], v / speed[:, None], np.nan),
            "curvature": np.where(there, turn / speed**3, np.nan),
            "torsion": np.where(bent, np.sum(across * jerk, axis=1) / turn**2, np.nan),
        }


def _size(vectors: Floats) -> Any:
    """Return the lengths of vectors (n, 2) or (n, 3)."""
    if vectors.shape[1] == 2:
        return np.hypot(vectors[:, 0], vectors[:, 1])
    return np.sqrt(np.sum(vectors**2, axis=1))


def _across(v: Matrix, a: Floats) -> Any:
    """Return the sizes of the products v x a."""
    if v.shape[1] == 2:
        return np.abs(v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0])
    return _size(np.cross(v, a))


def curves(track: Track, outputs: Outputs) -> tuple[dict[str, Json], list[Json]]:
    """Return what there is to say about each point's path over the sweep, and the cusps."""
    found: dict[str, Json] = {}
    events: list[Json] = []
    for entry in _points(outputs):
        path = _Curve(track, entry)
        if not path.moves:
            continue
        events += path.events
        if track.high > track.low:
            found[entry.part] = path.facts()
    return found, events


def _beside_folds(integrand: Any, charts: list[Substitution]) -> float:
    """Return what the rounding of limit positions s* does to the speeds beside them.

    They grow like 1/sqrt(|s - s*|): an error d of s* is one of d/(2 |s - s*|) of the speed.
    """
    off = 0.0
    for chart in charts:
        if chart.fold:
            s, slope = chart.place(PLACES)
            fold = chart.low if chart.fold < 0 else chart.high
            share = SHIFTED * np.spacing(abs(fold)) / (2 * np.abs(s - fold))
            off += float(np.nansum(KRONROD * slope * integrand(s)[:, 0] * share))
    return off


def _points(outputs: Outputs) -> list[ReportedQuantity]:
    return [entry for entry in outputs.entries if entry.kind == "points"]


class _Curve:
    """The path of one point."""

    def __init__(self, track: Track, entry: ReportedQuantity) -> None:
        self.track, self.entry = track, entry
        self.columns = list(entry.columns)
        margin = track.margin
        searched = track.pieces(track.low - margin, track.high + margin)
        self.moves = any(
            (travel(track.sample(piece), self.columns) > AT_REST * track.scale).any()
            for piece in searched
        )
        self.cusps: list[Json] = []
        self.reversals: list[Json] = []
        self.stops: list[float] = []
        if self.moves:
            for piece in searched:
                self._find_stops(piece)

    @property
    def _speed(self) -> Family:
        """Half the rate of the squared speed, and its own rate."""

        def family(sample: Sample) -> tuple[Floats, Floats]:
            v, a, j = (array[:, self.columns] for array in sample.y[1:4])
            slope = np.sum(v * a, axis=1, keepdims=True)
            return slope, np.sum(a * a + v * j, axis=1, keepdims=True)

        return family

    def _find_stops(self, piece: Piece) -> None:
        """Find where the velocity vanishes: the speed is least and no more than rounding."""
        track = self.track
        places = track.zeros(piece, self._speed)[0]
        poses = track.at(places)
        x, v, a, j = (array[:, self.columns] for array in poses.y[:4])
        speed, bend, third = (_size(part) for part in (v, a, j))
        grain = np.maximum(CUSP, 8 * np.finfo(float).eps * np.abs(places) / track.unit)
        across = _across(a, j)
        sharp = across > BESIDE * bend * np.maximum(third, bend / track.unit)
        slack = SAME * track.unit
        for k in np.flatnonzero(speed <= grain * track.unit * bend):
            at = float(places[k] + piece.shift)
            if not track.low - slack <= at <= track.high + slack:
                continue
            if self._rests_since(float(places[k])):
                continue
            self.stops.append(float(places[k]))
            found = self.cusps if sharp[k] else self.reversals
            clipped = float(np.clip(at, track.low, track.high))
            found.append({"at": clipped, "position": x[k].tolist()})

    def _rests_since(self, place: float) -> bool:
        """Return whether the point has not moved since the last stop: one rest, its rounding."""
        if not self.stops:
            return False
        between = np.linspace(self.stops[-1], place, LOOKED_AT)
        x = self.track.at(between).y[0][:, self.columns]
        return bool(np.abs(x - x[0]).max() <= RESTING * self.track.scale)

    @property
    def events(self) -> list[Json]:
        return [
            {"kind": "cusp", "point": self.entry.part, **cusp, "in_range": True}
            for cusp in self.cusps
        ]

    def facts(self) -> Json:
        """Return length and area with their errors, whether the path is closed, its cusps."""
        track = self.track
        pieces = track.pieces(track.low, track.high)
        charts = [chart for piece in pieces for chart in self._charts(piece)]
        if not charts:
            return {"length": None, "closed": False}
        start = track.at(np.array([pieces[0].low])).y[0][0, self.columns]

        def integrand(s: Floats) -> Points:
            y = track.at(s).y
            x, v = y[0][:, self.columns] - start, y[1][:, self.columns]
            area = (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) / 2  # in space: seen along z
            return np.stack([_size(v), area], axis=1)

        def size(integrals: Floats | tuple[float, float]) -> Floats:
            return np.array([integrals[0], integrals[0] ** 2])

        (length, area), error = integrate(integrand, charts, size)
        ends = [s for piece in pieces for s in (piece.low, piece.high)]
        off = self._cut(ends) + _beside_folds(integrand, charts)
        error = error + size((length, area)) * ROUNDING + off * np.array([1, length])
        facts: Json = {"length": float(length), "error": float(error[0])}
        facts["closed"] = self._closed(pieces, float(length))
        if facts["closed"] and len(self.columns) == 2:
            facts |= {"area": track.sense * float(area), "area_error": float(error[1])}
        facts["cusps"] = self.cusps
        facts["reversals"] = self.reversals
        return facts

    def _cut(self, ends: list[float]) -> float:
        """Return how much of the way the errors of limit positions may cut off or add.

        A place is known to the share `KNOWN` of the driver's unit. The point's own limit
        positions add what the pose there is known to; elsewhere its speed is finite.
        """
        track = self.track
        found = [
            end.s for reach in track.path.reach.values() for end in (reach.low, reach.high) if end
        ]
        ends = [s for s in ends if s in found]
        if not ends:
            return 0.0
        v = track.at(np.array(ends)).y[1][:, self.columns]
        speed = _size(v)
        return float(np.where(np.isfinite(speed), speed * track.unit, track.scale).sum() * KNOWN)

    def _charts(self, piece: Piece) -> list[Substitution]:
        """Return the intervals to integrate over: ends at limits and at stops."""
        if piece.low >= piece.high:
            return []
        count = int(np.ceil((piece.high - piece.low) / (STEPS * self.track.path.largest)))
        even = piece.low + (piece.high - piece.low) * np.arange(1, count) / count
        inner = {float(s) for s in [*even, *self.stops] if piece.low < s < piece.high}
        places = sorted({piece.low, piece.high, *inner})
        folds = {end.s for end in self.track.ends()[2] if end.kind == "limit"}
        charts = []
        for a, b in itertools.pairwise(places):
            if a in folds and b in folds:
                middle = (a + b) / 2
                charts += [Substitution(a, middle, -1), Substitution(middle, b, 1)]
            else:
                charts.append(Substitution(a, b, -1 if a in folds else int(b in folds)))
        return charts

    def _closed(self, pieces: list[Piece], length: float) -> bool:
        """Return whether the path ends where it began, after a sweep without gaps."""
        track = self.track
        if len(pieces) != 1 or pieces[0].low > track.low or pieces[0].high < track.high:
            return False
        ends = track.at(np.array([track.low, track.high])).y[0][:, self.columns]
        return bool(np.abs(ends[1] - ends[0]).max() <= CLOSED * length)

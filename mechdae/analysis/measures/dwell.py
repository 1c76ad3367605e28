"""Dwells: driver intervals over which a body or a slide stays within a narrow band."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.measures.courses import Course, rates_of
from mechdae.analysis.measures.track import SAME, TURN, Piece, Sample, Track

ROUNDS = 60
CLOSE = 1e-6
"""Share of the driver's unit within which two dwells are the same one."""


def dwells(track: Track, courses: dict[str, Course], share: float) -> dict[str, Any]:
    """Return the dwells of bodies and slides that move, by the name of the part.

    A dwell contains a stationary position, the quantity stays within `share` of its swing
    from a mean value over it, and of all such intervals around the position it is the longest.
    """
    found = {}
    for course in courses.values():
        if course.quantity.is_output and course.moves and course.range > 0:
            finder = _Finder(track, course, share * course.range)
            entries = finder.all()
            if entries:
                found[course.quantity.part] = entries
    return found


class _Finder:
    """Dwells of one quantity; places are on the path, a turn beyond the sweep both ways."""

    def __init__(self, track: Track, course: Course, half: float) -> None:
        self.track, self.course, self.half = track, course, half
        self.column = course.quantity.column
        low, high = track.low, track.high
        if track.is_angle and track.reach(low - TURN, high + TURN):
            low, high = low - TURN, high + TURN
        first, last, _ = track.ends(course.quantity.groups)
        self.piece = Piece(max(low, first), min(high, last))
        if self.piece.low >= self.piece.high:
            self.places = self.values = np.zeros(0)
            return
        self.places = track.zeros(self.piece, rates_of([self.column]))[0]
        here = track.at(self.places)
        self.peaks = here.y[2][:, self.column] < 0
        self.values = here.y[0][:, self.column]
        samples = track.sample(self.piece)
        order = np.argsort(np.concatenate([samples.s, self.places]))
        self.s = np.concatenate([samples.s, self.places])[order]
        self.q = np.concatenate([samples.y[0][:, self.column], self.values])[order]

    def all(self) -> list[dict[str, Any]]:
        """Return the dwells at stationary positions of the sweep, whole turns aside."""
        track, slack = self.track, SAME * self.track.unit
        windows = [
            (*self._window(i), piece.shift)
            for piece in track.pieces(self.course.quantity.groups, track.low, track.high)
            for i, s in enumerate(self.places)
            if piece.low - slack <= s <= piece.high + slack
        ]
        found: list[dict[str, Any]] = []
        for first, last, shift in dict.fromkeys(windows):
            entry = self._entry(first, last)
            if entry is not None:
                entry |= {"from": entry["from"] + shift, "to": entry["to"] + shift}
                if not any(self._again(entry, other) for other in found):
                    found.append(entry)
        return found

    def _again(self, entry: dict[str, Any], other: dict[str, Any]) -> bool:
        """Return whether a dwell is another one whole turns later."""
        gaps = [entry[end] - other[end] for end in ("from", "to")]
        turns = round(gaps[0] / TURN) if self.track.is_angle else 0
        if abs(entry["mean"] - other["mean"]) > CLOSE * self.half:
            return False
        return bool(max(abs(gap - turns * TURN) for gap in gaps) <= CLOSE * self.track.unit)

    def _window(self, i: int) -> tuple[int, int]:
        """Return the stationary positions around one whose values fit into the band."""
        first = last = i

        def fits(a: int, b: int) -> bool:
            inside = self.values[a : b + 1]
            return bool(np.ptp(inside) <= 2 * self.half)

        while last + 1 < len(self.values) and fits(first, last + 1):
            last += 1
        while first > 0 and fits(first - 1, last):
            first -= 1
        return first, last

    def _entry(self, first: int, last: int) -> dict[str, Any] | None:
        inside = self.values[first : last + 1]
        top, bottom = float(inside.max()), float(inside.min())
        lowest, highest = top - self.half, bottom + self.half  # means that keep all of them
        mean = lowest if self.peaks[last] else highest
        left, right = self._left(first, mean), self._right(last, mean)
        if self.peaks[first] != self.peaks[last]:
            if left[1]:
                mean = lowest if self.peaks[last] else highest
            elif right[1]:
                mean = lowest if self.peaks[first] else highest
            else:
                mean = self._longest(first, last, lowest, highest)
            left, right = self._left(first, mean), self._right(last, mean)
        if not np.isfinite([left[0], right[0]]).all():
            return None
        entry = {"from": left[0], "to": right[0], "mean": mean, "within": self.half}
        if left[1] or right[1]:
            entry["cut"] = True
        return entry

    def _left(self, first: int, mean: float) -> tuple[float, bool]:
        return self._leaves(self.places[first], -1, mean, bool(self.peaks[first]))

    def _right(self, last: int, mean: float) -> tuple[float, bool]:
        return self._leaves(self.places[last], 1, mean, bool(self.peaks[last]))

    def _leaves(self, s: float, sense: int, mean: float, peak: bool) -> tuple[float, bool]:
        """Return where the band is left from a stationary position on, and whether it is not."""
        level = mean - self.half if peak else mean + self.half
        order = np.argsort(sense * self.s)
        ahead = order[(self.s[order] - s) * sense > 0]
        beyond = (self.q[ahead] < level) if peak else (self.q[ahead] > level)
        out = np.flatnonzero(beyond)
        if not out.size:
            return (self.piece.high if sense > 0 else self.piece.low), True
        k = int(out[0])
        inner = s if k == 0 else float(self.s[ahead[k - 1]])
        outer = float(self.s[ahead[k]])
        ends = (inner, outer) if sense > 0 else (outer, inner)
        rising = np.array([(not peak) == (sense > 0)])

        def family(sample: Sample) -> tuple[Any, Any]:
            return sample.y[0][:, [self.column]] - level, sample.y[1][:, [self.column]]

        a, b = (np.array([end]) for end in ends)
        return float(self.track.refine(family, np.zeros(1, int), a, b, rising)[0]), False

    def _longest(self, first: int, last: int, lowest: float, highest: float) -> float:
        """Return the mean of the longest interval that leaves the band at opposite faces."""

        def growth(mean: float) -> float:
            ends = [self._left(first, mean)[0], self._right(last, mean)[0]]
            slopes = self.track.at(np.array(ends)).y[1][:, self.column]
            return float(1 / slopes[1] - 1 / slopes[0])

        a, b = lowest, highest
        fa, fb = growth(a), growth(b)
        if not (fa > 0 > fb):
            return a if fa <= 0 else b
        for _ in range(ROUNDS):  # Illinois' rule
            c = b - fb * (b - a) / (fb - fa)
            if c in (a, b):
                break
            fc = growth(c)
            if fc == 0:
                return c
            if (fc > 0) == (fb > 0):
                fa /= 2
            else:
                a, fa = b, fb
            b, fb = c, fc
        return b

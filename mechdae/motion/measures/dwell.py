"""Dwells: driver intervals over which a body or a slide stays within a narrow band."""

from __future__ import annotations

import numpy as np

from mechdae.motion.measures.along_sweep_extremes import Course, stops
from mechdae.motion.measures.track import SAME, TURN, Piece, Sample, Track
from mechdae.types import Floats, Json

ROUNDS = 60
FINE = 1e-13
"""Share of the band within which its middle is known."""
CLOSE = 1e-6
"""Share of the driver's unit within which two dwells are the same one."""


def dwells(track: Track, courses: dict[str, Course], share: float) -> Json:
    """Return the dwells of bodies and slides that move, by the name of the part.

    A dwell contains a stationary position, the quantity stays within `share` of its swing
    from a mean value over it, and of all such intervals around the position it is the longest.
    """
    found = {}
    for course in courses.values():
        if course.quantity.is_output and course.moves and course.range > 0:
            entries = _Finder(track, course, share * course.range).all()
            if entries:
                found[course.quantity.label] = entries
    return found


class _Finder:
    """Dwells of one quantity; places are on the path, a turn beyond the sweep both ways."""

    def __init__(self, track: Track, course: Course, half: float) -> None:
        self.track, self.course, self.half = track, course, half
        self.column = course.quantity.column
        low, high = track.low, track.high
        if track.is_angle and track.reach(low - TURN, high + TURN):
            low, high = low - TURN, high + TURN
        first, last, _ = track.ends()
        self.piece = Piece(max(low, first), min(high, last))
        if self.piece.low >= self.piece.high:
            self.places = self.values = np.zeros(0)
            return
        size = 1.0 if course.quantity.is_angle else track.scale
        (found,) = stops(track, self.piece, [self.column], [size])
        places, peaks, values = [], [], []
        for stop in found:  # of a rest both ends, each with the side it is left to
            one, other = stop.before or stop.after, stop.after or stop.before
            places += [stop.first, stop.last] if stop.rests else [stop.first]
            peaks += [one < 0, other < 0] if stop.rests else [one < 0]
            values += [stop.value] * (1 + stop.rests)
        self.places, self.peaks, self.values = (np.array(a) for a in (places, peaks, values))
        samples = track.sample(self.piece)
        order = np.argsort(np.concatenate([samples.s, self.places]))
        self.s = np.concatenate([samples.s, self.places])[order]
        self.q = np.concatenate([samples.y[0][:, self.column], self.values])[order]

    def all(self) -> list[dict[str, float]]:
        """Return the dwells at stationary positions of the sweep, whole turns aside."""
        track, slack = self.track, SAME * self.track.unit
        windows = [
            (*self._window(i), piece.shift)
            for piece in track.pieces(track.low, track.high)
            for i, s in enumerate(self.places)
            if piece.low - slack <= s <= piece.high + slack
        ]
        chosen = list(dict.fromkeys(windows))
        means = [self._mean(first, last) for first, last, _ in chosen]
        lefts = self._leaves(
            [(first, -1, m) for (first, _, _), m in zip(chosen, means, strict=True)]
        )
        rights = self._leaves([(last, 1, m) for (_, last, _), m in zip(chosen, means, strict=True)])
        found: list[dict[str, float]] = []
        for (_, _, shift), mean, left, right in zip(chosen, means, lefts, rights, strict=True):
            if np.isfinite([left[0], right[0]]).all():
                ends = {"from": left[0] + shift, "to": right[0] + shift}
                entry: dict[str, float] = {**ends, "mean": mean, "within": self.half}
                entry |= {"cut": True} if left[1] or right[1] else {}
                if not any(self._again(entry, other) for other in found):
                    found.append(entry)
        return found

    def _again(self, entry: dict[str, float], other: dict[str, float]) -> bool:
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

    def _mean(self, first: int, last: int) -> float:
        """Return the middle of the band that holds a window's positions the longest."""
        inside = self.values[first : last + 1]
        lowest, highest = float(inside.max()) - self.half, float(inside.min()) + self.half
        starts, ends = (lowest if self.peaks[k] else highest for k in (first, last))
        if self.peaks[first] == self.peaks[last]:
            return starts
        if self._leaves([(first, -1, ends)])[0][1]:
            return ends  # on the other side the motion ends before the band does
        if self._leaves([(last, 1, ends)])[0][1]:
            return starts
        return self._longest(first, last, lowest, highest)

    def _leaves(self, asked: list[tuple[int, int, float]]) -> list[tuple[float, bool]]:
        """Return where bands are left, and whether the motion ends before that.

        Each is asked for by a stationary position, the sense to go on in and the band's middle.
        """
        found: list[tuple[float, bool]] = []
        brackets: list[tuple[int, float, float, bool, float]] = []
        for i, sense, mean in asked:
            s, peak = self.places[i], bool(self.peaks[i])
            level = mean - self.half if peak else mean + self.half
            ahead = np.flatnonzero((self.s - s) * sense > 0)[::sense]
            out = np.flatnonzero((self.q[ahead] < level) if peak else (self.q[ahead] > level))
            found.append((self.piece.high if sense > 0 else self.piece.low, True))
            if out.size:
                k = int(out[0])
                inner, outer = s if k == 0 else self.s[ahead[k - 1]], self.s[ahead[k]]
                low, high = min(inner, outer), max(inner, outer)
                brackets.append((len(found) - 1, low, high, (not peak) == (sense > 0), level))
        if brackets:
            owners, a, b, rising, levels = (np.array(part) for part in zip(*brackets, strict=True))

            def family(sample: Sample) -> tuple[Floats, Floats]:
                q, rate = (array[:, [self.column]] for array in sample.y[:2])
                return q - levels, rate + 0 * levels

            for owner, place in zip(
                owners, self.track.refine(family, np.arange(len(a)), a, b, rising), strict=True
            ):
                found[owner] = (float(place), False)
        return found

    def _longest(self, first: int, last: int, lowest: float, highest: float) -> float:
        """Return the mean of the longest interval that leaves the band at opposite faces."""

        def growth(mean: float) -> float:
            ends = [end for end, _ in self._leaves([(first, -1, mean), (last, 1, mean)])]
            slopes = self.track.at(np.array(ends)).y[1][:, self.column]
            return float(1 / slopes[1] - 1 / slopes[0])

        a, b = lowest, highest
        fa, fb = growth(a), growth(b)
        if not (fa > 0 > fb):
            return a if fa <= 0 else b
        for _ in range(ROUNDS):  # Illinois' rule
            c = b - fb * (b - a) / (fb - fa)
            if abs(c - b) <= FINE * self.half:
                return c
            fc = growth(c)
            if fc == 0:
                return c
            if (fc > 0) == (fb > 0):
                fa /= 2
            else:
                a, fa = b, fb
            b, fb = c, fc
        return b

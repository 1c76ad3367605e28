"""Nets of spatial vectors between points and bodies, many sets of numbers at once, in 80 bits.

Owes nothing to the package. A vector is its head less its tail, of a length, an elevation out of
the x-z plane towards y and an azimuth in it from x towards z; what is not given of it is a
coordinate. Points are placed one after the other by vectors, and a vector between two points that
are placed is three equations. Bodies are those of `dual_quaternions`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.reference.dual_quaternions import (
    EXACT,
    FREEDOMS,
    Loops,
    Pair,
    cross,
    length,
    point_of,
)

WORDS = ("length", "elevation", "azimuth")


@dataclass(frozen=True)
class Arrow:
    """A vector from one point to another, points as numbers; (k,) what is given of it."""

    tail: int
    head: int
    given: Mapping[str, Any]

    @property
    def unknown(self) -> tuple[str, ...]:
        return tuple(word for word in WORDS if word not in self.given)


@dataclass(frozen=True)
class CacheOwner:
    """A point of a body, at (k, 3) in its frame."""

    point: int
    body: int
    place: Any


@dataclass(frozen=True)
class Tie:
    """Two points in one place, or where a length (k,) is given at that distance."""

    first: int
    second: int
    length: Any = None


@dataclass
class Net:
    """What a closure has placed: bodies (k, 8), points (k, 3) by number, coordinates (k, n)."""

    bodies: list[Any]
    points: dict[int, Any]
    values: Any


class Nets(Loops):
    """Coordinates of pairs, then those of vectors; equations of vectors, ties and bars.

    Parameters
    ----------
    pairs
        That place bodies, from the ground on.
    arrows, held, ties
        Vectors, the points of bodies at their ends, further equations between points.
    driven
        Number of a pair, or of a vector after all of them, and of its coordinate.
    sets
        How many sets of numbers.
    """

    def __init__(
        self,
        pairs: list[Pair],
        arrows: list[Arrow],
        held: list[CacheOwner],
        ties: list[Tie],
        driven: tuple[int, int],
        sets: int,
    ) -> None:
        self.pairs, self.meshes, self.sets = pairs, [], sets
        self.arrows, self.held, self.ties = arrows, held, ties
        self.first, self.count = [], 0
        for freedoms in [*(FREEDOMS[p.kind] for p in pairs), *(a.unknown for a in arrows)]:
            self.first.append(self.count)
            self.count += len(freedoms)
        self.driven = self.column(driven)
        self.free = [k for k in range(self.count) if k != self.driven]
        self.order = self._order()
        self.steps = self._steps()

    def _steps(self) -> list[tuple[int, str]]:
        """Return how the vectors are used: they place their head or their tail, or close."""
        known, steps = {own.point for own in self.held}, []
        left = list(range(len(self.arrows)))
        while left:
            for i in left:
                arrow = self.arrows[i]
                told = [arrow.tail in known, arrow.head in known]
                if any(told):
                    steps.append((i, "close" if all(told) else "head" if told[0] else "tail"))
                    known |= {arrow.tail, arrow.head}
                    left.remove(i)
                    break
            else:
                raise ValueError("a vector hangs on nothing")
        return steps

    def chosen(self, which: Any) -> Nets:
        """Return the nets of some of the sets."""
        pairs = [replace(p, own=p.own[which], other=p.other[which]) for p in self.pairs]
        pairs = [replace(p, number=None if p.number is None else p.number[which]) for p in pairs]
        arrows = [
            replace(a, given={word: value[which] for word, value in a.given.items()})
            for a in self.arrows
        ]
        held = [replace(own, place=own.place[which]) for own in self.held]
        ties = [replace(t, length=None if t.length is None else t.length[which]) for t in self.ties]
        chosen = Nets(pairs, arrows, held, ties, (0, 0), len(which))
        chosen.driven, chosen.free = self.driven, self.free
        return chosen

    def triple(self, number: int, c: Any) -> list[Any]:
        """Return length, elevation and azimuth (k,) of a vector."""
        arrow, at = self.arrows[number], self.first[len(self.pairs) + number]
        return [
            arrow.given[word].astype(c.dtype)
            if word in arrow.given
            else c[:, at + arrow.unknown.index(word)]
            for word in WORDS
        ]

    def placed(self, c: Any, spins: dict[int, Any]) -> tuple[Net, Any, Any]:
        """Return the net, the gaps (k, rows) and their slopes (k, rows, n) by the coordinates."""
        bodies, ways, screws, gaps, slopes = self._frames(c, spins)
        points: dict[int, Any] = {}
        moves: dict[int, Any] = {}
        for own in self.held:
            P = point_of(bodies[own.body], own.place.astype(c.dtype))
            turns, shifts = screws[:, :3].swapaxes(1, 2), screws[:, 3:].swapaxes(1, 2)
            speeds = shifts + cross(turns, P.astype(float)[:, None])
            points[own.point], moves[own.point] = P, (ways[own.body][:, None] * speeds)
        for number, use in self.steps:
            arrow = self.arrows[number]
            way, slope = self._way(number, c)
            if use == "head":
                points[arrow.head] = points[arrow.tail] + way
                moves[arrow.head] = moves[arrow.tail] + slope
            elif use == "tail":
                points[arrow.tail] = points[arrow.head] - way
                moves[arrow.tail] = moves[arrow.head] - slope
            else:
                gaps.append(points[arrow.tail] + way - points[arrow.head])
                both = moves[arrow.tail] + slope - moves[arrow.head]
                slopes.append(both.swapaxes(1, 2))
        for tie in self.ties:
            gap = points[tie.second] - points[tie.first]
            both = (moves[tie.second] - moves[tie.first]).swapaxes(1, 2)
            if tie.length is None:
                gaps.append(gap)
                slopes.append(both)
                continue
            whole = length(gap)
            gaps.append(whole - tie.length[:, None].astype(c.dtype))
            slopes.append((gap / whole).astype(float)[:, None] @ both)
        net = Net([bodies[i] for i in sorted(bodies)], points, c)
        return net, np.concatenate(gaps, axis=1), np.concatenate(slopes, axis=1)

    def _way(self, number: int, c: Any) -> tuple[Any, Any]:
        """Return head less tail (k, 3) of a vector and its slopes (k, n, 3)."""
        size, e, a = self.triple(number, c)
        none = np.zeros_like(size)
        u = np.stack([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)], axis=1)
        n = np.stack([-np.sin(e) * np.cos(a), np.cos(e), -np.sin(e) * np.sin(a)], axis=1)
        h = np.stack([-np.sin(a), none, np.cos(a)], axis=1)
        way = size[:, None] * u
        by = {
            "length": u,
            "elevation": size[:, None] * n,
            "azimuth": (size * np.cos(e))[:, None] * h,
        }
        slope = np.zeros((len(c), self.count, 3))
        for i, word in enumerate(self.arrows[number].unknown):
            slope[:, self.first[len(self.pairs) + number] + i] = by[word].astype(float)
        return way, slope


def read_triple(way: Any) -> dict[str, Any]:
    """Return length, elevation and azimuth of (k, 3), of the length above 0."""
    x, y, z = (way[:, i].astype(EXACT) for i in range(3))
    level = np.sqrt(x * x + z * z)
    values = (np.sqrt(level * level + y * y), np.arctan2(y, level), np.arctan2(z, x))
    return dict(zip(WORDS, values, strict=True))

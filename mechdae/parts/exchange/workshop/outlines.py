"""Outlines of parts: arcs, curves and the straight sides between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mechdae.types import Floats, Points

STEP = np.pi / 24
"""Largest turn of a side of polygons that stand for circles."""

NO_SIDE = 1e-9
"""Distance of two arcs that need no side between them, over the size of an outline."""


class CircularArc(NamedTuple):
    """An arc, counterclockwise around its middle; a corner where all three are one place."""

    begin: Floats
    end: Floats
    middle: Floats

    @property
    def radius(self) -> float:
        return float(np.hypot(*(self.begin - self.middle)))

    @property
    def start(self) -> float:
        """Direction of its begin."""
        return float(np.arctan2(*(self.begin - self.middle)[::-1]))

    @property
    def turn(self) -> float:
        """Angle from its begin to its end."""
        last = float(np.arctan2(*(self.end - self.middle)[::-1]))
        return (last - self.start) % (2 * np.pi)

    def points(self, apart: float) -> list[Floats]:
        """Return points from its begin on, without its end."""
        turn, radius = self.turn, self.radius
        if radius == 0:
            return []
        steps = max(1, int(np.ceil(max(turn / STEP, turn * radius / apart) - 1e-9)))
        angles = self.start + turn * np.arange(steps) / steps
        return [self.middle + radius * np.array([np.cos(t), np.sin(t)]) for t in angles]


class Bend(NamedTuple):
    """A cubic curve of Bezier: its ends and the two points between them that it leads to."""

    begin: Floats
    first: Floats
    second: Floats
    end: Floats

    def points(self, apart: float) -> list[Floats]:
        """Return points from its begin on, without its end."""
        steps = max(1, int(np.ceil(np.hypot(*(self.end - self.begin)) / apart)))
        t = (np.arange(steps) / steps)[:, None]
        weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
        return list(weights @ np.array(self))

    def mirrored(self, place: Floats, angle: float) -> Bend:
        """Return it mirrored at a line, from its end to its begin."""
        cos, sin = np.cos(2 * angle), np.sin(2 * angle)
        mirror = np.array([[cos, sin], [sin, -cos]])
        return Bend(*(place + mirror @ (point - place) for point in reversed(self)))


class Outline:
    """A closed line, counterclockwise; circles of one radius around its corners hold it."""

    corners: Points
    radius: float

    def sides(self) -> list[CircularArc | Bend]:
        """Return its arcs and curves; straight sides lead from one to the next."""
        raise NotImplementedError

    def polygon(self, side: float = np.inf, apart: float = np.inf) -> Points:
        """Return points on it (n, 2), arcs at most `STEP` apart in turn.

        Straight sides have points at most `side` apart, arcs and curves at most `apart`.
        """
        points: list[Floats] = []
        sides = self.sides()
        for one, other in zip(sides, sides[1:] + sides[:1], strict=True):
            points += one.points(apart)
            way = other.begin - one.end
            far = float(np.hypot(*way))
            if len(sides) > 1 and far > NO_SIDE * self.radius:
                count = max(1, int(np.ceil(far / side)))
                points += [one.end + way * k / count for k in range(count)]
        return np.array(points)


@dataclass(frozen=True)
class Loop(Outline):
    """The convex hull of circles of one radius around corners, counterclockwise.

    One corner is a circle, two are a slot or a bar with round ends.
    """

    corners: Points
    radius: float

    def grown(self, by: float) -> Loop:
        return Loop(self.corners, self.radius + by)

    def moved(self, turn: float, shift: Floats) -> Loop:
        return Loop(self.corners @ turned(turn).T + shift, self.radius)

    def core(self) -> Loop:
        """Return what is within it all around."""
        return self

    def sides(self) -> list[CircularArc | Bend]:
        count = len(self.corners)
        if count == 1:
            side = np.array([self.radius, 0.0])
            here = self.corners[0]
            return [CircularArc(here - way, here + way, here) for way in (side, -side)]
        found: list[CircularArc | Bend] = []
        for k, corner in enumerate(self.corners):
            before = corner - self.corners[k - 1]
            after = self.corners[(k + 1) % count] - corner
            one, other = (
                self.radius * np.array([way[1], -way[0]]) / np.hypot(*way)
                for way in (before, after)
            )
            found.append(CircularArc(corner + one, corner + other, corner))
        return found


def turned(angle: Floats | float) -> Floats:
    """Return the matrix that turns vectors by an angle, (2, 2), or those of angles, (n, 2, 2)."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.moveaxis(np.array([[cos, -sin], [sin, cos]]), (0, 1), (-2, -1))

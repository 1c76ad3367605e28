"""Outlines of parts: convex hulls of circles, round holes, slots; as arcs and as polygons."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mechdae.parts.exchange.workshop.plates import RING, Kit, Plate, hull
from mechdae.types import Floats, Points

STEP = np.pi / 24
"""Largest turn of a side of polygons that stand for circles."""


@dataclass(frozen=True)
class Loop:
    """The convex hull of circles of one radius around corners, counterclockwise.

    One corner is a circle, two are a slot or a bar with round ends.
    """

    corners: Points
    radius: float

    def grown(self, by: float) -> Loop:
        return Loop(self.corners, self.radius + by)

    @property
    def area(self) -> float:
        """Area of the polygon of corners, of the sides and of the circle."""
        x, y = self.corners.T
        nx, ny = np.roll(x, -1), np.roll(y, -1)
        inside = float(np.sum(x * ny - nx * y)) / 2 if len(x) > 2 else 0.0
        around = float(np.sum(np.hypot(nx - x, ny - y))) if len(x) > 1 else 0.0
        return inside + around * self.radius + np.pi * self.radius**2

    def arcs(self) -> list[tuple[Floats, Floats, Floats]]:
        """Return begin, end and middle of each arc; straight sides lead from one to the next."""
        count = len(self.corners)
        if count == 1:
            side = np.array([self.radius, 0.0])
            here = self.corners[0]
            return [(here - side, here + side, here), (here + side, here - side, here)]
        found = []
        for k, corner in enumerate(self.corners):
            before = corner - self.corners[k - 1]
            after = self.corners[(k + 1) % count] - corner
            one, other = (
                self.radius * np.array([way[1], -way[0]]) / np.hypot(*way)
                for way in (before, after)
            )
            found.append((corner + one, corner + other, corner))
        return found

    def polygon(self, side: float = np.inf) -> Points:
        """Return points on the outline (n, 2), counterclockwise, at most `STEP` apart in turn.

        Straight sides have points at most `side` apart.
        """
        points: list[Floats] = []
        arcs = self.arcs()
        for (begin, end, middle), (after, _, _) in zip(arcs, arcs[1:] + arcs[:1], strict=True):
            a = float(np.arctan2(*(begin - middle)[::-1]))
            b = float(np.arctan2(*(end - middle)[::-1]))
            turn = (b - a) % (2 * np.pi)
            steps = max(1, int(np.ceil(turn / STEP - 1e-9)))
            angles = a + turn * np.arange(steps) / steps
            points += [middle + self.radius * np.array([np.cos(t), np.sin(t)]) for t in angles]
            far = float(np.hypot(*(after - end)))
            if len(arcs) > 1 and far > 0:
                count = max(1, int(np.ceil(far / side)))
                points += [end + (after - end) * k / count for k in range(count)]
        return np.array(points)


@dataclass(frozen=True)
class CutPart:
    """What is cut: an outline with holes, how many of it, and where it belongs."""

    name: str
    outline: Loop
    holes: list[Loop] = field(default_factory=list)
    count: int = 1
    note: str = ""

    @property
    def area(self) -> float:
        """Area without the holes."""
        return self.outline.area - sum(hole.area for hole in self.holes)


def part_of(plate: Plate, kit: Kit, only: set[str] | None = None, name: str = "") -> CutPart:
    """Return a plate as a part, `only` with the holes of some pins."""
    sizes = kit.sizes
    holes = [
        Loop(place[None], kit.hole(pin))
        for pin, place in plate.holes.items()
        if only is None or pin in only
    ]
    holes += [Loop(hull(ends), kit.hole(name)) for name, ends in plate.slots.items()]
    distinct: list[Loop] = []
    for hole in holes:  # several pins at one place are one hole
        if not any(np.array_equal(hole.corners, known.corners) for known in distinct):
            distinct.append(hole)
    return CutPart(name or plate.name, Loop(plate.corners, sizes.width / 2), distinct)


def ring(kit: Kit) -> CutPart:
    """Return a spacer."""
    here = np.zeros((1, 2))
    return CutPart("spacer", Loop(here, RING * kit.sizes.pin / 2), [Loop(here, kit.sizes.hole)])

"""Involute teeth: outlines of wheels and racks, whether a pair of them passes, contact ratios.

A region of teeth is what lies within them: of a wheel its material, of a ring the hole in it, whose
spaces have the shape of a wheel's teeth. All lengths are metres, angles radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from mechdae.parts.exchange.workshop.outlines import Bend, CircularArc, Loop, Outline, turned
from mechdae.types import Floats, Points

TIP, ROOT = 1.0, 1.25
"""Addendum and dedendum, in modules."""
SHAPE = 2e-7
"""How far curves of an outline may be off the involute, in modules."""
ROLLED = 128
"""Places of a pitch in which a pair of wheels is looked at."""
DENSE = 0.01
"""Distance of points on teeth that are looked at, in modules."""
FAR = 0.5
"""Distance from the teeth of the mate beyond which points are not looked at, in modules."""


def involute(angle: Floats | float) -> Floats:
    """Return tan(a) - a: the polar angle that an involute reaches where its pressure angle is a."""
    found: Floats = np.tan(angle) - angle
    return found


@dataclass(frozen=True)
class Teeth:
    """Teeth of a wheel, a ring or a rack, in the frame of their body.

    Attributes
    ----------
    place
        Centre; of a rack the middle of its pitch line.
    count
        Teeth; of a rack those that are cut.
    radius
        Of the pitch circle; of a rack infinite.
    module, pressure
        Module and pressure angle, the same of all that mesh.
    phase
        Direction of a tooth's middle; of a rack that of the pitch line, with teeth on its left.
    thin
        By how much a tooth is thinner than half of a pitch.
    inside
        Whether they are the teeth of a ring.
    tip
        Addendum.
    """

    place: Floats
    count: int
    radius: float
    module: float
    pressure: float
    phase: float = 0.0
    thin: float = 0.0
    inside: bool = False
    tip: float = 0.0

    @property
    def straight(self) -> bool:
        """Whether this is a rack."""
        return not np.isfinite(self.radius)

    @property
    def sense(self) -> int:
        """Whether tips are farther out than roots: 1, of a ring -1."""
        return -1 if self.inside else 1

    @property
    def base(self) -> float:
        """Radius of the base circle; of a rack the cosine of the pressure angle."""
        return (1.0 if self.straight else self.radius) * float(np.cos(self.pressure))

    @property
    def top(self) -> float:
        """Radius of the tips; of a rack their height."""
        return (0.0 if self.straight else self.radius) + self.sense * self.tip

    @property
    def bottom(self) -> float:
        """Radius of the roots; of a rack their height."""
        return (0.0 if self.straight else self.radius) - self.sense * ROOT * self.module

    @property
    def low(self) -> float:
        """Least radius of the region's teeth; of a rack their least height."""
        return min(self.top, self.bottom)

    @property
    def high(self) -> float:
        """Largest radius of the region's teeth; of a rack their largest height."""
        return max(self.top, self.bottom)

    @property
    def pitch(self) -> float:
        """Angle of a pitch; of a rack its length."""
        return np.pi * self.module if self.straight else 2 * np.pi / self.count

    @property
    def tangent(self) -> float:
        """Length of a tangent of the base circle up to the tips."""
        return float(np.sqrt(max(self.top**2 - self.base**2, 0.0)))

    @cached_property
    def wide(self) -> float:
        """Half of the angle of a region's tooth on the base circle; of a rack of its breadth."""
        if self.straight:
            return self.pitch / 4 - self.thin / 2
        thin = self.sense * self.thin
        return float(self.pitch / 4 - thin / (2 * self.radius) + involute(self.pressure))

    def half(self, height: Floats | float, by: float = 0.0) -> Floats:
        """Return half of the angle of the region's tooth at radii, radial below the base circle.

        Of a rack half of its breadth at heights. The outline is `by` larger.
        """
        at = np.asarray(height, float)
        if self.straight:
            slope: Floats = at * np.tan(self.pressure)
        else:
            slope = involute(np.arccos(self.base / np.maximum(at, self.base)))
        return self.wide + by / self.base - slope

    def height(self, points: Points) -> Floats:
        """Return the radii of points (..., 2) from `place`; of a rack their heights."""
        found: Floats = np.hypot(points[..., 0], points[..., 1])
        return points[..., 1] if self.straight else found

    def gaps(self, points: Points) -> Floats:
        """Return how far points (n, 2) are from the material at least, below 0 inside of it.

        Points are from `place`, turned so that a tooth's middle is on the x axis; of a rack the
        pitch line is.
        """
        height, start = self.height(points), 0.5 if self.inside else 0.0  # a ring's space
        place = points[:, 0] if self.straight else np.arctan2(points[:, 1], points[:, 0])
        off = np.abs((place / self.pitch - start + 0.5) % 1 - 0.5) * self.pitch
        arm = self.base if self.straight else np.minimum(height, self.base)
        side = self.sense * arm * (off - self.half(height))
        above_root, above_tip = (self.sense * (height - end) for end in (self.bottom, self.top))
        found: Floats = np.maximum(np.minimum(side, above_root), above_tip)
        return found

    @property
    def note(self) -> str:
        """What they are, for the list of parts [mm, deg]."""
        found = (
            f"{self.count} teeth; module {self.module * 1e3:.6g} mm; pressure angle "
            f"{np.degrees(self.pressure):.6g} deg; addendum {self.tip / self.module:.4g} modules"
        )
        if not self.straight and not self.inside and self.low < self.base:
            found += "; flanks radial below the base circle"
        return found

    # -- outlines --------------------------------------------------------------------------

    def frame(self, back: float, top: float | None = None, inset: float = 0.0) -> Points:
        """Return the centre, or the corners of a rack's rectangle up to a height."""
        if not self.straight:
            return self.place[None]
        end = self.count * self.pitch / 2 - inset
        high, low = (self.top if top is None else top) - inset, self.bottom - back + inset
        corners = np.array([(-end, low), (end, low), (end, high), (-end, high)])
        return self.place + corners @ turned(self.phase).T

    def sides(self, by: float, back: float) -> list[CircularArc | Bend]:
        """Return the region's outline, `by` larger; of a rack with `back` below its roots."""
        if self.straight:
            return self._row(by, back)
        start = self.phase + (self.pitch / 2 if self.inside else 0.0)
        middles = start + self.pitch * np.arange(self.count)
        return [side for middle in middles for side in self._tooth(float(middle), by)]

    def _tooth(self, middle: float, by: float) -> list[CircularArc | Bend]:
        """Return a tooth: half of a root, flank, tip, flank, half of a root."""
        low, high = self.low + by, self.high + by
        ends = np.maximum([low, high], self.base) / self.base
        first, last = np.sqrt(ends**2 - 1).tolist()
        bound = self.base * (3 + last) / 384 / (SHAPE * self.module)
        rolls = np.linspace(first, last, 1 + max(2, int(np.ceil((last - first) * bound**0.25))))
        right = [self._bend(a, b, middle, by) for a, b in pairwise(rolls)]
        left = [bend.mirrored(self.place, middle) for bend in reversed(right)]
        foot = float(self.half(low, by))
        roots = [
            self.place + low * turned(middle + angle)[:, 0]
            for angle in (-self.pitch / 2, -foot, foot, self.pitch / 2)
        ]
        return [
            CircularArc(roots[0], roots[1], self.place), *right,
            CircularArc(right[-1].end, left[0].begin, self.place), *left,
            CircularArc(roots[2], roots[3], self.place),
        ]  # fmt: skip

    def _bend(self, first: float, last: float, middle: float, by: float) -> Bend:
        """Return a curve along the right flank between two angles of roll, outwards."""
        start = turned(middle - self.wide - by / self.base)
        ends, ways = [], []
        for roll in (first, last):
            out, across = turned(roll).T
            ends.append(self.place + start @ (self.base * (out - roll * across)))
            ways.append(start @ (self.base * roll * out) * (last - first) / 3)
        return Bend(ends[0], ends[0] + ways[0], ends[1] - ways[1], ends[1])

    def _row(self, by: float, back: float) -> list[CircularArc | Bend]:
        """Return a rack: its teeth from the right to the left, then its back."""
        low, high = self.bottom + by, self.top + by
        end = self.count * self.pitch / 2 + by
        corners = [(end, low)]
        for k in reversed(range(self.count)):
            middle = (k - (self.count - 1) / 2) * self.pitch
            for height, sense in ((low, 1), (high, 1), (high, -1), (low, -1)):
                half = float(self.half(height - by, by))
                corners.append((middle + sense * half, height))
        corners += [(-end, low), (-end, low - back - 2 * by), (end, low - back - 2 * by)]
        places = self.place + np.array(corners) @ turned(self.phase).T
        return [CircularArc(place, place, place) for place in places]

    def dense(self) -> Points:
        """Return points of a wheel's tooth at most `DENSE` modules apart, its middle on x."""
        plain = replace(self, place=np.zeros(2))
        return np.array(
            [p for side in plain._tooth(0.0, 0.0) for p in side.points(DENSE * self.module)]
        )


@dataclass(frozen=True)
class ToothedLoop(Outline):
    """The outline of a wheel, of the hole in a ring, or of a rack with `back` below its roots."""

    teeth: Teeth
    back: float = 0.0
    by: float = 0.0

    @property
    def corners(self) -> Points:  # type: ignore[override]
        return self.teeth.frame(self.back)

    @property
    def radius(self) -> float:  # type: ignore[override]
        return (0.0 if self.teeth.straight else self.teeth.high) + self.by

    def grown(self, by: float) -> ToothedLoop:
        return replace(self, by=self.by + by)

    def moved(self, turn: float, shift: Floats) -> ToothedLoop:
        place = turned(turn) @ self.teeth.place + shift
        return replace(self, teeth=replace(self.teeth, place=place, phase=self.teeth.phase + turn))

    def core(self) -> Loop:
        """Return what is within it all around."""
        if not self.teeth.straight:
            return Loop(self.corners, self.teeth.low)
        inset = self.back / 4
        top = self.teeth.bottom - self.teeth.top
        return Loop(self.teeth.frame(self.back, top, inset), inset)

    def sides(self) -> list[CircularArc | Bend]:
        return self.teeth.sides(self.by, self.back)


# -- pairs ---------------------------------------------------------------------------------


def addendum(one: Teeth, mate: Teeth, far: float) -> float:
    """Return the addendum of teeth: they end where the flanks of their mate begin.

    Beyond the point where the line of action touches the mate's base circle there is no involute.
    """
    standard = TIP * one.module
    if mate.straight or mate.inside:
        return standard
    sin = float(np.sin(one.pressure))
    if one.straight:
        return min(standard, mate.radius * sin**2)
    limit = float(np.hypot(one.base, far * sin))
    return min(standard, one.radius - limit if one.inside else limit - one.radius)


def contact_ratio(one: Teeth, mate: Teeth, far: float) -> float:
    """Return how many pairs of teeth are in contact in the mean; `one` is no ring or rack."""
    sin, cos = float(np.sin(one.pressure)), float(np.cos(one.pressure))
    if mate.straight:
        beyond = mate.tip / sin - one.radius * sin
    else:
        beyond = mate.sense * (mate.tangent - far * sin)
    return (one.tangent + beyond) / (np.pi * one.module * cos)


def least_gap(one: Teeth, mate: Teeth, far: float) -> tuple[float, float]:
    """Return the least gap of a wheel and its mate over a pitch of rolling, and a bound below it.

    Points of the wheel's teeth are `DENSE` modules apart and places of the roll a `ROLLED`-th of a
    pitch; the bound takes off how far the outline may get between them.
    """
    tooth, step = one.dense(), one.pitch / ROLLED
    rolled = np.linspace(0.0, one.pitch, ROLLED, endpoint=False)
    ratio = mate.sense * one.radius / mate.radius  # 0 of a rack
    start = np.pi / 2 if mate.straight else mate.pitch / 2 + (0.0 if mate.inside else np.pi)
    frames = turned(start - ratio * rolled)
    along = mate.pitch / 2 - one.radius * rolled if mate.straight else 0.0 * rolled
    least = bound = FAR * one.module
    half = one.count // 2 + 1
    for teeth in (range(half), range(-1, -half, -1)):  # from the pitch point on, either way
        for k in teeth:
            points = tooth @ turned(-(rolled + k * one.pitch))
            local = (points - [mate.sense * far, 0.0]) @ frames
            local[..., 0] += along[:, None]
            near = mate.sense * (mate.height(local) - mate.top) < FAR * one.module
            if not near.any():
                break
            gaps = mate.gaps(local[near])
            arm = np.hypot(*(points[near] - [one.radius, 0.0]).T)
            least = min(least, float(gaps.min()))
            bound = min(bound, float((gaps - arm * (1 + ratio) * step / 2).min()))
    return least, bound - DENSE * one.module / 2

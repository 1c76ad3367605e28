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
    def base(self) -> float:
        """Radius of the base circle."""
        return self.radius * float(np.cos(self.pressure))

    @property
    def top(self) -> float:
        """Radius of the tips; of a rack their height."""
        if self.straight:
            return self.tip
        return self.radius + (-self.tip if self.inside else self.tip)

    @property
    def bottom(self) -> float:
        """Radius of the roots; of a rack their height."""
        deep = ROOT * self.module
        if self.straight:
            return -deep
        return self.radius + (deep if self.inside else -deep)

    @property
    def low(self) -> float:
        """Least radius of the region's teeth."""
        return min(self.top, self.bottom)

    @property
    def high(self) -> float:
        """Largest radius of the region's teeth."""
        return max(self.top, self.bottom)

    @property
    def pitch(self) -> float:
        """Angle of a pitch; of a rack its length."""
        return np.pi * self.module if self.straight else 2 * np.pi / self.count

    @cached_property
    def wide(self) -> float:
        """Half of the angle of a region's tooth on the base circle."""
        thin = -self.thin if self.inside else self.thin
        return float(self.pitch / 4 - thin / (2 * self.radius) + involute(self.pressure))

    def half(self, radius: Floats | float, by: float = 0.0) -> Floats:
        """Return half of the angle of the region's tooth at radii, radial below the base circle."""
        at = np.maximum(np.asarray(radius, float), self.base)
        found: Floats = self.wide + by / self.base - involute(np.arccos(self.base / at))
        return found

    def breadth(self, height: Floats | float) -> Floats:
        """Return half of the breadth of a rack's tooth at heights above the pitch line."""
        middle = self.pitch / 4 - self.thin / 2
        found: Floats = middle - np.asarray(height, float) * np.tan(self.pressure)
        return found

    def gaps(self, points: Points) -> Floats:
        """Return how far points (n, 2) are from the material at least, below 0 inside of it.

        Points are from `place`, turned so that a tooth's middle is on the x axis; of a rack the
        pitch line is.
        """
        found: Floats
        if self.straight:
            x, height = points.T
            along = np.abs((x / self.pitch + 0.5) % 1 - 0.5) * self.pitch
            side = (along - self.breadth(height)) * np.cos(self.pressure)
            found = np.maximum(np.minimum(side, height - self.bottom), height - self.top)
            return found
        radius = np.hypot(points[:, 0], points[:, 1])
        start = 0.5 if self.inside else 0.0  # the middle of a ring's space
        share = np.arctan2(points[:, 1], points[:, 0]) / self.pitch - start
        angle = np.abs((share + 0.5) % 1 - 0.5) * self.pitch
        side = np.minimum(radius, self.base) * (angle - self.half(radius))
        if self.inside:
            found = np.maximum(np.minimum(-side, self.high - radius), self.low - radius)
        else:
            found = np.maximum(np.minimum(side, radius - self.low), radius - self.high)
        return found

    @property
    def note(self) -> str:
        """What they are, for the list of parts [mm, deg]."""
        found = f"{self.count} teeth; module {self.module * 1e3:.6g} mm; pressure angle "
        found += (
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
        first, last = (
            float(np.sqrt(max((r / self.base) ** 2 - 1, 0.0))) for r in (max(low, self.base), high)
        )
        bound = self.base * (3 + last) / 384 / (SHAPE * self.module)
        rolls = np.linspace(first, last, 1 + max(2, int(np.ceil((last - first) * bound**0.25))))
        right = [self._bend(a, b, middle, by) for a, b in pairwise(rolls)]
        left = [bend.mirrored(self.place, middle) for bend in reversed(right)]
        foot = float(self.half(low, by))
        roots = [
            self.place + turned(middle + angle) @ [low, 0.0]
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
        wider = by / np.cos(self.pressure)
        end = self.count * self.pitch / 2 + by
        corners = [(end, low)]
        for k in reversed(range(self.count)):
            middle = (k - (self.count - 1) / 2) * self.pitch
            for height, sense in ((low, 1), (high, 1), (high, -1), (low, -1)):
                half = float(self.breadth(height - by)) + wider
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
    along = float(np.sqrt(max(one.top**2 - one.base**2, 0.0)))
    if mate.straight:
        along += mate.tip / sin - one.radius * sin
    else:
        there = float(np.sqrt(max(mate.top**2 - mate.base**2, 0.0)))
        along += far * sin - there if mate.inside else there - far * sin
    return along / (np.pi * one.module * cos)


def least_gap(one: Teeth, mate: Teeth, far: float) -> tuple[float, float]:
    """Return the least gap of a wheel and its mate over a pitch of rolling, and a bound below it.

    Points of the wheel's teeth are `DENSE` modules apart and places of the roll a `ROLLED`-th of a
    pitch; the bound takes off how far the outline may get between them.
    """
    tooth, step = one.dense(), one.pitch / ROLLED
    sense = -1.0 if mate.inside else 1.0
    rate = 1.0 if mate.straight else 1 + sense * one.radius / mate.radius
    least = bound = FAR * one.module
    for k in _nearby(one, mate, far):
        turn = (np.arange(ROLLED) * step + k * one.pitch)[:, None]
        x, y = np.cos(turn), np.sin(turn)
        points = np.stack(
            [x * tooth[:, 0] - y * tooth[:, 1], y * tooth[:, 0] + x * tooth[:, 1]], -1
        )
        rolled = np.arange(ROLLED)[:, None] * step
        if mate.straight:
            along = points[..., 1] - one.radius * rolled + mate.pitch / 2
            local = np.stack([along, one.radius - points[..., 0]], -1)
            near = local[..., 1] < mate.top + FAR * one.module
        else:
            local = points - [sense * far, 0.0]
            start = mate.pitch / 2 + (0.0 if mate.inside else np.pi)
            there = -start + sense * one.radius / mate.radius * rolled
            cos, sin = np.cos(there), np.sin(there)
            a, b = local[..., 0], local[..., 1]
            local = np.stack([cos * a - sin * b, sin * a + cos * b], -1)
            size, close = np.hypot(a, b), FAR * one.module
            near = size > mate.low - close if mate.inside else size < mate.high + close
        if near.any():
            gaps = mate.gaps(local[near])
            arm = np.hypot(*(points[near] - [one.radius, 0.0]).T)
            least = min(least, float(gaps.min()))
            bound = min(bound, float((gaps - arm * rate * step / 2).min()))
    return least, bound - DENSE * one.module / 2


def _nearby(one: Teeth, mate: Teeth, far: float) -> list[int]:
    """Return the teeth of a wheel that get near those of its mate within a pitch."""
    turns = (np.arange(one.count) * one.pitch + np.pi) % (2 * np.pi) - np.pi
    angle = np.maximum(np.abs(turns) - 1.5 * one.pitch, 0.0)
    close = FAR * one.module
    if mate.straight:
        found = one.high * np.cos(angle) > one.radius - mate.top - close
    elif mate.inside:
        found = np.hypot(far + one.high * np.cos(angle), one.high * np.sin(angle)) > (
            mate.low - close
        )
    else:
        size = np.clip(far * np.cos(angle), one.low, one.high)
        found = np.hypot(far - size * np.cos(angle), size * np.sin(angle)) < mate.high + close
    return [int(k) for k in np.flatnonzero(found)]

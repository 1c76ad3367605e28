"""Platforms on three legs for the tests, and a count of their poses that owes nothing to mechdae.

`Platform` draws a random pose and legs that close there, writes them as a mechanism (bodies,
joints, frames of any orientation) and as conditions on the pose z, w = exp(i phi) in complex
80-bit numbers. `scan` intersects the loci of two legs over a grid of phi and bisects the third
leg's condition.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass

import numpy as np

import mechdae as md

LONG = np.clongdouble
KINDS = ("RR", "distance", "PR", "RP", "ground slot", "plate slot")
CIRCLES = ("RR", "distance")


@dataclass
class Condition:
    """A circle |z + w m - b| = l, or Im((frame) conj(d)) = 0 with a direction d.

    Of a "ground line" the frame is z + w m - b, of a "plate line" (b - z) / w - m.
    """

    kind: str
    b: complex
    m: complex
    length: float = 0.0
    d: complex = 1.0

    def centre(self, w):
        return LONG(self.b) - w * LONG(self.m)

    def linear(self, w):
        """Return n, c of Re(conj(n) z) = c."""
        if self.kind == "ground line":
            n = 1j * LONG(self.d) + 0 * w
            return n, np.real(np.conj(n) * self.centre(w))
        n = 1j * LONG(self.d) * w
        return n, np.real(np.conj(n) * (LONG(self.b) - w * LONG(self.m)))

    def miss(self, z, w):
        if self.kind == "circle":
            return np.abs(z - self.centre(w)) - np.longdouble(self.length)
        n, c = self.linear(w)
        return np.real(np.conj(n) * z) - c


def meet(one: Condition, other: Condition, w):
    """Return the two places where the loci of two legs meet, nan where they do not."""
    if one.kind != "circle":
        n1, c1 = one.linear(w)
        if other.kind != "circle":
            n2, c2 = other.linear(w)
            z = 1j * (c2 * n1 - c1 * n2) / np.imag(np.conj(n1) * n2)
            return [z]
        centre, radius = other.centre(w), np.longdouble(other.length)
        off = c1 - np.real(np.conj(n1) * centre)
        half = np.sqrt(radius**2 - off**2)
        return [centre + n1 * off + s * 1j * n1 * half for s in (1, -1)]
    a, b = one.centre(w), other.centre(w)
    gap = np.abs(b - a)
    n = (b - a) / gap
    r1, r2 = np.longdouble(one.length), np.longdouble(other.length)
    off = (gap + (r1 - r2) * (r1 + r2) / gap) / 2
    half = np.sqrt((r1 - off) * (r1 + off))
    return [a + n * off + s * 1j * n * half for s in (1, -1)]


TURN = (-np.pi, np.pi)


def scan(conditions, count: int = 2000, span=TURN) -> list[tuple[float, complex]]:
    """Return phi and z of all poses by sign changes over a grid of phi and bisection."""
    first, second, third = sorted(conditions, key=lambda c: c.kind == "circle")
    size = max(abs(c.b) + abs(c.m) + c.length for c in conditions)
    found = []
    with np.errstate(invalid="ignore", divide="ignore"):
        grid = edges(first, second, count, span)
        for branch in range(len(meet(first, second, np.exp(1j * grid[:1])))):

            def miss(phi, branch=branch):
                w = np.exp(1j * np.asarray(phi, np.clongdouble))
                value = third.miss(meet(first, second, w)[branch], w)
                if second.kind == "circle":
                    return value
                # no poles where two lines are parallel
                area = np.imag(np.conj(first.linear(w)[0]) * second.linear(w)[0])
                return value * (np.abs(area) if third.kind == "circle" else area)

            values = miss(grid)
            changes = np.flatnonzero(values[:-1] * values[1:] < 0)
            low, high = grid[changes].copy(), grid[changes + 1].copy()
            before = values[changes]
            for _ in range(70):
                middle = (low + high) / 2
                same = miss(middle) * before > 0
                low, high = np.where(same, middle, low), np.where(same, high, middle)
            for phi in (low + high) / 2:
                w = np.exp(1j * phi)
                z = meet(first, second, np.array([w]))[branch][0]
                if abs(third.miss(z, w)) < 1e-12 * size:  # not a pole
                    found.append((float(phi), complex(z)))
    return found


def edges(first: Condition, second: Condition, count: int, span):
    """Return a grid of phi with the ends of the arcs on which two loci meet put in."""
    grid = np.linspace(np.longdouble(span[0]), np.longdouble(span[1]), count + 1)

    def real(phi):
        return ~np.isnan(meet(first, second, np.exp(1j * phi.astype(LONG)))[0].real)

    inside = real(grid)
    extra = []
    for k in np.flatnonzero(inside[:-1] != inside[1:]):
        low, high = grid[k], grid[k + 1]
        if inside[k + 1]:
            low, high = high, low  # low is real
        for _ in range(70):
            middle = (low + high) / 2
            low, high = (middle, high) if real(np.array([middle]))[0] else (low, middle)
        extra.append(low)
    return np.sort(np.concatenate([grid, extra]))


class Platform:
    """A random platform on three legs of given kinds, closed at a pose z0, phi0."""

    def __init__(self, kinds, random, size: float = 1.0) -> None:
        self.random, self.size = random, size
        self.phi0 = random.uniform(-3, 3)
        self.z0 = self._draw()
        self.w0 = cmath.rect(1, self.phi0)
        self.conditions, self.points, self.bodies, self.joints = [], {}, [], []
        self.plate = {}
        for k, kind in enumerate(kinds, start=1):
            {
                "RR": self._bar,
                "distance": self._bar,
                "ground slot": self._slot,
                "plate slot": self._slot,
                "PR": self._slider,
                "RP": self._sled,
            }[kind](k, kind)

    def _draw(self, size: float = 1.0) -> complex:
        return complex(*self.random.normal(size=2)) * size * self.size

    def _bar(self, k: int, kind: str) -> None:
        """A link with two pins, or the distance of two points."""
        b, m = self._draw(1.5), self._draw()
        length = abs(self.z0 + self.w0 * m - b)
        self.conditions.append(Condition("circle", b, m, length))
        self._ground(f"P{k}", b)
        self._plate(f"Q{k}", m)
        ends = (f"ground.P{k}", f"plate.Q{k}")
        if kind == "distance":
            self._joint(md.Distance, f"J{k}", *ends, swap=True, length=length)
            return
        root, turn = self._draw(0.4), cmath.rect(1, self.random.uniform(-3, 3))
        self._body(f"leg{k}", {"S": root, "T": root + length * turn})
        self._joint(md.Revolute, f"J{k}", ends[0], f"leg{k}.S", swap=True)
        self._joint(md.Revolute, f"K{k}", ends[1], f"leg{k}.T", swap=True)

    def _slot(self, k: int, kind: str) -> None:
        """A pin of the plate in a slot of the ground, or the other way round."""
        alpha = self.random.uniform(-3, 3)
        d = cmath.rect(1, alpha)
        if kind == "ground slot":
            m = self._draw()
            at = self.z0 + self.w0 * m
            self.conditions.append(Condition("ground line", at, m, d=d))
            self._ground(f"P{k}", at + 0.7 * self.size * d)
            self._plate(f"Q{k}", m)
            ends = (f"ground.P{k}", f"plate.Q{k}")
        else:
            b = self._draw(1.5)
            local = (b - self.z0) / self.w0
            self.conditions.append(Condition("plate line", b, local, d=d))
            self._ground(f"P{k}", b)
            self._plate(f"Q{k}", local - 0.6 * self.size * d)
            ends = (f"plate.Q{k}", f"ground.P{k}")
        self._joint(md.PinInSlot, f"J{k}", *ends, axis=alpha)

    def _slider(self, k: int, kind: str) -> None:
        """A slider on a guide of the ground, at the angle tau, whose pin carries the plate."""
        m, offset = self._draw(), self._draw(0.4)
        alpha, tau = self.random.uniform(-3, 3, 2)
        d, at = cmath.rect(1, alpha), self.z0 + self.w0 * m
        self.conditions.append(Condition("ground line", at, m, d=d))
        self._body(f"leg{k}", {"S": 0j, "T": offset})
        self._ground(f"P{k}", at - cmath.rect(1, tau) * offset + 0.3 * self.size * d)
        self._plate(f"Q{k}", m)
        self._joint(md.Revolute, f"K{k}", f"plate.Q{k}", f"leg{k}.T", swap=True)
        self._guide(k, f"ground.P{k}", alpha, tau)

    def _sled(self, k: int, kind: str) -> None:
        """A sled pinned to the ground, at the angle tau to the plate, on which it slides."""
        b, offset = self._draw(1.5), self._draw(0.4)
        alpha, tau = self.random.uniform(-3, 3, 2)
        d, local = cmath.rect(1, alpha), (b - self.z0) / self.w0
        self.conditions.append(Condition("plate line", b, local, d=d))
        self._body(f"leg{k}", {"S": 0j, "T": offset})
        self._ground(f"P{k}", b)
        self._plate(f"Q{k}", local - cmath.rect(1, tau) * offset - 0.2 * self.size * d)
        self._joint(md.Revolute, f"K{k}", f"ground.P{k}", f"leg{k}.T", swap=True)
        self._guide(k, f"plate.Q{k}", alpha, tau)

    def _guide(self, k: int, hub: str, alpha: float, tau: float) -> None:
        """A prismatic pair, the guide on either of the two bodies."""
        if self.random.random() < 0.5:
            self._joint(md.Prismatic, f"J{k}", hub, f"leg{k}.S", axis=alpha, turn=tau)
        else:
            self._joint(md.Prismatic, f"J{k}", f"leg{k}.S", hub, axis=alpha - tau, turn=-tau)

    def _ground(self, name, place) -> None:
        self.points[name] = (place.real, place.imag)

    def _plate(self, name, place) -> None:
        self.plate[name] = (place.real, place.imag)

    def _body(self, name, points) -> None:
        self.bodies.append(md.Body(name, {n: (z.real, z.imag) for n, z in points.items()}))

    def _joint(self, kind, name, first, second, swap=False, **numbers) -> None:
        if swap and self.random.random() < 0.5:
            first, second = second, first
        self.joints.append(kind(name, first, second, **numbers))

    def mechanism(self, order=None) -> md.Mechanism:
        """Return the platform, with a driven crank beside it that moves nothing."""
        bodies = [
            md.Body("idle", {"O": (0, 0), "A": (self.size, 0)}),
            md.Body("plate", {"Z": (0, 0), **self.plate}),
            *self.bodies,
        ]
        joints = [md.Revolute("idle_pin", "ground.O", "idle.O"), *self.joints]
        if order is not None:
            order.shuffle(bodies)
            order.shuffle(joints)
        ground = md.Ground({"O": (0.0, 0.0), **self.points})
        return md.Mechanism(ground=ground, bodies=bodies, joints=joints)

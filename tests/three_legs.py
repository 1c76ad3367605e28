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
    l: float = 0.0
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
            return np.abs(z - self.centre(w)) - np.longdouble(self.l)
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
        centre, radius = other.centre(w), np.longdouble(other.l)
        off = c1 - np.real(np.conj(n1) * centre)
        half = np.sqrt(radius**2 - off**2)
        return [centre + n1 * off + s * 1j * n1 * half for s in (1, -1)]
    a, b = one.centre(w), other.centre(w)
    gap = np.abs(b - a)
    n = (b - a) / gap
    r1, r2 = np.longdouble(one.l), np.longdouble(other.l)
    off = (gap + (r1 - r2) * (r1 + r2) / gap) / 2
    half = np.sqrt((r1 - off) * (r1 + off))
    return [a + n * off + s * 1j * n * half for s in (1, -1)]


def scan(conditions, count: int = 6000) -> np.ndarray:
    """Return phi and z of all poses, (k,) each, by sign changes over a grid and bisection."""
    first, second, third = sorted(conditions, key=lambda c: c.kind == "circle")
    size = max(abs(c.b) + abs(c.m) + c.l for c in conditions)
    found = []
    with np.errstate(invalid="ignore"):
        grid = edges(first, second, count)
        for branch in range(len(meet(first, second, np.exp(1j * grid[:1])))):

            def miss(phi, branch=branch):
                w = np.exp(1j * np.asarray(phi, np.clongdouble))
                return third.miss(meet(first, second, w)[branch], w)

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
                    found.append((phi, z))
    return found


def edges(first: Condition, second: Condition, count: int):
    """Return a grid of phi with the ends of the arcs on which two loci meet put in."""
    grid = np.linspace(np.longdouble(-np.pi), np.longdouble(np.pi), count + 1)

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
        self.kinds, self.size = kinds, size
        self.phi0 = random.uniform(-3, 3)
        self.z0 = complex(*random.normal(size=2)) * size
        w0 = cmath.rect(1, self.phi0)
        self.conditions, self.points, self.bodies, self.joints = [], {}, [], []
        self.plate = {}
        for k, kind in enumerate(kinds, start=1):
            m = complex(*random.normal(size=2)) * size
            b = complex(*random.normal(size=2)) * size * 1.5
            alpha, tau, beta = random.uniform(-3, 3, 3)
            d = cmath.rect(1, alpha)
            at = self.z0 + w0 * m  # the leg's point of the plate
            swap = random.random() < 0.5
            leg, pin, end = f"leg{k}", f"P{k}", f"Q{k}"
            offset = complex(*random.normal(size=2)) * size * 0.4
            if kind in CIRCLES:
                length = abs(at - b)
                self.conditions.append(Condition("circle", b, m, length))
                self._ground(pin, b)
                self._plate(end, m)
                if kind == "distance":
                    self._joint(md.Distance, f"J{k}", f"ground.{pin}", f"plate.{end}", swap, length=length)
                else:
                    root = offset
                    self._body(leg, {"S": root, "T": root + length * cmath.rect(1, beta)})
                    self._joint(md.Revolute, f"J{k}", f"ground.{pin}", f"{leg}.S", swap)
                    self._joint(md.Revolute, f"K{k}", f"plate.{end}", f"{leg}.T", not swap)
                continue
            if kind == "ground slot":
                self.conditions.append(Condition("ground line", at, m, d=d))
                self._ground(pin, at + 0.7 * size * d)
                self._plate(end, m)
                self._joint(md.PinInSlot, f"J{k}", f"ground.{pin}", f"plate.{end}", axis=alpha)
            elif kind == "plate slot":
                local = (b - self.z0) / w0
                self.conditions.append(Condition("plate line", b, local, d=d))
                self._ground(pin, b)
                self._plate(end, local - 0.6 * size * d)
                self._joint(md.PinInSlot, f"J{k}", f"plate.{end}", f"ground.{pin}", axis=alpha)
            elif kind == "PR":
                # a slider at the angle tau pinned to the plate; its other point is on the guide
                self.conditions.append(Condition("ground line", at, m, d=d))
                self._body(leg, {"S": 0j, "T": offset})
                guide = at - cmath.rect(1, tau) * offset
                self._ground(pin, guide + 0.3 * size * d)
                self._plate(end, m)
                self._joint(md.Revolute, f"K{k}", f"plate.{end}", f"{leg}.T", swap)
                if random.random() < 0.5:
                    self._joint(md.Prismatic, f"J{k}", f"ground.{pin}", f"{leg}.S", axis=alpha, turn=tau)
                else:
                    self._joint(md.Prismatic, f"J{k}", f"{leg}.S", f"ground.{pin}", axis=alpha - tau, turn=-tau)
            else:
                # a sled pinned to the ground that slides along the plate
                local = (b - self.z0) / w0
                self.conditions.append(Condition("plate line", b, local, d=d))
                self._body(leg, {"S": 0j, "T": offset})
                guide = local - cmath.rect(1, tau) * offset
                self._ground(pin, b)
                self._plate(end, guide - 0.2 * size * d)
                self._joint(md.Revolute, f"K{k}", f"ground.{pin}", f"{leg}.T", swap)
                if random.random() < 0.5:
                    self._joint(md.Prismatic, f"J{k}", f"plate.{end}", f"{leg}.S", axis=alpha, turn=tau)
                else:
                    self._joint(md.Prismatic, f"J{k}", f"{leg}.S", f"plate.{end}", axis=alpha - tau, turn=-tau)

    def _ground(self, name, place) -> None:
        self.points[name] = (place.real, place.imag)

    def _plate(self, name, place) -> None:
        self.plate[name] = (place.real, place.imag)

    def _body(self, name, points) -> None:
        self.bodies.append(md.Body(name, {n: (z.real, z.imag) for n, z in points.items()}))

    def _joint(self, kind, name, first, second, swap=False, **numbers) -> None:
        first, second = (second, first) if swap else (first, second)
        self.joints.append(kind(name, first, second, **numbers))

    def mechanism(self, order=None) -> md.Mechanism:
        """Return the platform with a driven crank that moves nothing, as a task needs a driver."""
        bodies = [md.Body("idle", {"O": (0, 0), "A": (self.size, 0)}),
                  md.Body("plate", {"Z": (0, 0), **self.plate}), *self.bodies]
        joints = [md.Revolute("idle_pin", "ground.O", "idle.O"), *self.joints]
        if order is not None:
            order.shuffle(bodies)
            order.shuffle(joints)
        return md.Mechanism(ground=md.Ground({"O": (0.0, 0.0), **self.points}), bodies=bodies, joints=joints)


def modes(mechanism, driver="idle.angle", at=0.4):
    return md.solve(mechanism, md.Modes(md.Driver(driver, at=[at])))

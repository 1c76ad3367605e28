"""Closed-form linkages with complex numbers, to judge what synthesis reports.

Nothing here comes from the package, and nothing is solved by iteration: a linkage is a crank and
dyads that are put on one after the other, each a triangle. How well a dyad is assembled is told
by its height h: sin^2 of its transmission angle, negative where it does not reach. A design is
sound when h stays positive over the whole range that it has to run through, with the same signs of
all triangles at all targets. Minima of h are refined between the nodes of the sweep.

    verdict = judged(FourBar(lengths, point, x0, y0, theta0), theta2, targets)
    assert not verdict.defects

Angles of cranks are those of the cases in synthesis.json: from the ground line, not unwrapped.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np

TURN = 2 * np.pi
NODES = 1441


# -- dyads -----------------------------------------------------------------------------------------


def rrr(A, D, a, b, sign):
    """Joint of links a from A and b from D, on the side sign of A -> D turned, and its height."""
    line = D - A
    far2 = np.abs(line) ** 2
    h = (far2 - (a - b) ** 2) * ((a + b) ** 2 - far2) / (4 * a * a * b * b)
    along = (far2 + a * a - b * b) / 2
    across = sign * a * b * np.sqrt(np.maximum(h, 0))
    return A + (along + 1j * across) / line.conj(), h


def rrp(A, a, origin, direction, sign):
    """Joint of a link a from A with a line, the further (sign 1) or nearer, and its height."""
    local = (A - origin) / direction
    h = 1 - (local.imag / a) ** 2
    return origin + direction * (local.real + sign * a * np.sqrt(np.maximum(h, 0))), h


# -- linkages --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FourBar:
    """[r1 ground, r2 crank, r3 coupler, r4 rocker], coupler point (r_cx, r_cy), x0, y0, theta0."""

    lengths: tuple
    point: complex = 0.0
    x0: float = 0.0
    y0: float = 0.0
    theta0: float = 0.0
    dyads = 1

    @classmethod
    def of(cls, x):
        """From the nine numbers x of synthesis.json."""
        return cls(tuple(x[:4]), complex(x[4], x[5]), *x[6:9])

    def moved(self, theta, signs):
        r1, r2, r3, r4 = self.lengths
        A = r2 * np.exp(1j * theta)
        B, h = rrr(A, r1 + 0j * A, r3, r4, signs[0])
        place = complex(self.x0, self.y0) + np.exp(1j * self.theta0) * (
            A + self.point * (B - A) / r3
        )
        return {"point": place, "output": np.angle(B - r1)}, [h]

    def swept_exactly(self, low, high):
        """Places of extreme distances, which are the extremes of h."""
        return np.pi * np.arange(np.ceil(low / np.pi), np.floor(high / np.pi) + 1)

    @property
    def grashof(self):
        names = ("drag-link", "crank-rocker", "double-rocker", "rocker-crank")
        order = sorted(self.lengths)
        if order[0] + order[3] > order[1] + order[2]:
            return "triple-rocker"
        return names[self.lengths.index(order[0])]


@dataclass(frozen=True)
class SliderCrank:
    """Crank r2, coupler r3, line at `offset` left of the pivot in direction theta0."""

    crank: float
    coupler: float
    offset: float = 0.0
    point: complex = 0.0
    x0: float = 0.0
    y0: float = 0.0
    theta0: float = 0.0
    dyads = 1
    grashof = ""

    def moved(self, theta, signs):
        A = self.crank * np.exp(1j * theta)
        C, h = rrp(A, self.coupler, 1j * self.offset, 1.0, signs[0])
        place = A + self.point * (C - A) / self.coupler
        return {
            "point": complex(self.x0, self.y0) + np.exp(1j * self.theta0) * place,
            "output": C.real,
        }, [h]


@dataclass(frozen=True)
class GearedFiveBar:
    """A = r2 e^(i theta2), D = r1 + r5 e^(i (ratio theta2 + phase)), r3 from A, r4 from D."""

    lengths: tuple
    ratio: float
    phase: float
    point: complex = 0.0
    x0: float = 0.0
    y0: float = 0.0
    theta0: float = 0.0
    dyads = 1
    grashof = ""

    def moved(self, theta, signs):
        r1, r2, r3, r4, r5 = self.lengths
        A = r2 * np.exp(1j * theta)
        D = r1 + r5 * np.exp(1j * (self.ratio * theta + self.phase))
        B, h = rrr(A, D, r3, r4, signs[0])
        place = complex(self.x0, self.y0) + np.exp(1j * self.theta0) * (
            A + self.point * (B - A) / r3
        )
        return {"point": place, "output": np.angle(B - D)}, [h]


@dataclass(frozen=True)
class WattTwo:
    """First loop 1, a, b, c; arm s0 at theta4 + delta drives e, f about (gx, gy) from its pivot."""

    first: tuple
    arm: float
    second: tuple
    delta: float
    pivot: complex
    dyads = 2
    grashof = ""

    @classmethod
    def of(cls, z):
        """From z of synthesis.json."""
        a, b, c, _, _, s0, e, f, delta, gx, gy = z
        return cls((a, b, c), s0, (e, f), delta, complex(gx, gy))

    def moved(self, theta, signs):
        a, b, c = self.first
        A = a * np.exp(1j * theta)
        B, h1 = rrr(A, 1 + 0j * A, b, c, signs[0])
        arm = 1 + self.arm * np.exp(1j * self.delta) * (B - 1) / c
        pivot = 1 + self.pivot
        E, h2 = rrr(arm, pivot + 0j * A, *self.second, signs[1])
        return {"point": E, "output": np.angle(E - pivot)}, [h1, h2]


@dataclass(frozen=True)
class StephensonThree:
    """First loop 1, a, b, c; coupler point (u, v) drives e, f about (gx, gy) from A0."""

    first: tuple
    second: tuple
    point: complex
    pivot: complex
    dyads = 2
    grashof = ""

    @classmethod
    def of(cls, z):
        """From z of synthesis.json."""
        a, b, c, _, _, e, f, u, v, gx, gy = z
        return cls((a, b, c), (e, f), complex(u, v), complex(gx, gy))

    def moved(self, theta, signs):
        a, b, c = self.first
        A = a * np.exp(1j * theta)
        B, h1 = rrr(A, 1 + 0j * A, b, c, signs[0])
        coupler = A + self.point * (B - A) / b
        E, h2 = rrr(coupler, self.pivot + 0j * A, *self.second, signs[1])
        return {"point": E, "output": np.angle(E - self.pivot)}, [h1, h2]


# -- judgement -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Verdict:
    """Errors at the targets (k,), signs of the dyads, and the defects of the motion.

    ``branches`` (k, dyads) are the signs that come nearest to each target, ``transmission`` [rad]
    is the least over the required range.
    """

    errors: np.ndarray
    signs: tuple
    branches: np.ndarray
    transmission: float
    height: float
    ordered: bool
    turns: bool
    grashof: str
    defects: tuple = field(default=())

    @property
    def f(self):
        """Sum of squares of the errors."""
        return float(np.sum(self.errors**2))


def judged(
    linkage, theta, targets, *, full_turn=True, ordered=True, signs=None, output="point",
    tolerance=1e-6,
):  # fmt: skip
    """Judge a design at crank angles theta (k,) against targets (k,) or (k, 2).

    signs: of the dyads, None: those with the least errors. tolerance: share of the targets' size
    within which two signs are both right (near a dead point).
    """
    theta, targets = np.asarray(theta, float), np.asarray(targets)
    if targets.ndim == 2:
        targets = targets[:, 0] + 1j * targets[:, 1]
    every = list(itertools.product((1, -1), repeat=linkage.dyads))
    distances = []
    for choice in every:
        values, heights = linkage.moved(theta, choice)
        miss = np.abs(values[output] - targets)
        if output == "output":
            miss = np.abs(wrapped(values[output] - targets))
        distances.append(np.where(np.min(heights, axis=0) < -1e-12, np.inf, miss))
    distances = np.array(distances)
    sums = np.sum(distances**2, axis=1)
    best = int(np.argmin(sums)) if signs is None else every.index(tuple(signs))
    errors = distances[best]
    size = float(np.abs(targets - targets.mean()).max()) or 1.0
    nearest = distances.argmin(axis=0)
    lost = errors - distances.min(axis=0) > tolerance * size
    span = (0.0, TURN) if full_turn else (float(theta.min()), float(theta.max()))
    least = lowest(linkage, every[best], *span)
    turns = least >= 0 if full_turn else lowest(linkage, every[best], 0.0, TURN) >= 0
    in_order = order_of(theta) != 0
    defects = []
    if not np.isfinite(errors).all():
        defects.append("does not assemble at a target")
    if signs is None and (lost.any() or not np.isfinite(sums[best])):
        defects.append("branch")
    if least < 0:
        defects.append("full turn" if full_turn else "circuit")
    if ordered and not in_order:
        defects.append("order")
    return Verdict(
        errors, every[best], np.array(every)[nearest], float(np.arcsin(np.sqrt(max(least, 0.0)))),
        least, in_order, bool(turns), linkage.grashof, tuple(defects),
    )  # fmt: skip


def lowest(linkage, signs, low, high):
    """Return the least height of all dyads over a range, refined between the nodes."""
    nodes = np.linspace(low, high, NODES)
    if hasattr(linkage, "swept_exactly"):
        nodes = np.sort(np.concatenate([nodes, linkage.swept_exactly(low, high)]))
    heights = np.array(linkage.moved(nodes, signs)[1])
    least = float(heights.min())
    for dyad, h in enumerate(heights):
        inner = np.flatnonzero((h[1:-1] <= h[:-2]) & (h[1:-1] <= h[2:])) + 1
        for i in inner[np.argsort(h[inner])[:2]]:
            a, b = nodes[i - 1], nodes[i + 1]
            for _ in range(60):
                c, d = a + (b - a) / 3, b - (b - a) / 3
                hc, hd = linkage.moved(np.array([c, d]), signs)[1][dyad]
                a, b = (a, d) if hc < hd else (c, b)
            least = min(least, float(linkage.moved(np.array([a]), signs)[1][dyad][0]))
    return least


def order_of(theta):
    """Return the sense in which angles follow each other within a turn, 0 if they do not."""
    for sense in (1, -1):
        steps = np.mod(sense * np.diff(theta), TURN)
        if (steps > 0).all() and steps.sum() < TURN:
            return sense
    return 0


def wrapped(angle):
    """Return angles in [-pi, pi)."""
    return np.mod(angle + np.pi, TURN) - np.pi


def function_error(linkage, begin, end, sense, share_in, share_out, ranges):
    """Return the largest error [rad] of a function generator and its verdict.

    share_in, share_out: input and output along their scales, 0 to 1; ranges: of both [rad].
    """
    theta = begin + ranges[0] * np.asarray(share_in)
    psi = end + sense * ranges[1] * np.asarray(share_out)
    verdict = judged(linkage, theta, psi, full_turn=False, ordered=False, output="output")
    return float(verdict.errors.max()), verdict

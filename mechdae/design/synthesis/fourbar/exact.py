"""Four-bars whose coupler point goes exactly through given points.

A four-bar with its coupler point has nine dimensions, and k points leave k turns of the coupler
free: 2 k equations |P_j - c e^(i theta_j) - A0| = L2, |P_j - (c - r3) e^(i theta_j) - B0| = L4
with 9 + k unknowns. With 9 - k dimensions given there are finitely many solutions: 1442 complex
ones for nine points (Wampler, Morgan & Sommese 1992; three cognates and two driven pivots each),
33 for five points with both fixed pivots given (Morgan & Wampler 1990). Points are not ordered
and branches not prescribed here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.design.synthesis.fourbar.linkage import (
    Linkage,
    invariants,
    linkage,
    scale_of,
    scaled_dimensions,
)
from mechdae.errors import InputError, UnknownName
from mechdae.numerics.levenberg import DistinctSolutions, Rows, solve_all
from mechdae.numerics.null_space import linear_fit
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Integers, Matrices, Matrix, Points, Unknowns

if TYPE_CHECKING:
    from numpy.random import Generator


DIMENSIONS = (
    "pivot_x", "pivot_y", "other_x", "other_y", "crank", "rocker", "coupler", "along", "across",
)  # fmt: skip
"""Pivots of crank and rocker, lengths, coupler point along and across the coupler."""
POLAR = {"ground": "other_x", "turn": "other_y"}
"""Length and direction of the ground line, in place of the other pivot."""
STARTS = 20_000
SPREAD = 1.0
"""Of the logarithm of sizes: long links are needed to find long links."""
COINCIDE = 1e-3
"""Pivots or pins that are nearer, in sizes of the targets, are one: a degenerate four-bar."""


@dataclass(frozen=True)
class Exact:
    """Four-bars through all points, one for each solution up to cognates, and the search.

    ``search`` has the hits of each design in the same order, and what the search cost. Where
    dimensions are given a cognate that has them too is a design of its own.
    """

    designs: tuple[Linkage, ...]
    search: DistinctSolutions


class PathRows:
    """Rows of k points, scaled to their size, with some dimensions given.

    `targets` (k,): with the middle at zero and size one.
    """

    def __init__(self, targets: Complexes, given: Mapping[str, float]) -> None:
        self.targets = targets
        self.polar: bool = any(name in POLAR for name in given)
        names = [POLAR.get(name, name) for name in given]
        self.free: Integers = np.array(
            [i for i, name in enumerate(DIMENSIONS) if name not in names], int
        )
        self.fixed: Integers = np.setdiff1d(np.arange(9), self.free)
        sizes = [abs(value) for name, value in given.items() if name != "turn"]
        self.reach: float = max(1.0, *sizes) if sizes else 1.0
        self.values: Floats = np.zeros(9)
        for name, value in zip(names, given.values(), strict=True):
            squared = name in ("crank", "rocker")
            self.values[DIMENSIONS.index(name)] = value * value if squared else value

    def whole(self, x: Unknowns) -> Matrix:
        """Return all dimensions (n, 9) with Cartesian pivots, lengths of crank, rocker squared."""
        d = self.full(x)
        if self.polar:
            d[:, 2], d[:, 3] = (
                d[:, 0] + d[:, 2] * np.cos(d[:, 3]),
                d[:, 1] + d[:, 2] * np.sin(d[:, 3]),
            )
        return d

    def full(self, x: Unknowns) -> Matrix:
        """Return all dimensions (n, 9), free ones from `x`."""
        d = np.broadcast_to(self.values, (len(x), 9)).copy()
        d[:, self.free] = x
        return d

    def __call__(self, x: Unknowns, t: Floats) -> Rows:
        d = self.whole(x)
        u, v, e = self._arms(d, t)
        crank, rocker = d[:, 7] + 1j * d[:, 8], d[:, 7] - d[:, 6] + 1j * d[:, 8]
        F = np.stack([np.abs(u) ** 2 - d[:, 4:5], np.abs(v) ** 2 - d[:, 5:6]], axis=2)
        J = np.zeros((*F.shape, 9))
        a, b = 2 * u.conj() * e, 2 * v.conj() * e
        J[:, :, 0, 0], J[:, :, 0, 1] = -2 * u.real, -2 * u.imag
        J[:, :, 1, 2], J[:, :, 1, 3] = -2 * v.real, -2 * v.imag
        J[:, :, 0, 4] = J[:, :, 1, 5] = -1
        J[:, :, 1, 6] = b.real
        J[:, :, 0, 7], J[:, :, 0, 8] = -a.real, a.imag
        J[:, :, 1, 7], J[:, :, 1, 8] = -b.real, b.imag
        by_turn = np.stack([(crank[:, None] * a).imag, (rocker[:, None] * b).imag], axis=2)
        F, J, by_turn = self._weighed(F, J, by_turn, crank, rocker)
        if self.polar:
            self._to_polar(J, self.full(x))
        return F, J if len(self.free) == 9 else J[:, :, :, self.free], by_turn

    @staticmethod
    def _weighed(
        F: Matrices, J: Floats, by_turn: Matrices, crank: Complexes, rocker: Complexes
    ) -> Rows:
        """Divide the rows by the distance of pin and point: far pins shall weigh as near ones."""
        arms = np.stack([crank, rocker], axis=1)
        size = np.sqrt(1 + np.abs(arms) ** 2)
        slope = np.zeros((len(arms), 2, 9))
        slope[:, :, 7], slope[:, :, 8] = arms.real, arms.imag
        slope[:, 1, 6] = -rocker.real
        F = F / size[:, None, :]
        J = J / size[:, None, :, None]
        J -= F[:, :, :, None] * (slope / size[:, :, None] ** 2)[:, None]
        return F, J, by_turn / size[:, None, :]

    @staticmethod
    def _to_polar(J: Floats, d: Floats) -> None:
        c, s, r = np.cos(d[:, 3, None]), np.sin(d[:, 3, None]), d[:, 2, None]
        x, y = J[:, :, 1, 2].copy(), J[:, :, 1, 3].copy()
        J[:, :, 1, 0], J[:, :, 1, 1] = x, y
        J[:, :, 1, 2], J[:, :, 1, 3] = c * x + s * y, r * (c * y - s * x)

    def draw(self, generator: Generator, n: int) -> tuple[Matrix, Matrix]:
        """Return starts: a crank that reaches all points, the rocker that fits its turns best."""
        d = np.zeros((n, 9))
        spread = np.exp(SPREAD * generator.normal(size=(n, 3)))
        if self.reach > 1:  # half of the starts up to the size of what is given
            spread *= self.reach ** np.maximum(2 * generator.random((n, 3)) - 1, 0)
        d[:, :4] = 1.5 * generator.normal(size=(n, 4)) * spread[:, [0, 0, 1, 1]]
        d = self._given(d)
        pivots = d[:, 0] + 1j * d[:, 1], d[:, 2] + 1j * d[:, 3]
        first = generator.random(n) < 0.5  # whether the crank is drawn and the rocker fitted
        arm = 2.0 * spread[:, 2]
        t = self._turns(np.where(first, *pivots), arm, generator)
        fit = self._fitted(np.where(first, *pivots[::-1]), t)
        crank, rocker = np.where(first, arm, fit), np.where(first, fit, arm)
        line = np.angle(crank - rocker)
        crank, t = crank * np.exp(-1j * line), t + line[:, None]
        d[:, 6], d[:, 7], d[:, 8] = np.abs(fit - arm), crank.real, crank.imag
        d = self._given(d)
        u, v, _ = self._arms(d, t)
        d[:, 4], d[:, 5] = np.mean(np.abs(u) ** 2, axis=1), np.mean(np.abs(v) ** 2, axis=1)
        if self.polar:
            d[:, 2], d[:, 3] = _polar(d)
        return d[:, self.free], t

    def _given(self, d: Floats) -> Matrix:
        """Return dimensions (n, 9), Cartesian, with those that are given."""
        if self.polar:
            d[:, 2], d[:, 3] = _polar(d)
        return self.whole(d[:, self.free])

    def _turns(self, pivot: Complexes, arm: Floats, generator: Generator) -> Any:
        """Return turns (n, k) of a coupler whose pin, at `arm` from its point, is on a circle.

        The circle about `pivot` is drawn among those that reach all points, and so is its side:
        one for all points or one for each.
        """
        p = self.targets - pivot[:, None]
        far, arm = np.abs(p), arm[:, None]
        low, high = np.abs(far - arm).max(axis=1), (far + arm).min(axis=1)
        length = (low + generator.random(len(p)) * (high - low))[:, None]
        cosine = (far**2 + arm**2 - length**2) / np.maximum(2 * far * arm, 1e-12)
        one = generator.choice((-1.0, 1.0), (len(p), 1))
        each = generator.choice((-1.0, 1.0), far.shape)
        side = np.where(generator.random((len(p), 1)) < 0.5, one, each)
        return np.angle(p) + side * np.arccos(np.clip(cosine, -1, 1))

    def _fitted(self, pivot: Complexes, t: Floats) -> Complexes:
        """Return the pin (from coupler point to pin, reversed) that keeps best to a circle."""
        q = self.targets - pivot[:, None]
        p = q * np.exp(-1j * t)
        A = np.stack([2 * p.real, 2 * p.imag, np.ones_like(t)], axis=2)
        found = linear_fit(A, np.abs(q) ** 2, least=1e-9)
        return found[:, 0] + 1j * found[:, 1]

    def _arms(self, d: Floats, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
        """Return vectors along crank and rocker (n, k) and the coupler's direction, complex."""
        e = np.exp(1j * t)
        crank = d[:, 7] + 1j * d[:, 8]
        u = self.targets - (d[:, 0] + 1j * d[:, 1])[:, None] - crank[:, None] * e
        v = self.targets - (d[:, 2] + 1j * d[:, 3])[:, None] - (crank - d[:, 6])[:, None] * e
        return u, v, e

    def usable(self, x: Unknowns) -> Any:
        """Return which solutions are four-bars: pivots, pins, links of some length."""
        d = self.whole(x)
        ground = np.hypot(d[:, 2] - d[:, 0], d[:, 3] - d[:, 1])
        least = np.minimum(ground, np.abs(d[:, 6]))
        good = (least > COINCIDE) & (d[:, 4:6].min(axis=1) > COINCIDE**2)
        if self.polar:
            good &= self.full(x)[:, 2] > 0
        if 6 not in self.free or 7 not in self.free or 8 not in self.free:
            good &= d[:, 6] > 0  # turned by pi and negative it is the same four-bar
        return good

    def key(self, x: Unknowns) -> Matrix:
        """Return what tells solutions apart: up to cognates where all dimensions are free."""
        d = self.whole(x)
        pivot, other = d[:, 0] + 1j * d[:, 1], d[:, 2] + 1j * d[:, 3]
        crank, rocker = np.sqrt(np.abs(d[:, 4])), np.sqrt(np.abs(d[:, 5]))
        point = d[:, 7] + 1j * d[:, 8]
        if len(self.free) == 9:
            return invariants(pivot, other, crank, d[:, 6], rocker, point)
        sign = np.sign(d[:, 6])
        d[:, 6:] *= sign[:, None]
        d[:, 4], d[:, 5] = crank, rocker
        return d


def _polar(d: Floats) -> tuple[Floats, Floats]:
    """Return length and direction of the ground line of Cartesian pivots."""
    x, y = d[:, 2] - d[:, 0], d[:, 3] - d[:, 1]
    return np.hypot(x, y), np.arctan2(y, x)


def exact_path(
    targets: object, given: Mapping[str, float] | None = None, *, starts: int = STARTS,
    seed: int = 0, enough: int | None = None,
) -> Exact:  # fmt: skip
    """Return the four-bars whose coupler point goes exactly through all points.

    `targets` (k, 2): three to nine points. `given`: 9 - k dimensions by name: ``pivot_x``,
    ``pivot_y`` (of the crank), ``other_x``, ``other_y`` (of the rocker) or ``ground`` and ``turn``
    (of the line between them), ``crank``, ``coupler``, ``rocker``, ``along``, ``across`` (the
    coupler point from the crank pin).
    """
    points = np.asarray(targets, float)
    given = dict(given or {})
    check_path(points, given)
    P = points[:, 0] + 1j * points[:, 1]
    middle, size = scale_of(P)
    rows = PathRows((P - middle) / size, scaled_dimensions(given, middle, size))
    search = solve_all(
        rows, rows.draw, starts, key=rows.key, usable=rows.usable, seed=seed, enough=enough
    )
    designs = []
    for d, t in zip(rows.whole(search.x), search.t, strict=True):
        pivot, other = (complex(*d[i : i + 2]) * size + middle for i in (0, 2))
        e = np.exp(1j * t) * size
        A = P - complex(d[7], d[8]) * e
        designs.append(linkage(pivot, other, A, A + d[6] * e, P))
    return Exact(tuple(designs), search)


def check_path(points: Points, given: Mapping[str, float]) -> None:
    """Refuse points that are none or the same, and dimensions that are not as many as needed."""
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise InputError("targets are finite points (x, y)", where="targets")
    k = len(points)
    if not 3 <= k <= 9:
        hint = "least squares through more, further goals for fewer"
        raise InputError(
            f"{k} points: a four-bar goes exactly through three to nine", where="targets", hint=hint
        )
    gaps = np.abs(points[:, None] - points[None]).max(axis=2)
    same = np.argwhere(np.triu(gaps <= 1e-12 * gaps.max(), 1))
    if len(same):
        i, j = (same[0] + 1).tolist()
        raise InputError(
            f"two targets are the same point, {i} and {j}", where="targets",
            hint="a point that is met twice is no condition more: leave one out",
        )  # fmt: skip
    names: Iterable[str] = (*DIMENSIONS, *POLAR)
    for name, value in given.items():
        if name not in names:
            raise UnknownName("dimension", name, names, where="given")
        if not np.isfinite(value):
            raise InputError(f"{name} = {value}", where="given")
        if name in ("crank", "rocker", "coupler", "ground") and value <= 0:
            raise InputError(f"{name} = {value:g} is no length", where="given")
    if any(name in POLAR for name in given) and any(name.startswith("other") for name in given):
        raise InputError(
            "the ground line is given twice: by its length or direction and by the other pivot",
            where="given",
        )
    if len(given) != 9 - k:
        raise InputError(
            f"{k} points and {len(given)} given dimensions make "
            f"{2 * k} equations for {9 - len(given) + k} unknowns",
            where="given", hint=f"give {9 - k} dimensions, or seek the best of infinitely many",
        )  # fmt: skip

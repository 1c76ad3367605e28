"""Platforms on three legs drawn at random in fractions, with where their ends are led."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mechdae as md
from tests.reference.three_points import PAIRS, ExactCourse, first_unknowns

KINDS = {
    "3-RPS": ("RPS", "RPS", "RPS"),
    "3-PRS": ("PRS", "PRS", "PRS"),
    "6-3": ("bars", "bars", "bars"),
    "circles": ("RPS", "PRS", "bars"),
    "one line": ("RPS", "PRS", "line"),
    "two lines": ("line", "RPS", "line"),
    "three lines": ("line", "line", "line"),
}
"""Legs: turned with a driven slide, the other way round, two distances, slid at a driven turn."""
MOST = {"one line": 16, "two lines": 12, "three lines": 8}
"""Complex poses; of circles 16."""


def _fraction(rng: Any, low: float, high: float) -> Fraction:
    return Fraction(round(float(rng.uniform(low, high)) * 64), 64)


def _frame(rng: Any) -> list[tuple[Fraction, ...]]:
    """Return three directions of length 1 at right angles, in fractions."""
    a, b, c, d = (Fraction(int(v)) for v in rng.integers(1, 9, size=4))
    n = a * a + b * b + c * c + d * d
    rows = (
        (a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)),
        (2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)),
        (2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d),
    )
    return [tuple(row[k] / n for row in rows) for k in range(3)]


def _floats(v: Any) -> tuple[float, ...]:
    return tuple(float(x) for x in v)


class DrawnPlatform:
    """A platform that can be assembled: its mechanism, task, and what leads its points."""

    def __init__(self, rng: Any, kind: str) -> None:
        self.ground: dict[str, Any] = {"O": (0, 0, 0)}
        self.bodies: list[Any] = []
        self.joints: list[Any] = []
        self.drivers: list[Any] = []
        self.courses = [
            getattr(self, f"_{leg.lower()}")(rng, k) for k, leg in enumerate(KINDS[kind])
        ]
        self.ends = [own.at(_fraction(rng, -2, 2)) for own in self.courses]
        self.squares = [
            sum((a - b) ** 2 for a, b in zip(self.ends[i], self.ends[j], strict=True))
            for i, j in PAIRS
        ]
        a, b, c = (float(square) for square in self.squares)
        x = (a + c - b) / (2 * a**0.5)
        points = ((0, 0, 0), (a**0.5, 0, 0), (x, (c - x * x) ** 0.5, 0))
        top = md.Body("top", {f"B{k}": point for k, point in enumerate(points)})
        if not self.drivers:  # a task has one
            self.bodies.append(md.Body("crank", {"O": (0, 0, 0)}))
            self.joints.append(md.SpatialRevolute("O", "ground.O", "crank.O", axis=(0, 0, 1)))
            self.drivers.append(md.Driver("O.angle", at=(0.0,)))
        self.mechanism = md.Mechanism(
            dimension=3,
            ground=md.Ground(self.ground),
            bodies=[*self.bodies, top],
            joints=self.joints,
        )
        self.task = md.Modes(drivers=tuple(self.drivers))

    def wanted(self) -> tuple[Any, int]:
        """Return the places of the first point in all poses, and the number of complex ones."""
        first, count = first_unknowns(self.courses, self.squares)
        return [_floats(self.courses[0].at(Fraction(z))) for z in first], count

    def _end(self, k: int, body: str) -> None:
        self.joints.append(md.Spherical(f"S{k}", f"{body}.B", f"top.B{k}"))

    def _hinged(self, rng: Any, k: int, free: bool) -> ExactCourse:
        centre = tuple(_fraction(rng, -1, 1) for _ in range(3))
        u, v, a = _frame(rng)
        self.ground[f"A{k}"] = _floats(centre)
        self.bodies += [md.Body(f"low{k}", {"A": (0, 0, 0)}), md.Body(f"up{k}", {"B": (0, 0, 0)})]
        self.joints += [
            md.SpatialRevolute(f"R{k}", f"ground.A{k}", f"low{k}.A", axis=_floats(a),
                               zero=_floats(u), axis2=(0, 0, 1), zero2=(1, 0, 0)),
            md.SpatialPrismatic(f"P{k}", f"low{k}.A", f"up{k}.B", axis=(1, 0, 0), zero=(0, 0, 1)),
        ]  # fmt: skip
        self._end(k, f"up{k}")
        if free:
            r = _fraction(rng, 0.5, 1.5)
            self.drivers.append(md.Driver(f"P{k}.slide", at=(float(r),)))
            return ExactCourse(centre, u, v, r)
        t = _fraction(rng, -1, 1)
        self.drivers.append(md.Driver(f"R{k}.angle", at=(2 * math.atan(t),)))
        c, s = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
        along = tuple(c * x + s * y for x, y in zip(u, v, strict=True))
        return ExactCourse(centre, along, a, Fraction(1), True)

    def _rps(self, rng: Any, k: int) -> ExactCourse:
        return self._hinged(rng, k, True)

    def _line(self, rng: Any, k: int) -> ExactCourse:
        return self._hinged(rng, k, False)

    def _prs(self, rng: Any, k: int) -> ExactCourse:
        start = tuple(_fraction(rng, -1, 1) for _ in range(3))
        (u, v, a), (way, across, _) = _frame(rng), _frame(rng)
        r, slid = _fraction(rng, 0.5, 1.5), _fraction(rng, -0.5, 0.5)
        self.ground[f"A{k}"] = _floats(start)
        self.bodies += [
            md.Body(f"low{k}", {"A": (0, 0, 0)}),
            md.Body(f"up{k}", {"A": (0, 0, 0), "B": (float(r), 0, 0)}),
        ]
        both = {"axis": _floats(way), "zero": _floats(across)}
        self.joints += [
            md.SpatialPrismatic(f"P{k}", f"ground.A{k}", f"low{k}.A", **both,
                                axis2=both["axis"], zero2=both["zero"]),
            md.SpatialRevolute(f"R{k}", f"low{k}.A", f"up{k}.A", axis=_floats(a), zero=_floats(u),
                               axis2=(0, 0, 1), zero2=(1, 0, 0)),
        ]  # fmt: skip
        self._end(k, f"up{k}")
        self.drivers.append(md.Driver(f"P{k}.slide", at=(float(slid),)))
        return ExactCourse(tuple(x + slid * w for x, w in zip(start, way, strict=True)), u, v, r)

    def _bars(self, rng: Any, k: int) -> ExactCourse:
        centre = tuple(_fraction(rng, -1, 1) for _ in range(3))
        u, v, a = _frame(rng)
        r = _fraction(rng, 0.5, 1.5)
        for i in (0, 1):
            h = (-1) ** i * _fraction(rng, 0.25, 1)
            self.ground[f"A{k}{i}"] = _floats(c + h * x for c, x in zip(centre, a, strict=True))
            length = math.sqrt(r * r + h * h)
            self.joints.append(md.Distance(f"L{k}{i}", f"ground.A{k}{i}", f"top.B{k}", length))
        return ExactCourse(centre, u, v, r)

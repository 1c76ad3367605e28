"""Planar linkages as polynomial systems: rigid parts, pins, pins that slide on lines of parts.

A part's turn is w = exp(z), its mirror image 1/w; for real poses z is imaginary. Round a loop

    sum A_j w_j = 0   and   sum A'_j / w_j = 0,   A = a + s n

with the steps a of the loop on part j, the slides s on it along n; the second equation holds the
conjugate numbers, which are numbers of their own for paths through complex dimensions. Parts that
only slide on each other have one turn. The first turn is 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mechdae.numerics.homotopy.generic_count import LARGEST, generic_count, sliding_count, walk
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Integers

if TYPE_CHECKING:
    from numpy.random import Generator


FAR, FAR_SLIDE = 20.0, 1e6
"""Logarithm of a turn, and size of a slide, that are at infinity."""


@dataclass(frozen=True)
class PinLinkage:
    """Parts with their pins, and what turns together.

    ``parts``: numbers of the pins on each part; the first one is fixed. ``turns``: number of each
    part's turn; that of the fixed part is 0. ``slides`` (part, pin): the pin is on a line of the
    part.
    """

    parts: tuple[tuple[int, ...], ...]
    turns: tuple[int, ...]
    slides: tuple[tuple[int, int], ...] = ()

    @property
    def unknowns(self) -> int:
        return max(self.turns) + len(self.slides)

    @cached_property
    def steps(self) -> tuple[tuple[int, int, int, int], ...]:
        """Steps (part, from pin, to pin, slide or -1) between pins."""
        found = [(j, pins[0], pin, -1) for j, pins in enumerate(self.parts) for pin in pins[1:]]
        slid = [(j, self.parts[j][0], pin, k) for k, (j, pin) in enumerate(self.slides)]
        return tuple(found + slid)

    @property
    def _between(self) -> list[tuple[int, int]]:
        return [(u, v) for _, u, v, _ in self.steps]

    @cached_property
    def tree(self) -> dict[int, dict[int, int]]:
        """By pin the steps that lead to it from the first one, {step: sign}."""
        return walk(self._between)[0]

    @cached_property
    def loops(self) -> Floats:
        """Signs of the steps in independent loops (l, steps)."""
        found = walk(self._between)[1]
        rows = np.zeros((len(found), len(self.steps)))
        for row, loop in zip(rows, found, strict=True):
            row[list(loop)] = list(loop.values())
        return rows

    @property
    def square(self) -> bool:
        """Whether there are as many equations as unknowns."""
        return 2 * len(self.loops) == self.unknowns

    @cached_property
    def count(self) -> int | None:
        """Poses for generic dimensions, None where they are not counted."""
        if self.slides or len(set(self.turns)) < len(self.turns):
            return sliding_count(self.loops, self.step_turns, self.step_slides)
        return generic_count(self.parts) if len(self.parts) <= LARGEST else None

    @property
    def far(self) -> Complexes:
        """Sizes (k,) of real and imaginary parts that are at infinity: turns may go on and on."""
        turn, slide = complex(FAR, np.inf), complex(FAR_SLIDE, FAR_SLIDE)
        return np.repeat([turn, slide], [max(self.turns), len(self.slides)])

    @cached_property
    def step_turns(self) -> Integers:
        return np.array([self.turns[j] for j, *_ in self.steps])

    @cached_property
    def step_slides(self) -> Integers:
        return np.array([k for *_, k in self.steps])

    def system(self, numbers: Sequence[ComplexDimensions]) -> _System:
        """Return the equations along a path of numbers, a polynomial in t with these coefficients.

        They are functions (x (n, k), t (n,)) -> F, dF/dx, dF/dt; x holds the logarithms of turns,
        then slides.
        """
        return _System(self, numbers)


@dataclass(frozen=True)
class ComplexDimensions:
    """Steps ``a`` (steps,) on their parts, directions ``n`` (slides,), and their mirror images."""

    a: Complexes
    n: Complexes
    mirrored_a: Complexes
    mirrored_n: Complexes

    @staticmethod
    def real(a: Complexes, n: Complexes) -> ComplexDimensions:
        """Return the numbers of a linkage that exists."""
        a, n = np.asarray(a, complex), np.asarray(n, complex)
        return ComplexDimensions(a, n, np.conj(a), np.conj(n))

    @staticmethod
    def drawn(linkage: PinLinkage, rng: Generator) -> ComplexDimensions:
        """Return complex numbers drawn at random."""

        def some(size: int) -> Complexes:
            return rng.normal(size=size) + 1j * rng.normal(size=size)

        steps, slides = len(linkage.steps), len(linkage.slides)
        return ComplexDimensions(some(steps), some(slides), some(steps), some(slides))

    @property
    def parts(self) -> tuple[Complexes, Complexes, Complexes, Complexes]:
        return self.a, self.n, self.mirrored_a, self.mirrored_n

    def plus(self, factor: float, other: ComplexDimensions) -> ComplexDimensions:
        return ComplexDimensions(
            *(x + factor * y for x, y in zip(self.parts, other.parts, strict=True))
        )


class _System:
    """The equations of a linkage along a path."""

    def __init__(self, linkage: PinLinkage, numbers: Sequence[ComplexDimensions]) -> None:
        m, k = max(linkage.turns), len(linkage.slides)
        self.m, self.k, self.degree = m, k, len(numbers)
        gather = np.zeros((len(linkage.steps), m + 1))
        gather[np.arange(len(gather)), linkage.step_turns] = 1
        sliding = linkage.step_slides >= 0
        spread = np.zeros((k, len(gather)))
        spread[linkage.step_slides[sliding], np.flatnonzero(sliding)] = 1
        self.of_slide = linkage.step_turns[sliding][np.argsort(linkage.step_slides[sliding])]
        loops = linkage.loops
        self.constant, self.slid = [], []
        for number in numbers:
            pair = ((number.a, number.n), (number.mirrored_a, number.mirrored_n))
            self.constant.append([(loops * a) @ gather for a, _ in pair])
            self.slid.append([(loops @ spread.T) * n for _, n in pair])

    def __call__(self, x: Complexes, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
        m = self.m
        w = np.exp(np.concatenate([np.zeros((len(x), 1)), x[:, :m]], axis=1))
        F, J, rate = [], [], []
        for side, turned in ((0, w), (1, 1 / w)):
            A, B, dA, dB = self._at(t, side)
            sliding = turned[:, self.of_slide]
            s = x[:, m:]
            terms = A * turned[:, None, :]
            along = B * sliding[:, None, :]
            moved = along * s[:, None, :]
            F.append(terms.sum(axis=2) + moved.sum(axis=2))
            for j in range(self.k):
                terms[:, :, self.of_slide[j]] += moved[:, :, j]
            J.append(np.concatenate([(1 - 2 * side) * terms[:, :, 1:], along], axis=2))
            slope = np.einsum("nlj,nj->nl", dA, turned)
            if self.k:
                slope = slope + np.einsum("nlj,nj->nl", dB, sliding * s)
            rate.append(slope)
        return np.concatenate(F, axis=1), np.concatenate(J, axis=1), np.concatenate(rate, axis=1)

    def _at(self, t: Floats, side: int) -> tuple[Complexes, Complexes, Complexes, Complexes]:
        """Return loops' factors of turns and slides at t (n,), and their slopes."""
        t = t[:, None, None]
        A, B = self.constant[0][side] + 0 * t, self.slid[0][side] + 0 * t
        dA, dB = np.zeros_like(A), np.zeros_like(B)
        for power in range(1, self.degree):
            constant, sliding = self.constant[power][side], self.slid[power][side]
            A, B = A + t**power * constant, B + t**power * sliding
            slope = power * t ** (power - 1)
            dA, dB = dA + slope * constant, dB + slope * sliding
        return A, B, dA, dB


def straight(
    start: ComplexDimensions, end: ComplexDimensions, bend: ComplexDimensions | None = None
) -> list[ComplexDimensions]:
    """Return the path from start to end as a polynomial, over t (1 - t) bend where there is one."""
    difference = end.plus(-1.0, start)
    if bend is None:
        return [start, difference]
    none = bend.plus(-1.0, bend)
    return [start, difference.plus(1.0, bend), none.plus(-1.0, bend)]


def instance(linkage: PinLinkage, rng: Generator) -> tuple[ComplexDimensions, Complexes]:
    """Return complex numbers drawn at random that a pose x (k,) drawn at random solves."""
    pins = {pin for pins in linkage.parts for pin in pins} | {pin for _, pin in linkage.slides}
    draw = ComplexDimensions.drawn(linkage, rng)
    m, k = max(linkage.turns), len(linkage.slides)
    z = 0.7 * (rng.normal(size=m) + 1j * rng.normal(size=m))
    s = rng.normal(size=k) + 1j * rng.normal(size=k)
    w = np.exp(np.concatenate([[0], z]))[linkage.step_turns]
    slid = linkage.step_slides
    place, sides = np.zeros(max(pins) + 1, complex), []
    for turn, n in ((w, draw.n), (1 / w, draw.mirrored_n)):
        place = rng.normal(size=len(place)) + 1j * rng.normal(size=len(place))
        a = np.array([(place[v] - place[u]) for _, u, v, _ in linkage.steps]) / turn
        sides += [a - np.where(slid >= 0, (s * n)[slid], 0) if k else a, n]
    return ComplexDimensions(*sides), np.concatenate([z, s])

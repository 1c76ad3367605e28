"""All solutions at generic complex numbers, collected on round trips through other numbers."""

from __future__ import annotations

import numpy as np

from mechdae.numerics.homotopy.linkage import ComplexDimensions, PinLinkage, instance, straight
from mechdae.numerics.homotopy.tracker import distinct, track
from mechdae.types import Booleans, Complexes, Integers

SAME = 1e-6
MISSED = 1e-6
"""Chance that a solution stays hidden, where no theorem tells how many there are."""
TRIPS = 400
CLOSE = 1e-9
"""Last Newton step of an end that is a solution."""


def within_a_turn(linkage: PinLinkage, x: Complexes) -> Complexes:
    """Return solutions with the imaginary parts of turns between -pi and pi."""
    m = max(linkage.turns)
    x = np.array(x, complex)
    x[:, :m] -= 2j * np.pi * np.round(x[:, :m].imag / (2 * np.pi))
    return x


def different(linkage: PinLinkage, x: Complexes, same: float = SAME) -> Integers:
    """Return the indices of solutions (n, k) that are no copies of earlier ones."""
    m = max(linkage.turns)
    both = [np.exp(x[:, :m]), np.exp(-x[:, :m]), x[:, m:]]
    with np.errstate(all="ignore"):
        sizes = np.concatenate([value / (1 + np.abs(value)) for value in both], axis=1)
    return distinct(sizes, same)


def followed(
    linkage: PinLinkage, path: list[ComplexDimensions], x: Complexes
) -> tuple[Complexes, Booleans]:
    """Return where solutions lead along a path, and which are simple ones at its end."""
    ends = track(linkage.system(path), x, linkage.far)
    return ends.x, ends.followed & (ends.step < CLOSE)


def generic_instance(
    linkage: PinLinkage, seed: int = 1
) -> tuple[ComplexDimensions, Complexes, bool]:
    """Return complex numbers, all their solutions (N, k), whether a theorem allows no more.

    Where no theorem tells how many there are, round trips end when a solution that was missed by
    all of them is as unlikely as 1e-6, with a full group of permutations.
    """
    rng = np.random.default_rng(seed)
    numbers, first = instance(linkage, rng)
    known, wanted, silent = first[None], linkage.count, 0
    for _ in range(TRIPS):
        there, bend = (ComplexDimensions.drawn(linkage, rng) for _ in range(2))
        x = known
        for path in (straight(numbers, there), straight(there, numbers, bend)):
            x, good = followed(linkage, path, x)
            x = x[good]
            if not len(x):
                break
        every = np.concatenate([known, within_a_turn(linkage, x)])
        more = every[different(linkage, every)]
        silent = silent + 1 if len(more) == len(known) else 0
        known = more
        if wanted is not None and len(known) >= wanted:
            return numbers, known, len(known) == wanted
        if wanted is None and (1 / (len(known) + 1)) ** silent < MISSED:
            break
    return numbers, known, False

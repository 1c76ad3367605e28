"""How many complex poses a linkage with guides and slots has for generic dimensions.

With turns w_j and slides s_k along lines that turn with j(k), the closures are linear in
(w_j, s_k w_j(k)): a linear space L. Their mirror images are linear in (1/w_j, s_k / w_j(k)), which
are monomials in the former, y = T(x). Sizes of parts and lines scale the coordinates of one space
against the other by a generic element of the torus, so the number of poses is that in which the
tropical fan of L meets the preimage under T of that of its mirror image, translated: points count
with the index of the lattices of the cones in which they lie.

The fan is that of the nested sets of connected flats (Feichtner and Sturmfels, Matroid polytopes,
nested sets and Bergman fans, 2005). For pins alone T = -1 and the number is `generic_count`'s.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from mechdae.numerics.homotopy.generic_count import PRIME, ranks
from mechdae.types import Floats, Integers, Matrix

LARGEST = 11
"""Turns and slides up to which poses are counted."""
CHUNK = 20_000
POSITIVE = 1e-9
"""Share of the largest coordinate that decides on which side of a wall a point lies."""


def sliding_count(loops: Floats, step_turns: Integers, step_slides: Integers) -> int | None:
    """Return the number of complex poses for generic dimensions, None where it is not counted.

    `loops` (l, n): signs of the steps in independent loops. `step_turns`, `step_slides` (n,):
    numbers of each step's turn (0: fixed) and of its slide or -1.
    """
    turns, slides = int(max(step_turns)) + 1, int(max(step_slides)) + 1
    n = turns + slides
    if n > LARGEST or n != 2 * len(loops) + 1:
        return None
    rng = random.Random(n)
    lengths, along = ([rng.randrange(1, PRIME) for _ in step_turns] for _ in range(2))
    matrix = [[0] * n for _ in loops]
    for row, loop in zip(matrix, loops, strict=True):
        for e in np.flatnonzero(loop):
            row[step_turns[e]] += int(loop[e]) * lengths[e]
            if step_slides[e] >= 0:
                row[turns + step_slides[e]] += int(loop[e]) * along[e]
    r = ranks([[value % PRIME for value in row] for row in matrix], n)
    T = -np.eye(n)
    for e in np.flatnonzero(np.asarray(step_slides) >= 0):
        k = turns + step_slides[e]
        T[k, k] = 1.0
        T[k, step_turns[e]] -= 2.0
    cones = nested_sets(r)
    return meeting(cones, T, n, rng) if cones else None


def nested_sets(r: list[int]) -> list[tuple[int, ...]]:
    """Return the largest nested sets of connected flats (masks) of a matroid, without the whole.

    `r` are the ranks of all sets of elements; none where there are loops or several components.
    """
    full = len(r) - 1
    singles = [1 << j for j in range(full.bit_length())]
    if any(r[one] == 0 for one in singles):
        return []

    def closed(mask: int) -> int:
        return sum(one for one in singles if r[mask | one] == r[mask])

    def connected(mask: int) -> bool:
        first, part = mask & -mask, (mask - 1) & mask
        while part:
            if part & first and r[part] + r[mask ^ part] == r[mask]:
                return False
            part = (part - 1) & mask
        return True

    flats = [mask for mask in range(1, full) if closed(mask) == mask and connected(mask)]
    if not connected(full):
        return []

    def fits(cone: tuple[int, ...], flat: int) -> bool:
        """Return whether no incomparable ones span a connected flat together with another."""
        apart = [other for other in cone if other & flat not in (other, flat)]
        for size in range(1, len(apart) + 1):
            for some in combinations(apart, size):
                if any(a & b in (a, b) for a, b in combinations(some, 2)):
                    continue
                union = flat
                for other in some:
                    union |= other
                if connected(closed(union)):
                    return False
        return True

    def grown(cone: tuple[int, ...], start: int) -> Iterator[tuple[int, ...]]:
        if len(cone) == r[full] - 1:
            yield cone
            return
        for k in range(start, len(flats)):
            if fits(cone, flats[k]):
                yield from grown((*cone, flats[k]), k + 1)

    return list(grown((), 0))


def meeting(cones: list[tuple[int, ...]], T: Matrix, n: int, rng: random.Random) -> int:
    """Return how often a fan meets the translated preimage of itself under T, with multiplicity.

    `cones` are sets of rays (masks), each with the line of (1, ..., 1).
    """
    rays = np.array([[[mask >> j & 1 for j in range(n)] for mask in cone] for cone in cones], float)
    shift = np.array([rng.uniform(-1, 1) for _ in range(n)])
    here, there = rays @ T.T, -rays
    size, total = len(cones), 0.0
    whole = np.broadcast_to(np.ones((1, n)), (1, 1, n))
    for start in range(0, size, max(1, CHUNK // size)):
        some = here[start : start + max(1, CHUNK // size)]
        count = len(some)
        rows = np.concatenate(
            [
                np.repeat(some, size, axis=0),
                np.tile(there, (count, 1, 1)),
                np.broadcast_to(whole, (count * size, 1, n)),
            ],
            axis=1,
        )
        index = np.abs(np.linalg.det(rows))
        regular = index > 0.5
        at = np.linalg.solve(
            rows[regular].transpose(0, 2, 1),
            np.broadcast_to(-shift[:, None], (int(regular.sum()), n, 1)),
        )[:, :-1, 0]
        inside = (at > POSITIVE).all(axis=1)
        total += float(np.round(index[regular][inside]).sum())
    return int(total)

"""How many complex poses a linkage of rigid links and pins has for generic dimensions.

With w_j = exp(i theta_j) and 1/w_j of the links, one of them fixed, a pose is a point w of a linear
space L, the closures, whose reciprocal is in another such space L': both have the matroid M of the
loops for generic links. Sizes of the links scale L' against L by a generic element of the
torus, so the number of poses is the number in which the tropical fan of M meets a generic translate
of its mirror image; each point of it counts once.

That number obeys a recursion, as that of a graph of bars does (the Laman number: Capco, Gallet,
Grasegger, Koutschan, Lubbes, Schicho 2018). For matroids M and N on the elements E and any e in E

    c(M, N) = sum of c(M|P, N/(Q+e)) c(M/(P+e), N|Q)

over the ways to part E - e into P and Q such that P + e is a flat of M and Q + e one of N.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from functools import cache

from mechdae.numerics.homotopy.loops import walk

PRIME = 2**61 - 1
LARGEST = 13
"""Links up to which the poses are counted."""


def generic_count(links: Sequence[Sequence[int]]) -> int:
    """Return the number of complex poses of a linkage that is rigid when one link is fixed.

    `links`: numbers of the pins on each link, the fixed one among them; a bar is a link of two
    pins.
    """
    steps = [(j, pins[0], pin) for j, pins in enumerate(links) for pin in pins[1:]]
    _, found = walk([(u, v) for _, u, v in steps])
    rng = random.Random(len(links))
    lengths = [rng.randrange(PRIME) for _ in steps]
    matrix = []
    for loop in found:
        row = [0] * len(links)
        for e, sign in loop.items():
            row[steps[e][0]] += sign * lengths[e]
        matrix.append([value % PRIME for value in row])
    return common_points(ranks(matrix, len(links)))


def ranks(matrix: list[list[int]], n: int) -> list[int]:
    """Return by set of coordinates (a mask) the rank of the null space of a matrix on them."""
    full = (1 << n) - 1
    rank_of = [_rank([[row[j] for j in range(n) if mask >> j & 1] for row in matrix])
           for mask in range(1 << n)]  # fmt: skip
    return [mask.bit_count() - rank_of[full] + rank_of[full ^ mask] for mask in range(1 << n)]


def _rank(rows: list[list[int]]) -> int:
    """Return the rank modulo the prime."""
    rank, rows = 0, [list(row) for row in rows]
    for column in range(len(rows[0]) if rows else 0):
        pivot = next((k for k in range(rank, len(rows)) if rows[k][column]), None)
        if pivot is None:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        inverse = pow(rows[rank][column], -1, PRIME)
        for k in range(rank + 1, len(rows)):
            if rows[k][column]:
                factor = rows[k][column] * inverse % PRIME
                rows[k] = [
                    (a - factor * b) % PRIME for a, b in zip(rows[k], rows[rank], strict=True)
                ]
        rank += 1
    return rank


def common_points(r: list[int]) -> int:
    """Return c(M, M) of a matroid given by the rank of each set of elements (a mask)."""
    full = len(r) - 1
    singles = [1 << j for j in range(full.bit_length())]

    def flat(edges: int, contracted: int, within: int) -> bool:
        least = r[edges | contracted]
        return all(r[edges | contracted | one] > least for one in singles if one & within & ~edges)

    @cache
    def count(E: int, m: int, n: int) -> int:
        """Return c((M/m)|E, (N/n)|E)."""
        here = r[E | m] - r[m], r[E | n] - r[n]
        if sum(here) != E.bit_count() + 1:
            return 0
        if not flat(0, m, E) or not flat(0, n, E):  # loops
            return 0
        if E & (E - 1) == 0:
            return 1
        e = E & -E
        rest, total, P = E ^ e, 0, E ^ e
        while True:
            Q = rest ^ P
            if flat(P | e, m, E) and flat(Q | e, n, E):
                total += part(P, m, Q | e | n, e, m) * part(Q, P | e | m, n, e, n)
            if not P:
                return total
            P = (P - 1) & rest

    def part(edges: int, m: int, n: int, e: int, held: int) -> int:
        """Return the points in one part; `e` must not add to the rank of the part it leaves."""
        if not edges:
            return 1
        if r[edges | held] != r[edges | e | held]:
            return 0
        return count(edges, m, n)

    return count(full, 0, 0)

"""How many complex poses a linkage of pins, guides and slots has for generic dimensions.

With w_j = exp(i theta_j) and 1/w_j of the links, one of them fixed, a pose is a point w of a linear
space L, the closures, whose reciprocal is in another such space L': both have the matroid M of the
loops for generic links. Sizes of the links scale L' against L by a generic element of the
torus, so the number of poses is the number in which the tropical fan of M meets a generic translate
of its mirror image; each point of it counts once.

That number obeys a recursion, as that of a graph of bars does (the Laman number: Capco, Gallet,
Grasegger, Koutschan, Lubbes, Schicho 2018). For matroids M and N on the elements E and any e in E

    c(M, N) = sum of c(M|P, N/(Q+e)) c(M/(P+e), N|Q)

over the ways to part E - e into P and Q such that P + e is a flat of M and Q + e one of N.

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
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations

import numpy as np

from mechdae.types import Floats, Integers, Matrix

Tree = dict[int, dict[int, int]]
"""By pin the steps {step: sign} that lead to it from the first one."""


def walk(steps: Sequence[tuple[int, int]]) -> tuple[Tree, list[dict[int, int]]]:
    """Return a tree of steps (from, to), and the loops {step: sign} that the other steps close."""
    tree: Tree = {steps[0][0]: {}} if steps else {}
    left, found = list(range(len(steps))), []
    while left:
        again = []
        for e in left:
            u, v = steps[e]
            if u in tree and v in tree:
                loop = dict(tree[u])
                loop[e] = loop.get(e, 0) + 1
                for other, sign in tree[v].items():
                    loop[other] = loop.get(other, 0) - sign
                found.append({other: sign for other, sign in loop.items() if sign})
            elif u in tree:
                tree[v] = {**tree[u], e: 1}
            elif v in tree:
                tree[u] = {**tree[v], e: -1}
            else:
                again.append(e)
        if len(again) == len(left):
            raise ValueError("the linkage falls apart")
        left = again
    return tree, found


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


LARGEST_SLIDING = 11
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
    if n > LARGEST_SLIDING or n != 2 * len(loops) + 1:
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

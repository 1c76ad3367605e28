"""Certificates of poses of a linkage: there, alone, real or not, apart from each other.

With v = 1/w as unknowns of their own the equations are quadrics, A w + ... = 0, A' v + ... = 0,
w_j v_j = 1, and Newton and Kantorovich's theorem holds in C^n: with eta = |J^-1 F| and K a bound
of J^-1 F'' there is one solution within 2 eta where K eta <= 1/4, and no other within 1/K. Unknowns
are measured by their own sizes. Rounding, and that of the numbers given, counts as `GRAIN` of each
term.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.numerics.homotopy.linkage import ComplexDimensions, PinLinkage
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Matrices, Matrix

GRAIN = 1e-13
LARGEST = 0.25
SOUND = 0.01
"""Most that a computed inverse may miss the inverse by."""


@dataclass(frozen=True)
class CertifiedPoses:
    """Of each of n poses (n,): whether it is ``simple``, ``real``, not real (``other``).

    ``y`` (n, k) are turns, their reciprocals and slides, ``size`` (n, k) what they are measured by,
    ``radius`` bounds the error, within ``alone`` there is no other solution.
    """

    y: Complexes
    size: Matrix
    simple: Booleans
    real: Any
    other: Booleans
    radius: Floats
    alone: Floats


def certify(
    linkage: PinLinkage, numbers: ComplexDimensions, x: Complexes, real: bool = True
) -> CertifiedPoses:
    """Certify solutions x (n, k) of a linkage; where its numbers are `real`, tell real ones."""
    m, k = max(linkage.turns), len(linkage.slides)
    x = np.asarray(x, complex)
    with np.errstate(all="ignore"):
        w = np.exp(x[:, :m])
        y = np.concatenate([w, 1 / w, x[:, m:]], axis=1)
        F, J, noise, terms = _quadrics(linkage, numbers, y)
        size = np.concatenate([np.abs(w), 1 / np.abs(w), np.maximum(np.abs(x[:, m:]), 1.0)], axis=1)
        J, terms = J * size[:, None, :], terms * size[:, None, :]
        try:
            Y = np.linalg.inv(J)
        except np.linalg.LinAlgError:
            Y = np.full(J.shape, np.nan, complex)
        miss = np.linalg.norm(Y @ J - np.eye(2 * m + k), axis=(1, 2))
        miss += np.linalg.norm(np.abs(Y) @ terms, axis=(1, 2)) * GRAIN
        factor = 1 / (1 - miss)
        eta = np.linalg.norm(np.einsum("nij,nj->ni", Y, F), axis=1)
        eta += np.linalg.norm(np.einsum("nij,nj->ni", np.abs(Y), noise), axis=1) * GRAIN
        eta *= factor
        K = factor * _bent(linkage, numbers, Y, size)
        simple = (miss <= SOUND) & (K * eta <= LARGEST)
        radius, alone = 2 * eta, 1 / K
    nothing = np.zeros(len(x), bool)
    if not real:
        return CertifiedPoses(y, size, simple, nothing, nothing, radius, alone)
    mirrored = np.conj(np.concatenate([y[:, m : 2 * m], y[:, :m], y[:, 2 * m :]], axis=1))
    swapped = np.concatenate([size[:, m : 2 * m], size[:, :m], size[:, 2 * m :]], axis=1)
    with np.errstate(all="ignore"):
        gap = np.linalg.norm((mirrored - y) / size, axis=1)
        spread = radius * (swapped / size).max(axis=1)
        is_real = simple & (gap + spread <= alone)
        is_other = simple & (gap > spread + radius)
    return CertifiedPoses(y, size, simple, is_real, is_other, radius, alone)


def _quadrics(
    linkage: PinLinkage, numbers: ComplexDimensions, y: Complexes
) -> tuple[Complexes, Complexes, Floats, Matrices]:
    """Return F, J and the sums of the sizes of their terms."""
    n, m, k = len(y), max(linkage.turns), len(linkage.slides)
    loops, turns, slides = linkage.loops, linkage.step_turns, linkage.step_slides
    count = len(loops)
    rows = 2 * count + m
    F, J = np.zeros((n, rows), complex), np.zeros((n, rows, 2 * m + k), complex)
    noise, terms = np.zeros((n, rows)), np.zeros((n, rows, 2 * m + k))
    one = np.ones((n, 1))
    s = y[:, 2 * m :]
    sides = (
        (numbers.a, numbers.n, y[:, :m], 0),
        (numbers.mirrored_a, numbers.mirrored_n, y[:, m : 2 * m], m),
    )
    for side, (a, columns, w, first) in enumerate(sides):
        here = slice(side * count, (side + 1) * count)
        turned = np.concatenate([one, w], axis=1)[:, turns]
        arm = np.broadcast_to(a, turned.shape).copy()
        large = np.abs(arm)
        for e in np.flatnonzero(slides >= 0):
            along = columns[slides[e]]
            arm[:, e] += s[:, slides[e]] * along
            large[:, e] += np.abs(s[:, slides[e]] * along)
            J[:, here, 2 * m + slides[e]] += loops[:, e] * (along * turned[:, e])[:, None]
            terms[:, here, 2 * m + slides[e]] += np.abs(
                loops[:, e] * (along * turned[:, e])[:, None]
            )
        F[:, here] = (arm * turned) @ loops.T
        noise[:, here] = (large * np.abs(turned)) @ np.abs(loops.T)
        for j in range(1, m + 1):
            held = turns == j
            J[:, here, first + j - 1] = arm[:, held] @ loops[:, held].T
            terms[:, here, first + j - 1] = large[:, held] @ np.abs(loops[:, held].T)
    last = 2 * count + np.arange(m)
    w, v = y[:, :m], y[:, m : 2 * m]
    F[:, last], noise[:, last] = w * v - 1, 2.0
    J[:, last, np.arange(m)], J[:, last, m + np.arange(m)] = v, w
    terms[:, last, np.arange(m)], terms[:, last, m + np.arange(m)] = np.abs(v), np.abs(w)
    return F, J, noise, terms


def _bent(linkage: PinLinkage, numbers: ComplexDimensions, Y: Complexes, size: Floats) -> Any:
    """Return a bound K (n,) of the second derivative of Y F.

    A sum of g_t (p_a q_b + p_b q_a) over pairs of unknowns is at most |G| |p| |q|, where no unknown
    is in two pairs, and at most sqrt(d) times that where it is in d of them.
    """
    m, k = max(linkage.turns), len(linkage.slides)
    count = len(linkage.loops)
    columns = [Y[:, :, 2 * count : 2 * count + m]]
    shared = np.ones(2 * m + k)
    for e in np.flatnonzero(linkage.step_slides >= 0):
        slide, turn = linkage.step_slides[e], linkage.step_turns[e]
        sides = ((numbers.n, 0, 0), (numbers.mirrored_n, count, m))
        for n, row, first in sides:
            scale = size[:, 2 * m + slide]
            if turn:
                scale = scale * size[:, first + turn - 1]
                shared[first + turn - 1] += 1
                shared[2 * m + slide] += 1
                rows = linkage.loops[:, e] * n[slide]
                column = np.einsum("nil,l->ni", Y[:, :, row : row + count], rows)
                columns.append((column * scale[:, None])[:, :, None])
    G = np.concatenate(columns, axis=2)
    return np.sqrt(shared.max()) * np.linalg.norm(G, axis=(1, 2))


def apart(certified: CertifiedPoses) -> bool:
    """Return whether all poses are proven to be different ones."""
    y, size, radius = certified.y, certified.size, certified.radius
    with np.errstate(all="ignore"):
        for i in range(len(y) - 1):
            later = slice(i + 1, len(y))
            gap = np.linalg.norm((y[later] - y[i]) / size[i], axis=1)
            theirs = radius[later] * (size[later] / size[i]).max(axis=1)
            if not (gap > radius[i] + theirs).all():
                return False
    return True

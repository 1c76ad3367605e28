"""All complex poses of pin-jointed linkages by Dixon's determinant: one eigenvalue problem.

Wampler, *Solving the kinematics of planar mechanisms by Dixon determinant and a complex-plane
formulation* (2001): with turns w and 1/w as unknowns the 2 l equations of l loops are linear in
each; with one turn hidden the determinant of their divided differences by the others is a form
t(alpha)' (P + x Q) t(theta) in products of reciprocals, of C(2 l, l) rows. Poses are eigenvectors.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

Links = list[dict[int, complex]]
"""Of each link the places of its pins in its own frame, by number; the first one is fixed."""
FAR = 12.0
"""Logarithm of a turn that is at infinity."""
NOTHING = 1e-13
"""Share of the largest entry of the form below which a row or a column is empty."""


def loops_of(links: Links) -> Any:
    """Return the factors (l, links) of the turns in independent closures."""
    n = len(links)
    of_pin: dict[int, list[int]] = {}
    for j, own in enumerate(links):
        for pin in own:
            of_pin.setdefault(pin, []).append(j)
    place: dict[int, Any] = {0: np.zeros(n, complex)}
    rest, rows = sorted(of_pin), []
    while rest:
        left = []
        for pin in rest:
            i, j = of_pin[pin]
            ends = [np.eye(n)[k] * links[k][pin] for k in (i, j)]
            if i in place and j in place:
                rows.append(place[i] + ends[0] - place[j] - ends[1])
            elif i in place:
                place[j] = place[i] + ends[0] - ends[1]
            elif j in place:
                place[i] = place[j] + ends[1] - ends[0]
            else:
                left.append(pin)
        rest = left
    return np.array(rows)


def all_poses(links: Links, hidden: int = 1, shift: complex = 0.8 + 0.5j) -> Any:
    """Return the turns (n, links) of all complex poses, the first one 1, and how open they are.

    Found are those that Newton's method keeps; none is invented, `hidden` and `shift` decide how
    well they are separated.
    """
    loops = loops_of(links)
    others = [k for k in range(1, len(links)) if k != hidden]
    size = len(loops)
    if len(others) != 2 * size - 1:
        raise ValueError("these links are not rigid for generic dimensions")
    P, Q, index = pencil(loops, others, hidden)
    large = np.abs(P) + np.abs(Q)
    rows, columns = (large.max(axis=k) > NOTHING * large.max() for k in (1, 0))
    P, Q = P[rows][:, columns], Q[rows][:, columns]
    at = {T: int(columns[:k].sum()) for T, k in index.items() if columns[k]}
    values, vectors = np.linalg.eig(np.linalg.solve(P + shift * Q, Q))
    with np.errstate(all="ignore"):
        w = np.ones((len(values), len(links)), complex)
        w[:, hidden] = shift - 1 / values
        for k, other in enumerate(others):
            pairs = [(T, tuple(sorted((*T, k)))) for T in at if len(T) < size and k not in T]
            pairs = [(T, more) for T, more in pairs if more in at]
            low = vectors[[at[T] for T, _ in pairs]]
            high = vectors[[at[T] for _, T in pairs]]
            best = np.argmax(np.minimum(np.abs(low), np.abs(high)), axis=0)[None]
            w[:, other] = (np.take_along_axis(low, best, 0) / np.take_along_axis(high, best, 0))[0]
    return polished(loops, w)


def pencil(loops: Any, others: list[int], hidden: int) -> tuple[Any, Any, dict[Any, int]]:
    """Return P and Q of Dixon's form, and the row of each product of reciprocals."""
    size, K = len(loops), len(others)
    mirrored = np.conj(loops)
    A, B = loops[:, others].T, mirrored[:, others].T
    sets = [*combinations(range(K), size), *combinations(range(K), size - 1)]
    index = {T: k for k, T in enumerate(sets)}
    P, Q = (np.zeros((len(sets), len(sets)), complex) for _ in range(2))

    def sign(rows: Any) -> int:
        return -1 if (sum(rows) + size * (size - 1) // 2) % 2 else 1

    def det(*rows: Any) -> complex:
        return complex(np.linalg.det(np.array(rows)))

    for T in sets[: len(sets) // 2]:
        S = [k for k in range(K) if k not in T]
        factor = sign([0, *(k + 1 for k in S)]) * (-1) ** size * det(*B[list(T)])
        P[index[T], index[T]] += factor * det(loops[:, 0], *A[S])
        Q[index[T], index[T]] += factor * det(loops[:, hidden], *A[S])
    for T in sets[len(sets) // 2 :]:  # these rows are multiplied by the hidden turn
        R = [k for k in range(K) if k not in T]
        factor = sign([k + 1 for k in R]) * (-1) ** (size - 1) * det(*A[R])
        own = B[list(T)]
        Q[index[T], index[T]] += factor * det(mirrored[:, 0], *own)
        P[index[T], index[T]] += factor * det(mirrored[:, hidden], *own)
        for k in R:
            value = factor * det(B[k], *own)
            more = index[tuple(sorted((*T, k)))]
            P[more, index[T]] += value
            Q[index[T], more] += value
    return P, Q, index


def polished(loops: Any, w: Any, steps: int = 12) -> Any:
    """Return the different turns that Newton's method leads to and how open the loops are."""
    mirrored = np.conj(loops)
    with np.errstate(all="ignore"):
        z = np.log(w[:, 1:])
        for _ in range(steps):
            turned = np.exp(np.concatenate([np.zeros((len(z), 1)), z], axis=1))
            F = np.concatenate([turned @ loops.T, (1 / turned) @ mirrored.T], axis=1)
            J = np.concatenate(
                [loops[:, 1:] * turned[:, None, 1:], -mirrored[:, 1:] / turned[:, None, 1:]], axis=1
            )
            good = np.isfinite(J).all(axis=(1, 2))
            z, F, J = z[good], F[good], J[good]
            try:
                change = np.linalg.solve(J, F[..., None])[..., 0]
            except np.linalg.LinAlgError:
                change = np.linalg.pinv(J) @ F[..., None]
                change = change[..., 0]
            z = z - change
        turned = np.exp(np.concatenate([np.zeros((len(z), 1)), z], axis=1))
        size = np.abs(loops) @ np.abs(turned).T + np.abs(loops) @ np.abs(1 / turned).T
        open_by = np.abs(turned @ loops.T).T / size + np.abs((1 / turned) @ mirrored.T).T / size
        sure = (np.abs(change) < 1e-9).all(axis=1) & (open_by.max(axis=0) < 1e-12)
        sure &= np.abs(z.real).max(axis=1) < FAR
    kept: list[Any] = []
    for own in turned[sure]:
        if all(np.abs(own / other - 1).max() > 1e-6 for other in kept):
            kept.append(own)
    return np.array(kept).reshape(-1, loops.shape[1])

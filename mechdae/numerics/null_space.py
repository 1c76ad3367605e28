"""Rank and null spaces by one rule of what counts as zero, and small least squares problems.

Rows are brought to one size first: equations in metres and in radians have no common one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.types import Complexes, Floats, Jacobian, Matrix

ZERO = 1e-9
"""Share of the largest singular value up to which one counts as zero."""
SHARE = 1e-6
"""Part in a combination that vanishes above which a row belongs to it."""


def rank(sigma: Floats, share: float = ZERO) -> int:
    """Return how many of falling singular values (n,) do not count as zero."""
    return int(np.count_nonzero(sigma > share * sigma[0])) if len(sigma) else 0


def unit_rows(matrix: Matrix) -> tuple[Floats, Floats]:
    """Return a matrix with rows of length 1, rows of zeros as they are, and the lengths (m, 1)."""
    norms = np.linalg.norm(matrix, axis=1, keepdims=True)
    norms = np.where(norms > 0, norms, 1.0)
    return matrix / norms, norms


def freedoms(J: Jacobian, sizes: Floats | float = 1.0, share: float = ZERO) -> Floats:
    """Return an orthonormal basis (n, k) of J x = 0, x over natural `sizes` (n,)."""
    if not len(J):
        return np.eye(J.shape[1])
    _, sigma, right = np.linalg.svd(unit_rows(J * sizes)[0])
    return right[rank(sigma, share) :].T


def dependences(matrix: Matrix) -> Floats:
    """Return an orthonormal basis (m, k) of the combinations of rows of length 1 that vanish."""
    left, sigma, _ = np.linalg.svd(unit_rows(matrix)[0])
    return left[:, rank(sigma) :]


def dependent(matrix: Matrix) -> Any:
    """Return which rows (m,) of a matrix depend on each other."""
    return np.abs(dependences(matrix)).max(axis=1, initial=0.0) > SHARE


def equilibrated_null_space(B: Matrix, share: float = ZERO) -> Floats:
    """Return a basis (n, k) of B x = 0 in columns of length 1, rows and columns equilibrated.

    Columns of zeros are left out: their unknowns are zero.
    """
    used = np.flatnonzero(np.abs(B).max(axis=0) > 0)
    scaled = B[:, used]
    left, right = np.ones(len(scaled)), np.ones(len(used))
    for _ in range(4):
        left /= np.sqrt(np.abs(left[:, None] * scaled * right).max(axis=1))
        right /= np.sqrt(np.abs(left[:, None] * scaled * right).max(axis=0))
    _, sigma, vectors = np.linalg.svd(left[:, None] * scaled * right)
    basis = right[:, None] * vectors[rank(sigma, share) :].T
    norms = np.sqrt((basis * basis).sum(axis=0))
    whole = np.zeros((B.shape[1], basis.shape[1]))
    whole[used] = basis / np.where(norms > 0, norms, 1.0)
    return whole


def natural_null_space(B: Floats, sizes: Floats, units: Floats, share: float = ZERO) -> Any:
    """Return the same for columns that may vanish: their unknowns are free.

    `sizes` (m,): natural sizes of the rows' coordinates, by which they are multiplied. `units`
    (n,): natural sizes of the columns, by which they are divided. `share`: of the largest singular
    value up to which one counts as zero.
    """
    scaled = sizes[:, None] * B / units
    norms = np.linalg.norm(scaled, axis=0)
    free = norms <= share * norms.max(initial=0.0)
    held = np.flatnonzero(~free)
    inside = equilibrated_null_space(scaled[:, held], share) if len(held) else np.zeros((0, 0))
    whole = np.zeros((B.shape[1], inside.shape[1] + int(free.sum())))
    whole[held, : inside.shape[1]] = inside
    whole[np.flatnonzero(free), inside.shape[1] + np.arange(int(free.sum()))] = 1.0
    whole = whole / units[:, None]
    return whole / np.linalg.norm(whole, axis=0)


def linear_fit(
    A: Floats, b: Complexes, ridge: float = 0.0, least: float = 0.0, sizes: Floats | float = 1.0
) -> Complexes:
    """Return the c (n, m) of least sum |A c - b|^2 + damping |c/sizes|^2.

    `A` (n, k, m): real or complex columns of each problem. `b` (k,) or (n, k): targets. `ridge`,
    `least`: the damping: a share of the trace of A* A over sizes, and a number. `sizes` (m,): what
    the unknowns are measured by, to a power of two: that leaves all bits.
    """
    even = np.exp2(np.round(np.log2(sizes)))
    A = A * even
    turned, at = A.conj(), range(A.shape[2])
    N = np.einsum("nki,nkj->nij", turned, A)
    right = np.einsum("nki,k->ni" if b.ndim == 1 else "nki,nk->ni", turned, b)
    N[:, at, at] += (least + ridge * np.maximum(np.trace(N, axis1=1, axis2=2), 1e-300))[:, None]
    return even * np.linalg.solve(N, right[:, :, None])[:, :, 0]


def solve(J: Jacobian, F: Floats) -> Any:
    """Return the step J^-1 F, with more equations than unknowns that of least squares."""
    if J.shape[0] == J.shape[1]:
        return np.linalg.solve(J, F)
    return np.linalg.lstsq(J, F)[0]

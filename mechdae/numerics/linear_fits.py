"""Small linear least squares problems, many at once: what variable projection eliminates."""

from __future__ import annotations

import numpy as np

from mechdae.types import Complexes, Floats


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

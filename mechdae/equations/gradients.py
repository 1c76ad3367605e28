"""Gradients of columns of expressions, by position: most of them are sparse."""

from __future__ import annotations

import casadi as ca

from mechdae.types import Sym


def gradients(column: Sym, symbols: Sym) -> list[dict[int, Sym]]:
    """Return the gradient of each entry of a column, by position in `symbols`."""
    jacobian = ca.jacobian(column, symbols)
    result: list[dict[int, Sym]] = [{} for _ in range(jacobian.shape[0])]
    triplet = zip(*jacobian.sparsity().get_triplet(), jacobian.nonzeros(), strict=True)
    for i, j, entry in triplet:
        result[i][j] = entry
    return result

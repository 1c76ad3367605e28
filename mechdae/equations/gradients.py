"""Gradients of columns of expressions, by position: most of them are sparse."""

from __future__ import annotations

from typing import Any

import casadi as ca


def gradients(column: Any, symbols: Any) -> list[dict[Any, Any]]:
    """Return the gradient of each entry of a column, by position in `symbols`."""
    jacobian = ca.jacobian(column, symbols)
    result: list[dict[Any, Any]] = [{} for _ in range(jacobian.shape[0])]
    triplet = zip(*jacobian.sparsity().get_triplet(), jacobian.nonzeros(), strict=True)
    for i, j, entry in triplet:
        result[i][j] = entry
    return result

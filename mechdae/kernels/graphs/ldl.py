"""LDL^T of a symmetric matrix of symbols, unrolled: only entries that can be non-zero cost."""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.types import Sym

SX = ca.SX
Column = dict[int, Any]
"""Entries of a vector by place."""


class Factor:
    """LDL^T without pivoting of a definite matrix, in the order of least fill.

    Parameters
    ----------
    matrix
        Symmetric SX matrix (n, n).
    """

    def __init__(self, matrix: Sym) -> None:
        self.n: int = matrix.shape[0]
        rows: list[Column] = [{} for _ in range(self.n)]
        triplet = zip(*matrix.sparsity().get_triplet(), matrix.nonzeros(), strict=True)
        for i, j, entry in triplet:
            if not entry.is_zero():
                rows[i][j] = entry
        for i in range(self.n):
            rows[i].setdefault(i, SX(0))
        self.order: list[int] = _least_fill(rows)
        self.place: dict[int, int] = {i: k for k, i in enumerate(self.order)}
        self.pivots: Column = {}
        self.lower: dict[int, Column] = {}
        for i in self.order:
            row, pivot = rows[i], rows[i][i]
            self.pivots[i] = pivot
            later = [j for j in row if j != i and self.place[j] > self.place[i]]
            self.lower[i] = {j: row[j] / pivot for j in later}
            for a, j in enumerate(later):
                for k in later[a:]:
                    change = -self.lower[i][j] * row[k]
                    rows[j][k] = rows[j][k] + change if k in rows[j] else change
                    rows[k][j] = rows[j][k]

    def forward(self, column: Column) -> Column:
        """Return L^-1 b."""
        found = dict(column)
        for i in self.order:
            if i in found:
                for j, factor in self.lower[i].items():
                    change = -factor * found[i]
                    found[j] = found[j] + change if j in found else change
        return found

    def backward(self, column: Column) -> Column:
        """Return L^-T b."""
        found = dict(column)
        for i in reversed(self.order):
            total = found.get(i)
            for j, factor in self.lower[i].items():
                if j in found:
                    change = -factor * found[j]
                    total = change if total is None else total + change
            if total is not None:
                found[i] = total
        return found

    def divided(self, column: Column) -> Column:
        """Return D^-1 b."""
        return {i: entry / self.pivots[i] for i, entry in column.items()}

    def solve(self, column: Sym) -> Sym:
        """Return the solution (n,) of a dense right-hand side (n,)."""
        found = self.backward(self.divided(self.forward(entries(column))))
        return vector(found, self.n)


def entries(column: Sym) -> Column:
    """Return a column vector by places."""
    sparse = SX(column)
    found: Any = zip(sparse.sparsity().row(), sparse.nonzeros(), strict=True)
    return {i: entry for i, entry in found if not entry.is_zero()}


def vector(column: Column, n: int) -> Sym:
    """Return a dense vector (n,) of entries by places."""
    return ca.vertcat(*[column.get(i, SX(0)) for i in range(n)]) if n else SX(0, 1)


def _least_fill(rows: list[Column]) -> list[int]:
    """Return the order of least degree."""
    around = {i: set(row) - {i} for i, row in enumerate(rows)}
    order = []
    while around:
        i = min(around, key=lambda k: (len(around[k]), k))
        neighbours = around.pop(i)
        for j in neighbours:
            around[j] |= neighbours - {j}
            around[j].discard(i)
        order.append(i)
    return order

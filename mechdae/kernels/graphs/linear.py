"""Linear equations in symbols: multipliers of one group or of eliminated rows, LDL^T unrolled.

Variables with constant pivots are eliminated, what is left is split into blocks; redundant
rows get the shortest of all solutions.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.equations.motion_equations import Released
from mechdae.equations.reduction import eliminate, split
from mechdae.kernels.graphs.blocks import inverse, left_inverse
from mechdae.types import Sym

SX = ca.SX


def solution(balance: list[Sym], lam: list[Sym]) -> Sym:
    """Return the multipliers that solve linear equations, over the other symbols in them."""
    equations = [(row, "", "") for row in balance]
    solved, rest, left = eliminate(equations, list(lam), [])
    values: dict[str, Sym] = {}
    if not rest:
        values = {str(symbol): SX(0) for symbol in left}
    elif len(rest) < len(left):  # redundant rows: the shortest of all solutions
        A, c = _linear(rest, left)
        found = left_inverse(A.T).T @ -c
        values = {str(symbol): found[k] for k, symbol in enumerate(left)}
    else:
        for unknowns, rows in split(rest, left):
            A, c = _linear(rows, unknowns)
            known = [s for s in left if str(s) in values]
            if known:
                c = ca.substitute(
                    c, ca.vertcat(*known), ca.vertcat(*[values[str(s)] for s in known])
                )
            found = inverse(A)[0] @ -c
            values |= {str(symbol): found[k] for k, symbol in enumerate(unknowns)}
    if left:
        symbols = ca.vertcat(*left)
        replaced = ca.vertcat(*[values[str(symbol)] for symbol in left])
        for symbol, expression, _ in solved:
            values[str(symbol)] = ca.substitute(expression, symbols, replaced)
    else:
        values |= {str(symbol): expression for symbol, expression, _ in solved}
    return ca.vertcat(*[SX(values[str(symbol)]) for symbol in lam])


def _linear(equations: list[tuple[Sym, str, str]], unknowns: list[Sym]) -> tuple[Sym, Sym]:
    """Return matrix and constant part of linear equations."""
    rows = ca.vertcat(*[expression for expression, _, _ in equations])
    x = ca.vertcat(*unknowns)
    return ca.densify(ca.jacobian(rows, x)), ca.substitute(rows, x, SX.zeros(x.numel()))


def among(symbol: Sym, groups: list[Sym]) -> bool:
    """Return whether a symbol is one of the entries."""
    key = symbol.element_hash()
    return any(key == entry.element_hash() for group in groups for entry in group.elements())


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


def recovered(r: Released, push: Sym, multipliers: Sym) -> Sym:
    """Return the multipliers of all equations, (rows,).

    Those of the eliminated equations balance the eliminated coordinates, block by block; their
    matrix has constant pivots.

    Parameters
    ----------
    r
        The equations of motion.
    push
        Forces less inertia at the absolute coordinates, (nq,).
    multipliers
        Those of the equations that are left.
    """
    model = r.model
    rows = ca.vertcat(*[row.expression for row in r.rows])
    gradient = ca.sparsify(r.moved(ca.jacobian(rows, model.q)))
    found: dict[int, Sym] = {i: multipliers[k] for k, i in enumerate(r.left)}
    found |= {i: SX(0) for i in r.empty}
    columns: list[dict[int, Sym]] = [{} for _ in range(model.q.numel())]
    triplet = zip(*gradient.sparsity().get_triplet(), gradient.nonzeros(), strict=True)
    for i, j, entry in triplet:
        columns[j][i] = entry
    matrix = gradient[r.gone, r.solved].T if r.gone else SX(0, 0)
    count, rowperm, colperm, rowblock, colblock, *_ = matrix.sparsity().btf()
    for k in range(count):
        places = [r.solved[i] for i in rowperm[rowblock[k] : rowblock[k + 1]]]
        equations = [r.gone[j] for j in colperm[colblock[k] : colblock[k + 1]]]
        left = []
        for j in places:
            total = push[j]
            for i, entry in columns[j].items():
                if i not in equations:
                    total -= entry * found[i]
            left.append(total)
        block = SX(len(places), len(equations))
        for row, j in enumerate(places):
            for column, i in enumerate(equations):
                block[row, column] = columns[j].get(i, SX(0))
        values = inverse(block)[0] @ ca.vertcat(*left)
        found |= {i: values[n] for n, i in enumerate(equations)}
    return ca.vertcat(*[found[i] for i in range(len(r.rows))])

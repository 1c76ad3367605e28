"""Symbolic solution of the linear equations of one group for its multipliers.

Variables with constant pivots are eliminated, what is left is split into blocks; redundant
rows get the shortest of all solutions.
"""

from __future__ import annotations

import casadi as ca

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
        for unknowns, own in split(rest, left):
            A, c = _linear(own, unknowns)
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

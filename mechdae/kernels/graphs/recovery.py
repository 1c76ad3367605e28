"""Multipliers of eliminated equations, from those that are left and the balance of forces."""

from __future__ import annotations

import casadi as ca

from mechdae.equations.motion_equations import Released
from mechdae.kernels.graphs.blocks import inverse
from mechdae.types import Sym

SX = ca.SX


def recovered(r: Released, push: Sym, kept: Sym) -> Sym:
    """Return the multipliers of all equations, (rows,).

    Those of the eliminated equations balance the eliminated coordinates, block by block; their
    matrix has constant pivots.

    Parameters
    ----------
    r
        The equations of motion.
    push
        Forces less inertia at the absolute coordinates, (nq,).
    kept
        Multipliers of the equations that are left.
    """
    model = r.model
    rows = ca.vertcat(*[row.expression for row in r.rows])
    gradient = ca.sparsify(r.moved(ca.jacobian(rows, model.q)))
    found: dict[int, Sym] = {i: kept[k] for k, i in enumerate(r.left)}
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

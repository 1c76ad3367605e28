"""Sizes of forces that follow from the multipliers of their own group, as casadi expressions.

Within a group lambda = L + S m is affine in its own sizes, so that the linear forms of a
feedback are start + slope m and its law says m = size(forms). Newton's method finds m in a few
steps, and sum |dsize/dm| < 1 proves that there is no other solution (Banach).
"""

from __future__ import annotations

import casadi as ca

from mechdae.equations.forces.feedback import ACROSS
from mechdae.kernels.graphs.blocks import inverse
from mechdae.types import Sym

SX = ca.SX


def size_of(law: str, forms: Sym) -> Sym:
    """Return the size of a feedback for the values of its forms."""
    if law == "length":
        return ca.sqrt(ca.sumsqr(forms))
    if law in ACROSS:
        return forms[0] * forms[1 + ACROSS.index(law)] / _least(ca.norm_2(forms[1:]))
    values = ca.vertsplit(forms)
    if len(values) == 2 and ca.is_equal(values[0], -values[1], 2):
        return ca.fabs(values[0])
    result = values[0]
    for value in values[1:]:
        result = ca.fmax(result, value)
    return result


def _gradient(law: str, forms: Sym, slopes: list[Sym]) -> list[Sym]:
    """Return the derivatives of a size along the slopes of its forms."""
    if law == "length":
        length = ca.fmax(ca.sqrt(ca.sumsqr(forms)), 1e-300)
        return [ca.dot(forms, slope) / length for slope in slopes]
    if law in ACROSS:  # d (p t / |t|) = dp t / |t| + p (dt - t (t . dt) / |t|^2) / |t|
        p, t = forms[0], forms[1:]
        size, k = _least(ca.norm_2(t)), ACROSS.index(law)
        return [
            (slope[0] * t[k] + p * slope[1 + k] - p * t[k] * ca.dot(t, slope[1:]) / size**2) / size
            for slope in slopes
        ]
    values = ca.vertsplit(forms)
    best, found = values[0], [slope[0] for slope in slopes]
    for k, value in enumerate(values[1:], start=1):
        larger = value > best
        found = [ca.if_else(larger, s[k], f) for s, f in zip(slopes, found, strict=True)]
        best = ca.fmax(best, value)
    return found


def _least(size: Sym) -> Sym:
    """Return a size that may be divided by."""
    return ca.fmax(size, 1e-150)


def _forms_at(start: list[Sym], slope: list[list[Sym]], m: list[Sym]) -> list[Sym]:
    return [
        first + sum((s * size for s, size in zip(row, m, strict=True)), SX(0))
        for first, row in zip(start, slope, strict=True)
    ]


def first_sizes(laws: list[str], start: list[Sym], slope: list[list[Sym]]) -> list[Sym]:
    """Return where Newton's method starts: sizes at m = 0, or 0 where these turn a force round.

    Of several solutions it is to come to the one that grows from no friction.
    """
    m = [size_of(law, forms) for law, forms in zip(laws, start, strict=True)]
    both = zip(laws, start, _forms_at(start, slope, m), strict=True)
    remaining = [ca.dot(one, other) >= 0 for law, one, other in both if law not in ACROSS]
    return [size * ca.if_else(ca.logic_all(ca.vertcat(*remaining)), 1, 0) for size in m]


def sizes_by_newton(
    laws: list[str],
    start: list[Sym],
    slope: list[list[Sym]],
    steps: int,
    first: list[Sym] | None = None,
) -> list[Sym]:
    """Return the sizes after some steps of Newton's method, from their values at m = 0."""
    m = first or [size_of(law, forms) for law, forms in zip(laws, start, strict=True)]
    if not any(entry.nnz() and not entry.is_zero() for row in slope for entry in row):
        return [size_of(law, forms) for law, forms in zip(laws, start, strict=True)]
    count = len(m)
    for _ in range(steps):
        forms = _forms_at(start, slope, m)
        rows, left = [], []
        for k in range(count):
            gradient = _gradient(laws[k], forms[k], slope[k])
            rows.append([SX(float(j == k)) - gradient[j] for j in range(count)])
            left.append(m[k] - size_of(laws[k], forms[k]))
        matrix = ca.vertcat(*[ca.horzcat(*row) for row in rows])
        step = inverse(matrix)[0] @ ca.vertcat(*left)
        m = [size - step[k] for k, size in enumerate(m)]
    return m


def miss_of(laws: list[str], start: list[Sym], slope: list[list[Sym]], m: list[Sym]) -> Sym:
    """Return how far sizes are from their laws, relative to the largest of them."""
    forms = _forms_at(start, slope, m)
    worst, size = SX(0), SX(0)
    for law, form, moment in zip(laws, forms, m, strict=True):
        worst = ca.fmax(worst, ca.fabs(moment - size_of(law, form)))
        size = ca.fmax(size, ca.fabs(moment))
    return worst / ca.fmax(size, 1e-300)


def contraction_of(laws: list[str], start: list[Sym], slope: list[list[Sym]]) -> Sym:
    """Return a bound of the contraction of m -> size(L + S m); below 1 there is one solution.

    In the norm max |m_j| / w_j with the positive weights w = 1 + K 1.
    """
    count = len(start)
    norms = {"length": lambda entry: ca.sqrt(ca.sumsqr(entry)), "largest": most}
    norms |= dict.fromkeys(ACROSS, _unbounded)
    K = [[norms[law](entry) for entry in row] for law, row in zip(laws, slope, strict=True)]
    weights = [1 + sum(row, SX(0)) for row in K]
    worst = SX(0)
    for k in range(count):
        total = sum((K[k][j] * weights[j] for j in range(count)), SX(0))
        worst = ca.fmax(worst, total / weights[k])
    return worst


def _unbounded(entry: Sym) -> Sym:
    """Return the bound of a law that has none: directions turn round where t vanishes."""
    return SX(0) if entry.is_zero() else ca.if_else(most(entry) > 0, SX.inf(), 0)


def most(entry: Sym) -> Sym:
    """Return the largest absolute value of a vector."""
    result = SX(0)
    for value in ca.vertsplit(entry):
        result = ca.fmax(result, ca.fabs(value))
    return result

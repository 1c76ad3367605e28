"""Errors of numbers computed from numbers against the same in 80 bits."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from mechdae.kernels.bounds.walk import ARRAYS, ROUNDOFF, SYMBOLIC, number_rounding, symbolic

TWO = (ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_POW, ca.OP_ATAN2, ca.OP_FMIN, ca.OP_FMAX)
ONE = (
    ca.OP_NEG, ca.OP_SQ, ca.OP_TWICE, ca.OP_INV, ca.OP_SIN, ca.OP_COS, ca.OP_TAN, ca.OP_SQRT,
    ca.OP_EXP, ca.OP_LOG, ca.OP_ASIN, ca.OP_ACOS, ca.OP_ATAN, ca.OP_SINH, ca.OP_COSH,
    ca.OP_TANH, ca.OP_FABS,
)  # fmt: skip
SETS = 300


@pytest.mark.parametrize("code", [*TWO, *ONE])
def test_errors_of_what_follows_from_a_difference(code: int) -> None:
    """x - y loses up to ten digits; what is computed of it is off by no more than said."""
    x, y, z = (ca.SX.sym(name) for name in "xyz")
    left = x * x - y * y
    squares = [(v * v, number_rounding(ca.OP_SQ, v * v, [(v, ca.SX(0))])) for v in (x, y)]
    error = number_rounding(ca.OP_SUB, left, squares)
    operands = [(left, error), (z, ca.SX(0))][: 2 if code in TWO else 1]
    result = symbolic(code, *[value for value, _ in operands])
    bound = number_rounding(code, result, operands)
    f = ca.Function("f", [x, y, z], [result, bound])
    rng = np.random.default_rng(code)
    seen = 0.0
    for _ in range(SETS):
        b = rng.uniform(0.1, 0.6)
        a, c = b * (1 + 10 ** rng.uniform(-10, -1)), rng.uniform(0.2, 2.0)
        c = -c if code == ca.OP_FMAX else c
        found, most = (float(v) for v in f(a, b, c))
        wide = [np.longdouble(v) for v in (a, b, c)]
        exact = ARRAYS[code](*[wide[0] ** 2 - wide[1] ** 2, wide[2]][: len(operands)])
        off = float(abs(np.longdouble(found) - exact)) / ROUNDOFF
        assert off <= most
        seen = max(seen, off / most) if most else seen
    assert seen > 0.01
    assert code in SYMBOLIC

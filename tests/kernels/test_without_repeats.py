"""Functions without repeated expressions give the numbers of those with them."""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.kernels.run.functions import without_repeats


def test_symbols_of_one_name_stay_apart() -> None:
    """casadi's own elimination takes them for one: sin x + sin y would be 2 sin x."""
    x, y, z = ca.SX.sym("i"), ca.SX.sym("i"), ca.SX.sym("i", 2)
    results = [ca.sin(x) + ca.sin(y), x * z + y * z, ca.cos(z[0]) - ca.cos(x)]
    at = [0.3, 0.7, [1.1, -0.4]]
    plain = ca.Function("plain", [x, y, z], results)
    lean = without_repeats("lean", [x, y, z], results)
    for wanted, found in zip(plain.call(at), lean.call(at), strict=True):
        assert np.array_equal(np.array(wanted), np.array(found))


def test_what_occurs_twice_is_computed_once() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    results = [ca.sin(x * y) + 1, 2 * ca.sin(x * y), ca.sin(x * y) * ca.exp(ca.sin(x * y))]
    lean = without_repeats("lean", [x, y], results)
    codes = [lean.instruction_id(k) for k in range(lean.n_instructions())]
    assert codes.count(ca.OP_SIN) == codes.count(ca.OP_MUL) - 1 == 1

"""Casadi functions for tests of the compiled machine: random graphs, and all operations."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from mechdae.kernels.machine.library import library

needs_machine = pytest.mark.skipif(
    library() is None, reason="the compiled machine is not built here, or another is chosen"
)
BINARY = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "fmin": ca.fmin,
    "fmax": ca.fmax,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "if": lambda a, b: ca.if_else(a, b, 0),
    "remainder": ca.remainder,
}
UNARY = {
    "neg": lambda a: -a,
    "sq": lambda a: a * a,
    "twice": lambda a: 2 * a,
    "inv": lambda a: 1 / a,
    "sqrt": ca.sqrt,
    "fabs": ca.fabs,
    "sign": ca.sign,
    "not": ca.logic_not,
}
"""Rounded as IEEE 754 says: the same bits everywhere."""
FUNCTIONS = {
    **{name: getattr(ca, name) for name in "tan asin acos atan sinh cosh tanh exp log".split()},
    "atan2": ca.atan2,
    "pow": lambda a, b: a**b,
}
"""Left to the C library."""
LOGIC = {"and": ca.logic_and, "or": ca.logic_or}
SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, np.inf, -np.inf, np.nan, 5e-324, 1e308, -3.25, 2.0]


def same(a: Any, b: Any) -> bool:
    """Return whether arrays are the same: nan like nan, zeros of any sign."""
    return bool(np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True))


def random_function(seed: int, size: int, functions: bool = False) -> Any:
    """Return a function (x, p, y) -> two vectors of a random graph with results used again."""
    random = np.random.default_rng(seed)
    inputs = [ca.SX.sym("x", 5), ca.SX.sym("p", 4), ca.SX.sym("y", 2)]
    values = [*ca.vertcat(*inputs).elements(), ca.SX(0.75), ca.SX(-2.5)]
    binary, unary = list(BINARY.values()), list(UNARY.values())
    if functions:
        unary += [ca.sin, ca.cos, ca.sin, ca.cos]
    for _ in range(size):
        near = values[-12:] if random.random() < 0.8 else values
        a, b = (near[random.integers(len(near))] for _ in range(2))
        kind = random.random()
        if kind < 0.6:
            values.append(binary[random.integers(4)](a, b))
        elif kind < 0.75:
            values.append(binary[random.integers(len(binary))](a, b))
        else:
            values.append(unary[random.integers(len(unary))](a))
    results = [
        ca.vertcat(*[values[k] for k in random.integers(len(values), size=count)])
        for count in (6, 3)
    ]
    results[1][2] = values[-1]
    return ca.Function("random", inputs, [ca.densify(r) for r in results], {"cse": True})


def numbers(seed: int, n: int, special: bool = True) -> list[Any]:
    """Return x (n, 5), p (4,), y (n, 2), some of them special."""
    random = np.random.default_rng(seed)
    x, p, y = random.normal(size=(n, 5)), random.normal(size=4), random.normal(size=(n, 2))
    if special:
        for array in (x, y):
            chosen = random.random(array.shape) < 0.1
            array[chosen] = random.choice(SPECIAL, size=int(chosen.sum()))
    return [x, p, y]

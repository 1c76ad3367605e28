"""Values of casadi functions in 80-bit floats, where the machine has them, or in 50 digits.

The graph is walked instruction by instruction with ``numpy.longdouble`` or ``decimal``.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Context, Decimal, localcontext
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.walk import ARRAYS, FORMULAS, replay
from mechdae.types import Graph

LONG = np.longdouble
DIGITS = 50
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640629")


def evaluate(function: Graph, inputs: list[Any]) -> Any:
    """Return the first output (n, rows) for inputs (n, columns) of any float type."""
    dtype = np.result_type(*inputs)
    columns = [list(np.asarray(value).T) for value in inputs]
    rows = replay(function, columns, lambda code, args: ARRAYS[code](*args), dtype.type)[0]
    return np.stack([np.broadcast_to(row, len(inputs[0])) for row in rows], axis=1)


class NoDecimals(Exception):
    """The function holds an operation that has no decimals."""


def decimals(function: Graph, inputs: list[Any]) -> list[Decimal]:
    """Return the first output in 50 digits for inputs given as vectors of floats or decimals.

    Raises
    ------
    NoDecimals
        An operation is none of + - * / ** sqrt sin cos tan exp log abs.
    """

    def operation(code: int, values: list[Decimal]) -> Decimal:
        if code not in EXACT:
            raise NoDecimals
        return EXACT[code](*values)

    with localcontext(Context(prec=DIGITS)):
        columns = [[exactly(value) for value in vector] for vector in inputs]
        return replay(function, columns, operation, exactly)[0]


def exactly(value: Any) -> Decimal:
    """Return the value of a float."""
    return value if isinstance(value, Decimal) else Decimal(float(value))


@lru_cache(maxsize=1024)
def _cos(a: Decimal) -> Decimal:
    a = a.remainder_near(2 * PI)
    total, term, k = Decimal(0), Decimal(1), 0
    while total + term != total:
        total += term
        k += 2
        term *= -a * a / (k * (k - 1))
    return total


def _sin(a: Decimal) -> Decimal:
    return _cos(a - PI / 2)


EXACT: dict[int, Callable[..., Decimal]] = {
    **FORMULAS,
    ca.OP_SIN: _sin,
    ca.OP_COS: _cos,
    ca.OP_TAN: lambda a: _sin(a) / _cos(a),
    ca.OP_SQRT: lambda a: a.sqrt(),
    ca.OP_EXP: lambda a: a.exp(),
    ca.OP_LOG: lambda a: a.ln(),
    ca.OP_FABS: abs,
}

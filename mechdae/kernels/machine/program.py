"""casadi functions as programs of the compiled machine, where there is one.

A program's `one` computes as casadi's virtual machine does, bit by bit; `many` as NumPy does,
bit by bit but for functions of the C library, and for sine and cosine of its own (1 ulp).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import casadi as ca

from mechdae.kernels.machine.instructions import instructions
from mechdae.types import Graph

NAMES = (
    "INPUT OUTPUT CONST ASSIGN ADD SUB MUL DIV NEG SQ TWICE INV SQRT SIN COS TAN ASIN ACOS ATAN "
    "ATAN2 SINH COSH TANH EXP LOG POW FABS SIGN FMIN FMAX LT LE EQ NE NOT AND OR IF_ELSE_ZERO "
    "REMAINDER"
).split()
"""casadi's names of the machine's operations, in their order there."""
NONE = 255


@cache
def _table() -> bytes:
    """Return the machine's operation for each of casadi's."""
    table = [NONE] * 256
    for code, name in enumerate(NAMES):
        table[getattr(ca, f"OP_{name}")] = code
    table[ca.OP_CONSTPOW] = table[ca.OP_POW]
    return bytes(table)


def compiled(
    machine: Any, function: Graph, shared: Sequence[int], wanted: bytes | None = None
) -> Any:
    """Return a new program, None where there is none.

    With `wanted`, a byte for each row of the outputs, it has only `block`: values that are asked
    for are computed once each, and nothing else is.
    """
    if not function.is_a("SXFunction"):
        return None
    rows_in = tuple(function.numel_in(i) for i in range(function.n_in()))
    rows_out = tuple(function.numel_out(i) for i in range(function.n_out()))
    dense = all(function.nnz_in(i) == n for i, n in enumerate(rows_in))
    if not dense or any(function.nnz_out(i) != n for i, n in enumerate(rows_out)):
        return None
    given = tuple(i in shared for i in range(len(rows_in)))
    code = instructions(function)
    try:
        return machine.Program(code, function.sz_w(), rows_in, rows_out, given, _table(), wanted)
    except ValueError:  # an operation that the machine does not know
        return None

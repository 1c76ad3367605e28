"""casadi functions as programs of the compiled machine, where there is one.

A program's `one` computes as casadi's virtual machine does, bit by bit; `many` as NumPy does,
bit by bit but for functions of the C library, and for sine and cosine of its own (1 ulp).

Instructions are given as bytes, 16 for each: operation and first place as int32, then two places
as int32 or a constant as float64. casadi stores its functions so, and reading that takes a sixth of
the time of asking for each instruction; where the text is not what is expected, they are asked for
one by one.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import cache
from typing import Any

import casadi as ca

from mechdae.types import Graph

SIZE = 16
MANY = 64
"""Instructions from which reading the stored form is faster."""
_NIBBLES = bytes.maketrans(b"abcdefghijklmnop", b"0123456789abcdef")


def instructions(function: Graph) -> bytes:
    """Return the instructions of an SX function."""
    many = function.n_instructions() >= MANY
    return (stored(function) if many else None) or one_by_one(function)


def one_by_one(function: Graph) -> bytes:
    """Return the instructions, asked for one by one."""
    return b"".join(_packed(function, k) for k in range(function.n_instructions()))


def _packed(function: Graph, k: int) -> bytes:
    """Return one instruction: of an output, i0 is the result, the others place and row."""
    code = function.instruction_id(k)
    into = function.instruction_output(k)
    if code == ca.OP_CONST:
        return struct.pack("=iid", code, into[0], function.instruction_constant(k))
    out_of = function.instruction_input(k)
    if code == ca.OP_OUTPUT:
        return struct.pack("=iiii", code, into[0], out_of[0], into[1])
    return struct.pack("=iiii", code, into[0], out_of[0], out_of[-1])


def stored(function: Graph) -> bytes | None:
    """Return the instructions as the function's stored form holds them, None where they are not.

    They are looked for behind their number, and compared at some places.
    """
    count = function.n_instructions()
    if not count:
        return b""
    text = function.serialize().encode("ascii")
    swapped = bytearray(len(text))  # the lower half of each byte comes first
    swapped[0::2], swapped[1::2] = text[1::2], text[0::2]
    try:
        whole = bytes.fromhex(swapped.translate(_NIBBLES).decode("ascii"))
    except ValueError:
        return None
    first, last = _packed(function, 0), _packed(function, count - 1)
    length = SIZE * count
    at = whole.find(first)
    while at >= 0:
        found = whole[at : at + length]
        if found[-SIZE:] == last and len(found) == length and _same(function, found, count):
            return found
        at = whole.find(first, at + 1)
    return None


def _same(function: Graph, found: bytes, count: int) -> bool:
    """Return whether instructions here and there are those of the function."""
    places = {count * k // 16 for k in range(16)}
    return all(found[SIZE * k : SIZE * (k + 1)] == _packed(function, k) for k in places)


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

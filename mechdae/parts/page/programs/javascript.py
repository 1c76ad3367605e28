"""A casadi SX function as text of a language: the same operations in the same order.

Arithmetic is IEEE double in both; sine, cosine and powers may differ in the last bit. A kernel
works on one array of doubles: inputs, then outputs, then values that pass from one piece to the
next. Long functions are written in pieces, because engines do not optimise very long ones.
Pages hold tables, from which ``web/compile.js`` writes the same text: they are half as large.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import casadi as ca

from mechdae.records import dataclass
from mechdae.types import Graph, Json

PIECE = 300
"""Operations in one piece,"""
WHOLE = 1500
"""of functions with more than that."""
LONGEST = 1500
"""Characters of one expression."""

OPERATIONS: dict[int, str] = {
    ca.OP_OUTPUT: "{0}",
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "({0}+{1})",
    ca.OP_SUB: "({0}-{1})",
    ca.OP_MUL: "({0}*{1})",
    ca.OP_DIV: "({0}/{1})",
    ca.OP_NEG: "(-{0})",
    ca.OP_SQ: "sq({0})",
    ca.OP_TWICE: "(2*{0})",
    ca.OP_INV: "(1/{0})",
    ca.OP_POW: "Math.pow({0},{1})",
    ca.OP_CONSTPOW: "Math.pow({0},{1})",
    ca.OP_SIN: "Math.sin({0})",
    ca.OP_COS: "Math.cos({0})",
    ca.OP_TAN: "Math.tan({0})",
    ca.OP_SQRT: "Math.sqrt({0})",
    ca.OP_EXP: "Math.exp({0})",
    ca.OP_LOG: "Math.log({0})",
    ca.OP_ASIN: "Math.asin({0})",
    ca.OP_ACOS: "Math.acos({0})",
    ca.OP_ATAN: "Math.atan({0})",
    ca.OP_ATAN2: "Math.atan2({0},{1})",
    ca.OP_SINH: "Math.sinh({0})",
    ca.OP_COSH: "Math.cosh({0})",
    ca.OP_TANH: "Math.tanh({0})",
    ca.OP_FABS: "Math.abs({0})",
    ca.OP_SIGN: "Math.sign({0})",
    ca.OP_FMIN: "Math.min({0},{1})",
    ca.OP_FMAX: "Math.max({0},{1})",
    ca.OP_FLOOR: "Math.floor({0})",
    ca.OP_CEIL: "Math.ceil({0})",
    ca.OP_FMOD: "({0}%{1})",
    ca.OP_LOG1P: "Math.log1p({0})",
    ca.OP_EXPM1: "Math.expm1({0})",
    ca.OP_LT: "({0}<{1}?1:0)",
    ca.OP_LE: "({0}<={1}?1:0)",
    ca.OP_EQ: "({0}==={1}?1:0)",
    ca.OP_NE: "({0}!=={1}?1:0)",
    ca.OP_NOT: "({0}===0?1:0)",
    ca.OP_AND: "({0}!==0&&{1}!==0?1:0)",
    ca.OP_OR: "({0}!==0||{1}!==0?1:0)",
    ca.OP_IF_ELSE_ZERO: "({0}!==0?{1}:0)",
    ca.OP_REMAINDER: "remainder({0},{1})",
    ca.OP_COPYSIGN: "copysign({0},{1})",
}
"""What each operation is; NaN goes through minimum and maximum as it does in NumPy."""
CODES = {code: k for k, code in enumerate(OPERATIONS)}
LARGE = 1 << 14
"""Numbers from here on take two letters of a stream."""

HELPERS = """\
const sq = (a) => a * a;
const even = (a) => {
  const low = Math.floor(a), rest = a - low;
  return rest < 0.5 ? low : rest > 0.5 ? low + 1 : low % 2 === 0 ? low : low + 1;
};
const remainder = (a, b) => a - b * even(a / b);
const copysign = (a, b) => (b < 0 || Object.is(b, -0) ? -Math.abs(a) : Math.abs(a));
"""
"""Functions that the printed ones call."""


class NotPrintable(Exception):
    """A function holds an operation that the language does not have."""


@dataclass(frozen=True)
class Language:
    """How a language writes kernels.

    Attributes
    ----------
    operations
        What each operation is.
    opens
        What a function begins with, its name in braces.
    declares
        What stands before the name of a value.
    decimal
        Whether whole numbers have a point.
    special
        What is written for nan and infinity.
    """

    name: str
    operations: Mapping[int, str]
    opens: str
    declares: str
    decimal: bool
    special: tuple[str, str]


JAVASCRIPT = Language(
    "JavaScript", OPERATIONS, "function {}(M){{", "const", False, ("NaN", "Infinity")
)


@dataclass(frozen=True)
class Operations:
    """A function with dense outputs as operations on one array, one after the other.

    Attributes
    ----------
    inputs, outputs
        Where each begins in memory, and its number of entries.
    steps
        Code, what is read, and where an output is stored, -1 of a value. What is read is the
        number of a value, or ``~k`` of the leaf k.
    leaves
        What no step gives: places in memory (int), constants (float).
    """

    inputs: tuple[tuple[int, int], ...]
    outputs: tuple[tuple[int, int], ...]
    steps: tuple[tuple[int, tuple[int, ...], int], ...]
    leaves: tuple[int | float, ...]

    @property
    def table(self) -> Json:
        """The operations as strings in which equal parts of a function look equal.

        Values are named by how far back they are. Of the second string 0 is a leaf, 3 the next
        number of the third or fourth, of first and second operands.
        """
        codes, kinds, first, second, leaves, ways = streams = [list[int]() for _ in range(6)]
        count = at = 0
        for code, sources, to in self.steps:
            codes.append(CODES[code])
            for far, source in zip((first, second), sources, strict=False):
                back = max(count - source, 0) if source >= 0 else 0
                kinds.append(min(back, 3))
                if back > 2:
                    far.append(back)
                elif not back:
                    leaves.append(~source)
            if to < 0:
                count += 1
            else:
                ways.append(2 * (to - at) if to >= at else 2 * (at - to) - 1)
                at = to
        return {
            "streams": [_spelled(stream) for stream in streams],
            "leaves": [_leaf(leaf, JAVASCRIPT) for leaf in self.leaves],
            "size": sum(self.outputs[-1]),
        }

    def text(self, name: str, language: Language = JAVASCRIPT) -> tuple[str, int]:
        """Return the definition of a function, and the length of its array."""
        many, pieces, operations = len(self.steps) > WHOLE, list[int](), 0
        uses, last = list[int](), list[int]()
        for _, sources, to in self.steps:
            pieces.append(operations // PIECE if many else 0)
            for source in sources:
                if source >= 0:
                    uses[source], last[source] = uses[source] + 1, pieces[-1]
            if to < 0:
                operations += 1
                uses.append(0)
                last.append(pieces[-1])
        bodies = [""] * (operations // PIECE + 1 if many else 1)
        known: list[tuple[int, str, str]] = []  # piece, text there, text in later ones
        fixed = [_leaf(leaf, language) for leaf in self.leaves]
        size, ends = sum(self.outputs[-1]), list[int]()  # of places after it: who reads last

        def read(source: int, piece: int) -> str:
            if source < 0:
                return fixed[~source]
            there, text, later = known[source]
            return text if there == piece else later

        for piece, (code, sources, to) in zip(pieces, self.steps, strict=True):
            text = language.operations[code].format(*(read(source, piece) for source in sources))
            k = len(known)
            if to >= 0:
                bodies[piece] += f"M[{to}]={text};\n"
            elif uses[k] == 1 and last[k] == piece and len(text) < LONGEST:
                known.append((piece, text, ""))
            else:
                bodies[piece] += f"{language.declares} v{k}={text};\n"
                slot = next((i for i, end in enumerate(ends) if end < piece), len(ends))
                known.append((piece, f"v{k}", f"M[{size + slot}]"))
                if last[k] > piece:
                    bodies[piece] += f"M[{size + slot}]=v{k};\n"
                    ends[slot : slot + 1] = [last[k]]
        opens = language.opens
        parts = [f"{opens.format(f'{name}_{k}')}\n{body}}}\n" for k, body in enumerate(bodies)]
        calls = "".join(f"{name}_{k}(M);" for k in range(len(bodies)))
        return f"{''.join(parts)}{opens.format(name)}{calls}}}\n", size + len(ends)


def supported(function: Graph, language: Language = JAVASCRIPT) -> bool:
    """Return whether every operation of the function can be printed."""
    known = {*language.operations, ca.OP_INPUT, ca.OP_CONST}
    return function.is_a("SXFunction") and all(
        function.instruction_id(k) in known for k in range(function.n_instructions())
    )


def operations_of(function: Graph, name: str, language: Language = JAVASCRIPT) -> Operations:
    """Return an SX function by its operations; sparse outputs become dense.

    Raises
    ------
    NotPrintable
        An operation that the language does not have.
    """
    arguments = function.sx_in()
    results = [ca.densify(part) for part in function.call(arguments)]
    f = ca.Function(name, arguments, results)
    if not supported(f, language):
        raise NotPrintable(f"{name} holds an operation that cannot be printed as {language.name}")
    counts = [f.numel_in(i) for i in range(f.n_in())] + [f.numel_out(i) for i in range(f.n_out())]
    begins = [sum(counts[:k]) for k in range(len(counts))]
    memory = list(zip(begins, counts, strict=True))
    place: dict[int, int] = {}
    leaves: list[int | float] = []
    numbers: dict[str, int] = {}
    steps: list[tuple[int, tuple[int, ...], int]] = []
    count = 0
    for k in range(f.n_instructions()):
        code, into, source = f.instruction_id(k), f.instruction_output(k), f.instruction_input(k)
        if code in (ca.OP_INPUT, ca.OP_CONST):
            is_input = code == ca.OP_INPUT
            leaf = begins[source[0]] + source[1] if is_input else float(f.instruction_constant(k))
            number = numbers.setdefault(repr(leaf), len(leaves))  # -0.0 is not 0.0
            leaves += [leaf] if number == len(leaves) else []
            place[into[0]] = ~number
        elif code == ca.OP_OUTPUT:
            steps.append((code, (place[source[0]],), begins[f.n_in() + into[0]] + into[1]))
        else:
            steps.append((code, tuple(place[i] for i in source), -1))
            place[into[0]], count = count, count + 1
    inputs, outputs = memory[: f.n_in()], memory[f.n_in() :]
    return Operations(tuple(inputs), tuple(outputs), tuple(steps), tuple(leaves))


def script(functions: Mapping[str, Operations]) -> str:
    """Return a script that gives functions by their names."""
    texts = []
    for name, operations in functions.items():
        text, size = operations.text(name)
        texts.append(f"{text}{name}.size={size};\n")
    return f"(() => {{\n{HELPERS}{''.join(texts)}return {{ {', '.join(functions)} }};\n}})()"


def tables(functions: Mapping[str, Operations]) -> Json:
    """Return what a page writes the same script of."""
    return {
        "functions": {name: operations.table for name, operations in functions.items()},
        "forms": list(OPERATIONS.values()),
        "limits": [PIECE, WHOLE, LONGEST],
        "helpers": HELPERS,
    }


def _spelled(numbers: list[int]) -> str:
    """Return numbers as letters, without those that a string would have to escape."""
    digits = [
        digit
        for number in numbers
        for digit in ((number,) if number < LARGE else (LARGE + number // LARGE, number % LARGE))
    ]
    return "".join(chr(digit + (35 if digit + 35 < ord("\\") else 36)) for digit in digits)


def _leaf(leaf: int | float, language: Language) -> str:
    return f"M[{leaf}]" if isinstance(leaf, int) else _number(leaf, language)


def _number(value: float, language: Language) -> str:
    """Return a number as the language reads it back, without a digit too many."""
    nan, infinity = language.special
    if math.isnan(value):
        return nan
    if math.isinf(value):
        return infinity if value > 0 else f"(-{infinity})"
    whole = not language.decimal and value == int(value) and abs(value) < 1e15
    text = repr(int(value)) if whole else repr(value)
    if whole and value == 0 and math.copysign(1, value) < 0:
        text = "-0"
    return f"({text})" if text.startswith("-") else text

"""A casadi SX function as text of a language: the same operations in the same order.

Arithmetic is IEEE double in both; sine, cosine and powers may differ in the last bit. A kernel
works on one array of doubles: inputs, then outputs, then values that pass from one piece to the
next. Long functions are printed in pieces, because engines do not optimise very long ones.
"""

from __future__ import annotations

import heapq
import math
import re
from collections.abc import Mapping

import casadi as ca

from mechdae.records import dataclass
from mechdae.types import Graph

PIECE = 300
"""Operations in one piece,"""
WHOLE = 1500
"""of functions with more than that."""
LONGEST = 1500
"""Characters of one expression."""

OPERATIONS: dict[int, str] = {
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
        The word before names of values.
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
    "JavaScript", OPERATIONS, "function {}(M){{", "let", False, ("NaN", "Infinity")
)


@dataclass(frozen=True)
class Printed:
    """A printed function.

    Attributes
    ----------
    text
        Definition of a function of one array.
    inputs, outputs
        Where each begins, and its number of entries.
    size
        Length of the array.
    """

    text: str
    inputs: tuple[tuple[int, int], ...]
    outputs: tuple[tuple[int, int], ...]
    size: int


def supported(function: Graph, language: Language = JAVASCRIPT) -> bool:
    """Return whether every operation of the function can be printed."""
    known = {*language.operations, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
    return function.is_a("SXFunction") and all(
        function.instruction_id(k) in known for k in range(function.n_instructions())
    )


def printed(function: Graph, name: str, language: Language = JAVASCRIPT) -> Printed:
    """Return a function with dense outputs as text.

    Parameters
    ----------
    function
        An SX function; sparse outputs are printed densely.
    name
        Of the printed function.

    Raises
    ------
    NotPrintable
        An operation that the language does not have.
    """
    arguments = function.sx_in()
    results = [ca.densify(part) for part in function.call(arguments)]
    function = ca.Function(name, arguments, results)
    if not supported(function, language):
        raise NotPrintable(f"{name} holds an operation that cannot be printed as {language.name}")
    return _Printer(function, name, language).result()


@dataclass
class _Value:
    """A value: where it is, or the operation that gives it."""

    text: str = ""
    code: int = -1
    sources: tuple[int, ...] = ()
    uses: int = 0
    piece: int = -1
    last: int = -1
    slot: int = -1


class _Printer:
    """Prints one function; values are numbered in the order of the instructions."""

    def __init__(self, function: Graph, name: str, language: Language) -> None:
        self.function, self.name, self.language = function, name, language
        counts = [function.numel_in(i) for i in range(function.n_in())]
        results = [function.numel_out(i) for i in range(function.n_out())]
        begins = [sum([*counts, *results][:k]) for k in range(len(counts) + len(results))]
        self.inputs = tuple(zip(begins, counts, strict=False))
        self.outputs = tuple(zip(begins[len(counts) :], results, strict=True))
        self.size = sum(counts) + sum(results)
        self.values: list[_Value] = []
        self.stores: list[tuple[int, int, int]] = []  # place in memory, value, piece
        self.free: dict[int, int] = {}  # places between pieces, with their last readers
        self._read()

    def _read(self) -> None:
        """Number the values, count their uses, and divide the instructions into pieces."""
        f, place = self.function, dict[int, int]()
        many = f.n_instructions() > WHOLE
        operations = 0
        for k in range(f.n_instructions()):
            code, into, source = (
                f.instruction_id(k),
                f.instruction_output(k),
                f.instruction_input(k),
            )
            piece = operations // PIECE if many else 0
            if code == ca.OP_INPUT:
                entry = _Value(f"M[{self.inputs[source[0]][0] + source[1]}]")
            elif code == ca.OP_CONST:
                entry = _Value(_number(f.instruction_constant(k), self.language))
            elif code == ca.OP_OUTPUT:
                value = self.values[place[source[0]]]
                value.uses, value.last = value.uses + 1, max(value.last, piece)
                self.stores.append((self.outputs[into[0]][0] + into[1], place[source[0]], piece))
                continue
            else:
                sources = tuple(place[i] for i in source)
                for i in sources:
                    self.values[i].uses += 1
                    self.values[i].last = max(self.values[i].last, piece)
                entry = _Value(code=code, sources=sources, piece=piece)
                operations += 1
            place[into[0]] = len(self.values)
            self.values.append(entry)
        self.pieces = operations // PIECE + 1 if many else 1

    def result(self) -> Printed:
        bodies: list[list[_Statement]] = [[] for _ in range(self.pieces)]
        stores = sorted(self.stores, key=lambda store: store[1])
        at = 0
        for number, value in enumerate(self.values):
            if value.code >= 0:
                self._put(number, value, bodies)
            while at < len(stores) and stores[at][1] == number:
                to, _, piece = stores[at]
                bodies[piece].append(_Statement(f"M[{to}]", self._use(number, piece)))
                at += 1
        opens, declares = self.language.opens, self.language.declares
        if self.pieces == 1:
            text = f"{opens.format(self.name)}\n{_written(bodies[0], declares)}}}\n"
        else:
            parts = [
                f"{opens.format(f'{self.name}_{k}')}\n{_written(body, declares)}}}\n"
                for k, body in enumerate(bodies)
            ]
            calls = "".join(f"{self.name}_{k}(M);" for k in range(self.pieces))
            text = "".join(parts) + f"{opens.format(self.name)}{calls}}}\n"
        return Printed(text, self.inputs, self.outputs, self.size)

    def _put(self, number: int, value: _Value, bodies: list[list[_Statement]]) -> None:
        """Keep an operation's text until it is used once, else give the value a name."""
        sources = [self._use(i, value.piece) for i in value.sources]
        text = self.language.operations[value.code].format(*sources)
        if value.uses <= 1 and value.last == value.piece and len(text) < LONGEST:
            value.text = text
            return
        number_text = f"<{number}>"
        bodies[value.piece].append(_Statement(number_text, text))
        value.text = number_text
        if value.last > value.piece:
            value.slot = self._slot(value)
            bodies[value.piece].append(_Statement(f"M[{value.slot}]", number_text))

    def _slot(self, value: _Value) -> int:
        """Return a place in memory whose last reader is a piece before the value's."""
        slot = next((name for name, last in self.free.items() if last < value.piece), self.size)
        self.size = max(self.size, slot + 1)
        self.free[slot] = value.last
        return slot

    def _use(self, number: int, piece: int) -> str:
        value = self.values[number]
        if value.code >= 0 and value.piece != piece:
            return f"M[{value.slot}]"
        return value.text


@dataclass
class _Statement:
    """One assignment; values with names stand as their numbers in angle brackets."""

    to: str
    text: str


NAMED = re.compile(r"<(\d+)>")
LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLNOPQRSTUVWXYZ"


def _written(body: list[_Statement], declares: str) -> str:
    """Return the statements of a piece; few names, each given again when its value is used up."""
    last = {found: k for k, line in enumerate(body) for found in NAMED.findall(line.text)}
    names: dict[str, str] = {}
    free: list[int] = []
    held: dict[str, int] = {}
    count, lines = 0, []
    for k, line in enumerate(body):
        text = NAMED.sub(lambda found: names[found[1]], line.text)
        for word in dict.fromkeys(NAMED.findall(line.text)):
            if last[word] == k:
                heapq.heappush(free, held[word])
        to = line.to
        if to.startswith("<"):
            word = to[1:-1]
            if free:
                held[word] = heapq.heappop(free)
            else:
                held[word], count = count, count + 1
            names[word] = to = _name(held[word])
        if text.startswith("(") and _closes_last(text):
            text = text[1:-1]
        lines.append(f"{to}={text};\n")
    head = f"{declares} {','.join(_name(k) for k in range(count))};\n" if count else ""
    return head + "".join(lines)


def _name(number: int) -> str:
    """Return a short name that is no word of a language: a letter, or one with digits."""
    turn, letter = divmod(number, len(LETTERS))
    return LETTERS[letter] + (str(turn) if turn else "")


def _closes_last(text: str) -> bool:
    """Return whether the bracket that opens a text is closed at its end."""
    depth = 0
    for k, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if depth == 0:
            return k == len(text) - 1
    return False


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

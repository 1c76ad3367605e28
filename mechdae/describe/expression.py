"""Numbers written as expressions: parsed with a whitelist, never executed.

An expression may hold numbers, names, ``+ - * / **``, unary signs, parentheses and the
functions listed in `FUNCTIONS`; dotted names (``slide.slide``) are coordinates. It is at
most `MAX_LENGTH` characters long and `MAX_DEPTH` operations deep.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache, reduce
from typing import TYPE_CHECKING, Any

from mechdae.errors import InputError, UnknownName, shorten

if TYPE_CHECKING:
    from mechdae.types import Sym


MAX_LENGTH = 500
MAX_DEPTH = 60
CONSTANTS = {"pi": math.pi}
FUNCTIONS = (
    "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt abs sign min max hypot".split()
)
TWO = ("atan2", "hypot")
MORE = ("min", "max")
"""Functions of two arguments, and of two or more; all others have one."""
OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}
_FLOAT: dict[str, Callable[..., Any]] = {
    **{name: getattr(math, name) for name in FUNCTIONS if hasattr(math, name)},
    "abs": abs,
    "min": min,
    "max": max,
    "sign": lambda x: math.copysign(1.0, x) if x else 0.0,
}


@lru_cache(maxsize=4096)
def parse(text: str) -> ast.expr:
    """Return the checked syntax tree of `text`.

    Raises
    ------
    InputError
        Too long, too deep, not an expression, or anything that is not on the whitelist.
    """
    if len(text) > MAX_LENGTH:
        raise InputError(
            f"expression of {len(text)} characters, at most {MAX_LENGTH} are allowed",
            hint="name its parts in [parameters]",
        )
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"'{shorten(text)}' is not an expression") from None
    _check(tree, text, 0)
    return tree


def _check(node: ast.AST, text: str, depth: int) -> None:
    if depth > MAX_DEPTH:
        raise InputError(f"'{shorten(text)}' is nested deeper than {MAX_DEPTH} operations")
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        parts: list[ast.expr] = [node.left, node.right]
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.UAdd | ast.USub):
        parts = [node.operand]
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id not in FUNCTIONS:
            raise UnknownName("function", node.func.id, FUNCTIONS)
        parts = node.args
        _check_count(node.func.id, len(parts), text)
    elif dotted(node) or (isinstance(node, ast.Constant) and type(node.value) in (int, float)):
        parts = []
    else:
        raise InputError(
            f"'{shorten(text)}' holds more than arithmetic",
            hint=("a power is **: x**2; " if "^" in text else "")
            + f"numbers, names, + - * / ** and {', '.join(FUNCTIONS)} are allowed",
        )
    for part in parts:
        _check(part, text, depth + 1)


def _check_count(name: str, count: int, text: str) -> None:
    """Raise for a function that is called with too few or too many arguments."""
    least = 2 if name in TWO + MORE else 1
    if count < least or (count > least and name not in MORE):
        more = " or more" if name in MORE else ""
        raise InputError(
            f"'{shorten(text)}': {name} takes {least}{more} argument{'s' * (least > 1)}, "
            f"here are {count}"
        )


def dotted(node: ast.AST) -> str:
    """Return ``a.b.c`` for a (dotted) name, '' for anything else."""
    parts = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return ".".join([node.id, *reversed(parts)]) if isinstance(node, ast.Name) else ""


def names_in(text: str) -> set[str]:
    """Return the (dotted) names that the expression uses, ``pi`` excepted."""
    result: set[str] = set()

    def walk(node: ast.AST) -> None:
        name = dotted(node)
        if name:
            result.add(name)
        elif isinstance(node, ast.Call):
            for argument in node.args:
                walk(argument)
        else:
            for child in ast.iter_child_nodes(node):
                walk(child)

    walk(parse(text))
    return result - set(CONSTANTS)


def build(text: str, names: Mapping[str, Sym], functions: Mapping[str, Callable[..., Any]]) -> Sym:
    """Return the expression over the values in `names` (floats or symbols).

    Raises
    ------
    InputError
        An unknown name, or plain numbers in it that have no value: ``1/0``.
    """

    def walk(node: Any) -> Sym:
        name = dotted(node)
        if name:
            if name in names:
                return names[name]
            if name in CONSTANTS:
                return CONSTANTS[name]
            raise UnknownName("name", name, [*names, *CONSTANTS])
        if isinstance(node, ast.Constant):
            return float(node.value)  # type: ignore[arg-type]
        if isinstance(node, ast.BinOp):
            value = OPERATORS[type(node.op)](walk(node.left), walk(node.right))
            if isinstance(value, complex):
                raise InputError(f"'{shorten(text)}' is not a real number")
            return value
        if isinstance(node, ast.UnaryOp):
            value = walk(node.operand)
            return -value if isinstance(node.op, ast.USub) else value
        values = [walk(argument) for argument in node.args]
        known = _FLOAT if all(isinstance(v, float) for v in values) else functions
        if node.func.id in MORE:
            return reduce(known[node.func.id], values)
        return known[node.func.id](*values)

    try:
        return walk(parse(text))
    except (ArithmeticError, ValueError) as problem:
        if isinstance(problem, InputError):
            raise
        raise InputError(f"'{shorten(text)}' has no value: {problem}") from None


def evaluate(number: float | str, names: Mapping[str, float]) -> float:
    """Return the value of a number or expression as a finite float.

    Raises
    ------
    InputError
        An unknown name, a wrong number of arguments, an overflow, a division by zero.
    """
    if not isinstance(number, str):
        return float(number)
    result = float(build(number, names, _FLOAT))
    if not math.isfinite(result):
        raise InputError(f"'{shorten(number)}' is not a finite real number")
    return result


def unknown_name(
    numbers: Iterable[float | str | None],
    known: Iterable[str],
    kind: str = "parameter",
    place: str = "",
) -> None:
    """Raise for a name in an expression among `numbers` that is not known."""
    for number in numbers:
        for used in sorted(names_in(number)) if isinstance(number, str) else ():
            if used not in known:
                raise UnknownName(kind, used, known, where=place)

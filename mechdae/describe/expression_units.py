"""What expressions tell of the units of the names in them, and their own units.

A name in ``cos(...)`` is an angle, terms of a sum have one unit, factors of a product the rest.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from mechdae.describe.coordinates import split_rate, unit_of
from mechdae.describe.expression import CONSTANTS, dotted, parse
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import force_unit
from mechdae.describe.units import BASES, NONE, Powers, fits, powers_of, text_of
from mechdae.errors import MechdaeError

ANGLES = ("sin", "cos", "tan")
PLAIN = ("asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")
ROUNDS = 4
"""How often all uses are read: each round hands what is known one expression on."""
SAME = ("abs", "min", "max", "hypot", "atan2")


class Reader:
    """Reads expressions for what they say about the units of the parameters in them.

    What is `exact` takes no factor for a plain number that may have a unit of its own.
    """

    def __init__(
        self, mechanism: Mechanism, known: dict[str, Powers | None], exact: bool = False
    ) -> None:
        self.mechanism = mechanism
        self.known = known
        self.exact = exact

    def use(self, number: float | str | None, powers: Powers | None, weak: bool = False) -> None:
        """Take note of a number whose unit is known, or of what stands in it.

        What is `weak` gives way to what is known already: the numbers in a product may have
        units of their own.
        """
        if isinstance(number, str):
            try:
                self._tell(parse(number), powers, weak)
            except MechdaeError:
                return  # what is no expression is said where the problem is checked

    def learn(self, name: str, powers: Powers | str | None, weak: bool) -> None:
        """Take note of a parameter's unit; one that is contradicted is not known any more."""
        if name not in self.mechanism.parameters or not isinstance(powers, tuple):
            return
        if not (weak and name in self.known):
            self.known[name] = powers if self.known.get(name, powers) == powers else None

    def _tell(self, node: ast.AST, powers: Powers | None, weak: bool) -> None:
        name = dotted(node)
        if name:
            self.learn(name, powers, weak)
        elif isinstance(node, ast.UnaryOp):
            self._tell(node.operand, powers, weak)
        elif isinstance(node, ast.BinOp):
            if isinstance(node.op, ast.Mult | ast.Div):
                self._tell_product(node, powers, weak)
            else:
                self._tell_sum(node, powers, weak)
        elif isinstance(node, ast.Call):
            assert isinstance(node.func, ast.Name)
            word, inside = node.func.id, None
            if word in ANGLES:
                inside = powers_of("rad")
            elif word in PLAIN:
                inside = NONE
            elif word in SAME:
                units = [self.unit(argument) for argument in node.args]
                known = [unit for unit in units if isinstance(unit, tuple)]
                inside = known[0] if known else powers if word != "atan2" else None
            elif word == "sqrt" and powers is not None:
                inside = tuple(2 * power for power in powers)
            for argument in node.args:
                self._tell(argument, inside, weak)

    def _tell_sum(self, node: ast.BinOp, powers: Powers | None, weak: bool) -> None:
        """Tell the sides of a sum, a difference or a power."""
        if not isinstance(node.op, ast.Pow):
            units = (powers, self.unit(node.left), self.unit(node.right))
            known = [unit for unit in units if isinstance(unit, tuple)]
            for side in (node.left, node.right):
                self._tell(side, known[0] if known else None, weak or powers is None)
            return
        times = node.right.value if isinstance(node.right, ast.Constant) else None
        base = None
        if powers is not None and isinstance(times, int | float) and times:
            base = tuple(power / Fraction(times).limit_denominator(100) for power in powers)
        self._tell(node.left, base, weak)

    def _tell_product(self, node: ast.BinOp, powers: Powers | None, weak: bool) -> None:
        left, right = self.factor(node.left), self.factor(node.right)
        first, second = _plain(left), _plain(right)
        divided = isinstance(node.op, ast.Div)
        weak = weak or "number" not in (left, right)
        above = below = None
        if powers is not None and second is not None:
            above = _times(powers, second, 1 if divided else -1)
        if powers is not None and first is not None:
            below = _times(first, powers, -1) if divided else _times(powers, first, -1)
        self._tell(node.left, above, weak)
        self._tell(node.right, below, weak)

    def factor(self, node: ast.AST) -> Powers | str | None:
        """Return the unit of a factor."""
        operand = node.operand if isinstance(node, ast.UnaryOp) else node
        if self.exact and isinstance(operand, ast.Constant) and not _bare(operand.value):
            return None
        return self.unit(node)

    def unit(self, node: ast.AST) -> Powers | str | None:
        """Return the unit of an expression, "number" of a plain one, None where not known."""
        name = dotted(node)
        if name:
            return self._of_name(name)
        if isinstance(node, ast.Constant):
            return "number"
        if isinstance(node, ast.UnaryOp):
            return self.unit(node.operand)
        if isinstance(node, ast.BinOp):
            if isinstance(node.op, ast.Mult | ast.Div):
                left, right = self.factor(node.left), self.factor(node.right)
            else:
                left, right = self.unit(node.left), self.unit(node.right)
            if isinstance(node.op, ast.Add | ast.Sub):
                return self._of_sum([left, right])
            if isinstance(node.op, ast.Pow):
                times = node.right.value if isinstance(node.right, ast.Constant) else None
                if isinstance(left, str) or left is None or not isinstance(times, int | float):
                    return left if left == "number" else None
                return tuple(power * Fraction(times).limit_denominator(100) for power in left)
            if left == "number" and right == "number":
                return "number"
            if left is None or right is None:
                return None
            a, b = _plain(left), _plain(right)
            assert a is not None
            assert b is not None
            return _times(a, b, -1 if isinstance(node.op, ast.Div) else 1)
        assert isinstance(node, ast.Call)
        assert isinstance(node.func, ast.Name)
        word = node.func.id
        inside = [self.unit(argument) for argument in node.args]
        if word in ("asin", "acos", "atan", "atan2"):
            return powers_of("rad")
        if word in SAME:
            return self._of_sum(inside)
        if word == "sqrt":
            first = inside[0]
            return tuple(power / 2 for power in first) if isinstance(first, tuple) else first
        return NONE

    def _of_sum(self, units: list[Powers | str | None]) -> Powers | str | None:
        """Return the unit of what is added up: the first that is known."""
        known = next((unit for unit in units if isinstance(unit, tuple)), None)
        return known or ("number" if all(unit == "number" for unit in units) else None)

    def _of_name(self, name: str) -> Powers | str | None:
        if name in CONSTANTS:
            return "number"
        if name == "t":
            return powers_of("s")
        if name in self.mechanism.parameters:
            return self.known.get(name)
        base, order = split_rate(name)
        unit = unit_of(self.mechanism, base) or force_unit(self.mechanism, name)
        if unit is None:
            return None
        return powers_of(unit if not order else f"{unit}/s{order if order > 1 else ''}")


def _bare(value: object) -> bool:
    """Return whether a number in an expression can hardly have a unit: 2, 0.5, 1000."""
    if not isinstance(value, int | float) or not value:
        return True
    size = float(f"{abs(value):.12e}".split("e")[0])
    return size == 1 or any(size == round(size) <= 12 for size in (abs(value), 1 / abs(value)))


class Output(Reader):
    """Reads the unit of a named output; of a sum only where all terms agree."""

    def _of_sum(self, units: list[Powers | str | None]) -> Powers | str | None:
        kinds = {unit for unit in units if unit != "number"} or {"number"}
        return kinds.pop() if len(kinds) == 1 else None

    def _of_name(self, name: str) -> Powers | str | None:
        if name in self.mechanism.outputs:
            return self.unit(parse(self.mechanism.outputs[name]))
        return super()._of_name(name)


class Checker(Reader):
    """Compares the suffixes of parameters with what an expression tells.

    Of what is ``alone`` in it an angle is no plain number.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        known: dict[str, Powers | None],
        typed: Mapping[str, str],
        alone: bool,
    ) -> None:
        super().__init__(mechanism, known, exact=True)
        self.typed = typed
        self.alone = alone
        self.misfit: tuple[str, str] | None = None

    def learn(self, name: str, powers: Powers | str | None, weak: bool) -> None:
        if name not in self.typed or not isinstance(powers, tuple) or self.misfit is not None:
            return
        if not fits(self.typed[name], powers, angles=self.alone):
            self.misfit = (name, text_of(powers))


def misfit_in(
    mechanism: Mechanism,
    known: dict[str, Powers | None],
    typed: Mapping[str, str],
    text: str,
    powers: Powers | None,
) -> tuple[str, str] | None:
    """Return the first parameter in an expression whose suffix is no unit of it, and its unit."""
    checker = Checker(mechanism, known, typed, alone=text.strip("- ") in typed)
    checker.use(text, powers)
    return checker.misfit


def inferred(
    mechanism: Mechanism, uses: Sequence[tuple[Any, Powers | None]], exact: bool
) -> dict[str, Powers | None]:
    """Return what all uses and the parameters' own expressions tell of parameters.

    Those that tell for sure count before products with numbers that may have units of their own.
    """
    known: dict[str, Powers | None] = {}
    reader = Reader(mechanism, known, exact)
    for whole in (False, True):  # last, for numbers in an expression may have units of their own
        for _ in range(ROUNDS):
            before = dict(known)
            for number, powers in uses:
                reader.use(number, powers)
            for name, number in mechanism.parameters.items():
                reader.use(number, known.get(name), weak=True)
                if whole and isinstance(number, str):
                    reader.learn(name, reader.unit(parse(number)), weak=True)
            if known == before:
                break
    sure = {} if exact else inferred(mechanism, uses, True)
    return known | {name: powers for name, powers in sure.items() if powers is not None}


def output_unit(mechanism: Mechanism, output: str, rate: int = 0) -> str:
    """Return the unit of a named output's rate of some order: ``rad``, ``m/s``, ``1``.

    Empty where it is not known: parameters have no unit inside the program.
    """
    powers = Output(mechanism, {}).unit(parse(mechanism.outputs[output]))
    if not isinstance(powers, tuple):
        return ""
    return text_of(tuple(p - rate * (name == "s") for name, p in zip(BASES, powers, strict=True)))


def _plain(unit: Powers | str | None) -> Powers | None:
    return NONE if unit == "number" else unit if isinstance(unit, tuple) else None


def _times(first: Powers, second: Powers, sign: int) -> Powers:
    return tuple(a + sign * b for a, b in zip(first, second, strict=True))

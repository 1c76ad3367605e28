"""Units of parameters and of named outputs, from where and how a problem uses them.

Inside the program numbers are SI without a unit. A parameter that is the length of a link
somewhere is in metres, one in ``cos(...)`` in radians, the speed of a driver in rad/s.
Where no use tells, or two uses contradict each other, the unit stays unknown.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import fields
from fractions import Fraction
from typing import Any

from mechdae.describe.coordinates import unit_of
from mechdae.describe.expression import CONSTANTS, dotted, parse
from mechdae.describe.loads import Force, Resistance, Spring, Torque
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import split_rate
from mechdae.describe.tasks.kinds import Driver, Task
from mechdae.errors import MechdaeError

Powers = tuple[Fraction, ...]
"""Exponents of metre, radian, second and kilogram."""
BASES = ("m", "rad", "s", "kg")
NAMED = {
    "N": (1, 0, -2, 1),
    "N m": (2, 0, -2, 1),
    "N/m": (0, 0, -2, 1),
    "N m/rad": (2, -1, -2, 1),
    "N s/m": (0, 0, -1, 1),
    "N m s/rad": (2, -1, -1, 1),
    "W": (2, 0, -3, 1),
    "kg m2": (2, 0, 0, 1),
}
"""Units that have a name of their own."""
NONE: Powers = (Fraction(0),) * len(BASES)
RATES = ("speed", "acceleration", "jerk")
ANGLES = ("sin", "cos", "tan")
PLAIN = ("asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")
SAME = ("abs", "min", "max", "hypot", "atan2")
ROUNDS = 4
"""How often all uses are read: each round hands what is known one expression on."""


def parameter_units(mechanism: Mechanism, tasks: Iterable[Task] = ()) -> dict[str, str]:
    """Return name -> unit of parameters and automatic names, as far as it is known.

    ``m``, ``rad``, ``1``, ``rad/s``, ``kg m2``, ``N/m``.
    """
    automatic = {name: powers_of(unit) for name, unit in _automatic(mechanism)}
    uses = [(number, automatic[name]) for name, number in mechanism.numbers() if name in automatic]
    uses += list(_loads(mechanism))
    for task in tasks:
        uses += list(_drivers(mechanism, task))
    uses += [(mechanism.outputs[name], None) for name in mechanism.outputs]
    known: dict[str, Powers | None] = {}
    reader = _Reader(mechanism, known)
    for turn in range(2 * ROUNDS):
        for number, powers in uses:
            reader.use(number, powers)
        for name, number in mechanism.parameters.items():
            reader.use(number, known.get(name), weak=True)
            if turn >= ROUNDS and isinstance(number, str):
                # last, for numbers in an expression may have units of their own
                reader.learn(name, reader.unit(parse(number)), weak=True)
    units = {name: text_of(powers) for name, powers in automatic.items() if powers is not None}
    return units | {name: text_of(powers) for name, powers in known.items() if powers is not None}


def powers_of(unit: str) -> Powers | None:
    """Return the exponents of a unit, None where the text names several or none."""
    if unit in NAMED:
        return tuple(Fraction(power) for power in NAMED[unit])
    if unit == "1":
        return NONE
    above, _, below = unit.partition("/")
    powers = dict.fromkeys(BASES, Fraction(0))
    for part, sign in ((above, 1), (below.replace("/", " "), -1)):
        for word in part.split():
            if word == "1":
                continue
            name = word.rstrip("0123456789")
            if name not in powers:
                return None
            powers[name] += sign * int(word[len(name) :] or 1)
    return tuple(powers.values()) if unit else None


def text_of(powers: Powers) -> str:
    """Return a unit as it is written."""
    for name in NAMED:
        if powers == powers_of(name):
            return name

    def word(name: str, power: Fraction) -> str:
        return name if power == 1 else f"{name}{power}"

    pairs = list(zip(BASES, powers, strict=True))
    above = [word(name, power) for name, power in pairs[-1:] + pairs[:-1] if power > 0]
    below = [word(name, -power) for name, power in pairs if power < 0]
    return "/".join([" ".join(above) or "1", *below])


def _automatic(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """Yield the automatic names with their units."""
    for name, _ in mechanism.numbers():
        part, *rest = name.split(".")
        if part == "loads":
            continue  # below, with what they act on
        if part == "gravity":
            yield name, "m/s2"
        elif part in mechanism.joints:
            entries = {entry.name: entry.metadata for entry in fields(mechanism.joints[part])}
            # the ends of a curve's range are no fields, and s has no unit
            unit = entries[rest[0]].get("unit") if rest[0] in entries else None
            if unit:
                yield name, unit
        else:
            yield name, {"mass": "kg", "inertia": "kg m2"}.get(rest[0], "m")


def _loads(mechanism: Mechanism) -> Iterator[tuple[Any, Powers | None]]:
    for load in mechanism.loads.values():
        if isinstance(load, Force):
            yield from ((number, powers_of("N")) for number in load.value)
        elif isinstance(load, Torque):
            values = load.value if isinstance(load.value, tuple) else (load.value,)
            yield from ((number, powers_of("N m")) for number in values)
        elif isinstance(load, Resistance):
            unit = "N m" if unit_of(mechanism, load.coordinate) == "rad" else "N"
            yield from ((own, powers_of(unit)) for own in (load.negative, load.positive))
        elif isinstance(load, Spring):
            turns = load.coordinate is not None and unit_of(mechanism, load.coordinate) == "rad"
            length, force = ("rad", "N m") if turns else ("m", "N")
            yield load.stiffness, powers_of("N m/rad" if turns else "N/m")
            yield load.damping, powers_of("N m s/rad" if turns else "N s/m")
            yield load.free_length, powers_of(length)
            yield load.preload, powers_of(force)


def _drivers(mechanism: Mechanism, task: Task) -> Iterator[tuple[Any, Powers | None]]:
    if getattr(task, "until", None) is not None:
        yield task.until, powers_of("s")  # type: ignore[attr-defined]
    for word, rate in (("start", ""), ("start_speed", "/s")):
        for name, number in (getattr(task, word, None) or {}).items():
            unit = unit_of(mechanism, str(name).removesuffix(".speed"))
            yield number, None if unit is None else powers_of(f"{unit}{rate}")
    several = getattr(task, "drivers", None) or ()
    for driver in (*several, getattr(task, "driver", None)):
        if not isinstance(driver, Driver):
            continue
        unit = unit_of(mechanism, driver.coordinate)
        if unit is None:
            continue
        base = powers_of(unit)
        if driver.law is None:
            yield from ((number, base) for number in (driver.from_, driver.to, *(driver.at or ())))
        else:
            yield driver.law, base
        for order, word in enumerate(RATES, start=1):
            yield getattr(driver, word), powers_of(f"{unit}/s{order if order > 1 else ''}")


class _Reader:
    """Reads expressions for what they say about the units of the parameters in them."""

    def __init__(self, mechanism: Mechanism, known: dict[str, Powers | None]) -> None:
        self.mechanism, self.known = mechanism, known

    def use(self, number: Any, powers: Powers | None, weak: bool = False) -> None:
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
        left, right = self.unit(node.left), self.unit(node.right)
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
        unit = unit_of(self.mechanism, base)
        if unit is None:
            return None
        return powers_of(unit if not order else f"{unit}/s{order if order > 1 else ''}")


class _Output(_Reader):
    """Reads the unit of a named output; of a sum only where all terms agree."""

    def _of_sum(self, units: list[Powers | str | None]) -> Powers | str | None:
        kinds = {unit for unit in units if unit != "number"} or {"number"}
        return kinds.pop() if len(kinds) == 1 else None

    def _of_name(self, name: str) -> Powers | str | None:
        if name in self.mechanism.outputs:
            return self.unit(parse(self.mechanism.outputs[name]))
        return super()._of_name(name)


def output_unit(mechanism: Mechanism, output: str, rate: int = 0) -> str:
    """Return the unit of a named output's rate of some order: ``rad``, ``m/s``, ``1``.

    Empty where it is not known: parameters have no unit inside the program.
    """
    powers = _Output(mechanism, {}).unit(parse(mechanism.outputs[output]))
    if not isinstance(powers, tuple):
        return ""
    return text_of(tuple(p - rate * (name == "s") for name, p in zip(BASES, powers, strict=True)))


def _plain(unit: Powers | str | None) -> Powers | None:
    return NONE if unit == "number" else unit if isinstance(unit, tuple) else None


def _times(first: Powers, second: Powers, sign: int) -> Powers:
    return tuple(a + sign * b for a, b in zip(first, second, strict=True))


__all__ = ["output_unit", "parameter_units", "powers_of", "text_of"]

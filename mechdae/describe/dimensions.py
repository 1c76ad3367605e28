"""Units of parameters and of named outputs, from where and how a problem uses them.

Inside the program numbers are SI without a unit. A parameter that is the length of a link
somewhere is in metres, one in ``cos(...)`` in radians, the speed of a driver in rad/s.
Where no use tells, or two uses contradict each other, the unit stays unknown.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from fractions import Fraction
from itertools import chain, repeat
from typing import Any

from mechdae.describe.coordinates import unit_of
from mechdae.describe.expression import CONSTANTS, dotted, parse
from mechdae.describe.loads import Force, Resistance, Spring, TableLoad, Torque
from mechdae.describe.mechanism import WHOLE_UNITS, Mechanism
from mechdae.describe.named import split_rate
from mechdae.describe.tasks.kinds import Driver, Task
from mechdae.describe.units import EVERY
from mechdae.describe.values import Value
from mechdae.errors import MechdaeError

Powers = tuple[Fraction, ...]
"""Exponents of metre, radian, second and kilogram."""
Use = tuple[Any, Powers | None, str]
"""A number, its unit, and where it stands."""
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
TASK_NUMBERS = {
    "until": "s", "max_step": "s", "linearise": "s", "v_s": "m/s", "omega_s": "rad/s"
}  # fmt: skip
SPRINGS = (
    {"stiffness": "N/m", "damping": "N s/m", "free_length": "m", "preload": "N"},
    {"stiffness": "N m/rad", "damping": "N m s/rad", "free_length": "rad", "preload": "N m"},
)
"""Units of the numbers of springs between points, and on angles."""
ANGLES = ("sin", "cos", "tan")
PLAIN = ("asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")
SAME = ("abs", "min", "max", "hypot", "atan2")
ROUNDS = 4
"""How often all uses are read: each round hands what is known one expression on."""


def parameter_units(mechanism: Mechanism, tasks: Iterable[Task] = ()) -> dict[str, str]:
    """Return name -> unit of parameters and automatic names, as far as it is known.

    ``m``, ``rad``, ``1``, ``rad/s``, ``kg m2``, ``N/m``.
    """
    known = _inferred(mechanism, _uses(mechanism, tasks))
    automatic = {name: powers_of(unit) for name, unit in _automatic(mechanism)}
    units = {name: text_of(powers) for name, powers in automatic.items() if powers is not None}
    return units | {name: text_of(powers) for name, powers in known.items() if powers is not None}


def misfit(
    mechanism: Mechanism, tasks: Mapping[str, Task], typed: Mapping[str, str]
) -> tuple[str, str, str] | None:
    """Return the first of the parameters `typed` with a suffix whose unit a use does not have.

    Name, unit of the use, and where it is. Uses that tell nothing for sure are left out: products
    with numbers that may have units of their own (``0.01*n``).
    """
    uses = _uses(mechanism, tasks.values(), tasks)
    uses += [
        (number, None, f"parameters.{name}") for name, number in mechanism.parameters.items()
    ]  # fmt: skip
    known = _inferred(mechanism, uses, exact=True)
    checker = _Checker(mechanism, known, typed)
    for number, powers, place in uses:
        own = place.removeprefix("parameters.")
        checker.place, checker.alone = place, str(number).strip("- ") in typed
        checker.use(number, known.get(own) if own != place else powers)
        if checker.found is not None:
            return checker.found
    return None


def _inferred(
    mechanism: Mechanism, uses: Sequence[Use], exact: bool = False
) -> dict[str, Powers | None]:
    """Return what all uses tell of parameters."""
    known: dict[str, Powers | None] = {}
    reader = _Reader(mechanism, known, exact)
    for turn in range(2 * ROUNDS):
        for number, powers, _ in uses:
            reader.use(number, powers)
        for name, number in mechanism.parameters.items():
            reader.use(number, known.get(name), weak=True)
            if turn >= ROUNDS and isinstance(number, str):
                # last, for numbers in an expression may have units of their own
                reader.learn(name, reader.unit(parse(number)), weak=True)
    return known


def _uses(mechanism: Mechanism, tasks: Iterable[Task], names: Iterable[str] = ()) -> list[Use]:
    """Return the numbers of a problem with their units and their places."""
    automatic = {name: powers_of(unit) for name, unit in _automatic(mechanism)}
    found: list[Use] = [
        (number, automatic[name], name) for name, number in mechanism.numbers() if name in automatic
    ]
    found += list(_loads(mechanism))
    for name, number in mechanism.sketch.items():
        unit = unit_of(mechanism, str(name))
        found.append((number, None if unit is None else powers_of(unit), f"sketch.{name}"))
    for task, name in zip(tasks, chain(names, repeat("")), strict=False):
        found += [(n, p, f"tasks.{name}.{word}") for n, p, word in _of_task(mechanism, task)]
    return found + [(text, None, f"outputs.{name}") for name, text in mechanism.outputs.items()]


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
        if part in WHOLE_UNITS:
            yield name, WHOLE_UNITS[part]
        elif part in mechanism.joints:
            entries = {entry.name: entry.metadata for entry in fields(mechanism.joints[part])}
            # the ends of a curve's range are no fields, and s has no unit
            unit = entries[rest[0]].get("unit") if rest[0] in entries else None
            if unit:
                yield name, unit
        else:
            yield name, {"mass": "kg", "inertia": "kg m2"}.get(rest[0], "m")


def _loads(mechanism: Mechanism) -> Iterator[Use]:
    for name, load in mechanism.loads.items():
        place = f"loads.{name}"
        if isinstance(load, Force):
            yield from ((number, powers_of("N"), f"{place}.value") for number in load.value)
        elif isinstance(load, Torque):
            values = load.value if isinstance(load.value, tuple) else (load.value,)
            yield from ((number, powers_of("N m"), f"{place}.value") for number in values)
        elif isinstance(load, Resistance):
            force = powers_of("N m" if unit_of(mechanism, load.coordinate) == "rad" else "N")
            for word in ("negative", "positive"):
                yield getattr(load, word), force, f"{place}.{word}"
        elif isinstance(load, Spring):
            turns = load.coordinate is not None and unit_of(mechanism, load.coordinate) == "rad"
            for word, unit in SPRINGS[turns].items():
                yield getattr(load, word), powers_of(unit), f"{place}.{word}"
        elif isinstance(load, TableLoad):
            for word in ("shift", "period"):
                yield getattr(load, word), powers_of("s"), f"{place}.{word}"


def _of_task(mechanism: Mechanism, task: Task) -> Iterator[Use]:
    """Yield the numbers of a task with their places inside of it."""
    for word, unit in TASK_NUMBERS.items():
        yield getattr(task, word, None), powers_of(unit), word
    for word, rate in (("start", ""), ("start_speed", "/s")):
        for name, number in (getattr(task, word, None) or {}).items():
            base = unit_of(mechanism, str(name).removesuffix(".speed"))
            powers = None if base is None else powers_of(f"{base}{rate}")
            yield number, powers, f"{word}.{name}"
    for watched in getattr(task, "events", None) or ():
        name, order = split_rate(watched.coordinate)
        base = unit_of(mechanism, name)
        if base is not None:
            yield watched.crosses, powers_of(f"{base}/s" if order else base), "events"
    several = getattr(task, "drivers", None) or ()
    for driver in (*several, getattr(task, "driver", None)):
        if isinstance(driver, Driver):
            yield from _of_driver(mechanism, driver)
    yield from _nested(task)


def _of_driver(mechanism: Mechanism, driver: Driver) -> Iterator[Use]:
    unit = unit_of(mechanism, driver.coordinate)
    if unit is None:
        return
    time, base = powers_of("s"), powers_of(unit)
    ends = base if driver.law is None else time
    yield driver.law, base, "driver.law"
    yield driver.from_, ends, "driver.from"
    yield driver.to, ends, "driver.to"
    yield from ((number, base, "driver.at") for number in driver.at or ())
    yield from ((number, time, "driver.times") for number in driver.times or ())
    for order, word in enumerate(RATES, start=1):
        rate = powers_of(f"{unit}/s{order if order > 1 else ''}")
        yield getattr(driver, word), rate, f"driver.{word}"


def _nested(value: Any, place: str = "") -> Iterator[Use]:
    """Yield the numbers of goals and constraints whose keys have a unit."""
    for entry in fields(value):
        own, where = getattr(value, entry.name), f"{place}{entry.name}"
        if entry.metadata.get("unit"):
            numbers = own if isinstance(own, tuple) else (own,)
            yield from ((n, powers_of(entry.metadata["unit"]), where) for n in numbers)
            continue
        for part in own if isinstance(own, tuple) else (own,):
            if isinstance(part, Value) and not isinstance(part, Driver):
                yield from _nested(part, f"{where}.")


class _Reader:
    """Reads expressions for what they say about the units of the parameters in them.

    What is `exact` takes no factor for a plain number that may have a unit of its own.
    """

    def __init__(
        self, mechanism: Mechanism, known: dict[str, Powers | None], exact: bool = False
    ) -> None:
        self.mechanism, self.known, self.exact = mechanism, known, exact

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
        own = node.operand if isinstance(node, ast.UnaryOp) else node
        if self.exact and isinstance(own, ast.Constant) and not _bare(own.value):
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
        unit = unit_of(self.mechanism, base)
        if unit is None:
            return None
        return powers_of(unit if not order else f"{unit}/s{order if order > 1 else ''}")


class _Checker(_Reader):
    """Compares the suffixes of parameters with what their uses tell.

    ``alone`` says that the parameter is all there is of an expression: an angle is no number there.
    """

    place, alone = "", False

    def __init__(
        self, mechanism: Mechanism, known: dict[str, Powers | None], typed: Mapping[str, str]
    ) -> None:
        super().__init__(mechanism, known, exact=True)
        self.typed = typed
        self.found: tuple[str, str, str] | None = None

    def learn(self, name: str, powers: Powers | str | None, weak: bool) -> None:
        if name not in self.typed or not isinstance(powers, tuple) or self.found is not None:
            return
        units = [powers_of(own) for own in EVERY[self.typed[name]].si]
        rad = BASES.index("rad")
        if not self.alone:  # an angle may be a plain number: an arc is a radius times an angle
            units = [own and (*own[:rad], powers[rad], *own[rad + 1 :]) for own in units]
        if powers not in units:
            where = self.place if self.alone else f"used in {self.place}"
            self.found = (name, text_of(powers), where)


def _bare(value: Any) -> bool:
    """Return whether a number in an expression can hardly have a unit: 2, 0.5, 1000."""
    if not isinstance(value, int | float) or not value:
        return True
    size = float(f"{abs(value):.12e}".split("e")[0])
    return size == 1 or any(own == round(own) <= 12 for own in (abs(value), 1 / abs(value)))


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

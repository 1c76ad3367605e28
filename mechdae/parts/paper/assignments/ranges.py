"""Ranges of numbers with round values in them: 100, 105, 110 and not 103.71."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal, DecimalException
from math import isfinite

from mechdae.describe import Problem
from mechdae.describe.file.reading import split_unit
from mechdae.describe.units import UNITS
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.records import dataclass

FINEST = 20
"""A range has at least so many round steps where none is asked for."""


@dataclass(frozen=True)
class RoundRange:
    """The multiples of a step between two numbers, in the unit of the name's suffix."""

    name: str
    first: Decimal
    step: Decimal
    count: int

    def value(self, k: int) -> float:
        """Return the multiple of that number, from 0: the float nearest to its decimal digits."""
        return float(self.text(k))

    def text(self, k: int) -> str:
        """Return its decimal digits."""
        value = self.first + k * self.step
        places = max(0, -int(self.step.normalize().as_tuple().exponent))
        return f"{value:.{places}f}"

    @property
    def base(self) -> str:
        """The name without its unit."""
        return split_unit(self.name)[0]

    @property
    def unit(self) -> str:
        """The unit of the suffix, "" where the name has none."""
        suffix = split_unit(self.name)[1]
        return UNITS[suffix].name if suffix else ""


def ranges(problem: Problem, vary: Mapping[str, Sequence[int | str]]) -> tuple[RoundRange, ...]:
    """Return the ranges of the numbers that are varied.

    `vary`: name -> (low, high) or (low, high, step), numbers or their decimal digits; a suffix of
    the name is a unit. Without a step it is 1, 2 or 5 times a power of ten and at most a twentieth
    of the range; whole where both ends are whole and five or more apart.
    """
    if not isinstance(vary, Mapping) or not vary:
        raise InputError("name a number and its range", where="vary", hint="a = 0.1:0.2")
    found = tuple(_range(problem, str(name), ends) for name, ends in vary.items())
    bases = [varied.base for varied in found]
    for varied in found:
        if bases.count(varied.base) > 1:
            raise InputError("is varied twice", where=f"vary {varied.base}")
    return found


def _range(problem: Problem, name: str, ends: Sequence[int | str]) -> RoundRange:
    where = f"vary {name}"
    _check_name(problem, name, where)
    if isinstance(ends, str) or not isinstance(ends, Sequence) or len(ends) not in (2, 3):
        raise InputError(
            "low and high are needed, and a step if you like", where=where, hint="LOW:HIGH:STEP"
        )
    low, high, *given = (_decimal(end, where) for end in ends)
    if not low < high:
        raise InputError(f"{low} is not below {high}", where=where, hint="LOW:HIGH")
    step = given[0] if given else _step(low, high)
    if step <= 0:
        raise InputError(f"a step of {step} leads nowhere", where=where)
    first = (low / step).to_integral_value(ROUND_CEILING)
    last = (high / step).to_integral_value(ROUND_FLOOR)
    if last <= first:
        raise InputError(
            f"less than two multiples of {step} lie between {low} and {high}", where=where
        )
    return RoundRange(name, first * step, step, int(last - first) + 1)


def _decimal(value: int | str, where: str) -> Decimal:
    """Return a number with the digits that were typed."""
    try:
        found = Decimal(value if isinstance(value, str) else repr(float(value)))
    except (DecimalException, TypeError, ValueError):
        raise InputError(f"'{value}' is not a number", where=where, hint="LOW:HIGH") from None
    if not isfinite(found) or abs(found.adjusted()) > 30:
        raise InputError(f"{value} is not a number of this size", where=where)
    return found


def _step(low: Decimal, high: Decimal) -> Decimal:
    """Return a round step of at most a twentieth of a range."""
    most = (high - low) / FINEST
    power = Decimal(10) ** most.adjusted()
    step = next(digit * power for digit in (5, 2, 1) if digit * power <= most)
    whole = low == low.to_integral_value() and high == high.to_integral_value()
    return max(step, Decimal(1)) if whole and high - low >= 5 else step


def _check_name(problem: Problem, name: str, where: str) -> None:
    """Raise for a name that is no number of the mechanism, or has a unit that does not fit."""
    values = problem.mechanism.values()
    base, suffix = (name, "") if name in values else split_unit(name)
    if base in problem.sizes:
        raise InputError("a size changes the structure, it is not varied", where=where)
    if base not in values:
        raise UnknownName("parameter", name, values, where=where)
    try:
        problem.with_values({name: values[base] / UNITS[suffix].factor if suffix else values[base]})
    except MechdaeError as error:
        error.where = where
        raise error from None

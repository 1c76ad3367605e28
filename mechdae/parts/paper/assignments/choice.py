"""Which sets of round numbers make a good assignment, and why the others do not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal, DecimalException
from math import degrees, isfinite, prod
from random import Random
from typing import Any

import numpy as np

from mechdae.describe import Problem
from mechdae.describe.file.reading import split_unit
from mechdae.describe.units import UNITS
from mechdae.errors import AssemblyError, InputError, MechdaeError, SolveError, UnknownName
from mechdae.records import dataclass
from mechdae.results import Result
from mechdae.tasks import Solver

FINEST = 20
"""A range has at least so many round steps where none is asked for."""
TRIES = 40
"""Sets of numbers that are tried for each variant wanted, before it is given up."""
NONE = 200
"""Sets of numbers that are tried while not even one variant is found."""
GOOD = ("ok", "limit")


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


def ranges(problem: Problem, vary: Mapping[str, Sequence[float | str]]) -> tuple[RoundRange, ...]:
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


def _range(problem: Problem, name: str, ends: Sequence[float | str]) -> RoundRange:
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


def _decimal(value: float | str, where: str) -> Decimal:
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


@dataclass(frozen=True)
class Chosen:
    """A set of numbers that makes an assignment.

    ``texts`` are the numbers as they are printed, ``values`` as they are set, ``results`` those of
    each task; ``transmission`` the least transmission angle [rad] by joint.
    """

    texts: dict[str, str]
    values: dict[str, float]
    results: tuple[Result, ...]
    transmission: dict[str, float]


@dataclass
class Refused:
    """How many sets of numbers were not chosen, by reason."""

    unassembled: Counter[str] = field(default_factory=Counter)
    below: Counter[str] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)
    unmade: Counter[str] = field(default_factory=Counter)
    best: float = 0.0

    def text(self, bound: float) -> str:
        """Return what failed and how often."""
        parts = []
        for counted, words in (
            (self.unmade, "make no mechanism"),
            (self.unassembled, "do not assemble over the task"),
            (self.faults, "have poses with a fault"),
            (self.below, f"have a transmission angle below {degrees(bound):.4g} deg"),
        ):
            if counted:
                most = ", ".join(f"{name}: {n}" for name, n in counted.most_common(3))
                parts.append(f"{counted.total()} {words} ({most})")
        best = f"; the best of these has {degrees(self.best):.1f} deg" if self.below else ""
        return "; ".join(parts) + best


def choose(
    solvers: Sequence[Solver],
    ranges: Sequence[RoundRange],
    count: int,
    seed: int,
    bound: float,
    least: int | None = None,
) -> tuple[list[Chosen], int]:
    """Return as many sets of numbers as are wanted, good for all tasks, and how many were tried."""
    total = prod(number.count for number in ranges)
    least = count if least is None else least
    if total < least:
        raise InputError(
            f"there are {total} sets of round numbers, {least} are wanted",
            where="vary",
            hint="wider ranges, or a smaller step: LOW:HIGH:STEP",
        )
    found: list[Chosen] = []
    refused = Refused()
    tried = 0
    for tried, picks in enumerate(_draws(ranges, min(total, TRIES * count + NONE), seed), 1):
        chosen = _judged(solvers, ranges, picks, bound, refused)
        found += [chosen] if chosen is not None else []
        if len(found) == count:
            return found, tried
        if tried == NONE and not found:
            break
    if len(found) >= least:
        return found, tried
    hint = "other ranges" if not refused.below else "narrower ranges, or a smaller angle"
    every = "" if tried < total else ", which are all"
    said = f"{len(found)} of {count} variants in {tried} sets of numbers{every}"
    raise SolveError(
        f"{said}: {refused.text(bound)}",
        where=f"task {', '.join(solver.name for solver in solvers)}",
        hint=hint,
    )


def _draws(ranges: Sequence[RoundRange], most: int, seed: int) -> Iterator[tuple[int, ...]]:
    """Yield different sets, as numbers of the values in their ranges."""
    total = prod(number.count for number in ranges)
    for place in Random(seed).sample(range(total), most):
        picks = []
        for number in ranges:
            place, k = divmod(place, number.count)
            picks.append(k)
        yield tuple(picks)


def _judged(
    solvers: Sequence[Solver],
    ranges: Sequence[RoundRange],
    picks: tuple[int, ...],
    bound: float,
    refused: Refused,
) -> Chosen | None:
    texts = {number.name: number.text(k) for number, k in zip(ranges, picks, strict=True)}
    values = {number.name: number.value(k) for number, k in zip(ranges, picks, strict=True)}
    results: list[Result] = []
    least: dict[str, float] = {}
    for solver in solvers:
        result = _solved(solver, values, refused)
        if result is None:
            return None
        results.append(result)
        for joint, angle in transmission(result).items():
            least[joint] = min(angle, least.get(joint, angle))
    if least and bound > 0:
        joint = min(least, key=lambda name: least[name])
        if least[joint] < bound:
            refused.below[joint] += 1
            refused.best = max(refused.best, least[joint])
            return None
    return Chosen(texts, values, tuple(results), least)


def _solved(solver: Solver, values: dict[str, float], refused: Refused) -> Result | None:
    """Return the result of a task, None where it has a fault, which is counted."""
    try:
        result = solver(values)
    except AssemblyError:
        refused.unassembled["at the sketch"] += 1
        return None
    except SolveError as error:
        refused.faults[error.what.splitlines()[0]] += 1
        return None
    except InputError as error:
        refused.unmade[error.what] += 1
        return None
    failed = result.summary.get("failed")
    if failed or "unassembled" in result.status:
        refused.unassembled[failed[0]["name"] if failed else "a pose"] += 1
        return None
    if result.fault or not np.isin(result.status, GOOD).all():
        words = [str(status) for status in result.status if status not in GOOD]
        refused.faults[words[0] if words else str(result.fault).splitlines()[0]] += 1
        return None
    return result


def transmission(result: Any) -> dict[str, float]:
    """Return the least transmission angle [rad] of each dyad by its joint."""
    found = result.summary.get("transmission")
    if found:
        return {joint: float(angle["min"]) for joint, angle in found.items()}
    return {
        joint: float(np.nanmin(series["transmission_angle"]))
        for joint, series in result.joints.items()
        if "transmission_angle" in series
    }

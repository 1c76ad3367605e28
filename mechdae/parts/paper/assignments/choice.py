"""Which sets of round numbers make a good assignment, and why the others do not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import field
from math import degrees, prod
from random import Random
from typing import Any

import numpy as np

from mechdae.errors import AssemblyError, InputError, SolveError
from mechdae.parts.paper.assignments.ranges import RoundRange
from mechdae.records import dataclass
from mechdae.results import Result
from mechdae.tasks import Solver

TRIES = 40
"""Sets of numbers that are tried for each variant wanted, before it is given up."""
NONE = 200
"""Sets of numbers that are tried while not even one variant is found."""
GOOD = ("ok", "limit")


@dataclass(frozen=True)
class Chosen:
    """A set of numbers that makes an assignment.

    ``texts`` are the numbers as they are printed, ``values`` as they are set; ``transmission`` the
    least transmission angle [rad] by joint.
    """

    texts: dict[str, str]
    values: dict[str, float]
    result: Result
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
    solver: Solver,
    ranges: Sequence[RoundRange],
    count: int,
    seed: int,
    bound: float,
    least: int | None = None,
) -> tuple[list[Chosen], int]:
    """Return as many sets of numbers as are wanted, and how many were tried for them."""
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
        chosen = _judged(solver, ranges, picks, bound, refused)
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
        where=f"task {solver.name}",
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
    solver: Solver,
    ranges: Sequence[RoundRange],
    picks: tuple[int, ...],
    bound: float,
    refused: Refused,
) -> Chosen | None:
    texts = {number.name: number.text(k) for number, k in zip(ranges, picks, strict=True)}
    values = {number.name: number.value(k) for number, k in zip(ranges, picks, strict=True)}
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
    least = transmission(result)
    if least and bound > 0:
        joint = min(least, key=lambda name: least[name])
        if least[joint] < bound:
            refused.below[joint] += 1
            refused.best = max(refused.best, least[joint])
            return None
    return Chosen(texts, values, result, least)


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

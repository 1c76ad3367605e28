"""`md.rank`: variants by size first, then by criteria with weights."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mechdae.describe import Problem, load
from mechdae.describe.file.load import Source, given
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.values import Number
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.numerics.dominance import undominated
from mechdae.parts.types.chains.variants.scheme import Variant, planar
from mechdae.parts.types.ranking.batch import Values, valued
from mechdae.parts.types.ranking.judges import Grades, Judgment, judged
from mechdae.parts.types.ranking.variants import first_sweep, variants
from mechdae.records import dataclass, public
from mechdae.types import Floats

CLOSE = 1e-9
"""How far from 1 the sum of weights may be."""
SEVERAL = 2
"""Judges from which on places differ."""
DIGITS, TIE = 12, 1e-12
"""Weighted sums that differ by less are equal."""


def checked(weights: Mapping[str, float] | None, names: Sequence[str]) -> dict[str, float]:
    """Return a weight for each criterion; without any they are equal."""
    if weights is None or not weights:
        return dict.fromkeys(names, 1 / max(len(names), 1))
    for name, weight in weights.items():
        if name not in names:
            raise UnknownName("criterion", name, names, where="weights")
        number = isinstance(weight, (int, float)) and not isinstance(weight, bool)
        if not number or not weight >= 0 or not np.isfinite(weight):
            raise InputError(
                f"a weight is a number of 0 or more, not {weight!r}", where=f"weights.{name}"
            )
    total = float(sum(weights.values()))
    if not abs(total - 1) <= CLOSE:
        raise InputError(
            f"the weights add up to {total:.6g}, not to 1",
            where="weights",
            hint=", ".join(f"{name}={weight / total:.6g}" for name, weight in weights.items())
            if total > 0
            else "one at least is above 0",
        )
    return {name: float(weights.get(name, 0.0)) for name in names}


def shares(values: Floats, senses: Sequence[str]) -> Any:
    """Return how far each value is from the best to the worst of its criterion (n, k), 0 to 1.

    Values that differ by rounding alone are equal.
    """
    signs = np.array([1.0 if sense == "min" else -1.0 for sense in senses])
    costs = np.asarray(values, float) * signs
    best, worst = costs.min(axis=0), costs.max(axis=0)
    width = worst - best
    apart = width > TIE * np.maximum(np.abs(best), np.abs(worst))
    return np.round(np.where(apart, (costs - best) / np.where(apart, width, 1.0), 0.0), DIGITS)


def ordered(costs: Floats, weights: Any) -> list[int]:
    """Return the rows by their weighted sums, least first."""
    plain = _sums(costs, np.ones(np.shape(costs)[1]))
    return [int(k) for k in np.lexsort((plain, _sums(costs, weights)))]


def _sums(costs: Floats, weights: Floats) -> Any:
    """Return the weighted sums, equal where they differ by rounding alone."""
    return np.round(np.asarray(costs, float) @ np.asarray(weights, float), DIGITS)


def intervals(costs: Floats, weights: Sequence[float], first: int) -> list[tuple[float, float]]:
    """Return for each criterion the weights with which the same row stays first.

    One weight moves, the others keep their proportions and add up to the rest of 1 (equal ones,
    where this weight is 1). The weighted sum of each row is linear in that weight: the
    intervals are exact.
    """
    costs, shares = np.asarray(costs, float), np.asarray(weights, float)
    found = []
    for k in range(costs.shape[1]):
        rest = np.delete(shares, k)
        rest = rest / rest.sum() if rest.sum() > 0 else np.full(len(rest), 1 / max(len(rest), 1))
        others = np.delete(costs, k, axis=1) @ rest if len(rest) else np.zeros(len(costs))
        low, high = 0.0, 1.0
        # how much the first is ahead of a row: ahead + weight * slope
        ahead = others - others[first]
        slope = (costs[:, k] - costs[first, k]) - ahead
        ahead = np.where(np.abs(ahead) < TIE, 0.0, ahead)
        for at, rise in zip(ahead, slope, strict=True):
            if rise > 0 and at < 0:
                low = max(low, -at / rise)
            elif rise < 0:
                high = min(high, -at / rise)
        here = float(shares[k])
        found.append((float(min(low, here)), float(max(high, here))))
    return found


@dataclass(frozen=True)
class RankedVariant:
    """A variant in a ranking; ``why`` says what keeps it out of the order, "" where nothing."""

    name: str
    values: Mapping[str, float]
    pareto: bool
    why: str = ""


@dataclass(frozen=True)
class Ranking:
    """Variants with their criteria, the front, and the order by weights.

    Attributes
    ----------
    criteria
        ``{"name", "unit", "sense"}`` of each.
    rows
        All variants as they came, those that are not ranked too.
    weights
        Of each criterion, 1 together.
    order
        Names of the ranked ones, the best first.
    score
        Their weighted sums, 0 for the best of each criterion to 1 for the worst.
    intervals
        Criterion -> (lowest, highest) weight with the same first place.
    variants
        By name.
    task
        That was solved.
    missing
        Criteria that only some variants have, with those that have none: not ranked by.
    places
        Of several judges, name -> (best, worst) place that the weights and grades of one of them
        give it.

    Examples
    --------
    >>> ranking = md.rank(md.four_bar(0.1, 0.04, 0.12, 0.08), by="inversion")
    >>> len(ranking.rows), len(ranking.order)
    (4, 4)
    """

    criteria: tuple[Mapping[str, str], ...]
    rows: tuple[RankedVariant, ...]
    weights: Mapping[str, float]
    order: tuple[str, ...]
    score: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    variants: Mapping[str, Variant]
    task: str
    missing: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    places: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return it as in the JSON."""
        rows = []
        for ranked in self.rows:
            row: dict[str, object] = {
                "name": ranked.name, "values": dict(ranked.values), "pareto": ranked.pareto
            }  # fmt: skip
            row |= {"score": self.score[ranked.name]} if ranked.name in self.score else {}
            row |= {"places": list(self.places[ranked.name])} if ranked.name in self.places else {}
            rows.append(row | ({"why": ranked.why} if ranked.why else {}))
        missing = {name: list(names) for name, names in self.missing.items()}
        return {
            "task": self.task,
            "criteria": [dict(criterion) for criterion in self.criteria],
            "weights": dict(self.weights),
            "rows": rows,
            "order": list(self.order),
            "intervals": {name: list(interval) for name, interval in self.intervals.items()},
        } | ({"missing": missing} if missing else {})


@public(old="problem variants")
def rank(
    problem: Source,
    task: Task | str | None = None,
    *,
    variants: Iterable[Variant | Problem] | str | Path | None = None,
    by: str = "construction",
    set: Mapping[str, Number] | None = None,
    weights: Mapping[str, float] | None = None,
    judges: Judgment | str | Path | None = None,
    criteria: Iterable[str] | None = None,
    within: Mapping[str, float] | None = None,
    output: str | None = None,
    limit: int | None = None,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Ranking:
    """Return variants ranked: limits on size first, then weighted criteria.

    Parameters
    ----------
    problem
        What is varied: a problem, the name of a predefined one, a file, a mechanism, or a result.
    variants
        Variants, problems, or a folder of problem files; absent: all of `problem`, ``by``.
    set
        Numbers of the problem to change, as of `md.solve`.
    by, limit
        As of `md.variants`.
    task
        The sweep or reactions that is solved; default: the first reactions, else the first sweep.
    weights
        Criterion -> weight, 1 together; what is not named has none. Absent: equal weights.
    judges
        What `md.judged` gives, or its file: criteria with weights, grades in words.
    criteria
        Those that are used; absent: all that the task gives for every variant.
    within
        Criterion -> the largest value (the least, of one where more is better) that is let in.
    output
        Coordinate whose acceleration counts.
    workers
        Processes for the studies.
    progress
        Called with the number of variants that are done, and of all.

    Returns
    -------
    Ranking
        The order, the scores, and all variants with their criteria.

    Raises
    ------
    InputError
        Weights that do not add up to 1, unknown criteria, no variants.

    Examples
    --------
    >>> ranking = md.rank(md.four_bar(0.1, 0.04, 0.12, 0.08), by="inversion")
    >>> ranking.order
    ('fixed-coupler', 'fixed-rocker', 'fixed-ground', 'fixed-crank')
    """
    judgment = judged(judges) if isinstance(judges, str | Path) else judges
    if judgment is not None and judgment.weights:
        if weights or criteria:
            raise InputError("judges give criteria and weights themselves", where="judges",
                             hint="leave out weights and criteria")  # fmt: skip
        weights, criteria = judgment.weights, list(judgment.weights)
    whole, named = given(problem, task, set)
    found = _collected(whole, variants, by, limit)
    name = named or _task(whole)
    checked_ones = [_comparable(variant, whole, name) for variant in found]
    values = valued(checked_ones, name, output, workers, progress)
    if judgment is not None:
        _grade(values, judgment.grades)
    used, missing = _used(values, criteria)
    units = next(solved.units for solved in values.values() if solved.numbers)
    own_weights = checked(weights, used)
    limits = _limits(within, used)
    rows = [_row(variant, values[variant.name], used, units, limits) for variant in checked_ones]
    by_name = {variant.name: variant for variant in found}
    ranking = _ranked(rows, used, units, own_weights, by_name, name)
    places = {} if judgment is None else _places(ranking, judgment)
    return replace(ranking, missing=missing, places=places)


def _grade(values: Mapping[str, Values], grades: Grades) -> None:
    """Add grades to the numbers of variants."""
    grades.check_names(list(values))
    for criterion in grades.words:
        for name, solved in values.items():
            if criterion in solved.units:
                raise InputError("is computed, it is not graded", where=f"grades.{criterion}")
            number = grades.value(criterion, name)
            if number is not None and solved.numbers:
                solved.numbers[criterion] = number
                solved.units = {**solved.units, criterion: ("1", "max")}


def _places(ranking: Ranking, judgment: Judgment) -> dict[str, tuple[int, int]]:
    """Return the best and the worst place of each ranked variant by single judges."""
    if len(judgment.judges) < SEVERAL or not ranking.order:
        return {}
    rows = {row.name: row for row in ranking.rows}
    senses = [criterion["sense"] for criterion in ranking.criteria]
    by_judge = []
    for judge in judgment.judges:
        table = [
            [judgment.grades.value(name, variant, judge.name)
             if name in judgment.grades.words else rows[variant].values[name]
             for name in judge.weights]
            for variant in ranking.order
        ]  # fmt: skip
        costs = shares(np.array(table, float), senses)
        sums = _sums(costs, np.array([*judge.weights.values()]))
        by_judge.append([1 + int((sums < total).sum()) for total in sums])
    best, worst = np.min(by_judge, axis=0), np.max(by_judge, axis=0)
    ends = zip(best.tolist(), worst.tolist(), strict=True)
    return dict(zip(ranking.order, ends, strict=True))


def _ranked(
    rows: list[RankedVariant],
    used: list[str],
    units: Mapping[str, tuple[str, str]],
    weights: Mapping[str, float],
    found: Mapping[str, Variant],
    task: str,
) -> Ranking:
    inside = [row for row in rows if not row.why]
    order: list[str] = []
    score: dict[str, float] = {}
    ranges: dict[str, tuple[float, float]] = {}
    best: set[str] = set()
    if inside:
        table = np.array([[row.values[name] for name in used] for row in inside])
        costs = shares(table, [units[name][1] for name in used])
        each = [weights[name] for name in used]
        places = ordered(costs, each)
        order = [inside[k].name for k in places]
        sums = costs @ np.array(each)
        score = {row.name: float(total) for row, total in zip(inside, sums, strict=True)}
        ranges = dict(zip(used, intervals(costs, each, places[0]), strict=True))
        flags = undominated(costs)
        best = {row.name for row, flag in zip(inside, flags, strict=True) if flag}
    return Ranking(
        tuple({"name": n, "unit": units[n][0], "sense": units[n][1]} for n in used),
        tuple(replace(row, pareto=row.name in best) for row in rows),
        weights,
        tuple(order),
        score,
        ranges,
        found,
        task,
    )


def _collected(
    problem: Problem, given: Iterable[Variant | Problem] | str | Path | None, by: str,
    limit: int | None,
) -> list[Variant]:  # fmt: skip
    """Return the variants, each with a name of its own."""
    if given is None:
        return list(variants(problem, by, limit=limit))
    found: list[Variant] = []
    if isinstance(given, str | Path):
        folder = Path(given)
        if not folder.is_dir():
            raise InputError("no such folder", where=str(folder), hint="variants P --out DIR")
        files = sorted(folder.glob("*.toml"))
        if not files:
            raise InputError("holds no problem files", where=str(folder))
        for path in files:
            try:
                found.append(_named(load(path)))
            except MechdaeError as error:
                text = path.read_text(encoding="utf-8", errors="replace")
                fault = str(error).splitlines()[0]
                found.append(Variant(path.stem, None, fault=fault, unmade=text))
    else:
        found = [variant if isinstance(variant, Variant) else _named(variant) for variant in given]
    if not found:
        raise InputError("there are no variants", where="variants")
    names = [variant.name for variant in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two variants are called '{name}'", where="variants")
    return found[:limit]


def _named(problem: Problem) -> Variant:
    return Variant(problem.name, planar(problem))


def _task(problem: Problem) -> str:
    """Return the name of the task that is solved: reactions before sweeps."""
    forces = [name for name, task in problem.tasks.items() if task.kind == "reactions"]
    name = next(iter(forces), None) or first_sweep(problem)
    if name is None:
        raise InputError("variants are ranked by a sweep or reactions", where="tasks")
    return name


def _comparable(variant: Variant, problem: Problem, name: str) -> Variant:
    """Return a variant, with a fault if it has not the task, or not the loads of the problem.

    Variants keep the names of joints; what has other joints is another mechanism with its loads.
    """
    if variant.problem is None or variant.fault:
        return variant
    one, two = problem.mechanism, variant.problem.mechanism
    lost = [load for load in one.loads if load not in two.loads]
    if lost and one.joints.keys() <= two.joints.keys():
        return replace(variant, fault=f"it has no load '{lost[0]}', which has no meaning in it")
    if name in variant.problem.tasks:
        return variant
    left = next((word for word in variant.left_out if word.startswith(f"tasks.{name}:")), "")
    return replace(variant, fault=left or f"it has no task '{name}'")


def _used(
    values: Mapping[str, Values], wanted: Iterable[str] | None
) -> tuple[list[str], dict[str, tuple[str, ...]]]:
    """Return the criteria that all variants have which could be solved, and who lacks others."""
    solved = {name: one for name, one in values.items() if one.numbers}
    if not solved:
        fault = next((one.fault for one in values.values() if one.fault), "")
        raise InputError(f"no variant can be ranked: {fault}", where="variants")
    every = list(dict.fromkeys(name for one in solved.values() for name in one.numbers))
    units = {name: unit for one in reversed(solved.values()) for name, unit in one.units.items()}
    lacking = {
        name: tuple(
            one
            for one, there in solved.items()
            if name not in there.numbers or there.units[name] != units[name]
        )
        for name in every
    }
    known = [name for name in every if not lacking[name]]
    missing = {name: names for name, names in lacking.items() if names}
    if wanted is None:
        return known, missing
    chosen = list(dict.fromkeys(wanted))
    for name in chosen:
        if name in missing:
            without = ", ".join(missing[name][:3])
            raise InputError(f"has no value for {without}", where=f"criteria.{name}")
        if name not in known:
            raise UnknownName("criterion", name, known, where="criteria")
    if not chosen:
        raise InputError("the list of criteria is empty", where="criteria")
    return chosen, {}


def _limits(within: Mapping[str, float] | None, used: list[str]) -> dict[str, float]:
    for name, value in (within or {}).items():
        if name not in used:
            raise UnknownName("criterion", name, used, where="within")
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InputError(f"a number is needed, not {value!r}", where=f"within.{name}")
    return dict(within or {})


def _row(
    variant: Variant,
    values: Values,
    used: list[str],
    units: Mapping[str, tuple[str, str]],
    limits: Mapping[str, float],
) -> RankedVariant:
    numbers = {name: values.numbers[name] for name in used if name in values.numbers}
    why = values.fault
    for name, limit in limits.items():
        if not why and name in numbers:
            over = numbers[name] > limit if units[name][1] == "min" else numbers[name] < limit
            word = "above" if units[name][1] == "min" else "below"
            why = f"{name} {numbers[name]:.6g} {units[name][0]} is {word} {limit:g}" if over else ""
    return RankedVariant(variant.name, numbers, False, why)

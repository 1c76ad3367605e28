"""Numbers of many variants: those of one structure in one study, equal ones once."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from mechdae.describe import Mechanism, Problem, dumps
from mechdae.describe.structure import Structure, structure_of
from mechdae.errors import MechdaeError
from mechdae.parts.types.chains.variants.scheme import Variant
from mechdae.parts.types.ranking.criteria import Criteria, measured
from mechdae.records import dataclass
from mechdae.tasks.parameter_studies import study
from mechdae.tasks.solve import solve

GOOD = ("ok", "limit")


@dataclass
class AlikeVariants:
    """Variants of one structure, with the numbers in which they differ from the first."""

    base: Variant
    members: list[Variant] = field(default_factory=list)
    numbers: list[dict[str, float]] = field(default_factory=list)


@dataclass
class Values:
    """What a variant is worth: numbers by criterion, or why there are none."""

    numbers: dict[str, float]
    units: dict[str, tuple[str, str]]
    fault: str = ""


def valued(
    variants: Sequence[Variant],
    task: str,
    output: str | None = None,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Values]:
    """Return the numbers of each variant by its name."""
    found: dict[str, Values] = {
        variant.name: Values({}, {}, variant.fault) for variant in variants if variant.fault
    }
    sound = [variant for variant in variants if not variant.fault]
    for group in grouped(sound, task):
        found |= _of_group(group, task, output, workers)
        if progress is not None:
            progress(len(found), len(variants))
    return {variant.name: found[variant.name] for variant in variants}


def grouped(variants: Sequence[Variant], task: str) -> list[AlikeVariants]:
    groups: dict[Structure, list[AlikeVariants]] = {}
    for variant in variants:
        assert variant.problem is not None
        mechanism = variant.problem.mechanism
        for group in groups.setdefault(structure_of(mechanism), []):
            numbers = _differences(group.base, variant, task)
            if numbers is not None:
                break
        else:
            group, numbers = AlikeVariants(variant), {}
            groups[structure_of(mechanism)].append(group)
        group.members.append(variant)
        group.numbers.append(numbers)
    return [group for some in groups.values() for group in some]


def _differences(base: Variant, variant: Variant, task: str) -> dict[str, float] | None:
    """Return the numbers in which two mechanisms differ, None where they differ in more."""
    assert base.problem is not None
    assert variant.problem is not None
    if base.problem.tasks[task] != variant.problem.tasks[task]:
        return None
    one, two = base.problem.mechanism, variant.problem.mechanism
    known = _plain(one)
    numbers = {name: value for name, value in _plain(two).items() if known.get(name) != value}
    if not numbers.keys() <= known.keys():
        return None
    same = one.with_values(numbers) == two if numbers else one == two
    return numbers if same else None


def _plain(mechanism: Mechanism) -> dict[str, float]:
    """Return the numbers that are no expressions."""
    every = [*mechanism.parameters.items(), *mechanism.numbers()]
    return {name: float(value) for name, value in every if not isinstance(value, str)}


def _of_group(
    group: AlikeVariants, task: str, output: str | None, workers: int
) -> dict[str, Values]:
    base = group.base.problem
    assert base is not None
    task_of_group = measured(base.mechanism, base.tasks[task])
    bare = replace(base, tasks=type(base.tasks)({task: task_of_group}), expected=())
    criteria = Criteria(bare, task, output).all
    paths = tuple(dict.fromkeys(path for one in criteria.values() for path in one.paths))
    different, which = _different(bare, group.numbers)
    try:
        rows = _solved(bare, task, paths, different, workers)
    except MechdaeError as error:
        rows = [str(error).splitlines()[0]] * len(different)
    units = {criterion.name: (criterion.unit, criterion.sense) for criterion in criteria.values()}
    found = {}
    for member, k in zip(group.members, which, strict=True):
        row = rows[k]
        assert member.problem is not None
        if isinstance(row, str):
            found[member.name] = Values({}, units, row)
            continue
        values, numbers = member.problem.mechanism.values(), {}
        for name, criterion in criteria.items():
            if all(_there(row.get(path)) for path in criterion.paths):
                number = criterion.value(row.__getitem__, values)
                if np.isfinite(number):
                    numbers[name] = number
        found[member.name] = Values(numbers, units)
    return found


def _there(value: object) -> bool:
    return value is not None and (not isinstance(value, dict) or bool(value))


def _different(
    problem: Problem, numbers: Sequence[Mapping[str, float]]
) -> tuple[list[dict[str, float]], list[int]]:
    """Return the sets of numbers that differ for the task, and which of them each one is.

    Numbers that stand in no dimension, load, output or law (layers, lengths of bearings that
    carry nothing more by them) make no difference.
    """
    used = _named(problem)
    keys: dict[tuple[float, ...], int] = {}
    sets: list[dict[str, float]] = []
    which = []
    for changes in numbers:
        mechanism = problem.mechanism.with_values(changes) if changes else problem.mechanism
        values = mechanism.values()
        key = tuple(values[name] for name, _ in mechanism.numbers())
        key += tuple(values[name] for name in used)
        if key not in keys:
            keys[key] = len(sets)
            sets.append(dict(changes))
        which.append(keys[key])
    return sets, which


def _named(problem: Problem) -> list[str]:
    """Return the parameters that loads, outputs, tasks and the sketch name."""
    parts = re.split(r"^\[", dumps(problem), flags=re.M)
    text = "".join(
        part for part in parts if part.startswith(("loads", "outputs", "tasks", "sketch"))
    )
    words = set(re.findall(r"(?<![\w.])[A-Za-z_]\w*", text))
    return [name for name in problem.mechanism.parameters if name in words]


def _solved(
    problem: Problem,
    task: str,
    paths: tuple[str, ...],
    sets: list[dict[str, float]],
    workers: int,
) -> list[dict[str, Any] | str]:
    """Return what each set gives by path, or its fault."""
    names = sorted({name for changes in sets for name in changes})
    if len(sets) == 1 or not names:
        changed = problem.with_values(sets[0]) if sets[0] else problem
        return [_alone(changed, task, paths)]
    plain = _plain(problem.mechanism)
    columns = {name: [changes.get(name, plain[name]) for changes in sets] for name in names}
    together = [path for path in paths if path != "summary/transmission"]
    dyads = _dyads(problem, task) if "summary/transmission" in paths else []
    outputs = [*together, *(f"summary/transmission/{joint}/min" for joint in dyads)]
    result = study(problem, of=task, sets=columns, outputs=outputs, workers=workers)
    faults = result.summary.get("faults") or {}
    rows: list[dict[str, Any] | str] = []
    for k, status in enumerate(result.status):
        if str(status) not in GOOD:
            rows.append(str(faults.get(str(k), faults.get(k, status))))
            continue
        row: dict[str, Any] = {path: result.table[path][k] for path in together}
        row["summary/transmission"] = {
            joint: {"min": result.table[f"summary/transmission/{joint}/min"][k]}
            for joint in dyads
        }  # fmt: skip
        rows.append(row)
    return rows


def _alone(problem: Problem, task: str, paths: tuple[str, ...]) -> dict[str, Any] | str:
    result = solve(problem, task)
    if result.fault:
        return str(result.fault)
    found = {}
    for path in paths:
        try:
            found[path] = result.value(path)
        except MechdaeError:
            found[path] = None
    return found


def _dyads(problem: Problem, task: str) -> list[str]:
    """Return the joints that have a transmission angle."""
    whole: Any = problem.tasks[task]
    one = solve(problem, replace(whole, poses=2))
    return list(one.summary.get("transmission", {}))


__all__ = ["AlikeVariants", "Values", "grouped", "valued"]

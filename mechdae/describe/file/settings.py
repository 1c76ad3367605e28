"""Problems and mechanisms with other numbers: sizes, parameters, automatic names that are set."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import fields, replace
from typing import Any

from mechdae.describe import values
from mechdae.describe.file.key_hints import unit_meant
from mechdae.describe.file.problem import Problem, check_parts, check_task
from mechdae.describe.file.reading import split_known, to_si
from mechdae.describe.file.repeat import Pattern
from mechdae.describe.file.tabulated import with_tables_of
from mechdae.describe.file.units import check_number
from mechdae.describe.mechanism import (
    BY_NAMES,
    MOMENTS,
    TOLERANCE,
    Body,
    Ground,
    Mechanism,
    check_values,
)
from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.describe.values import Number, Table
from mechdae.errors import InputError, MechdaeError, UnknownName


def with_values(problem: Problem, changes: Mapping[str, Number]) -> Problem:
    """Return the problem with sizes, parameters and automatic names set, see `Problem`."""
    for name in changes:
        if not isinstance(name, str):
            raise InputError(f"a name is needed, not {values.describe(name)}", where="set")
    for name in problem.sizes:
        if name in changes:
            try:
                problem = _resized(problem, name, changes[name])
            except MechdaeError as error:
                error.where = f"set {name}: {error.where}".removesuffix(": ")
                raise error from None
    mechanism, sizes = problem.mechanism, problem.sizes
    known = mechanism.settable
    numbers: dict[str, Number] = {}
    for name, value in changes.items():
        if name in sizes:
            continue
        base, number = settable(problem, known, name, value)
        numbers[base] = number
    if not numbers:
        return problem
    pattern = problem.pattern
    for base, value in numbers.items():
        pattern = pattern and pattern.with_number(base, value)
    return _revalued(problem, _changed(mechanism, numbers), pattern)


def settable(
    problem: Problem, known: Collection[str], name: str, value: Number
) -> tuple[str, Number]:
    """Return name and value in SI of a number that is set, of the `known` names; see `in_si`.

    Raises
    ------
    UnknownName
        Neither a parameter nor an automatic name.
    """
    mechanism, sizes = problem.mechanism, problem.sizes
    try:
        base, number = in_si(mechanism, problem.tasks, known, name, value)
        if base not in known:
            mechanism.with_values({base: number})  # says what there is
    except MechdaeError as error:
        error.where = f"set {name}"
        if isinstance(error, UnknownName) and sizes and not error.hint.startswith("did you"):
            more = f"; {error.hint}" if error.hint else ""
            error.hint = f"the sizes are {', '.join(sizes)}{more}"
        if isinstance(error, UnknownName):
            error.hint = unit_meant(name, known) or error.hint
        raise error from None
    return base, number


def in_si(
    mechanism: Mechanism,
    tasks: Mapping[str, Task],
    known: Collection[str],
    name: str,
    value: Number,
) -> tuple[str, Number]:
    """Return the name and the value in SI of a number that is set: ``a_mm`` = 41.

    `known` are the names of parameters and the automatic ones.

    Raises
    ------
    InputError
        A unit that the number does not have.
    """
    base, suffix = split_known(name, known)
    if base in known:
        check_number(mechanism, tasks, base, suffix)
    return base, values.number(to_si(values.number(value), suffix))


def _revalued(problem: Problem, mechanism: Mechanism, pattern: Pattern | None) -> Problem:
    """Return the problem with a mechanism of the same names: only values are checked."""
    revalued: Problem = object.__new__(type(problem))
    vars(revalued).update({entry.name: getattr(problem, entry.name) for entry in fields(problem)})
    vars(revalued).update(mechanism=mechanism, pattern=pattern)
    check_parts(mechanism)
    for name, task in problem.tasks.items():
        if not isinstance(task, Driven):  # of those names are checked, which are the same
            check_task(mechanism, name, task)
    return revalued


def _changed(mechanism: Mechanism, numbers: Mapping[str, Number]) -> Mechanism:
    """Return the mechanism with numbers set all at once: one by one some may make none."""
    try:
        return mechanism.with_values(numbers)
    except MechdaeError as problem:
        problem.where = f"set {', '.join(numbers)}"
        for name, value in numbers.items() if len(numbers) > 1 else ():
            try:
                mechanism.with_values({name: value})
            except MechdaeError as alone:
                alone.where = f"set {name}"
                raise alone from None
        raise problem from None


def _resized(problem: Problem, name: str, value: Number) -> Problem:
    """Return the problem expanded again; tasks put or replaced since it was read are kept."""
    assert problem.pattern is not None
    pattern = problem.pattern.with_size(name, value)
    old, new = problem.pattern.problem(problem.name), pattern.problem(problem.name)
    if old.mechanism != problem.mechanism:
        raise InputError(
            "the mechanism is no longer the one of the file", hint="set the size before"
        )
    tasks = {
        key: new.tasks[key] if task == old.tasks.get(key) and key in new.tasks else task
        for key, task in problem.tasks.items()
    }
    resized: Problem = replace(
        new,
        mechanism=with_tables_of(new.mechanism, problem.mechanism),
        tasks=Table(tasks),
        expected=new.expected if problem.expected == old.expected else problem.expected,
        title=problem.title,
        source=problem.source,
    )
    return resized


def renumbered(mechanism: Mechanism, changes: Mapping[str, Number]) -> Mechanism:
    """Return the mechanism with parameters or automatic names set, see `Mechanism.with_values`."""
    result, parameters = mechanism, mechanism.parameters
    if not all(name in parameters for name in changes):
        known = mechanism.settable
        if not changes.keys() <= known.keys():
            changes = dict(in_si(mechanism, {}, known, *change) for change in changes.items())
    for name, number in changes.items():
        if name in parameters:
            parameters = parameters.with_(name, number)
    if parameters is not mechanism.parameters:
        result = _with_parameters(mechanism, parameters)
    for name, number in changes.items():
        if name not in parameters:
            result = _with_number(result, name, number)
    return result


def _with_parameters(mechanism: Mechanism, parameters: Table[Number]) -> Mechanism:
    """Return the mechanism with other values of its parameters: only values are checked."""
    changed: Mechanism = object.__new__(type(mechanism))
    held = vars(changed)
    held.update({entry.name: getattr(mechanism, entry.name) for entry in fields(mechanism)})
    try:
        held["parameters"] = values.numbers_by_name(parameters)
    except MechdaeError as problem:
        raise problem.inside("parameters") from None
    for shared in BY_NAMES:
        held[shared] = getattr(mechanism, shared)
    if _by_values_alone(mechanism, parameters):
        held["structures"] = mechanism.structures
    check_values(changed)
    return changed


def _by_values_alone(mechanism: Mechanism, parameters: Table[Number]) -> bool:
    """Return whether other parameters cannot make another structure."""
    bound = mechanism.dimension == 3 or any(joint.on_curve for joint in mechanism.joints.values())
    return not bound and all(
        old == new or not (isinstance(old, str) or isinstance(new, str))
        for old, new in zip(mechanism.parameters.values(), parameters.values(), strict=True)
    )


def _with_number(mechanism: Mechanism, name: str, number: Number) -> Mechanism:
    if name == TOLERANCE:
        return replace(mechanism, closure_tolerance=number)
    if name not in dict(mechanism.numbers()):
        automatic = [entry for entry, _ in mechanism.numbers()]
        known = [*mechanism.parameters, *automatic]
        raise UnknownName("parameter", name, known, listed=mechanism.parameters or automatic)
    part, *rest = name.split(".")
    if part == "loads":
        load = mechanism.loads[rest[0]].with_number(".".join(rest[1:]), number)
        return replace(mechanism, loads=mechanism.loads.with_(rest[0], load))
    if part == "gravity":
        axis = Mechanism.AXES.index(rest[0])
        return replace(mechanism, gravity=_put(mechanism.gravity or (), axis, number))
    if part in mechanism.joints:
        joint = mechanism.joints[part].with_number(".".join(rest), number)
        return replace(mechanism, joints=mechanism.joints.with_(part, joint))
    body = mechanism.body(part)
    axes = MOMENTS if rest[0] == "inertia" else tuple(Mechanism.AXES)
    place = axes.index(rest[1]) if len(rest) == 2 else None
    changes: dict[str, Any]
    if place is None:
        changes = {rest[0]: number}
    elif rest[0] in body.points:
        changes = {"points": body.points.with_(rest[0], _put(body.points[rest[0]], place, number))}
    else:
        assert isinstance(body, Body)
        changes = {rest[0]: _put(getattr(body, rest[0]) or (), place, number)}
    if isinstance(body, Ground):
        return replace(mechanism, ground=replace(body, **changes))
    return replace(mechanism, bodies=mechanism.bodies.with_(part, replace(body, **changes)))


def _put(items: tuple[Number, ...], position: int, number: Number) -> tuple[Number, ...]:
    return (*items[:position], number, *items[position + 1 :])

"""The shaking force and moment of a task as paths: named outputs of what the masses do.

The force is the sum of m a over all bodies, the moment that of its moments about the origin and of
the change of each body's own moment of momentum about its centre: what the frame has to give to the
motion, and its own bearings feel with the other sign.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.table import Table
from mechdae.describe.tasks.shaken import Shaken, Terms
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.describe.tasks.kinds import Task


WORDS = ("shaking/force", "shaking/moment")
"""Paths below a task."""


def shaking(dimension: int) -> dict[str, tuple[str, ...]]:
    """Return the outputs that the two paths stand for: components of force and moment."""
    axes = "xyz"[:dimension]
    turns = [f"shaking_moment_{axis}" for axis in axes] if dimension == 3 else ["shaking_moment"]
    return dict(zip(WORDS, (tuple(f"shaking_{axis}" for axis in axes), tuple(turns)), strict=True))


def shaking_paths(path: str, dimension: int) -> tuple[str, ...]:
    """Return the paths of the outputs that a path stands for, itself if it is no shaking."""
    names = shaking(dimension).get(path)
    return (path,) if names is None else tuple(f"outputs/{name}/value" for name in names)


def with_shaking(problem: Problem, tasks: Iterable[str]) -> Problem:
    """Return the problem with points at the centres of mass and outputs of what shakes the frame.

    Parameters
    ----------
    tasks
        Names of sweeps that are to have these outputs.

    Raises
    ------
    InputError
        No body has a mass; a task without accelerations.
    """
    wanted = list(dict.fromkeys(tasks))
    names = [name for names in shaking(problem.mechanism.dimension).values() for name in names]
    if not wanted or set(names) <= set(problem.mechanism.outputs):
        return problem
    driven = [d.coordinate for name in wanted for d in _sweep(problem, name).all_drivers]
    mechanism = _with_outputs(problem.mechanism, driven)
    changed: dict[str, Task] = dict(problem.tasks)
    for name in wanted:
        sweep = _sweep(problem, name)
        if sweep.derivatives < 2:
            raise InputError(
                "a shaking force needs accelerations",
                where=f"tasks.{name}.derivatives",
                hint="derivatives = 2",
            )
        if sweep.outputs is not None:
            changed[name] = replace(sweep, outputs=(*sweep.outputs, *names))
    return replace(problem, mechanism=mechanism, tasks=Table(changed), pattern=None)


def _sweep(problem: Problem, name: str) -> Any:
    return problem.tasks[name]


def _with_outputs(mechanism: Mechanism, driven: list[str]) -> Mechanism:
    shaken = Shaken(mechanism, driven)
    outputs = dict(mechanism.outputs)
    sums: Terms = {name: [] for names in shaking(mechanism.dimension).values() for name in names}
    for name, body in mechanism.bodies.items():
        if body.mass is None and body.inertia is None:
            continue
        for word, terms in shaken.terms(name).items():
            whole = f"{word}_{name}"
            if len(terms) > 1 and mechanism.dimension == 3:  # texts have a limited length
                parts = {f"{whole}_{k}": text for k, text in enumerate(terms, start=1)}
                outputs |= parts
                terms = [*parts]
            if terms:
                outputs[whole] = " + ".join(terms)
                sums[word].append(whole)
    if not any(sums.values()):
        raise InputError("no body has a mass: nothing shakes the frame", where="bodies")
    outputs |= {word: " + ".join(parts) or "0" for word, parts in sums.items()}
    return replace(
        mechanism,
        bodies=Table(shaken.bodies),
        outputs=Table(outputs),
        parameters=Table(shaken.parameters),
    )

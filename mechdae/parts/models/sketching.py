"""A sketch for lengths that were given: where a mechanism assembles, in the template's mode."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Driver, Modes, Sweep
from mechdae.describe.units import units_of
from mechdae.errors import InputError
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.not_assembled import as_sketch
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.setup.drivers import plan

if TYPE_CHECKING:
    from mechdae.types import Floats, Json

STEPS = 12
"""Values of each driver that are tried on either side of the template's."""
ROUNDS = 3
"""Of golden sections of all drivers, where there are several."""
REFINED = 20
"""Narrowings of the place where lengths that do not close come nearest to it."""
MOST = 64
"""Modes among which that of the template is looked for."""
EDGE = 1e-7
"""Share of a gap on either side of which a bound of a length is tried."""


def sketched_at(data: Json, usual: Problem, units: str) -> Problem:
    """Return the problem of a template's tables, with a sketch at which its numbers assemble.

    Parameters
    ----------
    data
        The tables, with numbers of one's own.
    usual
        The template's own problem: its mode is looked for.
    units
        Those of messages.

    Raises
    ------
    InputError
        It assembles nowhere; the message has the bound of a length.
    """
    problem = from_dict(data, usual.name)
    (wanted, u0), (there, u) = _assembler(usual), _assembler(problem)
    label = wanted.labels.of_pose(wanted.from_sketch(u0).x, u0)
    missed: list[tuple[int, float, Floats]] = []
    for at in _tried(there, u):
        modes = there.modes(at)
        if modes.failure is None:
            listed = modes.first(MOST)
            mode = next((mode for mode in listed if mode.label == label), listed[0])
            return _put(data, usual, as_sketch(there, mode, at), there, at)
        missed.append((*_missed(there, modes.failure), at))
    raise _impossible(problem, there, min(missed, key=lambda miss: miss[:2])[2], units)


def _assembler(problem: Problem) -> tuple[Assembler, Floats]:
    """Return what assembles a problem, and the values of the drivers of its task of modes."""
    task = problem.tasks["modes"]
    assert isinstance(task, Modes)
    numbers = plan(problem.mechanism, task)
    u: Floats = numbers.values[0]
    pairs = zip(numbers.coordinates, u, strict=True)
    held = tuple(Driver(c.text, at=(float(value),), speed=0.0) for c, value in pairs)
    return prepare(problem, Sweep(drivers=held, derivatives=0)).assembler, u


def _tried(assembler: Assembler, u: Floats) -> Iterator[Floats]:
    """Yield values of the drivers from `u` outwards, angles over a turn."""
    every = 1 if len(u) == 1 else 2
    shares = sorted(range(every - STEPS, STEPS + 1, every), key=abs)
    for some in itertools.product(shares, repeat=len(u)):
        yield u + np.array(some) * _steps(assembler, u)


def _steps(assembler: Assembler, u: Floats) -> Floats:
    """Return how far values of the drivers (nd,) that are tried are from each other."""
    pairs = zip(assembler.scene.drivers, u.tolist(), strict=True)
    return np.array([(math.pi if c.is_angle else value) / STEPS for c, value in pairs])


def _missed(assembler: Assembler, failure: NoPose | None) -> tuple[int, float]:
    """Return how many groups do not close, and by how much the first of them."""
    if failure is None:
        return 0, 0.0
    groups = assembler.scene.groups
    return len(groups) - groups.index(failure.group), failure.gap


def _impossible(problem: Problem, assembler: Assembler, u: Floats, units: str) -> InputError:
    """Return the error for lengths that close nowhere; at `u` they come near to it."""
    u = _nearest(assembler, u)
    failure = assembler.modes(u).failure
    assert failure is not None
    length, bounds, mechanism = units_of(units).of("m"), list[str](), problem.mechanism

    def closes(name: str, value: float) -> bool:
        return _assembler(problem.with_values({name: value}))[0].modes(u).failure is None

    for name, si in parameter_units(mechanism, problem.tasks.values()).items():
        for sign, word in ((1, "at least"), (-1, "at most")):
            if si != "m" or isinstance(mechanism.parameters.get(name, ""), str):
                continue
            there = mechanism.parameter_values[name]
            bound, before = (there + sign * failure.gap * share for share in (1 + EDGE, 1 - EDGE))
            if bound > 0 and closes(name, bound) and not closes(name, before):
                bounds.append(f"{name} {word} {bound * length.factor:.6g} {length.name}")
    drivers = " and ".join(c.text for c in assembler.scene.drivers)
    joint = failure.at.joint if failure.at is not None else failure.group.key_joint
    return InputError(
        f"these lengths assemble at no value of {drivers}: joint {joint} stays open",
        hint=", or ".join(bounds) or "other lengths",
    )


def _nearest(assembler: Assembler, u: Floats) -> Floats:
    """Return drivers' values near `u` at which least stays open: golden sections, each in turn."""
    share = (math.sqrt(5) - 1) / 2
    for step in np.geomspace(1.0, 0.1, ROUNDS if len(u) > 1 else 1):
        for k, width in enumerate(step * _steps(assembler, u)):
            along = np.eye(len(u))[k]

            def missed(
                at: float, u: Floats = u, along: Floats = along
            ) -> tuple[tuple[int, float], float]:
                return _missed(assembler, assembler.modes(u + at * along).failure), at

            low, high = -float(width), float(width)
            first, second = missed(high - share * (high - low)), missed(low + share * (high - low))
            for _ in range(REFINED):
                if first < second:
                    high, second = second[1], first
                    first = missed(high - share * (high - low))
                else:
                    low, first = first[1], second
                    second = missed(low + share * (high - low))
            u = u + min(first, second, missed(0.0))[1] * along
    return u


def _put(data: Json, usual: Problem, sketch: Json, assembler: Assembler, u: Floats) -> Problem:
    """Return the problem with a sketch, and with its modes at the driver values of that."""
    changed = from_dict({**data, "sketch": sketch}, usual.name)
    named = zip(assembler.scene.drivers, u.tolist(), strict=True)
    drivers = tuple(Driver(c.text, at=(value,)) for c, value in named)
    return changed.with_task("modes", Modes(drivers=drivers))

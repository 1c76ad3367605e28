"""Classes of results, beside that of sweeps: what only some kinds of tasks have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, ClassVar

from mechdae.records import dataclass
from mechdae.results.result import Result, SweepResult
from mechdae.results.series import Series, Summary
from mechdae.results.shown import RowsOfResult
from mechdae.types import Floats


def _none() -> Series:
    return Series({})


@dataclass(frozen=True, repr=False)
class ModesResult(Result):
    """Assembly modes, one in each row.

    Attributes
    ----------
    labels
        Of each mode, one text for each group.
    """

    labels: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True, repr=False)
class ReactionsResult(SweepResult):
    """Forces along a sweep.

    Attributes
    ----------
    efforts
        Torque or force conjugate to each driver, (n,) by its name; ``parts`` has further ones by
        word: uncoupled, static, inertial.
    unique
        Where constraints are superfluous: unique directions of a joint's reaction, the values
        along them, the frame of the directions.
    solutions
        All solutions of the poses that have several.
    checks
        Relative errors of the checks that come with forces.
    loads
        Force [N] and moment about the body's origin [N m] of each load on each body, (n, 3) in
        world axes, by load and body; weights under ``gravity``. Not in the JSON.
    """

    efforts: Series = field(default_factory=_none)
    parts: Mapping[str, Series] = field(default_factory=dict)
    unique: Summary = field(default_factory=Summary)
    solutions: tuple[dict[str, Any], ...] = ()
    checks: Mapping[str, float] = field(default_factory=dict)
    loads: Mapping[str, Series] = field(default_factory=dict)
    forces: ClassVar[bool] = True


@dataclass(frozen=True, repr=False)
class MotionResult(Result):
    """States of a motion under forces.

    Attributes
    ----------
    efforts
        Of coordinates that follow laws, (n,) by name.
    scalars, work
        Energy, kinetic, potential [J] and drift (the largest gap of a constraint over a length of
        the mechanism), (n,) each; work since t = 0 by load [J].
    unique
        As of `ReactionsResult`.
    checks
        The gap of the energy balance over the energies in motion.
    data
        The linear system, where the task asks for it.
    """

    efforts: Series = field(default_factory=_none)
    scalars: Series = field(default_factory=_none)
    work: Series = field(default_factory=_none)
    unique: Summary = field(default_factory=Summary)
    checks: Mapping[str, float] = field(default_factory=dict)
    data: Mapping[str, Any] = field(default_factory=dict)
    forces: ClassVar[bool] = True


@dataclass(frozen=True, repr=False)
class EquilibriumResult(Result):
    """A pose at rest.

    Attributes
    ----------
    unique, data
        As of `MotionResult`.
    """

    unique: Summary = field(default_factory=Summary)
    data: Mapping[str, Any] = field(default_factory=dict)
    forces: ClassVar[bool] = True


@dataclass(frozen=True, repr=False)
class StudyResult(Result):
    """Sets of parameters, one in each row.

    Attributes
    ----------
    parameters, table
        Name -> (n,), path -> (n, ...).
    """

    parameters: Mapping[str, Floats] = field(default_factory=dict)
    table: Mapping[str, Floats] = RowsOfResult()  # type: ignore[assignment]


@dataclass(frozen=True, repr=False)
class SensitivityResult(Result):
    """Derivatives by parameters.

    Attributes
    ----------
    data
        Values, derivatives and what tolerances do, by path and name.
    """

    data: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class SynthesisResult(Result):
    """Designs, one in each row.

    Attributes
    ----------
    data
        The designs, best first.
    motions
        How designs move, by the text of their problems; not in the JSON.
    """

    data: Mapping[str, Any] = field(default_factory=dict)
    motions: Mapping[str, Any] = field(default_factory=dict)

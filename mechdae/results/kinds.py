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

    Examples
    --------
    >>> result = md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), "modes")
    >>> result.labels
    (('+',), ('-',))
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
        Where constraints are redundant: unique directions of a joint's reaction, the values
        along them, the frame of the directions.
    solutions
        All solutions of the poses that have several.
    checks
        Relative errors of the checks that come with forces.
    loads
        Force [N] and moment about the body's origin [N m] of each load on each body, (n, 3) in
        world axes, by load and body; weights under ``gravity``. Not in the JSON.

    Examples
    --------
    >>> result = md.solve("slider-crank-friction", "cycle", poses=5)
    >>> result.efforts["crank.angle"].shape, result.joints["B"].reaction.shape
    ((5,), (5, 3))
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

    Examples
    --------
    >>> task = md.Motion(start={"rod.angle": -1.5}, until=1.0, poses=3)
    >>> result = md.solve(md.load("pendulum"), task)
    >>> result.time.tolist(), result.scalars["kinetic"].round(4).tolist()
    ([0.0, 0.5, 1.0], [0.0, 0.0246, 0.0])
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

    Examples
    --------
    >>> task = md.Equilibrium(free=["rod.angle"], start={"rod.angle": -1.5}, linearise=True)
    >>> result = md.solve(md.load("pendulum"), task)
    >>> [round(f, 4) for f in result.value("summary/frequencies")]
    [0.4985]
    """

    unique: Summary = field(default_factory=Summary)
    data: Mapping[str, Any] = field(default_factory=dict)
    forces: ClassVar[bool] = True


@dataclass(frozen=True, repr=False)
class StudyResult(Result):
    """Sets of parameters, one in each row.

    Attributes
    ----------
    parameters
        Name -> (n,), the sets.
    table
        Path -> (n, ...), the outputs of each set.

    Examples
    --------
    >>> sets, outputs = {"crank": [0.03, 0.04]}, ["summary/swing/rocker"]
    >>> found = md.study(md.four_bar(0.1, 0.04, 0.12, 0.08), sets=sets, of="turn", outputs=outputs)
    >>> found.table["summary/swing/rocker"].shape
    (2,)
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

    Examples
    --------
    >>> task = md.Sensitivity(of="turn", outputs=["summary/swing/rocker"], wrt=["crank"])
    >>> result = md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), task)
    >>> round(result.value("derivatives")["summary/swing/rocker"]["crank"], 2)
    37.26
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

    Examples
    --------
    >>> goal = {"kind": "rocker", "body": "rocker", "swing": 0.8}
    >>> turned = {"coordinate": "crank.angle"}
    >>> task = md.Synthesis(turned, goal, free={"crank": [0.02, 0.035]}, starts=2)
    >>> found = md.synthesize(md.four_bar(0.1, 0.03, 0.12, 0.08), task)
    >>> len(found), len(found.data["designs"])
    (1, 1)
    """

    data: Mapping[str, Any] = field(default_factory=dict)
    motions: Mapping[str, Any] = field(default_factory=dict)

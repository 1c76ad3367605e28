"""A design swept over its whole input with the certified kinematics, before it is reported."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdae.analysis.sweep import sweep
from mechdae.describe.problem import Problem
from mechdae.describe.table import Table
from mechdae.describe.tasks import Driver, Sweep
from mechdae.errors import MechdaeError

POSES = 721
"""Poses of a sweep over a turn."""
AGREES = 1e-7
"""Share of the targets' size by which the sweep may differ from the poses of the NLP."""


@dataclass(frozen=True)
class Verified:
    """What a sweep says about a design.

    ``defects`` are sentences, none for a sound design; ``errors`` (k,) distances from the
    targets; ``transmission`` the least transmission angle over the sweep [rad].
    """

    defects: list[str]
    errors: Any
    transmission: float | None
    points: Any


def design_problem(
    problem: Problem, values: dict[str, float], sketch: dict[str, float], driver: str, task: Sweep
) -> Problem:
    """Return the problem with the dimensions of a design, sketched at its first target."""
    mechanism = problem.mechanism.with_values(values)
    mechanism = replace(mechanism, sketch=Table(sketch))
    return Problem(
        mechanism, Table({"path": task}), name=problem.name, title=problem.title,
        source=problem.source,
    )  # fmt: skip


def verified(
    problem: Problem,
    values: dict[str, float],
    sketch: dict[str, float],
    driver: str,
    at: Any,
    point: str,
    targets: Any,
    full_turn: bool,
    size: float,
) -> Verified:
    """Return the errors and defects of a design.

    The mechanism is assembled at its first target and moved along the driver to all others,
    and over a whole turn where one is asked for: what is not reached on one circuit and one
    branch is a defect.
    """
    at = np.asarray(at, float)
    named = Sweep(Driver(driver, at=tuple(at)), outputs=(point,), derivatives=0)
    defects: list[str] = []
    try:
        found = sweep(design_problem(problem, values, sketch, driver, named), "path", named)
    except MechdaeError as error:
        return Verified([f"does not assemble: {error.what}"], np.full(len(at), np.nan), None, None)
    places = found.points[point].position
    errors = np.hypot(*(places - targets).T)
    bad = [str(word) for word in found.status if word not in ("ok", "limit")]
    if bad:
        defects.append(f"{len(bad)} of {len(at)} targets are not reached on one branch")
    transmission = None
    if full_turn:
        turn = Sweep(
            Driver(driver, from_=float(at[0]), to=float(at[0] + 2 * np.pi)),
            poses=POSES, outputs=None, derivatives=1, measures=("transmission",),
        )  # fmt: skip
        try:
            whole = sweep(design_problem(problem, values, sketch, driver, turn), "path", turn)
        except MechdaeError as error:
            return Verified([*defects, f"does not turn: {error.what}"], errors, None, places)
        lost = int(np.sum((whole.status != "ok") & (whole.status != "limit")))
        if lost or whole.summary.get("limits"):
            defects.append("the input does not turn fully")
        angles = [e["min"] for e in whole.summary.get("transmission", {}).values()]
        transmission = float(min(angles)) if angles else None
    return Verified(defects, errors, transmission, places)

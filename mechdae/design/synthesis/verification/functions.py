"""An output coordinate against the values that are wanted of it, in the sense asked for."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.expression import evaluate
from mechdae.describe.tasks.goals import FunctionTargets
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.design.synthesis.robust.values import of_largest, of_squares
from mechdae.design.synthesis.verification.claims import Claim, Stated, Worth
from mechdae.design.synthesis.verification.design_file import TURN, DesignFile
from mechdae.results import Result
from mechdae.types import Floats

FINE = 721
"""Places at which a formula is compared."""
EXACT = 1e-9
"""Error of an exact target, by the spread of the outputs."""


def measured(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return the errors of the output, and their measure."""
    asked = stated.asked
    assert isinstance(asked, FunctionTargets)
    minimax, even = asked.measure == "minimax", np.linspace(0, 1, FINE)
    shares = even if asked.targets else np.unique([*even, *claim.between])
    inputs, outputs = _wanted(asked, shares)
    begin = _start(asked.input_start, claim.input_start, design)
    end = _start(asked.output_start, claim.output_start, design)
    sense = claim.sense if asked.sense == "free" else 1.0
    found, defects = design.swept(begin + inputs, (asked.output,))
    if found is None:
        return Worth(np.inf, np.full(len(inputs), np.nan), defects)
    c = coordinate(design.problem.mechanism, asked.output)
    errors = _series(found, c) - end - sense * outputs
    if c.is_angle and np.isfinite(errors).any():
        errors = errors - TURN * np.round(np.nanmedian(errors) / TURN)
    size = np.abs(errors)
    value, parts = float(size.max()) if minimax else float(np.mean(errors**2)), None
    if asked.measure == "exact":
        value = float(size.max())
        if not value <= EXACT * (float(np.ptp(outputs)) or 1.0):
            defects = [*defects, f"a target is missed by {value:.3g}"]
    elif stated.robust is not None:
        value, parts = _robust(stated, begin + inputs, design, errors)
    if not asked.targets:
        errors = errors[np.isin(shares, even)]
    return Worth(value, errors, defects, parts)


def _wanted(asked: FunctionTargets, shares: Floats) -> tuple[Floats, Floats]:
    """Return inputs and outputs from their starts: of the targets, or at shares of the range."""
    if asked.targets:
        x, y = np.array(asked.targets, float).T
        return x - x[0], y - y[0]
    low, high = asked.range
    first, last = (evaluate(str(asked.function), {"x": x}) for x in (low, high))
    xs = [low + (high - low) * share for share in shares.tolist()]
    ys = [evaluate(str(asked.function), {"x": x}) for x in xs]
    inputs = [asked.input_range * (x - low) / (high - low) for x in xs]
    return np.array(inputs), np.array(
        [asked.output_range * (y - first) / (last - first) for y in ys]
    )


def _start(asked: Any, claimed: float, design: DesignFile) -> float:
    """Return where a scale starts: a number, a parameter of the file, or what is claimed."""
    if asked is None:
        return claimed
    return float(design.numbers[asked]) if isinstance(asked, str) else float(asked)


def _robust(
    stated: Stated, at: Any, design: DesignFile, errors: Any
) -> tuple[float, dict[str, float]]:
    """Return the robust value, by the derivatives of a task of sensitivity."""
    asked, robust = stated.asked, stated.robust
    assert isinstance(asked, FunctionTargets)
    assert robust is not None
    path, columns = _path(coordinate(design.problem.mechanism, asked.output))
    task = Sweep(Driver(design.driver, at=tuple(float(u) for u in at)))
    _, slopes = design.slopes(task, (path,), robust.names)[path]
    slopes = slopes[:, columns] * robust.sigmas
    if asked.measure == "minimax":
        return of_largest(np.abs(errors), slopes, robust.factor)
    weights = np.full(len(errors), 1.0 / len(errors))
    return of_squares(errors[:, None], slopes, weights, robust.factor)


def _path(c: NamedCoordinate) -> tuple[str, slice]:
    """Return the path of a coordinate in results, and its place among the values there."""
    if c.kind == "body angle":
        return f"bodies/{c.part}/angle", slice(0, 1)
    if c.kind == "point":
        return f"points/{c.part}.{c.point}/position", slice(c.axis, c.axis + 1)
    return f"joints/{c.part}/{c.text.rpartition('.')[2]}", slice(0, 1)


def _series(found: Result, c: NamedCoordinate) -> Floats:
    path, columns = _path(c)
    values = np.asarray(found.value(path), float)
    return values[:, columns][:, 0] if c.kind == "point" else values

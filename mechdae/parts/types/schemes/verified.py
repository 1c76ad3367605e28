"""The error of a design measured again on its file, with no code of its search.

Both are resampled at equal arc length, centred, and divided by the wanted one's radius; of all
shifts in both senses, each with its best rotation, the least mean distance counts, times 2 pi.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.describe.file.load import from_dict
from mechdae.describe.tasks.goals import FunctionTargets
from mechdae.design.synthesis.verification.claims import Claim, Stated, disagreement
from mechdae.design.synthesis.verification.design_file import POSES, TURN, DesignFile
from mechdae.design.synthesis.verification.verify import measured
from mechdae.parts.types.described.composition import CompositionDemand
from mechdae.parts.types.described.scheme_goals import INPUT
from mechdae.types import Complexes, Floats

POINTS = 200


def shape_distance(curve: Complexes, wanted: Complexes) -> float:
    """Return how far a closed curve (t,) is from another one (k,) in shape and size."""
    traced, target = (_resampled(np.asarray(each, complex)) for each in (curve, wanted))
    traced, target = traced - traced.mean(), target - target.mean()
    radius = np.sqrt(np.mean(np.abs(target) ** 2))
    least = np.inf
    for way in (target, target[::-1]):
        for shift in range(POINTS):
            shifted = np.roll(way, shift)
            turn = np.vdot(traced, shifted)
            gaps = np.abs(traced * turn / max(abs(turn), 1e-300) - shifted)
            least = min(least, float(gaps.mean()))
    return TURN * least / float(radius)


def _resampled(corners: Complexes) -> Any:
    """Return points of a closed polyline at equal arc length, from its first corner on."""
    closed = np.append(corners, corners[0])
    length = np.append(0.0, np.cumsum(np.abs(np.diff(closed))))
    at = length[-1] * np.arange(POINTS) / POINTS
    return np.interp(at, length, closed)


def verified(
    text: str, demand: CompositionDemand, error: float, coordinate: str, at: Floats, unit: float
) -> list[str]:
    """Return what is wrong with an error that is claimed of a design."""
    design = DesignFile(from_dict(tomllib.loads(text)), INPUT, at)
    if demand.visits is None and demand.function is None:
        turn = float(at[0]) + TURN * np.arange(POSES - 1) / (POSES - 1)
        found, defects = design.swept(turn, (coordinate,))
        if found is None or defects:
            return defects
        place = found.points[coordinate].position
        curve, wanted = place @ [1, 1j], np.array(demand.corners) @ [1, 1j]
        traced = shape_distance(curve, wanted)
        # of shifts that are alike the search looks at some
        text = disagreement(traced, error, unit, False)
        return [text] if text and traced > error else []
    if demand.visits is not None:
        goal: Any = replace(demand.visits, what=coordinate)
        weights, minimax = np.array(goal.weights), goal.measure == "minimax"
    else:
        goal = _function(demand, coordinate)
        minimax = demand.function is not None and demand.function.minimax
        weights = np.ones(len(goal.targets))
    part = measured(Stated(goal), Claim(at), design)
    if part.defects:
        return part.defects
    size = np.abs(part.errors)
    traced = float(size.max()) if minimax else float(np.sqrt(weights @ size**2 / weights.sum()))
    gap = disagreement(traced, error, unit, False)
    return [gap] if gap else []


def _function(demand: CompositionDemand, output: str) -> FunctionTargets:
    """Return a function as pairs of values of both coordinates."""
    wanted = demand.function
    assert wanted is not None
    first, start = wanted.input_start or 0.0, wanted.output_start or 0.0
    rows = tuple((first + x, start + y) for x, y in zip(wanted.inputs, wanted.outputs, strict=True))
    return FunctionTargets(output=output, targets=rows, input_start=first, output_start=start)

"""Refined extremes of angles and slides along a path: swing and stroke."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.evaluate import Evaluator, Poses
from mechdae.analysis.outputs import Entry, Outputs
from mechdae.analysis.path import Path

ITERATIONS = 6


def ranges(
    evaluator: Evaluator,
    outputs: Outputs,
    path: Path,
    poses: Poses,
    low: float,
    high: float,
    between: Any = (),
) -> dict[str, dict[str, float]]:
    """Return ``swing`` [rad] by body and ``stroke`` [m] by joint over [low, high].

    A stationary value is bracketed between nodes of the path by the sign of its first
    derivative and refined by Newton's method on it, so that it does not depend on the grid.
    `between` are further places to look at, for a path that needs no nodes.
    """
    entries = [
        entry
        for entry in outputs.entries
        if (entry.kind == "bodies" and entry.name == "angle") or entry.name == "slide"
    ]
    result: dict[str, dict[str, float]] = {"swing": {}, "stroke": {}}
    if not entries or len(poses.y) < 3:
        return result
    nodes = np.array([*path.s, *between])
    inner = nodes[(nodes > low) & (nodes < high)]
    ends = [e.s for r in path.reach.values() for e in (r.low, r.high) if e is not None]
    ends = [s for s in ends if low <= s <= high]
    places = sorted({*inner.tolist(), low, high, *ends})  # np.unique would import numpy.ma
    at_nodes = evaluator.at(path, np.array(places))
    for entry in entries:
        values = [poses.y[0][:, entry.columns[0]], at_nodes.y[0][:, entry.columns[0]]]
        values.append(_stationary(evaluator, path, at_nodes, entry))
        every = np.concatenate(values)
        every = every[np.isfinite(every)]
        if every.size:
            word = "stroke" if entry.name == "slide" else "swing"
            result[word][entry.part] = float(every.max() - every.min())
    return result


def _stationary(evaluator: Evaluator, path: Path, nodes: Poses, entry: Entry) -> Any:
    """Return the values where the quantity is stationary."""
    column = entry.columns[0]
    rate = nodes.y[1][:, column]
    with np.errstate(invalid="ignore"):
        bracket = np.flatnonzero(rate[:-1] * rate[1:] < 0)
    if not bracket.size:
        return np.zeros(0)
    a, b = nodes.s[bracket], nodes.s[bracket + 1]
    fa, fb = rate[bracket], rate[bracket + 1]
    s = a - fa * (b - a) / (fb - fa)
    for _ in range(ITERATIONS):
        here = evaluator.at(path, s)
        slope, bend = here.y[1][:, column], here.y[2][:, column]
        with np.errstate(invalid="ignore", divide="ignore"):
            step = np.where(bend != 0, slope / bend, 0.0)
        s = np.clip(s - np.nan_to_num(step), a, b)
        if np.all(np.abs(step) < 1e-9 * (b - a)):
            break
    return evaluator.at(path, s).y[0][:, column]

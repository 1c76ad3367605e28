"""True extremes of a quantity over a task: certified solves close in on what its poses bracket.

The poses of a task are samples; the largest of them is not the largest value. Around the best
samples the task is solved again at closer and closer values of its driver.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.describe.tasks.goals import Extreme as Asked
from mechdae.describe.tasks.kinds import Driver, Reactions, Sweep
from mechdae.describe.tasks.shaking import WORDS, shaking_paths
from mechdae.errors import MechdaeError
from mechdae.results import FINE, Result
from mechdae.synthesis.verify import Design

TOPS, ZOOM, ROUNDS = 3, 17, 3
"""Brackets that are closed in, places in each, how often it is narrowed."""


def values_of(found: Result, path: str) -> Any:
    """Return a quantity over the poses of a solved task (n,); of vectors the length."""
    if path in WORDS:
        paths = shaking_paths(path, found.mechanism.dimension)
        parts = [np.asarray(found.value(own), float) for own in paths]
        return parts[0] if len(parts) == 1 else np.linalg.norm(parts, axis=0)
    series = np.atleast_1d(np.asarray(found.value(path), float))
    if series.ndim == 1:
        return series
    # of a reaction the force, without its moment
    return np.linalg.norm(series[:, : found.mechanism.dimension], axis=1)


def largest(design: Design, found: Result, asked: Asked, curve: Callable[[Any], Any]) -> float:
    """Return the largest value of `curve` (of the quantity's values) over a task's range.

    Parameters
    ----------
    found
        The task, solved with the design.
    """
    values = np.asarray(curve(values_of(found, asked.path)), float)
    best = float(np.nanmax(values))
    task = design.others[asked.task]
    assert isinstance(task, Sweep)
    driver = task.all_drivers[0]
    if len(values) < 3 or driver.at is not None or driver.law is not None:
        return best
    u = np.asarray(found.drivers[driver.coordinate].position, float)
    tops = np.flatnonzero(
        (values >= np.append(-np.inf, values[:-1])) & (values >= np.append(values[1:], -np.inf))
    )
    tops = tops[np.argsort(-values[tops], kind="stable")][:TOPS]
    ends = np.stack([u[np.maximum(tops - 1, 0)], u[np.minimum(tops + 1, len(u) - 1)]], axis=1)
    for _ in range(ROUNDS):
        at = np.linspace(ends[:, 0], ends[:, 1], ZOOM, axis=1)
        closer = _at(design, task, asked, at.ravel())
        if closer is None:
            return best
        shown = np.asarray(curve(closer), float).reshape(at.shape)
        k = np.nanargmax(shown, axis=1)
        rows = np.arange(len(at))
        best = max(best, float(np.nanmax(shown)))
        ends = np.stack(
            [at[rows, np.maximum(k - 1, 0)], at[rows, np.minimum(k + 1, ZOOM - 1)]], axis=1
        )
    return best


def _at(design: Design, task: Sweep, asked: Asked, places: Any) -> Any:
    """Return the quantity at places of the driver, None where a pose is not certified there."""
    order = np.argsort(places, kind="stable")
    own, back = np.unique(places[order], return_inverse=True)
    driver = task.all_drivers[0]
    driver = Driver(
        driver.coordinate, at=tuple(own.tolist()), speed=driver.speed,
        acceleration=driver.acceleration, jerk=driver.jerk,
    )  # fmt: skip
    near = replace(task, driver=driver, drivers=None, poses=None, measures=None)
    if isinstance(near, Reactions):
        near = replace(near, cycle=False)
    try:
        found = design.solved_as(near)
    except MechdaeError:
        return None
    if any(str(word) not in FINE for word in found.status):
        return None
    values = np.empty(len(places))
    values[order] = values_of(found, asked.path)[back]
    return values

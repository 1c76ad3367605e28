"""Quantities of other tasks, solved again with a design: means, true extremes, single numbers.

The poses of a task are samples; the largest of them is not the largest value. Around the best
samples the task is solved again at closer and closer values of its driver.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.describe.tasks.goals import Extreme as Asked
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.describe.tasks.motion import Equilibrium, Motion, Reactions
from mechdae.describe.tasks.shaking import WORDS, shaking_paths
from mechdae.design.derivatives.figures import is_figure
from mechdae.design.derivatives.figures import value as figure
from mechdae.design.synthesis.quantity import MEANS, TRANSMISSION
from mechdae.design.synthesis.robust.deviations import Deviations
from mechdae.design.synthesis.robust.values import of_largest
from mechdae.design.synthesis.verification.claims import Claim, Stated, Worth
from mechdae.design.synthesis.verification.design_file import POSES, DesignFile
from mechdae.errors import InputError, MechdaeError
from mechdae.results import FINE, Result
from mechdae.types import Floats

NEAR = 2e-3
"""Share by which a limit may be missed between its nodes."""
SAME = 1e-6
"""Share by which a number of a motion or an equilibrium may miss a limit."""
TOPS, ZOOM, ROUNDS = 3, 17, 3
"""Brackets that are closed in, places in each, how often it is narrowed."""


def of_quantity(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return the reduced quantity of another task, and where it misses its limits."""
    goal = stated.asked
    assert isinstance(goal, Asked)
    if isinstance(design.tasks[goal.task], Motion | Equilibrium):
        return _number(stated, goal, claim, design)
    try:
        found = design.solved(goal.task)
    except MechdaeError as error:
        return Worth(np.inf, np.zeros(0), [f"task {goal.task}: {error.what}"])
    defects = []
    bad = [str(word) for word in found.status if str(word) not in FINE]
    if bad:
        defects.append(f"task {goal.task}: {len(bad)} poses are {bad[0]}")
    if not bad and (lost := np.count_nonzero(np.isnan(values_of(found, goal.path)))):
        defects.append(f"{goal.path} has no value at {lost} poses of task {goal.task}")
        return Worth(np.inf, np.zeros(0), defects)
    if stated.robust is not None:
        try:
            value, parts = of_task(design, goal, stated.robust)
        except MechdaeError as error:
            return Worth(np.inf, np.zeros(0), [f"task {goal.task}: {error.what}"])
        return Worth(value, np.zeros(0), defects, parts)
    if stated.bounds is None:
        return Worth(_reached(design, found, goal), np.zeros(0), defects)
    low, high = stated.bounds
    series = values_of(found, goal.path)
    slack = NEAR * max(float(np.max(np.abs(series))), stated.unit)
    reached = (
        [quantity_of(found, goal)] * 2
        if goal.reduce in ("mean", "rms")
        else _ends(design, found, goal)
    )
    for value in dict.fromkeys(reached):
        if not low - slack <= value <= high + slack:
            defects.append(f"{goal.path} is {value:.6g}, the limit is missed")
    return Worth(float(np.max(series)), np.zeros(0), defects)


def _number(stated: Stated, asked: Asked, claim: Claim, design: DesignFile) -> Worth:
    """Return a number of a motion or an equilibrium, which is that from the asked sketch too."""
    path = asked.path
    try:
        solved = design.solved(asked.task, (path,))
        found = np.asarray(figure(solved, path if is_figure(path) else solved.whole_path(path)))
    except MechdaeError as error:
        return Worth(np.inf, np.zeros(0), [f"task {asked.task}: {error.what}"])
    value, defects = float(found.ravel()[0]), []
    if not abs(value - claim.value) <= SAME * max(abs(claim.value), stated.unit):
        defects.append(
            f"{path} is {value:.6g} from the pose of the design, {claim.value:.6g} from "
            "the sketch of the file"
        )
    if stated.bounds is not None:
        low, high = stated.bounds
        slack = SAME * max(abs(value), stated.unit)
        if not low - slack <= value <= high + slack:
            defects.append(f"{path} is {value:.6g}, the limit is missed")
    return Worth(value, np.zeros(0), defects)


def _reached(design: DesignFile, found: Result, asked: Asked) -> float:
    """Return the reduced quantity, extremes refined."""
    if asked.path in MEANS or asked.reduce in ("mean", "rms"):
        return quantity_of(found, asked)
    if asked.reduce == "least":
        return _ends(design, found, asked)[0]
    return largest(design, found, asked, np.abs)


def _ends(design: DesignFile, found: Result, asked: Asked) -> tuple[float, float]:
    """Return the least and the largest value over the task, refined."""
    if asked.path in MEANS:
        value = quantity_of(found, asked)
        return value, value
    if asked.path.endswith(f"/{TRANSMISSION}"):
        facts = found.summary["transmission"][asked.path.split("/")[1]]
        return float(facts["min"]), float(facts["max"])
    low = -largest(design, found, asked, np.negative)
    return low, largest(design, found, asked, np.positive)


def quantity_of(found: Result, asked: Asked) -> float:
    """Return the reduced quantity of a solved task."""
    series = values_of(found, asked.path)
    if len(series) == 1:
        return float(series[0])
    if asked.reduce in ("mean", "rms") and len(series) > 2:
        weights = np.ones(len(series))
        weights[[0, -1]] = 0.5
        powered = series**2 if asked.reduce == "rms" else series
        mean = float(weights @ powered / weights.sum())
        return float(np.sqrt(mean)) if asked.reduce == "rms" else mean
    return reduced(series, asked.reduce)


def reduced(series: Floats, word: str) -> float:
    """Return mean, rms, largest magnitude or least value."""
    if word == "mean":
        return float(np.mean(series))
    if word == "rms":
        return float(np.sqrt(np.mean(series**2)))
    return float(np.max(np.abs(series))) if word == "peak" else float(np.min(series))


def values_of(found: Result, path: str) -> Any:
    """Return a quantity over the poses of a solved task (n,); of vectors the length."""
    if path in WORDS:
        paths = shaking_paths(path, found.mechanism.dimension)
        parts = [np.asarray(found.value(key), float) for key in paths]
        return parts[0] if len(parts) == 1 else np.linalg.norm(parts, axis=0)
    series = np.atleast_1d(np.asarray(found.value(path), float))
    if series.ndim == 1:
        return series
    # of a reaction the force, without its moment
    return np.linalg.norm(series[:, : found.mechanism.dimension], axis=1)


def largest(design: DesignFile, found: Result, asked: Asked, curve: Callable[[Any], Any]) -> float:
    """Return the largest value of `curve` (of the quantity's values) over a task's range."""
    values = np.asarray(curve(values_of(found, asked.path)), float)
    best = float(np.nanmax(values))
    task = design.tasks[asked.task]
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


def _at(design: DesignFile, task: Sweep, asked: Asked, places: Floats) -> Any:
    """Return the quantity at places of the driver, None where a pose is not certified there."""
    order = np.argsort(places, kind="stable")
    parts_of, back = np.unique(places[order], return_inverse=True)
    driver = task.all_drivers[0]
    driver = Driver(
        driver.coordinate, at=tuple(parts_of.tolist()), speed=driver.speed,
        acceleration=driver.acceleration, jerk=driver.jerk, direction=driver.direction,
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


def of_task(
    design: DesignFile, asked: Asked, deviations: Deviations
) -> tuple[float, dict[str, Any]]:
    """Return the robust value of a quantity by the derivatives of the task itself."""
    names, factor, sigmas = deviations.names, deviations.factor, deviations.sigmas
    paths = shaking_paths(asked.path, design.problem.mechanism.dimension)
    task = design.tasks[asked.task]
    assert isinstance(task, Sweep)
    found = design.slopes(asked.task if asked.path in MEANS else fine(task), paths, names)
    value = np.concatenate([found[path][0] for path in paths], axis=1)
    slopes = np.concatenate([found[path][1] for path in paths], axis=1) * sigmas
    if not np.isfinite(slopes).all():
        raise InputError(f"{asked.path} has no derivative by {', '.join(names)} at all poses")
    width = min(value.shape[1], design.problem.mechanism.dimension)
    value, slopes = value[:, :width], slopes[:, :width]
    sense = -asked.sense * factor
    if asked.path in MEANS or asked.reduce in ("mean", "rms"):
        weights = np.ones(len(value))
        if len(value) > 2:
            weights[[0, -1]] = 0.5
        weights /= weights.sum()
        nominal, sigma = _averaged(asked, value, slopes, weights)
        total = nominal - sense * sigma
        return total, {"nominal": nominal, "sigma": sigma, "value": total}
    if asked.reduce == "peak":
        sizes, along = _sizes(value, slopes)
        return of_largest(sizes, along[:, None], factor)
    total, parts = of_largest(-value[:, 0], slopes, factor)
    return -total, {"nominal": -parts["nominal"], "sigma": parts["sigma"], "value": -total}


def fine(task: Sweep) -> Sweep:
    """Return a task with enough poses for extremes."""
    if any(driver.at is not None or driver.times is not None for driver in task.all_drivers):
        return task
    return replace(task, poses=max(task.poses or 0, POSES))


def _sizes(value: Any, slopes: Any) -> tuple[Any, Any]:
    """Return lengths (n,) of vectors and their deviations (n, nt)."""
    sizes = np.linalg.norm(value, axis=1)
    unit = value / np.maximum(sizes, 1e-300)[:, None]
    return sizes, np.einsum("nw,nwt->nt", unit, slopes)


def _averaged(asked: Asked, value: Any, slopes: Any, weights: Any) -> tuple[float, float]:
    """Return a mean or root mean square over poses and its standard deviation."""
    if asked.path not in MEANS and asked.reduce == "rms":
        nominal = float(np.sqrt(weights @ np.sum(value**2, axis=1)))
        along = np.einsum("n,nw,nwt->t", weights, value, slopes) / nominal
    else:
        if value.shape[1] > 1:
            value, slopes = (part[:, None] for part in _sizes(value, slopes))
        nominal = float(weights @ value[:, 0])
        along = weights @ slopes[:, 0]
    return nominal, float(np.linalg.norm(along))

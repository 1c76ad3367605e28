"""The task of a result once more, with poses between its own: what curves are drawn of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.describe.tasks.motion import Motion
from mechdae.errors import SolveError
from mechdae.results import Result
from mechdae.tasks.dispatch.solve import solve


def finer(result: Result, parts: int) -> Result:
    """Return the same task with `parts` steps from each pose of a result to the next."""
    task = result.definition
    if not isinstance(task, Sweep | Motion) or len(result) < 2:
        raise SolveError("there is nothing between the poses of this result")
    if isinstance(task, Motion):
        times = _between(result.time, parts)
        # a motion that ends early is as long as it is
        task = replace(task, at=times, poses=None)
    else:
        task = _finer_sweep(result, task, parts)
    return solve(result.as_problem().with_task(result.task, task), result.task)


def _finer_sweep(result: Result, task: Sweep, parts: int) -> Sweep:
    """Return a sweep through more poses; of what is located along it only what has series."""
    drivers = tuple(_finer_driver(result, driver, parts) for driver in task.all_drivers)
    listed = any(len(driver.at or ()) > 1 or driver.times is not None for driver in drivers)
    measures = tuple(word for word in task.measures or () if word != "extremes") or None
    return replace(
        task, driver=None, drivers=drivers, measures=measures,
        poses=None if listed else (len(result) - 1) * parts + 1,
    )  # fmt: skip


def _finer_driver(result: Result, driver: Driver, parts: int) -> Driver:
    if driver.times is not None:
        return replace(driver, times=_between(result.time, parts))
    if driver.at is None or len(driver.at) < 2:
        return driver
    return replace(driver, at=_between(result.drivers[driver.coordinate].position, parts))


def _between(values: object, parts: int) -> tuple[float, ...]:
    known = np.asarray(values, dtype=float)
    places = np.linspace(0.0, len(known) - 1.0, (len(known) - 1) * parts + 1)
    return tuple(np.interp(places, np.arange(len(known)), known).tolist())

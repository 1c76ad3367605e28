"""The measures that a task lists, computed where it lists any (`along_sweep`)."""

from __future__ import annotations

from mechdae.describe.tasks.kinds import Sweep
from mechdae.equations.reduction import Scene
from mechdae.motion.continuation.evaluate import Evaluator, Poses
from mechdae.motion.continuation.path import Path
from mechdae.motion.measures.measured import OF_POSES, Measured
from mechdae.motion.setup.outputs import Outputs, Request
from mechdae.types import Floats

ORDERS = {
    "transmission": 2,
    "extremes": 2,
    "time-ratio": 2,
    "dwell": 2,
    "envelope": 2,
    "curve": 3,
    "centrodes": 2,
    "instant-centres": 1,
    "axodes": 1,
    "screw-axes": 1,
    "velocity-ratio": 1,
    "mechanical-advantage": 1,
}
"""Rates that each measure needs."""


def order_of(task: Sweep) -> int:
    """Return the highest order of rates that the task's measures need."""
    return max((ORDERS[name] for name in task.measures or ()), default=0)


def requests(scene: Scene, task: Sweep, by_value: bool) -> list[Request]:
    """Return what is evaluated for the measures beside what is reported.

    `by_value` tells that one driver moves and no law moves it.

    Raises
    ------
    UnavailableError
        A measure along the path without such a driver.
    """
    if not task.measures:
        return []
    from mechdae.motion.measures import along_sweep

    return along_sweep.requests(scene, task, by_value)


def at_poses(
    outputs: Outputs, task: Sweep, poses: Poses, unit: float = 1.0, moving: int = 0
) -> Measured:
    """Return the measures of single poses; `unit` is what a radian is for other drivers."""
    found = Measured()
    if task.measures:
        from mechdae.motion.measures import along_sweep

        along_sweep.at_poses(outputs, task.measures, poses, unit, moving, found)
    return found


def along_path(
    outputs: Outputs,
    task: Sweep,
    evaluator: Evaluator,
    path: Path,
    values: Floats,
    found: Measured,
    moving: int,
) -> None:
    """Add the measures of the whole sweep of the driver that moves to `found`."""
    if not set(task.measures or ()) - OF_POSES:
        return
    from mechdae.motion.measures import along_sweep

    along_sweep.along_path(outputs, task, evaluator, path, values, found, moving)

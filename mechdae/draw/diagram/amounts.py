"""Values of coordinates and of loads in the poses of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.loads import Force, Load, Resistance, Spring, TableLoad, Torque
from mechdae.describe.named import TIME
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.errors import MechdaeError

if TYPE_CHECKING:
    from mechdae.results import SweepResult


STILL = 1e-9
"""A coordinate that changes less than this share of its range in a step stands still."""


def sense(scene: PlacedScene, result: SweepResult, entry: NamedCoordinate, pose: int) -> float:
    """Return +1 or -1 as the coordinate grows or falls at a pose, 0 where that is not known.

    The change from pose to pose is turned into one with time by that of the driver.
    """
    drivers = list((getattr(result, "drivers", None) or {}).values())
    values = scene.series(entry)
    if len(values) < 2 or len(drivers) != 1:
        return 0.0
    low, high = max(pose - 1, 0), min(pose + 1, len(values) - 1)
    driver = np.asarray(drivers[0].position, dtype=float)
    speed = getattr(drivers[0], "velocity", None)
    forth = float(np.atleast_1d(speed)[min(pose, np.size(speed) - 1)]) if speed is not None else 1.0
    step = float(values[high] - values[low])
    span = float(np.ptp(values[np.isfinite(values)])) if np.isfinite(values).any() else 0.0
    if not np.isfinite(step) or abs(step) <= STILL * span:
        return 0.0
    way = step if result_in_time(result) else step * float(driver[high] - driver[low]) * forth
    return float(np.sign(way))


def pushing(scene: PlacedScene, result: SweepResult, load: Resistance, pose: int) -> float:
    """Return the sense in which a resistance acts: against the motion, along it where loads drive.

    0 where the sense of the motion is not known.
    """
    way = sense(scene, result, coordinate(scene.mechanism, load.coordinate), pose)
    return way if getattr(result.definition, "direction", "") == "load" else -way


def result_in_time(result: SweepResult) -> bool:
    """Return whether the poses follow each other in time."""
    return getattr(result, "time", None) is not None


def load_values(
    scene: PlacedScene, result: SweepResult, load: Load, pose: int
) -> tuple[float, ...] | None:
    """Return the values of a load in one pose, None where the description does not give them.

    A force has two, in space three, in the axes of its frame, and so has a torque in space; a
    resistance has that which acts against the motion of its coordinate, the others one.
    """
    names = _Known(scene, result, pose)
    try:
        if isinstance(load, Force):
            return tuple(names.value(load, "value", k) for k in range(len(load.value)))
        if isinstance(load, Torque):
            if isinstance(load.value, tuple):
                return tuple(names.value(load, "value", k) for k in range(len(load.value)))
            return (names.value(load, "value"),)
        if isinstance(load, Resistance):
            way = sense(scene, result, coordinate(scene.mechanism, load.coordinate), pose)
            both = tuple(names.value(load, name) for name in ("negative", "positive"))
            if way == 0.0 and both[0] != both[1]:
                return None
            return (both[0] if way < 0 else both[1],)
        if isinstance(load, TableLoad):
            return (_looked_up(load, names) * names.value(load, "factor"),)
    except (MechdaeError, LookupError):
        return None
    return None


def load_axis(
    scene: PlacedScene, result: SweepResult, load: TableLoad, pose: int
) -> tuple[float, ...] | None:
    """Return the axis of a table's torque in the axes of its frame, None where it is not known."""
    names = _Known(scene, result, pose)
    try:
        return tuple(names.value(load, "axis", k) for k in range(3))
    except (MechdaeError, LookupError):
        return None


def acts(load: Spring, name: str) -> bool:
    """Return whether a number of a spring is given and not zero."""
    return bool(getattr(load, name) != 0.0)


class _Known:
    """Names of the description with their values in a pose."""

    def __init__(self, scene: PlacedScene, result: Any, pose: int) -> None:
        self.scene, self.result, self.pose = scene, result, pose

    def value(self, load: Load, name: str, axis: int | None = None) -> float:
        number = getattr(load, name)
        number = number if axis is None else number[axis]
        if not isinstance(number, str):
            return float(number)
        return evaluate(number, {used: self.of(used) for used in names_in(number)})

    def of(self, name: str) -> float:
        """Return a parameter, a coordinate or the time; speeds are not known."""
        if name in self.scene.numbers:
            return self.scene.numbers[name]
        if name == TIME and result_in_time(self.result):
            return float(self.result.time[self.pose])
        value = float(self.scene.series(coordinate(self.scene.mechanism, name))[self.pose])
        if not np.isfinite(value):
            raise LookupError(name)
        return value


def _looked_up(load: TableLoad, names: _Known) -> float:
    at = names.of(load.coordinate)
    rows = np.array(load.points, dtype=float)
    if not len(rows) or load.interpolation != "linear":
        raise LookupError(load.name)
    first, last = rows[0, 0], rows[-1, 0]
    if load.coordinate == TIME:
        at -= names.value(load, "shift")
    if load.period is not None:
        period = names.value(load, "period")
        at = first + (at - first) % period
        if period > last - first:
            rows, last = np.vstack([rows, [first + period, rows[0, 1]]]), first + period
    elif load.periodic:
        at = first + (at - first) % (last - first)
    if not first <= at <= last:
        raise LookupError(load.name)
    return float(np.interp(at, rows[:, 0], rows[:, 1]))

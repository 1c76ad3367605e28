"""Laws of time as numbers: the curve of the drivers, its times, values and rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.expression import build, evaluate
from mechdae.describe.tasks.kinds import Driver
from mechdae.equations.model import FUNCTIONS
from mechdae.errors import InputError, MechdaeError
from mechdae.kernels.graphs.driver_curve import FINITE, DriverCurve
from mechdae.motion.setup.drivers import SAMPLES, DriverPlan, Timing, interval
from mechdae.types import Booleans, Floats, Sym

ROUNDING = 64 * np.finfo(float).eps
SAME = 1e-9
"""Share by which a rate may differ on the two sides of a corner and still be one rate."""


def timing(drivers: Sequence[Driver], count: int, known: Mapping[str, float]) -> Timing:
    """Return the poses of drivers that follow laws; those with a single value are held.

    Raises
    ------
    InputError
        Times that are missing or differ, a speed beside a law, a law without a finite value
        or with a jump.
    """
    times = _times(drivers, count, known)
    t = ca.SX.sym("t")
    course = DriverCurve(t, ca.vertcat(*[_expression(driver, t, known) for driver in drivers]))
    values, speed, acceleration, jerk, rough = _at_poses(course, times)
    _refuse_jumps(course, times)
    corners = _corners(course, times)
    return Timing(course, times, values, speed, acceleration, jerk, corners, rough)


def _times(drivers: Sequence[Driver], count: int, known: Mapping[str, float]) -> Floats:
    """Return the times (n,) that the laws name; they are the same for all of them."""
    found: list[Floats] = []
    for driver in drivers:
        if driver.law is None:
            continue
        for entry in ("speed", "acceleration", "jerk"):
            if getattr(driver, entry) is not None:
                raise InputError("a law of time gives its rates itself", where=entry)
        if driver.times is not None:
            found.append(np.array([evaluate(value, known) for value in driver.times]))
        elif driver.from_ is not None and driver.to is not None:
            found.append(interval(evaluate(driver.from_, known), evaluate(driver.to, known), count))
    if any(not np.array_equal(times, found[0]) for times in found):
        raise InputError("the laws of one task have the same times", where="times")
    return found[0]


def _expression(driver: Driver, t: Sym, known: Mapping[str, float]) -> Sym:
    if driver.law is None:
        assert driver.at is not None
        return ca.SX(evaluate(driver.at[0], known))
    try:
        return ca.SX(build(driver.law, {**known, "t": t}, FUNCTIONS))
    except MechdaeError as problem:
        raise problem.inside("law") from None


def _at_poses(
    course: DriverCurve, times: Floats
) -> tuple[Floats, Floats, Floats, Floats, Booleans]:
    """Return u, u', u'', u''' at the times, and which poses lie on a corner of u or u'.

    At the first and the last of the times the rates are those of the inner side.
    """
    values, speed, acceleration, jerk = course.sampled(times, 3)
    derivatives = (speed, acceleration, jerk)
    rough = np.zeros(len(times), bool)
    span = float(np.ptp(times)) or 1.0
    nudge = ROUNDING * np.maximum(np.abs(times), span)
    after = np.where(times == times.max(), times - nudge, times + nudge)
    before = np.where(times == times.min(), times + nudge, times - nudge)
    if len(times) == 1:
        after, before = times + nudge, times - nudge
    sides = [course.sides(places) for places in (before, after)]
    turning = (sides[0] != sides[1]) | (course.sides(times) != sides[1])
    for k in np.flatnonzero(turning.any(axis=1)):
        left, right = (course.one_sided(times[k], side[k]) for side in sides)
        differ = np.zeros(values.shape[1], bool)
        for order, rates in enumerate(derivatives, start=1):
            rates[k] = right[order]
            size = np.abs(rates).max(axis=0, initial=0.0, where=np.isfinite(rates))
            with np.errstate(invalid="ignore"):  # infinite on both sides: no rate
                differ |= ~(np.abs(left[order] - right[order]) <= SAME * size)
            rates[k, differ] = np.nan
            rough[k] |= order < 3 and bool(differ.any())
    smooth = ~rough
    if not (np.all(np.isfinite(values)) and np.all(np.isfinite(speed[smooth]))):
        _refuse_times(times, values, speed)
    if not np.all(np.isfinite(acceleration[smooth])):
        _refuse_times(times, values, acceleration)
    jerk[~np.isfinite(jerk)] = np.nan  # none of a law that is not smooth enough
    return values, *derivatives, rough


def _refuse_times(times: Floats, values: Floats, rates: Floats) -> None:
    bad = times[~np.all(np.isfinite(values) & np.isfinite(rates), axis=1)]
    raise InputError(f"the law has no finite value or rate at t = {bad[0]:.6g}", where="law")


def _corners(course: DriverCurve, times: Floats) -> Floats:
    """Return the times strictly between the first and the last at which a switch turns."""
    first, last = float(times.min()), float(times.max())
    if not course.switches.numel() or first == last:
        return np.zeros(0)
    grid = _grid(times)
    sides = course.sides(grid)
    found = set()
    for j in range(sides.shape[1]):
        for k in np.flatnonzero(sides[:-1, j] != sides[1:, j]):
            a, b, left = float(grid[k]), float(grid[k + 1]), sides[k, j]
            while left and a < (middle := (a + b) / 2) < b:
                same = course.sides(np.array([middle]))[0, j] == left
                a, b = (middle, b) if same else (a, middle)
            found.add(b if left else a)
    return np.array(sorted(found - {first, last}))


def _refuse_jumps(course: DriverCurve, times: Any) -> None:
    """Raise where a law has a pole, leaves its domain or jumps: a driver moves continuously."""
    span = float(np.ptp(times))
    a, b = (grid := _grid(times))[:-1], grid[1:]
    while a.size:  # cells over which the law is not bounded, halved until they are
        middle = (a + b) / 2
        open_ = (course.reach(middle, (b - a) / 2) > FINITE).any(axis=1)
        a, b, middle = a[open_], b[open_], middle[open_]
        beyond = ~(np.abs(course.sampled(middle)[0]) <= FINITE).all(axis=1)
        if beyond.any():
            _refuse_place(float(middle[beyond][0]))
        narrow = b - a <= ROUNDING * np.maximum(np.maximum(np.abs(a), np.abs(b)), span)
        if narrow.any():
            _refuse_place(float(a[narrow][0]))
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
    _refuse_cuts(course, grid)
    if not course.switches.numel():
        return
    u, rate, _ = course.sampled(grid)
    size = np.max(np.abs(u), axis=0) + 1e-300
    steep = np.fmax(np.abs(rate[:-1]), np.abs(rate[1:])) * np.diff(grid)[:, None]
    jumps = np.abs(np.diff(u, axis=0)) > 2 * steep + SAME * size
    for k in np.flatnonzero(jumps.any(axis=1)):
        low, high = float(grid[k]), float(grid[k + 1])
        moved = np.inf
        while high - low > ROUNDING * max(abs(low), abs(high), span):
            middle = (low + high) / 2
            here = course.sampled(np.array([low, middle, high]))[0] / size
            left, right = np.abs(np.diff(here, axis=0)).max(axis=1)
            moved = max(left, right)
            low, high = (low, middle) if left >= right else (middle, high)
        if moved > SAME:
            _refuse_place(low)


def _refuse_cuts(course: DriverCurve, grid: Floats) -> None:
    """Raise where an atan2 passes its cut and the law jumps with it."""
    sides = course.cuts(grid)
    size = np.max(np.abs(course.sampled(grid)[0]), axis=0) + 1e-300
    for k, j in zip(*np.nonzero(sides[1:] * sides[:-1] < 0), strict=True):
        low, high = float(grid[k]), float(grid[k + 1])
        while low < (middle := (low + high) / 2) < high:
            here = course.cuts(np.array([middle]))[0, j]
            if not here:
                break  # it went round the other side
            low, high = (middle, high) if here == sides[k, j] else (low, middle)
        else:
            before, after = course.sampled(np.array([low, high]))[0] / size
            if np.max(np.abs(after - before)) > SAME:
                _refuse_place(high)


def _refuse_place(t: float) -> None:
    raise InputError(
        f"the law jumps or has no bounded value at t = {t:.6g}: a driver moves continuously",
        where="law",
    )


def _grid(times: Floats) -> Any:
    """Return the times of the poses and `SAMPLES` more between the first and the last."""
    samples = np.linspace(times.min(), times.max(), SAMPLES).tolist()
    return np.array(sorted({*samples, *times.tolist()}))


def by_laws(
    coordinates: tuple[NamedCoordinate, ...],
    drivers: Sequence[Driver],
    moving: list[int],
    poses: int,
    known: Mapping[str, float],
    sketch: Floats,
) -> DriverPlan:
    """Return the plan of drivers that follow laws of time, others held."""
    t = timing(drivers, poses, known)
    named = any(driver.times is not None for driver in drivers)
    return DriverPlan(
        coordinates,
        t.values,
        len(t.times),
        named,
        t.speed,
        t.acceleration,
        t.jerk,
        sketch,
        course=t.course,
        timing=t,
        lead=moving[0],
    )

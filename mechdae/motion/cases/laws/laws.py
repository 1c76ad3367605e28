"""Laws of time as numbers, and sweeps of several drivers along straight lines or a course."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.expression import build, evaluate
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.equations.model import FUNCTIONS
from mechdae.errors import InputError, MechdaeError, SolveError
from mechdae.kernels.graphs.driver_curve import FINITE, DriverCurve
from mechdae.motion.continuation.evaluate import Evaluator, swept
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.legs import Legs, largest_step
from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.kinematics.extremes import Spans
from mechdae.motion.kinematics.path_events import limit_events
from mechdae.motion.kinematics.prepared import Run, Setting, covered
from mechdae.motion.kinematics.sweep import PathRange
from mechdae.motion.measures.measure import at_poses
from mechdae.motion.setup.drivers import SAMPLES, DriverPlan, Timing, interval
from mechdae.motion.setup.scales import Constants
from mechdae.results import Summary
from mechdae.types import Booleans, Floats, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.continuation.limit_positions import Limit

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


MOST_STEPS = 4096
"""Steps along a law for its fastest moment, beside four times those for its whole way."""
SHARES = (2.0**-4, 2.0**-7, 2.0**-10)
"""Shares of a way that begins on a limit position at which it is looked for another beginning."""
BACK = 16
"""Legs from there back to the limit."""
MET = 1e-12
"""Share of the last leg within which a limit position is its end."""
ALIKE = 1e-5
"""Share of a radian or of the mechanism's length within which two limits are one pose: a root of
the last bits of the driver."""


def walked(setting: Setting, x: Unknowns, corners: Floats) -> Legs:
    """Return the proved straight legs through the drivers' values `corners` (m, nd)."""
    graphs = setting.graphs.straight

    def follow(numbers: Constants) -> tuple[Legs, Legs]:
        legs = Legs(graphs, numbers, corners, setting.driver_sizes)
        legs.leg.on_change_point = setting.on_change_point
        legs.walk(x)
        return legs, legs

    legs: Legs = covered(follow, setting, corners, 0.0, (x, corners[0]), graphs)[1]
    return legs


def approach(setting: Setting, u: Floats, x: Unknowns, to: Floats) -> Floats | None:
    """Return the unknowns at the drivers' values `to`, moved there straight from `u`.

    None where a limit position lies between.
    """
    if np.array_equal(u, to):
        return x
    legs = walked(setting, x, np.array([u, to]))
    return legs.nodes[-1] if legs.whole_way else None


def leaving(
    setting: Setting, u: Floats, x: Unknowns, way: Any, places: Floats
) -> tuple[float, Any] | None:
    """Return a place of a way that begins on a limit position, and the unknowns there.

    `way` gives the drivers' values (n, nd) at places (n,) of it. The mechanism moves from the
    sketch, `x` at `u`, straight to a place a little further on: from there the way is followed
    back to its beginning too. None where it does not begin on a limit, or where it leads back
    to another pose of it.
    """
    begin = way(places[:1])[0]
    met = _met(walked(setting, x, np.array([u, begin])), 1.0)
    if met is None:
        return None
    for share in SHARES:
        place = float(places[0] + share * (places[-1] - places[0]))
        to = way(np.array([place]))[0]
        start = approach(setting, u, x, to) if not np.array_equal(to, begin) else None
        if start is None:
            continue
        back = way(place + (places[0] - place) * np.arange(BACK + 1) / BACK)
        again = _met(walked(setting, start, back), float(BACK))
        if again is not None and _same(setting, met.x, again.x):
            return place, start
    return None


def _met(legs: Legs, at: float) -> Limit | None:
    """Return the limit position with which legs end at a corner, None without."""
    ended = [reach.high for reach in legs.reach.values() if reach.high is not None]
    if not ended or any(end.kind != "limit" or abs(end.s - at) > MET for end in ended):
        return None
    return ended[0]


def _same(setting: Setting, one: Floats, other: Floats) -> bool:
    sizes = setting.scene.unknowns.sizes(setting.scene.model.mechanism.scale)
    period = setting.scene.unknowns.periods
    whole = np.where(period > 0, period, 1.0)
    apart = one - other
    apart = np.where(period > 0, apart - whole * np.round(apart / whole), apart)
    return bool(np.all(np.abs(apart) <= ALIKE * sizes))


def from_pose_to_pose(setting: Setting, task: Sweep, u: Floats, x: Unknowns) -> Run:
    """Return the poses along straight legs from one to the next, the sketch first.

    Groups that reach a limit position are lost from there on, the others go on.
    """
    plan = setting.plan
    legs = walked(setting, x, np.vstack([u, plan.values]))
    evaluator = Evaluator(legs.graphs, setting.outputs)
    n = len(plan.values)
    places = np.arange(1.0, n + 1)
    poses = swept(evaluator, legs, places, _rates(setting))
    events = limit_events(setting, legs, 0.0, float(n))
    measured = at_poses(setting.outputs, task, poses)
    return Run(legs, evaluator, poses, plan.values, places, events, Summary(), measured)


def along_a_line(setting: Setting, task: Sweep, u: Floats, x: Unknowns) -> Run:
    """Return the poses along one straight line from the first to the last values."""
    plan = setting.plan
    values = plan.values
    start = approach(setting, u, x, values[0])
    d = values[-1] - values[0]
    begin = 0.0
    if start is None:
        way = leaving(setting, u, x, lambda s: values[0] + s[:, None] * d, np.array([0.0, 1.0]))
        if way is None:
            return from_pose_to_pose(setting, task, u, x)
        begin, start = way
    largest = float(largest_step(d, setting.driver_sizes))

    def follow(numbers: Constants) -> tuple[Path, Any]:
        path = Path(setting.graphs, numbers, values[0], d, largest)
        path.on_change_point = setting.on_change_point
        path.begin(start, begin)
        extend(path, 1.0)
        extend(path, 0.0)
        return path, None

    path = covered(follow, setting, values, 0.0, (start, values[0] + begin * d))[0]
    evaluator = Evaluator(setting.graphs, setting.outputs)
    grid = np.linspace(0.0, 1.0, len(values))
    poses = swept(evaluator, path, grid, _rates(setting))
    spans = None
    if task.derivatives >= 2:
        spans = Spans(evaluator, setting.outputs, path, poses, 0.0, 1.0)
    summary = Summary() if spans is None else spans.summary()
    events = limit_events(setting, path, 0.0, 1.0)
    measured = at_poses(setting.outputs, task, poses)
    return Run(path, evaluator, poses, values, grid, events, summary, measured, spans)


def _rates(setting: Setting) -> tuple[Floats, ...]:
    """Return speeds, accelerations and jerks of the drivers, each (n, nd)."""
    plan = setting.plan
    shape = plan.values.shape
    return tuple(np.broadcast_to(r, shape) for r in (plan.speed, plan.acceleration, plan.jerk))


def on_course(
    setting: Setting, task: Sweep, u: Floats, x: Floats, along: Callable[..., Run]
) -> Run:
    """Return the run along the drivers' path: a course, one value, or straight lines.

    `along` gives that along one parameter.
    """
    plan = setting.plan
    if plan.course is None:
        straight = from_pose_to_pose if plan.named or plan.poses == 1 else along_a_line
        return straight(setting, task, u, x)
    if task.derivatives and plan.timing and plan.timing.rough.any():
        times = [f"{time:.6g}" for time in plan.timing.times[plan.timing.rough]]
        setting.notes.append(f"a law has a corner at t = {', '.join(times)}: no rates there")
    if task.derivatives >= 3 and plan.timing:
        none = np.isnan(plan.timing.jerk).any(axis=1) & ~plan.timing.rough
        if none.any():
            times = [f"{time:.6g}" for time in plan.timing.times[none]]
            setting.notes.append(f"a law has no third derivative at t = {', '.join(times)}")
    to = np.where(np.isnan(plan.first), u, plan.first)
    if plan.moving is not None:
        to[plan.moving] = u[plan.moving]
    start = approach(setting, u, x, to)
    if start is not None:
        return along(setting, task, to, start, _range(setting, plan.timing))
    if plan.timing is not None:
        course = plan.timing.course
        found = leaving(setting, u, x, lambda t: course.sampled(t, 0)[0], plan.timing.times)
        if found is not None:
            begin, start = found
            path_range = _range(setting, plan.timing, begin)
            return along(setting, task, course.sampled([begin], 0)[0][0], start, path_range)
    if plan.values is None:
        raise SolveError(
            "a limit position lies between the sketch and the values of the held drivers",
            hint="sketch a pose with the held drivers at their values",
        )
    return from_pose_to_pose(setting, task, u, x)


def _range(setting: Setting, laws: Timing | None, begin: float | None = None) -> PathRange | None:
    """Return how laws are followed, from their first time where no other is given."""
    if laws is None:
        return None
    first = float(laws.times[0]) if begin is None else begin
    largest = largest_in_time(laws, setting.driver_sizes)
    return PathRange(first, largest, laws.course.sampled(laws.dense)[0], 0.1 * setting.driver_sizes)


def largest_in_time(laws: Timing, scales: Floats) -> float:
    """Return the largest step in time: drivers and their speeds change little over it.

    Unknowns may move faster than the drivers: the interval has at least as many steps as a
    turn. A short burst does not decide, its steps are made smaller when they come.
    """
    values, speed, acceleration = (part / scales for part in laws.course.sampled(laws.dense))
    share, span = 2 * np.pi / NODES_PER_TURN, float(np.ptp(laws.times))
    rate, bend = (
        float(np.max(np.abs(part), initial=0.0, where=np.isfinite(part)))
        for part in (speed, acceleration)
    )
    way = float(np.sum(np.abs(np.diff(values, axis=0))))
    fastest = max(span * rate / share, span * np.sqrt(bend / (2 * share)))
    count = max(NODES_PER_TURN, min(fastest, 4 * way / share + MOST_STEPS))
    return span / count or 1.0

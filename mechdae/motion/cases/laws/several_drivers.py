"""Sweeps of several drivers along straight lines, and the way from the sketch to a course."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import SolveError
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
from mechdae.motion.setup.drivers import Timing
from mechdae.motion.setup.scales import Constants
from mechdae.results import Summary
from mechdae.types import Floats, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.continuation.limit_positions import Limit

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

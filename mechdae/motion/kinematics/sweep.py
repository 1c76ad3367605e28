"""Positions, velocities and accelerations along the drivers, every pose certified."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import SolveError
from mechdae.motion.continuation.evaluate import Evaluator, in_time
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.many_poses import swept
from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.reachable_arc import NEARER, TIMES, arc_of
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.kinematics.extremes import Spans
from mechdae.motion.kinematics.prepared import Run, Setting, covered, first_pose, prepare
from mechdae.motion.kinematics.report import begins_singular, limit_events, report
from mechdae.motion.kinematics.several_drivers import (
    along_a_line,
    approach,
    from_pose_to_pose,
    leaving,
    scales,
)
from mechdae.motion.measures.measure import along_path, at_poses
from mechdae.motion.setup.laws import Timing
from mechdae.motion.setup.scales import Constants, driver_size
from mechdae.results import Result, Summary
from mechdae.types import Floats, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.continuation.limit_positions import Limit

TURN = 2 * np.pi
MAX_TURNS = 1000
MAX_SPANS = 25
MOST_BACK = 8
"""Turns back from a limit position after which gears that are not back are given up."""
BACK = 1e-9
"""Share of its size within which a coordinate is back where it was."""
FLAT = ("dead_point", "ambiguous", "unproved")
"""Ends of an assembled arc at which there is no certified pose, and in front of which there is."""
SINGULAR = 1e6
"""Condition from which a pose is next to a singular one."""
MOST_STEPS = 4096
"""Steps along a law for its fastest moment, beside four times those for its whole way."""


def sweep(problem: Problem, name: str, task: Sweep) -> Result:
    """Return the result of a sweep.

    The mechanism is assembled at the sketch (or on the mode asked for at the first pose),
    moved to the first pose and on along the drivers. Poses that no certified motion
    reaches are ``unassembled``.

    Raises
    ------
    AssemblyError
        The sketch does not assemble at its own driver value.
    """
    setting = prepare(problem, task)
    return report(problem, name, task, setting, run(setting, task))


def run(setting: Setting, task: Sweep) -> Run:
    """Evaluate a prepared sweep."""
    result = _followed(setting, task)
    if setting.graphs.contacts:
        from mechdae.motion.kinematics.curve_corners import without_two_values

        without_two_values(setting, result)
    result.poses.y = result.poses.y[: task.derivatives + 1]
    return result


def _followed(setting: Setting, task: Sweep) -> Run:
    """Return the run along the drivers' path: a course, one value, or straight lines."""
    plan = setting.plan
    u, x = first_pose(setting, task)
    if setting.graphs.single:
        return _along(setting, task, u, x)
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
        return _along(setting, task, to, start)
    if plan.timing is not None:
        course = plan.timing.course
        found = leaving(setting, u, x, lambda t: course.sampled(t, 0)[0], plan.timing.times)
        if found is not None:
            begin, start = found
            return _along(setting, task, course.sampled([begin], 0)[0][0], start, begin)
    if plan.values is None:
        raise SolveError(
            "a limit position lies between the sketch and the values of the held drivers",
            hint="sketch a pose with the held drivers at their values",
        )
    return from_pose_to_pose(setting, task, u, x)


def _along(
    setting: Setting, task: Sweep, u: Floats, x: Unknowns, begin: float | None = None
) -> Run:
    """Return the poses along one parameter: the value of the driver that moves, or time.

    The path starts from unknowns `x` at drivers' values `u`, at the time `begin` of laws where
    that is not their first.
    """
    plan, graphs, laws = setting.plan, setting.graphs, setting.plan.timing
    moving, is_angle = plan.lead, graphs.turns
    model, c = setting.scene.model, plan.coordinates[plan.lead]
    contact = model.contacts.get(c.part)
    closed = contact is not None and contact.closed
    scale = model.mechanism.scale
    size = driver_size(model, c, scale)
    if begin is None:
        begin = float(laws.times[0] if laws else u[moving])
    if laws:
        largest = _largest(laws, scales(setting))
        span, margin = laws.course.sampled(laws.dense)[0], 0.1 * scales(setting)
    else:
        largest = 2 * np.pi / NODES_PER_TURN * size
        span = u[None, :] if plan.values is None else np.vstack([plan.values, u])
        margin = np.zeros(len(u))
        margin[moving] = 4 * (scale if c.unit == "m" else np.pi * size)
    evaluator = Evaluator(graphs, setting.outputs)
    summary = Summary()

    def follow(numbers: Constants) -> tuple[Path, Any]:
        path = Path(graphs, numbers, np.zeros(graphs.nu), np.ones(graphs.nu), largest)
        path.on_change_point = setting.on_change_point
        path.begin(x, begin)
        if plan.values is None:
            turn = 2 * np.pi * size if is_angle or closed else None
            places, summary["limits"] = _assembled(
                path, evaluator, turn, 4 * scale, plan.poses, setting.notes
            )
            return path, places
        places = laws.times if laws else plan.values[:, moving]
        cover(path, evaluator, places, is_angle, laws.corners if laws else ())
        return path, places

    path, places = covered(follow, setting, span, margin, (x, u))
    rates = (plan.speed, plan.acceleration, plan.jerk)
    own = [rate[:, [moving]] for rate in rates]
    driver = None if laws else (own[0], own[1], own[2])
    measures = bool(task.measures)  # of derivatives by the driver
    poses = swept(
        evaluator, path, places, rates if laws else (), None if measures else driver, measures
    )
    low, high = float(np.min(places)), float(np.max(places))
    spans = None
    if not plan.named and task.derivatives >= 2:
        between = [*laws.dense, *laws.corners] if laws and not graphs.nx else []
        spans = Spans(evaluator, setting.outputs, path, poses, low, high, between)
        summary["swing"] = summary["stroke"] = spans.later
        if task.measures:  # they follow the path further
            spans.later.parts()
    ends = arc_of(path).ends if plan.values is None else ()
    met = [low, high, *(end for end in ends if end is not None)]
    events = limit_events(setting, path, min(met), max(met))
    if "limits" not in summary and not laws:
        limits = arc_of(path).ends
        if any(end is not None for end in limits):
            summary["limits"] = limits
    if any(begins_singular(setting, path, event) for event in events):
        summary.pop("limits", None)  # not known: the pose is on two branches
    values = plan.values if plan.values is not None else path.drivers(places)
    measured = at_poses(setting.outputs, task, poses, 1.0 if is_angle or laws else scale)
    if not laws:
        along_path(setting.outputs, task, evaluator, path, places, measured, moving)
        for event in measured.events if graphs.nu > 1 else ():
            event["at"] = path.drivers(np.array([event["at"]]))[0].tolist()
        if measures:
            poses.y = in_time(poses.y, *own)
    return Run(path, evaluator, poses, values, places, events, summary, measured, spans)


def _largest(laws: Timing, scales: Floats) -> float:
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


def cover(
    path: Path, evaluator: Evaluator, values: Floats, is_angle: bool, corners: Any = ()
) -> None:
    """Follow the path over all values, and the other way round where some are not reached."""
    if not path.followed:
        return
    begin = path.origin[0]
    for place in [*[c for c in corners if c > begin], float(np.max(values))]:
        extend(path, float(place))
    for place in [*[c for c in corners[::-1] if c < begin], float(np.min(values))]:
        extend(path, float(place))
    arc = arc_of(path)
    if is_angle and (arc.low is None) != (arc.high is None) and not arc.holds(values).all():
        turn = TURN if arc.low is not None else -TURN
        anchor = arc.first if arc.low is not None else arc.last
        for turns in range(1, MOST_BACK + 1):
            extend(path, anchor + turns * turn, first=True)
            if None not in arc_of(path).ends or _comes_back(path, evaluator, turns * turn):
                return


def _comes_back(path: Path, evaluator: Evaluator, turned: float) -> bool:
    """Return whether all groups are in their first pose again after whole turns of the driver."""
    s = np.array([path.origin[0]])
    return bool(evaluator.returns(path, path.guess(s), s + turned, s).all())


def _assembled(
    path: Path,
    evaluator: Evaluator,
    turn: float | None,
    length: float,
    count: int,
    notes: list[str],
) -> tuple[Any, list[float | None]]:
    """Return driver values over the whole assembled arc and its ends (None: turns fully).

    The driver is moved up turn by turn (or, where it has no `turn`, by `length`) until a
    group ends or the mechanism is back at its first pose, then down to the other end.
    """
    s = path.origin[0]
    span, most = (turn, MAX_TURNS) if turn else (length, MAX_SPANS)
    high = low = None
    for turns in range(1, most + 1):
        extend(path, s + turns * span, first=True)
        high = arc_of(path).ends[1]
        if high is not None:
            break
        closed = _closed(path) if turn else None
        if turn and closed is not None:
            turns *= _rounds(path, evaluator, turns * turn, turns, closed, notes)
            extend(path, s + turns * span, first=True)
            # whole turns from zero, or from the full turn below a sketch further away
            base = 0.0 if abs(s) <= turn else turn * np.floor(s / turn)
            grid = base + turn * turns * np.arange(count) / max(count - 1, 1)
            extend(path, float(grid[-1]))
            extend(path, float(grid[0]))
            return grid, [None, None]
    for turns in range(1, (most if high is not None else 1) + 1):
        extend(path, s - turns * span, first=True)
        low = arc_of(path).ends[0]
        if low is not None:
            break
    first = low if low is not None else s - span
    last = high if high is not None else s + span
    if low is None or high is None:
        ways = " and ".join(w for w, end in (("down", low), ("up", high)) if end is None)
        notes.append(f"no end of the assembled arc was found {ways}: one span of it is shown")
    arc = arc_of(path)
    first = _before_end(path, evaluator, arc.low, first, -1)
    last = _before_end(path, evaluator, arc.high, last, 1)
    grid = first + (last - first) * (np.arange(count) / max(count - 1, 1))
    grid[0], grid[-1] = first, last
    return grid, [low, high]


def _before_end(
    path: Path, evaluator: Evaluator, end: Limit | None, place: float, way: int
) -> float:
    """Return the outermost place of the assembled arc whose pose is certified.

    It is a limit position itself, and a hair in front of ends at which several branches meet.
    """
    if end is None or end.kind not in FLAT:
        return place
    s = place - way * path.largest * NEARER ** np.arange(TIMES, 0.0, -1)
    poses = evaluator.at(path, s)
    sure = poses.alive.all(axis=1) & ~poses.uncertain & ~poses.singular
    if end.kind == "unproved":  # elsewhere it is the proof that failed, not the mechanism
        sure &= poses.condition > SINGULAR
    return float(s[np.argmax(sure)]) if sure.any() else place


def _closed(path: Path) -> Any:
    """Return the whole turns (nx,) after which unknowns are back at the last node, or None."""
    scene = path.graphs.scene
    moved = path.state[-1][: path.graphs.nx] - path.origin[1]
    period = scene.unknowns.periods
    whole = np.where(period > 0, period, 1.0)
    turned = np.where(period > 0, whole * np.round(moved / whole), 0.0)
    size = scene.unknowns.sizes(path.constants.scale)
    back = np.abs((moved - turned) / size).max(initial=0.0) < BACK
    return turned if back else None


def _rounds(
    path: Path, evaluator: Evaluator, span: float, turns: int, turned: Floats, notes: list[str]
) -> int:
    """Return after how many rounds of `span` bodies that gears and racks move are back too.

    After each round the unknowns are back, `turned` (nx,) further. One round where nothing ever
    comes back, with a note.
    """
    recovered, (coordinates, *_) = path.graphs.scene.recovered, evaluator.recovered
    s, x = path.origin
    rounds = np.arange(MAX_TURNS // turns + 1)
    u = path.drivers(s + span * rounds)
    values = coordinates(x + rounds[:, None] * turned, u, path.constants.p)[0]
    apart = np.where(recovered.places, 0.0, values - values[0])
    whole = 2 * np.pi * np.round(apart / (2 * np.pi))
    apart = np.where(recovered.turns, apart - whole, apart / path.constants.scale)
    away = np.abs(apart) >= BACK
    back = np.flatnonzero(~away.any(axis=1))
    if len(back) > 1:
        return int(back[1])
    if len(away) > 1 and away[1].any():
        names = [part for part, _ in path.graphs.scene.recover]
        part = names[int(np.argmax(away[1]))]
        notes.append(
            f"{part} does not come back to where it began: "
            f"{'one turn' if turns == 1 else f'{turns} turns'} of the driver shown"
        )
    return 1

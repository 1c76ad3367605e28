"""What a design's own file does of what was asked, measured by the kind of goal.

A visited pose counts by how far the origin of the body's frame is from its target, and by the
directions: an angle phi between both counts 2 sin(phi/2) times the size of the targets.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.expression import evaluate
from mechdae.describe.tasks.goals import (
    FunctionTargets,
    Maximise,
    Minimise,
    Rocker,
    StraightLine,
    Visits,
)
from mechdae.design.synthesis.robust.values import of_largest, of_squares
from mechdae.design.synthesis.verification.claims import Claim, Stated, Worth
from mechdae.design.synthesis.verification.design_file import AXES, ORIGIN, TURN, DesignFile
from mechdae.design.synthesis.verification.quantities import of_quantity
from mechdae.results import Result
from mechdae.results.rotations import matrices
from mechdae.types import Floats, Matrices, Points

EXACT = 1e-9
"""Error of what is exact, by the spread of the targets or the size of the coordinate."""
FINE = 721
"""Places at which a line or a formula is compared."""
TIMED = 1e-9
"""By how much driver values may differ from those asked for, in turns or largest values."""


def of_visits(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return the errors of visited targets, and their measure."""
    goal = stated.asked
    assert isinstance(goal, Visits)
    at, count = np.asarray(claim.at, float), len(goal.targets)
    if len(at) != count:
        return Worth(np.inf, np.full(count, np.nan), [f"{len(at)} poses for {count} targets"])
    found, defects = design.swept(at, (goal.what,))
    if found is None:
        return Worth(np.inf, np.full(count, np.nan), defects)
    defects = defects + _timing(goal, at, design.turned)
    errors, size, weights = _errors(goal, found, design), size_of(goal), np.array(goal.weights)
    if goal.measure == "exact":
        worst = float(np.max(errors))
        if not worst <= EXACT * size:
            defects.append(f"a target is missed by {worst:.3g}")
        return Worth(worst, errors, defects)
    if stated.robust is not None:
        factor, sigmas = stated.robust.factor, stated.robust.sigmas
        gaps, slopes = _deviated(goal, at, design, stated.robust.names)
        if goal.measure == "minimax":
            value, parts = of_largest(errors, slopes * sigmas, factor)
        else:
            value, parts = of_squares(gaps, slopes * sigmas, weights, factor)
        return Worth(value, errors, defects, parts)
    if goal.measure == "minimax":
        return Worth(float(np.max(errors)), errors, defects)
    return Worth(float(np.sum(weights * errors**2)), errors, defects)


def size_of(asked: Visits) -> float:
    """Return the root of the mean square distance of the targets from their middle [m]."""
    places = np.array(asked.places)
    return float(np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1))))


def _timing(asked: Visits, at: Floats, turned: bool) -> list[str]:
    """Return the defect of driver values that are not those, or not in the order, asked for."""
    if asked.timing == "any":
        return []
    if asked.timing == "free":
        steps, whole = np.diff(at), abs(at[-1] - at[0])
        if not ((steps > 0).all() or (steps < 0).all()) or (turned and whole >= TURN):
            return ["the targets are not visited in order within a turn"]
        return []
    wanted = np.array(asked.programme, float)
    near = TIMED * max(TURN if turned else 0.0, float(np.abs(wanted).max()))
    gaps = [at - wanted]
    if asked.timing == "steps":  # in one sense or the other
        gaps = [at - at[0] - sense * (wanted - wanted[0]) for sense in (1, -1)]
    if min(float(np.abs(gap).max()) for gap in gaps) > near:
        return ["the targets are not visited at the driver's values that are asked for"]
    return []


def _errors(asked: Visits, found: Result, design: DesignFile) -> Any:
    """Return how far swept poses are from their targets (k,) [m]."""
    places = np.array(asked.places)
    if not asked.is_motion:
        return np.sqrt(np.sum((found.points[asked.what].position - places) ** 2, axis=1))
    size, gaps = size_of(asked), design.origin(found, asked.what) - places
    if places.shape[1] == 2:
        angle = found.bodies[asked.what].angle
        turn = (angle - np.array(asked.targets)[:, 2] + np.pi) % TURN - np.pi
        return np.hypot(np.hypot(*gaps.T), size * 2 * np.sin(np.abs(turn) / 2))
    turned = _columns(found.bodies[asked.what].orientation) - _turned(asked)
    return size * np.sqrt(np.sum(gaps**2, axis=-1) / size**2 + np.sum(turned**2, axis=-1) / 2)


def _deviated(
    asked: Visits, at: Floats, design: DesignFile, names: Sequence[str]
) -> tuple[Points, Matrices]:
    """Return residuals (k, m) [m] at driver values, and derivatives (k, m, nt) by names."""
    task, what = design.poses_at(at), asked.what
    wanted, size = np.array(asked.places), size_of(asked)
    if not asked.is_motion:
        path = f"points/{what}/position"
        value, slopes = design.slopes(task, (path,), names)[path]
        return value - wanted, slopes
    if wanted.shape[1] == 2:
        both = (f"points/{what}.{ORIGIN}/position", f"bodies/{what}/angle")
        found = design.slopes(task, both, names, what)
        (places, moved), (angle, turned) = (found[path] for path in both)
        turn = angle[:, 0] - np.array(asked.targets)[:, 2]
        residuals = np.column_stack(
            [places - wanted, size * np.sin(turn), size * (1 - np.cos(turn))]
        )
        slopes = size * np.stack([np.cos(turn), np.sin(turn)], axis=1)[:, :, None] * turned
        return residuals, np.concatenate([moved, slopes], axis=1)
    paths = tuple(f"points/{what}.{point}/position" for point in (ORIGIN, *AXES))
    found = design.slopes(task, paths, names, what)
    (place, moved), *ends = (found[path] for path in paths)
    share = size / np.sqrt(2)
    turned = np.concatenate([end - place for end, _ in ends], axis=1) - _turned(asked)
    slopes = [moved, *(share * (slope - moved) for _, slope in ends)]
    residuals = np.concatenate([place - wanted, share * turned], axis=1)
    return residuals, np.concatenate(slopes, axis=1)


def _turned(asked: Visits) -> Any:
    """Return the wanted rotation matrices column by column, (k, 9)."""
    e = np.array(asked.targets)[:, 3:]
    return _columns(e / np.linalg.norm(e, axis=1, keepdims=True))


def _columns(quaternions: Any) -> Any:
    """Return rotation matrices column by column, (n, 9)."""
    return matrices(quaternions).transpose(0, 2, 1).reshape(-1, 9)


BACK = 1e-5
"""Share of the stroke by which the point may move back between the nodes."""
STROKE = 1e-7
"""Share by which the stroke may differ from the one that is asked for."""


def of_line(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return deviations from a line, and the largest of them by the stroke."""
    goal = stated.asked
    assert isinstance(goal, StraightLine)
    fine = np.linspace(0, 1, FINE)
    shares = np.unique([*fine, *claim.between])
    at = float(claim.at[0]) + goal.arc * shares
    found, defects = design.swept(at, (goal.point,))
    if found is None:
        return Worth(np.inf, np.full(FINE, np.nan), defects)
    places = found.points[goal.point].position
    along = places @ np.array([np.cos(claim.direction), np.sin(claim.direction)])
    normal = np.array([-np.sin(claim.direction), np.cos(claim.direction)])
    errors = places @ normal - claim.offset
    stroke = float(along[-1] - along[0])
    back = float(np.max(np.maximum.accumulate(along) - along))
    if back > BACK * stroke:
        defects.append(f"the point moves back by {back:.3g} within the stroke")
    if goal.stroke is not None and not abs(stroke - goal.stroke) <= STROKE * goal.stroke:
        defects.append(f"the stroke is {stroke:.6g} m, not {goal.stroke:.6g} m")
    value, parts = float(np.abs(errors).max()) / stroke, None
    if stated.robust is not None:
        path = f"points/{goal.point}/position"
        task, names = design.poses_at(at), stated.robust.names
        slopes = design.slopes(task, (path,), names)[path][1]
        slopes = normal @ slopes * stated.robust.sigmas
        value, parts = of_largest(np.abs(errors), slopes[:, None], stated.robust.factor, stroke)
    return Worth(value, errors[np.isin(shares, fine)], defects, parts)


STROKE_TIMED = 1e-7
"""Miss of a stroke of the driver [rad]."""


def of_rocker(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return how far way and times are from what is asked for."""
    goal = stated.asked
    assert isinstance(goal, Rocker)
    found, defects = design.turn
    if found is None:
        return Worth(np.inf, np.full(2, np.nan), list(defects))
    defects, part = list(defects), goal.coordinate.rpartition(".")[0]
    table = found.summary.get("stroke" if goal.slides else "swing", {})
    way = table.get(part)
    ends, values = design.swept(claim.at, (goal.coordinate if goal.slides else part,))
    defects += values
    if ends is None or way is None:
        word = "the joint does not slide" if goal.slides else "the body does not swing"
        return Worth(np.inf, np.full(2, np.nan), [*defects, word])
    series = ends.joints[part].slide if goal.slides else ends.bodies[part].angle
    reached = float(np.ptp(series))
    size = max(design.problem.mechanism.scale if goal.slides else 1.0, goal.reach or 0.0)
    wanted = way if goal.reach is None else goal.reach
    errors = np.array([way - wanted, reached - way])
    if np.abs(errors).max() > EXACT * size:
        defects.append(missed(goal.slides, part, float(way), float(wanted), reached))
    turned = float(abs(claim.at[1] - claim.at[0]))
    ratio = turned / (TURN - turned)
    wanted = goal.time_ratio
    if wanted is not None and not abs(turned - TURN * wanted / (1 + wanted)) <= STROKE_TIMED:
        defects.append(f"the time ratio of {part} is {ratio:.6g}, not {wanted:.6g}")
    value = {"reach": float(way), "time_ratio": ratio}.get(stated.word)
    if value is not None and stated.bounds is not None:
        low, high = stated.bounds
        slack = 1e-7 * max(abs(value), stated.unit)
        if not low - slack <= value <= high + slack:
            defects.append(f"{stated.path} is {value:.6g}, the limit is missed")
    if value is None or stated.bounds is not None:
        value = float(np.abs(errors).max())
    return Worth(value, errors, defects)


def missed(slides: bool, part: str, way: float, wanted: float, reached: float) -> str:
    """Return what is wrong with a way, or with the ends between which it was sought."""
    word = "stroke" if slides else "swing"
    shown = [
        f"{value:.9g} m" if slides else f"{np.degrees(value):.9g} deg"
        for value in (way, wanted, reached)
    ]
    if abs(reached - way) > abs(way - wanted):
        return (
            f"the two ends that the search took are {shown[2]} apart, the {word} of {part} is "
            f"{shown[0]}"
        )
    return f"the {word} of {part} is {shown[0]}, not {shown[1]}"


def of_function(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return the errors of the output, and their measure."""
    goal = stated.asked
    assert isinstance(goal, FunctionTargets)
    minimax, even = goal.measure == "minimax", np.linspace(0, 1, FINE)
    shares = even if goal.targets else np.unique([*even, *claim.between])
    inputs, outputs = _wanted(goal, shares)
    begin = _start(goal.input_start, claim.input_start, design)
    end = _start(goal.output_start, claim.output_start, design)
    sense = claim.sense if goal.sense == "free" else 1.0
    found, defects = design.swept(begin + inputs, (goal.output,))
    if found is None:
        return Worth(np.inf, np.full(len(inputs), np.nan), defects)
    c = coordinate(design.problem.mechanism, goal.output)
    errors = _series(found, c) - end - sense * outputs
    if c.is_angle and np.isfinite(errors).any():
        errors = errors - TURN * np.round(np.nanmedian(errors) / TURN)
    size = np.abs(errors)
    value, parts = float(size.max()) if minimax else float(np.mean(errors**2)), None
    if goal.measure == "exact":
        value = float(size.max())
        if not value <= EXACT * (float(np.ptp(outputs)) or 1.0):
            defects = [*defects, f"a target is missed by {value:.3g}"]
    elif stated.robust is not None:
        value, parts = _robust(stated, begin + inputs, design, errors)
    if not goal.targets:
        errors = errors[np.isin(shares, even)]
    return Worth(value, errors, defects, parts)


def _wanted(asked: FunctionTargets, shares: Floats) -> tuple[Floats, Floats]:
    """Return inputs and outputs from their starts: of the targets, or at shares of the range."""
    if asked.targets:
        x, y = np.array(asked.targets, float).T
        return x - x[0], y - y[0]
    low, high = asked.range
    first, last = (evaluate(str(asked.function), {"x": x}) for x in (low, high))
    xs = [low + (high - low) * share for share in shares.tolist()]
    ys = [evaluate(str(asked.function), {"x": x}) for x in xs]
    inputs = [asked.input_range * (x - low) / (high - low) for x in xs]
    return np.array(inputs), np.array(
        [asked.output_range * (y - first) / (last - first) for y in ys]
    )


def _start(asked: Any, claimed: float, design: DesignFile) -> float:
    """Return where a scale starts: a number, a parameter of the file, or what is claimed."""
    if asked is None:
        return claimed
    return float(design.numbers[asked]) if isinstance(asked, str) else float(asked)


def _robust(
    stated: Stated, at: Any, design: DesignFile, errors: Any
) -> tuple[float, dict[str, float]]:
    """Return the robust value, by the derivatives of a task of sensitivity."""
    goal, robust = stated.asked, stated.robust
    assert isinstance(goal, FunctionTargets)
    assert robust is not None
    path, columns = _path(coordinate(design.problem.mechanism, goal.output))
    _, slopes = design.slopes(design.poses_at(at), (path,), robust.names)[path]
    slopes = slopes[:, columns] * robust.sigmas
    if goal.measure == "minimax":
        return of_largest(np.abs(errors), slopes, robust.factor)
    weights = np.full(len(errors), 1.0 / len(errors))
    return of_squares(errors[:, None], slopes, weights, robust.factor)


def _path(c: NamedCoordinate) -> tuple[str, slice]:
    """Return the path of a coordinate in results, and its place among the values there."""
    if c.kind == "body angle":
        return f"bodies/{c.part}/angle", slice(0, 1)
    if c.kind == "point":
        return f"points/{c.part}.{c.point}/position", slice(c.axis, c.axis + 1)
    return f"joints/{c.part}/{c.text.rpartition('.')[2]}", slice(0, 1)


def _series(found: Result, c: NamedCoordinate) -> Floats:
    path, columns = _path(c)
    values = np.asarray(found.value(path), float)
    return values[:, columns][:, 0] if c.kind == "point" else values


KINDS: Mapping[type, Callable[[Stated, Claim, DesignFile], Worth]] = {
    Visits: of_visits,
    FunctionTargets: of_function,
    StraightLine: of_line,
    Rocker: of_rocker,
    Minimise: of_quantity,
    Maximise: of_quantity,
}


def measured(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return what the file of a design does of a goal or a limit."""
    return KINDS[type(stated.asked)](stated, claim, design)

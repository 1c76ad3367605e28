"""Places of a point and poses of a body, measured at the driver values of a design.

A pose counts by how far the origin of the body's frame is from its target, and by the directions:
an angle phi between both counts 2 sin(phi/2) times the size of the targets.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdae.describe.tasks.goals import Visits
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.design.synthesis.robust.values import of_largest, of_squares
from mechdae.design.synthesis.verification.claims import Claim, Stated, Worth
from mechdae.design.synthesis.verification.design_file import AXES, ORIGIN, TURN, DesignFile
from mechdae.results import Result
from mechdae.results.rotations import matrices
from mechdae.types import Floats, Matrices, Points

EXACT = 1e-9
"""Error of an exact target, relative to the spread of the targets."""
TIMED = 1e-9
"""By how much driver values may differ from those asked for, in turns or largest values."""


def measured(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return the errors of visited targets, and their measure."""
    asked = stated.asked
    assert isinstance(asked, Visits)
    at, count = np.asarray(claim.at, float), len(asked.targets)
    if len(at) != count:
        return Worth(np.inf, np.full(count, np.nan), [f"{len(at)} poses for {count} targets"])
    found, defects = design.swept(at, (asked.what,))
    if found is None:
        return Worth(np.inf, np.full(count, np.nan), defects)
    defects = defects + _timing(asked, at, design.turned)
    errors, size, weights = _errors(asked, found, design), size_of(asked), np.array(asked.weights)
    if asked.measure == "exact":
        worst = float(np.max(errors))
        if not worst <= EXACT * size:
            defects.append(f"a target is missed by {worst:.3g}")
        return Worth(worst, errors, defects)
    if stated.robust is not None:
        factor, sigmas = stated.robust.factor, stated.robust.sigmas
        gaps, slopes = _deviated(asked, at, design, stated.robust.names)
        if asked.measure == "minimax":
            value, parts = of_largest(errors, slopes * sigmas, factor)
        else:
            value, parts = of_squares(gaps, slopes * sigmas, weights, factor)
        return Worth(value, errors, defects, parts)
    if asked.measure == "minimax":
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
    task = Sweep(Driver(design.driver, at=tuple(float(u) for u in at)))
    what, wanted, size = asked.what, np.array(asked.places), size_of(asked)
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

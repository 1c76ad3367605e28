"""The whole arc over which a mechanism is assembled: its ends, or the turns that close it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdae.motion.continuation.any_path import arc_of
from mechdae.motion.continuation.beyond_ends import NEARER, TIMES
from mechdae.motion.continuation.evaluate import Evaluator
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.path import Path
from mechdae.types import Floats

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


def turn_back(path: Path, evaluator: Evaluator, values: Floats) -> None:
    """Follow a path with one end the other way round, where not all values are before that end."""
    arc = arc_of(path)
    if (arc.low is None) == (arc.high is None) or arc.holds(values).all():
        return
    turn = TURN if arc.low is not None else -TURN
    anchor = arc.first if arc.low is not None else arc.last
    for turns in range(1, MOST_BACK + 1):
        extend(path, anchor + turns * turn, first=True)
        if None not in arc_of(path).ends or comes_back(path, evaluator, turns * turn):
            return


def comes_back(path: Path, evaluator: Evaluator, turned: float) -> bool:
    """Return whether all groups are in their first pose again after whole turns of the driver."""
    s = np.array([path.origin[0]])
    return bool(evaluator.returns(path, path.guess(s), s + turned, s).all())


def assembled(
    path: Path,
    evaluator: Evaluator,
    turn: float | None,
    length: float,
    count: int,
    notes: list[str],
) -> tuple[Floats, list[float | None]]:
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


def _closed(path: Path) -> Floats | None:
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

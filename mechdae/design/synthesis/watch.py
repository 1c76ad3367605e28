"""Transmission angles over a turn: the NLP has poses where they are least."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechdae.design.synthesis.nlp import NewValues, Values
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.space import TURN, WATCHED
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.trace import Trace, grid_of, maxima
from mechdae.motion.measures.transmission import Dyad
from mechdae.types import Floats, Unknowns

SEEN = 1e-9
"""What the sine of an angle may fall below its limit between the poses of the NLP."""


def watched(spread: Spread, d: Floats, u: Floats, x: Unknowns) -> tuple[Floats, Floats, Floats]:
    """Return where the watched transmission angles of a design are least.

    `d`, `u`, `x`: parameters, driver values (k,) over a turn and unknowns (k, nx) there.

    Returns
    -------
    u, x, least
        ``WATCHED`` driver values and their unknowns for each dyad that is watched, and the
        least sine of each.
    """
    space = spread.space
    trace = Trace(spread, d, u, x)
    grid = grid_of(np.append(trace.u, trace.u[0] + TURN))
    places, least = [], []
    for dyad in space.watched_dyads:
        at, tops = maxima(partial(_negative, trace, dyad), grid)
        order = np.argsort(-tops, kind="stable")[:WATCHED]
        least.append(float(-tops[order[0]]) if len(order) else np.nan)
        spare = trace.u[0] + TURN * (np.arange(WATCHED - len(order)) + 0.5) / WATCHED
        places.append(np.concatenate([at[order], spare]))
    nodes = np.concatenate(places) if places else np.zeros(0)
    return nodes, trace.poses(nodes)[0], np.array(least)


def _negative(trace: Trace, dyad: Dyad, u: Floats) -> Floats:
    return -sines(trace, dyad, u)


def sines(trace: Trace, dyad: Dyad, u: Floats) -> Floats:
    """Return the sine of a transmission angle (m,), nan where a pose is not reached."""
    poses = trace.spread.poses
    _, branch, values, held = trace.poses(u)
    k = poses.branch_of(dyad)
    sine = np.abs(poses.sine_of(dyad, values) if k is None else branch[:, k])
    return np.where(held, sine, np.nan)


def fallen(spread: Spread, values: Values, given: Values) -> NewValues | None:
    """Return poses and driver values that see the least angles, None where they are seen."""
    space = spread.space
    if not space.watched_dyads or not space.asked.full_turn:
        return None
    whole = np.reshape(values["turn"], (-1, max(space.poses.nx, 1)))
    d = dimensions(values["d"], given)
    unknowns, x, least = watched(spread, d, space.circle, whole[: space.NODES])
    bounds = np.array([np.sin(asked.min) for asked in space.watched_limits])
    if not (least < bounds - SEEN).any():
        return None
    return {"turn": np.concatenate([whole[: space.NODES], x])}, {"watched": unknowns}

"""Steps of a path around its power series, where tangents prove none of that length."""

from __future__ import annotations

import numpy as np

from mechdae.motion.continuation.path import Front
from mechdae.motion.continuation.series_steps import Stretch
from mechdae.types import Floats

LONGER = 4.0
"""Times a step that is not proved around its tangent, that one around the series must have."""
PARTS = 4
"""Nodes that a step around the series leaves behind."""


def stretched(front: Front, least: float, rest: float, goal: float | None) -> float:
    """Take a step around the path's power series; return its length, 0 where none holds."""
    longest = min(rest, front.path.largest)
    found = _expanded(front, front.sense * longest, min(least, longest))
    if found is None:
        return 0.0
    whole = abs(found.step) == rest
    places = front.s + found.step * np.arange(1, PARTS + 1) / PARTS
    if whole and goal is not None:
        places[-1] = goal
    nodes = []
    for place in places.tolist():
        node = _on(front, found, place)
        if node is None:
            return 0.0
        nodes.append((place, node))
    for at, state in nodes:
        front.append(at, state)
    front.path.counts.steps += 1
    return abs(found.step)


def _expanded(front: Front, step: float, least: float) -> Stretch | None:
    """Return a stretch of the path from the last node, of at most `step`, or None."""
    path, state = front.path, front.state
    known, gone = state[3 * path.graphs.nx :], np.abs(front.x) > path.far / 2
    if path.graphs.course is not None or gone.any() or not np.isfinite(known).all():
        return None  # a law, a pole, or a node that cannot be stepped from
    u, d, *_ = path.motion(front.s)
    blocks = np.flatnonzero(front.alive).tolist()
    return path.finders.expansion.stretch(state, front.s, u, d, step, least, blocks)


def _on(front: Front, found: Stretch, place: float) -> Floats | None:
    """Return the node at a place of a stretch, None where it is not certified."""
    path, alive, n = front.path, front.alive, front.path.graphs.nx
    guess = found.at((place - found.s) / found.step)
    start = np.concatenate([guess, np.zeros(2 * n + path.graphs.nb)])
    state, test, det, _ = path.step(start, place, 0.0)
    unknowns = np.concatenate([path.graphs.blocks[b].own for b in np.flatnonzero(alive)])
    near = np.abs(state[:n] - guess) <= found.radius * (1 + 1e-6) + 1e-300
    proved = path.proved(state, test, det, np.zeros(len(test)), front.sign)
    return state if near[unknowns].all() and proved[alive].all() else None

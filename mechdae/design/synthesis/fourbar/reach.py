"""Targets that no four-bar within the bounds can reach.

The coupler point is no further from the crank's pivot than crank and coupler point together
are long, and two of its places no further apart than twice that. Where this fails for the
largest lengths that the bounds allow, no mechanism exists: that is a proof, not a search
without success.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.design.synthesis.goals.path_generation import VisitsGoal
from mechdae.design.synthesis.search import Search
from mechdae.types import Graph, Points

SX = ca.SX


def out_of_reach(search: Search) -> str:
    """Return why no design exists, empty where that is not proved."""
    space, lead = search.space, search.lead
    loop = space.loop
    stuck = _never_turns(search)
    if stuck:
        return stuck
    if not isinstance(lead, VisitsGoal) or not lead.exact or lead.asked.is_motion or loop is None:
        return ""
    if lead.asked.what.split(".")[0] != loop.coupler or space.asked.choices:
        return ""
    d = SX.sym("d", len(space.names))
    point = loop.point(space.poses.scene, lead.asked.what)
    parts = ca.vertcat(loop.lengths[1], point, loop.pivot)
    function = ca.Function("parts", [d], [space.over_free(parts, d)])
    low, high = _bounds(function, space.box)
    if low is None:
        return ""
    reach = high[0] + float(np.hypot(*np.maximum(np.abs(low[1:3]), np.abs(high[1:3]))))
    targets = lead.targets
    gaps = np.linalg.norm(targets[:, None] - targets[None, :], axis=2)
    if gaps.max() > 2 * reach:
        return (
            f"two targets are {gaps.max():.6g} apart, the coupler point moves within "
            f"{2 * reach:.6g}: no design exists within these bounds"
        )
    beyond = np.maximum(np.maximum(low[3:] - targets, targets - high[3:]), 0.0)
    away = float(np.hypot(*beyond.T).max())
    if away > reach:
        return (
            f"a target is {away:.6g} away from the nearest place of the pivot, the coupler "
            f"point reaches {reach:.6g}: no design exists within these bounds"
        )
    return ""


def _never_turns(search: Search) -> str:
    """Return why no four-bar within the bounds turns fully, empty where that is not proved."""
    space = search.space
    if not search.asked.full_turn or space.loop is None or space.asked.choices:
        return ""
    d = SX.sym("d", len(space.names))
    function = ca.Function("lengths", [d], [space.over_free(space.loop.lengths, d)])
    low, high = _bounds(function, space.box)
    if low is None:
        return ""
    r1, r2, r3, r4 = range(4)
    classes = [
        [((r3, r4), (r2, r1)), ((r1, r4), (r2, r3)), ((r1, r3), (r2, r4))],
        [((r3, r4), (r1, r2)), ((r2, r4), (r1, r3)), ((r2, r3), (r1, r4))],
    ]
    misses = [
        max(low[a] + low[b] - high[c] - high[e] for (c, e), (a, b) in three) for three in classes
    ]
    if min(misses) <= 0:
        return ""
    return (
        f"the driven link of no four-bar within these bounds turns fully: Grashof's condition is "
        f"missed by {min(misses):.6g} at least"
    )


def _bounds(function: Graph, box: Points) -> tuple[Any, Any]:
    """Return bounds of what is a single free parameter or a number in each row, or None."""
    middle = box.mean(axis=1)
    slopes = np.array(function.jacobian()(middle, 0))
    slopes = slopes.reshape(-1, len(box))
    other = np.array(function.jacobian()(box[:, 0] * 0.7 + box[:, 1] * 0.3, 0))
    other = other.reshape(-1, len(box))
    if not np.allclose(slopes, other, atol=1e-9):
        return None, None
    value = np.array(function(middle)).ravel()
    half = np.abs(slopes) @ (np.ptp(box, axis=1) / 2)
    return value - half, value + half

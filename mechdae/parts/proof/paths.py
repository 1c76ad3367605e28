"""Paths as certificates have them: nodes, limit positions, ways across change points.

Of a change point they have exact places, angles and driver in right angles.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.errors import UnavailableError
from mechdae.motion.continuation.any_path import Arc
from mechdae.motion.continuation.legs import Legs
from mechdae.motion.continuation.path import Path
from mechdae.parts.proof.checker import mechanism_of
from mechdae.parts.proof.checker.arithmetic import FalseClaim, exact, exacts
from mechdae.parts.proof.checker.crossings import ExactChangePoint
from mechdae.parts.proof.mechanism import Frames, as_text
from mechdae.parts.proof.space import SpatialFrames
from mechdae.parts.proof.superfluous import origins
from mechdae.types import Floats, Json

if TYPE_CHECKING:
    from mechdae.motion.cases.hard_steps.crossings.across_change_point import Zone

NEAR = 1e-6
"""How far an angle may be off right angles to be taken for them, as near as rounding lets it be."""


def meeting(mechanism: dict[str, Json], bodies: dict[str, list[str]], s: float) -> Json:
    """Return the exact pose near `bodies` at a change point, with the driver at `s`."""
    angles = {body: float(Fraction(place[2])) for body, place in bodies.items()} | {"": s}
    counts = {body: round(angle / (math.pi / 2)) for body, angle in angles.items()}
    if any(abs(angles[body] - count * math.pi / 2) > NEAR for body, count in counts.items()):
        raise _refused("where angles are no right angles", s)
    turns = {body: (0, count) for body, count in counts.items()} | {"ground": (0, 0)}
    found = origins(mechanism, turns)
    if not found.keys() >= bodies.keys():
        raise _refused("where not all bodies are linked by pins", s)
    place = {
        body: [*(str(waves.get((0, "c"), Fraction(0))) for waves in found[body]), str(counts[body])]
        for body in bodies
    }
    m: Any = mechanism_of(mechanism)
    numbers = [v for body in m.bodies for v in exacts(place[body], 3, body)]
    try:
        ExactChangePoint(m, [*numbers, exact(str(counts[""]), "at")], "at")
    except (FalseClaim, ArithmeticError, ValueError) as why:
        raise _refused(f"that is not exact ({why})", s) from None
    return {"at": str(counts[""]), "bodies": place}


def _refused(why: str, s: float) -> UnavailableError:
    return UnavailableError(
        f"no certificate is written of a motion across a change point {why}: near {s:.6g}"
    )


BEFORE = 1e-3
"""Share of the largest step before a limit position from which on the way into it begins."""
MOST_NODES = 24
"""Steps of a path that are written down; the check takes each in as many parts as it needs."""
MOST_STEPS = 20000
"""Steps of a path across change points whose check takes some minutes."""


def path_of(
    path: Path,
    arc: Arc,
    frames: Frames | SpatialFrames,
    places: Floats,
    mechanism: Json,
) -> Json:
    """Return the nodes of a path inside its arc, and the limit positions that end it.

    Where all is linear in the drivers' values there are none: the ends of the poses' `places`.
    """
    nx, ends = path.graphs.nx, [end.s for end in arc.limits if end is not None]
    known = [
        (s, state)
        for s, state in zip(path.s, path.state, strict=True)
        if arc.first <= s <= arc.last and all(abs(s - end) > BEFORE * path.largest for end in ends)
    ]
    inside = [s for s in places if arc.first <= s <= arc.last]
    if inside:  # the way on towards a singular pose proves nothing of the poses
        low, high = (end is not None and end.kind != "limit" for end in arc.limits)
        first = max((s for s, _ in known if s <= min(inside)), default=-np.inf)
        last = min((s for s, _ in known if s >= max(inside)), default=np.inf)
        known = [
            row for row in known if (not low or row[0] >= first) and (not high or row[0] <= last)
        ]
    zones = {zone.low: zone for zone in path.zones}
    known = [row for row in known if not any(z.low < row[0] < z.high for z in path.zones)]
    if not nx:
        reached = {*path.s, float(np.min(places)), float(np.max(places))}
        known = [(s, np.zeros(0)) for s in sorted(reached)]
    nodes = [
        {"at": as_text(s), "bodies": frames.at(state[:nx], path.drivers(np.array([s]))[0])}
        for s, state in known
    ]
    if not nodes:
        raise UnavailableError("no certificate is written of a pose at a limit position alone")
    if not zones:
        count = min(MOST_NODES, len(nodes) - 1)
        nodes = [nodes[k * (len(nodes) - 1) // max(count, 1)] for k in range(count + 1)]
    steps = _steps(path, known, zones) if zones else 1
    if steps > MOST_STEPS:
        raise UnavailableError(
            f"no certificate is written of a path that takes about {steps} steps to check: it "
            "leads across change points to a singular pose"
        )
    found: Json = {**nodes[0], "steps": []}
    for (s, _), (before, after) in zip(known, pairwise(nodes), strict=False):
        step = {"from": before["at"], "to": after["at"], "bodies": after["bodies"]}
        if s in zones:
            place, x = zones[s].s, zones[s].nodes[1][1]
            bodies = frames.at(x, path.drivers(np.array([place]))[0])
            step["through"] = meeting(mechanism, bodies, place)
        found["steps"].append(step)
    for word, end in (("low", arc.low), ("high", arc.high)):
        if end is not None and end.kind == "limit":
            at = np.array([end.s])
            bodies = frames.at(path.guess(at)[0], path.drivers(at)[0])
            found[word] = {"at": as_text(end.s), "bodies": bodies}
    return found


def corners_of(path: Legs, arc: Arc, frames: Frames | SpatialFrames) -> dict[str, Any]:
    """Return the corners of a path of legs that it comes to."""
    nodes = [
        {"at": str(k), "bodies": frames.at(x, path.corners[k])}
        for k, x in enumerate(path.nodes)
        if arc.holds(k)
    ]
    steps = [{"from": a["at"], "to": b["at"], "bodies": b["bodies"]} for a, b in pairwise(nodes)]
    return nodes[0] | {"steps": steps}


def _steps(path: Path, known: list[tuple[float, Floats]], zones: dict[float, Zone]) -> int:
    """Return about how many steps around tangents lead along the nodes of a path.

    As many as a step at whose beginning the test is passed goes into the way to the next node,
    one across a change point.
    """
    count = 0
    for (s, state), (to, _) in pairwise(known):
        parts = 1
        while s not in zones and parts < MOST_STEPS:
            if np.all(path.step(state, s, (to - s) / parts)[1] <= 1):
                break
            parts *= 2
        count += parts
    return count

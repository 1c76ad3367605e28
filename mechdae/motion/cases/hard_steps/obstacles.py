"""What a path meets where its steps shrink: folds, change points, corners of curves, ends.

Each way past one (`PAST_A_STEP` in `motion.cases`) takes a front, the block whose step is not
proved, that step, how far the goal is and where; it returns the step to go on with, None where it
is not the way.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mechdae.kernels.graphs.steps import STRIDE
from mechdae.motion.cases.hard_steps.crossings.across_change_point import Bridge
from mechdae.motion.cases.hard_steps.crossings.change_points import Crossing
from mechdae.motion.cases.hard_steps.cusps import CuspFinder, Touch
from mechdae.motion.continuation.follower import Front
from mechdae.motion.continuation.limit_positions import Limit
from mechdae.motion.continuation.path import APPROACH, SHRUNK, SMALLEST
from mechdae.motion.continuation.series_steps import Stretch
from mechdae.motion.continuation.step_sizes import PASS, ZONE
from mechdae.types import Floats, Unknowns

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


HAIR, MOVED = 1e-7, 1e3
"""Share of the largest step taken over the corner of a curve, and how far the pose may move
over that."""
BESIDE = 1e-3
"""Largest steps before a limit position within which its own expansion tells the poses."""
LARGEST = 0.6
"""Share of the way to a limit position that a step may be."""
STEADY = 0.2
"""Share of the way to a limit position below which steps are taken many at once."""
NEAREST = 1e-6
"""Share of the largest step that must be left for the way across a change point."""
NEARLY_PASSED, NEARLY_TURNED = 2e-6, 1e-5
"""Distance of branches that do not meet up to which their expansions tell where they go: past the
place, or back."""
NARROWER = 12
"""Times the neighbourhood of a change point is halved until its expansion holds."""


WEAK = 1 / 128
"""Share of the largest step below which a step around the series is tried."""
MOST_SMALL_STEPS = 20_000
"""Small steps in a row after which the path is given up as not provable."""


def past_change_point(front: Front, b: int, step: float, rest: float, goal: float) -> float | None:
    """Cross a change point ahead."""
    path, key = front.path, (b, front.sense)
    if step < path.tries.bridge.get(key, SHRUNK * path.largest):
        path.tries.bridge[key] = step / 4
        if across(front, b, rest):
            return path.largest * ZONE
    return None


def past_limit(front: Front, b: int, step: float, rest: float, goal: float) -> float | None:
    """Follow the path into a limit position ahead, where a group ends."""
    path, key = front.path, (b, front.sense)
    if step < path.tries.fold.get(key, SHRUNK * path.largest):
        path.tries.fold[key] = step / 4
        if to_fold(front, b, rest):
            return step
    return None


def by_series(front: Front, b: int, step: float, rest: float, goal: float) -> float | None:
    """Take a step around the power series of the path."""
    path, tries = front.path, front.path.tries
    if step < tries.stretch.get(front.sense, WEAK * path.finders.patience * path.largest):
        taken = stretched(front, LONGER * step, rest, goal)
        if taken:
            tries.fold.clear()
            return min(taken, path.largest)
        tries.stretch[front.sense] = step / 4
    return None


def to_end(front: Front, b: int, step: float, rest: float, goal: float) -> float | None:
    """End the group of a block whose steps have become too small, or step over a corner."""
    path, tries = front.path, front.path.tries
    hopeless = tries.hopeless or tries.laboured > MOST_SMALL_STEPS
    if step >= SMALLEST * path.largest and not hopeless:
        return None
    unknowns = path.graphs.blocks[b].own
    if np.any(np.abs(front.x[unknowns]) > path.far[unknowns] / 2):
        kind = "pole"
    elif step >= SMALLEST * path.largest:
        kind = "unproved"
    else:
        kind = path.finders.limits.kind(b, front.s, front.x)
    if kind == "unproved" and over_corner(front, b):
        return SHRUNK * path.largest
    front.end(end_of(front, b, kind))
    tries.laboured, tries.hopeless = 0, False
    return path.largest


def walk(front: Front, to: float) -> bool:
    """Follow the path to `to` in proved steps; return whether it was reached, nearly."""
    path, sense, alive = front.path, front.sense, front.alive
    step = sense * (to - front.s)
    while (rest := sense * (to - front.s)) > SMALLEST * path.largest:  # less would be rounding
        step = min(step, rest)
        after, proved = front.step(step)
        if proved[alive].all():
            path.counts.steps += 1
            front.append(to if step == rest else front.s + sense * step, after)
        else:
            path.counts.rejected += 1
            step /= 2
            weak = SHRUNK * path.finders.patience * rest
            if step < weak and stretched(front, LONGER * step, rest, to):
                step = sense * (to - front.s)
            elif step < 1e-3 * rest or front.s + sense * step == front.s:
                return False
    return True


def over_corner(front: Front, b: int) -> bool:
    """Take a step of a hair over the corner of a curve in front of block `b`; return whether.

    There the equations are made of two smooth pieces. Next to the pose they have one
    solution for each driver's value if the determinants of both have one sign.
    """
    path, n = front.path, front.path.graphs.nx
    hair = front.sense * HAIR * path.largest
    if path.curves is None or path.block_group[b] not in path.curves.in_pieces:
        return False
    after, place = path.step(front.state, front.s, hair)[0], front.s + hair
    lengths = path.graphs.scene.unknowns.lengths
    near = MOVED * HAIR * np.where(lengths, path.constants.scale, 1.0)
    _, test, det, miss = path.step(after, place, hair)
    proved = path.proved(after, test, det, miss, front.sign)
    if not (np.all(np.abs(after[:n] - front.x) <= near) and proved[front.alive].all()):
        return False
    path.counts.steps += 1
    front.append(place, after)
    return True


# -- limit positions -----------------------------------------------------------------------------


def to_fold(front: Front, b: int, rest: float) -> bool:
    """Follow the path to a fold just ahead of block `b` or of one it depends on."""
    path = front.path
    for k in reversed(path.graphs.ancestors(b)):
        if not front.alive[k]:
            continue
        path.counts.folds += 1
        limit = path.finders.limits.find(k, front.s, front.x, front.sense, path.largest)
        if limit is None:
            continue
        passed = front.s
        if _approach(front, limit, rest):
            return True
        rest -= front.sense * (front.s - passed)
    return False


@np.errstate(invalid="ignore")
def _approach(front: Front, limit: Limit, rest: float) -> bool:
    """Follow the path to a limit position in proved steps; return whether it ends there.

    Stops where the goal lies before the limit, and where the steps do not hold.
    """
    path, sense, alive = front.path, front.sense, front.alive
    share = LARGEST  # the steps that hold near a fold are a fixed share of the distance
    while True:
        distance = sense * (limit.s - front.s)
        if distance <= APPROACH * path.largest:
            return _into(front, limit)
        if distance > rest:
            return False
        passed = front.s
        step, taken = share * distance, 0.0
        below = SHRUNK * path.finders.patience * distance
        while True:
            after, proved = front.step(step)
            bad = (alive & ~proved).nonzero()[0]
            if not bad.size:
                path.counts.steps += 1
                front.append(front.s + sense * step, after)
                break
            path.counts.rejected += 1
            step /= 2
            if step < below and distance > BESIDE * path.largest:
                below = step / 4
                taken = stretched(front, LONGER * step, LARGEST * distance, None)
                if taken:
                    break
            if step < 1e-3 * distance:
                # the proof is too weak here, not of what the fold depends on
                before = path.graphs.ancestors(limit.block)[:-1]
                return not set(before) & set(bad) and _into(front, limit)
        share = LARGEST if taken else min(LARGEST, 1.5 * step / distance)
        if not taken and step < STEADY * distance:
            share = _in_shares(front, limit, step / distance)
        rest -= sense * (front.s - passed)


def _in_shares(front: Front, limit: Limit, share: float) -> float:
    """Take steps that are each a share of what is left to a limit, many in one call.

    Returns the share to go on with: where one step is not proved, that of those before it.
    """
    path, sense = front.path, front.sense
    while True:
        distance = sense * (limit.s - front.s)
        left = math.log(max(1.0, distance / (APPROACH * path.largest))) / -math.log1p(-share)
        count = min(STRIDE, math.ceil(left))
        if not count:
            return share
        ahead = sense * distance * (1 - share) ** np.arange(1, count + 1)
        places = np.concatenate([[front.s], limit.s - ahead])
        states, test, det, miss = path.graphs.strides(
            front.state, places[:-1], np.diff(places), path.whole, count
        )
        good = path.good(states, test, det, miss, front.alive, front.sign)
        held = count if good.all() else int(np.argmin(good))
        path.append_all(places[1 : held + 1].tolist(), list(states[:held]), front.up)
        path.counts.steps += held
        if held < count:
            path.counts.rejected += 1
            return share
        share = min(LARGEST, 1.5 * share)


def _into(front: Front, limit: Limit) -> bool:
    """Record a fold that all later groups can be followed into; return whether they can."""
    path = front.path
    hanging = path.hanging(limit.group) - front.ended
    blocks = [b for b, group in enumerate(path.block_group) if group in hanging]
    led = path.finders.folds.lead(limit, front.s, front.x, blocks)
    if led is None and limit.gap:  # no step can be proved where branches nearly meet
        led = path.finders.folds.beside(limit, front.s, front.x, blocks)
    if led is not None:
        front.end(led)
    return led is not None


# -- change points -------------------------------------------------------------------------------


def across(front: Front, b: int, rest: float) -> bool:
    """Follow the path across a change point of block `b` or of one it depends on.

    Branches that nearly meet and do not for the numbers given are passed, or followed to where
    they turn back, too.
    """
    path, sense = front.path, front.sense
    for k in path.graphs.ancestors(b):
        if not front.alive[k]:
            continue
        found = path.finders.crossings.find(k, front.s, front.state, sense, {})
        if found is None:
            continue
        missed = found.missed
        if missed and found.gap >= (NEARLY_PASSED if missed.passes else NEARLY_TURNED):
            missed = None
        if not (found.meant or missed):
            continue
        if missed and not missed.passes:
            limit = front.path.finders.limits.of_missed(found, front.x, front.sense)
            return limit is not None and _approach(front, limit, rest)
        distance = sense * (found.s - front.s)
        zone = ZONE * path.largest
        if path.within:
            zone = min(zone, rest - distance - SMALLEST * path.largest)
        if distance - zone >= rest or zone < NEAREST * path.largest:
            return False
        taken = go_back(front, found.s - sense * zone)
        crossed = missed is not None and _bridged(front, found, zone, PASS)
        if not crossed and found.meant:
            crossed = _bridged(front, found, zone, path.on_change_point)
        if not crossed:
            for node in taken:
                if sense * (node[0] - front.s) > 0:
                    front.append(*node)
        return crossed
    return False


def go_back(front: Front, place: float) -> list[tuple[float, Floats]]:
    """Take away, and return in order, nodes beyond a place: too near to a change point.

    Kept are nodes where this motion began, of other change points, and before the ends of
    groups: those interpolate.
    """
    path, sense = front.path, front.sense
    ends = [end.s for end in path.ends]
    zone = next(
        (zone for zone in reversed(path.zones) if zone.up == front.up), None
    )  # the farthest
    marks = [path.began, path.origin[0], *ends, *(zone.nodes[0] if zone else ())]
    last = max(sense * mark for mark in marks if sense * (front.s - mark) >= 0)
    taken: list[tuple[float, Floats]] = []
    while sense * (front.s - place) > 0 and sense * front.s > last:
        taken.insert(0, path.pop(front.up))
    return taken


def _bridged(front: Front, found: Crossing, zone: float, action: str) -> bool:
    """Go from the last node to `zone` before a change point, or nearer, and across it."""
    path, sense = front.path, front.sense
    for _ in range(NARROWER):
        zone = min(zone, sense * (found.s - front.s))
        if zone < NEAREST * path.largest:
            return False
        if not walk(front, found.s - sense * zone):
            return False
        node = (front.s, front.state, front.sign, front.alive)
        bridge = path.finders.bridges.build(found, *node, action)
        if bridge is not None:
            _pass(front, bridge)
            return True
        zone /= 2
    return False


def _pass(front: Front, bridge: Bridge) -> None:
    """Put the nodes of a bridge; a group that is to stop ends at the change point."""
    path = front.path
    for s, state in bridge.nodes:
        front.append(s, state)
    path.zones.append(bridge.zone)
    path.tries.bridge.clear()
    for b in bridge.flipped:
        path.flips[b].append(bridge.zone.s)
        path.flips[b].sort()
        front.sign[b] *= -1
    if bridge.zone.action == "stop":
        x = bridge.nodes[0][1][: path.graphs.nx]
        for c in bridge.zone.crossings:
            front.end(Limit(c.s, c.block, c.group, "change_point", x))


# -- ends ----------------------------------------------------------------------------------------


def end_of(front: Front, b: int, kind: str) -> Limit:
    """Return the end of a path that cannot be proved any further for block `b`."""
    path, s, x = front.path, front.s, front.x
    group = path.block_group[b]
    if kind in ("pole", "locked"):
        return Limit(s, b, group, kind, x)
    finder = path.finders.crossings
    near = finder.find(b, s, front.state, front.sense, {}, path.largest)
    if near is not None:
        return Limit(s, b, group, "ambiguous", x, gap=near.gap)
    for k in reversed(path.graphs.ancestors(b)):
        touch = CuspFinder(finder).find(k, s, front.state, front.sense)
        if touch is not None:
            return _touching(touch, s, k, path.block_group[k], x)
    # without a place and its range nothing is said to meet
    return Limit(s, b, group, "unproved" if kind == "change_point" else kind, x)


def _touching(touch: Touch, s: float, b: int, group: int, x: Unknowns) -> Limit:
    """Return the end of a path at `s` just before a place at which branches touch, or nearly do."""
    if not touch.meet:
        return Limit(s, b, group, "ambiguous", x, gap=touch.gap, nearest=touch.s)
    kind = "cusp" if touch.cusp else "change_point"
    within = (touch.low, touch.high)
    limit = Limit(touch.s, b, group, kind, x, gap=touch.gap, reached=s)
    return replace(limit, order=touch.order, within=within)

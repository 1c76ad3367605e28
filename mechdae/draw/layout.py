"""Places for labels where they cover neither the drawing nor each other.

Greedy and deterministic: each label takes the cheapest of its candidate places, the first
ranks before the others and the hardest labels first; then all are reconsidered until
nothing changes, and a label that came off badly may push others aside. Lengths are in
units of the sheet.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

HALO = 4.0
"""More room that a label with segments of its own keeps to those of others,"""
STRANGER = 0.12
"""at this share of their weight."""
OVERLAP = 400.0
"""Cost of covering another label."""
BETWEEN = 20.0
"""Cost of lying between another label and what that belongs to."""
OUTSIDE = 1000.0
"""Cost of leaving the sheet."""
WORTH = 3.0
"""A label that could be so much cheaper is put there, and its rivals move, if that pays."""
MANY = 60
"""With more labels that is left out, for its cost."""
ROUNDS = 4
POOR = 12.0
"""A label that covers so much gets places farther off, if there are better ones."""
RINGS = (0.0, 12.0, 26.0, 42.0, 60.0, 80.0, 105.0, 135.0)
"""How much farther than the farthest place of its own."""


@dataclass(frozen=True)
class Label:
    """A label to be placed.

    Parameters
    ----------
    width, height
        Size of its box.
    places
        (m, 2) candidate places of the middle of the box.
    costs
        (m,) what each place costs in itself; the preferred one is the cheapest.
    """

    width: float
    height: float
    places: Array
    costs: Array
    own: Array | None = None
    """Rows of the segments the label belongs to; it keeps more room to all others."""
    rank: int = 0
    """Labels of lower rank choose first."""
    anchors: Array | None = None
    """Rows (x0, y0, x1, y1) of what the label belongs to: no other label is to lie between."""


def place(labels: Sequence[Label], segments: ArrayLike, boxes: ArrayLike, size: ArrayLike) -> Array:
    """Return the chosen middle of each label, (number of labels, 2).

    Labels that would cover something all the same get places farther off, and all are
    placed once more.

    Parameters
    ----------
    labels
        What is to be placed.
    segments, boxes
        What should stay visible: rows (x0, y0, x1, y1, weight).
    size
        Width and height of the sheet.
    """
    lines = np.asarray(segments, dtype=float).reshape(-1, 5)
    blocks = np.asarray(boxes, dtype=float).reshape(-1, 5)
    area = np.asarray(size, dtype=float)
    near = list(labels)
    fixed = [label.costs + _static(label, lines, blocks, area) for label in near]
    spots, burden = _place(near, fixed)
    poor = np.flatnonzero(burden > POOR).tolist()
    if not poor:
        return spots
    for k in poor:
        near[k] = _wider(labels[k])
        fixed[k] = near[k].costs + _static(near[k], lines, blocks, area)
    others, lighter = _place(near, fixed)
    return others if lighter.sum() < burden.sum() else spots


def _wider(label: Label) -> Label:
    """Return a label with more places, on rings around those it has."""
    middle = label.places.mean(axis=0)
    reach = float(np.hypot(*(label.places - middle).T).max())
    angles = np.arange(36) * np.pi / 18
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    rings = [middle + (reach + step) * circle for step in RINGS]
    rings += [middle + share * reach * circle for share in (0.4, 0.6, 0.8)]
    price = min(float(label.costs.max()), POOR)
    costs = [price + 0.12 * step for step in (*RINGS, 0.0, 0.0, 0.0) for _ in angles]
    return replace(
        label,
        places=np.vstack([label.places, *rings]),
        costs=np.concatenate([label.costs, costs]),
    )


def _place(labels: Sequence[Label], fixed: Sequence[Array]) -> tuple[Array, Array]:
    """Return the middle of each label and how much it covers there.

    ``fixed`` is what each place of a label costs without the other labels.
    """
    rivals = _rivals(labels)
    feet = [_feet(label) for label in labels]
    chosen: list[int | None] = [None] * len(labels)
    order = sorted(
        range(len(labels)), key=lambda i: (labels[i].rank, -round(float(fixed[i].min()), 6))
    )

    known: dict[tuple[int, ...], Array] = {}

    def covering(i: int) -> Array:
        """Return what each place of a label covers of the labels placed so far."""
        picks = [-1 if (pick := chosen[j]) is None else pick for j in rivals[i]]
        key = (i, *picks)
        if key not in known:
            placed = [(j, k) for j, k in zip(rivals[i], picks, strict=True) if k >= 0]
            taken = [(labels[j], k, feet[j]) for j, k in placed]
            known[key] = _covering(labels[i], feet[i], taken)
        return known[key]

    def settle(members: Sequence[int]) -> None:
        for i in members:
            chosen[i] = int(np.argmin(np.round(fixed[i] + covering(i), 9)))

    def total(members: Iterable[int]) -> float:
        cost = 0.0
        for i in members:
            cost += float((fixed[i] + covering(i))[chosen[i] or 0])
        return cost

    for _ in range(ROUNDS):
        before = list(chosen)
        settle(order)
        if chosen == before:
            break
    for i in order if len(labels) <= MANY else ():
        best = int(np.argmin(np.round(fixed[i], 9)))
        if float(fixed[i][chosen[i] or 0] - fixed[i][best]) < WORTH:
            continue
        before, affected = list(chosen), {i, *rivals[i], *(k for j in rivals[i] for k in rivals[j])}
        cost = total(sorted(affected))
        chosen[i] = best
        settle([j for j in order if j in rivals[i]])
        if total(sorted(affected)) > cost - 1e-6:
            chosen[:] = before
    spots = [label.places[pick or 0] for label, pick in zip(labels, chosen, strict=True)]
    burden = []
    for i, label in enumerate(labels):
        pick = chosen[i] or 0
        burden.append(float(fixed[i][pick] - label.costs[pick] + covering(i)[pick]))
    return np.array(spots).reshape(-1, 2), np.array(burden)


def around(
    anchor: ArrayLike,
    width: float,
    height: float,
    gap: float,
    away: ArrayLike = (0.0, 1.0),
    steps: Sequence[float] = (0.0, 3.0, 6.0, 10.0, 15.0, 21.0, 28.0, 36.0),
) -> Label:
    """Return a label with places around a point, best on the side `away`.

    ``gap`` is kept between the point and the label's box.
    """
    middle, favour = np.asarray(anchor, dtype=float), np.asarray(away, dtype=float)
    places, costs = [], []
    for step in steps:
        for angle in np.arange(24) * np.pi / 12:
            out = np.array([np.cos(angle), np.sin(angle)])
            reach = (gap + step) + _support(width, height, out)
            places.append(middle + reach * out)
            costs.append(0.6 * step + 1.2 * (1.0 - float(favour @ out)))
    return Label(width, height, np.array(places), np.array(costs))


def inside(anchor: ArrayLike, width: float, radius: float, favour: ArrayLike) -> Label:
    """Return a square label with places on a circle, best on the side `favour`."""
    out = np.stack([np.cos(np.arange(24) * np.pi / 12), np.sin(np.arange(24) * np.pi / 12)], -1)
    places = np.asarray(anchor, dtype=float) + max(radius, 0.0) * out
    return Label(width, width, places, 1.2 * (1.0 - out @ np.asarray(favour, dtype=float)))


def along(
    pieces: Sequence[tuple[Array, Array]],
    width: float,
    height: float,
    gap: float,
) -> Label:
    """Return a label with places beside lines, best at the middle of the longest."""
    lengths = [float(np.hypot(*(b - a))) for a, b in pieces]
    places, costs = [], []
    for (a, b), length in zip(pieces, lengths, strict=True):
        if length == 0.0:
            continue
        side = np.array([-(b - a)[1], (b - a)[0]]) / length
        shorter = 3.0 * (1.0 - length / max(lengths))
        for share in (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82):
            for step in (0.0, 3.0, 7.0, 12.0, 18.0, 25.0, 33.0):
                for sign in (1.0, -1.0):
                    reach = gap + step + _support(width, height, side)
                    places.append(a + share * (b - a) + sign * reach * side)
                    upper = float(sign * side[1] >= 0)
                    costs.append(shorter + 6.0 * abs(share - 0.5) + 0.35 * step - 0.2 * upper)
    return Label(width, height, np.array(places), np.array(costs))


def merge(first: Label, second: Label, surcharge: float) -> Label:
    """Return a label with the places of both; those of the second cost more."""
    return Label(
        first.width,
        first.height,
        np.vstack([first.places, second.places]),
        np.concatenate([first.costs, second.costs + surcharge]),
        first.own,
        anchors=first.anchors,
    )


def crossing(segments: Array, low: Array, high: Array) -> Array:
    """Return the length of each segment inside each box, (boxes, segments)."""
    start, end = segments[:, 0:2], segments[:, 2:4]
    step = end - start
    enter = np.zeros((len(low), len(segments)))
    leave = np.ones((len(low), len(segments)))
    for axis in (0, 1):
        moving = np.abs(step[:, axis]) > 1e-12
        slope = np.where(moving, step[:, axis], 1.0)
        first = (low[:, axis, None] - start[:, axis]) / slope
        second = (high[:, axis, None] - start[:, axis]) / slope
        inside = (low[:, axis, None] < start[:, axis]) & (start[:, axis] < high[:, axis, None])
        near = np.where(moving, np.minimum(first, second), np.where(inside, 0.0, 2.0))
        far = np.where(moving, np.maximum(first, second), np.where(inside, 1.0, -1.0))
        enter, leave = np.maximum(enter, near), np.minimum(leave, far)
    length: Array = np.clip(leave - enter, 0.0, None) * np.hypot(step[:, 0], step[:, 1])
    return length


def cuts(starts: Array, ends: Array, segments: Array) -> Array:
    """Return how many of the segments each line from start to end crosses, (lines,)."""

    def side(a: Array, b: Array, c: Array) -> Array:
        result: Array = np.sign(
            (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1])
            - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])
        )
        return result

    a, b = starts[:, None], ends[:, None]
    c, d = segments[None, :, 0:2], segments[None, :, 2:4]
    apart = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
    count: Array = apart.sum(axis=1).astype(float)
    return count


def overlap(low: Array, high: Array, other_low: Array, other_high: Array) -> Array:
    """Return the common area of each box with each other box, (boxes, others)."""
    shared = np.minimum(high[:, None], other_high) - np.maximum(low[:, None], other_low)
    result: Array = np.clip(shared, 0.0, None).prod(axis=-1)
    return result


def _corners(label: Label) -> tuple[Array, Array]:
    half = np.array([label.width, label.height]) / 2
    return label.places - half, label.places + half


def _static(label: Label, segments: Array, boxes: Array, size: Array) -> Array:
    """Return what each place of a label covers of the drawing."""
    low, high = _corners(label)
    floor, ceiling = low.min(axis=0), high.max(axis=0)
    near = (
        (np.minimum(segments[:, 0:2], segments[:, 2:4]) <= ceiling + HALO)
        & (np.maximum(segments[:, 0:2], segments[:, 2:4]) >= floor - HALO)
    ).all(axis=1)
    lines = segments[near]
    inside = crossing(lines, low, high)
    cost: Array = ((inside > 0) * lines[:, 4]).sum(axis=1)
    cost += (inside * lines[:, 4]).sum(axis=1) / (label.width + label.height)
    if label.own is not None:
        for rows, sign in ((lines, 1.0), (label.own, -1.0)):
            close = crossing(rows, low - HALO, high + HALO) > 0
            cost += sign * STRANGER * (close * rows[:, 4]).sum(axis=1)
    covered = overlap(low, high, boxes[:, 0:2], boxes[:, 2:4])
    share = covered / (label.width * label.height)
    cost += ((share > 0) * boxes[:, 4] * (1.0 + 2.0 * share)).sum(axis=1)
    out = np.clip(-low, 0.0, None).sum(axis=1) + np.clip(high - size, 0.0, None).sum(axis=1)
    cost += OUTSIDE * (out > 0) + out
    return cost


def _feet(label: Label) -> Array | None:
    """Return for each place the nearest point of what the label belongs to."""
    if label.anchors is None or not len(label.anchors):
        return None
    start, step = label.anchors[:, 0:2], label.anchors[:, 2:4] - label.anchors[:, 0:2]
    length = (step**2).sum(axis=1)
    along = ((label.places[:, None] - start) * step).sum(axis=-1) / np.where(length > 0, length, 1)
    spots = start + np.clip(along, 0.0, 1.0)[..., None] * step
    away = np.hypot(*np.moveaxis(spots - label.places[:, None], -1, 0))
    feet: Array = spots[np.arange(len(spots)), np.argmin(np.round(away, 6), axis=1)]
    return feet


def _rivals(labels: Sequence[Label]) -> list[list[int]]:
    """Return for each label the others that could overlap it somewhere."""
    if not labels:
        return []
    corners = [_corners(label) for label in labels]
    for k, label in enumerate(labels):
        if label.anchors is not None and len(label.anchors):
            ends = label.anchors.reshape(-1, 2)
            corners[k] = (np.vstack([corners[k][0], ends]), np.vstack([corners[k][1], ends]))
    floor = np.array([low.min(axis=0) for low, _ in corners])
    ceiling = np.array([high.max(axis=0) for _, high in corners])
    meet = np.all((floor[:, None] < ceiling) & (ceiling[:, None] > floor), axis=-1)
    np.fill_diagonal(meet, False)
    return [np.flatnonzero(row).tolist() for row in meet]


def _covering(
    label: Label, feet: Array | None, taken: Sequence[tuple[Label, int, Array | None]]
) -> Array:
    """Return what each place of a label covers of labels placed so far."""
    if not taken:
        return np.zeros(len(label.places))
    middles = np.array([other.places[pick] for other, pick, _ in taken])
    halves = np.array([(other.width, other.height) for other, _, _ in taken]) / 2
    low, high = _corners(label)
    covered = overlap(low, high, middles - halves, middles + halves)
    share = covered / (label.width * label.height)
    cost: Array = ((share > 0) * OVERLAP * (0.2 + share)).sum(axis=1)
    if feet is not None:
        own = np.hstack([label.places, feet])
        cost += BETWEEN * (crossing(own, middles - halves, middles + halves) > 0).sum(axis=0)
    others = [[*other.places[pick], *foot[pick]] for other, pick, foot in taken if foot is not None]
    if others:
        cost += BETWEEN * (crossing(np.array(others), low, high) > 0).sum(axis=1)
    return cost


def _support(width: float, height: float, out: Array) -> float:
    """Return how far the middle of a box is from a tangent that has the normal `out`."""
    return float(abs(out[0]) * width + abs(out[1]) * height) / 2

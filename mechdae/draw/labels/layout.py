"""Places for labels where they cover neither the drawing nor each other.

Each label takes the cheapest of its candidate places, the first ranks before the others and
the hardest labels first; then all are reconsidered until nothing changes, and a label that
came off badly may push others aside (`mechdae.draw.labels.arrangement`). Lengths are in units of
the sheet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechdae.draw.labels.arrangement import Arrangement, Candidates
from mechdae.draw.labels.obstacles import Array, Obstacles, length_inside
from mechdae.records import dataclass

POOR = 12.0
"""A label that covers so much gets places farther off, if there are better ones."""
ROUND: Array = np.stack(
    [np.cos(np.arange(24) * np.pi / 12), np.sin(np.arange(24) * np.pi / 12)], axis=-1
)
"""Directions around a point."""
BESIDE: Array = np.array(
    [
        (share, step, sign)
        for share in (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82)
        for step in (0.0, 3.0, 7.0, 12.0, 18.0, 25.0, 33.0)
        for sign in (1.0, -1.0)
    ]
)
"""Places beside a line: share of its length, distance, side."""
MANY = 110
"""So many places of each label are looked at first."""
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
    if not labels:
        return np.zeros((0, 2))
    obstacles = Obstacles(segments, boxes, size)
    candidates = [_candidates(label, obstacles) for label in labels]
    arrangement = Arrangement(candidates)
    arrangement.choose()
    spots, burden = arrangement.spots(), arrangement.burden()
    poor = np.flatnonzero(burden > POOR).tolist()
    if not poor:
        return spots
    for k in poor:
        candidates[k] = _candidates(wider(labels[k]), obstacles, None)
    second = Arrangement(candidates)
    second.choose()
    return second.spots() if second.burden().sum() < burden.sum() else spots


def cheapest(places: Array, half: ArrayLike, obstacles: Obstacles) -> int:
    """Return the first of the places (m, 2) of one box where it covers least.

    ``half`` are the half sides of the box.
    """
    cost = _covered(places, half, obstacles)
    return int(np.argmin(np.round(cost, 9)))


def first_free(places: Array, half: ArrayLike, obstacles: Obstacles) -> int | None:
    """Return the first of the places (m, 2) of one box where it covers nothing, if there is one."""
    free = np.flatnonzero(_covered(places, half, obstacles) == 0.0)
    return int(free[0]) if free.size else None


def _covered(places: Array, half: ArrayLike, obstacles: Obstacles) -> Array:
    sides = np.broadcast_to(np.asarray(half, dtype=float), places.shape)
    return obstacles.cost(places, sides, np.zeros(len(places), dtype=bool))


def _candidates(label: Label, obstacles: Obstacles, most: int | None = MANY) -> Candidates:
    """Return the places of a label that are the cheapest in themselves."""
    half, best = np.array([label.width, label.height]) / 2, np.argsort(label.costs, kind="stable")
    places, costs = label.places[best[:most]], label.costs[best[:most]]
    return Candidates(places, costs, half, label.own, label.anchors, label.rank, obstacles)


def wider(label: Label, steps: Sequence[float] = RINGS, most: float = POOR) -> Label:
    """Return a label with more places, on rings around those it has.

    ``steps`` say how much farther than the farthest of these; they cost ``most`` at most.
    """
    middle = label.places.mean(axis=0)
    reach = float(np.hypot(*(label.places - middle).T).max())
    angles = np.arange(36) * np.pi / 18
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    rings = [middle + (reach + step) * circle for step in steps]
    rings += [middle + share * reach * circle for share in (0.4, 0.6, 0.8)]
    price = min(float(label.costs.max()), most)
    costs = [price + 0.12 * step for step in (*steps, 0.0, 0.0, 0.0) for _ in angles]
    return replace(
        label,
        places=np.vstack([label.places, *rings]),
        costs=np.concatenate([label.costs, costs]),
    )


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
    rings = np.asarray(steps, dtype=float)[:, None]
    reach = gap + rings + np.abs(ROUND) @ (width / 2, height / 2)
    places = middle + (reach[..., None] * ROUND).reshape(-1, 2)
    return Label(width, height, places, (0.6 * rings + 1.2 * (1.0 - ROUND @ favour)).ravel())


def inside(anchor: ArrayLike, width: float, radius: float, favour: ArrayLike) -> Label:
    """Return a square label with places on a circle, best on the side `favour`."""
    places = np.asarray(anchor, dtype=float) + max(radius, 0.0) * ROUND
    return Label(width, width, places, 1.2 * (1.0 - ROUND @ np.asarray(favour, dtype=float)))


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
        reach = gap + _support(width, height, side) + BESIDE[:, 1]
        places.append(a + BESIDE[:, :1] * (b - a) + (BESIDE[:, 2] * reach)[:, None] * side)
        upper = BESIDE[:, 2] * side[1] >= 0
        costs.append(
            3.0 * (1.0 - length / max(lengths))
            + 6.0 * np.abs(BESIDE[:, 0] - 0.5)
            + 0.35 * BESIDE[:, 1]
            - 0.2 * upper
        )
    if not places:
        return around(pieces[0][0], width, height, gap)
    return Label(width, height, np.vstack(places), np.concatenate(costs))


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
    k, s = np.indices((len(low), len(segments))).reshape(2, -1)
    start, end = segments[:, 0:2], segments[:, 2:4]
    line = np.hstack([(start + end) / 2, (end - start) / 2]).T[:, s]
    box = np.hstack([(low + high) / 2, (high - low) / 2]).T[:, k]
    return length_inside(line, box).reshape(len(low), len(segments))


def cuts(starts: Array, ends: Array, segments: Array) -> Array:
    """Return how many of the segments each line from start to end crosses, (lines,)."""

    def side(a: Array, b: Array, c: Array) -> Array:
        return np.sign(
            (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1])
            - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])
        )

    a, b = starts[:, None], ends[:, None]
    c, d = segments[None, :, 0:2], segments[None, :, 2:4]
    apart = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
    count: Array = apart.sum(axis=1).astype(float)
    return count


def _support(width: float, height: float, out: Array) -> float:
    """Return how far the middle of a box is from a tangent that has the normal `out`."""
    return float(abs(out[0]) * width + abs(out[1]) * height) / 2

"""Places for labels where they cover neither the drawing nor each other.

Each label takes the cheapest of its candidate places, the first ranks before the others and
the hardest labels first; then all are reconsidered until nothing changes, and a label that
came off badly may push others aside. Lengths are in units of the sheet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechdae.draw.labels.obstacles import HALO, STRANGER, Array, Obstacles, crosses
from mechdae.records import dataclass
from mechdae.types import Booleans

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
WIDENED = 3
"""So often labels get places farther off."""
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
    placed once more; then those that were pushed into such a place.

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
    best = latest = Arrangement(candidates)
    widened: set[int] = set()
    for _ in range(WIDENED):
        poor = set(np.flatnonzero(latest.burden() > POOR).tolist()) - widened
        if not poor:
            break
        widened |= poor
        for k in poor:
            candidates[k] = _candidates(wider(labels[k]), obstacles, None)
        latest = Arrangement(candidates)
        best = min(best, latest, key=lambda arrangement: float(arrangement.burden().sum()))
    return best.spots()


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


def cuts(starts: Array, ends: Array, segments: Array) -> Array:
    """Return how many of the segments each line from start to end crosses, (lines,)."""
    met = meet(starts[:, None], ends[:, None], segments[None, :, 0:2], segments[None, :, 2:4])
    count: Array = met.sum(axis=1).astype(float)
    return count


def meet(a: Array, b: Array, c: Array, d: Array) -> Booleans:
    """Return whether lines from a to b cross those from c to d, (..., 2) each."""

    def side(p: Array, q: Array, r: Array) -> Array:
        u, v = q - p, r - p
        return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    both: Booleans = side(a, b, c) * side(a, b, d) < 0
    both &= side(c, d, a) * side(c, d, b) < 0
    return both


def feet(places: Array, starts: Array, ends: Array) -> Array:
    """Return the points of lines from start to end that are nearest to places, (..., 2) each."""
    step = ends - starts
    length = (step**2).sum(axis=-1)
    along = ((places - starts) * step).sum(axis=-1) / np.where(length > 0, length, 1.0)
    nearest: Array = starts + np.clip(along, 0.0, 1.0)[..., None] * step
    return nearest


def _support(width: float, height: float, out: Array) -> float:
    """Return how far the middle of a box is from a tangent that has the normal `out`."""
    return float(abs(out[0]) * width + abs(out[1]) * height) / 2


OVERLAP = 400.0
"""Cost of covering another label."""
BETWEEN = 20.0
"""Cost of lying between another label and what that belongs to."""
WORTH = 3.0
"""A label that could be so much cheaper is put there, and its rivals move, if that pays."""
RIVALS = 60
"""With more labels that is left out, for its cost."""
ROUNDS = 4


class Candidates:
    """The places of a label, and what each costs with all it covers of the drawing.

    Parameters
    ----------
    places, costs
        (m, 2) and (m,): middles of its box, and what each costs in itself.
    half
        (2,) half width and height of the box.
    own
        Rows (x0, y0, x1, y1, weight) the label belongs to; it keeps a halo to all others.
    anchors
        Rows (x0, y0, x1, y1) of what the label belongs to: no other label is to lie between.
    rank
        Labels of lower rank choose first.
    """

    def __init__(
        self, places: Array, costs: Array, half: Array, own: Array | None, anchors: Array | None,
        rank: int, obstacles: Obstacles,
    ) -> None:  # fmt: skip
        self.places, self.costs, self.rank = places, costs, rank
        sides = np.tile(half, (len(places), 1))
        self.fixed: Array = costs + obstacles.cost(
            places, sides, np.full(len(places), own is not None)
        )
        if own is not None and len(own):
            self.fixed = self.fixed - STRANGER * _halo(own, places, half)
        near = places if anchors is None or not len(anchors) else feet_of(places, anchors)
        # of each place middle and half sides of its box, middle of the way to its foot, half of it
        self.table: Array = np.hstack([places, sides, (places + near) / 2, (near - places) / 2]).T
        low, high = np.minimum(places - half, near), np.maximum(places + half, near)
        self.boxes, self.box = (
            np.hstack([low, high]),
            np.hstack([low.min(axis=0), high.max(axis=0)]),
        )


class Arrangement:
    """The places that labels choose beside each other.

    Attributes
    ----------
    picks
        By label the number of its place, -1 before it has chosen.
    """

    def __init__(self, labels: Sequence[Candidates]) -> None:
        self.labels, self.picks = list(labels), [-1] * len(labels)
        least = [round(float(label.fixed.min()), 6) for label in labels]
        self.order: list[int] = sorted(
            range(len(labels)), key=lambda i: (labels[i].rank, -least[i])
        )
        self.table, self.boxes = np.zeros((8, len(labels))), np.full((4, len(labels)), np.nan)
        self._choose()

    def _choose(self) -> None:
        """Let all labels choose until nothing changes, and push others aside where that pays."""
        for _ in range(ROUNDS):
            before = list(self.picks)
            self._settle(self.order)
            if self.picks == before:
                break
        for i in self.order if len(self.labels) <= RIVALS else ():
            fixed = self.labels[i].fixed
            best = int(np.round(fixed, 9).argmin())
            if float(fixed[self.picks[i]] - fixed[best]) < WORTH:
                continue
            before, total = list(self.picks), float(self.totals().sum())
            self._put(i, best)
            self._settle([j for j in self.order if j != i and self._meet(j)[i]])
            if float(self.totals().sum()) > total - 1e-6:
                for k, pick in enumerate(before):
                    self._put(k, pick)

    def spots(self) -> Array:
        """Return the middle of each label, (labels, 2)."""
        return self.table[0:2].T

    def totals(self) -> Array:
        """Return what each label costs at its place, (labels,)."""
        return np.array([self._cost(i, [pick])[0] for i, pick in enumerate(self.picks)])

    def burden(self) -> Array:
        """Return how much each label covers at its place, (labels,)."""
        pairs = zip(self.labels, self.picks, strict=True)
        result: Array = self.totals() - np.array([label.costs[pick] for label, pick in pairs])
        return result

    def _settle(self, members: Sequence[int]) -> None:
        """Let labels take the cheapest of their places, one after the other."""
        for i in members:
            self._put(i, int(self._cost(i, slice(None)).round(9).argmin()))

    def _put(self, i: int, pick: int) -> None:
        self.picks[i] = pick
        self.table[:, i], self.boxes[:, i] = (
            self.labels[i].table[:, pick],
            self.labels[i].boxes[pick],
        )

    def _meet(self, i: int) -> Booleans:
        """Return which placed labels come near any place of one."""
        low, high = self.labels[i].box[:2, None], self.labels[i].box[2:, None]
        close = (self.boxes[:2] < high) & (self.boxes[2:] > low)
        near: Booleans = close[0] & close[1]
        near[i] = False
        return near

    def _cost(self, i: int, places: slice | list[int]) -> Array:
        """Return what places of a label cost beside the other labels."""
        one, mine = self.table[:, self._meet(i), None], self.labels[i].table[:, None, places]
        both = one[2:4] + mine[2:4] - np.abs(one[0:2] - mine[0:2])
        both = np.maximum(np.minimum(both, 2 * np.minimum(one[2:4], mine[2:4])), 0.0)
        share = both[0] * both[1] / (4 * mine[2] * mine[3])
        cost = OVERLAP * (0.2 * (share > 0) + share)
        cost += BETWEEN * crosses(one[4:8], mine[0:4])
        cost += BETWEEN * crosses(mine[4:8], one[0:4])
        total: Array = self.labels[i].fixed[places] + cost.sum(axis=0)
        return total


def _halo(own: Array, places: Array, half: Array) -> Array:
    """Return the weight of the own lines that come near a box at each place."""
    middle, way = (own[:, 0:2] + own[:, 2:4]) / 2, (own[:, 2:4] - own[:, 0:2]) / 2
    sides = np.broadcast_to(half + HALO, places.shape)
    box = np.hstack([places, sides]).T[:, :, None]
    return crosses(np.hstack([middle, way]).T, box) @ own[:, 4]


def feet_of(places: Array, anchors: Array) -> Array:
    """Return for each place the nearest point of the lines (x0, y0, x1, y1), (places, 2)."""
    spots = feet(places[:, None], anchors[:, 0:2], anchors[:, 2:4])
    if len(anchors) == 1:
        return spots[:, 0]
    away = np.hypot(*np.moveaxis(spots - places[:, None], -1, 0))
    nearest: Array = spots[np.arange(len(spots)), np.argmin(np.round(away, 6), axis=1)]
    return nearest

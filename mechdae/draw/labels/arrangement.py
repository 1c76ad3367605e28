"""Labels that choose places beside each other: each the cheapest, until nothing changes.

Greedy and deterministic: the hardest labels first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.draw.labels.obstacles import HALO, STRANGER, Array, Obstacles, crosses
from mechdae.types import Booleans

OVERLAP = 400.0
"""Cost of covering another label."""
BETWEEN = 20.0
"""Cost of lying between another label and what that belongs to."""
WORTH = 3.0
"""A label that could be so much cheaper is put there, and its rivals move, if that pays."""
MANY = 60
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
        feet = places if anchors is None or not len(anchors) else feet_of(places, anchors)
        # of each place middle and half sides of its box, middle of the way to its foot, half of it
        self.table: Array = np.hstack([places, sides, (places + feet) / 2, (feet - places) / 2]).T
        low, high = np.minimum(places - half, feet), np.maximum(places + half, feet)
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
        least = [round(float(own.fixed.min()), 6) for own in labels]
        self.order: list[int] = sorted(
            range(len(labels)), key=lambda i: (labels[i].rank, -least[i])
        )
        self.table, self.boxes = np.zeros((8, len(labels))), np.full((4, len(labels)), np.nan)

    def choose(self) -> None:
        """Let all labels choose until nothing changes, and push others aside where that pays."""
        for _ in range(ROUNDS):
            before = list(self.picks)
            self._settle(self.order)
            if self.picks == before:
                break
        for i in self.order if len(self.labels) <= MANY else ():
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
        result: Array = self.totals() - np.array([own.costs[pick] for own, pick in pairs])
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
    start, step = anchors[:, 0:2], anchors[:, 2:4] - anchors[:, 0:2]
    length = (step**2).sum(axis=1)
    along = ((places[:, None] - start) * step).sum(axis=-1) / np.where(length > 0, length, 1.0)
    spots: Array = start + np.clip(along, 0.0, 1.0)[..., None] * step
    if len(anchors) == 1:
        return spots[:, 0]
    away = np.hypot(*np.moveaxis(spots - places[:, None], -1, 0))
    feet: Array = spots[np.arange(len(spots)), np.argmin(np.round(away, 6), axis=1)]
    return feet

"""Labels that choose places beside each other: each the cheapest, until nothing changes.

Greedy and deterministic. What a label covers of the drawing is found out step by step, for
the places that are cheap in themselves first; what it covers of other labels is kept for
all those places, and brought up to date when one of the others moves.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mechdae.draw.labels.obstacles import HALO, STRANGER, Array, Indices, Obstacles, crosses

OVERLAP = 400.0
"""Cost of covering another label."""
BETWEEN = 20.0
"""Cost of lying between another label and what that belongs to."""
WORTH = 3.0
"""A label that could be so much cheaper is put there, and its rivals move, if that pays."""
MANY = 60
"""With more labels that is left out, for its cost."""
ROUNDS = 4
STEP = 40
"""So many places of each label are looked at first."""
GAIN = 0.5
"""Places are not looked at that cannot be so much cheaper."""
Field = tuple[Indices, Array]
"""Places that a label makes dearer, and by how much."""


class Ladder:
    """The places of a label from the cheapest on, and what those looked at cost.

    A place costs at least what it costs in itself: those behind a place that is cheaper with
    all it covers need no look.

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
        self,
        places: Array,
        costs: Array,
        half: Array,
        own: Array | None,
        anchors: Array | None,
        rank: int,
    ) -> None:
        order = np.argsort(costs, kind="stable")
        self.places, self.costs, self.half = places[order], costs[order], half
        self.own, self.anchors, self.rank = own, anchors, rank
        self.fixed: Array = np.zeros(0)

    def rungs(self, limit: float) -> int:
        """Return how many of the places not looked at cost no more than that in themselves."""
        return max(int(np.searchsorted(self.costs, limit - GAIN, "right")) - len(self.fixed), 0)

    def feet(self, places: Array) -> Array:
        """Return the nearest point of what the label belongs to, else the places."""
        anchors = self.anchors
        if anchors is None or not len(anchors):
            return places
        if len(anchors) == 1 and (anchors[0, 0:2] == anchors[0, 2:4]).all():
            return np.broadcast_to(anchors[0, 0:2], places.shape)
        return feet_of(places, anchors)


class Arrangement:
    """The places that labels have chosen so far.

    Parameters
    ----------
    ladders
        The places of each label.
    obstacles
        The drawing.

    Attributes
    ----------
    picks
        By label the place on its ladder, -1 before it has chosen.
    """

    # of each place looked at: middle, half sides of its box, middle of the way to its foot and
    # half that way, corners of box and foot
    _table: Array

    def __init__(self, ladders: Sequence[Ladder], obstacles: Obstacles) -> None:
        self.ladders, self.obstacles = list(ladders), obstacles
        self.picks = [-1] * len(self.ladders)
        self._rows: list[Indices] = [np.zeros(0, dtype=np.intp)] * len(self.ladders)
        self._table, self._owner = np.zeros((12, 0)), np.zeros(0, dtype=np.intp)
        self._cover, self._fields = np.zeros(0), dict[int, Field]()
        self._restless = np.ones(len(self.ladders), dtype=bool)
        self._look(dict.fromkeys(range(len(self.ladders)), STEP))

    def choose(self) -> None:
        """Let all labels choose until nothing changes."""
        rounds = ROUNDS
        while rounds:
            order, before = self._order(), list(self.picks)
            self._settle(order)
            totals = self.totals()
            pairs = enumerate(zip(self.ladders, totals, strict=True))
            short = {i: own.rungs(float(total)) for i, (own, total) in pairs}
            if any(short.values()):
                self._look({i: rungs for i, rungs in short.items() if rungs})
            elif self.picks == before:
                break
            else:
                rounds -= 1
        if len(self.ladders) <= MANY:
            self._push(order)

    def widen(self, ladders: dict[int, Ladder]) -> None:
        """Give some labels other places; they choose anew."""
        for i, ladder in ladders.items():
            self._put(i, -1)
            self.ladders[i], self._rows[i] = ladder, self._rows[i][:0]
        self._look(dict.fromkeys(ladders, STEP))

    def spots(self) -> Array:
        """Return the middle of each label, (labels, 2)."""
        pairs = zip(self.ladders, self.picks, strict=True)
        return np.array([ladder.places[pick] for ladder, pick in pairs]).reshape(-1, 2)

    def totals(self) -> Array:
        """Return what each label costs at its place, (labels,)."""
        at = [self._at(i, pick) for i, pick in enumerate(self.picks)]
        fixed = [own.fixed[pick] for own, pick in zip(self.ladders, self.picks, strict=True)]
        result: Array = np.array(fixed) + self._cover[at]
        return result

    def burden(self) -> Array:
        """Return how much each label covers at its place, (labels,)."""
        pairs = zip(self.ladders, self.picks, strict=True)
        result: Array = self.totals() - np.array([own.costs[pick] for own, pick in pairs])
        return result

    def _order(self) -> list[int]:
        """Return the labels in the order in which they choose: the hardest first."""
        least = [round(float(ladder.fixed.min()), 6) for ladder in self.ladders]
        return sorted(range(len(least)), key=lambda i: (self.ladders[i].rank, -least[i]))

    def _at(self, i: int, pick: int) -> int:
        return int(self._rows[i][pick])

    def _look(self, rungs: dict[int, int]) -> None:
        """Compute the cost of so many more places, and of later ones that might be cheaper."""
        first = self._table.shape[1]
        while rungs:
            members = list(rungs)
            ladders = [self.ladders[i] for i in members]
            starts = [len(ladder.fixed) for ladder in ladders]
            places = [
                own.places[k : k + more]
                for own, k, more in zip(ladders, starts, rungs.values(), strict=True)
            ]
            counts = [len(own) for own in places]
            half = np.repeat(np.array([ladder.half for ladder in ladders]), counts, axis=0)
            middle = np.vstack(places)
            shy = np.repeat([ladder.own is not None for ladder in ladders], counts)
            cost = self.obstacles.cost(middle, half, shy)
            ends = np.cumsum([0, *counts])
            feet = []
            for k, (i, ladder) in enumerate(zip(members, ladders, strict=True)):
                a, b = ends[k], ends[k + 1]
                more = ladder.costs[starts[k] : starts[k] + counts[k]] + cost[a:b]
                if ladder.own is not None and len(ladder.own):
                    more = more - STRANGER * _halo(ladder.own, places[k], ladder.half)
                ladder.fixed = np.concatenate([ladder.fixed, more])
                feet.append(ladder.feet(places[k]))
                begin = self._table.shape[1]
                self._rows[i] = np.concatenate([self._rows[i], np.arange(begin + a, begin + b)])
            foot = np.vstack(feet)
            low, high = np.minimum(middle - half, foot), np.maximum(middle + half, foot)
            rows = [middle, half, (middle + foot) / 2, (foot - middle) / 2, low, high]
            self._table = np.hstack([self._table, np.hstack(rows).T])
            self._owner = np.concatenate([self._owner, np.repeat(members, counts)])
            further = {i: self.ladders[i].rungs(float(self.ladders[i].fixed.min())) for i in rungs}
            known = [len(ladder.fixed) for ladder in ladders]
            pairs = zip(further.items(), known, strict=True)
            rungs = {i: min(count, limit) for (i, count), limit in pairs if count}
        self._append(first)

    def _append(self, first: int) -> None:
        """Find out what the labels placed so far make dearer of the places from `first` on."""
        self._cover = np.concatenate([self._cover, np.zeros(self._table.shape[1] - first)])
        self._restless[self._owner[first:]] = True
        placed = [self._at(i, pick) for i, pick in enumerate(self.picks) if pick >= 0]
        known = self._fields
        self._fields = self._found(placed, first)
        for at, (rows, cost) in self._fields.items():
            self._cover[rows] += cost
            old = known[at]
            self._fields[at] = np.concatenate([old[0], rows]), np.concatenate([old[1], cost])
        pairs = [(i, own) for i, own in enumerate(self.ladders) if self.picks[i] < 0]
        likely = [self._at(i, int(own.fixed.argmin())) for i, own in pairs]
        self._fields.update(self._found(likely, 0))

    def _settle(self, members: Iterable[int]) -> None:
        """Let labels take the cheapest of their places, one after the other."""
        for i in members:
            if self._restless[i]:
                cost = self.ladders[i].fixed + self._cover[self._rows[i]]
                self._put(i, int(cost.round(9).argmin()))
                self._restless[i] = False

    def _put(self, i: int, pick: int) -> None:
        for place, sign in ((self.picks[i], -1.0), (pick, 1.0)):
            if pick != self.picks[i] and place >= 0:
                rows, cost = self._field(self._at(i, place))
                self._cover[rows] += sign * cost
                self._restless[self._owner[rows]] = True
        self.picks[i], self._restless[i] = pick, True

    def _push(self, order: Sequence[int]) -> None:
        """Put labels with bad places at their best ones, where the sum of all costs falls."""
        for i in order:
            fixed = self.ladders[i].fixed
            best = int(np.round(fixed, 9).argmin())
            if float(fixed[self.picks[i]] - fixed[best]) < WORTH:
                continue
            before, cost = list(self.picks), float(self.totals().sum())
            moved = [self._field(self._at(i, pick))[0] for pick in (best, self.picks[i])]
            touched = set(self._owner[np.concatenate(moved)].tolist())
            self._put(i, best)
            self._settle([j for j in order if j in touched])
            if float(self.totals().sum()) > cost - 1e-6:
                for j, pick in enumerate(before):
                    self._put(j, pick)

    def _field(self, at: int) -> Field:
        """Return which places of others one place makes dearer, and by how much."""
        if at not in self._fields:
            self._fields.update(self._found([at], 0))
        return self._fields[at]

    def _found(self, places: Sequence[int], first: int) -> dict[int, Field]:
        """Return that for several places, of the places of others from `first` on."""
        member, rows, cost = self._dearer(places, first)
        ends = np.searchsorted(member, np.arange(len(places) + 1)).tolist()
        return {
            at: (rows[a:b], cost[a:b]) for at, a, b in zip(places, ends, ends[1:], strict=False)
        }

    def _dearer(self, places: Sequence[int], first: int) -> tuple[Indices, Indices, Array]:
        """Return which of the places from `first` on some places make dearer.

        Returns
        -------
        tuple
            Index in `places`, index of the other place, cost.
        """
        k, table = np.array(places, dtype=np.intp), self._table
        left, bottom, right, top = table[8:12, k, None]
        near = (table[8, first:] < right) & (table[10, first:] > left)
        near &= (table[9, first:] < top) & (table[11, first:] > bottom)
        near &= self._owner[first:] != self._owner[k, None]
        member, rows = np.divmod(np.flatnonzero(near), near.shape[1] or 1)
        rows += first
        one, other = table[:8, k[member]], table[:8, rows]
        both = one[2:4] + other[2:4] - np.abs(one[0:2] - other[0:2])
        both = np.minimum(both, 2 * np.minimum(one[2:4], other[2:4]))
        share = np.maximum(both[0], 0.0) * np.maximum(both[1], 0.0) / (4 * other[2] * other[3])
        cost = OVERLAP * (0.2 * (share > 0) + share)
        cost += BETWEEN * crosses(one[4:8], other[0:4])
        cost += BETWEEN * crosses(other[4:8], one[0:4])
        there = np.flatnonzero(cost)
        return member[there], rows[there], cost[there]


def _halo(own: Array, places: Array, half: Array) -> Array:
    """Return the weight of the own lines that come near a box at each place."""
    middle, way = (own[:, 0:2] + own[:, 2:4]) / 2, (own[:, 2:4] - own[:, 0:2]) / 2
    sides = np.broadcast_to(half + HALO, places.shape)
    box = np.hstack([places, sides]).T[:, :, None]
    close: Array = crosses(np.hstack([middle, way]).T, box) @ own[:, 4]
    return close


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

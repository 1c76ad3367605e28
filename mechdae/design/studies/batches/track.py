"""The certified motions of many lanes as something that can be evaluated anywhere.

As `mechdae.motion.measures.track` has it for one motion: zeros of functions are bracketed between
samples and refined, so that what is read off does not depend on the poses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mechdae.design.studies.batches.poses import AT_ONCE, LaneNodes, LanePoses, Lanes
from mechdae.motion.measures.along_sweep_extremes import AT_REST, SHORT
from mechdae.motion.measures.track import FINEST, brackets
from mechdae.numerics.roots import refined
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Matrix, Unknowns

Family = Callable[[list[Any], Any], tuple[Any, Any]]
"""From y, y', ... (columns, n) and the lanes (n,) to functions and their slopes, (m, n) each."""


@dataclass(frozen=True)
class Zeros:
    """Places at which functions vanish: which function, lane, place, whether it rises, (n,)."""

    member: Integers
    lane: Integers
    s: Floats
    rising: Booleans

    def of(self, member: int) -> tuple[Any, Any, Any]:
        """Return lanes, places and senses of one function."""
        chosen = self.member == member
        return self.lane[chosen], self.s[chosen], self.rising[chosen]


class LaneTrack:
    """Lanes that go through their whole way.

    `first`, `last` (k,): ends of the ways that are looked at. `scale` (k,): lengths of the
    mechanisms [m]. `step` (k,): largest steps of a single path. `sense`: 1 where the poses follow
    one another upwards, else -1. ``lane``, ``s`` (n,): the sample: places close enough to see every
    turn, lane by lane, ends included. ``y`` list of (columns, n) arrays: what is evaluated there,
    and its derivatives by the driver. ``good`` (k,): lanes that are certified wherever they were
    evaluated.
    """

    def __init__(
        self, poses: LanePoses, lanes: Lanes, nodes: LaneNodes, first: Floats, last: Floats,
        scale: Floats, step: Floats, is_angle: bool, sense: float = 1.0,
    ) -> None:  # fmt: skip
        self.poses, self.lanes, self.nodes = poses, lanes, nodes
        self.first, self.last, self.scale, self.step = first, last, scale, step
        self.sense = sense
        self.unit: Floats = np.ones(len(scale)) if is_angle else scale
        self.good: Booleans = np.ones(len(scale), bool)
        self.place: dict[int, int] = {column: k for k, column in enumerate(poses.asked.columns)}
        self.lane, self.s, node = self._places()
        self.y: list[Matrix] = self.at(self.lane, self.s, node)
        self.next: Booleans = self.lane[:-1] == self.lane[1:]

    def _places(self) -> tuple[Integers, Floats, Integers]:
        """Return lanes and places of the sample: nodes, ends, and more where a body turns fast."""
        nodes, angles = self.nodes, self.poses.graphs.scene.unknowns.turns
        s, lane = nodes.s, nodes.lanes
        same = lane[:-1] == lane[1:]
        x = nodes.states[:, 0, angles]
        turned = np.abs(np.diff(x, axis=0)).max(axis=1, initial=0.0)
        with np.errstate(invalid="ignore"):
            count = np.where(same, np.ceil(np.nan_to_num(turned) / FINEST), 1).astype(int)
        count = np.append(np.clip(count, 1, 64), 1)
        start = np.repeat(np.cumsum(count) - count, count)
        share = (np.arange(count.sum()) - start) / np.repeat(count, count)
        node = np.where(share == 0, np.repeat(np.arange(len(s)), count), -1)
        width = np.append(np.where(same, np.diff(s), 0.0), 0.0)
        lane, s = np.repeat(lane, count), np.repeat(s, count) + share * np.repeat(width, count)
        inside = (s > self.first[lane]) & (s < self.last[lane])
        every = np.arange(len(self.first))
        lane = np.concatenate([lane[inside], every, every])
        s = np.concatenate([s[inside], self.first, self.last])
        node = np.concatenate([node[inside], np.full(2 * len(every), -1)])
        order = np.lexsort((s, lane))
        return lane[order], s[order], node[order]

    def at(self, lane: Any, s: Floats, node: Integers | None = None) -> list[Matrix]:
        """Return y, y', ... (columns, n) at places of lanes (n,), `node` those that are nodes."""
        order = np.argsort(lane, kind="stable")  # a guess takes lanes in their order
        lane, s = lane[order], s[order]
        node = np.full(len(s), -1) if node is None else node[order]
        piece = self.nodes.piece(lane, s)
        width, parts = len(self.place), []
        for start in range(0, len(s), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            guess = self._guess(lane[some], piece[some], s[some], node[some])
            found, sure = self.poses.certified(self.lanes.take(lane[some]), guess, s[some])
            parts.append(found)
            self.good[lane[some][~sure]] = False
        y = np.empty((width * (self.poses.asked.order + 1), len(s)))
        if parts:
            y[:, order] = np.concatenate(parts, axis=1)
        return np.split(y, range(width, len(y), width)) if width else [y]

    def _guess(self, lane: Integers, piece: Integers, s: Floats, node: Integers) -> Unknowns:
        """Return unknowns (nx, n), those of nodes as they are."""
        known = node >= 0
        guess = np.empty((self.nodes.states.shape[2], len(s)))
        guess[:, known] = self.nodes.states[node[known], 0].T
        if not known.all():
            other = ~known
            guess[:, other] = self.nodes.guess(lane[other], piece[other], s[other])
        return guess

    def column(self, y: list[Floats], order: int, columns: Sequence[int]) -> Floats:
        """Return columns of the outputs (m, n) from what `at` gives."""
        return y[order][[self.place[column] for column in columns]]

    def zeros(self, family: Family, moving: Booleans | None = None) -> Zeros:
        """Return where functions vanish: sign changes between samples, refined.

        Where a function turns round between two samples without one, it is evaluated there once
        more. `moving` (m, k) leaves out functions that are rounding noise.
        """
        f, df = family(self.y, self.lane)
        if moving is not None:
            f = np.where(moving[:, self.lane], f, np.nan)

        def value(rows: Integers, columns: Integers, places: Floats) -> Any:
            values = family(self.at(self.lane[rows], places), self.lane[rows])[0]
            return values[columns, np.arange(len(rows))]

        rows, member, a, b, rising = brackets(self.s, f.T, df.T, value, self.next[:, None])
        lane, whole = self.lane[rows], (a == self.s[rows]) & (b == self.s[rows + 1])
        with np.errstate(invalid="ignore", divide="ignore"):
            share = f[member, rows] / (f[member, rows] - f[member, rows + 1])
        share = np.where((share >= 0) & (share <= 1), share, 0.5)
        first = np.where(whole, a + share * (b - a), (a + b) / 2)

        def evaluate(rows: Integers, places: Floats) -> tuple[Floats, Floats]:
            values = family(self.at(lane[rows], places), lane[rows])
            which = np.arange(len(rows))
            return values[0][member[rows], which], values[1][member[rows], which]

        s, lost = refined(evaluate, a, b, rising, self.unit[lane], first)
        self.good[lane[np.isfinite(lost)]] = False
        remaining = np.isfinite(s)
        return Zeros(member[remaining], lane[remaining], s[remaining], rising[remaining])

    # -- what moves ------------------------------------------------------------------------

    def travel(self, columns: Sequence[int]) -> Floats:
        """Return the greatest less the least value of columns (m,) over the sample, (m, k)."""
        values = self.column(self.y, 0, columns)
        start = np.searchsorted(self.lane, np.arange(len(self.first)))
        top = np.maximum.reduceat(values, start, axis=1)
        return top - np.minimum.reduceat(values, start, axis=1)

    def moves(self, columns: list[int], size: Floats) -> Booleans:
        """Return which columns move in which lanes (m, k), measured by `size` (m, k)."""
        moving = self.travel(columns) > AT_REST * size
        values = self.column(self.y, 0, columns)
        still = np.abs(np.diff(values, axis=1)) <= AT_REST * size[:, self.lane[1:]]
        still &= (np.diff(self.s) > SHORT * self.unit[self.lane[1:]]) & self.next
        rests = (still & moving[:, self.lane[1:]]).any(axis=0)
        self.good[self.lane[1:][rests]] = False
        return moving

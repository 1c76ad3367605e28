"""How far bodies turn and joints slide in lanes that go through their whole way.

As of a single sweep: stationary values between nodes are bracketed by the sign of the first
derivative and refined, so that they do not depend on the poses.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.continuation.interpolate import turning
from mechdae.studies.batches.poses import AT_ONCE, LaneNodes, LanePoses, Lanes

ITERATIONS = 8
SAME = 1e-6
"""Share of a bracket within which a place is good enough."""


class LaneSpans:
    """Differences of the largest and the smallest value of some columns over lanes.

    Parameters
    ----------
    poses
        Evaluates columns with two derivatives.
    columns
        Of y.
    """

    def __init__(self, poses: LanePoses, columns: list[int]) -> None:
        self.poses, self.width = poses, len(poses.asked.columns)
        self.places = [poses.asked.columns.index(column) for column in columns]

    def __call__(self, lanes: Lanes, nodes: LaneNodes) -> tuple[Any, Any]:
        """Return the spans (k, columns), and which lanes (k,) are certified at all places."""
        k, m = len(nodes.count), len(self.places)
        good = np.ones(k, bool)
        x = nodes.states[:, 0].T
        y, sure = self._at(lanes, nodes.lanes, x, nodes.s)
        np.logical_and.at(good, nodes.lanes, sure)
        least, most = np.full((m, k), np.inf), np.full((m, k), -np.inf)
        self._enter(least, most, nodes.lanes[None], y[0])
        same = nodes.lanes[:-1] == nodes.lanes[1:]
        column, i = np.nonzero((y[1][:, :-1] * y[1][:, 1:] < 0) & same)
        if not len(i):
            return (most - least).T, good
        a, b, lane = nodes.s[i], nodes.s[i + 1], nodes.lanes[i]
        ends = [values[column, at] for at in (i, i + 1) for values in y]
        s = a + turning(b - a, *ends)[0]
        for _ in range(ITERATIONS):
            piece = np.argsort(lane, kind="stable")  # a guess takes lanes in their order
            guess = np.empty((x.shape[0], len(s)))
            guess[:, piece] = nodes.guess(lane[piece], i[piece], s[piece])
            here, sure = self._at(lanes, lane, guess, s)
            value, rate, bend = (values[column, np.arange(len(s))] for values in here)
            with np.errstate(invalid="ignore", divide="ignore"):
                step = np.nan_to_num(np.where(bend != 0, rate / bend, 0.0))
            if np.all(np.abs(step) <= SAME * (b - a)):
                break
            s = np.clip(s - step, a, b)
        np.logical_and.at(good, lane, sure)
        np.minimum.at(least, (column, lane), value - rate * step / 2)
        np.maximum.at(most, (column, lane), value - rate * step / 2)
        return (most - least).T, good

    @staticmethod
    def _enter(least: Any, most: Any, lanes: Any, values: Any) -> None:
        for low, high, own in zip(least, most, values, strict=True):
            np.minimum.at(low, lanes[0], own)
            np.maximum.at(high, lanes[0], own)

    def _at(self, lanes: Lanes, lane: Any, guess: Any, s: Any) -> tuple[list[Any], Any]:
        """Return y, y', y'' (columns, n) at places of lanes (n,), and which are certified."""
        parts, sure = [], []
        for first in range(0, len(s), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            own = lanes.take(lane[some])
            results, good = self.poses.certified(own, guess[:, some], s[some])
            parts.append(results)
            sure.append(good)
        y = np.concatenate(parts, axis=1)
        orders = (y[order * self.width :][self.places] for order in range(3))
        return list(orders), np.concatenate(sure)

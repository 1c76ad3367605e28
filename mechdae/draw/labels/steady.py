"""Labels whose places are chosen once for a range of poses: they move with points and bodies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mechdae.draw.diagram.loads import Mark
from mechdae.draw.labels.labels import Writing, load_names, write_label
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.draw.primitives import PAPER, Anchor, Array
from mechdae.draw.sheet import Sheet
from mechdae.records import dataclass

POSES = 9
"""Poses in which places of labels are compared."""
FAITH = 3.0
"""How much more than in one pose a place costs that is far from what a label belongs to."""
TAKEN = 400.0
"""Weight of what a label covers of another one."""


def compared(known: Sequence[int], pose: int) -> list[int]:
    """Return poses in which places of labels are compared, that drawn first."""
    picks = np.linspace(0, len(known) - 1, min(POSES, len(known))).round().astype(int)
    return [pose, *(known[k] for k in dict.fromkeys(picks.tolist()) if known[k] != pose)]


class AnchorFrame:
    """Where the corners of what moves with an anchor are, in one pose."""

    def __init__(self, sheet: Sheet, scene: Any, pose: int, anchor: Anchor) -> None:
        self.sheet, self.scene, self.pose, self.anchor = sheet, scene, pose, anchor
        self.bases = np.array([self.base(point) for point in anchor.points] or np.zeros((1, 2)))
        angle = self.angle(anchor.turn)
        c, s = np.cos(angle), np.sin(angle)
        self.turn = np.array([[c, s], [-s, c]])

    def base(self, point: str) -> Array:
        """Return a point on the sheet."""
        return self.sheet.at(self.scene.place(point, self.pose))

    def angle(self, turn: str) -> float:
        """Return the angle [rad] of the frame that ways are told in."""
        return float(self.scene.angles[turn][self.pose]) if turn else 0.0

    def length(self, grow: str) -> float:
        """Return the length on the sheet that ways are proportional to."""
        if grow == "m":
            return self.sheet.metre
        if ">" in grow:
            a, b = (self.base(point) for point in grow.split(">"))
            return float(np.hypot(*(b - a)))
        name, _, key = grow.partition("/")
        number = self.scene.numbers[f"{name}.{'roller_radius' if key == 'roller' else key}"]
        return float(abs(number) * self.sheet.metre)

    def shares(self, corners: Array) -> Array:
        """Return how far corners are from the first to the second point of a span, (n,)."""
        if not self.anchor.span:
            return np.zeros(len(corners))
        if self.anchor.weight:
            return np.array(self.anchor.weight * len(corners))[: len(corners)]
        way = self.bases[1] - self.bases[0]
        shares: Array = (corners - self.bases[0]) @ way / max(float(way @ way), 1e-12)
        return np.clip(shares, 0.0, 1.0)

    def local(self, corners: Array) -> Array:
        """Return the ways of corners from what they keep to, in its frame."""
        found: Array = (corners - self._held(corners, self.shares(corners))) @ self.turn.T
        return found

    def placed(self, ways: Array) -> Array:
        """Return where labels are: that are told from the middle of all points."""
        found: Array = self.bases.mean(axis=0) + ways @ self.turn
        return found

    def _held(self, corners: Array, shares: Array) -> Array:
        if self.anchor.span:
            between: Array = self.bases[0] + shares[:, None] * (self.bases[1] - self.bases[0])
            return between
        each = len(self.bases) == len(corners) and self.anchor.spot is None
        return self.bases if each else self.bases.mean(axis=0)


@dataclass(frozen=True)
class SteadyLabels:
    """Labels, each with what it moves with and its way from there.

    ``frame_of`` gives the frame of an anchor on a sheet, in a pose.
    """

    labels: tuple[tuple[Writing, Anchor, Array], ...]
    frame_of: Callable[[Sheet, int, Anchor], AnchorFrame]

    def write(self, sheet: Sheet, pose: int, marks: Sequence[Mark] = ()) -> None:
        """Write the labels of a pose, of loads those that were drawn."""
        texts = {label.gid: label.text for label in load_names(marks)}
        for label, anchor, way in self.labels:
            spot = self.frame_of(sheet, pose, anchor).placed(way[None])[0]
            text = texts.get(label.gid, "") if label.kind == "load" else label.text
            if not text or not np.isfinite(spot).all():
                continue
            with sheet.held(Anchor(anchor.points, anchor.turn, spot=(*spot.tolist(),))):
                write_label(sheet, label, spot, text)


def chosen_labels(
    sheets: Sequence[Sheet],
    poses: Sequence[int],
    rows: Sequence[Sequence[Writing]],
    anchors_of: Callable[[Writing], list[Anchor]],
    frame_of: Callable[[Sheet, int, Anchor], AnchorFrame],
) -> SteadyLabels:
    """Return labels where they cover least in all poses.

    ``rows`` are the labels of each pose, drawn on its sheet, with their possible places;
    ``anchors_of`` gives what a label may move with.
    """
    every = [{label.gid: label for label in row} for row in rows]
    blocks = [Obstacles(*sheet.obstacles(), sheet.size) for sheet in sheets]
    found = []
    for first in sorted(every[0].values(), key=lambda label: label.kind == "number"):
        there = [k for k, row in enumerate(every) if first.gid in row]
        half = np.array([first.label.width, first.label.height]) / 2
        best: tuple[float, Anchor, Array, list[Array]] = np.inf, PAPER, np.zeros(2), []
        for anchor in anchors_of(first):
            frames = [frame_of(sheets[k], poses[k], anchor) for k in there]
            ways = frames[0].local(first.label.places)
            spots, cost = [frame.placed(ways) for frame in frames], np.zeros(len(ways))
            for k, at in zip(there, spots, strict=True):
                shy, label = (
                    np.full(len(at), first.label.own is not None),
                    every[k][first.gid].label,
                )
                cost += blocks[k].cost(at, np.broadcast_to(half, at.shape), shy)
                same = anchor.turn or len(label.costs) != len(cost)
                cost += FAITH * (first.label if same else label).costs
            i = int(np.argmin(np.round(cost, 6)))
            if cost[i] < best[0] - 1e-6:
                best = float(cost[i]), anchor, ways[i], [at[i] for at in spots]
        for k, spot in zip(there, best[3], strict=True):
            box = np.array([[*(spot - half), *(spot + half), TAKEN]])
            blocks[k].areas = np.vstack([blocks[k].areas, box])
        found.append((first, best[1], best[2]))
    return SteadyLabels(tuple(found), frame_of)

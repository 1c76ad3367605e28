"""Labels whose places are chosen once for a range of poses: they move with points and bodies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from mechdae.draw.diagram.loads import Mark
from mechdae.draw.labels import layout
from mechdae.draw.labels.labels import Writing, load_names, write_label
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.sheet import Sheet
from mechdae.records import dataclass
from mechdae.types import Floats, Matrix

POSES = 37
"""Poses in which places of labels are compared."""
GLIDE = 0.25, 0.75
"""Between which shares of the way from one of them to the next a label goes elsewhere."""
MOVES = 20.0, 0.8
"""What it costs that a label goes to another place: in itself, and for each unit of the way."""
WIDER = 0.0, 12.0
"""How much farther off a label may be that covers twice `POOR` in the mean of the poses."""
TAKEN = 400.0
"""Weight of what a label covers of another one."""


def compared(known: Sequence[int], pose: int) -> list[int]:
    """Return poses in which places of labels are compared, that drawn first."""
    picks = np.linspace(0, len(known) - 1, min(POSES, len(known))).round().astype(int)
    return [pose, *(known[k] for k in dict.fromkeys(picks.tolist()) if known[k] != pose)]


class AnchorFrame:
    """Where the corners of what moves with an anchor are, in one pose."""

    def __init__(self, sheet: Sheet, scene: Any, pose: int, anchor: Anchor) -> None:
        self.sheet: Sheet = sheet
        self.scene: Any = scene
        self.pose: int = pose
        self.anchor: Anchor = anchor
        self.bases: Floats = np.array(
            [self.base(point) for point in anchor.points] or np.zeros((1, 2))
        )
        angle = self.angle(anchor.turn)
        c, s = np.cos(angle), np.sin(angle)
        self.turn: Matrix = np.array([[c, s], [-s, c]])

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
    """Labels, each with what it moves with and its ways from there.

    Ways are rows (pose, x, y), between which a label glides; ``frame_of`` gives the frame of an
    anchor on a sheet, in a pose.
    """

    labels: tuple[tuple[Writing, Anchor, Array], ...]
    frame_of: Callable[[Sheet, int, Anchor], AnchorFrame]

    def write(
        self, sheet: Sheet, pose: int, marks: Sequence[Mark] = (), shares: Array | None = None
    ) -> None:
        """Write the labels of a pose, of loads those that were drawn.

        ``shares`` say of labels that a page moves where on its way the poses are.
        """
        texts = {label.gid: label.text for label in load_names(marks)}
        for label, anchor, ways in self.labels:
            way = np.array([np.interp(pose, ways[:, 0], column) for column in ways[:, 1:].T])
            spot = self.frame_of(sheet, pose, anchor).placed(way[None])[0]
            text = texts.get(label.gid, "") if label.kind == "load" else label.text
            if not text or not np.isfinite(spot).all():
                continue
            at = ways[:, 0] if shares is None else np.interp(ways[:, 0], range(len(shares)), shares)
            keys = tuple(sorted(tuple(row) for row in np.c_[at, ways[:, 1:]].tolist()))
            with sheet.held(Anchor(anchor.points, anchor.turn, spot=(*spot.tolist(),), ways=keys)):
                write_label(sheet, label, spot, text)


class LabelCourse(NamedTuple):
    """Places of a label at poses: what they cost, ways (poses, 3) from an anchor, spots."""

    cost: float
    anchor: Anchor
    ways: Array
    spots: list[Array]


def chosen_labels(
    sheets: Sequence[Sheet],
    poses: Sequence[int],
    rows: Sequence[Sequence[Writing]],
    anchors_of: Callable[[Writing], list[Anchor]],
    frame_of: Callable[[Sheet, int, Anchor], AnchorFrame],
) -> SteadyLabels:
    """Return labels where they cover least in all poses; they go elsewhere where that pays.

    ``rows`` are the labels of each pose, drawn on its sheet, with their possible places;
    ``anchors_of`` gives what a label may move with.
    """
    every = [{label.gid: label for label in row} for row in rows]
    blocks = [Obstacles(*sheet.obstacles(), sheet.size) for sheet in sheets]
    found, order = [], sorted(range(len(poses)), key=lambda k: poses[k])

    def course(label: layout.Label, anchor: Anchor, gid: str, there: Sequence[int]) -> LabelCourse:
        half = np.array([label.width, label.height]) / 2
        frames = {k: frame_of(sheets[k], poses[k], anchor) for k in there}
        ways = frames[0].local(label.places)
        covered, costs, spots = [], [], []
        for k, frame in frames.items():
            spots.append(frame.placed(ways))
            shy = np.full(len(ways), label.own is not None)
            covered.append(blocks[k].cost(spots[-1], np.broadcast_to(half, ways.shape), shy))
            now = every[k][gid].label.costs
            costs.append(label.costs if anchor.turn or len(now) != len(ways) else now)
        beside = np.array([covered[0], *covered, covered[-1]])
        worst = np.max([beside[:-2], beside[1:-1], beside[2:]], axis=0)  # links pass between poses
        cost, picks = cheapest_course(worst + np.array(costs), ways)
        at = [spot[i] for spot, i in zip(spots, picks, strict=True)]
        return LabelCourse(cost, anchor, np.c_[[poses[k] for k in there], ways[picks]], at)

    for first in sorted(every[0].values(), key=lambda label: label.kind == "number"):
        there = [k for k in order if first.gid in every[k]]
        half = np.array([first.label.width, first.label.height]) / 2
        anchors = anchors_of(first)
        best = min(
            (course(first.label, anchor, first.gid, there) for anchor in anchors), key=_price
        )
        if best.cost > 2 * layout.POOR * len(there):
            far = layout.wider(first.label, WIDER, np.inf)
            more = (course(far, anchor, first.gid, there) for anchor in anchors)
            best = min(best, *more, key=_price)
        for k, spot in zip(there, best.spots, strict=True):
            box = np.array([[*(spot - half), *(spot + half), TAKEN]])
            blocks[k].areas = np.vstack([blocks[k].areas, box])
        found.append((first, best.anchor, _glides(best.ways)))
    return SteadyLabels(tuple(found), frame_of)


def _price(course: LabelCourse) -> float:
    return round(course.cost, 4)


def _glides(ways: Array) -> Array:
    """Return the rows (pose, x, y) in which a label begins to go elsewhere and is there."""
    rows = [ways[0]]
    for before, after in pairwise(ways):
        if (before[1:] != after[1:]).any():
            ends = [before[0] + share * (after[0] - before[0]) for share in GLIDE]
            rows += [np.array([ends[0], *before[1:]]), np.array([ends[1], *after[1:]])]
    return np.array(rows)


def cheapest_course(costs: Array, ways: Array) -> tuple[float, Array]:
    """Return the least cost of a place at each pose, (poses, places), with moves, and the places.

    Found by dynamic programming over the poses.
    """
    apart = np.linalg.norm(ways[:, None] - ways[None], axis=-1)
    moves = np.where(apart > 0, MOVES[0], 0.0) + MOVES[1] * apart
    total, came = np.round(costs[0], 6), []
    for row in costs[1:]:
        before = total[:, None] + moves
        came.append(np.argmin(before, axis=0))
        total = before.min(axis=0) + np.round(row, 6)
    picks = [int(np.argmin(total))]
    for back in reversed(came):
        picks.append(int(back[picks[-1]]))
    return float(total.min()), np.array(picks[::-1])

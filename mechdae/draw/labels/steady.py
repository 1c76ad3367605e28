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
from mechdae.types import Floats, Integers, Matrix

POSES = 37
"""Poses in which places of labels are compared."""
GLIDE = 0.25, 0.75
"""Between which shares of the way from one of them to the next a label goes elsewhere."""
MOVES = 20.0, 0.8
"""What it costs that a label goes to another place: in itself, and for each unit of the way."""
WIDER = 0.0, 12.0, 30.0
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
        if ">" in turn:
            a, b = (self.base(point) for point in turn.split(">"))
            return float(np.arctan2(*(b - a)[::-1]))
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


@dataclass(frozen=True)
class MovingPlaces:
    """Places of a label that moves with an anchor: at poses by their index, ways from the anchor.

    ``spots`` are (poses, places, 2), ``costs`` in themselves and what they ``cover`` of the
    drawing (poses, places).
    """

    label: layout.Label
    anchor: Anchor
    there: list[int]
    ways: Array
    spots: Array
    costs: Array
    cover: Array

    @property
    def half(self) -> Array:
        """Half of the label's width and height."""
        return np.array([self.label.width, self.label.height]) / 2


class LabelCourse(NamedTuple):
    """Places of a label at poses: what they cost, of all places, which, at which spots."""

    cost: float
    places: MovingPlaces
    picks: Integers
    spots: Array


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
    order = sorted(range(len(poses)), key=lambda k: poses[k])
    taken, found = np.zeros((0, len(poses), 4)), []

    def places_of(gid: str, label: layout.Label, anchor: Anchor) -> MovingPlaces:
        there = [k for k in order if gid in every[k]]
        frames = [frame_of(sheets[k], poses[k], anchor) for k in there]
        ways = frames[there.index(0)].local(label.places)
        now = [every[k][gid].label.costs for k in there]
        costs = [label.costs if anchor.turn or len(row) != len(ways) else row for row in now]
        spots = np.array([frame.placed(ways) for frame in frames])
        cover = np.full(spots.shape[:2], np.nan)
        return MovingPlaces(label, anchor, there, ways, spots, np.array(costs), cover)

    def look(trials: Sequence[MovingPlaces]) -> None:
        for k, block in enumerate(blocks):
            seen = [(trial, trial.there.index(k)) for trial in trials if k in trial.there]
            seen = [(trial, i) for trial, i in seen if np.isfinite(trial.spots[i]).all()]
            counts = [len(trial.ways) for trial, _ in seen]
            if not counts:
                continue
            half = np.repeat([trial.half for trial, _ in seen], counts, axis=0)
            shy = np.repeat([trial.label.own is not None for trial, _ in seen], counts)
            cost = block.cost(np.vstack([trial.spots[i] for trial, i in seen]), half, shy)
            for (trial, i), part in zip(seen, np.split(cost, np.cumsum(counts)[:-1]), strict=True):
                trial.cover[i] = part

    def course(trial: MovingPlaces) -> LabelCourse:
        cover, low, high = trial.cover.copy(), trial.spots - trial.half, trial.spots + trial.half
        for box in taken[:, trial.there, None]:
            shared = np.minimum(high, box[..., 2:]) - np.maximum(low, box[..., :2])
            share = np.prod(np.maximum(shared, 0.0) / (2 * trial.half), axis=-1)
            cover += (share > 0) * TAKEN * (1.0 + 2.0 * share)
        beside = np.array([cover[0], *cover, cover[-1]])
        worst = np.max([beside[:-2], beside[1:-1], beside[2:]], axis=0)  # links pass between poses
        cost, picks = cheapest_course(worst + trial.costs, trial.ways)
        return LabelCourse(cost, trial, picks, trial.spots[range(len(picks)), picks])

    labels = sorted(every[0].values(), key=lambda label: label.kind == "number")
    trials = {
        sought.gid: [places_of(sought.gid, sought.label, at) for at in anchors_of(sought)]
        for sought in labels
    }
    look([trial for some in trials.values() for trial in some])
    for label in labels:
        best = min(map(course, trials[label.gid]), key=_price)
        if best.cost > 2 * layout.POOR * len(best.picks):
            far = layout.wider(label.label, WIDER, np.inf)
            more = [places_of(label.gid, far, trial.anchor) for trial in trials[label.gid]]
            look(more)
            best = min(best, *map(course, more), key=_price)
        box = np.full((1, len(poses), 4), np.inf)
        half = best.places.half
        box[0, best.places.there] = np.hstack([best.spots - half, best.spots + half])
        taken = np.vstack([taken, box])
        at = [poses[k] for k in best.places.there]
        ways = np.c_[at, best.places.ways[best.picks]]
        found.append((label, best.places.anchor, _glides(ways)))
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


def cheapest_course(costs: Array, ways: Array) -> tuple[float, Integers]:
    """Return the least cost of a place at each pose, (poses, places), with moves, and the places.

    Found by dynamic programming over the poses.
    """
    least = costs.min(axis=1, keepdims=True)
    spare = costs.sum(axis=0).min() - least.sum()  # no course is worse than the best that stays
    able = np.flatnonzero(~((costs - least).min(axis=0) > spare + 1e-4))
    costs, ways = np.round(costs[:, able], 6), ways[able]
    total, came = costs[0], []
    for row in costs[1:]:
        best = int(np.argmin(total))
        direct = total[best] + MOVES[1] * np.linalg.norm(ways - ways[best], axis=-1)
        left = np.flatnonzero(total <= direct + 1e-9)  # from others one goes by way of the best
        apart = np.linalg.norm(ways[left, None] - ways[None], axis=-1)
        before = total[left, None] + (np.where(apart > 0, MOVES[0], 0.0) + MOVES[1] * apart)
        source = np.argmin(before, axis=0)
        moved, came_from = before[source, range(len(able))], left[source]
        stays = (total < moved) | ((total == moved) & (came_from > range(len(able))))
        came.append(np.where(stays, range(len(able)), came_from))
        total = np.where(stays, total, moved) + row
    picks = [int(np.argmin(total))]
    for back in reversed(came):
        picks.append(int(back[picks[-1]]))
    return float(total.min()), able[picks[::-1]]

"""Modes that a sketch does not tell apart: which of them is meant all the same, what would tell.

Meant is the one of fewest whole turns; of cylinders between two pins the one that is pushed out;
in space, where no point is elsewhere, the one of the least angles. All else is for the sketch to
say.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, KINDS
from mechdae.describe.coordinates import NamedCoordinate, Selection, coordinate
from mechdae.describe.joints.bearings import bearings
from mechdae.describe.structure import cylinders
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.kernels.run.functions import Local
from mechdae.types import Floats, Unknowns


class NumberOfSketch(Protocol):
    """A number of the sketch, or one as if it said so."""

    @property
    def coordinate(self) -> NamedCoordinate: ...
    @property
    def turns(self) -> bool: ...
    @property
    def value(self) -> Local: ...
    def gap(self, x: Unknowns, u: Floats, p: Any, unwound: bool = False) -> float: ...


class BlocksOfGroups(Protocol):
    """What is asked of an assembler."""

    p: Any

    def blocks_of(self, group: Group) -> list[int]: ...


class Saying(Protocol):
    """What is asked of what the sketch says."""

    @property
    def assembler(self) -> BlocksOfGroups: ...
    @property
    def entries(self) -> Sequence[NumberOfSketch]: ...

    scene: Scene
    groups: list[Group]

    def entry(self, c: NamedCoordinate, wanted: float) -> NumberOfSketch | None: ...


class Undecided:
    """Which of modes is meant that are equally near to the sketch.

    Parameters
    ----------
    sketched
        What the sketch says.
    tie
        Difference in angles [rad] and sizes that counts as none.
    """

    def __init__(self, sketched: Saying, tie: float) -> None:
        self.tie = tie
        self.sketched: Saying = sketched
        self.assembler: BlocksOfGroups = sketched.assembler
        self.scene: Scene = sketched.scene
        self.groups: list[Group] = sketched.groups

    def meant(
        self, part: list[int], near: list[Floats], u: Floats
    ) -> tuple[list[Floats], list[str]]:
        """Return the modes of some groups that may be meant, and joints turned as little as can be.

        `near` are poses that the sketch tells apart by whole turns at most.
        """
        turned: list[str] = []
        if len(near) > 1:
            near = self._pushed_out(part, near, u)
        if len(near) > 1 and self.scene.model.mechanism.dimension == 3:
            near = self._least_wound(near, u)
            near, turned = self._least_turned(part, near, u) if len(near) > 1 else (near, [])
        return near, turned

    def _pushed_out(self, part: list[int], near: list[Floats], u: Floats) -> list[Floats]:
        """Return the modes in which each cylinder has a positive slide, all if there is none."""
        mechanism = self.scene.model.mechanism
        parts = {e.coordinate.part for e in self.sketched.entries if not e.coordinate.is_angle}
        untold = {name for k in part for name in self.groups[k].joints} - parts
        entries = [self._of(f"{name}.slide") for name in cylinders(mechanism) if name in untold]
        slides = [[entry.gap(x, u, self.assembler.p) for entry in entries if entry] for x in near]
        out = [x for x, lengths in zip(near, slides, strict=True) if min(lengths, default=0.0) > 0]
        return out or near

    def _of(self, name: str) -> NumberOfSketch | None:
        """Return a coordinate as if the sketch said that it is zero."""
        return self.sketched.entry(coordinate(self.scene.model.mechanism, name), 0.0)

    def _least_wound(self, near: list[Floats], u: Floats) -> list[Floats]:
        """Return modes in space without those that are others with wheels or screws turned on."""
        p = self.assembler.p
        angles = wound(self.scene, self.groups)
        if not angles:
            return near
        by_name = {entry.coordinate.text: entry for entry in self.sketched.entries}
        entries = {name: by_name.get(name) or self._of(name) for names in angles for name in names}

        def turned(name: str, x: Unknowns) -> float:
            entry = entries[name]
            return 0.0 if entry is None else float(entry.gap(x, u, p, True))

        return least_wound(near, angles, turned)

    def _least_turned(
        self, part: list[int], near: list[Floats], u: Floats
    ) -> tuple[list[Floats], list[str]]:
        """Return of modes in which all points are at one place the one of the least angles.

        A leg between a cross and a ball closes too when it is turned by half a turn about itself.
        The joints whose angles differ are the second result.
        """
        mechanism, p = self.scene.model.mechanism, self.assembler.p
        groups = [self.groups[k] for k in part]
        points = [
            self._of(f"{body}.{point}.{axis}")
            for group in groups
            for body in group.bodies
            for point in self._placed(body)
            for axis in mechanism.axes
        ]
        for entry in points:
            if entry and any(abs(self._moved(entry, near[0], x, u)) > self.tie for x in near[1:]):
                return near, []
        every = [
            self._of(f"{name}.{word}")
            for group in groups
            for name in group.joints
            for word in mechanism.joints[name].coordinates
            if KINDS[word] is ANGLE
        ]
        turns = [entry for entry in every if entry is not None]
        sizes = [math.hypot(*[entry.gap(x, u, p) for entry in turns]) for x in near]
        least = min(sizes)
        remaining = [x for x, size in zip(near, sizes, strict=True) if size - least < self.tie]
        if len(remaining) > 1:
            return near, []
        return remaining, [
            entry.coordinate.part
            for entry in turns
            if any(abs(self._moved(entry, remaining[0], x, u)) > self.tie for x in near)
        ]

    # -- what would tell -------------------------------------------------------------------

    def hint(
        self, tied: Sequence[tuple[list[int], list[Floats]]], u: Floats
    ) -> tuple[list[str], list[str]]:
        """Return keys of the sketch that tell the tied modes apart, and lines as one mode has them.

        All keys are needed; where any of some does, they come as "one of".
        """
        keys, lines, p = [], [], self.assembler.p
        in_plane = self.scene.model.mechanism.dimension == 2
        for part, poses in tied:
            left = poses
            while len(left) > 1:
                telling = self._telling(self.first_to_differ(part, left), left, u)
                if not telling:
                    return [], []
                first = telling[0]
                angle = first.coordinate.kind == "body angle"
                near = self._upright(first, left, u) if angle else left[0]
                value = first.value(near, u, p).item()
                every = [_key(e.coordinate, in_plane) for e in telling]
                keys.append(every[0] if len(every) == 1 else f"one of {', '.join(every)}")
                shown = math.degrees(value) if angle else value
                lines.append(f"{_key(first.coordinate, in_plane)} = {shown:.6g}")
                left = [x for x in left if abs(self._moved(first, near, x, u)) <= self.tie]
        return keys, lines

    def _upright(self, entry: NumberOfSketch, poses: list[Unknowns], u: Floats) -> Floats:
        """Return the first pose, or one half a turn from it that stands as it is drawn."""
        turned = [abs(self._moved(entry, poses[0], x, u)) for x in poses]
        half = [x for x, t in zip(poses, turned, strict=True) if abs(t - math.pi) <= self.tie]
        p = self.assembler.p
        return min(
            [poses[0], *half],
            key=lambda x: abs(math.remainder(entry.value(x, u, p).item(), 2 * math.pi)),
        )

    def first_to_differ(self, part: list[int], poses: list[Unknowns]) -> Group:
        """Return the first group whose unknowns are not the same in all poses."""
        return next(self.groups[k] for k in part if self._differ(self.groups[k], poses))

    def _differ(self, group: Group, poses: list[Unknowns]) -> bool:
        unknowns = [i for b in self.assembler.blocks_of(group) for i in self.scene.blocks[b].x]
        return any(not np.array_equal(poses[0][unknowns], x[unknowns]) for x in poses)

    def _placed(self, body: str) -> list[str]:
        """Return the points of a body that have a place: not those of a link that spins freely."""
        model = self.scene.model
        points = model.mechanism.bodies[body].points
        every = Selection((), tuple(f"{body}.{point}" for point in points), ())
        return [point.split(".")[1] for point in model.reported(every, False).points]

    def _moved(self, entry: NumberOfSketch, x: Unknowns, y: Floats, u: Floats) -> float:
        """Return by how much a coordinate differs between two poses, in its size."""
        p = self.assembler.p
        gap = entry.gap(y, u, p, True) - entry.gap(x, u, p, True)
        return math.remainder(gap, 2 * math.pi) if entry.turns else gap

    def _telling(self, group: Group, poses: list[Unknowns], u: Floats) -> list[NumberOfSketch]:
        """Return angles that differ between poses, else slides, else the point that moves most."""
        mechanism = self.scene.model.mechanism
        sketched = {entry.coordinate.text for entry in self.sketched.entries}
        in_plane = mechanism.dimension == 2
        angles = [f"{body}.angle" for body in group.bodies if in_plane]
        slides = [
            f"{name}.{word}"
            for name in group.joints
            for word in mechanism.joints[name].coordinates
            if KINDS[word] is not ANGLE or not in_plane
        ]
        points = [
            f"{body}.{point}.{axis}"
            for body in group.bodies
            for point in self._placed(body)
            for axis in mechanism.axes
        ]
        for every in (angles, slides, points):
            entries = [self._of(name) for name in every if name not in sketched]
            apart = {}
            for entry in entries:
                if entry is not None:
                    apart[entry] = max(abs(self._moved(entry, poses[0], x, u)) for x in poses)
            telling = [entry for entry, gap in apart.items() if gap > self.tie]
            telling.sort(key=lambda entry: -apart[entry])
            if telling:
                return telling[:1] if every is points else telling
        return []


def _key(c: NamedCoordinate, in_plane: bool = True) -> str:
    """Return a coordinate as a key of the sketch."""
    if c.kind == "point":
        return f'"{c.text}"'
    if c.kind == "body angle":
        return f"{c.part}_deg"
    return c.part if in_plane else f'"{c.text}"'


WHOLE = 1e-6
"""Share of a turn by which turns may differ from whole ones."""


def wound(scene: Scene, groups: Sequence[Group]) -> list[list[str]]:
    """Return the angles of each mesh and screw of groups: of a mesh those of its bearings."""
    mechanism, found = scene.model.mechanism, []
    for name in (name for group in groups for name in group.joints):
        joint = mechanism.joints[name]
        if joint.winds:
            found.append([f"{name}.angle"])
        elif joint.meshes:
            both = bearings(mechanism, joint)
            found.append([f"{b.joint}.{b.word}" for b in both if b.word.startswith("angle")])
    return found


def least_wound(
    near: list[Floats], angles: list[list[str]], turned: Callable[[str, Any], float]
) -> list[Floats]:
    """Return poses without those that are others turned further.

    Parameters
    ----------
    near
        Poses.
    angles
        Of each mesh and screw; in each of them one has to differ by whole turns.
    turned
        (angle, pose) -> how far it is turned from what is sketched [rad].
    """
    values = [{name: turned(name, x) for names in angles for name in names} for x in near]

    def turns(name: str, i: int, k: int) -> float:
        return (values[i][name] - values[k][name]) / (2 * math.pi)

    def further(i: int, k: int) -> bool:
        found = []
        for names in angles:
            whole = [
                round(turn) for turn in (turns(n, i, k) for n in names)
                if abs(turn - round(turn)) < WHOLE
            ]  # fmt: skip
            if not whole:
                return False
            found += whole
        far, other = (math.hypot(*values[j].values()) for j in (i, k))
        return any(found) and far - other > WHOLE

    every = range(len(near))
    return [x for i, x in enumerate(near) if not any(further(i, k) for k in every)]

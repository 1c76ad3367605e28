"""All assembly modes at one value of the drivers, as a tree: independent groups multiply.

A group depends on those whose unknowns its equations hold. Groups that share no such unknowns once
earlier groups are placed are solved once each; the number of modes is the product of theirs, and
modes are put together only when they are listed. An and-or tree (A. Martelli, U. Montanari, 1973).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import casadi as ca
import numpy as np

from mechdae.equations.groups import Group
from mechdae.errors import UnavailableError
from mechdae.kernels.run.functions import local
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.mode_labels import Assembling, ModeLabels
from mechdae.motion.assembly.nearest_mode import Sketched
from mechdae.records import dataclass
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.equations.reduction import Scene

MOST_SOLVED = 100_000
"""Groups that are solved for the poses of earlier ones before the count is given up."""
DEEPEST = 200
"""Groups with several poses that may depend on each other in a row."""


@dataclass(frozen=True)
class Mode:
    """One assembly mode: unknowns (nx,), labels of the groups in the order of the formula."""

    x: Floats
    labels: tuple[str, ...]

    @property
    def label(self) -> str:
        return ",".join(self.labels)


@dataclass(frozen=True)
class GroupPose:
    """A pose of one group: its unknowns, its label, and what its later groups may be."""

    values: Floats
    label: str
    later: list[GroupChoice]
    count: int


@dataclass(frozen=True)
class GroupChoice:
    """The poses of one group, best label first, at given poses of the groups it depends on."""

    group: int
    poses: list[GroupPose]

    @property
    def count(self) -> int:
        return sum(pose.count for pose in self.poses)


@dataclass(frozen=True)
class GroupSolutions:
    """Solutions of one group: its unknowns by pose, labels, whether these are proven to be all."""

    values: list[Floats]
    labels: list[str]
    proven: bool
    failure: NoPose | None


class ModeAssembling(Assembling, Protocol):
    """One that names the modes too."""

    labels: ModeLabels

    @property
    def sketched(self) -> Sketched: ...


class ModeTree:
    """All assembly modes of a scene at one value of its drivers.

    Parameters
    ----------
    assembler
        Gives all poses of one group.
    u
        Values of the drivers (nu,).

    Attributes
    ----------
    count
        Number of modes.
    proven
        Whether it is proven that there are no others.
    failure
        The group that failed last, None where there are modes.

    Raises
    ------
    UnavailableError
        The groups depend on each other so that there are too many to be counted.
    """

    needs: list[set[int]]
    held: list[list[int]]

    def __init__(self, assembler: ModeAssembling, u: Floats) -> None:
        self.assembler: ModeAssembling = assembler
        self.scene: Scene = assembler.scene
        self.u: Floats = u
        self.groups: list[Group] = self.scene.groups
        self.own: list[list[int]] = [
            [i for b in assembler.blocks_of(group) for i in assembler.graphs.blocks[b].own]
            for group in self.groups
        ]
        self.needs, self.held = self._dependencies()
        self.proven: bool = True
        self._failed: tuple[int, NoPose] | None = None
        self._solved: dict[tuple[int, bytes], GroupSolutions] = {}
        self.root: list[GroupChoice] | None = self._later(
            list(range(len(self.groups))), self._start(), 0
        )
        self.count: int = (
            0 if self.root is None else math.prod(choice.count for choice in self.root)
        )
        self.failure: NoPose | None = (
            None if self.count or self._failed is None else self._failed[1]
        )

    def _start(self) -> Floats:
        return np.zeros(self.assembler.graphs.nx)

    def _dependencies(self) -> tuple[list[set[int]], list[list[int]]]:
        """Return by group the earlier groups it depends on, and their unknowns that it holds."""
        place = {i: k for k, unknowns in enumerate(self.own) for i in unknowns}
        needs, unknowns = [], []
        for k, group in enumerate(self.groups):
            held = self._held(group)
            ahead = {place[i] for i in held if place[i] < k}
            needs.append(ahead)
            unknowns.append(sorted(i for i in held if place[i] < k))
        return needs, unknowns

    def _held(self, group: Group) -> set[int]:
        """Return the unknowns that a group's equations, senses of axes and labels hold."""
        blocks, model = self.assembler.blocks_of(group), self.scene.model

        def made() -> ca.SX:
            rows = [self.scene.rows[i].expression for i in group.rows]
            choosers = self.assembler.choosers
            senses = [v for chooser in choosers for b in blocks for v in chooser.positive(b)]
            frames = [] if model.space.behind else [model.frame(b).angle for b in group.bodies]
            expression: ca.SX = ca.vertcat(*rows, *senses, *frames)
            return expression

        held = set(local(self.scene, ("held", group.index), made).held[0])
        for b in blocks:
            held |= set(self.assembler.graphs.blocks[b].uses)
        for check in self.scene.checks:
            if check.group == group.index:
                held |= set(self.scene.held(check.residual)[0])
        return held

    # -- building ----------------------------------------------------------------------------

    def _later(self, ks: list[int], x: Floats, depth: int) -> list[GroupChoice] | None:
        """Return the choices among groups `ks` at the earlier poses in `x`; None where one fails.

        What depends on a group with a single pose stands beside it.
        """
        choices, waiting = [], [(part, x) for part in reversed(self._parts(ks))]
        while waiting:
            (k, *rest), at = waiting.pop()
            solved = self._poses(k, at)
            if len(solved.values) == 1:
                choices.append(
                    GroupChoice(k, [GroupPose(solved.values[0], solved.labels[0], [], 1)])
                )
                placed = self._placed(k, at, solved.values[0])
                waiting += [(part, placed) for part in reversed(self._parts(rest))]
                continue
            if depth > DEEPEST:
                raise self._too_many()
            poses = []
            for values, label in zip(solved.values, solved.labels, strict=True):
                later = self._later(rest, self._placed(k, at, values), depth + 1)
                if later is not None:
                    count = math.prod(choice.count for choice in later)
                    poses.append(GroupPose(values, label, later, count))
            if not poses:
                return None
            poses.sort(key=lambda pose: order(pose.label))
            choices.append(GroupChoice(k, poses))
        return choices

    def _placed(self, k: int, x: Floats, values: Floats) -> Floats:
        """Return unknowns with those of group `k` replaced."""
        y = x.copy()
        y[self.own[k]] = values
        return y

    def _parts(self, ks: Sequence[int]) -> list[list[int]]:
        """Return sets of the groups `ks` that depend on each other, each in order."""
        leader = {k: k for k in ks}

        def of(k: int) -> int:
            while leader[k] != k:
                leader[k] = k = leader[leader[k]]
            return k

        for k in ks:
            for earlier in self.needs[k]:
                if earlier in leader:
                    leader[of(k)] = of(earlier)
        parts: dict[int, list[int]] = {}
        for k in ks:
            parts.setdefault(of(k), []).append(k)
        return list(parts.values())

    def _poses(self, k: int, x: Floats) -> GroupSolutions:
        """Return the poses of group `k`, solved once for all poses of others it does not hold."""
        key = (k, x[self.held[k]].tobytes())
        if key not in self._solved:
            if len(self._solved) >= MOST_SOLVED:
                raise self._too_many()
            group = self.groups[k]
            poses, proven, failure = self.assembler.candidates(group, x, self.u)
            labels = [""] * len(poses)
            if self.assembler.labelled(group):
                labels = self.assembler.labels.of_group(group, poses, self.u)
            values = [pose[self.own[k]] for pose in poses]
            self._solved[key] = GroupSolutions(values, labels, proven, failure)
            self.proven &= proven
            if failure is not None and (self._failed is None or self._failed[0] <= k):
                self._failed = (k, failure)
        return self._solved[key]

    def _too_many(self) -> UnavailableError:
        return UnavailableError(
            f"the assembly modes are not counted: groups that depend on each other have more than "
            f"{len(self._solved)} poses",
            hint="hold a link in between as a further driver: its pose is one then",
        )

    # -- listing -----------------------------------------------------------------------------

    def __iter__(self) -> Iterator[Mode]:
        """Give the modes one by one, in the order of their labels."""
        return self.having(())

    def first(self, most: int | None) -> list[Mode]:
        """Return the first `most` modes, all without a number."""
        return list(itertools.islice(self, most))

    @cached_property
    def _of_sketch(self) -> dict[str, Floats]:
        """The pose that is assembled on the sketch by its label, where turns without end move it.

        Of the poses of one mode that differ by such turns it is the one that is listed.
        """
        if not any(self.assembler.turns.endless):
            return {}
        nearest = self.assembler.sketched.nearest(self.u)
        if nearest.failure is not None or nearest.doubtful:
            return {}
        return {self.assembler.labels.of_pose(nearest.x, self.u): nearest.x}

    def having(self, wanted: Sequence[str]) -> Iterator[Mode]:
        """Give the modes whose labels begin with those `wanted`."""
        waiting: list[tuple[list[GroupChoice], Floats, tuple[str, ...]]] = []
        if self.root is not None:
            waiting.append((self.root, self._start(), ()))
        while waiting:
            choices, x, labels = waiting.pop()
            if not choices:
                mode = Mode(x, labels)
                yield Mode(self._of_sketch.get(mode.label, x), labels)
                continue
            first = min(choices, key=lambda choice: choice.group)
            others = [choice for choice in choices if choice is not first]
            named = self.assembler.labelled(self.groups[first.group])
            at = len(labels)
            for pose in reversed(first.poses):
                if named and at < len(wanted) and pose.label != wanted[at]:
                    continue
                y = self._placed(first.group, x, pose.values)
                ahead = (*labels, pose.label) if named else labels
                waiting.append(([*others, *pose.later], y, ahead))


def order(label: str) -> tuple[bool, int, str]:
    """Return by what the labels of a group are put in order: + first."""
    return label[:1] != "+", len(label), label

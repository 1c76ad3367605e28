"""Poses at which axes of spatial joints have the sense they were given.

The equations of a joint that is cut open hold for axes of opposite sense too, and for other half
turns. On a continuous path that cannot change; every assembly has to be tested.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.equations.coordinates import quaternions
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.equations.tree.tree_model import TreeModel
from mechdae.kernels.run.functions import local
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.mode_labels import Assembling, Chooser
from mechdae.motion.setup.drivers import Sketch
from mechdae.types import Floats, Sym, Unknowns

FEW = 8
"""Poses of a block up to which none is dropped before the group is solved."""
SAME = 1e-7
"""Largest difference of one and the same pose, in its unknowns."""


class OrientationChecks(Chooser):
    """What must be positive at the poses of a scene, by group."""

    def __init__(self, assembler: Assembling) -> None:
        self.scene: Scene = assembler.scene
        scene = self.scene
        self._of: dict[int, list[Sym]] = {}
        self._told: dict[int, list[Sym]] = {}
        self.quaternions: list[list[int]] = quaternions(scene.unknowns)
        """Places of those among the unknowns: a quaternion and its opposite are one orientation."""
        vectors = vectors_of(scene)
        self.directions: list[int] = [k for k, c in enumerate(scene.unknowns)
                           if c.kind is ANGLE and c.owner in vectors]  # fmt: skip
        """Places of angles of vectors, whose whole turns make no difference."""
        if isinstance(scene.model, TreeModel):
            for name, value in scene.model.senses:
                group = next((g.index for g in scene.groups if name in g.joints), None)
                if group is not None:
                    self._of.setdefault(group, []).append(value)

    def of_group(self, group: Group, poses: list[Unknowns], u: Floats) -> list[Floats]:
        """Return the poses of a group with axes of the right sense."""
        values = self._of.get(group.index)
        poses = self._once(poses)
        if not values or not poses:
            return poses
        return self._positive(("senses", group.index), values, poses, u)

    def after_block(
        self, group: Group, b: int | None, poses: list[Floats], u: Floats
    ) -> tuple[list[Floats], NoPose | None]:
        """Return the poses whose axes have the right sense as far as block `b` tells of them.

        Legs of a platform double the poses each: those that will be dropped must not be doubled.
        """
        if b is None or not self._of.get(group.index) or len(poses) < FEW:
            return poses, None
        if set(self.scene.blocks[b].x) & {i for components in self.quaternions for i in components}:
            poses = self._once(poses)
        return self.possible(b, poses, u), None

    def positive(self, b: int) -> list[Sym]:
        """Return what must be positive of which block `b` is the last to tell."""
        if not self._told:
            self._told = self._tell()
        return self._told.get(b, [])

    def possible(self, b: int, poses: list[Unknowns], u: Floats) -> list[Floats]:
        """Return the poses whose axes have the right sense as far as block `b` tells of them."""
        values = self.positive(b)
        return self._positive(("senses", b, "block"), values, poses, u) if values else poses

    def _tell(self) -> dict[int, list[Sym]]:
        """Return what must be positive by the block that is the last to tell of it."""
        at = {i: b for b, block in enumerate(self.scene.blocks) for i in block.x}
        rows: dict[int, list[Sym]] = {}
        for value in (value for values in self._of.values() for value in values):
            held = self.scene.held(self.scene.expression(value))[0]
            if held:
                rows.setdefault(max(at[i] for i in held), []).append(value)
        return rows

    def _positive(
        self,
        key: tuple[str, int, str] | tuple[str, int],
        values: list[Sym],
        poses: list[Unknowns],
        u: Floats,
    ) -> list[Floats]:
        function = local(self.scene, key, lambda: ca.vertcat(*values))
        p = self.scene.model.p_values
        return [x for x in poses if np.all(function(x, u, p) > 0)]

    def _once(self, poses: list[Unknowns]) -> list[Floats]:
        """Return the poses without those that have an opposite quaternion and are else the same."""
        if not self.quaternions or len(poses) < 2:
            return poses
        every, remaining = np.array(poses), np.zeros(len(poses), bool)
        for k, x in enumerate(every):
            others = every[remaining]
            turned = np.broadcast_to(x, others.shape).copy()
            for places in self.quaternions:
                opposite = others[:, places] @ x[places] < 0
                turned[np.ix_(opposite, places)] *= -1
            gaps = turned - others
            gaps[:, self.directions] -= 2 * np.pi * np.round(gaps[:, self.directions] / (2 * np.pi))
            remaining[k] = not (np.abs(gaps).max(axis=1, initial=0.0) < SAME).any()
        return [x for x, new in zip(poses, remaining, strict=True) if new]

    def towards(self, x: Unknowns, other: Floats) -> Floats:
        """Return unknowns with the signs of quaternions that are nearer to those of others."""
        result = x.copy()
        for components in self.quaternions:
            if result[components] @ other[components] < 0:
                result[components] = -result[components]
        return result


def vectors_of(scene: Scene) -> set[str]:
    """Return the names of the joints that are vectors of loops."""
    return {j.name for j in scene.model.mechanism.joints.values() if j.pointer}


def angles_from_sketch(scene: Scene, sketch: Sketch) -> dict[str, float]:
    """Return the sketched angles of spatial joints that are coordinates, by joint."""
    vectors = vectors_of(scene)
    angles = {c.key for c in scene.model.coordinates if c.kind is ANGLE and c.owner not in vectors}
    return {
        c.part: v for c, v in sketch.places.items() if (c.part, c.word) in angles and c.is_angle
    }

"""Labels of assembly modes and what a case may say of the poses of groups."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.equations.space import PLANE
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import local
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.turns.block_turns import BlockTurns
from mechdae.types import Floats, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.blocks import BlockGraph
    from mechdae.motion.assembly.elimination import BlockSolver


class Chooser:
    """One that chooses nothing; cases say otherwise."""

    def after_block(
        self, group: Group, b: int | None, poses: list[Floats], u: Floats
    ) -> tuple[list[Floats], NoPose | None]:
        """Return the poses (nx,) that may be some as far as block `b` tells, or why none is.

        Block None stands for what is told before the first one.
        """
        return poses, None

    def of_group(self, group: Group, poses: list[Unknowns], u: Floats) -> list[Floats]:
        """Return the poses of a whole group that are some."""
        return poses

    def positive(self, b: int) -> list[Sym]:
        """Return expressions over q that are positive at a pose, of which block `b` tells last."""
        return []

    def possible(self, b: int, poses: list[Floats], u: Floats) -> list[Floats]:
        """Return the poses at which that is so."""
        return poses

    def towards(self, x: Floats, other: Floats) -> Floats:
        """Return the same pose with unknowns that are nearer to those of another one."""
        return x

    def rank(self, group: Group, x: Floats, u: Floats) -> float | None:
        """Return by what poses of a group are put in order, None for the usual."""
        return None

    def places(self, group: Group, x: Floats, u: Floats) -> dict[str, float]:
        """Return where contacts of a group lie on their curves, by joint."""
        return {}

    def notes(self) -> list[str]:
        """Return what to know about a scene."""
        return []


class Assembling(Protocol):
    """What is asked of an assembler by those that search, compare and name its poses."""

    graphs: Graphs
    scene: Scene
    sketch: dict[str, float]
    places: dict[NamedCoordinate, float]
    p: Floats
    size: float
    natural: Floats
    turns: BlockTurns
    choosers: list[Chooser]
    solvers: list[Any]
    shortened: bool

    def blocks_of(self, group: Group) -> list[int]: ...
    def labelled(self, group: Group) -> bool: ...
    def coordinates(self, x: Floats, u: Floats) -> dict[tuple[str, str], float]: ...
    def group_jacobian(self, x: Unknowns, u: Floats, group: Group) -> Floats: ...
    def candidates(
        self, group: Group, x: Unknowns, u: Floats, nearby: bool = False, *, drawn: bool = False
    ) -> tuple[list[Floats], bool, NoPose | None]: ...
    def turned(
        self, b: int, solutions: Floats | Sequence[Floats], x: Floats, u: Floats
    ) -> list[Floats]: ...
    def polish(self, b: int, x: Floats, u: Floats) -> Floats: ...


class ModeLabels:
    """Labels of the assembly modes of a scene.

    Parameters
    ----------
    assembler
        Gives all poses of one group.
    """

    def __init__(self, assembler: Assembling) -> None:
        self.assembler: Assembling = assembler
        self.scene: Scene = assembler.scene
        self.graphs: list[BlockGraph] = assembler.graphs.blocks
        self.solvers: list[BlockSolver] = assembler.solvers
        self.turns: BlockTurns = assembler.turns
        self.p: Floats = assembler.p

    def sign(self, group: Group, x: Unknowns, u: Floats) -> str:
        """Return + or -: orientation of the triangle of an RRR dyad, else sign of the Jacobian.

        A redundant group has no determinant, its sign is always +.
        """
        if group.superfluous:
            return "+"
        if group.kind == "RRR" and len(group.bodies) == 2 and group.higher_pairs == 0:
            value = self._orientation(group, x, u)
        else:
            value = float(np.linalg.slogdet(self.assembler.group_jacobian(x, u, group))[0])
        return "+" if value > 0 else "-" if value < 0 else "0"

    def _orientation(self, group: Group, x: Unknowns, u: Floats) -> float:
        def make() -> Sym:
            joints = self.scene.model.mechanism.joints
            inner = joints[group.inner[0]]
            first = group.bodies[0]
            outer = [joints[name] for name in group.joints if name != inner.name]
            outer.sort(key=lambda joint: first not in joint.bodies)
            pins = (outer[0].second, inner.second, outer[1].second)
            return ca.horzcat(*[self.scene.model.point(pin) for pin in pins])

        a, b, c = local(self.scene, ("triangle", group.index), make)(x, u, self.p).T
        return float((b - a)[0] * (c - b)[1] - (b - a)[1] * (c - b)[0])

    def of_group(self, group: Group, poses: list[Unknowns], u: Floats) -> list[str]:
        """Return the labels of all poses of one group: sign, and rank where it is no dyad.

        Whole turns of a dyad's body, which gears tell apart, are counted from the sketch.
        """
        signs = [self.sign(group, x, u) for x in poses]
        if self.signs_tell(group):
            return [sign + self._whole(group, x, u) for sign, x in zip(signs, poses, strict=True)]
        order = [self._rank(group, x, u) for x in poses]
        labels = []
        for k, sign in enumerate(signs):
            rank = 1 + sum(other == sign and order[i] < order[k] for i, other in enumerate(signs))
            labels.append(f"{sign}{rank}")
        return labels

    def of_pose(self, x: Unknowns, u: Floats) -> str:
        """Return the label of a solved pose among the modes at `u`."""
        labels = []
        for group in self.scene.groups:
            if not self.assembler.labelled(group):
                continue
            sign = self.sign(group, x, u)
            if self.signs_tell(group):
                labels.append(sign + self._whole(group, x, u))
                continue
            poses, _, _ = self.assembler.candidates(group, x, u)
            names = self.of_group(group, poses, u)
            blocks = self.assembler.blocks_of(group)
            for chooser in self.assembler.choosers:
                poses = [chooser.towards(pose, x) for pose in poses]
            gaps = [max(self.turns.apart(b, pose, x).max() for b in blocks) for pose in poses]
            labels.append(names[int(np.argmin(gaps))] if gaps else sign)
        return ",".join(labels)

    def _whole(self, group: Group, x: Unknowns, u: Floats) -> str:
        """Return the whole turns that a pose is away from the sketch as text, if there are any."""
        numbers = [
            self.turns.whole.number(i, x, u)
            for b in self.assembler.blocks_of(group)
            for j, i in enumerate(self.graphs[b].own)
            if self.solvers[b].turning[j] and not self.turns.lattices[b].single[j]
        ]
        return "".join(f":{number}" for number in numbers) if any(numbers) else ""

    def signs_tell(self, group: Group) -> bool:
        """Return whether the sign, with whole turns, tells the modes of a group apart."""
        return group.is_dyad or all(self.solvers[b].linear for b in self.assembler.blocks_of(group))

    def _rank(self, group: Group, x: Unknowns, u: Floats) -> tuple[float, ...]:
        """Return by what a group's poses are put in order: first contact or body's angle.

        A body that only slides has one angle in all modes: then the unknowns tell.
        """
        pose = x.copy()
        for b in self.assembler.blocks_of(group):
            unknowns, angle = self.graphs[b].own, self.solvers[b].angle
            turned = self.turns.lattices[b].remainder((x[unknowns] / (2 * np.pi))[None])[0]
            pose[unknowns] = np.where(angle, 2 * np.pi * turned, x[unknowns])
        unknowns = [i for b in self.assembler.blocks_of(group) for i in self.graphs[b].own]
        ranks = [chooser.rank(group, x, u) for chooser in self.assembler.choosers]
        known = [rank for rank in ranks if rank is not None]
        if known:
            first = known[0]
        elif self.scene.model.space is not PLANE:
            first = 0.0  # bodies have no angle
        else:
            first = self._angles(group, pose, u)[group.bodies[0]]
            model = self.scene.model
            if model.q_names[model.turn(group.bodies[0])] not in [
                self.scene.x_names[i] for i in unknowns
            ]:
                first -= 2 * np.pi * float(np.ceil(first / (2 * np.pi) - 0.5))
        return (round(first, 9), *np.round(pose[unknowns] / self.turns.natural[unknowns], 9))

    def _angles(self, group: Group, x: Unknowns, u: Floats) -> dict[str, float]:
        """Return the angles of a group's bodies at a pose."""
        frame = self.scene.model.frame
        function = local(
            self.scene,
            ("angles", group.index),
            lambda: ca.vertcat(*[frame(b).angle for b in group.bodies]),
        )
        return dict(zip(group.bodies, function(x, u, self.p).ravel().tolist(), strict=True))

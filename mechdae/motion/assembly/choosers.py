"""What a case may say about the poses of groups, and what is asked of who assembles them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.turns.block_turns import BlockTurns
from mechdae.types import Floats, Sym, Unknowns


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

"""Solutions of blocks that differ by whole turns: which are one pose, and which are modes.

A solver gives angles within its periods. The equations of gears, belts and racks hold unwrapped
angles: there whole turns make other modes (`turn_lattice`), elsewhere they make no difference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, PLACE
from mechdae.describe.coordinates import NamedCoordinate
from mechdae.equations.reduction import Scene
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.kernels.run.functions import Local
from mechdae.motion.assembly.elimination import BlockSolver
from mechdae.types import Floats, Unknowns

SAME = 1e-7
"""Largest difference of one and the same solution [rad, sizes of the mechanism]."""
FURTHER = 2
"""Whole turns, to either side, among which the one nearest to a sketch is looked for."""
SILENT = 1e-3
"""What the turns of a body count that the sketch does not name, beside those that it does."""
NOISE = 1e-6
"""Share of a turn within which a pose is half a turn away."""


class SingleTurns:
    """Whole turns of the angles of a block, each of which makes no difference by itself.

    Attributes
    ----------
    size
        Number of unknowns.
    basis : (r, n) array
        Vectors of turns that make no difference.
    single
        Whether a single turn of each unknown alone is one of them.
    """

    def __init__(self, angles: Sequence[bool]) -> None:
        self.size: int = len(angles)
        self.single: list[bool] = list(angles)
        self.basis: Floats = np.eye(self.size)[list(angles)]
        self._each = np.array(angles, float)

    moving: Sequence[Floats] = ()
    """Vectors of turns that leave the block as it is and move bodies solved later."""

    def remainder(self, gaps: Floats, weights: Floats | None = None) -> Floats:
        """Return gaps (k, n) [turns] less the vectors nearest to them.

        With `weights` (n,) some entries count more than others.
        """
        gaps = np.asarray(gaps, float)
        if not len(self.basis) or not len(gaps):
            return gaps
        turn = self._each
        with np.errstate(invalid="ignore", divide="ignore"):
            return gaps - np.where(turn > 0, turn * np.round(gaps / turn), 0.0)

    def classes(self, periods: Sequence[float]) -> Floats:
        """Return vectors of turns (k, n), one for each class that differs from the others, or None.

        They are made of `periods` [rad], 0 for what does not turn; None: there are too many.
        """
        return np.zeros((1, self.size))


class WholeTurns:
    """Whole turns of the angles of a scene, counted from the sketch.

    Parameters
    ----------
    scene
        Its unknowns and what follows from them.
    angles
        Sketched angles of bodies [rad].
    p
        Values of the parameters.
    """

    geared: Sequence[str] = ()
    """Sketched bodies whose unwrapped angles are in an equation."""

    def __init__(self, scene: Scene, angles: Mapping[str, float], p: Floats) -> None:
        self.scene: Scene = scene
        self.angles: Mapping[str, float] = angles
        self.p: Floats = p

    def lattices(
        self, blocks: list[list[int]], solvers: Sequence[BlockSolver]
    ) -> tuple[list[SingleTurns], list[bool]]:
        """Return for each block (unknowns in solve order) the whole turns that make no difference.

        And whether turns without end move bodies solved later.
        """

        def made() -> list[SingleTurns]:
            kinds = [[self.scene.unknowns[i].kind for i in block] for block in blocks]
            return [SingleTurns([kind is ANGLE for kind in block]) for block in kinds]

        turns: list[SingleTurns] = self.scene.cache("single turns", made)
        return turns, [False] * len(blocks)

    def told(self, i: int) -> list[tuple[str, Local]]:
        """Return the sketched geared bodies that turn like angle `i`, each with its angle."""
        return []

    def wanted(self, i: int, x: Unknowns, u: Floats) -> float:
        """Return the value of unknown angle `i` that the sketch asks for; 0 where it is silent.

        Of bodies that turn together it is the one that gears hang on that decides.
        """
        for body, angle in self.told(i):
            return float(x[i] - (angle(x, u, self.p).item() - self.angles[body]))
        return self.angles.get(self.scene.unknowns[i].owner, 0.0)

    def start(self, i: int, x: Unknowns, u: Floats) -> float:
        """Return the sketched angle `i` on the turn that the sketch asks for, nan without one."""
        joined = self.angles.get(self.scene.unknowns[i].owner)
        if not self.told(i):
            return np.nan if joined is None else joined
        wanted = self.wanted(i, x, u)
        return (
            wanted
            if joined is None
            else joined + 2 * np.pi * round((wanted - joined) / (2 * np.pi))
        )

    def number(self, i: int, x: Unknowns, u: Floats) -> int:
        """Return the whole turns of angle `i` between the sketch and a pose.

        Of two poses half a turn from the sketch it is always the lower one that counts as near.
        """
        turned = float(x[i]) - self.wanted(i, x, u)
        return math.floor(turned / (2 * math.pi) + 0.5 + NOISE)


class BlockTurns:
    """Whole turns of the solutions of a scene's blocks.

    Parameters
    ----------
    scene
        Its unknowns and what follows from them.
    graphs, solvers
        Kernel and solver of each block.
    whole
        Whole turns of single angles, counted from the sketch.
    sketch, places
        Sketched angles [rad] by owner, and places along curves [m].
    natural
        Size of each unknown (nx,).
    """

    def __init__(
        self, scene: Scene, graphs: Sequence[BlockGraph], solvers: Sequence[BlockSolver],
        sketch: Mapping[str, float], places: Mapping[NamedCoordinate, float], natural: Floats,
    ) -> None:  # fmt: skip
        self.scene: Scene = scene
        self.graphs: Sequence[BlockGraph] = graphs
        self.solvers: Sequence[BlockSolver] = solvers
        self.sketch: Mapping[str, float] = sketch
        self.natural: Floats = natural
        self._on_curves = {c.part: value for c, value in places.items() if c.on_curve}
        make = next(iter(scene.cases("whole turns")), WholeTurns)
        self.whole: WholeTurns = make(scene, sketch, scene.model.p_values)
        """Whole turns of single angles, counted from the sketch."""
        turns = self.whole.lattices([graph.own for graph in graphs], solvers)
        self.lattices: list[SingleTurns] = turns[0]
        self.endless: list[bool] = turns[1]
        """Whole turns by block that make no difference, and whether such without end move bodies
        solved later: modes are not all listed then."""
        self._classes: dict[tuple[int, bool], Floats] = {}

    def turned(
        self, b: int, solution: Floats, x: Unknowns, u: Floats, single: bool = False
    ) -> list[Floats]:
        """Return the solution with all whole turns of its angles that gears tell apart.

        A solver gives solutions within its periods, `single` ones within one turn.
        """
        if (b, single) not in self._classes:
            periods = self.solvers[b].turning
            periods = [min(period, 2 * np.pi) for period in periods] if single else periods
            self._classes[b, single] = self.lattices[b].classes(periods)
        turns = 2 * np.pi * self._classes[b, single]
        return [self._nearest(b, solution + turn, x, u) for turn in turns]

    def further(self, b: int, poses: list[Unknowns]) -> list[Unknowns]:
        """Return poses of block `b`, and those whole turns away that move bodies solved later."""
        turns = [k * 2 * np.pi * vector for vector in self.lattices[b].moving
                 for k in range(-FURTHER, FURTHER + 1) if k]  # fmt: skip
        unknowns = self.graphs[b].own
        return [*poses, *(put(x, unknowns, x[unknowns] + turn) for x in poses for turn in turns)]

    def _nearest(self, b: int, solution: Floats, x: Unknowns, u: Floats) -> Any:
        """Return the solution with whole turns that make no difference, nearest to the sketch."""
        graph, solver = self.graphs[b], self.solvers[b]
        result = np.array(solution, float)
        pose = put(x, graph.own, result)
        wanted = result.copy()
        for j, i in enumerate(graph.own):
            if solver.angle[j]:
                wanted[j] = self.wanted(i, pose, u)
            elif period := solver.period(j):
                result[j] -= period * np.round((result[j] - self.wanted(i, pose, u)) / period)
                wanted[j] = result[j]
        sketched = [self.scene.unknowns[i].owner in self.sketch for i in graph.own]
        gaps = (result - wanted) / (2 * np.pi)
        left = self.lattices[b].remainder(gaps[None], np.where(sketched, 1.0, SILENT))[0]
        return result - 2 * np.pi * np.round(gaps - left)

    def distinct(self, b: int, poses: list[Unknowns], u: Floats) -> list[Floats]:
        """Return poses of block `b` that differ by more than whole turns that make no difference.

        Those before the block are the same in all poses.
        """
        turning, single = self.solvers[b].turning, self.lattices[b].single
        once = all(one or not period for period, one in zip(turning, single, strict=True))
        if len(poses) < 2 or (once and max(turning, default=0.0) < 3 * np.pi):
            return poses  # a solver gives no solution twice within one turn
        kept: list[Floats] = []
        for x in poses:
            if not any(self.same(b, x, other) for other in kept):
                kept.append(x)
        return kept

    def same(self, b: int, x: Unknowns, y: Floats) -> bool:
        """Return whether two poses are the same in block `b`, but for turns and rounding."""
        return bool(self.apart(b, x, y).max(initial=0.0) < SAME)

    def apart(self, b: int, x: Floats, y: Floats) -> Any:
        """Return how far the unknowns of block `b` are apart, without turns [rad, sizes]."""
        unknowns = self.graphs[b].own
        unit = np.where(self.solvers[b].angle, 2 * np.pi, 1.0)
        gaps = self.lattices[b].remainder(((x - y)[unknowns] / unit)[None])[0] * unit
        periods = np.array(
            [0.0 if a else self.solvers[b].period(j) for j, a in enumerate(self.solvers[b].angle)]
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            gaps -= np.where(periods > 0, periods * np.round(gaps / periods), 0.0)
        return np.abs(gaps) / self.natural[unknowns]

    def wanted(self, i: int, x: Unknowns, u: Floats) -> float:
        """Return the sketched value of an unknown that has a period, in its absence a middle."""
        coordinate = self.scene.unknowns[i]
        if coordinate.kind is PLACE:
            return self._on_curves.get(coordinate.owner, coordinate.middle)
        return (
            self.whole.wanted(i, x, u)
            if coordinate.kind is ANGLE
            else self.sketch.get(coordinate.owner, 0.0)
        )


def put(x: Unknowns, unknowns: list[int], values: Floats | list[float]) -> Floats:
    """Return x with the unknowns of a block replaced."""
    result = x.copy()
    result[unknowns] = values
    return result

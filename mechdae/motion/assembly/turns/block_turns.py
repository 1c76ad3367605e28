"""Solutions of blocks that differ by whole turns: which are one pose, and which are modes.

A solver gives angles within its periods. The equations of gears, belts and racks hold unwrapped
angles: there whole turns make other modes, elsewhere they make no difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, PLACE
from mechdae.describe.coordinates import NamedCoordinate
from mechdae.equations.reduction import Scene
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.motion.assembly.elimination import BlockSolver
from mechdae.motion.assembly.turns.turn_lattice import lattices, with_periods
from mechdae.motion.assembly.turns.whole_turns import WholeTurns
from mechdae.types import Floats, Unknowns

SAME = 1e-7
"""Largest difference of one and the same solution [rad, sizes of the mechanism]."""
SILENT = 1e-3
"""What the turns of a body count that the sketch does not name, beside those that it does."""


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
        whole: WholeTurns, sketch: Mapping[str, float], places: Mapping[NamedCoordinate, float],
        natural: Floats,
    ) -> None:  # fmt: skip
        self.scene, self.graphs, self.solvers, self.whole = scene, graphs, solvers, whole
        self.sketch, self.natural = sketch, natural
        self._on_curves = {c.part: value for c, value in places.items() if c.on_curve}
        exact = lattices(scene, [graph.own for graph in graphs])
        self.lattices = [
            with_periods(lattice, solver.turning)
            for lattice, solver in zip(exact, solvers, strict=True)
        ]
        """Whole turns by block that make no difference."""
        self.endless = [a is not b for a, b in zip(exact, self.lattices, strict=True)]
        """Whether turns without end move bodies solved later: modes are not all listed."""
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
        told = [self.scene.unknowns[i].owner in self.sketch for i in graph.own]
        gaps = (result - wanted) / (2 * np.pi)
        left = self.lattices[b].remainder(gaps[None], np.where(told, 1.0, SILENT))[0]
        return result - 2 * np.pi * np.round(gaps - left)

    def distinct(self, b: int, poses: list[Unknowns], u: Floats) -> list[Floats]:
        """Return poses of block `b` that differ by more than whole turns that make no difference.

        Those before the block are the same in all poses.
        """
        turning, single = self.solvers[b].turning, self.lattices[b].single
        once = all(one or not period for period, one in zip(turning, single, strict=True))
        if len(poses) < 2 or (once and max(turning, default=0.0) < 3 * np.pi):
            return poses  # a solver gives no solution twice within one turn
        kept: list[Any] = []
        for x in poses:
            if not any(self.same(b, x, other) for other in kept):
                kept.append(x)
        return kept

    def same(self, b: int, x: Unknowns, y: Floats) -> bool:
        """Return whether two poses are the same in block `b`, but for turns and rounding."""
        return bool(self.apart(b, x, y).max(initial=0.0) < SAME)

    def apart(self, b: int, x: Unknowns, y: Floats) -> Any:
        """Return how far the unknowns of block `b` are apart, without turns [rad, sizes]."""
        own = self.graphs[b].own
        unit = np.where(self.solvers[b].angle, 2 * np.pi, 1.0)
        gaps = self.lattices[b].remainder(((x - y)[own] / unit)[None])[0] * unit
        periods = np.array(
            [0.0 if a else self.solvers[b].period(j) for j, a in enumerate(self.solvers[b].angle)]
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            gaps -= np.where(periods > 0, periods * np.round(gaps / periods), 0.0)
        return np.abs(gaps) / self.natural[own]

    def wanted(self, i: int, x: Unknowns, u: Floats) -> float:
        """Return the sketched value of an unknown that has a period, in its absence a middle."""
        own = self.scene.unknowns[i]
        if own.kind is PLACE:
            return self._on_curves.get(own.owner, own.middle)
        return self.whole.wanted(i, x, u) if own.kind is ANGLE else self.sketch.get(own.owner, 0.0)


def put(x: Unknowns, own: list[int], values: Any) -> Floats:
    """Return x with the unknowns of a block replaced."""
    result = x.copy()
    result[own] = values
    return result

"""The pose of a block that the sketch is but for rounding."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, PLACE
from mechdae.motion.assembly.nearest_mode import Sketched, SketchNumber
from mechdae.types import Floats, Jacobian, Matrix, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.blocks import BlockGraph

OWN = 1e-3
"""Largest step from a sketch to a pose that it is but for rounding [rad, sizes]."""
ITERATIONS, FITS = 12, 3
NUDGE = 1e-6


class SketchedBlock:
    """The equations of block `b` and what the sketch says, all in sizes of the mechanism.

    `u` (nd,): the drivers' values. ``size`` (n,): sizes of the block's unknowns.
    """

    def __init__(self, sketched: Sketched, b: int, u: Floats) -> None:
        assembler = self.assembler = sketched.assembler
        self.sketched, self.b, self.u, self.p = sketched, b, u, assembler.p
        self.graph: BlockGraph = assembler.graphs.blocks[b]
        self.unknowns, self.size = self.graph.own, assembler.natural[self.graph.own]
        lengths = [unit == "m" for unit in self.graph.block.units]
        self.units: Floats = np.where(lengths, assembler.size, 1.0)

    def equations(self, pose: Unknowns) -> tuple[Floats, Jacobian]:
        """Return residuals and Jacobian at a pose (nx,)."""
        F, J, _ = self.graph.value_at(pose, self.u, self.p)
        return F / self.units, J * self.size / self.units[:, None]

    def step(self, pose: Unknowns) -> tuple[Floats, Floats, Jacobian] | None:
        """Return Newton's step, residuals and Jacobian; None where these are not finite."""
        F, J = self.equations(pose)
        if not (np.isfinite(F).all() and np.isfinite(J).all()):
            return None
        step: Any = np.linalg.lstsq(J, F)[0]
        return step, F, J

    def gaps(self, entries: Sequence[SketchNumber], pose: Unknowns) -> Floats:
        """Return by how much a pose is off entries of the sketch."""
        return np.array([entry.gap(pose, self.u, self.p) for entry in entries])

    def slopes(
        self, entries: Sequence[SketchNumber], places: Sequence[int], pose: Unknowns
    ) -> Matrix:
        """Return the derivatives (m, n) of gaps by some of the block's unknowns."""
        here, slopes = self.gaps(entries, pose), np.zeros((len(entries), len(places)))
        for column, k in enumerate(places):
            moved = pose.copy()
            moved[self.unknowns[k]] += NUDGE * self.size[k]
            slopes[:, column] = (self.gaps(entries, moved) - here) / NUDGE
        return slopes


def own_pose(
    sketched: Sketched, b: int, x: Unknowns, u: Floats, begun: Floats | None = None
) -> Unknowns | None:
    """Return the solution of block `b` that the sketch is but for rounding, None: it is none.

    Angles and places on curves are those of the sketch, lengths the ones that fit best what
    it says, but where another start (nx,) is `begun` from; Newton's method must not lead away
    from them.
    """
    block = SketchedBlock(sketched, b, u)
    start = _start(block, x) if begun is None else begun
    if start is None:
        return None
    pose, last = start.copy(), math.inf
    for _ in range(ITERATIONS):
        found = block.step(pose)
        if found is None:
            return None
        moved = float(np.abs(found[0]).max())
        if moved > OWN or (moved >= last and last > OWN**2):
            return None
        if moved >= last or moved == 0.0:
            break
        pose[block.unknowns] -= found[0] * block.size
        last = moved
    return pose


def _start(block: SketchedBlock, x: Unknowns) -> Floats | None:
    """Return x with the unknowns of a block by the sketch, None where it is silent."""
    assembler, sketched, pose, lengths = block.assembler, block.sketched, x.copy(), []
    for k, i in enumerate(block.unknowns):
        coordinate = sketched.scene.unknowns[i]
        if coordinate.kind is PLACE or (
            coordinate.kind is ANGLE and coordinate.owner not in sketched.stage
        ):
            places = {c.part: v for c, v in assembler.places.items() if c.on_curve}
            pose[i] = places.get(coordinate.owner, np.nan)
        elif coordinate.kind is ANGLE:
            pose[i] = assembler.turns.whole.start(i, pose, block.u)
        else:
            lengths.append(k)
    unknowns = block.unknowns
    if not np.all(np.isfinite(pose[unknowns])):
        return None
    pose[unknowns] = assembler.solvers[block.b].with_tangents(pose[None, unknowns])[0]
    return _fitted(block, lengths, pose)


def _fitted(block: SketchedBlock, lengths: list[int], pose: Unknowns) -> Floats:
    """Return the pose with lengths that fit the equations of a block and the sketch best."""
    columns = [block.unknowns[k] for k in lengths]
    held = [e for e in block.sketched.entries if set(e.value.held[0]) & set(columns)]
    held = [e for e in held if max(e.value.held[0]) <= max(block.unknowns)]
    for _ in range(FITS if lengths else 0):
        F, J = block.equations(pose)
        rows = [J[:, lengths], block.slopes(held, lengths, pose)]
        step = np.linalg.lstsq(np.vstack(rows), np.append(F, block.gaps(held, pose)))[0]
        pose = pose.copy()
        pose[columns] -= step * block.size[lengths]
    return pose

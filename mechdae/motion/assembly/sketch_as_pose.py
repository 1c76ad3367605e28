"""The pose of a block that the sketch is but for rounding."""

from __future__ import annotations

import math

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, PLACE
from mechdae.motion.assembly.nearest_mode import Sketched
from mechdae.types import Floats, Unknowns

OWN = 1e-3
"""Largest step from a sketch to a pose that it is but for rounding [rad, sizes]."""
ITERATIONS, FITS = 12, 3
NUDGE = 1e-6


def own_pose(
    sketched: Sketched, b: int, x: Unknowns, u: Floats, begun: Floats | None = None
) -> Unknowns | None:
    """Return the solution of block `b` that the sketch is but for rounding, None: it is none.

    Angles and places on curves are those of the sketch, lengths the ones that fit best what
    it says, but where another start (nx,) is `begun` from; Newton's method must not lead away
    from them.
    """
    start = _start(sketched, b, x, u) if begun is None else begun
    if start is None:
        return None
    graph = sketched.assembler.graphs.blocks[b]
    unknowns, size = graph.own, sketched.assembler.natural[graph.own]
    units = [sketched.assembler.size if unit == "m" else 1.0 for unit in graph.block.units]
    pose, last = start.copy(), math.inf
    for _ in range(ITERATIONS):
        F, J, _ = graph.value_at(pose, u, sketched.assembler.p)
        if not (np.all(np.isfinite(F)) and np.all(np.isfinite(J))):
            return None
        step = np.linalg.lstsq(J * size / np.array(units)[:, None], F / units)[0]
        moved = float(np.abs(step).max())
        if moved > OWN or (moved >= last and last > OWN**2):
            return None
        if moved >= last or moved == 0.0:
            break
        pose[unknowns] -= step * size
        last = moved
    return pose


def _start(sketched: Sketched, b: int, x: Unknowns, u: Floats) -> Floats | None:
    """Return x with the unknowns of block `b` by the sketch, None where it is silent."""
    assembler, graph = sketched.assembler, sketched.assembler.graphs.blocks[b]
    pose, lengths = x.copy(), []
    for i in graph.own:
        coordinate = sketched.scene.unknowns[i]
        if coordinate.kind is PLACE or (
            coordinate.kind is ANGLE and coordinate.owner not in sketched.stage
        ):
            places = {c.part: v for c, v in assembler.places.items() if c.on_curve}
            pose[i] = places.get(coordinate.owner, np.nan)
        elif coordinate.kind is ANGLE:
            pose[i] = assembler.turns.whole.start(i, pose, u)
        else:
            lengths.append(i)
    if not np.all(np.isfinite(pose[graph.own])):
        return None
    pose[graph.own] = assembler.solvers[b].with_tangents(pose[None, graph.own])[0]
    return _fitted(sketched, b, lengths, pose, u)


def _fitted(sketched: Sketched, b: int, lengths: list[int], pose: Unknowns, u: Floats) -> Floats:
    """Return the pose with lengths that fit the equations of block `b` and the sketch best."""
    assembler = sketched.assembler
    graph, p, size = assembler.graphs.blocks[b], assembler.p, assembler.size
    units = np.array([size if unit == "m" else 1.0 for unit in graph.block.units])
    columns = [graph.own.index(i) for i in lengths]
    held = [e for e in sketched.entries if set(e.value.held[0]) & set(lengths)]
    held = [e for e in held if max(e.value.held[0]) <= max(graph.own)]
    for _ in range(FITS if lengths else 0):
        F, J, _ = graph.value_at(pose, u, p)
        gaps = np.array([entry.gap(pose, u, p) for entry in held])
        rows = [J[:, columns] * size / units[:, None]]
        for entry in held:
            ahead = []
            for i in lengths:
                moved = pose.copy()
                moved[i] += NUDGE * size
                ahead.append((entry.gap(moved, u, p) - entry.gap(pose, u, p)) / NUDGE)
            rows.append(np.array([ahead]))
        step = np.linalg.lstsq(np.vstack(rows), np.append(F / units, gaps))[0]
        pose = pose.copy()
        pose[lengths] -= step * size
    return pose

"""Spatial blocks from their sketch: modes it is but for rounding, unknowns that fit it best.

The sketch tells each of the block's angles, and what fixes its lengths. Where Newton's method
finds a solution next to it, another mode as near to the sketch would be as near to that solution;
there is none within 1/(beta kappa) of it (Newton and Kantorovich), as in `multistart`. Next to a
singular pose, which few starts of a search lead to, there may be.

Where the search from many starts fails: the sketch may say where points are and how joints are
turned; quaternions of bodies follow from that by least squares (Gauss and Newton) from a few
rotations, together with the block's equations.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, LENGTH, UNIT
from mechdae.motion.assembly.nearest_mode import ROUNDING, Sketched, SketchNumber
from mechdae.motion.assembly.sketch_as_pose import OWN, SketchedBlock
from mechdae.types import Floats, Unknowns

CLOSE = 1e-6
"""Farthest a sketch is from the pose that it is but for rounding [rad, sizes]."""
FARTHER = 10.0
"""Times the tie of two modes within which no other may lie: equations bend, lengths follow."""
MET = 1e-13
"""Largest residual of a solution, in sizes of the mechanism and radians."""
APART = 0.01
"""Share of 1/beta within which a solution is the only one: equations of size 1 bend by a few."""
ITERATIONS = 8


def drawn_pose(sketched: Sketched, b: int, x: Any, u: Any) -> tuple[Any, bool] | None:
    """Return the solution (n,) of block `b` that the sketch is, None if it is none.

    The second value tells whether it is nearer to the sketch than any other mode. `x` (nx,) has
    the unknowns of earlier blocks, `u` (nd,) are the drivers' values.
    """
    block = SketchedBlock(sketched, b, u)
    unknowns, size = block.unknowns, block.size
    places = {(c.part, c.word): value for c, value in block.assembler.places.items()}
    pose, lengths = x.copy(), []
    for k, i in enumerate(unknowns):
        unknown = sketched.scene.unknowns[i]
        if unknown.kind is LENGTH:
            lengths.append(k)
            pose[i] = places.get(unknown.key, 0.0)
        elif unknown.kind is ANGLE and unknown.key in places:
            pose[i] = places[unknown.key]
        else:
            return None

    sigma = 1.0
    if lengths:
        columns = [unknowns[k] for k in lengths]
        held = [e for e in sketched.entries if _tells(e, columns, unknowns)]
        for _ in range(ITERATIONS):
            F, J = block.equations(pose)
            A = np.vstack([J[:, lengths], block.slopes(held, lengths, pose)])
            step, _, _, values = np.linalg.lstsq(A, np.append(F, block.gaps(held, pose)))
            pose[columns] -= step * size[lengths]
            sigma = min(1.0, float(values[-1]))
            if np.abs(step).max() < CLOSE:
                break
    start, last = pose[unknowns].copy(), np.inf
    for _ in range(ITERATIONS):
        found = block.step(pose)
        if found is None:
            return None
        step, F, J = found
        moved = float(np.abs(step).max(initial=0.0))
        met = float(np.abs(F).max(initial=0.0)) <= MET
        if moved > CLOSE or (moved >= last and last > CLOSE**2 and not met):
            return None
        if moved >= last or moved == 0.0:
            break
        pose[unknowns] -= step * size
        last = moved
    far = float(np.abs((pose[unknowns] - start) / size).max(initial=0.0)) + ROUNDING
    beta = float(np.linalg.svd(J, compute_uv=False)[-1])
    return pose[unknowns], FARTHER * far < sigma * APART * beta


def _tells(entry: SketchNumber, columns: list[int], unknowns: list[int]) -> bool:
    """Return whether an entry of the sketch holds some of the lengths, and nothing unsolved."""
    held = set(entry.value.held[0])
    return bool(held & set(columns)) and held <= set(range(min(unknowns))) | set(unknowns)


FITS = 25
LARGEST = 0.7
"""Longest step [rad, sizes]."""
SETTLED = 1e-9
ROTATIONS = np.vstack([np.eye(4), [[1, 1, 1, 1], [1, -1, -1, 1], [1, 1, -1, -1], [1, -1, 1, -1]]])


def fitted_start(sketched: Sketched, b: int, x: Unknowns, u: Floats) -> Any:
    """Return x (nx,) with the unknowns of block `b` by the sketch, None where none fits.

    `x` has the unknowns of earlier blocks, `u` (nd,) are the drivers' values.
    """
    block = SketchedBlock(sketched, b, u)
    columns = block.unknowns
    places = {(c.part, c.word): value for c, value in block.assembler.places.items()}
    unknowns = [sketched.scene.unknowns[i] for i in columns]
    turned = [k for k, unknown in enumerate(unknowns) if unknown.kind is UNIT]
    known = set(range(min(columns))) | set(columns)
    held = [e for e in sketched.entries if set(columns) & set(e.value.held[0]) <= known]
    held = [entry for entry in held if set(entry.value.held[0]) & set(columns)]
    for rotation in ROTATIONS if turned else ROTATIONS[:1]:
        pose = x.copy()
        for k, i in enumerate(columns):
            pose[i] = places.get(unknowns[k].key, 0.0)
        for k in turned:
            pose[columns[k]] = rotation[int(unknowns[k].name[1:])] / np.linalg.norm(rotation)
        for _ in range(FITS):
            F, J = block.equations(pose)
            A = np.vstack([J, block.slopes(held, range(len(columns)), pose)])
            left = np.append(F, block.gaps(held, pose))
            if not (np.isfinite(A).all() and np.isfinite(left).all()):
                break
            step = np.linalg.lstsq(A, left)[0]
            longest = float(np.abs(step).max())
            pose[columns] -= step * block.size * min(1.0, LARGEST / max(longest, SETTLED))
            if longest < SETTLED:
                if np.abs(left).max() <= OWN:
                    return pose
                break
    return None

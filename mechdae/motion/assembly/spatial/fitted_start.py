"""A spatial block's unknowns that fit the sketch best: where the search from many starts fails.

The sketch may say where points are and how joints are turned; quaternions of bodies follow from
that by least squares (Gauss and Newton) from a few rotations, together with the block's equations.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.coordinate_kinds import UNIT
from mechdae.motion.assembly.nearest_mode import Sketched
from mechdae.motion.assembly.sketch_as_pose import OWN, SketchedBlock
from mechdae.types import Floats, Unknowns

ITERATIONS = 25
LARGEST = 0.7
"""Longest step [rad, sizes]."""
SETTLED = 1e-9
ROTATIONS = np.vstack([np.eye(4), [[1, 1, 1, 1], [1, -1, -1, 1], [1, 1, -1, -1], [1, -1, 1, -1]]])


def fitted_start(sketched: Sketched, b: int, x: Unknowns, u: Floats) -> Any:
    """Return x (nx,) with the unknowns of block `b` by the sketch, None where none fits.

    `x` has the unknowns of earlier blocks, `u` (nd,) are the drivers' values.
    """
    block = SketchedBlock(sketched, b, u)
    own = block.unknowns
    places = {(c.part, c.word): value for c, value in block.assembler.places.items()}
    unknowns = [sketched.scene.unknowns[i] for i in own]
    turned = [k for k, unknown in enumerate(unknowns) if unknown.kind is UNIT]
    known = set(range(min(own))) | set(own)
    held = [e for e in sketched.entries if set(own) & set(e.value.held[0]) <= known]
    held = [entry for entry in held if set(entry.value.held[0]) & set(own)]
    for rotation in ROTATIONS if turned else ROTATIONS[:1]:
        pose = x.copy()
        for k, i in enumerate(own):
            pose[i] = places.get(unknowns[k].key, 0.0)
        for k in turned:
            pose[own[k]] = rotation[int(unknowns[k].name[1:])] / np.linalg.norm(rotation)
        for _ in range(ITERATIONS):
            F, J = block.equations(pose)
            A = np.vstack([J, block.slopes(held, range(len(own)), pose)])
            left = np.append(F, block.gaps(held, pose))
            if not (np.isfinite(A).all() and np.isfinite(left).all()):
                break
            step = np.linalg.lstsq(A, left)[0]
            longest = float(np.abs(step).max())
            pose[own] -= step * block.size * min(1.0, LARGEST / max(longest, SETTLED))
            if longest < SETTLED:
                if np.abs(left).max() <= OWN:
                    return pose
                break
    return None

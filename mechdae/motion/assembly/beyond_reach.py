"""Whether a pose exists that no motion from the sketch reaches."""

from __future__ import annotations

import numpy as np

from mechdae.errors import FreedomError
from mechdae.motion.assembly.assembler import Assembler
from mechdae.types import Floats, Integers

CHECKED = 24
"""Poses that are looked at, spread over those that are lost."""
TRIED = 256
"""Poses of groups that are tried at one of them."""


def assembles(assembler: Assembler, signs: list[str], u: Floats) -> bool | None:
    """Return whether the mechanism assembles at `u` in the mode with these `signs` of its groups.

    None where it is not known: groups without a closed form are not searched for, and two modes of
    a larger group may have one sign.
    """
    groups = assembler.scene.groups
    wanted = dict(zip(filter(assembler.labelled, groups), signs, strict=True))
    waiting: list[tuple[int, Floats]] = [(0, np.zeros(assembler.graphs.nx))]
    known = True
    for _ in range(TRIED):
        if not waiting:
            return False if known else None
        done, x = waiting.pop()
        if done == len(groups):
            return True if all(map(assembler.labels.signs_tell, wanted)) else None
        group = groups[done]
        try:
            poses, sure, _ = assembler.candidates(group, x, u, search=False, measured=False)
        except FreedomError:
            return None
        known &= sure
        if group in wanted:
            poses = [
                pose for pose in poses if assembler.labels.sign(group, pose, u) == wanted[group]
            ]
        waiting += [(done + 1, pose) for pose in poses]
    return None


def assembled(
    assembler: Assembler, start: tuple[Floats, Floats], values: Floats, rows: Integers
) -> dict[int, bool | None]:
    """Return whether the poses `rows` can be assembled in the mode of the pose `start`, (x, u).

    `values` (n, nd) are the drivers' values; of many rows a sample is tried.
    """
    labels, groups = assembler.labels, assembler.scene.groups
    signs = [labels.sign(group, *start) for group in groups if assembler.labelled(group)]
    chosen = rows[np.linspace(0, len(rows) - 1, min(len(rows), CHECKED)).astype(int)]
    return {int(k): assembles(assembler, signs, values[k]) for k in dict.fromkeys(chosen.tolist())}

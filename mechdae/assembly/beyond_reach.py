"""Whether a pose exists that no motion from the sketch reaches."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.assembly.assembler import Assembler
from mechdae.errors import FreedomError

CHECKED = 24
"""Poses that are looked at, spread over those that are lost."""
TRIED = 256
"""Poses of groups that are tried at one of them."""


def assembles(assembler: Assembler, u: Any) -> bool | None:
    """Return whether the mechanism has any assembly mode at `u`; None where that is not known.

    Groups without a closed form are not searched for.
    """
    groups = assembler.scene.groups
    waiting: list[tuple[int, Any]] = [(0, np.zeros(assembler.graphs.nx))]
    known = True
    for _ in range(TRIED):
        if not waiting:
            return False if known else None
        done, x = waiting.pop()
        if done == len(groups):
            return True
        try:
            poses, sure, _ = assembler.candidates(groups[done], x, u, search=False, measured=False)
        except FreedomError:
            return None
        known &= sure
        waiting += [(done + 1, pose) for pose in poses]
    return None


def assembled(assembler: Assembler, values: Any, rows: Any) -> dict[int, bool | None]:
    """Return the numbers of the poses `rows` that can be assembled; of many, a sample is tried.

    `values` (n, nd) are the drivers' values.
    """
    chosen = rows[np.linspace(0, len(rows) - 1, min(len(rows), CHECKED)).astype(int)]
    return {int(k): assembles(assembler, values[k]) for k in dict.fromkeys(chosen.tolist())}

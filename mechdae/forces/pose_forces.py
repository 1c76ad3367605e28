"""Forces at the poses of a sweep; all solutions where friction may have none or several."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.forces.friction_solutions import FrictionSolutions
from mechdae.forces.inverse_dynamics import Loaded, Motion, Statics


@dataclass
class Answer:
    """Forces at the poses of a sweep.

    ``there`` (n,) tells which poses have rates, ``jammed``, ``ambiguous`` which of them have
    no solution or several; ``found`` has all solutions of those by pose. ``free`` is what acts
    without friction, ``sizes`` and ``quiet`` the sizes with and without it.
    """

    motion: Motion
    inputs: list[Any]
    there: Any
    jammed: Any
    ambiguous: Any
    found: dict[int, FrictionSolutions]
    sizes: Any
    quiet: Any
    whole: Loaded
    free: Loaded


def solved(statics: Statics, motion: Motion, status: Any) -> Answer:
    """Return the forces at poses, all solutions where there may be none or several."""
    n = len(motion)
    there = ((status == "ok") | (status == "ambiguous")) & motion.there
    inputs = statics.inputs(motion)
    jammed, ambiguous = np.zeros(n, bool), np.zeros(n, bool)
    if statics.task.friction != "coupled" or not statics.frictional:
        quiet = statics.sizes(inputs)[0]
        free = statics.loaded(inputs, quiet, friction=False)
        free.put(np.flatnonzero(~there), np.nan)
        return Answer(motion, inputs, there, jammed, ambiguous, {}, quiet, quiet, free, free)
    forces, found = statics.settled(inputs, there)
    for k, own in found.items():
        jammed[k], ambiguous[k] = len(own.sizes) == 0, len(own.sizes) > 1
    free, whole = forces.free, forces.whole
    free.put(np.flatnonzero(~there), np.nan)
    whole.put(np.flatnonzero(~there | jammed), np.nan)
    sizes, quiet = forces.sizes, forces.quiet
    return Answer(motion, inputs, there, jammed, ambiguous, found, sizes, quiet, whole, free)

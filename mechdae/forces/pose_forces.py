"""Forces at poses; all solutions where friction may have none or several."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from mechdae.forces.friction_branches import FrictionSolutions, some
from mechdae.forces.inverse_dynamics import InverseDynamics, Loaded, LoadedPoses
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Matrix


@dataclass
class PoseForces:
    """Forces at poses.

    ``there`` (n,) tells which poses have forces, as far as one may know before they are solved,
    ``good`` (n,) which have proved to have one solution; ``found`` has all those of others, by
    pose. ``quiet`` and ``sizes`` (n, feedbacks) are sizes of friction without it and with it,
    ``free`` and ``whole`` what acts; the same where friction is not coupled.
    """

    motion: LoadedPoses
    inputs: list[Matrix]
    there: Any
    quiet: Floats
    sizes: Matrix
    good: Any
    free: Loaded
    whole: Loaded
    found: dict[int, FrictionSolutions]

    @cached_property
    def counts(self) -> Integers:
        """Numbers of solutions, (n,)."""
        counts = np.ones(len(self.motion), int)
        for k, solutions in self.found.items():
            counts[k] = len(solutions.sizes)
        return counts

    @property
    def jammed(self) -> Any:
        """Where there is no solution."""
        return self.counts == 0

    @property
    def ambiguous(self) -> Booleans:
        """Where there are several."""
        return self.counts > 1

    @property
    def standing(self) -> Any:
        """Where there are forces."""
        return self.there & ~self.jammed

    @property
    def coupled(self) -> bool:
        """Whether friction acts on the reactions it comes from."""
        return self.whole is not self.free

    def leave_out(self, poses: Booleans) -> None:
        """Let some poses (n,) have no forces."""
        for loaded in (self.free, self.whole):
            loaded.put(np.flatnonzero(poses), np.nan)


def solved(
    statics: InverseDynamics, motion: LoadedPoses, there: Booleans, critical: bool = True
) -> PoseForces:
    """Return the forces at poses, all solutions where there may be none or several.

    Only poses that are `there` (n,) are examined for these. Of several solutions the one that
    continues from no friction is taken; poses without a solution are nan. `critical` asks for the
    factor on friction at which they end.
    """
    inputs = statics.inputs(motion)
    if not statics.coupled:
        quiet = statics.sizes(inputs)[0]
        free = statics.loaded(inputs, quiet, friction=False)
        good = np.ones(len(motion), bool)
        return PoseForces(motion, inputs, there, quiet, quiet, good, free, free, {})
    quiet, sizes, good, free, whole = statics.forces(inputs)
    rows, found = np.flatnonzero(there & ~good), dict[int, FrictionSolutions]()
    if rows.size:
        every = statics.branches.at(some(inputs, rows), critical)
        found = dict(zip(rows.tolist(), every, strict=True))
        for k, solutions in found.items():
            sizes[k] = solutions.sizes[solutions.connected or 0] if len(solutions.sizes) else np.nan
        whole.put(rows, statics.loaded(some(inputs, rows), sizes[rows]))
    result = PoseForces(motion, inputs, there, quiet, sizes, good, free, whole, found)
    whole.put(np.flatnonzero(result.jammed), np.nan)
    return result

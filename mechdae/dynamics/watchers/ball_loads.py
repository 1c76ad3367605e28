"""Where the law of a ball's friction leaves its moment open: about the line of its load.

A ball has no drag about that line. Where its spin turns into it, or a moment about it acts on a
ball that sticks, the law says how large the moment of friction may be and not how large it is.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.friction_sizes import pressing
from mechdae.dynamics.undetermined_messages import NoWay
from mechdae.dynamics.watchers.glides import LEAST
from mechdae.equations.forces.feedback import ACROSS

SHARPEST = 1e-6
"""Square of the sine between a ball's spin and its load at which its friction is left open."""


class BallLoads:
    """Watches spins and moments of balls about the lines of their loads."""

    def __init__(self, setup: MotionProblem) -> None:
        self.setup, self.kernel = setup, setup.kernel

    @cached_property
    def sizes(self) -> dict[int, int]:
        """Place of a ball's slip -> that of its size |t|, those of p t / |t| come after it."""
        rubbing = self.setup.released.rubbing
        laws = [feedback.law for feedback in rubbing.feedbacks]
        return {
            k: j
            for j, k in enumerate(rubbing.owners)
            if k is not None and j + 1 < len(laws) and laws[j + 1] in ACROSS
        }

    def left(self, k: int, held: Any, at: tuple[Any, Any, Any, Any]) -> Any:
        """Return what is left (n,) at states `at` until the law of a ball leaves its moment open.

        `held`: moments (n, 3) that hold it while it sticks; None while it turns.
        """
        sizes, forms = pressing(self.kernel)(*at)
        j = self.sizes[k]
        if held is None:
            along = (sizes[:, j + 1 : j + 4] ** 2).sum(axis=1)
            return sizes[:, j] ** 2 - SHARPEST * (sizes[:, j] ** 2 + along)
        load = forms[:, self.kernel.places[j]]
        square = (load**2).sum(axis=1)
        about = (held * load).sum(axis=1) ** 2 / np.maximum(square, LEAST)
        return SHARPEST * square * self._radius(k) ** 2 - about

    def _radius(self, k: int) -> float:
        """Return the radius of the friction circle of a ball."""
        values = self.setup.problem.mechanism.values()
        name = self.setup.released.rubbing.slips[k].owner
        f = values[f"{name}.friction"]
        return float(values[f"{name}.ball_radius"] * f / np.sqrt(1 + f * f))

    def verdict(self, name: str) -> NoWay:
        """Return the verdict on a ball."""
        return NoWay(
            f"{name} turns about the line of its load (F6): its friction keeps it there by a "
            f"moment that its law leaves open",
            "ambiguous",
            "F6",
            joints=[name],
        )

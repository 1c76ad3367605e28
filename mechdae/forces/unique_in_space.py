"""Unique directions of reactions in space, in axes in which they stand still."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.reduction import Scene
from mechdae.kernels.run.functions import Batch
from mechdae.records import dataclass


@dataclass
class SpatialDirections:
    """Unique directions (k, 6) of force and moment of a joint, in the axes of `frame`.

    ``turns`` (n, 3, 3) lead from these axes to the world's.
    """

    frame: str
    directions: Any
    turns: Any

    def values(self, reaction: Any) -> dict[str, Any]:
        """Return directions and the reaction's values along them, for (n, 6) reactions."""
        both = reaction.reshape(len(reaction), 2, 3)
        turned = np.einsum("nji,nkj->nki", self.turns, both).reshape(len(reaction), 6)
        values = turned @ self.directions.T
        return {"directions": self.directions, "values": values, "frame": self.frame}


class Orientations:
    """Rotation matrices of a scene's bodies at poses q (n, columns)."""

    def __init__(self, scene: Scene, columns: Sequence[int], q: Any) -> None:
        self.model, self._scene, self._columns, self._q = scene.model, scene, list(columns), q
        self.world = np.broadcast_to(np.eye(3), (len(q), 3, 3))

    def of(self, body: str) -> Any:
        """Return the matrices (n, 3, 3) from a body's axes to the world's."""
        model: Any = self.model

        def make() -> Batch:
            flat = ca.densify(ca.vec(model.frame(body).R.T))
            inputs = [model.q[self._columns], model.p]
            return Batch(ca.Function("turn", inputs, [flat]), [1])

        batch: Batch = self._scene.cache(("orientation", body), make)
        return batch(self._q, model.p_values)[0].reshape(-1, 3, 3)


def still_directions(
    orientations: Orientations, name: str, spaces: list[Any], chosen: Any
) -> Iterator[tuple[str, Any, list[Any]]]:
    """Yield axes, their matrices, and the directions (k, 6) at `chosen` poses in these axes."""
    model: Any = orientations.model
    joint = model.mechanism.joints[name]
    for frame in ("world", joint.second_body, joint.first_body):
        world = frame == "world"
        if not world and (frame not in model.mechanism.bodies or frame in model.idle):
            continue
        turns = orientations.world if world else orientations.of(frame)
        still = []
        for space, k in zip(spaces, chosen, strict=True):
            both = space.reshape(len(space), 2, 3)
            still.append(np.einsum("ji,skj->ski", turns[k], both).reshape(len(space), 6))
        yield frame, turns, still

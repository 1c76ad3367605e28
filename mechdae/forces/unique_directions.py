"""Unique directions of reactions, in axes in which they stand still.

Force and moment are vectors (3,) each: in the plane one vector (Fx, Fy, M), turned about z.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from mechdae.equations.model import Model
from mechdae.equations.structure_cache import StructureCache
from mechdae.kernels.run.functions import Batch
from mechdae.records import dataclass
from mechdae.types import Floats, Integers, Matrix


@dataclass
class Directions:
    """Unique directions (k, 3) or, in space, (k, 6) of a joint's reaction in the axes of `frame`.

    ``turns`` (n, 3, 3) lead from these axes to the world's.
    """

    frame: str
    directions: Floats
    turns: Floats

    def values(self, reaction: Floats) -> dict[str, Matrix | str]:
        """Return directions and the values along them of reactions (n, 3) or (n, 6)."""
        values = in_axes(self.turns, reaction) @ self.directions.T
        return {"directions": self.directions, "values": values, "frame": self.frame}


def in_axes(turns: Floats, reaction: Floats) -> Floats:
    """Return reactions (n, 3) or (n, 6) in axes that `turns` (n, 3, 3) lead to the world's."""
    vectors = reaction.reshape(len(reaction), reaction.shape[1] // 3, 3)
    turned: Floats = np.einsum("nji,nkj->nki", turns, vectors)
    return turned.reshape(reaction.shape)


class Orientations:
    """Rotation matrices of a model's bodies at poses q (n, columns)."""

    def __init__(
        self, model: Model, cache: StructureCache, columns: Sequence[int], q: Floats
    ) -> None:
        self._cache, self._columns, self._q = cache, list(columns), q
        self.model: Model = model
        self.world: Floats = np.broadcast_to(np.eye(3), (len(q), 3, 3))

    def has(self, body: str) -> bool:
        """Return whether a body moves and has axes: a link that spins freely has none."""
        return body in self.model.mechanism.bodies and body not in self.model.spinning

    def of(self, body: str) -> Floats:
        """Return the matrices (n, 3, 3) from a body's axes to the world's."""
        model = self.model
        if not model.space.behind:
            return self.about(body, 0.0)

        def build() -> Batch:
            flat = ca.densify(ca.vec(model.frame(body).R.T))
            inputs = [model.q[self._columns], model.p]
            return Batch(ca.Function("turn", inputs, [flat]), [1])

        batch: Batch = self._cache(("orientation", body), build)
        turns: Floats = batch(self._q, model.p_values)[0]
        return turns.reshape(-1, 3, 3)

    def about(self, body: str, angle: float) -> Floats:
        """Return the matrices (n, 3, 3) from axes at an angle on a body of the plane."""
        angles = np.full(len(self._q), angle)
        if self.has(body):
            angles = angles + self._q[:, self._columns.index(self.model.turn(body))]
        c, s, turns = np.cos(angles), np.sin(angles), np.zeros((len(angles), 3, 3))
        turns[:, 0, 0], turns[:, 0, 1], turns[:, 1, 0], turns[:, 1, 1] = c, -s, s, c
        turns[:, 2, 2] = 1.0
        return turns


def still_directions(
    orientations: Orientations, name: str, spaces: Sequence[Floats], chosen: Integers
) -> Directions:
    """Return the unique directions of a joint's reaction in the axes in which they stand still.

    `spaces` are bases (k, 3) or (k, 6) of them at the poses `chosen`, in the world's axes.
    """
    joint = orientations.model.mechanism.joints[name]
    for frame in ("world", joint.second_body, joint.first_body):
        if frame != "world" and not orientations.has(frame):
            continue
        turns = orientations.world if frame == "world" else orientations.of(frame)
        still = [
            in_axes(np.broadcast_to(turns[k], (len(space), 3, 3)), space)
            for space, k in zip(spaces, chosen, strict=True)
        ]
        shared = common(still)
        if len(shared) == min(map(len, still)):
            return Directions(frame, tidy(shared), turns)
    return Directions("world", spaces[0][:0], orientations.world)


def common(spaces: Sequence[Floats]) -> Floats:
    """Return an orthonormal basis (k, d) of what lies in all spaces.

    At single poses a joint may have more: where the self-stress does not pass through it.
    """
    outside = sum(np.eye(space.shape[1]) - _projector(space) for space in spaces)
    values, vectors = np.linalg.eigh(outside)
    return vectors[:, values < 1e-8].T


def _projector(space: Floats) -> Floats:
    if not len(space):
        return np.zeros((space.shape[1], space.shape[1]))
    basis: Floats = np.linalg.qr(space.T)[0]
    return basis @ basis.T


def tidy(rows: Floats) -> Floats:
    """Return the same directions with a leading positive entry, axes where they span a plane."""
    if not len(rows):
        return rows
    rows = rows.copy()
    place = 0
    for column in range(rows.shape[1]):  # reduced row echelon form, then normalised
        if place == len(rows):
            break
        pivot = place + int(np.argmax(np.abs(rows[place:, column])))
        if abs(rows[pivot, column]) < 1e-7:
            continue
        rows[[place, pivot]] = rows[[pivot, place]]
        rows[place] /= rows[place, column]
        for row in range(len(rows)):
            if row != place:
                rows[row] -= rows[row, column] * rows[place]
        place += 1
    rows[np.abs(rows) < 1e-15] = 0.0
    unit: Floats = rows / np.sqrt((rows * rows).sum(axis=1))[:, None]
    return unit

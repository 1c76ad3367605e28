"""What is visited: places of a point, poses of a body in the plane or in space.

A pose counts by how far the origin of the body's frame is from its target, and by the directions:
an angle phi between both counts 2 sin(phi/2) times the size of the targets. In space that is the
norm of R - R* by sqrt 2.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.goals import Visits
from mechdae.design.synthesis.nlp import Nlp
from mechdae.equations.model import Model
from mechdae.errors import InputError
from mechdae.results.rotations import matrices
from mechdae.types import Floats, Sym


class Visited:
    """Places (k, w) of a point.

    ``wanted``: rows of what is compared at each target, places first. ``size``: root of the mean
    square distance of the places from their middle [m].
    """

    def __init__(self, asked: Visits) -> None:
        self.what: str = asked.what
        places = np.array(asked.places)
        self.width: int = places.shape[1]
        self.wanted: Floats = self._rows(asked)
        self.size: float = float(
            np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1)))
        )

    def _rows(self, asked: Visits) -> Floats:
        return np.array(asked.targets)

    def asks(self, model: Model) -> Sym:
        """Return what is compared with a row, over the coordinates of a model."""
        return model.point(self.what)

    def gap(self, value: Sym, wanted: Sym) -> Sym:
        """Return the (dimensionless) distance of a pose from its target, by components."""
        return (value[: self.width] - wanted[: self.width]) / self.size

    def met(self, nlp: Nlp, value: Sym, wanted: Sym) -> None:
        """Add that a target is met exactly."""
        nlp.constrain("target", self.gap(value, wanted), unit=self.size)

    def squares(self, values: Floats, wanted: Floats) -> Any:
        """Return the (dimensionless) squared distances of values (..., w) from wanted ones."""
        gap = values[..., : self.width] - wanted[..., : self.width]
        return np.sum(gap**2, axis=-1) / self.size**2


class PlanarPoses(Visited):
    """Poses (k, 3) of a body: origin of its frame and angle."""

    def asks(self, model: Model) -> Sym:
        return ca.vertcat(model.origin(self.what), model.frame(self.what).angle)

    def gap(self, value: Sym, wanted: Sym) -> Sym:
        turn = value[2] - wanted[2]
        return ca.vertcat(super().gap(value, wanted), ca.sin(turn), 1 - ca.cos(turn))

    def met(self, nlp: Nlp, value: Sym, wanted: Sym) -> None:
        gap = self.gap(value, wanted)
        nlp.constrain("target", gap[:3], unit=self.size)
        # the same direction, not the opposite one
        nlp.constrain("target", gap[3], -np.inf, 1.0, self.size)

    def squares(self, values: Floats, wanted: Floats) -> Any:
        return super().squares(values, wanted) + 2 - 2 * np.cos(values[..., 2] - wanted[..., 2])


class SpatialPoses(Visited):
    """Poses of a body: origin of its frame and rotation matrix by columns, rows (k, 12)."""

    def _rows(self, asked: Visits) -> Floats:
        rows = np.array(asked.targets)
        e = rows[:, 3:] / np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
        return np.concatenate([rows[:, :3], matrices(e).transpose(0, 2, 1).reshape(-1, 9)], axis=1)

    def asks(self, model: Model) -> Sym:
        idle = getattr(model, "idle", {})
        if self.what in idle:
            raise InputError(
                f"{self.what} spins freely about the line of its ball joints: it has no pose",
                where="goal.body", hint="a body that is held, or a path of a point on that line",
            )  # fmt: skip
        frame: Any = model.frame(self.what)
        return ca.vertcat(model.origin(self.what), ca.vec(frame.R))

    def gap(self, value: Sym, wanted: Sym) -> Sym:
        turned = (value[3:] - wanted[3:]) / np.sqrt(2)
        return ca.vertcat(super().gap(value, wanted), turned)

    def met(self, nlp: Nlp, value: Sym, wanted: Sym) -> None:
        nlp.constrain("target", super().gap(value, wanted), unit=self.size)
        Q = ca.reshape(wanted[3:], 3, 3).T @ ca.reshape(value[3:], 3, 3)
        sines = ca.vertcat(Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]) / 2
        nlp.constrain("target", sines, unit=self.size)
        # the same orientation, not one half a turn away
        nlp.constrain("target", (3 - ca.trace(Q)) / 2, -np.inf, 1.0, self.size)

    def squares(self, values: Floats, wanted: Floats) -> Any:
        turned = values[..., 3:] - wanted[..., 3:]
        return super().squares(values, wanted) + np.sum(turned**2, axis=-1) / 2


def visited(asked: Visits) -> Visited:
    """Return what a goal of visits compares."""
    if not asked.is_motion:
        return Visited(asked)
    return PlanarPoses(asked) if len(asked.targets[0]) == 3 else SpatialPoses(asked)

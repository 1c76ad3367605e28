"""What is visited: places of a point, poses of a body in the plane or in space.

A pose counts by how far the origin of the body's frame is from its target, and by the directions:
an angle phi between both counts 2 sin(phi/2) times the size of the targets. In space that is the
norm of R - R* by sqrt 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.goals import Visits
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.errors import InputError
from mechdae.model.model import Model
from mechdae.results import Result
from mechdae.results.rotations import matrices
from mechdae.synthesis.nlp import Nlp

TURN = 2 * np.pi
ORIGIN = "origin_of_the_frame"
AXES = tuple(f"{ORIGIN}_{axis}" for axis in "xyz")
"""Names of the points that a design has where deviations of a body are asked for."""


class Visited:
    """Places (k, w) of a point.

    Attributes
    ----------
    wanted
        Rows of what is compared at each target, places first.
    width
        Coordinates of a place.
    size
        Root of the mean square distance of the places from their middle [m].
    """

    def __init__(self, asked: Visits) -> None:
        self.what = asked.what
        places = np.array(asked.places)
        self.width = places.shape[1]
        self.wanted = self._rows(asked)
        self.size = float(np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1))))

    def _rows(self, asked: Visits) -> Any:
        return np.array(asked.targets)

    @property
    def places(self) -> Any:
        """Where the targets are, (k, 2) or (k, 3) [m]."""
        return self.wanted[:, : self.width]

    def asks(self, model: Model) -> Any:
        """Return what is compared with a row, over the coordinates of a model."""
        return model.point(self.what)

    def gap(self, value: Any, wanted: Any) -> Any:
        """Return the (dimensionless) distance of a pose from its target, by components."""
        return (value[: self.width] - wanted[: self.width]) / self.size

    def met(self, nlp: Nlp, value: Any, wanted: Any) -> None:
        """Add that a target is met exactly."""
        nlp.constrain("target", self.gap(value, wanted), unit=self.size)

    def squares(self, values: Any, wanted: Any) -> Any:
        """Return the (dimensionless) squared distances of values (..., w) from wanted ones."""
        gap = values[..., : self.width] - wanted[..., : self.width]
        return np.sum(gap**2, axis=-1) / self.size**2

    def errors(self, found: Result, design: Any) -> Any:
        """Return the errors (k,) of swept poses [m]."""
        gap = found.points[self.what].position - self.places
        return np.sqrt(np.sum(gap**2, axis=1))

    def deviated(self, at: Any, design: Any, names: Sequence[str]) -> tuple[Any, Any]:
        """Return residuals (k, m) [m] at driver values, and derivatives (k, m, nt) by names."""
        task = Sweep(Driver(design.driver, at=tuple(float(u) for u in at)))
        path = f"points/{self.what}/position"
        value, slopes = design.slopes(task, (path,), names)[path]
        return value - self.places, slopes


class PlanarPoses(Visited):
    """Poses (k, 3) of a body: origin of its frame and angle."""

    def asks(self, model: Model) -> Any:
        return ca.vertcat(model.origin(self.what), model.frame(self.what).angle)

    def gap(self, value: Any, wanted: Any) -> Any:
        turn = value[2] - wanted[2]
        return ca.vertcat(super().gap(value, wanted), ca.sin(turn), 1 - ca.cos(turn))

    def met(self, nlp: Nlp, value: Any, wanted: Any) -> None:
        gap = self.gap(value, wanted)
        nlp.constrain("target", gap[:3], unit=self.size)
        # the same direction, not the opposite one
        nlp.constrain("target", gap[3], -np.inf, 1.0, self.size)

    def squares(self, values: Any, wanted: Any) -> Any:
        return super().squares(values, wanted) + 2 - 2 * np.cos(values[..., 2] - wanted[..., 2])

    def deviated(self, at: Any, design: Any, names: Sequence[str]) -> tuple[Any, Any]:
        task = Sweep(Driver(design.driver, at=tuple(float(u) for u in at)))
        paths = (f"points/{self.what}.{ORIGIN}/position", f"bodies/{self.what}/angle")
        found = design.slopes(task, paths, names, self.what)
        (places, moved), (angle, turned) = (found[path] for path in paths)
        turn = angle[:, 0] - self.wanted[:, 2]
        residuals = np.column_stack(
            [places - self.places, self.size * np.sin(turn), self.size * (1 - np.cos(turn))]
        )
        slopes = self.size * np.stack([np.cos(turn), np.sin(turn)], axis=1)[:, :, None] * turned
        return residuals, np.concatenate([moved, slopes], axis=1)

    def errors(self, found: Result, design: Any) -> Any:
        angle = found.bodies[self.what].angle
        turn = (angle - self.wanted[:, 2] + np.pi) % TURN - np.pi
        gap = np.hypot(*(design.origin(found, self.what) - self.places).T)
        return np.hypot(gap, self.size * 2 * np.sin(np.abs(turn) / 2))


class SpatialPoses(Visited):
    """Poses of a body: origin of its frame and rotation matrix by columns, rows (k, 12)."""

    def _rows(self, asked: Visits) -> Any:
        rows = np.array(asked.targets)
        e = rows[:, 3:] / np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
        return np.concatenate([rows[:, :3], _columns(e)], axis=1)

    def asks(self, model: Model) -> Any:
        idle = getattr(model, "idle", {})
        if self.what in idle:
            raise InputError(
                f"{self.what} spins freely about the line of its ball joints: it has no pose",
                where="goal.body", hint="a body that is held, or a path of a point on that line",
            )  # fmt: skip
        frame: Any = model.frame(self.what)
        return ca.vertcat(model.origin(self.what), ca.vec(frame.R))

    def gap(self, value: Any, wanted: Any) -> Any:
        turned = (value[3:] - wanted[3:]) / np.sqrt(2)
        return ca.vertcat(super().gap(value, wanted), turned)

    def met(self, nlp: Nlp, value: Any, wanted: Any) -> None:
        nlp.constrain("target", super().gap(value, wanted), unit=self.size)
        Q = ca.reshape(wanted[3:], 3, 3).T @ ca.reshape(value[3:], 3, 3)
        sines = ca.vertcat(Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]) / 2
        nlp.constrain("target", sines, unit=self.size)
        # the same orientation, not one half a turn away
        nlp.constrain("target", (3 - ca.trace(Q)) / 2, -np.inf, 1.0, self.size)

    def squares(self, values: Any, wanted: Any) -> Any:
        turned = values[..., 3:] - wanted[..., 3:]
        return super().squares(values, wanted) + np.sum(turned**2, axis=-1) / 2

    def deviated(self, at: Any, design: Any, names: Sequence[str]) -> tuple[Any, Any]:
        task = Sweep(Driver(design.driver, at=tuple(float(u) for u in at)))
        paths = tuple(f"points/{self.what}.{point}/position" for point in (ORIGIN, *AXES))
        found = design.slopes(task, paths, names, self.what)
        (place, moved), *ends = (found[path] for path in paths)
        share = self.size / np.sqrt(2)
        turned = np.concatenate([end - place for end, _ in ends], axis=1) - self.wanted[:, 3:]
        slopes = [moved, *(share * (slope - moved) for _, slope in ends)]
        residuals = np.concatenate([place - self.places, share * turned], axis=1)
        return residuals, np.concatenate(slopes, axis=1)

    def errors(self, found: Result, design: Any) -> Any:
        turned = _columns(found.bodies[self.what].orientation)
        values = np.concatenate([design.origin(found, self.what), turned], axis=1)
        return self.size * np.sqrt(self.squares(values, self.wanted))


def _columns(quaternions: Any) -> Any:
    """Return rotation matrices column by column, (n, 9)."""
    return matrices(quaternions).transpose(0, 2, 1).reshape(-1, 9)


def visited(asked: Visits) -> Visited:
    """Return what a goal of visits compares."""
    if not asked.is_motion:
        return Visited(asked)
    return PlanarPoses(asked) if len(asked.targets[0]) == 3 else SpatialPoses(asked)

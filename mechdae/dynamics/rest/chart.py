"""The assembly mode of a pose of a released mechanism, decided by some of its coordinates.

With as many independent coordinates as there are freedoms named as drivers, the modes are those
that a task of kind `modes` with these drivers counts. Where no group's Jacobian changes its sign
along a way, the way stays on one mode.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.describe.coordinates import BALL, NamedCoordinate
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.sketch import Transfer, wound
from mechdae.equations.coordinates import QUATERNION
from mechdae.errors import InputError, MechdaeError, within
from mechdae.motion.assembly.not_assembled import mode_by_label
from mechdae.motion.kinematics.driverless import independent, likely_drivers
from mechdae.motion.kinematics.prepared import Setting, prepare
from mechdae.types import Floats, Graph, Matrix, Unknowns

GROUPS = 8
"""Groups up to which the modes of a scene are counted."""


class Chart:
    """Assembly modes of a mechanism at rest."""

    def __init__(self, setup: MotionProblem, x: Unknowns, basis: Matrix, names: list[str]) -> None:
        self.setup = setup
        self.in_space: bool = setup.problem.mechanism.dimension == 3
        self.coordinates: list[NamedCoordinate] = self._chosen(x, basis, names)
        self.names: list[str] = [c.text for c in self.coordinates]
        r, model = setup.released, setup.model
        held = [law.coordinate for law in setup.laws]
        self.drivers: list[NamedCoordinate] = [*held, *self.coordinates]
        values = [model.coordinate(c) for c in self.drivers]
        k = setup.kernel

        def build() -> Graph:
            moved = r.moved(ca.vertcat(r.model.q, *values))
            rows = r.moved(ca.vertcat(*values[len(held) :])) if self.coordinates else ca.SX(0, 1)
            slope = ca.jacobian(ca.vertcat(r.phi, rows), r.x)
            return k.function("chart", [ca.densify(moved), ca.densify(slope)])

        self._place = k.call(f"chart {[c.text for c in self.drivers]}", build)
        self.setting: Setting | None = self._setting()
        self._rows: list[int] | None = None

    def _chosen(self, x: Unknowns, basis: Matrix, names: list[str]) -> list[NamedCoordinate]:
        """Return independent coordinates at a pose, the preferred ones first."""
        setup, k = self.setup, self.setup.kernel
        turns = turns_of_balls(setup.model) if self.in_space else []
        laws = [law.coordinate for law in setup.laws]

        def slope(c: NamedCoordinate) -> Floats:
            slope_of = k.call(f"slope {c.text}", partial(self._slope, c))
            return np.ravel(slope_of(0.0, x, np.zeros(len(x)), setup.loose)[0]) * k.sizes

        every = [c for c in [*likely_drivers(setup.problem, names), *turns] if c not in laws]
        found = independent(every, slope, basis)
        if len(found) < basis.shape[1]:
            raise InputError(
                "no coordinates tell the freedoms apart", where="free", hint=", ".join(names)
            )
        return found

    def _slope(self, c: NamedCoordinate) -> Graph:
        """Return the function of the slope of a coordinate by the free ones."""
        r = self.setup.released
        row = r.moved(self.setup.model.coordinate(c))
        return self.setup.kernel.function("slope", [ca.densify(ca.jacobian(row, r.x))])

    def _setting(self) -> Setting | None:
        """Return the scene with the coordinates as drivers, None where it has no such form."""
        if not self.drivers:
            return None
        drivers = tuple(Driver(c.text, at=(0.0,)) for c in self.drivers)
        try:
            return prepare(self.setup.problem, Sweep(drivers=drivers))
        except MechdaeError:
            return None

    # -- a pose ----------------------------------------------------------------------------

    def _at(self, x: Unknowns) -> tuple[Floats, Floats, Floats]:
        """Return absolute coordinates, values of the drivers, and the Jacobian with their rows."""
        moved, slope = self._place(0.0, x, np.zeros(len(x)), self.setup.loose)
        moved, nq = np.ravel(moved), self.setup.model.q.numel()
        rows = self.setup.released.phi.numel() + len(self.coordinates)
        return moved[:nq], moved[nq:], np.reshape(slope, (rows, len(x)), order="F")

    def slope(self, x: Unknowns) -> Matrix:
        """Return the gradients of constraints and coordinates at a pose, by rows."""
        return self._at(x)[2]

    def values(self, x: Unknowns) -> dict[str, float]:
        numbers = self._at(x)[1][len(self.drivers) - len(self.coordinates) :]
        return dict(zip(self.names, numbers.tolist(), strict=True))

    def _scene(self, q: Unknowns) -> Floats:
        assert self.setting is not None
        model = self.setting.scene.model
        if self.in_space:  # its tree is another one
            q = self._transfer(True)(q)
            return np.array([q[model.places[name]] for name in self.setting.scene.x_names])
        places = self.setup.model.places
        return np.array([q[places[name]] for name in self.setting.scene.x_names])

    def _transfer(self, there: bool) -> Transfer:
        """Return what leads from the motion's tree to the scene's, or back."""
        assert self.setting is not None
        of_motion, other = self.setup.model, self.setting.scene.model
        pair = (of_motion, other) if there else (other, of_motion)
        key = ("transfer", there, *(c.text for c in self.drivers))
        made: Transfer = self.setup.cache(key, lambda: Transfer(*pair))
        return made.at(*pair)

    def signs(self, x: Unknowns) -> str:
        """Return the signs of the groups' Jacobians at a pose."""
        q, u, slope = self._at(x)
        if self.setting is None:
            return self._own_sign(slope)
        assembler, pose = self.setting.assembler, self._scene(q)
        groups = [g for g in self.setting.scene.groups if assembler.labelled(g)]
        return "".join(assembler.labels.sign(group, pose, u) for group in groups)

    def _own_sign(self, slope: Any) -> str:
        """Return the sign of the whole Jacobian, of rows that are independent."""
        m = len(slope) - len(self.coordinates)
        scaled = slope * self.setup.kernel.sizes
        if self._rows is None:
            chosen: list[int] = []
            for i in [*range(m, len(slope)), *range(m)]:
                trial = scaled[[*chosen, i]]
                if np.linalg.matrix_rank(trial, 1e-9) == len(chosen) + 1:
                    chosen.append(i)
            self._rows = chosen
        square = scaled[self._rows]
        if square.shape[0] != square.shape[1]:
            return ""
        return "+" if np.linalg.slogdet(square)[0] > 0 else "-"

    @property
    def counted(self) -> bool:
        """Whether modes are counted and labelled in closed form."""
        if self.setting is None:
            return False
        assembler, scene = self.setting.assembler, self.setting.scene
        groups = [group for group in scene.groups if assembler.labelled(group)]
        dyads = all(group.is_dyad and not group.superfluous for group in groups)
        return dyads and not scene.redundant and 0 < len(groups) <= GROUPS

    def label(self, x: Unknowns) -> str:
        """Return the label of a pose's mode: that of a task of modes, or the groups' signs."""
        if not self.counted:
            return ",".join(self.signs(x))
        assert self.setting is not None
        q, u, _ = self._at(x)
        return self.setting.assembler.labels.of_pose(self._scene(q), u)

    def modes(self, x: Unknowns) -> list[Floats]:
        """Return the free coordinates of all modes at the coordinates of a pose, if counted."""
        if not self.counted:
            return []
        assert self.setting is not None
        q, u, _ = self._at(x)
        return [self._lifted(q, mode.x, u) for mode in self.setting.assembler.modes(u)]

    def on_mode(self, x: Unknowns, label: str) -> Floats:
        """Return the free coordinates of the mode with that label at the coordinates of a pose."""
        if not self.counted:
            raise InputError("the modes of this mechanism are not counted", where="mode")
        assert self.setting is not None
        q, u, _ = self._at(x)
        with within("mode"):
            mode = mode_by_label(self.setting.assembler, u, label)
        return self._lifted(q, mode.x, u)

    def _lifted(self, q: Unknowns, pose: Unknowns, u: Floats) -> Floats:
        assert self.setting is not None
        found: Mapping[tuple[str, str], float] = self.setting.assembler.coordinates(pose, u)
        model, q = self.setup.model, q.copy()
        if self.in_space:
            names = self.setting.scene.model.q_names
            near = dict(zip(model.q_names, q.tolist(), strict=True))
            q = self._transfer(False)(np.array([found[key] for key in names]))
            return wound(model.coordinates, q, near)[self.setup.released.free]
        for key, value in found.items():
            k = model.places[key]
            if model.coordinates[k].kind is ANGLE:
                value -= 2 * np.pi * np.round((value - q[k]) / (2 * np.pi))
            q[k] = value
        return q[self.setup.released.free]


def turns_of_balls(model: Any) -> list[NamedCoordinate]:
    """Return components of unit quaternions: half the turns about the axes, beside a pose."""
    found = []
    for owner, name in model.q_names:
        if name in QUATERNION[1:]:
            found.append(NamedCoordinate(f"{owner}.{name}", BALL, owner))
    return found

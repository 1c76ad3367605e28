"""Verification of a design by the certified kinematics, before it is reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.describe.file.problem import Problem
from mechdae.describe.table import Table
from mechdae.describe.tasks.constraints import Box
from mechdae.describe.tasks.kinds import Driver, Sweep, Synthesis, Task
from mechdae.errors import MechdaeError
from mechdae.kinematics.sweep import sweep
from mechdae.model.coordinates import Coordinate
from mechdae.model.parameters import parameters_of
from mechdae.model.space import PLANE
from mechdae.records import dataclass
from mechdae.results import FINE, Result, Status
from mechdae.solver.solve import solve
from mechdae.studies.sensitivity import sharp
from mechdae.synthesis.space import DesignSpace

SX = ca.SX
POSES = 721
"""Poses of a sweep over a turn."""
TURN = 2 * np.pi


def sketched(
    problem: Problem, space: DesignSpace, d: Any, at: float | None
) -> tuple[float, Any] | None:
    """Return driver value and unknowns (nx,) of parameters in the pose of the file's sketch.

    The pose is the one at `at`, or else at the sketch's own driver value, or at zero; None where
    none of them assembles.
    """
    poses = space.poses
    parameters = dict(zip(space.names, d.tolist(), strict=True))
    mechanism = problem.mechanism.with_values(parameters)
    driver = poses.scene.drivers[0]
    keys = (driver.part, driver.text)
    own = next((mechanism.sketch[key] for key in keys if key in mechanism.sketch), 0.0)
    values = [float(v) for v in (at, own, 0.0) if isinstance(v, (int, float))]
    for u in dict.fromkeys(values):
        task = Sweep(Driver(driver.text, at=(u,)), derivatives=0)
        try:
            found = sweep(Problem(mechanism, Table({"own": task})), "own", task)
        except MechdaeError:
            continue
        if found.status[0] != Status.OK:
            continue
        x = np.array([_coordinate(mechanism, found, c) for c in poses.scene.unknowns])
        if np.isfinite(x).all():
            return u, x
    return None


def driven(coordinate: str, low: float, high: float) -> Driver:
    """Return a driver over a range, or at the one value that it is."""
    return Driver(coordinate, at=(low,)) if low == high else Driver(coordinate, from_=low, to=high)


def _coordinate(mechanism: Any, found: Result, c: Coordinate) -> float:
    """Return a coordinate of a body, or of a joint that has its own, at the first pose."""
    part = c.owner
    if part not in found.bodies:
        own = found.joints.get(part, {})
        return float(own[c.name][0]) if c.name in own else np.nan
    angle = float(found.bodies[part].angle[0])
    if c.kind is ANGLE:
        return angle
    name = next(iter(mechanism.bodies[part].points))
    values = mechanism.values()
    x, y = (values[f"{part}.{name}.{axis}"] for axis in PLANE.axes)
    place = found.points[f"{part}.{name}"].position[0]
    cos, sin = np.cos(angle), np.sin(angle)
    origin = (place[0] - cos * x + sin * y, place[1] - sin * x - cos * y)
    return float(origin[PLANE.axes.index(c.name)])


@dataclass
class Design:
    """A point of the NLP as a mechanism of its own.

    Attributes
    ----------
    values, given
        Variables and parameters of the NLP by name.
    at, x
        The driver's values at the poses of the first goal, and the unknowns at its first pose,
        where the mechanism is sketched: everything is swept from there.
    around
        Whether those poses may be reached in any order, either way round.
    """

    problem: Problem
    space: DesignSpace
    values: Mapping[str, Any]
    given: Mapping[str, Any]
    at: Any
    x: Any
    around: bool = False

    @property
    def u(self) -> float:
        """The driver's value at the first pose."""
        return float(self.at[0])

    @cached_property
    def d(self) -> Any:
        """Free parameters, then those that are chosen."""
        return np.concatenate([self.values["d"], np.atleast_1d(self.given["choice"])])

    @cached_property
    def parameters(self) -> dict[str, float]:
        """Dimensions by name."""
        return dict(zip(self.space.names, self.d.tolist(), strict=True))

    @cached_property
    def sketch(self) -> dict[str, float]:
        """Angles of all bodies and the driver's value at the first pose."""
        poses = self.space.poses
        scene, model = poses.scene, poses.model
        turns = [c for c in scene.recovered if c.kind is ANGLE]
        stacked = ca.vertcat(*[scene.recover[c.key] for c in turns])
        p = np.array(ca.DM(parameters_of(model, poses.free, SX(ca.DM(self.d))))).ravel()
        angles = ca.Function("angles", [scene.x, scene.u, model.p], [stacked])
        found = np.array(angles(self.x, self.u, p)).ravel()
        sketch = {c.owner: float(angle) for c, angle in zip(turns, found, strict=True)}
        driver = scene.drivers[0]
        if driver.part not in sketch:
            sketch[driver.part if driver.kind != "point" else driver.text] = float(self.u)
        return sketch

    def as_problem(self, tasks: Mapping[str, Task]) -> Problem:
        """Return a problem with these dimensions, sketched at the first pose."""
        mechanism = self.problem.mechanism.with_values(self.parameters)
        kept = {name: value for name, value in mechanism.sketch.items() if name not in self.sketch}
        mechanism = replace(mechanism, sketch=Table({**kept, **self.sketch}))
        return Problem(
            mechanism, Table(tasks), name=self.problem.name, title=self.problem.title,
            source=self.problem.source,
        )  # fmt: skip

    @property
    def driver(self) -> str:
        return self.space.asked.driver

    # -- sweeps --------------------------------------------------------------------------------

    def swept(self, at: Any, outputs: tuple[str, ...]) -> tuple[Result | None, list[str]]:
        """Return the poses at driver values, and what is wrong with them."""
        task = Sweep(
            Driver(self.driver, at=tuple(float(value) for value in at)), outputs=outputs,
            derivatives=0,
        )  # fmt: skip
        try:
            found = sweep(self.as_problem({"path": task}), "path", task)
        except MechdaeError as error:
            return None, [f"does not assemble: {error.what}"]
        bad = sum(str(word) not in FINE for word in found.status)
        if bad:
            return found, [f"{bad} of {len(at)} poses are not reached on one branch"]
        return found, []

    @cached_property
    def turn(self) -> tuple[Result | None, list[str]]:
        """A whole turn of the driver on a fine grid, or what the first goal needs of it."""
        if self.space.asked.full_turn:
            return self._ranged(self.u, self.u + TURN)
        found: tuple[Result | None, list[str]] = (None, [])
        for low, high in self._arcs():
            found = self._ranged(low, high)
            if not found[1]:
                break
        return found

    def _arcs(self) -> list[tuple[float, float]]:
        """Return the ranges that hold all poses, of poses in any order the shortest one first."""
        if not self.around:
            return [(float(np.min(self.at)), float(np.max(self.at)))]
        turned = np.sort(np.mod(self.at, TURN))
        arcs = [
            (float(turned[k]), float(turned[k - 1] + (TURN if k else 0)))
            for k in range(len(turned))
        ]
        return sorted(arcs, key=lambda arc: arc[1] - arc[0])

    def _ranged(self, low: float, high: float) -> tuple[Result | None, list[str]]:
        asked = self.space.asked
        points = tuple({point: None for box in asked.of(Box) for point in box.points})
        task = Sweep(
            driven(self.driver, low, high), poses=None if low == high else POSES,
            outputs=tuple(points) or None, derivatives=2, measures=("transmission",),
        )  # fmt: skip
        try:
            found = sweep(self.as_problem({"turn": task}), "turn", task)
        except MechdaeError as error:
            return None, [f"does not move over its range: {error.what}"]
        lost = [word for word in found.status if str(word) not in FINE]
        if lost or (asked.full_turn and found.summary.get("limits")):
            word = "turn fully" if asked.full_turn else "run over its range"
            return found, [f"the input does not {word} on one circuit"]
        return found, []

    @cached_property
    def transmission(self) -> float | None:
        """The least transmission angle over that range [rad], where there are dyads."""
        if self.turn[0] is None:
            return None
        angles = [e["min"] for e in self.turn[0].summary.get("transmission", {}).values()]
        return float(min(angles)) if angles else None

    def solved(self, task: str, figures: tuple[str, ...] = ()) -> Result:
        """Return the result of one of the problem's own tasks, sharp enough for its `figures`.

        Raises
        ------
        MechdaeError
            It cannot be solved with these dimensions.
        """
        problem = self.as_problem(self.others)
        found = solve(sharp(problem, task, figures) if figures else problem, task)
        assert isinstance(found, Result)
        return found

    def solved_as(self, task: Task) -> Result:
        """Return the result of a task of one's own with these dimensions."""
        found = solve(self.as_problem({"own": task}), "own")
        assert isinstance(found, Result)
        return found

    def transmissions(self, at: Any) -> dict[str, Any]:
        """Return the transmission angles (k,) by joint at driver values."""
        task = Sweep(
            Driver(self.driver, at=tuple(float(value) for value in at)), derivatives=0,
            measures=("transmission",),
        )  # fmt: skip
        joints = self.solved_as(task).joints
        return {
            name: np.asarray(own["transmission_angle"], float)
            for name, own in joints.items() if "transmission_angle" in own
        }  # fmt: skip

    @property
    def others(self) -> dict[str, Task]:
        """The problem's tasks that are no syntheses."""
        return {n: t for n, t in self.problem.tasks.items() if not isinstance(t, Synthesis)}

    def origin(self, found: Result, body: str) -> Any:
        """Return where the origin of a body's frame is, (n, 2)."""
        values = self.problem.mechanism.with_values(self.parameters).values()
        name = next(iter(self.problem.mechanism.bodies[body].points))
        x, y = (values[f"{body}.{name}.{axis}"] for axis in "xy")
        angle = found.bodies[body].angle
        c, s = np.cos(angle), np.sin(angle)
        arm = np.stack([c * x - s * y, s * x + c * y], axis=1)
        place: Any = found.points[f"{body}.{name}"].position - arm
        return place

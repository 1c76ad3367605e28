"""Verification of a design by the certified kinematics, before it is reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, UNIT
from mechdae.describe.coordinates import Selection
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.table import Table
from mechdae.describe.tasks.constraints import Box
from mechdae.describe.tasks.kinds import Driver, Sensitivity, Sweep, Synthesis, Task
from mechdae.errors import MechdaeError
from mechdae.kinematics.prepared import prepare
from mechdae.kinematics.report import report
from mechdae.kinematics.sweep import run, sweep
from mechdae.model.parameters import parameters_of
from mechdae.records import dataclass
from mechdae.results import FINE, Result, Status
from mechdae.results.rotations import matrices
from mechdae.solver.solve import solve
from mechdae.studies.sensitivity import sensitivity, sharp
from mechdae.synthesis.goals.visited import AXES, ORIGIN
from mechdae.synthesis.space import DesignSpace

SX = ca.SX
POSES = 721
"""Poses of a sweep over a turn."""
TURN = 2 * np.pi


def with_origin(mechanism: Mechanism, body: str) -> Mechanism:
    """Return a mechanism with points at the origin of a body's frame and, in space, on its axes."""
    own = mechanism.bodies[body]
    every = [ORIGIN, *AXES] if mechanism.dimension == 3 else [ORIGIN]
    places = np.vstack([np.zeros(mechanism.dimension), np.eye(mechanism.dimension)])
    added = {name: tuple(place) for name, place in zip(every, places.tolist(), strict=False)}
    own = replace(own, points=Table({**own.points, **added}))
    return replace(mechanism, bodies=Table({**mechanism.bodies, body: own}))


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
        whole = Problem(mechanism, Table({"own": task}))
        try:
            setting = prepare(whole, task)
            found = run(setting, task)
            status = report(whole, "own", task, setting, found).status[0]
        except MechdaeError:
            continue
        if status != Status.OK:
            continue
        known = setting.assembler.coordinates(found.poses.x[0], np.array([u]))
        x = np.array([known.get(key, np.nan) for key in poses.x_names])
        if np.isfinite(x).all():
            return u, x
    return None


def driven(coordinate: str, low: float, high: float) -> Driver:
    """Return a driver over a range, or at the one value that it is."""
    return Driver(coordinate, at=(low,)) if low == high else Driver(coordinate, from_=low, to=high)


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
        """What tells the first pose, with the driver's value.

        In the plane angles of all bodies; in space coordinates of joints, and where quaternions
        are among the unknowns the places of all points.
        """
        poses = self.space.poses
        scene, model, mechanism = poses.scene, poses.model, poses.mechanism
        if mechanism.dimension == 2:
            told = {c.owner: scene.recover[c.key] for c in scene.recovered if c.kind is ANGLE}
        else:
            told = {
                ".".join(c.key): scene.recover[c.key]
                for c in scene.recovered
                if c.owner in mechanism.joints and c.kind is not UNIT
            }
            if any(c.kind is UNIT for c in scene.recovered):
                told |= self._places()
        p = np.array(ca.DM(parameters_of(model, poses.free, SX(ca.DM(self.d))))).ravel()
        values = ca.Function(
            "told", [scene.x, scene.u, model.p], [ca.densify(ca.vertcat(*told.values()))]
        )
        found = np.array(values(self.x, self.u, p)).ravel()
        sketch = dict(zip(told, found.tolist(), strict=True))
        driver = scene.drivers[0]
        if driver.part not in sketch and driver.text not in sketch:
            sketch[driver.part if driver.kind != "point" else driver.text] = float(self.u)
        return sketch

    def _places(self) -> dict[str, Any]:
        """Return the places of all points in space; of links that spin, of those on their line."""
        scene, model = self.space.poses.scene, self.space.poses.model
        bodies = {body for group in scene.groups for body in group.bodies}
        every = Selection(
            (), tuple(f"{b}.{p}" for b in bodies for p in model.mechanism.bodies[b].points), ()
        )
        return {
            f"{point}.{axis}": scene.expression(model.point(point)[k])
            for point in model.reported(every, False).points
            for k, axis in enumerate(model.mechanism.axes)
        }

    def as_problem(self, tasks: Mapping[str, Task]) -> Problem:
        """Return a problem with these dimensions, sketched at the first pose."""
        mechanism = self.problem.mechanism.with_values(self.parameters)
        scene = self.space.poses.scene
        known = set(self.sketch)
        if mechanism.dimension == 3:  # all of the scene is told anew, in other words
            parts = {scene.drivers[0].part}
            parts |= {name for g in scene.groups for name in (*g.bodies, *g.joints)}
            known |= {name for name in mechanism.sketch if name.split(".")[0] in parts}
        kept = {name: value for name, value in mechanism.sketch.items() if name not in known}
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
            outputs=tuple(points) or None, derivatives=2,
            measures=("transmission",) if self.space.poses.dyads else (),
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

    def slopes(
        self, task: Sweep | str, paths: tuple[str, ...], names: Sequence[str], origin: str = ""
    ) -> dict[str, tuple[Any, Any]]:
        """Return values (n, w) and derivatives (n, w, nt) by names of paths of a task, or its name.

        They are those of a task of sensitivity of the file of this design; with the name of a body
        in `origin` its file has the point `ORIGIN` at the origin of that body's frame, in space
        the points `AXES` one metre along its axes too.

        Raises
        ------
        MechdaeError
            It cannot be solved with these dimensions.
        """
        own = {} if isinstance(task, str) else {"own": task}
        asked = Sensitivity(of=task if isinstance(task, str) else "own", outputs=paths,
                            wrt=tuple(names))  # fmt: skip
        problem = self.as_problem({**self.others, **own, "slopes": asked})
        if origin:
            problem = replace(problem, mechanism=with_origin(problem.mechanism, origin))
        data = sensitivity(problem, "slopes", asked).data
        found = {}
        for path in paths:
            value = np.atleast_1d(np.asarray(data["values"][path], float))
            by_name = [np.asarray(data["derivatives"][path][n], float) for n in names]
            rows = len(value)
            found[path] = (
                value.reshape(rows, -1),
                np.stack([own.reshape(rows, -1) for own in by_name], axis=2),
            )
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
        """Return where the origin of a body's frame is, (n, 2) or (n, 3)."""
        mechanism = self.problem.mechanism
        values = mechanism.with_values(self.parameters).values()
        name = next(iter(mechanism.bodies[body].points))
        own = np.array([values[f"{body}.{name}.{axis}"] for axis in mechanism.axes])
        if mechanism.dimension == 2:
            angle = found.bodies[body].angle
            c, s = np.cos(angle), np.sin(angle)
            arm = np.stack([c * own[0] - s * own[1], s * own[0] + c * own[1]], axis=1)
        else:
            arm = matrices(found.bodies[body].orientation) @ own
        place: Any = found.points[f"{body}.{name}"].position - arm
        return place

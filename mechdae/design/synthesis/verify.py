"""A point of the NLP as a design: its dimensions, its sketch, its file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, UNIT
from mechdae.describe.coordinates import Selection, coordinate
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.writing import in_units
from mechdae.describe.tasks.constraints import Box
from mechdae.describe.tasks.kinds import Driver, Sweep, Task
from mechdae.describe.tasks.synthesis import Synthesis
from mechdae.describe.values import Table
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.space import DesignSpace
from mechdae.design.synthesis.verification.design_file import TURN, DesignFile, driven
from mechdae.equations.parameters import parameters_of
from mechdae.errors import MechdaeError
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run
from mechdae.records import dataclass
from mechdae.results import Result, Status
from mechdae.tasks.dispatch.solve import solve
from mechdae.types import Floats, Sym

PATH = "path"
"""Task of a design's problem that moves it."""
SMOOTH = 1441
"""Poses of a path that is looked at closely: where a link turns fast they are far apart."""
FINE = 721
"""Poses of an interval that a goal looks at."""
SX = ca.SX


class DesignMotion:
    """A design over its whole sweep, at its targets, and closely between them."""

    def __init__(self, problem: Problem, at: Sequence[float], full_turn: bool) -> None:
        self.problem, self.at, self.full_turn = problem, tuple(map(float, at)), full_turn
        task = problem.tasks[PATH]
        assert isinstance(task, Sweep)
        self._task = task
        self._driver = task.all_drivers[0].coordinate

    @cached_property
    def whole(self) -> Result:
        """The whole sweep; it starts at the first target."""
        return self._solved(self._task)

    @cached_property
    def smooth(self) -> tuple[Result, ...]:
        """The positions over the same in small steps; parts run from the first target."""
        if self._task.all_drivers[0].at is not None:
            return (self.whole,)
        fine = replace(self._task, poses=SMOOTH, derivatives=0)
        if self.full_turn:
            return (self._solved(fine),)
        start = self.at[0]
        ends = [end for end in (min(self.at), max(self.at)) if end != start]
        drivers = [Driver(self._driver, from_=start, to=end) for end in ends]
        return tuple(self._solved(replace(fine, driver=driver)) for driver in drivers)

    @cached_property
    def at_targets(self) -> Result:
        return self._placed(self.at)

    @cached_property
    def between(self) -> Result:
        """The poses from the first to the last target, evenly spread."""
        return self._placed(np.linspace(self.at[0], self.at[-1], FINE).tolist())

    def _placed(self, values: Sequence[float]) -> Result:
        return self._solved(Sweep(Driver(self._driver, at=tuple(values)), derivatives=0))

    def _solved(self, task: Task) -> Result:
        return solve(self.problem.with_task(PATH, task), PATH)


def sketched(
    problem: Problem, space: DesignSpace, d: Floats, at: float | None
) -> tuple[float, Floats] | None:
    """Return driver value and unknowns (nx,) of parameters in the pose of the file's sketch.

    The pose is the one at `at`, or else at the sketch's own driver value, or at zero; None where
    none of them assembles.
    """
    poses = space.poses
    parameters = dict(zip(space.names, d.tolist(), strict=True))
    mechanism = problem.mechanism.with_values(parameters)
    driver = poses.scene.drivers[0]
    keys = (driver.part, driver.text)
    sketched = next((mechanism.sketch[key] for key in keys if key in mechanism.sketch), 0.0)
    values = [float(v) for v in (at, sketched, 0.0) if isinstance(v, (int, float))]
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


@dataclass
class Design:
    """A point of the NLP as a mechanism of its own.

    ``at``, ``x``: the driver's values at the poses of the first goal, and the unknowns at its first
    pose, where the mechanism is sketched. ``around``: whether those poses may be reached in any
    order, either way round.
    """

    problem: Problem
    space: DesignSpace
    values: Mapping[str, Any]
    given: Mapping[str, Any]
    at: Any
    x: Floats
    around: bool = False

    @property
    def u(self) -> float:
        """The driver's value at the first pose."""
        return float(self.at[0])

    @cached_property
    def d(self) -> Floats:
        """Free parameters, then those that are chosen."""
        return dimensions(self.values["d"], self.given)

    @cached_property
    def parameters(self) -> dict[str, float]:
        """Dimensions by name."""
        return dict(zip(self.space.names, self.d.tolist(), strict=True))

    @cached_property
    def sketch(self) -> dict[str, float]:
        """What tells the first pose, with the driver's value.

        In the plane angles of all bodies, slides and places on curves where they are solved for;
        in space coordinates of joints, and where quaternions are among the unknowns the places of
        all points.
        """
        poses = self.space.poses
        scene, model, mechanism = poses.scene, poses.model, poses.mechanism
        if mechanism.dimension == 2:
            angles = {c.owner: scene.recover[c.key] for c in scene.recovered if c.kind is ANGLE}
            angles |= self._slides()
        else:
            angles = {
                ".".join(c.key): scene.recover[c.key]
                for c in scene.recovered
                if c.owner in mechanism.joints and c.kind is not UNIT
            }
            if any(c.kind is UNIT for c in scene.recovered):
                angles |= self._places()
        p = np.array(ca.DM(parameters_of(model, poses.free, SX(ca.DM(self.d))))).ravel()
        values = ca.Function(
            "told", [scene.x, scene.u, model.p], [ca.densify(ca.vertcat(*angles.values()))]
        )
        found = np.array(values(self.x, self.u, p)).ravel()
        sketch = dict(zip(angles, found.tolist(), strict=True))
        driver = scene.drivers[0]
        turns = driver.part in mechanism.joints and driver.text == f"{driver.part}.angle"
        if driver.text not in sketch and (turns or driver.part not in sketch):
            alone = driver.kind != "point" and driver.part not in sketch  # else its slide is there
            sketch[driver.part if alone else driver.text] = float(self.u)
        return sketch

    def _slides(self) -> dict[str, Sym]:
        """Return slides and places on curves of groups that are not solved by angles."""
        scene, model = self.space.poses.scene, self.space.poses.model
        mechanism, found = model.mechanism, {}
        turned = {b.group: True for b in scene.blocks}
        for block in scene.blocks:
            turned[block.group] &= bool(scene.unknowns.turns[list(block.x)].all())
        for group in scene.groups:
            for joint in (mechanism.joints[name] for name in group.joints):
                word = "s" if joint.on_curve else "slide" if joint.slides else ""
                if word and (joint.on_curve or not turned.get(group.index, True)):
                    c = coordinate(mechanism, f"{joint.name}.{word}")
                    found[joint.name] = scene.expression(model.coordinate(c))
        return found

    def _places(self) -> dict[str, object]:
        """Return the places of all points in space; of links that spin, of those on their line."""
        scene, model = self.space.poses.scene, self.space.poses.model
        bodies = dict.fromkeys(body for group in scene.groups for body in group.bodies)
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
        parts = {scene.drivers[0].part}  # all of the scene is told again
        parts |= {name for g in scene.groups for name in (*g.bodies, *g.joints)}
        remaining = {
            n: value for n, value in mechanism.sketch.items() if n.split(".")[0] not in parts
        }
        mechanism = replace(mechanism, sketch=Table({**remaining, **self.sketch}))
        return Problem(
            mechanism, Table(tasks), name=self.problem.name, title=self.problem.title,
            source=self.problem.source,
        )  # fmt: skip

    @property
    def others(self) -> dict[str, Task]:
        """The problem's tasks that are no syntheses."""
        return {n: t for n, t in self.problem.tasks.items() if not isinstance(t, Synthesis)}

    @cached_property
    def text(self) -> str:
        """The design as a problem file, with a task that moves it over the poses or a turn."""
        last = self.u + TURN if self.space.asked.full_turn else float(self.at[-1])
        task = Sweep(driven(self.space.asked.driver, self.u, last))
        return in_units(self.as_problem({**self.others, PATH: task}))

    @cached_property
    def file(self) -> DesignFile:
        """The file, read back, to be measured."""
        required = self.space.asked
        return DesignFile(
            from_dict(tomllib.loads(self.text), self.problem.name), required.driver, self.at,
            required.full_turn, self.around, bool(self.space.poses.dyads),
            tuple({point: None for box in required.of(Box) for point in box.points}), self.others,
        )  # fmt: skip

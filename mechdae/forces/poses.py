"""Unknowns with their rates in time, and forces, at the poses of a run and between them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Reactions
from mechdae.equations.forces.loads import Loads
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene
from mechdae.errors import InputError
from mechdae.forces.friction_branches import FrictionSolutions, some
from mechdae.forces.inverse_dynamics import InverseDynamics, Loaded, LoadedPoses
from mechdae.motion.continuation.evaluate import Poses, in_time
from mechdae.motion.kinematics.prepared import Run, Setting, prepare
from mechdae.motion.kinematics.sweep import run
from mechdae.motion.setup.outputs import Request
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Matrix

PREFIX = "unknown "


def loaded_bodies(model: Model) -> Iterable[str]:
    """Return the bodies that forces act on or come from, beside weights and inertia."""
    found = set(Loads(model).bodies)
    for joint in model.mechanism.joints.values():
        if joint.loaded:
            found |= set(joint.bodies)
    return found


def requests(scene: Scene) -> list[Request]:
    """Return the unknowns as what is evaluated beside the outputs, for their rates."""
    model = scene.model
    return [
        (f"{PREFIX}{i}", model.q[model.places[key]], _bodies(model, key[0]))
        for i, key in enumerate(scene.x_names)
    ]


def _bodies(model: Model, name: str) -> tuple[str, ...]:
    joint = model.mechanism.joints.get(name)
    if joint is None:
        return (name,)
    return tuple(body for body in joint.bodies if body in model.mechanism.bodies)


def unknown_columns(setting: Setting) -> list[int]:
    """Return the columns of a setting's outputs that are the unknowns, in the order of x."""
    return setting.outputs.columns(f"{PREFIX}{i}" for i in range(setting.graphs.nx))


class Moving:
    """The motion of a run.

    Parameters
    ----------
    setting, run
        Of a task whose outputs hold `requests`.
    slow
        Whether the motion is as slow as one likes, and has no time then.
    """

    def __init__(self, setting: Setting, run: Run, slow: bool) -> None:
        self.setting: Setting = setting
        self.run: Run = run
        self.slow: bool = slow
        self._columns = unknown_columns(setting)
        plan = setting.plan
        self.by_value: bool = plan.by_value
        self.speed: float = float(plan.speed[0, plan.lead]) if plan.by_value else 1.0
        """The rate of the path's parameter in time."""

    def poses(self) -> LoadedPoses:
        """Return the motion at the poses of the run."""
        plan, run = self.setting.plan, self.run
        shape = run.values.shape
        rates = tuple(np.broadcast_to(r, shape) for r in (plan.speed, plan.acceleration))
        return self._motion(run.poses, run.values, rates, self._times(run.values))

    def _times(self, values: Floats) -> Floats | None:
        return None if self.slow else self.setting.plan.time_of(values)

    def at(self, places: Floats) -> LoadedPoses:
        """Return the motion at places of the path, the driver's speed constant.

        Along lines in the values of several drivers the path's parameter is the time.
        """
        plan, run = self.setting.plan, self.run
        places = np.asarray(places, float)
        poses = run.evaluator.at(run.path, places)
        values = run.path.drivers(places)
        if self.by_value:
            poses.y = in_time(poses.y, self.speed, 0.0)
            rates = tuple(np.broadcast_to(r, values.shape) for r in (plan.speed, 0 * plan.speed))
            time = self._times(run.values)
            if time is not None:
                time = (places - run.values[0, plan.lead]) / self.speed
        else:
            rates = run.path.rates(places, 2)
            time = places if plan.timing and run.path.graphs.course else None
        return self._motion(poses, values, rates, time)

    def _motion(
        self, poses: Poses, values: Floats, rates: tuple[Floats, ...], time: Floats | None
    ) -> LoadedPoses:
        n, nx, dead = len(values), len(self._columns), ~poses.alive.all(axis=1)
        found = []
        for y, driven in zip(poses.y, (values, *rates), strict=False):
            columns = np.empty((nx + values.shape[1], n)).T  # columns lie together, as kernels read
            for k, column in enumerate(self._columns):
                columns[:, k] = y[:, column]
            columns[:, nx:] = driven
            columns[dead] = np.nan
            found.append(columns)
        w, v, a = found[:3]
        return LoadedPoses(w, v, a, time, poses.condition, nx)


@dataclass(frozen=True)
class LoadedRun:
    """A run with what acts at its poses."""

    moving: Moving
    motion: LoadedPoses
    statics: InverseDynamics

    @property
    def setting(self) -> Setting:
        """What was prepared for it."""
        return self.moving.setting

    @property
    def run(self) -> Run:
        """The run itself."""
        return self.moving.run

    def of(self, task: Reactions) -> LoadedRun:
        """Return the same run with the forces that another task asks for."""
        statics = InverseDynamics(self.setting.scene, self.run.evaluator, task, self.motion)
        return LoadedRun(self.moving, self.motion, statics)


def loaded_run(problem: Problem, task: Reactions, free: Iterable[str] = ()) -> LoadedRun:
    """Return the run of a task with what acts at its poses.

    Numbers that are `free` stay symbols even where they are zero.
    """
    wanted = replace(task, derivatives=max(2, task.derivatives))
    setting = prepare(problem, wanted, loaded_bodies, requests, free)
    followed = run(setting, wanted)
    moving = Moving(setting, followed, task.quasi_static)
    motion = moving.poses()
    statics = InverseDynamics(setting.scene, followed.evaluator, task, motion)
    _check_time(statics, motion)
    return LoadedRun(moving, motion, statics)


def _check_time(statics: InverseDynamics, motion: LoadedPoses) -> None:
    if statics.loads.uses_time and motion.t is None:
        raise InputError(
            "it uses t, and this task has no time",
            where=f"loads.{statics.loads.uses_time[0]}",
            hint="a driver with a constant speed or a law",
        )


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

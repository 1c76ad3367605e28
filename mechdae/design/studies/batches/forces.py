"""Reactions, friction and efforts of many sets at once, along their certified motions.

The balance of forces is that of a single set, its numbers given pose by pose. Poses at which
friction has no solution or several are told apart one by one; sets in which anything else is out of
the ordinary (a load without a value, constraints without rank, a check that fails) are left to be
solved alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.describe.tasks.motion import Reactions
from mechdae.describe.units import shown
from mechdae.design.studies.batches.batch import LaneRun, SeriesBatch
from mechdae.design.studies.batches.poses import AT_ONCE
from mechdae.design.studies.batches.readings import ForceReading, Reading
from mechdae.errors import UnknownName
from mechdae.forces.force_messages import TOLERANCE, about_friction, powers_of
from mechdae.forces.friction_branches import FrictionSolutions, some
from mechdae.forces.inverse_dynamics import FACTOR, InverseDynamics, LoadedPoses
from mechdae.forces.poses import PoseForces, loaded_bodies, requests, solved, unknown_columns
from mechdae.forces.series import efforts_of, series_of
from mechdae.forces.task import SINGULAR
from mechdae.motion.continuation.evaluate import Evaluator
from mechdae.motion.kinematics.prepared import Setting, prepare
from mechdae.results import Status
from mechdae.types import Booleans, Floats, Integers, Matrices

WIDTHS = {"reaction": 3, "reaction_uncoupled": 3}


class LaneStatics(InverseDynamics):
    """The balance of forces of a scene over poses of many mechanisms."""

    single = frozenset((FACTOR,))

    def __init__(self, setting: Setting, task: Reactions) -> None:
        nx = setting.graphs.nx
        none = np.zeros((0, nx + setting.graphs.nu))
        motion = LoadedPoses(none, none, none, None, np.zeros(0), nx)
        super().__init__(setting.scene, Evaluator(setting.graphs, setting.outputs), task, motion)


class ForcesBatch(SeriesBatch):
    """Computes series of motions and forces of a task of reactions for many sets."""

    forces = True
    task: Reactions

    def _prepared(self) -> Setting:
        wanted = replace(self.task, derivatives=max(2, self.task.derivatives))
        return prepare(self.problem, wanted, loaded_bodies, requests, self.names)

    def _more(self) -> tuple[tuple[int, tuple[int, ...]], ...]:
        self.unknowns: list[int] = unknown_columns(self.setting)
        return ((2, tuple(self.unknowns)),)

    def _reading(self, path: str) -> Reading | None:
        try:
            return super()._reading(path)
        except UnknownName:
            head, _, rest = path.partition("/")
            if head in ("efforts", "efforts_uncoupled"):
                return ForceReading("", path)
            if head != "joints":
                raise
            joint, _, word = rest.rpartition("/")
            return ForceReading(joint, word, WIDTHS.get(word, 1))

    def _why_not(self) -> str:
        reason = super()._why_not()
        if reason:
            return reason
        task, model = self.task, self.setting.scene.model
        if task.cycle:
            return "a cycle is looked at between its poses too"
        if task.axes or task.parts:
            return "forces in other axes, or taken apart, are computed for one set at a time"
        if model.mesh_names:
            return (
                f"joint {model.mesh_names[0]} is a mesh: whether it is real is a matter of numbers"
            )
        self.statics: LaneStatics = LaneStatics(self.setting, task)
        if self.statics.loads.timed or self.statics.loads.uses_time:
            return "a load depends on the time"
        known = self._tables(self.statics, self._nothing())
        for path, reading in zip(self.outputs, self.read, strict=True):
            if isinstance(reading, ForceReading) and reading.word not in known.get(
                reading.part, {}
            ):
                return f"{path} is not known"
        return ""

    def _nothing(self) -> PoseForces:
        """Return forces at no poses: what they are named is asked for."""
        g = self.setting.graphs
        none = np.zeros((0, g.nx + g.nu))
        p = np.zeros((0, g.np))
        motion = LoadedPoses(none, none, none, None, np.zeros(0), g.nx, p, np.zeros(0))
        return solved(self.statics, motion, np.zeros(0, bool))

    def _tables(self, statics: InverseDynamics, answer: PoseForces) -> dict[str, dict[str, Floats]]:
        """Return the series of joints by name; under '' those of drivers, by their paths."""
        found = series_of(statics, answer, self.task, None)
        efforts, parts = efforts_of(self.setting, statics, answer, self.task)
        series = [
            ("efforts", efforts),
            *((f"efforts_{word}", part) for word, part in parts.items()),
        ]
        drivers = {f"{head}/{name}": values[name] for head, values in series for name in values}
        return found | {"": drivers}

    def _write(self, table: list[Floats], run: LaneRun) -> None:
        super()._write(table, run)
        rows = np.flatnonzero(~run.trace.left)
        y = run.in_time()
        size = max(1, AT_ONCE // run.complete.shape[1])
        for first in range(0, len(rows), size):
            self._forces(table, run, rows[first : first + size], y)

    def _forces(
        self, table: list[Matrices], run: LaneRun, rows: Integers, y: list[Matrices]
    ) -> None:
        motion, there = self._motion(run, rows, y)
        k, n = len(rows), run.complete.shape[1]
        statics = self.statics
        left = (motion.condition.reshape(k, n) > SINGULAR).any(axis=1)
        for _, lost, *_ in statics.lost(motion):
            left |= lost.reshape(k, n).any(axis=1)
        answer = solved(statics, motion, there, critical=False)
        answer.leave_out(~there)
        left |= ~self._checked(statics, answer, k)
        if answer.jammed.any() or answer.ambiguous.any():
            left |= self._told(run, rows, answer)
        run.trace.left[rows[left]] = True
        series = self._tables(statics, answer)
        for part, reading in zip(table, self.read, strict=True):
            if isinstance(reading, ForceReading):
                part[run.lanes[rows]] = series[reading.part][reading.word].reshape(
                    k, n, reading.width
                )

    def _motion(
        self, run: LaneRun, rows: Integers, y: list[Matrices]
    ) -> tuple[LoadedPoses, Booleans]:
        k, n, nx = len(rows), run.complete.shape[1], len(self.unknowns)
        place = {column: i for i, column in enumerate(self.asked.columns)}
        there = run.complete[rows].ravel()
        chosen = [place[column] for column in self.unknowns]
        values = np.broadcast_to(self.setting.plan.values[:, 0], (k, n))
        numbers, lanes = run.numbers, run.lanes[rows]
        driven = (values, *(np.repeat(rate[lanes], n) for rate in numbers.rates[:2]))
        parts = []
        for order, driver in enumerate(driven):
            columns = np.empty((nx + 1, k * n)).T  # columns lie together, as kernels read
            for i, column in enumerate(chosen):
                columns[:, i] = y[order][column][rows].ravel()
            columns[:, nx] = np.ravel(driver)
            columns[~there] = np.nan
            parts.append(columns)
        with np.errstate(invalid="ignore"):
            each = run.mu[rows].T[:, :, None] * run.beta[:, rows]
        condition = np.fmax.reduce(each, axis=0, initial=1.0).ravel()
        p, scale = (np.repeat(array, n, axis=0) for array in (numbers.p[lanes], run.scale[rows]))
        motion = LoadedPoses(parts[0], parts[1], parts[2], None, condition, nx, p, scale)
        return motion, there & motion.there

    @staticmethod
    def _checked(statics: InverseDynamics, answer: PoseForces, k: int) -> Any:
        """Return the lanes (k,) in which powers and bodies are balanced."""
        driven, loads, lost, rate, _, sizes = powers_of(statics, answer)
        left = statics.imbalance(answer.inputs, answer.sizes, answer.whole, answer.coupled)

        def largest(values: Floats) -> Any:
            sizes_there = np.where(answer.standing, np.abs(values), 0.0)
            return sizes_there.reshape(k, -1).max(axis=1)

        gap = largest(driven + loads + lost - rate)
        return (gap <= TOLERANCE * largest(sizes)) & (largest(left) <= TOLERANCE)

    def _told(self, run: LaneRun, rows: Integers, answer: PoseForces) -> Booleans:
        """Note lanes that jam or have several solutions; return those that are left."""
        k, n = len(rows), run.complete.shape[1]
        c, values = self.setting.plan.coordinates[0], self.setting.plan.values[:, 0]
        jammed, ambiguous = (poses.reshape(k, n) for poses in (answer.jammed, answer.ambiguous))
        left = np.zeros(k, bool)
        for i in np.flatnonzero((jammed | ambiguous).any(axis=1)):
            left[i] = not run.complete[rows[i]].all()  # what is said of that is said alone
            solutions: dict[int, FrictionSolutions] = {
                pose: answer.found[i * n + pose]
                for pose in range(n) if i * n + pose in answer.found
            }  # fmt: skip
            if jammed[i].any():
                first = int(np.argmax(jammed[i]))
                one = some(answer.inputs, slice(i * n + first, i * n + first + 1))
                (solutions[first],) = self.statics.branches.at(one)
                left[i] |= len(solutions[first].sizes) > 0
            words = np.where(jammed[i], Status.JAMMED, np.where(ambiguous[i], Status.AMBIGUOUS, ""))
            note = about_friction(
                n, np.flatnonzero(jammed[i]), np.flatnonzero(ambiguous[i]), solutions,
                lambda pose: f"{c.text} = {shown(c.unit, float(values[pose]))}",
            )  # fmt: skip
            self.wrong[int(run.lanes[rows[i]])] = (
                str(next(word for word in words if word)), "; ".join(note)
            )  # fmt: skip
        return left

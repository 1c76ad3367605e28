"""`md.Solver`: one task of one mechanism for many sets of numbers, its kernels built once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.file.load import Source, chosen
from mechdae.describe.tasks.kinds import Sweep, Task
from mechdae.describe.tasks.studies import Study
from mechdae.describe.values import Number, names
from mechdae.design.derivatives.function import function
from mechdae.errors import InputError, UnknownName
from mechdae.motion.kinematics.near_poses import NearPoses, near_poses
from mechdae.motion.kinematics.pose_arrays import PoseArrays, PoseState, floats
from mechdae.motion.kinematics.prepared import CacheOwner, keep_for
from mechdae.motion.kinematics.tracker import Posed, Tracker, posed
from mechdae.motion.kinematics.tracker import tracker as tracker_of
from mechdae.results import Result, StudyResult
from mechdae.tasks.parameter_studies import study
from mechdae.tasks.solve import solve
from mechdae.types import Floats, Graph

if TYPE_CHECKING:
    from mechdae.tasks.pose_sets import RowsOfSets


class Solver:
    """Solves one task again and again, with other values of its numbers.

    What depends on the mechanism's structure alone (model, equations, kernels, buffers) is built
    once and kept as long as the solver lives. Every call assembles the sketch of its own numbers,
    so it starts on the mode that `md.solve` starts on. A set of numbers of another structure (a
    number that is no longer zero, another range of a curve) is right too, and builds again.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        Name of a task of the problem (default: its first), or a task as a value.
    vary
        Parameters and automatic names that stay symbols even where they are zero: they may
        leave zero without a new structure.

    Raises
    ------
    UnknownName
        A name in `vary` that is no parameter and no automatic name, an unknown task.
    InputError
        Something in the description is wrong.

    Notes
    -----
    A solver may be used by several threads at once; they share the kernels and have buffers of
    their own. It is pickled as its problem, task and `vary`.

    Examples
    --------
    >>> solver = md.Solver(md.slider_crank(0.1, 0.3), vary=["rod"])
    >>> solver.poses({"rod": 0.4}, [0.0, 0.5])["points/rod.C/position"].round(4).tolist()
    [[0.5, 0.0], [0.4849, 0.0]]
    """

    def __init__(
        self,
        problem: Source,
        task: Task | str | None = None,
        vary: Sequence[str] = (),
    ) -> None:
        whole, name = chosen(problem, task)
        self.name: str = name
        self.vary: tuple[str, ...] = names(vary)
        self.problem = whole
        known = {**dict(whole.mechanism.numbers()), **whole.mechanism.parameters}
        for varied in self.vary:
            if varied not in known:
                raise UnknownName("parameter", varied, known, where="vary")
        self._held = CacheOwner(frozenset(self.vary))
        self._posed: tuple[dict[str, Number], Posed | Tracker] | None = None
        self._tracker: Tracker | None = None
        self._near: tuple[tuple[str, ...], NearPoses | None] | None = None
        self._rows: RowsOfSets | None = None

    def __reduce__(self) -> Any:
        return Solver, (self.problem, self.name, self.vary)

    @property
    def task(self) -> Task:
        """The task that is solved."""
        return self.problem.tasks[self.name]

    def __call__(self, values: Mapping[str, Number] | None = None, **more: Number) -> Result:
        """Return the result for some numbers, as `md.solve` with ``set`` does.

        Parameters
        ----------
        values, more
            Parameters and automatic names with their new values; a suffix such as ``_deg`` or
            ``_mm`` is a unit. What is not named has the problem's value.

        Raises
        ------
        InputError
            A number that is no such name, or a value that makes no mechanism.
        SolveError
            The mechanism cannot be assembled at its sketch.
        """
        with keep_for(self._held):
            return solve(self.problem, self.name, set=_merged(values, more))

    def poses(
        self,
        values: Mapping[str, Number | Floats | Sequence[float]] | Floats | None,
        u: Floats | Sequence[float] | float,
    ) -> PoseArrays:
        """Return one or many poses as arrays, without a report.

        Parameters
        ----------
        values
            As of a call; calls with the same values one after another follow the same path on.
            Arrays (n,) by name, or rows (n, p) in the order of `vary`, are a set for each row.
        u : float, (n,) or (n, nd) array
            Values of the driver, or of several in the order of the task, each row for itself.
            Poses of several drivers are reached on the straight line from the sketch's values;
            drivers that follow laws of time are driven by their values.

        Raises
        ------
        InputError
            The task is no sweep, or `u` has not as many columns as there are drivers, or holds no
            value; with a single driver also values that are not finite. With a set for each row:
            another number of rows.
        SolveError
            The mechanism cannot be assembled at its sketch. With a set for each row nothing is
            raised for one: it is ``unassembled``, and ``faults`` says why.

        Examples
        --------
        >>> import mechdae as md
        >>> solver = md.Solver("four-bar-crank-rocker", "turn", vary=["b"])
        >>> poses = solver.poses({"b": [0.119, 0.12, float("nan")]}, 0.5)
        >>> poses.status.tolist(), poses["bodies/rocker/angle"].shape
        (['ok', 'ok', 'unassembled'], (3,))
        """
        if values is not None and (not isinstance(values, Mapping) or _is_many(values)):
            return self._poses_of_sets(values, u)
        return self._poses(_merged(values, {}), np.atleast_1d(floats(u, "u")))

    def _poses_of_sets(self, values: object, u: object) -> PoseArrays:
        """Return poses with a set of numbers for each row."""
        from mechdae.tasks.pose_sets import RowSets, RowsOfSets

        if self._rows is None:
            self._rows = RowsOfSets(self.problem, self._sweep(), self._poses)
        with keep_for(self._held):
            return self._rows.at(RowSets(self.problem, self.vary, values), floats(u, "u"))

    def _poses(self, numbers: dict[str, Number], places: Floats) -> PoseArrays:
        """Return poses with one set of numbers."""
        task = self._sweep()
        last = self._posed
        if last is None or last[0] != numbers:
            found = self._near_pose(task, numbers, places) if last is not None else None
            if found is not None:
                return found
            with keep_for(self._held):
                last = (numbers, posed(self.problem.with_values(numbers), task))
            self._posed = last
        return last[1].at(places)

    def track(
        self,
        pose: PoseArrays | None,
        u: Floats | Sequence[float] | float,
        speed: Floats | Sequence[float] | None = None,
        acceleration: Floats | Sequence[float] | None = None,
    ) -> PoseArrays:
        """Return the pose that a proved motion straight in the drivers leads to from another one.

        For loops that move a little at each call: no path is kept.

        Parameters
        ----------
        pose
            What a call before returned, or one row of `poses`, whose numbers it keeps; None
            begins at the sketch. From a pose that is not ``ok`` it goes on from the last that was.
        u : (nd,) array
            Values of the drivers; of the moving one alone where others are held.
        speed, acceleration : (nd,) arrays
            Rates of the drivers; by default those of the task, zero where it has a law.

        Returns
        -------
        PoseArrays
            One row. ``status`` is ``unassembled`` where a limit position, or another place that
            no proof leads past, lies on the way; then the mechanism has not moved.

        Examples
        --------
        >>> solver = md.Solver("five-bar-robot", "forward")
        >>> pose = None
        >>> for k in range(3):
        ...     pose = solver.track(pose, [2.2 + 0.01 * k, 0.9])
        >>> pose.status.tolist(), pose["points/tip.P/position"].round(4).tolist()
        (['ok'], [[0.1029, 0.3591]])
        """
        if pose is None:
            node = self._first()
        elif pose.node is None:
            raise InputError("one pose of several drivers is needed", where="pose")
        else:
            node = pose.node
        rates = {"speed": speed, "acceleration": acceleration}
        given = [None if rate is None else floats(rate, name) for name, rate in rates.items()]
        return node.tracker.moved(node, floats(u, "u"), *given)

    def _first(self) -> PoseState:
        """Return the pose of the sketch, with the problem's numbers."""
        if self._tracker is None:
            with keep_for(self._held):
                self._tracker = tracker_of(self.problem, self._sweep())
        return self._tracker.first

    def _sweep(self) -> Sweep:
        """The task, which has to move drivers."""
        task = self.task
        if not isinstance(task, Sweep):
            raise InputError(f"a task of kind '{task.kind}' has no poses of a driver", where="task")
        return task

    def _near_pose(
        self, task: Sweep, numbers: dict[str, Number], places: Floats
    ) -> PoseArrays | None:
        """Return poses from a start in closed form, None where one is not proved so."""
        if places.ndim != 1 or not places.size or not np.isfinite(places).all():
            return None
        names, near = tuple(numbers), self._near
        if near is None or near[0] != names:
            with keep_for(self._held):
                near = self._near = (names, self._nearby(task, names))
        if near[1] is None:
            return None
        return near[1].at(numbers, places)

    def _nearby(self, task: Sweep, names: tuple[str, ...]) -> NearPoses | None:
        known = {**dict(self.problem.mechanism.numbers()), **self.problem.mechanism.parameters}
        plain = all(name in known and name not in self.problem.sizes for name in names)
        return near_poses(self.problem, task, names) if plain else None

    def many(
        self,
        sets: Mapping[str, Sequence[float]],
        outputs: Sequence[str],
        workers: int = 1,
        progress: Callable[[int, int], None] | None = None,
        executor: Executor | None = None,
        out: str | FilePath | None = None,
        certify: bool = True,
    ) -> StudyResult:
        """Return a table of outputs over many sets of numbers, computed at once where they can be.

        Parameters
        ----------
        sets
            name -> values (k,), as many for each name.
        outputs
            Paths below the task in the JSON: ``points/rod.B/position``, ``summary/swing/rocker``.
        workers, progress, executor, out, certify
            As of `md.study`.

        Returns
        -------
        Result
            That of a study: ``table`` has one array (k, ...) for each path, ``status`` (k,).
        """
        with keep_for(self._held):
            return study(
                self.problem, Study(certify=certify), sets=sets, of=self.name, outputs=outputs,
                workers=workers, executor=executor, out=out, progress=progress,
            )  # fmt: skip

    def function(self, outputs: Sequence[str], inputs: Sequence[str] = ()) -> Graph:
        """Return outputs as a casadi function of the driver and of `vary`, see `md.function`.

        Parameters
        ----------
        outputs
            Paths of one pose each.
        inputs
            Drivers, their rates, numbers; default: the task's drivers, then `vary`.
        """
        task = self.task
        if not isinstance(task, Sweep):
            raise InputError(f"a task of kind '{task.kind}' has no function", where="task")
        drivers = [driver.coordinate for driver in task.all_drivers]
        whole = inputs or [*drivers, *self.vary]
        return function(self.problem, self.name, inputs=whole, outputs=outputs)


def _is_many(values: Mapping[str, Any]) -> bool:
    """Return whether numbers are given for each row."""
    return any(not isinstance(value, str) and np.ndim(value) for value in values.values())


def _merged(values: Mapping[str, Any] | None, more: Mapping[str, Number]) -> dict[str, Number]:
    if values is not None and not isinstance(values, Mapping):
        raise InputError(f"names and their numbers are needed, not {values!r}", where="set")
    return {**(values or {}), **more}

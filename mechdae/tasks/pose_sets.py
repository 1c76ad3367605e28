"""Poses of many sets of numbers, one set for each row: at once where the lanes of studies can."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.file.settings import settable
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.values import Number
from mechdae.design.studies.batches.set_poses import SetPoses
from mechdae.design.studies.rows import in_series
from mechdae.errors import InputError, MechdaeError
from mechdae.motion.kinematics.pose_arrays import PoseArrays, floats, of_rows
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.setup.drivers import plan
from mechdae.types import Floats, Integers

FEW, MANY = 8, 32
"""Sets from which lanes are faster than one set after the other; rows of a set from which its own
path is faster than a lane for each."""
NOWHERE = "the mechanism cannot be assembled at its sketch on any mode"
Alone = Callable[[dict[str, Number], Floats], PoseArrays]
"""Gives the poses of one set of numbers at some rows of drivers' values."""


class RowSets:
    """Sets of numbers: ``names`` of those that differ, ``values`` (n, m) in SI, ``same`` by name.

    Parameters
    ----------
    values
        By name one number or one for each row, or rows (n, p) in the order of `vary`.
    """

    def __init__(self, problem: Problem, vary: Sequence[str], values: object) -> None:
        if not isinstance(values, Mapping):
            rows = floats(values, "parameters")
            if rows.ndim != 2 or rows.shape[1] != len(vary) or not vary:
                wanted = (
                    f"(n, {len(vary)}): {', '.join(vary)}" if vary else "names in 'vary' and rows"
                )
                raise InputError(f"{wanted} are needed, not {rows.shape}", where="parameters")
            values = dict(zip(vary, rows.T, strict=True))
        self.same: dict[str, Number] = {
            n: v for n, v in values.items() if isinstance(v, str) or np.ndim(v) == 0
        }
        known = problem.mechanism.settable
        columns: dict[str, Floats] = {}
        for name, value in values.items():
            if name not in self.same:
                column = floats(value, name)
                if column.ndim != 1 or not column.size:
                    raise InputError(
                        f"one value for each row is needed, not {column.shape}", where=name
                    )
                base, _ = settable(problem, known, name, 1.0)
                if base != name:
                    numbers = [
                        settable(problem, known, name, v)[1] if np.isfinite(v) else np.nan
                        for v in column.tolist()
                    ]
                    column = np.array(numbers, float)
                columns[base] = column
        lengths = {name: len(column) for name, column in columns.items()}
        if len(set(lengths.values())) > 1:
            said = ", ".join(f"{count} of {name}" for name, count in lengths.items())
            raise InputError(
                f"as many values of each are needed, here are {said}", where="parameters"
            )
        self.names, self.values = tuple(columns), np.stack(list(columns.values()), axis=1)


class RowsOfSets:
    """Poses of a task by sets of numbers; what computes many at once is built once for names."""

    def __init__(self, problem: Problem, task: Sweep, alone: Alone) -> None:
        self.problem, self.task, self._alone = problem, task, alone
        self._known: tuple[object, SetPoses | None] | None = None

    def at(self, sets: RowSets, u: Floats) -> PoseArrays:
        """Return the poses of n sets at n values of the drivers, one of either counts for all."""
        rows = self._rows(u)
        count = max(len(rows), len(sets.values))
        if {len(rows), len(sets.values)} - {1, count}:
            raise InputError(
                f"{len(sets.values)} sets of numbers and {len(rows)} values of the drivers",
                where="u", hint="as many of both are needed, or one",
            )  # fmt: skip
        rows = np.broadcast_to(rows, (count, *rows.shape[1:]))
        values = np.broadcast_to(sets.values, (count, sets.values.shape[1]))
        distinct, which = np.unique(values, axis=0, return_inverse=True)
        parts, faults = list[tuple[Integers, PoseArrays]](), dict[int, str]()
        left = np.ones(count, bool)
        batch = self._batch(sets) if max(FEW, count / MANY) <= len(distinct) else None
        if batch is not None:
            found, places, left = batch.at(values, rows)
            parts += [(places, found)] if found is not None else []
            faults |= dict.fromkeys(np.setdiff1d(np.flatnonzero(~left), places).tolist(), NOWHERE)
        for k in np.unique(which[left]).tolist():
            mine = np.flatnonzero(left & (which == k))
            try:
                if not np.isfinite(distinct[k]).all():
                    raise InputError("a number is not finite")
                finite = mine[np.isfinite(rows[mine].reshape(len(mine), -1)).all(axis=1)]
                numbers = dict(zip(sets.names, distinct[k].tolist(), strict=True))
                if finite.size:
                    parts.append((finite, self._alone({**sets.same, **numbers}, rows[finite])))
            except MechdaeError as error:
                faults |= dict.fromkeys(mine.tolist(), str(error))
        setting = parts[0][1]._setting if parts else prepare(self.problem, self.task)
        return of_rows(rows, parts, setting, self.task.derivatives + 1, faults)

    def _rows(self, u: Floats) -> Floats:
        """Return values of the drivers as rows: (n,) of one that moves, (n, nd) of several."""
        numbers = plan(self.problem.mechanism, self.task)
        nd = len(numbers.coordinates)
        alone = nd == 1 or numbers.moving is not None
        rows = np.atleast_1d(u) if alone else np.atleast_2d(u)
        if not rows.size or not ((alone and rows.ndim == 1) or rows.shape[1:] == (nd,)):
            names = ", ".join(c.text for c in numbers.coordinates)
            raise InputError(f"values of {names} are needed, not of shape {u.shape}", where="u")
        return rows[:, 0] if nd == 1 and rows.ndim == 2 else rows

    def _batch(self, sets: RowSets) -> SetPoses | None:
        """Return what computes sets at once, None where they are computed alone."""
        key = (sets.names, tuple(sets.same.items()))
        if self._known is None or self._known[0] != key:
            found = None
            if in_series(self.task, (), True):
                try:
                    problem = self.problem.with_values(sets.same)
                    found = SetPoses(problem, self.task, sets.names, ())
                except MechdaeError:  # other sets may make a mechanism
                    found = None
            self._known = key, found if found is not None and found.usable else None
        return self._known[1]

"""A number of a motion or an equilibrium as a function of the free parameters, with its gradient.

Each value is a whole task, solved again from the sketch of the file. Gradients are those of the
tasks of sensitivity: exact at rest, differenced over motions. casadi sees both as a function that
it calls; where the task cannot be solved it is nan, so that IPOPT takes a shorter step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Equilibrium
from mechdae.design.derivatives.figures import is_figure, value
from mechdae.design.derivatives.function import DenseCallback
from mechdae.design.studies.sensitivity import numbers, sharp
from mechdae.errors import InputError, MechdaeError, within
from mechdae.results import Result
from mechdae.tasks.dispatch.solve import solve
from mechdae.types import Floats, Sym

KEPT = 64
"""Designs whose values are kept: IPOPT asks for value and gradient of one several times."""
SAME = 1e-9
"""Share below which a number did not change."""


class TaskRun:
    """A task with all numbers that are asked of it.

    `names`, `box`: free parameters, then those that are chosen; bounds (k, 2) of the free ones.
    """

    def __init__(
        self,
        problem: Problem,
        task: str,
        paths: Sequence[str],
        names: Sequence[str],
        box: list[tuple[float, float]],
    ) -> None:
        self.task: str = task
        self.names: list[str] = list(names)
        self.box: Floats = np.asarray(box, float)
        self.problem: Problem = sharp(problem, task, tuple(paths))
        self.rests: bool = isinstance(self.problem.tasks[task], Equilibrium)
        self._values: dict[bytes, dict[str, float]] = {}
        self._slopes: dict[bytes, dict[str, Any]] = {}
        with within(f"goal.of: {task}"):
            self.found: Result = solve(self.problem, task)
            self.whole: dict[str, str] = {
                p: p if is_figure(p) else self.found.whole_path(p) for p in paths
            }
            self.here: dict[str, float] = {path: self.of(self.found, path) for path in paths}

    def of(self, found: Result, path: str) -> float:
        """Return a number of the solved task."""
        given = value(found, self.whole[path])
        try:
            number = np.asarray(given, float)
        except (TypeError, ValueError):
            raise InputError(f"{path} is not a number") from None
        if number.size != 1:
            raise InputError(
                f"{path} is {number.size} numbers, a goal or a limit is one",
                hint="append /0, /1, ... or name one number in [outputs]"
                if self.rests or is_figure(path)
                else f"last/{path}, highest/..., peak/..., fluctuation/... or settling/{path}",
            )  # fmt: skip
        return float(number.ravel()[0])

    def values(self, d: Floats) -> dict[str, float]:
        """Return the numbers with parameters (k,), nan where the task cannot be solved."""
        key = d.tobytes()
        if key not in self._values and self.rests:
            self.slopes(d)  # they come with the values
        if key not in self._values:
            _trim(self._values)
            try:
                found = solve(self._at(d), self.task)
                self._values[key] = {path: self.of(found, path) for path in self.whole}
            except MechdaeError:
                self._values[key] = dict.fromkeys(self.whole, np.nan)
        return self._values[key]

    def slopes(self, d: Floats) -> dict[str, Floats]:
        """Return derivatives (k,) by the free parameters, zeros for those that are chosen."""
        key = d.tobytes()
        if key in self._slopes:
            return self._slopes[key]
        _trim(self._slopes)
        free = self.names[: len(self.box)]
        wide = self.box[:, 1] - self.box[:, 0]
        sizes = np.abs(d[: len(free)])
        sizes = np.where(sizes > 0, np.minimum(sizes, wide), wide)
        steps = dict(zip(free, sizes.tolist(), strict=True))
        rest = np.zeros(len(d) - len(free))
        try:
            found = numbers(self._at(d), self.task, list(self.whole.values()), free, steps)
            self._slopes[key] = {
                path: np.append([np.ravel(found[whole][1][name])[0] for name in free], rest)
                for path, whole in self.whole.items()
            }
            if self.rests:
                _trim(self._values)
                self._values[key] = {
                    path: float(np.ravel(found[whole][0])[0]) for path, whole in self.whole.items()
                }
        except MechdaeError:
            self._slopes[key] = {path: np.full(len(d), np.nan) for path in self.whole}
        return self._slopes[key]

    def _at(self, d: Floats) -> Problem:
        return self.problem.with_values(dict(zip(self.names, d.tolist(), strict=True)))


class Outcome:
    """One number of a task."""

    def __init__(self, run: TaskRun, path: str) -> None:
        self.run: TaskRun = run
        self.path: str = path
        self.names: list[str] = run.names
        self.here: float = run.here[path]

    def value(self, d: Floats) -> float:
        """Return the number with parameters (k,), nan where the task cannot be solved."""
        return self.run.values(np.asarray(d, float).ravel())[self.path]

    def gradient(self, d: Floats) -> Floats:
        """Return its derivatives (k,)."""
        return self.run.slopes(np.asarray(d, float).ravel())[self.path]

    def depends_on(self, k: int, d: Floats) -> bool:
        """Return whether another value of a free parameter changes the number, or its failing.

        Near `d`, or else near other designs within the bounds: what is damped too little settles at
        the same time whatever its spring.
        """
        low, high = self.run.box.T
        size = max(abs(self.here), 1e-300)
        bases = [np.array(d, float) for _ in range(3)]
        bases[1][: len(low)], bases[2][: len(low)] = low + 0.618034 * (high - low), high
        for base in bases:
            value = self.value(base)
            for share in (0.0, 0.381966, 1.0):
                moved = base.copy()
                moved[k] = low[k] + share * (high[k] - low[k])
                if not abs(self.value(moved) - value) <= SAME * size:
                    return True
        return False


def _trim(kept: dict[bytes, Any]) -> None:
    if len(kept) >= KEPT:
        del kept[next(iter(kept))]


class Called(DenseCallback):
    """d (k,) -> a number."""

    def __init__(self, name: str, outcome: Outcome) -> None:
        self._outcome = outcome
        self._slopes: Any = None
        super().__init__(name, (len(outcome.names),), (1, 1))

    def eval(self, arg: Any) -> Sequence[float]:
        return [self._outcome.value(np.array(arg[0]))]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(
        self, name: str, inames: Sequence[str], onames: Sequence[str], opts: Mapping[str, object]
    ) -> Any:
        self._slopes = _Slopes(name, self._outcome, opts)
        return self._slopes


class _Slopes(DenseCallback):
    """(d, value) -> derivatives (1, k)."""

    def __init__(self, name: str, outcome: Outcome, options: Mapping[str, object]) -> None:
        self._outcome, k = outcome, len(outcome.names)
        super().__init__(name, (k, 1), (1, k), options)

    def eval(self, arg: Any) -> Sequence[Sym]:
        return [ca.DM(self._outcome.gradient(np.array(arg[0]))).T]

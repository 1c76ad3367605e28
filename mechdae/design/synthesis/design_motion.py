"""The motions of a design: sweeps that are computed once, when they are first read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Driver, Sweep, Task
from mechdae.results import Result
from mechdae.tasks.dispatch.solve import solve

PATH = "path"
"""Task of a design's problem that moves it."""
SMOOTH = 1441
"""Poses of a path that is looked at closely: where a link turns fast they are far apart."""
FINE = 721
"""Poses of an interval that a goal looks at."""


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

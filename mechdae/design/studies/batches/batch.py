"""A study's sweep for many sets at once, as far as lanes can be certified."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from functools import partial
from typing import Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.design.studies.batches.lane_extremes import Ways
from mechdae.design.studies.batches.march import Followed, FrontStates, LaneFollower
from mechdae.design.studies.batches.modes import StartingModes, Starts
from mechdae.design.studies.batches.numbers import Numbers, bounds_of, numbers_of
from mechdae.design.studies.batches.poses import Asked, LaneNodes, LanePoses, Lanes
from mechdae.design.studies.batches.readings import (
    ForceReading,
    Reading,
    SeriesReading,
    WayReading,
    reading_of,
)
from mechdae.kernels.graphs.closed_form import ClosedForm, closed_form
from mechdae.motion.continuation.beyond_ends import TURN
from mechdae.motion.continuation.evaluate import in_time
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.kinematics.prepared import Setting, prepare
from mechdae.records import dataclass
from mechdae.results import Status
from mechdae.types import Booleans, Floats, Integers, Matrices, Matrix

SERIES = ("bodies", "points", "joints")
NUMBERS = 20_000_000
"""Numbers that a portion of lanes may hold, roughly."""
LEAST, MOST = 64, 8192
"""Lanes of a portion."""
Follow = Callable[..., tuple[Any, Any, int]]
"""Of numbers, lanes, starts, places, values and table: lanes left, whole poses, steps."""


@dataclass(frozen=True)
class Rows:
    """Rows of some sets: values (k, ...) by path, statuses; ``left`` (k,) are computed alone."""

    values: list[Floats]
    status: list[str]
    left: Booleans
    steps: int = 0
    faults: dict[int, str] = field(default_factory=dict)


@dataclass
class LaneRun:
    """Lanes at the poses of a study: rows of the study, y and its derivatives by the driver.

    ``beta`` (nb, k, n) are norms of the blocks' inverse Jacobians where they are wanted, ``mu``
    (k, nb) those of the Jacobians, ``complete`` (k, n) tells which poses are there.
    """

    numbers: Numbers
    lanes: Integers
    lane_numbers: Lanes
    nodes: LaneNodes
    trace: Followed
    largest: Floats
    mu: Floats
    beta: Any
    y: list[Floats]
    complete: Booleans

    @property
    def scale(self) -> Floats:
        """Lengths of the mechanisms (k,)."""
        return self.numbers.scale[self.lanes]

    def in_time(self) -> list[Matrices]:
        """Return y and its derivatives by the time."""
        speed, acceleration, jerk = (rate[self.lanes][:, None] for rate in self.numbers.rates)
        return in_time(self.y, speed, acceleration, jerk)


class SeriesBatch:
    """Computes series of a plain sweep for many sets."""

    forces = False
    """Whether forces are asked for."""

    def __init__(
        self, problem: Problem, task: Sweep, names: Sequence[str], outputs: Sequence[str]
    ) -> None:
        self.problem, self.task, self.names, self.outputs = problem, task, list(names), outputs
        self.wrong: dict[int, tuple[str, str]] = {}
        self.setting: Setting = self._prepared()
        read = [self._reading(path) for path in outputs]
        self.unread: list[str] = [
            path for path, reading in zip(outputs, read, strict=True) if reading is None
        ]
        self.read: list[Reading] = [reading for reading in read if reading is not None]
        self.series: list[SeriesReading] = [
            reading for reading in self.read if isinstance(reading, SeriesReading)
        ]
        self.asked: Asked = self._selected()
        self.why_not: str = self._why_not()

    def _prepared(self) -> Setting:
        return prepare(self.problem, self.task, free=self.names)

    def _reading(self, path: str) -> Reading | None:
        return reading_of(path, self.setting.outputs, self.task)

    def _selected(self) -> Asked:
        """Return orders and columns that are needed at poses."""
        return Asked((*((s.order, s.columns) for s in self.series), *self._more()))

    def _more(self) -> tuple[tuple[int, tuple[int, ...]], ...]:
        """Return orders and columns that are needed at poses beside what is asked for."""
        return ()

    @property
    def usable(self) -> bool:
        """Whether sets can be computed at once."""
        return not self.why_not

    def _why_not(self) -> str:
        """Return why sets cannot be computed at once, '' where they can."""
        setting, graphs = self.setting, self.setting.graphs
        if self.unread:
            return f"{self.unread[0]} is computed for one set at a time"
        if not graphs.single or setting.plan.values is None:
            return "the driver does not go through given values alone"
        if setting.scene.redundant or graphs.contacts:
            names = ", ".join(group.name for group in setting.scene.redundant)
            return f"group {names} has redundant equations" if names else "a joint is on a curve"
        if setting.scene.cases("stops"):
            return "a joint has limits"
        form = closed_form(graphs, setting.scene.model.p_values)
        if not isinstance(form, ClosedForm):
            groups = {graphs.blocks[b].block.group for b in form}
            names = ", ".join(group.name for group in setting.scene.groups if group.index in groups)
            return f"no closed form of group {names} is known: it is no dyad"
        self.modes: StartingModes = StartingModes(setting, form)
        made = partial(LanePoses, graphs, setting.outputs, form)
        self.poses: LanePoses = made(self.asked)
        of_way = [reading for reading in self.read if isinstance(reading, WayReading)]
        self.ways: Ways | None = None
        if of_way:
            values, is_angle = setting.plan.values[:, 0], setting.plan.coordinates[0].is_angle
            if values.min() == values.max():
                return "over a single value of the driver there is no range"
            self.ways = Ways(made, of_way, is_angle, values)
        return "" if self.modes.usable else "whole turns of geared bodies tell modes apart"

    @property
    def portion(self) -> int:
        g, values = self.setting.graphs, len(self.setting.plan.values)
        series = 2 * len(self.asked.columns) * (self.asked.order + 1)
        ways = self.ways
        more = 2 * len(ways.poses.asked.columns) * (ways.poses.asked.order + 1) if ways else 0
        each = 2 * NODES_PER_TURN * (6 * g.nx + more) + values * series
        return int(np.clip(NUMBERS // max(each, 1), LEAST, MOST))

    def rows(self, sets: Floats) -> Rows:
        """Return the rows of some sets (k, m)."""
        return self.started(sets, self._followed)

    def started(self, sets: Matrix, follow: Follow) -> Rows:
        """Return the rows of some sets; `follow` computes those whose start is known."""
        numbers = numbers_of(self.problem, self.task, self.setting, self.names, sets)
        if numbers is None:
            return self._none(len(sets))
        plan, count = self.setting.plan, len(sets)
        values = plan.values[:, 0]
        s = np.where(np.isnan(numbers.start), values[0], numbers.start)
        with np.errstate(all="ignore"):
            starts = self.modes(numbers, s)
        left = numbers.left | ~starts.sure
        lanes = np.flatnonzero(~left & ~starts.open)
        n = len(values)
        table = [self._empty(reading, count, n) for reading in self.read]
        status = np.full(count, str(Status.UNASSEMBLED), object)
        steps, self.wrong = 0, {}
        if lanes.size:
            missed, whole, steps = follow(numbers, lanes, starts, s, values, table)
            left[lanes[missed]] = True
            status[lanes[whole.all(axis=1)]] = str(Status.OK)
        faults = {}
        for k, (word, fault) in self.wrong.items():
            if not left[k]:
                status[k], faults[k] = word, fault
        shaped = [self._shaped(k, part) for k, part in enumerate(table)]
        return Rows(shaped, status.tolist(), left, steps, faults)

    @staticmethod
    def _empty(reading: Reading, count: int, poses: int) -> Floats:
        if isinstance(reading, WayReading):
            return np.full((count, 4) if reading.kind == "envelope" else count, np.nan)
        if isinstance(reading, ForceReading):
            return np.full((count, poses, reading.width), np.nan)
        return np.full((count, poses, 1 if reading.made else len(reading.columns)), np.nan)

    def _none(self, count: int) -> Rows:
        return Rows([], [str(Status.UNASSEMBLED)] * count, np.ones(count, bool))

    def _followed(
        self,
        numbers: Numbers,
        lanes: Integers,
        starts: Starts,
        s: Floats,
        values: Floats,
        table: list[Floats],
    ) -> tuple[Booleans, Booleans, int]:
        """Write series of lanes into the table; return which are left, whole poses, steps."""
        g, setting = self.setting.graphs, self.setting
        is_angle = setting.plan.coordinates[0].is_angle
        march, trace, ends, lanes_of_run, mu = self._begun(numbers, lanes, starts, s[lanes], values)
        largest, s = march.largest, s[lanes]
        around = [values + TURN * k for k in (-1, 0, 1)] if is_angle else [values]
        grid = np.unique(np.concatenate(around))
        every = np.arange(len(lanes))
        low, high = values.min() + 0 * largest, values.max() + 0 * largest
        if self.ways is not None:
            low, high = self.ways.reach(largest)
        march.go(trace, ends, every, high, grid)
        march.go(trace, ends, every, low, grid)
        if self.ways is not None:
            trace.left |= np.isfinite([*trace.low, *trace.high]).any(axis=0)
            trace.left |= (trace.first > low) | (trace.last < high)
        elif is_angle:
            self._the_other_way(march, trace, ends, values, grid)
        nodes = LaneNodes(trace, len(lanes), g.nx)
        beta = np.full((g.nb, len(lanes), len(values)), np.nan) if self.forces else None
        y, complete = self.poses(lanes_of_run, nodes, trace, s, values, is_angle, beta)
        run = LaneRun(numbers, lanes, lanes_of_run, nodes, trace, largest, mu, beta, y, complete)
        self._write(table, run)
        return trace.left, complete, trace.steps

    def _begun(
        self, numbers: Numbers, lanes: Integers, starts: Starts, s: Floats, values: Floats
    ) -> tuple[LaneFollower, Followed, FrontStates, Lanes, Floats]:
        """Return what follows lanes from places `s` (k,), their traces, ends and numbers, mu."""
        g, is_angle = self.setting.graphs, self.setting.plan.coordinates[0].is_angle
        scale = numbers.scale[lanes]
        size = np.ones(len(lanes)) if is_angle else scale
        margin = 4 * (np.pi if is_angle else float(scale.max()))
        size_u = np.array([max(np.abs(values).max(), np.abs(s).max()) + margin])
        consts, mu, size_x = bounds_of(g, numbers, lanes, size_u)
        largest = 2 * np.pi / NODES_PER_TURN * size
        march = LaneFollower(g, self.modes.form, consts, size_x, scale, largest)
        trace, ends = march.begin(starts.x[lanes], s)
        unlike = march.sign != starts.sign[lanes].T
        trace.left |= unlike[self.modes.form.branches].any(axis=0)
        first = g.np + 1
        parts = consts.T, consts.T[first : first + g.nb], consts.T[first + g.nb : first + 2 * g.nb]
        return march, trace, ends, Lanes(*parts, march.sign, np.ascontiguousarray(size_x.T)), mu

    def _write(self, table: list[Floats], run: LaneRun) -> None:
        """Write what is asked for into the table; lanes that have to be solved alone are left."""
        self._series(table, run.lanes, run.in_time())
        if self.ways is not None:
            self._of_the_way(table, run)

    def _series(self, table: list[Floats], lanes: Integers, y: list[Matrices]) -> None:
        """Write series of poses into the table, y and its derivatives by the time given."""
        place = {column: k for k, column in enumerate(self.asked.columns)}
        for part, reading in zip(table, self.read, strict=True):
            if isinstance(reading, SeriesReading):
                chosen = [y[reading.order][place[column]] for column in reading.columns]
                for k, column in enumerate([reading.made(chosen)] if reading.made else chosen):
                    part[lanes, :, k] = column

    def _of_the_way(self, table: list[Floats], run: LaneRun) -> None:
        """Write numbers of the whole way into the table, for lanes that are not left."""
        assert self.ways is not None
        rows = np.flatnonzero(~run.trace.left)
        if not rows.size:
            return
        sizes = run.scale[rows], run.largest[rows]
        found, good = self.ways(run.lane_numbers.take(rows), run.nodes.take(rows), *sizes)
        run.trace.left[rows[~good]] = True
        pairs = zip(table, self.read, strict=True)
        places = [part for part, reading in pairs if isinstance(reading, WayReading)]
        for part, values in zip(places, found, strict=True):
            part[run.lanes[rows]] = values

    def _the_other_way(
        self, march: LaneFollower, trace: Followed, ends: FrontStates, values: Floats, grid: Floats
    ) -> None:
        """Follow lanes that ended on one side to their other end: poses may be there too."""
        low, high = trace.whole
        ended = np.isfinite(low) != np.isfinite(high)
        outside = (values.max() > high) | (values.min() < low)
        rows = np.flatnonzero(ended & outside & ~trace.left)
        if not rows.size:
            return
        anchor = np.where(np.isfinite(low[rows]), low[rows] + TURN, high[rows] - TURN)
        march.go(trace, ends, rows, anchor, grid, first=True)
        low, high = trace.whole
        trace.left[rows[np.isinf(low[rows]) | np.isinf(high[rows])]] = True

    def _shaped(self, k: int, values: Floats) -> Floats:
        path = self.outputs[k]
        if values.ndim < 3:
            return values
        return values if "/position" in path or values.shape[2] > 1 else values[:, :, 0]

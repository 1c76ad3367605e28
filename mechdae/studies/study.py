"""The task of kind study: one sweep for many sets of parameters.

Series of a sweep with one driver over given values go through all sets in lockstep; sets
that the lockstep cannot prove, and everything else that a task gives (``summary/...``),
are computed one by one.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mechdae.continuation.change_points import NODES_PER_TURN
from mechdae.continuation.evaluate import in_time
from mechdae.derivatives.figures import base_of, prepared
from mechdae.describe.coordinates import coordinate_names
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import evaluate_all
from mechdae.describe.tasks.kinds import Equilibrium, Motion, Study, Sweep
from mechdae.errors import InputError, MechanismError, MechdaeError, SolveError, UnknownName
from mechdae.jobs.distribute import distribute
from mechdae.jobs.executors import Processes, Supply
from mechdae.kinematics.prepared import Setting, first_pose, prepare
from mechdae.results import StudyResult, Summary
from mechdae.setup.drivers import Sketch, sketched
from mechdae.setup.drivers import plan as plan_of
from mechdae.setup.scales import Constants
from mechdae.studies.lockstep import Lockstep
from mechdae.studies.set_modes import OwnModes
from mechdae.studies.sets import OF_PARTS, SetRow, Sets, computed, row_of, text_of

MAX_SETS = 200_000
MAX_NUMBERS = 50_000_000
SERIES = ("bodies", "points", "joints")
PORTION = 400_000
"""Poses of all sets that are computed in one portion."""
MOST, SHARES = 32, 8
"""Sets that are sent to a process at a time: at most, and portions for each process at least."""
AHEAD = 2
"""Portions that are handed over for each process: the next one lies ready."""
Progress = Callable[[int, int], None]


def study(
    problem: Problem, name: str, task: Study, workers: int = 1, progress: Progress | None = None
) -> StudyResult:
    """Return a result whose rows are sets of parameters.

    Sets that are computed one by one are spread over `workers` processes; `progress` is told how
    many of how many are done.

    ``parameters`` holds the sets, ``table`` one array (sets, ...) for each path in `outputs`;
    ``status`` is ok for sets in which all poses are, else the first other status; sets whose
    cycle jams or has several solutions between the poses are not ok either. Other faults
    of sets that are ok (a slack belt) are under ``faults`` in the summary.

    Raises
    ------
    InputError
        Unknown parameters, paths or tasks, too many sets.
    """
    base_name, base = base_of(problem, task.of, "varied")
    names, sets = _sets(problem, task)
    if not task.outputs:
        raise InputError(
            "name the paths to tabulate", where="outputs", hint='"summary/swing/rocker"'
        )
    for path in task.outputs:
        _check_summary(problem, path)
    problem = prepared(problem, base_name, tuple(task.outputs))
    _, base = base_of(problem, base_name, "varied")
    collector = _Collector(
        problem, base_name, base, names, sets, tuple(task.outputs), workers, progress
    )
    table, status = collector.run()
    units = parameter_units(problem.mechanism, problem.tasks.values())
    summary = {
        "sets": len(sets),
        "of": base_name,
        "status": {str(word): status.count(word) for word in dict.fromkeys(status)},
        "units": {key: units[key] for key in names if key in units},
        "work": {"lockstep": collector.together, "one_by_one": len(sets) - collector.together},
    }
    if collector.faults:
        summary["faults"] = collector.faults
    if collector.errors:
        summary["estimated_error"] = collector.errors
    reached = any(word == "ok" for word in status)
    return StudyResult(
        problem.name,
        name,
        task.kind,
        problem.mechanism,
        problem.title,
        parameters={key: sets[:, k] for k, key in enumerate(names)},
        table=table,
        status=np.array(status),
        summary=Summary(summary),
        fault=None if reached else f"none of {len(sets)} sets is assembled at all poses",
        definition=task,
    )


def _sets(problem: Problem, task: Study) -> tuple[list[str], Any]:
    """Return names (m,) and values (k, m) of the parameter sets."""
    if (task.vary is None) == (task.samples is None):
        raise InputError("give either 'vary' or 'samples'", where="vary")
    word = "vary" if task.vary is not None else "samples"
    table = task.vary if task.vary is not None else task.samples
    if not table:
        raise InputError("a table name = [...] is needed", where=word)
    known = problem.mechanism.parameter_values
    automatic = {*known, *dict(problem.mechanism.numbers())}
    columns = []
    for key, items in table.items():
        if key not in automatic:
            raise UnknownName("parameter", key, automatic, where=word)
        try:
            columns.append(_column(word, items, known))
        except MechdaeError as error:
            raise error.inside(f"{word}.{key}") from None
    if word == "samples":
        if len({len(column) for column in columns}) > 1:
            raise InputError("the lists have different lengths", where=word)
        sets = np.array(columns, float).T
    else:
        count = int(np.prod([len(column) for column in columns]))
        if count > MAX_SETS:
            raise InputError(f"{count} sets, at most {MAX_SETS} are computed", where=word)
        sets = np.array(list(itertools.product(*columns)), float)
    if len(sets) > MAX_SETS:
        raise InputError(f"{len(sets)} sets, at most {MAX_SETS} are computed", where=word)
    return list(table), sets


def _column(word: str, items: Any, known: Mapping[str, float]) -> list[float]:
    values = [evaluate(item, dict(known)) for item in items]
    if word == "samples":
        return values
    if len(values) != 3 or values[2] != int(values[2]) or values[2] < 1:
        raise InputError("[from, to, count] is needed, count a whole number above 0")
    count = int(values[2])
    return [values[0]] if count == 1 else np.linspace(values[0], values[1], count).tolist()


class _Collector:
    """Fills the table of a study."""

    def __init__(
        self,
        problem: Problem,
        name: str,
        task: Sweep | Motion | Equilibrium,
        names: list[str],
        sets: Any,
        outputs: tuple[str, ...],
        workers: int,
        progress: Progress | None,
    ) -> None:
        self.problem, self.name, self.task = problem, name, task
        self.names, self.sets, self.outputs = names, sets, outputs
        self.workers, self.progress = workers, progress
        self.together = 0
        self.faults: list[dict[str, Any]] = []
        self.refused: dict[int, InputError] = {}
        self.errors: dict[str, float] = {}

    def run(self) -> tuple[dict[str, Any], list[str]]:
        """Return path -> (sets, ...) and the status of each set."""
        rows: list[Any] = [None] * len(self.sets)
        status = ["unassembled"] * len(self.sets)
        if self._in_series():
            self._lockstep(rows, status)
        self._one_by_one(rows, status)
        return self._stacked(rows), status

    def _stacked(self, rows: list[Any]) -> dict[str, Any]:
        table = {}
        for j, path in enumerate(self.outputs):
            shapes = [np.shape(row[j]) for row in rows if row is not None and row[j] is not None]
            if not shapes:
                table[path] = np.full(len(rows), np.nan)
                continue
            shape = max(set(shapes), key=shapes.count)
            if len(rows) * int(np.prod(shape, initial=1)) > MAX_NUMBERS:
                raise InputError(f"{path}: more than {MAX_NUMBERS} numbers", where="outputs")
            array = np.full((len(rows), *shape), np.nan)
            for k, row in enumerate(rows):
                if row is not None and row[j] is not None and np.shape(row[j]) == shape:
                    array[k] = row[j]
            table[path] = array
        return table

    def _in_series(self) -> bool:
        """Return whether all outputs are series of one driver over given values."""
        if not isinstance(self.task, Sweep) or type(self.task) is not Sweep:
            return False  # only plain sweeps have a lockstep
        drivers = self.task.all_drivers
        plain = len(drivers) == 1 and drivers[0].law is None and drivers[0].range is None
        heads = all(path.split("/")[0] in SERIES for path in self.outputs)
        return plain and heads and self.task.mode is None and self.task.derivatives <= 2

    def _values(self, k: int) -> dict[str, float]:
        return dict(zip(self.names, self.sets[k].tolist(), strict=True))

    def _one_by_one(self, rows: list[Any], status: list[str]) -> None:
        """Fill in the sets that are left, in this process or in several."""
        left = [k for k in range(len(self.sets)) if rows[k] is None]
        done = len(self.sets) - len(left)

        def take(k: int, own: SetRow) -> None:
            nonlocal done
            done += 1
            rows[k], status[k] = own.values, own.status
            if own.fault:
                self.faults.append({"set": k, "fault": own.fault})
            for path, error in own.errors.items():
                self.errors[path] = max(self.errors.get(path, 0.0), error)
            if own.refused is not None:
                self.refused[k] = own.refused
            if self.progress is not None:
                self.progress(done, len(self.sets))

        if self.workers == 1 or len(left) < 2:
            for k in left:
                take(k, row_of(self.problem, self.name, self.outputs, self._values(k)))
        else:
            self._spread(left, take)
        self.faults.sort(key=lambda fault: int(fault["set"]))
        if len(self.refused) == len(self.sets):
            raise self.refused[min(self.refused)]

    def _spread(self, left: list[int], take: Callable[[int, SetRow], None]) -> None:
        """Compute sets in processes, a few at a time."""
        size = min(MOST, max(1, len(left) // (SHARES * self.workers)))
        portions = [left[i : i + size] for i in range(0, len(left), size)]
        text = text_of(self.problem, self.name, self.task)
        works = {
            i: Sets(text, self.name, self.outputs, tuple(self._values(k) for k in portion))
            for i, portion in enumerate(portions)
        }

        def landed(i: int, found: list[SetRow]) -> None:
            for k, own in zip(portions[i], found, strict=True):
                take(k, own)

        with Supply(lambda: Processes(self.workers)) as supply:
            distribute(works, supply, landed, AHEAD * self.workers, computed, "portion")

    @property
    def _sweep(self) -> Sweep:
        """The task, which is a sweep where `_in_series` is true."""
        assert isinstance(self.task, Sweep)
        return self.task

    # -- lockstep --------------------------------------------------------------------------

    def _lockstep(self, rows: list[Any], status: list[str]) -> None:
        """Fill in the sets that all poses of are proved in lockstep."""
        setting = prepare(self.problem, self._sweep)
        if not setting.graphs.single or setting.graphs.contacts or setting.scene.redundant:
            return
        for path in self.outputs:
            setting.outputs.column_of(
                path
            )  # unknown names are reported before anything is computed
        try:
            u, x = first_pose(setting, self._sweep)
        except (SolveError, MechanismError):  # other sets may have other sketches
            return
        own = OwnModes(setting, u, x)
        if not own.usable:
            return
        plan, s = setting.plan, float(u[0])
        is_angle = plan.coordinates[0].is_angle
        scale = setting.scene.model.mechanism.scale
        largest = 2 * np.pi / NODES_PER_TURN * (1.0 if is_angle else scale)
        values = plan.values[:, 0]
        size_u = np.array([max(np.abs(values).max(), abs(s)) + 1e-9])
        lanes = Lockstep(setting, largest)
        numbers, rates = self._parameters(setting), self._rates()
        if numbers is None or rates is None:
            return
        portion = max(1, PORTION // max(len(values), 1))
        base = setting.scene.model.p_values
        for start in range(0, len(self.sets), portion):
            chosen = range(start, min(start + portion, len(self.sets)))
            p = [base, *(numbers[k] for k in chosen)]
            constants = [Constants(setting.graphs, size_u, p=q) for q in p]
            sketches, there = self._sketches(setting, chosen)
            starts = own.starts(lanes, constants, sketches, s)
            found = lanes.run(constants, starts, s, values)
            speeds = np.concatenate([rates[:1], rates[start : start + len(chosen)]])[:, None, :]
            y = in_time(found.y, speeds[:, :, :1], speeds[:, :, 1:])
            for i, k in enumerate(chosen, start=1):
                if not (found.kept[i] and there[i]):
                    continue
                rows[k] = [_series(setting, path, [part[i] for part in y]) for path in self.outputs]
                status[k] = "ok"
                self.together += 1
            if self.progress is not None:
                self.progress(self.together, len(self.sets))

    def _sketches(self, setting: Setting, chosen: range) -> tuple[list[Sketch], list[bool]]:
        """Return the sketches of the first set and of others, and which begin at its driver value.

        A sketch may name parameters that the study varies.
        """
        mechanism = self.problem.mechanism
        base = sketched(mechanism)
        words = [number for number in mechanism.sketch.values() if isinstance(number, str)]
        if not words or not set(self.names) & set(mechanism.parameters):
            return [base] * (len(chosen) + 1), [True] * (len(chosen) + 1)
        sketches, there = [base], [True]
        for k in chosen:
            varied = mechanism
            for name, value in self._values_of(k, mechanism.parameters).items():
                varied = varied.with_values({name: value})
            sketches.append(sketched(varied))
            other = plan_of(varied, self._sweep).sketch
            there.append(np.array_equal(other, setting.plan.sketch, equal_nan=True))
        return sketches, there

    def _rates(self) -> Any:
        """Return speed and acceleration of the driver in each set (k, 2).

        None where a set changes the values that the driver takes.
        """
        driver, parameters = self._sweep.all_drivers[0], dict(self.problem.mechanism.parameters)
        places = [n for n in (driver.from_, driver.to, *(driver.at or ())) if n is not None]
        given = (
            driver.speed if driver.speed is not None else 1.0,
            driver.acceleration if driver.acceleration is not None else 0.0,
        )
        if not any(isinstance(number, str) for number in (*places, *given)):
            return np.tile(np.array(given, float), (len(self.sets), 1))
        known = evaluate_all(parameters)
        rates = np.empty((len(self.sets), 2))
        for k in range(len(self.sets)):
            own = evaluate_all({**parameters, **self._values_of(k, parameters)})
            if any(evaluate(number, own) != evaluate(number, known) for number in places):
                return None
            rates[k] = [evaluate(number, own) for number in given]
        return rates

    def _parameters(self, setting: Setting) -> Any:
        """Return the parameter vectors (k, np) of the sets; None where they do not suffice."""
        model = setting.scene.model
        place = {name: i for i, name in enumerate(model.p_names)}
        if any(name not in place for name in self.names):
            return None  # a literal zero is no symbol of this model
        base = dict(self.problem.mechanism.parameters)
        dependent = [name for name, number in base.items() if isinstance(number, str)]
        result = np.tile(model.p_values, (len(self.sets), 1))
        for j, name in enumerate(self.names):
            result[:, place[name]] = self.sets[:, j]
        if dependent and set(self.names) & set(base):
            for k in range(len(self.sets)):
                known = evaluate_all({**base, **self._values_of(k, base)})
                for name in dependent:
                    result[k, place[name]] = known[name]
        return result

    def _values_of(self, k: int, base: Mapping[str, Any]) -> dict[str, float]:
        return {name: value for name, value in self._values(k).items() if name in base}


def _series(setting: Setting, path: str, y: list[Any]) -> Any:
    order, columns = setting.outputs.column_of(path)
    values = y[order][:, columns]
    return values if "/position" in path or len(columns) > 1 else values[:, 0]


def _check_summary(problem: Problem, path: str) -> None:
    """Raise for a path like ``summary/swing/rocker`` that names no part of the mechanism.

    A part that is there may have no value, such as a time ratio, and then is nan.
    """
    head, *rest = path.split("/")
    if head != "summary" or len(rest) < 2 or rest[0] not in OF_PARTS:
        return
    mechanism = problem.mechanism
    points = [f"{body}.{point}" for body, part in mechanism.bodies.items() for point in part.points]
    names = [*mechanism.bodies, *mechanism.joints, *points, *coordinate_names(mechanism)]
    if rest[1] not in names:
        known = [f"summary/{rest[0]}/{name}" for name in names]
        raise UnknownName("path", path, known, where="outputs")

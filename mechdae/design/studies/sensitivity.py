"""Derivatives of outputs by parameters, and what tolerances of them do.

Values at poses are differentiated through the casadi graph of the solved pose, exact to
rounding (see `Composed`). Figures of a whole task (``summary/...``) and tasks with laws of time
are differenced: central differences of halved steps, extrapolated (Richardson), with the
last change as an estimate of their error.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.expression import build, names_in
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import evaluate_all
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.describe.tasks.motion import Equilibrium, Motion, Reactions
from mechdae.describe.tasks.studies import Sensitivity, Study, half_widths
from mechdae.design.derivatives import figures
from mechdae.design.derivatives.composed import Composed, is_series, without_expressions
from mechdae.design.derivatives.figures import base_of, prepared, units_of
from mechdae.dynamics.rest.implicit import Implicit
from mechdae.equations.model import FUNCTIONS
from mechdae.errors import InputError, SolveError, UnknownName
from mechdae.forces.poses import loaded_run
from mechdae.forces.task import with_forces
from mechdae.forces.uniqueness import require_unique
from mechdae.kernels.run.functions import Batch
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run
from mechdae.records import dataclass
from mechdae.results import Result, SensitivityResult, Summary, whole_path
from mechdae.tasks.dispatch.solve import placed, solve
from mechdae.types import Floats, Sym

SX = ca.SX
LEVELS, FEW_LEVELS = 4, 2
"""Halved steps of a difference, fewer for a gradient that a search takes again and again."""
STEP = 2.0**-6
"""First step, as a share of the parameter (of the mechanism's length where it is zero)."""
SAMPLES, FEW_SAMPLES = 1000, 200
"""Sets of a Monte Carlo run, fewer where each is a whole task of its own."""
SHARP = 1e-13
"""Tolerance of motions that are differenced."""
SETTLED = 1e-9
"""How far the last Newton step of a sampled pose may still move."""


@dataclass
class PathDerivatives:
    """Values and derivatives of one path: (n, ...), by name, by pair of names."""

    value: Any
    first: dict[str, Any]
    second: dict[str, Any]
    error: dict[str, float]


def sensitivity(problem: Problem, name: str, task: Sensitivity) -> SensitivityResult:
    """Return the result of a task of kind sensitivity.

    ``derivatives`` of the result's data holds path -> name -> array like the value.
    """
    base_name, base = base_of(problem, task.of, "differentiated")
    outputs = task.outputs or ()
    problem = _sharp(prepared(problem, base_name, outputs), base_name)
    if not task.outputs:
        raise InputError("name the paths to differentiate", where="outputs")
    tolerances = half_widths(problem.mechanism, problem.tasks, task.tolerances or {})
    names = list(dict.fromkeys([*(task.wrt or ()), *tolerances]))
    if not names:
        raise InputError("name parameters to differentiate by", where="wrt")
    if task.order > 2:
        raise InputError("derivatives up to the second are computed", where="order")
    values = problem.mechanism.values()
    for key in names:
        if key not in values:
            raise UnknownName("parameter", key, values, where="wrt")
    literal = without_expressions(problem, names)
    paths = [whole_path(literal.mechanism.outputs, path) for path in task.outputs]
    series = [path for path in paths if is_series(path) and _has_series(base)]
    rest = [path for path in paths if path not in series]
    poses = None
    found: dict[str, PathDerivatives] = {}
    if isinstance(base, Sweep) and series:
        with placed(literal, base_name):
            poses = _Poses(literal, base_name, base, series, names)
        found = poses.found(task.order)
    whole = _solved(literal, base_name) if rest or poses is None else poses.result
    if isinstance(base, Equilibrium) and task.order == 1:
        found = _at_rest(literal, base, names, rest)
        rest = [path for path in rest if path not in found]
    for path in rest:
        found[path] = _differenced(literal, base_name, path, names, task.order, whole)
    data = {
        "derivatives": {path: found[path].first for path in paths},
        "values": {path: found[path].value for path in paths},
    }
    if task.order == 2:
        data["second"] = {path: found[path].second for path in paths}
    implicit = [path for path in paths if path not in (*series, *rest)]
    errors = {path: found[path].error for path in rest}
    if errors:
        data["estimated_error"] = errors
    if tolerances:
        data["tolerances"] = _spread(
            literal, base_name, poses, [*implicit, *rest], names, found, tolerances
        )
    summary = {
        "of": base_name,
        "wrt": names,
        "order": task.order,
        "units": units_of(problem, base_name, names, paths),
        "exact": series,
        "differenced": rest,
        **({"implicit": implicit} if implicit else {}),
        "status": whole.summary.get("status", {}),
    }
    return SensitivityResult.of(
        problem,
        name,
        task,
        drivers=whole.drivers,
        status=whole.status,
        summary=Summary(summary),
        fault=whole.fault,
        data=data,
    )


def _has_series(task: Sweep | Motion | Equilibrium) -> bool:
    return isinstance(task, Sweep) and all(
        driver.law is None and driver.range is None for driver in task.all_drivers
    )


def _sharp(problem: Problem, name: str) -> Problem:
    """Return the problem with a motion sharp enough to be differenced."""
    task = problem.tasks[name]
    if not isinstance(task, Motion):
        return problem
    return problem.with_task(name, replace(task, tolerance=SHARP))


def sharp(problem: Problem, name: str, paths: tuple[str, ...]) -> Problem:
    """Return the problem with a task sharp and fine enough for differences of paths."""
    return _sharp(prepared(problem, name, paths), name)


def numbers(
    problem: Problem, name: str, paths: list[str], names: list[str], sizes: Mapping[str, float]
) -> dict[str, tuple[float, dict[str, Floats]]]:
    """Return numbers of a motion or an equilibrium with their derivatives by name."""
    task, found = problem.tasks[name], {}
    if isinstance(task, Equilibrium):
        found = _at_rest(problem, task, names, paths)
    rest = [path for path in paths if path not in found]
    whole = _solved(problem, name) if rest else None
    for path in rest:
        found[path] = _differenced(problem, name, path, names, 1, whole, FEW_LEVELS, sizes)
    return {path: (found[path].value, found[path].first) for path in paths}


def _at_rest(
    problem: Problem, base: Equilibrium, names: list[str], paths: list[str]
) -> dict[str, PathDerivatives]:
    """Return values and derivatives of the paths of an equilibrium that have exact ones."""
    implicit = Implicit(problem, base, names)
    found = {}
    for path in paths:
        if not implicit.knows(path):
            continue
        of_pose = is_series(path)
        value, slopes = implicit.place(path) if of_pose else implicit.motion(path)
        first = {name: slopes[..., k] for k, name in enumerate(names)}
        if of_pose and len(value) == 1:  # one pose
            first = {name: np.ravel(slope) for name, slope in first.items()}
        elif of_pose:
            value, first = value[None, :], {name: slope[None, :] for name, slope in first.items()}
        found[path] = PathDerivatives(value, first, {}, {})
    return found


def _solved(problem: Problem, name: str) -> Result:
    return solve(problem, name)


# -- through the graph -------------------------------------------------------------------------


class _Poses:
    """The poses of a sweep or reactions task, to be evaluated with other parameters."""

    def __init__(
        self, problem: Problem, name: str, base: Sweep, paths: list[str], names: list[str]
    ) -> None:
        self.paths, self.names, self.statics = paths, names, None
        if isinstance(base, Reactions):
            loaded = loaded_run(problem, base, names)
            self.setting, followed, self.statics = loaded.setting, loaded.run, loaded.statics
            require_unique(self.statics, loaded.motion, paths)
            kinematic = report(problem, name, base, self.setting, followed)
            self.result: Result
            self.result, answer = with_forces(kinematic, loaded, base)
        else:
            self.setting = prepare(problem, base, free=names)
            followed = run(self.setting, base)
            self.result = report(problem, name, base, self.setting, followed)
        n, nu = followed.values.shape
        extra: list[Floats] = [np.zeros((n, 1)), *[np.zeros((n, 0))] * 3]
        if self.statics is not None:
            extra = [*answer.inputs[3:6], answer.sizes]
        plan, model = self.setting.plan, self.setting.scene.model
        self.p = model.p_values
        self.free = np.array([self.p[model.p_names.index(name)] for name in names])
        rates = [np.broadcast_to(rate, (n, nu)) for rate in (plan.speed, plan.acceleration)]
        self.inputs = [followed.poses.x, followed.values, *rates, *extra]
        self._last = _driver_slopes(problem, base, names, n)

    def _kept(self, order: int) -> tuple[list[slice], Batch]:
        """Return the rows of each path and the function of derivatives, of samples for order 0."""
        dependent = bool(self._last)
        forces = self.statics and self.statics.key

        def build() -> tuple[list[slice], Batch]:
            composed = Composed(
                self.setting, self.paths, self.names, self.statics, apart=not order,
                solved=order == 1, numbers=True, dependent=dependent,
            )  # fmt: skip
            function = composed.derivatives(order) if order else composed.sampled
            first = len(self.inputs)
            last = [first + 2 + len(self._last)] * (not order)
            return composed.spans, Batch(function, [first, first + 1, *last])

        key = ("derivatives", *self.paths, None, *self.names, order, dependent, forces)
        return self.setting.scene.cache(key, build)

    def found(self, order: int) -> dict[str, PathDerivatives]:
        spans, batch = self._kept(order)
        values, first, *second = batch(*self.inputs, self.free, self.p, *self._last)
        rows, k, names = values.shape[1], len(self.names), self.names
        found = {}
        for path, span in zip(self.paths, spans, strict=True):
            # derivatives lie by columns: name after name
            by_name = {
                name: _flat(first[:, j * rows + span.start : j * rows + span.stop])
                for j, name in enumerate(names)
            }
            pairs = {}
            for i, j in itertools.combinations_with_replacement(range(k), 2):
                if second:
                    start = (j * k + i) * rows
                    mixed = second[0][:, start + span.start : start + span.stop]
                    pairs[f"{names[i]},{names[j]}"] = _flat(mixed)
            found[path] = PathDerivatives(_flat(values[:, span]), by_name, pairs, {})
        return found

    def sampled(self, sets: Any) -> dict[str, Any]:
        """Return the values of each path for sets (m, k) of the parameters, nan where one fails.

        Poses start from those of the parameters themselves: for sets near them.
        """
        spans, batch = self._kept(0)
        tables: dict[str, list[Any]] = {path: [] for path in self.paths}
        for free in sets:
            values = batch(*self.inputs, free, self.p, *self._last, self.free)[0]
            with np.errstate(invalid="ignore"):
                values[~(values[:, -1] <= SETTLED)] = np.nan
            for path, span in zip(self.paths, spans, strict=True):
                tables[path].append(_flat(values[:, span]))
        return {path: np.array(rows) for path, rows in tables.items()}


def _flat(array: Floats) -> Floats:
    return array[:, 0] if array.shape[1] == 1 else array


def _driver_slopes(problem: Problem, task: Sweep, names: Sequence[str], n: int) -> list[Floats]:
    """Return derivatives of the drivers' values, speeds, accelerations by parameters.

    (n, 3 nu k) and second ones (n, 3 nu k k), by columns; nothing where they do not depend on
    them.
    """
    parameters = problem.mechanism.parameters
    free = {name: SX.sym(name) for name in names if name in parameters}
    known: dict[str, Sym] = dict(free)

    def symbolic(number: float | str) -> Sym:
        if not isinstance(number, str):
            return SX(number)
        for name in names_in(number):
            if name not in known:
                known[name] = symbolic(parameters[name])
        return SX(build(number, known, FUNCTIONS))

    columns = [_driver_columns(driver, n, symbolic) for driver in task.all_drivers]
    ordered = [column for part in zip(*columns, strict=True) for column in part]
    stacked = ca.vertcat(*[numbers for _, numbers in ordered])
    every = ca.vertcat(*[free.get(name, SX.sym("other")) for name in names])
    if not ca.depends_on(stacked, every):
        return []
    point = evaluate_all(parameters)
    first = ca.densify(ca.jacobian(stacked, every))
    second = ca.densify(ca.jacobian(ca.vec(first), every))
    function = ca.Function("slopes", [every], [first, second])
    one, two = (np.array(part) for part in function([point.get(name, 0.0) for name in names]))
    ends = np.cumsum([0, *[numbers.numel() for _, numbers in ordered]])
    found = []
    for matrix in (one, two.reshape(len(one), -1, order="F")):
        parts = np.split(matrix, ends[1:-1])
        whole_parts = [
            part if shares is None else shares @ part
            for (shares, _), part in zip(ordered, parts, strict=True)
        ]
        found.append(np.stack(whole_parts, axis=1).reshape(n, -1, order="F"))
    return found


def _driver_columns(driver: Driver, n: int, symbolic: Any) -> list[tuple[Floats | None, Sym]]:
    """Return value, speed and acceleration (n,) of a driver as shares (n, k) of k expressions."""
    ones = np.ones((n, 1))
    if driver.at is not None:
        shares = ones if len(driver.at) == 1 else None
        value = (shares, ca.vertcat(*[symbolic(number) for number in driver.at]))
    else:
        share = np.linspace(0.0, 1.0, n)
        ends = ca.vertcat(symbolic(driver.from_), symbolic(driver.to))
        value = (np.stack([1 - share, share], axis=1), ends)
    speed = symbolic(driver.usual_speed)
    acceleration = symbolic(0.0 if driver.acceleration is None else driver.acceleration)
    return [value, (ones, speed), (ones, acceleration)]


# -- by differences ------------------------------------------------------------------------------


def _differenced(
    problem: Problem, base: str, path: str, names: list[str], order: int, whole: Any,
    levels: int = LEVELS, sizes: Mapping[str, float] | None = None,
) -> PathDerivatives:  # fmt: skip
    values = problem.mechanism.values()
    middle = _number(whole, path)
    first: dict[str, float] = {}
    second: dict[str, Any] = {}
    error: dict[str, float] = {}
    scale = problem.mechanism.scale
    for name in names:
        h = STEP * (sizes[name] if sizes else abs(values[name]) or scale)
        ones, twos = [], []
        for level in range(levels):
            step = h / 2**level
            up, down = (
                _number(_solved(problem.with_values({name: values[name] + d}), base), path)
                for d in (step, -step)
            )
            ones.append((up - down) / (2 * step))
            twos.append((up - 2 * middle + down) / step**2)
        first[name], error[name] = _extrapolated(ones)
        if order == 2:
            second[f"{name},{name}"] = _extrapolated(twos)[0]
    return PathDerivatives(middle, first, second, error)


def _extrapolated(column: list[float]) -> tuple[Any, Any]:
    """Return the limit of central differences with halved steps, and an error estimate."""
    table = [column]
    for order in range(1, len(column)):
        last, factor = table[-1], 4.0**order
        pairs = itertools.pairwise(last)
        table.append([(factor * fine - coarse) / (factor - 1) for coarse, fine in pairs])
    best, change = table[-1][-1], None
    for before, row in itertools.pairwise(table):
        for k, entry in enumerate(row):
            gap = np.maximum(np.abs(entry - before[k]), np.abs(entry - before[k + 1]))
            size = float(np.nanmax(gap, initial=0.0))
            if change is None or size < float(np.nanmax(change, initial=0.0)):
                best, change = entry, gap
    return best, change


def _number(result: Result, path: str) -> Floats:
    value = figures.value(result, path)
    if value is None:
        raise SolveError(f"{path} has no value here", hint="ask for a path that has one")
    try:
        found = np.array(value, float)
    except (TypeError, ValueError):
        raise InputError(f"{path} is not a number", where="outputs") from None
    if not found.size:
        raise SolveError(f"{path} has no value here", hint="ask for a path that has one")
    return found


# -- tolerances ----------------------------------------------------------------------------------


def _spread(
    problem: Problem,
    base: str,
    poses: _Poses | None,
    rest: list[str],
    names: list[str],
    found: dict[str, PathDerivatives],
    tolerances: dict[str, float],
) -> dict[str, Any]:
    """Return what tolerances do to each path, three ways side by side.

    Parameters lie evenly in +- their half width: ``first_order`` is the standard deviation to
    first order, ``worst_case`` the largest deviation to first order, ``monte_carlo`` mean,
    standard deviation and extremes of sampled mechanisms.
    """
    generator = np.random.default_rng(0)
    values = problem.mechanism.values()
    middle = np.array([values[name] for name in names])
    widths = np.array([tolerances.get(name, 0.0) for name in names])
    sets = middle + widths * generator.uniform(-1, 1, (SAMPLES, len(names)))
    tables = poses.sampled(sets) if poses else {}
    if rest:
        few = sets[:FEW_SAMPLES]
        samples = {name: few[:, names.index(name)].tolist() for name in tolerances}
        study = Study(samples=samples, of=base, outputs=tuple(rest))
        tables |= solve(problem, study).table
    result = {}
    for path, derivatives in found.items():
        slopes = [derivatives.first[name] * width for name, width in tolerances.items()]
        table = tables[path]
        there = np.isfinite(table.reshape(len(table), -1)).all(axis=1)
        remaining = table[there] if there.any() else np.full((1, *table.shape[1:]), np.nan)
        result[path] = {
            "first_order": np.sqrt(sum(slope * slope for slope in slopes) / 3),
            "worst_case": sum(np.abs(slope) for slope in slopes),
            "monte_carlo": {
                "samples": int(there.sum()),
                "failed": int(len(table) - there.sum()),
                "mean": remaining.mean(axis=0),
                "std": remaining.std(axis=0),
                "min": remaining.min(axis=0),
                "max": remaining.max(axis=0),
            },
        }
    return result

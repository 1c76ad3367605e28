"""`md.function`: outputs of a mechanism as a casadi function of drivers and parameters.

The pose comes from a certified path from the sketch, followed in the drivers and then in the
parameters, without derivatives; two Newton steps on top of it make the function exact, and its
derivatives up to the second order too. Calls with other values stay on the sketch's branch.
"""

from __future__ import annotations

import threading
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_names import coordinate_names
from mechdae.describe.file.load import Source, given
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.structure import structure_of
from mechdae.describe.tasks.kinds import Driver, Sweep, Task
from mechdae.describe.tasks.motion import Reactions
from mechdae.describe.values import Number, names
from mechdae.design.derivatives.composed import Composed, is_series, without_expressions
from mechdae.errors import InputError, MechdaeError, UnknownName, within
from mechdae.forces.inverse_dynamics import InverseDynamics
from mechdae.forces.poses import loaded_run
from mechdae.forces.uniqueness import require_unique
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.prepared import first_pose, prepare
from mechdae.motion.kinematics.tracker import Tracker
from mechdae.motion.setup.drivers import placed
from mechdae.motion.setup.drivers import plan as planned
from mechdae.motion.setup.scales import Constants
from mechdae.records import public
from mechdae.results import whole_path
from mechdae.types import Floats, Graph, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.steps import Graphs

MX = ca.MX
RATES = (".speed", ".acceleration")
CERTIFIED = 0.2
"""Newton-Kantorovich number of a step in the parameters."""
NEAR = 1e-2
"""Longest last step of Newton's method: sine and cosine after it are of second order."""
HALVINGS = 40


class DenseCallback(ca.Callback):
    """A function of Python within casadi's graphs; keep it as long as what is built with it."""

    def __init__(
        self, name: str, sizes: Sequence[int], shape: tuple[int, int], options: Any = None
    ) -> None:
        ca.Callback.__init__(self)
        self._sizes, self._shape = tuple(sizes), shape
        self.construct(name, options or {})

    def get_n_in(self) -> int:
        return len(self._sizes)

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> Any:
        return ca.Sparsity.dense(self._sizes[i], 1)

    def get_sparsity_out(self, i: int) -> Any:
        return ca.Sparsity.dense(*self._shape)


@public(old="problem inputs outputs task")
def function(
    problem: Source,
    task: Task | str | None = None,
    *,
    inputs: Sequence[str],
    outputs: Sequence[str],
    set: Mapping[str, Number] | None = None,
) -> Graph:
    """Return a casadi function from scalars to the values of paths.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    inputs
        Drivers' coordinates (``crank.angle``), their rates (``crank.angle.speed``,
        ``crank.angle.acceleration``), parameters and automatic names, each a scalar input.
        ``rod.C.x`` is the place of C on the rod, unless a task drives it or no other input is
        a driver.
    outputs
        Paths as in the JSON of a task, one pose each: ``points/rod.B/position``,
        ``efforts/crank.angle``, ``joints/O/reaction``, names of `[outputs]`.
    set
        Numbers to change, as of `md.solve`.
    task
        Sweep or reactions task that gives drivers, speeds and friction where they are no
        inputs; the first one with the drivers named. Without any speed forces are quasi-static;
        of a law of time the drivers alone count. The function has the task's name.

    Returns
    -------
    casadi.Function
        Column vectors; nan where the mechanism cannot get to from its sketch, or where
        friction has no solution. Derivatives up to the second order are exact.

    Raises
    ------
    UnknownName
        An input or a path that does not exist.
    InputError
        An input or a path twice, or two with the same name in casadi's alphabet; a coordinate
        that the task named does not drive.

    Examples
    --------
    >>> position = md.function(
    ...     md.slider_crank(0.1, 0.3), inputs=["crank.angle"], outputs=["points/rod.C/position"]
    ... )
    >>> [round(float(x), 4) for x in position(0.5).full().ravel()]
    [0.3839, 0.0]
    """
    inputs, outputs = _names(inputs, "inputs"), _names(outputs, "outputs")
    _tell_apart([*inputs, *outputs])
    whole, named = given(problem, task, set)
    mechanism = whole.mechanism
    values = mechanism.values()
    coordinates = [name for name in inputs if name in coordinate_names(mechanism)]
    called, base = _base(whole, coordinates, values, named, inputs, outputs)
    drivers = [driver.coordinate for driver in base.all_drivers]
    numbers = [name for name in inputs if name not in drivers and not name.endswith(RATES)]
    for name in numbers:
        if name in values:
            continue
        if name in coordinates:
            raise InputError(
                f"{name} is not driven in this task, {' and '.join(drivers)} is",
                where="inputs",
                hint="without 'task' a driver is made for it",
            )
        raise UnknownName("input", name, [*values, *coordinate_names(mechanism)])
    for name in inputs:
        if name.endswith(RATES) and name.rpartition(".")[0] not in drivers:
            raise UnknownName("input", name, [d + r for d in drivers for r in RATES])
    literal = without_expressions(whole, numbers)
    key = (
        structure_of(literal.mechanism),
        tuple(literal.mechanism.values().items()),
        tuple(literal.mechanism.sketch.items()),
        *(called, base, tuple(inputs), tuple(outputs)),
    )
    with _MAKING:
        if key not in _MADE:
            _MADE[key] = _Built(literal, base, inputs, numbers, outputs).function(_plain(called))
        return _MADE[key][0]


def _names(given: Sequence[str], where: str) -> list[str]:
    """Return the names of inputs or of outputs as a list."""
    with within(where):
        return list(names(given))


def _tell_apart(names: Sequence[str]) -> None:
    known: dict[str, str] = {}
    for name in names:
        plain = _plain(name)
        if plain in known:
            raise InputError(
                f"'{known[plain]}' and '{name}' are both '{plain}' in casadi: inputs and outputs "
                "need names of their own",
                where="function",
            )
        known[plain] = name


def _base(
    problem: Problem,
    coordinates: list[str],
    values: Mapping[str, float],
    task: str | None,
    inputs: Sequence[str],
    outputs: Sequence[str],
) -> tuple[str, Sweep]:
    """Return the name of a task and the task of one pose with the drivers that are inputs."""
    sure = [name for name in coordinates if name not in values]
    chosen: Sweep | None = None
    name = task or "mechanism"
    if task is not None:
        given_task = problem.task(task)
        if not isinstance(given_task, Sweep):
            raise InputError(f"'{task}' is no sweep and no task of reactions", where="task")
        chosen = given_task
    else:
        sweeps = {name: each for name, each in problem.tasks.items() if isinstance(each, Sweep)}
        for driven in (coordinates, sure) if sure or not coordinates else (coordinates,):
            for each, sweep in sweeps.items():
                if chosen is None and {d.coordinate for d in sweep.all_drivers} >= set(driven):
                    name, chosen = each, sweep
    driven = sure or coordinates
    forces = any(_needs_forces(path) for path in outputs)
    if chosen is None:
        if not driven:
            raise InputError("name the driver's coordinate among the inputs", where="inputs")
        chosen = Sweep(drivers=tuple(Driver(name, at=(0.0,)) for name in driven))
    if any(driver.law is not None for driver in chosen.all_drivers):
        chosen = placed(chosen, planned(problem.mechanism, chosen))
    drivers = []
    for driver in chosen.all_drivers:
        place = driver.at[:1] if driver.at else (driver.from_ if driver.from_ is not None else 0.0,)
        held = driver.speed is None and driver not in chosen.moving_drivers
        given = {f"{driver.coordinate}{rate}" for rate in RATES}.intersection(inputs)
        speed = 0.0 if held else driver.usual_speed if given else driver.speed
        direction = None if held or given else driver.direction
        drivers.append(
            replace(
                driver, at=place, from_=None, to=None, range=None, speed=speed, direction=direction
            )
        )
    at_pose = tuple(drivers)
    if not forces:
        return name, Sweep(drivers=at_pose, mode=chosen.mode)
    if not isinstance(chosen, Reactions):
        return name, Reactions(drivers=at_pose, mode=chosen.mode)
    return name, replace(
        chosen, drivers=at_pose, driver=None, poses=None, outputs=None, measures=None, cycle=False
    )


def _needs_forces(path: str) -> bool:
    head, _, tail = path.partition("/")
    quantity = tail.rpartition("/")[2]
    return head.startswith("efforts") or (
        head == "joints" and quantity.split("_")[0] in ("reaction", "loss", "normal")
    )


class _Built:
    """Everything a function needs; casadi keeps the callback, the callback keeps this."""

    def __init__(
        self, problem: Problem, base: Sweep, inputs: list[str], names: list[str], outputs: list[str]
    ) -> None:
        self.inputs, self.names, self.outputs = inputs, names, outputs
        mechanism = problem.mechanism
        paths = [whole_path(mechanism.outputs, path) for path in outputs]
        for path in paths:
            if not is_series(path):
                raise UnknownName(
                    "path", path, ["points/...", "bodies/...", "joints/...", "efforts/..."]
                )
        start = replace(_at_sketch(mechanism, base), derivatives=2)
        self.base, self.statics = base, None
        if isinstance(start, Reactions):
            loaded = loaded_run(problem, start, names)
            self.setting, self.statics = loaded.setting, loaded.statics
            require_unique(self.statics, loaded.motion, paths)
        else:
            self.setting = prepare(problem, start, free=names)
        self.u, self.x = first_pose(self.setting, start)
        self.tracker = Tracker(self.setting, self.u, self.x)
        self.composed = Composed(self.setting, paths, names, self.statics)
        self.parameters = ca.Function("p", [self.composed.free], [self.composed.p])

    def function(self, called: str) -> tuple[Any, _Guess]:
        """Return the casadi function, and the callback that it needs."""
        composed, plan = self.composed, self.setting.plan
        symbols = {name: MX.sym(_plain(name)) for name in self.inputs}
        coordinates = [c.text for c in plan.coordinates]
        base = planned(self.setting.scene.model.mechanism, self.base)

        def given(name: str, value: float) -> Sym:
            return symbols.get(name, MX(float(value)))

        u = ca.vertcat(*[given(c, base.values[0, k]) for k, c in enumerate(coordinates)])
        du = ca.vertcat(*[given(c + RATES[0], base.speed[0, k]) for k, c in enumerate(coordinates)])
        ddu = ca.vertcat(
            *[given(c + RATES[1], base.acceleration[0, k]) for k, c in enumerate(coordinates)]
        )
        free = ca.vertcat(*[symbols[name] for name in self.names]) if self.names else MX(0, 1)
        callback = _Guess(self)
        guess = callback(u, free) if composed.graphs.nx else MX(0, 1)
        pieces, signs, sizes, good = MX(0, 1), MX(0, 1), MX(0, 1), MX(1)
        if self.statics is not None:
            pieces, signs, sizes, good = self._forces(guess, u, du, ddu, free)
        values = composed.function(guess, u, du, ddu, MX(0), pieces, signs, sizes, free)
        values = ca.if_else(good, values, np.nan)
        results = [values[span] for span in composed.spans]
        names = [_plain(path) for path in self.outputs]
        made = ca.Function(
            called, list(symbols.values()), results, [_plain(n) for n in symbols], names
        )
        return made, callback

    def _forces(self, guess: Any, u: Any, du: Any, ddu: Any, free: Any) -> tuple[Any, ...]:
        """Return pieces of tables, signs, sizes of friction, and whether there is a solution."""
        assert self.statics is not None
        composed, balance = self.composed, self.statics.balance
        inputs = [composed.guess, composed.u, composed.du, composed.ddu, composed.free]
        moved = ca.Function("moved", inputs, [*composed.coordinates])
        w, dw, ddw = moved(guess, u, du, ddu, free)
        p = self.parameters(free)
        signs = ca.sign(balance.slipping(w, dw, p)[0]) if balance.slips else MX(0, 1)
        pieces = self._pieces(self.statics, w, dw, p)
        sizes, good = MX(0, 1), MX(1)
        if balance.feedbacks:
            law, whole, miss, _ = balance.solve(w, dw, ddw, MX(0), pieces, signs, p, MX(1))
            coupled = self.statics.coupled
            sizes = whole if coupled else law
            good = ca.mmax(miss) <= 1e-9 if coupled else MX(1)
        return pieces, signs, sizes, good

    @staticmethod
    def _pieces(statics: InverseDynamics, w: object, dw: object, p: object) -> Any:
        loads = statics.loads
        timed = [MX(ca.DM(table.piece(0.0))) for table in loads.timed]
        if not loads.signals:
            return ca.vertcat(MX(0, 1), *timed)
        at = statics.abscissae.function(w, dw, p)
        found = []
        for k, signal in enumerate(loads.signals):
            X, Y = np.array(signal.load.points).T
            inside = at[k]
            if signal.load.periodic:
                inside = X[0] + ca.fmod(at[k] - X[0], X[-1] - X[0])
                inside = ca.if_else(inside < X[0], inside + X[-1] - X[0], inside)
            slopes = np.diff(Y) / np.diff(X)
            place = ca.low(ca.DM(X), inside)
            found += [MX(ca.DM(X))[place] + (at[k] - inside), MX(ca.DM(Y))[place]]
            found.append(MX(ca.DM(slopes))[place])
        return ca.vertcat(*found, *timed)

    # -- the pose ----------------------------------------------------------------------------

    def pose(self, u: Floats, free: Floats) -> Unknowns:
        """Return unknowns near the pose at given values, nan where it cannot be reached."""
        graphs = self.setting.graphs.straight
        nothing = np.full(graphs.nx, np.nan)
        if not np.isfinite(u).all() or not np.isfinite(free).all():
            return nothing
        model = self.setting.scene.model
        size = np.maximum(np.abs(u), np.abs(self.u)) + 2 * np.pi
        x = self.x
        near = self.tracker.reached(self.tracker.first, u)
        if near is not None:
            x = near[0].state[: graphs.nx]
        elif not np.array_equal(u, self.u):
            d = u - self.u
            steps = Path(
                graphs, Constants(graphs, size), self.u, d, 0.05 / max(np.abs(d).max(), 0.05)
            )
            try:
                steps.begin(x, 0.0)
                extend(steps, 1.0)
            except MechdaeError:  # further than is followed, or no start: not reached
                return nothing
            if any(
                end is not None for reach in steps.reach.values() for end in (reach.low, reach.high)
            ):
                return nothing
            x = steps.at(1.0)
        if not self.names:
            return x
        target = np.array(self.parameters(free)).ravel()
        return self._along(graphs, x, u, model.p_values, target, size, nothing)

    def _along(
        self,
        graphs: Graphs,
        x: Unknowns,
        u: Floats,
        p: Floats,
        target: Floats,
        size: Floats,
        nothing: Floats,
    ) -> Floats:
        """Return the unknowns after moving the parameters, each step certified.

        Newton's method must be proved to converge from the old pose as well as from the one it
        leads to: far from a pose the kernels do not even give the right Jacobian.
        """
        done, step = 0.0, 1.0
        zero = [np.zeros(graphs.nu)] * len(graphs.driven)

        def newton(start: Floats, numbers: Constants) -> tuple[Floats, Floats, Floats, Floats]:
            """Return unknowns after a step, sign of the determinants, beta, length of the step."""
            found = graphs.pose(start, u, *zero, numbers.consts)
            x, det, beta, eta = (np.array(found[k]).ravel() for k in (0, 2, 3, 4))
            return x, np.sign(det), beta, np.sqrt(eta)

        while done < 1.0:
            ahead = min(1.0, done + step)
            _, before, beta, _ = newton(x, Constants(graphs, size, p=p + done * (target - p)))
            numbers = Constants(graphs, size, p=p + ahead * (target - p))
            moved, _, _, first = newton(x, numbers)
            again, after, grown, last = newton(moved, numbers)
            h = numbers.kappa * np.maximum(beta, grown) * np.maximum(first, last)
            near = (h <= CERTIFIED).all() and (first <= 1).all() and (last <= NEAR).all()
            if np.isfinite(again).all() and near and (after == before).all():
                x, done = again, ahead
                step *= 2
            else:
                step = (ahead - done) / 2
                if step < 2.0**-HALVINGS:
                    return nothing
        return x


_MADE: dict[Hashable, tuple[Any, Any]] = {}
"""Functions with their callbacks, by what they compute. casadi graphs hold bare pointers to these,
so they live as long as the process; the same function is made once."""


_MAKING = threading.RLock()


def _at_sketch(mechanism: Mechanism, base: Sweep) -> Sweep:
    """Return the task at the drivers' values in the sketch, where it has them."""
    sketch = planned(mechanism, base).sketch
    drivers = tuple(
        driver if np.isnan(value) else replace(driver, at=(float(value),))
        for driver, value in zip(base.all_drivers, sketch, strict=True)
    )
    return replace(base, drivers=drivers, driver=None)


def _plain(name: str) -> str:
    """Return a name that casadi takes: letters, digits, single underscores."""
    text = "".join(c if c.isalnum() else "_" for c in name).strip("_")
    while "__" in text:
        text = text.replace("__", "_")
    return text if text[:1].isalpha() else f"v_{text}"


class _Guess(DenseCallback):
    """The pose near given drivers and parameters, constant as far as derivatives go."""

    def __init__(self, built: _Built) -> None:
        graphs, self.built = built.setting.graphs, built
        super().__init__("guess", (graphs.nu, len(built.names)), (graphs.nx, 1))

    def eval(self, arguments: Sequence[Sym]) -> list[Sym]:
        u, free = (np.array(value).ravel() for value in arguments)
        return [ca.DM(self.built.pose(u, free))]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(
        self, name: str, inames: Sequence[str], onames: Sequence[str], options: Any
    ) -> Graph:
        sizes, nx = self._sizes, self._shape[0]
        arguments = [*(MX.sym("at", size) for size in sizes), MX.sym("x", nx)]
        results = [MX(nx, size) for size in sizes]
        return ca.Function(name, arguments, results, inames, onames, dict(options))

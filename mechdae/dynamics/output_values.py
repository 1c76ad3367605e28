"""What a motion or an equilibrium reports of its states: bodies, joints, outputs, energies."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import RATES, Selection, coordinate, selection, split_rate
from mechdae.describe.expression import build, names_in
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import COMPONENTS, TIME, force_of, forces_of
from mechdae.dynamics.equations import MotionProblem
from mechdae.equations.forces.joint_reactions import reactions_of
from mechdae.equations.forces.loads import Loads
from mechdae.equations.model import FUNCTIONS, Model
from mechdae.equations.motion_equations import row_size
from mechdae.equations.structure_cache import structure_property
from mechdae.errors import InputError, MechdaeError
from mechdae.kernels.graphs.linear import recovered
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.motion.setup.named_outputs import NamedOutputs, requests
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass
from mechdae.results import Named, Series
from mechdae.types import Booleans, Floats, Graph, Integers, Matrix, Reactions, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.motion_equations import Released
    from mechdae.equations.structure_cache import StructureCache
    from mechdae.equations.tree.joint_chains import WayProducts
    from mechdae.kernels.graphs.equations_of_motion import Kernel
    from mechdae.results.series import LazyPart

SX = ca.SX
LEAST = 1e-9
"""Share of the largest force that holds up to which a limit of friction is none."""


def over_states(
    model: Model, loads: Loads, text: str, more: Mapping[str, Sym], seen: tuple[str, ...] = ()
) -> Sym:
    """Return an expression over (q, v, a, t, p) of the model; `more` are further names."""
    mechanism = model.mechanism
    known: dict[str, Sym] = dict(more)
    for used in names_in(text):
        if used in known:
            continue
        if used == TIME:
            known[used] = loads.time
        elif used in mechanism.parameters:
            known[used] = model.p[model.p_names.index(used)]
        elif used in mechanism.outputs and used not in seen:
            inner = mechanism.outputs[used]
            known[used] = over_states(model, loads, inner, more, (*seen, used))
        else:
            base, order = split_rate(used)
            value = model.coordinate(coordinate(mechanism, base))
            at = ca.vertcat(model.q, model.velocity)
            along = ca.vertcat(model.velocity, model.acceleration)
            for _ in RATES[:order]:
                value = ca.jtimes(value, at, along)
            known[used] = value
    return SX(build(text, known, FUNCTIONS))


class WithForces:
    """Named outputs that use forces, at states."""

    def __init__(self, model: Model, loads: Loads, names: Iterable[str]) -> None:
        mechanism = model.mechanism
        self.names: list[str] = list(names)
        self.forces: list[str] = sorted(
            {force for name in names for force in forces_of(mechanism, name)}
        )
        symbols, known, rows = SX.sym("forces", len(self.forces)), dict[str, Sym](), []
        for k, force in enumerate(self.forces):
            word, owner, _ = force_of(mechanism, force) or ("", "", "")
            speed = over_states(model, loads, f"{owner}{RATES[0]}", {}) if word == "power" else 1
            known[force] = symbols[k] * speed
        for name in self.names:
            try:
                rows.append(over_states(model, loads, mechanism.outputs[name], known, (name,)))
            except (ArithmeticError, TypeError, NotImplementedError) as problem:
                raise InputError(f"has no value: {problem}", where=f"outputs.{name}") from None
            except MechdaeError as problem:
                raise problem.inside(f"outputs.{name}") from None
        inputs = [model.q, model.velocity, model.acceleration, loads.time, symbols, model.p]
        function = ca.Function("outputs", inputs, [ca.vertcat(*rows)])
        self._batch = Batch(function, [5])
        self.function = function

    def __call__(
        self, q: Unknowns, v: Floats, a: Floats, t: Floats, forces: Mapping[str, Floats], p: Floats
    ) -> Floats:
        """Return the values (n, names) from those of `forces` (n,)."""
        columns = np.column_stack([forces[force] for force in self.forces])
        return self._batch(q, v, a, t[:, None], columns, p)[0]


@dataclass(frozen=True)
class Whole:
    """What `Outputs` reads of a scene: absolute coordinates stay as they are."""

    model: Model
    selection: Selection
    groups: tuple[Any, ...] = ()

    def expression(self, absolute: Sym) -> Sym:
        return absolute

    def keep_reaches(self, values: list[Sym], reaches: list[WayProducts | None]) -> None:
        """Reaches serve bounds, which motions do not have."""


def _given(mechanism: Mechanism, output: str, driven: Collection[str]) -> bool:
    """Return whether an output uses forces that a motion with laws of some coordinates gives."""
    forces = [force_of(mechanism, name) for name in forces_of(mechanism, output)]
    words = [force and (force[0] == "reaction" or force[1] in driven) for force in forces]
    return bool(words) and all(words)


class Reported:
    """Bodies, points, joints and named outputs at states."""

    def __init__(self, setup: MotionProblem, asked: tuple[str, ...] | None, moves: bool) -> None:
        self.setup, self.moves, self._key = setup, moves, (asked, moves)
        mechanism = setup.problem.mechanism
        chosen = selection(mechanism, asked, forces=True)
        self.chosen: Selection = setup.model.reported(chosen, asked is not None)
        named = self.chosen.named
        driven = {row.owner for row in setup.released.rows if row.driver and row.part == "law"}
        self.forced: list[str] = [
            name for name in named if moves and _given(mechanism, name, driven)
        ]
        plain = [name for name in named if name not in self.forced]
        whole: Any = Whole(setup.model, self.chosen)

        def build() -> tuple[Outputs, NamedOutputs]:
            listed = plain if asked is not None else ()
            expressions = NamedOutputs(setup.model, plain, 2, listed, moves)
            return Outputs(whole, requests(setup.model, list(expressions.rates))), expressions

        outputs, expressions = setup.cache(("reported", *self._key), build)
        self._outputs: Outputs = outputs.at(whole)
        self._expressions: NamedOutputs = expressions.at(setup.model)
        self.notes: list[str] = []

    def evaluate(
        self, coordinates: tuple[Floats, Floats, Floats], t: Floats | None, there: Any
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Return the tables and the series of the outputs without forces.

        `coordinates`: absolute ones with rates and accelerations, (n, nq) each. `there` (n,):
        states that have coordinates at all.
        """
        y = self.setup.cache(("rates", *self._key), self._rates)(
            *coordinates, self.setup.model.p_values
        )
        columns = self._outputs.columns(self._expressions.coordinates)
        found, lost = self._expressions.evaluate([part[:, columns] for part in y], t, there)
        self.notes = self._expressions.notes + lost
        tables: dict[str, Named] = self._outputs.named(y if self.moves else y[:1])
        return tables, {name: dict(found[name]) for name in found}

    def of_forces(
        self,
        coordinates: tuple[Floats, Floats, Floats],
        t: Floats,
        reactions: Mapping[str, Reactions],
        efforts: Mapping[str, Floats],
    ) -> dict[str, dict[str, Floats]]:
        """Return the series of the outputs that use forces."""
        setup, known = self.setup, dict[str, Floats]()
        function: WithForces = setup.cache(
            ("forced", *self._key), lambda: WithForces(setup.model, setup.loads, self.forced)
        )
        words = COMPONENTS[setup.model.mechanism.dimension]
        for force in function.forces:
            word, owner, axis = force_of(setup.model.mechanism, force) or ("", "", "")
            reaction = word == "reaction"
            known[force] = reactions[owner][:, words.index(axis)] if reaction else efforts[owner]
        values = function(*coordinates, t, known, setup.model.p_values)
        return {name: {"value": values[:, k]} for k, name in enumerate(self.forced)}

    def with_reactions(
        self, joints: Named, reactions: Mapping[str, Floats | LazyPart],
        more: Mapping[str, Mapping[str, Floats | LazyPart]] | None = None,
    ) -> Named:  # fmt: skip
        found = {}
        for joint in self.chosen.joints:
            series: dict[str, object] = dict(joints.get(joint, {}))
            if joint in reactions:
                series["reaction"] = reactions[joint]
            series |= (more or {}).get(joint, {})
            found[joint] = Series(series)
        return Named("joint", found)

    def _rates(self) -> Batch:
        """Return the function of the scalars with their rates and accelerations."""
        model, expression = self.setup.model, self._outputs.expression
        at = ca.vertcat(model.q, model.velocity)
        along = ca.vertcat(model.velocity, model.acceleration)
        first = ca.jtimes(expression, model.q, model.velocity)
        second = ca.jtimes(first, at, along)
        inputs = [model.q, model.velocity, model.acceleration, model.p]
        results = [ca.densify(part) for part in (expression, first, second)]
        function = without_repeats("outputs", inputs, results)
        return Batch(function, [3], straight=lambda: None)


@dataclass
class States:
    """States at the times of output, rows are times: x, v, a, multipliers, works."""

    t: Any
    x: Matrix
    v: Floats
    a: Matrix
    lam: Floats
    w: Matrix
    signs: Matrix


def alike(patterns: Any, rows: Integers | None = None) -> Iterator[tuple[Any, Integers]]:
    """Yield each pattern (n, k) among some rows with the rows that have it."""
    rows = np.arange(len(patterns)) if rows is None else rows
    while len(rows):
        same = (patterns[rows] == patterns[rows[0]]).all(axis=1)
        yield patterns[rows[0]], rows[same]
        rows = rows[~same]


class Observer:
    """Functions of states."""

    def __init__(self, setup: MotionProblem) -> None:
        self.setup: MotionProblem = setup
        self.r: Released = setup.loaded
        self.kernel: Kernel = setup.force_kernel
        self.model: Model = setup.model
        self.cache: StructureCache = self.kernel.cache
        self.p: Floats = self.model.p_values

    def many(self, name: str, made: Callable[[], tuple[list[Any], list[Any]]]) -> Any:
        """Return a function of (t, x, v, signs, ...); signs have one row for each state."""

        def function() -> Graph:
            results, more = made()
            return self.kernel.function(name, [ca.densify(e) for e in results], more)

        return self.kernel.batch(name, function, ())

    def absolute(self, s: States) -> tuple[Floats, Floats, Floats]:
        """Return absolute coordinates with their rates and accelerations, (n, nq) each."""
        r = self.r

        def build() -> tuple[list[Sym], list[Sym]]:
            a = SX.sym("a", r.x.numel())
            return [r.q, r.qd, r.bias + r.V @ a], [a]

        q, v, a = self.many("absolute", build)(s.t[:, None], s.x, s.v, s.signs, s.a)
        return q, v, a

    def energies(self, s: States) -> tuple[Floats, dict[str, Floats]]:
        """Return the kinetic energy (n,) and the potential ones by load."""
        r = self.r
        energies = self.many("energies", lambda: ([ca.vertcat(r.kinetic, *r.stores.values())], []))
        found = energies(s.t[:, None], s.x, s.v, s.signs)[0]
        stores = {name: found[:, k + 1] for k, name in enumerate(r.stores)}
        return found[:, 0], stores

    @structure_property
    def _gaps(self) -> Batch:
        model, r = self.model, self.r
        rows = ca.vertcat(*[row.expression for row in r.rows]) if r.rows else SX(0, 1)
        rate = ca.jtimes(rows, ca.vertcat(model.q, r.t), ca.vertcat(model.velocity, SX(1)))
        inputs = [model.q, model.velocity, r.t, r.signs, model.p]
        function = ca.Function("gaps", inputs, [ca.densify(rows), ca.densify(rate)])
        return Batch(function, [4], straight=lambda: None)

    def gaps(self, s: States, q: Unknowns, v: Floats) -> tuple[Floats, Floats]:
        """Return the largest gap of all equations at each state, and that of their rates."""
        if not self.r.rows:
            return np.zeros(len(s.t)), np.zeros(len(s.t))
        length = self.setup.length
        sizes = np.array([row_size(row.unit, length) for row in self.r.rows])
        gaps, rates = self._gaps(q, v, s.t[:, None], s.signs, self.p)
        return np.max(np.abs(gaps / sizes), axis=1), np.max(np.abs(rates / sizes), axis=1)

    # -- multipliers -----------------------------------------------------------------------

    def complete(self, s: States) -> States:
        """Return states with the multipliers and sizes of all forces, those of teeth too."""
        if self.kernel is self.setup.kernel:
            return s
        self.kernel.scale(float(s.t[0]), s.x[0], s.v[0], self.setup.loose)
        rates = self.kernel.batch("rhs", lambda: self.kernel.rhs)
        lam = np.full((len(s.t), self.kernel.inner), np.nan)
        for signs, rows in alike(s.signs, np.flatnonzero(np.isfinite(s.a).all(axis=1))):
            lam[rows] = rates(s.t[rows, None], s.x[rows], s.v[rows], signs)[1]
        return replace(s, lam=lam)

    def _multipliers(self) -> tuple[list[Sym], list[Sym]]:
        """(..., a, lambda of what is left, forces of locks, sizes) -> multipliers of all."""
        r, k = self.r, self.kernel
        a, inner = SX.sym("a", r.x.numel()), SX.sym("lam", k.inner)
        push = r.push - r.mass @ (r.V @ a)
        if k.slips:
            push -= r.held_back @ inner[k.m : k.m + k.slips]
        if k.rubs:
            push += r.rubbed @ inner[k.m + k.slips :]
        return [recovered(r, push, inner[: k.m])], [a, inner]

    def multipliers(self, s: States) -> Floats:
        """Return the multipliers of all equations, (n, rows)."""
        if not self.r.rows:
            return np.zeros((len(s.t), 0))
        inner = self._inner(s)
        multipliers = self.many("multipliers", self._multipliers)
        found: Floats = multipliers(s.t[:, None], s.x, s.v, s.signs, s.a, inner)[0]
        return found

    def _inner(self, s: States) -> Floats:
        inner = np.zeros((len(s.t), self.kernel.inner))
        inner[:, : s.lam.shape[1]] = s.lam
        return inner

    def holds(self, s: States) -> Booleans:
        """Return which slips and contacts may bear a force at rest, (n, k).

        One that a contact keeps at rest bears none without a limit of its friction.
        """
        count, found = self.r.rubbing.count, self.r.locked(s.signs)
        beside = found[:, :count] & (s.signs[:, count : 2 * count] == 0)
        rows = np.flatnonzero(beside.any(axis=1))
        if len(rows):
            decisive = self.kernel.batch("sticking", lambda: self.kernel.sticking, ())
            at = (s.t[rows, None], s.x[rows], s.v[rows], s.signs[rows])
            _, _, held, low, high, _ = decisive(*at)
            least = LEAST * np.abs(held).max(initial=0.0)
            idle = (high - low)[:, :count] <= least
            found[rows, :count] &= ~(beside[rows] & idle)
        return found

    def loads(self, s: States) -> float:
        """Return the largest load on a body over the states, times a length of the mechanism."""
        sizes = self.r.acting_sizes(self.setup.length)
        applied = self.many("loads", lambda: ([self.r.acting], []))
        found = np.abs(applied(s.t[:, None], s.x, s.v, s.signs)[0]) * sizes
        return float(np.max(found, initial=0.0, where=np.isfinite(found)))

    # -- reactions -------------------------------------------------------------------------

    def reactions(self, s: States, lam: Floats) -> dict[str, Reactions]:
        """Return force and moment about the second body's point, on the second body, by joint.

        (n, 3), in space (n, 6); friction of the joint is in them. Beside contacts whose forces are
        not known there are none.
        """
        joints, width = list(self.model.mechanism.joints), self.model.space.freedoms
        if not set(self.model.mesh_names) <= self.r.rubbing.meshes.keys():
            return {name: np.full((len(s.t), width), np.nan) for name in joints}
        r, k = self.r, self.kernel

        def build() -> tuple[list[Any], list[Any]]:
            a, every = SX.sym("a", r.x.numel()), SX.sym("lam", len(r.rows))
            inner = SX.sym("inner", k.inner)
            _, held, sizes = ca.vertsplit(inner, [0, k.m, k.m + k.slips, k.inner])
            return [reactions_of(r, joints, a, every, held, sizes)], [a, every, inner]

        states = (s.t[:, None], s.x, s.v, s.signs, s.a, lam, self._inner(s))
        flat = self.many("reactions", build)(*states)[0].reshape(len(s.t), -1, width)
        return {name: flat[:, i] for i, name in enumerate(joints)}

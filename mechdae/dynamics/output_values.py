"""What a motion or an equilibrium reports of bodies, points, joints and named outputs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import RATES, Selection, coordinate, selection, split_rate
from mechdae.describe.expression import build, names_in
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import COMPONENTS, TIME, force_of, forces_of
from mechdae.dynamics.equations import MotionProblem
from mechdae.equations.forces.loads import Loads
from mechdae.equations.model import FUNCTIONS, Model
from mechdae.errors import InputError, MechdaeError
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.motion.setup.named_outputs import NamedOutputs, requests
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass
from mechdae.results import Named, Series
from mechdae.types import Floats, Reactions, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.tree.joint_chains import WayProducts
    from mechdae.results.series import LazyPart

SX = ca.SX


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
        more: Mapping[str, Mapping[str, Floats]] | None = None,
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

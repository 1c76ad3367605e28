"""What a motion or an equilibrium reports of bodies, points, joints and named outputs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import RATES, Selection, coordinate, selection, split_rate
from mechdae.describe.expression import build, names_in
from mechdae.describe.named import COMPONENTS, TIME, reactions_of
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


class WithReactions:
    """Named outputs that use reactions, at states."""

    def __init__(self, model: Model, loads: Loads, names: Iterable[str]) -> None:
        mechanism = model.mechanism
        self.names = list(names)
        self.joints = list(mechanism.joints)
        words = COMPONENTS[mechanism.dimension]
        forces = SX.sym("reactions", len(words) * len(self.joints))
        known = {
            f"{joint}.reaction.{word}": forces[len(words) * k + i]
            for k, joint in enumerate(self.joints)
            for i, word in enumerate(words)
        }
        rows = []
        for name in self.names:
            try:
                rows.append(over_states(model, loads, mechanism.outputs[name], known, (name,)))
            except (ArithmeticError, TypeError, NotImplementedError) as problem:
                raise InputError(f"has no value: {problem}", where=f"outputs.{name}") from None
            except MechdaeError as problem:
                raise problem.inside(f"outputs.{name}") from None
        inputs = [model.q, model.velocity, model.acceleration, loads.time, forces, model.p]
        function = ca.Function("outputs", inputs, [ca.vertcat(*rows)])
        self._batch = Batch(function, [5])
        self.function = function

    def __call__(
        self, q: Unknowns, v: Floats, a: Floats, t: Floats, forces: Mapping[str, Floats], p: Floats
    ) -> Floats:
        """Return the values (n, names)."""
        flat = np.hstack([forces[joint] for joint in self.joints])
        return self._batch(q, v, a, t[:, None], flat, p)[0]


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


class Reported:
    """Bodies, points, joints and named outputs at states."""

    def __init__(self, setup: MotionProblem, asked: tuple[str, ...] | None, moves: bool) -> None:
        self.setup, self.moves, self._key = setup, moves, (asked, moves)
        mechanism = setup.problem.mechanism
        chosen = selection(mechanism, asked, forces=True)
        self.chosen = setup.model.reported(chosen, asked is not None)
        named = self.chosen.named
        self.forced = [name for name in named if moves and reactions_of(mechanism, name)]
        plain = [name for name in named if name not in self.forced]
        whole: Any = Whole(setup.model, self.chosen)

        def build() -> tuple[Outputs, NamedOutputs]:
            expressions = NamedOutputs(setup.model, plain, 2, asked is not None, moves)
            return Outputs(whole, requests(setup.model, list(expressions.rates))), expressions

        outputs, expressions = setup.cache(("reported", *self._key), build)
        self._outputs: Outputs = outputs.at(whole)
        self._expressions: NamedOutputs = expressions.at(setup.model)
        self.notes: list[str] = []

    def evaluate(
        self, coordinates: tuple[Floats, Floats, Floats], t: Floats | None, there: Any
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Return the tables and the series of the outputs without reactions.

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
    ) -> dict[str, dict[str, Floats]]:
        """Return the series of the outputs that use reactions."""
        if not self.forced:
            return {}
        setup = self.setup
        function: WithReactions = setup.cache(
            ("forced", *self._key), lambda: WithReactions(setup.model, setup.loads, self.forced)
        )
        values = function(*coordinates, t, reactions, setup.model.p_values)
        return {name: {"value": values[:, k]} for k, name in enumerate(self.forced)}

    def with_reactions(self, joints: Named, reactions: Mapping[str, Floats | LazyPart]) -> Named:
        found = {}
        for joint in self.chosen.joints:
            series: dict[str, object] = dict(joints.get(joint, {}))
            if joint in reactions:
                series["reaction"] = reactions[joint]
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

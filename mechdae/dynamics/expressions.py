"""Expressions over states of a motion: events, outputs that use reactions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import RATES, coordinate, split_rate
from mechdae.describe.expression import build, names_in
from mechdae.describe.named import COMPONENTS, TIME
from mechdae.equations.forces.loads import Loads
from mechdae.equations.model import FUNCTIONS, Model
from mechdae.errors import InputError, MechdaeError
from mechdae.kernels.run.functions import Batch
from mechdae.types import Floats, Sym, Unknowns

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

"""The parameter vector with some of its entries replaced, and what depends on them following."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from mechdae.describe.expression import build, names_in
from mechdae.equations.model import FUNCTIONS, Model
from mechdae.errors import UnknownName
from mechdae.types import Sym

SX = ca.SX


def parameters_of(
    model: Model, names: Sequence[str], values: Sym, numbers: Sym | None = None
) -> Sym:
    """Return p (np,) with some entries replaced by `values` (SX).

    The others are those of the model, or `numbers` (SX).

    Raises
    ------
    UnknownName
        A name that is no entry of p.
    """
    changed = dict(zip(names, ca.vertsplit(values), strict=True)) if len(names) else {}
    others = model.p_values.tolist() if numbers is None else ca.vertsplit(numbers)
    known = dict(zip(model.p_names, others, strict=True))
    for name in changed:
        if name not in known:
            raise UnknownName("parameter", name, known)
    numbers = model.mechanism.parameters
    done: dict[str, Sym] = {}

    def value(name: str) -> Sym:
        if name not in done:
            number = numbers.get(name)
            if name in changed:
                done[name] = changed[name]
            elif isinstance(number, str):
                inner = {other: value(other) for other in names_in(number)}
                done[name] = SX(build(number, inner, FUNCTIONS))
            else:
                done[name] = SX(known[name])
        return done[name]

    return ca.vertcat(*[value(name) for name in model.p_names])

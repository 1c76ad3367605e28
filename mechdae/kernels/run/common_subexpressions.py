"""Functions in which an expression that occurs several times is computed once.

casadi's ``cse`` takes two symbols of one name for the same symbol, and then the numbers are wrong
without a word (seen in casadi 3.7). So inputs with names that are not all different get new ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from mechdae.types import Graph, Sym


def without_repeats(name: str, inputs: Sequence[Sym], results: Sequence[Sym]) -> Graph:
    """Return the casadi function of `inputs` that gives `results`, nothing computed twice."""
    own: list[Sym] = list(inputs)
    if isinstance(next(iter(own), None), ca.SX):
        names = [symbol.name() for part in own for symbol in part.nonzeros()]
        if len(set(names)) < len(names):
            plain = ca.Function(name, own, list(results))
            own = [ca.SX.sym(f"i{k}", part.sparsity()) for k, part in enumerate(own)]
            results = plain.call(own)
    return ca.Function(name, own, list(results), {"cse": True})

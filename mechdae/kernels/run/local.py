"""Functions of the few entries of x, u and p that an expression holds.

A call costs what the expression costs, however large the scene around it is.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any

import casadi as ca

from mechdae.equations.reduction import Scene
from mechdae.kernels.run.call import Call
from mechdae.types import Floats, Sym, Unknowns


class Local:
    """A dense expression over (x, u, p) of a scene as a function of one pose."""

    def __init__(self, scene: Scene, expression: Sym) -> None:
        self.held = scene.held(expression)
        vectors = (scene.x, scene.u, scene.model.p)
        inputs = [v[i] if i else ca.SX(0, 1) for v, i in zip(vectors, self.held, strict=True)]
        self.function = ca.Function("local", inputs, [ca.densify(expression)])
        self._call, self._shape = Call(self.function), self.function.size_out(0)

    def __call__(self, x: Unknowns, u: Floats, p: Floats) -> Floats:
        """Return the value as an array of the expression's shape."""
        vectors = (x, u, p)
        value = self._call(*[v[i] for v, i in zip(vectors, self.held, strict=True)])[0]
        return value.reshape(self._shape)


def local(scene: Scene, key: Hashable, make: Callable[[], Any]) -> Local:
    """Return the function of the expression over q that `make` gives; made once for a scene."""
    made: Local = scene.cache(("local", key), lambda: Local(scene, scene.expression(make())))
    return made

"""Functions of the few entries of x, u and p that an expression holds.

A call costs what the expression costs, however large the scene around it is.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.model.reduction import Scene


class Local:
    """A dense expression over (x, u, p) of a scene as a function of one pose."""

    def __init__(self, scene: Scene, expression: Any) -> None:
        self.held = scene.held(expression)
        vectors = (scene.x, scene.u, scene.model.p)
        inputs = [v[i] if i else ca.SX(0, 1) for v, i in zip(vectors, self.held, strict=True)]
        self.function = ca.Function("local", inputs, [ca.densify(expression)])

    def __call__(self, x: Any, u: Any, p: Any) -> Any:
        """Return the value as an array of the expression's shape."""
        vectors = (x, u, p)
        return np.array(self.function(*[v[i] for v, i in zip(vectors, self.held, strict=True)]))

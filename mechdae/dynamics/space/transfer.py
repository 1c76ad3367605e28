"""Poses of one model of a spatial mechanism as those of another one, whose tree may be another."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.coordinates import QUATERNION, Coordinates
from mechdae.kernels.run.functions import Call
from mechdae.motion.setup.angular_rates import quaternions
from mechdae.types import Floats, Unknowns

SX = ca.SX


class Transfer:
    """From the coordinates of a model to those of another one of the same mechanism."""

    def __init__(self, source: Any, target: Any) -> None:
        self.source, self.target = source, target

    @cached_property
    def _function(self) -> Call:
        from mechdae.equations.tree.reading import placements, reading

        source, target = self.source, self.target
        bodies = [edge.child for edge in source.edges]
        values, turns = reading(target, bodies, placements(source))
        inputs, results = [source.q, source.p, target.p], [values, turns]
        return Call(ca.Function("transfer", inputs, [ca.densify(part) for part in results]))

    def at(self, source: Any, target: Any) -> Transfer:
        """Return the same for copies of the models with other numbers."""
        other, self._function = copy(self), self._function
        other.source, other.target = source, target
        return other

    def __call__(self, q: Unknowns) -> Floats:
        """Return the coordinates (nq,) of the target at a pose (nq,) of the source."""
        found, turns = self._function(q, self.source.p_values, self.target.p_values)
        found = found.copy()
        balls = [key[0] for key in self.target.q_names if key[1] == QUATERNION[0]]
        for k, owner in enumerate(balls):
            matrix = turns[9 * k : 9 * (k + 1)].reshape(3, 3, order="F")
            places = [self.target.places[owner, name] for name in QUATERNION]
            found[places] = quaternions(matrix[None])[0]
        return found


def wound(coordinates: Coordinates, x: Unknowns, near: Mapping[tuple[str, str], float]) -> Floats:
    """Return x with angles moved by whole turns to the values they are said to be near to."""
    x = x.copy()
    for i, c in enumerate(coordinates):
        if c.period and c.key in near:
            x[i] += c.period * np.round((near[c.key] - x[i]) / c.period)
    return x

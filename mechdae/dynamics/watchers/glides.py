"""Slips that glide in several directions: balls, and cylindrical pairs that slide and turn.

Their components rub together: friction acts against the direction of the speed. While such a pair
moves that direction is its own; where it starts it has a *heading*, which is an input like a sign.
All components stick together, held by a force whose size has the limit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.forces.feedback import Slip
from mechdae.equations.structure_cache import StructureCache
from mechdae.kernels.run.functions import Call
from mechdae.types import Floats, Sym

FIRST = 1e-14
"""Speed, over the largest so far, up to which the heading stands for the direction."""
LEAST = 1e-150
TURNS = 60
"""Corrections of a heading."""
SAME = 1e-13


class Glides:
    """The components that belong together, by their places among the slips.

    `weights`: of the squares of the components of a force that holds. ``groups``: places of the
    components of each pair that glides. ``first``: place of a component -> place of the first one
    of its pair.
    """

    def __init__(self, slips: list[Slip], weights: Floats) -> None:
        self.weights = weights
        self.groups: list[list[int]] = [
            list(range(k, k + slip.parts))
            for k, slip in enumerate(slips)
            if slip.parts > 1 and slip.part == 0
        ]
        self.first: dict[int, int] = {k: group[0] for group in self.groups for k in group}

    def group(self, k: int) -> list[int]:
        """Return the places of the slips that stick with one."""
        return next((group for group in self.groups if k in group), [k])

    def spread(self, values: Floats) -> Floats:
        """Return values (..., k) with the length of their vector at all components of a pair."""
        found = np.abs(values)
        for group in self.groups:
            found[..., group] = np.linalg.norm(values[..., group], axis=-1, keepdims=True)
        return found

    def still(self, sides: Floats) -> Any:
        """Return which slips are locked (k,): of pairs that glide those without a heading."""
        found = np.asarray(sides) == 0
        for group in self.groups:
            found[group] = found[group].all()
        return found

    def headings(self, values: Floats) -> Floats:
        """Return values (k,) with the components of pairs divided by their length."""
        found = np.array(values, float)
        for group in self.groups:
            size = float(np.linalg.norm(found[group]))
            found[group] = found[group] / size if size > 0 else 0.0
        return found

    def alone(self, rest: list[int]) -> list[list[int]]:
        """Return the slips at rest, those of a pair that glides together."""
        return [self.group(k) for k in rest if self.first.get(k, k) == k]

    def holding(self, held: Floats, high: Floats, k: int) -> tuple[Floats | float, Floats]:
        """Return the size of the force that holds a pair, and its limit, (n,) each."""
        group = self.group(k)
        squares = self.weights[group] * held[..., group] ** 2
        return np.sqrt(squares.sum(axis=-1)), high[..., group[0]]

    def headed(
        self, sides: Floats, rates: Callable[[Any], Any], free: Floats, held: Floats
    ) -> Floats:
        """Return sides with headings where they are not known yet (nan).

        A pair starts the way it is pulled: rates (k,) of its speeds for these sides are along its
        heading. Friction changes them by as much as `free` ones, without any, are apart from them.

        `rates`: sides -> rates of all slips. `free`, `held`: rates without friction, and the forces
        that hold where all that is not known sticks.
        """
        open_ = [group for group in self.groups if np.isnan(sides[group]).any()]
        if not open_:
            return sides
        found = sides.copy()
        for group in open_:
            found[group] = -held[group] / max(float(np.linalg.norm(held[group])), LEAST)
        for _ in range(TURNS):
            now, worst = rates(found), 0.0
            for group in open_:
                back = float(np.linalg.norm(free[group] - now[group]))
                way = now[group] + back * found[group]
                size = float(np.linalg.norm(way))
                if size == 0 or not np.isfinite(size):
                    continue
                worst = max(worst, float(np.abs(way / size - found[group]).max()))
                found[group] = way / size
            if worst <= SAME:
                break
        return found


def weights_of(slips: list[Slip], p: Sym, values: Floats, kept: StructureCache) -> Floats:
    """Return the weights (k,) of slips for values of the parameters."""
    if all(isinstance(slip.weight, (int, float)) for slip in slips):
        return np.array([slip.weight for slip in slips], float)

    def build() -> Call:
        weights = ca.vertcat(*[ca.SX(slip.weight) for slip in slips])
        return Call(ca.Function("weights", [p], [ca.densify(weights)]))

    return np.ravel(kept("weights", build)(values)[0])

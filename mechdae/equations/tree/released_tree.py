"""The model of a spatial mechanism that moves under forces: its tree, and the mass matrix.

Nothing is driven: joints whose coordinates the task names are edges of the tree where they can be,
and the equations of cut joints are written as they are, so that the force and the moment that a
multiplier stands for are those of its equation.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import casadi as ca

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.forces.generalised import massive
from mechdae.equations.model import Row
from mechdae.equations.structure_cache import structure_property
from mechdae.equations.tree.invariants import Invariants
from mechdae.equations.tree.spins import Edge
from mechdae.equations.tree.tree_model import TreeModel
from mechdae.types import Sym

SX = ca.SX


class ReleasedTree(TreeModel):
    """Symbols and equations of a spatial mechanism without drivers.

    Parameters
    ----------
    mechanism
        The description.
    named
        Joints whose coordinates are given or looked at.
    free
        Names of numbers that must stay symbols even where they are a literal zero.
    """

    def __init__(
        self, mechanism: Mechanism, named: Iterable[str] = (), free: Iterable[str] = ()
    ) -> None:
        self._named = set(named)
        super().__init__(mechanism, (), free)

    def _then(self) -> set[str]:
        return self._named

    def _norms(self, edge: Edge) -> list[Row]:
        return [replace(row, unit="rad") for row in super()._norms(edge)]

    def _invariant(self, joint: Joint) -> Invariants | None:
        return None

    @structure_property
    def mass_matrix(self) -> Sym:
        """Mass matrix (nq, nq): kinetic energy of all bodies is half of v^T M v."""
        entries: dict[tuple[int, int], Sym] = {}
        for name in massive(self):
            for (i, j), value in self._masses(name).items():
                entries[i, j] = entries[i, j] + value if (i, j) in entries else value
        M = SX(self.q.numel(), self.q.numel())
        for (i, j), value in entries.items():
            M[i, j] = M[j, i] = value
        return M

    def _masses(self, name: str) -> dict[tuple[int, int], Sym]:
        """Return the share of a body in the mass matrix, on and below its diagonal."""
        if name in self.idle:
            return self._bar_masses(name)
        mass, J, arm = self.space.solid(self, name)  # type: ignore[attr-defined]
        frame: Any = self.frame(name)
        centre, found = frame.r + arm, {}
        moved: list[tuple[int, Any, Any]] = []
        for screw in self.space.kinetics(self).screws[name]:  # type: ignore[attr-defined]
            turn = None if J is None else frame.R.T @ screw.turn
            moved.append((screw.place, screw.velocity(centre), turn))
        for k, (i, velocity, turn) in enumerate(moved):
            turned = None if turn is None else J @ turn
            for j, other, others in moved[: k + 1]:
                value = mass * ca.dot(velocity, other)
                if turned is not None:
                    value += ca.dot(turned, others)
                if not value.is_zero():
                    found[max(i, j), min(i, j)] = value
        return found

    def _bar_masses(self, name: str) -> dict[tuple[int, int], Any]:
        """Return that of a link that spins freely: a matrix of the velocities of its two ends."""
        bar, kinetics = self.space.bar(self, name), self.space.kinetics(self)  # type: ignore[attr-defined]
        slopes = [
            {s.place: s.velocity(place) for s in kinetics.screws[end.split(".")[0]]}
            for end, place in zip(bar.link.ends, bar.places, strict=True)
        ]
        m11, m12, m22 = bar.matrix()
        zero, found = SX(3, 1), {}
        places = sorted({*slopes[0], *slopes[1]})
        for k, i in enumerate(places):
            for j in places[: k + 1]:
                (a, b), (c, d) = ([slope.get(at, zero) for slope in slopes] for at in (i, j))
                value = m11 * ca.dot(a, c) + m22 * ca.dot(b, d)
                value += m12 * (ca.dot(a, d) + ca.dot(b, c))
                if not value.is_zero():
                    found[i, j] = value
        return found

"""What a tree model says to those who ask for forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.equations.model import Model, Row
from mechdae.equations.tree.row_forces import columns_of
from mechdae.equations.tree.solid import SPACE
from mechdae.types import Sym

if TYPE_CHECKING:
    from mechdae.describe.spinning_links import IdleLink


SX = ca.SX


class TreeForces(Model):
    """The part of a tree model that forces are made of; the tree itself is that of the heir."""

    idle: dict[str, IdleLink]

    def columns_of(self, rows: Sequence[Row]) -> list[dict[Any, Any]]:
        return columns_of(self, rows)

    def gradient(self, coordinate: NamedCoordinate) -> dict[Any, Any]:
        if coordinate.kind == "point":
            unit = SX.eye(3)[:, coordinate.axis]
            place = self.point(f"{coordinate.part}.{coordinate.point}")
            return self.space.push(self, coordinate.part, place, unit)
        return SPACE.along(self, coordinate.part, coordinate.word)

    def mass_center(self, body: str) -> Sym:
        if body not in self.idle:
            return super().mass_center(body)
        bar = SPACE.bar(self, body)
        first, second = bar.mass_shares()
        return bar.places[0] * first + bar.places[1] * second

    def axes_of(self, name: str) -> tuple[Sym, Sym]:
        """Return the frames of a joint's sides in the fixed frame."""
        sides: list[Any] = [self.frame(body) for body in self.mechanism.joints[name].bodies[:2]]
        A1, A2 = (f.side(self._side(name, bool(k))) for k, f in enumerate(sides))
        return A1, A2

    def _side(self, name: str, second: bool) -> Sym:
        """Return the rotation from a side's joint frame to the frame of its body."""
        raise NotImplementedError

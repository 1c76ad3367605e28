"""What a tree model says to those who ask for forces: what minus a unit of each multiplier does.

The rows of a cut joint depend on where its second side lies from the first one: their gradient in a
small shift and turn of the second body is the force and the moment there, and the opposite ones act
on the first body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.equations.model import Model, Row
from mechdae.equations.tree.closures import CutJoint, angles_of, rows_of
from mechdae.equations.tree.solid import SPACE, Wrench, entries, plus
from mechdae.types import Sym

if TYPE_CHECKING:
    from mechdae.describe.spinning_links import IdleLink

SAME = 8
"""Operations down to which expressions are compared."""


def columns_of(model: Any, rows: Sequence[Row]) -> list[Wrench]:
    """Return the columns of rows of a model, of its drivers too."""
    made: dict[str, list[Wrench]] = {}
    result: list[Wrench] = []
    for row in rows:
        if row.driver:
            result.append(model.gradient(coordinate(model.mechanism, row.owner)))
        elif row.part in ("norm", "spin") or model.mechanism.joints[row.owner].meshes:
            result.append(Model.columns_of(model, [row])[0])
        else:
            if row.owner not in made:
                made[row.owner] = _of_joint(model, row.owner)
            result.append(made[row.owner].pop(0))
    return result


def _of_joint(model: Any, name: str) -> list[Wrench]:
    """Return the columns of the rows of a cut joint, or of the length of a bar."""
    for link in model.idle.values():
        if link.joint == name:
            return [_of_bar(model, link.name)]
    joint = model.mechanism.joints[name]
    if joint.pointer:
        return _of_vector(model, name)
    cut: CutJoint = model.cut(name)
    shift, turn = SX.sym("shift", 3), SX.sym("turn", 3)
    A2 = cut.A2 + ca.skew(turn) @ cut.A2
    moved: CutJoint = replace(cut, gap=cut.gap + shift, A2=A2, ways=None)
    rows = [row[1] for row in rows_of(joint.kind, moved)]
    if "angle" in cut.own:
        for word, sine, cosine in angles_of(moved, joint.crossed):
            rows.append(cosine * ca.sin(cut.own[word]) - sine * ca.cos(cut.own[word]))
    axes = model.axes_of(name)[0]
    seen = None if ca.is_equal(ca.densify(cut.A1), ca.densify(axes), SAME) else axes @ cut.A1.T
    step = ca.vertcat(shift, turn)
    slopes = ca.substitute(ca.jacobian(ca.vertcat(*rows), step), step, SX.zeros(6))
    symbols = list(cut.own.items())
    at = ca.vertcat(*[symbol for _, symbol in symbols]) if symbols else SX(0, 1)
    by_own = ca.substitute(ca.jacobian(ca.vertcat(*rows), at), step, SX.zeros(6))
    found, count = [], len(rows) - len(symbols)
    for i in range(len(rows)):
        force, moment = slopes[i, :3].T, slopes[i, 3:].T
        if seen is not None:  # a joint may be seen from a body that moves
            force, moment = seen @ force, seen @ moment
        column = SPACE.between(model, name, force, moment)
        for k, (word, _) in enumerate(symbols):
            entry = by_own[i, k]
            if not entry.is_zero():
                column[model.places[name, word]] = entry
        if i < count:  # the rows after that tell angles: they pass loads on, no reaction
            led = -cut.lead * axes[:, 2] if cut.lead is not None and i == count - 1 else 0
            plus(column, entries((name,), force, moment + led))
        found.append(column)
    return found


def _of_vector(model: Any, name: str) -> list[Wrench]:
    """Return the columns of the three rows of a vector that closes a loop."""
    found, none, slopes = [], SX.zeros(3), model.slopes_of(name)
    for k in range(3):
        force = SX.eye(3)[:, k]
        column = SPACE.between(model, name, force, none)
        for word, slope in slopes.items():
            if not slope[k].is_zero():
                column[model.places[name, word]] = -slope[k]
        found.append(plus(column, entries((name,), force, none)))
    return found


def _of_bar(model: Any, body: str) -> Wrench:
    bar = SPACE.bar(model, body)
    along = (bar.places[1] - bar.places[0]) / model.length(model.idle[body])
    return SPACE.on_bar(model, body, -along, along)


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

"""Which joints are the edges of the tree; which bodies spin freely together, what holds them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import casadi as ca

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.describe.spinning_links import IdleLink, Line, Spin, place_of, share_of
from mechdae.equations.coordinates import QUATERNION, Coordinate
from mechdae.equations.model import Row
from mechdae.errors import UnavailableError
from mechdae.records import dataclass
from mechdae.types import Sym

FREEDOMS = 6


@dataclass(frozen=True)
class Edge:
    """A joint that places a body; ``joint`` is empty for one that is placed in space by itself."""

    joint: str
    parent: str
    child: str
    forward: bool = True


def edges(
    joints: Iterable[Joint],
    groups: Sequence[Collection[str]],
    first: Collection[str] = (),
    then: Collection[str] = (),
    points: Collection[str] = (),
) -> list[Edge]:
    """Return the edges in the order in which they place the bodies.

    In each group of bodies a tree of the largest weight grows from what is placed already (Prim's
    algorithm): the weight of a joint are the equations that it would have if it were cut. Of equal
    ones the nearest to the root is taken: the tree is balanced. Joints of `first` come before all
    others, those of `then` next. A vector places nothing but one of the `points`, which a ball
    joint holds wholly.
    """
    usable = [j for j in joints if j.spatial]
    found: list[Edge] = []
    placed = {GROUND}
    for group in groups:
        depth = dict.fromkeys(placed, 0)
        left = [name for name in group if name not in placed]
        while left:
            best: tuple[tuple[float, int], Edge] | None = None
            for joint in usable:
                for parent, child, forward in (
                    (joint.first_body, joint.second_body, True),
                    (joint.second_body, joint.first_body, False),
                ):
                    if parent not in depth or child not in left:
                        continue
                    if joint.pointer and child not in points:
                        continue
                    held = joint.ball and child in points
                    weight = FREEDOMS if held else _weight(joint, first, then)
                    key = (-weight, depth[parent])
                    if best is None or key < best[0]:
                        best = key, Edge(joint.name, parent, child, forward)
            edge = best[1] if best is not None else Edge("", GROUND, left[0])
            found.append(edge)
            depth[edge.child] = depth[edge.parent] + 1
            left.remove(edge.child)
        placed |= set(group)
    return found


def _weight(joint: Joint, first: Collection[str], then: Collection[str]) -> float:
    if joint.name in first:
        return math.inf
    if joint.name in then:
        return FREEDOMS + 1
    return FREEDOMS - joint.freedoms


SX = ca.SX
TILTS = (0.3, 0.2)
"""Parts across a line of what holds a spin about it."""


class Spinning:
    """What a tree model knows of bodies that spin freely."""

    mechanism: Any
    idle: dict[str, IdleLink]
    edges: list[Edge]
    loose: Sequence[str]
    numbers: dict[str, Sym]
    spins: list[Spin]
    spinning: Any
    _lines: dict[str, Line]
    _of: dict[tuple[str, str], Coordinate]
    _span: Any
    _side: Any

    def _unspun(self) -> list[Row]:
        """Return an equation for each spin: it chooses one, and nothing that is told hangs on it.

        The quaternion e by which the spinning bodies hang on others has no part along a direction
        k that is fixed in them. About their line d it turns by (e0 d + e x d) / 2: where that has
        no part along k the equation would not hold the spin, which is so in one direction of the
        line alone. k leaves the line, lest that direction be in the plane of a motion.
        """
        rows = []
        for spin in self.spins:
            edge, k = self.unspun(spin)
            owner = edge.joint or edge.child
            e = ca.vertcat(*[self._of[owner, name].symbol for name in QUATERNION[1:]])
            rows.append(Row(owner, "spin", ca.dot(e, k), "1"))
            if spin.sleeve:
                rows.append(Row(spin.sleeve, "spin", self._of[spin.sleeve, "angle"].symbol, "rad"))
        return rows

    def unspun(self, spin: Spin) -> tuple[Edge, Sym]:
        """Return by which edge bodies that spin hang on others, and the direction k (3,)."""
        edge = next(
            edge
            for edge in self.edges
            if edge.child in spin.bodies and edge.parent not in spin.bodies
        )
        x, y, z = self._spun_about(edge.child)
        a, b = TILTS
        return edge, ca.vertcat(x + a * y + b * z, y + a * z + b * x, z + a * x + b * y)

    def _spun_about(self, body: str) -> list[Sym]:
        """Return about which direction a body spins, nearly: from one of its joints to another."""
        every = self.mechanism.joints.values()
        joints = [j for j in every if body in j.bodies[:2] and not {*j.bodies} & {*self.loose}]
        ends = [joint.ends_at(body)[0] for joint in joints]
        places = [place_of(self.mechanism, point) for point in ends]
        other = next((i for i, place in enumerate(places) if place != places[0]), None)
        if other is None:
            return [SX(1), SX(0), SX(0)]
        way = ca.vertcat(*self._span(ends[0], ends[other]))
        found: list[Sym] = (way / ca.sqrt(ca.sumsqr(way))).elements()
        return found

    def spun_about(self, body: str) -> Any:
        """Return the direction about which a body spins with others, None of any other."""
        line = self._lines.get(body)
        if line is None or body in self.idle:
            return None
        if len(line) == 1:
            return self._side(line[0], self.mechanism.joints[line[0]].second_body == body)[:, 2]
        way = ca.vertcat(*self._span(*line))
        return way / ca.sqrt(ca.sumsqr(way))

    @property
    def left_out(self) -> Iterable[str]:
        for spin in self.spins:
            one = len(spin.bodies) == 1
            yield (
                f"{' and '.join(spin.bodies)} {'spins' if one else 'spin'} freely about the line "
                f"of {'its' if one else 'their'} ball joints: what turns with "
                f"{'it' if one else 'them'} is left out"
            )

    def has_value(self, joint: str, word: str) -> bool:
        """Return whether a coordinate of a joint has one: not the angle of a free sleeve."""
        return word != "angle" or all(joint != spin.sleeve for spin in self.spins)

    def has_place(self, reference: str) -> bool:
        """Return whether a point has one: of bodies that spin freely, those on their line."""
        body = reference.split(".")[0]
        if body not in self.spinning or any(reference in link.own for link in self.idle.values()):
            return True
        held = any(reference in spin.ends.values() for spin in self.spins)
        return held or share_of(self.mechanism, self._lines, reference) is not None

    def knows(self, coordinate: NamedCoordinate) -> bool:
        if coordinate.kind == "point":
            return self.has_place(f"{coordinate.part}.{coordinate.point}")
        return self.has_value(coordinate.part, coordinate.word)

    def demand(self, coordinate: NamedCoordinate) -> None:
        if self.knows(coordinate):
            return
        if coordinate.kind == "point":
            raise self._beside(f"{coordinate.part}.{coordinate.point}")
        joint = self.mechanism.joints[coordinate.part]
        raise UnavailableError(
            f"{joint.first_body} and {joint.second_body} spin freely about the axis of "
            f"{joint.name}: {coordinate.text} has no value",
            where=f"joints.{joint.name}",
            hint="its slide has one",
        )

    def _beside(self, reference: str) -> UnavailableError:
        body = reference.split(".")[0]
        return UnavailableError(
            f"{body} spins freely about the line of its ball joints: {reference} has no place",
            where=f"bodies.{body}",
            hint="points on that line have one",
        )

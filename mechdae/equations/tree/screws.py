"""How the bodies of a tree of joints move: a screw for each coordinate, twists and their rates.

Along an edge from parent to child the angular velocities of the turning coordinates add up in the
order of their axes, w_c = w_p + sum w_k q_k', and so do their rates with what turns the axes,
a_c = a_p + sum (w_k q_k'' + w_before x w_k q_k').
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.describe.joints.spatial import SpatialJoint
from mechdae.equations.coordinates import QUATERNION
from mechdae.equations.tree.spatial_frames import about_z
from mechdae.equations.tree.spins import Edge
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX
SHIFTS = {"slide": 2, "x": 0, "y": 1}
"""The column of the joint's frame along which a coordinate shifts."""


@dataclass(frozen=True)
class CoordinateScrew:
    """What a coordinate does to all bodies behind it, per unit of its rate.

    ``place`` is its position in q, ``turn`` (3,) the angular velocity, ``shift`` (3,) the velocity
    of the material point at ``centre`` (3,).
    """

    place: int
    turn: Sym
    shift: Sym
    centre: Sym

    def velocity(self, place: Sym) -> Sym:
        """Return the velocity (3,) of the material point at a place."""
        return self.shift + ca.cross(self.turn, place - self.centre)


@dataclass(frozen=True)
class Twist:
    """Motion of a body: ``spin`` and its rate ``turning``, ``velocity`` and ``acceleration`` of
    the anchor, (3,) each.
    """

    spin: Sym
    turning: Sym
    velocity: Sym
    acceleration: Sym

    def velocity_at(self, arm: Sym) -> Sym:
        """Return the velocity of the point that lies by `arm` from the anchor."""
        return self.velocity + ca.cross(self.spin, arm)

    def acceleration_at(self, arm: Sym) -> Sym:
        """Return its acceleration."""
        inwards = ca.cross(self.spin, ca.cross(self.spin, arm))
        return self.acceleration + ca.cross(self.turning, arm) + inwards


REST = Twist(SX.zeros(3), SX.zeros(3), SX.zeros(3), SX.zeros(3))


class Kinetics:
    """Screws and twists of the bodies of a tree model over q, its velocity and acceleration.

    Attributes
    ----------
    path : dict
        Edges from the ground to each body.
    screws : dict
        Screws of the coordinates along that path.
    twists : dict
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        self.path: dict[str, tuple[Edge, ...]] = {"ground": ()}
        self.screws: dict[str, tuple[CoordinateScrew, ...]] = {"ground": ()}
        self.twists: dict[str, Twist] = {"ground": REST}
        for edge in model.edges:
            screws, twist = self._of(edge)
            self.path[edge.child] = (*self.path[edge.parent], edge)
            self.screws[edge.child] = (*self._carried(edge), *screws)
            self.twists[edge.child] = twist

    def _carried(self, edge: Edge) -> tuple[CoordinateScrew, ...]:
        """Return the screws of the parent; a point moves with the place it hangs on, unturned."""
        screws, model = self.screws[edge.parent], self.model
        if edge.child not in model.points:
            return screws
        place = model.point(self._near(edge))
        return tuple(CoordinateScrew(s.place, SX(3, 1), s.velocity(place), place) for s in screws)

    def _near(self, edge: Edge) -> str:
        """Return the point of the parent at the joint of an edge."""
        joint = self.model.mechanism.joints[edge.joint]
        return joint.first if edge.forward else joint.second  # type: ignore[no-any-return]

    def _of(self, edge: Edge) -> tuple[list[CoordinateScrew], Twist]:
        if not edge.joint:
            return self._alone(edge)
        return self._pointed(edge) if edge.child in self.model.points else self._along(edge)

    def _pointed(self, edge: Edge) -> tuple[list[CoordinateScrew], Twist]:
        """Return the screws of a vector's coordinates and the twist of the point at its end."""
        model, above, near = self.model, self.twists[edge.parent], self._near(edge)
        screws: list[CoordinateScrew] = []
        arm = SX(3, 1)
        if edge.parent in model.mechanism.bodies:
            arm = model.frame(edge.parent).direction(model.local(near))
        v, a, zero = above.velocity_at(arm), above.acceleration_at(arm), SX.zeros(3)
        if not model.mechanism.joints[edge.joint].pointer:
            return screws, Twist(zero, zero, v, a)
        centre, slopes = model.frame(edge.child).r, model.slopes_of(edge.joint)
        places = [model.places[edge.joint, word] for word in slopes]
        q, rates = model.q[places], model.velocity[places]
        for j, slope in zip(places, slopes.values(), strict=True):
            way = slope if edge.forward else -slope
            screws.append(CoordinateScrew(j, SX(3, 1), way, centre))
            v += way * model.velocity[j]
            a += way * model.acceleration[j] + ca.jtimes(way, q, rates) * model.velocity[j]
        return screws, Twist(zero, zero, v, a)

    def _place(self, owner: str, name: str) -> int | None:
        return self.model.places.get((owner, name))  # type: ignore[no-any-return]

    def _rates(self, places: list[int]) -> tuple[Sym, Sym]:
        return self.model.velocity[places], self.model.acceleration[places]

    def _alone(self, edge: Edge) -> tuple[list[CoordinateScrew], Twist]:
        """Return the screws and the twist of a body that is placed in space by itself."""
        r = self.model.frame(edge.child).r
        shifts = [self.model.places[edge.child, name] for name in "xyz"]
        zero = SX(3, 1)
        screws = [CoordinateScrew(j, zero, SX.eye(3)[:, k], r) for k, j in enumerate(shifts)]
        balls, spin, turning = self._ball(edge.child, SX.eye(3), r)
        v, a = self._rates(shifts)
        return [*screws, *balls], Twist(spin, turning, v, a)

    def _ball(self, owner: str, A: Sym, centre: Sym) -> tuple[list[CoordinateScrew], Sym, Sym]:
        """Return screws of a quaternion, angular velocity and its rate, in axes A; w = 2 G e'."""
        places = [self.model.places[owner, name] for name in QUATERNION]
        e, (v, a) = self.model.q[places], self._rates(places)
        w, (x, y, z) = e[0], ca.vertsplit(e[1:])
        G = (
            2
            * A
            @ ca.vertcat(
                ca.horzcat(-x, w, -z, y), ca.horzcat(-y, z, w, -x), ca.horzcat(-z, -y, x, w)
            )
        )
        screws = [CoordinateScrew(j, G[:, k], SX(3, 1), centre) for k, j in enumerate(places)]
        return screws, G @ v, G @ a

    def _along(self, edge: Edge) -> tuple[list[CoordinateScrew], Twist]:
        """Return the screws of an edge's coordinates, and the twist of its child."""
        model, side = self.model, 1.0 if edge.forward else -1.0
        joint = model.mechanism.joints[edge.joint]
        parent, child = model.frame(edge.parent), model.frame(edge.child)
        near = joint.first if edge.forward else joint.second
        fixed = parent.side(model._side(edge.joint, not edge.forward))
        own_side = child.side(model._side(edge.joint, edge.forward))
        shifting = fixed if edge.forward else own_side
        arm_near = parent.direction(model.local(near))
        pivot = child.r if edge.forward else parent.r + arm_near
        turns, shifts = self._coordinates(edge, joint, fixed, own_side, shifting)
        above = self.twists[edge.parent]
        spin, turning, screws = above.spin, above.turning, []
        if joint.ball:
            balls, relative, rate = self._ball(edge.joint, side * shifting, pivot)
            screws += balls
            turning = turning + rate + ca.cross(spin, relative)
            spin = spin + relative
        for j, axis in turns:
            v, a = self._rates([j])
            turning = turning + axis * a + ca.cross(spin, axis * v)
            spin = spin + axis * v
        going, speeding, by_place = SX.zeros(3), SX.zeros(3), dict(turns)
        for j, along in shifts:
            v, a = self._rates([j])
            going, speeding = going + along * v, speeding + along * a
        for j in dict.fromkeys([*by_place, *dict(shifts)]):
            zero = SX(3, 1)
            screws.append(
                CoordinateScrew(j, by_place.get(j, zero), dict(shifts).get(j, zero), pivot)
            )
        slid = self._slid(edge, joint, shifting) * side
        carried = above.spin if edge.forward else spin
        whole = Twist(carried, above.turning if edge.forward else turning, going, speeding)
        velocity = above.velocity_at(arm_near) + whole.velocity_at(slid)
        acceleration = above.acceleration_at(arm_near) + whole.acceleration_at(slid)
        acceleration += 2 * ca.cross(carried, going)
        return screws, Twist(spin, turning, velocity, acceleration)

    def _slid(self, edge: Edge, joint: SpatialJoint, A: Sym) -> Sym:
        """Return the way by which a joint has slid."""
        t, lead = SX(3, 1), self.model._lead(edge.joint)
        for name, column in SHIFTS.items():
            j = self._place(edge.joint, name)
            if j is not None:
                t[column] = self.model.q[j]
        if lead is not None:
            t[2] = lead * self.model.q[self.model.places[edge.joint, "angle"]]
        return A @ t

    def _coordinates(
        self, edge: Edge, joint: SpatialJoint, fixed: Sym, own_side: Sym, shifting: Sym
    ) -> tuple[list[tuple[int, Sym]], list[tuple[int, Sym]]]:
        """Return axes by place in the order in which they turn, and directions of shifts."""
        side, lead = 1.0 if edge.forward else -1.0, self.model._lead(edge.joint)
        turns: list[tuple[int, Sym]] = []
        angle, second = (self._place(edge.joint, name) for name in ("angle", "angle2"))
        if joint.crossed:
            assert angle is not None
            assert second is not None
            middle = fixed @ about_z(self.model.q[angle]) if edge.forward else fixed
            pins = [(angle, side * shifting[:, 2]), (second, side * middle[:, 0])]
            turns += pins if edge.forward else pins[::-1]
        elif angle is not None:
            turns.append((angle, side * fixed[:, 2]))
        shifts = []
        for name, column in SHIFTS.items():
            j = self._place(edge.joint, name)
            if j is not None:
                shifts.append((j, side * shifting[:, column]))
        if lead is not None and angle is not None:
            shifts.append((angle, side * lead * fixed[:, 2]))
        return turns, shifts

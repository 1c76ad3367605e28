"""Gears, racks and belts as the forces between their wheels.

The row of a gear holds angles only: its multiplier, a torque, gives the right motion and the
right effort, and wrong bearing reactions. Here it becomes the force at the pitch point along
the line of action, or the pull of both strands of a belt. Pitch radii follow from the distance
of the centres and the ratio. Where the two wheels are no real pair of wheels (their centres
coincide, or move apart) the torque is all there is: `Mesh.real` tells.

Source: Litvin and Fuentes, Gear Geometry and Applied Theory, 2004, ch. 11 (line of action);
Artobolevsky, Theory of Mechanisms and Machines, 1988 (belts).
"""

from __future__ import annotations

import casadi as ca

from mechdae.equations.forces.generalised import (
    Wrench,
    add,
    couple,
    couples,
    pair,
    push,
    spin,
    times,
    velocity,
)
from mechdae.equations.joints import Ends
from mechdae.equations.model import Model
from mechdae.equations.space import left
from mechdae.types import Sym

SX = ca.SX


class Mesh:
    """The forces of one gear, rack, belt or pair of friction wheels.

    Attributes
    ----------
    column : dict
        Generalised force of the joint's multiplier, in place of the gradient of its row; None
        for the torque of the row itself.
    tangential : SX
        The tangential force is this times the multiplier [N per unit of the multiplier].
    apart : dict
        Generalised force per unit of the tangential force that pushes the wheels apart.
    steady : dict
        That of the pretension, which does not depend on the multiplier.
    turning, rubbing : SX
        Speed of the first wheel relative to the carrier, and the one that losses go with.
    closing, size : SX
        The speed of the wheels against each other at the pitch point, zero in a real pair, and
        the size of speeds it is compared with. Wheels that keep rolling while they come nearer
        are no pair: what pushes their teeth apart would do work.
    """

    def __init__(self, model: Model, ends: Ends, real: bool) -> None:
        self.model, self.ends, self.real = model, ends, real
        self.joint = joint = ends.joint
        self.first, self.second = joint.first_body, joint.second_body
        self.carrier = getattr(joint, "carrier", None) or "ground"
        self.turning: Sym = spin(model, self.first) - spin(model, self.carrier)
        self.column: Wrench | None = None
        self.apart: Wrench = {}
        self.steady: Wrench = {}
        self.tangential: Sym = SX(1)
        self.rubbing: Sym = self.turning
        self.closing: Sym = SX(0)
        self.size: Sym = SX(0)
        self.holding = None
        self._sense = self._drives = SX(1)
        KINDS[joint.kind](self)

    @property
    def kept_by(self) -> bool:
        """What decides its equations beside its joint."""
        return self.column is not None

    def number(self, entry: str) -> Sym:
        return self.ends.number(entry)

    def _teeth(self, along: Sym, place: Sym, away: Sym) -> None:
        """Set the forces of teeth at a pitch point.

        `along` is the common tangent, `away` the direction on the second body in which the teeth
        push it.
        """
        tangent = ca.tan(self.number("pressure_angle"))
        self._rolls(place)
        self._drives = self._sense
        if self.real:
            force = pair(self.model, self.first, self.second, place, along)
            self.column = times(self.tangential, force)
            self.apart = pair(self.model, self.first, self.second, place, tangent * away)
            self.rubbing = spin(self.model, self.second) - spin(self.model, self.first)
            if self.ends.joint.wheels == 2:  # w2 - w1 = (w1 - wc) (1 - ratio) / ratio
                ratio = self.number("ratio")
                self._drives = self._sense * ca.sign((1 - ratio) / ratio)
            else:  # -(w1 - wc)
                self._drives = -self._sense

    def gear(self) -> None:
        """Pitch point P = O1 + (O2 - O1) / (1 - ratio)."""
        ratio, gap = self.number("ratio"), self.ends.gap
        distance = ca.sqrt(ca.sumsqr(gap))
        centres = gap / distance
        first = distance / (1 - ratio)
        self.tangential = 1 / first if self.real else SX(1)
        self._radii = (ca.fabs(first), ca.fabs(ratio * first))
        self._inside, self._sense = ca.sign(ratio), ca.sign(first) if self.real else SX(1)
        self._teeth(left(centres), self.ends.p1 + first * centres, -ca.sign(ratio) * centres)
        if not self.real:
            self.tangential = SX(1)

    def rack(self) -> None:
        """Pitch point P = O1 - radius n, n the left normal of the rack."""
        a, radius = self.number("axis"), self.number("radius")
        axis = self.ends.second.direction(ca.vertcat(ca.cos(a), ca.sin(a)))
        normal = left(axis)
        self._radii = (ca.fabs(radius), SX.inf())
        self._inside, self._sense = SX(-1), ca.sign(radius)
        self._teeth(axis, self.ends.p1 - radius * normal, -ca.sign(radius) * normal)

    def belt(self) -> None:
        """Two strands; their pull differs by the multiplier over the first wheel's radius."""
        numbers, name = self.model.numbers, self.ends.joint.name
        if f"{name}.radius" not in numbers:
            return
        r1 = numbers[f"{name}.radius"]
        r2 = r1 * self.number("ratio")
        other = self.ends.joint.sense * r2
        gap = self.ends.gap
        distance = ca.sqrt(ca.sumsqr(gap))
        centres = gap / distance
        sine = (r1 - other) / distance
        cosine = ca.sqrt(1 - sine * sine)
        apart = velocity(self.model, self.second, self.ends.p2)
        apart -= velocity(self.model, self.first, self.ends.p1)
        self.closing = ca.dot(centres, apart)
        self.size = ca.fabs(self.turning) * r1 + ca.sqrt(ca.sumsqr(apart))
        if not self.real:
            return
        strands = []
        for side in (1, -1):
            normal = sine * centres + side * cosine * left(centres)
            along = cosine * centres - side * sine * left(centres)
            on_first = push(self.model, self.first, self.ends.p1 + r1 * normal, along)
            on_second = push(self.model, self.second, self.ends.p2 + other * normal, -along)
            strands.append(add(on_first, on_second))
        both, difference = add(*strands), add(strands[0], times(-1, strands[1]))
        # the generalised force of the multiplier is -column
        self.tangential = 1 / r1
        self.column = times(1 / (2 * r1), difference)
        if f"{name}.pretension" in numbers:
            self.steady = times(numbers[f"{name}.pretension"], both)
        else:
            self.apart = times(0.5, both)

    def friction_wheel(self) -> None:
        """Contact P = O1 +- r1 (O2 - O1) / |O2 - O1|, where the wheels have one speed."""
        first, second = self.number("radius"), self.number("second_radius")
        gap, sense = self.ends.gap, self.ends.joint.sense
        centres = gap / ca.sqrt(ca.sumsqr(gap))
        side = ca.sign(first - second) if sense > 0 else SX(1)
        place = self.ends.p1 + side * first * centres
        self._rolls(place)
        if not self.real:
            return
        force = pair(self.model, self.first, self.second, place, left(centres))
        self.tangential, self.column = side, times(side, force)
        if self.ends.joint.loaded:
            press = -sense * self.number("press") * centres
            self.steady = pair(self.model, self.first, self.second, place, press)

    def _rolls(self, place: Sym) -> None:
        """Set the speed of the wheels against each other where they touch, and its size."""
        gap = velocity(self.model, self.second, place) - velocity(self.model, self.first, place)
        self.closing = ca.sqrt(ca.sumsqr(gap))
        arm = ca.sqrt(ca.sumsqr(place - self.ends.p1))
        self.size = ca.fabs(self.turning) * arm + ca.sqrt(
            ca.sumsqr(velocity(self.model, self.second, place))
        )

    def lost(self, loss: Sym, side: int, sign: Sym) -> tuple[Sym, Wrench]:
        """Return arm and generalised force of the loss per unit of tangential force.

        `side` is the sign of the multiplier, `sign` that of the rubbing speed: they tell which
        wheel drives, and so which power the share is of.
        """
        driven_by_second = side * sign * self._drives  # +1: the second wheel drives, -1: the first
        if self.real and not self.ends.joint.strands:
            r1, r2 = self._radii
            inside = self._inside  # -1 external, +1 internal
            ring_is_second = ca.if_else(r2 > r1, 1, -1)
            ring_drives = ring_is_second * driven_by_second > 0
            outer = ca.if_else(inside > 0, ca.if_else(ring_drives, -1, 1), 1)
            drive = ca.if_else(driven_by_second > 0, 1 / r2, 1 / r1)
            arm = loss / (ca.fabs(1 / r1 - inside / r2) - outer * loss * drive)
            return arm, couples(self.model, self.first, self.second, -sign * arm)
        share = ca.if_else(driven_by_second > 0, loss, loss / (1 - loss))
        per = 1 / self.tangential
        drag = couple(self.model, self.first, -sign * share * per)
        back = couple(self.model, self.carrier, sign * share * per)
        return share * per, add(drag, back)


KINDS = {
    "gear": Mesh.gear,
    "rack": Mesh.rack,
    "belt": Mesh.belt,
    "friction-wheel": Mesh.friction_wheel,
}

"""Forces whose size follows from the reactions of their own joint, one function per kind.

Each is a `Feedback`: a generalised force ``column`` times a size m, the largest of some
linear forms of the joint's multipliers, or the length of their vector. Coulomb friction is of
this kind, and so is the force that pushes the teeth of a gear apart, which does no work.

Laws: Artobolevsky, Theory of Mechanisms and Machines, 1988, ch. 11 (friction circle, friction
in a guide that tilts); sliding pins after the same book.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import casadi as ca

from mechdae.equations.forces.feedback import Feedback, Slip, Unilateral
from mechdae.equations.forces.generalised import MeshForces, Wrench, couples, pair, spin, velocity
from mechdae.equations.forces.spatial_friction import spatial_law
from mechdae.equations.joints import Ends
from mechdae.equations.model import Model
from mechdae.equations.space import left
from mechdae.types import Sym

SX = ca.SX


class Laws:
    """The feedbacks of a mechanism's joints.

    Parameters
    ----------
    model
        Symbols.
    meshes
        Gears, racks and belts whose forces act at a pitch point, by joint.
    radius
        "exact" friction circle r sin(atan f), or r f as "article" 003 has it.
    friction
        Whether there is any.
    adhesion
        Whether coefficients at rest count: `Slip.resting` chooses them.

    Attributes
    ----------
    factor : SX
        Multiplies all coefficients of friction.
    slips : list of Slip
    """

    def __init__(
        self,
        model: Model,
        meshes: Mapping[str, MeshForces],
        radius: str = "exact",
        friction: bool = True,
        adhesion: bool = False,
    ) -> None:
        self.adhesion = adhesion
        self.model: Model = model
        self.meshes: Mapping[str, MeshForces] = meshes
        self.radius: str = radius
        self.friction: bool = friction
        self.factor: Sym = SX.sym("factor")
        self.slips: list[Slip] = []
        self.assumptions: list[str] = []

    def of(self, name: str) -> list[Feedback]:
        """Return the feedbacks of a joint."""
        if name in self.meshes:
            return self._mesh(name, self.meshes[name])
        if self.model.space.behind:
            return spatial_law(self, name) if self.friction and self._rubs(name) else []
        law = LAWS.get(self.model.mechanism.joints[name].kind)
        if self.friction and law is not None and self._rubs(name):
            return law(self, self.model.ends[name])
        return []

    def of_contact(self, k: int, contact: Unilateral) -> list[Feedback]:
        """Return the friction of a unilateral contact, by its place among them."""
        if contact.axis is None or not self.friction or not self._rubs(contact.owner):
            return []
        ends = self.model.ends[contact.owner]
        forms = ca.vertcat(SX(-1), SX(0))  # the force that holds it is minus its own
        return [replace(self._along(ends, forms, contact.axis, contact.place), contact=k)]

    def _given(self, name: str, entry: str) -> bool:
        number = self.model.numbers.get(f"{name}.{entry}")
        return number is not None and not (number.is_constant() and float(number) == 0)

    def _rubs(self, name: str) -> bool:
        adheres = self.adhesion and self._given(name, "friction_static")
        return adheres or self._given(name, "friction")

    def _slip(
        self, name: str, speed: Sym, unit: str, column: Wrench | None = None, **more: Sym
    ) -> Slip:
        resting = SX.sym(f"resting_{name}_{len(self.slips)}") if self.adhesion else None
        sign = SX.sym(f"sign_{name}_{len(self.slips)}")
        slip = Slip(name, speed, unit, sign, resting=resting, column=column, **more)
        self.slips.append(slip)
        return slip

    def _friction(self, slip: Slip) -> Sym:
        name = slip.owner
        sliding = self.model.numbers.get(f"{name}.friction", SX(0))
        if self.adhesion and self._given(name, "friction_static"):
            sliding += slip.resting * (self.model.numbers[f"{name}.friction_static"] - sliding)
        return self.factor * sliding

    # -- pairs -----------------------------------------------------------------------------

    def revolute(self, ends: Ends) -> list[Feedback]:
        """M = rho |R|, with the radius rho of the friction circle."""
        name, joint = ends.joint.name, ends.joint
        turning = spin(self.model, joint.second_body) - spin(self.model, joint.first_body)
        slip = self._slip(name, turning, "rad")
        f, r = self._friction(slip), self.model.numbers[f"{name}.pin_radius"]
        rho = r * f if self.radius == "article" else r * f / ca.sqrt(1 + f * f)
        column = couples(self.model, joint.first_body, joint.second_body, -slip.sign * rho)
        rate = rho * ca.fabs(turning)
        return [Feedback(name, "length", SX.eye(2), column, rate, strength=rho, slip=slip)]

    def prismatic(self, ends: Ends) -> list[Feedback]:
        """F = f |N|, or f (|N1| + |N2|) = f max(|N|, |M| / b) in a guide of length 2 b."""
        name = ends.joint.name
        forms = ca.horzcat(1, 0)
        length = self.model.numbers.get(f"{name}.contact_length")
        if length is not None and self._given(name, "contact_length"):
            forms = ca.vertcat(forms, ca.horzcat(0, 2 / length))
        else:
            self.assumptions.append(
                f"joint {name}: a long guide, friction of its moment is left out "
                f"(contact_length would count it)"
            )
        forms = ca.vertcat(forms, -forms)
        return [self._along(ends, forms, ends.axis(), ends.p2)]

    def _along(self, ends: Ends, forms: Sym, axis: Sym, place: Sym) -> Feedback:
        """Return friction along an axis at a place, of the size of the largest form."""
        joint, speed = ends.joint, sliding_speed(self.model, ends, axis, place)
        slip = self._slip(joint.name, speed, "m")
        f = self._friction(slip)
        force = pair(self.model, joint.first_body, joint.second_body, place, -slip.sign * f * axis)
        rate = f * ca.fabs(speed)
        return Feedback(joint.name, "largest", forms, force, rate, strength=f, slip=slip)

    def pin_in_slot(self, ends: Ends) -> list[Feedback]:
        """F = f |N| at the point of the pin's surface that is pressed against the slot."""
        name = ends.joint.name
        if not self._given(name, "pin_radius"):
            return [self._along(ends, ca.vertcat(SX(1), SX(-1)), ends.axis(), ends.p2)]
        r = self.model.numbers.get(f"{name}.pin_radius", SX(0))
        result = []
        for side in (1, -1):  # the multiplier is minus the normal force on the pin
            place = place_on_pin(ends, side, r)
            forms = ca.vertcat(SX(0), SX(-side))
            result.append(self._along(ends, forms, ends.axis(), place))
        return result

    def curve(self, ends: Ends) -> list[Feedback]:
        """F = f |N| along the tangent at the place of contact."""
        forms = normal_form(ends)
        place = place_on_curve(ends)
        return [self._along(ends, ca.vertcat(forms, -forms), tangent_of(ends), place)]

    # -- meshes ----------------------------------------------------------------------------

    def apart(self, name: str) -> list[Feedback]:
        """Return what pushes the wheels of a mesh apart."""
        mesh = self.meshes[name]
        forms = ca.vertcat(mesh.tangential, -mesh.tangential)
        found = [Feedback(name, "largest", forms, mesh.apart, SX(0), friction=False)]
        return found if mesh.apart else []

    def _mesh(self, name: str, mesh: MeshForces) -> list[Feedback]:
        result = self.apart(name)
        if not (self.friction and self._given(name, "mesh_loss")):
            return result
        loss = self.factor * self.model.numbers[f"{name}.mesh_loss"]
        slip = self._slip(name, mesh.rubbing, "rad", mesh.holding)
        for side in (1, -1):
            arm, column = mesh.lost(loss, side, slip.sign)
            rising, falling = (mesh.lost(loss, side, SX(sign))[0] for sign in (1, -1))
            forms = ca.vertcat(SX.zeros(mesh.tangential.shape), side * mesh.tangential)
            rate = arm * ca.fabs(mesh.rubbing)
            result.append(
                Feedback(name, "largest", forms, column, rate, True, rising, falling, slip)
            )
        return result


def sliding_speed(model: Model, ends: Ends, axis: Sym, place: Sym) -> Sym:
    """Return how fast the second body moves against the first along an axis at a place [m/s]."""
    bodies = (ends.joint.second_body, ends.joint.first_body)
    second, first = (velocity(model, body, place) for body in bodies)
    return ca.dot(axis, second - first)


def place_on_pin(ends: Ends, side: int, radius: Sym) -> Sym:
    """Return where a pin is pressed by a slot whose normal force has the sign `side`."""
    return ends.p2 - side * radius * ends.normal()


def place_on_curve(ends: Ends) -> Sym:
    """Return the contact of a point, or of a roller of radius r, on its curve."""
    contact = ends.contact
    assert contact is not None
    if not contact.rolls:
        return ends.p2
    return ends.p2 - ends.number("roller_radius") * ends.first.direction(contact.normal)


def tangent_of(ends: Ends) -> Sym:
    """Return the unit tangent of a curve at its contact, in the fixed frame."""
    contact = ends.contact
    assert contact is not None
    if contact.rolls:
        return ends.first.direction(contact.direction)
    tangent = ends.first.direction(contact.tangent)
    return tangent / ca.sqrt(ca.sumsqr(tangent))


def normal_form(ends: Ends) -> Sym:
    """Return the linear form of a joint's multipliers that is minus its normal force, (1, n).

    The force acts on the second body, + along the left normal of guide, slot or curve.
    """
    if ends.contact is None:
        return ca.horzcat(1, 0) if ends.joint.guide else SX(1)
    normal = left(tangent_of(ends))
    return ca.horzcat(normal[0], normal[1], *([SX(0)] if ends.contact.rolls else []))


LAWS: dict[str, Callable[[Laws, Ends], list[Feedback]]] = {
    "revolute": Laws.revolute,
    "prismatic": Laws.prismatic,
    "pin-in-slot": Laws.pin_in_slot,
    "curve": Laws.curve,
}

"""Forces, velocities and inertia of bodies of a tree of joints.

A force on a body is a generalised force of the coordinates behind which the body lies. Beside
these, {position in q: expression}, it is kept what it does in joints and on bodies:

- (joint, k): minus the force and moment (6 numbers, about the point of the second body, world axes)
  that the joint has to pass on because of it. The sum over all that acts, multipliers of cut
  joints among it, is the joint's reaction: that of a joint of the tree is the sum over its subtree.
- ("on", body, k): force and moment about the anchor, on the body itself.

What drives or loads a coordinate of a joint is no part of its reaction, friction in it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca

from mechdae.equations.space import Space
from mechdae.equations.tree.bars import SpinningBar, tensor
from mechdae.equations.tree.screws import SHIFTS, Kinetics
from mechdae.types import Sym

if TYPE_CHECKING:
    from mechdae.equations.model import Model


SX = ca.SX
Wrench = dict[Any, Any]


def plus(total: Wrench, part: Wrench, factor: float = 1.0) -> Wrench:
    """Return the first generalised force with another one added in place."""
    for key, value in part.items():
        entry = value if factor == 1.0 else factor * value
        total[key] = total[key] + entry if key in total else entry
    return total


def entries(key: tuple[str, ...], force: Sym, moment: Sym) -> Wrench:
    """Return six numbers under (*key, k), zeros left out."""
    parts = [*ca.vertsplit(SX(force)), *ca.vertsplit(SX(moment))]
    return {(*key, k): part for k, part in enumerate(parts) if not part.is_zero()}


def _on(key: tuple[int | str, ...] | int) -> bool:
    """Return whether a key is of what acts on a body itself."""
    return isinstance(key, tuple) and key[0] == "on"


class Solid(Space):
    """The space of a tree model; twists and wrenches have six numbers."""

    @property
    def behind(self) -> bool:
        return True

    def kinetics(self, model: Any) -> Kinetics:
        """Return screws and twists of a model's bodies."""
        made: Kinetics = model.cache("kinetics", lambda: Kinetics(model))
        return made

    def bar(self, model: Any, body: str) -> SpinningBar:
        """Return a link that spins freely between two ball joints as a bar."""
        made: SpinningBar = model.cache(("bar", body), lambda: SpinningBar(model, model.idle[body]))
        return made

    # -- forces ----------------------------------------------------------------------------

    def push(self, model: Any, body: str, place: Sym, force: Sym) -> Wrench:
        if body in model.idle:
            first, second = self.bar(model, body).shares(place)
            return self.on_bar(model, body, first * force, second * force)
        return self.acting(model, body, place, force, SX.zeros(3))

    def couple(self, model: Model, body: str, moment: Sym) -> Wrench:
        return self.acting(model, body, model.frame(body).r, SX.zeros(3), moment)

    def acting(self, model: Any, body: str, place: Sym, force: Sym, moment: Sym) -> Wrench:
        """Return what a force at a place and a moment on a body of the tree do.

        A point takes no moment: it passes on the force alone, a vector to where it begins.
        """
        if body not in model.mechanism.bodies:
            return {}
        kinetics, found = self.kinetics(model), Wrench()
        moment = SX.zeros(3) if body in model.points else moment
        for screw in kinetics.screws[body]:
            work = ca.dot(force, screw.velocity(place)) + ca.dot(moment, screw.turn)
            if not work.is_zero():
                found[screw.place] = work
        at, turning = place, moment
        for edge in reversed(kinetics.path[body]):
            if edge.joint:
                joint = model.mechanism.joints[edge.joint]
                whole = turning + ca.cross(at - model.point(joint.second), force)
                if joint.pointer or edge.parent in model.points:
                    near = joint.first if edge.forward else joint.second
                    at, turning = model.point(near), SX.zeros(3)
                    whole = SX.zeros(3) if joint.pointer else whole
                sign = -1.0 if edge.forward else 1.0
                plus(found, entries((edge.joint,), sign * force, sign * whole))
        return plus(found, self._on_body(model, body, place, force, moment))

    def _on_body(self, model: Any, body: str, place: Sym, force: Sym, moment: Sym) -> Wrench:
        """Return a force at a place and a moment as what acts on a body itself."""
        if body not in model.mechanism.bodies:
            return {}
        whole = moment + ca.cross(place - model.frame(body).r, force)
        whole = SX.zeros(3) if body in model.points else whole
        return entries(("on", body), force, whole)

    def between(self, model: Any, joint: str, force: Sym, moment: Sym) -> Wrench:
        """Return what a force at a joint's second point and a moment do, that act on the second
        body and in the opposite sense on the first: a load, no part of the reaction.
        """
        pair = model.mechanism.joints[joint]
        place = model.point(pair.second)
        back = model.point(pair.first) if pair.pointer else place
        found = self.acting(model, pair.second_body, place, force, moment)
        return plus(found, self.acting(model, pair.first_body, back, force, moment), -1.0)

    def rubbing(self, model: Any, joint: str, force: Sym, moment: Sym) -> Wrench:
        """Return what friction in a joint does: a force at its second point and a moment on the
        second body, and the opposite ones on the first. They are part of its reaction.
        """
        if joint not in model.tree:
            found = self.between(model, joint, force, moment)
            return plus(found, entries((joint,), force, moment))
        pair, found = model.mechanism.joints[joint], Wrench()
        place = model.point(pair.second)
        kinetics = self.kinetics(model)
        forward = kinetics.path[pair.second_body][-1:] and (
            kinetics.path[pair.second_body][-1].joint == joint
        )
        child, parent = pair.bodies[:2][::-1] if forward else pair.bodies[:2]
        for screw in kinetics.screws[child][len(kinetics.screws[parent]) :]:
            work = ca.dot(force, screw.velocity(place)) + ca.dot(moment, screw.turn)
            if not work.is_zero():
                found[screw.place] = work if forward else -work
        return found

    def holding(self, model: Any, joint: str, word: str) -> Wrench:
        """Return what a unit of force or moment along a coordinate of a joint does that holds it
        by friction: part of the reaction, unlike a load `along` it.
        """
        force, moment = self.conjugate(model, joint, word)
        if joint not in model.tree and (joint, word) not in model.places:
            return self.rubbing(model, joint, force, moment)
        found = {
            key: value for key, value in self.along(model, joint, word).items() if not _on(key)
        }
        return plus(found, entries((joint,), force, moment))

    def on_bar(self, model: Any, body: str, first: Sym, second: Sym) -> Wrench:
        """Return what forces at the two ends of a bar do: its ball joints pass them on."""
        bar, found = self.bar(model, body), Wrench()
        for name, place, force in zip(bar.joints, bar.places, (first, second), strict=True):
            joint = model.mechanism.joints[name]
            other = joint.first_body if joint.second_body == body else joint.second_body
            passed = self.acting(model, other, place, force, SX.zeros(3))
            plus(found, {key: value for key, value in passed.items() if not _on(key)})
            sign = -1.0 if joint.second_body == body else 1.0
            plus(found, entries((name,), sign * force, SX.zeros(3)))
        whole = ca.cross(bar.places[1] - bar.places[0], second)
        return plus(found, entries(("on", body), first + second, whole))

    def along(self, model: Any, joint: str, word: str) -> Wrench:
        """Return what a unit of force or moment along a coordinate of a joint does."""
        force, moment = self.conjugate(model, joint, word)
        column = model.places.get((joint, word))
        lead = model._lead(joint) if word == "slide" and joint in model.tree else None
        if lead is not None:
            column = model.places[joint, "angle"]
        if column is None:
            return self.between(model, joint, force, moment)
        found: Wrench = {column: SX(1) if lead is None else lead}
        ends = model.mechanism.joints[joint]
        if joint in model.tree or ends.pointer:
            plus(found, entries((joint,), -force, -moment))
        place = model.point(ends.second)
        back = model.point(ends.first) if ends.pointer else place
        for body, at, sign in ((ends.second_body, place, 1.0), (ends.first_body, back, -1.0)):
            plus(found, self._on_body(model, body, at, sign * force, sign * moment))
        return found

    def conjugate(self, model: Any, joint: str, word: str) -> tuple[Sym, Sym]:
        """Return force and moment on the second body that do the work of a coordinate."""
        zero = SX.zeros(3)
        if model.mechanism.joints[joint].pointer:
            slope = model.slopes_of(joint)[word]
            return slope / ca.sumsqr(slope), zero
        A1, A2 = model.axes_of(joint)
        if word == "angle":
            return zero, A1[:, 2]
        if word == "angle2":
            return zero, A2[:, 0]
        return A1[:, SHIFTS[word]], zero

    def imbalance(
        self,
        model: Any,
        bodies: Sequence[str],
        parts: Sequence[dict[tuple[int | str, ...] | int, Sym]],
        reactions: Mapping[str, Sym],
    ) -> Sym:
        """Return what is left of the balance of bodies, relative to what acts on them.

        Parameters
        ----------
        parts
            What acts beside the joints.
        reactions
            Force and moment (6,) of each joint on its second body, about its point there.
        """
        shares = [{key: value for key, value in part.items() if _on(key)} for part in parts]
        arms: list[Sym] = []
        for name, reaction in reactions.items():
            joint = model.mechanism.joints[name]
            place = model.point(joint.second)
            back = model.point(joint.first) if joint.pointer else place
            for body, at, sign in (
                (joint.second_body, place, 1.0), (joint.first_body, back, -1.0),
            ):  # fmt: skip
                if body in model.mechanism.bodies:
                    arm = at - self._anchor(model, body)
                    arm = SX.zeros(3) if body in model.points else arm
                    arms.append(ca.norm_1(arm) * ca.norm_1(reaction[:3]))
                    whole = reaction[3:] + ca.cross(arm, reaction[:3])
                    shares.append(entries(("on", body), sign * reaction[:3], sign * whole))
        worst = SX(0)
        for places, least in ((range(3), []), (range(3, 6), arms)):
            keys = [("on", body, k) for body in bodies for k in places]
            sizes = [share[key] for share in shares for key in keys if key in share]
            gaps = [sum((share.get(key, SX(0)) for share in shares), SX(0)) for key in keys]
            size, gap = (_most([SX(v) for v in vector]) for vector in ([*sizes, *least], gaps))
            worst = ca.fmax(worst, ca.if_else(size > 0, gap / size, 0))
        return worst

    def _anchor(self, model: Any, body: str) -> Sym:
        return self.bar(model, body).places[0] if body in model.idle else model.frame(body).r

    def at_origin(self, model: Any, wrench: Wrench, body: str) -> Sym | None:
        keys = [("on", body, k) for k in range(self.freedoms)]
        if not any(key in wrench for key in keys):
            return None
        column = ca.vertcat(*[SX(wrench.get(key, 0.0)) for key in keys])
        if body in model.idle:
            return column
        arm = model.frame(body).r - model.origin(body)
        return ca.vertcat(column[:3], column[3:] + ca.cross(arm, column[:3]))

    def moves(self, model: Any, joint: str) -> Sym:
        """Return how the second body can move at its point, (6, k): no reaction is along that."""
        pair = model.mechanism.joints[joint]
        if pair.ball:
            return ca.vertcat(SX(3, 3), SX.eye(3))
        lead = model._lead(joint)
        if lead is not None:
            axis = model.axes_of(joint)[0][:, 2]
            return ca.vertcat(lead * axis, axis)
        if not pair.spatial:
            return SX(6, 0)
        both = [ca.vertcat(*self.conjugate(model, joint, word)) for word in pair.coordinates]
        both += [ca.vertcat(SX(3, 3), SX.eye(3))] if pair.pointer else []
        return ca.horzcat(*both) if both else SX(6, 0)

    # -- velocities and inertia ---------------------------------------------------------------

    def point_velocity(self, model: Model, body: str, place: Sym) -> Sym:
        twist = self.kinetics(model).twists[body]
        return twist.velocity_at(place - model.frame(body).r)

    def spin(self, model: Model, body: str) -> Sym:
        return self.kinetics(model).twists[body].spin

    def reaction(self, model: Model, name: str, wrench: Wrench) -> list[Sym]:
        """Return the force and the moment of a joint: `wrench` is all that acts."""
        return [wrench.get((name, k), SX(0)) for k in range(self.freedoms)]

    def inertia_force(self, model: Any, name: str) -> Wrench:
        if name in model.idle:
            return self.on_bar(model, name, *self.bar(model, name).inertia())
        mass, J, arm = self.solid(model, name)
        frame, twist = model.frame(name), self.kinetics(model).twists[name]
        force, moment = mass * twist.acceleration_at(arm), SX.zeros(3)
        if J is not None:
            spin, turning = frame.R.T @ twist.spin, frame.R.T @ twist.turning
            moment = frame.R @ (J @ turning + ca.cross(spin, J @ spin))
        return self.acting(model, name, frame.r + arm, force, moment)

    def kinetic_energy(self, model: Any, name: str) -> Sym:
        if name in model.idle:
            return self.bar(model, name).kinetic_energy()
        mass, J, arm = self.solid(model, name)
        twist = self.kinetics(model).twists[name]
        energy = mass * ca.sumsqr(twist.velocity_at(arm)) / 2
        if J is not None:
            spin = model.frame(name).R.T @ twist.spin
            energy += ca.dot(spin, J @ spin) / 2
        return energy

    def solid(self, model: Any, name: str) -> tuple[Sym, Sym | None, Sym]:
        """Return mass, inertia (3, 3) about the centre in body axes or None, arm to the centre."""
        mass = model.numbers.get(f"{name}.mass", SX(0))
        return mass, tensor(model, name), model.frame(name).direction(model.center(name))


def _most(values: list[Sym]) -> Sym:
    result = SX(0)
    for value in values:
        result = ca.fmax(result, ca.fabs(value))
    return result


SPACE = Solid("xyz", ("x", "y", "z", "wx", "wy", "wz"))

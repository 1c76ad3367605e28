"""Friction of pairs in space: two bearing planes, vector sums.

The reaction of a pair is a force F and a moment M about its point. Two planes at +-b along the
axis a carry it, N1 = F/2 - (a x M)/(2b) and N2 = F/2 + (a x M)/(2b) across the axis, and friction
is of the sizes |N1| and |N2|; the axial force rubs at a collar, the moment about the axis of a
guide at its width. Friction circle and guides after Artobolevsky, Theory of Mechanisms and
Machines, 1988, ch. 11. With loads in one plane that is the planar |N1| + |N2| = max(|F|, |M|/b).
Each pin of a universal joint is such a bearing. A screw is a wedge wound about a cylinder, its
square thread is pressed by N along the normal of the helix (ibid., ch. 11). A ball presses where
its load F points, so that it rubs with rho |F| against the part of its spin across F.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import TYPE_CHECKING, Any

import casadi as ca

from mechdae.equations.forces.feedback import ACROSS, Feedback, Slip
from mechdae.equations.forces.generalised import times
from mechdae.types import Sym

if TYPE_CHECKING:
    from mechdae.equations.tree.released_tree import ReleasedTree
    from mechdae.equations.tree.solid import Solid


SX = ca.SX


def spatial_law(laws: Any, name: str) -> list[Feedback]:
    """Return the friction of a joint; none of a pair that has no law."""
    joint = laws.model.mechanism.joints[name]
    if joint.pointer:
        return _vector(laws, name)
    law = LAWS.get(joint.kind)
    return law(_Pair(laws, name)) if law is not None else []


def _vector(laws: Any, name: str) -> list[Feedback]:
    """Return F = f |F across| of a point that slides along a direction."""
    model: Any = laws.model
    (u,) = model.slopes_of(name).values()
    speed = ca.jtimes(model.relative(name, "length"), model.q, model.velocity)
    slip = laws._slip(name, speed, "m", model.space.holding(model, name, "length"))
    f = laws._friction(slip)
    column = model.space.rubbing(model, name, -slip.sign * f * u, SX.zeros(3))
    across = ca.horzcat(SX.eye(3) - u @ u.T, SX(3, 3))
    rate = f * ca.fabs(speed)
    return [Feedback(name, "length", across, column, rate, strength=f, slip=slip)]


class _Pair:
    """A joint with friction: its axes in the fixed frame, its numbers and speeds."""

    def __init__(self, laws: Any, name: str) -> None:
        self.laws, self.name, self.model = laws, name, laws.model
        model: ReleasedTree = laws.model
        A1 = model.axes_of(name)[0]
        self.n, self.m, self.a = (A1[:, k] for k in range(3))

    def number(self, entry: str) -> Sym:
        """Return one of the joint's numbers, None where it is not given."""
        given = self.laws._given(self.name, entry)
        return self.model.numbers[f"{self.name}.{entry}"] if given else None

    def pin(self, second: bool) -> _Pair:
        """Return the pair as one with the axis of its first or second pin."""
        if not second:
            return self
        other = copy(self)
        model: Any = self.model
        A2 = model.axes_of(self.name)[1]
        other.a, other.n, other.m = (A2[:, k] for k in range(3))
        return other

    def speed(self, word: str) -> Sym:
        model: ReleasedTree = self.model
        return ca.jtimes(model.relative(self.name, word), model.q, model.velocity)

    def planes(self) -> list[Sym]:
        """Return the forms (2, 6) of the normal forces in the planes, over force and moment."""
        length = self.number("contact_length")
        n, m, none = self.n.T, self.m.T, SX(1, 3)
        if length is None:
            self.assume("tilting is left out of its friction (contact_length would count it)")
            return [ca.vertcat(ca.horzcat(n, none), ca.horzcat(m, none))]
        self.assume("friction of two bearing planes contact_length apart, the same in both")
        halves = ((1.0, 1 / length), (1.0, -1 / length))
        return [ca.vertcat(ca.horzcat(n / 2, s * m), ca.horzcat(m / 2, -s * n)) for _, s in halves]

    def assume(self, text: str) -> None:
        self.laws.assumptions.append(f"joint {self.name}: {text}")

    def along(
        self, word: str, strengths: list[tuple[str, Sym, Callable[..., Any]]]
    ) -> list[Feedback]:
        """Return friction against a coordinate: sizes by law and forms, each with its strength."""
        speed = self.speed(word)
        unit, space = "m" if word == "slide" else "rad", self.model.space
        slip = self.laws._slip(self.name, speed, unit, space.holding(self.model, self.name, word))
        f, found = self.laws._friction(slip), []
        for law, forms, strength in strengths:
            size = strength(f)
            if SX(size).is_zero():  # a pin without a radius: its normal force causes nothing
                continue
            wrench = -slip.sign * size * self.a
            zero = SX.zeros(3)
            force, moment = (wrench, zero) if word == "slide" else (zero, wrench)
            column = space.rubbing(self.model, self.name, force, moment)
            rate = size * ca.fabs(speed)
            found.append(Feedback(self.name, law, forms, column, rate, strength=size, slip=slip))
        return found

    def gliding(
        self,
        speeds: Sym,
        unit: str,
        columns: list[dict[tuple[int | str, ...] | int, Sym]],
        weights: tuple[Sym, ...],
    ) -> tuple[Slip | None, Any, Any]:
        """Return the slip of a speed with several components, its direction and its size.

        In motions, where a pair sticks and starts, the direction is that of the speed after its
        first moments, and of the slips' signs before. Where ``resting`` of the first slip is 1 the
        speed has one line to change along: its friction does not turn round before the event.
        """
        if not self.laws.adhesion:
            size = ca.sqrt(ca.sumsqr(speeds))
            return None, ca.if_else(size > 0, speeds / size, SX.zeros(speeds.shape)), size
        count = speeds.numel()
        slips = [
            self.laws._slip(
                self.name, speeds[k], unit, columns[k], part=k, parts=count, weight=weights[k]
            )
            for k in range(count)
        ]
        heading = ca.vertcat(*[slip.sign for slip in slips])
        sense = ca.if_else(slips[0].resting > 0, ca.sign(ca.dot(speeds, heading)), 1)
        way = ca.if_else(ca.sumsqr(heading) > 0, sense * speeds + heading, SX.zeros(count))
        size = ca.sqrt(ca.sumsqr(way))
        direction = ca.if_else(size > 0, way / ca.fmax(size, 1e-300), SX.zeros(count))
        return slips[0], direction, ca.sqrt(ca.sumsqr(speeds))

    def both(self, row: Sym) -> Sym:
        """Return a form and its opposite: the largest is its size."""
        return ca.vertcat(row, -row)


def _revolute(pair: _Pair, word: str = "angle") -> list[Feedback]:
    """Return M = rho (|N1| + |N2|) + f r_c |F_a|."""
    collar, circle = pair.number("collar_radius"), _circle(pair, "pin_radius")
    sizes = [("length", plane, circle) for plane in pair.planes()]
    if collar is None:
        pair.assume("an axial force causes no friction (collar_radius would count it)")
    else:
        axial = pair.both(ca.horzcat(pair.a.T, SX(1, 3)))
        sizes.append(("largest", axial, lambda f: f * collar))
    return pair.along(word, sizes)


def _circle(pair: _Pair, entry: str) -> Callable[[Any], Any]:
    """Return the radius of the friction circle by the coefficient."""
    r = pair.number(entry)
    radius = SX(0) if r is None else r
    exact = pair.laws.radius != "article"
    return lambda f: radius * f / ca.sqrt(1 + f * f) if exact else radius * f


def _universal(pair: _Pair) -> list[Feedback]:
    """Return the friction of both pins of the cross, each that of a revolute."""
    pair.assume("both pins of its cross have one radius and one contact_length")
    return [
        feedback
        for second, word in ((False, "angle"), (True, "angle2"))
        for feedback in _revolute(pair.pin(second), word)
    ]


def _screw(pair: _Pair) -> list[Feedback]:
    """Return f |N| along the helix, N = F_a cos g - M_a sin g / r, tan g = lead / r."""
    model: Any = pair.model
    r, lead = pair.number("thread_radius"), model._lead(pair.name)
    root = ca.sqrt(r * r + lead * lead)
    cosine, sine = r / root, lead / root
    turning = pair.speed("angle")
    held = model.space.holding(model, pair.name, "angle")
    slip = pair.laws._slip(pair.name, turning, "rad", held)
    f = pair.laws._friction(slip)
    pair.assume("a square thread; what acts across its axis or tilts it causes no friction")
    normal = pair.both(ca.horzcat(cosine * pair.a.T, -sine / r * pair.a.T))
    space, back = model.space, -slip.sign * f * pair.a
    column = space.rubbing(model, pair.name, back * sine, back * r * cosine)
    rate, moment = f * ca.fabs(turning) * root, f * root
    return [Feedback(pair.name, "largest", normal, column, rate, strength=moment, slip=slip)]


def _spherical(pair: _Pair) -> list[Feedback]:
    """Return M = rho |F| against the spin across F.

    With the unit vector w of the spin, F = p w + t: M = -rho (|t| w - p t / |t|).
    """
    model: Any = pair.model
    joint = model.mechanism.joints[pair.name]
    spin = _spin(model, joint.second_body) - _spin(model, joint.first_body)
    f = pair.laws.factor * model.numbers[f"{pair.name}.friction"]
    rho = _circle(pair, "ball_radius")(f)
    turned = [model.space.rubbing(model, pair.name, SX.zeros(3), SX.eye(3)[:, k]) for k in range(3)]
    slip, w, speed = pair.gliding(spin, "rad", turned, (1.0, 1.0, 1.0))
    pair.assume("the ball presses where its load points, without drag about that line")
    across = ca.horzcat(SX.eye(3) - w @ w.T, SX(3, 3))
    both = ca.vertcat(ca.horzcat(w.T, SX(1, 3)), across)
    none, force = SX.zeros(3), ca.horzcat(SX.eye(3), SX(3, 3))
    against = model.space.rubbing(model, pair.name, none, -rho * w)
    numbers = {"strength": rho, "needs": force}
    found = [Feedback(pair.name, "length", across, against, rho * speed, slip=slip, **numbers)]
    for law, column in zip(ACROSS, turned, strict=True):
        found.append(Feedback(pair.name, law, both, times(rho, column), SX(0), **numbers))
    return found


def _spin(model: ReleasedTree, body: str) -> Sym:
    return model.space.spin(model, body)


def _prismatic(pair: _Pair) -> list[Feedback]:
    """Return F = f (|N1| + |N2| + |M_a| / w)."""
    sizes: list[tuple[str, Sym, Callable[..., Any]]] = [
        ("length", plane, lambda f: f) for plane in pair.planes()
    ]
    width = pair.number("contact_width")
    if width is None:
        pair.assume("a moment about its axis causes no friction (contact_width would count it)")
    else:
        torsion = pair.both(ca.horzcat(SX(1, 3), pair.a.T))
        sizes.append(("largest", torsion, lambda f: 2 * f / width))
    return pair.along("slide", sizes)


def _cylindrical(pair: _Pair) -> list[Feedback]:
    """Return f |N_k| / sqrt(1 + f_t^2) in either plane, against the sliding s' a + r w t."""
    sliding, turning = pair.speed("slide"), pair.speed("angle")
    r = pair.number("pin_radius")
    if r is None:
        return pair.along("slide", [("length", plane, lambda f: f) for plane in pair.planes()])
    f = pair.laws.factor * pair.model.numbers[f"{pair.name}.friction"]
    space: Solid = pair.model.space
    held = [space.holding(pair.model, pair.name, word) for word in ("slide", "angle")]
    columns = [held[0], times(r, held[1])]  # of a force around at the surface
    slip, way, v = pair.gliding(ca.vertcat(sliding, r * turning), "m", columns, (1.0, 1 + f * f))
    ahead, across = way[0], way[1]
    size = f / ca.sqrt(1 + (f * across) ** 2)
    force = -size * ahead * pair.a
    moment = -size * across * r * pair.a
    column = space.rubbing(pair.model, pair.name, force, moment)
    return [
        Feedback(pair.name, "length", plane, column, size * v, strength=size, slip=slip)
        for plane in pair.planes()
    ]


LAWS: dict[str, Callable[[_Pair], list[Feedback]]] = {
    "revolute": _revolute,
    "prismatic": _prismatic,
    "cylindrical": _cylindrical,
    "universal": _universal,
    "screw": _screw,
    "spherical": _spherical,
}

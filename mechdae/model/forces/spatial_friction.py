"""Friction of pairs in space: two bearing planes, vector sums.

The reaction of a pair is a force F and a moment M about its point. Two planes at +-b along the
axis a carry it, N1 = F/2 - (a x M)/(2b) and N2 = F/2 + (a x M)/(2b) across the axis, and friction
is of the sizes |N1| and |N2|; the axial force rubs at a collar, the moment about the axis of a
guide at its width. Friction circle and guides after Artobolevsky, Theory of Mechanisms and
Machines, 1988, ch. 11. With loads in one plane that is the planar |N1| + |N2| = max(|F|, |M|/b).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from mechdae.model.forces.feedback import Feedback

SX = ca.SX


def spatial_law(laws: Any, name: str) -> list[Feedback]:
    """Return the friction of a joint; none of a pair that has no law."""
    law = LAWS.get(laws.model.mechanism.joints[name].kind)
    return law(_Pair(laws, name)) if law is not None else []


class _Pair:
    """A joint with friction: its axes in the fixed frame, its numbers and speeds."""

    def __init__(self, laws: Any, name: str) -> None:
        self.laws, self.name, self.model = laws, name, laws.model
        model: Any = laws.model
        A1 = model.axes_of(name)[0]
        self.n, self.m, self.a = (A1[:, k] for k in range(3))

    def number(self, entry: str) -> Any:
        """Return one of the joint's numbers, None where it is not given."""
        given = self.laws._given(self.name, entry)
        return self.model.numbers[f"{self.name}.{entry}"] if given else None

    def speed(self, word: str) -> Any:
        model: Any = self.model
        return ca.jtimes(model.relative(self.name, word), model.q, model.velocity)

    def planes(self) -> list[Any]:
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

    def along(self, word: str, strengths: list[tuple[str, Any, Any]]) -> list[Feedback]:
        """Return friction against a coordinate: sizes by law and forms, each with its strength."""
        speed = self.speed(word)
        slip = self.laws._slip(self.name, speed, "rad" if word == "angle" else "m")
        f, found = self.laws._friction(slip), []
        for law, forms, strength in strengths:
            size = strength(f)
            wrench = -slip.sign * size * self.a
            zero = SX.zeros(3)
            force, moment = (zero, wrench) if word == "angle" else (wrench, zero)
            space: Any = self.model.space
            column = space.rubbing(self.model, self.name, force, moment)
            rate = size * ca.fabs(speed)
            found.append(Feedback(self.name, law, forms, column, rate, strength=size, slip=slip))
        return found

    def both(self, row: Any) -> Any:
        """Return a form and its opposite: the largest is its size."""
        return ca.vertcat(row, -row)


def _revolute(pair: _Pair) -> list[Feedback]:
    """Return M = rho (|N1| + |N2|) + f r_c |F_a|."""
    r, collar = pair.number("pin_radius"), pair.number("collar_radius")
    exact = pair.laws.radius != "article"
    radius = SX(0) if r is None else r

    def circle(f: Any) -> Any:
        return radius * f / ca.sqrt(1 + f * f) if exact else radius * f

    sizes = [("length", plane, circle) for plane in pair.planes()]
    if collar is None:
        pair.assume("an axial force causes no friction (collar_radius would count it)")
    else:
        axial = pair.both(ca.horzcat(pair.a.T, SX(1, 3)))
        sizes.append(("largest", axial, lambda f: f * collar))
    return pair.along("angle", sizes)


def _prismatic(pair: _Pair) -> list[Feedback]:
    """Return F = f (|N1| + |N2| + |M_a| / w)."""
    sizes: list[tuple[str, Any, Any]] = [("length", plane, lambda f: f) for plane in pair.planes()]
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
    around = (SX(0) if r is None else r) * turning
    f = pair.laws.factor * pair.model.numbers[f"{pair.name}.friction"]
    v = ca.sqrt(sliding**2 + around**2)
    across = ca.if_else(v > 0, around / v, 0)
    ahead = ca.if_else(v > 0, sliding / v, 0)
    size = f / ca.sqrt(1 + (f * across) ** 2)
    space: Any = pair.model.space
    force = -size * ahead * pair.a
    moment = -size * across * (SX(0) if r is None else r) * pair.a
    column = space.rubbing(pair.model, pair.name, force, moment)
    return [
        Feedback(pair.name, "length", plane, column, size * v, strength=size)
        for plane in pair.planes()
    ]


LAWS: dict[str, Callable[[_Pair], list[Feedback]]] = {
    "revolute": _revolute,
    "prismatic": _prismatic,
    "cylindrical": _cylindrical,
}

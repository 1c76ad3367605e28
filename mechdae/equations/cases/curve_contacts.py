"""The symbols of a curve joint: its parameter s, and for a roller the tangent's angle.

Both are coordinates of the joint, entries of q beside those of the bodies. With the angle
psi of the tangent in the first body as an unknown of its own, x'(s) sin psi = y'(s) cos psi,
the normal of a roller is (sin psi, -cos psi) without a division by |c'|: trigonometric and
polynomial curves keep bounds that hold for all poses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Any

import casadi as ca

from mechdae.describe.expression import build
from mechdae.describe.joints.curve import PARAMETER, Curve, repeats, span
from mechdae.equations.coordinates import Coordinate, of_owner
from mechdae.types import Sym

SX = ca.SX
CORNERS = {ca.OP_FABS, ca.OP_SIGN, ca.OP_FMIN, ca.OP_FMAX}
"""Operations at which a derivative jumps."""


class Contact:
    """One curve joint in symbols.

    Parameters
    ----------
    joint
        The description.
    parameters
        Symbols of the mechanism's parameters, which x and y may name.
    numbers
        Symbols of all automatic names.
    values
        Their values: they tell whether a closed curve repeats by itself.
    functions
        The functions an expression may call.

    Attributes
    ----------
    s, angle : SX
        The joint's coordinates; ``angle`` is None for a point follower.
    start, end, turn : SX
        First and last s; the range over 2 pi, which is the unit of s.
    range : (float, float)
        First and last s as numbers.
    point, tangent : SX (2,)
        c(s) and turn dc/ds in the first body [m].
    """

    def __init__(
        self, joint: Curve, parameters: Mapping[str, Sym], numbers: Mapping[str, Sym],
        values: Mapping[str, float], functions: Mapping[str, object],
    ) -> None:  # fmt: skip
        name = joint.name
        self.joint: Curve = joint
        self.closed: bool = joint.closed
        self.rolls: bool = joint.roller_radius is not None
        self.s: Sym = SX.sym(f"{name}.s")
        self._tangents = of_owner(name, ("angle",)) if self.rolls else ()
        self.angle: Any = self._tangents[0].symbol if self.rolls else None
        self.start: Sym = numbers[f"{name}.start"]
        self.end: Sym = numbers[f"{name}.end"]
        self.turn: Sym = (self.end - self.start) / (2 * math.pi)
        self.range: tuple[float, float] = span(joint, values)
        self.wrapped: bool = joint.closed and not repeats(joint, values)
        inside = self.s
        if self.wrapped:
            middle = (self.start + self.end) / 2
            inside = middle + ca.remainder(self.s - middle, self.end - self.start)
        known = {**parameters, PARAMETER: inside}
        self.point: Sym = place(joint, known, functions)
        self.tangent: Sym = ca.densify(ca.jacobian(self.point, self.s)) * self.turn

    def at(self, joint: Any) -> Contact:
        """Return the same symbols for a joint of the same range and other numbers."""
        other = copy(self)
        other.joint = joint
        return other

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The joint's own coordinates."""
        low, high = self.range
        around = high - low if self.closed else 0.0
        middle = (low + high) / 2
        s = Coordinate(self.joint.name, "s", self.s, around, self.unit, self.turn, middle)
        return (s, *self._tangents)

    @cached_property
    def pieces(self) -> bool:
        """Whether the curve is made of pieces, so that some derivative may jump."""
        every = ca.Function("c", [*ca.symvar(self.point)], [self.point])
        codes = {every.instruction_id(k) for k in range(every.n_instructions())}
        return self.wrapped or bool(codes & CORNERS)

    @property
    def unit(self) -> float:
        """The range of s over 2 pi as a number."""
        return (self.range[1] - self.range[0]) / (2 * math.pi)

    @property
    def direction(self) -> Sym:
        """Unit tangent of a roller's contact in the first body, by its angle."""
        return ca.vertcat(ca.cos(self.angle), ca.sin(self.angle))

    @property
    def normal(self) -> Sym:
        """Unit normal towards a roller in the first body, by the tangent's angle."""
        along = self.direction
        right = ca.vertcat(along[1], -along[0])
        return right if self.joint.side == "right" else -right


def place(joint: Curve, known: Mapping[str, Sym], functions: Mapping[str, Any]) -> Sym:
    """Return x and y of a curve (2,) with its parameter and all names as `known`."""
    texts = (joint.x, joint.y)
    return ca.vertcat(
        *[SX(build(t, known, functions)) if isinstance(t, str) else SX(t) for t in texts]
    )


def contacts(
    joints: Sequence[Curve], values: Mapping[str, float], parameters: Mapping[str, Sym],
    numbers: Mapping[str, Sym], functions: Mapping[str, object],
) -> dict[str, Contact]:  # fmt: skip
    """Return the contacts of curve joints by name."""
    return {joint.name: Contact(joint, parameters, numbers, values, functions) for joint in joints}

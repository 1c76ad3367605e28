"""The frames of a spatial joint on its two bodies: columns normal, axis x normal, axis."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal, localcontext

import casadi as ca

from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.spatial import AXES, SpatialJoint, largest
from mechdae.types import Sym

SX = ca.SX
DIGITS = 50


def literal(joint: Joint) -> bool:
    """Return whether the directions of a joint are plain numbers."""
    given = joint.directions() if isinstance(joint, SpatialJoint) else ()
    return not any(isinstance(number, str) for _, vector in given for number in vector)


def side(joint: Joint, second: bool, number: Mapping[str, Sym], value: Mapping[str, float]) -> Sym:
    """Return the rotation (3, 3) from a side's joint frame to the frame of its body.

    Parameters
    ----------
    number, value
        Symbols and values of all numbers of the mechanism by their names. Directions that are
        plain numbers are normalised in 50 digits and rounded once.
    """
    if not isinstance(joint, SpatialJoint) or not dict(joint.directions()):
        return SX.eye(3)
    axis, zero = joint.side(second)

    def vector(name: str, of: Mapping[str, Sym]) -> list[Sym]:
        return [of[f"{joint.name}.{name}.{letter}"] for letter in AXES]

    a = vector(axis, number)
    if zero is not None:
        n = vector(zero, number)
    else:
        after = (largest(tuple(vector(axis, value))) + 1) % 3
        n = [SX(float(i == after)) for i in range(3)]
    if all(SX(entry).is_constant() for entry in (*a, *n)):
        columns = _rounded([float(v) for v in a], [float(v) for v in n])
    else:
        columns = _normal(ca.vertcat(*a), ca.vertcat(*n))
    if joint.crossed and second:  # the second pin is x, the first one z
        first, across, last = columns
        columns = (last, -across, first)
    return ca.sparsify(SX(ca.horzcat(*columns)))


def _normal(a: Sym, n: Sym) -> tuple[Sym, Sym, Sym]:
    """Return normal, axis x normal, axis."""
    a = a / ca.norm_2(a)
    n = n - a * ca.dot(a, n)
    n = n / ca.norm_2(n)
    return n, ca.cross(a, n), a


def _rounded(a: list[float], n: list[float]) -> tuple[Sym, Sym, Sym]:
    with localcontext() as context:
        context.prec = DIGITS
        axis = _unit([Decimal(v) for v in a])
        normal = [Decimal(v) for v in n]
        along = _dot(axis, normal)
        normal = _unit([v - along * w for v, w in zip(normal, axis, strict=True)])
        cross = [axis[i - 2] * normal[i - 1] - axis[i - 1] * normal[i - 2] for i in range(3)]
    return tuple(ca.DM([_near(v) for v in vector]) for vector in (normal, cross, axis))  # type: ignore[return-value]


def _dot(a: list[Decimal], b: list[Decimal]) -> Decimal:
    return sum((v * w for v, w in zip(a, b, strict=True)), Decimal(0))


def _unit(a: list[Decimal]) -> list[Decimal]:
    size = _dot(a, a).sqrt()
    return [v / size for v in a]


def _near(value: Decimal) -> float:
    """Return the nearest double; rounding of the last of 50 digits is no component."""
    return 0.0 if abs(value) < Decimal("1e-40") else float(value)

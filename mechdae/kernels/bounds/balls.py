"""How far an expression can move over a step: arithmetic of balls (centre and radius).

The counterpart of `majorant` for laws of time: there angles may take any value and steps
are told apart by their size alone, here the argument stays near a known place. A radius
that cannot be bounded (a pole, the end of a domain) is `HUGE`, never nan.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from mechdae.kernels.bounds.walk import SYMBOLIC, replay
from mechdae.types import Graph, Sym

SX = ca.SX
HUGE = 1e100


def radii(function: Graph, inputs: Sequence[Sequence[tuple[Sym, Sym]]]) -> Sym:
    """Return how far each entry of the first output may be from its value at the centre.

    Parameters
    ----------
    function
        SX function.
    inputs
        For each input of the function its entries as (centre, radius).
    """
    found = replay(function, inputs, _step, lambda number: (SX(number), SX(0)))[0]
    return ca.vertcat(*[_where(r <= HUGE, r) for _, r in found]) if found else SX(0, 1)


def _where(condition: Sym, radius: Sym) -> Sym:
    """Return the radius where the condition holds, else `HUGE`; nan does not get through."""
    return ca.if_else(condition, radius, HUGE)


def _step(code: int, inputs: list[tuple[Sym, Sym]]) -> tuple[Sym, Sym]:
    """Return centre and radius of one operation."""
    centre = SYMBOLIC[code](*[c for c, _ in inputs])
    if all(r.is_zero() for _, r in inputs):
        return centre, SX(0)
    return centre, _radius(code, centre, *inputs[0], *(inputs[1] if len(inputs) > 1 else (0, 0)))


def _radius(code: int, centre: Sym, a: Sym, ra: Sym, b: Sym, rb: Sym) -> Sym:
    size, near = ca.fabs(a), ca.fabs(a) - ra
    if code in (ca.OP_ADD, ca.OP_SUB):
        return ra + rb
    if code in (ca.OP_NEG, ca.OP_ASSIGN, ca.OP_FABS, ca.OP_ATAN, ca.OP_TANH):
        return ra
    if code == ca.OP_TWICE:
        return 2 * ra
    if code == ca.OP_MUL:
        return size * rb + ca.fabs(b) * ra + ra * rb
    if code == ca.OP_SQ:
        return (2 * size + ra) * ra
    if code == ca.OP_INV:
        return _where(near > 0, ra / (size * near))
    if code == ca.OP_DIV:
        near = ca.fabs(b) - rb
        return _where(near > 0, (ra + ca.fabs(centre) * rb) / near)
    if code in (ca.OP_SIN, ca.OP_COS):
        return ca.fmin(ra, 2)
    if code == ca.OP_TAN:
        near = ca.fabs(ca.cos(a)) - ra
        return _where(near > 0, ra / (ca.fabs(ca.cos(a)) * near))
    if code == ca.OP_SQRT:
        return _where(a >= ra, ra / (centre + 1e-300))
    if code == ca.OP_EXP:
        return ra * ca.exp(a + ra)
    if code == ca.OP_LOG:
        return _where(a > ra, ra / (a - ra))
    if code in (ca.OP_ASIN, ca.OP_ACOS):
        return _where(size + ra < 1, ra / ca.sqrt(1 - (size + ra) ** 2))
    if code == ca.OP_SINH:
        return ra * ca.cosh(size + ra)
    if code == ca.OP_COSH:
        return ra * ca.sinh(size + ra)
    if code in (ca.OP_FMIN, ca.OP_FMAX):
        return ca.fmax(ra, rb)
    if code in (ca.OP_POW, ca.OP_CONSTPOW):
        return _power(centre, a, ra, b, rb)
    if code == ca.OP_ATAN2:
        # a is the ordinate; the angle jumps by a turn on the negative axis
        moved = ca.sqrt(ra * ra + rb * rb)
        near = ca.sqrt(a * a + b * b) - moved
        cut = ca.logic_and(b < rb, size <= ra)
        return _where(ca.logic_and(near > 0, ca.logic_not(cut)), moved / near)
    raise NotImplementedError(f"operation {code} in a law of time")


def _power(centre: Sym, a: Sym, ra: Sym, b: Sym, rb: Sym) -> Sym:
    """Return the radius of a**b: where only a moves, its largest slope; else exp(b log a)."""
    if rb.is_zero():
        far, near = ca.fabs(a) + ra, ca.fabs(a) - ra
        slope = ca.fmax(far ** (b - 1), ca.if_else(near > 0, near ** (b - 1), 0))
        return _where(ca.logic_or(near > 0, b >= 1), ca.fabs(b) * slope * ra)
    logarithm = ca.log(a)
    moved = ra / (a - ra)
    exponent = ca.fabs(b) * moved + ca.fabs(logarithm) * rb + moved * rb
    return _where(a > ra, centre * exponent * ca.exp(exponent))

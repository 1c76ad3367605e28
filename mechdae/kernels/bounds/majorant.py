"""Upper bounds of expressions for all poses at once, and of their rounding errors.

An expression graph is walked once: sin and cos of anything that moves become 1, minus
becomes plus, constants and parameters their absolute value. The result bounds the
expression for every value of its angles. Beside it runs a rounding-error bound in units
of the unit roundoff (running error analysis, Higham, Accuracy and Stability of Numerical
Algorithms, 2002, 3.3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial, reduce
from typing import Any

import casadi as ca

from mechdae.kernels.bounds.walk import SYMBOLIC, number_rounding, replay, symbolic
from mechdae.types import Sym

SX = ca.SX
ZERO, ONE = SX(0), SX(1)
_plus, _times, _over = (partial(symbolic, code) for code in (ca.OP_ADD, ca.OP_MUL, ca.OP_DIV))
_size = partial(symbolic, ca.OP_FABS)
_twice = partial(symbolic, ca.OP_TWICE)


class NoMajorant(Exception):
    """The expression holds an operation without a bound (curve joints, tables)."""


def majorant(
    expressions: Sym,
    moving: Sequence[Sym],
    bounds: Sequence[Sym],
    noise: Mapping[int, Any] | None = None,
) -> tuple[Sym, Sym]:
    """Return bounds of the absolute values and of the rounding errors of `expressions`.

    Parameters
    ----------
    expressions : SX (k,)
    moving, bounds : lists of SX vectors
        Symbols that change with the pose, and the bounds to use for their absolute values;
        all other symbols are parameters, the same along a sweep.
    noise
        Errors of parameters, by the hash of their symbols; 0 of others. Without it no errors are
        wanted: they are zero, and half the work is left out.

    Returns
    -------
    magnitude, error : SX (k,)
        Expressions over `bounds` and parameters; `error` in units of the roundoff.

    Raises
    ------
    NoMajorant
    """
    stacked = ca.vec(ca.densify(expressions))
    known = {symbol.element_hash() for group in moving for symbol in group.elements()}
    parameters = [s for s in ca.symvar(stacked) if s.element_hash() not in known]
    function = ca.Function("f", [*moving, ca.veccat(*parameters)], [stacked])
    inputs = [[(m, ZERO, None) for m in ca.vec(bound).elements()] for bound in bounds]
    noisy = noise or {}
    inputs.append([(_size(p), noisy.get(p.element_hash(), ZERO), p) for p in parameters])
    found = replay(function, inputs, _step if noise is None else _rounded, _constant)[0]
    if not found:
        return SX(0, 1), SX(0, 1)
    return ca.vertcat(*[f[0] for f in found]), ca.vertcat(*[f[1] for f in found])


def _constant(number: float) -> tuple[Sym, Sym, Sym]:
    value = SX(number)
    return _size(value), ZERO, value


def _sum(*terms: Sym) -> Sym:
    return reduce(_plus, terms)


def _step(code: int, inputs: list[tuple[Sym, Sym, Sym | None]]) -> tuple[Any, Any, Any]:
    """Return magnitude, no error and (for parameters only) value of one operation."""
    if all(value is not None for _, _, value in inputs):
        if code not in SYMBOLIC:
            raise NoMajorant
        value = symbolic(code, *[value for _, _, value in inputs])
        return _size(value), ZERO, value
    a = inputs[0][0]
    if code in (ca.OP_ADD, ca.OP_SUB):
        return _plus(a, inputs[1][0]), ZERO, None
    if code == ca.OP_MUL:
        return _times(a, inputs[1][0]), ZERO, None
    if code == ca.OP_SQ:
        return _times(a, a), ZERO, None
    if code == ca.OP_TWICE:
        return _twice(a), ZERO, None
    if code == ca.OP_NEG:
        return a, ZERO, None
    if code in (ca.OP_SIN, ca.OP_COS):
        return ONE, ZERO, None
    if code == ca.OP_DIV and inputs[1][2] is not None:
        return _over(a, inputs[1][0]), ZERO, None
    raise NoMajorant


def _rounded(code: int, inputs: list[tuple[Sym, Sym, Sym | None]]) -> tuple[Any, Any, Any]:
    """Return magnitude, error and (for parameters only) value of one operation."""
    size, _, value = _step(code, inputs)
    a, ea, _ = inputs[0]
    b, eb, _ = inputs[1] if len(inputs) > 1 else (ZERO, ZERO, None)
    if value is not None:
        return size, number_rounding(code, value, [(v, e) for _, e, v in inputs]), value
    if code in (ca.OP_ADD, ca.OP_SUB):
        return size, _sum(ea, eb, a, b), None
    if code == ca.OP_MUL:
        return size, _sum(_times(ea, b), _times(eb, a), size), None
    if code == ca.OP_SQ:
        return size, _plus(_times(_twice(ea), a), size), None
    if code == ca.OP_TWICE:
        return size, _twice(ea), None
    if code == ca.OP_NEG:
        return size, ea, None
    if code in (ca.OP_SIN, ca.OP_COS):
        return size, _plus(ea, ONE), None
    return size, _plus(_over(_plus(ea, _over(_times(a, eb), b)), b), size), None

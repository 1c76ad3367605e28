"""Upper bounds of expressions for all poses at once, and of their rounding errors.

An expression graph is walked once: sin and cos of anything that moves become 1, minus
becomes plus, constants and parameters their absolute value. The result bounds the
expression for every value of its angles. Beside it runs a rounding-error bound in units
of the unit roundoff (running error analysis, Higham, Accuracy and Stability of Numerical
Algorithms, 2002, 3.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial, reduce
from typing import Any

import casadi as ca

from mechdae.kernels.replay import SYMBOLIC, replay, symbolic

SX = ca.SX
ZERO, ONE = SX(0), SX(1)
_plus, _times, _over = (partial(symbolic, code) for code in (ca.OP_ADD, ca.OP_MUL, ca.OP_DIV))
_size = partial(symbolic, ca.OP_FABS)
_twice = partial(symbolic, ca.OP_TWICE)


class NoMajorant(Exception):
    """The expression holds an operation without a bound (curve joints, tables)."""


def majorant(expressions: Any, moving: Sequence[Any], bounds: Sequence[Any]) -> tuple[Any, Any]:
    """Return bounds of the absolute values and of the rounding errors of `expressions`.

    Parameters
    ----------
    expressions : SX (k,)
    moving, bounds : lists of SX vectors
        Symbols that change with the pose, and the bounds to use for their absolute values;
        all other symbols are parameters, the same along a sweep.

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
    inputs.append([(_size(p), ZERO, p) for p in parameters])
    found = replay(function, inputs, _step, _constant)[0]
    if not found:
        return SX(0, 1), SX(0, 1)
    return ca.vertcat(*[f[0] for f in found]), ca.vertcat(*[f[1] for f in found])


def _constant(number: float) -> tuple[Any, Any, Any]:
    value = SX(number)
    return _size(value), ZERO, value


def _sum(*terms: Any) -> Any:
    return reduce(_plus, terms)


def _step(code: int, inputs: list[tuple[Any, Any, Any]]) -> tuple[Any, Any, Any]:
    """Return magnitude, error and (for parameters only) value of one operation."""
    magnitudes = [m for m, _, _ in inputs]
    errors = [e for _, e, _ in inputs]
    if all(value is not None for _, _, value in inputs):
        if code not in SYMBOLIC:
            raise NoMajorant
        value = symbolic(code, *[value for _, _, value in inputs])
        size = _size(value)
        exact = code in (ca.OP_NEG, ca.OP_TWICE)
        return size, errors[0] if exact else _times(SX(4), size), value
    a, ea = magnitudes[0], errors[0]
    b, eb = (magnitudes[1], errors[1]) if len(inputs) > 1 else (ZERO, ZERO)
    if code in (ca.OP_ADD, ca.OP_SUB):
        return _plus(a, b), _sum(ea, eb, a, b), None
    if code == ca.OP_MUL:
        product = _times(a, b)
        return product, _sum(_times(ea, b), _times(eb, a), product), None
    if code == ca.OP_SQ:
        square = _times(a, a)
        return square, _plus(_times(_twice(ea), a), square), None
    if code == ca.OP_TWICE:
        return _twice(a), _twice(ea), None
    if code == ca.OP_NEG:
        return a, ea, None
    if code in (ca.OP_SIN, ca.OP_COS):
        return ONE, _plus(ea, ONE), None
    if code == ca.OP_DIV and inputs[1][2] is not None:
        quotient = _over(a, b)
        return quotient, _plus(_over(_plus(ea, _over(_times(a, eb), b)), b), quotient), None
    raise NoMajorant

"""Graphs that prove a step around polynomials through its two ends, block by block.

Over a part of a step, -1 <= t <= 1, the unknowns of a block are near polynomials q(t) of degree
five, those of earlier blocks within e_z of theirs, the drivers on a line. With Y the inverse of the
Jacobian in the middle and M[r, r] the majorants of the second derivatives, e_z included,

    | x - Y F(x) - q | <= g + D r + |Y| M[r, r]   for   | x - q | <= r,
    g >= |Y F(q)| + |Y F_z(q)| e_z,   D >= |1 - Y J(q)|,

entry by entry (Krawczyk 1969). Where the right-hand side is at most r, the box holds one solution
for each t and no other one, and it is no further from q than the right-hand side.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.kernels.bounds.series import SymbolicSeries, expanded, plus, product, total
from mechdae.kernels.bounds.walk import majorant
from mechdae.kernels.graphs.blocks import BlockShape, inverse
from mechdae.kernels.run.functions import without_repeats

SX = ca.SX
COUNT = 6
"""Coefficients of a polynomial."""
TIGHTENED = 2
"""Times that a box is made smaller to what it must hold."""


def along(shape: BlockShape) -> Any:
    """Return what F and its derivatives leave along polynomials, as a function.

    (c, cz, u, q) -> |Y F| (n,), |Y F_z| (n nz,), |1 - Y J| (n n,), |Y| (n rows,): bounds, column by
    column. c and cz hold the coefficients of each unknown one after the other, u the drivers in
    the middle and their rates.

    Raises
    ------
    NoSeries
    """
    n, nz, nu = (part.numel() for part in shape.moving)
    c, cz = SX.sym("c", COUNT * n), SX.sym("cz", COUNT * nz)
    u = SX.sym("u", 2 * nu)
    polynomials, used = _polynomials(c, n), _polynomials(cz, nz)
    driven = [SymbolicSeries([u[k], u[nu + k], *[SX(0)] * (COUNT - 2)]) for k in range(nu)]
    J, Fz = ca.jacobian(shape.F, shape.x), ca.jacobian(shape.F, shape.z)
    parts = [ca.densify(ca.vec(part)) for part in (shape.F, J, Fz)]
    function = without_repeats("parts", [*shape.moving, shape.q], parts)
    F, entries, by_z = expanded(function, [polynomials, used, driven, shape.q.elements()])
    square = ca.reshape(ca.vertcat(*[_middle(part) for part in entries]), n, n)
    Y, _ = inverse(square)
    open_by = [_size(_row(Y, a, F, n)) for a in range(n)]
    slopes = [_size(_row(Y, a, by_z[k * n : (k + 1) * n], n)) for k in range(nz) for a in range(n)]
    change = []
    for k in range(n):
        for a in range(n):
            product = _row(Y, a, entries[k * n : (k + 1) * n], n)
            change.append(_size(plus(product, SX(-1 if a == k else 0))))
    results = [ca.vertcat(SX(0, 1), *part) for part in (open_by, slopes, change)]
    results.append(ca.fabs(ca.vec(Y)))
    inputs = [c, cz, u, shape.q]
    return without_repeats("along", inputs, [ca.densify(part) for part in results])


def box(shape: BlockShape) -> Any:
    """Return how far the solutions may be from the polynomials, as a function.

    (what `along` gives, e_z, |x|, |z|, |u|, noise, r, q) -> distance (n,), share of r (1,). With a
    share below 1 the box r holds one solution for each t, no further from q(t) than the distance.
    """
    n, nz, nu = (part.numel() for part in shape.moving)
    given = [SX.sym("g", n), SX.sym("G", n * nz), SX.sym("D", n * n), SX.sym("Y", n * n)]
    away, noise, r = SX.sym("away", nz), SX.sym("noise", n), SX.sym("r", n)
    sizes = [SX.sym(name, k) for name, k in (("x", n), ("z", nz), ("u", nu))]
    D, Y = (ca.reshape(part, n, n) for part in given[2:])
    w = [SX.sym("w", n), SX.sym("wz", nz)]
    moving = [*shape.moving, shape.vx, shape.vz, shape.vu]
    found, _ = majorant(shape.second, moving, [*sizes, *w, SX.zeros(nu)])
    bent = without_repeats("bent", [*w, *sizes, shape.q], [ca.densify(found)])
    fixed = given[0] + Y @ noise
    if nz:
        fixed += ca.reshape(given[1], n, nz) @ away

    def needed(width: Any) -> Any:
        return fixed + D @ width + Y @ bent(width, away, *sizes, shape.q)

    distance = needed(r)
    share = ca.mmax(distance / r)
    for _ in range(TIGHTENED):
        distance = needed(distance)
    inputs = [*given, away, *sizes, noise, r, shape.q]
    return without_repeats("box", inputs, [ca.densify(distance), ca.densify(share)])


def _polynomials(c: Any, count: int) -> list[SymbolicSeries]:
    """Return the polynomials of a vector of coefficients."""
    return [SymbolicSeries(c[COUNT * k : COUNT * (k + 1)].elements()) for k in range(count)]


def _middle(value: Any) -> Any:
    """Return the value of a series in the middle."""
    return value.c[0] if isinstance(value, SymbolicSeries) else SX(value)


def _row(Y: Any, a: int, column: list[Any], n: int) -> Any:
    """Return the product of a row of Y with a column of series."""
    result: Any = SX(0)
    for i in range(n):
        result = plus(result, product(column[i], Y[a, i]))
    return result


def _size(value: Any) -> Any:
    """Return a bound of a value's size."""
    if isinstance(value, SymbolicSeries):
        return value.size + value.e
    return total([ca.fabs(value)])

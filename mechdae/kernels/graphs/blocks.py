"""The numerical blocks as graphs: residual, Jacobian, rates, inverse.

A block's equations F(x_b, z, u; p) = 0 are square in its own unknowns x_b, or there are more
of them in a redundant block; z are unknowns of earlier blocks. With v = (x_b', z', u') the
rates follow from

    J x_b'  = -(F_z z' + F_u u')
    J x_b'' = -(D2F[v, v] + F_z z'' + F_u u'')
    J x_b''' = -(D3F[v, v, v] + 3 D2F[v, a] + F_z z''' + F_u u''')

with a = (x_b'', z'', u''). The third is built only when it is asked for.

Inverses are adjugates up to 4 x 4; larger ones are refined, because an unrolled
factorisation loses digits like the square of the condition number. A redundant block has the
left inverse (J^T J)^-1 J^T: a step with it is one of Gauss and Newton on all equations.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.kernels.bounds.walk import with_trig
from mechdae.kernels.run.call import Call
from mechdae.model.kept import Kept
from mechdae.model.reduction import Block, Scene

SX = ca.SX
ADJUGATE_LIMIT = 4


class BlockGraph:
    """Graphs of one block, to be called with symbols of the caller."""

    def __init__(self, scene: Scene, block: Block) -> None:
        self.block, self.kept = block, Kept()
        self.own, self.uses = list(block.x), list(block.uses)
        self.size, self.rows = len(self.own), len(block.units)
        self.redundant = block.redundant
        xb = scene.x[self.own]
        z = scene.x[self.uses] if self.uses else SX(0, 1)
        u, F = scene.u, block.residual
        self.params = scene.held(F)[2]
        p = scene.model.p[self.params] if self.params else SX(0, 1)
        self.x, self.z, self.p, self.F = xb, z, p, F
        self._u = u
        self.vx, self.vz = SX.sym("vx", xb.numel()), SX.sym("vz", z.numel())
        self.vu, self.az = SX.sym("vu", u.numel()), SX.sym("az", z.numel())
        self.au = SX.sym("au", u.numel())
        self.J = ca.jacobian(F, xb)
        self.Fz = ca.jacobian(F, z)
        self.drift = ca.jtimes(F, ca.vertcat(z, u), ca.vertcat(self.vz, self.vu))
        every = ca.vertcat(xb, z, u)
        rates = ca.vertcat(self.vx, self.vz, self.vu)
        self.first = ca.jtimes(F, every, rates)
        self.second = ca.jtimes(self.first, every, rates)
        pushed = ca.jtimes(F, ca.vertcat(z, u), ca.vertcat(self.az, self.au))
        rate = [self.vx, self.vz, self.vu, self.az, self.au]
        self._angles = [i for i in (*self.own, *self.uses) if scene.unknowns[i].kind is ANGLE]
        angles = scene.x[self._angles] if self._angles else SX(0, 1)
        sines, cosines = SX.sym("sin", angles.numel()), SX.sym("cos", angles.numel())
        parts = [F, self.J, self.Fz, -self.drift, -(self.second + pushed)]
        F, J, Fz, r1, r2 = with_trig(parts, angles, sines, cosines)
        self.turns_alone = not ca.depends_on(F, angles)
        """Whether angles are in the equations by their sines and cosines only."""
        at = [xb, z, u, p, sines, cosines]
        self._value = ca.Function("value", at, [F, J, Fz])
        self._dense = Call(ca.Function("value", at, [ca.densify(part) for part in (F, J, Fz)]))
        self._rates = ca.Function("rates", [*at, *rate], [r1, r2])
        self._trig, self._moving = (angles, sines, cosines), (xb, z, u, p)

    @cached_property
    def _thirds(self) -> Any:
        """Right-hand side of the third rates as a function."""
        xb, z, u, p = self._moving
        ax, jz = SX.sym("ax", xb.numel()), SX.sym("jz", z.numel())
        ju = SX.sym("ju", u.numel())
        every = ca.vertcat(xb, z, u)
        third = ca.jtimes(self.second, every, ca.vertcat(self.vx, self.vz, self.vu))
        third += 3 * ca.jtimes(self.first, every, ca.vertcat(ax, self.az, self.au))
        third += ca.jtimes(self.F, ca.vertcat(z, u), ca.vertcat(jz, ju))
        (r3,) = with_trig([-third], *self._trig)
        rates = [self.vx, self.vz, self.vu, ax, self.az, self.au, jz, ju]
        return ca.Function("thirds", [xb, z, u, p, *self._trig[1:], *rates], [r3])

    @cached_property
    def function(self) -> Any:
        """The residual (x_b, z, u, p) -> F; p are the block's own parameters."""
        inputs = [self.x, self.z, self._u, self.p]
        return ca.Function("F", inputs, [ca.densify(self.F)])

    def _at(self, x: Any, u: Any, p: Any, trig: Any) -> list[Any]:
        sines, cosines = trig
        nothing = SX(0, 1)
        chosen = [v[self._angles] if self._angles else nothing for v in (sines, cosines)]
        p = p[self.params] if self.params else nothing
        return [x[self.own], x[self.uses] if self.uses else nothing, u, p, *chosen]

    def value(self, x: Any, u: Any, p: Any, trig: Any = None) -> tuple[Any, Any, Any]:
        """Return F, J and F_z with the unknown vector `x` of the whole scene.

        `trig` holds sin x and cos x where the caller has them.
        """
        trig = trig if trig is not None else (ca.sin(x), ca.cos(x))
        result: tuple[Any, Any, Any] = self._value(*self._at(x, u, p, trig))
        return result

    def value_at(self, x: Any, u: Any, p: Any) -> tuple[Any, Any, Any]:
        """Return F (m,), J (m, n) and F_z (m, nz) as arrays at one pose."""
        z = x[self.uses] if self.uses else np.zeros(0)
        turned = x[self._angles]
        own = (x[self.own], z, u, p[self.params])
        F, J, Fz = self._dense(*own, np.sin(turned), np.cos(turned))
        return F, J.reshape(self.rows, -1), Fz.reshape(self.rows, -1)

    def first_rate(self, x: Any, u: Any, p: Any, v: Any, du: Any, trig: Any) -> Any:
        """Return the right-hand side of J x' (entries of `v` up to this block are known)."""
        zero, nothing = SX.zeros(self.size), SX.zeros(self.az.numel())
        no_u = SX.zeros(self.au.numel())
        rates = (zero, self._used(v), du, nothing, no_u)
        return self._rates(*self._at(x, u, p, trig), *rates)[0]

    def second_rate(
        self, x: Any, u: Any, p: Any, v: Any, du: Any, a: Any, ddu: Any, trig: Any
    ) -> Any:
        """Return the right-hand side of J x''."""
        rates = (self._own(v), self._used(v), du, self._used(a), ddu)
        return self._rates(*self._at(x, u, p, trig), *rates)[1]

    def third_rate(
        self, x: Any, u: Any, p: Any, rates: tuple[Any, Any, Any], driven: list[Any], trig: Any
    ) -> Any:
        """Return the right-hand side of J x'''; `driven` holds the three rates of u."""
        (v, a, j), (du, ddu, dddu) = rates, driven
        known = (self._own(v), self._used(v), du, self._own(a), self._used(a), ddu)
        return self._thirds(*self._at(x, u, p, trig), *known, self._used(j), dddu)

    def _own(self, x: Any) -> Any:
        return x[self.own]

    def _used(self, x: Any) -> Any:
        return x[self.uses] if self.uses else SX(0, 1)


def inverse(J: Any) -> tuple[Any, Any]:
    """Return the inverse and the determinant (1 above 4 x 4, where it is not used)."""
    if J.shape[0] <= ADJUGATE_LIMIT:
        det = ca.det(J)
        return ca.adj(J) * (1 / det), det
    eye = SX.eye(J.shape[0])
    guess = ca.solve(J, eye)
    for _ in range(2):
        guess = guess @ (2 * eye - J @ guess)
    return guess, SX(1)


def left_inverse(J: Any) -> Any:
    """Return (J^T J)^-1 J^T of a matrix with more rows than columns.

    From an orthogonal factorisation, refined once: J^T J would lose digits like the square of
    the condition number. Columns with few entries come first, they stay sparse.
    """
    n = J.shape[1]
    order = sorted(range(n), key=lambda j: J[:, j].nnz())
    Q, R = ca.qr(J[:, order])
    guess = ca.solve(R, Q.T)[[order.index(j) for j in range(n)], :]
    return (2 * SX.eye(n) - guess @ J) @ guess


def norm(matrix: Any) -> Any:
    """Return the Frobenius norm."""
    return ca.sqrt(ca.sumsqr(matrix))


def placed(vector: Any, positions: list[int], values: Any) -> Any:
    """Return the vector with some entries replaced."""
    if not positions:
        return vector
    result = SX(vector)
    result[positions] = ca.densify(values)
    return result


def column(items: list[Any]) -> Any:
    """Return entries or vectors below one another."""
    return ca.vertcat(*items) if items else SX(0, 1)

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

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.equations.reduction import Block, Scene
from mechdae.equations.structure_cache import StructureCache
from mechdae.kernels.graphs.block_shape import BlockShape, Equations
from mechdae.kernels.graphs.row_reaches import RowReaches
from mechdae.kernels.run.call import Call
from mechdae.types import Floats, Sym, Unknowns

SX = ca.SX
ADJUGATE_LIMIT = 4


class BlockGraph:
    """Graphs of one block, to be called with symbols of the caller.

    Attributes
    ----------
    x, z, p, F : SX
        Own unknowns, those of earlier blocks, own parameters and equations, in the scene's symbols.
    turning : list of int
        Those of the own unknowns that are angles.
    reaches : RowReaches
        Bounds of equations in space.
    q, noise : SX
        The numbers of the block's shape as expressions over p, and their rounding.
    """

    def __init__(self, scene: Scene, block: Block) -> None:
        self.block, self.cache = block, StructureCache()
        self.own, self.uses = list(block.x), list(block.uses)
        self.size, self.rows = len(self.own), len(block.units)
        self.redundant = block.redundant
        self.x, self.F = scene.x[self.own], block.residual
        self.z = scene.x[self.uses] if self.uses else SX(0, 1)
        self.params = scene.held(self.F)[2]
        self.p = scene.model.p[self.params] if self.params else SX(0, 1)
        self._u = scene.u
        self.turning = [i for i in self.own if scene.unknowns[i].kind is ANGLE]
        self._angles = self.turning + [i for i in self.uses if scene.unknowns[i].kind is ANGLE]
        self.function = ca.Function("F", [self.x, self.z, self._u, self.p], [ca.densify(self.F)])
        """The residual (x_b, z, u, p) -> F; p are the block's own parameters."""
        self.reaches = self._reaches(scene)
        self.shape = self._shape(scene)

    def _reaches(self, scene: Scene) -> RowReaches | None:
        """Return what bounds the equations of a block in space, None where terms do."""
        if not any(reach is not None for reach in self.block.reaches):
            return None
        found = RowReaches(scene, self.F, self.block.reaches, [self.x, self.z, self._u])
        return found if found.any else None

    def _shape(self, scene: Scene) -> BlockShape:
        kinds = tuple(scene.unknowns[i].kind for i in (*self.own, *self.uses))
        angles = [i for i, kind in enumerate(kinds) if kind is ANGLE]
        if (
            self.redundant or scene.model.contacts or self.reaches
        ):  # bounds of curves are in the scene's symbols
            self.q, self.noise = self.p, SX.zeros(self.p.numel())
            return BlockShape(self.x, self.z, self._u, self.p, self.F, angles)
        found = Equations(self.function, self.p)
        self.q, self.noise = column(found.numbers), column(found.noise)
        key = (self.size, kinds, self.block.units, tuple(found.steps), tuple(found.rows))
        shape: BlockShape = scene.cache(key, lambda: found.shape(angles))
        return shape

    @cached_property
    def J(self) -> Sym:
        """The Jacobian in the scene's symbols."""
        return ca.jacobian(self.F, self.x)

    @cached_property
    def drift(self) -> Sym:
        """F_z z' + F_u u' in the scene's symbols, with the shape's `vz` and `vu`."""
        rates = ca.vertcat(self.shape.vz, self.shape.vu)
        return ca.jtimes(self.F, ca.vertcat(self.z, self._u), rates)

    @cached_property
    def _dense(self) -> Call:
        sines, cosines = (SX.sym(name, len(self._angles)) for name in ("sin", "cos"))
        values = self.shape.value(self.x, self.z, self._u, self.q, sines, cosines)
        at = [self.x, self.z, self._u, self.p, sines, cosines]
        return Call(ca.Function("value", at, [ca.densify(part) for part in values]))

    def at(self, x: Sym, u: Sym, trig: tuple[Sym, Sym]) -> list[Sym]:
        """Return the inputs of the shape's functions; `trig` are sin x, cos x of all unknowns."""
        sines, cosines = trig
        nothing = SX(0, 1)
        chosen = [v[self._angles] if self._angles else nothing for v in (sines, cosines)]
        return [x[self.own], self.used(x), u, self.q, *chosen]

    def value(self, x: Sym, u: Sym) -> tuple[Sym, Sym, Sym]:
        """Return F, J and F_z with the unknown vector `x` of the whole scene."""
        result: tuple[Sym, Sym, Sym] = self.shape.value(*self.at(x, u, (ca.sin(x), ca.cos(x))))
        return result

    def value_at(self, x: Unknowns, u: Floats, p: Floats) -> tuple[Any, Any, Any]:
        """Return F (m,), J (m, n) and F_z (m, nz) as arrays at one pose."""
        z = x[self.uses] if self.uses else np.zeros(0)
        turned = x[self._angles]
        own = (x[self.own], z, u, p[self.params])
        F, J, Fz = self._dense(*own, np.sin(turned), np.cos(turned))
        return F, J.reshape(self.rows, -1), Fz.reshape(self.rows, -1)

    def first_rate(self, at: Any, known: Any, used: Sequence[Sym], driven: Any) -> Any:
        """Return the right-hand side of J x'; `at` as of `at`.

        `known` are the lower rates of the block, `used` the rates of the earlier unknowns, `driven`
        those of the drivers.
        """
        zero, nothing, still = (SX.zeros(n.numel()) for n in (at[0], at[1], at[2]))
        return self.shape.push(*at, zero, used[0], driven[0], nothing, still)[0]

    def second_rate(
        self,
        at: tuple[Sym, Sym, Sym, Sym, Sym, Sym],
        known: list[Sym],
        used: list[Sym],
        driven: tuple[Sym, ...],
    ) -> Sym:
        """Return the right-hand side of J x''."""
        return self.shape.push(*at, known[0], used[0], driven[0], used[1], driven[1])[1]

    def third_rate(
        self,
        at: tuple[Sym, Sym, Sym, Sym, Sym, Sym],
        known: list[Sym],
        used: list[Sym],
        driven: tuple[Sym, Sym, Sym],
    ) -> Sym:
        """Return the right-hand side of J x'''."""
        (v, a, j), (du, ddu, dddu) = used, driven
        return self.shape.third(*at, known[0], v, du, known[1], a, ddu, j, dddu)

    def used(self, x: Sym) -> Sym:
        """Return the entries of the earlier unknowns."""
        return x[self.uses] if self.uses else SX(0, 1)


def inverse(J: Sym) -> tuple[Sym, Sym]:
    """Return the inverse and the determinant (1 above 4 x 4, where it is not used)."""
    if J.shape[0] <= ADJUGATE_LIMIT:
        det = ca.det(J)
        return ca.adj(J) * (1 / det), det
    eye = SX.eye(J.shape[0])
    guess = ca.solve(J, eye)
    for _ in range(2):
        guess = guess @ (2 * eye - J @ guess)
    return guess, SX(1)


def left_inverse(J: Sym) -> Sym:
    """Return (J^T J)^-1 J^T of a matrix with more rows than columns.

    From an orthogonal factorisation, refined once: J^T J would lose digits like the square of
    the condition number. Columns with few entries come first, they stay sparse.
    """
    n = J.shape[1]
    order = sorted(range(n), key=lambda j: J[:, j].nnz())
    Q, R = ca.qr(J[:, order])
    guess = ca.solve(R, Q.T)[[order.index(j) for j in range(n)], :]
    return (2 * SX.eye(n) - guess @ J) @ guess


def norm(matrix: Sym) -> Sym:
    """Return the Frobenius norm."""
    return ca.sqrt(ca.sumsqr(matrix))


def placed(vector: Sym, positions: list[int], values: Sym) -> Sym:
    """Return the vector with some entries replaced."""
    if not positions:
        return vector
    result = SX(vector)
    result[positions] = ca.densify(values)
    return result


def column(items: list[Sym]) -> Sym:
    """Return entries or vectors below one another."""
    return ca.vertcat(*items) if items else SX(0, 1)

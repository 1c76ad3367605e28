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

What an equation makes of parameters and numbers only, ``(k + 1) * pitch``, is one number q of the
block. Blocks whose equations are the same in their unknowns, the drivers and q have one shape,
which is built once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.additions import of_cases
from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.equations.reduction import Block, Scene
from mechdae.equations.structure_cache import StructureCache
from mechdae.kernels.bounds.walk import instructions, number_rounding, symbolic, with_trig
from mechdae.kernels.run.functions import Call
from mechdae.records import dataclass
from mechdae.types import Floats, Graph, Matrix, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.tree.joint_chains import WayProducts
    from mechdae.kernels.graphs.row_reaches import RowReaches

SX = ca.SX


class BlockShape:
    """Functions of the equations F(x, z, u; q) = 0 of blocks.

    Parameters
    ----------
    x, z, u, q : SX
        Unknowns, those of earlier blocks, drivers, numbers.
    F : SX
    angles
        Which entries of (x, z) are angles.
    shared
        Whether several blocks may have this shape: its symbols are nobody else's.
    """

    def __init__(
        self, x: Sym, z: Sym, u: Sym, q: Sym, F: Sym, angles: list[int], shared: bool = False
    ) -> None:
        self.F = F
        self.x: Sym = x
        self.z: Sym = z
        self.u: Sym = u
        self.q: Sym = q
        self.shared: bool = shared
        self.cache: StructureCache = StructureCache()
        self.vx: Sym = SX.sym("vx", x.numel())
        self.vz: Sym = SX.sym("vz", z.numel())
        self.vu: Sym = SX.sym("vu", u.numel())
        self.az: Sym = SX.sym("az", z.numel())
        self.au: Sym = SX.sym("au", u.numel())
        self.moving: list[Sym] = [x, z, u]
        self.every: Sym = ca.vertcat(x, z, u)
        self.rates: Sym = ca.vertcat(self.vx, self.vz, self.vu)
        self.J: Sym = ca.jacobian(F, x)
        Fz = ca.jacobian(F, z)
        drift = ca.jtimes(F, ca.vertcat(z, u), ca.vertcat(self.vz, self.vu))
        self.first: Sym = ca.jtimes(F, self.every, self.rates)
        self.second: Sym = ca.jtimes(self.first, self.every, self.rates)
        pushed = ca.jtimes(F, ca.vertcat(z, u), ca.vertcat(self.az, self.au))
        self._angles = angles
        turned = self._turned(x, z)
        sines, cosines = SX.sym("sin", len(angles)), SX.sym("cos", len(angles))
        self._trig = (turned, sines, cosines)
        parts = with_trig([F, self.J, Fz, -drift, -(self.second + pushed)], *self._trig)
        self.turns_alone: bool = not ca.depends_on(parts[0], turned)
        """Whether angles are in the equations by their sines and cosines only."""
        at = [x, z, u, q, sines, cosines]
        moving = [self.vx, self.vz, self.vu, self.az, self.au]
        self.value: Graph = ca.Function("value", at, parts[:3])
        self.push: Graph = ca.Function("push", [*at, *moving], parts[3:])

    def _turned(self, x: Sym, z: Sym) -> Sym:
        return ca.vertcat(x, z)[self._angles] if self._angles else SX(0, 1)

    def at(self, x: Sym, z: Sym, u: Sym) -> Any:
        """Return F, J and F_z with the shape's own q."""
        turned = self._turned(x, z)
        return self.value(x, z, u, self.q, ca.sin(turned), ca.cos(turned))

    @cached_property
    def third(self) -> Graph:
        """Right-hand side of the third rates as a function."""
        x, z, u = self.x, self.z, self.u
        ax, jz = SX.sym("ax", x.numel()), SX.sym("jz", z.numel())
        ju = SX.sym("ju", u.numel())
        third = ca.jtimes(self.second, self.every, self.rates)
        third += 3 * ca.jtimes(self.first, self.every, ca.vertcat(ax, self.az, self.au))
        third += ca.jtimes(self.F, ca.vertcat(z, u), ca.vertcat(jz, ju))
        (r3,) = with_trig([-third], *self._trig)
        rates = [self.vx, self.vz, self.vu, ax, self.az, self.au, jz, ju]
        return ca.Function("third", [x, z, u, self.q, *self._trig[1:], *rates], [r3])


@dataclass
class Equations:
    """Equations F(x, z, u; p) = 0, told apart from their numbers.

    ``steps`` are the operations in which an unknown or a driver takes part, ``rows`` the places of
    the results; ``numbers`` are the q as expressions over p, ``noise`` their rounding in units of
    the roundoff.
    """

    function: Graph
    p: Sym
    steps: list[Any] = field(default_factory=list)
    numbers: list[Sym] = field(default_factory=list)
    noise: list[Sym] = field(default_factory=list)
    _known: dict[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Walk the instructions: an operation on numbers alone is a number, others are steps."""
        work: dict[int, Any] = {}
        symbols = self.p.elements()
        rows: list[Any] = [None] * self.function.numel_out(0)
        for code, into, out_of, number in instructions(self.function):
            if code == ca.OP_INPUT:
                k, i = out_of
                work[into[0]] = f"{k}.{i}" if k < 3 else (symbols[i], SX(0))
            elif code == ca.OP_CONST:
                work[into[0]] = (SX(number), SX(0))
            elif code == ca.OP_OUTPUT:
                rows[into[1]] = work[out_of[0]]
            else:
                work[into[0]] = self._step(code, [work[i] for i in out_of])
        self.rows = [self._place(value) for value in rows]

    def _step(self, code: int, inputs: Sequence[Any]) -> tuple[Sym, Sym] | int:
        """Return (expression, noise) of what is a number, else the place of a new step."""
        if all(isinstance(value, tuple) for value in inputs):
            result = symbolic(code, *[value[0] for value in inputs])
            return result, number_rounding(code, result, inputs)
        self.steps.append((code, *map(self._place, inputs)))
        return len(self.steps) - 1

    def _place(self, value: object) -> Any:
        """Return what stands for a value in a step: a symbol, a step, a q, a number."""
        if not isinstance(value, tuple):
            return value
        number, noise = value
        if number.is_constant():
            return (float(number),)
        place = self._known.setdefault(number.element_hash(), len(self.numbers))
        if place == len(self.numbers):
            self.numbers.append(number)
            self.noise.append(noise)
        return f"3.{place}"

    def shape(self, angles: list[int]) -> BlockShape:
        """Return the shape; `angles` are the angles among (x, z)."""
        counts = [*[self.function.numel_in(k) for k in range(3)], len(self.numbers)]
        x, z, u, q = (SX.sym(name, count) for name, count in zip("xzuq", counts, strict=True))
        values: dict[Any, Any] = {
            f"{k}.{i}": symbol
            for k, part in enumerate((x, z, u, q))
            for i, symbol in enumerate(part.elements())
        }

        def at(place: tuple[float] | int | str) -> Sym:
            return SX(place[0]) if isinstance(place, tuple) else values[place]

        for k, (code, *inputs) in enumerate(self.steps):
            operands = [at(place) for place in inputs]
            make = SX.unary if len(operands) == 1 else SX.binary
            values[k] = make(code, *operands)
        F = ca.vertcat(*map(at, self.rows))
        return BlockShape(x, z, u, q, F, angles, shared=True)


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
        self.block: Block = block
        self.cache: StructureCache = StructureCache()
        self.own: list[int] = list(block.x)
        self.uses: list[int] = list(block.uses)
        self.size: int = len(self.own)
        self.rows: int = len(block.units)
        self.redundant: bool = block.redundant
        self.F = block.residual
        self.x: Sym = scene.x[self.own]
        self.z: Sym = scene.x[self.uses] if self.uses else SX(0, 1)
        self.params: list[int] = scene.held(self.F)[2]
        self.p: Sym = scene.model.p[self.params] if self.params else SX(0, 1)
        self._u = scene.u
        self.turning: list[int] = [i for i in self.own if scene.unknowns[i].kind is ANGLE]
        self._angles = self.turning + [i for i in self.uses if scene.unknowns[i].kind is ANGLE]
        self.function: Graph = ca.Function(
            "F", [self.x, self.z, self._u, self.p], [ca.densify(self.F)]
        )
        """The residual (x_b, z, u, p) -> F; p are the block's own parameters."""
        self.reaches: RowReaches | None = self._reaches(scene)
        self.shape: BlockShape = self._shape(scene)

    def _reaches(self, scene: Scene) -> RowReaches | None:
        """Return what bounds the equations of a block in space, None where terms do."""
        return row_reaches(scene, self.F, self.block.reaches, [self.x, self.z, self._u])

    def _shape(self, scene: Scene) -> BlockShape:
        kinds = tuple(scene.unknowns[i].kind for i in (*self.own, *self.uses))
        angles = [i for i, kind in enumerate(kinds) if kind is ANGLE]
        if (
            self.redundant or scene.model.contacts or self.reaches
        ):  # bounds of curves are in the scene's symbols
            self.q: Sym = self.p
            self.noise: Sym = SX.zeros(self.p.numel())
            return BlockShape(self.x, self.z, self._u, self.p, self.F, angles)
        found = Equations(self.function, self.p)
        self.q, self.noise = column(found.numbers), column(found.noise)
        key = (self.size, kinds, self.block.units, tuple(found.steps), tuple(found.rows))
        return scene.cache(key, lambda: found.shape(angles))

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

    def value_at(self, x: Unknowns, u: Floats, p: Floats) -> tuple[Floats, Matrix, Matrix]:
        """Return F (m,), J (m, n) and F_z (m, nz) as arrays at one pose."""
        z = x[self.uses] if self.uses else np.zeros(0)
        turned = x[self._angles]
        inputs = (x[self.own], z, u, p[self.params])
        F, J, Fz = self._dense(*inputs, np.sin(turned), np.cos(turned))
        return F, J.reshape(self.rows, -1), Fz.reshape(self.rows, -1)

    def step_at(self, x: Sym, u: Floats, p: Floats) -> Any:
        """Return Newton's step J^-1 F at one pose, that of least squares of a redundant block."""
        F, J, _ = self.value_at(x, u, p)
        return np.linalg.lstsq(J, F)[0] if self.redundant else np.linalg.solve(J, F)

    def first_rate(
        self, at: Sequence[Sym], known: object, used: Sequence[Sym], driven: Any,
    ) -> Sym:  # fmt: skip
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


def row_reaches(
    scene: Scene, values: Sym, reaches: Sequence[WayProducts | None], moving: list[Sym]
) -> RowReaches | None:
    """Return what bounds scalars by their reaches; None where their terms do, as in the plane."""
    if not any(reach is not None for reach in reaches):
        return None
    (make,) = of_cases("reaches")
    found: RowReaches = make(scene, values, reaches, moving)
    return found if found.any else None


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

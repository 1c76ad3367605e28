"""Bounds of equations and outputs of spatial mechanisms in the unknowns of a scene.

Their reaches speak of coordinates of joints. Those follow from unknowns and drivers by sums with
constant weights, or they were eliminated: what is known of the equation with the constant pivot
bounds the coordinate and its derivatives, and the chain rule the scalar. Other equations are
bounded by majorants.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from mechdae.equations.reduction import Scene
from mechdae.equations.tree.joint_chains import Freedom, WayProduct, WayProducts
from mechdae.kernels.bounds.reaches import bounded
from mechdae.kernels.bounds.walk import majorant
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX
ZERO = SX(0)
DIVIDED = 4
"""Roundings of an equation solved for a coordinate, of its size."""


@dataclass
class Bends:
    """Bounds of some scalars F over y.

    ``first`` (k, n) of their derivatives, ``second`` k matrices (n, n) of the second ones,
    ``rounding`` (k,) of F in units of the roundoff, ``data`` (k,) of its change when each
    parameter changes by its own size.
    """

    first: Any
    second: list[Any]
    rounding: Any
    data: Any


@dataclass
class Reached:
    """Bounds of one scalar over y: ``size`` of itself, the rest as of `Bends`."""

    size: Sym
    first: Any
    second: Any
    rounding: Any
    data: Any

    def plus(self, other: Reached) -> Reached:
        """Return those of the sum of two scalars."""
        return Reached(
            self.size + other.size,
            self.first + other.first,
            self.second + other.second,
            self.rounding + other.rounding,
            self.data + other.data,
        )


class RowReaches:
    """Bounds of scalars whose reaches are known.

    Parameters
    ----------
    scene
    values : SX (k,)
        The scalars, over the scene's unknowns and drivers.
    reaches
        Of each of them; None of one that is bounded by its terms.
    moving : list of SX
        Unknowns and drivers; y are all of them.
    """

    def __init__(
        self, scene: Scene, values: Sym, reaches: Sequence[WayProducts | None], moving: list[Sym]
    ) -> None:
        self.values: Sym = ca.densify(values)
        self.scene: Scene = scene
        self.moving: list[Sym] = moving
        self.y: Sym = ca.vertcat(*moving)
        self.p: Sym = scene.model.p
        self.ends: list[int] = [0, *_ends(moving)]
        self.straight: dict[int, tuple[Sym, Sym, Sym]] = {}
        """Coordinates by their hash: expression, slope by y, what is left at y = 0."""
        self.solved: dict[int, WayProducts] = {}
        """Reaches of the coordinates that follow from an equation, by their hash."""
        self._asked: set[int] = set()
        unslid = [reach if reach is None else reach.unslid for reach in reaches]
        self.reaches: list[WayProducts | None] = [
            r if r is not None and self._known(r) else None for r in unslid
        ]

    @property
    def any(self) -> bool:
        """Whether there is a scalar with a reach."""
        return any(reach is not None for reach in self.reaches)

    def _known(self, reach: WayProducts) -> bool:
        """Return whether all coordinates of a reach are bounded."""
        parts = [part for product in reach.products for part in product.way]
        free = [part for part in parts if isinstance(part, Freedom)]
        return all(self._found(symbol, part.word) for part in free for symbol in part.symbols)

    def _found(self, symbol: Sym, word: str) -> bool:
        """Keep what is known of a coordinate: a sum of unknowns and drivers, or an equation.

        An angle that the scalar does not depend on may hold anything.
        """
        key = symbol.element_hash()
        if key in self.straight or key in self.solved:
            return True
        value = self.scene.expression(symbol)
        slope = ca.jacobian(value, self.y)
        if _others(value, self.y, self.p):
            if word != "turn" or slope.nnz():
                return False
            self.straight[key] = (symbol, slope, ZERO)
            return True
        if not ca.depends_on(slope, self.y):
            rest = ca.substitute(value, self.y, SX.zeros(self.y.numel()))
            self.straight[key] = (value, slope, rest)
            return True
        if key in self._asked:
            return False
        self._asked.add(key)
        reach = self._of_equation(symbol)
        if reach is None or not self._known(reach):
            return False
        self.solved[key] = reach
        return True

    def _of_equation(self, symbol: Sym) -> WayProducts | None:
        """Return the reach of a coordinate that was eliminated by an equation with one."""
        row = self.scene.solved_from.get(symbol.element_hash())
        if row is None or row.reach is None:
            return None
        pivot = ca.jacobian(row.expression, symbol)
        rest = ca.substitute(SX(row.reach.rest), symbol, 0)
        open_ = _others(pivot, SX(0, 1), self.p)
        if open_ or _others(self.scene.expression(rest), self.y, self.p):
            return None
        rest_of: WayProducts = row.reach.without(symbol, -1 / pivot, rest)
        return rest_of

    def bounds(self, sizes: list[Sym], whole: bool) -> Bends:
        """Return bounds for all y of at most these sizes.

        Parameters
        ----------
        sizes
            As `moving`.
        whole
            The sizes are those of a whole sweep: no quaternion is longer than its components may
            be. Else they belong to a place, and its norm is that of the sizes.
        """
        at = BoundsWithin(self, ca.vertcat(*sizes), whole)
        rows = [
            at.by_terms(self.values[k]) if reach is None else at.reached(reach)
            for k, reach in enumerate(self.reaches)
        ]
        first = [ca.densify(row.first) for row in rows]
        return Bends(
            ca.vertcat(*first) if rows else SX(0, self.y.numel()),
            [ca.densify(row.second) for row in rows],
            ca.vertcat(SX(0, 1), *[row.rounding for row in rows]),
            ca.vertcat(SX(0, 1), *[row.data for row in rows]),
        )


class BoundsWithin:
    """Bounds of scalars for all y of at most some sizes (n,); see `RowReaches.bounds`."""

    def __init__(self, rows: RowReaches, size: Sym, whole: bool) -> None:
        self.rows, self.size, self.whole = rows, size, whole
        self.sizes: list[Sym] = ca.vertsplit(size, rows.ends)
        self.n: int = size.numel()
        self._solved: dict[int, Reached] = {}

    def by_terms(self, value: Sym) -> Reached:
        """Return the bounds of a scalar by majorants."""
        rows, n = self.rows, self.n
        slope = ca.jacobian(value, rows.y)
        bend = ca.jacobian(slope.T, rows.y)
        by_p = ca.jacobian(value, rows.p)
        results = []
        for entries in (slope, bend, by_p):
            found, _ = majorant(ca.vertcat(SX(0, 1), *entries.nonzeros()), rows.moving, self.sizes)
            results.append(SX(entries.sparsity(), found) if entries.nnz() else SX(*entries.shape))
        size, rounding = majorant(value, rows.moving, self.sizes, {})
        data = ca.densify(results[2]) @ ca.fabs(rows.p) if rows.p.numel() else ZERO
        bent = ca.densify(ca.reshape(results[1], n, n))
        return Reached(size, ca.densify(results[0]), bent, rounding, data)

    def reached(self, reach: WayProducts) -> Reached:
        """Return the bounds of a scalar with a reach."""
        rest = SX(self.rows.scene.expression(reach.rest))
        total = Reached(ca.fabs(rest), SX(1, self.n), SX(self.n, self.n), ZERO, ZERO)
        if not rest.is_constant():
            total = self.by_terms(rest)
        for product in reach.products:
            total = total.plus(self._along(product))
        return total

    def _along(self, product: WayProduct) -> Reached:
        """Return the bounds of a product along a way, by those of the way's coordinates."""
        found = bounded(product, self._size, self._norm, self.rows.p)
        first, second = SX(1, self.n), SX(self.n, self.n)
        rounding, data = found.rounding, found.data
        if found.symbols:
            D, m = ca.vertcat(*map(self._slope, found.symbols)), ca.vertcat(*found.first)
            first = m.T @ D
            second = D.T @ ca.vertcat(*[ca.horzcat(*r) for r in found.second]) @ D
        for symbol, share in zip(found.symbols, found.first, strict=True):
            bends = self.eliminated(symbol)
            if bends is not None:
                second = second + share * bends.second
            off, moved = self._off(symbol) if bends is None else (bends.rounding, bends.data)
            rounding, data = rounding + share * off, data + share * moved
        return Reached(found.size, first, second, rounding, data)

    def eliminated(self, symbol: Sym) -> Reached | None:
        """Return the bounds of a coordinate that follows from an equation, None of others."""
        key = symbol.element_hash()
        reach = self.rows.solved.get(key)
        if reach is None:
            return None
        if key not in self._solved:
            bounds = self.reached(reach)
            bounds.rounding = bounds.rounding + DIVIDED * bounds.size
            self._solved[key] = bounds
        return self._solved[key]

    def _slope(self, symbol: Sym) -> Sym:
        bends = self.eliminated(symbol)
        return (
            ca.fabs(self.rows.straight[symbol.element_hash()][1]) if bends is None else bends.first
        )

    def _off(self, symbol: Sym) -> tuple[Sym, Sym]:
        """Return how far a sum is off by rounding and by changes of parameters."""
        value = self.rows.straight[symbol.element_hash()][0]
        if value.is_leaf():
            return ZERO, ZERO
        p = self.rows.p
        _, rounding = majorant(value, self.rows.moving, self.sizes, {})
        slope = ca.jacobian(value, p)
        held: list[Sym] = slope.nonzeros()
        entries, _ = majorant(ca.vertcat(SX(0, 1), *held), self.rows.moving, self.sizes)
        columns = slope.sparsity().get_triplet()[1]
        return rounding, sum((entries[i] * ca.fabs(p[j]) for i, j in enumerate(columns)), ZERO)

    def _size(self, symbol: Sym) -> Sym:
        bends = self.eliminated(symbol)
        if bends is not None:
            return bends.size
        _, slope, rest = self.rows.straight[symbol.element_hash()]
        return (ca.fabs(slope) @ self.size + ca.fabs(rest))[0]

    def _norm(self, ball: Freedom) -> Sym:
        parts = ca.vertcat(*map(self._size, ball.symbols))
        return ca.mmax(parts) if self.whole else ca.sqrt(ca.sumsqr(parts))


def _ends(moving: list[Sym]) -> list[int]:
    ends, count = [], 0
    for part in moving:
        count += part.numel()
        ends.append(count)
    return ends


def _others(value: Sym, y: Sym, p: Sym) -> bool:
    """Return whether an expression holds symbols that are neither moving nor parameters."""
    known = {s.element_hash() for part in (y, p) for s in part.elements()}
    return any(s.element_hash() not in known for s in ca.symvar(SX(value)))

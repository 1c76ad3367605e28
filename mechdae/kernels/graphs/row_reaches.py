"""Bounds of equations and outputs of spatial mechanisms in the unknowns of a scene.

Their reaches speak of coordinates of joints; where those follow from unknowns and drivers by sums
with constant weights, so do the bounds. Other equations are bounded by majorants.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import casadi as ca

from mechdae.kernels.bounds.majorant import majorant
from mechdae.kernels.bounds.reaches import Bounded, bounded
from mechdae.model.reduction import Scene
from mechdae.model.tree.ways import Freedom, WayProducts
from mechdae.records import dataclass

SX = ca.SX
ZERO = SX(0)


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
        self, scene: Scene, values: Any, reaches: Sequence[WayProducts | None], moving: list[Any]
    ) -> None:
        self.scene, self.values, self.moving = scene, ca.densify(values), moving
        self.y, self.p = ca.vertcat(*moving), scene.model.p
        self._known: dict[int, tuple[Any, Any, Any]] = {}
        self.reaches = [
            reach if reach is not None and self._straight(reach) else None for reach in reaches
        ]

    @property
    def any(self) -> bool:
        """Whether there is a scalar with a reach."""
        return any(reach is not None for reach in self.reaches)

    def _straight(self, reach: WayProducts) -> bool:
        """Return whether all coordinates of a reach are sums of unknowns and drivers."""
        parts = [part for product in reach.products for part in product.way]
        free = [part for part in parts if isinstance(part, Freedom)]
        return all(self._found(symbol, part.word) for part in free for symbol in part.symbols)

    def _found(self, symbol: Any, word: str) -> bool:
        """Keep a coordinate's expression, its slope by y, what it is at y = 0, if it is straight.

        An angle that the scalar does not depend on may hold anything.
        """
        key = symbol.element_hash()
        if key not in self._known:
            value = self.scene.expression(symbol)
            slope = ca.jacobian(value, self.y)
            if _others(value, self.y, self.p):
                if word != "turn" or slope.nnz():
                    return False
                self._known[key] = (symbol, slope, ZERO)
                return True
            if ca.depends_on(slope, self.y):
                return False
            rest = ca.substitute(value, self.y, SX.zeros(self.y.numel()))
            self._known[key] = (value, slope, rest)
        return True

    def bounds(self, sizes: list[Any], whole: bool) -> Bends:
        """Return bounds for all y of at most these sizes.

        Parameters
        ----------
        sizes
            As `moving`.
        whole
            The sizes are those of a whole sweep: no quaternion is longer than its components may
            be. Else they belong to a place, and its norm is that of the sizes.
        """
        size = ca.vertcat(*sizes)
        n, rows = size.numel(), []
        for k, reach in enumerate(self.reaches):
            own = self._terms(k, sizes) if reach is None else self._reached(reach, size, whole)
            rows.append(own)
        first = ca.vertcat(*[row[0] for row in rows]) if rows else SX(0, n)
        return Bends(
            first,
            [row[1] for row in rows],
            ca.vertcat(SX(0, 1), *[row[2] for row in rows]),
            ca.vertcat(SX(0, 1), *[row[3] for row in rows]),
        )

    def _terms(self, k: int, sizes: list[Any]) -> tuple[Any, Any, Any, Any]:
        return self._by_terms(self.values[k], sizes)

    def _by_terms(self, value: Any, sizes: list[Any]) -> tuple[Any, Any, Any, Any]:
        """Return the bounds of a scalar by majorants."""
        n = self.y.numel()
        slope = ca.jacobian(value, self.y)
        bend = ca.jacobian(slope.T, self.y)
        by_p = ca.jacobian(value, self.p)
        results = []
        for entries in (slope, bend, by_p):
            found, _ = majorant(ca.vertcat(SX(0, 1), *entries.nonzeros()), self.moving, sizes)
            results.append(SX(entries.sparsity(), found) if entries.nnz() else SX(*entries.shape))
        _, rounding = majorant(value, self.moving, sizes, {})
        data = ca.densify(results[2]) @ ca.fabs(self.p) if self.p.numel() else ZERO
        return ca.densify(results[0]), ca.densify(ca.reshape(results[1], n, n)), rounding, data

    def _reached(self, reach: WayProducts, size: Any, whole: bool) -> tuple[Any, Any, Any, Any]:
        n = self.y.numel()
        rest = SX(self.scene.expression(reach.rest))
        first, second, rounding, data = SX(1, n), SX(n, n), ZERO, ZERO
        if not rest.is_constant():
            sizes = ca.vertsplit(size, [0, *_ends(self.moving)])
            first, second, rounding, data = self._by_terms(rest, sizes)
        for product in reach.products:
            found = bounded(
                product, partial(self._size, size), partial(self._norm, size, whole), self.p
            )
            if found.symbols:
                slopes = [ca.fabs(self._known[s.element_hash()][1]) for s in found.symbols]
                D, m = ca.vertcat(*slopes), ca.vertcat(*found.first)
                first = first + m.T @ D
                second = second + D.T @ ca.vertcat(*[ca.horzcat(*r) for r in found.second]) @ D
            off, moved = self._off(found, size)
            rounding, data = rounding + found.rounding + off, data + found.data + moved
        return ca.densify(first), ca.densify(second), rounding, data

    def _off(self, found: Bounded, size: Any) -> tuple[Any, Any]:
        """Return how rounding and changes of parameters reach a product by its coordinates."""
        off, moved = ZERO, ZERO
        sizes = ca.vertsplit(size, [0, *_ends(self.moving)])
        for symbol, share in zip(found.symbols, found.first, strict=True):
            value = self._known[symbol.element_hash()][0]
            if value.is_leaf():
                continue
            _, rounding = majorant(value, self.moving, sizes, {})
            slope = ca.jacobian(value, self.p)
            held: list[Any] = slope.nonzeros()
            entries, _ = majorant(ca.vertcat(SX(0, 1), *held), self.moving, sizes)
            columns = slope.sparsity().get_triplet()[1]
            change = sum((entries[i] * ca.fabs(self.p[j]) for i, j in enumerate(columns)), ZERO)
            off, moved = off + share * rounding, moved + share * change
        return off, moved

    def _size(self, size: Any, symbol: Any) -> Any:
        _, slope, rest = self._known[symbol.element_hash()]
        return (ca.fabs(slope) @ size + ca.fabs(rest))[0]

    def _norm(self, size: Any, whole: bool, ball: Freedom) -> Any:
        parts = ca.vertcat(*[self._size(size, symbol) for symbol in ball.symbols])
        return ca.mmax(parts) if whole else ca.sqrt(ca.sumsqr(parts))


def _ends(moving: list[Any]) -> list[int]:
    ends, count = [], 0
    for part in moving:
        count += part.numel()
        ends.append(count)
    return ends


def _others(value: Any, y: Any, p: Any) -> bool:
    """Return whether an expression holds symbols that are neither moving nor parameters."""
    known = {s.element_hash() for part in (y, p) for s in part.elements()}
    return any(s.element_hash() not in known for s in ca.symvar(SX(value)))

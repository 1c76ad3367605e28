"""Steps of the path that are proved around its power series, where those around tangents fail.

Over a step s + t h, 0 <= t <= 1, block by block the unknowns are a polynomial p(t), the inverse of
the Jacobian is nearly a polynomial Y(t), and

    | x - Y(t) F(x) - p(t) | <= g + (D + B r) r   for   | x - p(t) | <= r,

entry by entry, with g >= |Y F(p)|, D >= |1 - Y J(p)| and B r a bound of what Y J changes in the
box. Where the right-hand side is at most r, the box holds one solution for each t and no other
one. What F(p) and Y J(p) leave is what the series leave out: the step is bounded by the distance
of the nearest singular pose, not by the square of the condition number.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.series import (
    BoundedPolynomial,
    NoSeries,
    SeriesFunction,
    coefficients,
    inverse,
    times,
)
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Call, without_repeats
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.types import Floats, Matrices, Matrix

ORDER = 16
"""Coefficients of a series."""
GROWING = (6, 12, ORDER)
"""Coefficients that Newton's method finds one after the other; it begins with three."""
LAST = 1e-10
"""Natural sizes of the unknowns that the last coefficients may have over a step."""
HALVINGS = 6
INFLATED = 1.5
"""Share by which a box is larger than what it must hold."""
BOXES = 8
"""Boxes that are tried for a step."""
ROUNDED = 2.0
"""Bounds of the rounding of F at a pose that are allowed to F along a series."""
NARROW = 0.5
"""Natural sizes that a box may have."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """A proved step: unknowns c_0 + c_1 t + ... with ``c`` (k, nx), within ``radius`` (nx,)."""

    s: float
    step: float
    c: Matrix
    radius: Floats

    def at(self, share: float) -> Any:
        """Return the unknowns (nx,) at a share of the step."""
        return np.polynomial.polynomial.polyval(share, self.c)


class Expansion:
    """Proves steps of a path along straight lines in the drivers' values.

    Parameters
    ----------
    graphs, constants
        Functions and numbers of the scene.
    sizes : (nx,) array
        Natural sizes of the unknowns.
    """

    def __init__(self, graphs: Graphs, constants: Constants, sizes: Floats) -> None:
        self.graphs: Graphs = graphs
        self.constants: Constants = constants
        self.sizes: Floats = sizes
        self._bounds: dict[int, tuple[Any, Any, Any, Any]] = {}
        self._numbers: dict[int, Any] = {}

    def _function(self, b: int) -> SeriesFunction | None:
        """Return F and J of a block for series, None where it has no such form."""

        def make() -> SeriesFunction | None:
            graph = self.graphs.blocks[b]
            inputs = [graph.x, graph.z, self.graphs.scene.u, graph.p]
            results = [ca.densify(graph.F), ca.densify(ca.vec(graph.J))]
            if graph.redundant or self.graphs.course is not None:
                return None
            try:
                return SeriesFunction(without_repeats("FJ", inputs, results), (3,))
            except NoSeries:
                return None

        return self.graphs.cache(("series", b), make)

    def _bound(self, b: int) -> tuple[Matrices, Matrices, Floats, Floats]:
        """Return bounds of a block.

        |dJ/dx| (n, n, n), |dJ/dz| (n, n, nz), |dF/dz| (n, nz), rounding of F (n,).
        """
        if b not in self._bounds:
            n, numbers = self.graphs.blocks[b].size, self.constants
            call = self.graphs.cache(("bends", b), lambda: Call(self.graphs.bends(b)))
            parts = call(numbers.size_x, numbers.size_u, numbers.p)
            jx, jz, fz = (np.asarray(part).ravel() for part in parts)
            units = self.graphs.units(numbers.scale, numbers.p)[1][b]
            self._bounds[b] = (
                jx.reshape(n, n, n, order="F"),
                jz.reshape(n, n, -1, order="F"),
                fz.reshape(n, -1, order="F"),
                ROUNDED * numbers.rho[b] * units,
            )
        return self._bounds[b]

    def stretch(
        self,
        state: Floats,
        s: float,
        u: Floats,
        d: Floats,
        step: float,
        least: float,
        blocks: list[int],
    ) -> Stretch | None:
        """Return a proved step of at most `step` and not less than `least`, None without one.

        Parameters
        ----------
        state
            A node: unknowns and their first two derivatives with respect to s come first.
        u, d : (nd,) arrays
            The drivers' values at s and their rates.
        blocks
            The blocks to be proved, in solve order, with all that they depend on.
        """
        if any(self._function(b) is None for b in blocks):
            return None
        nx = self.graphs.nx
        c = np.zeros((ORDER, nx))
        c[:3] = state[:nx], state[nx : 2 * nx] * step, state[2 * nx : 3 * nx] * (step * step / 2)
        if not np.isfinite(c[:, [i for b in blocks for i in self.graphs.blocks[b].own]]).all():
            return None
        try:
            with np.errstate(all="ignore"):
                for b in blocks:
                    self._expand(b, c, u, d * step)
                share = self._share(c, blocks)
                for _ in range(HALVINGS):
                    if not abs(share * step) >= least:
                        return None
                    scaled = c * share ** np.arange(ORDER)[:, None]
                    radius = self._radius(scaled, u, d * (share * step), blocks)
                    if radius is not None:
                        return Stretch(s, share * step, scaled, radius)
                    share /= 2
        except np.linalg.LinAlgError:
            pass
        return None

    def _values(
        self, b: int, c: Floats, u: Floats, d: Floats, count: int
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Return F (count, n) and J (count, n, n) along a polynomial, and what they leave out."""
        graph, function = self.graphs.blocks[b], self._function(b)
        assert function is not None
        polynomials = [BoundedPolynomial(c[:count, i].copy()) for i in graph.own]
        z = [BoundedPolynomial(c[:count, i].copy()) for i in graph.uses]
        driven: list[BoundedPolynomial | float] = []
        for value, rate in zip(u, d, strict=True):
            line = np.zeros(count)
            line[:2] = value, rate
            driven.append(BoundedPolynomial(line) if rate else float(value))
        values = [polynomials, z, driven, self.constants.p[graph.params].tolist()]
        if b not in self._numbers:
            self._numbers[b] = function.numbers(values)
        F, J = function(values, self._numbers[b])
        (f, ef), (j, ej) = coefficients(F, count), coefficients(J, count)
        n = graph.size
        return f, ef, j.reshape(count, n, n).transpose(0, 2, 1), ej.reshape(n, n).T

    def _expand(self, b: int, c: Floats, u: Floats, d: Floats) -> None:
        """Write the coefficients of a block's unknowns by Newton's method on power series."""
        unknowns = self.graphs.blocks[b].own
        for count in GROWING:
            f, _, j, _ = self._values(b, c, u, d, count)
            c[:count, unknowns] -= times(inverse(j, count), f[:, :, None], count)[:, :, 0]

    def _share(self, c: Floats, blocks: list[int]) -> float:
        """Return the share of the step over which the last coefficients are small."""
        unknowns = [i for b in blocks for i in self.graphs.blocks[b].own]
        size = np.abs(c[:, unknowns] / self.sizes[unknowns]).max(axis=1)
        last = (ORDER - 2, ORDER - 1)
        return float(min((LAST / size[k]) ** (1 / k) if size[k] > LAST else 1.0 for k in last))

    def _radius(self, c: Floats, u: Floats, d: Floats, blocks: list[int]) -> Floats | None:
        """Return how far the solutions may be from the polynomial (nx,), None: not proved."""
        radius = np.zeros(self.graphs.nx)
        for b in blocks:
            graph = self.graphs.blocks[b]
            f, ef, j, ej = self._values(b, c, u, d, ORDER)
            Y = inverse(j, ORDER)
            size = np.abs(Y).sum(axis=0)
            product = times(Y, j, 2 * ORDER - 1)
            product[0] -= np.eye(graph.size)
            away = np.abs(product).sum(axis=0) + size @ ej
            jx, jz, fz, rounding = self._bound(b)
            earlier = radius[graph.uses]
            g = size @ (np.abs(f).sum(axis=0) + ef + rounding + fz @ earlier)
            away = away + size @ (jz @ earlier)
            r = INFLATED * g
            for _ in range(BOXES):
                needed = g + (away + size @ (jx @ r)) @ r
                if not np.all(needed <= NARROW * self.sizes[graph.own]):
                    return None
                if np.all(needed <= r):
                    break
                r = INFLATED * needed
            else:
                return None
            radius[graph.own] = r
        return radius

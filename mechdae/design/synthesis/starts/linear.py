"""Variable projection for any mechanism: parameters that only place the traced point.

A parameter that enters no closure equation (an offset of the coupler point, a common shift of
the fixed pivots) moves the point linearly while the poses stay. Such parameters are not drawn
but fitted to the targets, all samples at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.design.synthesis.space import DesignSpace
from mechdae.kernels.run.functions import Batch
from mechdae.numerics.linear_fits import linear_fit
from mechdae.types import Booleans, Floats, Matrices, Sym

if TYPE_CHECKING:
    from numpy.random import Generator


SX = ca.SX
NOTHING = 1e-12
RIDGE = 1e-8


class Linear:
    """The parameters of a space in which an asked value is linear at given poses.

    ``places``: their places among the free parameters. ``wide``: how many of the asked values are
    coordinates of a place: these are fitted.
    """

    def __init__(self, space: DesignSpace, what: str, wide: int = 2) -> None:
        self.space, self.wide = space, wide
        poses = space.poses
        n, nd = len(space.box), len(space.names)
        self._x, self._u, self._d = SX.sym("x", poses.nx), SX.sym("u"), SX.sym("d", nd)
        F, _, values = poses.function(self._x, self._u, self._d)
        value = poses.part(values, what)
        slopes = ca.densify(ca.jacobian(ca.vertcat(F / space.units, value), self._d))
        inputs = [self._x, self._u, self._d]
        function = ca.Function("slopes", inputs, [slopes, ca.densify(value)])
        generator = np.random.default_rng(0)
        low, high = space.box.T
        found = []
        for _ in range(3):
            d = np.concatenate([generator.uniform(low, high), space.middle[n:]])
            x = generator.uniform(-2, 2, poses.nx) * space.natural
            found.append(np.array(function(x, generator.uniform(0, 6), d)[0]))
        rows = F.numel()
        closed = [np.abs(slope[:rows, :n]).max(axis=0, initial=0.0) for slope in found]
        moves = [np.abs(slope[rows:, :n]).max(axis=0) for slope in found]
        enters = np.max(closed, axis=0) > NOTHING
        # angles of a body cannot be shifted linearly; a point's coordinates can
        bent = self._bent(value, inputs, n, generator)
        self.places = np.flatnonzero(~enters & (np.min(moves, axis=0) > NOTHING) & ~bent)
        chosen = [int(k) for k in self.places]
        self._function = ca.Function("point", inputs, [ca.vec(slopes[rows:, chosen])])
        self.width = value.numel()

    def _bent(self, value: Sym, inputs: list[Sym], n: int, generator: Generator) -> Booleans:
        """Return which parameters a value depends on other than linearly."""
        low, high = self.space.box.T
        d = inputs[2]
        curved = np.zeros(n, bool)
        for row in ca.vertsplit(value):
            bends = ca.Function("bends", inputs, [ca.densify(ca.hessian(row, d)[0])])
            for _ in range(2):
                at = np.concatenate([generator.uniform(low, high), self.space.middle[n:]])
                x = generator.uniform(-2, 2, inputs[0].numel())
                matrix = np.array(bends(x, generator.uniform(0, 6), at))[:n, :n]
                scaled = np.abs(matrix) * self.space.size
                curved |= (np.diag(scaled) > NOTHING) | (scaled[:, :n].sum(axis=1) > NOTHING)
        return curved

    def fitted(
        self, d: Floats, u: Any, x: Matrices, places: Any, targets: Any, weights: Any
    ) -> tuple[Floats, ...]:
        """Return designs (n, nd) fitted to targets (k, w), and the places (n, k, w) they give."""
        if not len(self.places) or not len(d):
            return d, places
        n, k = u.shape
        m = len(self.places)
        flat = [x.reshape(n * k, x.shape[-1]), u.reshape(-1, 1), np.repeat(d, k, axis=0)]
        slopes = Batch(self._function, ())(*flat)[0]
        # columns of a dense Jacobian lie one after another
        A = slopes.reshape(n, k, m, self.width).transpose(0, 1, 3, 2)[:, :, : self.wide]
        gap = targets[None, :, : self.wide] - places[..., : self.wide]
        w = np.sqrt(np.asarray(weights))[None, :, None]
        rows = (A * w[..., None]).reshape(n, -1, m)
        sizes = self.space.scale[self.places]
        step = linear_fit(rows, (gap * w).reshape(n, -1), ridge=RIDGE, sizes=sizes)
        low, high = self.space.box[self.places].T
        new = d.copy()
        new[:, self.places] = np.clip(d[:, self.places] + step, low, high)
        moved = np.einsum("nkwi,ni->nkw", A, new[:, self.places] - d[:, self.places])
        result = places.copy()
        result[..., : self.wide] += moved
        return new, result

"""Variable projection for mechanisms that may be shifted, turned and enlarged.

Where free parameters shift the whole mechanism, turn it, and give all of its lengths, a traced
point is P = t + alpha p + beta e with complex t, alpha, beta: p is the path of the point's
foot, e the direction of its body, both of a mechanism of any size in any place. What is left
to be drawn are ratios and phases; the rest is a linear least squares problem, all samples at
once. Which parameters do what is measured at random poses, whatever they are called.

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
from mechdae.numerics.null_space import linear_fit
from mechdae.types import Booleans, Floats, Integers, Matrices, Sym, Unknowns

if TYPE_CHECKING:
    from numpy.random import Generator

NO_EFFECT = 1e-12
LINEAR_RIDGE = 1e-8
SX = ca.SX
NOTHING = 1e-9
TESTS = 3
RIDGE = 1e-10


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
        enters = np.max(closed, axis=0) > NO_EFFECT
        # angles of a body cannot be shifted linearly; a point's coordinates can
        bent = self._bent(value, inputs, n, generator)
        self.places: Integers = np.flatnonzero(
            ~enters & (np.min(moves, axis=0) > NO_EFFECT) & ~bent
        )
        chosen = [int(k) for k in self.places]
        self._function = ca.Function("point", inputs, [ca.vec(slopes[rows:, chosen])])
        self.width: int = value.numel()

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
                curved |= (np.diag(scaled) > NO_EFFECT) | (scaled[:, :n].sum(axis=1) > NO_EFFECT)
        return curved

    def fitted(
        self, d: Floats, u: Any, x: Matrices, places: Any, targets: Any, weights: object
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
        step = linear_fit(rows, (gap * w).reshape(n, -1), ridge=LINEAR_RIDGE, sizes=sizes)
        low, high = self.space.box[self.places].T
        new = d.copy()
        new[:, self.places] = np.clip(d[:, self.places] + step, low, high)
        moved = np.einsum("nkwi,ni->nkw", A, new[:, self.places] - d[:, self.places])
        result = places.copy()
        result[..., : self.wide] += moved
        return new, result


class Similar:
    """What moves a mechanism as a whole.

    ``lengths``: which free parameters (nd,) are all of its lengths; none where some are fixed.
    ``shift``, ``turn``, ``offsets``: places of the parameters that shift it along x and y, that
    turn it, and that place the point along and across a direction of its body; None where there are
    none.
    """

    def __init__(self, space: DesignSpace, what: str) -> None:
        self.space, self.what = space, what
        poses = space.poses
        nd = len(space.names)
        x, u, d = SX.sym("x", poses.nx), SX.sym("u"), SX.sym("d", nd)
        F, _, values = poses.function(x, u, d)
        value = poses.part(values, what)[:2]
        slopes = ca.densify(ca.jacobian(value, d))
        inputs = [x, u, d]
        self._function = ca.Function("point", inputs, [ca.vec(slopes), ca.densify(value)])
        self._closure = ca.Function("closure", inputs, [F / space.units, ca.jacobian(F, d)])
        self._samples = self._drawn(np.random.default_rng(0))
        self.shift: tuple[int, int] | None = self._shift()
        self.offsets: tuple[int, int] | None = self._offsets()
        self.lengths: Booleans = self._lengths()
        self.turn: int | None = self._turn()

    def _drawn(self, generator: Generator) -> list[tuple[Floats, float, Floats]]:
        space, n = self.space, len(self.space.box)
        low, high = space.box.T
        found = []
        for _ in range(TESTS):
            d = np.concatenate([generator.uniform(low, high), space.middle[n:]])
            x = generator.uniform(-2, 2, space.poses.nx) * space.natural
            found.append((x, float(generator.uniform(0, 6)), d))
        return found

    def _at(self, x: Unknowns, u: float, d: Floats) -> tuple[Any, Any, Any]:
        """Return slopes (nd,) of the point as complex numbers, the point, the closure (nx,)."""
        slopes, value = (np.array(part) for part in self._function(x, u, d))
        pairs = slopes.reshape(-1, 2)
        place = value.ravel()
        left = np.array(self._closure(x, u, d)[0]).ravel()
        return pairs[:, 0] + 1j * pairs[:, 1], complex(place[0], place[1]), left

    def _free_of_closure(self, k: int) -> bool:
        return all(
            np.abs(np.array(ca.DM(self._closure(*sample)[1]))[:, k]).max(initial=0.0) < NOTHING
            for sample in self._samples
        )

    def _all(self, k: int, wanted: complex) -> bool:
        return all(abs(self._at(*sample)[0][k] - wanted) < NOTHING for sample in self._samples)

    def _shift(self) -> tuple[int, int] | None:
        count = len(self.space.box)
        found = []
        for wanted in (1, 1j):
            usable = [k for k in range(count) if self._all(k, wanted) and self._free_of_closure(k)]
            if len(usable) != 1:
                return None
            found.append(usable[0])
        return found[0], found[1]

    def _offsets(self) -> tuple[int, int] | None:
        """Return two parameters whose slopes have length one and are at right angles."""
        count = len(self.space.box)
        units = [
            k for k in range(count)
            if (self.shift is None or k not in self.shift) and self._free_of_closure(k)
            and all(abs(abs(self._at(*sample)[0][k]) - 1) < NOTHING for sample in self._samples)
        ]  # fmt: skip
        for a in units:
            for b in units:
                turned = [self._at(*s)[0][b] - 1j * self._at(*s)[0][a] for s in self._samples]
                if np.abs(turned).max() < NOTHING:
                    return a, b
        return None

    def _lengths(self) -> Booleans:
        """Return the parameters that enlarge the mechanism: all but the angles, or none."""
        n = len(self.space.box)
        chosen = ~self.space.periodic
        for x, u, d in self._samples:
            large = d.copy()
            large[:n][chosen] *= 2
            both = np.where(self.space.turns, x, 2 * x)
            _, place, left = self._at(x, u, d)
            _, second, more = self._at(both, u, large)
            if abs(second - 2 * place) > NOTHING * self.space.size:
                return np.zeros(n, bool)
            if np.abs(more - 2 * left)[self.space.rows_of_length].max(initial=0.0) > NOTHING:
                return np.zeros(n, bool)
        return chosen

    def _turn(self) -> int | None:
        """Return the parameter that turns the mechanism about its shifted origin."""
        for k in range(len(self.space.box)):
            if self.lengths[k] or (self.shift and k in self.shift):
                continue
            good = True
            for x, u, d in self._samples:
                moved = d.copy()
                moved[k] += 0.7
                turned = np.where(self.space.turns, x + 0.7, x)
                origin = complex(*[d[i] for i in self.shift]) if self.shift else 0j
                _, place, left = self._at(x, u, d)
                _, second, more = self._at(turned, u, moved)
                wanted = origin + (place - origin) * np.exp(0.7j)
                near = abs(second - wanted) < NOTHING * self.space.size
                alike = abs(np.linalg.norm(more) - np.linalg.norm(left)) < NOTHING
                good &= bool(near and alike)
            if good:
                return k
        return None

    @property
    def available(self) -> bool:
        """Whether there is more to fit than offsets and shifts, which are linear anyway."""
        return bool(self.lengths.any())

    # -- the fit -----------------------------------------------------------------------------

    def neutral(self, d: Floats) -> Any:
        """Return designs (n, nd) at the origin, not turned, with the point at its foot."""
        new = d.copy()
        for k in [*(self.shift or ()), *(self.offsets or ())]:
            new[:, k] = 0.0
        if self.turn is not None:
            new[:, self.turn] = 0.0
        return new

    def at(self, d: Floats, u: Floats, x: Matrices) -> tuple[Any, Any]:
        """Return foot p and direction e of the point's body (n, k) at poses of neutral designs."""
        n, k = u.shape
        flat = [x.reshape(n * k, x.shape[-1]), u.reshape(-1, 1), np.repeat(d, k, axis=0)]
        slopes, values = Batch(self._function, ())(*flat)
        p = (values[:, 0] + 1j * values[:, 1]).reshape(n, k)
        if self.offsets is None:
            return p, np.zeros((n, k), complex)
        a = self.offsets[0]
        return p, (slopes[:, 2 * a] + 1j * slopes[:, 2 * a + 1]).reshape(n, k)

    def fitted(
        self, d: Any, u: Any, x: Any, targets: Any, weights: Any
    ) -> tuple[Any, Any, Any, Any]:
        """Return designs, unknowns, places, and by how much bounds are exceeded.

        `d`, `u`, `x`: neutral designs (n, nd) with their poses (n, k), (n, k, nx). `targets` (k,
        2). `weights` (k,).

        Returns
        -------
        d, x, places (n, k, 2), beyond (n,)
            ``beyond`` in sizes of the mechanism; designs are clipped to their bounds.
        """
        n, k = u.shape
        p, e = self.at(d, u, x)
        columns = [] if self.shift is None else [np.ones((n, k)), 1j * np.ones((n, k))]
        start = len(columns)
        columns += [p] if self.turn is None else [p, 1j * p]
        after = len(columns)
        if self.offsets is not None:
            columns += [e, 1j * e]
        A = np.stack(columns, axis=2) * np.sqrt(weights)[:, None]
        P = (targets[:, 0] + 1j * targets[:, 1]) * np.sqrt(weights)
        stacked = np.concatenate([A.real, A.imag], axis=1)
        b = np.concatenate([P.real, P.imag])
        sizes = np.full(len(columns), self.space.size)
        sizes[start:after] = 1.0  # the path itself has the mechanism's size
        c = linear_fit(stacked, b, ridge=RIDGE, sizes=sizes)
        alpha = c[:, start] + (1j * c[:, start + 1] if self.turn is not None else 0j)
        grown = np.abs(alpha) if self.turn is not None else c[:, start]
        new, poses = d.copy(), x.copy()
        lengths = np.flatnonzero(self.lengths)
        new[:, lengths] *= grown[:, None]
        if self.shift is not None:
            new[:, list(self.shift)] = c[:, :2]
        angle = np.angle(alpha) if self.turn is not None else np.zeros(n)
        if self.turn is not None:
            new[:, self.turn] = angle
        if self.offsets is not None:
            beta = (c[:, after] + 1j * c[:, after + 1]) * np.exp(-1j * angle)
            # the direction of the body at the neutral place turns with the mechanism
            new[:, self.offsets[0]], new[:, self.offsets[1]] = beta.real, beta.imag
        poses = np.where(
            self.space.turns, poses + angle[:, None, None], poses * grown[:, None, None]
        )
        places = np.einsum("nki,ni->nk", np.stack(columns, axis=2), c)
        low, high = self.space.box.T
        free = new[:, : len(low)]
        over = np.maximum(free - high, 0) + np.maximum(low - free, 0)
        beyond = np.sum((over / self.space.scale) ** 2, axis=1)
        beyond[grown <= 0] = np.inf
        new[:, : len(low)] = np.clip(free, low, high)
        return new, poses, np.stack([places.real, places.imag], axis=2), beyond

"""Right-hand side and projection of the motion: one kernel for all scenes.

    [M, J^T; J, -E] [a; lambda] = [f; gamma],   E = eps diag(size of J M^-1 J^T)

solved by its range-space form and corrected six times with the right-hand side [0; E lambda].
What E takes away along a direction with singular value s of the scaled J M^(-1/2) is
(eps/(s^2 + eps))^7 of it: regular directions are exact, along superfluous ones the multiplier is
the shortest, and no decision about the rank is taken. Where M is singular, M + J^T W J takes its
place, with f + J^T W gamma: the same solution for any W.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.sparse import Factor, entries
from mechdae.model.released import Released

SX = ca.SX
EPSILON = 1e-8
PASSES = 6
"""Corrections of the multipliers."""
DEFINITE = 1e-9
"""Least eigenvalue of the scaled mass matrix that counts as definite."""
NEWTON = 2
"""Steps of a projection to the constraints, and of one to their rates."""


class Kernel:
    """Functions of the equations of motion with numbers for the parameters.

    Parameters
    ----------
    released
        The equations in symbols.
    p
        Values of the parameters.
    sizes
        Natural sizes of the coordinates x.
    length
        By which gaps are measured [m].
    """

    def __init__(self, released: Released, p: Any, sizes: Any, length: float) -> None:
        self.released, self.sizes = released, np.asarray(sizes, float)
        self.length = length
        self.p = ca.DM(p)
        self.n, self.m = released.x.numel(), released.phi.numel()
        self.t, self.x, self.v, self.signs = (
            released.t,
            released.x,
            released.v,
            released.signs,
        )
        self._eps: Any = None
        self._weights: Any = None

    # -- the parts -----------------------------------------------------------------------------

    def function(self, name: str, results: Sequence[Any], more: Sequence[Any] = ()) -> Any:
        """Return the function (t, x, v, signs, ...) with the parameters' values put in."""
        at = [self.t, self.x, self.v, self.signs, *more]
        general = ca.Function(name, [*at, self.released.model.p], list(results))
        return ca.Function(name, at, general.call([*at, self.p]), {"cse": True})

    @cached_property
    def place(self) -> Any:
        """(t, x, v, signs) -> phi, J, phi_t."""
        r = self.released
        return self.function("place", [ca.densify(r.phi), r.J, ca.densify(r.phi_t)])

    @cached_property
    def parts(self) -> Any:
        """(t, x, v, signs) -> M, f, J, gamma."""
        r = self.released
        return self.function("parts", [r.M, r.f, r.J, ca.densify(r.gamma)])

    def scale(self, t: float, x: Any, v: Any, signs: Any) -> None:
        """Fix the scalings at a pose."""
        M, _, J, _ = (np.array(ca.DM(part)) for part in self.parts(t, x, v, signs))
        ends = np.diag(M).copy()
        whole = ends / self.sizes**2 if self.n else ends
        mean = whole[ends > 0].mean() if (ends > 0).any() else 1.0
        ends[ends <= 0] = mean * self.sizes[ends <= 0] ** 2
        inverse = 1 / np.sqrt(ends)
        scaled = M * np.outer(inverse, inverse)
        rows = np.sum((J * inverse) ** 2, axis=1)
        least = 1e-12 * rows.max(initial=0.0)
        rows = np.where(rows > least, rows, rows.mean() if self.m and rows.any() else 1.0)
        self._eps = EPSILON * rows
        definite = self.n == 0 or np.linalg.eigvalsh(scaled)[0] > DEFINITE
        self._weights = None if definite else 1 / rows

    # -- solutions -------------------------------------------------------------------------

    @cached_property
    def rhs(self) -> Any:
        """(t, x, v, signs) -> x'', lambda."""
        at = [self.t, self.x, self.v, self.signs]
        M, f, J, gamma = self.parts(*at)
        solver = _Solver(M, J, self._eps, self._weights)
        if self._weights is not None:
            f = f + J.T @ (ca.DM(self._weights) * gamma)
        a, lam = solver.solve(f, gamma)
        return ca.Function("rhs", at, [ca.densify(a), ca.densify(lam)], {"cse": True})

    @cached_property
    def project(self) -> Any:
        """(t, x, v, signs) -> x and v on the constraints, what is left of them."""
        at = [self.t, self.x, self.v, self.signs]
        if not self.m:
            return ca.Function("project", at, [self.x, self.v, SX(0)])
        M, _, J, _ = self.parts(*at)
        solver = _Solver(M, J, self._eps, self._weights)
        x, v = self.x, self.v
        for _ in range(NEWTON):
            phi = self.place(self.t, x, v, self.signs)[0]
            x = x - solver.shortest(phi)
        phi, J, phi_t = self.place(self.t, x, v, self.signs)
        for _ in range(NEWTON):
            v = v - solver.shortest(J @ v + phi_t)
        miss = ca.mmax(ca.fabs(phi) / ca.DM(self.gaps))
        return ca.Function("project", at, [x, v, miss], {"cse": True})

    @property
    def gaps(self) -> Any:
        """Natural sizes of the constraints."""
        units = self.released.units
        return np.array([1.0 if unit == "rad" else self.length for unit in units])


class _Solver:
    """The range-space form of the proximal equations at one pose."""

    def __init__(self, M: Any, J: Any, eps: Any, weights: Any) -> None:
        self.n, self.m = M.shape[0], J.shape[0]
        if weights is not None:
            M = M + J.T @ (ca.diag(ca.DM(weights)) @ J)
        self.mass = Factor(M)
        self.J, self.eps = J, ca.DM(eps)
        halves = [self.mass.forward(entries(J[i, :].T)) for i in range(self.m)]
        scaled = [self.mass.divided(half) for half in halves]
        S = SX(self.m, self.m)
        for i in range(self.m):
            for j in range(i + 1):
                shared = halves[j].keys() & scaled[i].keys()
                if shared or i == j:
                    total = SX(0)
                    for k in sorted(shared):
                        total += scaled[i][k] * halves[j][k]
                    S[i, j] = total + (float(eps[i]) if i == j else 0)
                    S[j, i] = S[i, j]
        self.schur = Factor(S) if self.m else None

    def solve(self, f: Any, gamma: Any) -> tuple[Any, Any]:
        """Return accelerations and multipliers."""
        free = self.mass.solve(f)
        if self.schur is None:
            return free, SX(0, 1)
        lam = change = self.schur.solve(self.J @ free - gamma)
        for _ in range(PASSES):
            change = self.schur.solve(self.eps * change)
            lam = lam + change
        return self.mass.solve(f - self.J.T @ lam), lam

    def shortest(self, gap: Any) -> Any:
        """Return the shortest change, measured by the mass, that closes a gap."""
        assert self.schur is not None
        return self.mass.solve(self.J.T @ self.schur.solve(gap))

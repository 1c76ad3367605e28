"""The balance of forces of a setup at rest as arrays, and Newton's method on it.

f(x) - J^T lambda = 0, phi(x) = 0; with Z a basis of the freedoms that the constraints leave,
x = x0 + Z z, and K = -Z^T d(f - J^T lambda)/dx Z the stiffness along them. All in natural sizes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import CONTRADICTING, MotionProblem
from mechdae.types import Floats, Graph, Jacobian, Matrix, Unknowns

STEPS = 150
SOLVED = 1e-13
"""Force left over, of those that balance, that counts as none."""
ACCEPTED = 1e-10
SHORT = 0.15
"""Largest change of a coordinate in one step, over its natural size."""
HALVINGS = 12
NEUTRAL = 1e-9
"""Share of the largest eigenvalue below which one counts as zero."""
RANK = 1e-9
CLOSED = 1e-12
CLOSINGS = 12


class EquilibriumEquations:
    """Equations of equilibrium of a setup as arrays."""

    def __init__(self, setup: MotionProblem) -> None:
        self.setup, k = setup, setup.kernel
        r = setup.released

        def whole() -> Graph:
            lam = ca.SX.sym("lam", k.m)
            force = ca.densify(r.f) - r.J.T @ lam
            slopes = [ca.jacobian(force, r.x), ca.jacobian(ca.densify(r.f), r.v)]
            parts = [r.f, r.J, r.phi, *slopes, r.M]
            return k.function("statics", [ca.densify(part) for part in parts], [lam])

        def light() -> Graph:
            return k.function("balance", [ca.densify(part) for part in (r.f, r.J, r.phi)])

        self._call, self._light = k.call("statics", whole), k.call("balance", light)
        self._applied = k.call("applied", lambda: k.function("applied", [ca.densify(r.acting)]))
        self._weights = r.acting_sizes(setup.length)
        self.sizes, self.gaps, self.n, self.m = k.sizes, k.gaps, k.n, k.m
        self.signs: Floats = setup.loose
        self.rank: float = max(RANK, CONTRADICTING * setup.closure)
        self.still: Floats = np.zeros(self.n)

    def at(self, x: Unknowns, lam: Floats) -> list[Floats]:
        """Return f, J, phi, stiffness, damping and mass with natural sizes as units."""
        found = self._call(0.0, x, self.still, self.signs, lam / self.gaps)
        shapes = [(self.n,), (self.m, self.n), (self.m,), *[(self.n, self.n)] * 3]
        f, J, phi, K, C, M = (
            np.reshape(a, shape, order="F") for a, shape in zip(found, shapes, strict=True)
        )
        s, g = self.sizes, self.gaps
        both = np.outer(s, s)
        return [f * s, J * s / g[:, None], phi / g, -K * both, -C * both, M * both]

    def light(self, x: Unknowns) -> tuple[Floats, Floats, Floats]:
        """Return f, J and phi with natural sizes as units."""
        f, J, phi = self._light(0.0, x, self.still, self.signs)
        J = np.reshape(J, (self.m, self.n), order="F")
        return (
            np.ravel(f) * self.sizes,
            J * self.sizes / self.gaps[:, None],
            np.ravel(phi) / self.gaps,
        )

    def weight(self, x: Unknowns) -> float:
        """Return the largest load on a body, times a length of the mechanism."""
        applied = self._applied(0.0, x, self.still, self.signs)[0]
        return float(np.max(np.abs(applied) * self._weights))

    def multipliers(self, f: Floats, J: Jacobian) -> Any:
        """Return the shortest multipliers, over natural sizes, that balance forces best."""
        return np.linalg.lstsq(J.T, f, rcond=self.rank)[0] if self.m else np.zeros(0)

    def freedoms(self, J: Jacobian) -> Floats:
        """Return a basis (n, k) of what the constraints leave at a Jacobian in natural sizes."""
        return self.setup.freedoms(J * self.gaps[:, None] / self.sizes)

    def closed(self, x: Unknowns) -> Any:
        """Return the pose on the constraints next to x, None where Newton's method finds none."""
        for _ in range(CLOSINGS):
            _, J, phi = self.light(x)
            left = float(np.max(np.abs(phi), initial=0.0))
            if not math.isfinite(left):
                return None
            if left < CLOSED + self.setup.closure:
                return x
            x = x - self.sizes * np.linalg.lstsq(J, phi, rcond=self.rank)[0]
        return None

    def left(self, x: Unknowns) -> float:
        """Return what is left of the forces at a pose, over the largest load on a body."""
        f, J, _ = self.light(x)
        size = self.weight(x)
        left = np.abs(f - J.T @ self.multipliers(f, J)).max(initial=0.0)
        return float(left) / size if size > 0 else 0.0

    def stiffness(self, x: Unknowns) -> tuple[Floats, tuple[Matrix, Matrix]]:
        """Return the forces (k,) and the stiffness (k, k) along the freedoms, and their basis."""
        f, J, _ = self.light(x)
        basis = self.freedoms(J)
        K = self.at(x, self.multipliers(f, J))[3]
        return basis.T @ f, (basis.T @ K @ basis, basis)

    def newton(
        self, x: Unknowns, kept: Callable[[Any], bool] | None = None
    ) -> tuple[Floats, Floats, float, int]:
        """Return coordinates, multipliers, what is left of the forces, and steps.

        A step that is not `kept` (it leaves the assembly mode) is halved; where halving does not
        help the method ends.
        """
        lam, left = np.zeros(self.m), math.inf
        best: tuple[float, Floats, Floats] = (math.inf, x, lam)
        stalled = steps = 0
        while steps < STEPS:
            steps += 1
            f, J, phi = self.light(x)
            if not np.isfinite(f).all():
                break
            lam = self.multipliers(f, J)
            size = self.weight(x)
            balance = f - J.T @ lam
            left = float(np.max(np.abs(balance), initial=0.0)) / size if size > 0 else 0.0
            gap = float(np.max(np.abs(phi), initial=0.0))
            left = max(left, gap if gap > self.setup.closure else 0.0)
            stalled = 0 if left < 0.5 * best[0] else stalled + 1
            if left < best[0]:
                best = (left, x, lam)
            if left == 0 or (stalled >= 3 and best[0] <= SOLVED) or stalled >= 40:
                break
            K = self.at(x, lam)[3]
            basis = self.freedoms(J)
            close = -np.linalg.lstsq(J, phi, rcond=self.rank)[0] if self.m else np.zeros(self.n)
            stiff = basis.T @ K @ basis
            pull = basis.T @ (balance - K @ close)
            step = close + basis @ np.linalg.lstsq(stiff, pull, rcond=1e-13)[0]
            largest = float(np.max(np.abs(step), initial=0.0))
            step *= min(1.0, SHORT / largest if largest else 1.0)
            after = self._ahead(x, step, kept)
            if after is None:
                break
            x = after
        left, x, lam = best
        return x, lam, left, steps

    def _ahead(self, x: Unknowns, step: Any, kept: Callable[[Any], bool] | None) -> Any:
        for _ in range(HALVINGS):
            after = x + self.sizes * step
            if kept is None or np.max(np.abs(step), initial=0.0) < 1e-6:
                return after
            after = self.closed(after)
            if after is not None and kept(after):
                return after
            step = step / 2
        return None

    def settled(self, x: Unknowns, kept: Callable[[Any], bool]) -> Any:
        """Return the pose in which the mechanism comes to rest from here, or None."""
        short, before = SHORT, None
        for _ in range(4 * STEPS):
            force, (K, basis) = self.stiffness(x)
            size = self.weight(x)
            if size == 0 or np.max(np.abs(force), initial=0.0) <= 1e-9 * size:
                return x
            values, vectors = np.linalg.eigh((K + K.T) / 2)
            sizes = np.maximum(np.abs(values), 1e-3 * np.abs(values).max())
            sizes = np.where(sizes > 0, sizes, size)
            step = basis @ (vectors @ (vectors.T @ force / sizes))
            if before is not None and step @ before < 0:
                short /= 2  # it went too far
            else:
                short = min(1.2 * short, SHORT)
            largest = float(np.max(np.abs(step)))
            step *= min(1.0, short / largest)
            before = step
            x = self._ahead(x, step, kept)
            if x is None or short < 1e-10:
                return x
        return None


def stability(K: Matrix) -> str:
    """Return "stable", "unstable" or "neutral" by the stiffness along the freedoms."""
    if not len(K):
        return "stable"
    values = np.linalg.eigvals(K).real
    largest = np.max(np.abs(values))
    if values.min() < -NEUTRAL * largest:
        return "unstable"
    return "stable" if values.min() > NEUTRAL * largest else "neutral"

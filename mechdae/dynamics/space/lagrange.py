"""A check of motions in space: Lagrange's equations from the kinetic energy alone.

The right-hand side has forces and moments of inertia body by body (Newton, Euler). With the kinetic
energy T(x, x', t) as a function, and Z a basis of what the constraints leave,

    Z^T (d/dt dT/dx' - dT/dx - Q) = 0

at every state. What the mass matrix, gyroscopic moments or accelerations have wrong is left over.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.dynamics.observe import Observer, States
from mechdae.types import Sym

SX = ca.SX
MOST = 48
"""States that are looked at."""


def left_over(observer: Observer, s: States) -> float:
    """Return the largest gap of Lagrange's equations over the largest term or load."""
    r, k = observer.r, observer.kernel
    there = np.flatnonzero(np.isfinite(s.a).all(axis=1))
    if not len(there) or not k.n:
        return 0.0
    chosen = there[np.linspace(0, len(there) - 1, min(MOST, len(there))).astype(int)]

    def build() -> tuple[list[Sym], list[Sym]]:
        a, inner = SX.sym("a", r.x.numel()), SX.sym("inner", k.inner)
        momentum = ca.gradient(r.kinetic, r.v)
        at, along = ca.vertcat(r.x, r.v, r.t), ca.vertcat(r.v, a, SX(1))
        rate = ca.jtimes(momentum, at, along)
        applied = r.applied
        if k.slips:
            applied = applied - r.held_back @ inner[k.m : k.m + k.slips]
        if k.rubs:
            applied = applied + r.rubbed @ inner[k.m + k.slips :]
        parts = [rate, ca.gradient(r.kinetic, r.x), r.V.T @ applied, ca.vec(ca.densify(r.J))]
        return parts, [a, inner]

    inner = np.zeros((len(s.t), k.inner))
    inner[:, : s.lam.shape[1]] = s.lam
    states = [part[chosen] for part in (s.t[:, None], s.x, s.v, s.signs, s.a, inner)]
    rate, slope, force, J = observer.many("lagrange", build)(*states)
    worst, sizes = 0.0, observer.loads(s)
    for i in range(len(chosen)):
        Z = observer.setup.freedoms(J[i].reshape(k.m, k.n, order="F"))
        terms = [part[i] * k.sizes for part in (rate, slope, force)]
        gap = Z.T @ (terms[0] - terms[1] - terms[2])
        worst = max(worst, float(np.max(np.abs(gap), initial=0.0)))
        sizes = max(sizes, *(float(np.max(np.abs(part))) for part in terms))
    return worst / sizes if sizes > 0 else 0.0

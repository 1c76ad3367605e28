"""Poses of arms, real and complex, improved by Newton's method and certified.

The six equations are the place of the hand, in sizes of the arm, and the skew part of its rotation
times the transpose of that asked for, which near 1 vanishes for 1 alone. Newton and Kantorovich:
with eta = |Y F| and K = |Y| sup |F''|, Y near J^-1, and K eta <= 1/4 there is one solution within
2 eta and no other within 1/K. Turns have norm 1 (exp |Im theta| where they are complex), so all
second derivatives have a bound.
"""

from __future__ import annotations

import numpy as np

from mechdae.numerics.arms.chain import AXES, frames
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Matrix, Numbers

GRAIN, LARGEST, SOUND = 3e-15, 0.25, 0.01
"""Rounding of a product, as a share of the norms of its factors; largest K eta; largest distance of
Y J from 1."""
FINE = float(np.finfo(np.longdouble).eps / np.finfo(float).eps)
"""Share of this rounding in sums of 80 bits."""
STEP = 1e-10
"""Length of a step of Newton's method [rad] that needs no other one."""
NEARBY = 0.1
"""Longest step towards a solution that belongs to its start [rad]."""


@dataclass(frozen=True)
class CertifiedAngles:
    """Angles ``theta`` (6, m), whether each is a solution, the radius of its ball, that of 1/K."""

    theta: Numbers
    holds: Booleans
    radius: Floats
    alone: Floats


@dataclass(frozen=True)
class NewtonStep:
    """A step of Newton's method, and what a proof is made of, poses last.

    ``off``: largest residual; ``large``, ``miss``: norms of the inverse and of Y J - 1; ``arms``:
    ways from the axes to the hand, in sizes of the arm.
    """

    step: Numbers
    off: Floats
    axes: Numbers
    arms: Numbers
    large: Floats
    miss: Floats
    inverse: Numbers

    def at(self, places: Booleans) -> NewtonStep:
        """Return that of some poses."""
        parts = ("step", "off", "axes", "arms", "large", "miss", "inverse")
        return NewtonStep(*(getattr(self, part)[..., places] for part in parts))


def certified(
    links: Matrix, theta: Numbers, R: Floats, t: Floats, size: float, steps: int
) -> CertifiedAngles:
    """Return angles (6, m) after `steps` steps of Newton's method at most, certified.

    `R` (3, 3, m) and `t` (3, m) are the hand's places.
    """
    theta, m = theta.copy(), theta.shape[1]
    holds, radius, alone = np.zeros(m, bool), *np.full((2, m), np.nan)
    at, longest = np.arange(m), 4 * NEARBY
    with np.errstate(all="ignore"):
        for k in range(steps):
            if not len(at):
                break
            now = theta[:, at]
            newton = _step(links, now, R[:, :, at], t[:, at], size)
            long = np.abs(newton.step).max(axis=0)
            theta[:, at] = now - np.where(long <= longest, newton.step, 0)
            last = long <= STEP if k < steps - 1 else np.ones(len(at), bool)
            if not last.all():
                now, newton = now[:, last], newton.at(last)
            proof = _proof(links, now, newton, size)
            holds[at[last]], radius[at[last]], alone[at[last]] = proof
            at, longest = at[~last & (long <= longest)], NEARBY
        at = np.flatnonzero(~holds & (radius < np.inf)) if np.iscomplexobj(theta) else at[:0]
        if len(at):  # far off, where terms are large and their sums small
            newton = _step(links, theta[:, at], R[:, :, at], t[:, at], size, FINE)
            holds[at], radius[at], alone[at] = _proof(links, theta[:, at], newton, size, FINE)
            theta[:, at] -= np.where(np.abs(newton.step).max(axis=0) <= NEARBY, newton.step, 0)
    return CertifiedAngles(theta, holds, radius, alone)


def _step(
    links: Matrix, theta: Numbers, R: Floats, t: Floats, size: float, fine: float = 1.0
) -> NewtonStep:
    """Return Newton's step (6, m), and what a proof is made of, poses last."""
    m, kind = theta.shape[1], theta.dtype
    if fine < 1:
        theta = theta.astype(np.clongdouble)
    X, Y, Z, P, axes, points = frames(links, theta)
    F = np.empty((AXES, m), kind)
    F[:3] = (P - t) / size
    for k, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):
        F[3 + k] = sum(v[i] * R[j, c] - v[j] * R[i, c] for c, v in enumerate((X, Y, Z))) / 2
    same = sum((v * R[:, c]).sum(axis=0) for c, v in enumerate((X, Y, Z)))
    J = np.empty((m, AXES, AXES), kind)
    axes, arms = axes.astype(kind, copy=False), ((P - points) / size).astype(kind, copy=False)
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        J[:, k] = (axes[:, i] * arms[:, j] - axes[:, j] * arms[:, i]).T
    J[:, 3:] = axes.transpose(2, 1, 0)
    try:
        inverse = np.linalg.inv(J)
    except np.linalg.LinAlgError:
        inverse = np.stack([_inverse(matrix) for matrix in J])
    step = np.einsum("nij,jn->in", inverse, F)
    large = np.sqrt((np.abs(inverse) ** 2).sum(axis=(1, 2)))
    miss = np.sqrt((np.abs(inverse @ J - np.eye(AXES)) ** 2).sum(axis=(1, 2)))
    off = np.maximum(np.abs(F).max(axis=0), np.abs(same - 3).astype(float))
    return NewtonStep(step, off, axes, arms, large, miss, inverse.transpose(1, 2, 0))


def _inverse(matrix: Numbers) -> Numbers:
    try:
        return np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)


def _proof(
    links: Matrix, theta: Numbers, newton: NewtonStep, size: float, fine: float = 1.0
) -> tuple[Booleans, Floats, Floats]:
    """Return of each pose whether it is certified, its radius, how far it is the only one.

    Of real turns all norms are 1. Rounding of a joint is led on by the product of those behind it,
    which leads back from the hand: its norm is that of the product up to there. A third derivative
    is at most as large as all norms together; until it doubles the second ones these hold.
    """
    axes, arms, large = newton.axes, newton.arms, newton.large
    reach = float(np.abs(links[:, [0, 2]]).sum()) / size
    rounding, far = AXES * GRAIN * (1 + reach), np.inf
    bent = AXES * np.hypot(reach, 1.5)
    K, wide, cast = bent * large, bent, 0.0
    if np.iscomplexobj(theta):
        high = np.abs(theta.imag)
        norms = np.ones((AXES + 1, theta.shape[1]))
        for k in range(1, AXES):
            parts = frames(links[:k], theta[:k])[:3]
            norms[k] = np.sqrt(sum((np.abs(v) ** 2).sum(axis=0) for v in parts))
        rounding = fine * GRAIN * (norms[:-1] * np.exp(high) * norms[1:]).sum(axis=0)
        rounding = rounding * (1 + reach * norms.max(axis=0))
        squares = (np.abs(axes) ** 2).sum(axis=(0, 1))
        long = np.sqrt((np.abs(arms) ** 2).sum(axis=1).max(axis=0))
        bent, wide = squares * np.hypot(long, 1.5), np.sqrt(squares) + AXES * (1 + long)
        cast = np.sqrt(squares) * np.hypot(long, 1) * GRAIN if fine < 1 else 0.0
        K = bent * large if fine == 1 else _bent(newton.inverse, axes, arms)
        third = 1.1 * AXES**1.5 * np.hypot(reach, 1.5) * np.exp(high.sum(axis=0))
        far, K = K / (large * third), 2 * K
    off = newton.off
    miss = newton.miss + large * (wide * (8 * off + rounding) + cast)
    eta = (np.sqrt((np.abs(newton.step) ** 2).sum(axis=0)) + large * rounding) / (1 - miss)
    K = K / (1 - miss)
    holds = (off < NEARBY) & (miss <= SOUND) & (K * eta <= LARGEST) & (2 * eta <= far)
    return holds, 2 * eta, np.minimum(1 / K, far) - eta


def _bent(inverse: Numbers, axes: Numbers, arms: Numbers) -> Floats:
    """Return norms (m,) of the inverse Jacobian times all second derivatives."""
    m = axes.shape[2]
    second = np.empty((AXES, AXES, AXES, m), axes.dtype)
    for j in range(AXES):
        lever = np.cross(axes[j], arms[j], axis=0)
        for i in range(j + 1):
            second[:3, i, j] = second[:3, j, i] = np.cross(axes[i], lever, axis=0)
            second[3:, i, j] = second[3:, j, i] = np.cross(axes[i], axes[j], axis=0) / 2
    led = np.einsum("abm,bijm->aijm", inverse, second)
    norms: Floats = np.sqrt((np.abs(led) ** 2).sum(axis=(0, 1, 2)))
    return norms


def off_target(links: Matrix, theta: Floats, R: Floats, t: Floats, size: float) -> Floats:
    """Return how far (m,) the hand is from its places at angles (6, m), in sizes of the arm."""
    X, Y, Z, P, _, _ = frames(links, theta)
    turned = np.abs(np.stack([X, Y, Z], axis=1) - R).max(axis=(0, 1))
    off: Floats = np.maximum(np.abs(P - t).max(axis=0) / size, turned)
    return off

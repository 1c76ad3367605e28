"""Certificates of solutions: boxes in which there is one solution, and no other (Krawczyk).

With the approximate inverse Y of the Jacobian at z and a bound H of the second derivatives over the
box of half widths r (discs of complex numbers) there is exactly one solution in the box where

    |Y F(z)| + (|1 - Y J(z)| + |Y| H r) r < r

(Krawczyk 1969; Moore 1977). What is rounded in F and J is added to them. The numbers of the
equations are the doubles that are given.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Matrix

UNIT = 2.0**-53
AT_ONCE = 400
STEPS = 4
"""Newton steps before a box is drawn."""
NEAR = 1e-6
"""Distance from its mirror image, by its size, up to which a solution is tried as a real one."""


class BoundedEquations(Protocol):
    """Equations with bounds of what is rounded in them, and of their second derivatives."""

    @property
    def conjugate(self) -> list[int]:
        """Where the conjugate of each unknown stands."""

    def symmetric(self, p: Complexes) -> bool:
        """Return whether conjugates of solutions at numbers p are solutions."""

    def residual(self, p: Complexes, z: Complexes) -> tuple[Any, Any, Any]:
        """Return F (n, N), J (n, N, N), and by how much F may be wrong (n, N)."""

    def bounds(self, p: Complexes, z: Complexes, r: Any) -> tuple[Any, Any]:
        """Return bounds over boxes: of second derivatives (n, N, N, N), of the rounding of J."""


@dataclass(frozen=True, eq=False)
class Enclosed:
    """Solutions (n, N), half widths of their boxes (n, N), which are ``certain`` and ``real``."""

    z: Complexes
    radius: Matrix
    certain: Any
    real: Booleans


def enclosed(equations: BoundedEquations, p: Complexes, z: Complexes) -> Enclosed:
    """Return solutions (n, N) at numbers p, refined, with boxes.

    The box of a ``real`` solution is its own mirror image.
    """
    symmetric = equations.symmetric(p)
    parts = [
        _enclosed(equations, p, z[i : i + AT_ONCE], symmetric) for i in range(0, len(z), AT_ONCE)
    ]
    if not parts:
        return Enclosed(z, np.zeros(z.shape), np.zeros(0, bool), np.zeros(0, bool))
    return Enclosed(
        *(np.concatenate([getattr(part, word) for part in parts])
          for word in ("z", "radius", "certain", "real"))
    )  # fmt: skip


def _enclosed(equations: BoundedEquations, p: Complexes, z: Complexes, symmetric: bool) -> Enclosed:
    with np.errstate(all="ignore"):
        z = _refined(equations, p, z)
        real = np.zeros(len(z), bool)
        if symmetric:
            mirrored = z[:, equations.conjugate].conj()
            real = np.abs(z - mirrored).max(axis=1) < NEAR * (1 + np.abs(z).max(axis=1))
            z = np.where(real[:, None], (z + mirrored) / 2, z)
        radius, certain = _boxes(equations, p, z, real)
    return Enclosed(z, radius, certain, real & certain)


def _refined(equations: BoundedEquations, p: Complexes, z: Complexes) -> Complexes:
    """Return solutions after Newton steps, as long as these help."""
    best, nearest = np.full(len(z), np.inf), z
    for _ in range(STEPS):
        F, J, _ = equations.residual(p, z)
        step = _times(_inverse(J), F)
        size = np.abs(step / (1 + np.abs(z))).max(axis=1)
        better = size < best
        nearest = np.where(better[:, None], z, nearest)
        best = np.where(better, size, best)
        z = z - step
    return nearest


def _boxes(
    equations: BoundedEquations, p: Complexes, z: Complexes, real: Booleans
) -> tuple[Matrix, Booleans]:
    """Return half widths of boxes and whether each has one solution."""
    F, J, rounding = equations.residual(p, z)
    Y = _inverse(J)
    most = np.abs(Y)
    eta = np.abs(_times(Y, F)) * (1 + 16 * UNIT) + _times(most, rounding)
    radius = 2 * eta + 4 * UNIT * np.abs(z)
    if real.any():
        radius = np.maximum(radius, np.where(real[:, None], radius[:, equations.conjugate], 0.0))
    H, slack = equations.bounds(p, z, radius)
    left = np.abs(np.eye(z.shape[1]) - Y @ J) + 16 * UNIT * (most @ np.abs(J)) + most @ slack
    left += np.einsum("nij,njkl,nl->nik", most, H, radius, optimize=True)
    inside = eta + _times(left, radius)
    return radius, np.isfinite(radius).all(axis=1) & (inside < radius).all(axis=1)


def _inverse(J: Any) -> Complexes:
    """Return inverses (n, N, N); `nan` where there is none."""
    good = np.isfinite(J).all(axis=(1, 2))
    J = np.where(good[:, None, None], J, np.eye(J.shape[1]))
    try:
        Y = np.linalg.inv(J)
    except np.linalg.LinAlgError:
        Y = np.full(J.shape, np.nan, complex)
        for i in range(len(J)):
            try:
                Y[i] = np.linalg.inv(J[i])
            except np.linalg.LinAlgError:
                continue
    return np.where(good[:, None, None], Y, np.nan)


def _times(Y: Complexes, F: Complexes) -> Any:
    return np.einsum("nij,nj->ni", Y, F)


def apart(found: Enclosed) -> bool:
    """Return whether no two boxes meet: all certain solutions are different."""
    z, r = found.z[found.certain], found.radius[found.certain]
    if len(z) < 2:
        return True
    # boxes meet only where their images under a linear form do
    form = np.cos(1.0 + np.arange(z.shape[1]))
    at, reach = z.real @ form, r @ np.abs(form) + 16 * UNIT * np.abs(z) @ np.abs(form)
    order = np.argsort(at - reach, kind="stable")
    at, reach, z, r = at[order], reach[order], z[order], r[order]
    for step in range(1, len(z)):
        near = at[step:] - reach[step:] <= np.maximum.accumulate(at + reach)[:-step]
        if not near.any():
            return True
        gap = np.abs(z[step:] - z[:-step])
        if (near & (gap <= r[step:] + r[:-step]).all(axis=1)).any():
            return False
    return True

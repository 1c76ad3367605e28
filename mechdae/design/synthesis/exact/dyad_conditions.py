"""Conditions of a dyad that guides a plane through five poses (Burmester).

In isotropic coordinates, with the first pose as the origin, a pin w and a pivot g are four complex
numbers (w, w', g, g'); at another pose (p, p'), turned by (r, r'), the pin is as far from the pivot
as at the first where

    p p' + w r p' + w' r' p - p g' - p' g - (r - 1) w g' - (r' - 1) w' g = 0

Four such equations are linear in (w, w') and in (g, g'): six solutions on two projective planes, of
which (0 : 1 : 0), (0 : 1 : 0) and its mirror image are at infinity for any poses. Four are left.
"""

from __future__ import annotations

from typing import Any

import numpy as np

W, W_, G, G_ = range(4)
COUNT = 4
"""Dyads through five poses, complex ones too."""
PLACES = 4
UNIT = 2.0**-53
SIZE = 1.5


class DyadConditions:
    """Rows of five poses, a family of equations: numbers are p, p', r, r' of four poses."""

    unknowns, cognate = 4, False
    conjugate = [W_, W, G_, G]  # noqa: RUF012

    def rows(self, z: Any, p: Any, rate: Any) -> tuple[Any, Any, Any]:
        """Return rows (n, 4), derivatives (n, 4, 4), and along a rate of the numbers (n, 4)."""
        F, J = self._values(z, p)
        w, w_, g, g_ = (z[:, i, None] for i in range(4))
        x, x_, r, r_ = np.split(p, 4, axis=1)
        dx, dx_, dr, dr_ = np.split(rate, 4, axis=1)
        Ft = dx * (x_ + w_ * r_ - g_) + dx_ * (x + w * r - g)
        Ft = Ft + dr * w * (x_ - g_) + dr_ * w_ * (x - g)
        return F, J, Ft

    @staticmethod
    def _values(z: Any, p: Any) -> tuple[Any, Any]:
        w, w_, g, g_ = (z[:, i, None] for i in range(4))
        x, x_, r, r_ = np.split(p, 4, axis=1)
        F = x * x_ + w * r * x_ + w_ * r_ * x - x * g_ - x_ * g - (r - 1) * w * g_
        F = F - (r_ - 1) * w_ * g
        J = np.stack(
            [r * x_ - (r - 1) * g_, r_ * x - (r_ - 1) * g, -x_ - (r_ - 1) * w_,
             -x - (r - 1) * w], axis=2,
        )  # fmt: skip
        return F, J

    def numbers(self, generator: Any) -> Any:
        """Return generic complex numbers."""
        return SIZE * (generator.normal(size=16) + 1j * generator.normal(size=16))

    def drawn(self, generator: Any) -> tuple[Any, Any]:
        """Return generic complex numbers and a dyad that keeps them."""
        z = generator.normal(size=4) + 1j * generator.normal(size=4)
        x, _, r, r_ = np.split(self.numbers(generator), 4)
        w, w_, g, g_ = z
        rest = w_ * r_ * x - x * g_ - (r - 1) * w * g_ - (r_ - 1) * w_ * g
        return np.concatenate([x, -rest / (x + w * r - g), r, r_]), z

    def key(self, z: Any) -> Any:
        """Return what tells solutions apart."""
        return z

    def of(self, places: Any, rotations: Any) -> Any:
        """Return the numbers of poses: places (5,), turns (5,) as unit complex numbers."""
        x, r = places[1:] - places[0], rotations[1:] / rotations[0]
        return np.concatenate([x, x.conj(), r, r.conj()])

    # -- certificates --------------------------------------------------------------------------

    def symmetric(self, p: Any) -> bool:
        """Return whether numbers are those of real poses."""
        x, x_, r, r_ = np.split(p, 4)
        return bool((x.conj() == x_).all() and (r.conj() == r_).all())

    def residual(self, p: Any, z: Any) -> tuple[Any, Any, Any]:
        """Return rows, slopes, and by how much rows may be wrong."""
        F, J = self._values(z, p[None])
        w, w_, g, g_ = (np.abs(z[:, i, None]) for i in range(4))
        x, x_, r, r_ = np.split(np.abs(p[None]), 4, axis=1)
        size = x * x_ + w * r * x_ + w_ * r_ * x + x * g_ + x_ * g + (r + 1) * w * g_
        return F, J, 32 * UNIT * (size + (r_ + 1) * w_ * g)

    def bounds(self, p: Any, z: Any, r: Any) -> tuple[Any, Any]:
        """Return bounds of second derivatives (constants) and of what is rounded in slopes."""
        n = len(z)
        x, x_, turn, turn_ = np.split(np.abs(p), 4)
        exact = np.split(p, 4)
        H = np.zeros((n, 4, 4, 4))
        H[:, :, W, G_] = H[:, :, G_, W] = np.abs(exact[2] - 1) * (1 + 4 * UNIT)
        H[:, :, W_, G] = H[:, :, G, W_] = np.abs(exact[3] - 1) * (1 + 4 * UNIT)
        w, w_, g, g_ = (np.abs(z[:, i, None]) for i in range(4))
        slack = np.stack(
            [turn * x_ + (turn + 1) * g_, turn_ * x + (turn_ + 1) * g,
             x_ + (turn_ + 1) * w_, x + (turn + 1) * w], axis=2,
        )  # fmt: skip
        return H, 16 * UNIT * slack

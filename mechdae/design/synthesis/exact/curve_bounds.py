"""Bounds of the equations of coupler curves over boxes about four-bars, for certificates."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.design.synthesis.exact import coupler_curve as curve
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats


class _Jet:
    """A function over boxes of half widths r: value, slope (8), bounds of both, of H (8, 8)."""

    def __init__(self, v: Complexes, size: Floats, g: Complexes, H: Floats, r: Floats) -> None:
        Hr = np.einsum("nkij,nj->nki", H, r)
        self.v, self.size, self.g, self.H, self.r = v, size, g, H, r
        self.most_g = np.abs(g) + Hr
        self.most = np.abs(v) + np.einsum("nki,ni->nk", np.abs(g) + Hr / 2, r)

    def __mul__(self, other: _Jet) -> _Jet:
        outer = self.most_g[..., :, None] * other.most_g[..., None, :]
        H = self.most[..., None, None] * other.H + other.most[..., None, None] * self.H
        g = self.v[..., None] * other.g + other.v[..., None] * self.g
        H = H + outer + np.swapaxes(outer, -1, -2)
        return _Jet(self.v * other.v, self.size * other.size, g, H, self.r)

    def __sub__(self, other: _Jet) -> _Jet:
        size = self.size + other.size
        return _Jet(self.v - other.v, size, self.g - other.g, self.H + other.H, self.r)


@dataclass(frozen=True, eq=False)
class CurveBounds:
    """Bounds over boxes: of second derivatives (n, k, 8, 8), of the sums of absolute values that

    the equations (n, k) and their slopes (n, k, 8) are computed from.
    """

    H: Floats
    size: Any
    slopes: Any


def curve_bounds(z: Complexes, d: Complexes, e: Complexes, r: Floats) -> CurveBounds:
    """Return bounds of the equations of curves through places (k,) over boxes r (n, 8) about z."""
    (A1, B1, C1), (A2, B2, C2) = (_link(z, d, e, r, link) for link in curve.LINKS)
    M, N, D = B1 * C2 - B2 * C1, C1 * A2 - C2 * A1, A1 * B2 - A2 * B1
    G = M * N - D * D
    slopes = (
        M.size[..., None] * N.most_g + N.size[..., None] * M.most_g
        + 2 * D.size[..., None] * D.most_g
    )  # fmt: skip
    return CurveBounds(G.H, G.size, slopes)


def _link(
    z: Complexes, d: Complexes, e: Complexes, r: Floats, link: tuple[int, int, int, int]
) -> tuple[_Jet, _Jet, _Jet]:
    """Return the three coefficients of a link as jets."""
    columns = [z[:, i, None] for i in link]
    x, x_, a, a_ = columns
    s, s_, t, t_ = (np.abs(v) for v in columns)
    n, k = len(z), len(d)
    d, e = d[None], e[None]

    def jet(
        v: Complexes, size: Floats, slopes: dict[int, Complexes], pairs: tuple[tuple[int, int], ...]
    ) -> _Jet:
        g = np.zeros((n, k, 8), complex)
        for i, slope in slopes.items():
            g[:, :, link[i]] = slope
        H = np.zeros((8, 8))
        for i, j in pairs:
            H[link[i], link[j]] = H[link[j], link[i]] = 1
        return _Jet(v, size, g, np.broadcast_to(H, (n, k, 8, 8)), r)

    f, h = np.abs(d), np.abs(e)
    size = f * h + f * t_ + h * t + s * t_ + s_ * t
    return (
        jet(x * (e - a_), s * (h + t_), {0: e - a_, 3: -x}, ((0, 3),)),
        jet(x_ * (d - a), s_ * (f + t), {1: d - a, 2: -x_}, ((1, 2),)),
        jet(
            d * e - d * a_ - e * a + x * a_ + x_ * a, size,
            {0: a_, 1: a, 2: x_ - e, 3: x - d}, ((0, 3), (1, 2)),
        ),
    )  # fmt: skip

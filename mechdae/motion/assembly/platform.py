"""All poses of a platform on three legs, by elimination.

A leg keeps a point of the platform at a distance from a point of the base (a circle), or on a
line that is fixed in the base or in the platform. With w = exp(i phi) the pose is
X = P + w (x - m1). The legs' equations less that of the first circle are linear in P,
Re(conj(a) P) = c, their solution P = N / D; |N|^2 - l^2 D^2 = 0 is a trigonometric polynomial of
degree 3 in phi, the sextic of the triads. Three lines have det(a, c) = 0. Nothing is divided by
D, which may vanish.

The count is proven when the discs that hold the roots of the polynomial (Smith 1970) tell which
of them are on the unit circle, and each has a pose that passes Newton-Kantorovich or provably
none, as where D and N vanish together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Jacobians, Matrices

EPS = float(np.finfo(float).eps)
DEGREE = 3
SAMPLES = 16
GRID = 360
"""Angles at which the gap of legs that do not meet is measured."""
LIPSCHITZ = 8.0
"""Of the Jacobian of three legs whose lengths are at most 1."""
FAR = 1e6
"""Sizes of the legs beyond which the platform is not looked for."""
CERTAIN = 0.1
"""Largest beta kappa eta of a pose that is certain."""


@dataclass(frozen=True)
class Leg:
    """|P - base| = length, or normal . (P - base) = length, of the platform's point P.

    ``base`` and ``platform`` are points in the two frames; ``normal`` (0 for a circle) is a unit
    vector of the base, of the platform when it is `turning`.
    """

    base: complex
    platform: complex
    length: float
    normal: complex = 0
    turning: bool = False


@dataclass(frozen=True)
class Closures:
    """Poses of the platform's frame in that of the base: origins ``z`` and ``w`` = exp(i phi).

    ``proven`` tells that there are no others, ``gap`` by how much the legs miss each other when
    there is none, ``free`` that the platform moves by itself.
    """

    z: Any
    w: Any
    proven: bool
    gap: float = 0.0
    free: bool = False


def closures(legs: Sequence[Leg]) -> Closures:
    """Return all poses of a platform on three legs."""
    return _Platform(legs).solve()


class _Platform:
    """Three legs, circles first, in units of their size and from the first leg's points."""

    def __init__(self, legs: Sequence[Leg]) -> None:
        legs = sorted(legs, key=lambda leg: leg.normal != 0)
        m = np.array([leg.platform for leg in legs])
        b = np.array([leg.base for leg in legs])
        lengths = np.array([leg.length for leg in legs])
        self.origin = b[0], m[0]
        self.n = np.array([complex(leg.normal) for leg in legs])
        self.turning = np.array([leg.turning for leg in legs])
        far = max(np.abs(m).max(), np.abs(b).max())
        m, b = m - m[0], b - b[0]
        self.size = float(max(np.abs(m).max(), np.abs(b).max(), np.abs(lengths).max())) or 1.0
        self.m, self.b, self.length = m / self.size, b / self.size, lengths / self.size
        self.grain = EPS * (1 + far / self.size)
        """Relative rounding of the legs' numbers."""
        self.circle = legs[0].normal == 0

    def linear(self, w: Complexes) -> tuple[Complexes, Floats, Floats, Floats]:
        """Return a and c (k, 2), three rows for lines only, and the sizes of their terms."""
        rows = slice(1, None) if self.circle else slice(None)
        m, b, n = self.m[rows], self.b[rows], self.n[rows]
        w = np.asarray(w)[:, None]
        turned = np.where(self.turning[rows], w * n, n)
        arm = w * m - b
        reach = np.abs(m) + np.abs(b)
        least, length = self.length[0], self.length[rows]
        constant = (length - least) * (length + least) - np.abs(m) ** 2 - np.abs(b) ** 2
        round_ = n == 0
        a = np.where(round_, 2 * arm, turned)
        c = np.where(
            round_,
            constant + 2 * np.real(w * m * np.conj(b)),
            length - np.real(np.conj(turned) * arm),
        )
        big_a = np.broadcast_to(np.where(round_, 2 * reach, 1.0), a.shape)
        big_c = np.where(round_, length**2 + least**2 + reach**2, np.abs(length) + reach)
        return a, c, big_a, np.broadcast_to(big_c, c.shape)

    def polynomial(self, w: Complexes) -> tuple[Any, Any]:
        """Return the polynomial at w (k,), and the size of its terms."""
        a, c, big_a, big_c = self.linear(w)

        def cross(i: int, j: int) -> Floats:
            return np.imag(np.conj(a[:, i]) * a[:, j])

        def both(i: int, j: int) -> Floats:
            return big_a[:, i] * big_a[:, j]

        if self.circle:
            N = c[:, 1] * a[:, 0] - c[:, 0] * a[:, 1]
            big_n = big_c[:, 1] * big_a[:, 0] + big_c[:, 0] * big_a[:, 1]
            value = np.abs(N) ** 2 - (self.length[0] * cross(0, 1)) ** 2
            return value, big_n**2 + (self.length[0] * both(0, 1)) ** 2
        turns = [(0, 1, 2), (1, 2, 0), (2, 0, 1)]
        value = sum(c[:, i] * cross(j, k) for i, j, k in turns)
        return value, sum(big_c[:, i] * both(j, k) for i, j, k in turns)

    def solve(self) -> Closures:
        w = np.exp(2j * np.pi * np.arange(SAMPLES) / SAMPLES)
        value, big = self.polynomial(w)
        noise = 16 * self.grain * float(big.max())
        spectrum = np.fft.fft(value) / SAMPLES
        c = np.concatenate([spectrum[-DEGREE:], spectrum[: DEGREE + 1]])
        if np.abs(c).max() <= noise:
            return Closures(np.zeros(0), np.zeros(0), False, free=True)
        roots, radius, cluster = real_roots(c, noise)
        z, w, certain, free = self.poses(roots)
        nearest = np.abs(w[:, None] - roots).argmin(axis=1) if len(w) else np.zeros(0, int)
        held = cluster[nearest][certain]
        proven = not free
        for k in set(cluster.tolist()):
            members = cluster == k
            count = int(np.sum(held == k))
            proven &= count == members.sum() or (
                count == 0 and self.none_near(roots[members], radius[members])
            )
        gap = 0.0 if len(w) else self.gap()
        base, platform = self.origin
        return Closures(base + self.size * z - w * platform, w, bool(proven), gap, free)

    def none_near(self, w: Complexes, radius: Floats) -> bool:
        """Return whether the linear equations contradict each other in all discs around w.

        A place P has |P| = l on a circle, at most `FAR` sizes on lines.
        """
        middle = w[0] / abs(w[0])
        spread = float(np.max(np.abs(w - middle) + radius))
        a, c, _, _ = self.linear(np.array([middle]))
        U, S, _ = np.linalg.svd(np.stack([a[0].real, a[0].imag], axis=-1))
        reach = self.length[0] if self.circle else FAR
        most = np.concatenate([S, np.zeros(len(c[0]) - 2)]) * reach
        slack = (spread + 16 * self.grain) * 4 * (1 + reach)
        return bool(np.any(np.abs(U.T @ c[0]) > most + slack))

    def candidates(self, w: Complexes) -> tuple[Complexes, Complexes]:
        """Return places P of the first point that may belong to w, with their w.

        The better of the linear equations gives P up to a direction; along it the other one or
        the circle decides, whichever is sound.
        """
        a, c, _, _ = self.linear(w)
        A = np.stack([a.real, a.imag], axis=-1)
        U, S, Vt = np.linalg.svd(A, full_matrices=False)
        along = Vt[:, :, 0] + 1j * Vt[:, :, 1]
        share = np.einsum("kij,ki->kj", U, c)
        with np.errstate(all="ignore"):
            main, other = (share / S).T
            places = [other]
            if self.circle:
                rest = np.sqrt(np.maximum(self.length[0] ** 2 - main**2, 0.0))
                places += [rest, -rest]
            P = np.stack([main * along[:, 0] + t * along[:, 1] for t in places])
        wide = np.broadcast_to(w, P.shape)
        good = np.isfinite(P)
        return P[good], wide[good]

    def residual(self, P: Complexes, w: Complexes) -> tuple[Floats, Matrices]:
        """Return the legs' equations (k, 3) and their Jacobian (k, 3, 3) in x, y, phi."""
        P, w = P[:, None], w[:, None]
        arm = w * self.m
        d = P + arm - self.b
        round_ = self.n == 0
        turned = np.where(self.turning, w * self.n, self.n)
        along = np.where(round_, d, turned)
        f = np.where(
            round_,
            (np.abs(d) ** 2 - self.length**2) / 2,
            np.real(np.conj(turned) * d) - self.length,
        )
        slope = np.real(np.conj(along) * 1j * arm)
        slope += np.where(self.turning, np.real(np.conj(1j * turned) * d), 0.0)
        return f, np.stack([along.real, along.imag, slope], axis=-1)

    def poses(self, w: Complexes) -> tuple[Any, Any, Any, bool]:
        """Return distinct poses (P, w) near the roots, which are certain, and freedom."""
        P, w = self.candidates(w / np.abs(w))
        for _ in range(12):
            held = np.abs(P) < 1e3 * FAR
            P, w = P[held], w[held]
            f, J = self.residual(P, w)
            step = newton_steps(J, f)
            P = P - (step[:, 0] + 1j * step[:, 1])
            w = w * np.exp(-1j * step[:, 2])
        f, J = self.residual(P, w)
        good = np.isfinite(P) & (np.abs(P) < FAR)
        good &= np.abs(f).max(axis=1, initial=0.0) <= 64 * self.grain * (1 + np.abs(P))
        P, w, J = P[good], w[good], J[good]
        least = np.linalg.svd(J, compute_uv=False)[:, -1]
        beta = np.sqrt(3) / np.maximum(least, 1e-100)
        kappa = LIPSCHITZ * (1 + np.abs(P))
        certain = beta * kappa * beta * 16 * self.grain * (1 + np.abs(P)) <= CERTAIN
        radius = np.where(certain, np.minimum(1 / (2 * beta * kappa), 1e-4), 1e-6)
        chosen: list[int] = []
        for k in np.argsort(~certain, kind="stable"):
            if all(abs(P[k] - P[j]) + abs(w[k] - w[j]) > radius[j] for j in chosen):
                chosen.append(int(k))
        P, w, certain = P[chosen], w[chosen], certain[chosen]
        a = self.linear(w)[0]
        S = np.linalg.svd(np.stack([a.real, a.imag], axis=-1), compute_uv=False)
        # linear equations that hold for a whole circle of places, or a whole line
        loose = ~certain & (S[:, 0 if self.circle else 1] <= 1e-6)
        still = self.translating()
        if still is not None:
            loose |= ~certain & (np.abs(w - still) <= 1e-4)
        return P[~loose], w[~loose], certain[~loose], still is not None or bool(loose.any())

    def translating(self) -> complex | None:
        """Return the turn at which three equal legs are parallel: the platform moves by itself."""
        fit = complex(np.sum(np.conj(self.m) * self.b))
        if np.any(self.n != 0) or fit == 0:
            return None
        w = fit / abs(fit)
        a, c, big_a, big_c = self.linear(np.array([w]))
        least = 64 * self.grain
        holds = np.all(np.abs(a) <= least * big_a) and np.all(np.abs(c) <= least * big_c)
        return w if holds else None

    def gap(self) -> float:
        """Return by how much the legs miss each other at the best of many angles."""
        P, w = self.candidates(np.exp(2j * np.pi * np.arange(GRID) / GRID))
        d = P[:, None] + w[:, None] * self.m - self.b
        turned = np.where(self.turning, w[:, None] * self.n, self.n)
        reach = np.where(self.n == 0, np.abs(d), np.real(np.conj(turned) * d))
        misses = np.abs(reach - self.length).max(axis=1)
        return self.size * float(misses.min()) if misses.size else 0.0


def newton_steps(J: Jacobians, f: Floats) -> Any:
    """Return the Newton steps (k, n); of least length where J is singular."""
    try:
        return np.linalg.solve(J, f[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        return np.einsum("kij,kj->ki", np.linalg.pinv(J), f)


def real_roots(c: Complexes, noise: float) -> tuple[Any, Any, Any]:
    """Return the roots that may lie on the unit circle, and which belong together.

    Parameters
    ----------
    c : (2 d + 1,) array
        Coefficients of sum c_k w^k, k = -d..d, of a function that is real on the circle.
    noise
        Bound of their errors.

    Returns
    -------
    w, radius : (k,) arrays
        Roots whose disc touches the unit circle, and its radius.
    cluster : (k,) array
        Number of the group of discs that each belongs to; a group of m discs holds m roots, and
        they are on the circle when it is a single one: the mirrored root would be another.
    """
    while len(c) > 1 and abs(c[-1]) <= 4 * len(c) * noise:
        noise += abs(c[-1])
        c = c[1:-1]
    w = np.roots(c[::-1])
    degree = len(w)
    if not degree:  # a constant; one that may be zero says nothing about any angle
        doubts = int(abs(c[0]) <= noise)
        return np.ones(doubts, complex), np.full(doubts, 2.0), np.zeros(doubts, int)
    powers = np.abs(w)[:, None] ** np.arange(degree + 1)
    value = np.abs(np.polyval(c[::-1], w)) + noise * powers.sum(axis=1)
    apart = w[:, None] - w
    np.fill_diagonal(apart, 1.0)
    with np.errstate(divide="ignore"):
        radius = degree * value / (abs(c[-1]) * np.abs(apart).prod(axis=1))
    np.fill_diagonal(apart, 0.0)
    near = np.abs(apart) <= 8 * (radius[:, None] + radius)
    cluster = np.arange(degree)
    for _ in range(degree):
        cluster = np.array([cluster[row].min() for row in near])
    touching = np.isin(cluster, cluster[np.abs(np.abs(w) - 1) <= radius])
    return w[touching], radius[touching], cluster[touching]

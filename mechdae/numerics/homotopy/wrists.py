"""Arms whose last three axes meet in a point: all joint angles in closed form.

Pieper (1968): the first three joints put the point where the axes meet, in four ways at most, the
last three turn the hand, in two. With the point h(theta_3) seen from the second joint, its height
along the first axis and its distance from the arm's foot are linear in the place (X, Y) to which
the second joint turns it,

    sin(alpha_1) Y = m(theta_3),   2 a_1 X = n(theta_3),   X^2 + Y^2 = g(theta_3),

m, n and g of degree 1 in cos and sin of theta_3: a trigonometric polynomial of degree 2, or of
degree 1 where a_1 or sin(alpha_1) is 0. That there are no other angles is decided by discs that
are sure to hold the roots (Smith 1970).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Floats, Matrix

MOST = 8
MEETS = 1e-12
"""Distance of axes, in sizes of the arm, up to which they meet."""
GRAIN = 1e-13
"""Rounding of the polynomial, as a share of its largest coefficient."""
CLEAR = 1e-9
"""Share of its largest value by which a discriminant must keep from 0."""


@dataclass(frozen=True)
class WristPoses:
    """All real joint ``angles`` (n, 6) [rad], whether these are ``sure`` to be all.

    ``regular`` counts the complex ones, of `MOST`, that are simple.
    """

    angles: Matrix
    sure: bool
    regular: int


def wrist_at(links: Floats) -> int:
    """Return 1 where the last three axes meet in a point, -1 where the first three do, else 0."""
    a, alpha, d = links.T
    size = float(np.abs(links[:, [0, 2]]).max()) or 1.0
    for sign, bends, shifts in ((1, (3, 4), 4), (-1, (0, 1), 1)):
        far = max(abs(a[bends[0]]), abs(a[bends[1]]), abs(d[shifts]))
        turned = min(abs(np.sin(alpha[k])) for k in bends)
        if far <= MEETS * size and turned > CLEAR:
            return sign
    return 0


def wrist_poses(links: Floats, hand: Floats) -> WristPoses:
    """Return all joint angles of an arm three of whose axes meet, at one end of it.

    `links`: rows (6, 3) of Denavit and Hartenberg: a [m], alpha [rad], d [m]. `hand`: rotation and
    origin of the hand (3, 4).
    """
    if wrist_at(links) > 0:
        return _forwards(links, hand)
    # the same arm from the hand to the foot
    a, alpha, d = links.T
    back = np.zeros((6, 3))
    back[:5, 0], back[:5, 1], back[:, 2] = -a[4::-1], -alpha[4::-1], -d[::-1]
    R, t = hand[:, :3], hand[:, 3]
    end = _turn_x(-alpha[5])
    foot = np.column_stack([R.T, -R.T @ t])
    foot[:, 3] += [a[5], 0, 0]
    foot = end.T @ foot
    found = _forwards(back, foot)
    return WristPoses(-found.angles[:, ::-1], found.sure, found.regular)


def _forwards(links: Floats, hand: Floats) -> WristPoses:
    a, alpha, d = links.T
    R, t = hand[:, :3], hand[:, 3]
    z6 = R @ [0, np.sin(alpha[5]), np.cos(alpha[5])]
    W = t - a[5] * R[:, 0] - d[5] * z6
    arms, sure, regular = _positions(links, W)
    M = R @ _turn_x(-alpha[5])
    angles = []
    for first in arms:
        T = np.eye(3)
        for k, theta in enumerate(first):
            T = T @ _turn_z(theta) @ _turn_x(alpha[k])
        last, clear = _turned(alpha, T.T @ M)
        sure &= clear
        angles += [[*first, *solution] for solution in last]
    found = np.array(angles).reshape(-1, 6)
    return WristPoses((found + np.pi) % (2 * np.pi) - np.pi, sure, 2 * regular)


def _positions(links: Floats, W: Floats) -> tuple[list[list[float]], bool, int]:
    """Return the first three angles that put the point at W, whether they are all, how many."""
    a, alpha, d = links.T
    sine, cosine = np.sin(alpha), np.cos(alpha)
    size = float(np.abs(links[:, [0, 2]]).max()) or 1.0
    flat, straight = abs(sine[0]) <= CLEAR, abs(a[0]) <= MEETS * size
    if flat and straight:
        return [], False, 0
    v = np.array([a[2], -d[3] * sine[2], d[2] + d[3] * cosine[2]])

    def seen(theta: Floats | float) -> Floats:
        """Return the point (n, 3) from the second joint."""
        x, y = (
            v[0] * np.cos(theta) - v[1] * np.sin(theta),
            (v[0] * np.sin(theta) + v[1] * np.cos(theta)),
        )
        return np.stack(
            [a[1] + x, y * cosine[1] - v[2] * sine[1], d[1] + y * sine[1] + v[2] * cosine[1]],
            axis=-1,
        )

    def parts(theta: Floats | float) -> tuple[Any, Any, Any]:
        g = seen(theta)
        m = W[2] - d[0] - cosine[0] * g[..., 2]
        n = W @ W - a[0] ** 2 - d[0] ** 2 - (g**2).sum(axis=-1) - 2 * d[0] * (W[2] - d[0])
        return m, n, (g[..., :2] ** 2).sum(axis=-1)

    def closed(theta: Floats) -> Any:
        m, n, g = parts(theta)
        if straight:
            return n
        if flat:
            return m
        return sine[0] ** 2 * n**2 + 4 * a[0] ** 2 * (m**2 - sine[0] ** 2 * g)

    roots, sure, count = _roots(closed, 1 if straight or flat else 2)
    found = []
    for theta in roots:
        m, n, g = parts(theta)
        if straight or flat:
            foot = m / sine[0] if straight else n / (2 * a[0])
            rest = g - foot**2
            sure &= bool(abs(rest) > CLEAR * (g + foot**2))
            if rest < 0:
                continue
            side = [np.sqrt(rest), -np.sqrt(rest)]
            places = [(x, foot) for x in side] if straight else [(foot, y) for y in side]
        else:
            places = [(n / (2 * a[0]), m / sine[0])]
        p = seen(theta)
        for X, Y in places:
            high = Y * cosine[0] - p[2] * sine[0]
            sure &= bool(min(np.hypot(X, Y), np.hypot(a[0] + X, high)) > CLEAR * size)
            one = np.arctan2(W[1], W[0]) - np.arctan2(high, a[0] + X)
            found.append([one, np.arctan2(Y, X) - np.arctan2(p[1], p[0]), theta])
    return found, sure, 2 * count if straight or flat else count


def _turned(alpha: Floats, M: Matrix) -> tuple[list[list[float]], bool]:
    """Return the last three angles that turn the wrist by M, and whether these are all."""
    sine, cosine = np.sin(alpha), np.cos(alpha)
    scale = sine[3] * sine[4]
    value = (cosine[3] * cosine[4] - M[2, 2]) / scale
    clear = abs(1 - abs(value)) > CLEAR
    if abs(value) > 1:
        return [], clear
    found = []
    for five in (np.arccos(value), -np.arccos(value)):
        inner = _turn_x(alpha[3]) @ _turn_z(five) @ _turn_x(alpha[4])
        four = np.arctan2(M[1, 2], M[0, 2]) - np.arctan2(inner[1, 2], inner[0, 2])
        left = (_turn_z(four) @ inner).T @ M
        found.append([four, five, np.arctan2(left[1, 0], left[0, 0])])
    return found, clear


def _roots(f: Any, degree: int) -> tuple[Floats, bool, int]:
    """Return the real roots of a trigonometric polynomial, whether they are all, how many complex.

    Roots in exp(i theta) come in pairs mirrored on the unit circle, so a disc that holds one root
    and meets the circle holds one on it.
    """
    count = 4 * degree + 2
    theta = 2 * np.pi * np.arange(count) / count
    spectrum = np.fft.fft(f(theta)) / count
    c = np.concatenate([spectrum[-degree:], spectrum[: degree + 1]])[::-1]
    noise = GRAIN * np.abs(c).max()
    if abs(c[0]) <= 1e3 * noise:
        return np.zeros(0), False, 0
    w = np.roots(c)
    apart = np.abs(w[:, None] - w) + np.eye(len(w))
    value = np.abs(np.polyval(c, w)) + noise * np.polyval(np.ones(len(c)), np.abs(w))
    radius = len(w) * value / (abs(c[0]) * apart.prod(axis=1))
    alone = (apart > radius[:, None] + radius) | np.eye(len(w), dtype=bool)
    on = np.abs(np.abs(w) - 1) <= radius
    simple = alone.all(axis=1)
    roots = np.angle(w[np.abs(np.abs(w) - 1) <= np.maximum(radius, 1e-9)])
    step = 1e-6
    for _ in range(2):  # to the last bits
        slope = (f(roots + step) - f(roots - step)) / (2 * step)
        roots = roots - np.where(slope != 0, f(roots) / np.where(slope != 0, slope, 1), 0)
    return roots, bool(simple.all() and len(roots) == on.sum()), int(simple.sum())


def _turn_x(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _turn_z(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

"""Arms whose last three axes meet in a point: all joint angles in closed form.

Pieper (1968): the first three joints put the point where the axes meet, in four ways at most, the
last three turn the hand, in two. Where the second and third axes are parallel, the plane in which
they move the point decides the first angle, in two ways, and two bars of a plane the rest. Else,
with the point h(theta_3) seen from the second joint, its height along the first axis and its
distance from the arm's foot are linear in the place (X, Y) to which the second joint turns it,

    sin(alpha_1) Y = m(theta_3),   2 a_1 X = n(theta_3),   X^2 + Y^2 = g(theta_3),

m, n and g of degree 1 in cos and sin of theta_3: a trigonometric polynomial of degree 2, or of
degree 1 where a_1 or sin(alpha_1) is 0.
"""

from __future__ import annotations

import numpy as np

from mechdae.numerics.arms.chain import MEETS, PARALLEL, frames, turn_x
from mechdae.numerics.arms.trigonometry import CLEAR, roots_of_two, signed, turns
from mechdae.types import Booleans, Floats, Matrices, Matrix, Numbers

MOST = 8


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


def wrist_poses(links: Matrix, R: Matrices, t: Matrix) -> tuple[Floats, Booleans]:
    """Return all joint angles (6, 8, n), nan where there is none, and whether they are sure.

    `R` (n, 3, 3) and `t` (n, 3) are rotations and origins of the hand; the last three axes meet.
    """
    a, alpha, d = links.T
    sine, cosine = np.sin(alpha), np.cos(alpha)
    z6 = R @ np.array([0, sine[5], cosine[5]])
    W = t - a[5] * R[:, :, 0] - d[5] * z6
    if abs(sine[1]) < PARALLEL and abs(sine[0]) > CLEAR:
        first, sure = _in_planes(links, W)
    else:
        first, sure = _by_polynomial(links, W)
    shape = first.shape[1:]
    X, Y, Z = (v.reshape(3, *shape) for v in frames(links[:3], first.reshape(3, -1))[:3])
    M = np.moveaxis(R @ turn_x(-float(alpha[5])), 0, 2)
    (u, v, w), (p, q, r) = ([(e * M[:, k, None]).sum(axis=0) for e in (X, Y, Z)] for k in (2, 0))
    s5, c5, clear = signed((cosine[3] * cosine[4] - w) / (sine[3] * sine[4]))
    c5 = np.clip(c5, -1, 1)
    sure &= (clear | np.isnan(w)).all(axis=0)
    across = -cosine[3] * c5 * sine[4] - sine[3] * cosine[4]
    four = np.arctan2(v, u) - np.arctan2(across, s5 * sine[4])
    c4, s4 = np.cos(four), np.sin(four)
    p, q = c4 * p + s4 * q, c4 * q - s4 * p
    c6 = c5 * p + s5 * (cosine[3] * q + sine[3] * r)
    s6 = -s5 * cosine[4] * p + (cosine[3] * c5 * cosine[4] - sine[3] * sine[4]) * q
    s6 += (sine[3] * c5 * cosine[4] + cosine[3] * sine[4]) * r
    five, six = np.arctan2(s5, np.broadcast_to(c5, s5.shape)), np.arctan2(s6, c6)
    whole = [*(np.broadcast_to(angle, s5.shape) for angle in first), four, five, six]
    return np.stack(whole).reshape(6, -1, len(t)), sure


def two_bars(a: float, b: float, X: Floats, Y: Floats) -> tuple[Floats, Floats, Booleans]:
    """Return how bars a and b reach a point: angle of the first, of the second on it (2, ...)."""
    sine, cosine, clear = signed((X * X + Y * Y - a * a - b * b) / (2 * a * b))
    cosine = np.clip(cosine, -1, 1)
    inner = np.arctan2(sine, np.broadcast_to(cosine, sine.shape))
    clear &= np.hypot(X, Y) > CLEAR * (abs(a) + abs(b))
    return np.arctan2(Y, X) - np.arctan2(b * sine, a + b * cosine), inner, clear


def behind_first(links: Matrix, one: Floats, W: Floats) -> tuple[Floats, Floats]:
    """Return x and y of points (3, n) in the frame behind the first joint, (..., n)."""
    (a, alpha, d), c, s = links[0], np.cos(one), np.sin(one)
    across = c * W[1] - s * W[0]
    return c * W[0] + s * W[1] - a, np.cos(alpha) * across + np.sin(alpha) * (W[2] - d)


def _in_planes(links: Matrix, W: Matrix) -> tuple[Floats, Booleans]:
    """Return the first three angles (3, 4, n) where the second and third axes are parallel."""
    a, alpha, d = links.T
    sine, same = np.sin(alpha), np.sign(np.cos(alpha[1]))
    size, w = float(np.abs(links[:, [0, 2]]).max()), W.T
    height = d[1] + same * (d[2] + np.cos(alpha[2]) * d[3]) - np.cos(alpha[0]) * (w[2] - d[0])
    one, sure = turns(-sine[0] * w[1], sine[0] * w[0], height, size)
    X, Y = behind_first(links, one, w)
    long = float(np.hypot(a[2], d[3] * sine[2]))
    two, inner, clear = two_bars(float(a[1]), long, X, Y)
    three = same * inner - np.arctan2(-d[3] * sine[2], a[2])
    whole = np.stack([np.broadcast_to(one, two.shape), two, three])
    return whole.reshape(3, -1, len(W)), sure & (clear | np.isnan(X)).all(axis=0)


def _by_polynomial(links: Matrix, W: Matrix) -> tuple[Floats, Booleans]:
    """Return the first three angles (3, 4, n) that put the point at W (n, 3)."""
    a, alpha, d = links.T
    sine, cosine = np.sin(alpha), np.cos(alpha)
    size, w = float(np.abs(links[:, [0, 2]]).max()) or 1.0, W.T
    flat, straight = abs(sine[0]) <= CLEAR, abs(a[0]) <= MEETS * size
    if flat and straight:
        return np.full((3, 4, len(W)), np.nan), np.zeros(len(W), bool)
    v = np.array([a[2], -d[3] * sine[2], d[2] + d[3] * cosine[2]])
    squares = (w**2).sum(axis=0) - a[0] ** 2 - d[0] ** 2 - 2 * d[0] * (w[2] - d[0])

    def seen(theta: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the point from the second joint."""
        c, s = np.cos(theta), np.sin(theta)
        x, y = v[0] * c - v[1] * s, v[0] * s + v[1] * c
        return a[1] + x, y * cosine[1] - v[2] * sine[1], d[1] + y * sine[1] + v[2] * cosine[1]

    def parts(theta: Floats) -> tuple[Floats, Floats, Floats]:
        x, y, z = seen(theta)
        g = x * x + y * y
        return w[2] - d[0] - cosine[0] * z, squares - g - z * z, g

    def closed(theta: Floats) -> Numbers:
        m, n, g = parts(theta)
        f: Numbers = sine[0] ** 2 * n**2 + 4 * a[0] ** 2 * (m**2 - sine[0] ** 2 * g)
        return f

    if straight or flat:
        quarter: Floats = np.pi / 2 * np.arange(4.0)[:, None]
        f = parts(quarter)[int(straight)]
        span = np.abs(f).max(axis=0)
        three, sure = turns((f[0] - f[2]) / 2, (f[1] - f[3]) / 2, -(f[0] + f[2]) / 2, span)
        m, n, g = parts(three)
        foot = m / sine[0] if straight else n / (2 * a[0])
        rest = g - foot**2
        near = np.abs(rest) <= CLEAR * (g + foot**2)
        side = np.sqrt(np.where(near, np.maximum(rest, 0), rest)) * np.array([1, -1])[:, None, None]
        sure &= (~near | np.isnan(rest)).all(axis=0)
        foot, three = np.broadcast_to(foot, side.shape), np.broadcast_to(three, side.shape)
        X, Y = (side, foot) if straight else (foot, side)
    else:
        three, sure = roots_of_two(closed, len(W))
        m, n, _ = parts(three)
        X, Y = n / (2 * a[0]), m / sine[0]
    x, y, z = seen(three)
    high = Y * cosine[0] - z * sine[0]
    clear = np.minimum(np.hypot(X, Y), np.hypot(a[0] + X, high)) > CLEAR * size
    sure &= (clear | np.isnan(X + Y)).reshape(-1, len(W)).all(axis=0)
    one = np.arctan2(w[1], w[0]) - np.arctan2(high, a[0] + X)
    two = np.arctan2(Y, X) - np.arctan2(y, x)
    return np.stack([one, two, three]).reshape(3, -1, len(W)), sure

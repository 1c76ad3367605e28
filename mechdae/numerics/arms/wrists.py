"""Arms whose last three axes meet in a point, or whose middle three are parallel.

Pieper (1968): the first three joints put the point where the axes meet, in four ways at most, the
last three turn the hand, in two. Where the second and third axes are parallel, the plane in which
they move the point decides the first angle, in two ways, and two bars of a plane the rest. Else,
with the point h(theta_3) seen from the second joint, its height along the first axis and its
distance from the arm's foot are linear in the place (X, Y) to which the second joint turns it,

    sin(alpha_1) Y = m(theta_3),   2 a_1 X = n(theta_3),   X^2 + Y^2 = g(theta_3),

m, n and g of degree 1 in cos and sin of theta_3: a trigonometric polynomial of degree 2, or of
degree 1 where a_1 or sin(alpha_1) is 0.

Arms whose second, third and fourth axes are parallel: all joint angles in closed form.

Let v be the direction of these axes. Its angle with the last axis gives cos(theta_5), the way
along it from the foot to the fifth axis gives sin(theta_5), both linear in cos and sin of theta_1:

    v . z_6 = cos(alpha_4) cos(alpha_5) - sin(alpha_4) sin(alpha_5) cos(theta_5)
    v . (O_5 - O_1) = d_2 + d_3 + d_4 + cos(alpha_4) d_5 + sin(alpha_4) a_5 sin(theta_5)

The fifth and sixth axes often meet (a_5 = 0): the second equation gives theta_1 then, in two ways.
The sixth joint turns v where it has to be; two bars of a plane remain. There are 8 poses at most.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdae.numerics.arms.chain import MEETS, PARALLEL, frames, turn_x
from mechdae.types import Booleans, Floats, Matrices, Matrix, Numbers

CLEAR = 1e-9
"""Share of its largest value by which a discriminant must keep from 0."""
GRAIN = 1e-13
"""Rounding of a polynomial, as a share of its largest coefficient."""


def signed(cosine: Floats) -> tuple[Floats, Floats, Booleans]:
    """Return sines (2, ...) of both angles that have a cosine, that cosine, whether it is clear.

    nan where there is none; a cosine beyond 1 by no more than `CLEAR` counts as 1.
    """
    rest = (1 - cosine) * (1 + cosine)
    near = np.abs(rest) <= 2 * CLEAR
    sine = np.sqrt(np.where(near, np.maximum(rest, 0), rest))
    return np.stack([sine, -sine]), cosine, ~near


def turns(a: Floats, b: Floats, c: Floats, scale: Floats | float) -> tuple[Floats, Booleans]:
    """Return both angles (2, n) with a cos + b sin = c, and whether they are sure to be all.

    `scale` (n,): what a and b are to be compared with.
    """
    long = np.hypot(a, b)
    sine, cosine, clear = signed(c / long)
    middle = np.arctan2(b, a)
    return middle + np.arctan2(sine, np.clip(cosine, -1, 1)), clear & (long > CLEAR * scale)


def roots_of_two(f: Callable[[Floats], Numbers], count: int) -> tuple[Matrix, Booleans]:
    """Return the real roots (4, n) of trigonometric polynomials of degree 2, nan where there is
    none, and whether they are sure to be all.

    `f` gives values (m, n) at angles (m, 1) or (m, n). Roots in exp(i theta) come in pairs mirrored
    on the unit circle, so a disc that holds one root and meets the circle holds one on it (Smith
    1970).
    """
    samples = 10
    theta = 2 * np.pi * np.arange(samples) / samples
    spectrum = np.fft.fft(f(theta[:, None]), axis=0) / samples
    c = np.concatenate([spectrum[-2:], spectrum[:3]])[::-1].T
    noise = GRAIN * np.abs(c).max(axis=1)
    flat = ~(np.abs(c[:, 0]) > 1e3 * noise)
    lead = np.where(flat, 1, c[:, 0])
    companion = np.zeros((count, 4, 4), complex)
    companion[:, 1:, :3] = np.eye(3)
    companion[:, 0] = -np.where(flat[:, None], 0, c[:, 1:]) / lead[:, None]
    w = np.linalg.eigvals(companion)
    apart = np.abs(w[:, :, None] - w[:, None]) + np.eye(4)
    value, bound = np.zeros_like(w), np.zeros(w.shape)
    for k in range(5):
        value, bound = value * w + c[:, k, None], bound * np.abs(w) + 1
    radius = 4 * (np.abs(value) + noise[:, None] * bound) / (np.abs(lead)[:, None] * apart.prod(2))
    alone = (apart > radius[:, :, None] + radius[:, None]) | np.eye(4, dtype=bool)
    off = np.abs(np.abs(w) - 1)
    on, near = off <= radius, off <= np.maximum(radius, CLEAR)
    roots = np.where(near & ~flat[:, None], np.angle(w), np.nan).T
    step = 1e-6
    for _ in range(2):  # to the last bits
        slope = (f(roots + step) - f(roots - step)) / (2 * step)
        roots = roots - np.where(slope != 0, f(roots) / np.where(slope != 0, slope, 1), 0)
    return roots, alone.all(axis=(1, 2)) & (on == near).all(axis=1) & ~flat


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


def parallel_at(links: Floats) -> int:
    """Return 1 where the axes 2, 3, 4 are parallel, -1 where 3, 4, 5 are, else 0."""
    a, alpha, _ = links.T
    sine, size = np.abs(np.sin(alpha)), float(np.abs(links[:, [0, 2]]).max()) or 1.0
    for sign, (k, last) in ((1, (1, 4)), (-1, (2, 0))):
        first, wrist = (0, 3) if sign > 0 else (4, 1)
        bars = min(abs(a[k]), abs(a[k + 1])) > MEETS * size
        ends = min(sine[first], sine[wrist]) > CLEAR
        far = sine[last] > CLEAR or abs(a[last]) > MEETS * size
        if max(sine[k], sine[k + 1]) < PARALLEL and bars and ends and far:
            return sign
    return 0


def parallel_poses(links: Matrix, R: Matrices, t: Matrix) -> tuple[Floats, Booleans]:
    """Return all joint angles (6, 8, n), nan where there is none, and whether they are sure.

    `R` (n, 3, 3) and `t` (n, 3) are rotations and origins of the hand.
    """
    a, alpha, d = links.T
    sine, cosine = np.sin(alpha), np.cos(alpha)
    size, same = float(np.abs(links[:, [0, 2]]).max()), np.sign(cosine[1])
    both = same * np.sign(cosine[2])
    z6 = R @ np.array([0, sine[5], cosine[5]])
    five_at = (t - a[5] * R[:, :, 0] - d[5] * z6).T
    z = z6.T
    height = cosine[0] * (five_at[2] - d[0]) - d[1] - same * d[2] - both * (d[3] + cosine[3] * d[4])
    turned = sine[3] * sine[4]
    meet, along = abs(a[4]) <= MEETS * size, abs(sine[4]) <= CLEAR

    def five_of(one: Floats) -> tuple[Floats, Floats]:
        """Return sin(alpha_4) sin(alpha_5) cos(theta_5) and a_5 sin(alpha_4) sin(theta_5)."""
        c, s = np.cos(one), np.sin(one)
        v = both * (sine[0] * (s * z[0] - c * z[1]) + cosine[0] * z[2])
        way = both * (sine[0] * (s * five_at[0] - c * five_at[1]) + height)
        return cosine[3] * cosine[4] - v, way

    if along:
        part = cosine[0] * z[2] - both * cosine[3] * cosine[4]
        one, sure = turns(-sine[0] * z[1], sine[0] * z[0], -part, 1.0)
        c5, s5, clear = signed(five_of(one)[1] / (a[4] * sine[3]))
        one = np.broadcast_to(one, c5.shape)
        s5 = np.broadcast_to(s5, c5.shape)
        sure &= (clear | np.isnan(s5[0])).all(axis=0)
    elif meet:
        one, sure = turns(-sine[0] * five_at[1], sine[0] * five_at[0], -height, size)
        s5, c5, clear = signed(five_of(one)[0] / turned)
        one, c5 = np.broadcast_to(one, s5.shape), np.broadcast_to(np.clip(c5, -1, 1), s5.shape)
        sure &= (clear | np.isnan(c5[0])).all(axis=0)
    else:
        scales = turned, a[4] * sine[3]

        def closed(one: Floats) -> Numbers:
            first, second = five_of(one)
            f: Numbers = (first / scales[0]) ** 2 + (second / scales[1]) ** 2 - 1
            return f

        one, sure = roots_of_two(closed, len(t))
        first, second = five_of(one)
        c5, s5 = first / scales[0], second / scales[1]
    one, c5, s5 = (v.reshape(-1, len(t)) for v in (one, c5, s5))
    c, s = np.cos(one), np.sin(one)
    v = both * np.stack([sine[0] * s, -sine[0] * c, np.full_like(c, cosine[0])])
    local = np.einsum("ij,nkj->ikn", turn_x(float(alpha[5])), R)
    p, q = ((v * local[k][:, None]).sum(axis=0) for k in (0, 1))
    x, y = s5 * sine[3], c5 * sine[3]
    y = cosine[4] * y + sine[4] * cosine[3]
    sure &= ((np.hypot(x, y) > CLEAR) | np.isnan(x + y)).all(axis=0)
    six = np.arctan2(y, x) - np.arctan2(q, p)
    # where the fourth link ends, and its first axis, in the plane behind the first joint
    c6, s6 = np.cos(six), np.sin(six)
    inner = c5 * c6 - s5 * cosine[4] * s6, -c5 * s6 - s5 * cosine[4] * c6, s5 * sine[4]
    back = a[4] * c6 + d[4] * sine[4] * s6, d[4] * sine[4] * c6 - a[4] * s6, d[4] * cosine[4]
    ways = [e + a[3] * f for e, f in zip(back, inner, strict=True)]
    x4, way = (
        np.stack([sum(e * local[i][k] for i, e in enumerate(v)) for k in range(3)])
        for v in (inner, ways)
    )
    X, Y = behind_first(links, one, five_at[:, None] - way)
    across = cosine[0] * (c * x4[1] - s * x4[0]) + sine[0] * x4[2]
    two, bent, clear = two_bars(float(a[1]), float(a[2]), X, Y)
    sure &= (clear | np.isnan(X)).all(axis=0)
    four = both * (np.arctan2(across, c * x4[0] + s * x4[1]) - two - bent)
    five = np.arctan2(s5, c5)
    whole = [one, two, same * bent, four, five, six]
    return np.stack([np.broadcast_to(v, two.shape) for v in whole]).reshape(6, -1, len(t)), sure

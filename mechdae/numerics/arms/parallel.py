"""Arms whose second, third and fourth axes are parallel: all joint angles in closed form.

Let v be the direction of these axes. Its angle with the last axis gives cos(theta_5), the way
along it from the foot to the fifth axis gives sin(theta_5), both linear in cos and sin of theta_1:

    v . z_6 = cos(alpha_4) cos(alpha_5) - sin(alpha_4) sin(alpha_5) cos(theta_5)
    v . (O_5 - O_1) = d_2 + d_3 + d_4 + cos(alpha_4) d_5 + sin(alpha_4) a_5 sin(theta_5)

The fifth and sixth axes often meet (a_5 = 0): the second equation gives theta_1 then, in two ways.
The sixth joint turns v where it has to be; two bars of a plane remain. There are 8 poses at most.
"""

from __future__ import annotations

import numpy as np

from mechdae.numerics.arms.chain import MEETS, PARALLEL, turn_x
from mechdae.numerics.arms.trigonometry import CLEAR, roots_of_two, signed, turns
from mechdae.numerics.arms.wrists import behind_first, two_bars
from mechdae.types import Booleans, Floats, Matrices, Matrix, Numbers


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

"""All poses of a general arm with six turning axes by eigenvalues of its eliminant, certified.

Raghavan and Roth (1993), Manocha and Canny (1994). With l the direction of the last axis and p a
point on it, seen from the frame behind the second joint, the 14 functions

    p, l, p.p, p.l, p x l, (p.p) l - 2 (p.l) p

are linear in cos and sin of each of theta_3, theta_4, theta_5, and of each of theta_1, theta_2 as
seen from the foot. The 8 products of the latter are eliminated; with half tangents x_4, x_5 six
equations and x_4 times these have 12 products, and determinant 0 at the eigenvalues x_3 of a
pencil of degree 2. Of its 24 eigenvalues 8 are +-i. There are 16 poses at most that are alone
(Primrose 1986; Lee and Liang 1988): where Newton's method leads to 16 certified ones that are
different, the real ones among these are all there are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.numerics.arms.certified import certified, off_target
from mechdae.numerics.arms.chain import AXES, frames, mirrored, mirrored_hands
from mechdae.types import Booleans, Complexes, Floats, Matrices, Matrix, Numbers

MOST, FUNCTIONS, PAIR = 16, 14, 8
STEPS = 14
SAME, CLOSE = 1e-6, 1e-3
"""Distances of angles below which certified solutions, and singular poses, are one [rad]."""
OPEN = 1e-7
"""Distance of the hand, in sizes of the arm, up to which a singular pose reaches its target."""
NEAR = (0.0, 1e-4, 3e-5, 1e-5, 3e-6, 1e-3)
"""How far the arm is whose solutions are taken as approximations, in turn: pencils of special arms
are singular."""
THIRDS = 2 * np.pi / 3 * np.arange(3)
_HALF = np.array([[1.0, 0, -1], [0, 2, 0], [1, 0, 1]])
"""cos, sin, 1 by 1, x, x^2, times 1 + x^2."""


def all_poses(links: Matrix, R: Matrices, t: Matrix, size: float) -> Any:
    """Return what is known of general arms at rotations (n, 3, 3) and origins (n, 3) of the hand.

    Angles (n, 16, 6) and radii (n, 16) of the real poses, nan where there is none, statuses (n,),
    numbers of certified complex poses (n,), and directions (m, 6, 3) of the axes in these.
    """
    n = len(t)
    theta = np.full((n, MOST, AXES), np.nan, complex)
    radius, real = np.full((n, MOST), np.nan), np.zeros((n, MOST), bool)
    whole, left = np.zeros(n, bool), np.arange(n)
    loose = np.full((n, MOST, AXES), np.nan)
    rng = np.random.default_rng(6)
    for far in NEAR:
        for back in (False, True):
            if not len(left):
                break
            rows = links + far * rng.normal(size=links.shape) * [size, 1, size]
            shifts = rng.uniform(-3, 3, size=3)
            with np.errstate(all="ignore"):
                if back:
                    hands = mirrored_hands(rows, R[left], t[left])
                    start = -_starts(mirrored(rows), *hands, size, shifts)[:, :, ::-1]
                else:
                    start = _starts(rows, R[left], t[left], size, shifts)
                known = theta[left], radius[left], real[left]
                found = _solutions(links, R[left], t[left], size, start, known)
                theta[left], radius[left], real[left], whole[left] = found[:4]
                if not far:
                    none = np.isnan(loose[left]).all(axis=(1, 2))
                    loose[left[none]] = found[4][none]
            left = left[~whole[left]]
    regular = np.isfinite(radius).sum(axis=1)
    angles = np.where(real[:, :, None], theta.real, np.nan)
    status = np.where(real.any(axis=1), "ok", "out of reach")
    status = np.where(whole, status, "unproven")
    singular = np.flatnonzero(~whole & np.isfinite(loose).any(axis=(1, 2)))
    if len(singular):
        every = np.concatenate([angles[singular], loose[singular]], axis=1)
        gaps = np.abs(np.exp(1j * every[:, :, None]) - np.exp(1j * every[:, None])).max(axis=3)
        twice = ((gaps < CLOSE) & np.tri(2 * MOST, k=-1, dtype=bool)).any(axis=2)
        twice |= np.isnan(every[:, :, 0])
        order = np.argsort(twice, axis=1, kind="stable")[:, :MOST]
        every = np.take_along_axis(np.where(twice[:, :, None], np.nan, every), order[:, :, None], 1)
        angles[singular], status[singular] = every, "singular"
        radius[singular] = np.take_along_axis(
            np.pad(radius[singular], ((0, 0), (0, MOST)), constant_values=np.nan), order, 1
        )
    axes = frames(links, theta.reshape(-1, AXES).T)[4].transpose(2, 0, 1).reshape(n, MOST, AXES, 3)
    directions = [row[there] for row, there in zip(axes, np.isfinite(theta).all(2), strict=True)]
    turned = angles - 2 * np.pi * np.round(angles / (2 * np.pi))
    return (turned, radius, status, regular), directions


Known = tuple[Complexes, Floats, Booleans]


def _solutions(
    links: Matrix, R: Matrices, t: Matrix, size: float, start: Complexes, known: Known
) -> Any:
    """Return certified solutions (n, 16, 6), radii, which are real, and whether they are all.

    `start` (n, k, 6): one of each pair of conjugates. `known`: solutions, radii, which are real.
    """
    row, k = np.nonzero(np.isfinite(start).all(axis=2))
    lanes = start[row, k].T
    found = certified(links, lanes, np.moveaxis(R, 0, 2)[:, :, row], t.T[:, row], size, STEPS)
    gap = 2 * np.sqrt((found.theta.imag**2).sum(axis=0))
    real = gap + found.radius <= found.alone
    held = found.holds & (real | (gap > 2 * found.radius))
    one, r = start.copy(), np.full(start.shape[:2], np.nan)
    one[row, k] = np.where(real, found.theta.real, found.theta).T
    r[row[held], k[held]] = found.radius[held]
    loose = np.full(start.shape, np.nan)
    near = np.flatnonzero(~held & (np.abs(lanes.imag).max(axis=0) < CLOSE))
    ends = lanes[:, near].real
    hand = np.moveaxis(R, 0, 2)[:, :, row[near]], t.T[:, row[near]]
    good = off_target(links, ends, *hand, size) < OPEN
    loose[row[near[good]], k[near[good]]] = ends[:, good].T
    flag = np.zeros(r.shape, bool)
    flag[row, k] = real
    twin = np.where(flag, np.nan, r)
    theta = np.concatenate([known[0], one, one.conj()], axis=1)
    radius = np.concatenate([known[1], r, twin], axis=1)
    reals = np.concatenate([known[2], flag, np.zeros_like(flag)], axis=1)
    # which are the same as one before, which are sure to be different
    between = theta[:, :, None] - theta[:, None]
    between -= 2 * np.pi * np.round(between.real / (2 * np.pi))
    far = np.sqrt((np.abs(between) ** 2).sum(axis=3))
    there = np.isfinite(radius)
    before = np.tri(far.shape[1], k=-1, dtype=bool) & there[:, None]
    new = there & ~((far < SAME) & before).any(axis=2)
    order = np.argsort(~new, axis=1, kind="stable")[:, :MOST]
    new = np.take_along_axis(new, order, axis=1)
    theta = np.take_along_axis(theta, order[:, :, None], axis=1)
    radius = np.where(new, np.take_along_axis(radius, order, axis=1), np.nan)
    apart = np.take_along_axis(np.take_along_axis(far, order[:, :, None], 1), order[:, None], 2)
    sure = (apart > radius[:, :, None] + radius[:, None]) | np.eye(MOST, dtype=bool)
    whole = new.all(axis=1) & sure.all(axis=(1, 2))
    theta = np.where(new[:, :, None], theta, np.nan)
    return theta, radius, np.take_along_axis(reals, order, axis=1) & new, whole, loose


# -- the pencil ----------------------------------------------------------------------------


def _functions(z: Numbers, p: Numbers) -> Numbers:
    """Return the 14 functions (14, ...) of a direction and a point (3, ...)."""
    square, along = (p * p).sum(axis=0), (p * z).sum(axis=0)
    cross = np.cross(p, z, axis=0)
    return np.concatenate([p, z, [square, along], cross, square * z - 2 * along * p])


def _left(links: Matrix, shifts: Floats) -> Floats:
    """Return coefficients (3, 14, 9) of the functions seen from behind the second joint.

    By cos, sin, 1 of theta_3, then of theta_4 and theta_5, each less its shift.
    """
    grid = np.stack(np.meshgrid(THIRDS, THIRDS, THIRDS, indexing="ij")).reshape(3, -1)
    _, _, z, p, _, _ = frames(links[2:5], grid + shifts[:, None])
    values = _functions(z, p).reshape(FUNCTIONS, 3, 3, 3)
    back = np.linalg.inv(np.stack([np.cos(THIRDS), np.sin(THIRDS), np.ones(3)], axis=1))
    terms = np.einsum("fijk,ai,bj,ck->afbc", values, back, back, back, optimize=True)
    forms: Floats = terms.reshape(3, FUNCTIONS, 9)
    return forms


def _right(links: Matrix, z6: Matrix, p: Matrix) -> Floats:
    """Return coefficients (n, 14, 9) of the functions of theta_1 and theta_2."""
    grid = np.stack(np.meshgrid(THIRDS, THIRDS, indexing="ij")).reshape(2, -1)
    X, Y, Z, origin, _, _ = frames(links[:2], grid)
    seen = np.stack([X, Y, Z])  # rows of the inverse
    z = np.einsum("ikg,nk->ing", seen, z6)
    q = np.einsum("ikg,nkg->ing", seen, p[:, :, None] - origin)
    values = _functions(z, q).reshape(FUNCTIONS, len(p), 3, 3)
    back = np.linalg.inv(np.stack([np.cos(THIRDS), np.sin(THIRDS), np.ones(3)], axis=1))
    terms = np.einsum("fnij,ai,bj->nfab", values, back, back, optimize=True)
    forms: Floats = terms.reshape(len(p), FUNCTIONS, 9)
    return forms


def _starts(links: Matrix, R: Matrices, t: Matrix, size: float, shifts: Floats) -> Complexes:
    """Return approximations (n, k, 6) of the solutions, one of each pair of conjugates."""
    rows, n = links * [1 / size, 1, 1 / size], len(t)
    a, alpha, d = rows.T
    z6 = R @ np.array([0, np.sin(alpha[5]), np.cos(alpha[5])])
    p = t / size - a[5] * R[:, :, 0] - d[5] * z6
    left, right = _left(rows, shifts), _right(rows, z6, p)
    products, constant = right[:, :, :PAIR], right[:, :, PAIR]
    free = np.linalg.qr(products, mode="complete")[0][:, :, PAIR:].swapaxes(1, 2)
    cosine, sine, rest = (free @ form for form in left)
    rest[:, :, PAIR] -= (free @ constant[:, :, None])[:, :, 0]
    half = np.kron(_HALF, _HALF)
    cosine, sine, rest = (form @ half for form in (cosine, sine, rest))
    pencil = np.zeros((3, n, 12, 12))
    for k, form in enumerate((rest + cosine, 2 * sine, rest - cosine)):
        pencil[k, :, :6, :9] = pencil[k, :, 6:, 3:] = form
    companion = np.zeros((n, 24, 24))
    companion[:, :12, 12:] = np.eye(12)
    companion[:, 12:] = -_solved(pencil[2], np.concatenate([pencil[0], pencil[1]], axis=2))
    good = np.array(np.isfinite(companion).all(axis=(1, 2)))
    values, vectors = np.linalg.eig(np.where(good[:, None, None], companion, np.eye(24)))
    values, vectors = values.astype(complex), vectors.astype(complex)
    # those at +-i are no solutions
    order = np.argsort(-np.abs(values**2 + 1), axis=1)[:, :MOST]
    x3 = np.take_along_axis(values, order, axis=1)
    v = np.take_along_axis(vectors, order[:, None], axis=2)
    v = np.where((np.abs(x3) > 1)[:, None], v[:, 12:], v[:, :12])
    v = v.reshape(n, 4, 3, MOST)
    x4 = (v[:, 1:] * v[:, :3].conj()).sum(axis=(1, 2)) / (np.abs(v[:, :3]) ** 2).sum(axis=(1, 2))
    low, high = v[:, :, :2], v[:, :, 1:]
    x5 = (high * low.conj()).sum(axis=(1, 2)) / (np.abs(low) ** 2).sum(axis=(1, 2))
    keep = (x3.imag >= 0) & good[:, None]
    theta = np.full((n, MOST, AXES), np.nan, complex)
    for k, x in enumerate((x3, x4, x5)):
        theta[:, :, 2 + k] = 2 * np.arctan(x) + shifts[k]
    # the first two from the products, the last from the rest
    ends = np.moveaxis(theta, 2, 0)[2:5].reshape(3, -1)
    _, _, z, q, _, _ = frames(rows[2:5], ends)
    seen = _functions(z, q).reshape(FUNCTIONS, n, MOST) - constant.T[:, :, None]
    terms = np.linalg.pinv(products, rcond=1e-10) @ seen.transpose(1, 0, 2)
    for k, (c, s) in enumerate(((2, 5), (6, 7))):
        theta[:, :, k] = _angle(terms[:, c], terms[:, s])
    X, Y, _, _, _, _ = frames(rows[:5], np.moveaxis(theta, 2, 0)[:5].reshape(5, -1))
    first = np.repeat(R[:, :, 0].T, MOST, axis=1)
    six = _angle((X * first).sum(axis=0), (Y * first).sum(axis=0))
    theta[:, :, 5] = six.reshape(n, MOST)
    return np.where(keep[:, :, None], theta, np.nan)


def _angle(c: Numbers, s: Numbers) -> Complexes:
    """Return complex angles of a cosine and a sine whose squares nearly add to 1."""
    angle: Complexes = -1j * np.log((c + 1j * s) / np.sqrt(c * c + s * s))
    return angle


def _solved(A: Matrices, B: Matrices) -> Numbers:
    try:
        return np.linalg.solve(A, B)
    except np.linalg.LinAlgError:
        return np.full(B.shape, np.nan)

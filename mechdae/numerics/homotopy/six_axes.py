"""All poses of an arm with six turning axes at a given place of its hand, certified.

With the directions z_2 .. z_5 of the axes as unknowns, z_1 and z_6 known, all equations are
quadrics (Wampler and Morgan 1991): z_i.z_i = 1, z_i.z_i+1 = c_i and the way to the hand

    sum k_i z_i x z_i+1 + sum d_i z_i = p,    c_i = cos alpha_i,  k_i = a_i / sin alpha_i.

They have 16 solutions at most that are alone (Primrose 1986; Lee and Liang 1988). Arms whose first
or last three axes meet in a point have 8, in closed form (`wrists`).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.errors import InputError
from mechdae.numerics.homotopy import wrists
from mechdae.numerics.homotopy.tracker import distinct, track
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Matrices, Matrix

if TYPE_CHECKING:
    from numpy.random import Generator


STORE = Path(__file__).resolve().parent / "six_axes.json"
MOST, UNKNOWNS, NUMBERS = 16, 12, 23
ROUTES, IDLE, BENT = 8, 3, 0.5
PARALLEL = 1e-9
"""Sine of the twist between two axes below which they are parallel."""
SIMPLE, SAME, FAR = 1e-9, 1e-6, 1e6
GRAIN, FINE, LARGEST, SOUND = 1e-13, 2e-15, 0.25, 0.01
"""Rounding counts as `GRAIN` of each term, as `FINE` where sums are formed in 80 bits: that of the
numbers given is left then."""
REFINED = 3
"""Newton steps with such sums."""
_CROSS = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _CROSS[_i, _j, _k], _CROSS[_i, _k, _j] = 1.0, -1.0


@dataclass(frozen=True)
class ArmPoses:
    """Real poses: ``angles`` (n, 6) of the joints [rad].

    ``regular`` counts the certified complex poses of the ``most`` there can be, ``basis`` is
    "theorem" where all of these are certified and different: then the real ones are all there are
    (``proven``), else "homotopy". ``axes`` (m, 6, 3) are the directions of the axes in all complex
    poses that are certified, where no three axes meet.
    """

    angles: Matrix
    regular: int
    basis: str
    most: int = MOST
    axes: Complexes | None = None

    @property
    def singular(self) -> int:
        return self.most - self.regular

    @property
    def proven(self) -> bool:
        return self.basis == "theorem"


def arm_poses(links: Sequence[Sequence[float]], hand: Floats) -> ArmPoses:
    """Return all joint angles at which an arm's hand is at a place.

    Parameters
    ----------
    links
        Rows (a [m], alpha [rad], d [m]) of Denavit and Hartenberg for the six joints: the hand is
        at the product of Rz(theta) Tz(d) Tx(a) Rx(alpha).
    hand
        Its place (4, 4) or (3, 4): rotation and origin [m].

    Raises
    ------
    InputError
        The place is no rotation, or neighbouring axes are parallel where no three axes at an end
        of the arm meet in a point.
    """
    rows, place = np.asarray(links, float), np.asarray(hand, float)
    if rows.shape != (6, 3) or place.shape not in ((3, 4), (4, 4)):
        raise InputError("six rows of three numbers and a matrix of 3 or 4 rows of 4 are needed")
    R, origin = place[:3, :3], place[:3, 3]
    if not np.isfinite(rows).all() or not np.allclose(R @ R.T, np.eye(3), atol=1e-6):
        raise InputError("the first three columns of the hand are no rotation", where="hand")
    a, alpha, d = rows.T
    sines = np.sin(alpha)
    if wrists.wrist_at(rows):
        found = wrists.wrist_poses(rows, place[:3])
        if found.sure and found.regular == wrists.MOST:
            return ArmPoses(_in_order(found.angles), found.regular, "theorem", wrists.MOST)
    if np.abs(sines[:5]).min() < PARALLEL:
        k = int(np.argmin(np.abs(sines[:5])))
        raise InputError(
            f"axes {k + 1} and {k + 2} are parallel: this method needs twists other than 0 and pi",
            where=f"links[{k}]",
        )
    size = float(np.sqrt((a**2).mean() + (d**2).mean())) or 1.0
    first, last = np.array([0.0, 0, 1]), sines[5] * R[:, 1] + np.cos(alpha[5]) * R[:, 2]
    p = (origin - d[0] * first - d[5] * last - a[5] * R[:, 0]) / size
    k = a[:5] / sines[:5] / size
    target = np.concatenate([first, last, np.cos(alpha[:5]), k, d[1:5] / size, p])
    X = _followed(target)
    simple, real, other, sure = _certified(target, X)
    if not simple.all():  # far off, where terms are large and their sums small
        X = _refined(target, X)
        simple, real, other, sure = _certified(target, X, FINE)
    whole = len(X) == MOST and bool((simple & (real | other)).all()) and sure
    angles = _angles(X[simple & real].real.reshape(-1, 4, 3), first, last, R[:, 0], sines[:5])
    inner = X[simple].reshape(-1, 4, 3)
    ends = [np.broadcast_to(vector, (len(inner), 1, 3)) for vector in (first, last)]
    axes = np.concatenate([ends[0], inner, ends[1]], axis=1)
    basis = "theorem" if whole else "homotopy"
    return ArmPoses(_in_order(angles), int(simple.sum()), basis, axes=axes)


def _in_order(angles: Floats) -> Floats:
    return angles[np.lexsort(np.round(angles, 9).T)] if len(angles) else angles


def _angles(z: Matrices, first: Floats, last: Floats, x_last: Floats, sines: Floats) -> Any:
    """Return the joints' angles (n, 6) from the directions (n, 4, 3) of the inner axes."""
    n = len(z)
    ends = [np.broadcast_to(vector, (n, 1, 3)) for vector in (first, last)]
    z = np.concatenate([ends[0], z, ends[1]], axis=1)
    x = np.cross(z[:, :-1], z[:, 1:]) / sines[:, None]
    x = np.concatenate(
        [np.broadcast_to([1.0, 0, 0], (n, 1, 3)), x, np.broadcast_to(x_last, (n, 1, 3))], axis=1
    )
    cosines = (x[:, :-1] * x[:, 1:]).sum(axis=2)
    return np.arctan2((z * np.cross(x[:, :-1], x[:, 1:])).sum(axis=2), cosines)


# -- equations -----------------------------------------------------------------------------


def quadrics(p: Complexes) -> tuple[Complexes, Complexes, Complexes]:
    """Return C (12,), L (12, 12), T (12, 12, 12) of F = C + L x + x T x / 2 for the numbers."""
    first, last, c, k, d, place = np.split(np.asarray(p), [3, 6, 11, 16, 20])
    kind = complex if np.iscomplexobj(p) else float
    C, L = np.zeros(12, kind), np.zeros((12, 12), kind)
    T = np.zeros((12, 12, 12), kind)
    at = [slice(3 * i, 3 * i + 3) for i in range(4)]
    for i in range(4):
        T[i, at[i], at[i]] = 2 * np.eye(3)
        C[i] = -1
    C[4:9] = -c
    L[4, at[0]], L[8, at[3]] = first, last
    for i in range(3):
        T[5 + i, at[i], at[i + 1]] = T[5 + i, at[i + 1], at[i]] = np.eye(3)
    way = slice(9, 12)
    C[way] = -place
    for i in range(4):
        L[way, at[i]] += d[i] * np.eye(3)
    L[way, at[0]] += k[0] * np.einsum("abc,b->ac", _CROSS, first)
    L[way, at[3]] += k[4] * np.einsum("abc,c->ab", _CROSS, last)
    for i in range(3):
        T[way, at[i], at[i + 1]] += k[i + 1] * _CROSS
        T[way, at[i + 1], at[i]] += k[i + 1] * _CROSS.transpose(0, 2, 1)
    return C, L, T


def along(start: Complexes, end: Floats, bend: Complexes | None = None) -> Any:
    """Return the system on a route of numbers, start + t (end - start) + t (1 - t) bend."""
    degree = 3 if bend is None else 5
    t = np.cos(np.pi * (np.arange(degree) + 0.5) / degree) / 2 + 0.5
    inverse = np.linalg.inv(np.vander(t, increasing=True))
    bent = 0 if bend is None else bend
    values = [quadrics(start + s * (end - start) + s * (1 - s) * bent + 0j) for s in t]
    C, L, T = (np.tensordot(inverse, np.stack(row), axes=1) for row in zip(*values, strict=True))
    flat = T.reshape(-1, UNKNOWNS).T.copy()

    def system(x: Complexes, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
        n = len(x)
        powers = t[:, None] ** np.arange(degree)
        slopes = np.zeros_like(powers)
        slopes[:, 1:] = powers[:, :-1] * np.arange(1, degree)
        half = np.einsum("nb,bk->nk", x, flat).reshape(n, degree, UNKNOWNS, UNKNOWNS)
        half += L
        F = C + ((half + L) * x[:, None, None, :]).sum(axis=3) / 2
        J = (powers[:, :, None, None] * half).sum(axis=1)
        return (powers[:, :, None] * F).sum(axis=1), J, (slopes[:, :, None] * F).sum(axis=1)

    return system


def _sums(p: Complexes, X: Complexes) -> Any:
    """Return F (n, 12) of complex doubles, its sums formed in 80 bits."""
    C, L, T = (form.astype(np.clongdouble) for form in quadrics(p))
    x = X.astype(np.clongdouble)
    half = (T * x[:, None, None, :]).sum(axis=3) / 2
    return (C + ((half + L) * x[:, None, :]).sum(axis=2)).astype(complex)


def _refined(p: Complexes, X: Complexes) -> Complexes:
    """Return solutions after steps of Newton's method with residuals of 80 bits."""
    _, L, T = quadrics(p)
    for _ in range(REFINED):
        J = L + np.einsum("rab,nb->nra", T, X)
        try:
            X = X - np.linalg.solve(J, _sums(p, X)[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:
            return X
    return X


def _certified(
    p: Complexes, X: Complexes, grain: float = GRAIN
) -> tuple[Booleans, Booleans, Booleans, bool]:
    """Return which solutions are certified, real, not real, and whether all are different.

    Newton and Kantorovich: with eta = |J^-1 F|, K = |J^-1 T| and K eta <= 1/4 there is one solution
    within 2 eta and no other within 1/K. Rounding counts as `grain` of each term; below `GRAIN`
    residuals are formed in 80 bits.
    """
    C, L, T = quadrics(p)
    n = len(X)
    with np.errstate(all="ignore"):
        half = np.einsum("rab,nb->nra", T, X)
        F, J = C + np.einsum("nra,na->nr", L + half / 2, X), L + half
        size = np.abs(X)
        large = np.abs(L) + np.einsum("rab,nb->nra", np.abs(T), size)
        F = F if grain == GRAIN else _sums(p, X)
        noise = grain * (np.abs(C) + np.einsum("nra,na->nr", large, size))
        try:
            Y = np.linalg.inv(J)
        except np.linalg.LinAlgError:
            Y = np.full(J.shape, np.nan, complex)
        miss = np.linalg.norm(Y @ J - np.eye(UNKNOWNS), axis=(1, 2))
        miss += GRAIN * np.linalg.norm(np.abs(Y) @ large, axis=(1, 2))
        eta = np.linalg.norm(np.einsum("nij,nj->ni", Y, F), axis=1)
        eta = (eta + np.linalg.norm(np.einsum("nij,nj->ni", np.abs(Y), noise), axis=1)) / (1 - miss)
        K = np.linalg.norm(np.tensordot(Y, T, axes=1).reshape(n, -1), axis=1) / (1 - miss)
        simple = (miss <= SOUND) & (K * eta <= LARGEST)
        gap, radius = 2 * np.linalg.norm(X.imag, axis=1), 2 * eta
        real = simple & (gap + radius <= 1 / K)
        other = simple & (gap > 2 * radius)
        apart = np.linalg.norm(X[:, None] - X, axis=2) > radius[:, None] + radius
    return simple, real, other, bool((apart | np.eye(n, dtype=bool)).all())


# -- paths ---------------------------------------------------------------------------------


@cache
def generic() -> tuple[Complexes, Complexes]:
    """Return the numbers (23,) of a generic complex arm and its 16 solutions, checked."""
    data = json.loads(STORE.read_text(encoding="utf-8"))
    p = np.array(data["parameters"]) @ [1, 1j]
    X = np.array(data["solutions"]) @ [1, 1j]
    simple, _, _, sure = _certified(p, X)
    if len(X) != MOST or not simple.all() or not sure:
        raise InputError("the stored solutions do not solve their arm", where=str(STORE))
    return p, X


def drawn(rng: Generator) -> Complexes:
    """Return complex numbers (23,) drawn at random."""
    return rng.normal(size=NUMBERS) + 1j * rng.normal(size=NUMBERS)


def _followed(target: Floats) -> Complexes:
    """Return the simple solutions (n, 12) that routes lead to, until some bring nothing new."""
    start, first = generic()
    rng = np.random.default_rng(6)
    best, idle = np.zeros((0, UNKNOWNS), complex), 0
    for route in range(ROUTES):
        bend = BENT * drawn(rng) if route else None
        ends = track(along(start, target, bend), first, FAR)
        size = np.maximum(np.abs(ends.x).max(axis=1), 1.0)
        every = np.concatenate([best, ends.x[ends.followed & (ends.step < SIMPLE * size)]])
        known, best = len(best), every[distinct(every, SAME)]
        idle = idle + 1 if len(best) == known else 0
        if len(best) == MOST or idle == IDLE:
            break
    return best

"""Paths of solutions x(t) of F(x, t) = 0 from t = 0 to 1, all at once in complex arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Integers

FIRST, SMALLEST, MOST = 0.02, 1e-9, 4000
NEARLY = 1e-6
"""Least part of the way that is left of which the smallest step is a share."""
FAR = 1e8
"""Size beyond which a solution is at infinity."""
FIRST_STEP, SECOND_STEP, DONE = 1e-2, 1e-6, 1e-8
"""Newton steps at a prediction: most of the first and the second, and what needs no ratio."""
RATIO, WANTED = 0.3, 3e-4
"""Most of the second by the first, and the first that the length of a step aims at."""
HASTY = (1e-1, 1e-3, 2e-2)
"""Most of the first and the second step, and the first aimed at, where a jump is found out."""
FINAL = 8

System = Callable[[Any, Any], tuple[Any, Any, Any]]
"""(x (n, k), t (n,)) -> F (n, k), J (n, k, k), the derivative of F by t (n, k)."""


@dataclass(frozen=True)
class PathEnds:
    """Where paths end: ``x`` (n, k), which were ``followed`` to t = 1, and ``step`` (n,).

    The last Newton step there tells simple solutions from multiple ones.
    """

    x: Complexes
    followed: Booleans
    step: Floats


def solve(J: Complexes, F: Complexes) -> Any:
    """Return J^-1 F for many systems F (n, k); `nan` where J is singular."""
    return solve_all(J, F[..., None])[..., 0]


def solve_all(J: Complexes, F: Complexes) -> Any:
    """Return J^-1 F for many systems of several sides F (n, k, m); `nan` where J is singular."""
    try:
        return np.linalg.solve(J, F)
    except np.linalg.LinAlgError:
        result = np.full(F.shape, np.nan, complex)
        for row in range(len(F)):
            try:
                result[row] = np.linalg.solve(J[row], F[row])
            except np.linalg.LinAlgError:
                continue
        return result


def _largest(values: Complexes) -> Floats:
    size = np.abs(values).max(axis=-1)
    return np.where(np.isfinite(size), size, np.inf)


def _near(x: Complexes, far: Complexes | float) -> Any:
    """Return which points (n, k) are not at infinity."""
    if np.iscomplexobj(far):
        return ((np.abs(x.real) < far.real) & (np.abs(x.imag) < far.imag)).all(axis=1)
    return _largest(x / far) < 1


def _ahead(
    last: Complexes, here: Complexes, rates: tuple[Complexes, Complexes], gap: Floats, h: Floats
) -> Complexes:
    """Return the cubic through two points and tangents, a step h beyond the second."""
    before, now = rates
    s = ((gap + h) / gap)[:, None]
    gap = gap[:, None]
    value = (2 * s**3 - 3 * s**2 + 1) * last + (s**3 - 2 * s**2 + s) * gap * before
    return value + (3 * s**2 - 2 * s**3) * here + (s**3 - s**2) * gap * now


def track(
    system: System,
    x: Complexes,
    far: Complexes | float = FAR,
    relative: bool = False,
    hasty: bool = False,
) -> PathEnds:
    """Follow solutions of F(x, 0) = 0, each with steps of its own, to t = 1.

    Predicted by a cubic through the last two points, corrected by two Newton steps. What grows
    beyond `far`, one size or one for each unknown (complex ones: of real and imaginary parts), is
    at infinity. Corrections of `relative` paths count by the size of each unknown where that is
    above one. `hasty` paths may jump to others, and are for those who count them.
    """
    with np.errstate(all="ignore"):
        return _track(system, np.array(x, complex), far, relative, hasty)


def _track(system: System, x: Any, far: Any, relative: bool, hasty: bool) -> PathEnds:
    n, (most, finest, wanted) = len(x), HASTY if hasty else (FIRST_STEP, SECOND_STEP, WANTED)
    t, h = np.zeros(n), np.full(n, FIRST)
    _, J, Ft = system(x, t)
    v = -solve(J, Ft)
    last, last_v, last_t = x.copy(), v.copy(), np.full(n, -1.0)
    going = np.isfinite(v).all(axis=1)
    for _ in range(MOST):
        rows = np.flatnonzero(going & (t < 1))
        if not rows.size:
            break
        step = np.minimum(h[rows], 1 - t[rows])
        ahead = np.where(step >= 1 - t[rows], 1.0, t[rows] + step)
        straight = x[rows] + step[:, None] * v[rows]
        bent = _ahead(last[rows], x[rows], (last_v[rows], v[rows]), t[rows] - last_t[rows], step)
        y = np.where((last_t[rows] < 0)[:, None], straight, bent)
        F, J, _ = system(y, ahead)
        first = solve(J, F)
        y = y - first
        F, J, Ft = system(y, ahead)
        both = solve_all(J, np.stack([F, Ft], axis=2))
        second, rate = both[:, :, 0], -both[:, :, 1]
        y = y - second
        sizes = np.maximum(np.abs(y), 1) if relative else 1.0
        e1, e2 = _largest(first / sizes), _largest(second / sizes)
        good = (e1 < most) & (e2 < finest) & ((e2 <= RATIO * e1) | (e2 < DONE))
        good &= np.isfinite(rate).all(axis=1)
        yes = rows[good]
        last[yes], last_v[yes], last_t[yes] = x[yes], v[yes], t[yes]
        x[yes], v[yes], t[yes] = y[good], rate[good], ahead[good]
        factor = np.clip(0.8 * (wanted / np.maximum(e1, 1e-300)) ** 0.25, 0.5, 2.0)
        h[rows] = np.where(good, step * factor, step / 2)
        least = SMALLEST * np.maximum(1 - t[rows], NEARLY)  # solutions may nearly meet at the end
        going[rows] = (h[rows] > least) & _near(x[rows], far)
    return _ended(system, x, t >= 1)


def _ended(system: System, x: Complexes, followed: Booleans) -> PathEnds:
    """Return end points after Newton steps that no longer shrink."""
    one, best = np.ones(len(x)), np.full(len(x), np.inf)
    for _ in range(FINAL):
        F, J, _ = system(x, one)
        step = solve(J, F)
        size = _largest(step)
        better = followed & (size < best)
        x = np.where(better[:, None], x - step, x)
        best = np.where(better, size, best)
    return PathEnds(x, followed, best)


def distinct(x: Complexes, same: float) -> Integers:
    """Return the indices of rows that are no copies of earlier ones, by their largest entry."""
    chosen: list[int] = []
    for row in range(len(x)):
        if not chosen or np.abs(x[chosen] - x[row]).max(axis=1).min() > same:
            chosen.append(row)
    return np.array(chosen, int)

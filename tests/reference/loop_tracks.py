"""Motions of loops of dual quaternions, followed from one pose with short steps."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.reference.dual_quaternions import EXACT, Loops

SHORTEST = 2.0**-12
"""Of the way from one pose to the next: where a shorter step is needed the track is lost."""
CLOSE, BEND = 0.02, 0.3
"""The largest first correction of a step, and that to the size of the step itself."""


def tracked(loops: Loops, start: Any, goals: Any, parts: int = 4) -> tuple[list[Any], Any]:
    """Return the states (c, spins) at goals, one after the other, and which were reached (k, n).

    Parameters
    ----------
    start
        Coordinates (k, n) and spins, closed.
    goals : (k, m)
        Values of the driver, one after the other.
    parts
        Steps from one to the next, at first.

    Notes
    -----
    A step follows the tangent and is corrected. It counts where the first correction is small, in
    radians and against the step, tangents at its ends agree, and the determinant keeps its sign.
    """
    c, spins = start[0].astype(float), {k: q.astype(float) for k, q in start[1].items()}
    alive = np.ones(len(c), bool)
    found, reached = [], np.zeros(goals.shape, bool)
    with np.errstate(all="ignore"):
        for m in range(goals.shape[1]):
            c, spins, alive = _onwards(loops, c, spins, alive, goals[:, m].astype(float), parts)
            exact = loops.at(c.astype(EXACT), goals[:, m])
            wide = {k: q.astype(EXACT) for k, q in spins.items()}
            exact, wide, first, last = loops.newton(exact, wide)
            good = alive & (first < 1e-6) & (last < 1e-13)
            reached[:, m] = good
            found.append((exact, wide, last))
    return found, reached


def _tangent(loops: Loops, slopes: Any) -> tuple[Any, Any]:
    """Return the rates (k, free) by the driver and the sign of the determinant."""
    J = slopes[..., loops.free]
    rates = -loops.solve(_sound(J), slopes[..., loops.driven])
    square = J.shape[1] == J.shape[2]
    return rates, np.linalg.slogdet(J)[0] if square else np.ones(len(J))


def _sound(J: Any) -> Any:
    """Return with unit matrices in the place of what is not finite: tracks that are lost."""
    bad = ~np.isfinite(J).all(axis=(1, 2))
    J = J.copy()
    J[bad] = np.eye(J.shape[1], J.shape[2])
    return J


def _onwards(
    loops: Loops, c: Any, spins: Any, alive: Any, goal: Any, parts: int
) -> tuple[Any, Any, Any]:
    """Return the states at the next goal and which are still on their track."""
    here, whole = c[:, loops.driven].copy(), goal - c[:, loops.driven]
    share, h = np.zeros(len(c)), np.full(len(c), 1.0 / parts)
    alive = alive.copy()
    rates, sign = _tangent(loops, loops.placed(c, spins)[2])
    while True:
        going = alive & (share < 1)
        if not going.any():
            return c, spins, alive
        h = np.where(going, np.minimum(h, 1 - share), 0.0)
        du = h * whole
        step = rates * du[:, None]
        trial, turned = loops.corrected(c, spins, np.where(going[:, None], step, 0))
        trial = loops.at(trial, here + (share + h) * whole)
        _, gaps, slopes = loops.placed(trial, turned)
        fix = -loops.solve(_sound(slopes[..., loops.free]), gaps)
        trial, turned = loops.corrected(trial, turned, fix)
        _, gaps, slopes = loops.placed(trial, turned)
        last = -loops.solve(_sound(slopes[..., loops.free]), gaps)
        trial, turned = loops.corrected(trial, turned, last)
        after, turned_sign = _tangent(loops, slopes)
        size, miss = np.abs(step).max(axis=1), np.abs(fix).max(axis=1)
        bent = np.abs(after - rates).max(axis=1) * np.abs(du)
        good = (miss <= CLOSE) & (miss <= BEND * size + 1e-12) & (bent <= 0.5 * size + 1e-12)
        good &= (turned_sign == sign) & (np.abs(last).max(axis=1) <= 1e-5 * (1 + size))
        good &= going & np.isfinite(trial).all(axis=1)
        c = np.where(good[:, None], trial, c)
        spins = {k: np.where(good[:, None], turned[k], q) for k, q in spins.items()}
        rates = np.where(good[:, None], after, rates)
        share = np.where(good, share + h, share)
        share = np.where(good & (share > 1 - 1e-9), 1.0, share)
        h = np.where(good, 1.5 * h, h / 4)
        alive &= ~going | good | (h >= SHORTEST)
        h = np.where(h <= 0, 1.0 / parts, h)

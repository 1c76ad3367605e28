"""Starts for coupler curves by variable projection.

For fixed ratios of the links and a programme of the crank the coupler point is linear in what
is left: P_i = t + alpha exp(i theta2_i) + beta exp(i theta3_i) with complex t, alpha, beta.
Ratios (and spacings of the crank, where they are free) are drawn evenly, the rest is a small
least squares problem for all samples at once; the best and mutually distant ones are kept.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.numerics.linear_fits import linear_fit
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Integers, Points

if TYPE_CHECKING:
    from numpy.random import Generator


RIDGE = 1e-12
"""Damping for each target, of coordinates of order one."""
DISTANT = 0.15
"""Starts differ by this much in the logarithm of a ratio."""


@dataclass(frozen=True)
class StartingFourBar:
    """A four-bar with its poses: lengths (4,), pivot, turn of the ground, coupler point (2,).

    ``turns`` (k,) are angles of the crank from the ground line, ``sense`` the sense in which it
    turns, ``branch`` the sign of sin(theta4 - theta3), ``residual`` the sum of squares.
    """

    lengths: Floats
    pivot: complex
    turn: float
    point: complex
    turns: Floats
    couplers: Floats
    rockers: Floats
    branch: int
    sense: int
    residual: float


def ratios(generator: Generator, count: int, kind: str) -> Floats:
    """Return ratios (r1, r3, r4)/r2 (count, 3) of a Grashof class whose crank turns fully."""
    found: list[Floats] = []
    total = 0
    while total < count:
        r = np.exp(generator.uniform(np.log(0.2), np.log(15.0), (4 * count, 3)))
        r1, r3, r4 = r.T
        if kind == "crank-rocker":
            good = (1 + r1 <= r3 + r4) & (1 + r3 <= r1 + r4) & (1 + r4 <= r1 + r3)
        else:
            good = (r1 + 1 <= r3 + r4) & (r1 + r3 <= 1 + r4) & (r1 + r4 <= 1 + r3)
        found.append(r[good])
        total += int(good.sum())
    return np.concatenate(found)[:count]


def spacings(generator: Generator, count: int, k: int) -> Floats:
    """Return angles (count, k) of a crank that visits k places in order within a turn."""
    gaps = generator.dirichlet(np.ones(k), count) * 2 * np.pi
    turned = np.cumsum(gaps, axis=1)
    return turned - turned[:, :1] + generator.uniform(0, 2 * np.pi, (count, 1))


def screened(
    targets: Points,
    generator: Generator,
    count: int,
    keep: int,
    kind: str,
    programme: Any,
    mode: str,
    frame: tuple[complex, float] | None = None,
    limits: Points | None = None,
) -> list[StartingFourBar]:
    """Return the best mutually distant starts.

    `targets` (k, 2). `programme` (k,): angles of the crank, or increments from a free start; None:
    free, in order. `mode`: "absolute", "steps", "free" (in order) or "any". `frame`: fixed pivot
    and ground direction, None where they are free. `limits` (4, 2): bounds of the lengths: samples
    beyond are ranked lower.
    """
    k = len(targets)
    P = targets[:, 0] + 1j * targets[:, 1]
    r = ratios(generator, count, kind)
    sense = generator.choice((-1, 1), count)
    branch = generator.choice((-1, 1), count)
    if mode == "absolute":
        theta2 = np.broadcast_to(programme, (count, k)).copy()
        sense[:] = 1 if programme[-1] >= programme[0] else -1
    elif mode == "steps":
        theta2 = sense[:, None] * programme + generator.uniform(0, 2 * np.pi, (count, 1))
    elif mode == "any":
        theta2 = generator.uniform(0, 2 * np.pi, (count, k))
    else:
        theta2 = sense[:, None] * spacings(generator, count, k)
    theta3, theta4 = closed_loop(r, theta2, branch)
    e2, e3 = np.exp(1j * theta2), np.exp(1j * theta3)
    size, turn, pivot, point, f = _placed(P, e2, e3, frame)
    lengths = np.stack([r[:, 0] * size, size, r[:, 1] * size, r[:, 2] * size], axis=1)
    rank = np.where((size > 0) & np.isfinite(f), f, np.inf)
    if limits is not None:
        low, high = limits.T
        beyond = np.maximum(lengths - high, 0) + np.maximum(low - lengths, 0)
        spread = np.sum(np.abs(P - P.mean()) ** 2)
        most = np.where(high > 0, high, high.max(initial=1e-300))
        rank = rank + spread * np.sum((beyond / most) ** 2, axis=1)
    return [
        StartingFourBar(
            lengths[n], complex(pivot[n]), float(turn[n]), complex(point[n]), theta2[n],
            theta3[n], theta4[n], int(branch[n]), int(sense[n]), float(f[n]),
        )
        for n in _distant(rank, np.log(r), branch, keep)
    ]  # fmt: skip


def _placed(
    P: Complexes, e2: Complexes, e3: Complexes, frame: tuple[complex, float] | None
) -> tuple[Floats, Floats, Complexes, Complexes, Floats]:
    """Return sizes, turns, pivots and coupler points (n,) that fit best, and sums of squares."""
    count, k = e2.shape
    if frame is None:
        A, b = np.stack([np.ones_like(e2), e2, e3], axis=2), P
        solution = linear_fit(A, b, least=RIDGE * k)
        pivot, alpha, beta = solution.T
        size, turn = np.abs(alpha), np.angle(alpha)
        point = beta * np.exp(-1j * turn)
    else:
        origin, fixed = frame
        Q = (P - origin) * np.exp(-1j * fixed)
        columns = np.stack([e2, e3, 1j * e3], axis=2)
        A = np.concatenate([columns.real, columns.imag], axis=1)
        b = np.concatenate([Q.real, Q.imag])
        solution = linear_fit(A, b, least=RIDGE * k)
        size, point = solution[:, 0], solution[:, 1] + 1j * solution[:, 2]
        pivot, turn = np.full(count, origin), np.full(count, fixed)
    left = np.einsum("nki,ni->nk", A, solution) - b
    return size, turn, pivot, point, np.sum(np.abs(left) ** 2, axis=1)


def _distant(rank: Floats, logs: Floats, branch: Integers, keep: int) -> list[int]:
    """Return the best samples that are distant from each other, `keep` at most."""
    kept: list[int] = []
    for n in np.argsort(rank, kind="stable"):
        if not np.isfinite(rank[n]) or len(kept) == keep:
            break
        near = [
            m for m in kept
            if branch[m] == branch[n] and np.abs(logs[m] - logs[n]).max() < DISTANT
        ]  # fmt: skip
        if not near:
            kept.append(int(n))
    return kept


def closed_loop(r: Floats, theta2: Floats, branch: Integers) -> tuple[Floats, Floats]:
    """Return angles of coupler and rocker (n, k) for ratios (n, 3), unwrapped along the poses."""
    d = r[:, :1] - np.exp(1j * theta2)
    size = np.abs(d)
    cosine = (size**2 + r[:, 1:2] ** 2 - r[:, 2:] ** 2) / (2 * size * r[:, 1:2])
    opened = np.arccos(np.clip(cosine, -1.0, 1.0))
    theta3 = np.angle(d) + branch[:, None] * opened
    end = np.exp(1j * theta2) + r[:, 1:2] * np.exp(1j * theta3) - r[:, :1]
    return np.unwrap(theta3, axis=1), np.unwrap(np.angle(end), axis=1)

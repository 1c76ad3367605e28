"""Screening: random dimensions that assemble over a whole turn, and many tracing points of each.

Of a tracing point in the frame of two points of a link many places are tried: their curves are sums
of two.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.parts.types.schemes.aims import ANGLE, PATH, Aim
from mechdae.parts.types.schemes.closure import SchemeTurn
from mechdae.parts.types.schemes.drawing import amount_of, drawn, shares
from mechdae.parts.types.schemes.scheme import RIGID, Scheme, pivot_of
from mechdae.parts.types.schemes.shape import centred, fitted, resampled
from mechdae.parts.types.schemes.targets.functions import based, measured_gaps, outputs
from mechdae.types import Complexes, Floats

if TYPE_CHECKING:
    from numpy.random import Generator

BETWEEN = 48
"""Crank angles beside those of the targets."""
SPACINGS = 12
"""Of free targets over the turn that are tried with each set."""
RIDGE = 1e-12
ANGLES, POINTS = 64, 64
PLACES = 24
"""Tracing points tried with each set."""
TURN = 2 * np.pi


def screened_sets(
    scheme: Scheme, aim: Aim, count: int, seed: list[int], keep: int, limits: list[float]
) -> tuple[Complexes, Floats]:
    """Return the places (k, n) of the best sets, and their measures (k,)."""
    generator = np.random.default_rng(seed)
    angles = aim.nodes(BETWEEN)
    x = drawn(scheme, count, angles, generator)
    if aim.what == PATH:
        places, error = _on_targets(scheme, aim, x, angles, generator)
    else:
        places, error = _as_function(scheme, aim, x, angles)
    # in their own place and size: ways of guides are those of the sets drawn, times their size
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.abs((places[:, 1] - places[:, 0]) / (x[1, :, 0] - x[0, :, 0]))
    amounts = size * amount_of(scheme, places / size[:, None], x)
    found: dict[int, None] = {}
    for limit in limits:
        allowed = np.where((amounts <= limit) & np.isfinite(error), error, np.inf)
        order = np.argsort(allowed, kind="stable")[:keep]
        found |= dict.fromkeys(order[np.isfinite(allowed[order])].tolist())
    chosen = list(found)
    return places[chosen], error[chosen]


def _on_targets(
    scheme: Scheme, aim: Aim, x: Complexes, angles: Floats, generator: Generator
) -> tuple[Complexes, Floats]:
    """Return sets laid on the targets, with the best tracing point, and their errors."""
    targets = np.array(aim.targets)
    count, k = x.shape[1], len(targets)
    if aim.angles:
        at = np.broadcast_to(np.arange(k), (count, 1, k))
    else:
        at = _spaced(aim, count, len(angles), k, generator)
    kind, i, j = scheme.points[scheme.trace]
    parts = (i, j) if kind == RIGID else (scheme.trace,)
    rows = np.arange(count)[:, None, None]
    columns = [np.ones(at.shape, complex), *(x[p][rows, at] for p in parts)]
    solved, error = _least_squares(np.stack(columns, axis=3), targets, np.array(aim.weights))
    best = error.argmin(axis=1)
    solved, error = (values[np.arange(count), best] for values in (solved, error))
    factor = solved[:, 1:].sum(axis=1)
    places = x[:, :, 0].T.copy()
    if kind == RIGID:
        with np.errstate(invalid="ignore", divide="ignore"):
            share = solved[:, 2] / factor
        places[:, scheme.trace] = places[:, i] + share * (places[:, j] - places[:, i])
    return factor[:, None] * places + solved[:, :1], error


def _spaced(aim: Aim, count: int, size: int, k: int, generator: Generator) -> Any:
    """Return numbers of crank angles (count, `SPACINGS`, k) for targets in their order."""
    shape = (count, SPACINGS)
    gaps = generator.exponential(1.0, (*shape, k)) + 0.3
    if not aim.ordered:
        gaps = generator.exponential(1.0, (*shape, k))
    shares = np.cumsum(gaps, axis=2)
    shares = (shares - shares[:, :, :1]) / shares[:, :, -1:]
    # most of a turn, or a part of it
    part = generator.choice([1.0, 0.7, 0.4], shape)
    first = generator.uniform(0, 1, shape)
    sense = generator.choice([-1.0, 1.0], shape)
    turns = first[:, :, None] + (sense * part)[:, :, None] * shares
    return np.floor(size * turns).astype(int) % size


def _least_squares(
    matrix: Complexes, targets: Complexes, weights: Floats
) -> tuple[Complexes, Floats]:
    """Return unknowns (b, s, u) and root mean squares (b, s) of fits to targets (k,)."""
    conj = np.conj(matrix) * weights[:, None]
    normal = np.einsum("bsku,bskv->bsuv", conj, matrix)
    right = np.einsum("bsku,k->bsu", conj, targets)
    size = np.einsum("bsuu->bs", normal).real
    normal = normal + (RIDGE * size)[:, :, None, None] * np.eye(normal.shape[2])
    solved = np.linalg.solve(normal, right[:, :, :, None])[:, :, :, 0]
    gaps = np.einsum("bsku,bsu->bsk", matrix, solved) - targets
    return solved, np.sqrt((weights * np.abs(gaps) ** 2).sum(axis=2))


def _as_function(scheme: Scheme, aim: Aim, x: Complexes, angles: Floats) -> tuple[Any, Any]:
    """Return sets with the best size of a slide, and their errors."""
    targets = np.array(aim.targets, float)
    places = x[:, :, 0].T.copy()
    turn = SchemeTurn(x, {})
    found = outputs(scheme, turn, places, aim, angles)[:, : len(targets)]
    if aim.what == ANGLE:
        error, _ = measured_gaps(targets - found, aim)
        return based(scheme, places, aim), error
    middle = found.mean(axis=1, keepdims=True)
    gap = found - middle
    size = (gap * targets).sum(axis=1) / np.maximum((gap**2).sum(axis=1), 1e-300)
    error, _ = measured_gaps(targets - size[:, None] * found, aim)
    k, g = scheme.trace, pivot_of(scheme)
    # a guide seen from its other side
    places[:, g] = np.where(size < 0, 2 * places[:, k] - places[:, g], places[:, g])
    return based(scheme, np.abs(size)[:, None] * places, aim), error


def screened(
    scheme: Scheme, wanted: Complexes, count: int, seed: list[int], keep: int, limits: list[float]
) -> tuple[Complexes, Floats]:
    """Return the places (k, n) of the best sets, and their mean square distances (k,)."""
    generator = np.random.default_rng(seed)
    angles = TURN * np.arange(ANGLES) / ANGLES
    x = drawn(scheme, count, angles, generator)
    kind, i, j = scheme.points[scheme.trace]
    rows = np.arange(count)
    if kind == RIGID:
        share = shares(generator, (count, PLACES))
        curves = x[i][:, None, :] + share[:, :, None] * (x[j] - x[i])[:, None, :]
    else:
        share = None
        curves = x[scheme.trace][:, None, :]
    flat = curves.reshape(-1, ANGLES)
    points = centred(resampled(flat, POINTS).points)
    straight, mirrored = (fitted(curve, wanted, scaled=True) for curve in (points, np.conj(points)))
    mirror = mirrored.residual < straight.residual
    residual = np.where(mirror, mirrored.residual, straight.residual).reshape(count, -1)
    factor = np.where(mirror, mirrored.factor, straight.factor).reshape(count, -1)
    places = x[:, :, 0].T.copy()
    found_places, found = [], []
    amounts = np.empty(residual.shape)
    for p in range(residual.shape[1]):
        if share is not None:
            places[:, scheme.trace] = x[i, :, 0] + share[:, p] * (x[j, :, 0] - x[i, :, 0])
        amounts[:, p] = amount_of(scheme, places, x) * np.abs(factor[:, p])
    for limit in limits:
        allowed = np.where(amounts <= limit, residual, np.inf)
        best = allowed.argmin(axis=1)
        value = allowed[rows, best]
        order = np.argsort(value, kind="stable")[:keep]
        for k in order[np.isfinite(value[order])].tolist():
            p = best[k]
            whole = x[:, k, 0].copy()
            if share is not None:
                whole[scheme.trace] = x[i, k, 0] + share[k, p] * (x[j, k, 0] - x[i, k, 0])
            if mirror.reshape(count, -1)[k, p]:
                whole = np.conj(whole)
            found_places.append(factor[k, p] * (whole - whole[0]))
            found.append(value[k])
    if not found:
        return np.zeros((0, scheme.size), complex), np.zeros(0)
    return np.array(found_places), np.array(found)

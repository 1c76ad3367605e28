"""Screening: random dimensions that assemble over a whole turn, and many tracing points of each.

Of a tracing point in the frame of two points of a link many places are tried: their curves are sums
of two.

Points are drawn one after the other. Bars of a dyad are drawn such that they reach from the
least to the largest distance of the points that they hang on; a bar to a block reaches beyond the
way of its pin across the guide, a slot passes its rod's pin nearer than the block ever comes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.parts.types.schemes.aims import ANGLE, PATH, Aim
from mechdae.parts.types.schemes.closure import Moved, SchemeTurn, material, slid, turning
from mechdae.parts.types.schemes.scheme import CRANK, DYAD, FIXED, RIGID, SLIDER, Scheme, pivot_of
from mechdae.parts.types.schemes.shape import centred, fitted, resampled
from mechdae.parts.types.schemes.targets.visits import based, measured_gaps, outputs
from mechdae.types import Complexes, Floats

if TYPE_CHECKING:
    from numpy.random import Generator

MARGIN = 0.12
"""By how much bars reach further than they must, at least."""
BETWEEN = 48
"""Crank angles beside those of the targets."""
SPACINGS = 12
"""Of free targets over the turn that are tried with each set."""
RIDGE = 1e-12
ANGLES, POINTS = 64, 64
PLACES = 24
"""Tracing points tried with each set."""
TURN = 2 * np.pi


def drawn(scheme: Scheme, count: int, angles: Floats, generator: Generator) -> Complexes:
    """Return the places (n, count, t) of all points over a turn; the crank has length 1."""
    x = np.empty((scheme.size, count, len(angles)), complex)
    for k, (kind, i, j) in enumerate(scheme.points):
        if kind == FIXED:
            far = 0.0 if k == 0 else _far(generator, count)
            x[k] = np.broadcast_to(np.asarray(far).reshape(-1, 1), x[k].shape)
        elif kind == CRANK:
            x[k] = np.exp(1j * angles)
        elif kind == RIGID:
            share = 0.0 if k == scheme.trace else shares(generator, (count, 1))
            x[k] = x[i] + share * (x[j] - x[i])
        elif kind == DYAD:
            first, second, side = reaching(x[i], x[j], generator)
            gap = x[j] - x[i]
            far = np.abs(gap) ** 2
            along = (first**2 - second**2 + far) / (2 * far)
            across = np.sqrt(np.maximum(first**2 / far - along**2, 0.0))
            x[k] = x[i] + gap * (along + 1j * side * across)
        else:
            x[k, :, 0] = middle(scheme, x, k, generator)
            x[k], _ = slid(scheme, Moved(x[:, :, :1], x), k)
    return x


def middle(scheme: Scheme, x: Complexes, k: int, generator: Generator) -> Any:
    """Return a place (b,) at the first angle of the middle of a dyad with a slide."""
    kind, i, j = scheme.points[k]
    count = x.shape[1]
    way = np.exp(1j * generator.uniform(0, TURN, (count, 1)))
    if kind == SLIDER:
        off = ((x[i] - x[j]) * np.conj(way * turning(scheme, Moved(x[:, :, :1], x), j))).imag
        far, size = np.abs(off).max(axis=1), np.abs(x[i] - x[j]).mean(axis=1)
        length = (1 + MARGIN) * far + size * generator.exponential(0.5, count)
        first = (x[i, :, :1] - x[j, :, :1]) * np.conj(way)
        side = generator.choice([-1.0, 1.0], count)
        along = first.real[:, 0] + side * np.sqrt(length**2 - first.imag[:, 0] ** 2)
        return x[j, :, 0] + along * way[:, 0]
    gap = x[j] - x[i]
    near = np.abs(gap).min(axis=1)
    off = (1 - MARGIN) * near * generator.uniform(-1, 1, count)
    off = off * (generator.random(count) < OFFSET)
    side = generator.choice([-1.0, 1.0], count)
    first = gap[:, 0]
    along = side * np.sqrt(np.abs(first) ** 2 - off**2)
    slot = first / (along + 1j * off)
    slot = slot / np.abs(slot)
    arm = np.abs(gap).mean(axis=1) * np.exp(generator.normal(0, 0.6, count))
    # on the slot, to one side of the foot of its pin or the other
    arm = arm * generator.choice([-1.0, 1.0], count)
    return x[i, :, 0] + slot * (1j * off + arm)


OFFSET = 0.6
"""Share of rods whose slot passes beside their pin."""


def amount_of(scheme: Scheme, places: Complexes, x: Complexes) -> Any:
    """Return the material (b,) of sets whose places (n, b, t) are known."""
    return material(scheme, places, turn=SchemeTurn(x, {}) if scheme.ways else None)


def reaching(
    one: Complexes, other: Complexes, generator: Generator, margin: float = MARGIN
) -> tuple[Floats, Floats, Floats]:
    """Return lengths of two bars (b, 1) between moving points that always meet, and a side."""
    far = np.abs(other - one)
    low, high = far.min(axis=1, keepdims=True), far.max(axis=1, keepdims=True)
    count = len(low)
    least = high * (1 + margin)
    whole = least + high * generator.exponential(0.5, (count, 1))
    most = (1 - margin) * low
    difference = most * generator.uniform(-1, 1, (count, 1))
    side = generator.choice([-1.0, 1.0], (count, 1))
    return (whole + difference) / 2, (whole - difference) / 2, side


def _far(generator: Generator, count: int) -> Any:
    size = np.exp(generator.normal(0.8, 0.6, count))
    return size * np.exp(1j * generator.uniform(0, TURN, count))


def shares(generator: Generator, shape: tuple[int, ...]) -> Complexes:
    return 0.5 + generator.normal(0, 0.9, shape) + 1j * generator.normal(0, 0.9, shape)


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


def _as_function(
    scheme: Scheme, aim: Aim, x: Complexes, angles: Floats
) -> tuple[Complexes, Floats]:
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

"""Dimensions drawn at random such that a scheme assembles at all angles of its crank.

Points are drawn one after the other. Bars of a dyad are drawn such that they reach from the
least to the largest distance of the points that they hang on; a bar to a block reaches beyond the
way of its pin across the guide, a slot passes its rod's pin nearer than the block ever comes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.parts.types.schemes.closure import SchemeTurn, material
from mechdae.parts.types.schemes.scheme import CRANK, DYAD, FIXED, RIGID, SLIDER, Scheme
from mechdae.parts.types.schemes.slides import Moved, slid, turning
from mechdae.types import Complexes, Floats

if TYPE_CHECKING:
    from numpy.random import Generator


MARGIN = 0.12
"""By how much bars reach further than they must, at least."""
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

"""Dyads with a sliding pair in closed form: places, sines of transmission, exact derivatives.

A guide is the straight line through a point of its link and the middle of the dyad in the pose
that a scheme is described by; it turns with the link.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.parts.types.schemes.scheme import CRANK, FIXED, SLIDER, Scheme
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Integers, Matrices


@dataclass
class Moved:
    """A batch of arrays by point: places in the first pose and at angles, and derivatives.

    ``start``, ``x`` (n, b, 1) and (n, b, t) complex. ``rates``, ``found``: derivatives of places in
    the first pose (n, p), and of those at angles (b, t, p) each.
    """

    start: Complexes
    x: Complexes
    rates: Any = None
    found: Any = None

    def at(self, rows: Integers, places: Integers) -> Moved:
        """Return one angle of each set."""
        picked = {
            k: np.broadcast_to(d, (*self.x.shape[1:], d.shape[-1]))[rows, places][:, None]
            for k, d in enumerate(self.found)
        }
        return Moved(self.start, self.x[:, rows, places][:, :, None], self.rates, picked)


def turning(scheme: Scheme, moved: Moved, g: int) -> Any:
    """Return by what a link with a guide has turned (b, t), complex of size one."""
    kind, i, j = scheme.points[g]
    if kind == FIXED:
        return np.ones((1, 1), complex)
    i, j = (0, g) if kind == CRANK else (i, j)
    return (moved.x[j] - moved.x[i]) / (moved.start[j] - moved.start[i])


def _turning_rate(scheme: Scheme, moved: Moved, g: int, turn: Complexes) -> Any:
    kind, i, j = scheme.points[g]
    if kind == FIXED:
        return np.zeros((1, 1, moved.rates.shape[1]), complex)
    i, j = (0, g) if kind == CRANK else (i, j)
    span = (moved.start[j] - moved.start[i])[:, :, None]
    gap = moved.rates[j] - moved.rates[i]
    return (moved.found[j] - moved.found[i] - turn[:, :, None] * gap) / span


def slid(scheme: Scheme, moved: Moved, k: int) -> tuple[Complexes, Floats]:
    """Return the places of the middle of a dyad with a sliding pair, and the sines (b, t)."""
    kind, i, j = scheme.points[k]
    start, x = moved.start, moved.x
    if kind == SLIDER:
        way = start[k] - start[j]
        way = way / np.abs(way) * turning(scheme, moved, j)
        first = start[k] - start[i]
        length = np.abs(first)
        side = np.sign((np.conj(first) * (start[k] - start[j])).real)
        off = (x[j] - x[i]) * np.conj(way)
        along = side * np.sqrt(length**2 - off.imag**2)
        return x[j] + (along - off.real) * way, np.abs(along) / length
    way = start[j] - start[k]
    way = way / np.abs(way)
    off = (start[j] - start[i]) * np.conj(way)
    gap = x[j] - x[i]
    far = np.abs(gap)
    along = np.sign(off.real) * np.sqrt(far**2 - off.imag**2)
    turn = gap / ((along + 1j * off.imag) * way)
    return x[i] + (start[k] - start[i]) * turn, np.abs(along) / far


def slid_derivatives(scheme: Scheme, moved: Moved, k: int) -> Any:
    """Return the derivatives (b, t, p) of the middle by implicit differentiation."""
    kind, i, j = scheme.points[k]
    start, x, rates, found = moved.start, moved.x, moved.rates, moved.found
    if kind == SLIDER:
        turn = turning(scheme, moved, j)
        way = (start[k] - start[j]) * turn
        share = ((x[k] - x[j]) / way).real[:, :, None]
        e = x[k] - x[i]
        first = start[k] - start[i]
        longer = (np.conj(first)[:, :, None] * (rates[k] - rates[i])).real
        moving = found[j] + share * _way_rate(scheme, moved, k, turn)
        rest = longer - (np.conj(e)[:, :, None] * (moving - found[i])).real
        return moving + way[:, :, None] * (rest / (np.conj(e) * way).real[:, :, None])
    turn, rate = _rod(moved, i, j, k)
    arm = start[k] - start[i]
    turned = (rates[k] - rates[i]) * turn[:, :, None]
    return found[i] + turned + (1j * arm * turn)[:, :, None] * rate


def _way_rate(scheme: Scheme, moved: Moved, k: int, turn: Complexes) -> Any:
    """Return the derivatives of the direction of a guide, as long as it was drawn."""
    _, _, j = scheme.points[k]
    start, rates = moved.start, moved.rates
    spin = _turning_rate(scheme, moved, j, turn)
    return (rates[k] - rates[j]) * turn[:, :, None] + (start[k] - start[j])[:, :, None] * spin


def _rod(moved: Moved, i: int, j: int, k: int) -> tuple[Complexes, Matrices]:
    """Return by what a rod has turned (b, t), and the derivatives (b, t, p) of that angle."""
    start, x, rates, found = moved.start, moved.x, moved.rates, moved.found
    turn = (x[k] - x[i]) / (start[k] - start[i])
    way, gap = start[j] - start[k], x[j] - x[i]
    slot = way * turn
    swung = rates[j] - rates[k]
    before = ((rates[j] - rates[i]) * np.conj(way)[:, :, None]).imag + (
        (start[j] - start[i])[:, :, None] * np.conj(swung)
    ).imag
    now = ((found[j] - found[i]) * np.conj(slot)[:, :, None]).imag + (
        gap[:, :, None] * np.conj(swung * turn[:, :, None])
    ).imag
    return turn, (now - before) / (gap * np.conj(slot)).real[:, :, None]


def sine_rate(scheme: Scheme, moved: Moved, k: int, rate: Complexes) -> Any:
    """Return the derivatives (b, t, p) of the sine of a dyad with a sliding pair."""
    kind, i, j = scheme.points[k]
    start, x, rates, found = moved.start, moved.x, moved.rates, moved.found
    if kind == SLIDER:
        turn = turning(scheme, moved, j)
        one, done = x[k] - x[i], rate - found[i]
        other, dother = (start[k] - start[j]) * turn, _way_rate(scheme, moved, k, turn)
    else:
        turn, angle = _rod(moved, i, j, k)
        one, done = x[j] - x[i], found[j] - found[i]
        other = (start[j] - start[k]) * turn
        dother = (rates[j] - rates[k]) * turn[:, :, None] + 1j * other[:, :, None] * angle
    cosine = (np.conj(one) * other).real
    sizes = np.abs(one) * np.abs(other)
    one, other = one[:, :, None], other[:, :, None]
    change = (np.conj(done) * other + np.conj(one) * dother).real
    shares = (np.conj(one) * done).real / np.abs(one) ** 2
    shares = shares + (np.conj(other) * dother).real / np.abs(other) ** 2
    found_rate = (change - cosine[:, :, None] * shares) / sizes[:, :, None]
    return np.sign(cosine)[:, :, None] * found_rate

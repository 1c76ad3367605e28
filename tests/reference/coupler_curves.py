"""Coupler curves of linkages drawn at random, and how far closed curves are apart, with NumPy."""

from __future__ import annotations

import numpy as np


def evenly(curve, count):
    """Return so many of the places of a dense closed curve (n,), at about equal lengths of arc."""
    far = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(np.append(curve, curve[0]))))])
    return curve[np.searchsorted(far, np.arange(count) / count * far[-1]) % len(curve)]


def drawn_four_bar(generator, count=240, full=True, size=0.1):
    """Return the closed curve (count,), complex, of a four-bar with places drawn in a square.

    `full`: one whose driven link turns fully; otherwise one whose links all swing, on both of its
    branches, one after the other.
    """
    while True:
        crank, a, b, other, point = generator.random((5, 2)) @ [1, 1j]
        r, bar, rocker, ground = abs(a - crank), abs(b - a), abs(other - b), abs(other - crank)
        if min(r, bar, rocker, ground) < 0.05:
            continue
        turns = abs(ground - r) > abs(bar - rocker) and ground + r < bar + rocker
        lengths = sorted([r, bar, rocker, ground])
        swings = lengths[0] + lengths[3] > lengths[1] + lengths[2]
        if not (turns if full else swings):
            continue
        angle = np.linspace(0, 2 * np.pi, 20_000, endpoint=False)
        side = np.ones_like(angle)
        if not full:
            reach = np.clip(
                (r * r + ground**2 - np.array([(bar - rocker) ** 2, (bar + rocker) ** 2]))
                / (2 * r * ground), -1, 1,
            )  # fmt: skip
            near, far = np.arccos(reach)
            side = np.where(np.cos(angle) < 0, -1.0, 1.0)
            if far == np.pi:  # both arcs are one, about the line away from the ground
                far = 2 * np.pi - near
            elif near == 0:
                near = -far
            angle = (near + far) / 2 + (far - near) / 2 * (1 - 1e-12) * np.sin(angle)
        line = (other - crank) / ground
        pin = crank + r * line * np.exp(1j * angle)
        rest = other - pin
        along = (bar**2 - rocker**2 + np.abs(rest) ** 2) / (2 * np.abs(rest))
        height = side * np.sqrt(np.maximum(bar**2 - along**2, 0))
        end = pin + (along + 1j * height) * rest / np.abs(rest)
        return size * evenly(pin + (point - a) / (b - a) * (end - pin), count)


def drawn_geared_five_bar(generator, ratio, count=240, size=0.05):
    """Return the closed curve (count,), complex, of a five-bar whose second crank is geared.

    The first crank has the length 1 and turns fully, the second one `ratio` times as fast.
    """
    turn = np.linspace(0, 2 * np.pi, 20_000, endpoint=False)
    while True:
        second, ground, bar, rod = np.exp(
            generator.uniform([-1, -0.5, 0.2, 0.2], [0.5, 1.3, 1.5, 1.5])
        )
        phase, aside = generator.uniform(-np.pi, np.pi, 2)
        pin = np.exp(1j * turn)
        rest = ground + second * np.exp(1j * (ratio * turn + phase)) - pin
        far = np.abs(rest)
        if far.min() < 1.05 * abs(bar - rod) or far.max() > 0.95 * (bar + rod):
            continue
        along = (bar**2 - rod**2 + far**2) / (2 * far)
        way = (along + 1j * np.sqrt(bar**2 - along**2)) * rest / far
        point = generator.uniform(0.2, 1.5) * np.exp(1j * aside)
        return size * evenly(pin + point * way, count)


def beyond(curve, way):
    """Return the largest distance of places from a closed polyline."""
    base, side = way[None], np.roll(way, -1)[None] - way[None]
    rest = curve[:, None] - base
    share = (rest * side.conj()).real / np.maximum(np.abs(side) ** 2, 1e-300)
    return float(np.abs(rest - np.clip(share, 0, 1) * side).min(axis=1).max())


def off(curve, way):
    """Return Hausdorff's distance of closed curves as a share of the first one's larger side."""
    size = max(np.ptp(curve.real), np.ptp(curve.imag))
    return max(beyond(curve, way), beyond(way, curve)) / size

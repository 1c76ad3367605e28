"""What tolerances do to four-bars and slider-cranks, by closed forms and Monte Carlo, batched.

Each set of dimensions is closed by a triangle; nothing is linear, nothing comes from the package.
Parameters lie evenly in their value -+ half width, independently.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

SAMPLES = 100_000
CHUNK = 4_000
TURN = np.linspace(0.0, 2 * np.pi, 721)[:-1]


def drawn(middle, widths, count=SAMPLES, seed=0):
    """Return sets of parameters by name (count,); those without a half width stay."""
    generator = np.random.default_rng(seed)
    return {
        name: value + widths.get(name, 0.0) * generator.uniform(-1, 1, count)
        for name, value in middle.items()
    }


def in_chunks(function: Callable, sets):
    """Return a function of sets of parameters, chunk by chunk: what it makes may be large."""
    count = len(next(iter(sets.values())))
    parts = [
        function({name: own[k : k + CHUNK] for name, own in sets.items()})
        for k in range(0, count, CHUNK)
    ]
    return np.concatenate(parts)


# -- four-bars: ground r1, crank r2, coupler r3, rocker r4 -----------------------------------------


def four_bar(p, turn, sign):
    """Return angles of coupler and rocker (n, k) at crank angles from the ground line."""
    r1, r2, r3, r4 = (np.asarray(p[name])[:, None] for name in ("r1", "r2", "r3", "r4"))
    x, y = r2 * np.cos(turn), r2 * np.sin(turn)
    gap = np.hypot(r1 - x, y)
    inner = (r3**2 + gap**2 - r4**2) / (2 * r3 * gap)
    coupler = np.arctan2(-y, r1 - x) + sign * np.arccos(inner)
    rocker = np.arctan2(y + r3 * np.sin(coupler), x + r3 * np.cos(coupler) - r1)
    return coupler, rocker


def coupler_point(p, turn, sign):
    """Return places (n, k, 2) of the coupler's point, the crank's pivot at the origin."""
    coupler, _ = four_bar(p, turn, sign)
    r2, x, y = (np.asarray(p[name])[:, None] for name in ("r2", "r_cx", "r_cy"))
    c, s = np.cos(coupler), np.sin(coupler)
    return np.stack([r2 * np.cos(turn) + x * c - y * s, r2 * np.sin(turn) + x * s + y * c], axis=2)


# -- slider-cranks: crank r, rod l, guide at height e ----------------------------------------------


def slider(p, turn):
    """Return the slide (n, k) of the slider to the right."""
    r, rod, e = (np.asarray(p[name])[:, None] for name in ("r", "l", "e"))
    lift = e - r * np.sin(turn)
    return r * np.cos(turn) + np.sqrt(rod**2 - lift**2)


def slider_loss(p, load, radius, friction, guide):
    """Return the mean friction power (n,) at unit crank speed, forces as without friction."""
    r, rod, e = (np.asarray(p[name])[:, None] for name in ("r", "l", "e"))
    sine = (e - r * np.sin(TURN)) / rod
    cosine = np.sqrt(1 - sine**2)
    turned = -r * np.cos(TURN) / (rod * cosine)
    speed = -r * np.sin(TURN) - rod * sine * turned
    pins = load / cosine * friction * radius * (1 + np.abs(turned - 1) + np.abs(turned))
    return (pins + guide * load * np.abs(sine / cosine * speed)).mean(axis=1)


# -- robust values by samples ----------------------------------------------------------------------


def of_squares(errors, factor):
    """Return mean + factor sigma of the sum of squares of errors (n, k, ...) of n sets."""
    total = np.sum(errors.reshape(len(errors), -1) ** 2, axis=1)
    return float(total.mean() + factor * total.std())


def of_largest(errors, nominal, factor):
    """Return the largest of |e_i| + factor sigma_i; errors (n, k, m), nominal (k, m)."""
    sigmas = np.sqrt(np.mean(np.sum((errors - nominal) ** 2, axis=2), axis=0))
    return float(np.max(np.linalg.norm(nominal, axis=1) + factor * sigmas))


def of_value(values, factor):
    """Return mean + factor sigma of a number (n,)."""
    return float(values.mean() + factor * values.std())

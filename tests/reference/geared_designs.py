"""Designs of geared five-bars that trace timed points, by least squares of their own.

With the crank as the unit of length and complex numbers of the plane, the first crank's end is
A = e^{iu}, the second's D = r1 + r5 e^{i (ratio u + phi)}, the joint B is where circles about
them with the radii r3 and r4 meet, and the traced point is z + s (A + c B') with B' the direction
from A to B. For given lengths z, s and s c follow from linear least squares; lengths, phi and
the crank's first angle from Levenberg's and Marquardt's method with differences, from random
starts. ``python -m tests.reference.geared_designs`` prints what the problem files expect.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

RATIOS = {"gear5-g1": -2, "gear5-g3": -1}
"""The ratio that meets the targets; the others leave 0.047 and 0.0050 (the benchmark's table)."""
EDGE = 0.99999
"""Cosines beyond are poses that do not assemble."""
STEP = 1e-7


def targets(name: str) -> tuple[Any, Any]:
    """Return steps of the crank [rad] and complex places of a problem file, (n,) each."""
    file = Path(__file__).parents[2] / f"problems/{name}.toml"
    goal = tomllib.loads(file.read_text(encoding="utf-8"))["tasks"]["design"]["goal"]
    return np.radians(goal["steps_deg"]), np.array([complex(*p) for p in goal["targets"]])


def directions(x: Any, u: Any, ratio: int, side: int) -> tuple[Any, Any, Any]:
    """Return A, the directions B' and by how much cosines are beyond 1, (n,) each.

    ``x`` are the logarithms of r1, r3, r4, r5, and phi.
    """
    r1, r3, r4, r5 = np.exp(x[:4])
    a = np.exp(1j * u)
    way = r1 + r5 * np.exp(1j * (ratio * u + x[4])) - a
    far = np.abs(way)
    cosine = (far**2 + r3**2 - r4**2) / (2 * far * r3)
    inside = np.clip(cosine, -EDGE, EDGE)
    turn = way / far * (inside + 1j * side * np.sqrt(1 - inside**2))
    return a, turn, np.maximum(np.abs(cosine) - EDGE, 0.0)


def residuals(x: Any, steps: Any, places: Any, ratio: int, side: int) -> tuple[Any, Any]:
    """Return what is off, (3 n,), and z, s, s c."""
    a, turn, beyond = directions(x, (x[5] if len(x) > 5 else 0.0) + steps, ratio, side)
    rows = np.stack([np.ones_like(a), a, turn], axis=1)
    linear = np.linalg.lstsq(rows, places, rcond=None)[0]
    off = rows @ linear - places
    return np.concatenate([off.real, off.imag, 10 * beyond]), linear


def fitted(x: Any, steps: Any, places: Any, ratio: int, side: int) -> tuple[Any, float]:
    """Return the numbers at which the sum of squares is least near a start, and that sum."""
    off, damping = residuals(x, steps, places, ratio, side)[0], 1e-2
    for _ in range(200):
        columns = [
            residuals(x + STEP * e, steps, places, ratio, side)[0]
            - residuals(x - STEP * e, steps, places, ratio, side)[0]
            for e in np.eye(len(x))
        ]
        slope = np.stack(columns, axis=1) / (2 * STEP)
        square, down = slope.T @ slope, slope.T @ off
        before = off @ off
        for _ in range(12):
            move = -np.linalg.solve(square + damping * np.diag(np.diag(square) + 1e-12), down)
            move /= max(1.0, np.abs(move).max())
            after = residuals(x + move, steps, places, ratio, side)[0]
            if after @ after < before:
                x, off, damping = x + move, after, max(damping / 5, 1e-12)
                break
            damping *= 5
        if before - off @ off <= 1e-14 * before:
            break
    return x, float(off @ off)


def design(name: str, seed: int = 0) -> dict[str, float]:
    """Return the parameters of a problem file that meet its targets, and their sum of squares."""
    steps, places = targets(name)
    ratio, random = RATIOS[name], np.random.default_rng(seed)
    for _ in range(400):
        side = int(random.choice([-1, 1]))
        start = [*random.normal(0.8, 0.6, 4), *random.uniform(-np.pi, np.pi, 2)]
        x, least = fitted(np.array(start), steps, places, ratio, side)
        if least < 1e-9:
            break
    # the first angle of the crank is none: it is left out
    x, least = fitted(x[:5], steps, places, ratio, side)
    middle, crank, point = residuals(x, steps, places, ratio, side)[1]
    size, lengths = abs(crank), np.exp(x[:4]) * abs(crank)
    arm = size * point / crank
    names = ("r1", "r3", "r4", "r5")
    return {
        **dict(zip(names, map(float, lengths), strict=True)),
        "r2": float(size),
        "r_cx": float(arm.real),
        "r_cy": float(arm.imag),
        "x0": float(middle.real),
        "y0": float(middle.imag),
        "theta0": float(np.angle(crank)),
        "phi": float(x[4]),
        "i": ratio,
        "side": side,
        "least": least,
    }


def poses(numbers: dict[str, float], u: float) -> dict[str, Any]:
    """Return the traced point, the joint B, and the angles of link and arm at a crank's angle."""
    r2 = numbers["r2"]
    x = [*np.log([numbers[own] / r2 for own in ("r1", "r3", "r4", "r5")]), numbers["phi"]]
    a, turn, _ = directions(x, np.array([u]), int(numbers["i"]), int(numbers["side"]))
    base = np.exp(1j * numbers["theta0"])
    place = complex(numbers["x0"], numbers["y0"])
    second = r2 * np.exp(x[0]) + r2 * np.exp(x[3]) * np.exp(
        1j * (numbers["i"] * u + numbers["phi"])
    )
    b = r2 * a[0] + numbers["r3"] * turn[0]
    traced = place + base * (r2 * a[0] + complex(numbers["r_cx"], numbers["r_cy"]) * turn[0])
    return {
        "P": traced,
        "B": place + base * b,
        "link": float(np.angle(base * turn[0])),
        "arm": float(np.angle(base * (b - second))),
    }


if __name__ == "__main__":
    for own in RATIOS:
        found = design(own)
        print(own, found)
        for angle in (0.0, 75.0, 90.0, 180.0, 300.0):
            print(angle, poses(found, np.radians(angle)))

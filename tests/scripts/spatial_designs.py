"""Spatial synthesis beside another optimiser: SciPy on closed forms, from many starts.

    python -m tests.scripts.spatial_designs --out docs/data/spatial-synthesis.json

Paths: `scipy.optimize.least_squares` within the bounds; functions: the same, then the largest error
by SLSQP at 181 places from the best. Neither knows anything of the package.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

import mechdae as md
from tests.reference.spatial_designs import crank, rocker, slider
from tests.shared.paths import ROOT

STARTS = 100
OPEN = 10.0
"""Error of a target that a design does not reach."""


def rssr_path(x, u, mode):
    """Return the bar's point (n, 3) of `rssr-path`."""
    r, bar, R, a, b, c, tw, s = x
    B = crank(r, u)
    _, C = rocker(B, bar, R, (a, b, c), (np.sin(tw), 0, np.cos(tw)), (0, 1, 0), 0.0, mode)
    return B + s * (C - B)


def rssp_path(x, u, mode):
    """Return the bar's point (n, 3) of `rssp-path`."""
    r, bar, ax, ay, az, gy, gz, el, be, s = x
    B = crank(r, u, (ax, ay, az))
    way = np.array([np.cos(el) * np.cos(be), np.cos(el) * np.sin(be), np.sin(el)])
    _, C = slider(B, bar, (0.3, gy, gz), way, mode)
    return B + s * (C - B)


PATHS = {"rssr-path": rssr_path, "rssp-path": rssp_path}


def turns(place, x, mode):
    """Return whether a design moves over a whole turn."""
    return bool(np.isfinite(place(x, np.linspace(0, 2 * np.pi, 361), mode)).all())


def path(name, starts, rng):
    """Return the least sum of squares that SciPy finds for a path, and its design."""
    from scipy.optimize import least_squares

    task = md.load(name).tasks["design"]
    place = PATHS[name]
    low, high = np.array(list(task.free.values()), float).T
    targets, steps = np.array(task.goal.targets), np.array(task.goal.steps)
    best, at = np.inf, None
    for mode in (1, -1):
        for sense in (1, -1):

            def rest(y, mode=mode, sense=sense):
                gap = place(y[1:], y[0] + sense * steps, mode) - targets
                return np.nan_to_num(gap, nan=OPEN).ravel()

            for _ in range(starts // 4):
                start = np.append(rng.uniform(0, 2 * np.pi), rng.uniform(low, high))
                if np.abs(rest(start)).max() >= OPEN:
                    continue
                bounds = np.append(-50.0, low), np.append(50.0, high)
                found = least_squares(
                    rest, start, bounds=bounds, xtol=1e-15, ftol=1e-15, gtol=1e-15
                )
                if 2 * found.cost < best and turns(place, found.x[1:], mode):
                    best, at = 2 * found.cost, found.x[1:]
    return best, at


def function(starts, rng):
    """Return the smallest largest error [rad] that SciPy finds for `rssr-function`."""
    from scipy.optimize import least_squares

    task = md.load("rssr-function").tasks["design"]
    low, high = np.array(list(task.free.values()), float).T
    low, high = low[:5], high[:5]
    nodes = (1 - np.cos(np.pi * np.arange(181) / 180)) / 2
    best, at = np.inf, None

    def errors(y, mode, sense, share=nodes):
        r, bar, R, s1, s4, phi, psi = y
        B = crank(r, phi + np.pi / 2 * share, (0, 0, s1))
        v, _ = rocker(B, bar, R, (0, 1, 0), (1, 0, 0), (0, 1, 0), s4, mode)
        return np.unwrap(np.nan_to_num(v, nan=OPEN)) - psi - sense * np.pi / 2 * share**2

    for mode in (1, -1):
        for sense in (1, -1):
            rest = lambda y, mode=mode, sense=sense: errors(y, mode, sense)  # noqa: E731
            ends = []
            for _ in range(starts // 4):
                start = np.concatenate([rng.uniform(low, high), rng.uniform(0, 2 * np.pi, 2)])
                if not np.isfinite(rest(start)).all() or np.ptp(rest(start)) > 3:
                    continue
                start[6] += rest(start).mean()
                bounds = np.append(low, [-50, -50]), np.append(high, [50, 50])
                found = least_squares(
                    rest, start, bounds=bounds, xtol=1e-15, ftol=1e-15, gtol=1e-15
                )
                ends.append((found.cost, found.x))
            for _, x in sorted(ends, key=lambda pair: pair[0])[:6]:
                _, x = minimax(rest, x, low, high)
                worst = float(np.abs(errors(x, mode, sense, np.linspace(0, 1, 20_001))).max())
                if worst < best:
                    best, at = worst, x
    return best, at


def minimax(rest, x, low, high):
    """Return the least largest error near a design: min t, -t <= e <= t."""
    from scipy.optimize import minimize

    unit = float(np.abs(rest(x)).max())
    if not 1e-9 < unit < 1e-2:
        return unit, x
    begin = np.append(x, 1.0)

    def gaps(z):
        e = rest(z[:-1]) / unit
        return np.concatenate([z[-1] - e, z[-1] + e])

    found = minimize(
        lambda z: z[-1], begin, method="SLSQP", constraints={"type": "ineq", "fun": gaps},
        bounds=[*zip(low, high, strict=True), (-50, 50), (-50, 50), (0, None)],
        options={"maxiter": 400, "ftol": 1e-12},
    )  # fmt: skip
    own = found.x[:-1]
    return min((float(np.abs(rest(y)).max()), tuple(y)) for y in (x, own))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", default="")
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("--seeds", type=int, default=5)
    given = parser.parse_args()
    rows = {}
    for name in (*PATHS, "rssr-function"):
        rng = np.random.default_rng(0)
        began = time.process_time()
        value, at = (
            function(given.starts, rng) if name not in PATHS else path(name, given.starts, rng)
        )
        other = time.process_time() - began
        runs = [md.synthesize(name, seed=seed) for seed in range(given.seeds)]
        best = [run.data["designs"][0]["objective"] for run in runs]
        rows[name] = {
            "scipy": value,
            "scipy_design": [float(v) for v in at],
            "scipy_starts": given.starts,
            "scipy_seconds": round(other, 1),
            "ours": sorted(best),
            "hits": [run.data["designs"][0]["hits"] for run in runs],
            "seconds": sorted(round(run.summary["seconds"]["whole"], 2) for run in runs),
        }
        print(name, rows[name], flush=True)
    if given.out:
        (ROOT / given.out).write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

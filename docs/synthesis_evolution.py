"""The benchmark cases of synthesis as differential evolution sees them, in NumPy alone.

Each case is a function of a box, (n, S) -> (S,), with the objective of the package's own task and
penalties for what does not assemble and does not turn. The closure is that of
``tests/reference/closure_fourbar.py``; nothing comes from the package. What helps the method is
done for it: angles of untimed targets are sorted, so that no order is ever violated; the line of
a straight line and the choice of branch, sense and gear ratio cost no evaluation.

    found = evolve(evolution(case), seed=0)
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.reference.closure_fourbar import TURN, rrr, wrapped

SHARE, GENERATIONS = 15, 2000
"""Population for each variable, and how many generations are run."""
SLACK = 1e-2
"""Sum of violations that a finer grid may find between the nodes."""
WORSE = 1e3
"""What a violation of its own size adds to the objective, in sizes of the targets."""


@dataclass(frozen=True)
class Case:
    """A box (n, 2), an objective over arrays (n, S), and the same on a finer grid."""

    box: Any
    objective: Callable[[Any], Any]
    fine: Callable[[Any], Any] | None = None


@dataclass(frozen=True)
class Found:
    """What a run gave."""

    value: float
    x: tuple[float, ...]
    evaluations: int
    seconds: float


def evolve(case: Case, seed: int, generations: int = GENERATIONS) -> Found:
    """Run scipy's differential evolution without its polish, all generations."""
    from scipy.optimize import differential_evolution

    began = time.process_time()
    found = differential_evolution(
        case.objective, case.box, popsize=SHARE, maxiter=generations, tol=0, atol=0, seed=seed,
        polish=False, vectorized=True, updating="deferred",
    )  # fmt: skip
    seconds = time.process_time() - began
    evaluations = SHARE * len(case.box) * (found.nit + 1)
    judge = case.fine or case.objective
    value = float(judge(found.x[:, None])[0])
    return Found(value, tuple(found.x.tolist()), evaluations, seconds)


def evolution(case: dict[str, Any]) -> Case | None:
    """Return a case of ``synthesis.json`` for differential evolution, None for other kinds."""
    kind = case["kind"]
    if kind in ("path four-bar", "exact path four-bar") and "fixed_pivots" not in case:
        return path(case)
    if kind == "path geared five-bar":
        return geared(case)
    if kind == "function four-bar":
        return function(case)
    if kind == "straight-line crank-rocker":
        return straight(case)
    return None


# -- pieces ----------------------------------------------------------------------------------------


def stuck(r: Any) -> Any:
    """Return by how much lengths (4, S) are no crank-rocker."""
    r1, r2, r3, r4 = r
    slacks = [r3 + r4 - r2 - r1, r1 + r4 - r2 - r3, r1 + r3 - r2 - r4]
    return sum(np.maximum(1e-6 - slack, 0) for slack in slacks)


def closed(A: Any, D: Any, a: Any, b: Any) -> tuple[list[Any], Any]:
    """Return the joint of a dyad (S, k) on both sides, and by how much it fails to close (S,)."""
    one, height = rrr(A, D, a, b, 1)
    line = D - A
    return [one, mirrored(one - A, line) + A], np.maximum(-height, 0).sum(axis=1)


def mirrored(z: Any, line: Any) -> Any:
    """Return places mirrored in a line through the origin."""
    return z.conj() * line / line.conj()


def as_complex(targets: Any) -> Any:
    targets = np.asarray(targets, float)
    return targets[:, 0] + 1j * targets[:, 1]


def spread(targets: Any) -> float:
    return float(np.sum(np.abs(targets - targets.mean()) ** 2))


# -- paths -----------------------------------------------------------------------------------------


def path(case: dict[str, Any]) -> Case:
    """Lengths, coupler point, frame; an offset of timed steps or all angles of untimed targets."""
    P = as_complex(case["targets"])
    weights = np.ones(len(P))
    untimed = "theta2" not in case
    if untimed and P[0] == P[-1]:
        P, weights = P[:-1], weights[:-1]
        weights[0] = 2.0
    bounds = case.get("bounds") or {"r1_r4": [0, 8], "r_cx_r_cy": [-8, 8], "x0_y0": [-8, 8]}
    box = [bounds["r1_r4"]] * 4 + [bounds["r_cx_r_cy"]] * 2
    framed = "x0_y0" in bounds
    if framed:
        box += [*[bounds["x0_y0"]] * 2, [0, TURN]]
    if untimed:
        box += [[0, 2 * TURN], *[[0, TURN]] * (len(P) - 1)]
    elif case["timing"] != "prescribed absolute theta2":
        box += [[0, 2 * TURN]]
    steps = np.array(case.get("theta2", []), float)
    unit = spread(P)

    def objective(z: Any) -> Any:
        z = z[..., None]  # (n, S, 1)
        r, point = np.maximum(z[:4], 1e-9), z[4] + 1j * z[5]
        place, turn = (z[6] + 1j * z[7], np.exp(1j * z[8])) if framed else (0.0, 1.0)
        rest = z[9 if framed else 6 :, :, 0].T  # (S, k)
        if untimed:
            theta = sorted_angles(rest)
        elif rest.shape[1]:  # the second turn of the offset is the other sense
            theta = rest + np.where(rest < TURN, 1.0, -1.0) * steps
        else:
            theta = steps[None, :]
        A = r[1] * np.exp(1j * theta)
        joints, miss = closed(A, r[0] + 0j * A, r[2], r[3])
        own = [
            np.abs(place + turn * (A + point * (B - A) / r[2]) - P) ** 2 @ weights for B in joints
        ]
        lost = stuck(r[:, :, 0]) / r[:, :, 0].max(axis=0) + miss
        return np.where(lost > 0, unit * WORSE * (1 + lost), np.minimum(*own))

    return Case(np.array(box, float), objective)


def sorted_angles(rest: Any) -> Any:
    """Return angles (S, k) in order within a turn from the first, in one sense or the other."""
    first = rest[:, :1]
    gaps = np.sort((rest[:, 1:] - first) % TURN, axis=1)
    sense = np.where(first < TURN, 1.0, -1.0)
    return np.concatenate([first, first + sense * gaps], axis=1)


def geared(case: dict[str, Any]) -> Case:
    """Five lengths, coupler point, frame, phase, offset, one of six gear ratios."""
    P = as_complex(case["targets"])
    size = float(np.sqrt(spread(P) / len(P)))
    steps = np.radians(case["theta2_increments_deg"]) * np.arange(len(P))
    ratios = np.array([-3, -2, -1, 1, 2, 3])
    far = 20 * size
    box = [[0.02 * size, far]] * 5 + [[-far, far]] * 4
    box += [[0, TURN], [0, TURN], [0, 2 * TURN], [0, len(ratios)]]
    circle = TURN * np.arange(48) / 48
    unit = spread(P)

    def objective(z: Any) -> Any:
        z = z[..., None]
        r1, r2, r3, r4, r5 = z[:5]
        point, place, turn = z[5] + 1j * z[6], z[7] + 1j * z[8], np.exp(1j * z[9])
        ratio = ratios[np.minimum(z[12], len(ratios) - 1e-9).astype(int)]

        def joints(theta: Any) -> Any:
            A = r2 * np.exp(1j * theta)
            return A, *closed(A, r1 + r5 * np.exp(1j * (ratio * theta + z[10])), r3, r4)

        theta = z[11] + np.where(z[11] < TURN, 1.0, -1.0) * steps
        A, both, miss = joints(theta)
        own = [np.sum(np.abs(place + turn * (A + point * (B - A) / r3) - P) ** 2, 1) for B in both]
        lost = miss + joints(np.broadcast_to(circle, (z.shape[1], 48)))[2]
        return np.where(lost > 0, unit * WORSE * (1 + lost), np.minimum(*own))

    return Case(np.array(box, float), objective)


# -- functions and straight lines ------------------------------------------------------------------


def function_of(case: dict[str, Any]) -> Callable[[Any], Any]:
    """Return the function of a case."""
    return {
        "log10(x)": np.log10, "sin(x deg)": lambda x: np.sin(np.radians(x)), "x^2": np.square,
        "exp(x)": np.exp,
    }[case["function"]]  # fmt: skip


def scales(case: dict[str, Any], share: Any) -> tuple[Any, Any]:
    """Return shares of the input's and the output's ranges at shares of the interval."""
    low, high = case["x_range"]
    f = function_of(case)
    y = f(low + (high - low) * share)
    first, last = f(np.array([low, high], float))
    return share, (y - first) / (last - first)


def function(case: dict[str, Any]) -> Case:
    """Links a, b, c on a ground of 1 and where the scales begin; largest error at 41 nodes."""
    box = [[0.1, 8.0]] * 3 + [[-np.pi, np.pi]] * 2
    nodes = (1 - np.cos(np.pi * np.arange(41) / 40)) / 2
    fine = np.linspace(0, 1, 721)
    return Case(np.array(box), _function(case, nodes), _function(case, fine, SLACK))


def _function(case: dict[str, Any], share: Any, slack: float = 0.0) -> Callable[[Any], Any]:
    ranges = np.radians([case["delta_phi_deg"], case["delta_psi_deg"]])
    share_in, share_out = scales(case, share)

    def objective(z: Any) -> Any:
        a, b, c, begin, end = z[..., None]
        A = a * np.exp(1j * (begin + ranges[0] * share_in))
        joints, miss = closed(A, 1.0 + 0j * A, b, c)
        best = np.full(z.shape[1], np.inf)
        for B in joints:
            psi = np.angle(B - 1)
            sine = np.abs(((B - A).conj() * (B - 1)).imag) / (b * c)
            weak = np.maximum(0.05 - sine, 0).sum(axis=1)
            for sense in (1, -1):
                error = np.abs(wrapped(psi - end - sense * ranges[1] * share_out)).max(axis=1)
                best = np.minimum(best, np.where(weak > slack, 10 * (1 + weak), error))
        return np.where(miss > 0, WORSE * (1 + miss), best)

    return objective


def straight(case: dict[str, Any]) -> Case:
    """Ratios to the crank, coupler point, where the half turn begins, turn of the line."""
    box = [[np.log(0.2), np.log(30.0)]] * 3 + [[-30.0, 30.0]] * 2 + [[0, TURN], [-2e-3, 2e-3]]
    return Case(np.array(box), _straight(case, 61), _straight(case, 721, SLACK))


def _straight(case: dict[str, Any], nodes: int, slack: float = 0.0) -> Callable[[Any], Any]:
    most = float(case["id"].rsplit("_", 1)[1])
    theta0 = np.linspace(0, np.pi, nodes)

    def objective(z: Any) -> Any:
        r1, r3, r4 = np.exp(z[:3])[..., None]
        point = (z[3] + 1j * z[4])[:, None]
        A = np.exp(1j * (z[5][:, None] + theta0))
        joints, miss = closed(A, r1 + 0j * A, r3, r4)
        lengths = np.stack([r1, np.ones_like(r1), r3, r4])[..., 0]
        lost = stuck(lengths) + miss
        best = np.full(z.shape[1], np.inf)
        for B in joints:
            place = A + point * (B - A) / r3
            way = place[:, -1:] - place[:, :1]
            line = (place - place[:, :1]) / way * np.exp(1j * z[6])[:, None]
            stroke = line.real.max(axis=1)
            parts = np.vstack([lengths, np.abs(z[3:5])]) / (np.abs(way[:, 0]) * stroke)
            beyond = np.maximum(parts - most, 0).sum(axis=0)
            beyond += np.maximum(0.05 - parts[:4], 0).sum(axis=0)
            sine = np.abs(((B - A).conj() * (B - r1)).imag) / (r3 * r4)
            beyond += np.maximum(0.34 - sine, 0).sum(axis=1)
            beyond += np.maximum(-np.diff(line.real, axis=1), 0).sum(axis=1)
            own = np.ptp(line.imag, axis=1) / 2 / stroke
            best = np.minimum(best, np.where(beyond > slack, 10 * (1 + beyond), own))
        return np.where(lost > 0, WORSE * (1 + lost), best)

    return objective

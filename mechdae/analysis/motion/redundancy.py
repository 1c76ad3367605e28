"""Superfluous equations of a motion: which ones depend on each other."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.analysis.motion.observe import Observer, States

RANK = 1e-9
PART = 1e-7
"""Share of the largest entry of a dependence from which an equation takes part in it."""


def dependent_equations(observer: Observer, states: States, q: Any) -> list[str]:
    """Return the equations that depend on each other for good.

    Multipliers that balance without any load, N = ker G^T of the gradient of all equations, are
    looked at where the rank is largest among the first, the middle and the last state: a singular
    pose alone decides nothing.
    """
    model, r = observer.model, observer.r
    if not r.rows:
        return []
    rows = ca.vertcat(*[row.expression for row in r.rows])
    gradient = ca.densify(ca.jacobian(rows, model.q))
    function = ca.Function("gradient", [model.q, r.t, model.p], [gradient])
    length = observer.setup.length
    sizes = np.array([1.0 if own[1] == "angle" else length for own in model.q_names])
    best: tuple[int, Any] | None = None
    for i in dict.fromkeys((0, len(states.t) // 2, len(states.t) - 1)):
        if not np.isfinite(q[i]).all():
            continue
        G = np.array(function(q[i], states.t[i], observer.p)) * sizes
        norms = np.linalg.norm(G, axis=1, keepdims=True)
        norms[norms == 0] = 1.0
        left, sigma, _ = np.linalg.svd(G / norms)
        rank = int(np.sum(sigma > RANK * sigma[0])) if len(sigma) else 0
        if best is None or rank > best[0]:
            best = (rank, left[:, rank:] / norms)
    if best is None or not best[1].shape[1]:
        return []
    part = np.abs(best[1]).max(axis=1) > PART * np.abs(best[1]).max()
    return [row.name for row, own in zip(r.rows, part, strict=True) if own]


def redundancy_note(found: dict[str, Any]) -> str:
    """Return what to say about it."""
    equations, unique = ", ".join(found["equations"]), ", ".join(found["unique"]) or "none"
    return (
        f"equations that depend on each other (S2): {equations}; reactions that "
        f"are not unique: {', '.join(found['not_unique']) or 'none'}, that are: {unique}"
    )

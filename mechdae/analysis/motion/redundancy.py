"""Superfluous equations of a motion: which ones depend on each other, and what they leave open."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.analysis.motion.observe import Observer, States

RANK = 1e-9
PART = 1e-7
"""Share of the largest entry of a dependence from which an equation takes part in it."""


def redundancy(observer: Observer, states: States, q: Any) -> dict[str, Any] | None:
    """Return the equations that depend on each other for good, and the joints by their reactions.

    Multipliers that balance without any load, N = ker G^T of the gradient of all equations, are
    looked at where the rank is largest among the first, the middle and the last state: a singular
    pose alone decides nothing. The reactions of a joint are unique where they are none in N.
    """
    model, r = observer.model, observer.r
    if not r.rows:
        return None
    rows = ca.vertcat(*[row.expression for row in r.rows])
    gradient = ca.densify(ca.jacobian(rows, model.q))
    function = ca.Function("gradient", [model.q, r.t, model.p], [gradient])
    length = observer.setup.length
    sizes = np.array([1.0 if own[1] == "angle" else length for own in model.q_names])
    best: tuple[int, int, Any] | None = None
    for i in dict.fromkeys((0, len(states.t) // 2, len(states.t) - 1)):
        if not np.isfinite(q[i]).all():
            continue
        G = np.array(function(q[i], states.t[i], observer.p)) * sizes
        norms = np.linalg.norm(G, axis=1, keepdims=True)
        norms[norms == 0] = 1.0
        left, sigma, _ = np.linalg.svd(G / norms)
        rank = int(np.sum(sigma > RANK * sigma[0])) if len(sigma) else 0
        if best is None or rank > best[0]:
            best = (rank, i, left[:, rank:] / norms)
    if best is None or not best[2].shape[1]:
        return None
    _, i, stress = best
    part = np.abs(stress).max(axis=1) > PART * np.abs(stress).max()
    found: dict[str, Any] = {
        "equations": [row.name for row, own in zip(r.rows, part, strict=True) if own]
    }
    if observer.meshed:
        return found
    count = stress.shape[1]
    own = States(*(np.repeat(getattr(states, name)[i : i + 1], count, axis=0) for name in
                   ("t", "x", "v", "a", "lam", "w", "signs")))  # fmt: skip
    own.lam = np.zeros_like(own.lam)
    open_ones = observer.reactions(own, np.repeat(q[i : i + 1], count, axis=0), stress.T)
    arms = np.array([1.0, 1.0, 1 / length])
    largest = max(float(np.max(np.abs(force * arms))) for force in open_ones.values())
    lost = [n for n, f in open_ones.items() if np.max(np.abs(f * arms)) > PART * largest]
    found["not_unique"] = lost
    found["unique"] = [name for name in open_ones if name not in lost]
    return found


def redundancy_note(found: dict[str, Any]) -> str:
    """Return what to say about it."""
    equations = ", ".join(found["equations"])
    text = f"equations that depend on each other (S2): {equations}"
    if "not_unique" in found:
        unique = ", ".join(found["unique"]) or "none"
        text += f"; reactions that are not unique: {', '.join(found['not_unique'])}"
        text += f", that are: {unique}"
    return text

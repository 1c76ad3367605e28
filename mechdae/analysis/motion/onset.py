"""Where inside accepted steps the laws of friction stop to give one acceleration.

The coupling of friction is looked at inside steps too where it is strong; the first state without
one solution is found by repeating the step with other sizes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.analysis.motion.integrate import Nodes

if TYPE_CHECKING:
    from mechdae.analysis.motion.sticking import NoWay, Sticking

STRONG = 0.5
"""Coupling from which steps are looked at, beside a largest value their inside too."""
SAMPLES = np.arange(1, 8) / 8
CLOSE = 4e-16
BISECTIONS = 70


def onset(sticking: Sticking, nodes: Nodes) -> tuple[Any, NoWay] | None:
    """Return the first state whose accelerations are not unique, and the verdict; or None."""
    integrator, lay = sticking.integrator, sticking.integrator.layout
    states, signs = nodes.states, nodes.signs
    t, x, v = (lay.of(states, name) for name in ("t", "x", "v"))
    kappa = sticking.contractions(t, x, v, signs)
    if kappa.max(initial=0.0) < STRONG:
        return None
    verdict = _verdict(sticking, states[0], signs) if kappa[0] >= 1 else None
    if verdict is not None:
        return states[0], verdict
    ends = np.concatenate([[-np.inf], kappa, [-np.inf]])
    peaks = (kappa >= ends[:-2]) & (kappa >= ends[2:])
    for i in range(len(states) - 1):
        if max(kappa[i], kappa[i + 1]) < STRONG:
            continue
        h = float(t[i + 1] - t[i])
        low, high = 0.0, 0.0
        inside = SAMPLES if peaks[i] or peaks[i + 1] else ()
        for share in (*inside, 1.0):
            at = states[i + 1] if share == 1 else integrator.stepped(states[i], share * h, signs)
            if _verdict(sticking, at, signs) is not None:
                high = share * h
                break
            low = share * h
        if high:
            return _located(sticking, states[i], low, high, signs)
    return None


def _located(
    sticking: Sticking, begin: Any, low: float, high: float, signs: Any
) -> tuple[Any, NoWay] | None:
    found = None
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        state = sticking.integrator.stepped(begin, middle, signs)
        verdict = _verdict(sticking, state, signs)
        if verdict is None:
            low = middle
        else:
            high, found = middle, (state, verdict)
        if high - low <= CLOSE * max(abs(float(begin[0])), high):
            break
    if found is None:
        state = sticking.integrator.stepped(begin, high, signs)
        verdict = _verdict(sticking, state, signs)
        found = None if verdict is None else (state, verdict)
    return found


def _verdict(sticking: Sticking, state: Any, signs: Any) -> NoWay | None:
    from mechdae.analysis.motion.sticking import NoWay

    lay = sticking.integrator.layout
    t, x, v = (lay.of(state, name) for name in ("t", "x", "v"))
    if not np.isfinite(x).all() or not np.isfinite(v).all():
        return None
    try:
        sticking.check(float(t), x, v, signs)
    except NoWay as verdict:
        return verdict
    return None

"""Where inside accepted steps the laws of friction stop to give one acceleration.

The coupling of friction is looked at inside steps too where it is strong; the first state without
one solution is found by repeating the step with other sizes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.dynamics.integrate import Nodes
from mechdae.dynamics.verdict import NoWay
from mechdae.dynamics.watchers.zeros import inside

if TYPE_CHECKING:
    from mechdae.dynamics.watchers.sticking import Sticking

STRONG = 0.5
"""Coupling from which steps are looked at, beside a largest value their inside too."""
SAMPLES = np.arange(1, 8) / 8
INSIDE = np.array([0.25, 0.5, 0.75])
"""Shares of every step at which the coupling is looked at, beside its ends."""
FINER = 5
"""Times that the strongest coupling in a step is looked for more closely."""
NEAR = 0.8
"""Coupling below which that is given up."""
JAMS = 1e-6
"""How near to 1 the coupling of friction has to be for a verdict where no step goes on."""
AHEAD = 1e-9
"""Share of the whole time behind such a state at which the solutions are counted."""
CLOSE = 4e-16
BISECTIONS = 70


def onset(sticking: Sticking, nodes: Nodes) -> tuple[Any, NoWay] | None:
    """Return the first state whose accelerations are not unique, and the verdict; or None."""
    lay = sticking.integrator.layout
    states, signs = nodes.states, nodes.signs
    t, x, v = (lay.of(states, name) for name in ("t", "x", "v"))
    kappa = sticking.sizes.contractions(t, x, v, signs)
    within = _within(sticking, nodes)
    if max(kappa.max(initial=0.0), within.max(initial=0.0)) < STRONG:
        return None
    verdict = _verdict(sticking, states[0], signs) if kappa[0] >= 1 else None
    if verdict is not None:
        return states[0], verdict
    ends = np.concatenate([[-np.inf], kappa, [-np.inf]])
    peaks = (kappa >= ends[:-2]) & (kappa >= ends[2:])
    for i in range(len(states) - 1):
        ends_of = max(kappa[i], kappa[i + 1])
        if max(ends_of, within[i]) < STRONG:
            continue
        h, high = float(t[i + 1] - t[i]), 0.0
        if peaks[i] or peaks[i + 1] or within[i] > ends_of:
            high = _strongest(sticking, states[i], h, signs)
        if not high and kappa[i + 1] >= 1 and _verdict(sticking, states[i + 1], signs):
            high = h
        if high:
            return _located(sticking, states[i], high, signs)
    return None


def _within(sticking: Sticking, nodes: Nodes) -> Any:
    """Return the strongest coupling at some places inside each step, (n,)."""
    count = len(nodes.states) - 1
    rows = np.repeat(np.arange(count), len(INSIDE))
    places = inside(sticking.integrator.layout, nodes.states, rows, np.tile(INSIDE, count))
    found = np.nan_to_num(sticking.sizes.contractions(*places, nodes.signs))
    return found.reshape(count, len(INSIDE)).max(axis=1, initial=0.0)


def _strongest(sticking: Sticking, begin: Any, h: float, signs: Any) -> float:
    """Return where inside a step the coupling is strongest if there is a verdict, else 0."""
    lay = sticking.integrator.layout
    shares = SAMPLES
    for _ in range(FINER):
        states = np.array([sticking.integrator.stepped(begin, s * h, signs) for s in shares])
        t, x, v = (lay.of(states, name) for name in ("t", "x", "v"))
        kappa = np.nan_to_num(sticking.sizes.contractions(t, x, v, signs))
        best = int(np.argmax(kappa))
        if kappa[best] >= 1 and _verdict(sticking, states[best], signs):
            return float(shares[best] * h)
        low, high = shares[max(best - 1, 0)], shares[min(best + 1, len(shares) - 1)]
        if kappa[best] < NEAR:
            break
        shares = np.linspace(low, high, len(SAMPLES) + 2)[1:-1]
    return 0.0


def _located(sticking: Sticking, begin: Any, high: float, signs: Any) -> tuple[Any, NoWay] | None:
    """Return the last state with one solution, and the verdict right behind it."""
    low, before = 0.0, begin
    found = _verdict(sticking, sticking.integrator.stepped(begin, high, signs), signs)
    for _ in range(BISECTIONS):
        if high - low <= CLOSE * max(abs(float(begin[0])), high):
            break
        middle = (low + high) / 2
        state = sticking.integrator.stepped(begin, middle, signs)
        verdict = _verdict(sticking, state, signs)
        if verdict is None:
            low, before = middle, state
        else:
            high, found = middle, verdict
    return None if found is None else (before, found)


def _verdict(sticking: Sticking, state: Any, signs: Any) -> NoWay | None:
    lay = sticking.integrator.layout
    t, x, v = (lay.of(state, name) for name in ("t", "x", "v"))
    if not np.isfinite(x).all() or not np.isfinite(v).all():
        return None
    try:
        sticking.sizes.check(float(t), x, v, signs)
    except NoWay as verdict:
        return verdict
    return None


def verdict_ahead(sticking: Sticking, state: Any, signs: Any) -> NoWay | None:
    """Return the verdict right behind a state at which the step size went to nothing, if any.

    Where the coupling of friction is 1 no step gets beyond it.
    """
    if not sticking.kernel.rubs:
        return None
    lay = sticking.integrator.layout
    t, x, v = (lay.of(state, name) for name in ("t", "x", "v"))
    if abs(float(sticking.sizes.contractions(t, x, v, signs)[0]) - 1) > JAMS:
        return None
    ahead, step = state.copy(), AHEAD * sticking.setup.end
    ahead[lay["t"]] = t + step
    ahead[lay["x"]] = x + step * v
    return _verdict(sticking, ahead, signs)

"""Where inside accepted steps the laws of friction cease to give a unique acceleration.

The coupling of friction is looked at inside steps too where it is strong; the first state without
one solution is found by repeating the step with other sizes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.dynamics.friction_sizes import Sizes
from mechdae.dynamics.integrate import Integrator, Nodes, NoWay
from mechdae.dynamics.watchers.zeros import inside
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.kernels.graphs.stepper import Layout

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


class Onset:
    """Looks for states at which the laws of friction give no accelerations, or several."""

    def __init__(self, integrator: Integrator, sizes: Sizes) -> None:
        self.integrator: Integrator = integrator
        self.sizes: Sizes = sizes
        self.layout: Layout = integrator.layout

    def look(self, nodes: Nodes) -> tuple[Any, NoWay] | None:
        """Return the first state whose accelerations are not unique, and the verdict; or None."""
        states, signs = nodes.states, nodes.signs
        kappa, within = self._coupling(states, signs), self._within(nodes)
        if max(kappa.max(initial=0.0), within.max(initial=0.0)) < STRONG:
            return None
        verdict = self._verdict(states[0], signs) if kappa[0] >= 1 else None
        if verdict is not None:
            return states[0], verdict
        t = self.layout.of(states, "t")
        ends = np.concatenate([[-np.inf], kappa, [-np.inf]])
        peaks = (kappa >= ends[:-2]) & (kappa >= ends[2:])
        for i in range(len(states) - 1):
            ends_of = max(kappa[i], kappa[i + 1])
            if max(ends_of, within[i]) < STRONG:
                continue
            h, high = float(t[i + 1] - t[i]), 0.0
            if peaks[i] or peaks[i + 1] or within[i] > ends_of:
                high = self._strongest(states[i], h, signs)
            if not high and kappa[i + 1] >= 1 and self._verdict(states[i + 1], signs):
                high = h
            if high:
                return self._located(states[i], high, signs)
        return None

    def _coupling(self, states: Floats, signs: Floats) -> Any:
        """Return the coupling of friction at states, (n,)."""
        t, x, v = (self.layout.of(states, name) for name in ("t", "x", "v"))
        return self.sizes.contractions(t, x, v, signs)

    def _within(self, nodes: Nodes) -> Any:
        """Return the strongest coupling at some places inside each step, (n,)."""
        count = len(nodes.states) - 1
        rows = np.repeat(np.arange(count), len(INSIDE))
        places = inside(self.layout, nodes.states, rows, np.tile(INSIDE, count))
        found = np.nan_to_num(self.sizes.contractions(*places, nodes.signs))
        return found.reshape(count, len(INSIDE)).max(axis=1, initial=0.0)

    def _strongest(self, begin: Floats, h: float, signs: Floats) -> float:
        """Return where inside a step the coupling is strongest if there is a verdict, else 0."""
        shares = SAMPLES
        for _ in range(FINER):
            states = np.array([self.integrator.stepped(begin, s * h, signs) for s in shares])
            kappa = np.nan_to_num(self._coupling(states, signs))
            best = int(np.argmax(kappa))
            if kappa[best] >= 1 and self._verdict(states[best], signs):
                return float(shares[best] * h)
            low, high = shares[max(best - 1, 0)], shares[min(best + 1, len(shares) - 1)]
            if kappa[best] < NEAR:
                break
            shares = np.linspace(low, high, len(SAMPLES) + 2)[1:-1]
        return 0.0

    def _located(self, begin: Floats, high: float, signs: Floats) -> tuple[Any, NoWay] | None:
        """Return the last state with one solution, and the verdict right behind it."""
        low, before = 0.0, begin
        found = self._verdict(self.integrator.stepped(begin, high, signs), signs)
        for _ in range(BISECTIONS):
            if high - low <= CLOSE * max(abs(float(begin[0])), high):
                break
            middle = (low + high) / 2
            state = self.integrator.stepped(begin, middle, signs)
            verdict = self._verdict(state, signs)
            if verdict is None:
                low, before = middle, state
            else:
                high, found = middle, verdict
        return None if found is None else (before, found)

    def _verdict(self, state: Floats, signs: Floats) -> NoWay | None:
        t, x, v = (self.layout.of(state, name) for name in ("t", "x", "v"))
        if not np.isfinite(x).all() or not np.isfinite(v).all():
            return None
        try:
            self.sizes.check(float(t), x, v, signs)
        except NoWay as verdict:
            return verdict
        return None

    def ahead(self, state: Floats, signs: Floats) -> NoWay | None:
        """Return the verdict right behind a state at which the step size went to nothing, if any.

        Where the coupling of friction is 1 no step gets beyond it.
        """
        if not self.sizes.kernel.rubs or abs(float(self._coupling(state, signs)[0]) - 1) > JAMS:
            return None
        lay, later, step = self.layout, state.copy(), AHEAD * self.integrator.setup.end
        later[lay["t"]] += step
        later[lay["x"]] += step * lay.of(state, "v")
        return self._verdict(later, signs)

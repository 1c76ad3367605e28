"""One-sided contacts along a motion: when they would have to pull.

The forces are looked at inside all accepted steps, as events are; the motion goes on as if the
contact held.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.dynamics.equations import Setup
from mechdae.dynamics.integrate import Integrator, Nodes
from mechdae.dynamics.observe import Observer, States
from mechdae.dynamics.watchers.zeros import Looker, changes, fitted, inside
from mechdae.forces.lift_off import OneSidedContacts, sentence

TIMES = 40
"""Steps of the search for the strongest pull, each to two thirds."""


class Lifting:
    """The arcs of time over which contacts would have to pull."""

    def __init__(self, setup: Setup, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.contacts = OneSidedContacts(setup.model, setup.model.mechanism.joints)
        self.observer = Observer(setup) if self.contacts.found else None
        self.found: list[dict[str, Any]] = []
        self._open: dict[int, dict[str, Any]] = {}

    def holding(self, t: Any, x: Any, v: Any, signs: Any) -> Any:
        """Return the forces (n, k) by which contacts hold, at states with the same signs."""
        observer, setup = self.observer, self.setup
        assert observer is not None
        a, lam = self.integrator.rates(t, x, v, signs)
        rows = setup.sided(t, x, v, np.broadcast_to(signs, (len(x), len(signs))))
        states = observer.complete(States(t[:, 0], x, v, a, lam, np.zeros((len(x), 0)), rows))
        q = observer.absolute(states)[0]
        return self.contacts.holding(q, observer.reactions(states, q, observer.multipliers(states)))

    def look(self, nodes: Nodes) -> None:
        """Look at the forces inside accepted steps."""
        if self.observer is None or len(nodes.states) < 2:
            return
        lay, signs = self.integrator.layout, nodes.signs

        def values(t: Any, x: Any, v: Any) -> Any:
            return self.holding(t, x, v, signs)

        looker = Looker(self.integrator, nodes, values)
        turns: list[tuple[float, int, bool]] = []
        for sign in changes(lay, nodes, values):
            for state, before in looker.states(sign):
                turns.append((float(lay.of(state, "t")), sign.which, before > 0))
        first, last = (float(lay.of(nodes.states[k], "t")) for k in (0, -1))
        at_first = values(*inside(lay, nodes.states, np.zeros(1, int), np.full(1, 1e-9)))[0]
        for k in range(len(self.contacts.names)):
            turns.append((first, k, bool(at_first[k] < 0)))
        for t, k, falls in sorted(turns):
            if falls and k not in self._open:
                self._open[k] = {"joint": self.contacts.names[k], "from": t, "to": t}
                self._open[k] |= {"force": 0.0, "worst": t}
                self.found.append(self._open[k])
            elif not falls and k in self._open:
                self._open.pop(k)["to"] = t
        for arc in self._open.values():
            arc["to"] = last
        self._strongest(nodes, looker, values)

    def _strongest(self, nodes: Nodes, looker: Looker, values: Any) -> None:
        """Keep the strongest pull of each arc among those inside some steps."""
        lay = self.integrator.layout
        rows, lows, highs, samples = fitted(lay, nodes, values)
        shares = lows[:, None] + (highs - lows)[:, None] * _places(samples.shape[1])
        begins = lay.of(nodes.states[rows], "t")
        lengths = lay.of(nodes.states[rows + 1], "t") - begins
        times = begins[:, None] + lengths[:, None] * shares
        for arc in self.found:
            k = self.contacts.names.index(arc["joint"])
            within = (times >= arc["from"]) & (times <= arc["to"])
            pulls = np.where(within, samples[:, :, k], np.inf)
            if not pulls.size or pulls.min() >= arc["force"]:
                continue
            n, j = np.unravel_index(int(np.argmin(pulls)), pulls.shape)
            row, share = int(rows[n]), float(shares[n, j])
            step = float(highs[n] - lows[n]) / samples.shape[1]
            low, high = max(share - 2 * step, 0.0), min(share + 2 * step, 1.0)
            if 0 < j < samples.shape[1] - 1:
                for _ in range(TIMES):
                    a, b = low + (high - low) / 3, high - (high - low) / 3
                    left, right = (looker.value(looker.at(row, own), k) for own in (a, b))
                    low, high = (low, b) if left < right else (a, high)
                share = (low + high) / 2
            state = looker.at(row, share)
            arc["force"], arc["worst"] = looker.value(state, k), float(lay.of(state, "t"))

    def events(self) -> list[dict[str, Any]]:
        """Return the events ``lift_off``."""
        return [
            {
                "kind": "lift_off", "at": arc["from"], "time": arc["from"], "joint": arc["joint"],
                "until": arc["to"], "force": arc["force"], "strongest_at": arc["worst"],
            }
            for arc in self.found
        ]  # fmt: skip

    def notes(self) -> list[str]:
        """Return the same in sentences."""
        return [
            sentence(arc, self.contacts.unit[arc["joint"]], lambda t: f"t = {t:.6g} s")
            for arc in self.found
        ]


def _places(count: int) -> Any:
    """Return the places of samples in a part of a step, as `fitted` takes them."""
    return (1 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2

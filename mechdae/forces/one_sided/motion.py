"""One-sided contacts along a motion: when they would have to pull."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import Integrator, Nodes
from mechdae.dynamics.observe import Observer, States
from mechdae.dynamics.watchers.zeros import DEGREE, Looker, fitted
from mechdae.forces.one_sided.lift_off import OneSidedContacts, Pull, arcs, sentence, unwatched
from mechdae.results import Event, motion_event
from mechdae.types import Floats, Points, Unknowns

PLACES = (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2
"""Samples in a part of a step, as `fitted` takes them."""


class HoldingContacts:
    """The forces by which contacts that are declared one-sided hold, at states of a motion."""

    def __init__(self, setup: MotionProblem) -> None:
        self.setup = setup
        self.contacts: OneSidedContacts = OneSidedContacts(
            setup.model, setup.model.mechanism.joints
        )
        self.names: list[str] = self.contacts.names
        self.observer: Observer | None = Observer(setup) if self.names else None

    def holding(
        self, t: Floats, x: Unknowns, v: Floats, signs: Floats, a: Floats, lam: Points
    ) -> Floats:
        """Return the forces (n, k) by which contacts hold, at states with the same signs.

        `a` and `lam` are accelerations and what goes with them, (n, .) each.
        """
        observer, setup = self.observer, self.setup
        assert observer is not None
        rows = setup.sided(t, x, v, np.broadcast_to(signs, (len(x), len(signs))))
        states = observer.complete(States(t[:, 0], x, v, a, lam, np.zeros((len(x), 0)), rows))
        q = observer.absolute(states)[0]
        return self.contacts.holding(q, observer.reactions(states, observer.multipliers(states)))


class Lifting:
    """The arcs of time over which contacts would have to pull."""

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.integrator, self.contacts = integrator, HoldingContacts(setup)
        self.found: list[Pull] = []
        self.open: list[str] = []

    def look(self, nodes: Nodes) -> None:
        """Look at the forces inside accepted steps."""
        if not self.contacts.names or len(nodes.states) < 2:
            return
        lay, signs = self.integrator.layout, nodes.signs

        def values(t: Floats, x: Unknowns, v: Floats) -> Floats:
            return self.contacts.holding(t, x, v, signs, *self.integrator.rates(t, x, v, signs))

        looker, k = Looker(self.integrator, nodes, values), len(self.contacts.names)
        begins = lay.of(nodes.states, "t")
        rows, lows, highs, samples = fitted(lay, nodes, values)
        shares = lows[:, None] + (highs - lows)[:, None] * PLACES
        times, firsts = np.unique(
            (begins[rows] + np.diff(begins)[rows] * shares.T).T, return_index=True
        )

        def force(t: Floats) -> Floats:
            row = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, len(begins) - 2)
            share = (t - begins[row]) / (begins[row + 1] - begins[row])
            pairs = zip(row.tolist(), share.tolist(), strict=True)
            states = np.array([looker.at(*pair) for pair in pairs])
            return values(lay.of(states, "t")[:, None], lay.of(states, "x"), lay.of(states, "v"))

        for pull in arcs(times, samples.reshape(-1, k)[firsts], self.contacts.names, force):
            last = next((p for p in reversed(self.found) if p.joint == pull.joint), None)
            if last is not None and last.end >= times[0] >= pull.start:  # it goes on
                stronger = min(last, pull, key=lambda one: one.force)
                last.force, last.worst, last.end = stronger.force, stronger.worst, pull.end
            else:
                self.found.append(pull)

    def leave_out(self, names: Iterable[str]) -> None:
        """Forget contacts whose reactions are not unique, or not known."""
        self.open = [name for name in self.contacts.names if name in set(names)]
        self.found = [pull for pull in self.found if pull.joint not in self.open]

    def events(self) -> list[Event]:
        """Return the events ``lift_off``."""
        return [motion_event("lift_off", pull.start, **pull.facts) for pull in self.found]

    def notes(self) -> list[str]:
        """Return the same in sentences."""
        lost = [unwatched(self.open)] if self.open else []
        return lost + [
            sentence(pull, self.contacts.contacts.unit[pull.joint], lambda t: f"t = {t:.6g} s")
            for pull in self.found
        ]

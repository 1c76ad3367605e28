"""Measured orders of the integration: steps of a fixed size, states between them, events."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.dynamics.integrate import Nodes
from mechdae.dynamics.task import prepared

END = 1.0
FINE = 160


class Fixed:
    """A double pendulum integrated with steps of a fixed size."""

    def __init__(self) -> None:
        problem = md.load("double-pendulum")
        name = next(key for key, task in problem.tasks.items() if task.kind == "motion")
        run, self.x, self.v = prepared(problem, problem.tasks[name])
        self.own, self.signs = run.integrator, run.setup.loose
        self.lay = self.own.layout

    def states(self, count: int) -> Any:
        """Return the states (count + 1, .) of so many steps."""
        found = [self.own.first(0.0, self.x, self.v, np.zeros(self.lay.works), self.signs)]
        for _ in range(count):
            found.append(self.own.stepped(found[-1], END / count, self.signs))
        return np.array(found)

    def between(self, states: Any, times: Any) -> Any:
        """Return coordinates inside the steps."""
        return self.own.between(Nodes(states, self.signs), times)[0]

    def rest(self, states: Any) -> float:
        """Return when the first coordinate comes to rest."""
        speeds = self.lay.of(states, "v")[:, 0]
        i = int(np.flatnonzero(speeds[:-1] * speeds[1:] < 0)[0])
        h = float(self.lay.of(states[i + 1], "t") - self.lay.of(states[i], "t"))
        ends = (0.0, states[i]), (h, self.own.stepped(states[i], h, self.signs))
        found = self.own.met(
            states[i], *ends, self.signs, lambda state: float(state[self.lay["v"]][0])
        )
        return float(self.lay.of(found, "t"))


@pytest.fixture(scope="module")
def fixed() -> Fixed:
    return Fixed()


def orders(errors: list[float]) -> Any:
    return np.log2(np.array(errors[:-1]) / errors[1:])


def test_the_method_has_order_eight(fixed) -> None:
    x = fixed.lay["x"]
    true = fixed.states(FINE)[-1][x]
    errors = [float(np.abs(fixed.states(n)[-1][x] - true).max()) for n in (10, 20, 40)]
    assert (orders(errors) > 7.5).all(), errors
    assert errors[-1] < 1e-12


def test_states_between_the_steps_have_order_seven(fixed) -> None:
    """Steps that begin at exact states: the local error of the interpolant is of order eight."""
    fine = fixed.states(FINE)
    errors = []
    for n in (10, 20, 40):
        times = (np.arange(n) + 0.37) / n * END
        gap = fixed.between(fine[:: FINE // n].copy(), times) - fixed.between(fine, times)
        errors.append(float(np.abs(gap).max()))
    assert (orders(errors) > 7.0).all(), errors


def test_events_have_the_order_of_the_method(fixed) -> None:
    true = fixed.rest(fixed.states(FINE))
    errors = [abs(fixed.rest(fixed.states(n)) - true) for n in (8, 16, 32)]
    assert (orders(errors) > 7.0).all(), errors
    assert errors[-1] < 1e-11

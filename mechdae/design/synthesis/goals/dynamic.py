"""A number of a motion or an equilibrium as a goal or a limit: frequencies, end states, peaks."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import unit_within
from mechdae.describe.tasks.goals import Extreme as Asked
from mechdae.design.synthesis.goals.base import Drawn, Goal
from mechdae.design.synthesis.nlp import LIMIT, NewValues, Nlp, Values
from mechdae.design.synthesis.outcome import Called, Outcome
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.verification.claims import Claim
from mechdae.design.synthesis.verify import sketched
from mechdae.errors import MechdaeError
from mechdae.types import Floats, Sym

if TYPE_CHECKING:
    from numpy.random import Generator


SX = ca.SX
TRIES = 8
"""Dimensions that are drawn for each start."""


class Dynamic(Goal):
    """A number of a task that is smallest or largest, or (as a limit) stays between bounds."""

    between_nodes = False
    """There are no nodes: the task is solved as it is."""

    def __init__(
        self, asked: Asked, name: str, outcome: Outcome, bounds: tuple[float, float] | None = None
    ) -> None:
        self.asked, self.name, self.outcome = asked, name, outcome
        self.sense: int = asked.sense
        self.unit: float = abs(outcome.here) or 1.0
        self.bounds = bounds
        self.exact: bool = bounds is not None
        self._called = Called(f"{name}_value", outcome)

    @property
    def words(self) -> str:
        return f"numbers of motions and equilibria ({self.asked.of})"

    def add(self, nlp: Nlp, d: Sym, sigma: Sym) -> Sym:
        value = nlp.outside(self.key("value"), self._called, d) / self.unit
        if self.bounds is not None:
            low, high = (bound / self.unit for bound in self.bounds)
            si = unit_within(self.outcome.run.problem.mechanism, None, self.asked.path) or ""
            nlp.constrain(f"{LIMIT}{self.asked.path}", value, low, high, self.unit, si)
            return SX(0)
        # one pose, to begin the sweeps with
        x = self.space.pose_variables(nlp, self.key("x"), 1)
        self.space.at(nlp, x[:, 0], nlp.parameter(self.key("start"), [self.start]), d, sigma)
        return self.sense * value

    def value(self, term: float) -> float:
        return self.sense * term * self.unit

    @property
    def start(self) -> float:
        """Value of the driver in the sketch, or else where the task begins."""
        driver = self.space.poses.scene.drivers[0]
        sketch = self.outcome.run.problem.mechanism.sketch
        for key in (driver.part, driver.text):
            if isinstance(sketch.get(key), (int, float)):
                return float(sketch[key])
        part, _, word = driver.text.rpartition(".")
        try:
            head = "bodies" if part in self.outcome.run.problem.mechanism.bodies else "joints"
            found = np.ravel(self.outcome.run.found.value(f"{head}/{part}/{word}"))
        except MechdaeError:
            return 0.0
        return float(found[0])

    def programme(self, values: Values, given: Values) -> tuple[Floats, Floats]:
        x = np.reshape(values[self.key("x")], (1, self.space.poses.nx))
        return np.atleast_1d(given.get(self.key("start"), self.start)), x

    # -- starts ------------------------------------------------------------------------------

    def drawn(self, kind: str, generator: Generator, count: int) -> Iterable[Drawn]:
        spread, space = Spread(self.space), self.space
        d = spread.designs(generator, TRIES * count)
        d = d[spread.turning(d, kind)]
        found = 0
        for number in d:
            if found == count:
                return
            value = self.outcome.value(number)
            at = sketched(self.outcome.run.problem, space, number, self.start)
            if at is None or not np.isfinite(value):
                continue
            u, x = at
            found += 1
            branch = space.poses.branch(x, u, number)
            given = {self.key("start"): [u]}
            yield Drawn(number, {}, given, np.array([u]), x[None], branch, self.sense * value)

    def first(self, d: Floats) -> float | None:
        return self.start

    def completed(self, spread: Spread, drawn: Drawn) -> NewValues:
        if self.bounds is not None:
            return {}, {}
        _, x, _ = spread.followed(drawn.d, drawn.x[0], float(drawn.u[0]), [self.start])
        return {self.key("x"): x}, {}

    def claim(self, values: Values, given: Values) -> Claim:
        d = dimensions(values["d"], given)
        return Claim(value=self.outcome.value(d))

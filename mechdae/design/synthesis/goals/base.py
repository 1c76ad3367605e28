"""What all goals share: variables and an objective in an NLP, starts, the value of a design."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.design.synthesis.nlp import NewValues, Nlp, Values
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.robust.deviations import Deviations
from mechdae.design.synthesis.space import DesignSpace
from mechdae.design.synthesis.verification.claims import Claim, Stated
from mechdae.equations.model import Model
from mechdae.kernels.run.functions import Batch
from mechdae.records import dataclass
from mechdae.types import Floats, Matrix, Sym

if TYPE_CHECKING:
    from numpy.random import Generator

    from mechdae.design.synthesis.starts.spread import Spread


@dataclass(frozen=True)
class Seed:
    """A start: values of the variables by name, parameters of the NLP by name, a rank."""

    values: dict[str, Any]
    given: dict[str, Floats | float]
    residual: float


@dataclass(frozen=True)
class Drawn:
    """A design with the poses a goal needs, drawn as a start.

    ``d`` holds the free and the chosen parameters, ``unknowns`` the goal's variables without its
    poses, ``u`` (k,) and ``x`` (k, nx) the poses, ``sigma`` (nb,) the branch; ``given`` the
    goal's parameters.
    """

    d: Any
    unknowns: dict[str, Any]
    given: dict[str, Any]
    u: Any
    x: Any
    sigma: Sym
    residual: float


class Goal:
    """One goal of a task.

    ``unit``: what the goal's term in the objective is multiplied with to be its value. ``sense``: 1
    where less is better. ``asked``, ``bounds``: as it is described; bounds of a limit, None for a
    goal. ``between_nodes``: whether a sweep finds more than the nodes of the NLP see.
    ``deviations``: of the poses by tolerances, where the goal is robust.
    """

    name = "goal"
    asked: Any
    bounds: tuple[float, float] | None = None
    between_nodes = True
    unit: float = 1.0
    sense = 1
    exact = False
    space: DesignSpace
    spread: Spread
    deviations: Deviations | None = None
    lines = 0
    """Numbers of the line that errors are across."""
    deviates = False
    """Whether there are deviations of it by tolerances."""

    @property
    def words(self) -> str:
        return "this goal"

    def bodies(self) -> tuple[str, ...]:
        """Return the bodies whose motion is needed."""
        return ()

    def asks(self, model: Model) -> Mapping[str, Sym]:
        """Return the expressions that are evaluated at poses, by name."""
        return {}

    def add(self, nlp: Nlp, d: Sym, sigma: Sym) -> Sym:
        """Add variables and constraints; return the (dimensionless) term of the objective."""
        raise NotImplementedError

    def drawn(self, kind: str, generator: Generator, count: int) -> Iterable[Drawn]:
        """Yield starts of a class, the most promising first."""
        raise NotImplementedError

    def first(self, d: Floats) -> float | None:
        """Return the driver's value at the goal's first pose, None where it is free."""
        return None

    def completed(self, spread: Spread, drawn: Drawn) -> NewValues:
        """Return values of this goal's variables, and parameters, for a start of another goal."""
        raise NotImplementedError

    def programme(self, values: Values, given: Values) -> tuple[Floats, Floats]:
        """Return driver values (k,) and unknowns (k, nx) of the goal's poses at a point."""
        raise NotImplementedError

    @property
    def stated(self) -> Stated:
        """What is asked, as the file of a design is measured."""
        return Stated(self.asked, self.bounds, self.unit, robust=self.deviations)

    def claim(self, values: Values, given: Values) -> Claim:
        """Return where a design is said to do it, as a point of the NLP has it."""
        return Claim(self.programme(values, given)[0])

    def moved_by(self, name: str) -> bool:
        """Return whether the goal depends on a parameter that no pose depends on."""
        return False

    def deviating(self, values: Values, given: Values) -> dict[str, Floats]:
        """Return the variables of a robust goal that follow from the others."""
        if self.deviations is None:
            return {}
        u, x = self.programme(values, given)
        return self._deviating(values, given, u, x, dimensions(values["d"], given))

    def _deviating(self, values: Values, given: Values, u: Any, x: Any, d: Any) -> dict[str, Any]:
        """Return them for the driver's values (k,), unknowns (k, nx) and dimensions."""
        return {}

    def refined(self, spread: Spread, values: Values, given: Values) -> NewValues | None:
        """Return variables and parameters that see the true extremes, None where they do."""
        return None

    def value(self, term: float) -> float:
        """Return the goal's value for its term in the objective."""
        return term * self.unit

    # -- deviations by tolerances ------------------------------------------------------------

    def _sigma_of(self, x: Any, u: Any, d: Any, *line: Any) -> Any:
        """Return the standard deviation of the error at a pose, in its unit."""
        raise NotImplementedError

    def _added(self, x: Matrix, u: Floats, d: Floats, *line: float) -> Any:
        """Return what deviations add to errors (m,) at poses; errors may be across a `line`."""
        if self.deviations is None:
            return 0.0
        numbers = [np.broadcast_to(d, (len(u), len(d))), *(np.full((len(u), 1), e) for e in line)]
        return self.deviations.factor * self._sigma(x, u[:, None], *numbers)[0][:, 0]

    @cached_property
    def _sigma(self) -> Batch:
        """(x, u, d, line) -> the standard deviation of the error, in its unit."""
        poses = self.space.poses
        inputs = [ca.SX.sym("x", poses.nx), ca.SX.sym("u"), ca.SX.sym("d", len(poses.free))]
        inputs += [ca.SX.sym("line") for _ in range(self.lines)]
        return Batch(ca.Function("sigma", inputs, [self._sigma_of(*inputs)]), ())

    # -- shared ------------------------------------------------------------------------------

    def key(self, word: str) -> str:
        """Return the name of one of the goal's variables."""
        return f"{self.name}.{word}"

    def of_free(self, name: str, d: Floats) -> Floats:
        return d[..., self.space.names.index(name)]

    def poses_of(self, values: Values, count: int) -> Floats:
        """Return the unknowns (k, nx) of the goal's poses; `count` of them where nx is zero."""
        nx = self.space.poses.nx
        return np.reshape(values[self.key("x")], (-1 if nx else count, nx))

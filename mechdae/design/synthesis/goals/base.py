"""What all goals share: variables and an objective in an NLP, starts, the value of a design."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.design.synthesis.nlp import Nlp
from mechdae.design.synthesis.robust.deviations import Deviations
from mechdae.design.synthesis.space import DesignSpace
from mechdae.design.synthesis.verification.claims import Claim, Stated
from mechdae.equations.model import Model
from mechdae.records import dataclass
from mechdae.types import Floats, Sym

if TYPE_CHECKING:
    from numpy.random import Generator

    from mechdae.design.synthesis.starts.spread import Spread


@dataclass(frozen=True)
class Seed:
    """A start: values of the variables by name, parameters of the NLP by name, a rank."""

    values: dict[str, Any]
    given: dict[str, Any]
    residual: float


@dataclass(frozen=True)
class Drawn:
    """A design with the poses a goal needs, drawn as a start.

    ``d`` holds the free and the chosen parameters, ``own`` the goal's variables without its
    poses, ``u`` (k,) and ``x`` (k, nx) the poses, ``sigma`` (nb,) the branch; ``given`` the
    goal's parameters.
    """

    d: Any
    own: dict[str, Any]
    given: dict[str, Any]
    u: Any
    x: Any
    sigma: Sym
    residual: float


class Goal:
    """One goal of a task.

    Attributes
    ----------
    name
        Prefix of its variables.
    unit
        What the goal's term in the objective is multiplied with to be its value.
    sense
        1 where less is better.
    asked, bounds
        As it is described; bounds of a limit, None for a goal.
    exact
        Whether it only constrains.
    between_nodes
        Whether a sweep finds more than the nodes of the NLP see.
    deviations
        Of the poses by tolerances, where the goal is robust.
    """

    name = "goal"
    asked: Any
    bounds: tuple[float, float] | None = None
    between_nodes = True
    unit = 1.0
    sense = 1
    exact = False
    space: DesignSpace
    spread: Spread
    deviations: Deviations | None = None
    deviates = False
    """Whether there are deviations of it by tolerances."""

    @property
    def words(self) -> str:
        """What the goal is about."""
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

    def completed(
        self, spread: Spread, drawn: Drawn
    ) -> tuple[dict[str, Floats | list[float]], dict[str, float]]:
        """Return values of this goal's variables, and parameters, for a start of another goal."""
        raise NotImplementedError

    def programme(
        self, values: Mapping[str, Floats], given: Mapping[str, Floats | float]
    ) -> tuple[Floats, Floats]:
        """Return driver values (k,) and unknowns (k, nx) of the goal's poses at a point."""
        raise NotImplementedError

    @property
    def stated(self) -> Stated:
        """What is asked, as the file of a design is measured."""
        return Stated(self.asked, self.bounds, self.unit, robust=self.deviations)

    def claim(self, values: Mapping[str, Floats], given: Mapping[str, Floats | float]) -> Claim:
        """Return where a design is said to do it, as a point of the NLP has it."""
        return Claim(self.programme(values, given)[0])

    def moved_by(self, name: str) -> bool:
        """Return whether the goal depends on a parameter that no pose depends on."""
        return False

    def deviating(
        self, values: Mapping[str, Floats], given: Mapping[str, Floats | float]
    ) -> dict[str, Floats]:
        """Return the variables of a robust goal that follow from the others."""
        return {}

    def refined(
        self, spread: Spread, values: Mapping[str, Floats], given: Mapping[str, Floats | float]
    ) -> tuple[dict[str, Any], dict[str, Any]] | None:
        """Return variables and parameters that see the true extremes, None where they do."""
        return None

    def value(self, term: float) -> float:
        """Return the goal's value for its term in the objective."""
        return term * self.unit

    # -- shared ------------------------------------------------------------------------------

    def own(self, word: str) -> str:
        """Return the name of one of the goal's variables."""
        return f"{self.name}.{word}"

    def of_free(self, name: str, d: Any) -> Any:
        """Return a free parameter."""
        return d[..., self.space.names.index(name)]

    def poses_of(self, values: Mapping[str, Floats], count: int) -> Floats:
        """Return the unknowns (k, nx) of the goal's poses; `count` of them where nx is zero."""
        nx = self.space.poses.nx
        return np.reshape(values[self.own("x")], (-1 if nx else count, nx))

"""What goals share: a search space, the poses of a design in an NLP, starts, driver values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from mechdae.synthesis.loops import FourBar, four_bar
from mechdae.synthesis.nlp import Nlp
from mechdae.synthesis.poses import Poses, parameters_of

SX = ca.SX
TURN = 2 * np.pi
WIDE = 40.0
"""Bound of angles [rad]: they are unwrapped, and nothing may run away."""
FAR = 10.0
"""The same for lengths among the unknowns, in sizes of the mechanism."""


@dataclass(frozen=True)
class Limits:
    """Margins of the constraints.

    ``full_turn`` whether the driver turns fully, ``margin`` [m] of Grashof's inequalities;
    ``branch`` least |determinant| relative to its columns (the sine of the transmission angle of
    a dyad RRR), ``order`` [rad] between the driver's values of poses, ``transmission`` least
    transmission angle over the turn [rad].
    """

    full_turn: bool = False
    margin: float = 1e-6
    branch: float = 1e-6
    order: float = 1e-3
    transmission: float = 0.0


@dataclass(frozen=True)
class Seed:
    """A start: values of the variables by name, parameters of the NLP by name, a rank."""

    values: dict[str, Any]
    given: dict[str, Any]
    residual: float


@dataclass
class Space:
    """Free parameters with their bounds, the mechanism's loop, the size of what is asked.

    ``size`` [m] makes lengths dimensionless.
    """

    poses: Poses
    bounds: dict[str, tuple[float, float]]
    limits: Limits
    size: float
    loop: FourBar | None = field(init=False)

    def __post_init__(self) -> None:
        self.loop = four_bar(self.poses.scene)

    @property
    def box(self) -> Any:
        """Bounds (nd, 2) in the order of the free parameters."""
        return np.array([self.bounds[name] for name in self.poses.free])

    @property
    def middle(self) -> Any:
        """The parameters of the file, within the bounds."""
        values = self.poses.mechanism.values()
        low, high = self.box.T
        return np.clip(np.array([values[name] for name in self.poses.free]), low, high)

    def over_free(self, expression: Any, d: Any) -> Any:
        """Return an expression over p as one over the free parameters `d`."""
        p = parameters_of(self.poses.model, self.poses.free, d)
        return ca.substitute(SX(expression), self.poses.model.p, p)

    # -- pieces of an NLP --------------------------------------------------------------------

    def design(self, nlp: Nlp) -> Any:
        """Add the free parameters."""
        low, high = self.box.T
        return nlp.variable("d", len(low), low, high)

    def pose_variables(self, nlp: Nlp, name: str, count: int) -> Any:
        """Add the unknowns of poses, (nx, count)."""
        kinds = [coordinate in ("angle", "s") for _, coordinate in self.poses.x_names]
        bound = np.where(kinds, WIDE, FAR * self.size)
        x = nlp.variable(name, self.poses.nx * count, np.tile(-bound, count), np.tile(bound, count))
        return ca.reshape(x, self.poses.nx, count)

    def at(self, nlp: Nlp, x: Any, u: Any, d: Any, sigma: Any) -> Any:
        """Add closure and branch of a pose; return the values asked for."""
        F, branch, values = self.poses.function(x, u, d)
        nlp.constrain("closure", F)
        nlp.constrain("branch", sigma * branch, self.limits.branch, np.inf)
        return values

    def _units(self) -> Any:
        units = [unit for block in self.poses.scene.blocks for unit in block.units]
        return ca.vertcat(*[self.size if unit == "m" else 1.0 for unit in units])

    def full_turn(self, nlp: Nlp, d: Any, kind: str) -> None:
        """Add the inequalities of Grashof's class, by which the crank turns fully."""
        if not self.limits.full_turn or self.loop is None:
            return
        r1, r2, r3, r4 = ca.vertsplit(self.over_free(self.loop.lengths, d))
        if kind == "crank-rocker":
            slack = [r3 + r4 - r2 - r1, r1 + r4 - r2 - r3, r1 + r3 - r2 - r4]
        else:
            slack = [r3 + r4 - r1 - r2, r2 + r4 - r1 - r3, r2 + r3 - r1 - r4]
        margin = self.limits.margin / self.size
        nlp.constrain("full turn", ca.vertcat(*slack) / self.size, margin, np.inf)
        if self.limits.transmission:
            least = float(np.cos(self.limits.transmission))
            for reach in (r1 - r2, r1 + r2):
                cosine = (r3 * r3 + r4 * r4 - reach * reach) / (2 * r3 * r4)
                nlp.constrain("transmission", cosine, -least, least)


class Goal:
    """One kind of goal over a space: an NLP, starts, and what a point of it means."""

    kinds: tuple[str, ...] = ("",)
    """Classes that each have an NLP of their own."""

    space: Space

    def build(self, kind: str) -> Nlp:
        """Return the NLP of a class."""
        raise NotImplementedError

    def seeds(self, kind: str, nlp: Nlp, generator: Any, count: int) -> Iterable[Seed]:
        """Yield starts of a class, the most promising first."""
        raise NotImplementedError

    def objective(self, value: float) -> float:
        """Return the objective in the user's units from that of the NLP."""
        raise NotImplementedError

    def driver_values(self, values: Mapping[str, Any], given: Mapping[str, Any]) -> Any:
        """Return the driver's values at the poses of a point."""
        raise NotImplementedError

"""An impact of contacts at a state of a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import casadi as ca
import numpy as np

from mechdae.dynamics.contacts.impacts import LAWS, RubbingImpacts, unique
from mechdae.dynamics.integrate import NoWay
from mechdae.types import Booleans, Floats, Integers, Matrix, Unknowns

if TYPE_CHECKING:
    from mechdae.dynamics.equations import MotionProblem
    from mechdae.equations.forces.feedback import Unilateral
    from mechdae.kernels.graphs.equations_of_motion import Kernel

FIXED = 1e-5
"""Gradient of a gap, in natural sizes, up to which no freedom moves it: impulses have no bound.

Its square is ten times the depth, in natural sizes, up to which contacts touch.
"""


class ContactsOfMotion(Protocol):
    """The contacts of a motion, with their sizes, coefficients of friction and law of impact."""

    setup: MotionProblem
    kernel: Kernel
    contacts: list[Unilateral]
    count: int
    sizes: Floats
    friction: list[float]
    law: str


class Hit:
    """An impact of contacts at a state: speeds before and after, impulses, works.

    ``normal`` is their matrix of inverse masses; ``fixed`` are those that no freedom moves.
    """

    def __init__(
        self, touching: ContactsOfMotion, t: float, x: Unknowns, v: Floats, which: Integers
    ) -> None:
        self.owner, self.at, self.v, self.touching = touching, (t, x), v, which
        setup, k = touching.setup, touching.kernel
        M, _, J, _ = k.value("parts", t, x, v, setup.loose)
        C, _, speeds = k.value("locking", t, x, v, setup.loose)
        owners = setup.released.rubbing.owners
        feedbacks = setup.released.rubbing.feedbacks
        slip_of = {f.contact: k for k, f in zip(owners, feedbacks, strict=True) if k is not None}
        self.n, self.rubs = len(which), np.flatnonzero([i in slip_of for i in which.tolist()])
        tangents = [slip_of[i] for i in which[self.rubs].tolist()]
        rows = np.concatenate([touching.count + which, np.array(tangents, int)])
        Z = setup.freedoms(J) * k.sizes[:, None]
        ahead = C[rows] @ Z
        share = np.linalg.norm(ahead[: self.n], axis=1) / touching.sizes[which]
        self.fixed: Booleans = share <= FIXED
        self.steps: Matrix = Z @ np.linalg.solve(Z.T @ M @ Z, ahead.T) if Z.size else Z @ ahead.T
        self.G: Matrix = C[rows] @ self.steps
        self.normal: Matrix = self.G[: self.n, : self.n]
        self.before: Floats = speeds.ravel()[rows]
        self.after, self.impulses = self.before, np.zeros(len(rows))
        self.unique = True

    def struck(self, e: Floats) -> Floats:
        """Return the rates of x behind the impact for restitutions (touching,)."""
        n, law = self.n, self.owner.law
        normal, before = self.normal, self.before[:n]
        if not (before < 0).any():
            return self.v
        self.impulses = LAWS[law](normal, before, e)
        self.unique = unique(normal, before, e, before + normal @ self.impulses)
        if len(self.rubs):
            which = self.touching[self.rubs].tolist()
            mu = np.array([self.owner.friction[i] for i in which])
            ways = getattr(RubbingImpacts(self.G, self.rubs, mu), law)(self.before, e)
            if not ways:
                names = list(dict.fromkeys(self.owner.contacts[i].owner for i in which))
                raise NoWay(f"no impact of {', '.join(names)} fits Coulomb's law", joints=names)
            self.impulses, self.unique = ways[0], self.unique and len(ways) == 1
        self.after = self.before + self.G @ self.impulses
        return self.v + self.steps @ self.impulses

    @property
    def works(self) -> Floats:
        """What impacts do to the energy, by contact (touching,)."""
        every: Floats = self.impulses * (self.before + self.after) / 2
        found = every[: self.n].copy()
        found[self.rubs] += every[self.n :]
        return found

    @property
    def gained(self) -> float:
        """Kinetic energy behind the impact less that before."""
        k, r = self.owner.kernel, self.owner.setup.released
        kinetic = k.call("kinetic", lambda: k.function("kinetic", [ca.densify(r.kinetic)]))
        loose = self.owner.setup.loose
        now = self.v + self.steps @ self.impulses
        return float((kinetic(*self.at, now, loose)[0] - kinetic(*self.at, self.v, loose)[0])[0])

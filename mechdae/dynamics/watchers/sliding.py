"""Slips with dry friction: which ones slide, to which side, and which ones stick.

Signs and locks are fixed over steps. Where some slips are at rest every way to go on is tried, with
the coefficients at rest: a slip that starts has to move the way its friction says, one that sticks
has to be held by a force that friction can give. Where the locks are more than the freedoms,
forces are not unique; then all stick if nothing can start.

A ball, or a pair that slides and turns, glides in several directions at once (`glides`): it sticks
where its speed vanishes in all of them, and has a heading in place of a sign.

A pin in a slot touches one side of it. If it sticks there, which is to roll, the slip of the other
side is idle: it has neither a sign nor a lock until it is pressed.

The components of what glides in several directions rub together: friction acts against the
direction of the speed. While such a pair moves that direction is its own; where it starts it has a
*heading*, which is an input like a sign. All components stick together, held by a force whose size
has the limit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import Integrator
from mechdae.equations.forces.feedback import Slip
from mechdae.equations.structure_cache import StructureCache
from mechdae.kernels.run.functions import Call
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Matrix, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.equations_of_motion import Kernel

FIRST = 1e-14
"""Speed, over the largest so far, up to which the heading stands for the direction."""
LEAST = 1e-150
TURNS = 60
"""Corrections of a heading."""
SAME = 1e-13


class Glides:
    """The components that belong together, by their places among the slips.

    `weights`: of the squares of the components of a force that holds. ``groups``: places of the
    components of each pair that glides. ``first``: place of a component -> place of the first one
    of its pair.
    """

    def __init__(self, slips: list[Slip], weights: Floats) -> None:
        self.weights = weights
        self.groups: list[list[int]] = [
            list(range(k, k + slip.parts))
            for k, slip in enumerate(slips)
            if slip.parts > 1 and slip.part == 0
        ]
        self.first: dict[int, int] = {k: group[0] for group in self.groups for k in group}

    def group(self, k: int) -> list[int]:
        """Return the places of the slips that stick with one."""
        return next((group for group in self.groups if k in group), [k])

    def spread(self, values: Floats) -> Floats:
        """Return values (..., k) with the length of their vector at all components of a pair."""
        found = np.abs(values)
        for group in self.groups:
            found[..., group] = np.linalg.norm(values[..., group], axis=-1, keepdims=True)
        return found

    def still(self, sides: Floats) -> Any:
        """Return which slips are locked (k,): of pairs that glide those without a heading."""
        found = np.asarray(sides) == 0
        for group in self.groups:
            found[group] = found[group].all()
        return found

    def headings(self, values: Floats) -> Floats:
        """Return values (k,) with the components of pairs divided by their length."""
        found = np.array(values, float)
        for group in self.groups:
            size = float(np.linalg.norm(found[group]))
            if found[group[0]] != IDLE:
                found[group] = found[group] / size if size > 0 else 0.0
        return found

    def alone(self, rest: list[int]) -> list[list[int]]:
        """Return the slips at rest, those of a pair that glides together."""
        return [self.group(k) for k in rest if self.first.get(k, k) == k]

    def holding(self, held: Floats, high: Floats, k: int) -> tuple[Floats | float, Floats]:
        """Return the size of the force that holds a pair, and its limit, (n,) each."""
        group = self.group(k)
        squares = self.weights[group] * held[..., group] ** 2
        return np.sqrt(squares.sum(axis=-1)), high[..., group[0]]

    def headed(
        self, sides: Floats, rates: Callable[[Any], Any], free: Floats, held: Floats
    ) -> Floats:
        """Return sides with headings where they are not known yet (nan).

        A pair starts the way it is pulled: rates (k,) of its speeds for these sides are along its
        heading. Friction changes them by as much as `free` ones, without any, are apart from them.

        `rates`: sides -> rates of all slips. `free`, `held`: rates without friction, and the forces
        that hold where all that is not known sticks.
        """
        open_ = [group for group in self.groups if np.isnan(sides[group]).any()]
        if not open_:
            return sides
        found = sides.copy()
        for group in open_:
            found[group] = -held[group] / max(float(np.linalg.norm(held[group])), LEAST)
        for _ in range(TURNS):
            now, worst = rates(found), 0.0
            for group in open_:
                back = float(np.linalg.norm(free[group] - now[group]))
                way = now[group] + back * found[group]
                size = float(np.linalg.norm(way))
                if size == 0 or not np.isfinite(size):
                    continue
                worst = max(worst, float(np.abs(way / size - found[group]).max()))
                found[group] = way / size
            if worst <= SAME:
                break
        return found


def weights_of(slips: list[Slip], p: Sym, values: Floats, cache: StructureCache) -> Floats:
    """Return the weights (k,) of slips for values of the parameters."""
    if all(isinstance(slip.weight, (int, float)) for slip in slips):
        return np.array([slip.weight for slip in slips], float)

    def build() -> Call:
        weights = ca.vertcat(*[ca.SX(slip.weight) for slip in slips])
        return Call(ca.Function("weights", [p], [ca.densify(weights)]))

    return np.ravel(cache("weights", build)(values)[0])


RESTS = 1e-9
"""Speed, as a share of the largest so far, that is none."""
RANK = 1e-9
STRAIGHT = 1e-5
"""Speed per speed of the freedoms below which these do not move a slip."""
SLACK = 1e-9
"""Share of its limit by which a force that holds may exceed it by rounding."""
ROUNDING = 1e-12
"""Share of the largest forces and rates so far up to which they are none."""
ROUGH = 100.0
"""Speed, over the tolerance, from which a pair that glides does not rest."""
IDLE = 2.0
"""Side of a slip that nothing presses, beside one that sticks."""


@dataclass(frozen=True)
class Turn:
    """An event of friction: at a state, of a slip; ``from_rest`` if it stuck.

    ``released`` tells that its own force has reached the limit, ``sharp`` that a ball turns about
    the line of its load.
    """

    state: Floats
    slip: int
    released: bool
    from_rest: bool
    sharp: bool = False


class Slips:
    """The slips of a motion: their sides, and the ways to go on where some are at rest.

    ``found`` list of (t, signs by name, kind): events: kind "reversal", "stick" or "slip", and the
    sign of the speed behind it of all joints and loads to which it happens in one instant, in the
    order of the mechanism.
    """

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.setup: MotionProblem = setup
        self.integrator: Integrator = integrator
        self.kernel: Kernel = setup.kernel
        self.slips: list[Slip] = setup.released.rubbing.slips
        self.names: list[str] = [slip.owner for slip in self.slips]
        self.count: int = len(self.slips)
        self.k: int = 0 if setup.smooth else self.count
        self.found: list[tuple[float, dict[str, float], str]] = []
        self._fastest = self._strongest = 0.0
        self._limits = self._pulls = np.zeros(self.count)
        """The largest forces and rates of slips at events so far."""
        self._held = set[int]()
        self._last = setup.loose
        weights = weights_of(self.slips, setup.model.p, setup.model.p_values, self.kernel.cache)
        self.glides: Glides = Glides(self.slips, weights)
        self._rough = np.full(self.k, RESTS)
        for group in self.glides.groups:
            self._rough[group] = max(RESTS, ROUGH * setup.tolerance)
        self._lines: set[int] = set()
        """First places of pairs that glide along one line: they have one freedom."""
        self._other: dict[int, int] = {}
        """The other side of each side of a slot."""
        for first, second in setup.released.rubbing.sides:
            self._other |= {first: second, second: first}

    def _apart(self, t: float, x: Unknowns, v: Floats) -> tuple[set[int], set[int]]:
        """Return the slips of contacts that are open, and those that closed ones keep at rest.

        The latter bear nothing, though they might: what they would take the contacts bear.
        """
        rubbing, closed = self.setup.released.rubbing, self.setup.closed > 0
        pairs = zip(rubbing.owners, rubbing.feedbacks, strict=True)
        contacts = [(k, f.contact) for k, f in pairs if k is not None and f.contact is not None]
        open_ = {k for k, contact in contacts if not closed[contact]}
        if not closed.any():
            return open_, set()
        moved, without = (
            self.glides.spread(np.linalg.norm(self._along(t, x, v, which), axis=1))
            for which in (closed, ~closed & closed)
        )
        held = (without > RANK) & (moved <= RANK * without)
        return open_, set(np.flatnonzero(held).tolist()) - open_

    # -- values --------------------------------------------------------------------------------

    @cached_property
    def _values(self) -> Any:
        return self.kernel.batch("sticking", lambda: self.kernel.sticking)

    def values(self, t: Floats | float, x: Unknowns, v: Floats, signs: Floats) -> list[Any]:
        """Return speeds, rates, holding forces, least and largest ones, (n, k) each, misses."""
        at = (np.reshape(t, (-1, 1)), np.atleast_2d(x), np.atleast_2d(v), signs)
        found: list[Floats] = self._values(*at)
        return [*(part[:, : self.count] for part in found[:5]), *found[5:]]

    def _along(self, t: float, x: Unknowns, v: Floats, contacts: Booleans | None = None) -> Matrix:
        """Return the speeds (slips, freedoms) that the freedoms give slips, over natural sizes.

        These are what contacts (n,) leave, by default those that are closed.
        """
        k = self.kernel
        contacts = self.setup.closed > 0 if contacts is None else contacts
        J = k.value("place", t, x, v, self.setup.loose)[1]
        C, closed = np.split(k.value("locking", t, x, v, self.setup.loose)[0], [self.count])
        J = np.vstack([J, closed[contacts]])
        return (C * k.sizes) @ self.setup.freedoms(J) / self._sizes()[:, None]

    def _sizes(self) -> Floats:
        return np.array([1.0 if s.unit == "rad" else self.setup.length for s in self.slips])

    # -- signs ---------------------------------------------------------------------------------

    def signs(self, sides: Floats, resting: Sequence[int] = ()) -> Floats:
        """Return the inputs of dry friction: sides -1, 0 (locked), 1, IDLE; slips at rest.

        One that is IDLE at rest is kept so by a closed contact.
        """
        sides = np.asarray(sides, float)
        still = np.zeros(self.k)
        still[list(resting)] = 1.0
        rubbing = np.where(sides == IDLE, 0.0, sides)
        for group in self.glides.groups:
            if sides[group[0]] != IDLE:
                still[group] = float(group[0] in self._lines)
            rubbing[group] *= np.maximum(FIRST * self._fastest * self._sizes()[group], LEAST)
        locks = np.where(self.glides.still(sides), 1.0, 0.0)
        return np.concatenate([rubbing, locks, still, self.setup.fixed])

    def resumed(self, signs: Floats) -> Floats:
        """Return inputs of dry friction with the pieces of tables that hold now."""
        self._last = self.setup.renewed(self._last)
        return self.setup.renewed(signs)

    def sides(self, signs: Floats) -> Floats:
        """Return -1, 0 (locked), 1 or IDLE by slip, of pairs that glide their headings."""
        ways, locks = signs[: self.k], signs[self.k : 2 * self.k]
        found = np.where((ways == 0) & (locks == 0), IDLE, ways)
        for group in self.glides.groups:
            if ways[group].any() or locks[group].any():
                found[group] = ways[group]
        return self.glides.headings(found)

    def mode(self, signs: Floats) -> dict[str, float]:
        """Return -1, 0 or 1 by joint or load; of pairs that glide 1 while they do."""
        sides = self.sides(signs)
        still = self.glides.still(sides)
        found = dict(zip(self.names, sides.tolist(), strict=True))
        return found | {self.names[k]: 0.0 if still[k] else 1.0 for k in self.glides.first}

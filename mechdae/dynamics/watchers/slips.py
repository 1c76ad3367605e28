"""Slips with dry friction: which ones slide, to which side, and which ones stick.

Signs and locks are fixed over steps. Where some slips are at rest every way to go on is tried, with
the coefficients at rest: a slip that starts has to move the way its friction says, one that sticks
has to be held by a force that friction can give. Where the locks are more than the freedoms,
forces are not unique; then all stick if nothing can start.

A ball, or a pair that slides and turns, glides in several directions at once (`glides`): it sticks
where its speed vanishes in all of them, and has a heading in place of a sign.

A pin in a slot touches one side of it. If it sticks there, which is to roll, the slip of the other
side is idle: it has neither a sign nor a lock until it is pressed.
"""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.dynamics.equations import Setup
from mechdae.dynamics.friction_sizes import Sizes
from mechdae.dynamics.integrate import Integrator
from mechdae.dynamics.verdict import NoWay
from mechdae.dynamics.watchers.glides import FIRST, LEAST, Glides, weights_of
from mechdae.dynamics.watchers.onset import Onset
from mechdae.numerics.null_space import freedoms
from mechdae.records import dataclass

RESTS = 1e-9
"""Speed, as a share of the largest so far, that is none."""
RANK = 1e-9
STRAIGHT = 1e-5
"""Speed per speed of the freedoms below which these do not move a slip."""
MOST = 6
"""Slips at rest at once of which all ways to go on are tried."""
SLACK = 1e-9
"""Share of its limit by which a force that holds may exceed it by rounding."""
SOON = 1e-9
"""Share of the whole time after which forces tell the side of a start that is about to come."""
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

    state: Any
    slip: int
    released: bool
    from_rest: bool
    sharp: bool = False


class Slips:
    """The slips of a motion: their sides, and the ways to go on where some are at rest.

    Attributes
    ----------
    found : list of (t, name, sign, kind)
        Events: kind "reversal", "stick" or "slip".
    several : list of (t, number)
        States at which several ways to go on fit.
    """

    def __init__(self, setup: Setup, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.kernel = setup.kernel
        self.slips = setup.released.rubbing.slips
        self.names = [slip.owner for slip in self.slips]
        self.k = 0 if setup.smooth else len(self.slips)
        self.found: list[tuple[float, str, float, str]] = []
        self.several: list[tuple[float, int]] = []
        self._fastest = self._strongest = 0.0
        self._last = setup.loose
        weights = weights_of(self.slips, setup.model.p, setup.model.p_values, self.kernel.kept)
        self.glides = Glides(self.slips, weights)
        self._rough = np.full(self.k, RESTS)
        for own in self.glides.groups:
            self._rough[own] = max(RESTS, ROUGH * setup.tolerance)
        self._lines: set[int] = set()
        """First places of pairs that glide along one line: they have one freedom."""
        self._other: dict[int, int] = {}
        """The other side of each side of a slot."""
        for first, second in setup.released.rubbing.sides:
            self._other |= {first: second, second: first}

    # -- values --------------------------------------------------------------------------------

    @cached_property
    def _values(self) -> Any:
        return self.kernel.batch("sticking", lambda: self.kernel.sticking)

    def values(self, t: Any, x: Any, v: Any, signs: Any) -> list[Any]:
        """Return speeds, rates, holding forces, least and largest ones, (n, k) each, misses."""
        at = (np.reshape(t, (-1, 1)), np.atleast_2d(x), np.atleast_2d(v), signs)
        found: list[Any] = self._values(*at)
        return found

    def _along(self, t: float, x: Any, v: Any) -> Any:
        """Return the speeds (slips, freedoms) that the freedoms give slips, over natural sizes."""
        k = self.kernel
        J = k.value("place", t, x, v, self.setup.loose)[1]
        C = k.value("locking", t, x, v, self.setup.loose)[0]
        return (C * k.sizes) @ freedoms(J, k.sizes) / self._sizes()[:, None]

    def _sizes(self) -> Any:
        """Return natural sizes of the slips."""
        return np.array([1.0 if s.unit == "rad" else self.setup.length for s in self.slips])

    # -- signs ---------------------------------------------------------------------------------

    def signs(self, sides: Any, resting: Any = ()) -> Any:
        """Return the inputs of dry friction: sides -1, 0 (locked), 1, IDLE; slips at rest."""
        sides = np.asarray(sides, float)
        still = np.zeros(self.k)
        still[list(resting)] = 1.0
        own = np.where(sides == IDLE, 0.0, sides)
        for group in self.glides.groups:
            still[group] = float(group[0] in self._lines)
            own[group] *= np.maximum(FIRST * self._fastest * self._sizes()[group], LEAST)
        locks = np.where(self.glides.still(sides), 1.0, 0.0)
        return np.concatenate([own, locks, still, self.setup.fixed])

    def resumed(self, signs: Any) -> Any:
        """Return inputs of dry friction with the pieces of tables that hold now."""
        self._last = self.setup.renewed(self._last)
        return self.setup.renewed(signs)

    def sides(self, signs: Any) -> Any:
        """Return -1, 0 (locked), 1 or IDLE by slip, of pairs that glide their headings."""
        own, locks = signs[: self.k], signs[self.k : 2 * self.k]
        found = np.where((own == 0) & (locks == 0), IDLE, own)
        for group in self.glides.groups:
            found[group] = own[group]
        return self.glides.headings(found)

    def mode(self, signs: Any) -> dict[str, float]:
        """Return -1, 0 or 1 by joint or load; of pairs that glide 1 while they do."""
        sides = self.sides(signs)
        still = self.glides.still(sides)
        found = dict(zip(self.names, sides.tolist(), strict=True))
        return found | {self.names[k]: 0.0 if still[k] else 1.0 for k in self.glides.first}

    def first(self, t: float, x: Any, v: Any) -> tuple[Any, Any]:
        """Return the inputs of dry friction at the start, and the speeds with locks."""
        if self.setup.smooth:
            self.sizes.check(t, x, v, self.setup.loose)
        if not self.k:
            return self.setup.loose, v
        return self.settled(t, x, v, np.zeros(self.k), None)

    def settled(self, t: float, x: Any, v: Any, sides: Any, turn: Turn | None) -> tuple[Any, Any]:
        """Return inputs of dry friction for the way to go on, and the rates of x with its locks.

        Raises
        ------
        NoWay
            No way fits.
        """
        if self.glides.groups:
            along = self._along(t, x, v)
            rank = np.linalg.matrix_rank
            self._lines = {own[0] for own in self.glides.groups if rank(along[own], RANK) < 2}
        free = self.values(t, x, v, self.setup.loose)
        speeds, pull = (part[0] / self._sizes() for part in free[:2])
        fast = self.glides.spread(speeds)
        self._fastest = max(self._fastest, float(np.max(fast, initial=0.0)))
        rest = set(np.flatnonzero(fast <= self._rough * self._fastest).tolist())
        still = self.glides.still(sides)
        rest |= set(np.flatnonzero(still).tolist()) if turn is not None else set()
        natural = np.sqrt(np.max(np.abs(pull), initial=0.0))
        idle = np.flatnonzero((sides == IDLE) & (np.abs(speeds) <= RESTS * natural))
        rest |= set(idle.tolist())  # where nothing has moved yet all speeds are rounding
        sides = sides.copy()
        if turn is None:
            sides = np.sign(speeds)
        sides = np.where(sides == IDLE, np.sign(speeds), sides)  # those at rest are tried
        for group in self.glides.groups:
            if group[0] not in rest:
                sides[group] = speeds[group] / fast[group]
        fixed: set[int] = set()
        if turn is not None and turn.released:
            own = self.glides.group(turn.slip)
            held = self.values(t, x, v, self._last)[2][0]
            sides[own] = -held[own] / max(float(np.linalg.norm(held[own])), LEAST)
            fixed = set(own)
        elif turn is not None and turn.slip not in self.glides.first:
            rest.add(turn.slip)
        tried = sorted(rest - fixed)
        again = turn is not None and not turn.released and bool(still[turn.slip])
        chosen = self._way(t, x, v, sides, tried)
        if again and (chosen == sides).all():  # about to start, forces are none yet
            chosen = self._way(t + SOON * self.setup.end, x, v, sides, tried)
        at_rest = self.glides.still(chosen)
        locked = [k for k in tried if at_rest[k]]
        signs = self.signs(chosen, locked)
        self._last = signs
        self.sizes.check(t, x, v, signs)
        if locked:
            v = self.integrator.projected(t, x, v, signs)
        return signs, v

    def _way(self, t: float, x: Any, v: Any, sides: Any, rest: list[int]) -> Any:
        """Return sides for the way to go on with some slips at rest."""
        if not rest:
            return sides
        along = self._along(t, x, v)
        moved = self.glides.spread(np.linalg.norm(along, axis=1)) > RANK
        sides, rest = self._turned(t, x, v, sides, rest, along)
        if not rest:
            return sides
        ways = self._ways(along, rest, moved)
        good, fallback = [], None
        for way in ways:
            own = sides.copy()
            own[rest] = way
            own = self._headed(t, x, v, own, rest)
            still = self.glides.still(own)
            locked = [k for k in rest if still[k]]
            rank = np.linalg.matrix_rank(along[locked], RANK) if locked else 0
            if rank < len(locked):
                fallback = own if fallback is None else fallback
                continue
            if self._fits(t, x, v, own, rest):
                good.append((len(locked), own))
        if good:
            if len(good) > 1:
                self.several.append((t, len(good)))
            return max(good, key=lambda entry: entry[0])[1]
        if fallback is not None:
            if along.shape[1] > 1:
                names = ", ".join(self.names[k] for k in rest)
                raise NoWay(
                    f"{names} come to rest together, more of them than freedoms: the forces that "
                    "hold them are not unique (F3)",
                    "ambiguous",
                    "F3",
                    joints=[self.names[k] for k in rest],
                )
            return fallback
        raise NoWay(
            f"no way to go on from rest fits the laws of dry friction (F5) of "
            f"{', '.join(self.names[k] for k in rest)}",
            joints=[self.names[k] for k in rest],
        )

    def _turned(
        self, t: float, x: Any, v: Any, sides: Any, rest: list[int], along: Any
    ) -> tuple[Any, list[int]]:
        """Return the sides of slips, those reversed that turn round for any friction.

        No freedom moves them at this pose, so that what they do next depends on speeds alone: where
        a rocker turns all that hangs on it does.
        """
        reach = self.glides.spread(np.linalg.norm(along, axis=1))
        if not (reach[rest] <= STRAIGHT).any():
            return sides, rest
        rates = self.values(t, x, v, self.setup.loose)[1][0] / self._sizes()
        pull = np.abs(self.integrator.acceleration(t, x, v, self.setup.loose) / self.kernel.sizes)
        size = self.glides.spread(rates)
        sure = (reach <= STRAIGHT) & (size > reach / STRAIGHT * pull.max(initial=0.0))
        sure &= size > RESTS * self._fastest**2
        ways = np.sign(rates)
        for group in self.glides.groups:
            ways[group] = rates[group] / np.maximum(size[group], LEAST)
        sides = np.where(sure & np.isin(np.arange(self.k), rest), ways, sides)
        return sides, [k for k in rest if not sure[k]]

    def _ways(self, along: Any, rest: list[int], moved: Any) -> list[Any]:
        """Return the sides to be tried for slips at rest."""
        alone = self.glides.alone(rest)
        if along.shape[1] == 1 and moved[rest].all() and len(rest) > 1:
            forward = np.sign(along[:, 0])
            for group in self.glides.groups:
                size = float(np.linalg.norm(along[group, 0]))
                forward[group] = along[group, 0] / max(size, LEAST)
            return [*self._stuck(rest), forward[rest], -forward[rest]]
        slots = [k for k in rest if self._other.get(k) in rest]
        if len(alone) - len(slots) // 2 > MOST:
            names = ", ".join(dict.fromkeys(self.names[k] for k in rest))
            raise NoWay(f"more than {MOST} slips come to rest at once: {names}")
        found = []
        choices = [(0.0, np.nan) if len(own) > 1 else (0.0, 1.0, -1.0, IDLE) for own in alone]
        for way_of in itertools.product(*choices):
            by = {k: side for own, side in zip(alone, way_of, strict=True) for k in own}
            way = [by[k] for k in rest]
            idle = {k for k, side in by.items() if side == IDLE}
            if {self._other[k] for k in slots if by[k] == 0} == idle:
                found.append(np.array(way))
        return found

    def _headed(self, t: float, x: Any, v: Any, sides: Any, rest: list[int]) -> Any:
        """Return sides with the headings of pairs that start."""
        if not np.isnan(sides).any():
            return sides
        stuck = np.where(np.isnan(sides), 0.0, sides)
        free = self.values(t, x, v, self.setup.loose)[1][0]
        held = self.values(t, x, v, self.signs(stuck, rest))[2][0]

        def rates(own: Any) -> Any:
            return self.values(t, x, v, self.signs(own, rest))[1][0]

        return self.glides.headed(sides, rates, free, held)

    def _stuck(self, rest: list[int]) -> list[Any]:
        """Return the ways in which all slips at rest stick, each slot on one of its sides."""
        pairs = [k for k in rest if self._other.get(k, -1) > k and self._other[k] in rest]
        found = []
        for chosen in itertools.product((False, True), repeat=len(pairs)):
            idle = {self._other[k] if first else k
                    for k, first in zip(pairs, chosen, strict=True)}  # fmt: skip
            found.append(np.array([IDLE if k in idle else 0.0 for k in rest]))
        return found

    def _fits(self, t: float, x: Any, v: Any, sides: Any, rest: list[int]) -> bool:
        """Return whether sides agree with what they lead to."""
        signs = self.signs(sides, rest)
        if not self.kernel.rubs or self.sizes.contractions(t, x, v, signs)[0] < 1:
            _, rates, held, low, high, miss = (part[0] for part in self.values(t, x, v, signs))
            return bool(miss[0] < 1e-9) and self._agrees(sides, rest, rates, held, low, high)
        # Newton's method finds one of them at most
        for m, _ in self.sizes.solutions(t, x, v, signs):
            found = self._values_of(*(np.atleast_2d(own) for own in (t, x, v, signs, m)))
            if self._agrees(sides, rest, *(part[0] for part in found[1:])):
                return True
        return False

    @cached_property
    def _values_of(self) -> Any:
        return self.kernel.batch("sticking of", lambda: self.kernel.sticking_of, ())

    def _agrees(
        self, sides: Any, rest: list[int], rates: Any, held: Any, low: Any, high: Any
    ) -> bool:
        """Return whether accelerations and forces are what sides of slips at rest need."""
        still = self.glides.still(sides)
        for k in rest:
            if k in self.glides.first:
                own = self.glides.group(k)
                if still[k]:
                    size, limit = self.glides.holding(held, high, k)
                    if not size <= limit * (1 + SLACK):
                        return False
                elif not rates[own] @ sides[own] > 0:
                    return False
            elif sides[k] == IDLE:
                if not high[k] <= SLACK * high[self._other[k]]:
                    return False
            elif sides[k] == 0:
                slack = SLACK * max(abs(low[k]), abs(high[k]))
                if not low[k] - slack <= held[k] <= high[k] + slack:
                    return False
            elif not rates[k] * sides[k] > 0:
                return False
        return True

    @cached_property
    def sizes(self) -> Sizes:
        """The sizes of friction in joints, and how many fit."""
        return Sizes(self.setup)

    @cached_property
    def onset(self) -> Onset:
        """Where the laws of friction stop to give one acceleration."""
        return Onset(self.integrator, self.sizes)

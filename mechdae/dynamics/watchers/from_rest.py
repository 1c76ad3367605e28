"""The ways to go on where slips are at rest: which of them fits the laws of dry friction.

Slips whose speeds are in a fixed ratio rest or move together: they are one *unit*, and where it
rests the forces that hold it are not unique; it sticks if it cannot start. All ways of the units
are tried, of many units one unit after the other. Where a force is at its limit, or a speed about
to change, the forces a moment later tell which way is right: pairs that let go, or come to rest,
in the same instant do so together.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.dynamics.friction_sizes import Sizes
from mechdae.dynamics.integrate import NoWay
from mechdae.dynamics.watchers.onset import Onset
from mechdae.dynamics.watchers.sliding import (
    IDLE,
    LEAST,
    RANK,
    RESTS,
    ROUNDING,
    SLACK,
    STRAIGHT,
    Slips,
    Turn,
)
from mechdae.records import dataclass
from mechdae.types import Floats, Unknowns

MOST = 6
"""Units at rest of which all ways to go on are tried."""
SWEEPS = 12
"""Times that more of them are gone through, one after the other."""
SOON = (1e-9, 1e-7, 1e-5)
"""Shares of the whole time after which forces tell what is about to come."""
SURE = 1e-12
"""Share of its limit by which a force then has to be off it, and of its rate a speed."""


@dataclass(frozen=True)
class Way:
    """A way to go on: sides of all slips, how many units and slips stick in it.

    ``fits`` tells whether what it leads to agrees with it, ``margin`` by which share of limits and
    rates it does or misses; locks of a ``dependent`` one are more than the freedoms.
    """

    sides: Floats
    shared: int
    locked: int
    fits: bool
    margin: float
    dependent: bool = False


FREE = (True, np.inf)
"""What a way is that asks nothing."""


@dataclass(frozen=True)
class _Unit:
    """Slips at rest that are looked at together, and the sides they may have, (slips,) each."""

    slips: list[int]
    shared: bool
    choices: list[Floats]


@dataclass(frozen=True)
class _Tries:
    """What ways to go on are tried with: time, x and v, sides, slips at rest.

    ``along`` are speeds that freedoms give slips, ``free`` the rates of these without friction;
    ``slack`` is the share by which a force may exceed its limit.
    """

    at: tuple[float, Floats, Floats]
    sides: Floats
    rest: list[int]
    along: Floats
    free: Floats
    units: list[_Unit]
    slack: float

    def ways(self) -> Iterator[Floats]:
        """Yield the sides to be tried, (rest,) each."""
        place = {k: i for i, k in enumerate(self.rest)}
        order = [place[k] for unit in self.units for k in unit.slips]
        for choice in itertools.product(*[unit.choices for unit in self.units]):
            found = np.empty(len(self.rest))
            found[order] = np.concatenate(choice)
            yield found


class WaysFromRest(Slips):
    """Finds the way to go on where some slips are at rest."""

    def first(self, t: float, x: Unknowns, v: Floats) -> tuple[Floats, Floats]:
        """Return the inputs of dry friction at the start, and the speeds with locks."""
        if self.setup.smooth:
            self.sizes.check(t, x, v, self.setup.loose)
        if not self.k:
            return self.setup.loose, v
        return self.settled(t, x, v, np.zeros(self.k), None)

    def settled(
        self, t: float, x: Unknowns, v: Floats, sides: Floats, turn: Turn | None
    ) -> tuple[Floats, Floats]:
        """Return inputs of dry friction for the way to go on, and the rates of x with its locks."""
        if self.glides.groups:
            along = self._along(t, x, v)
            rank = np.linalg.matrix_rank
            self._lines = {group[0] for group in self.glides.groups if rank(along[group], RANK) < 2}
        before, still = sides, self.glides.still(sides)
        sides, rest, fixed = self._at_rest(t, x, v, sides, turn)
        tried = sorted(rest - fixed)
        chosen, sure = self._way(t, x, v, sides, tried, SLACK)
        again = turn is not None and not turn.released and bool(still[turn.slip])
        if again and (chosen == sides).all():  # about to start, forces are none yet
            sure = False
        if not sure:
            chosen = self._soon(t, x, v, sides, sorted(rest | fixed), chosen)
        at_rest = self.glides.still(chosen)
        locked = [k for k in sorted(rest | fixed) if at_rest[k]]
        signs = self.signs(chosen, [*locked, *self._held])
        self._last = signs
        started = sorted(k for k in rest | fixed if not at_rest[k])
        self._checked(t, x, v, signs, (before, chosen), started)
        if locked:
            v = self.integrator.projected(t, x, v, signs)
        return signs, v

    def _at_rest(
        self, t: float, x: Unknowns, v: Floats, sides: Floats, turn: Turn | None
    ) -> tuple[Floats, set[int], set[int]]:
        """Return the sides of slips that move, those at rest, and those that an event lets go."""
        free = self.values(t, x, v, self.setup.loose)
        speeds, pull = (part[0] / self._sizes() for part in free[:2])
        self._pulls = np.fmax(self._pulls, self.glides.spread(free[1][0]))
        self._limits = np.fmax(self._limits, free[4][0])
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
            together = self.glides.group(turn.slip)
            held = self.values(t, x, v, self._last)[2][0]
            sides[together] = -held[together] / max(float(np.linalg.norm(held[together])), LEAST)
            fixed = set(together)
        elif turn is not None and turn.slip not in self.glides.first:
            rest.add(turn.slip)
        open_, self._held = self._apart(t, x, v)
        sides[[*open_, *self._held]] = IDLE
        return sides, rest - open_ - self._held, fixed - open_ - self._held

    def _soon(
        self, t: float, x: Unknowns, v: Floats, sides: Floats, rest: list[int], chosen: Floats
    ) -> Floats:
        """Return the way that fits a moment later: here what is chosen is on an edge."""
        locked = [k for k in rest if self.glides.still(chosen)[k]]
        a = self.integrator.acceleration(t, x, v, self.signs(chosen, locked))
        a = np.where(np.isfinite(a), a, 0.0)
        for share in SOON:
            h = share * self.setup.end
            later = (t + h, x + h * v + h * h / 2 * a, v + h * a)
            try:
                chosen, sure = self._way(*later, sides, rest, SURE)
            except NoWay:
                break
            if sure:
                break
        return chosen

    def _checked(
        self,
        t: float,
        x: Unknowns,
        v: Floats,
        signs: Floats,
        sides: tuple[Floats, Floats],
        started: list[int],
    ) -> None:
        """Raise where the laws of friction give no accelerations for a way, or several."""
        before, chosen = sides
        self.sizes.started &= set(np.flatnonzero(before == chosen).tolist())
        free = self.values(t, x, v, self.setup.loose)[1][0]

        def agrees(m: Floats) -> bool:
            found = self._values_of(*(np.atleast_2d(part) for part in (t, x, v, signs, m)))
            margins = self._margins(chosen, started, [part[0] for part in found[1:]], free)
            return bool((margins >= -SLACK).all())

        if self.sizes.check(t, x, v, signs, agrees if started else None):
            self.sizes.started |= set(started)

    # -- trying ----------------------------------------------------------------------------

    def _way(
        self, t: float, x: Unknowns, v: Floats, sides: Floats, rest: list[int], slack: float
    ) -> tuple[Floats, bool]:
        """Return sides for the way to go on with some slips at rest, and whether it is sure."""
        if not rest:
            return sides, True
        along = self._along(t, x, v)
        sides, rest = self._turned(t, x, v, sides, rest, along)
        if not rest:
            return sides, True
        free = self.values(t, x, v, self.setup.loose)[1][0]
        tries = _Tries((t, x, v), sides, rest, along, free, self._units(along, rest), slack)
        many = len(tries.units) > MOST
        ways = self._relaxed(tries) if many else [self._tried(tries, w) for w in tries.ways()]
        sure = all(abs(way.margin) > slack for way in ways)
        good = [way for way in ways if way.fits]
        if len(good) > 1:
            good = self._pushing(tries, good) or good
        if good:
            return min(good, key=lambda way: (way.shared, -way.locked)).sides, sure
        names = ", ".join(dict.fromkeys(self.names[k] for k in rest))
        joints = [self.names[k] for k in rest]
        if dependent := [way for way in ways if way.dependent]:
            if along.shape[1] == 1:
                return dependent[0].sides, True
            raise NoWay(
                f"{names} come to rest together, more of them than freedoms: the forces that "
                "hold them are not unique (F3)",
                "ambiguous",
                "F3",
                joints=joints,
            )
        more = f", gone through {SWEEPS} times" if many else ""
        raise NoWay(
            f"no way to go on from rest fits the laws of dry friction (F5) of {names}{more}",
            joints=joints,
        )

    def _units(self, along: Floats, rest: list[int]) -> list[_Unit]:
        """Return the slips at rest, those together that only move together.

        The two sides of a slot are one too; where there are several freedoms with nothing else.
        """
        moved = self.glides.spread(np.linalg.norm(along, axis=1)) > RANK
        if along.shape[1] == 1 and moved[rest].all():
            return [self._unit(along, rest)]
        found: list[list[int]] = []
        for slip in self.glides.alone(rest):
            slot = self._other.get(slip[0])
            unit = next((unit for unit in found if slot in unit), None)
            if slot is None and moved[slip].all():
                unit = next((unit for unit in found if self._together(along, [*unit, *slip])), None)
            if unit is None:
                found.append(list(slip))
            else:
                unit += slip
        return [self._unit(along, way) for way in found]

    def _together(self, along: Floats, slips: list[int]) -> bool:
        """Return whether the speeds of slips, none of them in a slot, are in a fixed ratio."""
        size = np.linalg.norm(along[slips], axis=1)
        if not size.min() > RANK or any(k in self._other for k in slips):
            return False
        return bool(np.linalg.matrix_rank(along[slips] / size[:, None], RANK) == 1)

    def _unit(self, along: Floats, slips: list[int]) -> _Unit:
        """Return slips with the sides they may have."""
        dependent = len(slips) > 1 and np.linalg.matrix_rank(along[slips], RANK) < len(slips)
        if dependent and (along.shape[1] == 1 or slips[0] not in self._other):
            forward = self._forward(along, slips)
            return _Unit(slips, True, [*self._stuck(slips), forward, -forward])
        if slips[0] in self.glides.first:
            return _Unit(slips, False, [np.full(len(slips), side) for side in (0.0, np.nan)])
        slots = [k for k in slips if self._other.get(k) in slips]
        sides = (0.0, 1.0, -1.0, IDLE) if slots else (0.0, 1.0, -1.0)
        choices = []
        for chosen in itertools.product(sides, repeat=len(slips)):
            by = dict(zip(slips, chosen, strict=True))
            idle = {k for k, side in by.items() if side == IDLE}
            if {self._other[k] for k in slots if by[k] == 0} == idle:  # the other side sticks
                choices.append(np.array(chosen))
        return _Unit(slips, False, choices)

    def _forward(self, along: Floats, slips: list[int]) -> Floats:
        """Return the sides of slips that move together one way."""
        one = along.shape[1] == 1
        direction = np.ones(1) if one else along[slips[0]] / np.linalg.norm(along[slips[0]])
        rates = along @ direction
        found = np.sign(rates)
        for group in self.glides.groups:
            found[group] = rates[group] / max(float(np.linalg.norm(rates[group])), LEAST)
        return found[slips]

    def _tried(self, tries: _Tries, way: Floats, only: Sequence[int] | None = None) -> Way:
        """Return what becomes of a way to go on; `only` some slips are asked whether it fits."""
        rest, along = tries.rest, tries.along
        turned = tries.sides.copy()
        turned[rest] = way
        turned = self._headed(*tries.at, turned, rest)
        still = self.glides.still(turned)
        shared = [unit.slips for unit in tries.units if unit.shared and self._rests(turned, unit)]
        open_ = {k for unit in shared for k in unit}
        locked = [k for k in rest if still[k] and k not in open_]
        firsts = [*locked, *(unit[0] for unit in shared)]
        count = sum(bool(still[k]) for k in rest)
        if firsts and np.linalg.matrix_rank(along[firsts], RANK) < len(firsts):
            return Way(turned, len(shared), count, False, np.inf, dependent=True)
        tried = [k for k in (rest if only is None else only) if k not in open_]
        fits, margin = self._fits(tries, turned, tried) if tried else FREE
        return Way(turned, len(shared), count, fits, margin)

    def _rests(self, sides: Floats, unit: _Unit) -> bool:
        return bool(self.glides.still(sides)[unit.slips].any() or (sides[unit.slips] == IDLE).any())

    def _relaxed(self, tries: _Tries) -> list[Way]:
        """Return the way that many units come to, each looked at with the others as they are."""
        settled = tries.sides.copy()
        for unit in tries.units:
            settled[unit.slips] = unit.choices[0]
        for _ in range(SWEEPS):
            last = settled.copy()
            for unit in tries.units:
                tried = []
                for choice in unit.choices:
                    settled[unit.slips] = choice
                    tried.append(self._tried(tries, settled[tries.rest], unit.slips))
                good = [way for way in tried if way.fits] or tried[:1]
                settled = min(good, key=lambda way: (way.shared, -way.locked)).sides.copy()
            if np.array_equal(settled, last):
                break
        return [self._tried(tries, settled[tries.rest])]

    def _pushing(self, tries: _Tries, ways: list[Way]) -> list[Way]:
        """Return the ways in which no contact that is declared one-sided would have to pull."""
        found = []
        for way in ways:
            locked = [k for k in tries.rest if self.glides.still(way.sides)[k]]
            signs = self.signs(way.sides, locked)
            if way.shared or not self.sizes.pulls(*tries.at, signs):
                found.append(way)
        return found

    def _turned(
        self, t: float, x: Unknowns, v: Floats, sides: Floats, rest: list[int], along: Floats
    ) -> tuple[Floats, list[int]]:
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

    def _headed(self, t: float, x: Unknowns, v: Floats, sides: Floats, rest: list[int]) -> Floats:
        """Return sides with the headings of pairs that start."""
        if not np.isnan(sides).any():
            return sides
        stuck = np.where(np.isnan(sides), 0.0, sides)
        free = self.values(t, x, v, self.setup.loose)[1][0]
        held = self.values(t, x, v, self.signs(stuck, rest))[2][0]

        def rates(ways: Floats) -> Any:
            return self.values(t, x, v, self.signs(ways, rest))[1][0]

        return self.glides.headed(sides, rates, free, held)

    def _stuck(self, rest: list[int]) -> list[Floats]:
        """Return the ways in which all slips at rest stick, each slot on one of its sides."""
        pairs = [k for k in rest if self._other.get(k, -1) > k and self._other[k] in rest]
        found = []
        for chosen in itertools.product((False, True), repeat=len(pairs)):
            idle = {self._other[k] if first else k
                    for k, first in zip(pairs, chosen, strict=True)}  # fmt: skip
            found.append(np.array([IDLE if k in idle else 0.0 for k in rest]))
        return found

    def _fits(self, tries: _Tries, sides: Floats, tried: list[int]) -> tuple[bool, float]:
        """Return whether sides agree with what they lead to, for some of the slips at rest."""
        fits, worst = False, -np.inf
        for found in self._answers(*tries.at, self.signs(sides, tries.rest)):
            margins = self._margins(sides, tried, found, tries.free)
            moving = ~self.glides.still(sides)[tried] & (sides[tried] != IDLE)
            fits |= bool(((margins > 0) | ~moving & (margins >= -tries.slack)).all())
            worst = max(worst, float(margins.min(initial=np.inf)))
        return fits, worst

    def _answers(self, t: float, x: Unknowns, v: Floats, signs: Floats) -> Iterator[list[Floats]]:
        """Yield rates, holding forces, least and largest ones, of all solutions of friction."""
        if not self.kernel.rubs or self.sizes.contractions(t, x, v, signs)[0] < 1:
            _, *found, miss = (part[0] for part in self.values(t, x, v, signs))
            if miss[0] < 1e-9:
                yield found
            return
        # Newton's method finds one of them at most
        for m, _ in self.sizes.solutions(t, x, v, signs):
            found = self._values_of(*(np.atleast_2d(part) for part in (t, x, v, signs, m)))
            yield [part[0] for part in found[1:]]

    @cached_property
    def _values_of(self) -> Any:
        return self.kernel.batch("sticking of", lambda: self.kernel.sticking_of, ())

    def _margins(
        self, sides: Floats, tried: list[int], answer: list[Floats], free: Floats
    ) -> Floats:
        """Return by how much accelerations and forces are what slips need, (tried,).

        A share of the limit of a force that holds, or of the rate of a speed that begins, beside
        that without friction.
        """
        rates, held, low, high = answer
        still = self.glides.still(sides)
        found = list[Any]()
        left: Any
        size: Any
        force: Any
        for k in tried:
            group = self.glides.group(k)
            force = np.linalg.norm(held[group])
            self._limits[k] = np.fmax(self._limits[k], force)
            least = ROUNDING * self._limits[k]
            if sides[k] == IDLE:
                left, size = (1.0 if high[k] <= SLACK * high[self._other[k]] else -1.0), 1.0
            elif still[k] and len(group) > 1:
                force, size = self.glides.holding(held, high, k)
                left = size - force
            elif still[k]:
                left, size = min(held[k] - low[k], high[k] - held[k]), max(-low[k], high[k])
            else:
                left = rates[group] @ sides[group]
                size = np.linalg.norm(rates[group]) + np.linalg.norm(free[group])
                force, least = size, ROUNDING * self._pulls[k]
            left = 0.0 if max(force, size) <= least else left
            found.append(left / size if size > 0 else np.sign(left))
        return np.array(found)

    @cached_property
    def sizes(self) -> Sizes:
        """The sizes of friction in joints, and how many fit."""
        return Sizes(self.setup)

    @cached_property
    def onset(self) -> Onset:
        """Where the laws of friction stop to give one acceleration."""
        return Onset(self.integrator, self.sizes)

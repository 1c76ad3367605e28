"""Dry friction between events: which slips slide, to which side, and which ones stick.

Signs and locks are fixed over steps. A step ends where a sliding speed vanishes or a
holding force reaches its limit; there every way to go on is tried for the slips at rest, with the
coefficients at rest: a slip that starts has to move the way its friction says, one that sticks
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

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import Setup
from mechdae.dynamics.friction_sizes import Sizes
from mechdae.dynamics.integrate import Cut, Integrator, Nodes
from mechdae.dynamics.verdict import NoWay
from mechdae.dynamics.watchers.ball_loads import BallLoads
from mechdae.dynamics.watchers.glides import FIRST, LEAST, Glides, weights_of
from mechdae.dynamics.watchers.onset import Onset
from mechdae.dynamics.watchers.zeros import Looker, Sign, changes
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
CLOSE = 1e-13
"""The same between steps, where the limit is reached."""
STARTS = 1e-12
"""Share of the acceleration without friction from which a mechanism at rest starts."""
SOON = 1e-9
"""Share of the whole time after which forces tell the side of a start that is about to come."""
TURNED = 0.2
"""Cosine between a direction and its heading at which the heading is that of now."""
ROUGH = 100.0
"""Speed, over the tolerance, from which a pair that glides does not rest."""
IDLE = 2.0
"""Side of a slip that nothing presses, beside one that sticks."""
MOVING = ("speed", "glide", "near", "sharp")
"""What is watched of slips that slide."""
RELEASED = ("below", "above", "slack")
"""What is watched of forces that hold."""


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


class Sticking:
    """Watches the slips of a motion.

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
        weights = weights_of(self.slips, setup.model.p, setup.model.p_values)
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

    # -- events --------------------------------------------------------------------------------

    def _starts(self, t: Any, x: Any, v: Any, signs: Any) -> Any:
        """Return what is left (n,) until locks of one freedom, more than it needs, give way.

        The accelerations to both sides with friction at rest, over those without friction.
        """
        t = np.ravel(t)
        sides = self.sides(signs).copy()
        locked = np.flatnonzero(self.glides.still(sides))
        along = self._along(float(t[0]), x[0], v[0])
        forward = np.sign(along[:, 0])
        for group in self.glides.groups:
            size = float(np.linalg.norm(along[group, 0]))
            forward[group] = along[group, 0] / max(size, LEAST)
        ways, worst = forward[locked], np.full(len(t), -np.inf)
        free = self.values(t, x, v, self.setup.loose)[1][:, locked]
        size = np.max(np.abs(free / self._sizes()[locked]), axis=1, initial=0.0)
        idle = np.flatnonzero(sides == IDLE)
        others = np.sign(along[idle, 0])
        for direction in (1.0, -1.0):
            own = sides.copy()
            own[locked] = direction * ways
            own[idle] = np.where(others == 0, IDLE, direction * others)
            rates = self.values(t, x, v, self.signs(own, locked))[1][:, locked]
            rates = rates * own[locked] / self._sizes()[locked]
            for group in self.glides.groups:
                at = np.flatnonzero(np.isin(locked, group))
                rates[:, at] = rates[:, at].sum(axis=1, keepdims=True)
            worst = np.maximum(worst, rates.min(axis=1))
        return STARTS * size - worst

    def unique(self, t: float, x: Any, v: Any, signs: Any) -> bool:
        """Return whether the forces of locked slips are unique."""
        locked = np.flatnonzero(self.glides.still(self.sides(signs)))
        along = self._along(t, x, v)
        return bool(np.linalg.matrix_rank(along[locked], RANK) == len(locked))

    def look(self, nodes: Nodes) -> Cut | None:
        """Return the first event in accepted steps, or the state without a way; None for none."""
        if len(nodes.states) < 2 or not (self.k or self.setup.smooth):
            return None
        lost = self.onset.look(nodes) if self.kernel.rubs else None
        turn = self._turn(nodes) if self.k else None
        if lost is not None and (turn is None or lost[0][0] < turn.state[0]):
            return Cut(lost[0], verdict=lost[1])
        if turn is not None and turn.sharp:
            return Cut(turn.state, verdict=self.balls.verdict(self.names[turn.slip]))
        return None if turn is None else Cut(turn.state, turn=turn)

    def _turn(self, nodes: Nodes) -> Turn | None:
        """Return the first event in accepted steps."""
        lay, states, signs = self.integrator.layout, nodes.states, nodes.signs
        t, x, v = (lay.of(states, name) for name in ("t", "x", "v"))
        sides = self.sides(signs)
        stuck = bool(self.glides.still(sides).any())
        shared = stuck and not self.unique(float(t[0]), x[0], v[0], signs)
        watched = self._watched(sides, shared)
        watched += self._nearing(float(t[0]), x[0], v[0], signs, sides)
        values = self._functions(watched, signs)
        for (k, word), own in zip(watched, values(t[:1, None], x[:1], v[:1])[0], strict=True):
            if word not in MOVING and own < 0:  # over its limit from the start
                return Turn(states[0], k, word in RELEASED, True)
        self._faster(t, x, v, signs)

        looker = Looker(
            self.integrator, nodes, values, lambda k: self._functions(watched[k : k + 1], signs)
        )
        first: Turn | None = None
        row = 0
        for sign in changes(lay, nodes, values, falls=True):
            if first is not None and sign.row > row:
                break
            for state, _ in looker.states(sign)[:1]:
                if first is None or lay.of(state, "t") < lay.of(first.state, "t"):
                    k, word = watched[sign.which]
                    released, sharp = word in RELEASED, word in ("sharp", "pivot")
                    first = Turn(state, k, released, word not in MOVING, sharp)
                    row = sign.row
        return self._ended(looker, watched, first, row if first is not None else len(states))

    def _ended(
        self, looker: Looker, watched: list[tuple[int, str]], first: Turn | None, last: int
    ) -> Turn | None:
        """Return the first event, those at ends of steps among them that no fit sees.

        Where a pair that glides comes to rest the direction of its friction turns round in no time.
        """
        lay, nodes = self.integrator.layout, looker.nodes
        rows = [j for j, (_, word) in enumerate(watched) if word in ("glide", "near", "sharp")]
        if not rows:
            return first
        t, x, v = (lay.of(nodes.states[: last + 1], name) for name in ("t", "x", "v"))
        own = looker.values(t[:, None], x, v)[:, rows]
        fallen = (own[:-1] > 0) & (own[1:] <= 0)
        if not fallen.any():
            return first
        row = int(np.flatnonzero(fallen.any(axis=1))[0])
        found = first
        for j in np.flatnonzero(fallen[row]).tolist():
            k, word = watched[rows[j]]
            state = looker.located(Sign(row, 0.0, 1.0, rows[j], 1.0, False), 0.0, 1.0)
            if found is None or lay.of(state, "t") < lay.of(found.state, "t"):
                found = Turn(state, k, False, False, word == "sharp")
        return found

    def _watched(self, sides: Any, shared: bool) -> list[tuple[int, str]]:
        """Return what is watched, and what happens to a slip where it falls below zero."""
        found: list[tuple[int, str]] = []
        still = self.glides.still(sides)
        locked = np.flatnonzero(still).tolist()
        for k, side in enumerate(sides.tolist()):
            if k in self.glides.first:
                if self.glides.first[k] != k:
                    continue
                ball = [(k, "pivot" if still[k] else "sharp")] if k in self.balls.sizes else []
                if not still[k]:
                    found += [(k, "glide"), *ball]
                elif shared:
                    found += [(k, "starts")] if locked[0] == k else []
                else:
                    found += [(k, "slack"), *ball]
            elif abs(side) == 1:
                found.append((k, "speed"))
            elif shared:
                found += [(k, "starts")] if locked and k == locked[0] else []
            else:
                found += [(k, "pressed")] if side == IDLE else [(k, "below"), (k, "above")]
        return found

    def _nearing(self, t: float, x: Any, v: Any, signs: Any, sides: Any) -> list[tuple[int, str]]:
        """Return the pairs that glide and are not at rest at the beginning: they may come to it."""
        moving = [own for own in self.glides.groups if not self.glides.still(sides)[own[0]]]
        if not moving:
            return []
        at = (np.array([[t]]), x[None, :], v[None, :])
        fast = self.glides.spread(self._speeds(*at, signs)[0] / self._sizes())[0]
        least = 2 * self._rough * self._fastest
        return [(own[0], "near") for own in moving if fast[own[0]] > least[own[0]]]

    @cached_property
    def balls(self) -> BallLoads:
        """The loads of balls."""
        return BallLoads(self.setup)

    def _functions(self, watched: list[tuple[int, str]], signs: Any) -> Any:
        """Return the function (t (n, 1), x, v) -> what is left to each event, (n, watched).

        A sliding speed over its sign, what a force that holds lacks to its limits, what lets the
        side of a slot free, what keeps locks of one freedom from giving way.
        """
        words = {word for _, word in watched}
        headings = self.sides(signs)

        def values(t: Any, x: Any, v: Any) -> Any:
            found = np.empty((len(t), len(watched)))
            moving = words & {"speed", "glide", "near"}
            speeds: Any = self._speeds(t, x, v, signs)[0] if moving else None
            held: Any = None
            low: Any = None
            high: Any = None
            if words & {"below", "above", "pressed", "slack", "pivot"}:
                _, _, held, low, high, _ = self.values(t, x, v, signs)
            for j, (k, word) in enumerate(watched):
                if word == "speed":
                    found[:, j] = speeds[:, k] * signs[k]
                elif word in ("glide", "near"):
                    own = self.glides.group(k)
                    size = np.linalg.norm(speeds[:, own], axis=1)
                    found[:, j] = (
                        speeds[:, own] @ headings[own] - TURNED * size
                        if word == "glide"
                        else size - self._rough[k] * self._fastest * self._sizes()[k]
                    )
                elif word == "slack":
                    size, limit = self.glides.holding(held, high, k)
                    found[:, j] = (limit**2 * (1 + CLOSE) - size**2) / np.maximum(limit, LEAST)
                elif word in ("sharp", "pivot"):
                    moments = held[:, self.glides.group(k)] if word == "pivot" else None
                    found[:, j] = self.balls.left(k, moments, (t, x, v, signs))
                elif word == "starts":
                    found[:, j] = self._starts(t, x, v, signs)
                elif word == "pressed":
                    top = np.maximum(high[:, self._other[k]], high[:, k])
                    self._strongest = max(
                        self._strongest, float(np.nan_to_num(top).max(initial=0.0))
                    )
                    slack = SLACK * self._strongest
                    found[:, j] = high[:, self._other[k]] - high[:, k] + slack
                else:
                    slack = CLOSE * np.maximum(np.abs(high[:, k]), np.abs(low[:, k]))
                    left = held[:, k] - low[:, k] if word == "below" else high[:, k] - held[:, k]
                    found[:, j] = left + slack
            return found

        return values

    @cached_property
    def _speeds(self) -> Any:
        k = self.kernel
        return k.batch("speeds", lambda: ca.Function("speeds", k.inputs, [k.locking(*k.inputs)[2]]))

    def _faster(self, t: Any, x: Any, v: Any, signs: Any) -> None:
        """Keep the largest speed of all slips."""
        speeds = np.abs(self._speeds(t[:, None], x, v, signs)[0]) / self._sizes()
        self._fastest = max(self._fastest, float(np.max(speeds, initial=0.0)))

    def note(self, t: float, turn: Turn, signs: Any) -> None:
        """Keep an event, unless it is one of a side of a slot that nothing presses."""
        sides = self.sides(signs)
        side = float(sides[turn.slip])
        if turn.slip in self.glides.first:
            side = 0.0 if self.glides.still(sides)[turn.slip] else 1.0
            lay = self.integrator.layout
            x, v = (turn.state[lay[name]] for name in "xv")
            fast = self.glides.spread(self.values(t, x, v, signs)[0][0] / self._sizes())
            if (
                side
                and not turn.from_rest
                and fast[turn.slip] > self._rough[turn.slip] * self._fastest
            ):
                return  # it has turned its direction alone
        if turn.slip in self._other:
            lay = self.integrator.layout
            x, v = (turn.state[lay[name]] for name in "xv")
            if side == IDLE or not self.values(t, x, v, signs)[4][0, turn.slip] > 0:
                return
        kind = "slip" if turn.from_rest else "stick"
        kind = "reversal" if side != 0 and not turn.from_rest else kind
        self.found.append((t, self.names[turn.slip], side, kind))

    def final(self, signs: Any, t: float, x: Any, v: Any) -> bool:
        """Return whether nothing moves any more: all freedoms stick and nothing depends on t."""
        setup = self.setup
        if setup.laws or setup.loads.uses_time or not self.k:
            return False
        locked = np.flatnonzero(self.glides.still(self.sides(signs)))
        along = self._along(t, x, v)
        return bool(np.linalg.matrix_rank(along[locked], RANK) == along.shape[1])

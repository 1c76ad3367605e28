"""The events of dry friction: a sliding speed vanishes, a holding force reaches its limit.

A ball has no drag about that line. Where its spin turns into it, or a moment about it acts on a
ball that sticks, the law says how large the moment of friction may be and not how large it is.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.friction_sizes import pressing
from mechdae.dynamics.integrate import Cut, Nodes, NoWay
from mechdae.dynamics.watchers.from_rest import WaysFromRest
from mechdae.dynamics.watchers.sliding import IDLE, LEAST, RANK, SLACK, Turn
from mechdae.dynamics.watchers.zeros import Looker, Sign, changes
from mechdae.equations.forces.feedback import ACROSS
from mechdae.types import Floats, Matrix, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.equations_of_motion import Kernel

SHARPEST = 1e-6
"""Square of the sine between a ball's spin and its load at which its friction is left open."""
CLOSE = 1e-13
"""Share of its limit by which a force that holds may exceed it between steps."""
STARTS = 1e-12
"""Share of the acceleration without friction from which a mechanism at rest starts."""
TURNED = 0.2
"""Cosine between a direction and its heading at which the heading is that of now."""
MOVING = ("speed", "glide", "near", "sharp")
"""What is watched of slips that slide."""
RELEASED = ("below", "above", "slack")
"""What is watched of forces that hold."""


class BallLoads:
    """Watches spins and moments of balls about the lines of their loads."""

    def __init__(self, setup: MotionProblem) -> None:
        self.setup: MotionProblem = setup
        self.kernel: Kernel = setup.kernel

    @cached_property
    def sizes(self) -> dict[int, int]:
        """Place of a ball's slip -> that of its size |t|, those of p t / |t| come after it."""
        rubbing = self.setup.released.rubbing
        laws = [feedback.law for feedback in rubbing.feedbacks]
        return {
            k: j
            for j, k in enumerate(rubbing.owners)
            if k is not None and j + 1 < len(laws) and laws[j + 1] in ACROSS
        }

    def left(self, k: int, held: object, at: tuple[Matrix, Matrix, Matrix, Floats]) -> Any:
        """Return what is left (n,) at states `at` until the law of a ball leaves its moment open.

        `held`: moments (n, 3) that hold it while it sticks; None while it turns.
        """
        sizes, forms = pressing(self.kernel)(*at)
        j = self.sizes[k]
        if held is None:
            along = (sizes[:, j + 1 : j + 4] ** 2).sum(axis=1)
            return sizes[:, j] ** 2 - SHARPEST * (sizes[:, j] ** 2 + along)
        load = forms[:, self.kernel.places[j]]
        square = (load**2).sum(axis=1)
        about = (held * load).sum(axis=1) ** 2 / np.maximum(square, LEAST)
        return SHARPEST * square * self._radius(k) ** 2 - about

    def _radius(self, k: int) -> float:
        """Return the radius of the friction circle of a ball."""
        values = self.setup.problem.mechanism.values()
        name = self.setup.released.rubbing.slips[k].owner
        f = values[f"{name}.friction"]
        return float(values[f"{name}.ball_radius"] * f / np.sqrt(1 + f * f))

    def verdict(self, name: str) -> NoWay:
        return NoWay(
            f"{name} turns about the line of its load (F6): its friction keeps it there by a "
            f"moment that its law leaves open",
            "ambiguous",
            "F6",
            joints=[name],
        )


class Sticking(WaysFromRest):
    """Watches the slips of a motion for events, see `Slips`."""

    def _starts(self, k: int, t: Floats, x: Unknowns, v: Floats, signs: Floats) -> Any:
        """Return what is left (n,) until locks that share their forces give way."""
        t = np.ravel(t)
        sides = self.sides(signs).copy()
        every = np.flatnonzero(self.glides.still(sides)).tolist()
        along = self._along(float(t[0]), x[0], v[0])
        unit = next(unit for unit in self._sharing(along, sides) if unit[0] == k)
        alone, locked = along.shape[1] == 1, np.array(unit)
        ways, worst = self._forward(along, unit), np.full(len(t), -np.inf)
        free = self.values(t, x, v, self.setup.loose)[1][:, locked]
        size = np.max(np.abs(free / self._sizes()[locked]), axis=1, initial=0.0)
        idle = np.flatnonzero(sides == IDLE) if alone else np.zeros(0, int)
        others = np.sign(np.where(np.abs(along[idle, 0]) > RANK, along[idle, 0], 0.0))
        for direction in (1.0, -1.0):
            turned = sides.copy()
            turned[locked] = direction * ways
            turned[idle] = np.where(others == 0, IDLE, direction * others)
            begun = self.signs(turned, every)
            slowest = self._slowest(turned, unit, self.values(t, x, v, begun)[1])
            strong = np.flatnonzero(self.sizes.contractions(t, x, v, begun) >= 1)
            for i in strong.tolist():  # there Newton's method finds one of them at most
                answers = self._answers(float(t[i]), x[i], v[i], begun)
                rates = np.array([found[0] for found in answers]).reshape(-1, self.k)
                slowest[i] = self._slowest(turned, unit, rates).max(initial=-np.inf)
            worst = np.maximum(worst, slowest)
        return STARTS * size - worst

    def _slowest(self, sides: Floats, unit: list[int], rates: Floats) -> Any:
        """Return the least rate (n,) of speeds of slips to their sides, over natural sizes."""
        found = rates[:, unit] * sides[unit] / self._sizes()[unit]
        for group in self.glides.groups:
            at = np.flatnonzero(np.isin(unit, group))
            found[:, at] = found[:, at].sum(axis=1, keepdims=True)
        return found.min(axis=1)

    def _sharing(self, along: Floats, sides: Floats) -> list[list[int]]:
        """Return the locked slips, those together that hold with forces that are not unique."""
        locked = np.flatnonzero(self.glides.still(sides)).tolist()
        if np.linalg.matrix_rank(along[locked], RANK) == len(locked):
            return []
        if along.shape[1] == 1:
            return [locked]
        return [unit.slips for unit in self._units(along, locked) if unit.shared]

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
        along = self._along(float(t[0]), x[0], v[0]) if self.glides.still(sides).any() else None
        watched = self._watched(sides, [] if along is None else self._sharing(along, sides))
        watched += self._nearing(float(t[0]), x[0], v[0], signs, sides)
        values = self._functions(watched, signs)
        for (k, word), value in zip(watched, values(t[:1, None], x[:1], v[:1])[0], strict=True):
            if word not in MOVING and value < 0:  # over its limit from the start
                return Turn(states[0], k, word in RELEASED, True)
        speeds = np.abs(self._speeds(t[:, None], x, v, signs)[0]) / self._sizes()
        self._fastest = max(self._fastest, float(np.max(speeds, initial=0.0)))

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
        margins = looker.values(t[:, None], x, v)[:, rows]
        fallen = (margins[:-1] > 0) & (margins[1:] <= 0)
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

    def _watched(self, sides: Floats, sharing: list[list[int]]) -> list[tuple[int, str]]:
        """Return what is watched, and what happens to a slip where it falls below zero.

        `sharing` are the locked slips whose forces are not unique, those together that start so.
        """
        found: list[tuple[int, str]] = []
        still = self.glides.still(sides)
        first = {k: unit[0] for unit in sharing for k in unit}
        for k, side in enumerate(sides.tolist()):
            if side == IDLE == sides[self._other.get(k, k)]:  # apart, or kept by a contact
                continue
            if k in self.glides.first:
                if self.glides.first[k] != k:
                    continue
                ball = [(k, "pivot" if still[k] else "sharp")] if k in self.balls.sizes else []
                if not still[k]:
                    found += [(k, "glide"), *ball]
                elif k in first:
                    found += [(k, "starts")] if first[k] == k else []
                else:
                    found += [(k, "slack"), *ball]
            elif abs(side) == 1:
                found.append((k, "speed"))
            elif k in first:
                found += [(k, "starts")] if first[k] == k else []
            elif side == IDLE and self._other[k] in first:
                continue
            else:
                found += [(k, "pressed")] if side == IDLE else [(k, "below"), (k, "above")]
        return found

    def _nearing(
        self, t: float, x: Unknowns, v: Floats, signs: Floats, sides: Floats
    ) -> list[tuple[int, str]]:
        """Return the pairs that glide and are not at rest at the beginning: they may come to it."""
        moving = [group for group in self.glides.groups if not self.glides.still(sides)[group[0]]]
        if not moving:
            return []
        at = (np.array([[t]]), x[None, :], v[None, :])
        fast = self.glides.spread(self._speeds(*at, signs)[0] / self._sizes())[0]
        least = 2 * self._rough * self._fastest
        return [(group[0], "near") for group in moving if fast[group[0]] > least[group[0]]]

    @cached_property
    def balls(self) -> BallLoads:
        return BallLoads(self.setup)

    def _functions(self, watched: list[tuple[int, str]], signs: Floats) -> Any:
        """Return the function (t (n, 1), x, v) -> what is left to each event, (n, watched).

        A sliding speed over its sign, what a force that holds lacks to its limits, what lets the
        side of a slot free, what keeps locks of one freedom from giving way.
        """
        words = {word for _, word in watched}
        headings = self.sides(signs)

        def values(t: Floats, x: Unknowns, v: Floats) -> Floats:
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
                    group = self.glides.group(k)
                    size = np.linalg.norm(speeds[:, group], axis=1)
                    found[:, j] = (
                        speeds[:, group] @ headings[group] - TURNED * size
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
                    found[:, j] = self._starts(k, t, x, v, signs)
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
        return k.batch(
            "speeds",
            lambda: ca.Function("speeds", k.inputs, [k.locking(*k.inputs)[2][: self.count]]),
        )

    def note(self, t: float, turn: Turn, before: Floats, signs: Floats) -> None:
        """Keep what an event changes: all that slip, stick or turn back in that instant."""
        sides, was = self.sides(signs), self.sides(before)
        if turn.from_rest and (sides == was).all():
            return
        still, rested = self.glides.still(sides), self.glides.still(was)
        lay = self.integrator.layout
        x, v = (turn.state[lay[name]] for name in "xv")
        speeds, _, _, _, high, _ = (part[0] for part in self.values(t, x, v, signs))
        fast = self.glides.spread(speeds / self._sizes())
        kinds: dict[str, dict[str, float]] = {}
        for k in [turn.slip, *range(self.k)]:
            side, from_rest, turned = float(sides[k]), bool(rested[k]), sides[k] != was[k]
            if k in self.glides.first:
                k = self.glides.first[k]
                side, turned = float(not still[k]), still[k] != rested[k]
                resting = fast[k] <= self._rough[k] * self._fastest
                if side and not from_rest and not resting:
                    continue  # it has turned its direction alone
            if k in self._other and (side == IDLE or not high[k] > 0):
                continue
            if k == turn.slip:
                from_rest, turned = turn.from_rest, True
            kind = "slip" if from_rest else "stick"
            kind = "reversal" if side != 0 and not from_rest else kind
            if turned and not any(self.names[k] in names for names in kinds.values()):
                kinds.setdefault(kind, {})[self.names[k]] = side
        for kind, sides_of in kinds.items():
            found = {name: sides_of[name] for name in self.names if name in sides_of}
            self.found.append((t, found, kind))

    def final(self, signs: Floats, t: float, x: Unknowns, v: Floats) -> bool:
        """Return whether nothing moves any more: all freedoms stick and nothing depends on t."""
        setup = self.setup
        if setup.laws or setup.loads.uses_time or not self.k:
            return False
        locked = np.flatnonzero(self.glides.still(self.sides(signs)))
        along = self._along(t, x, v)
        return bool(np.linalg.matrix_rank(along[locked], RANK) == along.shape[1])

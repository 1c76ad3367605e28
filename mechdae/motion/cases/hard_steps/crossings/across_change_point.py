"""Across a change point: from a proved pose before it to a pose of the same branch behind it.

The tube test of a step needs a regular Jacobian, so between two proved nodes at equal
distances from the crossing the branch is carried by its own expansion there: the prediction
behind the crossing misses the solution by far less than the two branches are apart, the
determinant has changed its sign, and Newton-Kantorovich holds from the prediction on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.kernels.bounds.walk import ROUNDOFF
from mechdae.kernels.graphs.blocks import ADJUGATE_LIMIT
from mechdae.motion.cases.hard_steps.crossings.change_points import (
    Branch,
    Crossing,
    CrossingFinder,
    Piece,
    piece,
)
from mechdae.motion.cases.hard_steps.crossings.missed import INNER
from mechdae.motion.continuation.interpolate import quintic_rates
from mechdae.motion.continuation.step_sizes import PASS
from mechdae.motion.setup.scales import Constants
from mechdae.numerics.null_space import solve
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Points, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.steps import Graphs

TOGETHER = 1e-9
"""Distance within which two blocks are said to cross at the same pose, in largest steps."""
MISS = 0.02
"""Share of the distance of the branches by which the prediction may miss its own."""
CLOSE = 1e-3
"""Share by which an expansion of such branches may miss a solved pose at its end."""
H_LIMIT = 0.2
SAMPLED = (1 / 3, 2 / 3)
"""Where, in parts of the way from a node to the crossing, the interpolant is compared."""
UNSEEN = 2.0
"""Factor from the largest difference at these places to the largest one in between: that of a
quintic is K t^3 (1 - t)^3, at t = 1/2 1.42 times what it is at 1/3 and 2/3."""


@dataclass(frozen=True, eq=False)
class Zone:
    """The neighbourhood of a change point where poses come from the branch's expansion.

    ``nodes`` are s, x, x', x'' before, at and behind it, s rising; ``remainder`` (nx,) is by how
    much interpolated unknowns of the crossing blocks may miss solved ones; ``action`` is what
    the path does there: continue, switch or stop; ``up`` tells whether it came with s rising.
    """

    s: float
    crossings: tuple[Crossing, ...]
    nodes: tuple[Floats, ...]
    remainder: Floats
    action: str
    up: bool

    @property
    def low(self) -> float:
        return float(self.nodes[0][0])

    @property
    def high(self) -> float:
        return float(self.nodes[0][-1])

    def sides(self, s: Floats) -> Floats:
        """Return places on one side of a switch: none between its two nodes, a hair apart."""
        S = self.nodes[0]
        if len(S) < 4:
            return s
        behind = S[2] if S[1] == self.s else S[1]
        return np.where((s > S[1]) & (s < S[2]), behind, s)

    @property
    def decided(self) -> bool:
        """Whether it is known for the numbers given where the path goes."""
        return self.action == PASS or all(crossing.exact for crossing in self.crossings)

    @property
    def given(self) -> tuple[float, float]:
        """The interval in which poses come from the expansion.

        Branches that only come near each other bend away from it, and before such a place the
        equations still decide; behind it no pose is ok. Branches known to pass each other have an
        expansion of their own.
        """
        if self.action == PASS:
            (crossing,) = self.crossings
            inner = INNER * crossing.missed.unit if crossing.missed else 0.0
            return max(self.low, self.s - inner), min(self.high, self.s + inner)
        if self.decided:
            return self.low, self.high
        return (self.s, self.high) if self.up else (self.low, self.s)

    def carried(self, s: Floats, columns: list[int]) -> list[Floats]:
        """Return x, x', x'' (n, nx) at places (n,); the crossing block's unknowns are `columns`."""
        S, X, V, A = self.nodes
        found = quintic_rates(S, X, V, A, self.sides(s))
        if self.action == PASS:
            (crossing,) = self.crossings
            for part, passed in zip(found, passing(crossing, s, self.up), strict=True):
                part[:, columns] = passed
        return found

    @property
    def blocks(self) -> frozenset[int]:
        return frozenset(crossing.block for crossing in self.crossings)


@dataclass(frozen=True, eq=False)
class Bridge:
    """A way across: nodes (s, state) in the order of travel, the zone, flipped blocks."""

    nodes: tuple[tuple[float, Any], ...]
    zone: Zone
    flipped: tuple[int, ...]


class Builder:
    """Builds bridges for a path.

    Parameters
    ----------
    finder
        Finds the change points.
    step
        The path's (state, s, ds) -> state, test, det, miss.
    constants
        Bounds of the scene: Lipschitz constants of the blocks' Jacobians.
    weights
        Units of the blocks' unknowns.
    """

    def __init__(
        self,
        finder: CrossingFinder,
        step: Callable[..., tuple[Floats, ...]],
        constants: Constants,
        weights: list[Floats],
    ) -> None:
        self.finder: CrossingFinder = finder
        self.step: Callable[..., tuple[Floats, ...]] = step
        self.kappa: Floats = constants.kappa
        self.rho: Floats = constants.rho
        self.weights: list[Floats] = weights
        self.graphs: Graphs = finder.graphs

    def build(
        self,
        crossing: Crossing,
        s: float,
        state: Floats,
        sign: Floats,
        alive: Booleans,
        action: str,
    ) -> Bridge | None:
        """Return the bridge from the proved node `state` at `s`, None where it does not hold.

        A path that would `switch` to a branch on which the driver stands still stops; so it does
        where a block crosses together with one it hangs on: with that one switched it comes from
        another side, and which of its branches is the other one is not told by the way it came.
        """
        g, n = self.graphs, self.graphs.nx
        sense = np.sign(crossing.s - s)
        seen = self._seen_from(crossing, s, state, sense)
        if seen is None:
            return None
        crossing = seen
        distance = abs(crossing.s - s)
        far = crossing.s + sense * distance
        _, test, det, miss = self.step(state, s, 2 * sense * distance)
        with np.errstate(invalid="ignore"):
            proved = (test <= 1) & (miss <= 1) & (np.sign(det) == sign)
        crossings, known = self._together(crossing, s, state, sense, proved, alive)
        if crossings is None:
            return None
        blocks = [c.block for c in crossings]
        touched = [bool(set(g.ancestors(b)) & set(blocks)) for b in range(g.nb)]
        if any(alive[b] and not touched[b] and not proved[b] for b in range(g.nb)):
            return None
        living = [b for b in range(g.nb) if alive[b]]
        before = self._centre(living, crossing.s, state, s, known)
        after = before
        serial = any(one in g.ancestors(b) for b in blocks for one in blocks if one != b)
        if action == PASS and len(crossings) > 1:
            return None
        if action == "switch" and (serial or any(c.other is None for c in crossings)):
            action = "stop"
        switch = action in ("switch", PASS)
        guess = np.array(piece(s, crossing.s, _parts(state, n), before)(far)[0])
        if switch:
            known = {c.block: _taylor(c.s, c.x, c.other) for c in crossings if c.other}
            after = self._centre(living, crossing.s, state, s, known)
            ds = far - crossing.s
            guess = after[0] + after[1] * ds + after[2] * ds * ds / 2
        found = self._behind(guess, far)
        if found is None:
            return None
        landed, signs, h = found
        flipped = () if switch else tuple(b for b in blocks if self._signed(b))
        expected = sign.copy()
        expected[list(flipped)] *= -1
        moved = np.abs(landed[:n] - guess)
        for b in living:
            if signs[b] != expected[b] or not h[b] <= H_LIMIT:
                return None
        for c in crossings:
            if not self._misses(c, moved[g.blocks[c.block].own]) <= MISS * distance:
                return None
        if action == PASS:
            remainder = self._passed(crossings[0], before, sense)
        else:
            ends = (s, state, before), (far, landed, after)
            remainder = self._remainder(crossings, crossing.s, *ends)
        if remainder is None:
            return None
        centre = [(crossing.s, self._state(before, state))]
        if switch:
            hair = 4 * np.spacing(max(abs(crossing.s), self.finder.unit))
            centre.append((float(crossing.s + sense * hair), self._state(after, state)))
        nodes = [(s, state), *centre, (far, landed)][:: int(sense)]
        places = np.array([place for place, _ in nodes])
        parts = [np.array([_parts(node, n)[k] for _, node in nodes]) for k in range(3)]
        zone = Zone(
            crossing.s, tuple(crossings), (places, *parts), remainder, action, bool(sense > 0)
        )
        return Bridge((*centre, (far, landed)), zone, flipped)

    def _remainder(
        self,
        crossings: list[Crossing],
        centre: float,
        near: tuple[float, Floats, tuple[Floats, Floats, Floats]],
        far: tuple[float, Floats, tuple[Floats, Floats, Floats]],
    ) -> Any:
        """Return by how much interpolated unknowns (nx,) may miss solved ones.

        Between the nodes `near` and `far` (s, state, unknowns at the centre). None where that is
        more than rounding at branches that cross.
        """
        g, n = self.graphs, self.graphs.nx
        (s, state, before), (end, landed, after) = near, far
        blocks = [c.block for c in crossings]
        first = piece(s, centre, _parts(state, n), before)
        second = piece(centre, end, after, _parts(landed, n))
        remainder = np.zeros(n)
        noise = np.maximum(self._noise(blocks, state, s), self._noise(blocks, landed, end))
        for c in crossings:
            unknowns = g.blocks[c.block].own
            missed = np.maximum(
                self._missed(first, s, centre, unknowns),
                self._missed(second, end, centre, unknowns),
            )
            if c.exact and not np.all(missed <= noise[unknowns]):
                return None  # otherwise no pose counts: branches that only come near bend away
            remainder[unknowns] = missed
        return remainder

    def _passed(
        self, crossing: Crossing, middle: tuple[Floats, Floats, Floats], sense: float
    ) -> Any:
        """Return by how much expansions of branches that pass each other may miss them (nx,).

        They are compared with solved poses where they end, with unknowns of the `middle` as first
        guesses of all others.
        """
        n, g, missed = self.graphs.nx, self.graphs, crossing.missed
        remainder, unknowns = np.zeros(n), g.blocks[crossing.block].own
        if missed is None or crossing.other is None:
            return None
        bent = np.abs(crossing.own.bend) + np.abs(crossing.other.bend)
        gap = missed.across * np.abs(missed.v)
        remainder[unknowns] = bent * (missed.across * missed.unit) ** 2 + gap * missed.across
        for side in (-1.0, 1.0):
            place = crossing.s + side * INNER * missed.unit
            there = passing(crossing, np.array([place]), sense > 0)[0][0]
            guess = middle[0] + middle[1] * (place - crossing.s)
            guess[unknowns] = there
            start = np.concatenate([guess, np.zeros(2 * n + g.nb)])
            solved = self.step(start, place, 0.0)[0][unknowns]
            if not np.all(np.abs(solved - there) <= CLOSE * np.max(np.abs(gap) + INNER)):
                return None
            remainder[unknowns] = np.maximum(remainder[unknowns], 2 * np.abs(solved - there))
        return remainder

    def _signed(self, b: int) -> bool:
        """Return whether a block's determinant changes its sign at a crossing."""
        graph = self.graphs.blocks[b]
        return graph.size <= ADJUGATE_LIMIT and not graph.redundant

    def _misses(self, crossing: Crossing, moved: Floats) -> float:
        """Return a distance of its block's unknowns as one along the driver.

        It is where the two branches of the crossing are as far apart.
        """
        size = self.finder.columns(crossing.block)
        if crossing.other is not None:
            apart = crossing.own.slope - crossing.other.slope
        else:
            apart = crossing.still / self.finder.unit
        return float(np.max(np.abs(moved) / size) / np.max(np.abs(apart) / size))

    def _seen_from(
        self, crossing: Crossing, s: float, state: Floats, sense: float
    ) -> Crossing | None:
        """Return a crossing whose branch leads back to the node at s, None if it does not.

        What was found from further away may be whole turns off, or on the other branch.
        """
        if self._leads_to(crossing, s, state):
            return crossing
        again = self.finder.find(crossing.block, s, state, sense, {})
        if again is None or not again.passable or not self._leads_to(again, s, state):
            return None
        return again

    def _leads_to(self, crossing: Crossing, s: float, state: Floats) -> bool:
        x = state[self.graphs.blocks[crossing.block].own]
        moved = _taylor(crossing.s, crossing.x, crossing.own)(s)[0] - x
        return self._misses(crossing, moved) <= MISS * abs(s - crossing.s)

    def _noise(self, blocks: list[int], state: Floats, s: float) -> Floats:
        """Return bounds (nx,) of what rounding does to the unknowns of some blocks at a node.

        After many turns the last bits of the unknowns themselves, and of the place, count.
        """
        g, n = self.graphs, self.graphs.nx
        x, v, _ = _parts(state, n)
        u, p, error = self.finder.u(s), self.finder.p, 8 * ROUNDOFF * (np.abs(x) + np.abs(v * s))
        for b in sorted({k for block in blocks for k in g.ancestors(block)}):
            graph = g.blocks[b]
            _, J, Fz = graph.value_at(x, u, p)
            error[graph.own] += state[3 * n + b] * self.rho[b] * self.weights[b]
            if graph.uses:
                error[graph.own] += np.abs(solve(J, Fz)) @ error[graph.uses]
        return error

    def _missed(self, carried: Piece, s: float, centre: float, unknowns: list[int]) -> Floats:
        """Return by how much an interpolant between s and a crossing may miss the solution.

        It is compared with poses that are solved for. The whole piece must be looked at: on an
        odd branch (a parallelogram's) the errors of both sides cancel at the crossing.
        """
        n, g = self.graphs.nx, self.graphs
        worst = np.zeros(len(unknowns))
        for share in SAMPLED:
            place = s + share * (centre - s)
            guess = carried(place)[0]
            start = np.concatenate([guess, np.zeros(2 * n + g.nb)])
            solved = self.step(start, place, 0.0)[0][:n]
            worst = np.fmax(worst, np.abs(solved - guess)[unknowns])
            worst[~np.isfinite(solved[unknowns])] = np.inf
        return UNSEEN * worst

    def _together(
        self,
        crossing: Crossing,
        s: float,
        state: Floats,
        sense: float,
        proved: Booleans,
        alive: Booleans,
    ) -> tuple[list[Crossing] | None, dict[int, Piece]]:
        """Return the crossings of all blocks at the pose of the first, None for others nearby."""
        g, n = self.graphs, self.graphs.nx
        found: list[Crossing] = []
        known: dict[int, Piece] = {}
        for b in range(g.nb):
            if not alive[b] or (proved[b] and b != crossing.block):
                continue
            each = crossing if b == crossing.block and not known else None
            each = each or self.finder.find(b, s, state, sense, known)
            if each is None:
                continue
            if abs(each.s - crossing.s) > TOGETHER * self.finder.largest:
                if abs(each.s - crossing.s) < 2 * abs(crossing.s - s):
                    return None, {}
                continue
            if not each.passable or not self._leads_to(each, s, state):
                return None, {}
            found.append(each)
            unknowns = g.blocks[b].own
            at_s = tuple(part[unknowns] for part in _parts(state, n))
            known[b] = piece(s, crossing.s, at_s, (each.x, each.own.slope, each.own.bend))
        return found, known

    def _centre(
        self, living: list[int], place: float, state: Floats, s: float, known: Mapping[int, Piece]
    ) -> tuple[Floats, Floats, Floats]:
        x, v, a = _parts(state, self.graphs.nx)
        ds = place - s
        return self.finder.follow(living, place, x + v * ds + a * ds * ds / 2, known)[:3]

    def _behind(self, guess: Unknowns, s: float) -> tuple[Floats, Floats, Floats] | None:
        """Return state, signs and Newton-Kantorovich numbers of the solution at `guess`."""
        g, n = self.graphs, self.graphs.nx
        start = np.concatenate([guess, np.zeros(2 * n + g.nb)])
        after, _, det, _ = self.step(start, s, 0.0)
        if not np.all(np.isfinite(after[:n])):
            return None
        moved = np.abs(after[:n] - guess)
        beta = after[3 * n :]
        h = np.zeros(g.nb)
        for b, graph in enumerate(g.blocks):
            h[b] = self.kappa[b] * beta[b] * np.linalg.norm(moved[graph.own] / self.weights[b])
        return after, np.sign(det), h

    def _state(self, parts: tuple[Floats, Floats, Floats], like: Floats) -> Floats:
        """Return a node that interpolates but cannot be stepped from: beta is infinite."""
        return np.concatenate([*parts, np.full(len(like) - 3 * self.graphs.nx, np.inf)])


def passing(crossing: Crossing, s: Floats, up: bool) -> tuple[Points, Points, Points]:
    """Return x, x', x'' (n, m) of a block near a crossing that its branches miss, at places (n,).

    They are the expansions of the asymptotes, and what the branch is off them; `up` tells
    whether it comes with s rising.
    """
    missed, other = crossing.missed, crossing.other
    if missed is None or other is None:
        raise ValueError("branches that meet")
    sense = 1.0 if up else -1.0
    ds = np.asarray(s, float) - crossing.s
    side = missed.side(crossing.own.slope, sense)
    behind = (ds >= 0 if up else ds < 0)[:, None]
    slope = np.where(behind, other.slope, crossing.own.slope)
    bend = np.where(behind, other.bend, crossing.own.bend)
    off = [missed.from_asymptote(ds, side, order)[:, None] * missed.v for order in range(3)]
    ds = ds[:, None]
    x = crossing.x + slope * ds + bend * ds * ds / 2 + off[0]
    return x, slope + bend * ds + off[1], bend + off[2]


def _parts(state: Floats, n: int) -> tuple[Floats, Floats, Floats]:
    return state[:n], state[n : 2 * n], state[2 * n : 3 * n]


def _taylor(s: float, x: Unknowns, branch: Branch) -> Piece:
    def at(place: float) -> tuple[Floats, Floats, Floats, Floats]:
        ds = place - s
        slope, bend = branch.slope, branch.bend
        return x + slope * ds + bend * ds * ds / 2, slope + bend * ds, bend, np.zeros(len(x))

    return at

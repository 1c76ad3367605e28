"""Across a change point: from a proved pose before it to a pose of the same branch behind it.

The tube test of a step needs a regular Jacobian, so between two proved nodes at equal
distances from the crossing the branch is carried by its own expansion there: the prediction
behind the crossing misses the solution by far less than the two branches are apart, the
determinant has changed its sign, and Newton-Kantorovich holds from the prediction on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.analysis.crossings import Branch, Crossing, CrossingFinder, Piece, piece
from mechdae.analysis.numbers import Constants
from mechdae.kernels.blocks import ADJUGATE_LIMIT

ZONE = 0.35
"""Distance from the crossing at which its expansion takes over, in largest steps."""
TOGETHER = 1e-9
"""Distance within which two blocks are said to cross at the same pose, in largest steps."""
MISS = 0.02
"""Share of the distance of the branches by which the prediction may miss its own."""
H_LIMIT = 0.2


@dataclass(frozen=True, eq=False)
class Zone:
    """The neighbourhood of a change point where poses come from the branch's expansion.

    ``nodes`` are s, x, x', x'' before, at and behind it, s rising; ``remainder`` (nx,) estimates
    the error of interpolated unknowns; ``action`` is what the path does there: continue, switch
    or stop.
    """

    s: float
    crossings: tuple[Crossing, ...]
    nodes: tuple[Any, ...]
    remainder: Any
    action: str

    @property
    def low(self) -> float:
        return float(self.nodes[0][0])

    @property
    def high(self) -> float:
        return float(self.nodes[0][-1])

    def sides(self, s: Any) -> Any:
        """Return places on one side of a switch: none between its two nodes, a hair apart."""
        S = self.nodes[0]
        if len(S) < 4:
            return s
        behind = S[2] if S[1] == self.s else S[1]
        return np.where((s > S[1]) & (s < S[2]), behind, s)

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
        self, finder: CrossingFinder, step: Any, constants: Constants, weights: Any
    ) -> None:
        self.finder, self.step = finder, step
        self.kappa, self.weights = constants.kappa, weights
        self.graphs = finder.graphs

    def build(
        self,
        crossing: Crossing,
        s: float,
        state: Any,
        sign: Any,
        alive: Any,
        action: str,
    ) -> Bridge | None:
        """Return the bridge from the proved node `state` at `s`, None where it does not hold.

        A path that would `switch` to a branch on which the driver stands still stops.
        """
        g, n = self.graphs, self.graphs.nx
        sense = np.sign(crossing.s - s)
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
        carried = self._carried(s, state, crossing.s, before)
        remainder = np.zeros(n)
        after = before
        if action == "switch" and any(c.other is None for c in crossings):
            action = "stop"
        switch = action == "switch"
        guess = np.array(carried(far)[0])
        continued = self._behind(guess, far)
        if continued is None:
            return None
        middle = piece(s, far, _parts(state, n), _parts(continued[0], n))(crossing.s)[0]
        remainder = np.abs(middle - before[0]) / 16
        if switch:
            known = {c.block: _taylor(c.s, c.x, c.other) for c in crossings if c.other}
            after = self._centre(living, crossing.s, state, s, known)
            ds = far - crossing.s
            guess = after[0] + after[1] * ds + after[2] * ds * ds / 2
            found = self._behind(guess, far)
            if found is None:
                return None
            continued = found
        landed, signs, h = continued
        flipped = () if switch else tuple(b for b in blocks if self._signed(b))
        expected = sign.copy()
        expected[list(flipped)] *= -1
        moved = np.abs(landed[:n] - guess)
        for b in living:
            if signs[b] != expected[b] or not h[b] <= H_LIMIT:
                return None
        for c in crossings:
            own = g.blocks[c.block].own
            apart = (
                c.own.slope - c.other.slope if c.other is not None else c.still / self.finder.unit
            )
            if not np.max(moved[own] / self._size(c)) <= MISS * distance * np.max(
                np.abs(apart) / self._size(c)
            ):
                return None
        centre = [(crossing.s, self._state(before, state))]
        if switch:
            hair = 4 * np.spacing(max(abs(crossing.s), self.finder.unit))
            centre.append((float(crossing.s + sense * hair), self._state(after, state)))
        nodes = [(s, state), *centre, (far, landed)][:: int(sense)]
        places = np.array([place for place, _ in nodes])
        parts = [np.array([_parts(node, n)[k] for _, node in nodes]) for k in range(3)]
        zone = Zone(crossing.s, tuple(crossings), (places, *parts), remainder, action)
        return Bridge((*centre, (far, landed)), zone, flipped)

    def _signed(self, b: int) -> bool:
        """Return whether a block's determinant changes its sign at a crossing."""
        graph = self.graphs.blocks[b]
        return graph.size <= ADJUGATE_LIMIT and not graph.redundant

    def _size(self, crossing: Crossing) -> Any:
        return self.finder.columns(crossing.block)

    def _together(
        self, crossing: Crossing, s: float, state: Any, sense: float, proved: Any, alive: Any
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
            if not each.meant:
                return None, {}
            found.append(each)
            own = g.blocks[b].own
            at_s = tuple(part[own] for part in _parts(state, n))
            known[b] = piece(s, crossing.s, at_s, (each.x, each.own.slope, each.own.bend))
        return found, known

    def _centre(
        self, living: list[int], place: float, state: Any, s: float, known: Mapping[int, Piece]
    ) -> tuple[Any, Any, Any]:
        x, v, a = _parts(state, self.graphs.nx)
        ds = place - s
        return self.finder.follow(living, place, x + v * ds + a * ds * ds / 2, known)[:3]

    def _carried(self, s: float, state: Any, place: float, centre: Any) -> Piece:
        return piece(s, place, _parts(state, self.graphs.nx), centre)

    def _behind(self, guess: Any, s: float) -> tuple[Any, Any, Any] | None:
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

    def _state(self, parts: Any, like: Any) -> Any:
        """Return a node that interpolates but cannot be stepped from: beta is infinite."""
        return np.concatenate([*parts, np.full(len(like) - 3 * self.graphs.nx, np.inf)])


def _parts(state: Any, n: int) -> tuple[Any, Any, Any]:
    return state[:n], state[n : 2 * n], state[2 * n : 3 * n]


def _taylor(s: float, x: Any, branch: Branch) -> Piece:
    def at(place: float) -> tuple[Any, Any, Any, Any]:
        ds = place - s
        slope, bend = branch.slope, branch.bend
        return x + slope * ds + bend * ds * ds / 2, slope + bend * ds, bend, np.zeros(len(x))

    return at


__all__ = ["Bridge", "Builder", "Zone"]

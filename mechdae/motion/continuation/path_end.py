"""One end of a path: its proved steps, and the groups that can be followed no further."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.series_steps import Stretch
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.motion.continuation.limit_positions import Limit

SMALLEST = 1e-9
SHRUNK = 1 / 32
"""Share of the largest step below which a limit position is looked for."""
LONGER = 4.0
"""Times a step that is not proved around its tangent, that one around the series must have."""
PARTS = 4
"""Nodes that a step around the series leaves behind."""


class Front:
    """The upper or the lower end of a path.

    Attributes
    ----------
    sense : float
        1 upwards, -1 downwards.
    ended : set of int
        Groups that go no further there.
    """

    def __init__(self, path: Path, up: bool) -> None:
        self.path, self.up, self.sense = path, up, 1.0 if up else -1.0
        ends = {i: reach.high if up else reach.low for i, reach in path.reach.items()}
        self.ended = {i for i, end in ends.items() if end}

    @property
    def s(self) -> float:
        """Place of the last node."""
        return self.path.s[-1] if self.up else self.path.s[0]

    @property
    def state(self) -> Floats:
        """The last node."""
        return self.path.state[-1] if self.up else self.path.state[0]

    @property
    def x(self) -> Any:
        """Unknowns (nx,) of the last node."""
        return self.state[: self.path.graphs.nx]

    @property
    def alive(self) -> Any:
        """Which blocks belong to groups that have not ended."""
        return self.path.alive(self.ended)

    @property
    def sign(self) -> Floats:
        """Signs of the blocks' determinants."""
        return self.path.front[self.up]

    def append(self, s: float, state: Floats) -> None:
        """Put a node behind the last one."""
        self.path.append(s, state, self.up)

    def step(self, step: float) -> tuple[Any, Any]:
        """Return the state after a step, and which blocks (nb,) it is proved for."""
        path, ds = self.path, self.sense * step
        after, test, det, miss = path.step(self.state, self.s, ds)
        if path.quintics is None:
            return after, path.proved(after, test, det, miss, self.sign)
        places, tests = np.array([self.s, self.s + ds]), (test[None], det[None], miss[None])
        return after, path.proved_between(places, self.state, after[None], tests, self.sign)[0]

    def end(self, limit: Limit) -> None:
        """Record that a group, and the groups attached to it, go no further."""
        for index in self.path.hanging(limit.group) - self.ended:
            self.ended.add(index)
            if self.up:
                self.path.reach[index].high = limit
            else:
                self.path.reach[index].low = limit

    def leave_curves(self) -> None:
        """End groups whose contact left an open curve since the last call."""
        curves = self.path.curves
        for limit in curves.left(self.path, self.up) if curves is not None else ():
            for index in self.path.hanging(limit.group):
                reach = self.path.reach[index]
                if self.up and (reach.high is None or reach.high.s > limit.s):
                    reach.high = limit
                elif not self.up and (reach.low is None or reach.low.s < limit.s):
                    reach.low = limit
                self.ended.add(index)

    def walk(self, to: float) -> bool:
        """Follow the path to `to` in proved steps; return whether it was reached, nearly."""
        path, sense, alive = self.path, self.sense, self.alive
        step = sense * (to - self.s)
        while (rest := sense * (to - self.s)) > SMALLEST * path.largest:  # less would be rounding
            step = min(step, rest)
            after, proved = self.step(step)
            if proved[alive].all():
                path.counts.steps += 1
                self.append(to if step == rest else self.s + sense * step, after)
            else:
                path.counts.rejected += 1
                step /= 2
                weak = SHRUNK * path.patience * rest
                if step < weak and self.stretched(LONGER * step, rest, to):
                    step = sense * (to - self.s)
                elif step < 1e-3 * rest or self.s + sense * step == self.s:
                    return False
        return True

    # -- steps around a power series ---------------------------------------------------------

    def stretched(self, least: float, rest: float, goal: float | None) -> float:
        """Take a step around the path's power series; return its length, 0 where none holds."""
        longest = min(rest, self.path.largest)
        found = self._expanded(self.sense * longest, min(least, longest))
        if found is None:
            return 0.0
        whole = abs(found.step) == rest
        places = self.s + found.step * np.arange(1, PARTS + 1) / PARTS
        if whole and goal is not None:
            places[-1] = goal
        nodes = []
        for place in places.tolist():
            node = self._on(found, place)
            if node is None:
                return 0.0
            nodes.append((place, node))
        for node in nodes:
            self.append(*node)
        self.path.counts.steps += 1
        return abs(found.step)

    def _expanded(self, step: float, least: float) -> Stretch | None:
        """Return a stretch of the path from the last node, of at most `step`, or None."""
        path, state = self.path, self.state
        known, gone = state[3 * path.graphs.nx :], np.abs(self.x) > path.far / 2
        if path.graphs.course is not None or gone.any() or not np.isfinite(known).all():
            return None  # a law, a pole, or a node that cannot be stepped from
        u, d, *_ = path.motion(self.s)
        blocks = np.flatnonzero(self.alive).tolist()
        return path.expansion.stretch(state, self.s, u, d, step, least, blocks)

    def _on(self, found: Stretch, place: float) -> Any:
        """Return the node at a place of a stretch, None where it is not certified."""
        path, alive, n = self.path, self.alive, self.path.graphs.nx
        guess = found.at((place - found.s) / found.step)
        start = np.concatenate([guess, np.zeros(2 * n + path.graphs.nb)])
        state, test, det, _ = path.step(start, place, 0.0)
        own = np.concatenate([path.graphs.blocks[b].own for b in np.flatnonzero(alive)])
        near = np.abs(state[:n] - guess) <= found.radius * (1 + 1e-6) + 1e-300
        proved = path.proved(state, test, det, np.zeros(len(test)), self.sign)
        return state if near[own].all() and proved[alive].all() else None

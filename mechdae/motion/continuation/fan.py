"""Straight lines from one pose to many values of the drivers, all of them stepped at once."""

from __future__ import annotations

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.legs import SHORT, Legs, largest_step, later, resized
from mechdae.motion.setup.scales import Constants
from mechdae.types import Booleans, Floats, Points, Unknowns

SMALLEST = 2.0**-14
"""Share of a largest step below which a line is given up: a limit or a change point is near."""


class Fan(Legs):
    """A path that begins again at its first corner for each other one.

    Steps of all lines are taken together, each line with its own; nothing is crossed that the
    drivers do not tell the way past. Lines of contacts on curves and of long chains are followed
    one by one. Corner k + 1 is reached on line k.

    Attributes
    ----------
    reached : (m, groups) array of bool
        Which groups come to each corner.
    """

    def __init__(
        self, graphs: Graphs, constants: Constants, corners: Floats, scales: Floats
    ) -> None:
        super().__init__(graphs, constants, corners, scales)
        self.directions: Points = corners[1:] - corners[0]
        self._advance: Batch = graphs.cache("steps", lambda: Batch(graphs.advance))
        self.reached: Booleans = np.ones((len(corners), len(self.groups)), bool)

    def walk(self, x: Unknowns) -> None:
        """Follow all lines from the solved pose `x` (nx,) at the first corner."""
        self._begin(x)
        if not self.followed:
            self.nodes[:] = self.nodes[0]
        elif self.curves is None and self.leg.quintics is None:
            self._together()
        else:
            for k in range(len(self.directions)):
                self._by_itself(k)

    def _together(self) -> None:
        """Step all lines at once."""
        lines, n = len(self.directions), self.graphs.nx
        whole = np.tile(self.whole, (lines, 1))
        whole[:, -self.graphs.nu :] = self.directions
        state, *_ = self._advance(np.tile(self._state, (lines, 1)), np.zeros((lines, 2)), whole)
        largest = largest_step(self.directions, self.scales)
        place, step = np.zeros(lines), np.minimum(SHORT * largest, 1.0)
        left, least, size = np.arange(lines), SMALLEST * largest, np.abs(state[:, :n])
        while left.size:
            ds = np.minimum(step[left], 1.0 - place[left])
            ds = (place[left] + ds) - place[left]
            steps = np.stack([place[left], ds], axis=1)
            after, test, det, miss = self._advance(state[left], steps, whole[left])
            good = self.proved(after, test, det, miss, self.sign).all(axis=1)
            held = left[good]
            state[held], place[held] = after[good], place[held] + ds[good]
            size[held] = np.maximum(size[held], np.abs(after[good, :n]))
            worst = test.max(axis=1)
            step[left] = resized(ds, np.where(good | (worst > 1), worst, np.inf))
            self.counts.steps += len(held)
            left = left[(place[left] < 1.0) & (step[left] >= least[left])]
        done = place >= 1.0
        self.nodes[1:][done] = state[done, :n]
        self.reached[1:] = done[:, None]
        self._grown(size[done].max(axis=0, initial=0.0))

    def _by_itself(self, k: int) -> None:
        """Follow line `k` in steps as long as its proof allows, past what lies on it."""
        leg = self.leg
        leg.redirect(self.corners[0], self.directions[k], self._largest(k))
        leg.begin(self.nodes[0], 0.0)
        extend(leg, 1.0)
        self._note(leg.on_curves())
        self._grown(leg.sizes()[0])
        self.nodes[k + 1] = leg.state[-1][: self.graphs.nx]
        self.zones += [later(zone, k) for zone in leg.zones]
        self._signs[k + 1] = leg.sign_at(np.array(leg.s[-1:]))[0]
        for column, group in enumerate(self.groups):
            self.reached[k + 1, column] = leg.reach[group].high is None

    def follows(self, s: Floats) -> Booleans:
        """Return which groups come to the corners `s` (n,): (n, groups)."""
        found: Booleans = self.reached[np.asarray(s, int)]
        return found.copy()

"""Straight legs in the drivers' values from corner to corner, every one of them proved.

Short legs are taken many in one call of the sequential kernel, two steps each: one of no
length that turns the state into the leg's direction, one to its end. A leg that is not
proved in one step is followed like any other path.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.kernels.graphs.steps import STRIDE, Graphs
from mechdae.kernels.run.functions import Batch
from mechdae.motion.continuation.any_path import AnyPath, Counts, Reach
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.setup.scales import Constants
from mechdae.types import Booleans, Floats, Matrix, Points, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.cases.hard_steps.crossings.across_change_point import Zone

SHORT = 8.0
"""Legs longer than so many largest steps are not tried in one step."""


SAFE, LEAST = 0.9, 0.2
"""Share of a step that is just proved which is tried next, and tests from which steps double."""
SHARE = 2 * np.pi / NODES_PER_TURN
"""Largest step, in radians or what counts as one."""


def largest_step(d: Floats, scales: Floats) -> Floats:
    """Return the largest steps in s along u0 + s d, 0 <= s <= 1, for d (.., nd)."""
    steps: Floats = SHARE / np.maximum(np.max(np.abs(d) / scales, axis=-1), SHARE)
    return steps


def resized(step: Any, test: Any) -> Any:
    """Return steps to try after some whose largest `test` of a block is known, see `advance`.

    Tests grow with the step, or with its square: half as long at least, at most twice as long.
    """
    return step * np.fmax(SAFE / np.sqrt(np.maximum(test, LEAST)), 0.5)


class Legs(AnyPath):
    """A path through given drivers' values; s counts the corners, whole numbers are corners.

    Parameters
    ----------
    graphs, constants
        Functions and numbers of a scene that moves along straight lines.
    corners : (m, nd) array
        Drivers' values.
    scales : (nd,) array
        What counts as one radian of each driver.
    """

    def __init__(
        self, graphs: Graphs, constants: Constants, corners: Floats, scales: Floats
    ) -> None:
        nothing = np.zeros(corners.shape[1])
        whole = np.concatenate([constants.consts, corners[0], nothing])
        super().__init__(graphs, constants, whole, 1.0, Counts())
        self.corners: Floats = corners
        self.scales: Floats = scales
        self.directions: Floats = np.diff(corners, axis=0)
        self.leg: Path = Path(graphs, constants, corners[0], nothing, 1.0, self.counts, within=True)
        self.ended: set[int] = set()
        self._sizes = np.zeros(graphs.nx)
        self._visited: list[tuple[Any, Any]] = []

    def _begin(self, x: Unknowns) -> None:
        """Put the first corner: a solved pose `x` (nx,)."""
        self.origin: tuple[float, Floats] = (0.0, x)
        self.leg.begin(x, 0.0)
        self.sign: Floats = self.leg.sign
        self._signs = np.repeat(self.sign[None, :], len(self.corners), axis=0)
        self.nodes: Floats = np.empty((len(self.corners), self.graphs.nx))
        self.nodes[0] = self.leg.state[0][: self.graphs.nx]
        self._state = self.leg.state[0]

    def walk(self, x: Unknowns) -> None:
        """Follow all legs from the solved pose `x` (nx,) at the first corner."""
        self._begin(x)
        k = 0
        while k < len(self.directions):
            if self.followed <= self.ended:
                self.nodes[k + 1 :] = self.nodes[k]
                return
            k += self._short(k) or self._long(k)

    def _largest(self, k: int) -> float:
        """Return the largest step of a leg in its own parameter, 0 to 1."""
        return float(largest_step(self.directions[k], self.scales))

    def _short(self, k: int) -> int:
        """Take the next legs in one step each; return how many were proved."""
        if self._largest(k) * SHORT < 1 or not self.graphs.nx or (self.curves and self.curves.open):
            return 0
        count = min(STRIDE // 2, len(self.directions) - k)
        whole = np.tile(self.whole, (STRIDE, 1))
        lines = whole[:, -2 * self.graphs.nu :].reshape(STRIDE // 2, 2, -1)
        lines[:count] = np.hstack([self.corners, self._padded])[k : k + count, None]
        lines[count:] = np.concatenate([self.corners[k + count], 0 * self.corners[0]])
        along = np.tile([0.0, 1.0], STRIDE // 2)
        states, test, det, miss = self.graphs.strides(self._state, 0.0, along, whole)
        alive = self.alive(self.ended)
        good = self.good(states, test, det, miss, alive, self._signs[k])
        good = good.reshape(-1, 2).all(axis=1)[:count]
        held = count if good.all() else int(np.argmin(good))
        ends = states[1 : 2 * held : 2, : self.graphs.nx]
        self.nodes[k + 1 : k + 1 + held] = ends
        self.counts.steps += held
        if held:
            self._state = states[2 * held - 1]
            corners = np.arange(k + 1, k + 1 + held)
            self._note((1.0 * corners, ends, self.corners[corners]))
            self._grown(np.abs(ends).max(axis=0))
        return held

    def _long(self, k: int) -> int:
        """Follow the next leg in steps as long as its proof allows."""
        leg, n = self.leg, self.graphs.nx
        leg.redirect(self.corners[k], self.directions[k], self._largest(k))
        for group in self.ended:
            leg.reach[group] = Reach(self.reach[group].high, self.reach[group].high)
        leg.begin(self.nodes[k], 0.0)
        extend(leg, 1.0)
        self._note(leg.on_curves())
        self._grown(leg.sizes()[0])
        self._state = leg.state[-1]
        self.nodes[k + 1] = self._state[:n]
        self.zones += [later(zone, k) for zone in leg.zones]
        self._signs[k + 1 :] = leg.sign_at(np.array(leg.s[-1:]))[0]
        for group, reach in leg.reach.items():
            if group not in self.ended and reach.high is not None:
                self.ended.add(group)
                self.reach[group].high = replace(reach.high, s=k + reach.high.s)
        return 1

    def _note(self, found: tuple[Any, Any, Any]) -> None:
        """Keep poses passed on the way, while the contacts on curves follow it."""
        if self.curves is not None and not self.ended & set(self.curves.groups):
            self._visited.append(found[1:])

    def _grown(self, size: Floats) -> None:
        """Enlarge the sizes of the unknowns of groups that have not ended."""
        alive = self.alive(self.ended)
        for b, graph in enumerate(self.graphs.blocks):
            if alive[b]:
                self._sizes[graph.own] = np.maximum(self._sizes[graph.own], size[graph.own])

    @property
    def _padded(self) -> Matrix:
        """The leg's direction at each corner, none at the last."""
        return np.vstack([self.directions, np.zeros((1, self.corners.shape[1]))])

    @property
    def whole_way(self) -> bool:
        """Whether all groups came to the last corner."""
        return not self.ended

    # -- what is asked of a path -----------------------------------------------------------

    @property
    def extent(self) -> tuple[float, float]:
        return 0.0, float(len(self.corners) - 1)

    def drivers(self, s: Floats) -> Any:
        """Return the drivers' values (n, nd) at `s` (n,)."""
        k = np.floor(s).astype(int)
        return self.corners[k] + (s - k)[:, None] * self._padded[k]

    def motion(self, s: float) -> list[Floats]:
        """Return the drivers' values (nd,) at a corner; it is a pose by itself: no derivatives."""
        u = self.drivers(np.array([s]))[0]
        return [u, *[np.zeros(len(u))] * 3]

    def rates(self, s: Floats, order: int) -> tuple[Floats, ...]:
        return tuple(np.zeros((len(s), self.corners.shape[1])) for _ in range(order))

    def follows(self, s: Floats) -> Booleans:
        return np.stack([reach.contains(s) for reach in self.reach.values()], axis=1)

    def sign_at(self, s: Floats) -> Floats:
        signs: Floats = self._signs[np.asarray(s, int)]
        return signs

    def guess(self, s: Floats) -> Unknowns:
        """Return the unknowns (n, nx) at corners `s` (n,)."""
        result: Floats = self.nodes[np.asarray(s, int)]
        return result

    def insert(self, places: Floats, most: int = 64) -> int:
        """Return 0: the corners are solved poses, nothing lies between them."""
        return 0

    def on_curves(self) -> tuple[Floats, Floats, Floats]:
        """Return s, x and u of no corner: what was passed between them, s not known as nan."""
        first = (self.nodes[:1], self.corners[:1])
        x, u = (np.vstack(parts) for parts in zip(first, *self._visited, strict=True))
        return np.full(len(x), np.nan), x, u

    def sizes(self) -> tuple[Floats, Floats]:
        return self._sizes, np.abs(self.corners).max(axis=0)


def later(zone: Zone, k: int) -> Zone:
    """Return the zone of a leg with s counted from the first corner."""
    places, *rest = zone.nodes
    crossings = tuple(replace(crossing, s=k + crossing.s) for crossing in zone.crossings)
    return replace(zone, s=k + zone.s, crossings=crossings, nodes=(k + places, *rest))


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

"""Starts of a four-bar in the parameters of the user's mechanism."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.design.synthesis.fourbar.linkage import StartingFourBar, closed_loop, screened
from mechdae.design.synthesis.space import DesignSpace
from mechdae.types import Floats, Graph, Points

if TYPE_CHECKING:
    from numpy.random import Generator

    from mechdae.design.synthesis.fourbar.freudenstein import FunctionStart


SX = ca.SX
CORNERS = 1024
"""Corners of the box of free numbers, and places in it, at which lengths are looked at."""


class FourBarStarts:
    """Draws four-bars whose coupler point comes near to targets."""

    def __init__(self, space: DesignSpace, point: str) -> None:
        assert space.loop is not None
        self.space, self.point, self.loop = space, point, space.loop

    @property
    def fits(self) -> bool:
        """The point belongs to the coupler and nothing but the four-bar is in the scene."""
        return self.space.single_loop and self.point.split(".")[0] == self.loop.coupler

    def screened(
        self,
        targets: Points,
        generator: Generator,
        samples: int,
        count: int,
        kind: str,
        timing: str,
        steps: Floats,
    ) -> list[StartingFourBar]:
        """Return the best mutually distant starts of a Grashof class."""
        ordered = {"absolute": self.absolute(steps), "steps": steps}
        return screened(
            targets, generator, samples, count, kind, ordered.get(timing), timing,
            self._fixed_frame(), self.limits(),
        )  # fmt: skip

    def posed(self, start: StartingFourBar) -> tuple[Floats, Floats, Points, Floats]:
        """Return the parameters of a start, its driver values, unknowns (k, nx) and branch."""
        return self.placed(start, self._fitted(start))

    def placed(self, start: StartingFourBar, d: Floats) -> tuple[Floats, Floats, Points, Floats]:
        """Return given parameters with the driver values, unknowns and branch of a start."""
        crank, coupler, rocker, _ = np.array(self._angles(d)).ravel()
        absolute = {
            self.loop.coupler: start.couplers + start.turn - coupler,
            self.loop.rocker: start.rockers + start.turn - rocker,
        }
        x = np.stack([absolute[body] for body, _ in self.space.poses.x_names], axis=1)
        u = start.turns + start.turn - crank - float(self._crank(0.0, d))
        branches = [
            np.array(self.space.poses.function(x[i], u[i], d)[1]).ravel() for i in range(len(u))
        ]
        return d, u, x, np.sign(np.mean(branches, axis=0))

    def ground(self) -> float:
        """Return the length of the ground line at the values of the file."""
        return float(np.array(self._geometry(self.space.middle)[0]).ravel()[0])

    def described(self, d: Floats) -> StartingFourBar:
        """Return the four-bar of given parameters, without poses."""
        v = np.array(self._geometry(d)[0]).ravel()
        nothing = np.zeros(0)
        return StartingFourBar(
            v[:4], complex(v[4], v[5]), float(np.arctan2(v[7], v[6])), complex(v[8], v[9]),
            nothing, nothing, nothing, 1, 1, 0.0,
        )  # fmt: skip

    def with_lengths(self, lengths: Floats) -> Floats:
        """Return the parameters of the file with other lengths."""
        value = np.array(self._geometry(self.space.middle)[0]).ravel()
        turn = float(np.arctan2(value[7], value[6]))
        point = complex(value[8], value[9])
        nothing = np.zeros(0)
        start = StartingFourBar(
            lengths, complex(value[4], value[5]), turn, point, nothing, nothing, nothing, 1, 1, 0.0
        )
        return self._fitted(start)

    def closed(self, start: FunctionStart, turns: Floats) -> StartingFourBar:
        """Return the poses of a four-bar of given lengths at angles of its crank."""
        value = np.array(self._geometry(self.space.middle)[0]).ravel()
        turn = float(np.arctan2(value[7], value[6]))
        r = start.lengths
        ratios = np.array([[r[0] / r[1], r[2] / r[1], r[3] / r[1]]])
        couplers, rockers = closed_loop(ratios, turns[None, :], np.array([start.branch]))
        return StartingFourBar(
            r, complex(value[4], value[5]), turn, 0j, turns, couplers[0], rockers[0],
            start.branch, start.sense, start.residual,
        )  # fmt: skip

    # -- geometry ------------------------------------------------------------------------------

    @cached_property
    def _geometry(self) -> Graph:
        """(free) -> lengths, pivot, cos and sin of the ground line, coupler point; its Jacobian."""
        loop, size = self.loop, self.space.size
        d = SX.sym("d", len(self.space.names))
        stacked = ca.vertcat(
            loop.lengths, loop.pivot, size * ca.cos(loop.turn), size * ca.sin(loop.turn),
            loop.point(self.space.poses.scene, self.point),
        )  # fmt: skip
        if "." not in self.point:  # the direction of A-B in a plane whose turn is asked for
            frame = loop.offsets[loop.coupler]
            stacked = ca.vertcat(stacked, size * ca.cos(frame), size * ca.sin(frame))
        stacked = self.space.over_free(stacked, d)
        return ca.Function("geometry", [d], [stacked, ca.jacobian(stacked, d)])

    @cached_property
    def _angles(self) -> Graph:
        """(free) -> directions of the lines of crank, coupler, rocker in their bodies, ground."""
        d = SX.sym("d", len(self.space.names))
        links = (self.loop.crank, self.loop.coupler, self.loop.rocker)
        stacked = ca.vertcat(*[self.loop.offsets[body] for body in links], self.loop.turn)
        return ca.Function("angles", [d], [self.space.over_free(stacked, d)])

    @cached_property
    def _crank(self) -> Graph:
        """(u, free) -> angle of the crank."""
        scene = self.space.poses.scene
        d, u = SX.sym("d", len(self.space.names)), SX.sym("u")
        angle = ca.substitute(scene.turn_of(self.loop.crank), scene.u, u)
        return ca.Function("crank", [u, d], [self.space.over_free(angle, d)])

    def absolute(self, steps: Floats) -> Any:
        """Return the crank's angles from the ground line at the driver's values."""
        middle = self.space.middle
        crank, _, _, ground = np.array(self._angles(middle)).ravel()
        return steps + float(self._crank(0.0, middle)) + crank - ground

    def output(self, values: Floats) -> Any:
        """Return the rocker's angles from the ground line at angles of its body."""
        _, _, rocker, ground = np.array(self._angles(self.space.middle)).ravel()
        return values + rocker - ground

    def _fixed_frame(self) -> tuple[complex, float] | None:
        """Return pivot and direction of the ground line where no free parameter moves them."""
        value, slope = (np.array(part) for part in self._geometry(self.space.middle))
        if np.abs(slope[4:8]).max(initial=0.0) > 0:
            return None
        x, y, c, s = value.ravel()[4:8]
        return complex(x, y), float(np.arctan2(s, c))

    def limits(self) -> Points:
        """Return bounds (4, 2) of ground, crank, coupler, rocker over the box."""
        low, high = self.space.box.T
        shares = np.random.default_rng(0).random((CORNERS, len(low)))
        inner = low + shares * (high - low)
        corners = np.where(shares < 0.5, low, high)
        every = self.space.lengths(np.concatenate([[low, high], corners, inner]))[0]
        return np.stack([every.min(axis=0), every.max(axis=0)], axis=1)

    def _fitted(self, start: StartingFourBar, steps: int = 12) -> Floats:
        """Return the free parameters that make the four-bar of a start, as nearly as they can."""
        return self.fitted(start, 0.0, steps)[0]

    def fitted(
        self, start: StartingFourBar, frame: float, steps: int = 30, tries: int = 0,
        met: float = 0.0,
    ) -> tuple[Floats, float]:  # fmt: skip
        """Return the free parameters of a start, and by how much they miss it [m].

        `frame` is the direction of A-B in the plane that takes poses. Gauss' and Newton's steps
        begin with the file's values; where they end further off than `met`, in up to so many
        `tries` with others within the bounds: a ground line that points the other way round is a
        place where they rest.
        """
        size = self.space.size
        wanted = np.concatenate(
            [
                start.lengths, [start.pivot.real, start.pivot.imag],
                size * np.array([np.cos(start.turn), np.sin(start.turn)]),
                [start.point.real, start.point.imag],
            ]
        )  # fmt: skip
        if "." not in self.point:
            wanted = np.append(wanted, size * np.array([np.cos(frame), np.sin(frame)]))
        low, high = self.space.box.T
        best, miss = self._nearest(self.space.middle, wanted, steps)
        generator = np.random.default_rng(0)
        for _ in range(tries):
            if miss <= met:
                break
            begin = self.space.middle.copy()
            begin[: len(low)] = generator.uniform(low, high)
            other, further = self._nearest(begin, wanted, steps)
            if further < miss:
                best, miss = other, further
        return best, miss

    def _nearest(self, d: Floats, wanted: Floats, steps: int) -> tuple[Floats, float]:
        """Return the nearest parameters on the way of Gauss' and Newton's steps, and the miss."""
        low, high = self.space.box.T
        n = len(low)
        best, least = d, np.inf
        for _ in range(steps):
            g, slope = (np.array(part) for part in self._geometry(d))
            left = g.ravel() - wanted
            if not np.isfinite(slope).all():
                break  # two pins of a link at one place: its line has no direction
            if float(left @ left) < least:
                best, least = d.copy(), float(left @ left)
            move = np.linalg.lstsq(slope[:, :n], left, rcond=1e-12)[0]
            d = np.concatenate([np.clip(d[:n] - move, low, high), d[n:]])
        return best, float(np.sqrt(least))

    def given(self) -> dict[str, float]:
        """Return the dimensions that no free parameter moves, as `exact.exact_path` calls them."""
        value, slope = (np.array(part) for part in self._geometry(self.space.middle))
        fixed = np.abs(slope).max(axis=1, initial=0.0) == 0.0
        v = value.ravel()
        words = ("ground", "crank", "coupler", "rocker", "pivot_x", "pivot_y")
        found = {word: float(v[i]) for i, word in enumerate(words) if fixed[i]}
        if fixed[6] and fixed[7]:
            found["turn"] = float(np.arctan2(v[7], v[6]))
        return found | {
            w: float(v[8 + i]) for i, w in enumerate(("along", "across")) if fixed[8 + i]
        }

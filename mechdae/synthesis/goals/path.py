"""Path generation: a point visits targets, at given values of the driver or in order.

All at once: the free parameters and the unknowns of every pose are variables, the closure of
every pose is an equation and its branch an inequality.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.goals import PathTargets
from mechdae.synthesis.nlp import Nlp
from mechdae.synthesis.projection import CLASSES, Start, screened
from mechdae.synthesis.search import TURN, WIDE, Goal, Seed, Space
from mechdae.synthesis.spread import Spread, drawn

SX = ca.SX
SAMPLES = 20_000
"""Designs drawn in the screening of each class."""
COARSE = 0.5
"""Least squares residual, as a share of the targets' size, above which a start is not tried."""


class Path(Goal):
    """The path of a point.

    Parameters
    ----------
    space
        Whose poses ask for the point alone.
    asked
        Targets, timing, weights.
    """

    def __init__(self, space: Space, asked: PathTargets) -> None:
        self.space, self.asked = space, asked
        self.targets = np.array(asked.targets)
        self.weights = np.array(asked.weights)
        self.programme = np.array(asked.programme)
        self.count = len(self.targets)
        if space.limits.full_turn and space.loop is not None:
            self.kinds = CLASSES

    # -- the problem -------------------------------------------------------------------------

    def build(self, kind: str) -> Nlp:
        nlp, space, asked = Nlp(), self.space, self.asked
        d = space.design(nlp)
        k = self.count
        sigma = nlp.parameter("sigma", np.ones(space.poses.nb))
        sense = nlp.parameter("sense", 1.0)
        targets = ca.reshape(nlp.parameter("targets", self.targets), 2, k)
        programme = nlp.parameter("programme", self.programme)
        free = asked.timing == "free"
        start = nlp.variable("start", int(asked.timing == "steps"), -WIDE, WIDE)
        own = nlp.variable("u", k if free else 0, -WIDE, WIDE)
        x = space.pose_variables(nlp, "x", k)
        u = []
        for i in range(k):
            if free:
                u.append(own[i])
            elif asked.timing == "steps":
                u.append(start + sense * programme[i])
            else:
                u.append(programme[i])
            point = space.at(nlp, x[:, i], u[i], d, sigma)
            gap = (point - targets[:, i]) / space.size
            nlp.objective += float(self.weights[i]) * ca.sumsqr(gap)
        if free:
            gaps = [sense * (u[i + 1] - u[i]) for i in range(k - 1)]
            nlp.constrain("order", ca.vertcat(*gaps), space.limits.order, np.inf)
            whole = sense * (u[-1] - u[0])
            nlp.constrain("turn", whole, -np.inf, TURN - space.limits.order)
        space.full_turn(nlp, d, kind)
        return nlp

    def objective(self, value: float) -> float:
        return value * self.space.size**2

    def driver_values(self, values: Mapping[str, Any], given: Mapping[str, Any]) -> Any:
        if self.asked.timing == "free":
            return np.array(values["u"])
        if self.asked.timing == "steps":
            return values["start"][0] + given["sense"] * self.programme
        return self.programme

    # -- starts ------------------------------------------------------------------------------

    def seeds(self, kind: str, nlp: Nlp, generator: Any, count: int) -> Iterable[Seed]:
        if self.space.loop is not None:
            yield from self._projected(kind, generator, count)
        else:
            yield from self._drawn(generator, count)

    def _projected(self, kind: str, generator: Any, count: int) -> Iterable[Seed]:
        relative = self.programme if self.asked.timing == "steps" else self._relative()
        found = screened(
            self.targets, generator, SAMPLES, count, kind or "crank-rocker",
            None if self.asked.timing == "free" else relative, self.asked.timing,
            self._fixed_frame(), self._length_limits(),
        )  # fmt: skip
        for start in found:
            yield self._seed(start)

    def _seed(self, start: Start) -> Seed:
        """Return the start of a four-bar in the variables of the NLP."""
        loop = self.space.loop
        assert loop is not None
        d = self._fitted(start)
        crank, coupler, rocker, _ = np.array(self._angles(d)).ravel()
        absolute = {
            loop.coupler: start.couplers + start.turn - coupler,
            loop.rocker: start.rockers + start.turn - rocker,
        }
        x = np.stack([absolute[body] for body, _ in self.space.poses.x_names], axis=1)
        u = start.turns + start.turn - crank - float(self._crank(0.0, d))
        first: Any = np.zeros(0)
        if self.asked.timing == "steps":
            first = u[:1] - start.sense * self.programme[0]
        inside = [
            np.array(self.space.poses.function(x[i], u[i], d)[1]).ravel() for i in range(self.count)
        ]
        free = u if self.asked.timing == "free" else np.zeros(0)
        values = {"d": d, "start": first, "u": free, "x": x}
        given = {"sigma": np.sign(np.mean(inside, axis=0)), "sense": float(start.sense)}
        return Seed(values, given, start.residual)

    def _drawn(self, generator: Any, count: int) -> Iterable[Seed]:
        """Yield starts of any mechanism: designs drawn in the box, moved along the programme."""
        spread = Spread(self.space.poses, self.space.size)
        d = drawn(generator, self.space.box, SAMPLES)
        sense = generator.choice((-1.0, 1.0), SAMPLES)
        first = generator.uniform(0, TURN, SAMPLES)
        if self.asked.timing == "absolute":
            u = np.broadcast_to(self.programme, (SAMPLES, self.count))
        elif self.asked.timing == "steps":
            u = first[:, None] + sense[:, None] * self.programme
        else:
            gaps = generator.dirichlet(np.ones(self.count), SAMPLES) * TURN
            u = first[:, None] + sense[:, None] * np.cumsum(gaps, axis=1)
        held, x, sigma, points = spread.moved(d, u, generator)
        f = np.sum(np.sum((points - self.targets) ** 2, axis=2) * self.weights, axis=1)
        f[~held] = np.inf
        for i in np.argsort(f, kind="stable")[:count]:
            if not np.isfinite(f[i]):
                return
            begin = first[i : i + 1] if self.asked.timing == "steps" else np.zeros(0)
            own = u[i] if self.asked.timing == "free" else np.zeros(0)
            values = {"d": d[i], "start": begin, "u": own, "x": x[i]}
            yield Seed(values, {"sigma": sigma[i], "sense": float(sense[i])}, float(f[i]))

    # -- geometry of the four-bar ------------------------------------------------------------

    @cached_property
    def _geometry(self) -> Any:
        """(free) -> lengths, pivot, cos and sin of the ground line, coupler point; its Jacobian."""
        loop, size = self.space.loop, self.space.size
        assert loop is not None
        d = SX.sym("d", len(self.space.poses.free))
        stacked = ca.vertcat(
            loop.lengths, loop.pivot, size * ca.cos(loop.turn), size * ca.sin(loop.turn),
            loop.point(self.space.poses.scene, self.asked.point),
        )  # fmt: skip
        stacked = self.space.over_free(stacked, d)
        return ca.Function("geometry", [d], [stacked, ca.jacobian(stacked, d)])

    @cached_property
    def _angles(self) -> Any:
        """(free) -> directions of the lines of crank, coupler, rocker in their bodies, ground."""
        loop = self.space.loop
        assert loop is not None
        d = SX.sym("d", len(self.space.poses.free))
        links = (loop.crank, loop.coupler, loop.rocker)
        stacked = ca.vertcat(*[loop.offsets[body] for body in links], loop.turn)
        return ca.Function("angles", [d], [self.space.over_free(stacked, d)])

    @cached_property
    def _crank(self) -> Any:
        """(u, free) -> angle of the crank."""
        loop, scene = self.space.loop, self.space.poses.scene
        assert loop is not None
        d, u = SX.sym("d", len(self.space.poses.free)), SX.sym("u")
        angle = ca.substitute(scene.recover[loop.crank, "angle"], scene.u, u)
        return ca.Function("crank", [u, d], [self.space.over_free(angle, d)])

    def _relative(self) -> Any:
        """Return the crank's angles from the ground line at the programme."""
        if self.asked.timing != "absolute":
            return None
        middle = self.space.middle
        crank, _, _, ground = np.array(self._angles(middle)).ravel()
        return self.programme + float(self._crank(0.0, middle)) + crank - ground

    def _fixed_frame(self) -> tuple[complex, float] | None:
        """Return pivot and direction of the ground line where no free parameter moves them."""
        value, slope = (np.array(part) for part in self._geometry(self.space.middle))
        if np.abs(slope[4:8]).max(initial=0.0) > 0:
            return None
        x, y, c, s = value.ravel()[4:8]
        return complex(x, y), float(np.arctan2(s, c))

    def _length_limits(self) -> Any:
        """Return bounds (4, 2) of ground, crank, coupler, rocker from the corners of the box."""
        ends = [np.array(self._geometry(d)[0]).ravel()[:4] for d in self.space.box.T]
        return np.stack([np.minimum(*ends), np.maximum(*ends)], axis=1)

    def _fitted(self, start: Start, steps: int = 12) -> Any:
        """Return the free parameters that make the four-bar of a start, as nearly as they can."""
        size = self.space.size
        wanted = np.concatenate(
            [
                start.lengths, [start.pivot.real, start.pivot.imag],
                size * np.array([np.cos(start.turn), np.sin(start.turn)]),
                [start.point.real, start.point.imag],
            ]
        )  # fmt: skip
        low, high = self.space.box.T
        d = self.space.middle
        best, least = d, np.inf
        for _ in range(steps):
            g, slope = (np.array(part) for part in self._geometry(d))
            left = g.ravel() - wanted
            if float(left @ left) < least:
                best, least = d, float(left @ left)
            d = np.clip(d - np.linalg.lstsq(slope, left, rcond=1e-12)[0], low, high)
        return best

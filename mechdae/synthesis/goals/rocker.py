"""A body swings by a given angle with a given ratio of the times of its two strokes.

At the ends of the swing the rate of its angle by the driver vanishes; between them the driver
turns by 2 pi Q/(1 + Q). Rates are unknowns of their own, linear in the Jacobian of the pose.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import Coordinate
from mechdae.describe.goals import Rocker as Asked
from mechdae.model.model import Model
from mechdae.synthesis.goals.base import Drawn, Goal, Worth
from mechdae.synthesis.nlp import Nlp
from mechdae.synthesis.space import TURN, WIDE
from mechdae.synthesis.spread import Spread
from mechdae.synthesis.verify import Design

SX = ca.SX
SAMPLES = 4_000
NODES = 36
FAST = 100.0
"""Largest rate of an unknown by the driver, in sizes of the mechanism."""
EXACT = 1e-9


class Rocker(Goal):
    """Swing and time ratio; they are met exactly, so that other goals choose among designs."""

    exact = True

    def __init__(self, asked: Asked, name: str) -> None:
        self.asked, self.name = asked, name
        self.stroke = TURN * asked.time_ratio / (1 + asked.time_ratio)

    def bodies(self) -> tuple[str, ...]:
        return (self.asked.body,)

    def asks(self, model: Model) -> Mapping[str, Any]:
        name = self.asked.body
        return {f"{name}.angle": model.coordinate(Coordinate(f"{name}.angle", "body angle", name))}

    # -- the problem -------------------------------------------------------------------------

    def add(self, nlp: Nlp, d: Any, sigma: Any) -> Any:
        space, poses = self.space, self.space.poses
        sense = nlp.parameter(self.own("sense"), 1.0)
        upward = nlp.parameter(self.own("upward"), 1.0)
        begin = nlp.variable(self.own("begin"), 1, -WIDE, WIDE)
        x = space.pose_variables(nlp, self.own("x"), 2)
        fast = np.tile(np.where(space.turns, FAST, FAST * space.size), 2)
        scale = np.tile(np.where(space.turns, 1.0, space.size), 2)
        v = ca.reshape(nlp.variable(self.own("v"), 2 * poses.nx, -fast, fast, scale), poses.nx, 2)
        angles = []
        for i, u in enumerate((begin, begin + sense * self.stroke)):
            values = space.at(nlp, x[:, i], u, d, sigma)
            angles.append(poses.part(values, f"{self.asked.body}.angle"))
            left, rates = poses.rates(x[:, i], u, d, v[:, i])
            nlp.constrain("closure", left / space.units)
            nlp.constrain("end of the swing", poses.part(rates, f"{self.asked.body}.angle"))
        nlp.constrain("swing", upward * (angles[1] - angles[0]) - self.asked.swing)
        return SX(0)

    def programme(self, values: Mapping[str, Any], given: Mapping[str, Any]) -> tuple[Any, Any]:
        begin = float(values[self.own("begin")][0])
        return begin + given[self.own("sense")] * self.stroke * np.arange(2), self.poses_of(values)

    # -- starts ------------------------------------------------------------------------------

    def drawn(self, kind: str, generator: Any, count: int) -> Iterable[Drawn]:
        spread = Spread(self.space)
        d = spread.designs(generator, SAMPLES * 4)
        d = d[spread.turning(d, kind)][:SAMPLES]
        u = np.broadcast_to(TURN * np.arange(NODES) / NODES, (len(d), NODES))
        kept, x, sigma, values = spread.moved(d, u, generator)
        d = d[kept]
        angle = self.space.poses.part(values, f"{self.asked.body}.angle")[..., 0]
        low, high = np.argmin(angle, axis=1), np.argmax(angle, axis=1)
        rows = np.arange(len(d))
        swing = angle[rows, high] - angle[rows, low]
        rise = ((high - low) % NODES) * TURN / NODES
        # the longer stroke is the forward one where the ratio is above one
        choices = []
        for forward in (True, False):
            stroke = rise if forward else TURN - rise
            miss = np.abs(np.log(np.maximum(swing, 1e-9) / self.asked.swing))
            choices.append(miss + np.abs(stroke - self.stroke))
        rank = np.concatenate(choices)
        order = np.argsort(rank, kind="stable")
        for i in spread.distinct(np.vstack([d, d]), order, count):
            k, sense = i % len(d), 1.0 if i < len(d) else -1.0
            ends = [low[k], high[k]]
            own = {self.own("begin"): [u[0, ends[0]]]}
            given = {self.own("sense"): sense, self.own("upward"): 1.0}
            begin = float(u[0, ends[0]])
            at = begin + sense * self.stroke * np.arange(2)
            yield Drawn(d[k], own, given, at, x[k, ends], sigma[k], float(rank[i]))

    def completed(self, spread: Spread, drawn: Drawn) -> tuple[dict[str, Any], dict[str, Any]]:
        start = float(drawn.u[0])
        u = start + TURN * np.arange(NODES) / NODES
        _, x, found = spread.followed(drawn.d, drawn.x[0], start, u)
        angle = self.space.poses.part(found, f"{self.asked.body}.angle")[:, 0]
        ends = [int(np.argmin(angle)), int(np.argmax(angle))]
        rise = (u[ends[1]] - u[ends[0]]) % TURN
        sense = 1.0 if abs(rise - self.stroke) < abs(TURN - rise - self.stroke) else -1.0
        own = {self.own("begin"): [u[ends[0]]], self.own("x"): x[ends]}
        return own, {self.own("sense"): sense, self.own("upward"): 1.0}

    # -- what a design is worth --------------------------------------------------------------

    def worth(self, design: Design) -> Worth:
        at, _ = self.programme(design.values, design.given)
        found, defects = design.turn
        if found is None:
            return Worth(np.inf, np.full(2, np.nan), list(defects))
        defects = list(defects)
        swing = found.summary.get("swing", {}).get(self.asked.body)
        ends, own = design.swept(at, (self.asked.body,))
        defects += own
        if ends is None or swing is None:
            return Worth(np.inf, np.full(2, np.nan), [*defects, "the body does not swing"])
        reached = float(np.ptp(ends.bodies[self.asked.body].angle))
        errors = np.array([swing - self.asked.swing, reached - swing])
        if np.abs(errors).max() > EXACT * max(1.0, self.asked.swing):
            defects.append(f"the body swings by {np.degrees(swing):.6g} deg")
        return Worth(float(np.abs(errors).max()), errors, defects)

"""Straight line: a point moves along a line while the driver runs over an arc.

The largest deviation relative to the stroke is made as small as it can be (minimax): all
nodes lie within t strokes of a line whose direction and place are free.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.goals import StraightLine
from mechdae.design.synthesis.goals.base import Drawn, Goal
from mechdae.design.synthesis.nlp import NewValues, Nlp, Values
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.robust.values import deviation
from mechdae.design.synthesis.space import FAR, TURN, WIDE
from mechdae.design.synthesis.starts.similar import Similar
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.trace import MET, Trace, grid_of, maxima, moved
from mechdae.design.synthesis.verification.claims import Claim
from mechdae.equations.model import Model
from mechdae.types import Floats, Matrices, Sym

if TYPE_CHECKING:
    from numpy.random import Generator


SX = ca.SX
SAMPLES = 40_000
COARSE = 13
NONE = 1e-13
"""Deviation per stroke that is rounding."""
LEAST = 0.05
"""Least stroke in sizes of the mechanism: a point that stays is no line."""


class StraightGoal(Goal):
    """A point on a straight line."""

    deviates = True

    def __init__(self, asked: StraightLine, name: str) -> None:
        self.asked, self.name = asked, name
        self.shares: Floats = np.linspace(0, 1, asked.nodes)
        self.inputs: Floats = asked.arc * self.shares

    def bodies(self) -> tuple[str, ...]:
        return (self.asked.point.split(".")[0],)

    def asks(self, model: Model) -> Mapping[str, Sym]:
        return {self.asked.point: model.point(self.asked.point)}

    # -- the problem -------------------------------------------------------------------------

    def add(self, nlp: Nlp, d: Sym, sigma: Sym) -> Sym:
        space, count = self.space, len(self.inputs)
        nodes = nlp.parameter(self.key("nodes"), self.shares)
        begin = nlp.variable(self.key("begin"), 1, -WIDE, WIDE)
        way = nlp.variable(self.key("way"), 1, -WIDE, WIDE)
        far = FAR * space.size
        offset = nlp.variable(self.key("offset"), 1, -far, far, space.size)
        # the deviation is small beside the stroke
        worst = nlp.variable(self.key("worst"), 1, 0.0, np.inf, 1e-3)
        x = space.pose_variables(nlp, self.key("x"), count)
        along, across, added = [], [], []
        c, s = ca.cos(way), ca.sin(way)
        for i in range(count):
            values = space.at(nlp, x[:, i], begin + self.asked.arc * nodes[i], d, sigma)
            px, py = ca.vertsplit(space.poses.part(values, self.asked.point))
            if self.deviations is not None:
                added.append(self._deviation(x[:, i], begin + self.asked.arc * nodes[i], d, way))
            along.append((c * px + s * py) / space.size)
            across.append((c * py - s * px - offset) / space.size)
        stroke = along[-1] - along[0]
        length = self.asked.stroke
        if length is None:
            nlp.constrain("stroke", stroke, LEAST, np.inf)
        else:
            nlp.constrain("stroke", stroke - length / space.size)
        ahead = ca.vertcat(*along[1:]) - ca.vertcat(*along[:-1])
        nlp.constrain("straight on", ahead, 0.0, np.inf)
        # the speed at both ends, by a parabola: nothing turns back beside the last node
        for steps, gaps in (
            ((ahead[0], ahead[1]), (nodes[1] - nodes[0], nodes[2] - nodes[1])),
            ((ahead[-1], ahead[-2]), (nodes[-1] - nodes[-2], nodes[-2] - nodes[-3])),
        ):
            share = gaps[0] / gaps[1]
            slope = (1 + 2 * share) * steps[0] - share**2 * steps[1]
            nlp.constrain("straight on", slope, 0.0, np.inf)
        lines, bound = ca.vertcat(*across), worst * stroke
        if self.deviations is not None:
            bound = bound - self.deviations.factor * ca.vertcat(*added)
        nlp.constrain("deviation", (lines - bound) * 1e3, -np.inf, 0.0)
        nlp.constrain("deviation", (lines + bound) * 1e3, 0.0, np.inf)
        return worst * 1e3

    # -- deviations by tolerances ------------------------------------------------------------

    def _deviation(self, x: object, u: object, d: Sym, way: Any) -> Any:
        """Return the (dimensionless) standard deviation of the point across the line."""
        assert self.deviations is not None
        normal = ca.horzcat(-ca.sin(way), ca.cos(way)) / self.space.size
        return deviation(normal @ self.deviations.of(self.asked.point, x, u, d))

    def _sigma_of(self, x: Any, u: Any, d: Any, *line: Any) -> Any:
        return self.space.size * self._deviation(x, u, d, *line)

    def _deviating(self, values: Values, given: Values, u: Any, x: Any, d: Any) -> dict[str, Any]:
        way, offset = (float(values[self.key(word)][0]) for word in ("way", "offset"))
        places = np.array([self.space.poses.function(x[i], u[i], d)[2] for i in range(len(u))])
        places = self.space.poses.part(places[..., 0], self.asked.point)
        across = places @ np.array([-np.sin(way), np.cos(way)]) - offset
        stroke = (places[-1] - places[0]) @ np.array([np.cos(way), np.sin(way)])
        worst = np.max(np.abs(across) + self._added(x, u, d, way)) / max(stroke, 1e-9)
        return {self.key("worst"): [worst]}

    unit = 1e-3
    lines = 1

    def programme(self, values: Values, given: Values) -> tuple[Floats, Floats]:
        shares = given.get(self.key("nodes"), self.shares)
        x = self.poses_of(values, len(shares))
        return values[self.key("begin")][0] + self.asked.arc * shares, x

    # -- starts ------------------------------------------------------------------------------

    def drawn(self, kind: str, generator: Generator, count: int) -> Iterable[Drawn]:
        space, spread = self.space, Spread(self.space)
        similar = Similar(space, self.asked.point)
        d = spread.designs(generator, SAMPLES, similar.lengths if similar.available else None)
        d = d[spread.turning(d, kind)]
        d = similar.neutral(d)
        first = generator.uniform(0, TURN, len(d))
        u = first[:, None] + self.asked.arc * np.linspace(0, 1, COARSE)
        closed, x, _, values = spread.moved(d, u, generator)
        d, first, u = d[closed], first[closed], u[closed]
        if not len(d):
            return
        places = space.poses.part(values, self.asked.point)
        if similar.offsets is not None:
            d, places = self._offset(similar, d, u, x)
        way, offset, worst, stroke, ahead = lines_of(places)
        rank = np.where(ahead, worst / np.maximum(stroke, 1e-300), np.inf)
        rank[stroke < LEAST * space.size] = np.inf
        if self.asked.stroke is not None and similar.available:
            grown = self.asked.stroke / np.maximum(stroke, 1e-300)
            places_of = np.flatnonzero(similar.lengths)
            d[:, places_of] *= grown[:, None]
            x = np.where(space.turns, x, x * grown[:, None, None])
            offset, worst, stroke = offset * grown, worst * grown, stroke * grown
        elif self.asked.stroke is not None:
            rank = rank + 0.1 * np.abs(np.log(np.maximum(stroke, 1e-300) / self.asked.stroke))
        low, high = space.box.T
        free = d[:, : len(low)]
        beyond = np.maximum(free - high, 0) + np.maximum(low - free, 0)
        rank = rank + 0.1 * np.sum(beyond / space.scale, axis=1)
        d[:, : len(low)] = np.clip(free, low, high)
        good = np.flatnonzero(np.isfinite(rank))
        for i in spread.distinct(d, good[np.argsort(rank[good], kind="stable")], count):
            own_u = first[i] + self.inputs
            on, poses, _ = spread.followed(d[i], x[i, 0], float(own_u[0]), own_u)
            if not on:
                continue
            unknowns = {
                self.key("begin"): [first[i]], self.key("way"): [way[i]],
                self.key("offset"): [offset[i]], self.key("worst"): [worst[i] / stroke[i]],
            }  # fmt: skip
            sigma = space.poses.branch(poses[0], own_u[0], d[i])
            yield Drawn(d[i], unknowns, {}, own_u, poses, sigma, float(rank[i]))

    def _offset(self, similar: Similar, d: Sym, u: Floats, x: Matrices) -> tuple[Floats, Matrices]:
        """Return designs with the point of the body that moves most nearly on a line.

        With the foot p and the direction e of the body at the poses, Re(n (p + c e)) - k is least
        for a unit n: c n and k are eliminated, n is an eigenvector of what is left.
        """
        n, k = u.shape
        p, e = similar.at(d, u, x)
        A = np.stack([p.real, -p.imag], axis=2)
        B = np.stack([e.real, -e.imag, np.ones((n, k))], axis=2)
        solved = np.linalg.solve(
            np.einsum("nki,nkj->nij", B, B) + 1e-12 * k * np.eye(3), np.einsum("nki,nkj->nij", B, A)
        )
        left = A - np.einsum("nki,nij->nkj", B, solved)
        _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", left, left))
        normal = vectors[:, 0, 0] + 1j * vectors[:, 1, 0]
        both = -np.einsum("nij,nj->ni", solved, vectors[:, :, 0])
        c = (both[:, 0] + 1j * both[:, 1]) / normal
        new = d.copy()
        assert similar.offsets is not None
        new[:, similar.offsets[0]], new[:, similar.offsets[1]] = c.real, c.imag
        place = p + c[:, None] * e
        return new, np.stack([place.real, place.imag], axis=2)

    def completed(self, spread: Spread, drawn: Drawn) -> NewValues:
        start = float(drawn.u[0])
        _, x, found = spread.followed(drawn.d, drawn.x[0], start, start + self.inputs)
        places = self.space.poses.part(found, self.asked.point)[None]
        way, offset, worst, stroke, _ = lines_of(places)
        unknowns = {
            self.key("begin"): [start], self.key("way"): way, self.key("offset"): offset,
            self.key("worst"): worst / np.maximum(stroke, 1e-9), self.key("x"): x,
        }  # fmt: skip
        return unknowns, {}

    # -- the true extremes ---------------------------------------------------------------------

    def _extremes(self, values: Values, given: Values) -> tuple[Trace, Floats, Floats]:
        """Return the design, shares of the arc where deviations are largest, and those."""
        begin = float(values[self.key("begin")][0])
        u, x = self.programme(values, given)
        d = dimensions(values["d"], given)
        trace = Trace(self.spread, d, u, x)
        way, offset = (float(values[self.key(word)][0]) for word in ("way", "offset"))

        def across(shares: Floats) -> Floats:
            at = begin + self.asked.arc * shares
            x, _, found, held = trace.poses(at)
            place = self.space.poses.part(found, self.asked.point)
            gap = place @ np.array([-np.sin(way), np.cos(way)]) - offset
            return np.where(held, np.abs(gap) + self._added(x, at, d, way), np.nan)

        nodes = given.get(self.key("nodes"), self.shares)
        return trace, *maxima(across, grid_of(nodes))

    def refined(self, spread: Spread, values: Values, given: Values) -> NewValues | None:
        trace, places, tops = self._extremes(values, given)
        way, begin = (float(values[self.key(word)][0]) for word in ("way", "begin"))
        _, _, found, _ = trace.poses(begin + self.asked.arc * np.array([0.0, 1.0]))
        ends = self.space.poses.part(found, self.asked.point) @ np.array([np.cos(way), np.sin(way)])
        stroke = float(ends[1] - ends[0])
        worst = float(values[self.key("worst")][0]) * stroke
        if not len(tops) or not tops.max() > worst * (1 + MET) + NONE * stroke:
            return None
        nodes = given.get(self.key("nodes"), self.shares)
        held = np.isin(np.arange(len(nodes)), (0, len(nodes) - 1))
        nodes = moved(nodes, places, tops, held)
        unknowns = {
            self.key("x"): trace.poses(begin + self.asked.arc * nodes)[0],
            self.key("worst"): [tops.max() / stroke],
        }
        return unknowns, {self.key("nodes"): nodes}

    def claim(self, values: Values, given: Values) -> Claim:
        begin, way, offset = (float(values[self.key(w)][0]) for w in ("begin", "way", "offset"))
        between = self._extremes(values, given)[1]
        return Claim((begin,), direction=way, offset=offset, between=between)


def lines_of(places: Matrices) -> tuple[Floats, Floats, Floats, Floats, Any]:
    """Return direction, offset, largest deviation, stroke of points (n, k, 2), and if straight on.

    The line joins the first point to the last one; it is shifted so that the deviations to both
    sides are alike.
    """
    gap = places[:, -1] - places[:, 0]
    way = np.arctan2(gap[:, 1], gap[:, 0])
    c, s = np.cos(way)[:, None], np.sin(way)[:, None]
    along = c * places[..., 0] + s * places[..., 1]
    across = c * places[..., 1] - s * places[..., 0]
    low, high = across.min(axis=1), across.max(axis=1)
    ahead = (np.diff(along, axis=1) > 0).all(axis=1)
    return way, (low + high) / 2, (high - low) / 2, along[:, -1] - along[:, 0], ahead

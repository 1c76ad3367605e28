"""A coordinate goes back and forth between two ends: swing or stroke, and the ratio of the times.

At the ends the rate by the driver vanishes; between them the driver turns by 2 pi Q/(1 + Q).
Rates are unknowns of their own, linear in the Jacobian of the pose.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate, unit_within
from mechdae.describe.tasks.goals import Rocker as Asked
from mechdae.design.synthesis.goals.base import Drawn, Goal
from mechdae.design.synthesis.nlp import LIMIT, NewValues, Nlp, Values
from mechdae.design.synthesis.space import TURN, WIDE
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.verification.claims import Stated
from mechdae.equations.model import Model
from mechdae.types import Floats, Sym

if TYPE_CHECKING:
    from numpy.random import Generator


SX = ca.SX
SAMPLES = 4_000
NODES = 36
FAST = 100.0
"""Largest rate of an unknown by the driver, in sizes of the mechanism."""
LEAST = 1e-3
"""Least way between the ends, and least part of a turn of a stroke, where they are free."""


class RockerGoal(Goal):
    """Way and time ratio; they are met exactly, so that other goals choose among designs.

    With a ``sense`` of 1 or -1 one of them, ``word``, is as small or as large as it can be
    instead; with ``bounds`` it lies between them.
    """

    def __init__(
        self, asked: Asked, name: str, word: str = "", sense: int = 0, bounds: Any = None,
        typical: float = 1.0, path: str = "",
    ) -> None:  # fmt: skip
        self.asked: Asked = asked
        self.name, self.word, self.bounds = name, word, bounds
        self.path = path
        self.exact: bool = not sense
        self.sense: int = sense or 1
        self.typical = typical
        self.unit: float = typical if word == "reach" else 1.0
        ratio = asked.time_ratio
        self.stroke: float | None = None if ratio is None else TURN * ratio / (1 + ratio)

    between_nodes = False

    @property
    def stated(self) -> Stated:
        return Stated(self.asked, self.bounds, self.unit, self.word, self.path)

    @cached_property
    def slides(self) -> bool:
        """Whether the coordinate is a length."""
        return self.asked.coordinate.endswith(".slide")

    @property
    def part(self) -> str:
        """The body or the joint."""
        return self.asked.coordinate.rpartition(".")[0]

    def bodies(self) -> tuple[str, ...]:
        return (self.asked.coordinate if self.slides else self.part,)

    def asks(self, model: Model) -> Mapping[str, Sym]:
        text = self.asked.coordinate
        if self.slides:
            return {text: model.coordinate(coordinate(model.mechanism, text))}
        return {text: model.coordinate(NamedCoordinate(text, "body angle", self.part))}

    # -- the problem -------------------------------------------------------------------------

    @property
    def words(self) -> str:
        return f"ways and time ratios ({self.path or self.asked.coordinate})"

    def add(self, nlp: Nlp, d: Sym, sigma: Sym) -> Sym:
        space, poses, text = self.space, self.space.poses, self.asked.coordinate
        sense = nlp.parameter(self.key("sense"), 1.0)
        upward = nlp.parameter(self.key("upward"), 1.0)
        begin = nlp.variable(self.key("begin"), 1, -WIDE, WIDE)
        free = self.stroke is None
        free_stroke = nlp.variable(self.key("stroke"), int(free), TURN * LEAST, TURN * (1 - LEAST))
        stroke = free_stroke if self.stroke is None else self.stroke
        x = space.pose_variables(nlp, self.key("x"), 2)
        fast = np.tile(FAST * space.natural, 2)
        scale = np.tile(space.natural, 2)
        v = ca.reshape(nlp.variable(self.key("v"), 2 * poses.nx, -fast, fast, scale), poses.nx, 2)
        places = []
        for i, u in enumerate((begin, begin + sense * stroke)):
            values = space.at(nlp, x[:, i], u, d, sigma)
            places.append(poses.part(values, text))
            left, rates = poses.rates(x[:, i], u, d, v[:, i])
            nlp.constrain("closure", left / space.units)
            nlp.constrain("end of the swing", poses.part(rates, text) / self.size)
        way = upward * (places[1] - places[0])
        if self.asked.reach is not None:
            nlp.constrain("swing", (way - self.asked.reach) / self.size)
        else:
            nlp.constrain("swing", way / self.size, LEAST, np.inf)
        # the longer stroke is the forward one
        if self.word == "time_ratio":
            nlp.constrain("longer stroke", stroke, np.pi, np.inf)
            value = stroke / (TURN - stroke)
        else:
            value = way / self.unit
        if self.bounds is not None:
            low, high = (bound / self.unit for bound in self.bounds)
            si = unit_within(poses.mechanism, None, self.path) or ""
            nlp.constrain(
                f"{LIMIT}{self.path}", value, max(low, -1e18), min(high, 1e18), self.unit, si
            )
        return SX(0) if self.exact else self.sense * value

    @property
    def size(self) -> float:
        """One of the coordinate: a radian, or the size of the mechanism."""
        return self.space.size if self.slides else 1.0

    def value(self, term: float) -> float:
        return self.sense * term * self.unit if not self.exact else term

    def programme(self, values: Values, given: Values) -> tuple[Floats, Floats]:
        begin = float(values[self.key("begin")][0])
        stroke = float(values[self.key("stroke")][0]) if self.stroke is None else self.stroke
        return begin + given[self.key("sense")] * stroke * np.arange(2), self.poses_of(values, 2)

    # -- starts ------------------------------------------------------------------------------

    def drawn(self, kind: str, generator: Generator, count: int) -> Iterable[Drawn]:
        spread = Spread(self.space)
        d = spread.designs(generator, SAMPLES * 4)
        d = d[spread.turning(d, kind)][:SAMPLES]
        u = np.broadcast_to(TURN * np.arange(NODES) / NODES, (len(d), NODES))
        closed, x, sigma, values = spread.moved(d, u, generator)
        d = d[closed]
        if not len(d):
            return
        place = self.space.poses.part(values, self.asked.coordinate)[..., 0]
        low, high = np.argmin(place, axis=1), np.argmax(place, axis=1)
        rows = np.arange(len(d))
        way = place[rows, high] - place[rows, low]
        rise = ((high - low) % NODES) * TURN / NODES
        # the longer stroke is the forward one where the ratio is above one
        choices = []
        for forward in (True, False):
            stroke = rise if forward else TURN - rise
            choices.append(self._misses(way, stroke))
        rank = np.concatenate(choices)
        order = np.argsort(rank, kind="stable")
        for i in spread.distinct(np.vstack([d, d]), order, count):
            k, sense = i % len(d), 1.0 if i < len(d) else -1.0
            ends = [low[k], high[k]]
            unknowns, given = self._own(float(u[0, ends[0]]), float(rise[k]), sense)
            stroke = self.stroke if self.stroke is not None else unknowns[self.key("stroke")][0]
            at = float(u[0, ends[0]]) + sense * stroke * np.arange(2)
            yield Drawn(d[k], unknowns, given, at, x[k, ends], sigma[k], float(rank[i]))

    def _misses(self, way: Floats, stroke: Floats) -> Floats:
        """Return how far ways and strokes are from what is asked for."""
        miss = np.zeros(len(way))
        if self.asked.reach is not None:
            miss = miss + np.abs(np.log(np.maximum(way, 1e-9 * self.size) / self.asked.reach))
        elif self.word == "reach" and not self.exact:
            miss = miss + self.sense * np.log(np.maximum(way, 1e-9 * self.size) / self.size)
        if self.stroke is not None:
            miss = miss + np.abs(stroke - self.stroke)
        elif self.word == "time_ratio":
            miss = miss + (0.0 if self.exact else self.sense) * stroke + 10 * (stroke < np.pi)
        return miss

    def _own(self, begin: float, rise: float, sense: float) -> NewValues:
        unknowns: dict[str, list[float]] = {self.key("begin"): [begin]}
        if self.stroke is None:
            unknowns[self.key("stroke")] = [rise if sense > 0 else TURN - rise]
        return unknowns, {self.key("sense"): sense, self.key("upward"): 1.0}

    def completed(self, spread: Spread, drawn: Drawn) -> NewValues:
        start = float(drawn.u[0])
        u = start + TURN * np.arange(NODES) / NODES
        _, x, found = spread.followed(drawn.d, drawn.x[0], start, u)
        place = self.space.poses.part(found, self.asked.coordinate)[:, 0]
        ends = [int(np.argmin(place)), int(np.argmax(place))]
        rise = float((u[ends[1]] - u[ends[0]]) % TURN)
        wanted = self.stroke if self.stroke is not None else np.pi + 1.0
        sense = 1.0 if abs(rise - wanted) < abs(TURN - rise - wanted) else -1.0
        unknowns, given = self._own(float(u[ends[0]]), rise, sense)
        return unknowns | {self.key("x"): x[ends]}, given

"""Function generation: an output coordinate follows a function of the input over an interval.

Nodes are those of Chebyshev and Lobatto: the error of the best design is largest near the
ends. Least squares, or minimax with a bound t of |error| at all nodes. The ranges of the scales
are given, where they start may be free, and so may be the sense of the output. Exact targets are
constraints.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.tasks.constraints import TransmissionAngle
from mechdae.describe.tasks.goals import FunctionTargets
from mechdae.design.synthesis.fourbar.freudenstein import FunctionStart, function_starts
from mechdae.design.synthesis.fourbar.starts import FourBarStarts
from mechdae.design.synthesis.goals.base import Drawn, Goal
from mechdae.design.synthesis.nlp import NewValues, Nlp, Values
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.robust.values import Row, deviation, moments, summed, variables
from mechdae.design.synthesis.space import TURN, WIDE
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.trace import MET, Trace, grid_of, maxima, moved
from mechdae.design.synthesis.verification.claims import Claim
from mechdae.equations.model import Model
from mechdae.types import Floats, Sym

if TYPE_CHECKING:
    from numpy.random import Generator


SX = ca.SX
SAMPLES = 30_000
COARSE = 9
"""Nodes at which samples are compared."""
LEAST = 0.05
"""Least sine of the transmission angle of starts where no limit is asked for."""


class Function(Goal):
    """A function between input and output."""

    deviates = True

    def __init__(self, asked: FunctionTargets, name: str) -> None:
        self.asked, self.name = asked, name
        self.minimax: bool = asked.measure == "minimax"
        self.exact: bool = asked.measure == "exact"
        self.between_nodes: bool = not asked.targets
        self.senses: tuple[int, ...] = asked.senses
        self.inputs, self.outputs = self._scales(asked.nodes)
        self.size: float = float(np.ptp(self.outputs)) or 1.0
        self.unit: float = self.size if self.minimax else self.size**2
        self.weight: float = 10.0 if self.minimax else 1.0

    def _scales(self, count: int, even: bool = False) -> tuple[Floats, Floats]:
        """Return input and output at nodes, each from the start of its scale."""
        share = (1 - np.cos(np.pi * np.arange(count) / max(count - 1, 1))) / 2
        share = np.linspace(0, 1, count) if even else share
        inputs, outputs = self.asked.scales(share.tolist())
        return np.array(inputs), np.array(outputs)

    def bodies(self) -> tuple[str, ...]:
        return (self.asked.output,)

    def asks(self, model: Model) -> Mapping[str, Sym]:
        c = coordinate(model.mechanism, self.asked.output)
        return {self.asked.output: model.coordinate(c)}

    # -- the problem -------------------------------------------------------------------------

    def add(self, nlp: Nlp, d: Sym, sigma: Sym) -> Sym:
        space, goal = self.space, self.asked
        count = len(self.inputs)
        sense = nlp.parameter(self.key("sense"), 1.0)
        inputs = nlp.parameter(self.key("inputs"), self.inputs)
        outputs = nlp.parameter(self.key("outputs"), self.outputs)
        begin = self._start(nlp, "begin", goal.input_start, d)
        end = self._start(nlp, "end", goal.output_start, d)
        worst = nlp.variable(self.key("worst"), int(self.minimax), 0.0, np.inf)
        x = space.pose_variables(nlp, self.key("x"), count)
        term = SX(0)
        rows: list[Row] = []
        for i in range(count):
            values = space.at(nlp, x[:, i], begin + inputs[i], d, sigma)
            value = space.poses.part(values, goal.output)
            error = (value - end - sense * outputs[i]) / self.size
            bound = worst
            if self.deviations is not None:
                A = self._deviation(x[:, i], begin + inputs[i], d)
                rows.append((1.0 / count, error, A))
                bound = worst - self.deviations.factor * deviation(A)
            if self.exact:
                nlp.constrain("target", error, unit=self.size)
            elif self.minimax:
                nlp.constrain("error", error - bound, -np.inf, 0.0)
                nlp.constrain("error", error + bound, 0.0, np.inf)
            else:
                term += ca.sumsqr(error) / count
        if self.minimax:
            return worst
        if self.deviations is None:
            return term
        typical = self.deviations.typical(self._deviation, space)
        return summed(nlp, self.name, rows, self.deviations.factor, typical)

    # -- deviations by tolerances ------------------------------------------------------------

    def _deviation(self, x: object, u: object, d: object) -> Any:
        """Return the (dimensionless) deviations (1, nt) of the output at a pose."""
        assert self.deviations is not None
        return self.deviations.of(self.asked.output, x, u, d) / self.size

    def _sigma_of(self, x: Any, u: Any, d: Any) -> Any:
        return self.size * deviation(self._deviation(x, u, d))

    def _deviating(self, values: Values, given: Values, u: Any, x: Any, d: Any) -> dict[str, Any]:
        places = [np.array(self.space.poses.function(x[i], u[i], d)[2]).ravel()
                  for i in range(len(u))]  # fmt: skip
        value = self.space.poses.part(np.array(places), self.asked.output)[:, 0]
        end = self._value(values, "end", self.asked.output_start)
        errors = (
            value - end - given[self.key("sense")] * given.get(self.key("outputs"), self.outputs)
        )
        if self.minimax:
            most = np.max(np.abs(errors) + self._added(x, u, d))
            return {self.key("worst"): [most / self.size]}
        slopes = [np.array(ca.DM(self._deviation(x[i], u[i], d))) for i in range(len(u))]
        share = 1.0 / len(u)
        rows = [(share, np.atleast_1d(e) / self.size, A)
                for e, A in zip(errors, slopes, strict=True)]  # fmt: skip
        return {variables(self.name): moments(rows)}

    def _start(self, nlp: Nlp, word: str, given: float | str | None, d: Sym) -> Sym:
        """Return where a scale starts: a number, a free parameter, or a variable of its own."""
        if isinstance(given, str):
            return d[self.space.names.index(given)]
        if given is not None:
            return SX(given)
        return nlp.variable(self.key(word), 1, -WIDE, WIDE)

    def _value(self, values: Values, word: str, asked: float | str | None) -> float:
        if isinstance(asked, str):
            return float(values["d"][self.space.names.index(asked)])
        return float(values[self.key(word)][0]) if asked is None else float(asked)

    def programme(self, values: Values, given: Values) -> tuple[Floats, Floats]:
        begin = self._value(values, "begin", self.asked.input_start)
        inputs = given.get(self.key("inputs"), self.inputs)
        return begin + inputs, self.poses_of(values, len(inputs))

    # -- starts ------------------------------------------------------------------------------

    def drawn(self, kind: str, generator: Generator, count: int) -> Iterable[Drawn]:
        starts = self._by_equation(kind, generator, count) or []
        yield from starts
        if len(starts) < count:
            yield from self._any(generator, count - len(starts))

    def _by_equation(self, kind: str, generator: Generator, count: int) -> list[Drawn] | None:
        """Return starts by Freudenstein's equation, None where it does not say all."""
        space, goal = self.space, self.asked
        if not space.single_loop or space.asked.choices or kind:
            return None
        loop = space.loop
        assert loop is not None
        c = coordinate(space.poses.mechanism, goal.output)
        fixed = [value for value in (goal.input_start, goal.output_start)
                 if value is not None and not isinstance(value, str)]  # fmt: skip
        if fixed or not c.is_angle or loop.rocker not in self._bodies_of(c):
            return None
        starts = FourBarStarts(space, loop.pins["A"])
        ground = starts.ground()
        limits = starts.limits() / ground
        low, high = limits[1:, 0].min(), limits[1:, 1].max()
        if not 0 < low < high:
            return None
        least = max(
            (float(np.sin(t.min)) for t in space.asked.of(TransmissionAngle)), default=LEAST
        )
        found = function_starts(
            self.inputs, self.outputs, keep=count, seed=generator, lengths=(low, high),
            least=max(least, 1e-3), senses=self.senses,
        )  # fmt: skip
        return [self._placed(start, starts, ground) for start in found]

    def _bodies_of(self, c: NamedCoordinate) -> tuple[str, ...]:
        if c.kind == "body angle":
            return (c.part,)
        joint = self.space.poses.mechanism.joints[c.part]
        return tuple(joint.bodies)

    def _placed(self, start: FunctionStart, starts: FourBarStarts, ground: float) -> Drawn:
        """Return a start in the parameters of the mechanism, with its poses."""
        space, goal = self.space, self.asked
        turns = start.input_start + self.inputs
        d = starts.with_lengths(start.lengths * ground)
        d, u, x, sigma = starts.placed(starts.closed(start, turns), d)
        u = u - self.inputs  # the same everywhere
        begin = self._put(d, goal.input_start, float(u[0]))
        u = begin + self.inputs
        values = [np.array(space.poses.function(x[i], u[i], d)[2]).ravel() for i in range(len(u))]
        value = np.unwrap(space.poses.part(np.array(values), goal.output)[:, 0])
        error = value - start.sense * self.outputs
        end = self._put(d, goal.output_start, float(np.mean(error)))
        x = x + np.where(space.turns, end - float(np.mean(error)), 0.0)
        unknowns = {self.key("worst"): [start.worst / self.size]}
        if goal.input_start is None:
            unknowns[self.key("begin")] = [begin]
        if goal.output_start is None:
            unknowns[self.key("end")] = [end]
        given = {self.key("sense"): float(start.sense)}
        return Drawn(d, unknowns, given, u, x, sigma, start.worst / self.size)

    def _put(self, d: Floats, name: float | str | None, value: float) -> float:
        """Return an angle brought into its bounds by whole turns, where it is a parameter."""
        if not isinstance(name, str):
            return value
        k = self.space.names.index(name)
        low, high = self.space.box[k]
        value += TURN * np.ceil((low - value) / TURN)
        d[k] = min(value, high)
        return float(d[k])

    def _any(self, generator: Generator, count: int) -> Iterable[Drawn]:
        """Yield designs drawn in the box that come nearest to the function."""
        spread = Spread(self.space)
        d = spread.designs(generator, SAMPLES)
        first = self._first(d, generator)
        coarse_in, coarse_out = self._scales(COARSE)
        closed, x, _, values = spread.moved(d, first[:, None] + coarse_in, generator)
        d, first = d[closed], first[closed]
        value = self.space.poses.part(values, self.asked.output)[..., 0]
        ranked, senses, ends = [], [], []
        for sense in self.senses:
            error = value - sense * coarse_out
            end = self._ends(d, error)
            rms = np.sqrt(np.mean((error - end[:, None]) ** 2, axis=1)) / self.size
            ranked.append(rms)
            senses += [sense] * len(rms)
            ends.append(end)
        whole, end = np.concatenate(ranked), np.concatenate(ends)
        good = np.flatnonzero(np.isfinite(whole))
        order = good[np.argsort(whole[good], kind="stable")]
        for i in spread.distinct(np.vstack([d] * len(self.senses)), order, count):
            k = i % len(d)
            u = first[k] + self.inputs
            on, poses, found = spread.followed(d[k], x[k, 0], float(u[0]), u)
            if not on:
                continue
            error = self.space.poses.part(found, self.asked.output)[:, 0] - senses[i] * self.outputs
            unknowns = {self.key("worst"): [np.abs(error - end[i]).max() / self.size]}
            if self.asked.input_start is None:
                unknowns[self.key("begin")] = [first[k]]
            if self.asked.output_start is None:
                unknowns[self.key("end")] = [end[i]]
            sigma = self.space.poses.branch(poses[0], u[0], d[k])
            given = {self.key("sense"): float(senses[i])}
            yield Drawn(d[k], unknowns, given, u, poses, sigma, float(whole[i]))

    def _first(self, d: Floats, generator: Generator) -> Floats:
        start = self.asked.input_start
        if isinstance(start, str):
            return self.of_free(start, d)
        if start is None:
            return generator.uniform(0, TURN, len(d))
        return np.full(len(d), float(start))

    def _ends(self, d: Floats, error: Floats) -> Any:
        start = self.asked.output_start
        if start is None:
            return error.mean(axis=1)
        if isinstance(start, str):
            return self.of_free(start, d)
        return np.full(len(error), float(start))

    def first(self, d: Floats) -> float | None:
        given = self.asked.input_start
        return float(self.of_free(given, d)) if isinstance(given, str) else given

    def completed(self, spread: Spread, drawn: Drawn) -> NewValues:
        start = float(drawn.u[0])
        given_start = self.asked.input_start
        begin = start
        if isinstance(given_start, str):
            begin = float(self.of_free(given_start, drawn.d))
        elif given_start is not None:
            begin = float(given_start)
        _, x, found = spread.followed(drawn.d, drawn.x[0], start, begin + self.inputs)
        value = self.space.poses.part(found, self.asked.output)[:, 0]
        sense = float(min(self.senses, key=lambda s: np.ptp(value - s * self.outputs)))
        error = value - sense * self.outputs
        unknowns = {
            self.key("x"): x, self.key("begin"): [begin], self.key("end"): [error.mean()],
            self.key("worst"): [np.ptp(error) / 2 / self.size],
        }  # fmt: skip
        return unknowns, {self.key("sense"): sense}

    # -- the true extremes ---------------------------------------------------------------------

    def _extremes(self, values: Values, given: Values) -> tuple[Trace, Floats, Floats, Floats]:
        """Return the design, its nodes as shares of the interval, shares of extremes, errors."""
        begin = self._value(values, "begin", self.asked.input_start)
        end = self._value(values, "end", self.asked.output_start)
        u, x = self.programme(values, given)
        d = dimensions(values["d"], given)
        trace, nodes = Trace(self.spread, d, u, x), (u - begin) / self.asked.input_range
        sense = given[self.key("sense")]

        def error(shares: Floats) -> Any:
            inputs, outputs = (np.array(part) for part in self.asked.scales(shares.tolist()))
            x, _, found, held = trace.poses(begin + inputs)
            value = self.space.poses.part(found, self.asked.output)[:, 0]
            size = np.abs(value - end - sense * outputs) + self._added(x, begin + inputs, d)
            return np.where(held, size, np.nan)

        return trace, nodes, *maxima(error, grid_of(nodes))

    def refined(self, spread: Spread, values: Values, given: Values) -> NewValues | None:
        if not self.minimax or self.asked.targets:
            return None
        trace, nodes, places, tops = self._extremes(values, given)
        worst = float(values[self.key("worst")][0]) * self.size
        if not len(tops) or not tops.max() > worst * (1 + MET):
            return None
        held = np.isin(np.arange(len(nodes)), (0, len(nodes) - 1))
        inputs, outputs = (
            np.array(p) for p in self.asked.scales(moved(nodes, places, tops, held).tolist())
        )
        begin = self._value(values, "begin", self.asked.input_start)
        unknowns = {
            self.key("x"): trace.poses(begin + inputs)[0],
            self.key("worst"): [tops.max() / self.size],
        }
        return unknowns, {self.key("inputs"): inputs, self.key("outputs"): outputs}

    def claim(self, values: Values, given: Values) -> Claim:
        at, _ = self.programme(values, given)
        refined = self.minimax and not self.asked.targets
        return Claim(
            at, sense=float(given[self.key("sense")]),
            input_start=self._value(values, "begin", self.asked.input_start),
            output_start=self._value(values, "end", self.asked.output_start),
            between=self._extremes(values, given)[2] if refined else (),
        )  # fmt: skip

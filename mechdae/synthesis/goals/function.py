"""Function generation: an output coordinate follows a function of the input over an interval.

Nodes are those of Chebyshev and Lobatto: the error of the best design is largest near the
ends. Least squares, or minimax with a bound t of |error| at all nodes. The ranges of the scales
are given, where they start may be free; so is the sense of the output.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.goals import FunctionTargets
from mechdae.synthesis.nlp import Nlp
from mechdae.synthesis.search import TURN, WIDE, Goal, Seed, Space
from mechdae.synthesis.spread import Spread, drawn

SX = ca.SX
SAMPLES = 30_000
COARSE = 9
"""Nodes at which samples are compared."""
TRIES = 200
"""Random poses from which a start is moved over all nodes again."""
LEAST = 0.05
"""Least |determinant| relative to its columns at the nodes."""


class Function(Goal):
    """A function between input and output.

    Parameters
    ----------
    space
        Whose poses ask for the output alone.
    asked
        Function, ranges, starts of the scales, measure.
    """

    def __init__(self, space: Space, asked: FunctionTargets) -> None:
        self.space, self.asked = space, asked
        self.minimax = asked.measure == "minimax"
        self.inputs, self.outputs = self._scales(asked.nodes)

    def _scales(self, count: int) -> tuple[Any, Any]:
        """Return input and output at nodes, each from the start of its scale."""
        share = (1 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2
        inputs, outputs = self.asked.scales(share)
        return np.array(inputs), np.array(outputs)

    # -- the problem -------------------------------------------------------------------------

    def build(self, kind: str) -> Nlp:
        nlp, space, asked = Nlp(), self.space, self.asked
        d = space.design(nlp)
        count = len(self.inputs)
        sigma = nlp.parameter("sigma", np.ones(space.poses.nb))
        sense = nlp.parameter("sense", 1.0)
        inputs, outputs = (
            nlp.parameter("inputs", self.inputs),
            nlp.parameter("outputs", self.outputs),
        )
        begin = self._start(nlp, "input_start", asked.input_start, d)
        end = self._start(nlp, "output_start", asked.output_start, d)
        worst = nlp.variable("worst", int(self.minimax), 0.0, np.inf)
        x = space.pose_variables(nlp, "x", count)
        for i in range(count):
            value = space.at(nlp, x[:, i], begin + inputs[i], d, sigma)
            error = value - end - sense * outputs[i]
            if self.minimax:
                nlp.constrain("error", error - worst, -np.inf, 0.0)
                nlp.constrain("error", error + worst, 0.0, np.inf)
            else:
                nlp.objective += ca.sumsqr(error) / count
        if self.minimax:
            nlp.objective = 10 * worst
        space.full_turn(nlp, d, kind)
        return nlp

    def _start(self, nlp: Nlp, name: str, given: float | str | None, d: Any) -> Any:
        """Return where a scale starts: a number, a free parameter, or a variable of its own."""
        if isinstance(given, str):
            return d[self.space.poses.free.index(given)]
        if given is not None:
            return SX(given)
        return nlp.variable(name, 1, -WIDE, WIDE)

    def objective(self, value: float) -> float:
        return value / 10 if self.minimax else float(np.sqrt(value))

    def driver_values(self, values: Mapping[str, Any], given: Mapping[str, Any]) -> Any:
        return self._begin(values) + self.inputs

    def _begin(self, values: Mapping[str, Any]) -> float:
        asked = self.asked.input_start
        if isinstance(asked, str):
            return float(values["d"][self.space.poses.free.index(asked)])
        return float(values["input_start"][0]) if asked is None else float(asked)

    # -- starts ------------------------------------------------------------------------------

    def seeds(self, kind: str, nlp: Nlp, generator: Any, count: int) -> Iterable[Seed]:
        """Yield designs drawn in the box that come nearest to the function."""
        space = self.space
        spread = Spread(space.poses, space.size)
        d = drawn(generator, space.box, SAMPLES)
        first = self._first(d, generator)
        coarse_in, coarse_out = self._scales(COARSE)
        held, _, sigma, values = spread.moved(d, first[:, None] + coarse_in, generator)
        found: list[tuple[float, int, int]] = []
        for sense in (1, -1):
            error = values[:, :, 0] - sense * coarse_out
            ends = self._ends(d, error)
            rms = np.sqrt(np.mean((error - ends[:, None]) ** 2, axis=1))
            rms[~held] = np.inf
            order = np.argsort(rms, kind="stable")[:count]
            found += [(float(rms[i]), sense, int(i)) for i in order if np.isfinite(rms[i])]
        found.sort()
        for rms, sense, i in found[:count]:
            seed = self._moved(spread, d[i], float(first[i]), sigma[i], sense, rms, generator)
            if seed is not None:
                yield seed

    def _first(self, d: Any, generator: Any) -> Any:
        asked = self.asked.input_start
        if isinstance(asked, str):
            return d[:, self.space.poses.free.index(asked)]
        if asked is None:
            return generator.uniform(0, TURN, len(d))
        return np.full(len(d), float(asked))

    def _ends(self, d: Any, error: Any) -> Any:
        asked = self.asked.output_start
        if asked is None:
            return error.mean(axis=1)
        if isinstance(asked, str):
            return d[:, self.space.poses.free.index(asked)]
        return np.full(len(error), float(asked))

    def _moved(
        self, spread: Spread, d: Any, first: float, sigma: Any, sense: int, rms: float,
        generator: Any,
    ) -> Seed | None:  # fmt: skip
        """Return the start with its poses at all nodes, from the same branch."""
        many = np.repeat(d[None, :], TRIES, axis=0)
        u = np.repeat((first + self.inputs)[None, :], TRIES, axis=0)
        held, x, signs, values = spread.moved(many, u, generator)
        error = values[:, :, 0] - sense * self.outputs
        ends = self._ends(many, error)
        size = np.sqrt(np.mean((error - ends[:, None]) ** 2, axis=1))
        size[~held | (signs != sigma).any(axis=1)] = np.inf
        k = int(np.argmin(size))
        if not np.isfinite(size[k]):
            return None
        given = {"sigma": sigma, "sense": float(sense)}
        values_of = {
            "d": d, "input_start": [first], "output_start": [ends[k]],
            "worst": [np.abs(error[k] - ends[k]).max()] if self.minimax else [], "x": x[k],
        }  # fmt: skip
        return Seed(values_of, given, rms)

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

from mechdae.describe.coordinates import coordinate
from mechdae.describe.goals import FunctionTargets
from mechdae.model.model import Model
from mechdae.synthesis.goals.base import Drawn, Goal, Worth
from mechdae.synthesis.nlp import Nlp
from mechdae.synthesis.space import TURN, WIDE
from mechdae.synthesis.spread import Spread
from mechdae.synthesis.verify import Design

SX = ca.SX
SAMPLES = 30_000
COARSE = 9
"""Nodes at which samples are compared."""
FINE = 721
"""Places at which a design is judged."""


class Function(Goal):
    """A function between input and output."""

    def __init__(self, asked: FunctionTargets, name: str) -> None:
        self.asked, self.name = asked, name
        self.minimax = asked.measure == "minimax"
        self.inputs, self.outputs = self._scales(asked.nodes)
        self.size = float(np.ptp(self.outputs)) or 1.0
        self.unit = self.size if self.minimax else self.size**2
        self.weight = 10.0 if self.minimax else 1.0

    def _scales(self, count: int, even: bool = False) -> tuple[Any, Any]:
        """Return input and output at nodes, each from the start of its scale."""
        share = (1 - np.cos(np.pi * np.arange(count) / max(count - 1, 1))) / 2
        share = np.linspace(0, 1, count) if even else share
        inputs, outputs = self.asked.scales(share.tolist())
        return np.array(inputs), np.array(outputs)

    def bodies(self) -> tuple[str, ...]:
        return (self.asked.output,)

    def asks(self, model: Model) -> Mapping[str, Any]:
        c = coordinate(model.mechanism, self.asked.output)
        return {self.asked.output: model.coordinate(c)}

    # -- the problem -------------------------------------------------------------------------

    def add(self, nlp: Nlp, d: Any, sigma: Any) -> Any:
        space, asked = self.space, self.asked
        count = len(self.inputs)
        sense = nlp.parameter(self.own("sense"), 1.0)
        inputs = nlp.parameter(self.own("inputs"), self.inputs)
        outputs = nlp.parameter(self.own("outputs"), self.outputs)
        begin = self._start(nlp, "begin", asked.input_start, d)
        end = self._start(nlp, "end", asked.output_start, d)
        worst = nlp.variable(self.own("worst"), int(self.minimax), 0.0, np.inf)
        x = space.pose_variables(nlp, self.own("x"), count)
        term = SX(0)
        for i in range(count):
            values = space.at(nlp, x[:, i], begin + inputs[i], d, sigma)
            value = space.poses.part(values, asked.output)
            error = (value - end - sense * outputs[i]) / self.size
            if self.minimax:
                nlp.constrain("error", error - worst, -np.inf, 0.0)
                nlp.constrain("error", error + worst, 0.0, np.inf)
            else:
                term += ca.sumsqr(error) / count
        return worst if self.minimax else term

    def _start(self, nlp: Nlp, word: str, given: float | str | None, d: Any) -> Any:
        """Return where a scale starts: a number, a free parameter, or a variable of its own."""
        if isinstance(given, str):
            return d[self.space.names.index(given)]
        if given is not None:
            return SX(given)
        return nlp.variable(self.own(word), 1, -WIDE, WIDE)

    def _value(self, values: Mapping[str, Any], word: str, asked: float | str | None) -> float:
        if isinstance(asked, str):
            return float(values["d"][self.space.names.index(asked)])
        return float(values[self.own(word)][0]) if asked is None else float(asked)

    def programme(self, values: Mapping[str, Any], given: Mapping[str, Any]) -> tuple[Any, Any]:
        begin = self._value(values, "begin", self.asked.input_start)
        return begin + self.inputs, self.poses_of(values)

    # -- starts ------------------------------------------------------------------------------

    def drawn(self, kind: str, generator: Any, count: int) -> Iterable[Drawn]:
        """Yield designs drawn in the box that come nearest to the function."""
        spread = Spread(self.space)
        d = spread.designs(generator, SAMPLES)
        first = self._first(d, generator)
        coarse_in, coarse_out = self._scales(COARSE)
        kept, x, _, values = spread.moved(d, first[:, None] + coarse_in, generator)
        d, first = d[kept], first[kept]
        value = self.space.poses.part(values, self.asked.output)[..., 0]
        ranked, senses, ends = [], [], []
        for sense in (1, -1):
            error = value - sense * coarse_out
            end = self._ends(d, error)
            rms = np.sqrt(np.mean((error - end[:, None]) ** 2, axis=1)) / self.size
            ranked.append(rms)
            senses += [sense] * len(rms)
            ends.append(end)
        whole, end = np.concatenate(ranked), np.concatenate(ends)
        good = np.flatnonzero(np.isfinite(whole))
        order = good[np.argsort(whole[good], kind="stable")]
        for i in spread.distinct(np.vstack([d, d]), order, count):
            k = i % len(d)
            u = first[k] + self.inputs
            on, poses, found = spread.followed(d[k], x[k, 0], float(u[0]), u)
            if not on:
                continue
            error = self.space.poses.part(found, self.asked.output)[:, 0] - senses[i] * self.outputs
            own = {self.own("worst"): [np.abs(error - end[i]).max() / self.size]}
            if self.asked.input_start is None:
                own[self.own("begin")] = [first[k]]
            if self.asked.output_start is None:
                own[self.own("end")] = [end[i]]
            sigma = np.sign(np.array(self.space.poses.function(poses[0], u[0], d[k])[1]).ravel())
            given = {self.own("sense"): float(senses[i])}
            yield Drawn(d[k], own, given, u, poses, sigma, float(whole[i]))

    def _first(self, d: Any, generator: Any) -> Any:
        asked = self.asked.input_start
        if isinstance(asked, str):
            return self.of_free(asked, d)
        if asked is None:
            return generator.uniform(0, TURN, len(d))
        return np.full(len(d), float(asked))

    def _ends(self, d: Any, error: Any) -> Any:
        asked = self.asked.output_start
        if asked is None:
            return error.mean(axis=1)
        if isinstance(asked, str):
            return self.of_free(asked, d)
        return np.full(len(error), float(asked))

    def completed(self, spread: Spread, drawn: Drawn) -> tuple[dict[str, Any], dict[str, Any]]:
        start = float(drawn.u[0])
        given_start = self.asked.input_start
        begin = start
        if isinstance(given_start, str):
            begin = float(self.of_free(given_start, drawn.d))
        elif given_start is not None:
            begin = float(given_start)
        _, x, found = spread.followed(drawn.d, drawn.x[0], start, begin + self.inputs)
        value = self.space.poses.part(found, self.asked.output)[:, 0]
        gaps = [value - s * self.outputs for s in (1.0, -1.0)]
        sense = 1.0 if np.ptp(gaps[0]) <= np.ptp(gaps[1]) else -1.0
        error = gaps[0] if sense > 0 else gaps[1]
        own = {
            self.own("x"): x, self.own("begin"): [begin], self.own("end"): [error.mean()],
            self.own("worst"): [np.ptp(error) / 2 / self.size],
        }  # fmt: skip
        return own, {self.own("sense"): sense}

    # -- what a design is worth --------------------------------------------------------------

    def worth(self, design: Design) -> Worth:
        begin = self._value(design.values, "begin", self.asked.input_start)
        end = self._value(design.values, "end", self.asked.output_start)
        inputs, outputs = (
            (self.inputs, self.outputs) if self.asked.points else self._scales(FINE, even=True)
        )
        found, defects = design.swept(begin + inputs, (self.asked.output,))
        if found is None:
            return Worth(np.inf, np.full(len(inputs), np.nan), defects)
        c = coordinate(design.problem.mechanism, self.asked.output)
        value = _series(found, c)
        errors = value - end - design.given[self.own("sense")] * outputs
        if c.is_angle:
            errors = errors - TURN * np.round(np.nanmedian(errors) / TURN)
        size = np.abs(errors)
        own = float(size.max()) if self.minimax else float(np.mean(errors**2))
        return Worth(own, errors, defects)


def _series(found: Any, c: Any) -> Any:
    """Return the values of a coordinate."""
    if c.kind == "body angle":
        return found.bodies[c.part].angle
    if c.kind == "point":
        return found.points[f"{c.part}.{c.point}"].position[:, c.axis]
    word = {"joint angle": "angle", "slide": "slide", "curve": "s"}[c.kind]
    return found.joints[c.part][word]

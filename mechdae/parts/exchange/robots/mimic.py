"""Polynomials that stand for a loop: joints' coordinates over the driver's range, errors proved.

The driver's range is covered by proved steps (`mechdae.motion.continuation.series_steps`): over
each the unknowns lie within a known radius of a polynomial, for every value of the driver and not
only at poses. Coordinates are evaluated with these polynomials and bounds; their difference from
the fitted polynomial is brought to Bernstein's form, whose largest coefficient bounds it on the
whole piece.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.polynomial import chebyshev

from mechdae.kernels.bounds.series import (
    BoundedPolynomial,
    NoSeries,
    SeriesFunction,
    coefficients,
)
from mechdae.kernels.run.functions import without_repeats
from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.series_steps import Expansion, Stretch
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats

DEGREES = 160
"""Degree of the fit before what is small is cut off."""
INWARDS = 0.02
"""Share of the range left out before a limit position, where speeds are infinite."""
ALLOWED = 1e-13
"""Share of the sizes of the terms that is added for the rounding of double precision."""
SAME = 1e-9
LONGEST = 4.0
"""Largest proved step, in steps of the path."""
LEAST = 1e-5
"""Smallest one."""


class NotProved(Exception):
    """No polynomial with a proved error; the message says why."""


@dataclass(frozen=True)
class MimicPolynomial:
    """q = sum of ``coefficients`` times Chebyshev's polynomials of the driver, within ``error``."""

    coordinate: str
    coefficients: Floats
    error: float

    def at(self, s: Floats, low: float, high: float) -> Any:
        """Return the values at driver values `s`."""
        return chebyshev.chebval((2 * np.asarray(s) - low - high) / (high - low), self.coefficients)


@dataclass(frozen=True)
class Mimics:
    """The polynomials of a motion over the driver's values from ``low`` to ``high``."""

    low: float
    high: float
    polynomials: dict[str, MimicPolynomial]
    lines: dict[str, MimicPolynomial]


def mimics(motion: ExportedMotion, coordinates: list[str], tolerance: float, size: float) -> Mimics:
    """Return polynomials of joints' coordinates, each with a proved bound of its error."""
    setting, run = motion.single("a mimic polynomial")
    path = run.path
    if not isinstance(path, Path) or any(path.flips):
        raise NotProved("the path goes through change points")
    low, high = _range(run, path)
    columns = _columns(setting, coordinates)
    grid = np.cos(np.pi * (np.arange(DEGREES + 1) + 0.5) / (DEGREES + 1))
    places = (low + high) / 2 + (high - low) / 2 * grid
    poses = run.evaluator.at(path, np.sort(places))
    values = poses.y[0][::-1][:, columns]
    if not np.isfinite(values).all() or poses.uncertain.any():
        raise NotProved("not all of the range is assembled")
    every = chebyshev.chebvander(grid, DEGREES)
    weights = np.full(DEGREES + 1, 2.0)
    weights[0] = 1.0
    fitted = (every.T @ values) * (weights / (DEGREES + 1))[:, None]
    aims = [tolerance * (size if name.endswith(".slide") else 1.0) for name in coordinates]
    cut = [_cut(c, aim) for c, aim in zip(fitted.T, aims, strict=True)]
    lines = [c[:2] for c in fitted.T]
    errors = _errors(setting, path, low, high, columns, [*cut, *lines])
    named = [
        MimicPolynomial(name, c, float(error))
        for name, c, error in zip([*coordinates] * 2, [*cut, *lines], errors, strict=True)
    ]
    half = len(coordinates)
    return Mimics(
        low,
        high,
        dict(zip(coordinates, named[:half], strict=True)),
        dict(zip(coordinates, named[half:], strict=True)),
    )


def _range(run: Run, path: Path) -> tuple[float, float]:
    """Return the driver's range, a little less at limit positions."""
    places = np.asarray(run.places, float)
    good = run.poses.alive.all(axis=1)
    if not np.all(run.poses.places[good] == run.poses.s[good]):
        raise NotProved("some poses are reached whole turns of the driver away")
    if not good.all():
        places = places[good]
    low, high = float(places.min()), float(places.max())
    if not high > low:
        raise NotProved("the driver has one value only")
    margin = INWARDS * (high - low)
    for reach in path.reach.values():
        if reach.low is not None and low - reach.low.s < margin:
            low = max(low, reach.low.s + margin)
        if reach.high is not None and reach.high.s - high < margin:
            high = min(high, reach.high.s - margin)
    return low, high


def _columns(setting: Setting, coordinates: list[str]) -> list[int]:
    found = {
        f"{entry.part}.{entry.name}": entry.columns[0]
        for entry in setting.outputs.entries
        if entry.kind == "joints"
    }
    return [found[name] for name in coordinates]


def _cut(c: Floats, aim: float) -> Floats:
    """Return the coefficients without those at the end that are small together."""
    tails = np.cumsum(np.abs(c[::-1]))[::-1]
    keep = int(np.argmax(tails <= aim / 2)) if (tails <= aim / 2).any() else len(c)
    return c[: max(keep, 1)].copy()


def _errors(
    setting: Setting, path: Path, low: float, high: float, columns: list[int], fits: list[Floats]
) -> Floats:
    """Return bounds of the differences between coordinates and fits over the whole range."""
    scene = setting.scene
    p = ca.DM(path.constants.p)
    some = ca.substitute(ca.densify(setting.outputs.expression[columns]), scene.model.p, p)
    try:
        function = SeriesFunction(without_repeats("coordinates", [scene.x, scene.u], [some]))
    except NoSeries:
        raise NotProved("a coordinate is no sum of products, sines and cosines") from None
    fit = _Fit(fits, low, high)
    worst = np.zeros(len(fits))
    for stretch in _stretches(path, low, high):
        count = len(stretch.c)
        x = [
            BoundedPolynomial(stretch.c[:, i].copy(), float(stretch.radius[i]))
            for i in range(stretch.c.shape[1])
        ]
        line = np.zeros(count)
        line[:2] = stretch.s, stretch.step
        (found,) = function([x, [BoundedPolynomial(line)]])
        c, e = coefficients(found, count)
        twice = np.concatenate([c, c], axis=1), np.concatenate([e, e])
        worst = np.maximum(worst, fit.apart(stretch.s, stretch.step, *twice))
    return worst


def _stretches(path: Path, low: float, high: float) -> list[Stretch]:
    """Return proved steps that cover the range."""
    graphs = path.graphs
    blocks = list(range(len(graphs.blocks)))
    found: list[Stretch] = []
    sizes = graphs.scene.unknowns.sizes(path.constants.scale)
    expansion = _NumericExpansion(graphs, path.constants, sizes)
    s = low
    k = min(max(int(np.searchsorted(path.s, s, side="right")) - 1, 0), len(path.s) - 1)
    state = path.step(path.state[k], path.s[k], s - path.s[k])[0]
    while s < high:
        wanted = min(LONGEST * path.largest, high - s)
        if not graphs.nx:  # everything follows from the driver in closed form
            found.append(Stretch(s, wanted, np.zeros((ORDER, 0)), np.zeros(0)))
            s = s + wanted if wanted < high - s else high
            continue
        u = path.drivers(np.array([s]))[0]
        least = min(LEAST * path.largest, wanted)
        stretch = expansion.stretch(state, s, u, path.d, wanted, least, blocks)
        if stretch is None:
            raise NotProved(f"no step is proved at {s:.6g}")
        found.append(stretch)
        nxt = high if stretch.step >= high - s else s + stretch.step
        state = path.step(state, s, nxt - s)[0]
        apart = np.abs(state[: graphs.nx] - stretch.at((nxt - s) / stretch.step))
        if not np.all(apart <= stretch.radius + SAME * np.maximum(1.0, np.abs(stretch.at(1.0)))):
            raise NotProved(f"a step from {s:.6g} ends on another branch")
        s = nxt
    return found


class _NumericExpansion(Expansion):
    """Proves steps for numbers that are put in: what depends on them alone needs no series."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._made: dict[int, SeriesFunction | None] = {}

    def _function(self, b: int) -> SeriesFunction | None:
        if b not in self._made:
            graph = self.graphs.blocks[b]
            p = ca.DM(self.constants.p[graph.params])
            parts = [ca.densify(graph.F), ca.densify(ca.vec(graph.J))]
            results = [ca.substitute(part, graph.p, p) for part in parts]
            inputs = [graph.x, graph.z, self.graphs.scene.u, graph.p]
            try:
                made = SeriesFunction(without_repeats("FJ", inputs, results))
            except NoSeries:
                made = None
            self._made[b] = None if graph.redundant else made
        return self._made[b]


class _Fit:
    """Fitted polynomials, and how far others are from them on intervals."""

    def __init__(self, fits: list[Floats], low: float, high: float) -> None:
        self.low, self.high = low, high
        self.fits = [(c, *_derivatives(c)) for c in fits]

    def apart(self, s: float, step: float, c: Floats, e: Floats) -> Floats:
        """Return bounds of |y - P| over [s, s + step] for y = c_0 + c_1 t + ... within e."""
        return np.array(
            [
                self._one(fit, s, step, terms, error)
                for fit, terms, error in zip(self.fits, c.T, e, strict=True)
            ]
        )

    def _one(self, fit: tuple[Any, ...], s: float, step: float, y: Floats, error: float) -> float:
        coefficients, rates, above = fit
        half = (self.high - self.low) / 2
        pieces = max(1, int(np.ceil(2 * (step / half) * len(coefficients))))
        starts, width = np.arange(pieces) / pieces, 1 / pieces
        x = (s + starts * step - self.low) / half - 1
        delta = width * step / half
        terms = np.stack(
            [chebyshev.chebval(x, rate) * delta**k for k, rate in enumerate(rates)]
        )  # (k, pieces), divided by k! already
        shifted = _shifted(y, starts, width, len(terms))
        left = above * delta ** len(rates)
        bound = np.abs(BERNSTEIN @ (shifted - terms)).max()
        size = np.abs(y).sum() + np.abs(coefficients).sum()
        return float(bound + left + error + ALLOWED * size)


ORDER = 16
"""Coefficients of the difference on a piece."""


def _binomials(count: int) -> Any:
    table = np.zeros((count, count))
    for n in range(count):
        table[n, 0] = 1.0
        for k in range(1, n + 1):
            table[n, k] = table[n - 1, k - 1] + (table[n - 1, k] if k < n else 0.0)
    return table


BINOMIALS = _binomials(ORDER)
BERNSTEIN = BINOMIALS / BINOMIALS[-1][None, :]
"""From powers of t to Bernstein's polynomials on 0 <= t <= 1: b_i = sum C(i,k)/C(n,k) a_k."""


def _shifted(y: Floats, starts: Floats, width: float, count: int) -> Floats:
    """Return the coefficients (count, pieces) of y(start + width t)."""
    powers = starts[None, :] ** np.arange(len(y))[:, None]
    found = np.zeros((count, len(starts)))
    for k in range(min(count, len(y))):
        rows = np.arange(k, len(y))
        found[k] = (y[rows] * BINOMIALS[rows, k]) @ powers[rows - k] * width**k
    return found


def _derivatives(c: Floats) -> tuple[list[Floats], float]:
    """Return P, P', P''/2, ... as Chebyshev series, and a bound of the next one on the range."""
    rates, series = [], np.asarray(c, float)
    for k in range(ORDER):
        rates.append(series)
        series = chebyshev.chebder(series) / (k + 1) if len(series) > 1 else np.zeros(1)
    return rates, float(np.abs(series).sum())

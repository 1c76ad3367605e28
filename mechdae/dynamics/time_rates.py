"""What the time alone does to a motion: how fast loads and laws vary, and when they bend.

Steps do not see what varies with the time alone: a mechanism at rest has no error, and a
pulse between two places at which forces are looked at is none. So the time is divided into cells
over each of which all that it does is one polynomial, proved by bounds of Taylor coefficients;
steps are not longer than two of them. Corners of expressions and rows of tables over the time are
breakpoints, at which steps end and begin.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.kernels.bounds.time_rates import ORDER, Tempo, signals
from mechdae.numerics.roots import halved
from mechdae.records import dataclass
from mechdae.types import Floats, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.forces.time_tables import Timed

SX = ca.SX
SMOOTH = 1e-6
"""Share of its range by which what varies may differ from a polynomial over a cell."""
ROUNDING = 1e-13
"""The same as a share of its size."""
FIRST = 16
"""Cells that are tried first."""
BUDGET = 2048
"""Cells and breakpoints that are looked for at once; the others when the motion is there."""
NARROW = 2.0**-40
"""Share of the whole time below which a cell is not divided."""
CELLS = 2.0
"""Cells that a step may reach over."""
ALIKE = 2.0
"""Ratio of the lengths of cells up to which they are one stretch."""
SAMPLES = 17
"""Places in each cell at which corners are looked for."""
FINER = 60
"""Steps to the least size of what makes a corner."""
APART = 4
"""Units of the last place between a breakpoint and the times right before and behind it."""
SAME = 1e-9
"""Share by which a law and its speed may differ on the two sides of a corner."""
PLACES = 65
"""Places at which the sizes of laws are looked at."""
GRAIN = 1e-3
"""Share of the whole time whose last place is the least distance of two times."""


@dataclass(frozen=True)
class StepLimit:
    """Times up to ``end`` over which steps have one limit; what follows begins at ``resume``."""

    end: float
    resume: float
    longest: float
    bends: bool = False


class Clock:
    """The stretches of a motion.

    `x`, `v`: free coordinates at the start and their rates: they stand for the state where the time
    and the state are in one function.
    """

    def __init__(
        self, setup: MotionProblem, x: Unknowns, v: Floats, more: list[Sym] | None = None
    ) -> None:
        self.setup, self.end = setup, setup.end
        self.tables: list[Timed] = setup.loads.timed
        self._tempo, self._gaps = self._expressions(x, v, more or [])
        self._stretches: list[StepLimit] = []
        self._until = 0.0
        self._begun = 0.0

    def _expressions(
        self, x: Unknowns, v: Floats, more: list[Sym]
    ) -> tuple[Tempo | None, Tempo | None]:
        """Return what varies with the time, and what makes its corners."""
        setup, r = self.setup, self.setup.released
        model, time = setup.model, setup.loads.time
        expressions = [*setup.loads.varying, *[law.value for law in setup.laws], *more]
        expressions = [SX(part) for part in expressions if ca.depends_on(SX(part), time)]
        if not expressions:
            return None, None
        k = setup.kernel
        place = k.call("q", lambda: k.function("q", [ca.densify(r.q), ca.densify(r.qd)]))
        q, qd = place(0.0, x, v, setup.loose)
        state = ca.vertcat(model.q, model.velocity)
        whole = ca.vertcat(*expressions)
        symbols = ca.vertcat(SX(0, 1), *[table.symbols for table in self.tables])
        known = ca.Function("known", [time, state, model.p, symbols], [ca.densify(whole)])
        none = SX.zeros(symbols.numel())  # the rows of tables are breakpoints
        whole = known(time, state, SX(ca.DM(model.p_values)), none)
        found, gaps = signals(time, state, [*q.tolist(), *qd.tolist()], whole)
        remaining = [part for part in found if self._finite(time, part)]
        if not remaining:
            return None, None
        corners = Tempo(time, gaps) if gaps.numel() else None
        return Tempo(time, ca.vertcat(*remaining)), corners

    def _finite(self, time: Sym, part: Sym) -> bool:
        """Return whether an expression of the time has a value over the motion."""
        values = Tempo(time, part).values(np.linspace(0.0, self.end, SAMPLES))
        return bool(np.isfinite(values).all())

    @property
    def varies(self) -> bool:
        """Whether anything depends on the time."""
        return self._tempo is not None or bool(self.tables)

    def begin(self) -> float:
        """Return the time from which a motion goes on: 0, or right behind a breakpoint there."""
        if self._gaps is None:
            return 0.0
        behind = 2 * APART * float(np.spacing(GRAIN * self.end))
        sides = np.sign(self._gaps.values(np.array([0.0, behind])))
        return behind if (sides[0] != sides[1]).any() else 0.0

    # -- stretches -----------------------------------------------------------------------------

    def stretch(self, t: float) -> StepLimit:
        """Return the stretch that begins at, or holds, a time."""
        if not self.varies:
            return StepLimit(self.end, self.end, self._limit(np.inf))
        while True:
            for k, stretch in enumerate(self._stretches):
                if t < stretch.end:
                    del self._stretches[:k]
                    return stretch
            if self._until >= self.end:
                return StepLimit(self.end, self.end, self._limit(np.inf))
            self._look(max(t, self._until))

    def _limit(self, longest: float) -> float:
        given = self.setup.longest
        return longest if given is None else min(longest, given)

    def _look(self, begin: float) -> None:
        """Find the stretches from a time on, as far as the budget reaches."""
        starts, ends = self._cells(begin)
        bends = self._bends(starts, ends)
        until = float(ends[-1])
        if len(bends) > BUDGET:
            bends, until = bends[:BUDGET], bends[BUDGET][0]
        marks = [(before, after, True) for before, after in bends if begin < before < until]
        lengths = ends - starts
        least = most = lengths[0]
        limits: list[tuple[float, float]] = []  # the end of a run of like cells, and its limit
        for k, length in enumerate(lengths.tolist()):
            low, high = min(least, length), max(most, length)
            if high > ALIKE * low * (1 + 1e-9):
                limits.append((float(starts[k]), CELLS * least))
                low = high = length
            least, most = low, high
        limits.append((float(ends[-1]), CELLS * least))
        marks += [(end, end, False) for end, _ in limits if begin < end < until]
        if until < self.end or not marks:
            marks.append((until, until, False))
        if until >= self.end:
            marks.append((self.end, self.end, False))
        found: list[StepLimit] = []
        for before, after, bend in sorted(set(marks)):
            longest = next((step for end, step in limits if before <= end), limits[-1][1])
            if found and before <= found[-1].resume:  # within rounding of the one before
                if bend and not found[-1].bends:
                    last = found.pop()
                    found.append(StepLimit(min(last.end, before), after, last.longest, True))
                continue
            found.append(StepLimit(before, after, self._limit(longest), bend))
        self._stretches, self._until = found, until

    # -- cells ---------------------------------------------------------------------------------

    def _cells(self, begin: float) -> tuple[Floats, Floats]:
        """Return starts and ends of cells over which all is smooth, from a time on."""
        if self._tempo is None:
            return np.array([begin]), np.array([self.end])
        edges = np.linspace(begin, self.end, FIRST + 1)
        starts, ends = edges[:-1], edges[1:]
        done: list[tuple[Floats, Floats]] = []
        low = np.full(self._tempo.count, np.inf)
        high, until = -low, self.end
        while len(starts):
            bounds = self._tempo.over(starts, ends)
            good = np.ones(len(starts), bool)
            for k, bound in enumerate(bounds):
                low[k] = np.fmin(low[k], np.fmin.reduce(bound.middle))
                high[k] = np.fmax(high[k], np.fmax.reduce(bound.middle))
                size = SMOOTH * (high[k] - low[k]) + ROUNDING * np.abs(bound.middle)
                good &= bound.terms[ORDER] <= size
            good |= ends - starts <= NARROW * self.end
            done.append((starts[good], ends[good]))
            starts, ends = starts[~good], ends[~good]
            if len(starts) > BUDGET:
                until = min(until, float(starts[BUDGET]))
                starts, ends = starts[:BUDGET], ends[:BUDGET]
            middle = (starts + ends) / 2
            starts = np.column_stack([starts, middle]).ravel()
            ends = np.column_stack([middle, ends]).ravel()
        whole = np.array(
            sorted({(a, b) for stretch in done for a, b in zip(*stretch, strict=True)})
        )
        whole = whole[whole[:, 1] <= until]
        return whole[:, 0], whole[:, 1]

    # -- breakpoints ---------------------------------------------------------------------------

    def _bends(self, starts: Floats, ends: Floats) -> list[tuple[float, float]]:
        """Return the times right before and behind each breakpoint, sorted."""
        found = set()
        for table in self.tables:
            for knot in table.knots(float(starts[0]), float(ends[-1]), BUDGET + 1):
                apart = APART * np.spacing(max(abs(knot), 1e-300)) if table.jumps(knot) else 0.0
                found.add((knot - apart, knot + apart))
        if self._gaps is not None:
            found |= self._corners(starts, ends)
        return sorted(found)

    def _corners(self, starts: Floats, ends: Floats) -> set[tuple[float, float]]:
        """Return the times right before and behind each corner of expressions."""
        assert self._gaps is not None
        share = (1 - np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))) / 2
        times = np.append(
            (starts[:, None] + share[:-1] * (ends - starts)[:, None]).ravel(), ends[-1]
        )
        values = self._gaps.values(times)
        found = set()
        for j in range(values.shape[1]):
            column = values[:, j]
            sides = np.sign(column)
            for k in np.flatnonzero(sides[:-1] != sides[1:]).tolist():
                found.add(self._between(j, float(times[k]), float(times[k + 1])))
            near = np.abs(column)
            dips = (near[1:-1] < near[:-2]) & (near[1:-1] <= near[2:])
            dips &= (sides[1:-1] == sides[:-2]) & (sides[1:-1] == sides[2:])
            for k in (np.flatnonzero(dips) + 1).tolist():
                low, high = float(times[k - 1]), float(times[k + 1])
                least = self._least(j, low, high, float(sides[k]))
                if least is not None:
                    found |= {self._between(j, low, least), self._between(j, least, high)}
        return found

    def _side(self, j: int, t: float) -> float:
        assert self._gaps is not None
        return float(np.sign(self._gaps.values(np.array([t]))[0, j]))

    def _between(self, j: int, low: float, high: float) -> tuple[float, float]:
        """Return the times right before and behind the place where a gap changes its side."""
        left, grain = self._side(j, low), float(np.spacing(GRAIN * self.end))
        first, last = low, high
        low, high = halved(lambda t: self._side(j, t) == left, low, high, grain)
        apart = APART * max(float(np.spacing(abs(high))), grain)
        return max(low - apart, first), min(high + apart, last)

    def _least(self, j: int, low: float, high: float, side: float) -> float | None:
        """Return where a gap that dips towards zero is past it, None where it is not."""
        assert self._gaps is not None
        ratio = (np.sqrt(5) - 1) / 2
        for _ in range(FINER):
            times = np.array([high - ratio * (high - low), low + ratio * (high - low)])
            one, other = side * self._gaps.values(times)[:, j]
            if min(one, other) < 0:
                return float(times[0] if one < other else times[1])
            low, high = (low, float(times[1])) if one <= other else (float(times[0]), high)
        return None

    # -- laws ----------------------------------------------------------------------------------

    @cached_property
    def _laws(self) -> Any:
        """(t, pieces) -> values and rates of the laws of time."""
        return self.setup.laws_at

    @cached_property
    def _largest(self) -> Any:
        """Largest sizes of the laws and of their rates, at places of the whole time."""
        times = np.linspace(0.0, self.end, PLACES)
        found = np.abs([self._laws(t, self.setup.pieces_at(t)) for t in times.tolist()])
        return np.where(np.isfinite(found), found, 0.0).max(axis=0)

    def impact(self, stretch: StepLimit) -> str | None:
        """Return what is wrong with the laws of time where they bend, None where smooth."""
        if not self.setup.laws:
            return None
        before = self._laws(stretch.end, self.setup.pieces)
        after = self._laws(stretch.resume, self.setup.pieces_at(stretch.resume))
        apart = stretch.resume - stretch.end
        for law, top, fastest, *sides in zip(
            self.setup.laws, *self._largest, *before, *after, strict=True
        ):
            value, rate, other, behind = sides
            fastest = max(fastest, abs(rate), abs(behind))
            sizes = [SAME * max(top, abs(value), abs(other)) + 2 * fastest * apart, SAME * fastest]
            for word, one, two, size in zip(
                ("position", "speed"), (value, rate), (other, behind), sizes, strict=True
            ):
                if not abs(one - two) <= size:
                    return (
                        f"the law of {law.coordinate.text} jumps in its {word} at t = "
                        f"{stretch.end:.9g} s, from {one:.6g} to {two:.6g}: an impact (S9), which "
                        "is not computed; the states up to there are kept. Round the corner, or "
                        'join rows by interpolation = "spline"'
                    )
        return None

"""Path and motion generation: a point visits places, a body poses, timed or in order.

All at once: the free parameters and the unknowns of every pose are variables, the closure of
every pose is an equation and its branch an inequality.

A pose counts by how far the origin of the body's frame is from its target, and by the directions:
an angle phi between both counts 2 sin(phi/2) times the size of the targets. In space that is the
norm of R - R* by sqrt 2.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.goals import Visits
from mechdae.design.synthesis.exact.complete import Follow, here
from mechdae.design.synthesis.fourbar.solutions import WithinBounds, freedoms_left, solutions
from mechdae.design.synthesis.fourbar.starts import FourBarStarts
from mechdae.design.synthesis.goals.base import Drawn, Goal
from mechdae.design.synthesis.nlp import NewValues, Nlp, Values
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.robust.values import Row, deviation, moments, summed, variables
from mechdae.design.synthesis.space import TURN, WIDE
from mechdae.design.synthesis.starts.similar import Linear, Similar
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.trace import PLACES, around, closed_in, ordered
from mechdae.equations.model import Model
from mechdae.errors import InputError
from mechdae.kernels.run.functions import without_repeats
from mechdae.results.rotations import matrices
from mechdae.types import Floats, Graph, Integers, Matrices, Points, Sym, Unknowns

if TYPE_CHECKING:
    from numpy.random import Generator

    from mechdae.design.synthesis.fourbar.linkage import StartingFourBar


class Visited:
    """Places (k, w) of a point.

    ``wanted``: rows of what is compared at each target, places first. ``size``: root of the mean
    square distance of the places from their middle [m].
    """

    def __init__(self, asked: Visits) -> None:
        self.what: str = asked.what
        places = np.array(asked.places)
        self.width: int = places.shape[1]
        self.wanted: Floats = self._rows(asked)
        self.size: float = float(
            np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1)))
        )

    def _rows(self, asked: Visits) -> Floats:
        return np.array(asked.targets)

    def asks(self, model: Model) -> Sym:
        """Return what is compared with a row, over the coordinates of a model."""
        return model.point(self.what)

    def gap(self, value: Sym, wanted: Sym) -> Sym:
        """Return the (dimensionless) distance of a pose from its target, by components."""
        return (value[: self.width] - wanted[: self.width]) / self.size

    def met(self, nlp: Nlp, value: Sym, wanted: Sym) -> None:
        """Add that a target is met exactly."""
        nlp.constrain("target", self.gap(value, wanted), unit=self.size, si="m")

    def squares(self, values: Floats, wanted: Floats) -> Any:
        """Return the (dimensionless) squared distances of values (..., w) from wanted ones."""
        gap = values[..., : self.width] - wanted[..., : self.width]
        return np.sum(gap**2, axis=-1) / self.size**2


class PlanarPoses(Visited):
    """Poses (k, 3) of a body: origin of its frame and angle."""

    def asks(self, model: Model) -> Sym:
        return ca.vertcat(model.origin(self.what), model.frame(self.what).angle)

    def gap(self, value: Sym, wanted: Sym) -> Sym:
        turn = value[2] - wanted[2]
        return ca.vertcat(super().gap(value, wanted), ca.sin(turn), 1 - ca.cos(turn))

    def met(self, nlp: Nlp, value: Sym, wanted: Sym) -> None:
        gap = self.gap(value, wanted)
        nlp.constrain("target", gap[:3], unit=self.size, si="m")
        # the same direction, not the opposite one
        nlp.constrain("target", gap[3], -np.inf, 1.0, self.size, "m")

    def squares(self, values: Floats, wanted: Floats) -> Any:
        return super().squares(values, wanted) + 2 - 2 * np.cos(values[..., 2] - wanted[..., 2])


class SpatialPoses(Visited):
    """Poses of a body: origin of its frame and rotation matrix by columns, rows (k, 12)."""

    def _rows(self, asked: Visits) -> Floats:
        rows = np.array(asked.targets)
        e = rows[:, 3:] / np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
        return np.concatenate([rows[:, :3], matrices(e).transpose(0, 2, 1).reshape(-1, 9)], axis=1)

    def asks(self, model: Model) -> Sym:
        idle = getattr(model, "idle", {})
        if self.what in idle:
            raise InputError(
                f"{self.what} spins freely about the line of its ball joints: it has no pose",
                where="goal.body", hint="a body that is held, or a path of a point on that line",
            )  # fmt: skip
        frame: Any = model.frame(self.what)
        return ca.vertcat(model.origin(self.what), ca.vec(frame.R))

    def gap(self, value: Sym, wanted: Sym) -> Sym:
        turned = (value[3:] - wanted[3:]) / np.sqrt(2)
        return ca.vertcat(super().gap(value, wanted), turned)

    def met(self, nlp: Nlp, value: Sym, wanted: Sym) -> None:
        nlp.constrain("target", super().gap(value, wanted), unit=self.size, si="m")
        Q = ca.reshape(wanted[3:], 3, 3).T @ ca.reshape(value[3:], 3, 3)
        sines = ca.vertcat(Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]) / 2
        nlp.constrain("target", sines, unit=self.size, si="m")
        # the same orientation, not one half a turn away
        nlp.constrain("target", (3 - ca.trace(Q)) / 2, -np.inf, 1.0, self.size, "m")

    def squares(self, values: Floats, wanted: Floats) -> Any:
        turned = values[..., 3:] - wanted[..., 3:]
        return super().squares(values, wanted) + np.sum(turned**2, axis=-1) / 2


def visited(asked: Visits) -> Visited:
    """Return what a goal of visits compares."""
    if not asked.is_motion:
        return Visited(asked)
    return PlanarPoses(asked) if len(asked.targets[0]) == 3 else SpatialPoses(asked)


SX = ca.SX
SAMPLES = 20_000
"""Designs drawn in the screening of each class."""
MANY = 100_000
"""The same where most of what is drawn does not turn and is dropped early."""
ORDER = 1e-3
"""Least step of the driver between targets in order [rad]."""
SLIDES = 5.0
"""A driver that slides is drawn from so many sizes of the targets to both sides."""
BETTER = 1e-6
"""Share by which other times of the same design must be better to be taken."""
NOTHING = 1e-12
"""A (dimensionless) objective that no other times need make less."""


class VisitsGoal(Goal):
    """A point's places or a body's poses."""

    deviates = True
    between_nodes = False

    def __init__(self, asked: Visits, name: str) -> None:
        self.asked, self.name = asked, name
        self.visited: Visited = visited(asked)
        self.targets: Floats = self.visited.wanted
        self.weights: Floats = np.array(asked.weights)
        self.steps: Floats = np.array(asked.programme)
        self.count: int = len(self.targets)
        self.size: float = self.visited.size
        self.exact: bool = asked.measure == "exact"
        self.minimax: bool = asked.measure == "minimax"
        self.follow: Follow = here
        self.within: WithinBounds | None = None
        self.freedoms: int = 0
        self.sound: int = 0
        self.defective: list[tuple[Drawn, tuple[str, ...]]] | None = None
        self.unit: float = self.size if self.minimax else self.size**2

    def bodies(self) -> tuple[str, ...]:
        return (self.asked.what.split(".")[0],)

    def asks(self, model: Model) -> Mapping[str, Sym]:
        return {self.asked.what: self.visited.asks(model)}

    # -- the problem -------------------------------------------------------------------------

    def add(self, nlp: Nlp, d: Sym, sigma: Sym) -> Sym:
        goal, k, space = self.asked, self.count, self.space
        sense = nlp.parameter(self.key("sense"), 1.0)
        targets = ca.reshape(nlp.parameter(self.key("targets"), self.targets), -1, k)
        steps = nlp.parameter(self.key("programme"), self.steps)
        free = goal.timing in ("free", "any")
        wide, way = WIDE * space.way, space.way
        start = nlp.variable(self.key("start"), int(goal.timing == "steps"), -wide, wide, way)
        times = nlp.variable(self.key("u"), k if free else 0, -wide, wide, way)
        x = space.pose_variables(nlp, self.key("x"), k)
        worst = nlp.variable(self.key("worst"), int(self.minimax), 0.0, np.inf)
        u, term = [], SX(0)
        rows: list[Row] = []
        for i in range(k):
            if free:
                u.append(times[i])
            elif goal.timing == "steps":
                u.append(start + sense * steps[i])
            else:
                u.append(steps[i])
            values = space.at(nlp, x[:, i], u[i], d, sigma)
            value = space.poses.part(values, goal.what)
            if self.exact:
                self.visited.met(nlp, value, targets[:, i])
                continue
            gap = self.visited.gap(value, targets[:, i])
            bound = worst
            if self.deviations is not None:
                A = self._row(x[:, i], u[i], d, targets[:, i])[1]
                rows.append((float(self.weights[i]), gap, A))
                bound = worst - self.deviations.factor * deviation(A)
            if self.minimax:
                nlp.constrain("error", ca.sumsqr(gap) - bound * bound, -np.inf, 0.0)
                if rows:
                    nlp.constrain("error", bound, 0.0, np.inf)
            else:
                term += float(self.weights[i]) * ca.sumsqr(gap)
        if goal.timing == "free":
            gaps = [sense * (u[i + 1] - u[i]) for i in range(k - 1)]
            nlp.constrain("order", ca.vertcat(*gaps) / way, ORDER, np.inf)
            if space.turned:
                nlp.constrain("order", sense * (u[-1] - u[0]), -np.inf, TURN - ORDER)
        if self.minimax:
            return worst
        if self.deviations is None:
            return term
        return summed(nlp, self.name, rows, self.deviations.factor, self._typical)

    # -- deviations by tolerances ------------------------------------------------------------

    @cached_property
    def _row(self) -> Graph:
        """(x, u, d, target) -> residual (m,), its deviations (m, nt), both dimensionless."""
        assert self.deviations is not None
        poses, what = self.space.poses, self.asked.what
        x, u, d = SX.sym("x", poses.nx), SX.sym("u"), SX.sym("d", len(poses.free))
        wanted = SX.sym("wanted", self.targets.shape[1])
        value = SX.sym("value", self.targets.shape[1])
        gap = self.visited.gap(value, wanted)
        both = ca.Function("gap", [value, wanted], [gap, ca.jacobian(gap, value)])
        gap, slopes = both(poses.part(poses.function(x, u, d)[2], what), wanted)
        A = slopes @ self.deviations.of(what, x, u, d)
        return without_repeats("row", [x, u, d, wanted], [gap, ca.densify(A)])

    @cached_property
    def _typical(self) -> float:
        """What the products of deviations are about, (dimensionless)."""
        assert self.deviations is not None
        return self.deviations.typical(
            lambda x, u, d: self._row(x, u, d, self.targets[0])[1], self.space
        )

    def _deviating(self, values: Values, given: Values, u: Any, x: Any, d: Any) -> dict[str, Any]:
        assert self.deviations is not None
        rows: list[Row] = []
        for i, w in enumerate(self.weights):
            gap, A = self._row(x[i], u[i], d, self.targets[i])
            rows.append((float(w), np.array(gap), np.array(A)))
        if not self.minimax:
            return {variables(self.name): moments(rows)}
        sizes = [np.linalg.norm(gap) + self.deviations.factor * np.linalg.norm(A)
                 for _, gap, A in rows]  # fmt: skip
        return {self.key("worst"): [max(sizes)]}

    def programme(self, values: Values, given: Values) -> tuple[Floats, Floats]:
        x = self.poses_of(values, self.count)
        if self.asked.timing == "free":
            return np.array(values[self.key("u")]), x
        if self.asked.timing == "any":
            times = np.array(values[self.key("u")])
            return (wound(times) if self.space.loop is not None else times), x
        if self.asked.timing == "steps":
            start = float(values[self.key("start")][0])
            return start + given[self.key("sense")] * self.steps, x
        return self.steps, x

    # -- starts ------------------------------------------------------------------------------

    def drawn(self, kind: str, generator: Generator, count: int) -> Iterable[Drawn]:
        space = self.space
        if space.loop is not None and not space.asked.choices:
            starts = FourBarStarts(space, self.asked.what)
            if self.exact and starts.fits:
                if self.within is None:
                    seed = int(generator.integers(2**31))
                    self.within = solutions(starts, self.asked, seed, self.follow)
                    self.freedoms = freedoms_left(starts, self.asked)
                if self.within is not None:
                    yield from self._solutions(self.within.each, starts)
                    return
            if starts.fits and not self.asked.is_motion:
                kinds = [kind] if kind else ["crank-rocker", "drag-link"]
                for each in kinds:
                    drawn = starts.screened(
                        self.targets, generator, SAMPLES, -(-count // len(kinds)), each,
                        self.asked.timing, self.steps,
                    )  # fmt: skip
                    yield from (self._posed(start, starts.posed(start)) for start in drawn)
                return
        yield from self._any(kind, generator, count)

    def _solutions(self, found: list[Any], starts: FourBarStarts) -> Iterable[Drawn]:
        """Yield the solutions that move well; the others are kept with their faults."""
        self.defective, self.sound = [], 0
        for each, d, faults in found:
            drawn = self._posed(each, starts.placed(each, d))
            if faults:
                self.defective.append((drawn, faults))
            else:
                self.sound += 1
                yield drawn

    def _posed(self, start: StartingFourBar, posed: tuple[Floats, Floats, Points, Floats]) -> Drawn:
        d, u, x, sigma = posed
        unknowns, given = self._own(u, float(start.sense))
        return Drawn(d, unknowns, given, u, x, sigma, start.residual / self.size**2)

    def _own(self, u: Floats, sense: float) -> NewValues:
        unknowns: dict[str, Floats] = {}
        if self.asked.timing in ("free", "any"):
            unknowns[self.key("u")] = u
        elif self.asked.timing == "steps":
            unknowns[self.key("start")] = u[:1] - sense * self.steps[0]
        return unknowns, {self.key("sense"): sense}

    def _any(self, kind: str, generator: Generator, count: int) -> Iterable[Drawn]:
        """Yield starts of any mechanism: designs drawn in the box, moved along the programme."""
        spread = Spread(self.space)
        similar = None
        if not self.asked.is_motion and self.visited.width == 2:
            similar = Similar(self.space, self.asked.what)
            similar = similar if similar.available else None
        count_of = SAMPLES if similar is None else MANY
        d = spread.designs(generator, count_of, None if similar is None else similar.lengths)
        if similar is not None:
            d = similar.neutral(d)
        d = d[spread.turning(d, kind)]
        count_of = len(d)
        if not count_of:
            return
        sense = generator.choice((-1.0, 1.0), count_of)
        first = self._spread(generator, count_of)
        if self.asked.timing == "absolute":
            u = np.broadcast_to(self.steps, (count_of, self.count))
        elif self.asked.timing == "steps":
            u = first[:, None] + sense[:, None] * self.steps
        elif self.asked.timing == "any":
            u = self._spread(generator, (count_of, self.count))
        else:
            gaps = generator.dirichlet(np.ones(self.count), count_of) * TURN
            if not self.space.turned:
                gaps *= self.space.way * generator.uniform(0.05, 1, (count_of, 1))
            u = first[:, None] + sense[:, None] * np.cumsum(gaps, axis=1)
        closed, x, sigma, values = spread.moved(d, u, generator)
        d, u, sense = d[closed], u[closed], sense[closed]
        if not len(d):
            return
        beyond = 0.0
        if similar is not None:
            d, x, places, beyond = similar.fitted(d, u, x, self.targets, self.weights)
        else:
            places = self.space.poses.part(values, self.asked.what)
            d, places = Linear(self.space, self.asked.what, self.visited.width).fitted(
                d, u, x, places, self.targets, self.weights
            )
        f = self._squares(places) + beyond
        for i in spread.distinct(d, np.argsort(f, kind="stable"), count):
            unknowns, given = self._own(u[i], float(sense[i]))
            yield Drawn(d[i], unknowns, given, u[i], x[i], sigma[i], float(f[i]))

    def _spread(self, generator: Generator, shape: tuple[int, int] | int) -> Floats:
        """Return driver values: within a turn, or some sizes to both sides."""
        if self.space.turned:
            return generator.uniform(0, TURN, shape)
        return generator.uniform(-SLIDES, SLIDES, shape) * self.space.way

    def _squares(self, places: Matrices) -> Any:
        """Return the (dimensionless) weighted sum of squares of values (n, k, w)."""
        return self.visited.squares(places, self.targets) @ self.weights

    def first(self, d: Floats) -> float | None:
        return float(self.steps[0]) if self.asked.timing == "absolute" else None

    def completed(self, spread: Spread, drawn: Drawn) -> NewValues:
        start = float(drawn.u[0])
        if self.asked.timing == "absolute":
            u = self.steps
        elif self.asked.timing == "steps":
            u = start + self.steps
        else:
            best = self._best_times(spread, drawn.d, start, drawn.x[0])
            if best is not None:
                return best[0], best[1]
            u = start + TURN * np.arange(self.count) / self.count
        _, x, _ = spread.followed(drawn.d, drawn.x[0], start, u)
        unknowns, given = self._own(np.asarray(u), 1.0)
        return unknowns | {self.key("x"): x}, given

    # -- the best times ------------------------------------------------------------------------

    def _costs(self, values: Floats, chosen: Integers | None = None) -> Any:
        """Return the (dimensionless) costs of asked values (n, w): of all targets, or some."""
        places = self.space.poses.part(values, self.asked.what)
        if chosen is None:
            places, targets, weights = places[:, None], self.targets, self.weights
        else:
            targets, weights = self.targets[chosen], self.weights[chosen]
        squares = self.visited.squares(places, targets)
        return squares if self.minimax else squares * weights

    def _best_times(
        self, spread: Spread, d: Floats, u: float, x: Unknowns
    ) -> tuple[dict[str, Floats | list[float]], dict[str, float], float] | None:
        """Return variables and parameters of the best times of a design, and its costs there."""
        if self.asked.timing not in ("free", "any") or not self.space.turned:
            return None
        trace, closed = around(spread, d, u, np.asarray(x, float), PLACES)
        costs = self._costs(trace.poses(trace.u)[2])
        if self.asked.timing == "any":
            places, sense = np.argmin(costs, axis=0), 1.0
        elif len(costs) < self.count:
            return None
        else:
            ways = [
                (*ordered(costs_along, self.minimax, closed), way)
                for costs_along, way in ((costs, 1.0), (costs[::-1], -1.0))
            ]
            total, places, sense = min(ways, key=lambda way: way[0])
            if not np.isfinite(total):
                return None
            places = places if sense > 0 else len(costs) - 1 - places
        step = TURN / PLACES
        at, poses = closed_in(trace, self._costs, trace.u[0] + step * places, step)
        _, _, values, held = trace.poses(at)
        final = self._costs(values, np.arange(self.count))
        if not held.all():
            return None
        unknowns, given = self._own(at, sense)
        worst = float(np.sqrt(final.max()))
        unknowns |= {self.key("x"): poses, self.key("worst"): [worst]}
        return unknowns, given, worst if self.minimax else float(final.sum())

    def refined(self, spread: Spread, values: Values, given: Values) -> NewValues | None:
        if self.exact or self.asked.timing not in ("free", "any") or self.deviations is not None:
            return None
        u, x = np.array(values[self.key("u")]), self.poses_of(values, self.count)
        d = dimensions(values["d"], given)
        best = self._best_times(spread, d, float(u[0]), x[0])
        if best is None:
            return None
        places = [spread.poses.function(x[i], u[i], d)[2] for i in range(self.count)]
        costs = self._costs(np.array([np.array(p).ravel() for p in places]), np.arange(self.count))
        now = float(np.sqrt(costs.max())) if self.minimax else float(costs.sum())
        if not best[2] < now * (1 - BETTER) or now <= NOTHING:
            return None
        return best[0], best[1]


def wound(u: Floats) -> Any:
    """Return angles of a driver brought together on the shortest arc, whole turns left out."""
    turned = np.mod(u, TURN)
    order = np.sort(turned)
    gaps = np.diff(np.append(order, order[0] + TURN))
    first = order[(int(np.argmax(gaps)) + 1) % len(order)]
    return first + np.mod(turned - first, TURN)

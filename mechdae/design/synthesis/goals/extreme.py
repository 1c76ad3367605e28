"""A quantity of another task as a goal or a limit: loss, efficiency, reactions, efforts, angles.

At nodes over the task's range the quantity is an expression of the pose and the free parameters;
its mean or root mean square is the objective, or a bound t of it at all nodes.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import unit_within
from mechdae.describe.tasks.goals import Extreme as Asked
from mechdae.design.synthesis.goals.base import Drawn, Goal
from mechdae.design.synthesis.nlp import (
    FINEST,
    LIMIT,
    SOFT,
    NewValues,
    Nlp,
    Values,
    kinked,
    rounded,
)
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.quantity import MEANS, Quantity
from mechdae.design.synthesis.robust.values import (
    deviation,
    lifted,
    mean_slopes,
    row_of,
    sigma_of_mean,
    variables,
)
from mechdae.design.synthesis.space import TURN
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.trace import MET, Trace, grid_of, maxima, moved
from mechdae.design.synthesis.verification.quantities import reduced
from mechdae.equations.parameters import parameters_of
from mechdae.errors import InputError
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.types import Floats, Graph, Sym

if TYPE_CHECKING:
    from numpy.random import Generator


SX = ca.SX
SAMPLES = 4_000
COARSE = 12


class ExtremeGoal(Goal):
    """A quantity that is smallest or largest, or (as a limit) stays between bounds."""

    def __init__(
        self,
        asked: Asked,
        name: str,
        quantity: Quantity,
        typical: float,
        bounds: tuple[float, float] | None = None,
    ) -> None:
        self.asked, self.name, self.quantity = asked, name, quantity
        if quantity.transmission and bounds is None and asked.reduce != "least":
            raise InputError(
                f"the {asked.reduce} of a transmission angle is no goal", where=f"{name}.reduce",
                hint='reduce = "least" is the worst of its poses',
            )  # fmt: skip
        self.sense: int = asked.sense
        self.unit = typical
        self.bounds = bounds
        self.exact: bool = bounds is not None

    def bodies(self) -> tuple[str, ...]:
        return self.quantity.bodies

    @property
    def _dimension(self) -> int:
        """Components of forces and places: moments of reactions follow them."""
        return self.space.poses.mechanism.dimension

    @property
    def between_nodes(self) -> bool:  # type: ignore[override]
        return not self.exactly

    @property
    def exactly(self) -> bool:
        """Whether the least transmission angle of a turn has a closed form here."""
        least = self.asked.reduce == "least" or (
            self.bounds is not None and self.bounds[1] >= np.pi / 2
        )
        turns = self.space.asked.full_turn and self.quantity.turns
        return self.quantity.transmission and self.space.single_loop and turns and least

    @cached_property
    def at_pose(self) -> Graph:
        """(x of the whole scene, u, free) -> values."""
        if self.deviations is not None:
            x, u, d = self._row.sx_in()
            return ca.Function("values", [x, u, d], [self._row(x, u, d)[0]])
        poses = self.space.poses
        x, u, d = SX.sym("x", poses.nx), SX.sym("u"), SX.sym("d", len(poses.free))
        p = parameters_of(poses.model, poses.free, d)
        whole = poses.recovered(x, u, p)
        places = [poses.names.index(name) for name in self.quantity.x_names]
        chosen = whole[places] if places else SX(0, 1)
        rest = self.quantity.free[len(poses.free) :]
        every = ca.vertcat(d, *[p[poses.model.p_names.index(name)] for name in rest])
        return without_repeats("values", [x, u, d], [self.quantity.function(chosen, u, every)])

    # -- deviations by tolerances ------------------------------------------------------------

    @property
    def deviates(self) -> bool:  # type: ignore[override]
        """Whether there are deviations of it: not of transmission angles."""
        return not self.quantity.transmission

    @property
    def words(self) -> str:
        return f"a transmission angle ({self.asked.of})"

    def moved_by(self, name: str) -> bool:
        function, place = self.quantity.function, self.quantity.free.index(name)
        inputs = function.sx_in()
        found = ca.jacobian_sparsity(function(*inputs), inputs[2][place])
        return bool(found.nnz())

    @cached_property
    def _row(self) -> Graph:
        """(x, u, d) -> values (m,), their deviations (m, nt)."""
        assert self.deviations is not None
        return row_of(self.quantity, self.deviations)

    def _deviated(self, row: Sym, A: object) -> Any:
        """Return the size of the quantity at a pose with its standard deviations added."""
        assert self.deviations is not None
        value = SX.sym("value", row.numel())
        size = self._size(value)
        slope = ca.Function("slope", [value], [size, ca.jacobian(size, value)])
        size, slope = slope(row)
        added = self.deviations.factor * deviation(slope @ A)
        return size + added if self.asked.reduce == "peak" else size - added

    def _robust_mean(self, nlp: Nlp, rows: list[Sym]) -> Any:
        """Return the (dimensionless) mean with standard deviations added, by the sense."""
        assert self.deviations is not None
        mean = self._mean([row for row, _ in rows])
        sums = lifted(nlp, self.name, self._sums(rows))
        sigma = sigma_of_mean(self.asked, sums, mean, self._powers([row for row, _ in rows]))
        return mean + self.sense * self.deviations.factor * sigma

    def _sums(self, rows: list[Sym]) -> Any:
        return mean_slopes(self.asked, rows, self.quantity.weights, self.unit, self._mean_of)

    def _powers(self, rows: list[Sym]) -> tuple[Any, Any]:
        """Return mean loss and power, where the goal is a mean of them."""
        if self.asked.path not in MEANS:
            return 0.0, 0.0
        loss, power = (
            sum((w * row[k] for w, row in zip(self.quantity.weights, rows, strict=True)), SX(0))
            for k in (0, 1)
        )
        return loss / self.unit, power / self.unit

    def _deviating(self, values: Values, given: Values, u: Any, x: Any, d: Any) -> dict[str, Any]:
        rows = [self._row(x[i], u[i], d) for i in range(len(u))]
        if self._averaged:
            sums = self._sums([(SX(row), SX(A)) for row, A in rows])
            return {variables(self.name): np.array(ca.DM(sums)).ravel()}
        found = np.array(ca.DM(ca.vertcat(*[self._deviated(SX(r), SX(A)) for r, A in rows])))
        return {self.key("worst"): [found.max() if self.asked.reduce == "peak" else found.min()]}

    # -- the problem -------------------------------------------------------------------------

    def add(self, nlp: Nlp, d: Sym, sigma: Sym) -> Sym:
        space = self.space
        if self.exactly and self.bounds is not None:
            most = float(np.cos(max(self.bounds[0], 0.0)))
            nlp.constrain(f"lower {LIMIT}{self.asked.path}", space.cosines(d), -most, most)
            return SX(0)
        if self.exactly:
            # one pose, to begin the sweeps with
            x = space.pose_variables(nlp, self.key("x"), 1)
            space.at(nlp, x[:, 0], self.quantity.nodes[0], d, sigma)
            angle = nlp.variable(self.key("worst"), 1, 0.0, np.pi / 2)
            nlp.constrain("least", space.cosines(d) - ca.cos(angle), -np.inf, 0.0)
            nlp.constrain("least", space.cosines(d) + ca.cos(angle), 0.0, np.inf)
            return -angle
        nodes = nlp.parameter(self.key("nodes"), self.quantity.nodes)
        x = space.pose_variables(nlp, self.key("x"), nodes.numel())
        rows = []
        for i, u in enumerate(ca.vertsplit(nodes)):
            space.at(nlp, x[:, i], u, d, sigma)
            robust = self.deviations is not None
            rows.append(self._row(x[:, i], u, d) if robust else self._value(nlp, x[:, i], u, d))
        if self.bounds is not None:
            low, high = (self._scaled(bound) for bound in self.bounds)
            sizes = [self._mean(rows)] if self._averaged else [self._size(row) for row in rows]
            unit, si = self.unit, unit_within(space.poses.mechanism, None, self.asked.path)
            if self.quantity.transmission:  # sines
                unit, si = 1.0, "1"
            for size in sizes:
                nlp.constrain(f"{LIMIT}{self.asked.path}", size, low, high, unit, si or "")
            return SX(0)
        if self._averaged and self.deviations is not None:
            return self.sense * self._robust_mean(nlp, rows)
        if self._averaged:
            return self.sense * self._mean(rows)
        ends = (0.0, np.pi / 2) if self.quantity.transmission else (-np.inf, np.inf)
        worst = nlp.variable(self.key("worst"), 1, *ends)
        bound = ca.sin(worst) if self.quantity.transmission else worst
        for row in rows:
            value = self._size(row) if self.deviations is None else self._deviated(*row)
            if self.asked.reduce == "peak":
                nlp.constrain("peak", value - bound, -np.inf, 0.0)
            else:
                nlp.constrain("least", value - bound, 0.0, np.inf)
        return self.sense * worst

    def _value(self, nlp: Nlp, x: Sym, u: Sym, d: Sym) -> Sym:
        """Return the values at a pose, kinks of a number of the user's rounded."""
        if not (self.asked.path.startswith("outputs/") and kinked(self.at_pose)):
            return self.at_pose(x, u, d)
        soft = nlp.known_parameter(SOFT, FINEST)
        return rounded(self.at_pose, self.space.samples, (x, u, d), soft)

    def _scaled(self, bound: float) -> float:
        if not self.quantity.transmission:
            return bound / self.unit
        if not 0 < bound < np.pi / 2:  # every angle keeps such a bound
            return float(np.copysign(np.inf, bound - 1))
        return float(np.sin(bound))

    def _size(self, row: Sym) -> Sym:
        """Return the quantity at a pose in its typical size; of vectors the length."""
        if self.quantity.transmission:
            return row
        row = row / self.unit
        if row.numel() == 1:
            return row if self.asked.reduce == "least" or self.bounds else ca.sqrt(row**2 + 1e-12)
        return ca.sqrt(ca.sumsqr(row[: self._dimension]) + 1e-12)

    def _mean(self, rows: list[Sym]) -> Sym:
        weights = self.quantity.weights
        if self.asked.path in MEANS:
            loss, power = (
                sum((w * row[k] for w, row in zip(weights, rows, strict=True)), SX(0))
                for k in (0, 1)
            )
            if self.asked.path == "summary/efficiency":
                return 1 - loss / power
            return (loss if self.asked.path == "summary/loss" else power) / self.unit
        if self.asked.reduce == "rms":
            parts = [w * ca.sumsqr(row) for w, row in zip(weights, rows, strict=True)]
            return ca.sqrt(sum(parts, SX(0)) / self.unit**2 + 1e-16)
        return sum((w * self._mean_of(r) for w, r in zip(weights, rows, strict=True)), SX(0))

    def _mean_of(self, row: Sym) -> Any:
        if row.numel() == 1:
            return row / (1.0 if self.quantity.transmission else self.unit)
        return self._size(row)

    def value(self, term: float) -> float:
        quantity = self.sense * term
        if self.quantity.transmission:
            return quantity
        return quantity if self.asked.path == "summary/efficiency" else quantity * self.unit

    def programme(self, values: Values, given: Values) -> tuple[Floats, Floats]:
        nodes = given.get(self.key("nodes"), self.quantity.nodes)
        x = self.poses_of(values, len(nodes))
        return nodes[: len(x)], x

    # -- the true extremes ---------------------------------------------------------------------

    @property
    def _averaged(self) -> bool:
        """Whether all nodes count, not the extremes."""
        return self.asked.path in MEANS or self.asked.reduce in ("mean", "rms")

    def refined(self, spread: Spread, values: Values, given: Values) -> NewValues | None:
        if self._averaged or self.exactly or self.quantity.setting.plan.named:
            return None
        u, x = self.programme(values, given)
        d = dimensions(values["d"], given)
        trace = Trace(spread, d, u, x)
        size = Batch(self._size_at, ())

        def curve(sign: float, at: Floats) -> Any:
            x, _, _, held = trace.poses(at)
            found = size(x, at[:, None], np.broadcast_to(d, (len(at), len(d))))[0][:, 0]
            return np.where(held, sign * found, np.nan)

        grid = grid_of(np.append(u, u[0] + TURN) if self.quantity.turns else u)
        signs, bounds = [], []
        if self.bounds is not None:
            low, high = (self._scaled(bound) for bound in self.bounds)
            signs, bounds = [-1.0, 1.0], [-low, high]
        else:
            worst = float(values[self.key("worst")][0])
            bound = np.sin(worst) if self.quantity.transmission else worst
            peak = self.asked.reduce == "peak"
            signs, bounds = ([1.0], [bound]) if peak else ([-1.0], [-bound])
        places, tops, missed = [], [], False
        for sign, bound in zip(signs, bounds, strict=True):
            if not np.isfinite(bound) or abs(bound) > 1e200:
                continue
            at, heights = maxima(partial(curve, sign), grid)
            missed |= bool(len(heights) and heights.max() > bound + MET * max(1.0, abs(bound)))
            places.append(at)
            tops.append(heights - bound)
        if not missed:
            return None
        held = np.zeros(len(u), bool)
        if not self.quantity.turns:
            held[[0, -1]] = True
        nodes = moved(u, np.concatenate(places), np.concatenate(tops), held)
        unknowns = {self.key("x"): trace.poses(nodes)[0]}
        if self.bounds is None:
            top = float(tops[0].max()) + bounds[0]
            value = float(signs[0] * top)
            if self.quantity.transmission:
                value = float(np.arcsin(np.clip(value, 0.0, 1.0)))
            return {**unknowns, self.key("worst"): [value]}, {self.key("nodes"): nodes}
        return unknowns, {self.key("nodes"): nodes}

    @cached_property
    def _size_at(self) -> Graph:
        """(x, u, free) -> the (dimensionless) quantity that is bounded."""
        poses = self.space.poses
        x, u, d = SX.sym("x", poses.nx), SX.sym("u"), SX.sym("d", len(poses.free))
        robust = self.deviations is not None
        size = self._deviated(*self._row(x, u, d)) if robust else self._size(self.at_pose(x, u, d))
        return ca.Function("size", [x, u, d], [ca.densify(size)])

    # -- starts ------------------------------------------------------------------------------

    def drawn(self, kind: str, generator: Generator, count: int) -> Iterable[Drawn]:
        spread = Spread(self.space)
        d = spread.designs(generator, SAMPLES * 4)
        d = d[spread.turning(d, kind)][:SAMPLES]
        nodes = self.quantity.nodes
        coarse = nodes[np.linspace(0, len(nodes) - 1, min(COARSE, len(nodes))).astype(int)]
        u = np.broadcast_to(coarse, (len(d), len(coarse)))
        closed, x, sigma, _ = spread.moved(d, u, generator)
        d, found = d[closed], []
        for i in range(min(len(d), 10 * count)):
            rows = [SX(self.at_pose(x[i, k], coarse[k], d[i])) for k in range(len(coarse))]
            value = self._rough(np.array([np.array(ca.DM(r)).ravel() for r in rows]))
            found.append(self.sense * value if np.isfinite(value) else np.inf)
        order = np.argsort(found, kind="stable")
        for i in spread.distinct(d[: 10 * count], order, count):
            on, poses, _ = spread.followed(d[i], x[i, 0], float(coarse[0]), nodes)
            if on and np.isfinite(found[i]):
                unknowns = {self.key("worst"): [self.sense * found[i]]}
                if self.exactly:
                    unknowns, poses = {self.key("worst"): [0.5]}, poses[:1]
                at = nodes[: len(poses)]
                yield Drawn(d[i], unknowns, {}, at, poses, sigma[i], float(found[i]))

    def _rough(self, rows: Floats) -> float:
        if self.asked.path in MEANS:
            loss, power = rows.mean(axis=0)
            if self.asked.path == "summary/efficiency":
                return float(1 - loss / power)
            return float((loss if self.asked.path == "summary/loss" else power) / self.unit)
        size = (
            rows[:, 0] if rows.shape[1] == 1 else np.linalg.norm(rows[:, : self._dimension], axis=1)
        )
        size = size / (1.0 if self.quantity.transmission else self.unit)
        return reduced(size, self.asked.reduce)

    def first(self, d: Floats) -> float | None:
        return float(self.quantity.nodes[0])

    def completed(self, spread: Spread, drawn: Drawn) -> NewValues:
        if self.exactly:
            _, x, _ = spread.followed(
                drawn.d, drawn.x[0], float(drawn.u[0]), self.quantity.nodes[:1]
            )
            return {self.key("x"): x, self.key("worst"): [0.5]}, {}
        nodes = self.quantity.nodes
        _, x, _ = spread.followed(drawn.d, drawn.x[0], float(drawn.u[0]), nodes)
        rows = [np.array(self.at_pose(x[k], nodes[k], drawn.d)).ravel() for k in range(len(nodes))]
        worst = self._rough(np.array(rows))
        return {self.key("x"): x, self.key("worst"): [worst]}, {}

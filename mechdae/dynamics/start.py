"""Where a motion starts: pose and speeds that meet all constraints.

The sketch is assembled as a sweep assembles it; then the coordinates that the start names, and
those with a law of time, are moved to their values, in steps short enough to stay on the assembly
mode. What the start leaves open stays where the sketch has it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.tasks.motion import start_values
from mechdae.dynamics.equations import CONTRADICTING, STILL, MotionProblem
from mechdae.dynamics.sketch import CLOSED, RANK, PlanarSketch
from mechdae.errors import AssemblyError, InconsistentStartError
from mechdae.kernels.run.functions import Call
from mechdae.motion.assembly.closure import bar_lengths, closing_tolerance, straight
from mechdae.motion.assembly.not_assembled import tolerance_hint
from mechdae.motion.setup.drivers import sketched
from mechdae.records import dataclass
from mechdae.types import Floats, Matrix, Unknowns

STEPS = 60
SPEEDS = 1e-10
"""Share of the largest singular value up to which constraints count as dependent for speeds: near
a dead point they are small and hold."""
OPEN = 1e-6
"""Left-over of a contradictory start that is put down to rounded numbers and corrected."""
UNITS = 8
"""Steps in which quaternions get the length of one."""
FAR = 0.35
"""Change of a coordinate [rad, or length] in one step of the way from the sketch."""
TURNED = 0.6
"""Change of a free coordinate that one such step may bring."""
PASSED, STEEP = 1e-3, 20.0
"""Step at which modes that meet are passed, and how much faster the mechanism may move in it."""


@dataclass
class Start:
    """Absolute coordinates and rates at t = 0, and how far the numbers given were corrected."""

    q: Any
    qd: Floats
    correction: float


class _Starter:
    def __init__(self, setup: MotionProblem, near: Floats | None = None) -> None:
        self.setup, self.near = setup, near
        self.r = setup.jointed
        mechanism, task = setup.problem.mechanism, setup.task
        self.given = start_values(mechanism, task.start, "start")
        self.speeds = start_values(mechanism, task.start_speed, "start_speed")
        model, laws = setup.model, setup.laws
        self.named = [*self.given, *self.speeds, *(law.coordinate for law in laws)]
        self.aims = dict(self.given)
        found = setup.laws_at(0.0, setup.pieces)
        for law, value in zip(laws, found[0], strict=True):
            self.aims.setdefault(law.coordinate, float(value))
        self.law_speeds = {
            law.coordinate: float(rate) if abs(rate) > self._least(law.coordinate) else 0.0
            for law, rate in zip(laws, found[1], strict=True)
        }
        self.law_values = {
            law.coordinate: float(value) for law, value in zip(laws, found[0], strict=True)
        }
        self.drawn = sketched(mechanism)
        self.places = dict(self.drawn.places)
        self.said = {*self.places, *self.drawn.coordinates(mechanism)}
        for c, value in self.aims.items():
            if c.kind == "body angle":
                self.drawn.angles.setdefault(c.part, value)
            else:
                self.places.setdefault(c, value)
        self.moving = list(
            dict.fromkeys([*self.aims, *self.speeds, *self.law_speeds, *self.places])
        )
        r = self.r

        def build() -> Call:
            rows = [r.moved(model.coordinate(c)) for c in self.moving]
            phi = ca.densify(ca.vertcat(r.phi, *rows))
            slopes = ca.densify(ca.jacobian(phi, r.x))
            return Call(ca.Function("start", [r.x, model.p], [phi, slopes]))

        self._rows = r.cache(("start", *(c.text for c in self.moving)), build)
        self.m, self.n = r.phi.numel(), r.x.numel()
        self.sizes = r.coordinates.sizes(setup.length)
        self.gaps = np.array(self.r.gaps(setup.length))
        self.closed = CLOSED + setup.closure
        self.rank = max(RANK, CONTRADICTING * setup.closure)
        sizes = [1.0 if c.is_angle else setup.length for c in self.moving]
        self.scales = np.concatenate([self.gaps, sizes])

    def _least(self, c: NamedCoordinate) -> float:
        """Return the speed below which a coordinate stands still until the end."""
        return STILL * (1.0 if c.is_angle else self.setup.length) / self.setup.end

    def rows(self, x: Unknowns) -> tuple[Floats, Matrix]:
        """Return constraints and moved coordinates, and their Jacobian, over natural sizes."""
        phi, J = self._rows(x, self.setup.model.p_values)
        J = np.reshape(J, (len(phi), self.n))
        return phi / self.scales, J * self.sizes / self.scales[:, None]

    def close(
        self, x: Unknowns, aims: Mapping[int, float], short: float = np.inf
    ) -> tuple[Floats, float]:
        """Return x with the constraints closed and some moved coordinates on their aims.

        `aims` are values over natural sizes by place in `moving`. The second result is the
        largest left-over; a step is at most `short`.
        """
        chosen = [*range(self.m), *(self.m + k for k in aims)]
        target = np.concatenate([np.zeros(self.m), np.array(list(aims.values()), float)])
        best, least, stalled = x, np.inf, 0
        for _ in range(STEPS):
            values, J = self.rows(x)
            left = values[chosen] - target
            size = float(np.max(np.abs(left), initial=0.0))
            if not np.isfinite(size):
                break
            if size < least:
                best, least, stalled = x, size, 0
            else:
                stalled += 1
            if least == 0 or (stalled >= 2 and least < self.closed) or stalled >= 12:
                break
            step = np.linalg.lstsq(J[chosen], -left, rcond=self.rank)[0]
            largest = float(np.max(np.abs(step), initial=0.0))
            x = x + self.sizes * step * min(1.0, short / largest if largest else 1.0)
        return best, least

    # -- the sketch ----------------------------------------------------------------------------

    def sketch(self) -> Any:
        if self.near is not None:
            return self.near[self.r.free]
        if self.setup.problem.mechanism.dimension == 3:
            from mechdae.dynamics.space.sketch import SpatialSketch

            x, nearest = SpatialSketch(self).pose()
        else:
            x, nearest = PlanarSketch(self).pose()
        if x is None:
            raise self._not_assembled(nearest)
        return x

    def sketched_places(self) -> dict[int, float]:
        """Return the places that the sketch or the start gives, by place in `moving`."""
        return {
            k: self.places[c] / self.scales[self.m + k]
            for k, c in enumerate(self.moving)
            if c in self.places
        }

    def _not_assembled(self, x: Floats) -> AssemblyError:
        joints = np.array([unit != "1" for unit in self.r.units])
        for _ in range(UNITS if not joints.all() else 0):  # quaternions have a length of one
            values, J = self.rows(x)
            rest = np.flatnonzero(~joints)
            x = x - self.sizes * np.linalg.lstsq(J[rest], values[rest], rcond=self.rank)[0]
        rows = [self.r.rows[k] for k in self.r.left]
        lengths = bar_lengths(self.setup.problem.mechanism, [row.owner for row in rows])
        gaps = np.abs(straight(self.rows(x)[0][: self.m] * self.gaps, lengths)[0])
        k = int(np.argmax(np.where(joints, gaps / self.gaps, -1.0)))
        row, gap = rows[k], gaps[k]
        hint, J = "check the lengths, or sketch the start more closely", self.rows(x)[1][: self.m]
        length = self.setup.length
        enough = closing_tolerance(float(np.linalg.norm(gaps / self.gaps)) * length, length)
        if enough and np.linalg.matrix_rank(J, self.rank) < self.m:
            hint = "give dimensions that depend on each other as expressions" + tolerance_hint(
                enough
            )
        return AssemblyError(
            f"the mechanism does not close at the sketch: joint {row.owner} stays open by "
            f"{gap:.4g} {row.unit}",
            where="sketch",
            hint=hint,
        )

    # -- the start -----------------------------------------------------------------------------

    def positions(self) -> tuple[Floats, float]:
        """Return the free coordinates of the start and the largest correction of numbers given."""
        x = self.sketch()
        places = {k: c for k, c in enumerate(self.moving) if c in self.aims}
        for c, value in self.law_values.items():
            if abs(self.aims[c] - value) > OPEN * (1.0 if c.is_angle else self.setup.length):
                raise self._error(
                    "start and law of time differ", {c.text: self.aims[c] - value}, "start"
                )
            self.aims[c] = value
        goals = {k: self.aims[c] / self.scales[self.m + k] for k, c in places.items()}
        if not goals:
            return self.close(x, {})[0], 0.0
        near = self._direct(x, goals)
        if near is None:
            near = self._way(x, goals)
        x, left = near
        if left > OPEN:
            self._contradiction(x, goals)
        found, _ = self.close(x, {})
        return found, float(np.max(np.abs((found - x) / self.sizes), initial=0.0))

    def _direct(self, x: Unknowns, goals: Mapping[int, float]) -> tuple[Floats, float] | None:
        """Return the start where it is near the sketch."""
        values, _ = self.rows(x)
        far = max(abs(values[self.m + k] - goal) for k, goal in goals.items())
        found, left = self.close(x, goals, short=0.5)
        if left < self.closed and far <= FAR:
            moved = float(np.max(np.abs((found - x) / self.sizes), initial=0.0))
            there = self._side(found, goals) == self._side(x, goals)
            return (found, left) if there and moved <= 3 * max(far, 0.1) else None
        rank = np.linalg.matrix_rank
        _, J = self.rows(found)
        chosen = [*range(self.m), *(self.m + k for k in goals)]
        extra = rank(J[chosen], self.rank) - rank(J[: self.m], self.rank) if self.m else len(goals)
        # more numbers than freedoms fit each other at their end only
        return (found, left) if extra < len(goals) else None

    def _way(self, x: Floats, goals: Mapping[int, float]) -> tuple[Floats, float]:
        """Return the start at the end of a way from the sketch, in short steps."""
        values, _ = self.rows(x)
        first = {k: values[self.m + k] for k in goals}
        far = max(abs(goal - first[k]) for k, goal in goals.items())
        share, step = 0.0, min(1.0, FAR / far if far else 1.0)
        left, side = 0.0, self._side(x, goals)
        while share < 1:
            ahead = min(1.0, share + step)
            aims = {k: first[k] + ahead * (goal - first[k]) for k, goal in goals.items()}
            found, left = self.close(x, aims)
            moved = float(np.max(np.abs((found - x) / self.sizes), initial=0.0))
            there = self._side(found, goals)
            # modes that meet are passed smoothly; where one ends, a step leaps to the other
            smooth = there == side or (step * far <= PASSED and moved <= STEEP * step * far)
            if left < self.closed and moved <= TURNED and smooth:
                x, share, step, side = found, ahead, step * 1.5, there
                continue
            step /= 2
            if step < 1e-4:
                self._contradiction(found, goals)
        return x, left

    def _side(self, x: Unknowns, goals: Mapping[int, float]) -> float:
        """Return the sign of the Jacobian with the named coordinates given; 0 where it is none."""
        _, J = self.rows(x)
        square = J[[*range(self.m), *(self.m + k for k in goals)]]
        return float(np.linalg.slogdet(square)[0]) if square.shape[0] == square.shape[1] else 0.0

    def _contradiction(self, x: Unknowns, goals: Mapping[int, float]) -> None:
        values, _ = self.rows(x)
        left = {
            self.r.rows[i].name: float(values[k] * self.gaps[k])
            for k, i in enumerate(self.r.left)
            if abs(values[k]) > self.closed
        }
        left |= {
            self.moving[k].text: float((values[self.m + k] - goal) * self.scales[self.m + k])
            for k, goal in goals.items()
            if abs(values[self.m + k] - goal) > self.closed
        }
        raise self._error("the positions given contradict each other", left, "start")

    def _error(self, what: str, left: Mapping[str, float], key: str) -> InconsistentStartError:
        worst = sorted(left.items(), key=lambda item: -abs(item[1]))[:6]
        listed = ", ".join(f"{name} {value:.3g}" for name, value in worst)
        error = InconsistentStartError(
            f"{what} (S3); what is left: {listed}",
            where=key,
            hint="give as many coordinates as the mechanism has freedoms; the others follow",
        )
        error.residuals = dict(left)
        return error

    def velocities(self, x: Unknowns) -> Any:
        """Return the rates of the free coordinates."""
        _, J = self.rows(x)
        aims = {**self.speeds}
        for c, rate in self.law_speeds.items():
            if c in aims and not np.isclose(aims[c], rate, rtol=1e-9, atol=self._least(c)):
                left = {c.text: aims[c] - rate}
                raise self._error("speed and law of time differ", left, "start_speed")
            aims[c] = rate
        places = [k for k, c in enumerate(self.moving) if c in aims]
        chosen = [*range(self.m), *(self.m + k for k in places)]
        target = np.concatenate(
            [np.zeros(self.m), [aims[self.moving[k]] / self.scales[self.m + k] for k in places]]
        )
        if not target.any():
            return np.zeros(self.n)
        share = max(SPEEDS, CONTRADICTING * self.setup.closure)
        rates = np.linalg.lstsq(J[chosen], target, rcond=share)[0]
        for _ in range(2):
            rates += np.linalg.lstsq(J[chosen], target - J[chosen] @ rates, rcond=share)[0]
        left = J[chosen] @ rates - target
        if np.max(np.abs(left)) > OPEN * np.max(np.abs(target)):
            names = [self.r.rows[i].name for i in self.r.left]
            names += [self.moving[k].text for k in places]
            scales = self.scales[chosen]
            found = dict(zip(names, (left * scales).tolist(), strict=True))
            found = {name: value for name, value in found.items() if abs(value) > self.closed}
            raise self._error("the speeds given contradict each other", found, "start_speed")
        return rates * self.sizes


def start(setup: MotionProblem, near: Floats | None = None) -> Start:
    """Return the start, reached from the assembled sketch, or from absolute coordinates `near`."""
    starter = _Starter(setup, near)
    x, correction = starter.positions()
    v = starter.velocities(x)
    r = setup.jointed

    def build() -> Call:
        results = [ca.densify(r.q), ca.densify(r.qd)]
        return Call(ca.Function("absolute", [r.x, r.v, r.t, r.model.p], results))

    q, qd = r.cache("absolute", build)(x, v, 0.0, setup.model.p_values)
    return Start(q, qd, correction)

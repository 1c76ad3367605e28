"""Path generation as an NLP over dimensions and the poses at the precision points.

All at once: the free parameters and the unknowns of every pose are variables, the closure of
every pose is an equation, its branch an inequality, so that a design never leaves the circuit
it is judged on. Nothing is solved inside.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.synthesis.ipopt import Optimum, Solver
from mechdae.synthesis.loops import FourBar, four_bar
from mechdae.synthesis.poses import Poses, parameters_of
from mechdae.synthesis.projection import Start

SX = ca.SX
TURN = 2 * np.pi
WIDE = 40.0
"""Bound of angles [rad]: they are unwrapped, and nothing may run away."""


@dataclass(frozen=True)
class PathGoal:
    """What the point has to do.

    ``targets`` (k, 2); ``mode`` "absolute" (values of the driver in `programme`), "steps"
    (increments from a free start) or "free" (in order within a turn); ``weights`` (k,).
    """

    point: str
    targets: Any
    mode: str
    programme: Any = None
    weights: Any = None

    @property
    def count(self) -> int:
        return len(self.targets)


@dataclass(frozen=True)
class Limits:
    """Margins of the constraints, in the user's units.

    ``grashof`` [m] of each inequality, ``branch`` of |det| relative to its columns (the sine of
    the transmission angle of a dyad RRR), ``order`` [rad] between poses.
    """

    grashof: float = 1e-6
    branch: float = 1e-6
    order: float = 1e-3
    transmission: float = 0.0


@dataclass
class Layout:
    """Where each kind of variable lies in z, and the bounds of z and g."""

    low: Any
    high: Any
    g_low: Any
    g_high: Any
    names: list[str] = field(default_factory=list)


class PathProblem:
    """One Grashof class of a path problem, built once for all starts, branches and senses.

    Parameters
    ----------
    poses
        Of the mechanism.
    goal, limits
        What is asked.
    bounds
        (low, high) of each free parameter by name.
    kind
        "crank-rocker", "drag-link" or "" for no condition on the whole turn.
    """

    def __init__(
        self,
        poses: Poses,
        goal: PathGoal,
        bounds: Mapping[str, tuple[float, float]],
        kind: str = "crank-rocker",
        limits: Limits = Limits(),
    ) -> None:
        self.poses, self.goal, self.kind, self.limits = poses, goal, kind, limits
        self.bounds = [bounds[name] for name in poses.free]
        self.loop: FourBar | None = four_bar(poses.scene)
        self.size = float(np.sqrt(np.mean(np.sum((goal.targets - goal.targets.mean(0)) ** 2, 1))))
        self._build()

    def _build(self) -> None:
        poses, goal = self.poses, self.goal
        k, n = goal.count, len(poses.free)
        d = SX.sym("d", n)
        start = SX.sym("start", goal.mode == "steps")
        u_free = SX.sym("u", k if goal.mode == "free" else 0)
        x = SX.sym("x", poses.nx, k)
        targets, programme = SX.sym("targets", 2, k), SX.sym("programme", k)
        sigma, sense = SX.sym("sigma", poses.nb), SX.sym("sense")
        rest = SX.sym("rest", 1)
        constraints: list[tuple[str, Any, float, float]] = []
        f = SX(0)
        weights = np.ones(k) if goal.weights is None else np.asarray(goal.weights)
        u = []
        for i in range(k):
            if goal.mode == "free":
                u.append(u_free[i])
            elif goal.mode == "steps":
                u.append(start[0] + sense * programme[i])
            else:
                u.append(programme[i])
            F, branch, P = poses.function(x[:, i], u[i], d)
            constraints.append(("closure", F, 0.0, 0.0))
            constraints.append(("branch", sigma * branch, self.limits.branch, np.inf))
            f += float(weights[i]) * ca.sumsqr(P - targets[:, i])
        if goal.mode == "free":
            gaps = [sense * (u[i + 1] - u[i]) for i in range(k - 1)]
            constraints.append(("order", ca.vertcat(*gaps), self.limits.order, np.inf))
            whole = sense * (u[-1] - u[0])
            constraints.append(("turn", whole, -np.inf, TURN - self.limits.order))
        constraints += self._whole_turn(d)
        z = ca.vertcat(d, start, u_free, ca.vec(x))
        p = ca.vertcat(ca.vec(targets), programme, sigma, sense, rest)
        g = ca.vertcat(*[expression for _, expression, _, _ in constraints])
        self.z, self.p, self.g = z, p, g
        self.f = f / (self.size**2)
        g_low = np.concatenate([np.full(e.numel(), low) for _, e, low, _ in constraints])
        g_high = np.concatenate([np.full(e.numel(), high) for _, e, _, high in constraints])
        low = [b[0] for b in self.bounds]
        high = [b[1] for b in self.bounds]
        more = z.numel() - n
        self.layout = Layout(
            np.array([*low, *[-WIDE] * more]), np.array([*high, *[WIDE] * more]), g_low, g_high,
            [name for name, e, _, _ in constraints for _ in range(e.numel())],
        )  # fmt: skip
        self.n = n

    def _whole_turn(self, d: Any) -> list[tuple[str, Any, float, float]]:
        """Return the inequalities of Grashof's class: the crank turns fully."""
        if not self.kind or self.loop is None:
            return []
        p = parameters_of(self.poses.model, self.poses.free, d)
        lengths = ca.substitute(self.loop.lengths, self.poses.model.p, p)
        r1, r2, r3, r4 = ca.vertsplit(lengths)
        if self.kind == "crank-rocker":
            slack = [r3 + r4 - r2 - r1, r1 + r4 - r2 - r3, r1 + r3 - r2 - r4]
        else:
            slack = [r3 + r4 - r1 - r2, r2 + r4 - r1 - r3, r2 + r3 - r1 - r4]
        found = [("full turn", ca.vertcat(*slack), self.limits.grashof, np.inf)]
        if self.limits.transmission:
            least = np.cos(self.limits.transmission)
            for reach in (r1 - r2, r1 + r2):
                cosine = (r3 * r3 + r4 * r4 - reach * reach) / (2 * r3 * r4)
                found.append(("transmission", cosine, -least, least))
        return found

    # -- solving -----------------------------------------------------------------------------

    @cached_property
    def solver(self) -> Solver:
        return Solver(self.z, self.p, self.f, self.g)

    @cached_property
    def polisher(self) -> Solver:
        """The objective divided by its value: what normal tolerances leave is taken away."""
        scaled = self.f / self.p[-1]
        return Solver(self.z, self.p, scaled, self.g, polish=True)

    def parameters(self, branch: Any, sense: int, rest: float = 1.0) -> Any:
        goal = self.goal
        programme = np.zeros(goal.count) if goal.programme is None else goal.programme
        return np.concatenate(
            [np.ravel(goal.targets), programme, np.atleast_1d(branch), [sense, rest]]
        )

    def solve(self, z0: Any, branch: Any, sense: int) -> Optimum:
        """Return the local optimum from a start."""
        lay = self.layout
        p = self.parameters(branch, sense)
        return self.solver.solve(z0, p, lay.low, lay.high, lay.g_low, lay.g_high)

    def polished(self, found: Optimum, branch: Any, sense: int) -> Optimum:
        """Return an optimum with the tolerances drawn tight, the old one if that is no better."""
        lay = self.layout
        scale = max(found.objective, 1e-16) * 1e-4
        p = self.parameters(branch, sense, scale)
        new = self.polisher.solve(found.z, p, lay.low, lay.high, lay.g_low, lay.g_high)
        objective = new.objective * scale
        if new.violation <= max(found.violation, 1e-9) and objective <= found.objective:
            return Optimum(
                new.z, objective, new.violation, found.status, found.iterations + new.iterations,
                found.seconds + new.seconds, new.bound_prices * scale, new.prices * scale,
            )  # fmt: skip
        return found

    def error(self, z: Any, branch: Any, sense: int) -> float:
        """Return the sum of squared distances at a point z, in the user's units."""
        value = self.solver._values(z, self.parameters(branch, sense))[0]
        return float(value) * self.size**2

    # -- what a point z means --------------------------------------------------------------

    def driver_values(self, z: Any, sense: int) -> Any:
        """Return the driver's values at the targets, (k,)."""
        k = self.goal.count
        if self.goal.mode == "free":
            return np.array(z[self.n : self.n + k])
        programme = np.asarray(self.goal.programme, float)
        return z[self.n] + sense * programme if self.goal.mode == "steps" else programme

    def first_pose(self, z: Any) -> Any:
        """Return the unknowns of the first pose."""
        return z[-self.goal.count * self.poses.nx :][: self.poses.nx]

    def active(self, found: Optimum, share: float) -> dict[str, float]:
        """Return the parameters and limits that hold the design back, with their prices.

        A price is the change of the objective per unit by which a limit gives way.
        """
        prices = {}
        size = self.size**2
        for k, name in enumerate(self.poses.free):
            low, high = self.bounds[k]
            near = min(found.z[k] - low, high - found.z[k]) <= share * (high - low)
            if near:
                prices[name] = float(abs(found.bound_prices[k]) * size)
        for word in ("full turn", "transmission", "branch", "order", "turn"):
            rows = [i for i, name in enumerate(self.layout.names) if name == word]
            most = float(np.abs(found.prices[rows]).max(initial=0.0)) * size
            if rows and most > 1e-6 * size:
                prices[word] = most
        return prices

    # -- starts ------------------------------------------------------------------------------

    def point_of(self, start: Start) -> tuple[Any, Any]:
        """Return z and the signs of the branches for a start by projection."""
        assert self.loop is not None
        d = self.fitted(start)
        turn, k = start.turn, self.goal.count
        angles = np.array(self._angles(d)).ravel()  # offsets of crank, coupler, rocker, ground
        crank, coupler, rocker, _ = angles
        absolute = {
            self.loop.coupler: start.couplers + turn - coupler,
            self.loop.rocker: start.rockers + turn - rocker,
        }
        x = np.stack([absolute[body] for body, _ in self.poses.x_names])
        u = np.array([self._driver(start.turns[i] + turn - crank, d) for i in range(k)])
        own: Any = u if self.goal.mode == "free" else np.zeros(0)
        if self.goal.mode == "steps":
            own = np.array([u[0] - start.sense * self.goal.programme[0]])
        z = np.concatenate([d, own, x.T.ravel()])
        inside = [np.array(self.poses.function(x[:, i], u[i], d)[1]).ravel() for i in range(k)]
        return z, np.sign(np.mean(inside, axis=0))

    def relative_programme(self) -> Any:
        """Return the crank's angles from the ground line at the targets, where they are given."""
        if self.goal.mode != "absolute":
            return self.goal.programme
        middle = self._middle
        offset = float(self._crank(0.0, middle)) + np.array(self._angles(middle)).ravel()[0]
        return self.goal.programme + offset - np.array(self._angles(middle)).ravel()[3]

    def fixed_frame(self) -> tuple[complex, float] | None:
        """Return pivot and direction of the ground line where no free parameter moves them."""
        value, slope = (np.array(part) for part in self._geometry(self._middle))
        if np.abs(slope[4:8]).max(initial=0.0) > 0:
            return None
        x, y, c, s = value.ravel()[4:8]
        return complex(x, y), float(np.arctan2(s, c))

    def length_limits(self) -> Any:
        """Return bounds (4, 2) of ground, crank, coupler and rocker from those of d, roughly."""
        assert self.loop is not None
        low, high = np.array(self.bounds).T
        ends = np.array([np.array(self._geometry(d)[0]).ravel()[:4] for d in (low, high)])
        return np.stack([np.minimum(*ends), np.maximum(*ends)], axis=1)

    @property
    def _middle(self) -> Any:
        low, high = np.array(self.bounds).T
        values = self.poses.mechanism.values()
        return np.clip(np.array([values[name] for name in self.poses.free]), low, high)

    @cached_property
    def _geometry(self) -> Any:
        """Free -> lengths, pivot, cos and sin of the ground line, coupler point; its Jacobian."""
        assert self.loop is not None
        d = SX.sym("d", len(self.poses.free))
        p = parameters_of(self.poses.model, self.poses.free, d)
        point = self.loop.point(self.poses.scene, self.goal.point)
        stacked = ca.vertcat(
            self.loop.lengths, self.loop.pivot,
            self.size * ca.cos(self.loop.turn), self.size * ca.sin(self.loop.turn), point,
        )  # fmt: skip
        stacked = ca.substitute(stacked, self.poses.model.p, p)
        return ca.Function("geometry", [d], [stacked, ca.jacobian(stacked, d)])

    @cached_property
    def _angles(self) -> Any:
        assert self.loop is not None
        d = SX.sym("d", len(self.poses.free))
        p = parameters_of(self.poses.model, self.poses.free, d)
        loop = self.loop
        stacked = ca.vertcat(
            *[loop.offsets[body] for body in (loop.crank, loop.coupler, loop.rocker)], loop.turn
        )
        return ca.Function("angles", [d], [ca.substitute(stacked, self.poses.model.p, p)])

    @cached_property
    def _crank(self) -> Any:
        """(u, free) -> angle of the crank."""
        assert self.loop is not None
        d, u = SX.sym("d", len(self.poses.free)), SX.sym("u")
        p = parameters_of(self.poses.model, self.poses.free, d)
        angle = self.poses.scene.recover[self.loop.crank, "angle"]
        angle = ca.substitute(angle, ca.vertcat(self.poses.scene.u, self.poses.model.p),
                              ca.vertcat(u, p))  # fmt: skip
        return ca.Function("crank", [u, d], [angle])

    def _driver(self, angle: float, d: Any) -> float:
        """Return the driver's value that turns the crank to an angle."""
        return float(angle - float(self._crank(0.0, d)))

    def fitted(self, start: Start, steps: int = 12) -> Any:
        """Return the free parameters that make the four-bar of a start, as nearly as they can."""
        wanted = np.concatenate(
            [
                start.lengths, [start.pivot.real, start.pivot.imag],
                self.size * np.array([np.cos(start.turn), np.sin(start.turn)]),
                [start.point.real, start.point.imag],
            ]
        )  # fmt: skip
        low, high = np.array(self.bounds).T
        d = self._middle
        best, least = d, np.inf
        for _ in range(steps):
            g, J = (np.array(part) for part in self._geometry(d))
            left = g.ravel() - wanted
            if float(left @ left) < least:
                best, least = d, float(left @ left)
            step = np.linalg.lstsq(J, left, rcond=1e-12)[0]
            d = np.clip(d - step, low, high)
        return best

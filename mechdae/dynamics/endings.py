"""Why a motion ends early: dead points of laws, steps that shrink to zero, speeds without bound."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.coordinate_kinds import kind_of
from mechdae.dynamics.equations import STILL, MotionProblem
from mechdae.dynamics.integrate import Cut, Integrator, Nodes
from mechdae.dynamics.watchers.sticking import Sticking
from mechdae.errors import InfeasibleMotionError
from mechdae.numerics.null_space import rank
from mechdae.results import Event, motion_event
from mechdae.types import Booleans, Floats, Matrix, Unknowns

DEAD = 1e-6
"""Singular value, over the largest, from which a start is one at a dead point."""
NEAR = 1e-2
"""The same where the step size went to nothing."""
AGAINST = 1e-6
"""Share of what the laws ask for that has to be left for a verdict."""
AWAY = 3e3
"""Coordinates, in natural sizes, from which speeds are looked at."""
DOUBLINGS = 4
"""Doublings of the speed whose time is compared with that of as many before."""
STEADY = 1.1
"""Their times from which a growth is no exponential: powers (t - t0)^k up to k = 29 have more."""
LONG = 5e4
"""Natural sizes that the present speed would run through until the end: less is just computed."""
MEETS = 1e-9
"""Share of the rates of laws of time by which speeds may miss them."""
HOPELESS = 1e9
"""Natural sizes that a growth would run through until the end: no number of steps does that."""


def singular_values(
    setup: MotionProblem, t: float, x: Unknowns, v: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return left vectors and singular values of the scaled Jacobian, and the laws' part of J v."""
    k = setup.kernel
    _, J, phi_t = k.value("place", t, x, v, setup.loose)
    left, sigma, _ = np.linalg.svd(J * k.sizes / k.gaps[:, None])
    return left, sigma, phi_t.ravel() / k.gaps


def dead_point(
    setup: MotionProblem, t: float, x: Unknowns, v: Floats, share: float
) -> tuple[float, str, dict[str, float]] | None:
    """Return what J v = -phi_t leaves at a pose where J has lost rank, None where nothing.

    The largest entry with its unit, the equation it is in, and the others; singular values below
    a share of the largest count as none.
    """
    k = setup.kernel
    if not setup.laws or not k.m:
        return None
    left, sigma, speeds = singular_values(setup, t, x, v)
    small = np.ones(k.m, bool)
    small[: len(sigma)] = sigma <= share * sigma[0]
    lost = left[:, small]
    rest = lost @ (lost.T @ speeds)
    least = max(AGAINST * np.max(np.abs(speeds), initial=0.0), STILL / setup.end)
    if not np.max(np.abs(rest), initial=0.0) > least:
        return None
    r = setup.released
    names = [r.rows[i].name for i in r.left]
    found = dict(zip(names, (rest * k.gaps).tolist(), strict=True))
    worst = int(np.argmax(np.abs(rest)))
    size = float(np.linalg.norm(rest) * k.gaps[worst])
    units = " rad/s" if r.units[worst] == "rad" else " m/s"
    return size, f"{names[worst]}{units}", {name: gap for name, gap in found.items() if gap}


def feasible(setup: MotionProblem, t: Floats, x: Unknowns, v: Floats, signs: Matrix) -> Booleans:
    """Return which states (n, .) have speeds that meet the constraints and the laws of time."""
    k = setup.kernel
    gaps = np.empty(len(t))
    for i in range(len(t)):
        _, J, phi_t = k.value("place", t[i], x[i], v[i], signs[i])
        wanted_speed = np.max(np.abs(phi_t.ravel() / k.gaps), initial=0.0)
        left = np.max(np.abs((J @ v[i] + phi_t.ravel()) / k.gaps), initial=0.0)
        gaps[i] = left / max(float(wanted_speed), STILL / (MEETS * setup.end))
    return gaps <= MEETS


def check_dead_start(setup: MotionProblem, x: Unknowns, v: Floats) -> None:
    """Raise where the laws of time ask for speeds that the joints do not have at the start."""
    found = dead_point(setup, 0.0, x, v, DEAD)
    if found is None:
        return
    raise infeasible(0.0, found)


def infeasible(t: float, found: tuple[float, str, dict[str, float]]) -> InfeasibleMotionError:
    """Return the error for a law that drives on at a dead point."""
    size, row, residuals = found
    name, _, unit = row.partition(" ")
    error = InfeasibleMotionError(
        f"the mechanism is at a dead point at t = {t:.12g} s, and the laws of time go on (S4): no "
        f"speeds meet the constraints, {name} is left with {size:.6g} {unit}",
        where="drivers",
        hint="let the law turn there, drive another coordinate, or start elsewhere",
    )
    error.residuals, error.time = residuals, t
    return error


class Growth:
    """Watches for speeds that grow without bound."""

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.found: dict[str, Any] | None = None
        self._reached: list[float] = []
        self._top = -np.inf
        self._before = (0.0, -np.inf)

    def look(self, nodes: Nodes) -> Cut | None:
        """Look at accepted steps; return the first state from which nothing leads to the end."""
        lay, sizes = self.integrator.layout, self.setup.kernel.sizes
        if not len(sizes):
            return None
        t, v = (lay.of(nodes.states, name) for name in "tv")
        with np.errstate(divide="ignore"):
            heights = np.log2(np.abs(v / sizes).max(axis=1))
        if heights.max() < self._top + 1:
            return None
        for i in range(len(t)):
            if self._doubled(float(t[i]), float(heights[i])) and self._hopeless(nodes.states[i]):
                return self._cut(nodes.states[i])
        return None

    def _doubled(self, t: float, height: float) -> bool:
        """Note a speed, as its logarithm; return whether the fastest has doubled."""
        before, last = self._before
        if self._top == -np.inf:
            self._top = height
        grown = int(height - self._top) if height > -np.inf else 0
        for k in range(grown):
            self._reached.append(t - (t - before) * (height - self._top - k - 1) / (height - last))
        self._top += max(grown, 0)
        self._before = (t, height)
        return grown > 0

    def _hopeless(self, state: Floats) -> bool:
        """Return whether speeds grow like exp(t) and would run through too much until the end."""
        if len(self._reached) <= 2 * DOUBLINGS:
            return False
        lay, sizes = self.integrator.layout, self.setup.kernel.sizes
        first, middle, last = self._reached[-1::-DOUBLINGS][2::-1]
        left = self.setup.end - float(lay.of(state, "t"))
        speed = 2.0**self._top
        if last - middle > STEADY * (middle - first) or speed * left < LONG:
            return False
        rate = DOUBLINGS * np.log(2) / (last - middle)
        way = speed * np.expm1(min(rate * left, 600.0)) / rate
        return bool(np.abs(lay.of(state, "x") / sizes).max() > AWAY and way > HOPELESS)

    def _cut(self, state: Floats) -> Cut:
        """Return the end of the motion at a state."""
        lay, sizes = self.integrator.layout, self.setup.kernel.sizes
        t, v, w = (lay.of(state, name) for name in "tvw")
        k = int(np.argmax(np.abs(v / sizes)))
        name = ".".join(self.setup.released.coordinates[k].key)
        works = dict(zip(self.setup.works, w.tolist(), strict=True))
        load = max(works, key=lambda name: works[name]) if works else ""
        unit = f"{kind_of(name).unit}/s"
        self.found = {"coordinate": name, "speed": float(v[k]), "unit": unit}
        self.found |= {"load": load, "work": works[load]} if load and works[load] > 0 else {}
        event = motion_event("unbounded", float(t), code="S7", **self.found)
        return Cut(state, end=(self._fault(float(t)), event))

    def _fault(self, t: float) -> str:
        """Return what to say about it."""
        assert self.found is not None
        top = self.found
        source = f"; load {top['load']} has put in {top['work']:.3g} J" if "load" in top else ""
        return (
            f"speeds grow without bound (S7): {top['coordinate']} has {top['speed']:.3g} "
            f"{top['unit']} at t = {t:.9g} s of {self.setup.end:g} s{source}; the states "
            "up to there are kept. A negative damping does this"
        )


def stalled(
    setup: MotionProblem, integrator: Integrator, sticking: Sticking, state: Floats, signs: Floats
) -> tuple[str, Event]:
    """Return the fault and the event of a step size that went to nothing."""
    lay = integrator.layout
    t, x, v, h = (lay.of(state, name) for name in ("t", "x", "v", "h"))
    t = float(t)
    dead = dead_point(setup, t, x, v, NEAR)
    if dead is not None:
        error = infeasible(t, dead)
        fault = f"{error.what}; the states up to there are kept. Try: {error.hint}"
        left = {"residual": dead[0], "residuals": dead[2]}
        return fault, motion_event("infeasible", t, code="S4", **left)
    facts: dict[str, dict[str, float] | float] = {"step": float(h)}
    more = []
    if setup.kernel.m:
        _, sigma, _ = singular_values(setup, t, x, v)
        nonzero = sigma[: rank(sigma)]
        facts["sigma_min"] = float(nonzero[-1] / sigma[0]) if len(nonzero) else 0.0
        more.append(f"least singular value of the constraints {facts['sigma_min']:.2g}")
    if setup.kernel.rubs:
        kappa = float(sticking.sizes.contractions(t, x, v, signs)[0])
        facts["kappa"] = kappa
        more.append(f"coupling of friction {kappa:.3g}")
    if sticking.k:
        mode = sticking.mode(signs)
        facts["mode"] = mode
        words = {0.0: "sticks", 1.0: "slides up", -1.0: "slides down"}
        more += [f"{name} {words[side]}" for name, side in mode.items()]
    details = f" ({', '.join(more)})" if more else ""
    fault = (
        f"the step size went to nothing (S7, {float(h):.1g} s) at t = {t:.12g} s of "
        f"{setup.end:g} s{details}; the states up to there are kept. Forces that grow without "
        "bound, or a pose no motion leads through, do this"
    )
    return fault, motion_event("stalled", t, code="S7", **facts)


def crawling(
    setup: MotionProblem, integrator: Integrator, state: Floats, steps: int
) -> tuple[str, Event]:
    """Return the fault and the event of a motion that takes too many steps."""
    t, h = (float(integrator.layout.of(state, name)) for name in "th")
    fault = (
        f"the motion takes steps of {h:.1g} s (S7), more than {steps} of them up to "
        f"t = {t:.9g} s of {setup.end:g} s; the states up to there are kept. Try: a method for "
        'stiff forces, method = "bdf", or a larger tolerance'
    )
    return fault, motion_event("stalled", t, code="S7", step=h)

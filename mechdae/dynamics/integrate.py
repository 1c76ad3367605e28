"""The integration: chunks of steps, states between them, roots of events."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.kernels.graphs.stepper import Chunk, interpolate
from mechdae.numerics.roots import root_between
from mechdae.records import dataclass
from mechdae.results import Event
from mechdae.types import Floats, Json, Matrix, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.equations_of_motion import Kernel
    from mechdae.kernels.graphs.stepper import Layout, Stepper

LEAST = 1e-13
"""Step, as a share of the whole time, below which the integration gives up."""
FIRST = 1.25
"""First step over tol^(1/8) / frequency."""
STILL = 1e-6
"""Share of the frequency without dry friction below which a state counts as at rest."""
STAGES = 12
"""Right-hand sides of a trial step."""
CLOSE = 4e-16
"""How near an event is met, as a share of the time and of the step."""


class NoWay(Exception):
    """No way to go on fits the laws of friction, or several do: the verdict."""

    def __init__(self, text: str, status: str = "jammed", code: str = "F5", **facts: Any) -> None:
        super().__init__(text)
        self.status: str = status
        self.code: str = code
        self.facts: Json = facts


@dataclass
class Nodes:
    """Accepted steps: states (n + 1, .), the first is where the first step starts.

    ``signs`` are the signs of slips that hold over these steps; ``stalled`` tells that the step
    size went to nothing behind the last node.
    """

    states: Floats
    signs: Floats
    stalled: bool = False

    def until(self, state: Floats) -> Nodes:
        """Return the steps up to a state inside one of them."""
        before = self.states[:, 0] < state[0]
        return Nodes(np.vstack([self.states[before], state[None, :]]), self.signs)


@dataclass(frozen=True)
class ContactEvent:
    """A unilateral contact closes, or one that was closed lets go, at a state."""

    state: Floats
    contact: int
    released: bool


@dataclass(frozen=True)
class Cut:
    """Where inside accepted steps a motion does not go on as it did.

    ``turn`` is an event of dry friction and ``touch`` one of a contact, behind which it goes on,
    ``verdict`` tells that friction
    leaves no way, ``end`` (what to say, event) why it ends; none of them: it is to stop here.
    """

    state: Floats
    turn: Any = None
    touch: ContactEvent | None = None
    verdict: NoWay | None = None
    end: tuple[str, Event] | None = None


class Watcher(Protocol):
    """What looks at the accepted steps of a motion, one chunk after the other."""

    def look(self, nodes: Nodes) -> Cut | None:
        """Look at accepted steps; return where the motion does not go on as it did."""


class Integrator(ABC):
    """Integrates a motion by a method: its steps, states inside them, one step."""

    name: str
    implicit = False

    rhs: int

    def __init__(self, setup: MotionProblem) -> None:
        self.setup: MotionProblem = setup
        self.kernel: Kernel = setup.kernel
        self.stepper: Stepper = setup.stepper
        self.layout: Layout = self.stepper.layout
        self.accepted = self.rejected = self.rhs = 0

    def turn_stiff(self) -> bool:
        """Go on by a method for stiff forces; return whether there is one."""
        return False

    @abstractmethod
    def _step_impl(self, state: Floats, signs: Any, end: float, longest: float) -> Iterator[Nodes]:
        """Yield accepted steps, several at a time, until a time or one of no length."""

    @abstractmethod
    def _dense_output_impl(self, nodes: Nodes, times: Floats) -> tuple[Matrix, Matrix, Matrix]:
        """Return x, v and works (n, .) at times inside accepted steps."""

    @abstractmethod
    def stepped(self, state: Floats, h: float, signs: Floats) -> Floats:
        """Return the state a time later; its steps do not count."""

    # -- functions -----------------------------------------------------------------------------

    @cached_property
    def _rhs(self) -> Any:
        return self.kernel.call("rhs", lambda: self.kernel.rhs)

    @cached_property
    def _project(self) -> Any:
        return self.kernel.batch("project", lambda: self.kernel.project)

    @cached_property
    def rates(self) -> Any:
        """(t, x, v, signs) -> x'', lambda for many states."""
        return self.kernel.batch("rhs", lambda: self.kernel.rhs)

    def acceleration(self, t: float, x: Unknowns, v: Floats, signs: Floats) -> Any:
        self.rhs += 1
        return self._rhs(t, x, v, signs)[0]

    # -- states --------------------------------------------------------------------------------

    def first(
        self, t: float, x: Unknowns, v: Floats, w: Floats, signs: Floats, h: float = 0.0
    ) -> Floats:
        """Return the state that an integration starts from."""
        self.rhs += 1
        a, inner = self._rhs(t, x, v, signs)
        m = inner[len(inner) - self.kernel.rubs :]
        lay = self.layout
        state = np.zeros(lay.size)
        for name, value in (("t", t), ("x", x), ("v", v), ("a", a), ("m", m), ("w", w)):
            state[lay[name]] = value
        omega = self.frequency(v, a)
        top = omega
        loose = self.setup.loose * (np.arange(len(signs)) < len(signs) - len(self.setup.closed))
        if (signs != loose).any():  # what rests is measured by what would move it
            self.rhs += 1
            top = max(omega, self.frequency(v, self._rhs(t, x, v, loose)[0]))
            omega = omega if omega > STILL * top else 0.0
        top = max(top, self._driven(t, x, v, signs))
        span = self.setup.end
        natural = FIRST * self.setup.tolerance ** (1 / 8) / omega if omega > 0 else np.inf
        state[lay["h"]] = h or min(natural, span / 10)
        state[lay["omega"]] = top if top > 0 else 1 / span
        return state

    def _driven(self, t: float, x: Unknowns, v: Floats, signs: Floats) -> float:
        """Return the frequency of what laws of time turn in space, 0 without any.

        Beside a shaft that turns steadily, arms may rest: rounding of their speeds is no motion.
        """
        setup, k = self.setup, self.kernel
        if not setup.laws or not setup.model.space.behind:
            return 0.0
        rates = k.call("rates of q", lambda: k.function("rates", [ca.densify(setup.released.qd)]))
        sizes = setup.model.coordinates.sizes(setup.length)
        return float(np.max(np.abs(rates(t, x, v, signs)[0]) / sizes, initial=0.0))

    def frequency(self, v: Floats, a: Floats) -> float:
        sizes = self.kernel.sizes
        return float(np.maximum(np.abs(v) / sizes, np.sqrt(np.abs(a) / sizes)).max(initial=0.0))

    def steps(
        self, state: Floats, signs: Floats, end: float | None = None, longest: float = np.inf
    ) -> Iterator[Nodes]:
        """Yield accepted steps, none longer than `longest`, until a time or a step of nothing."""
        yield from self._step_impl(state, signs, self.setup.end if end is None else end, longest)

    def between(self, nodes: Nodes, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return x, v and works (n, .) at times inside accepted steps, on the constraints."""
        return self._dense_output_impl(nodes, np.asarray(times, float))

    def projected(self, t: float, x: Unknowns, v: Floats, signs: Floats) -> Any:
        """Return the rates of x on the constraints and with locks."""
        return self._project(np.array([[t]]), x[None, :], v[None, :], signs)[1][0]

    def met(
        self,
        state: Floats,
        low: tuple[float, Floats],
        high: tuple[float, Floats],
        signs: Floats,
        value: Callable[[Floats], float],
    ) -> Floats:
        """Return the state between two others where a value over states vanishes."""
        h, first = high[0], value(low[1])
        if first == 0:
            return low[1]
        states = dict((low, high))

        def at(size: float) -> float:
            states[size] = self.stepped(state, size, signs)
            return value(states[size])

        def grain(size: float) -> float:
            return CLOSE * max(abs(float(states[size][0])), h)

        ends = (first, value(high[1]))
        return states[root_between(at, low[0], h, ends, grain)]


class DormandPrince(Integrator):
    """The explicit method of order 8 of Dormand and Prince, in chunks of compiled steps."""

    name = "explicit, Dormand-Prince 8(5,3)"

    @cached_property
    def _chunk(self) -> Chunk:
        return self.kernel.cache("chunk", lambda: Chunk(self.stepper))

    @cached_property
    def _step(self) -> Any:
        return self.kernel.call("step", lambda: self.stepper.step)

    @cached_property
    def _dense(self) -> Any:
        return self.kernel.batch("dense", lambda: self.stepper.dense, (6,))

    def _step_impl(self, state: Floats, signs: Any, end: float, longest: float) -> Iterator[Nodes]:
        lay = self.layout
        given = [end, self.setup.tolerance, longest]
        numbers = np.concatenate([given, signs, self.kernel.numbers])
        while state[lay["t"]][0] < end:
            state = state.copy()
            state[lay["passed"]] = 0
            states = self._chunk(state, numbers)
            good = lay.of(states, "accepted") > 0
            trials = int(states[-1][lay["trials"]][0] - state[lay["trials"]][0])
            self.accepted += int(good.sum())
            self.rejected += trials - int(good.sum())
            self.rhs += STAGES * trials
            last = states[-1]
            least = LEAST * self.setup.end
            stalled = bool(not last[lay["t"]][0] >= end and not last[lay["h"]][0] > least)
            nodes = np.vstack([state[None, :], states[good]])
            state = last
            if len(nodes) > 1 or stalled:
                yield Nodes(nodes, signs, stalled)
            if stalled:
                return

    def _dense_output_impl(self, nodes: Nodes, times: Floats) -> tuple[Matrix, Matrix, Matrix]:
        lay, states = self.layout, nodes.states
        starts = lay.of(states, "t")
        place = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, len(states) - 2)
        used = np.array(sorted(set(place.tolist())), int)
        h = starts[1:] - starts[:-1]
        parts = [lay.of(states[used], name) for name in ("x", "v", "a", "m")]
        inputs = [starts[used][:, None], *parts, h[used][:, None], nodes.signs]
        n = lay.n
        coefficients = self._dense(*inputs)[0].reshape(len(used), 2 * n + lay.works, 7)
        self.rhs += (STAGES + 3) * len(used)
        rows = np.searchsorted(used, place)
        first = np.hstack([lay.of(states[place], name) for name in ("x", "v", "w")])
        share = (times - starts[place]) / h[place]
        found = interpolate(coefficients[rows], first, share)
        x, v, w = found[:, :n], found[:, n : 2 * n], found[:, 2 * n :]
        if self.kernel.m or self.kernel.slips:
            x, v = self._project(times[:, None], x, v, nodes.signs)[:2]
        exact = np.isin(times, starts)
        for k in np.flatnonzero(exact):
            node = states[int(np.searchsorted(starts, times[k]))]
            x[k], v[k], w[k] = (node[lay[name]] for name in ("x", "v", "w"))
        return x, v, w

    def stepped(self, state: Floats, h: float, signs: Floats) -> Floats:
        lay = self.layout
        parts = [state[lay[name]] for name in ("t", "x", "v", "a", "m", "w")]
        omega = state[lay["omega"]][0]
        self.rhs += STAGES
        x, v, a, m, w, _, _ = self._step(*parts, h, signs, omega)
        after = state.copy()
        for name, value in (("x", x), ("v", v), ("a", a), ("m", m), ("w", w)):
            after[lay[name]] = value
        after[lay["t"]] = state[lay["t"]] + h
        return after

"""One step of Dormand and Prince 8(5,3) with projection, chunks of steps, the dense output.

The state of the integration is one vector, see `Layout`. A step that is not accepted leaves it as
it is but for the next step size. What the controller compares with the tolerance is the
error relative to natural sizes: 1 rad and a length of the mechanism for coordinates, for
rates these times the frequency omega = max(|x'|, sqrt|x''|) over the same sizes, so that neither
unit of length nor of mass matters.
"""

from __future__ import annotations

import threading
from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.structure_cache import StructureCache, structure_property
from mechdae.kernels.graphs.equations_of_motion import Kernel
from mechdae.kernels.graphs.tableau import DENSE, FIFTH, NODES, STAGES, THIRD
from mechdae.kernels.run.functions import program, without_repeats
from mechdae.types import Floats, Graph, Matrices, Sym

SX = ca.SX
CHUNK = 32
GROWTH, SAFE, SHRINK = 2.0, 0.8, 0.2
SLOW = 1e-3
"""Share of the highest frequency so far below which the present one does not count."""
UNROLLED = 4000
"""Instructions of a right-hand side up to which twelve of them are one graph."""
STRICT = 0.25
"""Share of the tolerance that the error of a step may have."""
CLOSED = 0.1
"""Share of the tolerance by which constraints may stay open after a projection, beside the
rounding of the coordinates: that of angles grows with their turns."""
ROUNDING = 4e-15
LARGEST = 1e300
"""Sum of squares of a state from which it counts as infinite."""


class Layout:
    """Places in the vector of state.

    ``t``, ``x``, ``v``, ``a``, sizes of friction ``m``, works ``w``, next step ``h``,
    ``rejected`` (the last trial was), highest frequency ``omega``; then of the last trial:
    ``accepted``, ``error``, ``passed`` (a sliding speed has passed zero), and ``trials`` so far.
    """

    def __init__(self, n: int, works: int, sized: int = 0) -> None:
        self.n, self.works = n, works
        place = 0
        self._slices: dict[str, slice] = {}
        for name, size in (
            ("t", 1), ("x", n), ("v", n), ("a", n), ("m", sized), ("w", works), ("h", 1),
            ("rejected", 1), ("omega", 1), ("accepted", 1), ("error", 1), ("passed", 1),
            ("trials", 1),
        ):  # fmt: skip
            self._slices[name] = slice(place, place + size)
            place += size
        self.size = place

    def __getitem__(self, name: str) -> slice:
        return self._slices[name]

    def of(self, state: Floats, name: str) -> Any:
        """Return a part of states (..., size); numbers lose their axis."""
        part = state[..., self[name]]
        return part if name in ("x", "v", "a", "m", "w") else part[..., 0]


class Stepper:
    """Graphs of one step.

    Parameters
    ----------
    kernel
        Right-hand side and projection.
    powers
        SX (k,) over (t, x, v, ``acceleration``, signs, c), integrated along as works.
    acceleration
        Symbols (n,) of the acceleration that powers may hold.
    sizes
        Those of the forces of friction in joints.
    """

    def __init__(
        self, kernel: Kernel, powers: Sym, acceleration: Sym, sizes: Sym | None = None
    ) -> None:
        self.kernel, self.n = kernel, kernel.n
        self.works = powers.numel()
        self.layout = Layout(self.n, self.works, kernel.rubs)
        self.sized = kernel.rubs
        sizes = sizes if sizes is not None else SX.sym("m", self.sized)
        self.power = kernel.function("power", [ca.densify(powers)], [acceleration, sizes])
        self.cache = StructureCache()
        self.fixed = kernel.signs.numel() + kernel.c.numel()

    @structure_property
    def kind(self) -> Any:
        """Type of the symbols: graphs of large right-hand sides are called, not unrolled."""
        return ca.MX if self.kernel.rhs.n_instructions() > UNROLLED else SX

    def sizes(self, c: Sym) -> Sym:
        """Return the natural sizes of the coordinates among the numbers."""
        return c[self.kernel.places_of["sizes"]] if self.n else ca.DM(0, 1)

    def _stages(
        self, t: Sym, x: Sym, v: Sym, a: Sym, m: Sym, h: Sym, signs: Sym, c: Sym, count: int
    ) -> tuple[list[Sym], list[Sym], list[Sym]]:
        """Return rates of x, v and the works at the stages of a step."""
        rates, slopes = [v], [a]
        powers = [self.power(t, x, v, signs, a, m, c)]
        for i in range(1, count):
            row = STAGES[i]
            place = x + h * _combined(row, rates)
            rate = v + h * _combined(row, slopes)
            at = t + NODES[i] * h
            slope, inner = self.kernel.rhs(at, place, rate, signs, c)
            rates.append(rate)
            slopes.append(slope)
            powers.append(self.power(at, place, rate, signs, slope, self._sizes(inner), c))
        return rates, slopes, powers

    def _sizes(self, inner: Sym) -> Sym:
        """Return the sizes of friction among the second results of a right-hand side."""
        return inner[self.kernel.inner - self.sized :] if self.sized else ca.DM(0, 1)

    def _error(self, h: Sym, rates: list[Sym], slopes: list[Sym], omega: Sym, c: Sym) -> Sym:
        """Return the norm of the error over the natural sizes."""
        sizes = self.sizes(c)
        third: list[Sym] = []
        fifth: list[Sym] = []
        for row, total in ((FIFTH, fifth), (THIRD, third)):
            total.append(_combined(row, rates) / sizes)
            total.append(_combined(row, slopes) / (sizes * omega))
        high, low = (ca.sumsqr(ca.vertcat(*parts)) for parts in (fifth, third))
        below = (high + 0.01 * low) * 2 * max(self.n, 1)
        return ca.if_else(below == 0, 0, ca.fabs(h) * high / ca.sqrt(below))

    @structure_property
    def step(self) -> Graph:
        """(t, x, v, a, m, w, h, signs, omega, c) -> new x, v, a, m, w, error, miss."""
        k, sym = self.kernel, self.kind.sym
        t, h, omega = sym("t"), sym("h"), sym("omega")
        x, v, a = (sym(name, self.n) for name in "xva")
        m, w, signs = sym("m", self.sized), sym("w", self.works), sym("signs", k.signs.numel())
        c = sym("c", k.c.numel())
        rates, slopes, powers = self._stages(t, x, v, a, m, h, signs, c, 12)
        place, rate = (y + h * _combined(STAGES[12], k) for y, k in ((x, rates), (v, slopes)))
        work = w + h * _combined(STAGES[12], powers)
        error = self._error(h, rates, slopes, omega, c)
        place, rate, miss = k.project(t + h, place, rate, signs, c)
        after, inner = k.rhs(t + h, place, rate, signs, c)
        inputs = [t, x, v, a, m, w, h, signs, omega, c]
        results = [place, rate, after, self._sizes(inner), work, error, miss]
        return without_repeats("step", inputs, [ca.densify(r) for r in results])

    def _frequency(self, v: Sym, a: Sym, sizes: Sym) -> Sym:
        if not self.n:
            return ca.DM(0)
        return ca.mmax(ca.fmax(ca.fabs(v) / sizes, ca.sqrt(ca.fabs(a) / sizes)))

    @structure_property
    def trial(self) -> Graph:
        """(state, [t_end, tol, longest step, signs, c]) -> state after one trial step."""
        lay = self.layout
        state = self.kind.sym("state", lay.size)
        numbers = self.kind.sym("numbers", 3 + self.fixed)
        end, tol, longest = numbers[0], numbers[1], numbers[2]
        signs, c = ca.vertsplit(numbers, [0, 3, 3 + self.kernel.signs.numel(), 3 + self.fixed])[1:]
        sizes = self.sizes(c)
        part = {name: state[lay[name]] for name in lay._slices}
        t, x, v, a, m, w = (part[name] for name in ("t", "x", "v", "a", "m", "w"))
        left = end - t
        wanted = ca.fmin(part["h"], longest)
        near = wanted >= left * (1 - 1e-10)
        half = wanted > left / 2
        h = ca.if_else(near, left, ca.if_else(half, left / 2, wanted))
        omega = self._frequency(v, a, sizes)
        top = ca.fmax(part["omega"], omega)
        slowest = ca.fmax(omega, SLOW * top)
        place, rate, after, sized, work, error, miss = self.step(
            t, x, v, a, m, w, h, signs, ca.fmax(slowest, 1e-300), c
        )
        grain = ROUNDING * (1 + ca.mmax(ca.fabs(x) / sizes)) if self.n else ROUNDING
        # fmax leaves nan out, a comparison with nan is false: such a step is not accepted
        whole = ca.sumsqr(ca.vertcat(place, rate, after)) + error + miss
        sound = whole < LARGEST
        error = ca.fmax(
            error / (STRICT * tol),
            miss / (CLOSED * tol + grain + c[self.kernel.places_of["closure"]]),
        )
        good = ca.logic_and(error < 1, sound)
        factor = ca.if_else(sound, SAFE * ca.fmax(error, 1e-16) ** (-1 / 8), SHRINK)
        factor = ca.fmin(GROWTH, ca.fmax(SHRINK, factor))
        factor = ca.if_else(ca.logic_and(good, part["rejected"] > 0), ca.fmin(factor, 1), factor)
        following = h * factor
        clipped = ca.logic_and(good, h < part["h"])
        following = ca.if_else(clipped, ca.fmax(following, part["h"]), following)
        kept = ca.vertcat(t, x, v, a, m, w)
        moved = ca.vertcat(ca.if_else(near, end, t + h), place, rate, after, sized, work)
        chosen = ca.if_else(good, moved, kept)
        passed = ca.logic_and(good, self._turned(t + h, place, rate, signs, c))
        done = ca.vertcat(
            chosen, following, ca.if_else(good, 0, 1), top, good, error, passed, part["trials"] + 1
        )
        return without_repeats("trial", [state, numbers], [done])

    def _turned(self, t: Sym, x: Sym, v: Sym, signs: Sym, c: Sym) -> Sym:
        """Return whether a slip moves against its sign."""
        k = self.kernel
        if not k.slips:
            return ca.DM(0)
        speeds = k.function("slips", [ca.densify(k.released.slips)])(t, x, v, signs, c)
        return ca.mmin(speeds * signs[: k.slips]) < 0

    @structure_property
    def advance(self) -> Graph:
        """As `trial`; a state at the end stays, with ``accepted`` 0, and costs nothing.

        So does one behind the reversal of a slip: what follows has another sign.
        """
        lay = self.layout
        state, numbers = ca.MX.sym("state", lay.size), ca.MX.sym("numbers", self.trial.size1_in(1))
        at, parameters = SX.sym("state", lay.size), SX.sym("numbers", numbers.numel())
        still = SX(at)
        still[lay["accepted"]] = 0
        idle = ca.Function("idle", [at, parameters], [still])
        switch = ca.Function.if_else("switch", self.trial, idle)
        going = ca.logic_and(state[lay["t"]] < numbers[0], state[lay["passed"]] == 0)
        after = switch(going, state, numbers)
        return ca.Function("advance", [state, numbers], [after])

    @structure_property
    def dense(self) -> Graph:
        """(t, x, v, a, m, h, signs, c) -> coefficients (2 n + works, 7), by rows."""
        k, sym = self.kernel, self.kind.sym
        t, h = sym("t"), sym("h")
        x, v, a = (sym(name, self.n) for name in "xva")
        signs, c = sym("signs", k.signs.numel()), sym("c", k.c.numel())
        m = sym("m", self.sized)
        stages = self._stages(t, x, v, a, m, h, signs, c, 16)
        change = [h * _combined(STAGES[12], part) for part in stages]
        columns = []
        for part, delta in zip(stages, change, strict=True):
            first, last = part[0], part[12]
            pieces = [delta, h * first - delta, 2 * delta - h * (last + first)]
            pieces += [h * _combined(row, part) for row in DENSE]
            columns.append(ca.horzcat(*pieces))
        whole = ca.densify(ca.vertcat(*columns))
        results = [ca.vec(whole.T)]
        return without_repeats("dense", [t, x, v, a, m, h, signs, c], results)


class Chunk:
    """Many trial steps in one call: of the compiled machine, else `mapaccum` through a buffer.

    Each thread has a buffer of its own.
    """

    def __init__(self, stepper: Stepper, count: int = CHUNK) -> None:
        self.layout, self.count, self.function = stepper.layout, count, stepper.trial
        self._trial = program(stepper.trial)
        if self._trial is None:
            self.function = stepper.advance.mapaccum("chunk", count)
        self._shapes = [(stepper.layout.size,), (count, 3 + stepper.fixed)]
        self._shapes.append((count, stepper.layout.size))
        self._threads = threading.local()

    def __call__(self, state: Floats, numbers: Floats) -> Floats:
        """Return the states (count, .) after each trial step."""
        if self._trial is not None:
            return self._tried(state, numbers)
        try:
            arrays, trigger, _ = self._threads.buffers
        except AttributeError:
            buffer, trigger = self.function.buffer()
            arrays = [np.zeros(shape) for shape in self._shapes]
            for i, array in enumerate(arrays[:2]):
                buffer.set_arg(i, memoryview(array))
            buffer.set_res(0, memoryview(arrays[2]))
            self._threads.buffers = arrays, trigger, buffer
        arrays[0][:] = state
        arrays[1][:] = numbers
        trigger()
        found: Floats = arrays[2].copy()
        return found

    def _tried(self, state: Floats, numbers: Floats) -> Floats:
        """Return the same by single trials, see `Stepper.advance`."""
        t, passed, accepted = (self.layout[name].start for name in ("t", "passed", "accepted"))
        states = np.empty((self.count, self.layout.size))
        for k in range(self.count):
            if not (state[t] < numbers[0] and state[passed] == 0):
                states[k:] = state
                states[k:, accepted] = 0
                break
            states[k] = state = self._trial.one(state, numbers)[0]
        return states


def interpolate(coefficients: Matrices, start: Floats, share: Floats) -> Floats:
    """Return states (n, k) inside steps: `coefficients` (n, k, 7), `start` (n, k), share (n,)."""
    s = np.asarray(share, float)[:, None]
    total = np.zeros_like(start)
    for i in range(7):
        total = (total + coefficients[..., 6 - i]) * (s if i % 2 == 0 else 1 - s)
    return start + total


def _combined(row: dict[int, float], parts: list[Sym]) -> Sym:
    """Return the weighted sum of stages."""
    return sum((weight * parts[j] for j, weight in row.items()), ca.DM.zeros(parts[0].numel()))

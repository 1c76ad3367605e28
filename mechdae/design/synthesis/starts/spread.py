"""Starts for any mechanism: dimensions drawn evenly, moved over a programme all at once.

Each sample is assembled at the first value of the driver by Newton's method from random
unknowns, and follows the driver with the last pose as the next guess; samples that lose their
closure or whose determinants change sign are dropped.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.design.synthesis.space import DesignSpace
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.kernels.run.numpy_backend import straight
from mechdae.types import Booleans, Floats, Integers, Matrix, Unknowns

if TYPE_CHECKING:
    from numpy.random import Generator

    from mechdae.design.synthesis.poses import FreePoses


SX = ca.SX
FIRST, NEXT = 14, 4
"""Newton steps of the first pose, and of each that follows."""
CLOSED = 1e-9
"""Share of the mechanism by which a pose may be open."""
STEP = 0.15
"""Largest step of an angle between poses that are followed [rad]."""
NEAR = (0.1, 4.0)
"""Lengths of mechanisms that are enlarged later are drawn between these shares of the size."""
APART = 0.03
"""Starts differ by this share of the range of a parameter, where ranges are wide of its ratio."""


class Spread:
    """Random designs of a mechanism with their poses."""

    def __init__(self, space: DesignSpace) -> None:
        self.space: DesignSpace = space
        self.poses: FreePoses = space.poses

    @cached_property
    def newton(self) -> Batch:
        """(x, u, d) -> x after a step of Newton's method, closure, branches, asked values."""
        g = self.poses.graphs
        d = SX.sym("d", len(self.poses.free))
        F, branch, values = self.poses.function(g.x, g.u, d)
        step = ca.solve(ca.jacobian(F, g.x), F) if self.poses.nx else SX(0, 1)
        results = [g.x - step, F / self.space.units, ca.densify(branch), ca.densify(values)]
        function = without_repeats("step", [g.x, g.u, d], results)
        return Batch(function, (), straight=lambda: straight(function))

    def moved(
        self, d: Floats, u: Floats, generator: Generator
    ) -> tuple[Integers, Floats, Matrix, Floats]:
        """Return the samples that hold, their poses (m, k, nx), branches (m, nb), values (m, k, w).

        `d` (n, nd) are dimensions, `u` (n, k) the driver's values. The first pose is found from
        random unknowns; a sample that does not close, or changes its branch, is dropped there.
        """
        n, k = u.shape
        x = generator.uniform(-np.pi, np.pi, (n, self.poses.nx))
        x[:, ~self.space.turns] *= self.space.natural[~self.space.turns]
        closed, signs = np.arange(n), None
        places: list[Floats] = []
        values: list[Floats] = []
        with np.errstate(all="ignore"):
            for i in range(k):
                at = u[closed, i : i + 1]
                for _ in range(NEXT if i else FIRST):
                    x = np.nan_to_num(self.newton(x, at, d[closed])[0], posinf=0, neginf=0)
                _, F, branch, value = self.newton(x, at, d[closed])
                sign = np.sign(branch)
                held = np.abs(F).max(axis=1, initial=0.0) <= CLOSED
                held &= (sign[:, self.poses.senses] > 0).all(axis=1)
                held &= (sign == (sign if signs is None else signs)).all(axis=1)
                signs = sign if signs is None else signs
                places.append(x)
                values.append(value)
                if not held.all():
                    closed, x, signs = closed[held], x[held], signs[held]
                    places = [part[held] for part in places]
                    values = [part[held] for part in values]
        assert signs is not None
        return closed, np.stack(places, axis=1), signs, np.stack(values, axis=1)

    def followed(
        self, d: Floats, x: Unknowns, start: float, u: Floats | list[float]
    ) -> tuple[bool, Floats, Floats]:
        """Return whether a design reaches driver values (k,) from a pose, poses, asked values."""
        x, d = np.array(x, float)[None, :], np.asarray(d, float)[None, :]
        last, held, sign = start, True, None
        places, values = [], []
        with np.errstate(all="ignore"):
            for target in u:
                steps = max(1, int(np.ceil(abs(target - last) / STEP)))
                for at in np.linspace(last, target, steps + 1)[1:]:
                    for _ in range(NEXT):
                        x = np.nan_to_num(self.newton(x, [[at]], d)[0], posinf=0, neginf=0)
                _, F, branch, value = self.newton(x, [[target]], d)
                last = target
                sign = np.sign(branch) if sign is None else sign
                held &= bool(np.abs(F).max(initial=0.0) <= CLOSED)
                held &= bool((np.sign(branch) == sign).all())
                places.append(x[0])
                values.append(value[0])
        return held, np.array(places), np.array(values)

    def reached(self, d: Floats, x: Unknowns, u: Floats, start: float) -> tuple[Matrix, bool]:
        """Return poses at driver values (k,) up to where a design opens, and whether it does."""
        found: list[Floats] = []
        last = np.array(x, float)
        sign = np.sign(self.newton(last[None], [[start]], np.asarray(d, float)[None])[2])
        before = start
        for value in u:
            held, poses, _ = self.followed(d, last, before, [value])
            branch = self.newton(poses, [[value]], np.asarray(d, float)[None])[2]
            if not held or (np.sign(branch) != sign).any():
                return np.array(found), False
            last, before = poses[0], float(value)
            found.append(last)
        return np.array(found), True

    # -- dimensions ----------------------------------------------------------------------------

    def designs(self, generator: Generator, count: int, lengths: Booleans | None = None) -> Matrix:
        """Return dimensions (count, nd) within the bounds, and values of what is chosen.

        Positive ranges over more than a decade are drawn by their logarithm. All combinations
        of what is chosen are equally frequent. `lengths` (nd,) are drawn near the mechanism's
        size: it is enlarged later.
        """
        low, high = self.space.box.T
        if lengths is not None:
            positive = lengths & (low > 0)
            ends = [share * self.space.size for share in NEAR]
            high = np.where(positive, np.maximum(ends[1], 1.01 * low), high)
            low = np.where(positive, np.minimum(ends[0], high / 1.01), low)
        share = generator.random((count, len(low)))
        even = low + share * (high - low)
        with np.errstate(all="ignore"):
            logs = np.exp(np.log(low) + share * (np.log(high) - np.log(low)))
        free = np.where((low > 0) & (high > 10 * low), logs, even)
        choices = np.array(list(self.space.choices))
        return np.hstack([free, choices[np.arange(count) % len(choices)]])

    def turning(self, d: Floats, kind: str) -> Any:
        """Return which designs are of a Grashof class; all of them where no class is asked for."""
        space = self.space
        if not kind or space.loop is None:
            return np.ones(len(d), bool)
        r1, r2, r3, r4 = space.lengths(d)[0].T
        if kind == "crank-rocker":
            return (r2 + r1 <= r3 + r4) & (r2 + r3 <= r1 + r4) & (r2 + r4 <= r1 + r3)
        return (r1 + r2 <= r3 + r4) & (r1 + r3 <= r2 + r4) & (r1 + r4 <= r2 + r3)

    @cached_property
    def _wide(self) -> Any:
        low, high = self.space.box.T
        return (low > 0) & (high > 10 * low)

    def distinct(self, d: Floats, order: Integers, count: int) -> list[int]:
        """Return the first places of an order whose designs differ from those before."""
        low, high = self.space.box.T
        n = len(low)
        with np.errstate(all="ignore"):
            logs = np.log(d[:, :n] / low) / np.log(high / low)
        shares = np.where(self._wide, logs, (d[:, :n] - low) / (high - low))
        groups = [tuple(row) for row in d[:, n:]]
        most = max(1, -(-count // max(1, len(set(groups)))))
        chosen: list[int] = []
        used: dict[Any, int] = {}
        for i in order:
            if len(chosen) == count:
                break
            alike = [k for k in chosen if groups[k] == groups[i]]
            if used.get(groups[i], 0) >= most:
                continue
            if alike and np.abs(shares[alike] - shares[i]).max(axis=1).min() < APART:
                continue
            chosen.append(int(i))
            used[groups[i]] = used.get(groups[i], 0) + 1
        return chosen

"""Machines of blocks that translate, with dry friction: who slips and who sticks, by enumeration.

All directions stay as they are, so that between events everything is linear in the state
z = (q, q', 1, t, sines and cosines): it is propagated by the exponential of a matrix. At an event
every choice of sticking, of sides and of signs of normal forces is a linear system; what is
consistent a moment later is how the machine goes on. Nothing here is of the package.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

GRID = 3000
"""Places at which a stretch of time is looked at."""
SOON = 1e-6
"""Share of the whole time after which a choice has to be consistent."""
REST = 1e-9
"""Speed, over the largest so far, that is none."""
Choice = tuple[tuple[int, ...], tuple[int, ...]]
"""Sides of all slips, 0 that stick; signs of all normal forces."""


class Undecided(Exception):
    """No choice is consistent, or several are: the draw is no test."""


@dataclass
class Slip:
    """A rubbing pair: row of its speed, its coefficients, and what presses it.

    ``row`` is the constraint whose force presses, None where ``size`` is a fixed one; ``speed`` is
    that of what it rubs on.
    """

    name: str
    along: Any
    mu: float
    static: float
    row: int | None = None
    size: float = 0.0
    speed: float = 0.0


@dataclass
class Load:
    """A force a + b t + c sin(w t + p) along a direction of q."""

    along: Any
    a: float
    b: float
    c: float
    w: float
    p: float


@dataclass
class Machine:
    """M q'' = loads - K q - D q' + G' lambda + T' f with G q'' = 0."""

    mass: Any
    G: Any
    K: Any
    D: Any
    slips: list[Slip]
    loads: list[Load]
    steady: Any
    q: Any
    v: Any
    end: float


@dataclass
class Course:
    """Events (t, kind, names), and the state at the end."""

    events: list[tuple[float, str, frozenset[str]]] = field(default_factory=list)
    q: Any = None
    v: Any = None
    edge: float = np.inf
    """The nearest that anything that did not happen came to happening."""


def exponential(A: Any) -> Any:
    """Return exp(A): Taylor's series of A over a power of two, squared again."""
    size = float(np.abs(A).sum(axis=1).max(initial=0.0))
    halvings = max(0, int(np.ceil(np.log2(size / 0.25))) if size > 0 else 0)
    A = A / 2.0**halvings
    term = total = np.eye(len(A))
    for k in range(1, 17):
        term = term @ A / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


class Follower:
    """Follows a machine from event to event."""

    def __init__(self, machine: Machine) -> None:
        self.m = machine
        self.n, self.r, self.k = len(machine.mass), len(machine.G), len(machine.slips)
        waves = [load for load in machine.loads if load.c]
        self.size = 2 * self.n + 2 + 2 * len(waves)
        n = self.n
        self.shift = np.zeros((self.size, self.size))
        self.force = np.zeros((n, self.size))
        self.force[:, :n], self.force[:, n : 2 * n] = -machine.K, -machine.D
        self.force[:, 2 * n] = machine.steady
        self.shift[:n, n : 2 * n] = np.eye(n)
        self.shift[2 * n + 1, 2 * n] = 1.0
        self.z = np.zeros(self.size)
        self.z[:n], self.z[n : 2 * n], self.z[2 * n] = machine.q, machine.v, 1.0
        at = 2 * n + 2
        for load in machine.loads:
            self.force[:, 2 * n] += load.a * load.along
            self.force[:, 2 * n + 1] += load.b * load.along
        for load in waves:
            self.force[:, at] += load.c * load.along
            self.z[at], self.z[at + 1] = np.sin(load.p), np.cos(load.p)
            self.shift[at, at + 1], self.shift[at + 1, at] = load.w, -load.w
            at += 2
        self.T = np.array([slip.along for slip in machine.slips]).reshape(self.k, n)
        self.speeds = np.zeros((self.k, self.size))
        self.speeds[:, n : 2 * n] = self.T
        self.speeds[:, 2 * n] = [-slip.speed for slip in machine.slips]
        self.units = self._units()
        self.coupled = self._coupled()
        self.fastest = 0.0
        self._solved: dict[Any, Any] = {}

    def _units(self) -> list[list[int]]:
        """Return the slips that only move together: parallel rows of the freedoms."""
        _, sigma, right = np.linalg.svd(self.m.G) if self.r else (0, np.zeros(0), np.eye(self.n))
        free = right[int((sigma > 1e-12).sum()) :].T
        rows = self.T @ free
        self.sense = np.zeros(self.k, int)
        found: list[list[int]] = []
        for k, row in enumerate(rows):
            for unit in found:
                cosine = row @ rows[unit[0]] / np.linalg.norm(row) / np.linalg.norm(rows[unit[0]])
                if abs(abs(cosine) - 1) < 1e-12:
                    self.sense[k] = round(cosine)
                    unit.append(k)
                    break
            else:
                self.sense[k] = 1
                found.append([k])
        return found

    def _coupled(self) -> list[int]:
        """Return the constraints whose forces friction changes."""
        if not self.r:
            return []
        over = self.m.G / self.m.mass
        effect = np.linalg.solve(over @ self.m.G.T, over @ self.T.T)
        used = {slip.row for slip in self.m.slips if slip.row is not None}
        return [j for j in sorted(used) if np.abs(effect[j]).max() > 1e-12]

    # -- linear systems --------------------------------------------------------------------

    def solved(self, sides: Any, signs: Any, static: frozenset[int]) -> Any:
        """Return q'', lambda, f as rows over z; of units that stick the first slip holds."""
        key = (tuple(sides), tuple(signs), static)
        if key in self._solved:
            return self._solved[key]
        n, r, k = self.n, self.r, self.k
        A, B = np.zeros((n + r + k, n + r + k)), np.zeros((n + r + k, self.size))
        A[:n, :n] = np.diag(self.m.mass)
        A[:n, n : n + r], A[:n, n + r :] = -self.m.G.T, -self.T.T
        A[n : n + r, :n] = self.m.G
        B[:n] = self.force
        first = {unit[0] for unit in self.units}
        for i, slip in enumerate(self.m.slips):
            row = n + r + i
            mu = slip.static if i in static else slip.mu
            if sides[i] == 0 and i in first:
                A[row, :n] = self.T[i]
                continue
            A[row, row] = 1.0
            if sides[i] and slip.row is None:
                B[row, 2 * n] = -sides[i] * slip.size * mu
            elif sides[i]:
                A[row, n + slip.row] = sides[i] * mu * signs[slip.row]
        try:
            found = np.linalg.solve(A, B)
        except np.linalg.LinAlgError:
            raise Undecided("singular") from None
        self._solved[key] = found
        return found

    def matrix(self, S: Any) -> Any:
        L = self.shift.copy()
        L[self.n : 2 * self.n] = S[: self.n]
        return L

    def margins(self, S: Any, sides: Any, signs: Any, Z: Any, static: frozenset[int]) -> Any:
        """Return what has to be positive at states Z (., n): normal forces, limits, rates."""
        n, r = self.n, self.r
        found = []
        parts = S @ Z
        for i, slip in enumerate(self.m.slips):
            alone = len(next(unit for unit in self.units if i in unit)) == 1
            if not alone and sides[i] == 0:
                continue  # they share their load in no known way
            size = slip.size if slip.row is None else signs[slip.row] * parts[n + slip.row]
            if slip.row is not None:
                found.append(size)
            if sides[i] == 0 and alone:
                found.append(slip.static * size - np.abs(parts[n + r + i]))
            if i in static and sides[i]:
                found.append(sides[i] * (self.T[i] @ parts[:n]))
        return np.array(found).reshape(len(found), Z.shape[1])

    # -- events ----------------------------------------------------------------------------

    def choices(self, sides: Any, resting: list[list[int]], signs: Any) -> Iterator[Any]:
        """Yield the sides and signs to be tried, some units at rest."""
        ways = [[(0,) * len(u), *(tuple(s * self.sense[k] for k in u) for s in (1, -1))]
                for u in resting]  # fmt: skip
        for way in itertools.product(*ways):
            own = np.array(sides)
            for unit, side in zip(resting, way, strict=True):
                own[unit] = side
            for flips in itertools.product((1, -1), repeat=len(self.coupled)):
                turned = np.array(signs)
                turned[self.coupled] = flips
                yield own, turned

    def resolved(self, z: Any, sides: Any, resting: list[list[int]], signs: Any) -> Any:
        """Return sides and signs with which the machine goes on behind a state."""
        static = frozenset(k for unit in resting for k in unit)
        moving, rests = [], []
        for own, turned in self.choices(sides, resting, signs):
            S = self.solved(own, turned, static)
            soon = exponential(self.matrix(S) * SOON * self.m.end) @ z
            left = self.margins(S, own, turned, soon[:, None], static)
            begun = [k for k in static if own[k]]
            away = own[begun] * (self.speeds[begun] @ soon)
            if (left > 0).all() and (away > 0).all():
                stuck = sum(len(u) > 1 and own[u[0]] == 0 for u in resting)
                (rests if stuck else moving).append((stuck, own, turned, S[: self.n] @ soon))
        found = moving or rests
        if not found:
            raise Undecided("nothing fits")
        least = min(entry[0] for entry in found)
        found = [entry for entry in found if entry[0] == least]
        if any(np.abs(entry[3] - found[0][3]).max() > 1e-9 * (1 + np.abs(found[0][3]).max())
               for entry in found):  # fmt: skip
            raise Undecided("several fit")
        return found[0][1], found[0][2]

    def course(self) -> Course:
        """Return the events until the end."""
        found, t = Course(), 0.0
        sides, signs = np.zeros(self.k, int), np.ones(self.r, int)
        before = None
        while True:
            if len(found.events) > 60:
                raise Undecided("events without end")
            speeds = self.speeds @ self.z
            self.fastest = max(self.fastest, float(np.abs(speeds).max(initial=0.0)))
            resting = [
                unit
                for unit in self.units
                if np.abs(speeds[unit]).max() <= REST * self.fastest
                or (before is not None and before[unit[0]] == 0)
            ]
            for k in range(self.k):
                sides[k] = np.sign(speeds[k])
            for unit in resting:
                sides[unit] = 0
            probe = self.solved(sides, signs, frozenset()) @ self.z
            signs = np.where(probe[self.n : self.n + self.r] < 0, -1, 1)
            sides, signs = self.resolved(self.z, sides, resting, signs)
            if before is not None:
                self._note(found, t, before, sides)
            before = sides.copy()
            t, going = self._stretched(t, sides, signs)
            if not going:
                found.q, found.v = self.z[: self.n], self.z[self.n : 2 * self.n]
                return found

    def _note(self, found: Course, t: float, before: Any, sides: Any) -> None:
        kinds: dict[str, set[str]] = {}
        for k, slip in enumerate(self.m.slips):
            if sides[k] == before[k]:
                continue
            kind = "slip" if before[k] == 0 else "stick" if sides[k] == 0 else "reversal"
            kinds.setdefault(kind, set()).add(slip.name)
        found.events += [(t, kind, frozenset(names)) for kind, names in sorted(kinds.items())]

    def _valid(self, Z: Any, sides: Any, signs: Any) -> Any:
        """Return whether a choice still holds at states (., n)."""
        S = self.solved(sides, signs, frozenset())
        good = (self.margins(S, sides, signs, Z, frozenset()) > 0).all(axis=0)
        moving = np.flatnonzero(sides)
        good &= ((self.speeds[moving] @ Z) * sides[moving, None] > 0).all(axis=0)
        for unit in self.units:
            if len(unit) > 1 and sides[unit[0]] == 0:
                good &= ~self._starts(Z, sides, signs, unit)
        return good

    def _starts(self, Z: Any, sides: Any, signs: Any, unit: list[int]) -> Any:
        """Return whether a unit that sticks could start at states."""
        found = np.zeros(Z.shape[1], bool)
        for own, turned in self.choices(sides, [unit], signs):
            if own[unit[0]]:
                S = self.solved(own, turned, frozenset(unit))
                found |= (self.margins(S, own, turned, Z, frozenset(unit)) > 0).all(axis=0)
        return found

    def _stretched(self, t: float, sides: Any, signs: Any) -> tuple[float, bool]:
        """Go on until a choice holds no more; return the time, and whether there is more."""
        L = self.matrix(self.solved(sides, signs, frozenset()))
        left, begin = self.m.end - t, self.z
        step = exponential(L * left / GRID)
        Z = np.empty((self.size, GRID + 1))
        Z[:, 0] = begin
        for i in range(GRID):
            Z[:, i + 1] = step @ Z[:, i]
        good = self._valid(Z, sides, signs)
        good[0] = True
        bad = np.flatnonzero(~good)
        seen = self.speeds @ Z[:, : bad[0] if len(bad) else None]
        self.fastest = max(self.fastest, float(np.abs(seen).max(initial=0.0)))
        if not len(bad):
            self.z = Z[:, -1]
            return self.m.end, False
        low, high = (bad[0] - 1) * left / GRID, bad[0] * left / GRID
        if low == 0.0:  # what has just begun is on its edge there
            low = 1e-3 * high
            if not self._valid((exponential(L * low) @ begin)[:, None], sides, signs)[0]:
                raise Undecided("ends as it begins")
        for _ in range(70):
            middle = (low + high) / 2
            state = (exponential(L * middle) @ begin)[:, None]
            low, high = (middle, high) if self._valid(state, sides, signs)[0] else (low, middle)
        self.z = exponential(L * high) @ begin
        return t + high, True

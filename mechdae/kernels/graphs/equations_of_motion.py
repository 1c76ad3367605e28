"""Right-hand side and projection of the motion: one kernel for all scenes.

    [M, J^T; J, -E] [a; lambda] = [f; gamma],   E = eps diag(size of J M^-1 J^T)

solved by its range-space form and corrected six times with the right-hand side [0; E lambda].
What E takes away along a direction with singular value s of the scaled J M^(-1/2) is
(eps/(s^2 + eps))^7 of it: regular directions are exact, along redundant ones the multiplier is
the shortest, and no decision about the rank is taken. Where M is singular, M + J^T W J takes its
place, with f + J^T W gamma: the same solution for any W.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.forces.feedback import ACROSS, Feedback
from mechdae.equations.motion_equations import Released
from mechdae.equations.structure_cache import StructureCache, forget, structure_property
from mechdae.kernels.graphs.friction_sizes import first_sizes, miss_of, sizes_by_newton
from mechdae.kernels.graphs.linear import Factor, entries, recovered
from mechdae.kernels.run.functions import Batch, Call, without_repeats
from mechdae.types import Floats, Graph, Sym, Unknowns

SX = ca.SX
EPSILON = 1e-8
PASSES = 6
"""Corrections of the multipliers."""
TAKEN = 100.0
"""What E takes at least, over what constraints may stay open by: along a direction that noise alone
makes regular, a projection moves by less than a tenth of that noise."""
DEFINITE = 1e-9
"""Least eigenvalue of the scaled mass matrix that counts as definite."""
NEWTON = 2
"""Steps of a projection to the constraints, and of one to their rates."""
SIZES = 6
"""Steps of Newton's method for the forces of friction."""
SIZES_OF_BALLS = 8
"""The same beside balls, whose friction turns with their load."""
SOLVED = 1e-9
"""How far these may be from their laws, relative to the largest: else there is no right-hand
side, and a step that meets it is rejected."""


class Kernel:
    """Functions of the equations of motion, the same for all numbers of one structure.

    Their inputs are t, x, v, ``signs`` (what is fixed between events) and ``c``: all numbers.
    Copies `at` numbers share the functions; `call` and `batch` put the numbers in.

    Parameters
    ----------
    released
        The equations in symbols.

    Attributes
    ----------
    sizes, gaps : (n,), (m,) arrays
        Natural sizes of the coordinates x and of the constraints.
    numbers : array
        Values of ``c``.
    """

    sizes: Floats
    gaps: Floats
    numbers: Floats

    cache: StructureCache

    def __init__(self, released: Released) -> None:
        self.released = released
        self.n: int = released.x.numel()
        self.m: int = released.phi.numel()
        self.slips: int = released.rubbing.count + len(released.unilateral)
        self.rubs: int = len(released.rubbing.feedbacks)
        self.inner: int = self.m + self.slips + self.rubs
        self.t: Sym = released.t
        self.x: Sym = released.x
        self.v: Sym = released.v
        self.signs: Sym = released.signs
        counts = {"sizes": self.n, "gaps": self.m, "eps": self.m, "weights": self.m}
        counts |= {"lock_sizes": self.slips, "widths": released.rubbing.count, "closure": 1}
        self.given: dict[str, Sym] = {"p": released.model.p}
        self.given |= {name: SX.sym(name, count) for name, count in counts.items()}
        self.c: Sym = ca.vertcat(*self.given.values())
        ends = np.cumsum([0, *(part.numel() for part in self.given.values())]).tolist()
        self.places_of: dict[str, slice] = dict(
            zip(self.given, map(slice, ends[:-1], ends[1:]), strict=True)
        )
        self.inputs: list[Sym] = [self.t, self.x, self.v, self.signs, self.c]
        self.definite: bool = True
        self.cache = self._first = StructureCache()

    def at(
        self, p: Floats, length: float, widths: Floats | None = None, closure: float = 0.0
    ) -> Kernel:
        """Return the same functions with numbers; scalings are those of no pose yet.

        Parameters
        ----------
        p
            Values of the parameters.
        length
            By which lengths are measured [m].
        widths
            Slope speed of each slip, in its unit, where friction is smoothed.
        closure
            Share of their natural sizes by which constraints may stay open, as the file says.
        """
        other, r = copy(self), self.released
        other.sizes = np.asarray(r.coordinates.sizes(length), float)
        other.gaps = np.array(r.gaps(length))
        other.numbers = np.ones(self.c.numel())
        other._put(p=p, sizes=other.sizes, gaps=other.gaps, closure=np.array([closure]))
        if widths is not None:
            other._put(widths=widths)
        return other

    def _put(self, **values: Floats) -> None:
        for name, value in values.items():
            self.numbers[self.places_of[name]] = value

    # -- evaluation ----------------------------------------------------------------------------

    def call(self, name: str, function: Callable[[], object]) -> Callable[..., list[Any]]:
        """Return what evaluates a function at one state, its numbers put in; kept by its name."""
        found: Call = self.cache(("call", name), lambda: Call(function()))
        return lambda *at: found(*at, self.numbers)

    def batch(
        self, name: str, function: Callable[[], Any], shared: Sequence[int] = (3,)
    ) -> Callable[..., list[Any]]:
        """Return the same for many states; signs are `shared` unless there are some for each."""

        def made() -> Batch:
            built = function()
            return Batch(built, [*shared, built.n_in() - 1], straight=lambda: None)

        found: Batch = self.cache(("batch", name, *shared), made)
        return lambda *at: found(*at, self.numbers)

    def value(self, name: str, *at: Floats | float) -> list[Floats]:
        """Return the results of ``place``, ``parts``, ... at a state as dense matrices."""

        def dense() -> Graph:
            built = getattr(self, name)
            results = built.call(self.inputs)
            return ca.Function(name, self.inputs, [ca.densify(part) for part in results])

        found = self.call(f"{name} dense", dense)(*at)
        shapes = [getattr(self, name).size_out(i) for i in range(len(found))]
        return [np.reshape(part, shape) for part, shape in zip(found, shapes, strict=True)]

    # -- the parts -----------------------------------------------------------------------------

    def function(self, name: str, results: Sequence[Sym], more: Sequence[Sym] = ()) -> Graph:
        """Return the function (t, x, v, signs, ..., c)."""
        at = [self.t, self.x, self.v, self.signs, *more, self.c]
        return without_repeats(name, at, list(results))

    @structure_property
    def place(self) -> Graph:
        """(t, x, v, signs, c) -> phi, J, phi_t."""
        r = self.released
        return self.function("place", [ca.densify(r.phi), r.J, ca.densify(r.phi_t)])

    @structure_property
    def parts(self) -> Graph:
        """(t, x, v, signs, c) -> M, f, J, gamma."""
        r = self.released
        return self.function("parts", [r.M, r.f, r.J, ca.densify(r.gamma)])

    def scale(self, t: float, x: Unknowns, v: Floats, signs: Floats) -> None:
        """Fix the scalings at a pose."""
        M, _, J, _ = self.value("parts", t, x, v, signs)
        ends = np.diag(M).copy()
        for ball in self.released.coordinates.balls:  # one of the four has no inertia of its own
            ends[ball] = ends[ball].mean()
        whole = ends / self.sizes**2 if self.n else ends
        mean = whole[ends > 0].mean() if (ends > 0).any() else 1.0
        ends[ends <= 0] = mean * self.sizes[ends <= 0] ** 2
        inverse = 1 / np.sqrt(ends)
        scaled = M * np.outer(inverse, inverse)
        rows = np.sum((J * inverse) ** 2, axis=1)
        least = 1e-12 * rows.max(initial=0.0)
        rows = np.where(rows > least, rows, rows.mean() if self.m and rows.any() else 1.0)
        closure = self.numbers[self.places_of["closure"]][0]
        self._put(eps=max(EPSILON, TAKEN * closure) * rows, weights=1 / rows)
        if self.slips:
            C = self.value("locking", t, x, v, signs)[0]
            squares = np.sum((C * inverse) ** 2, axis=1)
            self._put(lock_sizes=np.where(squares > 0, squares, 1.0))
        self.definite = bool(self.n == 0 or np.linalg.eigvalsh(scaled)[0] > DEFINITE)
        self.cache = self._first if self.definite else self._first("indefinite", StructureCache)
        forget(self)

    @property
    def _weights(self) -> Sym | None:
        """What stands for W, None where M is definite."""
        return None if self.definite else self.given["weights"]

    # -- solutions -------------------------------------------------------------------------

    @structure_property
    def locking(self) -> Graph:
        """(t, x, v, signs, c) -> Jacobian of what locks hold, its rates at x'' = 0, its speeds."""
        r = self.released
        speeds = r.moved(r.lockable)
        C = ca.jacobian(speeds, r.v)
        return self.function("locking", [C, ca.densify(r.rate(speeds)), ca.densify(speeds)])

    def _locked(self, M: Sym, J: Sym, at: list[Sym]) -> tuple[_Solver, Sym, Sym]:
        """Return the solver with locks, what is locked, and rates of the slips at x'' = 0."""
        if not self.slips:
            return _Solver(M, J, self.given["eps"], self._weights), SX(0, 1), SX(0, 1)
        C, rates, _ = self.locking(*at)
        locks = self.released.locks
        C = ca.densify(C)
        for k in range(self.slips):
            C[k, :] = C[k, :] * locks[k]
        sizes = self.given["lock_sizes"]
        eps = ca.vertcat(self.given["eps"], sizes * (EPSILON * locks + 1 - locks))
        whole = ca.vertcat(J, ca.sparsify(C))
        return _Solver(M, whole, eps, self._weights), locks, rates

    @structure_property
    def coupling(self) -> Graph:
        """(t, x, v, signs, c) -> solutions without friction in joints and by unit of its sizes.

        A solution is x'', lambda, forces of locks; then linear forms of the feedbacks, stacked, and
        their slopes by columns.
        """
        r, at = self.released, self.inputs
        M, f, J, gamma = self.parts(*at)
        solver, locks, rates = self._locked(M, J, at)
        if self._weights is not None:
            f = f + J.T @ (self._weights * gamma)
        none = SX.zeros(self.m + self.slips)
        a, lam = solver.solve(f, ca.vertcat(gamma, -locks * rates))
        columns, ends = [ca.vertcat(a, lam)], [0, self.n, self.n + self.m + self.slips]
        if not self.rubs:
            return without_repeats("coupling", at, [columns[0], SX(0, 1), SX(0, 0)])
        form = self._forms()
        base, effects = self.function("pushes", [ca.densify(r.push), r.rubbed])(*at)
        V = self.function("V", [r.V])(*at)
        unit = [SX(ca.DM(row)) for row in np.eye(self.rubs)]
        free = [base, *ca.vertsplit(columns[0], ends), SX(1), SX.zeros(self.rubs)]
        starts, slopes = form(*at[:4], *free, self.c), []
        for j in range(self.rubs):
            b, tau = solver.solve(ca.densify(V.T @ effects[:, j]), none)
            columns.append(ca.vertcat(b, tau))
            inputs = [ca.densify(effects[:, j]), b, tau, SX(0), unit[j]]
            slopes.append(form(*at[:4], *inputs, self.c))
        results = [ca.horzcat(*columns), starts, ca.horzcat(*slopes)]
        return without_repeats("coupling", at, [ca.densify(p) for p in results])

    def _forms(self) -> Graph:
        """Return the function of the linear forms of all feedbacks, stacked.

        Over (t, x, v, signs, forces at the absolute coordinates, accelerations, multipliers and
        holding forces, 1 where loads act themselves, sizes that act, c).
        """
        r = self.released
        push, applied = SX.sym("push", r.push.numel()), SX.sym("a", self.n)
        inner, acts = SX.sym("inner", self.m + self.slips), SX.sym("acts")
        sizes = SX.sym("sizes", self.rubs)
        lam, held = ca.vertsplit(inner, [0, self.m, self.m + self.slips])
        given = push - r.mass @ (r.V @ applied)
        given -= r.held_back @ held if self.slips else 0
        every = recovered(r, given, lam)
        if r.model.space.behind:
            passed = r.passed.at(applied, every, held, sizes, acts)
            forms = [
                r.moved(SX(feedback.forms)) @ passed[r.passed.place(feedback.joint)]
                for feedback in r.rubbing.feedbacks
            ]
        else:
            forms = [
                r.moved(SX(feedback.forms)) @ self._forces_of(feedback, every, held)
                for feedback in r.rubbing.feedbacks
            ]
        return self.function("forms", [ca.vertcat(*forms)], [push, applied, inner, acts, sizes])

    def _forces_of(self, feedback: Feedback, every: Sym, held: Sym) -> Sym:
        """Return what the forms of a feedback are over, in the plane."""
        r = self.released
        if feedback.contact is None:
            return every[r.own(feedback)]
        return held[r.rubbing.count + feedback.contact]

    @property
    def places(self) -> list[slice]:
        """Which of the stacked forms belong to each feedback."""
        found, start = [], 0
        for feedback in self.released.rubbing.feedbacks:
            count = feedback.forms.shape[0]
            found.append(slice(start, start + count))
            start += count
        return found

    @structure_property
    def coupled(self) -> Graph:
        """(t, x, v, signs, c) -> x'', (lambda, forces of locks, sizes), how far sizes miss laws."""
        at = self.inputs
        columns, starts, slopes = self.coupling(*at)
        total, m, miss = columns[:, 0], SX(0, 1), SX(0)
        if self.rubs:
            laws = [feedback.law for feedback in self.released.rubbing.feedbacks]
            first = [starts[place] for place in self.places]
            slope = [[slopes[place, j] for j in range(self.rubs)] for place in self.places]
            steps = SIZES_OF_BALLS if any(law in ACROSS for law in laws) else SIZES
            begin = first_sizes(laws, first, slope)
            found = sizes_by_newton(laws, first, slope, steps, begin)
            miss, m = miss_of(laws, first, slope, found), ca.vertcat(*found)
            total = total + columns[:, 1:] @ m
        a, forces = ca.vertsplit(total, [0, self.n, self.n + self.m + self.slips])
        return ca.Function("coupled", at, [a, ca.vertcat(forces, m), miss])

    @structure_property
    def sticking(self) -> Graph:
        """(t, x, v, signs, c) -> what decides between stick and slip, (k,) each, and a number.

        Speeds of the slips, their rates, forces that hold locked ones, the least and the largest
        that friction can give there; how far sizes miss their laws.
        """
        at = self.inputs
        a, inner, miss = self.coupled(*at)
        results = [*self._decisive(a, inner), miss]
        return without_repeats("sticking", at, [ca.densify(e) for e in results])

    @structure_property
    def sticking_of(self) -> Graph:
        """(t, x, v, signs, sizes of friction, c) -> as `sticking`, without the number."""
        at, m = self.inputs, SX.sym("m", self.rubs)
        columns, _, _ = self.coupling(*at)
        total = columns[:, 0] + columns[:, 1:] @ m
        results = self._decisive(total[: self.n], ca.vertcat(total[self.n :], m))
        return ca.Function("sticking", [*at[:4], m, self.c], [ca.densify(e) for e in results])

    def _decisive(self, a: Sym, inner: Sym) -> list[Sym]:
        """Return what decides between stick and slip, for accelerations and what goes with them."""
        r, at = self.released, self.inputs
        C, rates, speeds = self.locking(*at)
        falls, grows = (r.moved(part) for part in r.rubbing.limits)
        feedbacks = r.rubbing.feedbacks
        rising = [SX(feedback.strength) for feedback in feedbacks]
        falling = [
            SX(feedback.strength if feedback.falling is None else feedback.falling)
            for feedback in feedbacks
        ]
        strengths = [r.moved(part) for part in (*rising, *falling)]
        function = self.function("limits", [ca.densify(falls), ca.densify(grows), *strengths])
        falls, grows, *strengths = function.call(at)
        none = SX.zeros(len(r.unilateral))
        high, low = ca.vertcat(falls, none), -ca.vertcat(grows, none)
        for j, k in enumerate(r.rubbing.owners):
            if k is not None:
                size = inner[self.m + self.slips + j]
                low[k] -= strengths[j] * size
                high[k] += strengths[len(feedbacks) + j] * size
        held = -inner[self.m : self.m + self.slips]
        return [speeds, C @ a + rates, held, low, high]

    @structure_property
    def rhs(self) -> Graph:
        """(t, x, v, signs, c) -> x'', lambda; forces of locks and sizes of friction after it."""
        at = self.inputs
        if self.slips or self.rubs:
            a, inner, miss = self.coupled(*at)
            a = a + ca.if_else(miss < SOLVED, 0, SX.nan()) if self.rubs else a
            return without_repeats("rhs", at, [ca.densify(a), ca.densify(inner)])
        M, f, J, gamma = self.parts(*at)
        solver = _Solver(M, J, self.given["eps"], self._weights)
        if self._weights is not None:
            f = f + J.T @ (self._weights * gamma)
        a, lam = solver.solve(f, gamma)
        return without_repeats("rhs", at, [ca.densify(a), ca.densify(lam)])

    @structure_property
    def project(self) -> Graph:
        """(t, x, v, signs, c) -> x and v on the constraints, what is left of them."""
        at = self.inputs
        if not self.m and not self.slips:
            return ca.Function("project", at, [self.x, self.v, SX(0)])
        M, _, J, _ = self.parts(*at)
        x, v = self.x, self.v
        if self.m:
            solver = _Solver(M, J, self.given["eps"], self._weights)
            for _ in range(NEWTON):
                phi = self.place(self.t, x, v, self.signs, self.c)[0]
                x = x - solver.shortest(phi)
        phi, J, phi_t = self.place(self.t, x, v, self.signs, self.c)
        if self.slips:
            at_x = [self.t, x, v, self.signs, self.c]
            solver, locks, _ = self._locked(M, J, at_x)
        for _ in range(NEWTON):
            gap = J @ v + phi_t
            if self.slips:
                gap = ca.vertcat(gap, locks * self.locking(self.t, x, v, self.signs, self.c)[2])
            v = v - solver.shortest(gap)
        if not self.m:
            return without_repeats("project", at, [x, v, SX(0)])
        miss = ca.mmax(ca.fabs(phi) / self.given["gaps"])
        return without_repeats("project", at, [x, v, miss])


class _Solver:
    """The range-space form of the proximal equations at one pose."""

    def __init__(self, M: Sym, J: Sym, eps: Sym, weights: Sym | None) -> None:
        self.n, self.m = M.shape[0], J.shape[0]
        if weights is not None:  # locks have none
            held = J[: weights.numel(), :]
            M = M + held.T @ (ca.diag(weights) @ held)
        self.mass = Factor(M)
        self.J, self.eps = J, SX(eps)
        halves = [self.mass.forward(entries(J[i, :].T)) for i in range(self.m)]
        scaled = [self.mass.divided(half) for half in halves]
        S = SX(self.m, self.m)
        for i in range(self.m):
            for j in range(i + 1):
                shared = halves[j].keys() & scaled[i].keys()
                if shared or i == j:
                    total = SX(0)
                    for k in sorted(shared):
                        total += scaled[i][k] * halves[j][k]
                    S[i, j] = total + (self.eps[i] if i == j else 0)
                    S[j, i] = S[i, j]
        self.schur = Factor(S) if self.m else None

    def solve(self, f: Sym, gamma: Sym) -> tuple[Sym, Sym]:
        """Return accelerations and multipliers."""
        free = self.mass.solve(f)
        if self.schur is None:
            return free, SX(0, 1)
        lam = change = self.schur.solve(self.J @ free - gamma)
        for _ in range(PASSES):
            change = self.schur.solve(self.eps * change)
            lam = lam + change
        return self.mass.solve(f - self.J.T @ lam), lam

    def shortest(self, gap: Sym) -> Sym:
        """Return the shortest change, measured by the mass, that closes a gap."""
        assert self.schur is not None
        return self.mass.solve(self.J.T @ self.schur.solve(gap))

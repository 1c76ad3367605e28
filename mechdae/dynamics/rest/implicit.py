"""Exact derivatives of an equilibrium and of its small motions by parameters.

The pose follows from F = (f - J^T lambda, phi) = 0 by the implicit function theorem,
d(x, lambda)/dp = -F_(x, lambda)^-1 F_p. An eigenvalue s of the bordered pencil

    P(s) = [s^2 M + s C + K, J^T; J, 0],   P(s) v = 0,   w^T P(s) = 0

has ds = -(w^T dP v) / (w^T P_s v), where dP counts what moves with the pose and the multipliers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import RELATIVE, coordinate
from mechdae.describe.file.problem import Problem
from mechdae.describe.named import forces_of
from mechdae.describe.tasks.motion import Equilibrium
from mechdae.dynamics.output_values import over_states
from mechdae.dynamics.rest.balance import RANK
from mechdae.dynamics.rest.equilibrium import at_rest
from mechdae.dynamics.rest.small_motions import SETTLED
from mechdae.equations.parameters import parameters_of
from mechdae.errors import MechdaeError, SolveError
from mechdae.kernels.run.functions import without_repeats
from mechdae.types import Complexes, Floats, Graph, Matrix, Points, Sym

if TYPE_CHECKING:
    from mechdae.dynamics.rest.equilibrium import AtRest

SX = ca.SX
CLOSES = 1e-6
"""Share of the derivatives by which redundant constraints may open."""
APART = 1e-7
"""Share of an eigenvalue by which another one has to be away for a derivative."""
MODES = ("eigenvalue", "frequency", "natural_frequency", "damping")


class Implicit:
    """An equilibrium that moves with parameters."""

    def __init__(self, problem: Problem, task: Equilibrium, names: Sequence[str]) -> None:
        self.task, self.names = task, list(names)
        self.found: AtRest = at_rest(problem, task)
        self.whole = whole = self.found.balance.setup
        self.r, self.model, k = whole.released, whole.model, whole.kernel
        r = self.r
        self.lam: Sym = SX.sym("lam", k.m)
        self.force: Sym = ca.densify(r.f) - r.J.T @ self.lam
        self.at = (0.0, self.found.rest.x, np.zeros(k.n), whole.loose,
                   self.found.rest.lam / k.gaps, self.model.p_values)  # fmt: skip
        self.inputs: list[Sym] = [r.t, r.x, r.v, r.signs, self.lam, self.model.p]
        self.able: bool = all(name in self.model.p_names for name in names)
        """Whether all names are symbols here: a number that is zero is none."""
        if not self.able:
            return
        free = SX.sym("free", len(names))
        p = parameters_of(self.model, names, free)
        here = [float(self.model.p_values[self.model.p_names.index(name)]) for name in names]
        self.dp: Floats = np.array(
            ca.Function("dp", [free], [ca.densify(ca.jacobian(p, free))])(here)
        )

    def knows(self, path: str) -> bool:
        """Return whether a path has an exact derivative here."""
        return self.able and (self._place(path) is not None or self._motion(path) is not None)

    def _function(self, *results: Sym) -> list[Floats]:
        found = ca.Function("part", self.inputs, [ca.densify(part) for part in results])(*self.at)
        return [np.array(part) for part in (found if isinstance(found, tuple) else (found,))]

    @cached_property
    def slopes(self) -> Any:
        """d(x, lambda)/d names, (n + m, names)."""
        r = self.r
        whole = ca.vertcat(self.force, r.phi)
        both = ca.vertcat(r.x, self.lam)
        A, B = self._function(ca.jacobian(whole, both), ca.jacobian(whole, self.model.p))
        k = self.whole.kernel
        # natural sizes, and multipliers in units of the largest stiffness
        stiff = np.abs(A[: k.n, : k.n] * np.outer(k.sizes, k.sizes)).max(initial=1e-300)
        rows = np.concatenate([k.sizes / stiff, 1 / k.gaps])
        columns = np.concatenate([k.sizes, stiff / k.gaps])
        A, right = A * np.outer(rows, columns), -(B @ self.dp) * rows[:, None]
        found = np.linalg.lstsq(A, right, rcond=RANK)[0]
        left = float(np.max(np.abs(A @ found - right), initial=0.0))
        if left > CLOSES * float(np.max(np.abs(right), initial=0.0)):
            raise SolveError(
                "the equilibrium has no derivative: it is neutral, or redundant constraints "
                "open when a dimension changes alone",
                where="wrt",
                hint="make dimensions that depend on each other expressions of one parameter",
            )
        return found * columns[:, None]

    # -- the pose --------------------------------------------------------------------------

    def _place(self, path: str) -> Any:
        """Return the expression over q of a path, None where it is no place of the mechanism."""
        head, _, tail = path.partition("/")
        part, _, quantity = tail.rpartition("/")
        model, mechanism = self.model, self.model.mechanism
        try:
            if head == "points" and quantity == "position":
                return model.point(part)
            if head in ("bodies", "joints") and quantity in RELATIVE:
                return model.coordinate(coordinate(mechanism, f"{part}.{quantity}"))
            if head == "outputs" and quantity == "value" and part in mechanism.outputs:
                if forces_of(mechanism, part):
                    return None
                loads = self.whole.loads
                return over_states(model, loads, mechanism.outputs[part], {}, (part,))
        except MechdaeError:
            return None
        return None

    def place(self, path: str) -> tuple[Any, Any]:
        """Return the value (k,) of a place, and its derivatives (k, names)."""
        r, model = self.r, self.model
        y = self._place(path)
        rest = [model.velocity, model.acceleration]
        y = ca.substitute([y], rest, [SX.zeros(*s.shape) for s in rest])[0]
        moved = r.moved(y)
        value, Jx, Jp = self._function(moved, ca.jacobian(moved, r.x), ca.jacobian(moved, model.p))
        n = self.whole.kernel.n
        return value.ravel(), Jx @ self.slopes[:n] + Jp @ self.dp

    # -- small motions -----------------------------------------------------------------------

    @cached_property
    def motions(self) -> list[tuple[complex, Complexes]]:
        """Eigenvalues in the order of the summary, with their derivatives (names,)."""
        from mechdae.dynamics.rest.small_motions import small_motions

        found = self.found
        M, C, K = found.along
        listed = small_motions(found.balance, self.task, found.rest.x, found.basis, found.along)
        every = np.linalg.eigvals(_companion(M, C, K)) if len(M) else np.zeros(0)
        result = []
        for mode in listed["modes"]:
            s = complex(*mode["eigenvalue"])
            near = np.sort(np.abs(every - s))
            if len(near) > 1 and near[1] <= APART * np.abs(every).max():
                raise SolveError(
                    "two small motions have one frequency: it has no derivative",
                    where="outputs",
                    hint="change a parameter a little",
                )
            result.append((s, self._slope(s, M, C, K)))
        return result

    def _slope(self, s: complex, M: Any, C: Matrix, K: Matrix) -> Any:
        """Return ds/d names."""
        k, found = self.whole.kernel, self.found
        left, _, right = np.linalg.svd(s * s * M + s * C + K)
        z, y = right[-1].conj(), left[:, -1].conj()
        sizes = found.balance.sizes
        v, w = sizes * (found.basis @ z), sizes * (found.basis @ y)
        full_M, full_C, full_K, J = self._matrices
        pencil = s * s * full_M + s * full_C + full_K
        units = k.sizes[:, None]
        solve = np.linalg.lstsq
        mu = solve(J.T * units, -(pencil @ v) * k.sizes, rcond=RANK)[0] if k.m else np.zeros(0)
        nu = solve(J.T * units, -(pencil.T @ w) * k.sizes, rcond=RANK)[0] if k.m else np.zeros(0)
        a, b = np.concatenate([w, nu]), np.concatenate([v, mu])
        rr, ii, ri, ir = (
            np.array(self._forms(*self.at, one, two))
            for one, two in ((a.real, b.real), (a.imag, b.imag), (a.real, b.imag), (a.imag, b.real))
        )
        gradient = (rr - ii) + 1j * (ri + ir)  # (3, n + m + p)
        whole = s * s * gradient[0] + s * gradient[1] + gradient[2]
        n = k.n + k.m
        moved = whole[:n] @ self.slopes + whole[n:] @ self.dp
        return -moved / (w @ (2 * s * full_M + full_C) @ v)

    @cached_property
    def _matrices(self) -> list[Matrix]:
        r = self.r
        K, C = -ca.jacobian(self.force, r.x), -ca.jacobian(ca.densify(r.f), r.v)
        return self._function(r.M, C, K, r.J)

    @cached_property
    def _forms(self) -> Graph:
        """(inputs, a, b) -> gradients of a^T M b, a^T C b, and of K with J, (3, n + m + p)."""
        r, n, m = self.r, self.whole.kernel.n, self.whole.kernel.m
        a, b = SX.sym("a", n + m), SX.sym("b", n + m)
        af, bf, am, bm = a[:n], b[:n], a[n:], b[n:]
        damped = -ca.jtimes(ca.densify(r.f), r.v, bf)
        stiff = -ca.jtimes(self.force, r.x, bf)
        rest = ca.dot(af, stiff) + ca.dot(r.J @ af, bm) + ca.dot(am, r.J @ bf) if m else None
        forms = ca.vertcat(
            ca.dot(af, r.M @ bf), ca.dot(af, damped), ca.dot(af, stiff) if rest is None else rest
        )
        every = ca.vertcat(r.x, self.lam, self.model.p)
        result = ca.densify(ca.jacobian(forms, every))
        return without_repeats("forms", [*self.inputs, a, b], [result])

    def _motion(self, path: str) -> tuple[str, int | None] | None:
        """Return word and place of a path to a number of small motions, None where it is none."""
        if not self.task.linearise:
            return None
        steps = path.split("/")
        if steps[0] != "summary" or len(steps) < 2:
            return None
        word, rest = steps[1], steps[2:]
        if word in ("frequencies", "damping") and (
            not rest or (rest[0].isdigit() and not rest[1:])
        ):
            return ("frequency" if word == "frequencies" else word), int(rest[0]) if rest else None
        if word == "settling_time" and not rest:
            return word, None
        if word == "modes" and len(rest) == 2 and rest[0].isdigit() and rest[1] in MODES:
            return rest[1], int(rest[0])
        return None

    def motion(self, path: str) -> tuple[Any, Any]:
        """Return a number of the small motions, or a list of them, and derivatives (..., names)."""
        chosen = self._motion(path)
        assert chosen is not None
        word, place = chosen
        if word == "settling_time":
            s, ds = max(self.motions, key=lambda motion: motion[0].real)
            if s.real >= 0:
                raise SolveError("nothing settles here", where="outputs", hint="add damping")
            return SETTLED / -s.real, SETTLED / s.real**2 * ds.real
        if place is not None and place >= len(self.motions):
            raise SolveError(f"there are {len(self.motions)} small motions", where="outputs")
        motions = self.motions if place is None else [self.motions[place]]
        found = [_number(word, s, ds) for s, ds in motions]
        values, slopes = (np.array([pair[i] for pair in found]) for i in (0, 1))
        return (values, slopes) if place is None else (values[0], slopes[0])


def _number(word: str, s: complex, ds: Complexes) -> tuple[Any, Any]:
    """Return a number of a small motion from its eigenvalue, and its derivatives."""
    size = abs(s)
    if word == "eigenvalue":
        return np.array([s.real, s.imag]), np.array([ds.real, ds.imag])
    if word == "frequency":
        return s.imag / (2 * math.pi), (ds.imag if s.imag else 0 * ds.imag) / (2 * math.pi)
    if size == 0:
        raise SolveError("a freedom without stiffness has no frequency", where="outputs")
    grown = (s.real * ds.real + s.imag * ds.imag) / size
    if word == "natural_frequency":
        return size / (2 * math.pi), grown / (2 * math.pi)
    return -s.real / size, -ds.real / size + s.real * grown / size**2


def _companion(M: Matrix, C: Matrix, K: Matrix) -> Points:
    n, inverse = len(M), np.linalg.inv(M)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])

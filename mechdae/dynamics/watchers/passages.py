"""Singular poses on the way: where the constraints lose rank, found between the steps.

The least singular value of the scaled Jacobian that does not vanish for good falls and rises
around such a pose like |t - t*|. Newton's method with its rate u^T J' w finds t*.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import Integrator, Nodes
from mechdae.kernels.graphs.linear import Factor
from mechdae.numerics.null_space import rank
from mechdae.types import Floats, Graph, Jacobian, Matrices, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.equations_of_motion import Kernel

SINGULAR = 1e-6
NEAR = 0.5
"""Share of its largest value so far above which a minimum is not looked at."""
NEWTON = 8
MANY = 16
"""Equations up to which singular values are computed at every node."""
POWERS = 6
"""Multiplications with the inverse that single out its largest singular value."""
BESIDE = 5e-4
"""Singular value, over the largest, at the values beside a singular pose that settle its time."""
SURE = 1e-8
"""Share of the largest singular value below which one counts as found: rounding is near."""


class Passages:
    """Watches the rank of the constraints along a motion.

    ``found`` list of (t, rank drop). ``superfluous``: equations more than the rank, at the poses of
    the first steps.
    """

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.kernel: Kernel = setup.kernel
        self.found: list[tuple[float, int]] = []
        self.superfluous: int = 0
        self._rank: int | None = None
        self._tail: tuple[Any, Any] | None = None
        self._largest = self._norm = 0.0

    @cached_property
    def _jacobian(self) -> Any:
        k, r = self.kernel, self.kernel.released

        def build() -> Graph:
            results = [ca.vec(ca.densify(part)) for part in (r.J, r.rate(r.J))]
            return k.function("J", results)

        return k.batch("J", build)

    def _scaled(
        self, t: Floats, x: Unknowns, v: Floats, signs: Floats
    ) -> tuple[Matrices, Matrices]:
        """Return Jacobians (n, m, nx) and their rates over natural sizes."""
        k, n = self.kernel, len(t)
        factor = k.sizes[None, :] / k.gaps[:, None]
        both = self._jacobian(t[:, None], x, v, signs)
        J, rate = (part.reshape(n, k.n, k.m).transpose(0, 2, 1) * factor for part in both)
        return J, rate

    @cached_property
    def _pivots(self) -> Any:
        """(t, x, v, signs) -> pivots of J J^T over natural sizes: one vanishes with the rank."""
        k = self.kernel

        def build() -> Graph:
            J = ca.diag(1 / k.given["gaps"]) @ k.released.J @ ca.diag(k.given["sizes"])
            return k.function("pivots", [ca.vertcat(*Factor(J @ J.T).pivots.values())])

        return k.batch("pivots", build)

    def look(self, nodes: Nodes) -> None:
        """Look for singular poses in accepted steps."""
        k, lay = self.kernel, self.integrator.layout
        if not k.m:
            return
        states = nodes.states
        t, x, v = (lay.of(states, name) for name in ("t", "x", "v"))
        values = self._values(t, x, v, nodes.signs)
        if self._tail is not None:  # the step before: a minimum may lie on the seam
            before, value = self._tail
            states = np.vstack([before[None, :], states])
            values = np.concatenate([[value], values])
            t = lay.of(states, "t")
        self._largest = max(self._largest, float(values.max()))
        for i in range(1, len(values) - 1):
            if values[i - 1] > values[i] <= values[i + 1] and values[i] < NEAR * self._largest:
                self._refine(Nodes(states[i - 1 : i + 2], nodes.signs), float(t[i]))
        if len(values) >= 2:
            self._tail = (states[-2], values[-2])

    def _values(self, t: Floats, x: Unknowns, v: Floats, signs: Floats) -> Any:
        """Return values (n,) that vanish with the least singular value.

        That itself, or where there are many equations the root of the least pivot, which is no
        less and costs what the equations have to do with each other.
        """
        if self._rank is None:
            some = slice(min(len(t), 3))
            first = np.linalg.svd(self._scaled(t[some], x[some], v[some], signs)[0], False, False)
            self._rank = max(rank(sigma, self.setup.rank) for sigma in first)
            self._norm = float(first.max(initial=0.0))
            self.superfluous = self.kernel.m - self._rank
        if self._rank == self.kernel.m > MANY:
            pivots = self._pivots(t[:, None], x, v, signs)[0]
            with np.errstate(invalid="ignore"):
                return np.sqrt(np.nan_to_num(np.maximum(pivots.min(axis=1), 0.0)))
        J, _ = self._scaled(t, x, v, signs)
        gram = J @ J.transpose(0, 2, 1) if self.kernel.m <= self.kernel.n else None
        if gram is None:
            gram = J.transpose(0, 2, 1) @ J
        squares = np.linalg.eigvalsh(gram)[:, ::-1]
        self._norm = max(self._norm, float(np.sqrt(squares[:, 0].max())))
        return np.sqrt(np.maximum(squares[:, self._rank - 1], 0.0)) if self._rank else t * 0 + 1

    def _refine(self, nodes: Nodes, t: float) -> None:
        """Find the singular pose near a step's end by Newton's method."""
        lay = self.integrator.layout
        first, last = (float(lay.of(nodes.states[i], "t")) for i in (0, -1))
        assert self._rank is not None
        k = self._rank - 1
        best: tuple[float, float, Any] = (np.inf, t, None)
        for _ in range(NEWTON):
            x, v, _ = self.integrator.between(nodes, np.array([t]))
            J, rate = self._scaled(np.array([t]), x, v, nodes.signs)
            least, left, right = self._least(J[0], k)
            if least < best[0]:
                best = (least, t, J[0])
            if least <= SURE * self._norm:
                break
            slope = float(left @ rate[0] @ right)
            step = -least / slope if slope else np.inf
            t = min(max(t + step, first), last)
        least, t, J = best
        if least > SINGULAR * self._norm:
            return
        sigma = np.linalg.svd(J, compute_uv=False)
        drop = int(np.sum(sigma[: self._rank] <= SINGULAR * self._norm))
        t = self._settled(nodes, t, self._rank - drop)
        near = 1e-6 * (last - first)
        if not any(abs(t - other) <= near for other, _ in self.found):
            self.found.append((t, drop))

    @staticmethod
    def _least(J: Jacobian, k: int) -> tuple[float, Floats, Floats]:
        """Return the singular value that falls first, the last of the rank, and its vectors."""
        if len(J) <= MANY or len(J) != k + 1:
            left, sigma, right = np.linalg.svd(J)
            return float(sigma[k]), left[:, k], right[k]
        Q, R = np.linalg.qr(J.T)  # J = R^T Q^T: the largest singular value of R^-T by powers
        try:
            inverse = np.linalg.inv(R)
        except np.linalg.LinAlgError:
            return 0.0, np.zeros(len(J)), np.zeros(J.shape[1])
        left = np.full(len(J), len(J) ** -0.5)
        for _ in range(POWERS):
            right = inverse.T @ left
            left = inverse @ right
            left /= np.linalg.norm(left)
        right = inverse.T @ left
        size = float(np.linalg.norm(right))
        return 1 / size, left, Q @ right / size

    def _settled(self, nodes: Nodes, t: float, place: int) -> float:
        """Return the zero of the cubic through four values of a singular value beside it.

        At the pose itself the state is known to the square root of rounding only.
        """
        lay = self.integrator.layout
        first, last = (float(lay.of(nodes.states[i], "t")) for i in (0, -1))

        def values(times: Floats) -> Any:
            x, v, _ = self.integrator.between(nodes, times)
            J = self._scaled(times, x, v, nodes.signs)[0]
            return np.linalg.svd(J, compute_uv=False)[:, place]

        far = t + (last - first) / 16 * (1 if t < (first + last) / 2 else -1)
        height = float(values(np.array([far]))[0])
        d = abs(far - t) * min(1.0, BESIDE * self._norm / max(height, 1e-300))
        shifts = np.array([-2.0, -1.0, 1.0, 2.0])
        times = t + d * shifts
        if times[0] < first or times[-1] > last:
            return t
        root: Any = 0.0
        c = np.polyfit(shifts, values(times) * np.sign(shifts), 3)
        for _ in range(4):
            slope = np.polyval(np.polyder(c), root)
            root -= np.polyval(c, root) / slope if slope else 0.0
        return t + d * float(root) if abs(root) <= 1 else t

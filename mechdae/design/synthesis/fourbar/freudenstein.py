"""Starts for function generators with a four-bar, by variable projection.

With the ground 1, crank a, coupler b, rocker c, Freudenstein's equation

    cos(psi)/a - cos(phi)/c + (1 + a^2 + c^2 - b^2)/(2 a c) = cos(phi - psi)

is linear in three constants, once it is known where the two scales start. These two angles are
drawn evenly, the constants follow from a small least squares problem for all samples at once, its
rows weighed so that they are errors of the output angle. The best and mutually distant samples
are improved by Levenberg-Marquardt over all five numbers, ranked by their largest error, and
those that became the same are dropped.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.errors import InputError
from mechdae.numerics.levenberg import Rows, descend
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Integers, Matrix, Unknowns

SAMPLES = 20_000
TRIED = 400
"""Samples of the projection that are improved, at most."""
ITERATIONS = 80
NODES = 13
"""Rows of the screening, at most: the nodes next to Chebyshev's."""
NEAR, SAME = 0.1, 0.1
"""Samples, and starts, are apart by this much in an angle or the logarithm of a length."""
SCALE = 1e3
"""Rows in milliradians: what hardly moves is told at a thousandth of it."""


@dataclass(frozen=True)
class FunctionStart:
    """A four-bar with ground 1 whose rocker follows a function.

    ``lengths`` (4,) of ground, crank, coupler, rocker; ``input_start`` and ``output_start`` the
    angles of crank and rocker from the ground line where the scales start, ``sense`` that of
    the output, ``branch`` the sign of sin(theta4 - theta3); ``worst`` and ``residual`` the
    largest error and the root of the mean square [rad] at the nodes.
    """

    lengths: Floats
    input_start: float
    output_start: float
    sense: int
    branch: int
    worst: float
    residual: float


def function_starts(
    inputs: Floats,
    outputs: Floats,
    *,
    keep: int = 20,
    seed: int | np.random.Generator = 0,
    samples: int = SAMPLES,
    lengths: tuple[float, float] = (0.1, 8.0),
    least: float = 0.05,
    senses: tuple[int, ...] = (1, -1),
) -> list[FunctionStart]:
    """Return mutually distant starts, the best first.

    `inputs`, `outputs` (k,): both scales at nodes, each from its start [rad]. `samples`: how many
    are drawn for each sense. `lengths`: bounds of crank, coupler and rocker, in grounds. `least`:
    least |sin| of the transmission angle at the nodes.
    """
    inputs, outputs = np.asarray(inputs, float), np.asarray(outputs, float)
    if len(inputs) < 3 or not (np.isfinite(inputs).all() and np.isfinite(outputs).all()):
        raise InputError("a function is three or more finite values", where="inputs")
    if inputs.shape != outputs.shape:
        raise InputError(f"{len(inputs)} inputs: as many outputs are needed", where="outputs")
    generator = np.random.default_rng(seed)
    found: list[FunctionStart] = []
    for sense in senses:
        x, branches = _screened(inputs, sense * outputs, generator, samples, least)
        for branch in (1, -1):
            rows = FunctionRows(inputs, sense * outputs, branch, lengths)
            begin = rows.kept(x[branches == branch])
            if len(begin):
                ends, _, _, _ = descend(rows, begin, np.zeros((len(begin), 0)), ITERATIONS)
                found += rows.starts(ends, sense, least)
    found.sort(key=lambda start: start.worst)
    return _apart(found, keep)


def three_pairs(phi: Floats, psi: Floats) -> Any:
    """Return crank, coupler and rocker by their ground that meet three pairs of angles exactly.

    The solution is the only one but for the sign of the coupler; crank and rocker may be
    negative: such a link points from its pin the other way. None where no link is that long.

    `phi`, `psi` (3,): angles of crank and rocker from the ground line [rad].
    """
    A = np.stack([np.cos(psi), -np.cos(phi), np.ones(3)], axis=1)
    with np.errstate(all="ignore"):
        try:
            K = np.linalg.solve(A, np.cos(phi - psi))
        except np.linalg.LinAlgError:
            return None
        a, c = 1 / K[0], 1 / K[1]
        found = np.array([a, np.sqrt(1 + a * a + c * c - 2 * a * c * K[2]), c])
    return found if np.isfinite(found).all() else None


class FunctionRows:
    """Errors of the output, and what lengths exceed their bounds, of one branch.

    Unknowns are the logarithms of crank, coupler and rocker, and where the scales start.

    `inputs`, `outputs` (k,): scales from their starts, the output with its sense.
    """

    def __init__(
        self, inputs: Floats, outputs: Floats, branch: int, lengths: tuple[float, float]
    ) -> None:
        self.inputs, self.outputs, self.branch = inputs, outputs, branch
        self.low, self.high = (float(np.log(bound)) for bound in lengths)

    def moved(self, d: Floats) -> tuple[Matrix, Matrix, Matrix, Complexes]:
        """Return input, output (n, k), sin(theta4 - theta3); nan where nothing is assembled."""
        a, b, c = (np.exp(d[:, i, None]) for i in range(3))
        phi = d[:, 3:4] + self.inputs
        crank = a * np.exp(1j * phi)
        line = 1 - crank
        size = np.abs(line)
        with np.errstate(invalid="ignore", divide="ignore"):
            opened = np.arccos((size**2 + b * b - c * c) / (2 * size * b))
            coupler = b * line / size * np.exp(1j * self.branch * opened)
            rocker = crank + coupler - 1
            sine = (rocker * coupler.conj()).imag / (b * c)
        return phi, np.angle(rocker), sine, crank

    def errors(self, d: Floats) -> tuple[Floats, Floats]:
        """Return errors of the output (n, k) and sin(theta4 - theta3)."""
        _, psi, sine, _ = self.moved(d)
        return np.mod(psi - d[:, 4:] - self.outputs + np.pi, 2 * np.pi) - np.pi, sine

    def __call__(self, d: Unknowns, t: Floats) -> Rows:
        error, _ = self.errors(d)
        a, b, c = (np.exp(d[:, i, None]) for i in range(3))
        phi = d[:, 3:4] + self.inputs
        psi = d[:, 4:] + self.outputs + error
        # G = 1 + a^2 + c^2 - b^2 + 2 c cos(psi) - 2 a cos(phi) - 2 a c cos(phi - psi) = 0
        by_psi = -2 * c * np.sin(psi) - 2 * a * c * np.sin(phi - psi)
        by_phi = 2 * a * np.sin(phi) + 2 * a * c * np.sin(phi - psi)
        by_a = 2 * a - 2 * np.cos(phi) - 2 * c * np.cos(phi - psi)
        by_c = 2 * c + 2 * np.cos(psi) - 2 * a * np.cos(phi - psi)
        n, k = error.shape
        F = np.zeros((n, k + 3, 1))
        J = np.moveaxis(np.zeros((5, n, k + 3, 1)), 0, 3)  # derivatives by an unknown lie together
        F[:, :k, 0] = error
        columns = [a * by_a, -2 * b * b + 0 * phi, c * by_c, by_phi]
        with np.errstate(invalid="ignore", divide="ignore"):
            J[:, :k, 0, :4] = -np.stack(columns, axis=2) / by_psi[:, :, None]
        J[:, :k, 0, 4] = -1
        at = np.arange(3)
        F[:, k + at, 0] = d[:, :3] - np.clip(d[:, :3], self.low, self.high)
        J[:, k + at, 0, at] = F[:, k + at, 0] != 0
        return SCALE * F, SCALE * J, None

    def kept(self, d: Floats) -> Floats:
        """Return samples that assemble at all nodes."""
        error, _ = self.errors(d)
        return d[np.isfinite(error).all(axis=1)]

    def starts(self, x: Unknowns, sense: int, least: float) -> list[FunctionStart]:
        """Return points within the bounds as starts."""
        d = x.copy()
        d[:, :3] = np.clip(d[:, :3], self.low, self.high)
        error, sine = self.errors(d)
        with np.errstate(invalid="ignore"):
            good = (np.abs(sine) >= least).all(axis=1) & np.isfinite(error).all(axis=1)
        made = []
        for one, e in zip(d[good], error[good], strict=True):
            size = np.exp(np.concatenate([[0.0], one[:3]]))
            size.flags.writeable = False
            begin, end = (float(np.mod(angle, 2 * np.pi)) for angle in one[3:])
            worst, rms = float(np.abs(e).max()), float(np.sqrt(np.mean(e * e)))
            made.append(FunctionStart(size, begin, end, sense, self.branch, worst, rms))
        return made


def _screened(
    inputs: Floats, outputs: Floats, generator: np.random.Generator, samples: int, least: float
) -> tuple[Floats, Integers]:
    """Return the best distant samples (m, 5) as unknowns of `FunctionRows`, and their branches."""
    k = len(inputs)
    nodes = np.round((k - 1) * (1 - np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)) / 2)
    at = np.array(sorted(set(nodes.astype(int).tolist()))) if k > NODES else np.arange(k)
    starts = generator.uniform(0, 2 * np.pi, (samples, 2))
    phi, psi = starts[:, :1] + inputs[at], starts[:, 1:] + outputs[at]
    A = np.stack([np.cos(psi), -np.cos(phi), np.ones_like(phi)], axis=2)
    right = np.cos(phi - psi)
    weight = np.ones_like(phi)
    for _ in range(3):
        W = A * weight[:, :, None]
        N = W.transpose(0, 2, 1) @ W + 1e-10 * len(at) * np.eye(3)
        K = np.linalg.solve(N, (W.transpose(0, 2, 1) @ (right * weight)[:, :, None]))[:, :, 0]
        slope = K[:, :1] * np.sin(psi) + np.sin(phi - psi)
        weight = 1 / np.maximum(np.abs(slope), 0.02)
    left = np.einsum("nki,ni->nk", A, K) - right
    with np.errstate(invalid="ignore", divide="ignore"):
        a, c = 1 / K[:, 0], 1 / K[:, 1]
        b = np.sqrt(1 + a * a + c * c - 2 * a * c * K[:, 2])
        rank = np.sqrt(np.mean((left * weight) ** 2, axis=1))
        pin = 1 + c[:, None] * np.exp(1j * psi)
        coupler = pin - a[:, None] * np.exp(1j * phi)
        side = ((pin - 1) * coupler.conj()).imag / (np.abs(c) * b)[:, None]
        one = (np.sign(side) == np.sign(side[:, :1])).all(axis=1)
        good = one & (np.abs(side).min(axis=1) > least) & np.isfinite(rank)
    # a negative length is a positive one, half a turn on
    starts += np.pi * (np.stack([a, c], axis=1) < 0)
    d = np.column_stack([np.log(np.abs(np.stack([a, np.abs(b), c], axis=1))), starts])
    order = [int(i) for i in np.argsort(rank, kind="stable") if good[i]]
    distinct = _distinct(d[order], NEAR, TRIED)
    chosen = [order[i] for i in distinct]
    return d[chosen], np.sign(side[chosen, 0]).astype(int)


def _distinct(d: Floats, apart: float, count: int) -> list[int]:
    """Return the indices of unknowns (m, 5), each apart from all that are kept before it."""
    kept: list[int] = []
    chosen = np.zeros((count, d.shape[1]))
    for i, one in enumerate(d):
        if len(kept) == count:
            break
        gap = np.abs(chosen[: len(kept)] - one)
        gap[:, 3:] = np.abs(np.mod(gap[:, 3:] + np.pi, 2 * np.pi) - np.pi)
        if (gap.max(axis=1) >= apart).all():
            chosen[len(kept)] = one
            kept.append(i)
    return kept


def _apart(found: list[FunctionStart], count: int) -> list[FunctionStart]:
    """Return the first starts that are no copies of each other."""
    if not found:
        return []
    d = np.array([[*np.log(s.lengths[1:]), s.input_start, s.output_start] for s in found])
    return [found[i] for i in _distinct(d, SAME, count)]

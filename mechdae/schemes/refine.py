"""Refinement of many sets of dimensions of one scheme at once: Levenberg and Marquardt, batched.

What is made small is the mean distance from the wanted curve, smooth near zero (`SOFT`), with
weights of iterated least squares, plus squares of what limits are exceeded by: material, sines of
dyads.
Derivatives are exact, those of the lengths of bars and of the resampling at equal arc length.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.schemes.closure import SchemeTurn, material, shortest, turned
from mechdae.schemes.scheme import DYAD, Scheme
from mechdae.schemes.shape import Resampled, centred, fitted, resampled

ANGLES, POINTS = 120, 100
"""Crank angles and points at equal arc length while dimensions are refined."""
SOFT = 0.01
"""Distance, in radii of the wanted curve, below which squares are counted."""
ROOM = 1.6
"""Sines of dyads are pushed away from so many times the least ones that are allowed."""
PUSH, PRESS = 0.3, 8.0
"""Weights of sines below that, and of material above its limit."""
TIGHT = 0.994
"""Material is pressed below this share of its limit, because a penalty leaves a little above."""
SHORT = 0.05
"""Least length of crank and bars of dyads, in radii of the wanted curve."""
EVERY = 6
"""Iterations after which shift, sense and rotation are found anew."""
TURN = 2 * np.pi


@dataclass
class _State:
    """Where each set of a batch is."""

    places: Any
    turn: SchemeTurn
    curve: Resampled
    gaps: Any
    merit: Any
    excess: Any
    slopes: Any


class Refinement:
    """A batch of sets of one scheme.

    Parameters
    ----------
    places
        (b, n) complex, in radii of the wanted curve.
    wanted
        (`POINTS`,) the wanted curve, centred.
    limits
        (b,) most material of each; inf: any.
    least
        (b,) sine of its dyads that each set keeps at all angles.
    """

    def __init__(self, scheme: Scheme, places: Any, wanted: Any, limits: Any, least: Any) -> None:
        self.scheme, self.wanted = scheme, wanted
        self.limits, self.least = np.asarray(limits, float), np.asarray(least, float)
        self.angles = TURN * np.arange(ANGLES) / ANGLES
        self.places = np.array(places, complex)
        self.dyads = [k for k, (kind, *_) in enumerate(scheme.points) if kind == DYAD]

    def run(self, iterations: int) -> Any:
        """Return the places (b, n) after so many iterations."""
        damping = np.full(len(self.places), 1e-2)
        growth = np.full(len(self.places), 2.0)
        targets = None
        state = None
        for k in range(iterations):
            if k % EVERY == 0 or targets is None:
                self.places, targets = self._aligned(self.places)
                state = self._at(self.places, targets)
            assert state is not None
            hessian, slope = self._normal(state)
            scale = np.einsum("bpp->bp", hessian)
            scale = scale + 1e-9 * (1e-9 + scale.max(axis=1, keepdims=True))
            lifted = hessian + (damping[:, None] * scale)[:, :, None] * np.eye(scale.shape[1])
            step = -np.linalg.solve(lifted, slope[:, :, None])[:, :, 0]
            trial = state.places.copy()
            trial[:, 1:] += step[:, 0::2] + 1j * step[:, 1::2]
            other = self._at(trial, targets)
            taken = other.merit < state.merit
            damping = np.where(taken, np.maximum(damping / 3, 1e-9), damping * growth)
            damping = np.minimum(damping, 1e9)
            growth = np.where(taken, 2.0, np.minimum(2 * growth, 64.0))
            state = _chosen(taken, other, state)
            self.places = state.places
        return self.places

    def _aligned(self, places: Any) -> tuple[Any, Any]:
        """Return the places turned so that the curves lie on the wanted one, and its points."""
        turn = turned(self.scheme, places, self.angles)
        curve = centred(resampled(_finite(turn.x[self.scheme.trace]), POINTS).points)
        fit = fitted(curve, self.wanted)
        factor = np.where(np.isfinite(fit.factor), fit.factor, 1.0)
        return places * factor[:, None], fit.targets(self.wanted)

    def _at(self, places: Any, targets: Any) -> _State:
        turn = turned(self.scheme, places, self.angles, derivatives=True)
        curve = resampled(_finite(turn.x[self.scheme.trace]), POINTS)
        gaps = centred(curve.points) - targets
        far = np.sqrt(np.abs(gaps) ** 2 + SOFT**2) - SOFT
        merit = far.mean(axis=1)
        excess, slopes = self._limits(places, turn)
        merit = merit + (excess**2).sum(axis=1)
        lost = ~(turn.least >= self.least) | (shortest(self.scheme, places) < SHORT)
        lost |= ~np.isfinite(merit)
        return _State(places, turn, curve, gaps, np.where(lost, np.inf, merit), excess, slopes)

    def _limits(self, places: Any, turn: SchemeTurn) -> tuple[Any, Any]:
        """Return by how much limits are exceeded (b, k), weighted, and derivatives (b, k, p)."""
        excess, slopes = [], []
        assert turn.slopes is not None
        for k in self.dyads:
            at, own = turn.slopes[k]
            sine = turn.sines[k][np.arange(len(at)), at]
            room = np.minimum(ROOM * self.least, (1 + self.least) / 2)
            short = np.maximum(1 - sine / room, 0.0)
            excess.append(PUSH * short)
            slopes.append(np.where((short > 0)[:, None], -PUSH / room[:, None] * own, 0.0))
        amount, slope = material(self.scheme, places, slopes=True)
        limits = TIGHT * self.limits
        over = np.maximum(amount / limits - 1, 0.0)
        excess.append(PRESS * over)
        share = np.where(over > 0, PRESS / limits, 0.0)
        slopes.append(share[:, None] * slope)
        return np.nan_to_num(np.stack(excess, axis=1)), np.nan_to_num(np.stack(slopes, axis=1))

    def _normal(self, state: _State) -> tuple[Any, Any]:
        """Return approximate Hessian (b, p, p) and gradient (b, p) of the merit."""
        own = state.curve.derivatives(np.nan_to_num(state.turn.derivatives))
        own = own - own.mean(axis=1, keepdims=True)
        weight = 1 / np.sqrt(np.abs(state.gaps) ** 2 + SOFT**2) / POINTS
        root = np.sqrt(weight)[:, :, None]
        hessian, slope = 0.0, 0.0
        # parts small enough that linear algebra stays on one thread: the same bits everywhere
        for part, gap in ((own.real, state.gaps.real), (own.imag, state.gaps.imag)):
            rows = np.ascontiguousarray(root * part)
            hessian = hessian + np.matmul(rows.transpose(0, 2, 1), rows)
            slope = slope + np.einsum("bmp,bm->bp", part, weight * gap)
        slopes = state.slopes
        hessian = hessian + 2 * np.einsum("bkp,bkq->bpq", slopes, slopes)
        slope = slope + 2 * np.einsum("bkp,bk->bp", slopes, state.excess)
        return hessian, slope


def _finite(curves: Any) -> Any:
    """Return curves without gaps: what does not assemble is lost anyway."""
    return np.nan_to_num(curves)


def _chosen(taken: Any, one: _State, other: _State) -> _State:
    """Return a state of rows of two states."""

    def rows(a: Any, b: Any, axis: int = 0) -> Any:
        shape = [1] * a.ndim
        shape[axis] = -1
        return np.where(taken.reshape(shape), a, b)

    assert one.turn.slopes is not None
    assert other.turn.slopes is not None
    turn = SchemeTurn(
        rows(one.turn.x, other.turn.x, 1),
        {k: rows(own, other.turn.sines[k]) for k, own in one.turn.sines.items()},
        rows(one.turn.derivatives, other.turn.derivatives),
    )
    turn.slopes = {
        k: (rows(at, other.turn.slopes[k][0]), rows(own, other.turn.slopes[k][1]))
        for k, (at, own) in one.turn.slopes.items()
    }
    curve = Resampled(*(
        rows(getattr(one.curve, name), getattr(other.curve, name))
        for name in ("points", "segment", "share", "steps", "lengths")
    ))  # fmt: skip
    return _State(
        rows(one.places, other.places), turn, curve, rows(one.gaps, other.gaps),
        rows(one.merit, other.merit), rows(one.excess, other.excess),
        rows(one.slopes, other.slopes),
    )  # fmt: skip

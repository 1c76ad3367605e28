"""Refinement of many sets of dimensions of one scheme at once, towards a closed curve.

What is made small is the mean distance from the wanted curve, smooth near zero (`SOFT`), with
weights of iterated least squares. Derivatives are exact, those of the lengths of bars and of the
resampling at equal arc length.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.parts.types.schemes.closure import SchemeTurn, turned
from mechdae.parts.types.schemes.descent import Descent, moved_by
from mechdae.parts.types.schemes.scheme import Scheme
from mechdae.parts.types.schemes.shape import Resampled, centred, fitted, resampled
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Matrices, Points

ANGLES, POINTS = 120, 100
"""Crank angles and points at equal arc length while dimensions are refined."""
SOFT = 0.01
"""Distance, in radii of the wanted curve, below which squares are counted."""
TURN = 2 * np.pi


@dataclass
class _State:
    """Where each set of a batch is."""

    places: Any
    turn: SchemeTurn
    curve: Resampled
    gaps: Complexes
    merit: Floats
    excess: Points
    slopes: Any


class Refinement(Descent):
    """A batch of sets of one scheme, towards a closed curve.

    `places` (b, n) complex: in radii of the wanted curve. `wanted` (`POINTS`,): the wanted curve,
    centred. `limits` (b,): most material of each; inf: any. `least` (b,): sine of its dyads that
    each set keeps at all angles.
    """

    def __init__(
        self, scheme: Scheme, places: Complexes, wanted: Complexes, limits: Floats, least: Floats
    ) -> None:
        super().__init__(scheme, places, limits, least)
        self.wanted = wanted
        self.angles = TURN * np.arange(ANGLES) / ANGLES
        self._targets: Any = None

    def _begun(self, state: Any) -> _State:
        self.places, self._targets = self._aligned(self.places)
        return self._at(self.places, self._targets)

    def _stepped(self, state: _State, step: Floats) -> _State:
        return self._at(moved_by(state.places, step), self._targets)

    def _aligned(self, places: Complexes) -> tuple[Complexes, Complexes]:
        """Return the places turned so that the curves lie on the wanted one, and its points."""
        turn = turned(self.scheme, places, self.angles)
        curve = centred(resampled(_finite(turn.x[self.scheme.trace]), POINTS).points)
        fit = fitted(curve, self.wanted)
        factor = np.where(np.isfinite(fit.factor), fit.factor, 1.0)
        return places * factor[:, None], fit.targets(self.wanted)

    def _at(self, places: Complexes, targets: Complexes) -> _State:
        turn = turned(self.scheme, places, self.angles, derivatives=True)
        curve = resampled(_finite(turn.x[self.scheme.trace]), POINTS)
        gaps = centred(curve.points) - targets
        far = np.sqrt(np.abs(gaps) ** 2 + SOFT**2) - SOFT
        merit, excess, slopes = self._judged(places, turn, far.mean(axis=1))
        return _State(places, turn, curve, gaps, merit, excess, slopes)

    def _normal(self, state: _State) -> tuple[Matrices, Floats]:
        rates = state.curve.derivatives(np.nan_to_num(state.turn.derivatives))
        rates = rates - rates.mean(axis=1, keepdims=True)
        weight = 1 / np.sqrt(np.abs(state.gaps) ** 2 + SOFT**2) / POINTS
        root = np.sqrt(weight)[:, :, None]
        hessian, slope = 0.0, 0.0
        # parts small enough that linear algebra stays on one thread: the same bits everywhere
        for part, gap in ((rates.real, state.gaps.real), (rates.imag, state.gaps.imag)):
            rows = np.ascontiguousarray(root * part)
            hessian = hessian + np.matmul(rows.transpose(0, 2, 1), rows)
            slope = slope + np.einsum("bmp,bm->bp", part, weight * gap)
        slopes = state.slopes
        hessian = hessian + 2 * np.einsum("bkp,bkq->bpq", slopes, slopes)
        slope = slope + 2 * np.einsum("bkp,bk->bp", slopes, state.excess)
        return hessian, slope

    def _chosen(self, taken: Booleans, one: _State, other: _State) -> _State:
        return _rows_of(taken, one, other)


def _finite(curves: Complexes) -> Complexes:
    """Return curves without gaps: what does not assemble is lost anyway."""
    return np.nan_to_num(curves)


def _rows_of(taken: Booleans, one: _State, other: _State) -> _State:

    def rows(a: Any, b: Any, axis: int = 0) -> Any:
        shape = [1] * a.ndim
        shape[axis] = -1
        return np.where(taken.reshape(shape), a, b)

    assert one.turn.slopes is not None
    assert other.turn.slopes is not None
    turn = SchemeTurn(
        rows(one.turn.x, other.turn.x, 1),
        {k: rows(sines, other.turn.sines[k]) for k, sines in one.turn.sines.items()},
        rows(one.turn.derivatives, other.turn.derivatives),
    )
    turn.slopes = {
        k: (rows(at, other.turn.slopes[k][0]), rows(rates, other.turn.slopes[k][1]))
        for k, (at, rates) in one.turn.slopes.items()
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

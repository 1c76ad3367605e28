"""Orders by weights, and how far a weight may move before another one is first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.errors import InputError, UnknownName
from mechdae.types import Floats

CLOSE = 1e-9
"""How far from 1 the sum of weights may be."""
DIGITS, TIE = 12, 1e-12
"""Weighted sums that differ by less are equal."""


def checked(weights: Mapping[str, float] | None, names: Sequence[str]) -> dict[str, float]:
    """Return a weight for each criterion; without any they are equal."""
    if weights is None or not weights:
        return dict.fromkeys(names, 1 / max(len(names), 1))
    for name, weight in weights.items():
        if name not in names:
            raise UnknownName("criterion", name, names, where="weights")
        number = isinstance(weight, (int, float)) and not isinstance(weight, bool)
        if not number or not weight >= 0 or not np.isfinite(weight):
            raise InputError(
                f"a weight is a number of 0 or more, not {weight!r}", where=f"weights.{name}"
            )
    total = float(sum(weights.values()))
    if not abs(total - 1) <= CLOSE:
        raise InputError(
            f"the weights add up to {total:.6g}, not to 1",
            where="weights",
            hint=", ".join(f"{name}={weight / total:.6g}" for name, weight in weights.items())
            if total > 0
            else "one at least is above 0",
        )
    return {name: float(weights.get(name, 0.0)) for name in names}


def shares(values: Floats, senses: Sequence[str]) -> Any:
    """Return how far each value is from the best to the worst of its criterion (n, k), 0 to 1.

    Values that differ by rounding alone are equal.
    """
    signs = np.array([1.0 if sense == "min" else -1.0 for sense in senses])
    costs = np.asarray(values, float) * signs
    best, worst = costs.min(axis=0), costs.max(axis=0)
    width = worst - best
    apart = width > TIE * np.maximum(np.abs(best), np.abs(worst))
    return np.round(np.where(apart, (costs - best) / np.where(apart, width, 1.0), 0.0), DIGITS)


def ordered(costs: Floats, weights: Any) -> list[int]:
    """Return the rows by their weighted sums, least first.

    Of equal ones that with the least sum of all criteria, then the first.
    """
    plain = _sums(costs, np.ones(np.shape(costs)[1]))
    return [int(k) for k in np.lexsort((plain, _sums(costs, weights)))]


def _sums(costs: Floats, weights: Floats) -> Any:
    """Return the weighted sums, equal where they differ by rounding alone."""
    return np.round(np.asarray(costs, float) @ np.asarray(weights, float), DIGITS)


def intervals(costs: Floats, weights: Sequence[float], first: int) -> list[tuple[float, float]]:
    """Return for each criterion the weights with which the same row stays first.

    One weight moves, the others keep their proportions and add up to the rest of 1 (equal ones,
    where this weight is 1). The weighted sum of each row is linear in that weight: the
    intervals are exact.
    """
    costs, shares = np.asarray(costs, float), np.asarray(weights, float)
    found = []
    for k in range(costs.shape[1]):
        rest = np.delete(shares, k)
        rest = rest / rest.sum() if rest.sum() > 0 else np.full(len(rest), 1 / max(len(rest), 1))
        others = np.delete(costs, k, axis=1) @ rest if len(rest) else np.zeros(len(costs))
        low, high = 0.0, 1.0
        # how much the first is ahead of a row: ahead + weight * slope
        ahead = others - others[first]
        slope = (costs[:, k] - costs[first, k]) - ahead
        ahead = np.where(np.abs(ahead) < TIE, 0.0, ahead)
        for at, rise in zip(ahead, slope, strict=True):
            if rise > 0 and at < 0:
                low = max(low, -at / rise)
            elif rise < 0:
                high = min(high, -at / rise)
        here = float(shares[k])
        found.append((float(min(low, here)), float(max(high, here))))
    return found

"""Peaks, means and distances along a cycle, integrated apart from the package."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
import pytest

NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)
WORDS = ("peak_pressure", "peak_pv", "mean_pv", "sliding_distance")


def mean(values: Callable, breaks: Sequence[float]) -> float:
    """Return the mean of a function over the driver's way, smooth between the breaks."""
    a, b = np.array(breaks[:-1])[:, None], np.array(breaks[1:])[:, None]
    every = values((a + (b - a) * (NODES + 1) / 2).ravel()).reshape(len(a), -1)
    return float((every @ WEIGHTS) @ (b - a)[:, 0]) / 2 / (breaks[-1] - breaks[0])


def largest(values: Callable, breaks: Sequence[float]) -> float:
    """Return the largest value: at many places, then at many between the best one's neighbours."""
    count = max(20000 // len(breaks), 20)
    ends = itertools.pairwise(breaks)
    at = np.concatenate([np.linspace(a, b, count + 1) for a, b in ends])
    k = int(np.argmax(values(at)))
    near = np.linspace(at[max(k - 1, 0)], at[min(k + 1, len(at) - 1)], 20001)
    return max(float(values(at[[k]])[0]), float(values(near).max()))


def root(values: Callable, a: float, b: float) -> float:
    """Return a zero between two places by halving."""
    sign = np.sign(values(a))
    for _ in range(80):
        middle = (a + b) / 2
        a, b = (middle, b) if np.sign(values(middle)) == sign else (a, middle)
    return (a + b) / 2


def agrees(wear: dict[str, float], pressure: Callable, speed: Callable, breaks, period) -> None:
    """Compare what is reported of a contact with its pressure and sliding speed."""

    def pv(s):
        return pressure(s) * np.abs(speed(s))

    expected = (
        largest(pressure, breaks), largest(pv, breaks), mean(pv, breaks),
        mean(lambda s: np.abs(speed(s)), breaks) * period,
    )  # fmt: skip
    assert [wear[word] for word in WORDS] == pytest.approx(expected, rel=1e-9, abs=0)

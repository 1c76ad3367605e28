"""Where a series runs through infinity: its line is cut there, and the picture says where.

Between two poses a series like 1/x changes sign with growing steps on both sides; before a
limit position a rate grows without end. Such places flatten a graph: what lies far beyond the
other values is left outside of it. A peak that is no pole, such as the push of a load, stays.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mechdae.records import dataclass
from mechdae.results.status import stretches

Array = NDArray[np.float64]
STEEPER = 2.0
"""Steps towards a change of sign through infinity grow at least by that factor."""
EVEN = 3.0
"""Steps of the reciprocal of such a series are alike up to that factor."""
GROWING = 1.5
"""Steps towards a place where values grow without end grow at least by that factor."""
EQUAL = 0.8
"""Three values of more than this share of the largest are a plateau."""
CORE = (0.1, 0.9)
"""Shares of the values between which most lie."""
FLAT, INFINITE = 8.0, 3.0
"""Values that reach over so many ranges of most others flatten a graph, with poles sooner."""
ROOM = 1.5
"""Ranges of most values shown above and below them where others are left out."""


@dataclass(frozen=True)
class Beyond:
    """A place where a series leaves the picture: abscissa, largest value there.

    ``pole`` tells that it runs through infinity, or grows without end.
    """

    at: float
    value: float
    pole: bool


@dataclass(frozen=True)
class Clip:
    """Limits of a graph and what lies beyond them."""

    low: float
    high: float
    beyond: tuple[Beyond, ...] = ()


def cuts(values: Array) -> list[int]:
    """Return the poses after which a series, (n,) or (n, 2), runs through infinity."""
    rows = np.reshape(np.asarray(values, float), (len(values), -1))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        jumps = np.diff(rows, axis=0)
        found = []
        for k in np.flatnonzero((rows[1:] * rows[:-1]).sum(axis=1) < 0).tolist():
            if 2 <= k <= len(rows) - 4 and _through_infinity(rows[k - 2 : k + 4] @ jumps[k]):
                found.append(k)
    return found


def _through_infinity(six: Array) -> bool:
    """Return whether a series runs through infinity in the middle of six poses.

    Both sides grow towards it, by growing steps; the reciprocal goes through zero, evenly.
    """
    steps = np.diff(six)
    outward = np.array([steps[0], steps[1], -steps[2], steps[3], steps[4]])
    if not (np.isfinite(outward).all() and bool((outward < 0).all() or (outward > 0).all())):
        return False
    left, right = np.abs(six[:3]), np.abs(six[:2:-1])
    grows = bool((np.diff(left) > 0).all() and (np.diff(right) > 0).all())
    steeper = abs(steps[1]) > STEEPER * abs(steps[0]) and abs(steps[3]) > STEEPER * abs(steps[4])
    slopes = np.abs(np.diff(1.0 / six[1:5]))
    return grows and steeper and bool(slopes.max() < EVEN * slopes.min())


def with_gaps(x: Array, values: Array, at: Sequence[int]) -> tuple[Array, Array]:
    """Return abscissas and values with nan between the poses where a line is cut."""
    places = np.asarray(at, int) + 1
    return np.insert(x, places, np.nan), np.insert(values, places, np.nan, axis=0)


def clip_of(x: Array, values: Array, at: Sequence[int]) -> Clip | None:
    """Return the limits within which a series is shown, None where all of it is.

    Parameters
    ----------
    x, values
        Abscissas and values, (n,).
    at
        Poses after which the series runs through infinity.
    """
    there = np.isfinite(values)
    finite = values[there]
    if finite.size < 8:
        return None
    lowest, highest = float(finite.min()), float(finite.max())
    low, high = np.quantile(finite, CORE)
    width, full = float(high - low), highest - lowest
    poles = tuple(Beyond(crossing(x, values, k), float(values[k]), True) for k in at)
    if width <= 0 or full <= (INFINITE if poles else FLAT) * width:
        return Clip(lowest, highest, poles) if poles else None
    least, most = low - ROOM * width, high + ROOM * width
    growing = _growing(values)
    with np.errstate(invalid="ignore"):
        outside = there & ((values < least) | (values > most))
    peaks = []
    for first, after in stretches(outside):
        if any(first <= k + 1 and k < after for k in at):
            continue
        part = values[first:after]
        peak = first + int(np.argmax(np.abs(part)))
        third = np.sort(np.abs(part))[-3:][0]
        plateau = len(part) > 2 and third > EQUAL * abs(values[peak])
        if growing & {peak - 1, peak, peak + 1} and not plateau:
            peaks.append(Beyond(float(x[peak]), float(values[peak]), False))
        else:
            least, most = min(least, float(part.min())), max(most, float(part.max()))
    least, most = max(least, lowest), min(most, highest)
    hidden = tuple(extreme for extreme in peaks if not least <= extreme.value <= most)
    if poles or (hidden and most - least < full / 2):
        return Clip(least, most, poles + hidden)
    return None


def crossing(x: Array, values: Array, k: int) -> float:
    """Return where a series runs through infinity after pose `k`: its reciprocal is zero."""
    a, b = 1.0 / values[k], 1.0 / values[k + 1]
    share = float(np.clip(a / (a - b), 0.0, 1.0)) if a != b else 0.5
    return float(x[k] + share * (x[k + 1] - x[k]))


def joined(clips: Sequence[Clip | None], values: Sequence[Array]) -> Clip | None:
    """Return the limits that hold all series of a panel."""
    if not any(clips):
        return None
    low, high = np.inf, -np.inf
    beyond: list[Beyond] = []
    for clip, value in zip(clips, values, strict=True):
        finite = value[np.isfinite(value)]
        if clip is not None:
            low, high = min(low, clip.low), max(high, clip.high)
            beyond += clip.beyond
        elif finite.size:
            low, high = min(low, float(finite.min())), max(high, float(finite.max()))
    outside = tuple(
        extreme for extreme in beyond if extreme.pole or not low <= extreme.value <= high
    )
    return Clip(low, high, outside) if outside else None


def _growing(values: Array) -> set[int]:
    """Return the poses towards which a series grows by growing steps, from one side."""
    steps = np.diff(values)

    def steeper(near: Array, middle: Array, far: Array) -> NDArray[np.bool_]:
        same: NDArray[np.bool_] = (near * middle > 0) & (middle * far > 0)
        same &= (np.abs(near) > GROWING * np.abs(middle)) & (np.abs(middle) > np.abs(far))
        return same

    with np.errstate(invalid="ignore"):
        left = np.flatnonzero(steeper(steps[2:], steps[1:-1], steps[:-2])) + 3
        right = np.flatnonzero(steeper(steps[:-2], steps[1:-1], steps[2:]))
    return {*left.tolist(), *right.tolist()}

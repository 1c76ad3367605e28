"""Where paths go that arrive nowhere: to infinity like a power of what is left of the way."""

from __future__ import annotations

import numpy as np

from mechdae.numerics.homotopy.tracker import System, track
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats

DECADES = (3, 4, 5, 6)
"""The way is followed to 1 - 10^-k of its length."""
LEAST = 0.04
"""Least power of what is left with which a solution grows that goes to infinity."""
STEADY = 0.25
"""Share by which that power may change from one decade to the next."""
NEAR = 1e-2
"""Change in a decade, by its size, below which a solution stays finite."""


@dataclass(frozen=True)
class FarEnds:
    """Of paths that do not arrive: which go to infinity, which to a finite solution; (n,) each.

    Paths that are neither are lost.
    """

    infinite: Booleans
    finite: Booleans


def far_ends(system: System, x: Complexes) -> FarEnds:
    """Return where paths of solutions (n, k) at t = 0 go that do not arrive at t = 1.

    Two steady powers in a row are evidence, no proof.
    """
    places, good, begun = [], np.ones(len(x), bool), 0.0
    for k in DECADES:
        stop = 1 - 10.0**-k
        ends = track(_part(system, begun, stop), x, relative=True)
        good &= ends.followed
        x, begun = np.where(good[:, None], ends.x, x), stop
        places.append(x)
    with np.errstate(all="ignore"):
        sizes = np.array([np.abs(place).max(axis=1) for place in places])
        powers = np.diff(np.log10(sizes), axis=0)
        steady = np.abs(powers[2] - powers[1]) <= STEADY * powers[2]
        change = np.abs(places[3] - places[2]).max(axis=1) / (1 + sizes[3])
    infinite = good & (powers[1:] >= LEAST).all(axis=0) & steady
    return FarEnds(infinite, good & ~infinite & (change < NEAR))


def _part(system: System, start: float, end: float) -> System:
    """Return a part of a way, from t = 0 to 1."""

    def part(x: Complexes, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
        F, J, rate = system(x, start + t * (end - start))
        return F, J, rate * (end - start)

    return part

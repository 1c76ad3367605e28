"""Families of equations F(x; p) = 0 with complex numbers p: straight and bent ways, round trips."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from mechdae.numerics.homotopy.tracker import System, track
from mechdae.types import Complexes, Floats

if TYPE_CHECKING:
    from numpy.random import Generator


CLOSE = 1e-8
"""Last Newton step of an end that is a simple solution, by its size."""
SAME = 1e-6
"""Largest relative difference of keys that are one."""


class Family(Protocol):
    """Square equations that are analytic in unknowns and numbers."""

    def rows(self, x: Complexes, p: Complexes, rate: Any) -> tuple[Any, Any, Any]:
        """Return F (n, k), its Jacobian (n, k, k), and its derivative along a `rate` of p.

        x is (n, k), p and its rate are (n, m) or (1, m).
        """

    def drawn(self, generator: Generator) -> tuple[Any, Any]:
        """Return generic complex numbers (m,) and one solution (k,) of theirs."""

    def numbers(self, generator: Any) -> Any:
        """Return generic complex numbers (m,)."""

    def key(self, x: Complexes) -> Any:
        """Return what tells solutions (n, k) apart, as rows of numbers."""


def way(family: Family, start: Complexes, end: Complexes, bend: Complexes | None = None) -> System:
    """Return the equations along the numbers start + t (end - start) + t (1 - t) bend."""

    def system(x: Complexes, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
        t = t[:, None]
        p, rate = start + t * (end - start), np.broadcast_to(end - start, (len(x), len(start)))
        if bend is not None:
            p, rate = p + t * (1 - t) * bend, rate + (1 - 2 * t) * bend
        return family.rows(x, p, rate)

    return system


def arrived(system: System, x: Complexes) -> Complexes:
    """Return where solutions lead to; rows of `nan` where paths were lost or end in no simple one.

    `system`: at t = 0 with the solutions x (n, k).
    """
    ends = track(system, x, relative=True)
    with np.errstate(all="ignore"):
        good = ends.followed & (ends.step <= CLOSE * (1 + np.abs(ends.x).max(axis=1)))
    return np.where(good[:, None], ends.x, np.nan)


def there(x: Complexes) -> Complexes:
    """Return the rows that are solutions."""
    return x[np.isfinite(x).all(axis=1)]


def united(family: Family, known: Complexes, more: Complexes) -> Complexes:
    """Return known solutions and the new ones among others, each once."""
    every = np.concatenate([known, more])
    kept = list(range(len(known)))
    keys = family.key(every)
    bounded = keys / (1 + np.abs(keys))
    for row in range(len(known), len(every)):
        gaps = np.abs(bounded[kept] - bounded[row]).max(axis=1)
        if not kept or not gaps.min() <= SAME:
            kept.append(row)
    return every[kept]


def round_trip(family: Family, p: Complexes, x: Complexes, generator: Generator) -> Complexes:
    """Return what is known (n, k) at numbers p after a way through others and back."""
    middle, bend = family.numbers(generator), family.numbers(generator)
    out = there(arrived(way(family, p, middle), x))
    if not len(out):
        return x
    return united(family, x, there(arrived(way(family, middle, p, bend), out)))

"""All poses of a planar linkage by paths from a generic complex one, certified."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.numerics.homotopy.certified_poses import apart, certify
from mechdae.numerics.homotopy.linkage import ComplexDimensions, straight
from mechdae.numerics.homotopy.stored_instances import Instance, different, followed, within_a_turn
from mechdae.records import dataclass
from mechdae.types import Matrix

ROUTES = 4
BENT = 0.5
"""Size of the bend of a further route, beside numbers of size 1."""
THEOREM, MONODROMY, PATHS = "theorem", "monodromy", "paths"


@dataclass(frozen=True)
class LinkagePoses:
    """Real poses: ``turns`` (n, m) [rad] and ``slides`` (n, k), and what is known of their number.

    ``generic`` is the number of complex poses for generic dimensions, ``regular`` that of those
    that are certified here, ``basis`` says why there are no others: "theorem", as many as a
    theorem allows at most; "monodromy", as many as round trips found for generic dimensions;
    "paths": fewer, some paths end elsewhere.
    """

    turns: Matrix
    slides: Matrix
    generic: int
    regular: int
    basis: str

    @property
    def proven(self) -> bool:
        return self.basis == THEOREM

    @property
    def singular(self) -> int:
        """Paths that end in singular poses or at infinity."""
        return self.generic - self.regular


def linkage_poses(start: Instance, numbers: ComplexDimensions) -> LinkagePoses:
    """Return the real poses of a linkage with real `numbers`, on paths from a generic one."""
    linkage, generic, first = start.linkage, start.numbers, start.x
    size = float(np.sqrt((np.abs(numbers.a) ** 2).mean())) or 1.0
    scaled = ComplexDimensions.real(numbers.a / size, numbers.n)
    wanted = len(first)
    rng = np.random.default_rng(7)
    best = np.zeros((0, first.shape[1]), complex)
    for route in range(ROUTES):
        bend = ComplexDimensions.drawn(linkage, rng) if route else None
        if bend is not None:
            bend = bend.plus(BENT - 1.0, bend)
        ends, good = followed(linkage, straight(generic, scaled, bend), first)
        known = len(best)
        every = np.concatenate([best, within_a_turn(linkage, ends[good])])
        best = every[different(linkage, every)]
        if len(best) >= wanted or (route and len(best) == known):
            break
    found = certify(linkage, scaled, best)
    regular = int(found.simple.sum())
    sure = regular == len(best) and bool((found.real | found.other).all()) and apart(found)
    basis = PATHS
    if sure and regular == wanted:
        basis = THEOREM if start.whole else MONODROMY
    m = max(linkage.turns)
    real = best[found.simple & found.real]
    order: Any = np.lexsort(np.round(real.imag[:, :m], 9).T) if len(real) else []
    real = real[order]
    return LinkagePoses(real[:, :m].imag, size * real[:, m:].real, wanted, regular, basis)

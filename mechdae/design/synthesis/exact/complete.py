"""All solutions of exact conditions: paths from generic numbers, certificates, what may be said."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae import __version__
from mechdae.design.synthesis.exact import coupler_curve as curve
from mechdae.design.synthesis.exact.conditions import COUNT, DyadConditions, PathConditions
from mechdae.numerics.homotopy.boxes import Enclosed, apart, enclosed
from mechdae.numerics.homotopy.families import (
    TraceTest,
    arrived,
    far_ends,
    round_trip,
    there,
    trace_test,
    united,
    way,
)
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes

if TYPE_CHECKING:
    from numpy.random import Generator

TRIPS = 60
WORK = 15_000
"""Paths that are followed at most."""
PROBES = 15
"""Places that determine a curve of degree three in d and d' through the origin."""
STEP = 0.1
PART = 128
"""Paths that are followed together."""
ROUTES = 6
SILENT = 2
"""Routes without news after which no more are followed."""
FEW = 0.5
"""Share of the paths below which the numbers are special and a second route is the last one."""
MOST_FAR = 300
"""Paths that arrive nowhere, up to which it is looked at where they go."""
SEED = 1992


@dataclass(frozen=True, eq=False)
class GenericSolutions:
    """Generic numbers ``p`` (m,) of a family and their solutions ``z`` (n, N).

    ``basis`` tells why these are all: "theorem", "trace test"; "none": they may not be.
    """

    family: Any
    p: Complexes
    z: Any
    basis: str
    bent: float = 1.0
    """Of the trace, see `TraceTest`."""


def traced(family: PathConditions, p: Complexes, z: Complexes, seed: int = 1) -> TraceTest:
    """Return the trace test of solutions at numbers p: of their curves, the last place moved."""
    generator = np.random.default_rng([seed, len(family.given)])
    angles = 2j * np.pi * generator.random((2, PROBES))
    probes = 1.3 * np.exp(angles)
    weights = _complex(generator, PROBES)
    forms = _complex(generator, PROBES, 4)

    def coordinates(x: Complexes) -> Any:
        G = curve.value(x, *probes[:, None])
        return G @ forms / (G @ weights)[:, None]

    return trace_test(family.pencil(p, weights, probes), z, coordinates, generator, STEP)


@dataclass(frozen=True, eq=False)
class Known:
    """What is known after so many ``trips``, the last ``silent`` of which brought no news."""

    p: Complexes
    z: Complexes
    trips: int = 0
    silent: int = 0
    work: int = 0


def generic(
    family: PathConditions,
    seed: int = 1,
    known: Known | None = None,
    tell: Callable[[Known], None] | None = None,
) -> GenericSolutions:
    """Return generic numbers and their solutions, all of them where the trace is linear."""
    if known is None:
        p, first = family.drawn(np.random.default_rng(seed))
        known = Known(p, first[None])
    trace = TraceTest(0, 1.0)
    while True:
        if known.silent >= SILENT:
            trace = traced(family, known.p, known.z)
        if trace.linear or known.trips >= TRIPS or known.work > WORK:
            break
        generator = np.random.default_rng([seed, known.trips + 1])
        before = len(known.z)
        z = round_trip(family, known.p, known.z, generator)
        silent = known.silent + 1 if len(z) == before else 0
        known = Known(known.p, z, known.trips + 1, silent, known.work + 2 * before)
        if tell is not None:
            tell(known)
    basis = "trace test" if trace.linear else "none"
    return GenericSolutions(family, known.p, known.z, basis, trace.bent)


def generic_dyads(family: DyadConditions, seed: int = 1) -> GenericSolutions:
    """Return generic poses with their four dyads."""
    generator = np.random.default_rng(seed)
    p, first = family.drawn(generator)
    z = first[None]
    for _ in range(TRIPS):
        if len(z) == COUNT:
            break
        z = round_trip(family, p, z, generator)
    return GenericSolutions(family, p, z, "theorem" if len(z) == COUNT else "none")


def _complex(generator: Generator, *shape: int) -> Complexes:
    return generator.normal(size=shape) + 1j * generator.normal(size=shape)


@dataclass(frozen=True, eq=False)
class PathWork:
    """Paths of a family from numbers ``start`` with solutions ``z`` to ``target``."""

    version: str
    family: Any
    start: Complexes
    target: Complexes
    bend: Complexes
    z: Complexes


Follow = Callable[[Sequence[PathWork]], list[Any]]
"""Where the solutions of each work lead to, `nan` where paths do not arrive."""


@dataclass(frozen=True, eq=False)
class AllSolutions:
    """Certified solutions at numbers of the user, and how the paths ended.

    ``z`` (n, N): certified solutions, all different, one of each curve where nothing is given.
    ``count``: of the generic solutions: of all paths. ``infinite``, ``singular``, ``lost``: paths
    that go to infinity; that end in a finite solution that is not simple; that ended somewhere on
    the way, or are too many to be looked at. ``basis``: what says how many there are: "theorem",
    "trace test", or "none". ``boxes``: certified complex solutions, with cognates and both ends of
    the ground line where nothing is given. Cognates whose links are too long for double numbers are
    missing; curves that both have such ones are told apart by their coefficients alone.
    """

    z: Complexes
    real: Booleans
    count: int
    infinite: int
    singular: int
    lost: int
    basis: str
    boxes: int

    @property
    def verdict(self) -> str:
        """Return "proven", "complete" or "found".

        Proven: a theorem allows no more than what is certified. Complete: as many as the generic
        numbers have are certified, or go to infinity. Found: there may be others.
        """
        if self.basis == "none" or len(self.z) + self.infinite < self.count:
            return "found"
        return "proven" if self.basis == "theorem" and not self.infinite else "complete"

    def facts(self) -> dict[str, Any]:
        """Return counts, basis and verdict as plain values."""
        return {
            "verdict": self.verdict, "basis": self.basis, "count": self.count,
            "certified": len(self.z), "boxes": self.boxes, "real": int(self.real.sum()),
            "infinite": self.infinite, "singular": self.singular, "lost": self.lost,
        }  # fmt: skip


def followed(work: PathWork) -> Complexes:
    """Return where the solutions of a work lead to."""
    return arrived(way(work.family, work.start, work.target, work.bend), work.z)


def here(works: Sequence[PathWork]) -> list[Complexes]:
    """Follow works one after the other in this process."""
    return [followed(work) for work in works]


def all_solutions(generic: GenericSolutions, target: Any, follow: Follow = here) -> AllSolutions:
    """Return all solutions at given numbers.

    `generic`: numbers of the same family with all their solutions. `target` (m,): numbers of the
    user, of the size of one.
    """
    family = generic.family
    z = np.zeros((0, family.unknowns), complex)
    silent, count = 0, len(generic.z)
    bend: Any = None
    ends: Any = None
    for route in range(ROUTES):
        bend = family.numbers(np.random.default_rng([SEED, route]))
        ends = np.concatenate(follow(_works(generic, target, bend)))
        before, z = len(z), united(family, z, there(ends))
        silent = silent + 1 if len(z) == before else 0
        if len(z) >= count or silent == SILENT or (route and len(z) < FEW * count):
            break
    found = _enclosed(family, target, z)
    left = int((~found.certain).sum())
    infinite = singular = lost = 0
    if int(found.certain.sum()) < count:
        missed = np.flatnonzero(~np.isfinite(ends).all(axis=1))
        missed = missed if len(missed) <= MOST_FAR else missed[:0]
        system = way(family, generic.p, target, bend)
        gone = far_ends(system, generic.z[missed])
        infinite, singular = int(gone.infinite.sum()), int(gone.finite.sum()) + left
        lost = max(count - int(found.certain.sum()) - infinite - singular, 0)
    z, real = found.z[found.certain], found.real[found.certain]
    # two of one curve would be cognates of each other: boxes of cognates would meet
    every = enclosed(family, target, family.variants(z)) if family.cognate else found
    basis = generic.basis if apart(every) else "none"
    boxes = int(every.certain.sum())
    return AllSolutions(z, real, count, infinite, singular, lost, basis, boxes)


def _enclosed(family: Any, target: Complexes, z: Any) -> Enclosed:
    """Return solutions with boxes; where one has none that of a cognate, if there is one."""
    found = enclosed(family, target, z)
    left = np.flatnonzero(~found.certain)
    if not family.cognate or not len(left):
        return found
    others = enclosed(family, target, family.variants(z[left]))
    certain = others.certain.reshape(-1, len(left))
    chosen = certain.argmax(axis=0) * len(left) + np.arange(len(left))
    z = found.z.copy()
    z[left] = np.where(certain.any(axis=0)[:, None], others.z[chosen], z[left])
    return enclosed(family, target, z)


def _works(generic: GenericSolutions, target: Complexes, bend: Complexes) -> list[PathWork]:
    return [
        PathWork(__version__, generic.family, generic.p, target, bend, generic.z[i : i + PART])
        for i in range(0, len(generic.z), PART)
    ]

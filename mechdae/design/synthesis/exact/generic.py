"""Generic complex four-bars with all their solutions: by round trips, ended by the trace test."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.design.synthesis.exact import coupler_curve as curve
from mechdae.design.synthesis.exact.conditions import PathConditions
from mechdae.design.synthesis.exact.dyad_conditions import COUNT, DyadConditions
from mechdae.numerics.homotopy.families import round_trip
from mechdae.numerics.homotopy.trace_check import TraceTest, trace_test
from mechdae.records import dataclass
from mechdae.types import Complexes

if TYPE_CHECKING:
    from numpy.random import Generator


TRIPS = 60
SILENT = 2
"""Round trips without news after which the trace is looked at."""
WORK = 15_000
"""Paths that are followed at most."""
PROBES = 15
"""Places that determine a curve of degree three in d and d' through the origin."""
STEP = 0.1


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


def traced(family: PathConditions, p: Any, z: Complexes, seed: int = 1) -> TraceTest:
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
    z: Any
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

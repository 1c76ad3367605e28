"""Generic four-bars with all their solutions: shipped ones, checked when they are read.

Stored are numbers and solutions in single precision, refined here, and the result of their trace
test. What is not stored is computed, in seconds, once in a process.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mechdae.design.synthesis.exact.conditions import PathConditions
from mechdae.design.synthesis.exact.dyad_conditions import DyadConditions
from mechdae.design.synthesis.exact.generic import GenericSolutions, generic, generic_dyads
from mechdae.errors import InputError
from mechdae.numerics.homotopy.boxes import apart, enclosed
from mechdae.numerics.homotopy.trace_check import LINEAR

STORE = Path(__file__).resolve().parent / "four_bars.npz"
TRIPLES = 1442
"""Curves of four-bars through nine points (Wampler, Morgan & Sommese 1992)."""


def name_of(count: int, given: tuple[str, ...]) -> str:
    """Return the name under which conditions are stored."""
    return "-".join([str(count), *given])


def written(found: GenericSolutions) -> dict[str, Any]:
    """Return the arrays that are stored of generic solutions, by name."""
    name = name_of(found.family.count, found.family.given)
    return {
        f"{name}/p": found.p.astype(np.complex64), f"{name}/z": found.z.astype(np.complex64),
        f"{name}/bent": np.array(found.bent),
    }  # fmt: skip


@cache
def paths(count: int, given: tuple[str, ...] = ()) -> GenericSolutions:
    """Return generic solutions of points and given dimensions."""
    family = PathConditions(count, given)
    return read(family, STORE) or generic(family)


def read(family: PathConditions, store: Path) -> GenericSolutions | None:
    """Return what is stored of conditions, refined and certified; None where nothing is."""
    name = name_of(family.count, family.given)
    with np.load(store, allow_pickle=False) as data:
        if f"{name}/p" not in data:
            return None
        p, z = (data[f"{name}/{word}"].astype(complex) for word in "pz")
        bent = float(data[f"{name}/bent"])
    found = enclosed(family, p, z)
    whole = bool(found.certain.all()) and apart(found) and bent <= LINEAR
    if not whole or (family.cognate and len(z) != TRIPLES):
        raise InputError("the stored solutions do not solve their conditions", where=str(store))
    return GenericSolutions(family, p, found.z, "trace test", bent)


@cache
def dyads() -> GenericSolutions:
    """Return generic poses with their four dyads."""
    return generic_dyads(DyadConditions())

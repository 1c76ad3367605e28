"""All four-bars through points, all dyads of poses, with what is certain about their number."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from mechdae.design.synthesis.exact import coupler_curve as curve
from mechdae.design.synthesis.exact.complete import (
    AllSolutions,
    Follow,
    GenericSolutions,
    all_solutions,
    generic,
    generic_dyads,
    here,
)
from mechdae.design.synthesis.exact.conditions import LENGTH, DyadConditions, G, PathConditions, W
from mechdae.design.synthesis.exact.coupler_curve import A, B, X, Y
from mechdae.design.synthesis.fourbar.exact import check_path
from mechdae.design.synthesis.fourbar.linkage import (
    LEAST,
    GuidingLink,
    Linkage,
    PlanePoses,
    linkage,
    scale_of,
    scaled_dimensions,
    variants,
)
from mechdae.errors import InputError
from mechdae.numerics.homotopy.boxes import apart, enclosed
from mechdae.numerics.homotopy.families import LINEAR
from mechdae.records import dataclass
from mechdae.types import Complexes

STORE = Path(__file__).resolve().parent / "four_bars.npz"
TRIPLES = 1442
"""Curves of four-bars through nine points (Wampler, Morgan & Sommese 1992)."""
UNIMODULAR = 1e-6
"""By how much the size of a turn may differ from one."""


def name_of(count: int, given: tuple[str, ...]) -> str:
    """Return the name under which conditions are stored."""
    return "-".join([str(count), *given])


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


@dataclass(frozen=True, eq=False)
class CountedFourBars:
    """Real four-bars, and all complex solutions of which they are the real ones."""

    designs: tuple[Linkage, ...]
    every: AllSolutions


def four_bars_through(
    targets: object, given: Mapping[str, float] | None = None, *, follow: Follow = here
) -> CountedFourBars | None:
    """Return all four-bars whose coupler point goes exactly through all points.

    `targets` (k, 2): three to nine points. `given`: 9 - k dimensions by name, as in `exact_path`.
    Where there are none, one four-bar of each coupler curve is returned; its cognates are others.

    Returns
    -------
    None where it is not known how many solutions there are: the given dimensions leave more than
    are looked for.
    """
    points, given = np.asarray(targets, float), dict(given or {})
    check_path(points, given)
    if {"pivot_x", "pivot_y", "ground", "turn"} <= set(given):
        ground, turn = given.pop("ground"), given.pop("turn")
        given["other_x"] = given["pivot_x"] + ground * np.cos(turn)
        given["other_y"] = given["pivot_y"] + ground * np.sin(turn)
    places = points[:, 0] + 1j * points[:, 1]
    middle, size = scale_of(places)
    generic = paths(len(places), tuple(sorted(given)))
    if generic.basis == "none":
        return None
    family = generic.family
    P = (places - middle) / size
    scaled = scaled_dimensions(given, middle, size)
    p = family.of(P, scaled)
    every = all_solutions(generic, p, follow)
    z = every.z[every.real]
    d, e = family.split(p)
    ones = np.ones((len(z), 1))
    turns = np.concatenate([ones, curve.turns(z, d[None], e[None])], axis=1)
    designs = []
    for own_z, m in zip(z, turns, strict=True):
        if not _usable(own_z, m, scaled):
            continue
        m = m / np.abs(m) * size
        first, second = (places + m * own_z[i] for i in (X, Y))
        pivot, other = (complex(places[0] + size * own_z[i]) for i in (A, B))
        designs.append(linkage(pivot, other, first, second, places))
    designs.sort(key=lambda made: made.lengths.tolist())
    return CountedFourBars(tuple(designs), every)


def _usable(z: Complexes, turns: Complexes, given: Mapping[str, float]) -> bool:
    """Return whether a real solution is a four-bar with the dimensions given, signs too."""
    arms = [z[B] - z[A], z[Y] - z[X], z[X] - z[A], z[Y] - z[B]]
    if min(map(abs, arms)) <= LEAST or not np.abs(np.abs(turns) - 1).max() <= UNIMODULAR:
        return False
    if "turn" in given and not (arms[0] * np.exp(-1j * given["turn"])).real > 0:
        return False
    return len(z) <= LENGTH or z[LENGTH].real > 0


def guiding_links(
    poses: PlanePoses, *, follow: Follow = here
) -> tuple[tuple[GuidingLink, ...], AllSolutions]:
    """Return all real dyads RR of five poses, the shortest first, and all complex ones."""
    middle, size = scale_of(poses.places)
    generic = dyads()
    p = generic.family.of((poses.places - middle) / size, poses.rotations)
    every = all_solutions(generic, p, follow)
    found = []
    for z in every.z[every.real]:
        pivot = complex(poses.places[0] + size * z[G])
        pin = complex(size * z[W] / poses.rotations[0])
        length = abs(poses.places[0] + poses.rotations[0] * pin - pivot)
        if length > LEAST * size:
            found.append(GuidingLink(pivot, pin, length))
    return tuple(sorted(found, key=lambda dyad: dyad.length)), every


def with_cognates(found: CountedFourBars) -> list[Linkage]:
    """Return the six four-bars of each curve."""
    return [one for design in found.designs for one in variants(design)]

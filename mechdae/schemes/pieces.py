"""The pieces of work of a search: small plain messages, each computed alone in any process."""

from __future__ import annotations

import hashlib
import traceback
from functools import lru_cache
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.jobs.distribute import Failure
from mechdae.records import dataclass
from mechdae.schemes import refine, screening
from mechdae.schemes.closure import material, shortest, turned
from mechdae.schemes.scheme import read
from mechdae.schemes.shape import Wanted, distances

ANGLES = 360
"""Crank angles at which what was refined is measured."""
TURN = 2 * np.pi
SCREEN, REFINE = "screen", "refine"


@dataclass(frozen=True)
class SchemePiece:
    """Work on one scheme.

    Parameters
    ----------
    do
        "screen": draw `count` sets and keep some for each of `limits`; "refine": go on from
        `places` for `count` iterations, each set within its limit of material and least sine.
    scheme
        Its text.
    corners
        (k,) complex, the wanted curve.
    """

    version: str
    do: str
    scheme: str
    corners: Any
    count: int
    seed: tuple[int, ...] = ()
    keep: int = 0
    places: Any = None
    limits: Any = None
    least: Any = None

    @property
    def digest(self) -> str:
        """A fingerprint, to the last bit."""
        plain = (self.do, self.scheme, self.count, self.seed, self.keep)
        found = hashlib.sha256(repr(plain).encode())
        for array in (self.corners, self.places, self.limits, self.least):
            if array is not None:
                own = np.ascontiguousarray(array)
                found.update(f"{own.dtype.kind}{own.shape}".encode() + own.tobytes())
        return found.hexdigest()[:32]


@dataclass(frozen=True)
class FoundSets:
    """Sets of dimensions of one scheme.

    Attributes
    ----------
    places
        (k, n) complex, in radii of the wanted curve; the crank's pivot is at zero.
    error
        (k,) the measure of `shape`; of what was screened the root mean square distance.
    material, least
        (k,) in radii; the least sine of the dyads.
    """

    places: Any
    error: Any
    material: Any
    least: Any


def computed(piece: SchemePiece) -> FoundSets | Failure:
    """Return what a piece gives; runs in any process that has the same mechdae."""
    if piece.version != __version__:
        return Failure(f"mechdae {__version__} runs there, {piece.version} here")
    try:
        return _screened(piece) if piece.do == SCREEN else _refined(piece)
    except Exception as error:  # told to the one who asked, whatever it is
        return Failure(f"{type(error).__name__}: {error}", traceback.format_exc())


def _screened(piece: SchemePiece) -> FoundSets:
    scheme, wanted = read(piece.scheme), _wanted(piece.corners.tobytes())
    target = wanted.points(screening.POINTS)
    places, residual = screening.screened(
        scheme, target - target.mean(), piece.count, list(piece.seed), piece.keep,
        piece.limits.tolist(),
    )  # fmt: skip
    return FoundSets(places, np.sqrt(residual), material(scheme, places), np.ones(len(places)))


def _refined(piece: SchemePiece) -> FoundSets:
    scheme, wanted = read(piece.scheme), _wanted(piece.corners.tobytes())
    target = wanted.points(refine.POINTS)
    run = refine.Refinement(scheme, piece.places, target - target.mean(), piece.limits, piece.least)
    return measured(piece.scheme, run.run(piece.count), piece.corners)


def measured(scheme: str, places: Any, corners: Any) -> FoundSets:
    """Return sets with their measures; those with bars too short, or that do not
    assemble at some angle, are left out.
    """
    own, wanted = read(scheme), _wanted(np.asarray(corners, complex).tobytes())
    turn = turned(own, places, TURN * np.arange(ANGLES) / ANGLES)
    least = turn.least
    whole = np.isfinite(places).all(axis=1) & (least > 0)
    kept = np.flatnonzero(whole & (shortest(own, places) >= refine.SHORT))
    places = places[kept] - places[kept, :1]
    if not len(kept):
        return FoundSets(places, np.zeros(0), np.zeros(0), np.zeros(0))
    error = distances(turn.x[own.trace][kept], wanted)
    return FoundSets(places, error, material(own, places), least[kept])


@lru_cache(maxsize=8)
def _wanted(corners: bytes) -> Wanted:
    return Wanted(np.frombuffer(corners, complex))

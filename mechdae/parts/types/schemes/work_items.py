"""The pieces of work of a search, small messages computed in any process, and what they found."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from typing import Any

import numpy as np

from mechdae.design.jobs.distribute import elsewhere
from mechdae.numerics.dominance import undominated
from mechdae.parts.types.schemes import screening
from mechdae.parts.types.schemes.aims import CURVE, PATH, Aim
from mechdae.parts.types.schemes.closure import SchemeTurn, material, shortest, turned
from mechdae.parts.types.schemes.descent import POINTS, SHORT, Descent, Refinement
from mechdae.parts.types.schemes.losses import LossAsked, losses
from mechdae.parts.types.schemes.scheme import Scheme, read
from mechdae.parts.types.schemes.screening import screened_sets
from mechdae.parts.types.schemes.shape import Wanted, distances
from mechdae.parts.types.schemes.targets.visits import (
    FunctionFitting,
    VisitFitting,
    based,
    function_errors,
    visited,
)
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats

ANGLES = 360
"""Crank angles at which what was refined is measured."""
TURN = 2 * np.pi
SCREEN, REFINE = "screen", "refine"
MOST = 24
"""Sets that are kept of one scheme."""
ROUNDED = 1e-13
"""Errors below are rounding, in units of the aim: none of them is better than another."""
SAME = 1e-4
"""Relative difference of measures below which two sets are one."""


@dataclass(frozen=True)
class SchemePiece:
    """Work on one scheme.

    `do`: "screen": draw `count` sets and keep some for each of `limits`; "refine": go on from
    `places` for `count` iterations, each set within its limit of material and least sine.
    """

    version: str
    do: str
    scheme: str
    aim: Aim
    count: int
    seed: tuple[int, ...] = ()
    keep: int = 0
    places: Any = None
    limits: Any = None
    least: Any = None
    rubbing: LossAsked | None = None
    losses: Any = None

    @property
    def digest(self) -> str:
        """A fingerprint, to the last bit."""
        plain = (self.do, self.scheme, self.count, self.seed, self.keep)
        found = hashlib.sha256(repr(plain).encode())
        if self.aim.what == CURVE:
            wanted = np.array(self.aim.corners)
        else:
            wanted = None
            found.update(repr(self.aim).encode())
        if self.rubbing is not None:
            found.update(repr(self.rubbing).encode())
        for array in (wanted, self.losses, self.places, self.limits, self.least):
            if array is not None:
                packed = np.ascontiguousarray(array)
                found.update(f"{packed.dtype.kind}{packed.shape}".encode() + packed.tobytes())
        return found.hexdigest()[:32]


@dataclass(frozen=True)
class FoundSets:
    """Sets of dimensions of one scheme.

    ``places`` (k, n) complex: in radii of the wanted curve; the crank's pivot is at zero. ``error``
    (k,): the measure of `shape`; of what was screened the root mean square distance. ``material``,
    ``least`` (k,): in radii; the least sine of the dyads. ``loss`` (k,) [W]; zero where none is
    asked for.
    """

    places: Complexes
    error: Floats
    material: Floats
    least: Floats
    loss: Floats


def computed(piece: SchemePiece) -> Any:
    """Return what a piece gives; runs in any process that has the same mechdae."""
    do = _screened if piece.do == SCREEN else _refined
    return elsewhere(piece.version, lambda: do(piece))


def _screened(piece: SchemePiece) -> FoundSets:
    scheme, aim, limits = read(piece.scheme), piece.aim, piece.limits.tolist()
    if aim.what != CURVE:
        places, error = screened_sets(
            scheme, aim, piece.count, list(piece.seed), piece.keep, limits
        )  # fmt: skip
        amount = _material(scheme, aim, places)
        return FoundSets(places, error, amount, np.ones(len(places)), np.zeros(len(places)))
    target = _wanted(aim.corners).points(screening.POINTS)
    places, residual = screening.screened(
        scheme, target - target.mean(), piece.count, list(piece.seed), piece.keep, limits
    )  # fmt: skip
    amount = _material(scheme, aim, places)
    none = np.zeros(len(places))
    return FoundSets(places, np.sqrt(residual), amount, np.ones(len(places)), none)


def _material(scheme: Scheme, aim: Aim, places: Complexes) -> Any:
    """Return the material of sets, with the ways of their guides."""
    turn = turned(scheme, places, _nodes(aim)) if scheme.ways else None
    return material(scheme, places, turn=turn)


def _refined(piece: SchemePiece) -> FoundSets:
    scheme, aim = read(piece.scheme), piece.aim
    limits, least = piece.limits, piece.least
    run: Descent
    if aim.what == CURVE:
        target = _wanted(aim.corners).points(POINTS)
        run = Refinement(scheme, piece.places, target - target.mean(), limits, least)
    elif aim.what == PATH:
        run = VisitFitting(scheme, piece.places, aim, limits, least)
    else:
        run = FunctionFitting(scheme, piece.places, aim, limits, least)
    if piece.rubbing is not None:
        run.lose(aim, piece.rubbing, piece.losses)
    return measured(piece.scheme, run.run(piece.count), aim, piece.rubbing)


def _nodes(aim: Aim) -> Floats:
    """Return the crank angles at which sets are measured."""
    if aim.what == CURVE:
        return TURN * np.arange(ANGLES) / ANGLES
    return aim.nodes(ANGLES if aim.turns else ANGLES // 2 + 1)


def measured(
    scheme: str, places: Complexes, aim: Aim, rubbing: LossAsked | None = None
) -> FoundSets:
    """Return sets with their measures; those with bars too short, or that do not
    assemble at some angle, are left out.
    """
    drawn = read(scheme)
    turn = turned(drawn, places, _nodes(aim))
    least = turn.least
    whole = np.isfinite(places).all(axis=1) & (least > 0)
    remaining = np.flatnonzero(whole & (shortest(drawn, places) >= SHORT))
    places = places[remaining] - places[remaining, :1] if aim.what == CURVE else places[remaining]
    if not len(remaining):
        return FoundSets(places, *(np.zeros(0) for _ in range(4)))
    if aim.what == CURVE:
        error = distances(turn.x[drawn.trace][remaining], _wanted(aim.corners))
    elif aim.what == PATH:
        error = visited(drawn, places, aim).error
    else:
        places = based(drawn, places, aim)
        error = function_errors(drawn, places, aim)[0]
    turn = SchemeTurn(turn.x[:, remaining], {})
    amount = material(drawn, places, turn=turn)
    loss = np.zeros(len(places))
    if rubbing is not None:
        loss = losses(drawn, places, aim, rubbing, ANGLES)
    return FoundSets(places, error, amount, least[remaining], loss)


@lru_cache(maxsize=8)
def _wanted(corners: tuple[complex, ...]) -> Wanted:
    return Wanted(np.array(corners))


@dataclass(frozen=True)
class SizedScheme:
    """One set of dimensions with its measures; lengths and errors in units of the aim."""

    scheme: Scheme
    places: Complexes
    error: float
    material: float
    least: float
    loss: float = 0.0

    def near(self, other: SizedScheme) -> bool:
        """Return whether another set of the scheme measures the same."""
        pairs = (
            (self.error, other.error), (self.material, other.material), (self.loss, other.loss)
        )  # fmt: skip
        return all(abs(a - b) <= SAME * (abs(b) + SAME) for a, b in pairs)

    def value(self, objective: str, aim: Aim) -> float:
        """Return an objective in SI units, before it is certified."""
        return {
            "error": max(self.error, ROUNDED) * aim.unit, "material": self.material * aim.radius,
            "joints": float(self.scheme.joints), "points": float(self.scheme.size),
            "transmission_angle": float(np.arcsin(min(self.least, 1.0))), "loss": self.loss,
        }[objective]  # fmt: skip


class Archive:
    """Sets by scheme, each better than the others of its scheme in something."""

    def __init__(self) -> None:
        self.entries: dict[str, list[SizedScheme]] = {}
        self.seen: int = 0

    def enter(self, text: str, found: FoundSets) -> None:
        """Take what a piece found."""
        scheme = read(text)
        sets = self.entries.setdefault(text, [])
        self.seen += len(found.error)
        for k in range(len(found.error)):
            entry = SizedScheme(
                scheme, found.places[k], float(found.error[k]), float(found.material[k]),
                float(found.least[k]), float(found.loss[k]),
            )  # fmt: skip
            if not any(entry.near(other) for other in sets):
                sets.append(entry)
        values = np.array([[e.error, e.material, -min(e.least, STEEP), e.loss] for e in sets])
        front = np.flatnonzero(undominated(values)).tolist() if sets else []
        order = sorted(front, key=lambda k: sets[k].error)
        if len(order) > MOST:
            picked = np.unique(np.linspace(0, len(order) - 1, MOST).astype(int))
            order = [order[k] for k in picked]
        self.entries[text] = [sets[k] for k in order]

    @property
    def every(self) -> list[SizedScheme]:
        return [entry for sets in self.entries.values() for entry in sets]

    def best(self, within: float = np.inf) -> dict[str, SizedScheme]:
        """Return the entry of least error of each scheme, within a limit of material."""
        found = {}
        for text, sets in self.entries.items():
            allowed = [entry for entry in sets if entry.material <= within]
            if allowed:
                found[text] = min(allowed, key=lambda entry: entry.error)
        return found


STEEP = 0.5
"""Sine above which a better transmission is not kept for its own sake."""

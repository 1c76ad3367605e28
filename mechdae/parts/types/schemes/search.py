"""The search for schemes: screening, refinement, growth, levels of material; round by round."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.random import Generator

from mechdae import __version__
from mechdae.parts.types.described.composition import LARGEST, LEAST, CompositionDemand
from mechdae.parts.types.schemes.aims import aim_of
from mechdae.parts.types.schemes.growth import Change, grown, merged
from mechdae.parts.types.schemes.losses import rubbing_of
from mechdae.parts.types.schemes.scheme import Scheme, read
from mechdae.parts.types.schemes.types import chain_names, named, schemes_of
from mechdae.parts.types.schemes.work_items import (
    REFINE,
    SCREEN,
    Archive,
    FoundSets,
    SchemePiece,
    SizedScheme,
)
from mechdae.types import Complexes, Json

if TYPE_CHECKING:
    from mechdae.parts.types.schemes.aims import Aim
    from mechdae.parts.types.schemes.losses import LossAsked

Run = Callable[[Sequence[SchemePiece]], list[FoundSets]]
CHUNK = 1000
"""Sets that are drawn in one piece."""
BATCH = 24
"""Sets that are refined in one piece at most."""
SHORT, LONG = 14, 45
"""Iterations of a first look at a scheme, and of what is promising."""
TRIES = 4
"""Sets of a grown scheme at first."""
NOISE = 0.04
"""Of these sets but the first, in radii of the wanted curve."""
BELOW = (0.6, 0.75, 0.85, 0.92, 0.96)
"""Levels below the least material that counts, as shares of it."""
AROUND = 9
"""Sets that each level is approached from at most."""
LAST = 3
"""How often levels of material are filled in at the end."""
LEVELS = 14
"""Levels of material, between which the front is filled in."""
CAP = 60.0
"""Material in radii that no design has where nothing is said: links without end are no answer."""


class SchemeSearch:
    """Everything that a task of composition searches with."""

    def __init__(self, demand: CompositionDemand, run: Run) -> None:
        self.demand, self.run = demand, run
        self.aim: Aim = aim_of(demand)
        self.radius: float = self.aim.radius
        self.rubbing: LossAsked | None = rubbing_of(demand)
        self.archive: Archive = Archive()
        self.tried: set[str] = set()
        self.rounds: list[Json] = []
        self.least: float = float(np.sin(demand.within.get("transmission_angle", LEAST)))
        self.cap: float = self._cap()
        self.worst: float = np.inf
        if demand.reference is not None and "error" in demand.objectives:
            worst = demand.reference[demand.objectives.index("error")]
            self.worst = worst / self.aim.unit

    def _cap(self) -> float:
        """Return the most material that is looked at, in radii."""
        demand, found = self.demand, CAP
        if "material" in demand.within:
            found = demand.within["material"] / self.radius
        elif demand.reference is not None and "material" in demand.objectives:
            found = demand.reference[demand.objectives.index("material")] / self.radius
        return found

    @property
    def _weighed(self) -> bool:
        return "material" in self.demand.objectives

    def schemes(self) -> list[Scheme]:
        """Return the schemes of the chains that are allowed, each once, small ones first."""
        demand = self.demand
        if demand.chains is not None:
            chains = [named(name, LARGEST, f"chains[{k}]") for k, name in enumerate(demand.chains)]
        else:
            chains = [(n, k) for n in demand.links for k in range(1, len(chain_names(n)) + 1)]
        found: dict[str, Scheme] = {}
        for links, place in chains:
            for scheme in schemes_of(links, place, self.aim.what, demand.slides):
                if self.allows(scheme):
                    found.setdefault(scheme.text, scheme)
        return sorted(found.values(), key=lambda scheme: scheme.size)

    def allows(self, scheme: Scheme) -> bool:
        """Return whether a scheme is small enough."""
        within = self.demand.within
        return scheme.size <= self.demand.points and scheme.joints <= within.get("joints", np.inf)

    # -- rounds --------------------------------------------------------------------------------

    def search(self, enough: Callable[[], bool] = lambda: False) -> Archive:
        """Return all that was found; no further round of growth begins when it is `enough`."""
        self._screen(self.schemes())
        self._fill("levels 0")
        for number in range(self.demand.grow):
            if enough():
                break
            self._grow(number)
            self._fill(f"levels {number + 1}")
        if self._weighed:
            for number in range(LAST):
                self._fill(f"levels, last {number + 1}")
        if "transmission_angle" in self.demand.objectives:
            self._transmit()
        if self.rubbing is not None:
            for number in range(LAST):
                self._lose(f"losses {number + 1}")
        return self.archive

    def _screen(self, schemes: Sequence[Scheme]) -> None:
        demand = self.demand
        limits = np.array([self.cap, *((0.7 * self.cap, 0.5 * self.cap) if self._weighed else ())])
        keep = max(2, demand.starts // 3)
        pieces = []
        for scheme in schemes:
            for k in range(-(-demand.samples // CHUNK)):
                count = min(CHUNK, demand.samples - k * CHUNK)
                seed = (demand.seed, zlib.crc32(scheme.text.encode()), k)
                pieces.append(
                    SchemePiece(
                        __version__, SCREEN, scheme.text, self.aim, count, seed, keep,
                        limits=limits,
                    )
                )  # fmt: skip
        by_scheme: dict[str, list[FoundSets]] = {}
        for piece, found in zip(pieces, self._done("screening", pieces), strict=True):
            by_scheme.setdefault(piece.scheme, []).append(found)
        jobs: list[tuple[str, Complexes, float]] = []
        for text, several in by_scheme.items():
            self.tried.add(text)
            places = np.concatenate([found.places for found in several])
            error = np.concatenate([found.error for found in several])
            amount = np.concatenate([found.material for found in several])
            for limit in limits.tolist():
                order = np.argsort(np.where(amount <= limit, error, np.inf), kind="stable")
                allowed = [k for k in order.tolist() if amount[k] <= limit]
                jobs += [(text, places[k], limit) for k in allowed[: demand.starts]]
        self._refine("refinement", jobs, LONG)

    def _grow(self, number: int) -> None:
        """Grow and shrink the best, look at new schemes shortly, go on with the best of them."""
        generator = np.random.default_rng([self.demand.seed, 7, number])
        jobs: list[tuple[str, Complexes, float]] = []
        for entry in self._parents():
            for change in self._changes(entry.scheme):
                text = change.scheme.text
                if text in self.tried:
                    continue
                self.tried.add(text)
                jobs += self._first_sets(entry, change, generator)
        before = set(self.archive.entries)
        self._refine(f"growth {number + 1}", jobs, SHORT)
        new = [text for text in self.archive.entries if text not in before]
        later: list[tuple[str, Any, float]] = []
        for text in self._promising(new):
            for entry in self.archive.entries[text][: BATCH // 4]:
                shift = generator.normal(0, NOISE, (2, entry.scheme.size))
                for limit in (self.cap, max(1.03 * entry.material, 1.0)):
                    later.append((text, entry.places, min(limit, self.cap)))
                later.append((text, entry.places + shift[0] + 1j * shift[1], self.cap))
        self._refine(f"growth {number + 1}, refinement", later, LONG)

    def _first_sets(
        self, entry: SizedScheme, change: Change, generator: Generator
    ) -> list[tuple[str, Complexes, float]]:
        span = None if self.aim.turns else self.aim.span
        sets = change.places(entry.scheme, entry.places, TRIES, generator, span)
        noise = generator.normal(0, NOISE, (2, *sets.shape))
        noise[:, 0] = 0.0
        sets = sets + noise[0] + 1j * noise[1]
        limit = max(self.cap, 1.0)
        return [(change.scheme.text, places, limit) for places in sets]

    def _changes(self, scheme: Scheme) -> Iterable[Change]:
        slides, function = self.demand.slides, self.demand.function is not None
        for change in (*grown(scheme, slides, function), *merged(scheme, function)):
            if self.allows(change.scheme):
                yield change

    def _parents(self) -> list[SizedScheme]:
        """Return the best entries of different schemes: by size, and along the material."""
        found: dict[int, SizedScheme] = {}
        best = sorted(self.archive.best().values(), key=lambda entry: entry.error)
        for size in sorted({entry.scheme.size for entry in best}):
            for entry in [entry for entry in best if entry.scheme.size == size][:EACH_SIZE]:
                found[id(entry)] = entry
        if self._weighed:
            for level in self._levels(ALONG):
                entries = self.archive.best(level).values()
                for entry in sorted(entries, key=lambda e: e.error)[:2]:
                    found[id(entry)] = entry
        return list(found.values())

    def _promising(self, texts: Sequence[str]) -> list[str]:
        """Return the new schemes that are best in their size or somewhere along the material."""
        found: dict[str, None] = {}
        limits = [np.inf, *(self._levels(ALONG) if self._weighed else [])]
        for limit in limits:
            best = {t: e for t, e in self.archive.best(limit).items() if t in set(texts)}
            for size in sorted({entry.scheme.size for entry in best.values()}):
                schemes = [t for t, e in best.items() if e.scheme.size == size]
                for text in sorted(schemes, key=lambda t: best[t].error)[:PROMISING]:
                    found[text] = None
        return list(found)

    # -- levels of material ----------------------------------------------------------------------

    def _levels(self, count: int) -> list[float]:
        """Return levels of material from the least there is to the most that is looked at."""
        every = self.archive.every
        if not every:
            return []
        counted = [entry for entry in every if entry.error <= self.worst]
        low = min(entry.material for entry in counted or every)
        errors = sorted(every, key=lambda entry: entry.error)
        high = min(self.cap, max(errors[0].material, 1.2 * low))
        if not low < high:
            return [high]
        return [float(number) for number in np.linspace(low, high, count)]

    def _fill(self, name: str) -> None:
        """Refine towards levels of material from the best sets around each."""
        if not self._weighed:
            return
        jobs: list[tuple[str, Complexes, float]] = []
        levels = self._levels(LEVELS)
        if levels:
            levels = [*(share * levels[0] for share in BELOW), *levels]
        lightest = sorted(self.archive.every, key=lambda e: e.material)[:2]
        for level in levels:
            around: dict[int, SizedScheme] = {}
            for share in (1.0, 1.06, 1.25, 1.6):
                near = sorted(self.archive.best(share * level).values(), key=lambda e: e.error)
                around |= {id(entry): entry for entry in near[:2]}
            within = [entry for entry in self.archive.every if entry.material <= 1.25 * level]
            for entry in sorted(within, key=lambda e: e.error):
                if len(around) == AROUND:
                    break
                if all(entry.error > 1.02 * other.error for other in around.values()):
                    around[id(entry)] = entry
            for entry in around.values() or lightest:
                jobs.append((entry.scheme.text, entry.places, level))
        self._refine(name, jobs, LONG)

    def _transmit(self) -> None:
        """Refine towards better transmission from the best of each size."""
        jobs, floors = [], []
        best = sorted(self.archive.best().values(), key=lambda entry: entry.error)[:TRANSMITTED]
        for entry in best:
            for angle in ANGLES_ASKED:
                jobs.append((entry.scheme.text, entry.places, self.cap))
                floors.append(float(np.sin(np.radians(angle))))
        for _ in range(2):
            self._refine("transmission", jobs, LONG, floors)

    def _lose(self, name: str) -> None:
        """Refine towards levels of loss from the best sets around each."""
        every = [entry for entry in self.archive.every if np.isfinite(entry.loss)]
        counted = [entry for entry in every if entry.error <= self.worst] or every
        if not counted:
            return
        low, high = (f(entry.loss for entry in counted) for f in (min, max))
        high = min(high, 4 * low)
        levels = [share * low for share in BELOW] + np.linspace(low, high, LEVELS).tolist()
        jobs, losses = [], []
        for level in levels:
            around: dict[int, SizedScheme] = {}
            for share in (1.0, 1.1, 1.6):
                under = (entry for entry in counted if entry.loss <= share * level)
                near = sorted(under, key=lambda entry: entry.error)
                around |= {id(entry): entry for entry in near[:3]}
            lightest = sorted(counted, key=lambda e: e.loss)[:2]
            for entry in list(around.values()) or lightest:
                jobs.append((entry.scheme.text, entry.places, self.cap))
                losses.append(level)
        self._refine(name, jobs, LONG, losses=losses)

    # -- pieces ----------------------------------------------------------------------------------

    def _refine(
        self, name: str, jobs: Sequence[tuple[str, Complexes, float]], iterations: int,
        floors: Sequence[float] | None = None, losses: Sequence[float] | None = None,
    ) -> None:  # fmt: skip
        """Refine sets, those of one scheme together, and enter what comes of them."""
        groups: dict[str, list[int]] = {}
        for k, (text, *_) in enumerate(jobs):
            groups.setdefault(text, []).append(k)
        pieces = []
        for text, sets in groups.items():
            for first in range(0, len(sets), BATCH):
                part = sets[first : first + BATCH]
                places = np.array([jobs[k][1] for k in part])
                limits = np.array([jobs[k][2] for k in part])
                least = np.full(len(part), self.least)
                if floors is not None:
                    least = np.maximum(least, [floors[k] for k in part])
                most = None
                if self.rubbing is not None:
                    most = np.array([np.inf if losses is None else losses[k] for k in part])
                pieces.append(
                    SchemePiece(
                        __version__, REFINE, text, self.aim, iterations, places=places,
                        limits=limits, least=least, rubbing=self.rubbing, losses=most,
                    )
                )  # fmt: skip
        for piece, found in zip(pieces, self._done(name, pieces), strict=True):
            self.archive.enter(piece.scheme, found)

    def _done(self, name: str, pieces: Sequence[SchemePiece]) -> list[FoundSets]:
        found = self.run(pieces)
        sets = sum(piece.count if piece.do == SCREEN else len(piece.places) for piece in pieces)
        every = (entry.error * self.aim.unit for entry in self.archive.every)
        best = min(every, default=None)
        self.rounds.append({"round": name, "pieces": len(pieces), "sets": sets, "before": best})
        return found


EACH_SIZE, ALONG, PROMISING, TRANSMITTED = 2, 6, 3, 6
"""Parents of each size, levels along which parents are taken, schemes that are gone on with."""
ANGLES_ASKED = (15.0, 25.0, 35.0, 45.0)
"""Least transmission angles that are tried where they are an objective [deg]."""
__all__ = ["SchemeSearch", "read"]

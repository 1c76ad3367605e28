"""What a search has found: sets of dimensions by scheme, those that nothing is better than."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.numerics.dominance import undominated
from mechdae.parts.types.schemes.aims import Aim
from mechdae.parts.types.schemes.scheme import Scheme, read
from mechdae.parts.types.schemes.work_items import FoundSets
from mechdae.records import dataclass

MOST = 24
"""Sets that are kept of one scheme."""
ROUNDED = 1e-13
"""Errors below are rounding, in units of the aim: none of them is better than another."""
SAME = 1e-4
"""Relative difference of measures below which two sets are one."""


@dataclass(frozen=True)
class SizedScheme:
    """One set of dimensions with its measures; lengths and errors in units of the aim."""

    scheme: Scheme
    places: Any
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
        self.seen = 0

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
        kept = np.flatnonzero(undominated(values)).tolist() if sets else []
        order = sorted(kept, key=lambda k: sets[k].error)
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

"""A plan as plain data: arrows, ends with letters, and the relations they stand for."""

from __future__ import annotations

import numpy as np

from mechdae.draw.diagram.scene import Array
from mechdae.records import dataclass

STEPS = (1, 1.5, 2, 2.5, 4, 5)
"""Scales of plans."""
CLOSED = 1e-9
"""Share of its size by which a plan may stay open before the picture says so."""


@dataclass(frozen=True)
class Arrow:
    """A vector of a plan, in the unit of the plan.

    Parameters
    ----------
    gid
        Its identifier in the SVG.
    kind
        total, relative, normal, tangential, coriolis, sliding, reaction, load, weight,
        inertia or inner.
    start, end
        From the pole.
    text
        Its name in mathtext, without the dollar signs; empty where letters say enough.
    """

    gid: str
    kind: str
    start: Array
    end: Array
    text: str = ""

    @property
    def length(self) -> float:
        return float(np.hypot(*(self.end - self.start)))


@dataclass(frozen=True)
class End:
    """A lettered place of a plan; ``text`` is mathtext without the dollar signs."""

    gid: str
    text: str
    place: Array


@dataclass(frozen=True)
class Plan:
    """A vector polygon or several that share a pole.

    Parameters
    ----------
    word
        velocity, acceleration, or force and the number of the group.
    title
        What stands above it.
    symbol, unit
        Of the scale.
    sides
        Lines between ends of one body: the image of the link.
    relations
        By Assur group: the vector equations drawn, in mathtext.
    gap
        Largest distance between the end of a chain and the place where it belongs.
    note
        Why there is nothing to draw.
    """

    word: str
    title: str
    symbol: str
    unit: str
    arrows: tuple[Arrow, ...] = ()
    ends: tuple[End, ...] = ()
    sides: tuple[tuple[Array, Array], ...] = ()
    relations: tuple[tuple[str, tuple[str, ...]], ...] = ()
    gap: float = 0.0
    note: str = ""

    @property
    def size(self) -> float:
        """Length of the longest vector."""
        return max((arrow.length for arrow in self.arrows), default=0.0)

    @property
    def corners(self) -> Array:
        """Starts and ends of all arrows, the pole before them."""
        return np.array(
            [np.zeros(2), *(p for arrow in self.arrows for p in (arrow.start, arrow.end))]
        )

    @property
    def closed(self) -> bool:
        return self.gap <= CLOSED * self.size


def round_up(number: float) -> float:
    """Return the least of `STEPS` times a power of ten that is not below the number."""
    power = int(np.floor(np.log10(number)))
    for exponent in (power - 1, power, power + 1):
        for step in STEPS:
            candidate = float(f"{step}e{exponent}")
            if candidate >= number * (1 - 1e-12):
                return candidate
    raise ArithmeticError(f"no round number above {number}")  # pragma: no cover

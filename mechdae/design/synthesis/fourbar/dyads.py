"""Poses of a plane, exactly: dyads by Burmester's theory, pairs of them as four-bars.

A dyad RR holds the point w of the moving plane at a distance L from the fixed point G:
|p_j + R_j w - G| = L at pose j. Five poses leave finitely many, at most four real ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import Any

import numpy as np

from mechdae.design.synthesis.fourbar.linkage import Linkage, linkage
from mechdae.errors import InputError
from mechdae.records import dataclass

LEAST = 1e-6
"""Shortest link in sizes of the poses: pins that fall together are none."""


@dataclass(frozen=True)
class PlanePoses:
    """Places (k,) complex of the moving plane's origin, and its turns (k,) [rad]."""

    places: Any
    turns: Any

    @property
    def rotations(self) -> Any:
        """Unit complex numbers of the turns."""
        return np.exp(1j * self.turns)

    def at(self, pin: complex) -> Any:
        """Return the places (k,) of a point of the moving plane."""
        return self.places + self.rotations * pin


@dataclass(frozen=True)
class GuidingLink:
    """A link between the fixed ``pivot`` and the ``pin`` of the moving plane, complex."""

    pivot: complex
    pin: complex
    length: float


def poses_of(values: Any) -> PlanePoses:
    """Return poses from rows x, y, turn, checked."""
    rows = np.asarray(values, float)
    if rows.ndim != 2 or rows.shape[1] != 3 or not np.isfinite(rows).all():
        raise InputError("poses are finite rows x, y, turn", where="poses")
    places = rows[:, 0] + 1j * rows[:, 1]
    size = float(np.abs(places - places.mean()).max())
    for i, j in permutations(range(len(rows)), 2):
        turned = abs(np.exp(1j * rows[i, 2]) - np.exp(1j * rows[j, 2]))
        if i < j and abs(places[i] - places[j]) <= 1e-12 * size and turned < 1e-12:
            raise InputError(f"poses {i + 1} and {j + 1} are the same", where="poses")
    return PlanePoses(places, rows[:, 2])


def paired(poses: PlanePoses, found: Sequence[GuidingLink]) -> tuple[Linkage, ...]:
    """Return the four-bars of two dyads, each driven at each of its pivots.

    The coupler point is the origin of the moving plane. Pairs that share a pivot or a pin are no
    four-bars and left out.
    """
    _, size = scale_of(poses.places)
    made = []
    for first, second in permutations(found, 2):
        line = second.pin - first.pin
        if min(abs(second.pivot - first.pivot), abs(line)) <= LEAST * size:
            continue
        A, B = poses.at(first.pin), poses.at(second.pin)
        frame = float(np.angle(line))
        made.append(linkage(first.pivot, second.pivot, A, B, poses.places, frame))
    return tuple(made)


def scale_of(places: Any) -> tuple[complex, float]:
    """Return the middle of places (k,) complex and their size."""
    middle = complex(places.mean())
    size = float(np.sqrt(np.mean(np.abs(places - middle) ** 2)))
    return middle, size if size > 0 else 1.0


def scaled_dimensions(given: Mapping[str, float], middle: complex, size: float) -> dict[str, float]:
    """Return given dimensions with the origin in the middle of the points, by their size."""
    shift = {"pivot_x": middle.real, "other_x": middle.real}
    shift |= {"pivot_y": middle.imag, "other_y": middle.imag}
    return {
        name: value if name == "turn" else (value - shift.get(name, 0.0)) / size
        for name, value in given.items()
    }

"""By how much groups stay open that have no pose."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from mechdae.describe.mechanism import Mechanism
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Block
from mechdae.records import dataclass
from mechdae.types import Floats

MEANT = 1e-4
"""Share of its size up to which dimensions of a mechanism may be off though they should agree."""


@dataclass(frozen=True)
class Gap:
    """By how much a joint (or driver) stays open; ``unit`` is m or rad.

    ``superfluous`` tells that the group closes without some of its equations, ``whole`` is what
    stays open of all of them [m], angles over the size of the mechanism, nan: not known. ``reach``
    says how long links are to be.
    """

    size: float
    unit: str
    joint: str
    superfluous: bool = True
    whole: float = math.nan
    reach: str = ""

    def tolerance(self, size: float) -> float | None:
        """Return a tolerance that would do in a mechanism of that size, None: none is meant."""
        return closing_tolerance(self.whole, size)


def closing_tolerance(whole: float, size: float) -> float | None:
    """Return a tolerance for what stays open in all [m] in a mechanism of a size; None if none is.

    What is open by more than a ten-thousandth of the mechanism is no noise.
    """
    return float(f"1e{math.ceil(math.log10(2 * whole))}") if 0 < whole < MEANT * size else None


@dataclass(frozen=True)
class NoPose:
    """A group that has no pose here, and the gap; `starts` of a search that found none.

    ``at`` tells which equation of a redundant group stays open, ``free`` that none does: the
    group has a freedom of its own.
    """

    group: Group
    gap: float
    infinite: bool = False
    starts: int = 0
    at: Gap | None = None
    free: bool = False


def bar_lengths(mechanism: Mechanism, owners: Iterable[str]) -> Floats:
    """Return the lengths of the `distance` joints that equations belong to, inf elsewhere."""
    bars = {name for name, joint in mechanism.joints.items() if joint.bar}
    values = mechanism.values() if bars else {}
    return np.array([values[f"{owner}.length"] if owner in bars else np.inf for owner in owners])


def straight(F: Floats, lengths: Floats) -> tuple[Floats, Floats]:
    """Return equations in which (d^2/l - l)/2 is d - l, a gap in metres.

    And by what their derivatives are to be multiplied.
    """
    with np.errstate(invalid="ignore"):
        share = np.sqrt(np.maximum(1 + 2 * F / lengths, 0.0))
        changed = np.where(np.isfinite(lengths), lengths * (share - 1), F)
    slope = np.where(np.isfinite(lengths), 1 / np.maximum(share, 1e-3), 1.0)
    return changed, slope


def worst(F: Floats, block: Block, size: float) -> Gap:
    """Return the joint of a block's equations that stays open most.

    `F` are the residuals, lengths divided by `size`; lengths of quaternions are no gaps of joints.
    """
    rows = list(zip(F, zip(block.owners, block.units, strict=True), strict=True))
    open_by: dict[tuple[str, str], float] = {}
    for value, key in [row for row in rows if row[1][1] != "1"] or rows:
        open_by[key] = float(np.hypot(open_by.get(key, 0.0), value))
    (joint, unit), most = max(open_by.items(), key=lambda item: item[1])
    return Gap(most * (size if unit == "m" else 1.0), unit, joint)

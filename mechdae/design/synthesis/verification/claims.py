"""What a search says of a design, and what a measurement of its file says."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

from mechdae.describe.tasks.goals import Asked
from mechdae.records import dataclass
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.design.synthesis.robust.deviations import Deviations

AGREES = 1e-6
"""Share by which what is measured may differ from what is claimed."""
FINER = 0.5
"""The same where the measurement looks between the nodes of the search: what it finds is
reported."""


@dataclass(frozen=True)
class Stated:
    """A goal or a limit as it is measured.

    ``unit``: size of what is measured, for what a limit may give way. ``word``, ``path``: of a way
    back and forth: "reach" or "time_ratio" as an objective or a limit, and its name. ``robust``:
    whose standard deviations are added.
    """

    asked: Asked
    bounds: tuple[float, float] | None = None
    unit: float = 1.0
    word: str = ""
    path: str = ""
    robust: Deviations | None = None


@dataclass(frozen=True)
class Claim:
    """Where a design is said to do what is asked: what the asking leaves free, nothing else.

    ``at``: driver values (k,) of the poses. ``sense``: in which the output of a function turns, by
    that of its values. ``direction``, ``offset``: of a straight line: its angle, and its distance
    from the origin. ``between``: shares (m,) of the interval at which errors are said to be
    largest. ``value``: of a motion or an equilibrium, from the sketch of the problem that was
    asked.
    """

    at: Any = ()
    sense: float = 1.0
    input_start: float = 0.0
    output_start: float = 0.0
    direction: float = 0.0
    offset: float = 0.0
    between: Any = ()
    value: float = 0.0


@dataclass(frozen=True)
class Worth:
    """What the file of a design does."""

    value: float
    errors: Floats
    defects: list[str] = field(default_factory=list)
    robust: dict[str, float] | None = None


def disagreement(measured: float, claimed: float, unit: float, between_nodes: bool) -> str:
    """Return that a measured objective is not the one that is claimed; empty where it is."""
    share, least = (FINER, 1e-5) if between_nodes else (AGREES, 1e-9)
    if abs(measured - claimed) <= share * abs(claimed) + least * unit:
        return ""
    return f"the sweep gives {measured:.6g}, not {claimed:.6g}"

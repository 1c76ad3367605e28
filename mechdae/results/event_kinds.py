"""A class for each sort of event: what it tells beside its place."""

from __future__ import annotations

from collections.abc import Sequence

from mechdae.records import dataclass
from mechdae.results.events import Event


@dataclass(frozen=True, eq=False, kw_only=True)
class GroupEvent(Event):
    """A group ends: a limit position, a cusp, a dead point, the end of a curve, or no proof.

    ``gap`` is the distance to another branch, ``order`` that to which branches touch, ``range``
    where the place is; ``reached`` is False behind the limit of another group.
    """

    group: list[str]
    joint: str | None
    name: str
    gap: float | None = None
    nearest: float | None = None
    order: float | None = None
    range: list[float] | None = None
    reached: bool | None = None
    ambiguous: bool | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class ChangePoint(GroupEvent):
    """Two branches meet: what was done, and the tangents of both by unknown.

    ``excluded`` tells that the other one does not meet redundant equations.
    """

    action: str
    tangents: dict[str, list[float | None]]
    exact: bool
    excluded: bool | None = None
    together_with: list[str] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Stationary(Event):
    """A quantity is largest or smallest."""

    of: str
    value: float
    extreme: str


@dataclass(frozen=True, eq=False, kw_only=True)
class PointCusp(Event):
    """A point comes to rest: the cusp of its path."""

    point: str
    position: list[float]


@dataclass(frozen=True, eq=False, kw_only=True)
class ValueEvent(Event):
    """A quantity that the task watches passes a value."""

    name: str
    of: str
    value: float
    direction: str


@dataclass(frozen=True, eq=False, kw_only=True)
class RubbingEvent(Event):
    """A pair sticks, slips or reverses: of a joint, or of a load that resists.

    Where several do so in one instant ``group`` names them all, with ``signs`` in its order.
    """

    sign: float
    joint: str | None = None
    load: str | None = None
    group: Sequence[str] | None = None
    signs: Sequence[float] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class SingularPose(Event):
    """The constraints of a motion lose rank."""

    rank_drop: int


CLASSES = (ChangePoint, GroupEvent, Stationary, PointCusp, ValueEvent, RubbingEvent, SingularPose)

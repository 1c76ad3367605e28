"""What happens along a sweep or a motion: a class for each sort of event, with the JSON's keys."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, fields
from typing import TYPE_CHECKING, Any

from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json


@dataclass(frozen=True, eq=False, kw_only=True)
class Event(Mapping[str, Any]):
    """Something that happens at a place of the way; its keys are those of the JSON.

    What does not apply is None and no key.

    Attributes
    ----------
    at
        The value of the driver, of several drivers the list of them; the time of a motion [s].
    in_range
        Whether it is within the task's poses.
    time
        Where drivers follow laws, and of motions [s].
    code
        Of what a motion says about itself, by the table in docs/motion.md.
    """

    kind: str
    at: float | list[float]
    in_range: bool
    time: float | None = None
    code: str | None = None
    entries: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def to_dict(self) -> Json:
        """Return the entry of the JSON."""
        return dict(self.entries)

    def __getitem__(self, name: str) -> Any:
        return self.entries[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)


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

    ``excluded`` tells that the other one does not meet superfluous equations.
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


def events_of(entries: Iterable[Mapping[str, Any]]) -> tuple[Event, ...]:
    """Return the events of entries of the JSON; what is an event already stays as it is."""
    return tuple(event if isinstance(event, Event) else _event(event) for event in entries)


def motion_event(kind: str, t: float, **parts: Any) -> Event:
    """Return an event of a motion, of the class that its parts tell."""
    return _event({"kind": kind, "at": t, "time": t, "in_range": True, **parts})


def _event(entry: Mapping[str, Any]) -> Event:
    """Return an event of the first class all of whose parts are there."""
    for kind in (*CLASSES, Event):
        parts = [entry_field for entry_field in fields(kind) if entry_field.name != "entries"]
        needed = [part.name for part in parts if part.default is not None]
        if all(name in entry for name in needed):
            known = {part.name: entry[part.name] for part in parts if part.name in entry}
            return kind(**known, entries=entry)
    raise KeyError(f"no kind, place or range in {sorted(entry)}")

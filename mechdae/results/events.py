"""What happens along a sweep or a motion: events with the keys of the JSON."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, fields
from importlib import import_module
from typing import TYPE_CHECKING, Any

from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json

KINDS = "mechdae.results.event_kinds"
"""It knows events: what only some of them have."""


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
        Of what a motion says about itself, by the table in docs/reference/motion.md.
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


def events_of(entries: Iterable[Mapping[str, Any]]) -> tuple[Event, ...]:
    """Return the events of entries of the JSON; what is an event already stays as it is."""
    return tuple(event if isinstance(event, Event) else _event(event) for event in entries)


def motion_event(kind: str, t: float, **parts: object) -> Event:
    """Return an event of a motion, of the class that its parts tell."""
    return _event({"kind": kind, "at": t, "time": t, "in_range": True, **parts})


def _event(entry: Mapping[str, object]) -> Event:
    """Return an event of the first class all of whose parts are there."""
    for kind in (*import_module(KINDS).CLASSES, Event):
        parts = [entry_field for entry_field in fields(kind) if entry_field.name != "entries"]
        needed = [part.name for part in parts if part.default is not None]
        if all(name in entry for name in needed):
            known = {part.name: entry[part.name] for part in parts if part.name in entry}
            event: Event = kind(**known, entries=entry)
            return event
    raise KeyError(f"no kind, place or range in {sorted(entry)}")

"""Events have a class with named parts, and the keys of the JSON."""

from __future__ import annotations

import pytest

import mechdae as md
from mechdae.results import Event, events_of
from mechdae.results.event_kinds import (
    CLASSES,
    ChangePoint,
    GroupEvent,
    PointCusp,
    RubbingEvent,
    ValueEvent,
)

GROUP = {"kind": "limit", "at": 1.0, "group": ["rod"], "joint": "A", "name": "I", "in_range": True}


def test_what_happens_has_named_parts() -> None:
    for event in md.solve("four-bar-double-rocker", "window").events:
        assert type(event) is GroupEvent
        assert event.kind == event["kind"] == "limit"
        assert event.to_dict() == dict(event) == event
        assert event.gap is None
        assert "gap" not in event
        assert event.get("time") is event.time is None


@pytest.mark.parametrize(
    ("entry", "kind"),
    [
        (GROUP, GroupEvent),
        (GROUP | {"action": "stop", "tangents": {}, "exact": True, "gap": 0.0}, ChangePoint),
        ({"kind": "cusp", "point": "p", "at": 1, "position": [0, 0], "in_range": True}, PointCusp),
        (
            {"kind": "slip", "at": 1, "time": 1, "load": "f", "sign": 1, "in_range": True},
            RubbingEvent,
        ),
        ({"kind": "impact", "code": "S9", "at": 1, "time": 1, "in_range": True}, Event),
    ],
)
def test_entries_become_events(entry: dict, kind: type) -> None:
    (event,) = events_of([entry])
    assert type(event) is kind
    assert event == entry
    assert list(event) == list(entry)
    assert events_of([event])[0] is event


def test_every_class_can_be_told() -> None:
    assert ValueEvent in CLASSES
    with pytest.raises(KeyError):
        events_of([{"kind": "limit"}])

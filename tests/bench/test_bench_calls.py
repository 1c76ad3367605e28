"""The measurement of whole calls: what is recorded, never seconds."""

from __future__ import annotations

from benchmarks import calls


def test_calls_are_recorded_and_tabled(monkeypatch) -> None:
    monkeypatch.setattr(calls, "CALLS", (("four-bar-crank-rocker", "turn", 7, "b"),))
    records = calls.measure(repeats=1)
    assert [record["way"] for record in records] == ["again", "warm"]
    for record in records:
        assert {"work", "n", "ratio", "yardstick", "seconds", "first"} <= set(record)
    assert "| four-bar-crank-rocker turn | 7 |" in calls.table(records)

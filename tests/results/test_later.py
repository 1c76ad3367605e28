"""Nothing is computed that is not read; what is read later is what was computed at once."""

from __future__ import annotations

import pickle
import pkgutil
import threading
from typing import Any

import pytest

import mechdae as md
from mechdae.results import LazyPart, Series, Summary

OPEN = {
    "mechdae.motion.kinematics.extremes.Spans._found": ("four-bar-crank-rocker", "turn", "swing"),
    "mechdae.forces.task.critical_factor": ("slider-crank-friction", "cycle", "critical_factor"),
    "mechdae.dynamics.unique.unique": ("four-bar-motor", "motion", "multipliers"),
}
"""What is computed later, a task that has it, and the entry of the summary that asks for it."""


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> list[str]:
    """Return the calls of the function a test is about, filled as they come."""
    real, seen = pkgutil.resolve_name(request.param), []

    def counted(*args: Any) -> Any:
        seen.append(request.param)
        return real(*args)

    monkeypatch.setattr(request.param, counted)
    return seen


@pytest.mark.parametrize(("calls", "place"), OPEN.items(), indirect=["calls"])
def test_it_is_computed_when_it_is_read_and_once(calls: list[str], place: Any) -> None:
    problem, task, entry = place
    assert task in md.load(problem).tasks
    result = md.solve(problem, task)
    body = next(iter(result.bodies))
    assert result.bodies[body].angle.size
    assert result.value(f"bodies/{body}/angle")
    assert result.value("summary/status")
    assert not calls
    found = result.summary[entry]
    assert len(calls) == 1
    assert result.value(f"summary/{entry}") == result.to_dict()["summary"][entry]
    assert result.summary[entry] is found
    assert len(calls) == 1


def test_reactions_of_a_motion_ask_for_what_is_unique() -> None:
    result = md.solve("four-bar-motor", "motion")
    joint = next(iter(result.joints))
    assert isinstance(result.joints[joint].open()["reaction"], LazyPart)
    assert result.joints[joint].reaction.shape == (len(result), 3)
    assert result.joints[joint].reaction is result.joints[joint]["reaction"]


def test_a_result_is_whole_before_it_is_packed() -> None:
    result = md.solve("four-bar-crank-rocker", "turn", poses=5)
    copy = pickle.loads(pickle.dumps(result))
    assert copy.to_dict() == result.to_dict()
    assert not any(isinstance(value, LazyPart) for value in dict.values(copy.summary))
    assert pickle.loads(pickle.dumps(LazyPart(lambda: {"a": 1}))).parts() == {"a": 1}


def test_two_threads_get_the_same() -> None:
    started, go, count = threading.Barrier(4), threading.Event(), []

    def compute() -> dict[str, Any]:
        count.append(1)
        assert go.wait(5)
        return {"a": [1.0], "c": 3}

    later = LazyPart(compute)
    summary, found = Summary(a=later, b=2, gone=later), []

    def read() -> None:
        started.wait(5)
        found.append(summary["a"])

    threads = [threading.Thread(target=read) for _ in range(3)]
    for thread in threads:
        thread.start()
    started.wait(5)
    go.set()
    for thread in threads:
        thread.join(5)
    assert len(count) == 1
    assert len({id(own) for own in found}) == 1
    assert dict(summary) == {"a": [1.0], "b": 2}


def test_a_summary_is_a_dictionary() -> None:
    later = LazyPart(lambda: {"swing": {"rod": 1.0}})
    summary = Summary(poses=3, swing=later, stroke=later, mode="+")
    assert summary.names() == ["poses", "swing", "stroke", "mode"]
    assert "poses" in summary
    assert summary.get("mode") == "+"
    assert isinstance(dict.get(summary, "swing"), LazyPart)
    part = summary.only(["swing"])
    assert isinstance(dict.get(part, "swing"), LazyPart)
    assert "stroke" not in summary
    assert summary.get("stroke", {}) == {}
    assert list(summary) == ["poses", "swing", "mode"]
    assert {**summary} == summary.copy() == dict(summary.items())
    assert summary | {"more": 1} == {**summary, "more": 1}
    with pytest.raises(KeyError):
        summary["stroke"]


def test_an_array_is_computed_when_it_is_read() -> None:
    series = Series({"angle": [1.0], "reaction": LazyPart(lambda: {"reaction": [2.0]})})
    assert list(series) == ["angle", "reaction"]
    assert isinstance(series.open()["reaction"], LazyPart)
    assert series.reaction.tolist() == [2.0]
    assert not series.reaction.flags.writeable

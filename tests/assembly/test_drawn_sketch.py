"""Sketches that are a pose but for rounding: assembled without a search, on the same mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.assembly.group_search import GroupSearch
from mechdae.motion.assembly.multistart import BlockSearch
from mechdae.motion.continuation.path import WINDOW, WINDOWS, Tries


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of unknowns of each block that is searched from many starts."""
    found: list[int] = []
    search = BlockSearch.__call__

    def counted(self: BlockSearch, *given, **more):
        found.append(self.n)
        return search(self, *given, **more)

    monkeypatch.setattr(BlockSearch, "__call__", counted)
    return found


def ring(off: float = 0.0) -> tuple[md.Mechanism, str, float]:
    """The ring of seven hinges with all of its angles sketched, each `off` from a pose of it."""
    problem = md.load("seven-r")
    name = next(n for n, task in problem.tasks.items() if task.kind == "sweep")
    driver = problem.tasks[name].all_drivers[0].coordinate
    result = md.solve(problem, name, poses=3)
    at = {f"{joint}.angle": float(series.angle[1]) for joint, series in result.joints.items()}
    sketch = {name: value + off * (name != driver) for name, value in at.items()}
    return replace(problem.mechanism, sketch=sketch), driver, at[driver]


def placed(mechanism: md.Mechanism, driver: str, at: float) -> md.Result:
    return md.solve(mechanism, md.Sweep(driver=md.Driver(driver, at=[at]), derivatives=0))


def test_a_pose_is_not_searched_for(searches, monkeypatch: pytest.MonkeyPatch) -> None:
    mechanism, driver, at = ring()
    searches.clear()
    result = placed(mechanism, driver, at)
    assert list(result.status) == ["ok"]
    assert not searches
    for name, value in mechanism.sketch.items():
        assert result.joints[name.split(".")[0]].angle[0] == pytest.approx(float(value), abs=1e-9)
    label = result.summary["mode"]  # its rank among all modes
    assert searches
    monkeypatch.setattr(GroupSearch, "drawn", lambda *given: None)
    searches.clear()
    whole = placed(mechanism, driver, at)
    assert searches
    assert whole.summary["mode"] == label
    for name, series in result.joints.items():
        np.testing.assert_allclose(series.angle, whole.joints[name].angle, atol=1e-12)


def test_a_rough_sketch_is_compared_with_all_modes(searches) -> None:
    mechanism, driver, at = ring(off=0.02)
    searches.clear()
    assert list(placed(mechanism, driver, at).status) == ["ok"]
    assert searches


def test_steps_that_lead_nowhere_are_given_up() -> None:
    """Steps of one size; and those that halve in 1000 and grow again, as at a narrow place."""
    even, narrow = Tries(), Tries()
    s = t = 0.0
    for k in range(WINDOWS * WINDOW):
        assert not even.hopeless
        s, t = s + 1e-7, t + 1e-7 * 2.0 ** abs(k / 1000 - 2.5)
        even.labour(s, 1.0 - s)
        narrow.labour(t, 1.0 - t)
        assert not narrow.hopeless
    assert even.hopeless

"""The curves of all predefined problems, against ones of 50 times as many poses."""

from __future__ import annotations

import pytest

import mechdae as md
from mechdae.describe.file import library
from mechdae.draw.catalogue import kind_and_task
from tests.shared.finer_curves import HALF, farthest


@pytest.mark.parametrize("problem", library.names())
def test_curves_are_within_half_a_pixel(problem: str) -> None:
    """Those of a few named poses are dots; a problem of designs alone has none."""
    whole = md.load(problem)
    _, name = kind_and_task(whole.tasks, "curves", None, {}, problem)
    task = whole.tasks[name]
    if "designs" in task.holds:
        assert all("poses" not in known.holds for known in whole.tasks.values())
        return
    if task.way >= 2:
        assert farthest(problem) < HALF
        return
    figure = md.plot(md.solve(whole, name), "curves").get_figure(root=True)
    lines = [line for panel in figure.axes for line in panel.lines]
    curves = [line for line in lines if str(line.get_gid()).startswith("curve-")]
    assert curves
    assert {line.get_linestyle() for line in curves} == {"None"}

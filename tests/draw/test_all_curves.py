"""The curves of all predefined problems, against ones of 50 times as many poses."""

from __future__ import annotations

import pytest

import mechdae as md
from mechdae.describe.file import library
from mechdae.draw.choice import kind_and_task
from tests.shared.finer_curves import HALF, farthest


@pytest.mark.parametrize("problem", library.names())
def test_curves_are_within_half_a_pixel(problem: str) -> None:
    whole = md.load(problem)
    _, name = kind_and_task(whole.tasks, "curves", None, {}, problem)
    if whole.tasks[name].way < 2:
        pytest.skip("a few named poses, or none: dots")
    assert farthest(problem) < HALF

"""What a page draws of a pose is what `plot` draws: the same primitives, places and names."""

from __future__ import annotations

import pytest

from tests.shared.browser import CHROMIUM
from tests.shared.page_shapes import Pages, compare_names, compare_primitives

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

CASES = [  # all others are compared by `test_all_pages.py`
    ("four-bar-crank-rocker", "turn"),
    ("cam-roller-follower", "turn"),
    ("planetary-gear-train", "turn"),
]


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    return Pages(tmp_path_factory.mktemp("pages"), CASES)


@pytest.mark.parametrize("name", [name for name, _ in CASES])
def test_primitives_are_those_of_plot(name, opened, pages):
    compare_primitives(opened, pages, name)


@pytest.mark.parametrize("name", [name for name, _ in CASES])
def test_names_are_those_of_plot(name, opened, pages):
    compare_names(opened, pages, name)

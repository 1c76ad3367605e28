"""What pages draw of predefined mechanisms of the plane is what `plot` draws, in three poses."""

from __future__ import annotations

import pytest

from mechdae.describe.file.library import names
from tests.shared.browser import CHROMIUM
from tests.shared.page_shapes import Pages, compare_names, compare_primitives
from tests.shared.predefined import predefined

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

KINDS = ("sweep", "reactions")
EXCEPT = {"vector-modules-planar": "its driven task asks for no point: there is nothing to draw"}
"""What is left out, and why."""


def flat_with_a_driver() -> list[tuple[str, None]]:
    """Return the problems of the plane with a task that is driven; pages choose which."""
    found = []
    for name in names():
        problem = predefined(name)
        tasks = [key for key, task in problem.tasks.items() if task.kind in KINDS]
        if problem.mechanism.dimension == 2 and tasks and name not in EXCEPT:
            found.append((name, None))
    return found


CASES = flat_with_a_driver()


def test_there_are_many():
    """With those of `test_space_drawing.py` more than sixty."""
    assert len(CASES) >= 60


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    return Pages(tmp_path_factory.mktemp("pages"), CASES)


@pytest.mark.parametrize("name", [name for name, _ in CASES])
def test_primitives_and_names_are_those_of_plot(name, opened, pages):
    compare_primitives(opened, pages, name)
    compare_names(opened, pages, name)

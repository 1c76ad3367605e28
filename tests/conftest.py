"""Where imports of the tests are looked for: the project's folder and its documentation."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
os.environ.setdefault("MECHDAE_CACHE", "0")  # planted mistakes must not meet kernels on disk
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]
HEAVIEST = (
    "synthesis/test_synthesis.py", "house/test_docs.py", "attack/test_random_mechanisms.py",
    "continuation/test_hard_cases.py", "draw/test_graphs.py", "house/test_articles.py",
    "dynamics/test_motion_reactions.py", "jobs/test_jobs.py", "forces/test_static_friction.py",
    "continuation/test_touching.py", "forces/test_reactions_hard.py", "jobs/test_jobs_cluster.py",
    "measures/test_measure_errors.py", "attack/test_tracebacks.py", "dynamics/test_motion.py",
    "forces/test_reactions_audit.py", "studies/test_statics_paths.py", "draw/test_plans.py",
    "attack/test_refusals.py", "attack/test_slips.py", "draw/test_draw_synthesis.py",
    "synthesis/test_slider_dyads.py", "synthesis/test_starts.py", "synthesis/test_front_ends.py",
    "tasks/test_small_mechanisms.py",
)  # fmt: skip
"""Files of more than ten seconds, given to workers first: the last ones to end are short."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    order = {ROOT / "tests" / name: k for k, name in enumerate(HEAVIEST)}
    items.sort(key=lambda item: order.get(item.path, len(order)))


STRUCTURES = 160
"""Those that the tests of a process keep built, whatever their size."""


@pytest.fixture(scope="session", autouse=True)
def kept() -> None:
    """Keep more structures than a user's process does: the same problems are solved again."""
    from mechdae.motion.kinematics import prepared

    prepared.SHAPES.most, prepared.SHAPES.size_of = STRUCTURES, lambda shape: 1


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the project's folder."""
    return ROOT


class Planting(pytest.MonkeyPatch):
    """pytest's own; what the package builds of something changed is neither found nor kept."""

    fresh = False

    def setattr(self, *given: Any, **keys: Any) -> None:
        self._forget()
        super().setattr(*given, **keys)

    def setitem(self, *given: Any, **keys: Any) -> None:
        self._forget()
        super().setitem(*given, **keys)

    def _forget(self) -> None:
        """Let nothing that was built before be found until this is undone."""
        if not self.fresh:
            from mechdae.motion.kinematics import prepared

            self.fresh = True
            empty = type(prepared.SHAPES)(prepared.SHAPES.size_of)
            super().setattr(prepared, "SHAPES", empty)


@pytest.fixture
def monkeypatch() -> Iterator[pytest.MonkeyPatch]:
    patch = Planting()
    yield patch
    patch.undo()

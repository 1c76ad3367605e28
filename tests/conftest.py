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

from tests.shared.slow import reason  # noqa: E402  (found by the line above)

TESTS = ROOT / "tests"


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "slow: left out by pytest alone, see tests/shared/slow.py")
    if not hasattr(config, "workerinput"):  # workers have the arguments of the first process
        named = config.args_source is pytest.Config.ArgsSource.ARGS
        named = named or bool(config.option.markexpr or config.option.keyword)
        os.environ["MECHDAE_TESTS"] = "named" if named else "default"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark slow tests; leave them out where neither a mark nor a file was asked for."""
    for item in items:
        why = reason(item.path, TESTS)
        if why:
            item.add_marker(pytest.mark.slow(reason=why))
    if os.environ["MECHDAE_TESTS"] == "default":
        left = [item for item in items if item.get_closest_marker("slow")]
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("slow")]


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
            from mechdae import additions
            from mechdae.motion.kinematics import prepared

            self.fresh = True
            empty = type(prepared.SHAPES)(prepared.SHAPES.size_of)
            super().setattr(prepared, "SHAPES", empty)
            additions._answers.cache_clear()  # what cases answer with may be what is changed

    def undo(self) -> None:
        from mechdae import additions

        super().undo()
        additions._answers.cache_clear()


@pytest.fixture
def monkeypatch() -> Iterator[pytest.MonkeyPatch]:
    patch = Planting()
    yield patch
    patch.undo()

"""Where imports of the tests are looked for: the project's folder and its documentation."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the project's folder."""
    return ROOT


@pytest.fixture
def monkeypatch(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Return pytest's own; what is changed is built anew, and nothing of it is kept."""
    from mechdae.kinematics import prepared

    monkeypatch.setattr(prepared, "SHAPES", type(prepared.SHAPES)(prepared.SHAPES.size_of))
    return monkeypatch

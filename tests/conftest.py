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

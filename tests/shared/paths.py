"""Folders that tests and scripts read."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
DOCS = ROOT / "docs"
FIGURES = DOCS / "data"
PROBLEMS = ROOT / "problems"

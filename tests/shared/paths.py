"""Folders that tests and scripts read."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
DOCS = ROOT / "docs"
FIGURES = DOCS / "data"
PROBLEMS = ROOT / "problems"
HISTORY = DOCS / "history"


def document_pages() -> list[Path]:
    """Return the pages of the documentation, in all of its folders but the history."""
    pages = (page for page in DOCS.glob("**/*.md") if page.parent != HISTORY)
    return sorted(page for page in pages if "website" not in page.relative_to(DOCS).parts)

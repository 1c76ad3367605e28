"""Tests that ``pytest`` leaves out unless they are named: each with what makes it slow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

SLOW: Mapping[str, str] = {
    "attack/": "random and mutated mechanisms, planted slips",
    "house/test_docs.py": "runs what the documents show",
}
"""Folder, file or test below ``tests/`` -> why; a folder ends in a slash."""


def reason(path: Path, name: str, tests: Path) -> str:
    """Return why a test is slow, "" for others."""
    file = path.relative_to(tests).as_posix()
    folder = file.rpartition("/")[0] + "/"
    return SLOW.get(f"{file}::{name}") or SLOW.get(file) or SLOW.get(folder) or ""

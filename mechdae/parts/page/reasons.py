"""Why a page plays recorded poses, or shows no forces, in the languages of pages."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path


@cache
def _reasons() -> dict[str, dict[str, str]]:
    """Return the sentences by language, then by what they are about."""
    path = Path(__file__).with_suffix(".toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))


def said(key: str, lang: str, **facts: object) -> str:
    """Return a sentence in a language, "" without a key."""
    return _reasons()["ru" if lang == "ru" else "en"][key].format(**facts) if key else ""

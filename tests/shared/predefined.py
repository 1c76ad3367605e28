"""The predefined problems, each read once: they are frozen, and tests are chosen by them."""

from __future__ import annotations

from functools import cache

import mechdae as md


@cache
def predefined(name: str) -> md.Problem:
    """Return a predefined problem."""
    return md.load(name)

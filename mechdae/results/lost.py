"""Why poses have no values, as what results hold of it and as the rest of a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Any


class Cause(StrEnum):
    """What keeps a pose from having values: told apart, for statuses do not."""

    OPEN = "open"
    RANK = "rank"
    CERTIFICATE = "certificate"


def why_lost(entry: Mapping[str, Any]) -> str:
    """Return what an entry of `failed` says of its group: how it is there."""
    cause, least = entry.get("cause", Cause.OPEN), entry.get("least_singular_value")
    if cause == Cause.RANK:
        return f"loses rank there (least singular value {least:.2g} of the largest)"
    if cause == Cause.CERTIFICATE:
        return (
            f"assembles there and keeps its rank (least singular value {least:.2g} of the "
            "largest), but no certificate holds"
        )
    return f"opens at joint {entry['joint']}"

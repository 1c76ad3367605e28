"""What measures put into a result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Floats


OF_POSES = {
    "instant-centres",
    "axodes",
    "screw-axes",
    "velocity-ratio",
    "mechanical-advantage",
}
"""Measures of single poses, which look at nothing between them."""


@dataclass
class Measured:
    """Series by kind, part and name; pairs of bodies; entries of the summary; events."""

    series: dict[str, dict[str, dict[str, Any]]] = field(default_factory=dict)
    centres: dict[str, Any] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    events: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def put(self, kind: str, parts: Mapping[str, dict[str, Floats]]) -> None:
        for part, arrays in parts.items():
            self.series.setdefault(kind, {}).setdefault(part, {}).update(arrays)

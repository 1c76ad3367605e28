"""A spatial vector as the pair of the points at its tail and its head."""

from __future__ import annotations

from typing import ClassVar

from mechdae.describe.joints.spatial import SpatialJoint
from mechdae.describe.values import Number, key
from mechdae.records import dataclass

WORDS = ("length", "elevation", "azimuth")


@dataclass(frozen=True)
class Pointer(SpatialJoint):
    """Head less tail is a vector by length, elevation and azimuth in the fixed frame.

    What is absent is a coordinate. Its bodies are points: they do not turn.
    """

    length: Number | None = key("number", None, unit="m")
    elevation: Number | None = key("number", None, unit="rad")
    azimuth: Number | None = key("number", None, unit="rad")
    friction: Number | None = key("number", None, doc="where its length alone is unknown", unit="1")
    friction_static: Number | None = key("number", None, unit="1")

    kind: ClassVar[str] = "vector"
    pointer: ClassVar[bool] = True
    smoothed: ClassVar[bool] = True

    @property
    def coordinates(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(word for word in WORDS if getattr(self, word) is None)

    def friction_law(self, article: bool) -> str:
        return "f |F across|"

    @property
    def freedoms(self) -> int:  # type: ignore[override]
        return len(self.coordinates)

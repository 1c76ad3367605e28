"""How a pose is written as a sketch."""

from __future__ import annotations

from typing import Any


def sketch_line(name: str, value: Any) -> str:
    """Return a line of a sketch: a coordinate, or the place of a point."""
    if isinstance(value, list):
        return f'"{name}" = [{", ".join(f"{part + 0.0:.5g}" for part in value)}]'
    return f"{name} = {value + 0.0:g}"

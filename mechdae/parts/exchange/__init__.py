"""Other programs' formats: simulators, drawings, kernels in C and JavaScript; back and forth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.additions import lazy_names

if TYPE_CHECKING:
    from mechdae.parts.exchange.formats import Exported, export, read_drawing

__all__ = ["Exported", "export", "read_drawing"]
__getattr__ = lazy_names(
    {
        "mechdae.parts.exchange.formats": "Exported export read_drawing",
    }
)

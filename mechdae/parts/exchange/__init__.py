"""Other programs' formats: simulators, drawings, kernels in C and JavaScript; to and fro."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.additions import lazy_names

if TYPE_CHECKING:
    from mechdae.parts.exchange.formats import Exported, exported
    from mechdae.parts.exchange.sources import imported

__all__ = ["Exported", "exported", "imported"]
__getattr__ = lazy_names(
    {
        "mechdae.parts.exchange.formats": "Exported exported",
        "mechdae.parts.exchange.sources": "imported",
    }
)

"""Other programs' formats: simulators, drawings, kernels in C and JavaScript; to and fro."""

from __future__ import annotations

from mechdae.exchange.formats import Exported, exported
from mechdae.exchange.sources import imported

__all__ = ["Exported", "exported", "imported"]

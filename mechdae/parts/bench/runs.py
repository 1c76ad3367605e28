"""What every measured row shares: the run it belongs to, and the yardstick, a four-bar in NumPy."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae import __version__
from mechdae.describe import whole_file
from mechdae.kernels.machine.library import backend
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.types import Json

CRANK, COUPLER, ROCKER, GROUND = 0.048, 0.09, 0.08, 0.1
STAMP = ("run", "date", "version", "back_end", "load")
"""What is added to each row, see `BenchRun`."""


def yardstick(t2: Floats) -> tuple[Floats, ...]:
    """Return coupler and rocker angle, their first and second derivatives, each (n,)."""
    a, b, c, d = CRANK, COUPLER, ROCKER, GROUND
    ax, ay = a * np.cos(t2), a * np.sin(t2)
    dx, dy = d - ax, -ay
    e2 = dx * dx + dy * dy
    e = np.sqrt(e2)
    t3 = np.arctan2(dy, dx) + np.arccos((e2 + b * b - c * c) / (2 * b * e))
    t4 = np.arctan2(ay + b * np.sin(t3), ax + b * np.cos(t3) - d)
    s, k = np.sin(t4 - t3), np.cos(t4 - t3)
    v3, v4 = a * np.sin(t2 - t4) / (b * np.sin(t4 - t3)), a * np.sin(t2 - t3) / (c * s)
    a3 = (a * np.cos(t2 - t4) + b * v3 * v3 * k - c * v4 * v4) / (b * s)
    a4 = (a * np.cos(t2 - t3) + b * v3 * v3 - c * v4 * v4 * k) / (c * s)
    return t3, t4, v3, v4, a3, a4


class BenchRun:
    """Rows of one run, written as they come: what a run has measured counts when it is broken off.

    Each row gets ``run``, the same text for all rows of a run and for no other; ``date`` (UTC) and
    ``load``, when it was measured and the mean number of processes that wanted a processor then
    (of the last minute; None where the system does not tell); ``version`` of mechdae and
    ``back_end``.
    """

    def __init__(self, path: Path | None = None) -> None:
        begun = datetime.now(UTC)
        self.path, self.records = path, list[dict[str, Any]]()
        self.name: str = f"{begun:%Y-%m-%dT%H:%M:%SZ}-{os.getpid()}"

    def add(self, records: Iterable[Json]) -> list[Json]:
        """Return rows just measured with what tells their run; they are written with the others."""
        stamp = {
            "run": self.name,
            "date": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
            "version": __version__,
            "back_end": backend(),
            "load": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None,
        }
        stamped = [{**record, **stamp} for record in records]
        self.records += stamped
        if self.path is not None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(self.path) as part:
                part.write((json.dumps(self.records, indent=1) + "\n").encode())
        return stamped

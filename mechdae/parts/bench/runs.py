"""The run that measured rows belong to: when, with what, beside how much other work."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae import __version__
from mechdae.describe import whole_file
from mechdae.kernels.machine.library import backend

if TYPE_CHECKING:
    from mechdae.types import Json


STAMP = ("run", "date", "version", "back_end", "load")
"""What is added to each row, see `BenchRun`."""


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
        self.name = f"{begun:%Y-%m-%dT%H:%M:%SZ}-{os.getpid()}"

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

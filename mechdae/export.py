"""Results to files: JSON, CSV with units in the headers, NPZ; each written whole or not."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.results import Result, plain

LINEAR = ("A", "B", "C", "D", "states", "inputs", "outputs")
"""What an NPZ has of a linear system."""


def document(results: Sequence[Result]) -> dict[str, Any]:
    """Return the JSON document of the tasks of one problem."""
    return {
        "mechdae": __version__,
        "problem": results[0].problem if results else "",
        "tasks": {result.task: result.to_dict() for result in results},
    }


def json_text(results: Sequence[Result], indent: int | None = None) -> str:
    """Return the JSON text; floats with the digits that give the same float back."""
    return json.dumps(document(results), indent=indent, allow_nan=False, ensure_ascii=False)


def csv_text(result: Result) -> str:
    """Return a table of all scalar series, one row per pose, units in the header."""
    columns = list(result.columns())
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    labels = result.labels or ()
    head = ["status"] + (["mode"] if labels else [])
    writer.writerow(head + [f"{name} [{unit}]" if unit else name for name, unit, _ in columns])
    first = [plain(np.asarray(result.status, dtype=str))]
    first += [[",".join(row) for row in labels]] if labels else []
    numbers = [plain(np.asarray(array, float)) for _, _, array in columns]
    writer.writerows(zip(*first, *numbers, strict=True))
    return out.getvalue()


def save(result: Result, folder: str | Path) -> list[Path]:
    """Write ``<task>.json``, ``<task>.csv`` and ``<task>.npz`` into `folder`.

    Of a synthesis also each design as a problem file, ``<task>-1.toml`` and so on.
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    packed = io.BytesIO()
    arrays = {name: array for name, _, array in result.columns()}
    linear = result.data.get("linear", {})
    arrays |= {f"linear.{key}": np.array(own) for key, own in linear.items() if key in LINEAR}
    np.savez(packed, status=np.asarray(result.status, dtype=str), **arrays)
    contents = {
        ".json": json_text([result], indent=1).encode(),
        ".csv": csv_text(result).encode(),
        ".npz": packed.getvalue(),
    }
    for rank, design in enumerate(result.data.get("designs", ()), 1):
        contents[f"-{rank}.toml"] = design["problem"].encode()
    written = []
    for suffix, content in contents.items():
        path = place / f"{result.task}{suffix}"
        partial = path.with_name(path.name + ".part")
        partial.write_bytes(content)
        partial.replace(path)
        written.append(path)
    return written

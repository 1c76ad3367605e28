"""Results to files: JSON, CSV with units in the headers, NPZ; each written whole or not."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.results import Result, heads, plain, shown_columns
from mechdae.types import Json

LINEAR = ("A", "B", "C", "D", "states", "inputs", "outputs")
"""What an NPZ has of a linear system."""
AT_ONCE = 1_000_000
"""Numbers of a table that are turned into text at once."""


def document(results: Sequence[Result]) -> Json:
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
    """Return a table of all scalar series, one row per pose, in the units of its header."""
    return "".join(_csv_pieces(result))


def _csv_pieces(result: Result) -> Iterator[str]:
    """Yield the text of the table, a few rows at a time."""
    columns = shown_columns(result)
    labels = result.labels or ()
    head = ["status"] + (["mode"] if labels else [])
    yield _lines([head + heads(columns)])
    step = max(1, AT_ONCE // (len(columns) + 1))
    status = np.asarray(result.status, dtype=str)
    for start in range(0, len(status), step):
        some = slice(start, start + step)
        first = [plain(status[some])]
        first += [[",".join(row) for row in labels[some]]] if labels else []
        numbers = [plain(np.asarray(array[some], float)) for _, _, array in columns]
        yield _lines(zip(*first, *numbers, strict=True))


def _lines(rows: Iterable[Sequence[str]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def _json_pieces(result: Result) -> Iterator[str]:
    """Yield the JSON text of one task; that of a large table row by row."""
    if sum(np.size(array) for array in result.table.values()) <= AT_ONCE:
        yield json_text([result], indent=1)
        return
    small = document([result.as_kind(type(result), table={})])
    words = {path: f"table {k} of {id(result)}" for k, path in enumerate(result.table)}
    small["tasks"][result.task]["table"] = words
    text = json.dumps(small, indent=1, allow_nan=False, ensure_ascii=False)
    for path, word in words.items():
        before, text = text.split(json.dumps(word), 1)
        yield before + "["
        array = result.table[path]
        step = max(1, AT_ONCE // max(1, int(np.prod(array.shape[1:]))))
        for start in range(0, len(array), step):
            rows = json.dumps(plain(np.asarray(array[start : start + step])), allow_nan=False)
            yield (",\n" if start else "") + rows[1:-1]
        yield "]"
    yield text


def _arrays(result: Result) -> dict[str, Any]:
    """Return what an NPZ holds."""
    arrays = {name: array for name, _, array in result.columns()}
    linear = result.data.get("linear", {})
    arrays |= {f"linear.{key}": np.array(value) for key, value in linear.items() if key in LINEAR}
    return {"status": np.asarray(result.status, dtype=str), **arrays}


def write_files(result: Result, place: Path) -> list[Path]:
    """Write JSON, CSV, NPZ and the problem files of designs into a folder that is there."""
    from mechdae.describe.file.atomic_write import whole_file  # only where files are written

    texts: dict[str, Iterable[str]] = {".json": _json_pieces(result), ".csv": _csv_pieces(result)}
    for rank, design in enumerate(result.data.get("designs", ()), 1):
        texts[f"-{rank}.toml"] = [design["problem"]]
    written = []
    for suffix, pieces in texts.items():
        with whole_file(place / f"{result.task}{suffix}") as file:
            for piece in pieces:
                file.write(piece.encode())
        written.append(place / f"{result.task}{suffix}")
    path = place / f"{result.task}.npz"
    with whole_file(path) as file:
        np.savez(file, **_arrays(result))
    return [*written[:2], path, *written[2:]]

"""Write what the runs in space have found into the page.

python -m tests.attack.spatial_page docs/theory/evidence/honesty.md
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from tests.attack import spatial_vectors
from tests.attack.honesty import page, rows
from tests.attack.spatial_poses import by_kind, totals

DATA = Path(__file__).parents[2] / "docs/data"
RUNS = {
    "spatial-poses": "250 sets a structure",
    "spatial-poses-many": "seed 2, 1000 sets",
    "spatial-poses-third": "seed 3, 1000 sets",
    "spatial-poses-wheels": "seed 4, 1000 sets, `--wheels`",
    "spatial-poses-fifth": "seed 5, 250 sets, after the mends below",
    "spatial-poses-sixth": "seed 6, 250 sets, `--wheels`, after the mends below",
}
"""Files of counts, and how their mechanisms were drawn."""
VECTORS = "spatial-vectors"
COUNTS = ("mechanisms", "ok", "tracked", "closed", "blurred")
TOLD = ["on the motion", "close", "blurred", "outside of their bound", "refused"]
HEAD = ["structures", "mechanisms", "poses `ok`"]


def runs() -> dict[str, list[dict[str, Any]]]:
    """Return the structures of each run with their counts."""
    return {
        name: json.loads((DATA / f"{name}.json").read_text("utf-8"))["structures"] for name in RUNS
    }


def vectors() -> list[dict[str, Any]]:
    """Return the structures of vector loops with their counts."""
    found: list[dict[str, Any]] = json.loads((DATA / f"{VECTORS}.json").read_text("utf-8"))[
        "structures"
    ]
    return found


def of_vectors(found: list[dict[str, Any]]) -> dict[str, str]:
    """Return the table of vector loops by its name."""
    head = ["holds", *HEAD, *TOLD]
    body = [
        [word, own["structures"], *(own[count] for count in COUNTS), _wrong(own), own["refused"]]
        for word, own in spatial_vectors.by_kind(found).items()
    ]
    return {"space vectors": rows(head, [*body, ["**all**", len(found), *_counts(found)]])}


def tables(found: dict[str, list[dict[str, Any]]]) -> dict[str, str]:
    """Return the tables of the page by name."""
    every = [own for run in found.values() for own in run]
    head = ["run", *HEAD, *TOLD]
    body = [
        [f"[{RUNS[name]}](../../data/{name}.json)", len(run), *_counts(run)]
        for name, run in found.items()
    ]
    kinds = [
        [word, own["structures"], own["mechanisms"], own["ok"], _wrong(own), own["refused"]]
        for word, own in by_kind(every).items()
    ]
    return {
        "space runs": rows(head, [*body, ["**all**", len(every), *_counts(every)]]),
        "space kinds": rows(["holds", *HEAD, "wrong", "refused"], kinds),
    }


def _counts(run: list[dict[str, Any]]) -> list[int]:
    own = totals(run)
    return [*(own[word] for word in COUNTS), _wrong(own), own["refused"]]


def _wrong(own: dict[str, int]) -> int:
    return own["wrong"] + own["turned wrong"]


def main() -> None:
    path = Path(sys.argv[1])
    path.write_text(page(path.read_text("utf-8"), tables(runs()) | of_vectors(vectors())), "utf-8")


if __name__ == "__main__":
    main()

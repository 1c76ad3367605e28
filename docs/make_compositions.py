"""Writes the table of ``compositions.md`` from ``docs/data/compositions.json``.

``python -m benchmarks.compositions --out docs/data/compositions.json`` measures it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
DATA = DOCS / "data" / "compositions.json"
PAGE = DOCS / "theory/evidence/compositions.md"
COLUMNS = (
    "curve", "distance, material: ours", "NSGA-II", "designs", "distance, points: ours", "NSGA-II",
    "designs", "least distance, ours", "NSGA-II", "open at 20 001 angles",
)  # fmt: skip
HEAD = f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}"


def table() -> str:
    """Return the table: hypervolumes of both fronts, and what the circles found."""
    rows = [_row(record) for record in json.loads(DATA.read_text(encoding="utf-8"))["records"]]
    return "\n".join([HEAD, *rows])


def _row(record: dict[str, Any]) -> str:
    material, points = record["material"], record["points"]
    designs = [own["circles"]["designs"] for own in (material, points)]
    gone = sum(own["circles"]["do_not_assemble"] for own in (material, points))
    least = [
        min(own["least_distance"][k] for own in (material, points) if own["least_distance"][k])
        for k in (0, 1)
    ]
    cells = [
        record["curve"], f"{material['ours']:.4g}", f"{material['nsga2']:.4g}", str(designs[0]),
        f"{points['ours']:.5g}", f"{points['nsga2']:.5g}", str(designs[1]),
        f"{least[0]:.3g}", f"{least[1]:.3g}", f"{gone} of {sum(designs)}",
    ]  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split("| curve | distance, material", 1)
    after = rest.split("\n\n", 1)[1]
    PAGE.write_text(f"{before}{table()}\n\n{after}", encoding="utf-8")


if __name__ == "__main__":
    main()

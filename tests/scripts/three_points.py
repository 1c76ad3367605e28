"""Modes of platforms on three legs against exact elimination.

`python -m tests.scripts.three_points --sets 30 --out docs/data/three-points.json`

Each set is drawn in fractions: circles and lines on which the platform's points are led by hinges,
guides and bars. The eliminant of the first point's place is formed in fractions, and its real roots
are isolated by balls (python-flint). A mode is missed where no pose has its first point at such a
root, false where a pose's first point is at none. A run that was stopped goes on.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from tests.shared.three_points import KINDS, MOST, DrawnPlatform

NEAR = 1e-8


def compared(drawn: DrawnPlatform) -> dict[str, Any]:
    """Return what the package and the elimination say of one platform."""
    began = time.process_time()
    found = md.solve(drawn.mechanism, drawn.task)
    seconds = time.process_time() - began
    ours = found.points["top.B0"].position if len(found.status) else np.zeros((0, 3))
    wanted, count = drawn.wanted()
    truth = np.array(wanted).reshape(-1, 3)
    gaps = np.abs(ours[:, None] - truth[None]).max(axis=2)
    return {
        "proven": bool(found.summary["proven"]),
        "modes": len(truth),
        "complex": count,
        "missed": int((gaps.min(axis=0, initial=9.0) > NEAR).sum()),
        "false": int((gaps.min(axis=1, initial=9.0) > NEAR).sum() + (len(ours) != len(truth))),
        "off": float(gaps.min(axis=0, initial=9.0).max(initial=0.0)),
        "seconds": seconds,
    }


def counted(kind: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of a kind."""
    return {
        "sets": len(rows),
        "proven": sum(row["proven"] for row in rows),
        "as_many_complex_as_said": sum(row["complex"] == MOST.get(kind, 16) for row in rows),
        "modes": [min(row["modes"] for row in rows), max(row["modes"] for row in rows)],
        "missed": sum(row["missed"] for row in rows),
        "false": sum(row["false"] for row in rows),
        "largest_off": max(row["off"] for row in rows),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=30)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    known: dict[str, Any] = {}
    if options.out.exists():
        known = json.loads(options.out.read_text(encoding="utf-8"))
    for number, kind in enumerate(KINDS):
        if known.get(kind, {}).get("sets") == options.sets:
            continue
        rng, rows = np.random.default_rng(100 + number), []
        while len(rows) < options.sets:
            rows.append(compared(DrawnPlatform(rng, kind)))
            known[kind] = counted(kind, rows)
            if len(rows) % 10 == 0 or len(rows) == options.sets:
                options.out.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
        print(kind, json.dumps(known[kind]), flush=True)


if __name__ == "__main__":
    main()

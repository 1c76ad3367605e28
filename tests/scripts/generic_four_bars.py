"""Computes what is shipped of generic four-bars: nine points, and five with both fixed pivots.

    python -m tests.scripts.generic_four_bars --folder FOLDER [--out docs/data/four-bars.json]

Each round trip is kept in FOLDER; a run that was broken off goes on there with the same answer.
Written are `mechdae/design/synthesis/exact/four_bars.npz` and the figures of the run.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

import numpy as np

from mechdae.design.synthesis.exact.complete import Known, generic, traced
from mechdae.design.synthesis.exact.conditions import PathConditions
from mechdae.design.synthesis.exact.four_bars import STORE, name_of, read
from mechdae.numerics.homotopy.boxes import apart, enclosed

CASES = ((9, ()), (5, ("pivot_x", "pivot_y", "other_x", "other_y")))


class Progress:
    """What is known of one case, on the disk."""

    def __init__(self, path: Path) -> None:
        self.path, self.seconds, self.sizes = path, 0.0, []
        self.since = time.process_time()

    def read(self) -> Known | None:
        if not self.path.exists():
            return None
        with np.load(self.path) as data:
            self.seconds, self.sizes = float(data["seconds"]), data["sizes"].tolist()
            trips, silent, work = (int(data[word]) for word in ("trips", "silent", "work"))
            return Known(data["p"], data["z"], trips, silent, work)

    def spent(self) -> float:
        now = time.process_time()
        self.seconds, self.since = self.seconds + now - self.since, now
        return self.seconds

    def tell(self, known: Known) -> None:
        self.sizes.append(len(known.z))
        part = self.path.with_suffix(".part.npz")
        np.savez(
            part, p=known.p, z=known.z, trips=known.trips, silent=known.silent, work=known.work,
            seconds=self.spent(), sizes=self.sizes,
        )  # fmt: skip
        os.replace(part, self.path)
        print(f"{self.path.stem}: {self.sizes[-1]} after {known.trips} trips", file=sys.stderr)


def run(count: int, given: tuple[str, ...], folder: Path) -> tuple[dict, dict]:
    """One case: what is stored, and the figures of it."""
    own = PathConditions(count, given)
    progress = Progress(folder / f"{name_of(count, given)}.npz")
    found = generic(own, known=progress.read(), tell=progress.tell)
    seconds = progress.spent()
    boxes = enclosed(own, found.p, own.variants(found.z) if own.cognate else found.z)
    without = traced(own, found.p, found.z[1:])
    facts = {
        "points": count, "given": list(given), "solutions": len(found.z), "basis": found.basis,
        "bent": found.bent, "bent_without_one": without.bent, "boxes": int(boxes.certain.sum()),
        "apart": apart(boxes), "widest": float((boxes.radius / (1 + abs(boxes.z))).max()),
        "trips": progress.sizes, "seconds_search_and_trace": round(seconds, 1),
        "seconds": round(progress.spent(), 1),
    }  # fmt: skip
    name = name_of(count, given)
    stored = {
        f"{name}/p": found.p.astype(np.complex64), f"{name}/z": found.z.astype(np.complex64),
        f"{name}/bent": np.array(found.bent),
    }  # fmt: skip
    return stored, facts


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, np.ndarray] = {}
    facts = []
    for count, given in CASES:
        own, figures = run(count, given, asked.folder)
        arrays |= own
        facts.append(figures)
    np.savez_compressed(STORE, **arrays)
    for count, given in CASES:
        assert read(PathConditions(count, given), STORE) is not None
    text = json.dumps({"cases": facts}, indent=1) + "\n"
    if asked.out is not None:
        asked.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()

"""Motions with stops beside closed forms: 200 drawn at random, a thousand elastic impacts.

`python -m tests.scripts.contacts --count 100 --out docs/data/contacts.json`.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared.bouncing import G, ball, hits, one_block, two_blocks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    figures: dict[str, dict[str, float]] = {}
    for name, case, seed in (("one block", one_block, 4), ("two blocks", two_blocks, 7)):
        draw = np.random.default_rng(seed)
        impacts, times, energies = zip(*[case(draw) for _ in range(options.count)], strict=True)
        figures[name] = {"motions": options.count, "impacts": sum(impacts), "time": max(times),
                         "energy": max(energies)}  # fmt: skip
    first = math.sqrt(2 / G)
    result = md.solve(from_dict(ball(1.0, 2000 * first, poses=2)), "m")
    times = np.array(hits(result))
    figures["elastic ball"] = {
        "motions": 1, "impacts": len(times),
        "time": float(np.abs(times / ((2 * np.arange(len(times)) + 1) * first) - 1).max()),
        "energy": float(abs(result.scalars["energy"][-1] / (2 * G) - 1)),
    }  # fmt: skip
    options.out.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

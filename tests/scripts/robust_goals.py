"""Robust goals beside a Monte Carlo of 100 000 closed forms.

``python -m tests.scripts.robust_goals --out docs/data/robust.json`` finds the designs of
`tests.shared.robust_cases` with one, four and sixteen times their tolerances, and draws each of
them 100 000 times with its tolerances (`tests.reference.deviated`). ``off`` is the robust value
that was reported by that of the samples, less one: sampling alone makes some 0.2 %, the rest is
what the first order leaves out.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import mechdae as md
from tests.reference.deviated import SAMPLES
from tests.shared.robust_cases import CASES, Case

FACTOR = 3.0
SCALES = (1.0, 4.0, 16.0)


def compared(case: Case, scale: float, count: int = SAMPLES) -> dict[str, Any]:
    """Return the best robust design of a case beside its samples."""
    began = time.process_time()
    result = md.synthesize(case.problem(FACTOR, scale), "design")
    seconds = time.process_time() - began
    best = result.data["designs"][0]
    widths = {name: scale * width for name, width in case.tolerances.items()}
    values = dict(best["parameters"])
    if case.name.startswith("slider"):
        values = {"r": 1.0, "l": 3.0, "e": 0.0, **values}
    sampled = case.sampled(values, widths, FACTOR, count)
    return {
        "case": case.name, "half_widths": widths, "k": FACTOR, **best["robust"][0],
        "monte_carlo": sampled, "off": best["objective"] / sampled - 1, "samples": count,
        "parameters": best["parameters"], "seconds": seconds,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    records = []
    for case in CASES:
        for scale in SCALES:
            records.append({"scale": scale, **compared(case, scale)})
            own = records[-1]
            print(f"{own['case']:30} x{scale:<4g} {own['value']:.6g} {own['monte_carlo']:.6g} "
                  f"{100 * own['off']:+.3f} % {own['seconds']:.1f} s", flush=True)  # fmt: skip
            if options.out:
                options.out.write_text(json.dumps({"records": records}, indent=1) + "\n")


if __name__ == "__main__":
    main()

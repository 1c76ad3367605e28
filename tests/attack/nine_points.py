"""Four-bars drawn at random, nine points of each on one branch: do they come back, with cognates?

    python -m tests.attack.nine_points --count 20 --log FILE --out docs/data/nine-points.json

Each case is a line of FILE when it is finished; a run that was broken off goes on there. Points are
those of the closed forms of `closure_fourbar`; what comes back is compared with what was drawn and
with its cognates, whose lengths are products of those drawn (Roberts). Times are of this process.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from mechdae.design.synthesis.exact.four_bars import four_bars_through, with_cognates
from tests.reference import closure_fourbar as closure

HEIGHT = 0.02
"""Least height of the dyad at a point: none of them near a dead point."""


def drawn(seed: int) -> tuple[closure.FourBar, np.ndarray]:
    """A four-bar and nine points that it visits on one branch, in the order of its crank."""
    generator = np.random.default_rng([92, seed])
    while True:
        r = np.exp(generator.uniform(np.log(0.4), np.log(2.5), 4))
        made = closure.FourBar(
            tuple(r.tolist()), complex(*generator.normal(size=2)), *generator.normal(size=3)
        )
        theta = np.sort(generator.uniform(0, 2 * np.pi, 9))
        parts, (height,) = made.moved(theta, (1,))
        if height.min() > HEIGHT:
            return made, np.column_stack([parts["point"].real, parts["point"].imag])


def cognate_lengths(made: closure.FourBar) -> list[np.ndarray]:
    """Lengths (ground, crank, coupler, rocker) of the three cognates, each way round."""
    r1, r2, r3, r4 = made.lengths
    k, m = abs(made.point) / r3, abs(1 - made.point / r3)
    three = [(r1, r2, r3, r4), (k * r1, k * r3, k * r2, k * r4), (m * r1, m * r2, m * r4, m * r3)]
    return [
        np.array(own) for g, a, c, b in three for own in ((g, a, c, b), (g, b, c, a))
    ]  # fmt: skip


def case(seed: int) -> dict:
    made, points = drawn(seed)
    begin = time.process_time()
    found = four_bars_through(points)
    spent = time.process_time() - begin
    lengths = np.array([own.lengths for own in with_cognates(found)])
    gaps = [float(np.abs(lengths - own).max(axis=1).min()) for own in cognate_lengths(made)]
    residual = max(own.residual for own in found.designs)
    return {
        "seed": seed, **found.every.facts(), "planted_within": max(gaps),
        "largest_residual": residual, "cpu_s": round(spent, 1),
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--log", type=Path, required=True)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    known = {}
    if asked.log.exists():
        rows = [json.loads(line) for line in asked.log.read_text(encoding="utf-8").splitlines()]
        known = {row["seed"]: row for row in rows}
    for seed in range(asked.count):
        if seed not in known:
            known[seed] = case(seed)
            with asked.log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(known[seed]) + "\n")
            print(json.dumps(known[seed]), flush=True)
    if asked.out is not None:
        rows = [known[seed] for seed in range(asked.count)]
        asked.out.write_text(json.dumps({"cases": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

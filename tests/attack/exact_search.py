"""How many of the real solutions of exact problems a search finds, and what it costs.

    python -m tests.attack.exact_search --out docs/data/exact.json

Nine points of Wampler, Morgan & Sommese 1992, problem 3: 64 real four-bars up to cognates are
counted in the literature (Hauenstein & Sottile, ACM TOMS algorithm 921). Five points and both
pivots, Morgan & Wampler 1990, problem 7: 15. Five poses: 4 dyads. Each design is judged with
`closure_fourbar`. Times are of this process alone.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from mechdae.design.synthesis.exact.four_bars import guiding_links
from mechdae.design.synthesis.fourbar.exact import exact_path
from mechdae.design.synthesis.fourbar.linkage import poses_of, variants
from tests.reference import closure_fourbar as closure
from tests.shared import attack
from tests.shared.paths import DATA

CASES = {
    case["id"]: case
    for case in json.loads((DATA / "synthesis.json").read_text(encoding="utf-8"))["cases"]
}
FIXED = {"pivot_x": 0.0, "pivot_y": 0.0, "other_x": 1.0, "other_y": 0.0}


def path(case, given, starts, seed):
    """One search: counts, work, the largest error, the mechanisms that move well."""
    begin = time.process_time()
    found = exact_path(case["targets"], given, starts=starts, seed=seed)
    spent = time.process_time() - begin
    sound = []
    for design in (one for each in found.designs for one in variants(each) if not given):
        made = closure.FourBar(
            tuple(map(float, design.lengths)), design.point,
            design.pivot.real, design.pivot.imag, design.turn,
        )  # fmt: skip
        verdict = closure.judged(made, design.turns, case["targets"])
        if verdict.defects:
            continue
        sound.append(
            {
                "lengths": design.lengths.tolist(), "class": verdict.grashof, "f": verdict.f,
                "transmission_deg": float(np.degrees(verdict.transmission)),
            }
        )  # fmt: skip
    hits = found.search.hits
    return {
        "seed": seed, "starts": starts, "iterations": found.search.iterations,
        "found": len(found.designs), "unseen": float((hits == 1).sum() / hits.sum()),
        "least_hits": int(hits.min()),
        "largest_f": max(design.residual for design in found.designs),
        "sound": sound, "cpu_s": round(spent, 2),
    }  # fmt: skip


def poses(case):
    begin = time.process_time()
    found, every = guiding_links(poses_of(case["poses_x_y_theta"]))
    spent = time.process_time() - begin
    wanted = np.array(sorted(case["dyads_G_w_L"], key=lambda row: row[4]))
    ours = np.array([[d.pivot.real, d.pivot.imag, d.pin.real, d.pin.imag, d.length] for d in found])
    off = float(np.abs(ours / wanted - 1).max()) if len(ours) == len(wanted) else None
    return {
        "verdict": every.verdict,
        "found": len(found),
        "largest_relative": off,
        "cpu_s": round(spent, 2),
    }


def main(arguments: list[str] | None = None) -> int:
    parser = attack.parser(__doc__, 5, "seeds")
    parser.add_argument("--starts", type=int, default=200_000)
    options = parser.parse_args(arguments)
    seeds = range(options.seed, options.seed + options.count)
    figures = {
        "nine points": {
            "real": 64,
            "short": [path(CASES["WMS3_ninepoint"], None, 20_000, seed) for seed in seeds],
            "long": path(CASES["WMS3_ninepoint"], None, options.starts, 0),
        },
        "five points, pivots given": {
            "real": 15,
            "runs": [
                path(CASES["MW7_fivepoint_fixed_pivots"], FIXED, 10_000, seed) for seed in seeds
            ],
        },
        "five poses": {"real": 4, "runs": [poses(CASES["BURMESTER5_public"])]},
    }  # fmt: skip
    return attack.ended(figures, options.out, False)


if __name__ == "__main__":
    sys.exit(main())

"""Bands of clearance beside adversaries: five problems and mechanisms drawn at random.

`python -m tests.scripts.play_bands --count 200 --samples 100000 --out docs/data/play.json`.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import mechdae as md
from tests.shared.gaps import Comparison, compared, drawn_mechanism, with_gaps

CASES = {
    "four-bar-crank-rocker": ("turn", 1e-3), "slider-crank": ("turn", 1e-3),
    "gorshkov-seven-link": ("turn", 1e-4), "toggle-press": ("cycle", 1e-4),
    "geared-five-bar": ("turns", 3e-4),
}  # fmt: skip
"""Problem -> task, gaps as a share of the size."""
ROUNDS = 3
"""Steps uphill of each sample."""
REPEATS = 40


def figures(found: Comparison) -> dict[str, float]:
    counts = {"samples": found.samples, "outside": found.outside, "open": found.open}
    bands = {"bands": found.bands, "not_proved": found.unbounded, "short": found.short}
    ratios = found.ratios or [np.nan]
    return {**counts, **bands, "median": float(np.median(ratios)), "worst": float(max(ratios))}


def seconds(*runs: Callable[[], object]) -> list[float]:
    """Return the least processor time of each of some runs, by turns after a first one [s]."""
    taken: list[list[float]] = [[] for _ in runs]
    for _ in range(REPEATS + 1):
        for run, times in zip(runs, taken, strict=True):
            begin = time.process_time()
            run()
            times.append(time.process_time() - begin)
    return [min(times[1:]) for times in taken]


def sampled(result: md.SweepResult, seed: int, samples: int, poses: int) -> Comparison:
    """Compare with so many samples in all, spread over the bands that are proved."""
    tried = compared(result, seed, poses, 1, 0)
    bands = tried.bands - tried.unbounded
    each = samples / (2 * max(bands, 1) * (ROUNDS + 1))
    return compared(result, seed, poses, math.ceil(each), ROUNDS)


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args(arguments)
    whole: dict[str, object] = {}
    for name, (task, share) in CASES.items():
        problem = md.load(name)
        base, mechanism = problem.tasks[task], with_gaps(problem.mechanism, share)
        drivers = base.all_drivers
        found = sampled(
            md.solve(mechanism, md.Play(drivers=drivers, poses=25)), 1, options.samples, 5
        )
        play, sweep = (kind(drivers=drivers, poses=361) for kind in (md.Play, md.Sweep))
        times = seconds(*[partial(md.solve, mechanism, task) for task in (play, sweep)])
        whole[name] = {"share": share, **figures(found), "times_a_sweep": times[0] / times[1]}
        print(name, whole[name], file=sys.stderr, flush=True)
    every, counted, bare, seed, fewest = Comparison(), 0, 0, -1, math.inf
    while counted < options.count:
        seed += 1
        rng = np.random.default_rng(seed)
        mechanism = drawn_mechanism(rng, 1 + seed % 3)
        mechanism = with_gaps(mechanism, 10.0 ** rng.uniform(-5, -3))
        driver = md.Driver("crank.angle", from_=-0.3, to=0.3)
        try:
            found = sampled(md.solve(mechanism, md.Play(driver, poses=7)), seed, options.samples, 2)
        except md.SolveError:
            continue
        every.join(found)
        if not found.samples:
            bare += 1
            continue
        counted, fewest = counted + 1, min(fewest, found.samples)
        print(seed, figures(every), file=sys.stderr, flush=True)
    random = {"mechanisms": counted, "samples_each": fewest, "without_any_band": bare}
    whole["random"] = {**random, **figures(every)}
    text = json.dumps(whole, indent=1) + "\n"
    if options.out:
        options.out.write_text(text, encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

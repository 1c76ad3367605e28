"""Random spatial mechanisms assembled from rough places of points alone, judged in 40 digits.

    python -m tests.attack.spatial_sketches --count 500 --out docs/data/spatial-sketches.json

Every body lies anywhere in its frame. Points of joints, and one more of every body that does not
spin freely, are sketched with Gaussian noise in each coordinate, a share of the size of the
mechanism: the root mean square distance of its joints from their middle. Counted are those that
assemble, those whose pose solves the closure, in which no axis is flipped, and how far it
lies from the points that were meant.
"""

from __future__ import annotations

import argparse
import collections
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.values import Table
from mechdae.motion.kinematics.prepared import CacheOwner, keep_for
from tests.attack.spatial_honesty import LOOPS, Case, drawn, error_of

NOISE = 0.2


def sketched(rng: Any, found: Case, noise: float) -> Case:
    """Return the mechanism with a rough sketch of its points and nothing else."""
    places = np.array(list(found.planted.values()))
    size = float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))
    mechanism, bodies, marks = found.mechanism, {}, {}
    for name, body in mechanism.bodies.items():
        bodies[name] = body
        if name in found.frames and turning(mechanism, name):
            r, R = found.frames[name]
            local = rng.uniform(-0.5, 0.5, 3)
            bodies[name] = replace(body, points=body.points.with_("M", tuple(local)))
            marks |= {f"{name}.M.{x}": v for x, v in zip("xyz", r + R @ local, strict=True)}
    known = {n: own for n, own in mechanism.sketch.items() if n.count(".") == 2} | marks
    rough = {name: float(own) + noise * size * float(rng.normal()) for name, own in known.items()}
    whole = replace(mechanism, bodies=Table(bodies), sketch=Table(rough))
    return replace(found, mechanism=whole)


def turning(mechanism: md.Mechanism, name: str) -> bool:
    """Return whether a body has an orientation: it is no link between two ball joints."""
    own = [joint for joint in mechanism.joints.values() if name in joint.bodies]
    return len(own) != 2 or not all(joint.ball for joint in own)


def assembled(found: Case) -> tuple[str, float]:
    """Return how a mechanism fares at the planted value of its driver, and how far it is off.

    "ok", "flipped" (no solution of the closure, axes in their sense), or the word of what failed;
    root mean square distance of the joints from the planted places, over the size.
    """
    driver = md.Driver(found.driver, at=[0.0])
    try:
        result = md.solve(found.mechanism, md.Sweep(driver=driver, derivatives=0))
    except md.SolveError as error:
        return type(error).__name__, np.nan
    if result.status[0] != "ok":
        return str(result.status[0]), np.nan
    if not error_of(found, result, 0) <= result.bound.length[0]:
        return "flipped", np.nan
    gaps = [
        float(np.linalg.norm(result.points[name].position[0] - found.planted[name.split(".")[1]]))
        for name in result.points
        if name.split(".")[1] in found.planted
    ]
    return "ok", float(np.sqrt(np.mean(np.square(gaps))))


def directions(mechanism: md.Mechanism) -> frozenset[str]:
    """Return the names of the numbers of all directions: mechanisms that differ in them alone and
    in lengths are of one structure where these are symbols.
    """
    return frozenset(f"{j.name}.{n}" for j in mechanism.joints.values() for n, _ in j.numbers()
                     if "." in n)  # fmt: skip


def _write(options: argparse.Namespace, told: Any, off: list[float]) -> None:
    """Write the counts of what was done so far."""
    found = {
        "seed": options.seed,
        "noise": options.noise,
        "counts": dict(sum(told.values(), collections.Counter())),
        "median_off": round(float(np.median(off)), 3) if off else None,
        "loops": {loop: dict(own) for loop, own in told.items()},
    }
    options.out.write_text(json.dumps(found, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noise", type=float, default=NOISE)
    parser.add_argument("--loops", nargs="*", default=LOOPS)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="of CPU time at most")
    parser.add_argument("--out", type=Path, help="a JSON file for the counts")
    options = parser.parse_args()
    told: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    off: list[float] = []
    count = len(options.loops)
    numbers = sorted(range(options.count), key=lambda k: (k % count, k))  # loop by loop
    held: dict[str, CacheOwner] = {}
    for k in numbers:
        if time.process_time() > options.seconds:
            break
        rng = np.random.default_rng((options.seed, k, 11))
        loop = options.loops[k % count]
        case = sketched(rng, drawn(rng, loop), options.noise)
        if loop not in held:
            held = {loop: CacheOwner(directions(case.mechanism))}
        with keep_for(held[loop]):
            word, gap = assembled(case)
        told[loop][word] += 1
        if word == "ok":
            off.append(gap)
        else:
            print(word, loop, "seed", options.seed, "number", k, flush=True)
        if options.out:
            _write(options, told, off)
    total = sum(told.values(), collections.Counter())
    print(dict(total))
    for loop, own in told.items():
        print(loop, dict(own))


if __name__ == "__main__":
    main()

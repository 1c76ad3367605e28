"""All assembly modes by paths against searches: trusses to nine links, platforms on six legs.

`python -m tests.scripts.all_modes --sets 20 --platforms 1000 --out docs/data/all-modes.json`
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.assembly import assembler
from mechdae.composition.chains import KinematicChain, chains
from mechdae.composition.mechanisms import mechanism_of
from mechdae.homotopy.platforms import platform_poses


def trusses(links: int) -> Iterator[KinematicChain]:
    """Yield the trusses without freedom, each with every link fixed that differs."""
    for chain in chains(links, 0):
        yield from chain.inversions()


def driven(chain: KinematicChain, places: Any) -> md.Mechanism:
    """Return a truss, its pins at places (n, 2), one ground pin of it on a driven crank."""
    drawn = mechanism_of(chain, places.tolist())
    name = next(iter(drawn.ground.points))
    x, y = drawn.ground.points[name]
    points = {**drawn.ground.points, "pivot": (x - 0.3, y)}
    del points[name]
    crank = md.Body("crank", {"pivot": (0, 0), name: (0.3, 0)})
    joints = [
        replace(joint, first=f"crank.{name}") if joint.name == name else joint
        for joint in drawn.joints.values()
    ]
    pivot = md.Revolute("pivot", "ground.pivot", "crank.pivot")
    return md.Mechanism(
        ground=md.Ground(points),
        bodies=[crank, *drawn.bodies.values()],
        joints=[pivot, *joints],
        sketch={**drawn.sketch, "crank": 0.0},
    )


def angles(result: md.Result) -> Any:
    """Return exp(i angle) (n, bodies) of all modes."""
    return np.exp(1j * np.stack([body.angle for body in result.bodies.values()], axis=1))


def compared(chain: KinematicChain, rng: Any, searched: bool) -> dict[str, Any]:
    """Return what paths and searches find for one set of lengths."""
    mechanism = driven(chain, rng.normal(size=(len(chain.joints), 2)))
    task = md.Modes(md.Driver("crank.angle", at=[0.0]))
    began = time.process_time()
    found = md.solve(mechanism, task)
    row = {
        "proven": found.summary["proven"],
        "real": found.summary["count"],
        "seconds": time.process_time() - began,
        "fault": found.fault,
    }
    if searched:
        ways, assembler.WAYS = assembler.WAYS, ()
        began = time.process_time()
        other = md.solve(mechanism, task)
        assembler.WAYS = ways
        row["searched"] = other.summary["count"]
        row["search_seconds"] = time.process_time() - began
        ours, theirs = angles(found), angles(other)
        gaps = [float(np.abs(ours - own).max(axis=1).min(initial=9.0)) for own in theirs]
        row["not_among"] = int(sum(gap > 1e-6 for gap in gaps))
    return row


def of_trusses(links: int, sets: int, every: int, sample: int) -> dict[str, Any]:
    """Return counts over all trusses of a size; every so many are compared with a search."""
    rng = np.random.default_rng(links)
    rows = []
    chosen = list(trusses(links))[::sample]
    for number, chain in enumerate(chosen):
        for _ in range(sets):
            rows.append(compared(chain, rng, every > 0 and number % every == 0))
    seconds = sorted(row["seconds"] for row in rows)
    both = [row for row in rows if "searched" in row]
    return {
        "links": links - 1,
        "groups": len(chosen),
        "sets": len(rows),
        "proven": sum(row["proven"] for row in rows),
        "real": [min(row["real"] for row in rows), max(row["real"] for row in rows)],
        "median_seconds": round(seconds[len(seconds) // 2], 3),
        "largest_seconds": round(seconds[-1], 3),
        "compared": len(both),
        "missed_by_paths": sum(row["not_among"] for row in both),
        "missed_by_search": sum(row["real"] > row["searched"] for row in both),
        "search_median_seconds": round(float(np.median([row["search_seconds"] for row in both])), 3)
        if both
        else None,
    }


def of_platforms(count: int) -> dict[str, Any]:
    """Return counts over random platforms on six legs, each built round a pose."""
    rng = np.random.default_rng(40)
    rows = []
    for _ in range(count):
        base, platform, place = rng.normal(size=(6, 3)), rng.normal(size=(6, 3)), rng.normal(size=3)
        R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        R *= np.sign(np.linalg.det(R))
        legs = np.linalg.norm(place + platform @ R.T - base, axis=1)
        began = time.process_time()
        found = platform_poses(base, platform, legs)
        seconds = time.process_time() - began
        gap = np.abs(found.position - place).max(axis=1).min(initial=9.0)
        rows.append((found.proven, len(found.position), seconds, gap))
    proven, real, seconds, gaps = (list(own) for own in zip(*rows, strict=True))
    return {
        "platforms": count,
        "proven": int(sum(proven)),
        "pose_lost": int(sum(gap > 1e-6 for gap in gaps)),
        "real": [min(real), max(real)],
        "median_seconds": round(float(np.median(seconds)), 3),
        "largest_seconds": round(max(seconds), 3),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--links", type=int, nargs="*", default=[7, 9])
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--every", type=int, default=1, help="groups of which one is searched too")
    parser.add_argument("--sample", type=int, default=1, help="every so many groups only")
    parser.add_argument("--platforms", type=int, default=0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    known = json.loads(options.out.read_text()) if options.out and options.out.exists() else {}
    for links in options.links:
        known[f"groups of {links - 1} links"] = of_trusses(
            links, options.sets, options.every, options.sample
        )
        print(json.dumps(known), flush=True)
    if options.platforms:
        known["platforms"] = of_platforms(options.platforms)
        print(json.dumps(known), flush=True)
    if options.out:
        options.out.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

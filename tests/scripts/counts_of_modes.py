"""How often all modes are proven, for groups drawn at random: Assur groups of the plane, rings.

`python -m tests.scripts.counts_of_modes --sets 200 --out docs/data/counts-of-modes.json`

The Assur groups are those of `tests/data/planar_groups.json` with other points; rings of seven
hinges close at angles drawn at random, and that pose has to be among those found; platforms with
three shared points on one body (6-3) or on both (3-3) have 16 simple poses. A run that was stopped
goes on with what is not in the file yet.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.numerics.homotopy.platforms import platform_poses
from tests.scripts.all_modes import between
from tests.shared.paths import DATA
from tests.shared.space import ring_of_seven

GROUPS = {
    "seven_link_star": 14,
    "six_links_four_legs": 18,
    "class_iv_ring": 56,
    "eight_links_five_legs": 54,
}
"""Groups of the data by their number of complex poses."""
EVERY = 10
"""Sets after which what is there is written."""


def group(case: Any, rng: Any) -> md.Mechanism:
    """Return a group of the data with points drawn at random, a crank of its own length."""

    def points(own: Any) -> dict[str, tuple[float, float]]:
        return {name: (float(x), float(y)) for name in own for x, y in [rng.normal(size=2)]}

    return md.Mechanism(
        ground=md.Ground(points(case["ground"])),
        bodies=[md.Body(name, points(own)) for name, own in case["bodies"].items()],
        joints=[md.Revolute(f"J{k}", *pair) for k, pair in enumerate(case["revolutes"])],
    )


def of_groups(name: str, sets: int) -> Iterator[dict[str, Any]]:
    """Yield how many of a group's sets are proven, every so often."""
    rng = np.random.default_rng(GROUPS[name])
    case = json.loads((DATA / "planar_groups.json").read_text(encoding="utf-8"))["groups"][name][0]
    rows = []
    for _ in range(sets):
        mechanism = group(case, rng)
        driver = md.Driver("crank.angle", at=[float(rng.uniform(0, 6))])
        began = time.process_time()
        summary = md.solve(mechanism, md.Modes(driver)).summary
        seconds = time.process_time() - began
        wanted = f"{GROUPS[name]} complex poses are certified"
        rows.append((bool(summary["proven"]) and wanted in summary["basis"], seconds))
        if len(rows) % EVERY == 0 or len(rows) == sets:
            yield counted(rows, GROUPS[name])


def of_rings(sets: int) -> Iterator[dict[str, Any]]:
    """Yield how many rings of seven hinges are proven, and how many drawn poses are lost."""
    rng, rows, lost = np.random.default_rng(7), [], 0
    for _ in range(sets):
        mechanism, first, world = ring_of_seven(rng)
        began = time.process_time()
        found = md.solve(mechanism, md.Modes(md.Driver("J0.angle", at=(first,))))
        rows.append((bool(found.summary["proven"]), time.process_time() - began))
        places = np.stack([found.points[f"b{k}.P{k}"].position for k in range(1, 7)], axis=1)
        lost += not np.abs(places - world).max(axis=(1, 2)).min(initial=9.0) < 1e-6
        if len(rows) % EVERY == 0 or len(rows) == sets:
            yield counted(rows, 16) | {"pose_lost": lost}


def of_shared(sets: int, base: tuple[int, ...]) -> Iterator[dict[str, Any]]:
    """Yield how many platforms with shared points have 16 simple poses."""
    rng, rows = np.random.default_rng(16), []
    for _ in range(sets):
        B = rng.normal(size=(6, 3))[list(base)]
        P, place = rng.normal(size=(3, 3))[[0, 0, 1, 1, 2, 2]], rng.normal(size=3)
        R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        R *= np.sign(np.linalg.det(R))
        began = time.process_time()
        found = platform_poses(B, P, np.linalg.norm(place + P @ R.T - B, axis=1))
        near = np.abs(found.position - place).max(axis=1).min(initial=9.0) < 1e-6
        rows.append((found.regular == 16 and bool(near), time.process_time() - began))
        if len(rows) % EVERY == 0 or len(rows) == sets:
            yield counted(rows, 16)


def counted(rows: list[tuple[bool, float]], most: int) -> dict[str, Any]:
    """Return counts and processor times."""
    seconds = sorted(time for _, time in rows)
    return {
        "complex": most,
        "sets": len(rows),
        "complete": sum(own for own, _ in rows),
        "median_seconds": round(seconds[len(rows) // 2], 3),
        "largest_seconds": round(seconds[-1], 3),
    }


def table(known: dict[str, Any]) -> str:
    """Return the figures as text of a page."""
    lines = [
        "| group | complex poses | sets | complete | median, largest |",
        "|---|---|---|---|---|",
    ]
    for name, own in known.items():
        lines.append(
            f"| {name.replace('_', ' ')} | {own['complex']} | {own['sets']} | {own['complete']} | "
            f"{own['median_seconds']:.2f}, {own['largest_seconds']:.2f} s |"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--again", action="store_true", help="what is in the file too")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--page", type=Path, help="page to write the figures into")
    options = parser.parse_args()
    known: dict[str, Any] = {}
    if options.out and options.out.exists():
        known = json.loads(options.out.read_text(encoding="utf-8"))
    runs = {
        **{name: of_groups(name, options.sets) for name in GROUPS},
        "3-3 platforms": of_shared(options.sets, (0, 1, 1, 2, 2, 0)),
        "6-3 platforms": of_shared(options.sets, (0, 1, 2, 3, 4, 5)),
        "rings of seven hinges": of_rings(options.sets),
    }
    for name, run in runs.items():
        if known.get(name, {}).get("sets") == options.sets and not options.again:
            continue
        for found in run:
            known[name] = found
            if options.out:
                options.out.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
        print(name, json.dumps(known[name]), flush=True)
    if options.page:
        text = between(options.page.read_text(encoding="utf-8"), "counts", table(known))
        options.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

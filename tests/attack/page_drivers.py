"""Moves several drivers of pages at random in Node.js: each pose is that of Python, none is
missing.

    python -m tests.attack.page_drivers --count 200 --out docs/data/page-drivers.json

A page and Python lead the same mechanism straight from values of its drivers to others, again and
again, with dimensions drawn at random. Where the page's straight line ends, Python's must end too.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from tests.shared.player import Player

PAGES = (
    *("five-bar-robot/forward", "five-bar-robot/circle", "pantograph/circle", "differential/line"),
    *("bevel-differential/turn", "flyball-governor/turn", "delta-robot/path", "six-axis-arm/move"),
    "hexapod/inverse",
)
LEGS, REACH, APART = 8, 0.25, 0.05
"""Legs one after the other, their length in sizes of drivers, shares by which dimensions differ."""
SAME = 1e-9
ASKED = """
const start = session.now(), all = WAYS;
return all.map(([theta, legs]) => {
  const found = [];
  if (session.dimension(theta) === 1) {
    [session.s] = session.range;
    for (const u of [session.drivers(), ...legs]) {
      const t = session.move(u), { pose } = session, bound = pose.y && session.motion.bound(pose);
      found.push([t, pose.status, session.places_of(pose), bound && bound.length]);
      if (t < 1) break;
    }
  }
  session.restore(start);
  return found;
});
"""


def drawn(page: md.Page, rng: np.random.Generator, legs: int) -> tuple[list[float], list[Any]]:
    """Return dimensions, and values of the drivers one after the other."""
    given = np.array([own["value"] for own in page.data["sliders"]])
    theta = (given * (1 + APART * rng.uniform(-1, 1, given.size))).tolist()
    sizes = np.array([own["size"] for own in page.data["drivers"]])
    ways = np.cumsum(REACH * sizes * rng.uniform(-1, 1, (legs, len(sizes))), axis=0)
    return theta, (np.array(page.data["way"]["u"]) + ways).tolist()


def followed(name: str, page: md.Page, theta: list[float], legs: list[Any]) -> md.Result:
    """Return Python's poses at the first values of the drivers, and after each leg."""
    problem = md.load(name)
    values = dict(zip([own["name"] for own in page.data["sliders"]], theta, strict=True))
    at = np.vstack([page.data["way"]["u"], *legs]).T.tolist()
    names = [own["name"] for own in page.data["drivers"]]
    task = md.Sweep(drivers=[md.Driver(own, at=list(u)) for own, u in zip(names, at, strict=True)])
    return md.solve(problem.with_values(values).mechanism, task)


def compared(name: str, page: md.Page, ways: list[Any], found: list[Any]) -> dict[str, Any]:
    """Return how many poses are those of Python, what differs, and what one of both has alone."""
    row: dict[str, Any] = {"sets": 0, "poses": 0, "ended": 0, "other": 0, "worst": 0.0}
    for (theta, legs), own in zip(ways, found, strict=True):
        if not own:  # these dimensions are not reached
            continue
        try:
            truth = followed(name, page, theta, legs[: len(own) - 1])
        except md.MechdaeError:
            continue
        row["sets"] += 1
        for k, (t, status, points, bound) in enumerate(own):
            good = str(truth.status[k]) == "ok"
            if t < 1:
                row["ended"] += 1
                row["other"] += good
                break
            row["poses"] += 1
            row["other"] += not (good and status == "ok")
            places = {ref: own.position[k] for ref, own in truth.points.items() if ref in points}
            size = max(np.abs(own).max() for own in places.values())
            miss = max(np.abs(np.array(points[ref]) - own).max() for ref, own in places.items())
            row["worst"] = max(row["worst"], float(max(miss - 2 * bound, 0.0) / size))
    return row


def examine(asked: str, count: int, player: Player, seed: int = 20) -> dict[str, Any]:
    """Return the figures of one page."""
    name, _, task = asked.partition("/")
    page = md.page(name, task)
    rng = np.random.default_rng(seed)
    ways = [drawn(page, rng, LEGS) for _ in range(count)]
    found = player.asks(page, ASKED.replace("WAYS", json.dumps(ways)))
    return compared(name, page, ways, found)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    table = {}
    with tempfile.TemporaryDirectory() as folder, Player(Path(folder)) as player:
        for asked in PAGES:
            table[asked] = examine(asked, options.count, player)
            print(asked, table[asked], flush=True)
            if options.out:
                whole = {key: sum(row[key] for row in table.values()) for key in ("sets", "poses")}
                whole |= {
                    key: sum(row[key] for row in table.values()) for key in ("ended", "other")
                }
                whole["worst"] = max(row["worst"] for row in table.values())
                text = json.dumps({"summary": whole, "pages": table}, indent=1)
                options.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""Numbers of live pages in Node.js against Python: poses, other dimensions, links that stretch.

    python -m tests.scripts.page_numbers --out docs/data/page-numbers.json [NAME ...]

All live pages of the predefined problems at 37 poses: ``over`` is the largest difference over what
is allowed, the bars of `BARS` and what rounding makes of the condition number. Ten of them with 60
sets of dimensions, each assembled anew by Python; and each with 500 random values of its sliders,
absurd ones and values of several drivers among them. Rows of pages that are not named stay in OUT.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.library import names
from mechdae.errors import MechdaeError
from tests.shared.live import places_of
from tests.shared.player import Player

POSES, SETS, APART, FRAMES = 37, 60, 0.12, 500
LONGEST = 60_000
"""Milliseconds after which a page is pulled no further."""
VARIED = ("four-bar-crank-rocker", "four-bar-double-rocker", "gorshkov-seven-link", "jansen-leg",
          "triad-six-modes", "slider-crank", "watt-six-bar", "stephenson-six-bar", "klann-leg",
          "oscillating-cylinder", "five-bar-robot", "pantograph", "cam-roller-follower",
          "wankel-rotor")  # fmt: skip
RATES = ("position", "velocity", "acceleration")
BARS = (1e-13, 1e-13, 1e-12)
"""Differences of positions, velocities, accelerations, of the largest entry of a pose."""
ROUNDING = 2.0**-52
"""Of it times the condition number positions may differ beyond, rates times its square."""
ASKED = """
const points = (pose) => Object.fromEntries(data.entries.filter((e) => e.kind === "points")
  .map((e) => [e.part, [0, 1, 2].map((order) => session.inTime(pose, e.columns, order))]));
const forces = session.checkForces();
const ends = session.motion.ends.map((e) => (e && e.kind === "limit" ? e.s : null));
return { trusted: session.trusted, ends, poses: PLACES.map((s) => {
    const pose = session.motion.pose(s);
    const acting = forces && pose.status === "ok" ? session.forcesAt(pose) : null;
    return { status: pose.status, points: pose.y && points(pose),
      bound: pose.error && session.motion.bound(pose).length,
      condition: pose.error && session.motion.condition(pose),
      acting: acting && !acting.still ? [acting.status, acting.efforts] : null };
  }) };
"""
CHANGED = """
const start = [...session.theta], coarse = session.sample.bind(session);
session.sample = () => coarse(25);
return SETS.map(([theta, places]) => {
  const t = session.dimension(theta);
  const poses = places.map((s) => {
    const pose = session.motion.pose(s);
    return [pose.status, pose.y && session.places_of(pose)];
  });
  const ends = session.motion.ends.map((e) => (e && e.kind === "limit" ? e.s : null));
  session.dimension(start);
  return [t, poses, ends];
});
"""
PULLED = """
let seed = 12345, worst = 0, frames = 0, moved = 0, ended = 0, unnamed = 0;
const begun = Date.now();
const random = () => { seed = (1103515245 * seed + 12345) % 2147483648; return seed / 2147483648; };
const coarse = session.sample.bind(session);
session.sample = () => coarse(25);
while (frames < FRAMES && (session.theta.length || data.drivers) && Date.now() - begun < LONGEST) {
  frames += 1;
  const theta = [...session.theta];
  const i = Math.floor(random() * theta.length);
  const wild = random() < 0.1 ? 1e3 * (random() - 0.5) : 0.2 + 2.5 * random();
  let t;
  if (data.drivers && random() < 0.4) {
    t = session.move(session.drivers().map((u, k) => u + data.drivers[k].size * (random() - 0.5)));
  } else if (theta.length) {
    theta[i] = (data.sliders[i].value || 0.1 * data.start.scale) * wild;
    t = session.dimension(theta);
  } else continue;
  moved += t > 0;
  ended += t < 1;
  unnamed += t < 1 && !session.reason;
  // pins are one point by construction: where a loop does not close, a link is longer
  let lengths = null;
  for (const pose of [...session.poses, session.pose]) {
    if (!pose.y) continue;
    const places = session.places_of(pose);
    const size = Math.max(data.start.scale, ...Object.values(places).flat().map(Math.abs));
    const now = data.scene.bodies.flatMap(({ shape }) => shape.slice(1).map((name) =>
      Math.hypot(...places[name].map((v, j) => v - places[shape[0]][j]))));
    lengths = lengths || now;
    now.forEach((own, j) => { worst = Math.max(worst, Math.abs(own - lengths[j]) / size); });
  }
}
return { worst, frames, moved, ended, unnamed };
"""


def as_python(name: str, page: md.Page, player: Player) -> dict[str, Any]:
    """Return the largest differences at poses of the task, relative to those of each pose."""
    result = md.solve(name, page.data["task"])
    rows = np.unique(np.linspace(0, len(result.status) - 1, POSES).astype(int))
    places = places_of(page, result)[rows].tolist()
    found = player.asks(page, ASKED.replace("PLACES", json.dumps(places)))
    worst = dict.fromkeys((*RATES, "limit", "forces", "over"), 0.0)
    other, ratios, poses = 0, [], 0
    for wanted, own in zip(page.data["limits"], found["ends"], strict=True):
        if wanted is not None:
            other += own is None
            worst["limit"] = max(worst["limit"], abs(wanted - (own or wanted)))
    for k, pose in zip(rows, found["poses"], strict=True):
        status = str(result.status[k])
        if status in ("ok", "limit", "unassembled"):
            other += pose["status"] != status
        if pose["status"] != "ok":
            continue
        poses += 1
        if result.bound is not None and result.bound.length[k] > 0:
            ratios.append(pose["bound"] / float(result.bound.length[k]))
        for order, rate in enumerate(RATES):
            series = {ref: np.asarray(getattr(own, rate))[k] for ref, own in result.points.items()}
            known = {ref: own for ref, own in series.items() if ref in pose["points"]}
            size = max((np.abs(own).max() for own in known.values()), default=0.0)
            natural = page.data["start"]["scale"] * abs(page.data["speed"]) ** order
            size = size if size > 1e-9 * natural else natural  # of what stands still
            allowed = BARS[order] + ROUNDING * pose["condition"] ** min(order + 1, 2)
            for ref, own in known.items():
                miss = float(np.abs(np.array(pose["points"][ref][order], float) - own).max())
                miss = miss / float(size) if size else miss
                worst[rate] = max(worst[rate], miss)
                worst["over"] = max(worst["over"], miss / allowed)
        if pose["acting"] and pose["acting"][0] == status == "ok":
            for effort, value in pose["acting"][1].items():
                size = np.nanmax(np.abs(result.efforts[effort]))
                miss = abs(value - float(result.efforts[effort][k]))
                worst["forces"] = max(worst["forces"], float(miss / size))
    rounded = {key: float(f"{value:.2g}") for key, value in worst.items()}
    middle = float(f"{np.median(ratios):.4g}") if ratios else None
    return {"trusted": found["trusted"], "poses": poses, "other": other, **rounded, "bound": middle}


def changed(name: str, page: md.Page, player: Player) -> dict[str, Any]:
    """Return how other dimensions that the page follows differ from what Python assembles."""
    task, sliders = page.data["task"], page.data["sliders"]
    solver, truths, others = md.Solver(name, task), [], 0
    own_mode = solver().summary.get("mode")
    for row in np.random.default_rng(20).uniform(-1, 1, (SETS, len(sliders))):
        values = {
            own["name"]: own["value"] * (1 + APART * u) for own, u in zip(sliders, row, strict=True)
        }
        try:
            truth = solver(**values)
        except MechdaeError:
            continue
        if truth.summary.get("mode") != own_mode:  # the sketch is nearer to another one there
            others += 1
            continue
        rows = np.flatnonzero(truth.status == "ok")[5::21]
        places = places_of(page, truth)[rows].tolist()
        truths.append((list(values.values()), truth, rows, places))
    sets = json.dumps([[theta, places] for theta, _, _, places in truths])
    found = player.asks(page, CHANGED.replace("SETS", sets))
    figures = {
        "sets": len(truths),
        "other_modes": others,
        "compared": 0,
        "missing": 0,
        "differ": 0,
        "limits": 0,
    }
    worst = apart = 0.0
    for (_, truth, rows, _), (t, poses, ends) in zip(truths, found, strict=True):
        for wanted, own in zip(truth.summary.get("limits") or (None, None), ends, strict=True):
            if t == 1 and wanted is not None and own is not None:
                figures["limits"] += 1
                apart = max(apart, abs(wanted - own))
        for k, (status, points) in zip(rows, poses, strict=True):
            if t < 1 or status != "ok":
                figures["missing"] += 1
                continue
            size = max(np.abs(own.position[k]).max() for own in truth.points.values())
            miss = max(
                np.abs(np.array(points[ref]) - own.position[k]).max() / size
                for ref, own in truth.points.items()
            )
            figures["compared"] += 1
            figures["differ"] += bool(miss > 1e-9)
            worst = max(worst, float(miss)) if miss <= 1e-9 else worst
    return {**figures, "worst": float(f"{worst:.2g}"), "limit": float(f"{apart:.2g}")}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    table: dict[str, Any] = {}
    if options.names and options.out and options.out.exists():
        table = json.loads(options.out.read_text(encoding="utf-8"))["pages"]
    with tempfile.TemporaryDirectory() as folder, Player(Path(folder)) as player:
        for name in options.names or names():
            try:
                page = md.page(name)
            except MechdaeError:
                continue
            if not page.data["live"]:
                continue
            own = {"poses": as_python(name, page, player)}
            own["pulled"] = player.asks(
                page, PULLED.replace("FRAMES", str(FRAMES)).replace("LONGEST", str(LONGEST))
            )
            if name in VARIED:
                own["changed"] = changed(name, page, player)
            table[name] = own
            print(name, own, flush=True)
            if options.out:
                options.out.write_text(written(table), encoding="utf-8")
    print(json.dumps(summary_of(table), indent=1))


def written(table: dict[str, Any]) -> str:
    """Return figures of pages with their summary as text."""
    known = [name for name in names() if name in table]
    table = {name: table[name] for name in known}
    return json.dumps({"summary": summary_of(table), "pages": table}, indent=1) + "\n"


def summary_of(table: dict[str, Any]) -> dict[str, Any]:
    """Return the largest differences and the counts of all pages."""
    varied = [own["changed"] for own in table.values() if "changed" in own]
    return {
        "live": len(table),
        "trusted": sum(own["poses"]["trusted"] for own in table.values()),
        **{
            key: max(own["poses"][key] for own in table.values())
            for key in (*RATES, "limit", "forces", "over")
        },
        "other": sum(own["poses"]["other"] for own in table.values()),
        "gap": float(f"{max(own['pulled']['worst'] for own in table.values()):.2g}"),
        "frames": sum(own["pulled"]["frames"] for own in table.values()),
        "unnamed": sum(own["pulled"]["unnamed"] for own in table.values()),
        **{key: sum(own[key] for own in varied) for key in ("sets", "compared", "missing")},
        "other_modes": sum(own["other_modes"] for own in varied),
        "differ": sum(own["differ"] for own in varied),
        "limits": sum(own["limits"] for own in varied),
        "limits_apart": max((own["limit"] for own in varied), default=0.0),
    }


if __name__ == "__main__":
    main()

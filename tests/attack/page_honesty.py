"""Draws random mechanisms, opens their pages in Node.js: nothing is certified that Python refutes.

    python -m tests.attack.page_honesty --count 420 --out docs/data/page-honesty.json

A page holds poses that Python solved. Its modules, where it is live, are asked for the poses at the
same values of the driver: what they certify must be certified by Python too, at the same places,
and limit positions must be those of Python. ``missing`` are poses that Python alone has. Then
each page is given further dimensions, which a closure of the tests' own judges
(`tests.attack.page_dimensions`). Work is done in chunks; a run that was stopped goes on from
OUT.parts.jsonl.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.attack import page_dimensions
from tests.shared import attack

CHUNK = 10
POSES = 24
SETS = 25
"""Further sets of dimensions of each page."""
APART = 1e-9
"""Share of the mechanism's size by which places may differ beyond the bounds of both."""
COUNTS = (
    *("mechanisms", "live", "recorded", "poses", "certified", "missing", "limits", "ends"),
    *page_dimensions.COUNTS,
)
WORST = ("worst", *page_dimensions.WORST)
LISTS = ("faults", "untrusted")
ASKED = """
const limits = session.motion.ends.map((end) => (end && end.kind === "limit" ? end.s : null));
return { trusted: session.trusted, limits, poses: PLACES.map((s) => {
  const pose = session.motion.pose(s), bound = pose.error ? session.motion.bound(pose).length : 0;
  return [pose.status, pose.y ? session.places_of(pose) : null, bound];
}) };
"""


def nothing() -> dict[str, Any]:
    """Return the figures of no mechanism."""
    lists: dict[str, Any] = {name: [] for name in LISTS}
    return {**dict.fromkeys(COUNTS, 0), **dict.fromkeys(WORST, 0.0), **lists, "reasons": {}}


def examine(seed: int, player: Any, sets: int = SETS) -> dict[str, Any]:
    """Return the figures of one mechanism."""
    import numpy as np

    import mechdae as md
    from tests.reference.truth.drawing import draw
    from tests.reference.truth.judging import swept

    row: dict[str, Any] = {**dict.fromkeys(COUNTS, 0), "faults": [], "untrusted": []}
    row |= {**dict.fromkeys(WORST, 0.0), "reason": ""}
    case = draw(seed)
    if case is None:
        return row
    row["mechanisms"] = 1
    try:
        page = md.page(md.Problem(case.mechanism(), {"sweep": swept(case, POSES)}))
    except md.MechdaeError as error:
        row["recorded"], row["reason"] = 1, f"no page: {error.what[:40]}"
        return row
    data = page.data
    if not data["live"]:
        row["recorded"], row["reason"] = 1, data["reason"]
        return row
    row["live"] = 1
    found = player.asks(page, ASKED.replace("PLACES", json.dumps(data["driver"]["values"])))
    if not found["trusted"]:
        row["reason"], row["untrusted"] = "the page does not trust itself", [seed]
        return row
    recorded = data["recorded"]["points"].items()
    truth = {name: np.reshape(np.array(rows, float), (-1, 2)) for name, rows in recorded}
    for k, (own, points, bound) in enumerate(found["poses"]):
        python = data["status"][k]
        row["poses"] += 1
        row["limits"] += own == "limit"
        row["missing"] += own not in ("ok", "limit") and python == "ok"
        if own != "ok":
            continue
        row["certified"] += 1
        if python != "ok":
            row["faults"].append(f"seed {seed} pose {k}: Python says {python}")
            continue
        away = [
            np.abs(np.array(points[name], float) - truth[name][k]).max()
            for name in points
            if name in truth
        ]
        miss = max(max(away) - 2 * bound, 0.0) / case.scale
        row["worst"] = max(row["worst"], float(miss))
        if not miss <= APART:
            row["faults"].append(f"seed {seed} pose {k}: {miss:.1e} elsewhere")
    for python, own in zip(data["limits"], found["limits"], strict=True):
        if python is not None and own is not None:
            unit = 1.0 if data["start"]["turns"] else case.scale
            row["ends"] += 1
            if not abs(python - own) <= APART * max(unit, abs(python)):
                row["faults"].append(f"seed {seed}: limit at {own!r}, of Python at {python!r}")
    page_dimensions.judge(case, page, player, sets, row)
    return row


def chunk(start: int, count: int, sets: int = SETS) -> dict[str, Any]:
    """Return the figures of some seeds, added up."""
    from tests.shared.player import Player

    total = nothing()
    with tempfile.TemporaryDirectory() as folder, Player(Path(folder)) as player:
        for seed in range(start, start + count):
            row = examine(seed, player, sets)
            for name in COUNTS:
                total[name] += row[name]
            for name in WORST:
                total[name] = max(total[name], row[name])
            for name in LISTS:
                total[name] += row[name]
            if row["reason"]:
                total["reasons"][row["reason"]] = total["reasons"].get(row["reason"], 0) + 1
    return {"start": start, **total}


def merged(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of a run from those of its chunks."""
    total = nothing()
    for part in sorted(parts, key=lambda part: int(part["start"])):
        for name in COUNTS:
            total[name] += part[name]
        for name in WORST:
            total[name] = max(total[name], part[name])
        for name in LISTS:
            total[name] += part[name]
        for reason, count in part["reasons"].items():
            total["reasons"][reason] = total["reasons"].get(reason, 0) + count
    total |= {name: float(f"{total[name]:.2g}") for name in WORST}
    total["reasons"] = dict(sorted(total["reasons"].items(), key=lambda item: -item[1]))
    return total


def main() -> int:
    parser = attack.parser(__doc__ or "", 200, "mechanisms")
    parser.add_argument("--portion", type=int, help="mechanisms of this call, the rest in others")
    options = parser.parse_args()
    log = options.out.with_suffix(".parts.jsonl") if options.out else None
    parts = []
    if log is not None and log.exists():
        parts = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    done = {part["start"] for part in parts}
    starts = range(options.seed, options.seed + options.count, CHUNK)
    last = options.seed + options.count
    jobs = [(start, min(CHUNK, last - start)) for start in starts if start not in done]
    if options.portion:
        jobs, later = jobs[: options.portion // CHUNK], jobs[options.portion // CHUNK :]
    else:
        later = []
    with attack.processes(options.workers) as spread:
        for part in spread(chunk, jobs):
            parts.append(part)
            if log is not None:
                with log.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(part) + "\n")
            done_so_far = part["start"], part["live"], part["sets"], part["faults"]
            print(*done_so_far, file=sys.stderr, flush=True)
    if later:
        return 0
    figures = {"seed": options.seed, "count": options.count, **merged(parts)}
    if log is not None:
        log.unlink(missing_ok=True)
    return attack.ended(figures, options.out, figures["faults"])


if __name__ == "__main__":
    sys.exit(main())

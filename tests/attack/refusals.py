"""Counts the poses of driven groups that exist and are refused, against a path follower.

    python -m tests.attack.refusals --count 2000 --workers 2 --out docs/data/refusals.json

Mechanisms of `truth.driven` are swept; each pose that the follower reaches from the sketch must
be `ok`, each pose that is `ok` must be where the follower is, within its bound. The exit code is
1 where a pose was `ok` and wrong. Figures are kept by family, with the reasons of what was refused.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from tests.shared import attack

POSES = 25
NEAR = 1e-6
"""Units of the driver by which poses may lie before the end of the follower's path unjudged."""
NOISE = 1e-10
"""Sizes by which the follower itself may be off, times the condition number over 1e4."""
TURNS = 4
"""Whole turns of the driver by which a pose may be reached the other way round."""
SOLVED = 1e-9
"""Sizes by which equations may be open at a pose that is shown."""
RUNS_AWAY = 50.0
"""Coordinates above which a slide runs away, which the package calls a pole at 100 lengths."""
LISTED = 60


def examine(seed, family=None):
    """Return the figures of one mechanism."""
    import mechdae as md
    from mechdae.describe.file.load import from_dict
    from tests.reference.truth.driven import draw

    case = draw(seed, family)
    row = {"seed": seed, "family": case.family, "poses": POSES, "reached": 0, "ok": 0}
    row |= {"refused": 0, "wrong": 0, "raised": 0, "other_mode": 0, "why": "", "error": 0.0}
    started = time.process_time()
    try:
        result = md.solve(from_dict(case.data(POSES)), task="t")
    except md.MechdaeError as error:
        result, row["raised"], row["why"] = None, 1, f"{type(error).__name__}: {error.what}"[:90]
    row["seconds"] = time.process_time() - started
    if result is None:
        places = np.linspace(*case.span, POSES)
        poses, _ = reached(case, case.start, case.s0, places)
        row["reached"] = row["refused"] = sum(x is not None for x in poses)
        return row
    u = np.asarray(result.drivers[case.coordinate].position)
    status = np.array([str(word) for word in result.status])
    ok = status == "ok"
    start, s0 = case.start, case.s0
    if ok.any():
        k = int(np.flatnonzero(ok)[np.argmin(np.abs(u[ok] - s0))])
        x = case.at(case.follow(start, s0, u[k]), u[k])
        if x is None or off(case, result, k, x)[0] > 1e-6:
            row["other_mode"] = 1
            start, s0 = pose_of(case, result, k), u[k]
    poses, ends = reached(case, start, s0, u)
    events = {e["kind"] for e in result.events}
    for k, x in enumerate(poses):
        near = min(abs(u[k] - end) for end in ends)
        row["ok"] += bool(ok[k])
        if ok[k]:
            if x is None:
                x = round_about(case, result, k, start, s0, u[k])
            gap, allowed = off(case, result, k, x) if x is not None else (np.inf, 0.0)
            if gap > allowed and not (x is None and near < NEAR):
                row["wrong"] += 1
                row["why"] += f" wrong at {u[k]:.6g} by {gap:.2g} of {allowed:.2g};"
            elif x is not None:
                row["error"] = max(row["error"], gap / allowed)
        if x is not None and near > NEAR and np.max(np.abs(x)) < RUNS_AWAY:
            row["reached"] += 1
            if not ok[k] and status[k] != "limit":
                row["refused"] += 1
                row.setdefault("statuses", []).append(str(status[k]))
    if row["refused"]:
        row["why"] += f" {sorted(events)} {sorted(set(row['statuses']))}"
    row.pop("statuses", None)
    return row


def reached(case, x, s, places):
    """Return the poses at `places` that the follower reaches, and the ends of its path."""
    sides = [case.follow(x, s, to) for to in (max(*places, s), min(*places, s))]
    poses = [case.at(sides[0] if place >= s else sides[1], place) for place in places]
    return poses, [side[-1][0] for side in sides] if any(x is None for x in poses) else [np.inf]


def round_about(case, result, k, x, s, place):
    """Return the pose reached the other way round that a result shows, None where there is none.

    After one turn or several: a pose at another number of turns of the driver is the pose asked
    for where it solves the equations with the driver's own value, gears among them.
    """
    shown = pose_of(case, result, k)
    if not case.angular or np.max(np.abs(case.system(shown, place)[0])) > SOLVED:
        return None
    way = np.sign(place - s)
    nodes = case.follow(x, s, place - TURNS * 2 * np.pi * way)
    there = [case.at(nodes, place - n * 2 * np.pi * way) for n in range(1, TURNS + 1)]
    there = [pose for pose in there if pose is not None]
    return min(there, key=lambda pose: off(case, result, k, pose)[0], default=None)


def off(case, result, k, x):
    """Return the largest distance of a pose's points from the truth, and what is allowed."""
    gap, cond = 0.0, np.linalg.cond(case.system(x, 0.0)[1])
    for _, name, a, p, b, q, _ in case.joints:
        for body, point, letter in ((a, p, "a"), (b, q, "b")):
            if body:
                found = result.points[f"b{body}.{name}{letter}"].position[k]
                gap = max(gap, float(np.max(np.abs(found - case.place(x, body, point)[0]))))
    return gap, float(result.bound["length"][k]) + NOISE * max(1.0, cond / 1e4)


def pose_of(case, result, k):
    """Return the follower's coordinates of a pose of the result."""
    from tests.reference.truth.driven import turned

    x = np.zeros(3 * case.bodies)
    for _, name, a, p, b, q, _ in case.joints:
        for body, point, letter in ((a, p, "a"), (b, q, "b")):
            if body:
                angle = float(result.bodies[f"b{body}"].angle[k])
                found = result.points[f"b{body}.{name}{letter}"].position[k]
                x[3 * body - 3 : 3 * body - 1] = found - turned(angle) @ point
                x[3 * body - 1] = angle
    return x


def add(rows):
    """Return the figures of all rows by family and together."""
    families = {}
    for row in rows:
        for name in (row["family"], "all"):
            table = families.setdefault(name, {"mechanisms": 0, "error": 0.0, "seconds": 0.0})
            table["mechanisms"] += 1
            for key in ("poses", "reached", "ok", "refused", "wrong", "raised", "other_mode"):
                table[key] = table.get(key, 0) + row[key]
            table["hit"] = table.get("hit", 0) + bool(row["refused"])
            table["error"] = max(table["error"], row["error"])
            table["seconds"] += row["seconds"]
    for table in families.values():
        table["refused_percent"] = round(100 * table["refused"] / max(table["reached"], 1), 4)
        table["seconds"] = round(table["seconds"], 1)
        table["error"] = float(f"{table['error']:.3g}")
    return families


def main(arguments=None):
    parser = attack.parser(__doc__, 500, "mechanisms")
    parser.add_argument("--family")
    options = parser.parse_args(arguments)
    jobs = [(seed, options.family) for seed in range(options.seed, options.seed + options.count)]
    with attack.processes(options.workers) as run:
        rows = list(run(examine, jobs, 5))
    families = add(rows)
    notable = [row for row in rows if row["refused"] or row["wrong"] or row["raised"]]
    listed = [
        {key: row[key] for key in ("seed", "family", "reached", "refused", "wrong", "why")}
        for row in sorted(notable, key=lambda row: (-row["wrong"], -row["refused"]))
    ]
    about = {"count": options.count, "seed": options.seed, "poses": POSES}
    figures = {**about, "families": families, "notable": listed[:LISTED]}
    return attack.ended(figures, options.out, families["all"]["wrong"])


if __name__ == "__main__":
    sys.exit(main())

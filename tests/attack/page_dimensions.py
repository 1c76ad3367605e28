"""Random dimensions of one page in Node.js, judged by a closure that owes the package nothing.

The page's kernels are printed once, as for its sliders: each set of dimensions is followed there,
and what the page then certifies is solved anew in absolute coordinates. A pose is refuted where

- no solution lies within its bounds,
- the determinant of a group has another sign than at the other poses,
- steps from the pose before it arrive elsewhere.

So is a limit position that is no fold, and a mechanism whose links are stretched.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np

CLOSE = (1e-2, 1e-4, 1e-7, 1e-10)
"""Shares of the range from its ends at which poses are near-singular on purpose."""
SHARES = {
    "PLAIN": [(k + 0.5) / 20 for k in range(20)],
    "CLOSE": [*CLOSE, *(1 - share for share in CLOSE)],
}
APART = 1e-9
FAR = 1e-8
"""Share of the mechanism by which two solutions may be one to rounding, as near double roots."""
LONGEST = 20_000
"""Milliseconds after which a page is given no further dimensions."""
FINER = (1024, 8192)
"""Steps of the follower from a pose to the next where fewer arrive elsewhere."""
SETS = ("all", "one", "little")
COUNTS = ("sets", "stopped", "set_poses", "set_limits", "followed", "by_python", "unsure")
WORST = ("worst_error", "worst_limit", "worst_gap")
ASKED = """
const told = (pose) => {
  if (!pose.y) return null;
  const { s, status } = pose, bound = session.motion.bound(pose);
  return { s, status, bound, points: session.places_of(pose), angles: session.angles_of(pose) };
};
const nominal = [...session.theta], coarse = session.sample.bind(session);
session.sample = () => coarse(25);
const begun = Date.now();
return THETAS.map((theta) => {
  if (Date.now() - begun > LONGEST) return null;
  session.remember();
  const t = session.dimension(theta);
  const { ends } = session.motion;
  const [low, high] = session.motion.span();
  const at = (s) => told(session.motion.pose(s));
  const found = (shares, plain) => shares.map((share) => at(low + share * (high - low)))
    .filter(Boolean).map((own) => ({ ...own, plain }));
  const poses = [...found(PLAIN, true), ...found(CLOSE, false)];
  const limits = ends.map((end) => (end && end.kind === "limit" ? at(end.s) : null));
  const now = [...session.theta];
  session.undo();
  const back = session.theta.every((value, k) => value === nominal[k]);
  return { t, theta: now, poses, ends: limits, back };
}).filter(Boolean);
"""


def sets_of(
    seed: int, sliders: list[dict[str, Any]], scale: float, count: int
) -> list[list[float]]:
    """Return dimensions: all of them changed, one pulled far until something opens, little."""
    rng = np.random.default_rng([seed, 20])
    found = []
    given = np.array([own["value"] for own in sliders])
    size = np.minimum(np.abs(given), scale)  # frames may lie far from their bodies
    for k in range(count):
        theta = given.copy()
        kind = SETS[k % len(SETS)]
        if kind == "all":
            theta += size * rng.uniform(0.02, 0.3) * rng.uniform(-1, 1, theta.size)
        elif kind == "one":
            j = int(rng.integers(theta.size))
            theta[j] += scale * 10.0 ** rng.uniform(-2, 1) * rng.choice([-1, 1])
        else:
            theta += size * 10.0 ** rng.uniform(-12, -3) * rng.uniform(-1, 1, theta.size)
        found.append(theta.tolist())
    return found


def judge(case: Any, page: Any, player: Any, count: int, row: dict[str, Any]) -> None:
    """Add the figures of some sets of dimensions of a page to a row, and its faults."""
    if not page.data["sliders"]:
        return
    thetas = sets_of(case.seed, page.data["sliders"], case.scale, count)
    for k, found in enumerate(shown(page, player, thetas)):
        faults = [] if found["back"] else ["undone to other dimensions"]
        if found["poses"]:
            row["sets"] += 1
            row["stopped"] += found["t"] < 1
            faults += judged(case, page, found, row)
        else:
            faults.append("no pose is left")
        row["faults"] += [f"seed {case.seed} set {k}: {fault}" for fault in faults]


def shown(page: Any, player: Any, thetas: list[list[float]]) -> list[dict[str, Any]]:
    """Return what the page shows at sets of dimensions: poses along its range, limit positions."""
    asked = ASKED.replace("THETAS", json.dumps(thetas)).replace("LONGEST", str(LONGEST))
    for word, shares in SHARES.items():
        asked = asked.replace(word, json.dumps(shares))
    return list(player.asks(page, asked))


def judged(case: Any, page: Any, found: dict[str, Any], row: dict[str, Any]) -> list[str]:
    """Return what is wrong with the poses of one set of dimensions."""
    from tests.reference.planar_closure import Closure

    changed = {own["name"]: v for own, v in zip(page.data["sliders"], found["theta"], strict=True)}
    numbers = dict(page.data["numbers"]) | changed
    closure = Closure(case.bodies, case.joints, case.coordinate, numbers)
    poses = [pose for pose in found["poses"] if pose["status"] == "ok"]
    faults: list[str] = []
    if poses:
        faults += _poses(case, closure, poses, row)
    for end in found["ends"]:
        if end is None:
            continue
        row["set_limits"] += 1
        q = _absolute(closure, end)
        gap = closure.gap(q, end["s"])
        row["worst_gap"] = max(row["worst_gap"], gap)
        if not gap <= APART:
            faults.append(f"limit at {end['s']!r}: shown open by {gap:.1e}")
        at = closure.fold(q, end["s"])
        unit = max(1.0 if page.data["start"]["turns"] else case.scale, abs(end["s"]))
        apart = abs(at - end["s"]) / unit
        row["worst_limit"] = float(np.fmax(row["worst_limit"], apart))
        if not apart <= APART:
            faults.append(f"limit at {end['s']!r}, the fold is at {at!r}")
    return faults


def _poses(case: Any, closure: Any, poses: list[Any], row: dict[str, Any]) -> list[str]:
    faults = []
    u = np.array([pose["s"] for pose in poses])
    q = np.array([_absolute(closure, pose) for pose in poses])
    bound = np.array([[pose["bound"]["length"]] * 2 + [pose["bound"]["angle"]] for pose in poses])
    solved = closure.solved(q, u)
    widths = np.array([closure.scale, closure.scale, 1.0])
    error = np.abs((q - solved).astype(float)).reshape(len(u), -1, 3)
    # a frame's origin lies beside the points that are bounded, and turns with the angle
    arm = _arms(closure)[None, :, None] * bound[:, 2][:, None, None] * [1.0, 1.0, 0.0]
    rounding = 1e-14 * np.maximum(widths, np.abs(q).reshape(len(u), -1, 3))
    miss = np.fmax(error - 2 * (bound[:, None, :] + arm) - rounding, 0.0) / widths
    row["set_poses"] += len(u)
    signs = closure.signs(q, u, [set(element.bodies) for element in case.elements])
    usual = np.sign(np.median(signs, axis=0))
    for k in range(len(u)):
        worst = miss[k].max() if np.isfinite(solved[k].astype(float)).all() else np.inf
        row["worst_error"] = float(max(row["worst_error"], worst))
        if not worst <= APART:
            faults.append(f"pose at {u[k]!r}: the solution is {worst:.1e} away")
        elif (signs[k] * usual < 0).any():
            faults.append(f"pose at {u[k]!r}: another sign of a determinant")
    plain = [k for k in range(len(u)) if poses[k]["plain"]]
    return faults or _ways(case, closure, q[plain], u[plain], bound[plain], row)


def _ways(case: Any, closure: Any, q: Any, u: Any, bound: Any, row: dict[str, Any]) -> list[str]:
    """Return where steps from pose to pose arrive elsewhere."""
    faults = []
    quick = replace(closure, wide=False)
    reached = quick.followed(q[:-1], u[:-1], u[1:])
    slack = FAR + 4 * (bound[1:, 0] / closure.scale + bound[1:, 2])
    away = closure.size(reached - q[1:])
    for k in np.flatnonzero(away > slack):  # the follower itself may have jumped
        reached[k] = quick.followed(q[[k]], u[[k]], u[[k + 1]], FINER)[0]
        away[k] = closure.size(reached[[k]] - q[[k + 1]])[0]
        if away[k] > slack[k]:
            faults.append(f"pose at {u[k + 1]!r}: steps arrive {away[k]:.1e} away")
    row["followed"] += int(np.isfinite(away).sum())
    for k in np.flatnonzero(np.isnan(away)):  # next to singular poses: Python's certified path
        off = _by_python(case, closure, q[k], q[k + 1], u[k], u[k + 1])
        row["by_python" if np.isfinite(off) else "unsure"] += 1
        if off > slack[k]:
            faults.append(f"pose at {u[k + 1]!r}: Python's path arrives {off:.1e} away")
    return faults


def _by_python(case: Any, closure: Any, q: Any, there: Any, u: float, v: float) -> float:
    """Return how far from a pose the package's path from another one ends, NaN where before it."""
    import mechdae as md
    from tests.reference.truth.case import JOINTS

    numbers, sketch = closure.numbers, dict(zip(closure.bodies, q[2::3].tolist(), strict=True))
    sketch[case.driver_key] = u
    points = {
        body: {name: tuple(numbers[f"{body}.{name}.{axis}"] for axis in "xy") for name in own}
        for body, own in case.local.items()
    }
    joints = [
        JOINTS[kind](
            name, a, b, **{key: numbers.get(f"{name}.{key}", own) for key, own in keys.items()}
        )
        for kind, name, a, b, keys in case.joints
    ]
    bodies = [md.Body(name, points=points[name]) for name in closure.bodies]
    mechanism = md.Mechanism(
        ground=md.Ground(points=points["ground"]), bodies=bodies, joints=joints, sketch=sketch
    )
    try:
        result = md.solve(mechanism, md.Sweep(md.Driver(case.coordinate, at=[u, v])))
    except md.MechdaeError:
        return np.nan
    if list(result.status) != ["ok", "ok"]:
        return np.nan
    found = np.concatenate(
        [
            [*(_origin(closure, result, body)), result.bodies[body].angle[1]]
            for body in closure.bodies
        ]
    )
    return float(closure.size((found - there)[None].astype(float))[0])


def _origin(closure: Any, result: Any, body: str) -> Any:
    """Return where the origin of a body's frame is at the second pose of a result."""
    point = _first(closure, body)
    a, b = (closure.numbers[f"{body}.{point}.{axis}"] for axis in "xy")
    turn = result.bodies[body].angle[1]
    x, y = result.points[f"{body}.{point}"].position[1]
    return x - np.cos(turn) * a + np.sin(turn) * b, y - np.sin(turn) * a - np.cos(turn) * b


def _arms(closure: Any) -> Any:
    """Return for each body how far its first point is from the origin of its frame."""
    return np.array(
        [np.hypot(*(closure.numbers[f"{body}.{_first(closure, body)}.{axis}"] for axis in "xy"))
         for body in closure.bodies]
    )  # fmt: skip


def _first(closure: Any, body: str) -> str:
    return next(name.split(".")[1] for name in closure.numbers if name.split(".")[0] == body)


def _absolute(closure: Any, pose: dict[str, Any]) -> Any:
    """Return places and angles of the frames from a point of each body and its angle."""
    q = []
    for body in closure.bodies:
        point = _first(closure, body)
        a, b = (closure.numbers[f"{body}.{point}.{axis}"] for axis in "xy")
        turn = pose["angles"][body]
        c, s = np.cos(turn), np.sin(turn)
        x, y = pose["points"][f"{body}.{point}"]
        q += [x - c * a + s * b, y - s * a - c * b, turn]
    return np.array(q)

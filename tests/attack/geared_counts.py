"""Counts of assembly modes of geared mechanisms: no pose twice, none missed where it is proven.

    python -m tests.attack.geared_counts --count 1000 --out docs/data/geared-counts.json

Mechanisms are those of `exact_sketches`, with gears, belts or racks. Two modes are the same
pose when all points of all bodies are at the same places. Poses are looked for by Newton's
method from random starts, several turns apart, with the equations written out here: each has
to be among the modes where their count is said to be proven. The exit code is 1 where not.
"""

from __future__ import annotations

import json
import math
import sys

import numpy as np

import mechdae as md
from tests.attack.exact_sketches import KINDS, draw, read
from tests.shared import attack

STARTS = 160
ITERATIONS = 40
SAME = 1e-6
SPREAD = 6 * math.pi


def rows_at(linkage, q, driven):
    """Return the equations of joints and drivers at many poses (n, bodies, 3), complex too."""
    x, y, a = (np.moveaxis(q, -1, 0)[k] for k in range(3))
    place = {name: k for k, name in enumerate(linkage.names)}
    nothing = np.zeros(len(q), q.dtype)

    def angle(body):
        return nothing if body == "ground" else a[:, place[body]]

    def point(body, name):
        px, py = linkage.points[body][name]
        if body == "ground":
            return nothing + px, nothing + py
        k, c, s = place[body], np.cos(angle(body)), np.sin(angle(body))
        return x[:, k] + c * px - s * py, y[:, k] + s * px + c * py

    def apart(joint):
        _, one, first, other, second, _ = joint
        (x1, y1), (x2, y2) = point(one, first), point(other, second)
        return x2 - x1, y2 - y1

    found = []
    for joint in linkage.joints.values():
        kind, one, _, other, _, keys = joint
        dx, dy = apart(joint)
        t1, t2, tc = angle(one), angle(other), angle(keys.get("carrier", "ground"))
        if kind == "revolute":
            found += [dx, dy]
        elif kind in ("prismatic", "pin-in-slot"):
            axis = t1 + keys["axis"]
            found.append(np.cos(axis) * dy - np.sin(axis) * dx)
            found += [t2 - t1 - keys["turn"]] if kind == "prismatic" else []
        elif kind == "distance":
            found.append((dx * dx + dy * dy - keys["length"] ** 2) / (2 * keys["length"]))
        elif kind == "rack":
            axis = t2 + keys["axis"]
            along = np.cos(axis) * dx + np.sin(axis) * dy
            found.append(along - keys["radius"] * (t1 - tc) - keys["phase"])
        else:
            ratio = -keys["ratio"] if keys.get("crossed") else keys["ratio"]
            found.append(t1 - tc - ratio * (t2 - tc) - keys["phase"])
    for text, value in driven:
        part, *rest = text.split(".")
        if part in place:
            at = angle(part) if rest == ["angle"] else point(part, rest[0])["xy".index(rest[1])]
        else:
            joint = linkage.joints[part]
            dx, dy = apart(joint)
            axis = angle(joint[1]) + joint[5].get("axis", 0.0)
            slide = np.cos(axis) * dx + np.sin(axis) * dy
            at = angle(joint[3]) - angle(joint[1]) if rest == ["angle"] else slide
        found.append(at - value)
    return np.stack(found, axis=-1)


@np.errstate(all="ignore")
def searched(linkage, seed):
    """Return poses (n, bodies, 3) found by Newton's method from random starts."""
    rng = np.random.default_rng([seed, 5])
    n = len(linkage.names)
    q = rng.uniform(-2, 2, (STARTS, n, 3))
    q[:, :, 2] = rng.uniform(-SPREAD, SPREAD, (STARTS, n))
    driven = [(text, linkage.value(text, linkage.pose)) for text in linkage.drivers]
    for _ in range(ITERATIONS):
        nudged = q[:, None].repeat(3 * n, axis=1).astype(complex)
        nudged.reshape(len(q), 3 * n, 3 * n)[:, range(3 * n), range(3 * n)] += 1e-30j
        values = rows_at(linkage, nudged.reshape(-1, n, 3), driven).reshape(len(q), 3 * n, -1)
        F, J = values[:, 0].real, values.imag.transpose(0, 2, 1) / 1e-30
        fine = np.isfinite(F).all(axis=1) & np.isfinite(J).all(axis=(1, 2))
        fine[fine] &= np.linalg.cond(J[fine]) < 1e12
        q, F, J = q[fine], F[fine], J[fine]
        step = np.linalg.solve(J, F[:, :, None])[:, :, 0]
        most = np.abs(step).max(axis=1, keepdims=True)
        q = q - (step * np.minimum(1.0, 1.0 / most)).reshape(q.shape)
    F = rows_at(linkage, q, driven)
    return q[np.abs(F).max(axis=1, initial=0.0) < 1e-11]


def places(linkage, pose):
    """Return where two points of each body are: whole turns make no difference."""
    return np.array(
        [
            coordinate
            for name in linkage.names
            for x, y, a in [pose[name]]
            for coordinate in (x, y, math.cos(a), math.sin(a))
        ]
    )


def counted(seed, search=True):
    """Return the number of modes, whether proven, and what is wrong; None: no such mechanism."""
    linkage = draw(seed, "geared")
    if linkage is None or not any(joint[0] in KINDS[4:] for joint in linkage.joints.values()):
        return None
    task = md.Modes(drivers=linkage.at(linkage.pose))
    try:
        result = md.solve(linkage.mechanism(linkage.sketch(linkage.pose)), task)
    except md.MechdaeError:
        return None  # some of it is held twice
    wrong, proven = [], result.summary["proven"]
    poses = [read(linkage, result, k) for k in range(len(result))]
    listed = np.array([places(linkage, pose) for pose in poses]).reshape(len(poses), -1)
    for i in range(len(listed)):
        for j in range(i):
            if np.abs(listed[i] - listed[j]).max() < SAME:
                wrong.append(f"{seed}: {result.labels[i]} and {result.labels[j]} are one pose")
    for k, pose in enumerate(poses):
        if result.status[k] == "ok" and np.abs(linkage.rows(pose)).max() > 1e-8:
            wrong.append(f"{seed}: {result.labels[k]} is no solution")
    if len(set(result.labels)) < len(result.labels):
        wrong.append(f"{seed}: two modes of one label")
    for q in searched(linkage, seed) if search and proven else ():
        own = places(linkage, dict(zip(linkage.names, q.tolist(), strict=True)))
        if not len(listed) or np.abs(listed - own).max(axis=1).min() > SAME:
            wrong.append(f"{seed}: a pose is missing though {len(poses)} are proven")
            break
    return len(poses), proven, wrong


def main(arguments=None):
    options = attack.parser(__doc__, 1000, "mechanisms").parse_args(arguments)
    seed, figures = options.seed, {}
    mechanisms, modes, sure, wrong = 0, 0, 0, []
    if options.out and options.out.exists():  # a run that was stopped goes on
        known = json.loads(options.out.read_text())
        if known["seeds"][0] == seed and known["mechanisms"] < options.count:
            seed, mechanisms, modes = known["seeds"][1] + 1, known["mechanisms"], known["modes"]
            sure, wrong = known["proven"], known["wrong"]
    while mechanisms < options.count:
        found = counted(seed)
        seed += 1
        if found is None:
            continue
        mechanisms, modes, sure = mechanisms + 1, modes + found[0], sure + found[1]
        wrong += found[2]
        for text in found[2]:
            print(text, file=sys.stderr, flush=True)
        figures = {
            "seeds": [options.seed, seed - 1], "mechanisms": mechanisms, "modes": modes,
            "proven": int(sure), "wrong": wrong,
        }  # fmt: skip
        attack.kept(figures, options.out)
    return attack.ended(figures, options.out, wrong)


if __name__ == "__main__":
    sys.exit(main())

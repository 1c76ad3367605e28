"""Random spatial loops with a planted pose: poses that are `ok` against a closure in 40 digits.

python -m tests.attack.spatial_honesty --count 300 --seed 1
"""

from __future__ import annotations

import argparse
import collections
import json
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mpmath
import numpy as np

import mechdae as md
from tests.reference.spatial_closure import DIGITS, GROUND, Closure, Pair, rotation, turned

LOOPS = (
    "RSSR RSSP RSRC RCSR RUSR RSUR RSCP RCCC RRSRR RUURR RHSC RSRRR RCUC RERC REUR RRRRRRR "
    "RDR RDP RWSRC RPSRR RSPU "
    "g-RSSR g-RRSRR k-RSSR k-RUSR G-RSSC G-RSRRC K-RSSC K-RCSC"
).split()
"""Pairs of single loops of one freedom; the ball joints side by side leave a link to spin.

D is a bar of constant length without a body of its own, W a weld. Before a dash, g and k: a wheel
or a rack on the ground drives the first link; G and K: the first and the last joint of a loop of
two freedoms are coupled by a gear, or as wheel and rack.
"""
NEAR = ("parallel", "meeting", "folded")
"""What nearly happens where it is asked for: two axes in line, two joints in one place, or three
joints in line, by 1e-9 to 1e-2 of what it is elsewhere."""
KINDS = {
    "R": md.SpatialRevolute,
    "P": md.SpatialPrismatic,
    "C": md.Cylindrical,
    "H": md.Screw,
    "U": md.Universal,
    "S": md.Spherical,
    "E": md.PlanarPair,
    "W": md.SpatialWeld,
}
ANGLE, POSES = 0.3, 7
NEAR_LIMIT = 0.01
"""Radians of the driver within which a limit position is near: bounds there may be wide."""


@dataclass
class Case:
    """A mechanism, the closure of it, and the planted pose: joints, places and turns of bodies."""

    name: str
    mechanism: md.Mechanism
    closure: Closure
    planted: dict[str, Any]
    driver: str = "J0.angle"
    reach: float = ANGLE
    frames: dict[str, Any] = field(default_factory=dict)


def random_turn(rng: Any) -> Any:
    q = rng.normal(size=4)
    return np.array(rotation((q / np.linalg.norm(q)).tolist()))


def strained(rng: Any, near: str, places: Any, turns: list[Any]) -> None:
    """Move one joint of a loop to where it is nearly singular."""
    k, share = int(rng.integers(1, len(places))), 10.0 ** rng.uniform(-9, -2)
    if near == "parallel":
        turns[k] = nearly(rng, share) @ turns[k - 1]
    elif near == "meeting":
        places[k] = places[k - 1] + share * (places[k] - places[k - 1])
    else:
        after = places[(k + 1) % len(places)]
        way = places[k - 1] + rng.uniform(0.3, 1.7) * (after - places[k - 1])
        places[k] = way + share * (places[k] - way)


def nearly(rng: Any, share: float) -> Any:
    """Return a rotation by a small angle about any axis."""
    axis = rng.normal(size=3)
    axis *= np.sin(share / 2) / np.linalg.norm(axis)
    return np.array(rotation([np.cos(share / 2), *axis]))


def case(rng: Any, loop: str, near: str = "") -> Case:
    """Return a loop of pairs whose frames, points and bodies lie anywhere.

    `near` is one of `NEAR`, or empty.
    """
    count = len(loop)
    names = [GROUND, *(f"b{k}" for k in range(1, count))]
    frames = {name: (rng.uniform(-1, 1, 3), random_turn(rng)) for name in names[1:]}
    frames[GROUND] = (np.zeros(3), np.eye(3))
    points: dict[str, dict[str, Any]] = {name: {} for name in names}
    joints, pairs, sketch = [], [], {}
    places = rng.uniform(-1, 1, (count, 3))
    turns = [random_turn(rng) for _ in loop]
    if near:
        strained(rng, near, places, turns)
    for k, letter in enumerate(loop):
        ends = [names[k], names[(k + 1) % count]]
        turn = turns[k]
        if letter == "D":
            joint, pair, known = bar(rng, k, ends, frames, points)
            joints.append(joint)
            pairs.append(pair)
            sketch |= known
            continue
        second_axis = turn[:, 0] if letter == "U" else turn[:, 2]
        second_zero = turn[:, 2] if letter == "U" else turn[:, 0]
        own = []
        for body, axis, zero in (
            (ends[0], turn[:, 2], turn[:, 0]),
            (ends[1], second_axis, second_zero),
        ):
            r, R = frames[body]
            points[body][f"P{k}"] = R.T @ (places[k] - r)
            own.append((R.T @ axis, R.T @ zero))
        keys: dict[str, Any] = {}
        if letter != "S":
            (keys["axis"], keys["zero"]), (keys["axis2"], keys["zero2"]) = own
        pitch = float(rng.uniform(0.1, 0.5))
        if letter == "H":
            keys["pitch"] = pitch
        between = [f"{body}.P{k}" for body in ends]
        joints.append(KINDS[letter](f"J{k}", *between, **keys))
        s1, s2 = (points[body][f"P{k}"] for body in ends)
        (a1, n1), (a2, n2) = own
        pairs.append(Pair(letter, *ends, s1, s2, a1, n1, a2, n2, pitch))
        if ends[1] != GROUND and letter != "W":
            sketch[f"{ends[1]}.P{k}"] = places[k].tolist()
        if letter not in "SPW":
            sketch[f"J{k}.angle"] = 0.0
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground(points[GROUND]),
        bodies=[md.Body(name, points[name]) for name in names[1:]],
        joints=joints,
        sketch=sketch,
    )
    planted = {f"P{k}": p for k, p in enumerate(places)}
    return Case(loop, mechanism, Closure(names[1:], pairs), planted, frames=frames)


def meshed(rng: Any, loop: str, near: str = "") -> Case:
    """Return a loop with a gear or a rack."""
    mesh, loop = loop.split("-")
    found = case(rng, loop, near)
    mechanism, pairs = found.mechanism, list(found.closure.pairs)
    bodies, joints = list(mechanism.bodies.values()), list(mechanism.joints.values())
    ground, sketch = dict(mechanism.ground.points), dict(mechanism.sketch)
    size = float(rng.choice([-1, 1]) * rng.uniform(0.4, 1.6))
    if mesh in "GK":
        last, k = len(loop) - 1, bodies[-1].name
        own, other = "b1.P0", f"{k}.P{last}"
    else:
        place, turn = rng.uniform(-1, 1, 3), random_turn(rng)
        ground["PW"], last = place, len(pairs)
        bodies.append(md.Body("wheel", {"PW": [0, 0, 0], "rim": rng.uniform(-1, 1, 3)}))
        kind, letter = (md.SpatialRevolute, "R") if mesh == "g" else (md.SpatialPrismatic, "P")
        axis, zero, axis2, zero2 = turn[:, 2], turn[:, 0], [0, 0, 1], [1, 0, 0]
        keys = {"axis": axis, "zero": zero, "axis2": axis2, "zero2": zero2}
        joints.append(kind("JW", "ground.PW", "wheel.PW", **keys))
        pairs.append(Pair(letter, GROUND, "wheel", place, [0, 0, 0], axis, zero, axis2, zero2))
        other = "wheel.PW"
    sense = -1.0 if mesh in "GK" else 1.0  # the last joint of a loop leads to the ground
    if mesh in "gG":
        joints.append(md.SpatialGear("mesh", other, own if mesh == "G" else "b1.P0", ratio=size))
    else:
        joints.append(md.SpatialRack("mesh", "b1.P0", other, radius=size))
    pairs.append(
        Pair(mesh.upper(), GROUND, GROUND, None, None, size=sense * size, meshed=(last, 0))
    )
    names = [body.name for body in bodies]
    whole = md.Mechanism(
        dimension=3, ground=md.Ground(ground), bodies=bodies, joints=joints, sketch=sketch
    )
    driven, driver, reach = 0, "J0.angle", ANGLE
    if mesh in "gk":
        driven = last
        driver, reach = f"JW.{'angle' if mesh == 'g' else 'slide'}", ANGLE * abs(size)
    closure = Closure(names, pairs, driven)
    frames = found.frames
    return Case(f"{mesh}-{loop}", whole, closure, found.planted, driver, reach, frames)


def drawn(rng: Any, loop: str, near: str = "") -> Case:
    """Return the random mechanism of a name of `LOOPS`."""
    return meshed(rng, loop, near) if "-" in loop else case(rng, loop, near)


def platform(rng: Any) -> Case:
    """Return a plate on six bars, the first one on a crank: a quaternion is among the unknowns."""
    r, R = np.array([0.1, 0.2, 1.0]), random_turn(rng)
    ways = 1.05 * np.arange(6)
    top = np.stack([0.5 * np.cos(ways), 0.5 * np.sin(ways), 0.1 * np.sin(3 * ways)], axis=1)
    base = np.stack([np.cos(ways + 0.3), np.sin(ways + 0.3), 0.05 * np.cos(2 * ways)], axis=1)
    pivot = base[0] - [0.2, 0, 0.1]
    points = {f"T{k}": R.T @ top[k] for k in range(6)}
    axis, zero = [0, 1, 0], [1, 0, 0]
    arm = base[0] - pivot
    joints = [md.SpatialRevolute("J0", "ground.O", "crank.O", axis=axis, zero=zero)]
    pairs = [Pair("R", GROUND, "crank", pivot, [0, 0, 0], axis, zero, axis, zero)]
    for k in range(6):
        body, foot, local = ("crank", "B0", arm) if k == 0 else (GROUND, f"B{k}", base[k])
        length = float(np.linalg.norm(r + top[k] - base[k]))
        bar = md.Distance(f"L{k}", f"{body}.{foot}", f"plate.T{k}", length=length)
        joints.append(bar)
        pairs.append(Pair("D", body, "plate", local, points[f"T{k}"], size=length))
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": pivot, **{f"B{k}": base[k] for k in range(1, 6)}}),
        bodies=[md.Body("crank", {"O": [0, 0, 0], "B0": arm}), md.Body("plate", points)],
        joints=joints,
        sketch={"J0.angle": 0.0} | {f"plate.T{k}": (r + top[k]).tolist() for k in range(6)},
    )
    planted = {f"T{k}": r + top[k] for k in range(6)}
    return Case("platform", mechanism, Closure(["crank", "plate"], pairs), planted)


def bar(
    rng: Any, k: int, ends: list[str], frames: dict[str, Any], points: dict[str, dict[str, Any]]
) -> tuple[Any, Pair, dict[str, Any]]:
    """Return a bar between two points anywhere, its pair, and where its second end is sketched."""
    both = rng.uniform(-1, 1, (2, 3))
    locals_ = []
    for body, name, place in zip(ends, (f"D{k}", f"E{k}"), both, strict=True):
        r, R = frames[body]
        points[body][name] = R.T @ (place - r)
        locals_.append(points[body][name])
    length = float(np.linalg.norm(both[1] - both[0]))
    joint = md.Distance(f"J{k}", f"{ends[0]}.D{k}", f"{ends[1]}.E{k}", length=length)
    known = {f"{ends[1]}.E{k}": both[1].tolist()} if ends[1] != GROUND else {}
    return joint, Pair("D", *ends, *locals_, size=length), known


def judged(found: Case, poses: int = POSES) -> collections.Counter[str]:
    """Return how poses of a sweep fare: ok, wrong (outside of their bound), jumped, other words.

    Bounds over 1e-9 are counted as wide but next to a limit position, where they grow without end.
    """
    driver = md.Driver(found.driver, from_=-found.reach, to=found.reach)
    result = md.solve(found.mechanism, md.Sweep(driver=driver, poses=poses, derivatives=0))
    told: collections.Counter[str] = collections.Counter()
    driver_at = result.drivers[found.driver].position
    limits = [limit for limit in result.summary.get("limits", ()) if limit is not None]
    for k, status in enumerate(result.status):
        if status != "ok":
            told[str(status)] += 1
            continue
        error = error_of(found, result, k)
        told["ok"] += 1
        told["wrong"] += int(not error <= result.bound.length[k])
        far = all(abs(driver_at[k] - limit) > NEAR_LIMIT for limit in limits)
        told["wide"] += int(far and result.bound.length[k] > 1e-9)
    return told


def error_of(found: Case, result: md.Result, k: int) -> float:
    """Return how far the reported points are from the solution next to the reported pose."""
    u = float(result.drivers[found.driver].position[k])
    x: list[float] = []
    for name in found.closure.bodies:
        q = result.bodies[name].orientation[k].tolist() if name in result.bodies else None
        if q is None:
            q = _spinning(found, result, name, k)
        point = next(p for p in result.points if p.startswith(f"{name}."))
        local = [float(v) for v in found.mechanism.bodies[name].points[point.split(".")[1]]]
        r = result.points[point].position[k] - np.array(rotation(q)) @ local
        x += [*r.tolist(), *q]
    for j, pair in enumerate(found.closure.pairs):
        name = next((n for n in (f"J{j}", "JW") if n in result.joints), "")
        if pair.kind in "HRC" and "angle" in result.joints.get(name, ()):
            pair.angle = float(result.joints[name].angle[k])  # whole turns count
    exact, step = found.closure.refined(x, u)
    if step > 1e-25:
        return np.inf
    worst = 0.0
    with mpmath.workdps(DIGITS):
        for i, name in enumerate(found.closure.bodies):
            own = exact[7 * i : 7 * i + 7]
            R = rotation(own[3:])
            for point in found.mechanism.bodies[name].points:
                if f"{name}.{point}" not in result.points:
                    continue
                s = [float(v) for v in found.mechanism.bodies[name].points[point]]
                place = [r + v for r, v in zip(own[:3], turned(R, s, mpmath.mp), strict=True)]
                ours = result.points[f"{name}.{point}"].position[k]
                gaps = [abs(p - mpmath.mpf(float(v))) for p, v in zip(place, ours, strict=True)]
                worst = max(worst, float(max(gaps)))
    return worst


def _spinning(found: Case, result: md.Result, name: str, k: int) -> list[float]:
    """Return an orientation of a link that spins freely: its line along the reported one."""
    points = found.mechanism.bodies[name].points
    (one, two), locals_ = list(points)[:2], [np.array(p, float) for p in points.values()]
    way = [result.points[f"{name}.{p}"].position[k] for p in (one, two)]
    a, b = locals_[1] - locals_[0], way[1] - way[0]
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    q = np.array([1 + a @ b, *np.cross(a, b)])
    return (q / np.linalg.norm(q)).tolist()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--loops", nargs="*", default=LOOPS)
    parser.add_argument("--near", type=float, default=0.3, help="share of nearly singular ones")
    parser.add_argument("--poses", type=int, default=POSES)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="of CPU time at most")
    parser.add_argument("--out", type=Path, help="a JSON file for the counts")
    options = parser.parse_args()
    whole: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for k in range(options.count):
        if time.process_time() > options.seconds:
            break
        rng = np.random.default_rng((options.seed, k))
        loop, near = options.loops[k % len(options.loops)], rng.uniform() < options.near
        try:
            found = drawn(rng, loop, str(rng.choice(NEAR)) if near else "")
            told = judged(found, options.poses)
            told["mechanisms"] += 1
        except md.SolveError as error:
            told = collections.Counter({type(error).__name__: 1})
        except md.MechdaeError as error:
            told = collections.Counter({f"{type(error).__name__}: {error.what[:50]}": 1})
        except Exception as fault:  # whatever it is, it is no answer to a user
            told = collections.Counter({"crash": 1})
            print(type(fault).__name__, fault, end=" ")
        if told["wrong"] or told["crash"]:
            word = "wrong" if told["wrong"] else "crash"
            print(word, loop, "seed", options.seed, "number", k, flush=True)
        whole[loop] += told
        if options.out and (k % 100 == 99 or k == options.count - 1):
            _write(options, whole, k + 1)
    for name, told in whole.items():
        print(name, dict(told))
    print("all", dict(sum(whole.values(), collections.Counter())))


def _write(options: argparse.Namespace, whole: dict[str, collections.Counter[str]], n: int) -> None:
    """Write the counts of what was done so far."""
    total = dict(sum(whole.values(), collections.Counter()))
    kept = {"near": options.near, "seed": options.seed, "poses": options.poses, "drawn": n}
    by_loop = {name: dict(told) for name, told in whole.items()}
    text = json.dumps(kept | {"counts": total, "loops": by_loop}, indent=1)
    options.out.write_text(text + "\n")


if __name__ == "__main__":
    main()

"""Sketches that are an exact pose, on all modes of random mechanisms: each is its own mode.

    python -m tests.attack.exact_sketches --count 2000 --out docs/data/exact-sketches.json

A pose is drawn first: places and angles of all bodies. Lengths, axes, phases are then worked
out so that the joints close there, and the sketch is that pose, with slides and coordinates of
joints and points. The answer has to be the pose itself, whatever other modes there are. The
other modes are those that the package lists, if they close by the equations written out here. A
rough sketch of each mechanism has to be answered with the nearest mode that is listed.
The exit code is 1 where something was wrong.
"""

from __future__ import annotations

import math
import sys

import numpy as np

import mechdae as md
from tests.shared import attack

KINDS = ("revolute", "prismatic", "pin-in-slot", "distance", "gear", "belt", "rack")
SHARE = {
    "dyads": (0.45, 0.2, 0.2, 0.15, 0.0, 0.0, 0.0),
    "geared": (0.42, 0.12, 0.12, 0.12, 0.1, 0.07, 0.05),
}
RATIOS = (-2.0, -1.5, -1.0, -0.75, -0.5, 0.5, 0.6, 1.5, 2.0)
CLOSES = 1e-9
"""Residual below which a pose closes [m, rad]."""
RIGHT = ("own", "own by the hint", "nearest")
SHARP = 1e5
"""Largest condition of the equations at a pose that is used."""
PORTION = 60
OFF = 1e-6
"""By how much an answer may be off its sketch: rounding times the condition, at most."""


class Linkage:
    """Bodies at known places, joints that close there, drivers: all numbers, no casadi."""

    def __init__(self, seed, family="dyads"):
        self.rng = rng = np.random.default_rng([seed, 77])
        self.family = family
        self.names = [f"b{i}" for i in range(int(rng.integers(2, 5)))]
        self.pose = {name: self.place() for name in self.names}
        self.points = {name: {} for name in ("ground", *self.names)}
        self.joints = {}
        self.drivers = []

    def place(self):
        """Return x, y and angle."""
        return (*self.rng.uniform(-1, 1, 2), self.rng.uniform(-math.pi, math.pi))

    def frame(self, body, pose):
        return (0.0, 0.0, 0.0) if body == "ground" else pose[body]

    def world(self, body, point, pose):
        x, y, a = self.frame(body, pose)
        px, py = self.points[body][point]
        c, s = math.cos(a), math.sin(a)
        return np.array([x + c * px - s * py, y + s * px + c * py])

    def point(self, body, at=None):
        """Return a new point of a body, at a place in the world or anywhere near it."""
        x, y, a = self.frame(body, self.pose)
        if at is None:
            local = self.rng.normal(size=2) * 0.7
        else:
            c, s = math.cos(a), math.sin(a)
            d = np.asarray(at) - (x, y)
            local = (c * d[0] + s * d[1], -s * d[0] + c * d[1])
        name = f"p{sum(map(len, self.points.values()))}"
        self.points[body][name] = (float(local[0]), float(local[1]))
        return name

    # -- drawing ---------------------------------------------------------------------------

    def again(self, seed):
        """Return a linkage of the same joints and drivers at another pose; None: it is not sharp.

        Ratios and what wheels turn on stay: they are part of the structure.
        """
        other = Linkage(seed, self.family)
        other.names, other.drivers = self.names, self.drivers
        other.pose = {name: other.place() for name in self.names}
        other.points = {name: {} for name in self.points}
        for kind, a, _, b, _, keys in self.joints.values():
            other.joint(kind, a, b, keys)
        return other if other.sharp(other.pose) else None

    def joint(self, kind, a, b, like=None):
        """Add a joint between two bodies that closes at the pose, of the structure of another."""
        rng, name = self.rng, f"j{len(self.joints)}"
        first = self.point(a)
        at = self.world(a, first, self.pose)
        second = self.point(b, at if kind == "revolute" else None)
        gap = self.world(b, second, self.pose) - at
        ta, tb = self.frame(a, self.pose)[2], self.frame(b, self.pose)[2]
        keys = {}
        if kind in ("prismatic", "pin-in-slot"):
            keys["axis"] = math.atan2(gap[1], gap[0]) - ta
            if rng.random() < 0.5:
                keys["axis"] -= math.pi
            if kind == "prismatic":
                keys["turn"] = tb - ta
        elif kind == "distance":
            keys["length"] = float(np.hypot(*gap))
        elif kind in ("gear", "belt", "rack"):
            others = [n for n in ("ground", *self.names) if n not in (a, b)]
            carrier = str(rng.choice(others)) if rng.random() < 0.5 else "ground"
            carrier = carrier if like is None else like.get("carrier", "ground")
            tc = self.frame(carrier, self.pose)[2]
            if carrier != "ground":
                keys["carrier"] = carrier
            ratio = float(rng.choice(RATIOS)) if like is None else like.get("ratio", 1.0)
            if kind == "gear":
                keys |= {"ratio": ratio, "phase": ta - tc - ratio * (tb - tc)}
            elif kind == "belt":
                crossed = bool(rng.random() < 0.3) if like is None else like["crossed"]
                signed = -abs(ratio) if crossed else abs(ratio)
                keys |= {"ratio": abs(ratio), "crossed": crossed}
                keys["phase"] = ta - tc - signed * (tb - tc)
            else:
                radius, axis = float(rng.uniform(0.1, 0.5)), float(rng.uniform(-3, 3))
                along = gap @ (math.cos(axis + tb), math.sin(axis + tb))
                keys |= {"radius": radius, "axis": axis, "phase": along - radius * (ta - tc)}
        self.joints[name] = (kind, a, first, b, second, keys)

    def rows(self, pose):
        """Return the residuals of all joints, in m and rad."""
        found = []
        for kind, a, first, b, second, keys in self.joints.values():
            gap = self.world(b, second, pose) - self.world(a, first, pose)
            ta, tb = self.frame(a, pose)[2], self.frame(b, pose)[2]
            tc = self.frame(keys.get("carrier", "ground"), pose)[2]
            if kind == "revolute":
                found += [*gap]
            elif kind in ("prismatic", "pin-in-slot"):
                axis = keys["axis"] + ta
                found.append(-math.sin(axis) * gap[0] + math.cos(axis) * gap[1])
                found += [tb - ta - keys["turn"]] if kind == "prismatic" else []
            elif kind == "distance":
                found.append(float(np.hypot(*gap)) - keys["length"])
            elif kind == "rack":
                along = gap @ (math.cos(keys["axis"] + tb), math.sin(keys["axis"] + tb))
                found.append(along - keys["radius"] * (ta - tc) - keys["phase"])
            else:
                signed = -keys["ratio"] if keys.get("crossed") else keys["ratio"]
                found.append(ta - tc - signed * (tb - tc) - keys["phase"])
        return np.array(found)

    def value(self, text, pose):
        """Return a coordinate at a pose."""
        part, *rest = text.split(".")
        if part in self.names:
            if rest == ["angle"]:
                return pose[part][2]
            return float(self.world(part, rest[0], pose)["xy".index(rest[1])])
        _, a, first, b, second, keys = self.joints[part]
        if rest == ["angle"]:
            return self.frame(b, pose)[2] - self.frame(a, pose)[2]
        gap = self.world(b, second, pose) - self.world(a, first, pose)
        axis = keys["axis"] + self.frame(a, pose)[2]
        return float(gap @ (math.cos(axis), math.sin(axis)))

    def drawn(self):
        """Add joints until as many freedoms are left as there are drivers; None: it failed."""
        rng = self.rng
        drivers = int(rng.choice([1, 2], p=[0.6, 0.4]))
        need = 3 * len(self.names) - drivers
        share = SHARE[self.family]
        for k, name in enumerate(self.names):  # each body hangs on one before it
            self.joint(str(rng.choice(KINDS[:4], p=_normed(share[:4]))), self.other(k), name)
        while (left := need - len(self.rows(self.pose))) > 0:
            kind = str(rng.choice(KINDS, p=share))
            if left == 1 and kind in KINDS[:2]:
                kind = str(rng.choice(KINDS[2:4]))
            a, b = (str(n) for n in rng.permutation(["ground", *self.names])[:2])
            if kind in KINDS[4:] and "ground" in (a, b) and rng.random() < 0.7:
                continue
            self.joint(kind, a, b)
        if left < 0:
            return None
        self.drivers = self.driven(drivers)
        return self if self.sharp(self.pose) else None

    def other(self, k):
        return "ground" if k == 0 else str(self.rng.choice(["ground", *self.names[:k]]))

    def driven(self, count):
        """Return coordinates to be driven: angles, slides, places of points."""
        every = [f"{name}.angle" for name in self.names] * 3
        for name, (kind, *_) in self.joints.items():
            every += [f"{name}.angle"] * (kind in ("revolute", "pin-in-slot"))
            every += [f"{name}.slide"] * (kind in ("prismatic", "pin-in-slot"))
        body = str(self.rng.choice(self.names))
        point = next(iter(self.points[body]))
        every += [f"{body}.{point}.x", f"{body}.{point}.y"]
        return [str(text) for text in self.rng.permutation(every)[:count]]

    def sharp(self, pose):
        """Return whether joints and drivers fix the pose well."""

        def every(q):
            shifted = {n: tuple(q[3 * k : 3 * k + 3]) for k, n in enumerate(self.names)}
            driven = [self.value(text, shifted) for text in self.drivers]
            return np.append(self.rows(shifted), driven)

        q = np.array([value for name in self.names for value in pose[name]])
        J = np.stack([(every(q + h) - every(q - h)) / 2e-6 for h in 1e-6 * np.eye(len(q))], axis=1)
        return J.shape[0] == J.shape[1] and np.linalg.cond(J) < SHARP

    # -- what the package is asked ---------------------------------------------------------

    def mechanism(self, sketch):
        def points(name):
            own = self.points[name]
            return {key: list(place) for key, place in own.items()}

        kinds = {
            "revolute": md.Revolute, "prismatic": md.Prismatic, "pin-in-slot": md.PinInSlot,
            "distance": md.Distance, "gear": md.Gear, "belt": md.Belt, "rack": md.Rack,
        }  # fmt: skip
        joints = [
            kinds[kind](name, f"{a}.{first}", f"{b}.{second}", **keys)
            for name, (kind, a, first, b, second, keys) in self.joints.items()
        ]
        bodies = [md.Body(name, points=points(name)) for name in self.names]
        ground = md.Ground(points=points("ground"))
        return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=sketch)

    def sketch(self, pose, more=()):
        """Return angles, slides, the drivers, and some coordinates of joints and points."""
        keys = [f"{name}.angle" for name in self.names]
        for name, (kind, *_) in self.joints.items():
            keys += [f"{name}.slide"] * (kind in ("prismatic", "pin-in-slot"))
            keys += [f"{name}.angle"] * (kind == "revolute" and self.rng.random() < 0.3)
        keys += [*self.drivers, *more]
        return {
            key.removesuffix(".angle") if key.split(".")[0] in self.names else key: self.value(
                key, pose
            )
            for key in dict.fromkeys(keys)
        }

    def at(self, pose):
        """Return the drivers of a task at that pose."""
        return [md.Driver(text, at=[self.value(text, pose)]) for text in self.drivers]


def _normed(share):
    return np.array(share) / sum(share)


def draw(seed, family):
    """Return a linkage of a pose that its equations fix, None for one that failed."""
    return Linkage(seed, family).drawn()


def read(linkage, result, k):
    """Return the pose in row `k` of a result."""
    pose = {}
    for name in linkage.names:
        a = float(result.bodies[name].angle[k])
        point = next(iter(linkage.points[name]))
        x, y = result.points[f"{name}.{point}"].position[k]
        px, py = linkage.points[name][point]
        c, s = math.cos(a), math.sin(a)
        pose[name] = (float(x - c * px + s * py), float(y - s * px - c * py), a)
    return pose


def asked(linkage, pose, more=()):
    """Return the answer to an exact sketch: "own", or what is wrong; and the hint if refused."""
    mechanism = linkage.mechanism(linkage.sketch(pose, more))
    try:
        result = md.solve(mechanism, md.Sweep(drivers=linkage.at(pose)))
    except md.MechanismError as error:
        if "which assembly mode" in str(error):
            return "refused", error.hint
        return f"{type(error).__name__}: {error}", ""
    except md.MechdaeError as error:
        return f"{type(error).__name__}: {error}", ""
    if result.status[0] != "ok":
        return str(result.status[0]), ""
    answer = read(linkage, result, 0)
    off = max(
        abs(a - b) for name in linkage.names for a, b in zip(answer[name], pose[name], strict=True)
    )
    return ("own", "") if off < OFF else (f"{off:.2g} from the sketch", "")


def judged(linkage, pose):
    """Return the answer to an exact sketch; one that is refused is asked again as the hint says."""
    answer, hint = asked(linkage, pose)
    if answer != "refused":
        return answer
    keys = hint.removeprefix("add ").partition(" to ")[0].split(" and ")
    more = [key.strip('"') for key in keys]
    if not all(key.count(".") == 2 for key in more):
        return f"refused, with no place that tells: {hint}"
    again, _ = asked(linkage, pose, more)
    return "own by the hint" if again == "own" else f"after the hint {hint!r}: {again}"


def off_sketch(linkage, sketch, pose):
    """Return how far a pose is from a sketch: radians without turns, lengths in sizes."""
    spans = [
        max(place[axis] for place in own.values()) - min(place[axis] for place in own.values())
        for own in linkage.points.values()
        if len(own) > 1
        for axis in (0, 1)
    ]
    spans += [keys["length"] for *_, keys in linkage.joints.values() if "length" in keys]
    total = 0.0
    for key, wanted in sketch.items():
        slide = key.endswith((".slide", ".x", ".y"))
        gap = linkage.value(key if "." in key else f"{key}.angle", pose) - wanted
        total += (gap / max(spans) if slide else math.remainder(gap, 2 * math.pi)) ** 2
    return math.sqrt(total)


def rough(seed, family, by=0.6):
    """Return "nearest" for the answer to a rough sketch, or that another mode is nearer to it."""
    linkage = draw(seed, family)
    if linkage is None:
        return []
    sketch = linkage.sketch(linkage.pose)
    for key in sketch:
        if (key if "." in key else f"{key}.angle") not in linkage.drivers:
            sketch[key] += float(linkage.rng.normal()) * by
    mechanism, at = linkage.mechanism(sketch), linkage.at(linkage.pose)
    try:
        modes = md.solve(mechanism, md.Modes(drivers=at))
        answer = md.solve(mechanism, md.Sweep(drivers=at))
    except md.MechanismError:
        return []
    if answer.status[0] != "ok":
        return []
    own = off_sketch(linkage, sketch, read(linkage, answer, 0))
    least = min(off_sketch(linkage, sketch, read(linkage, modes, k)) for k in range(len(modes)))
    return ["nearest" if own < least + OFF else f"{own:.3g} away, another mode {least:.3g}"]


def examine(seed, family, most=6):
    """Return what the answers were to the exact sketches of one mechanism."""
    linkage = draw(seed, family)
    if linkage is None:
        return []
    try:
        sketch = linkage.sketch(linkage.pose)
        md.solve(linkage.mechanism(sketch), md.Modes(drivers=linkage.at(linkage.pose), limit=1))
    except md.MechanismError:
        return []  # some of it is held twice, some not at all
    except md.MechdaeError as error:
        return [f"{type(error).__name__}: {error}"]
    answers = [judged(linkage, linkage.pose)]
    task = md.Modes(drivers=linkage.at(linkage.pose))
    result = md.solve(linkage.mechanism(linkage.sketch(linkage.pose)), task)
    for k in range(min(len(result), most)):
        pose = read(linkage, result, k)
        if np.abs(linkage.rows(pose)).max() < CLOSES and linkage.sharp(pose):
            answers.append(judged(linkage, pose))
    return answers + rough(seed, family)


def main(arguments=None):
    options = attack.parser(__doc__, 2000, "exact sketches").parse_args(arguments)
    counts, wrong, mechanisms, seed = {}, [], 0, options.seed
    figures = {}
    with attack.processes(options.workers) as run:
        while figures.get("sketches", 0) < options.count:
            jobs = [(k, ("dyads", "geared")[k % 2]) for k in range(seed, seed + PORTION)]
            seed += PORTION
            for job, answers in zip(jobs, run(examine, jobs, 2), strict=True):
                mechanisms += bool(answers)
                for answer in answers:
                    word = answer if answer in RIGHT else "wrong"
                    counts[word] = counts.get(word, 0) + 1
                    if word == "wrong":
                        wrong.append(f"{job[1]} {job[0]}: {answer}")
                        print(wrong[-1], file=sys.stderr, flush=True)
            figures = {
                "seeds": [options.seed, seed - 1], "mechanisms": mechanisms,
                "sketches": sum(counts.values()) - counts.get("nearest", 0), "answers": counts,
                "wrong": wrong,
            }  # fmt: skip
            attack.kept(figures, options.out)
    return attack.ended(figures, options.out, wrong)


if __name__ == "__main__":
    sys.exit(main())

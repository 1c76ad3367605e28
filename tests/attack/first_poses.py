"""Tasks of one file begin at one pose: all kinds of tasks of random mechanisms of the plane.

    python -m tests.attack.first_poses --count 2000 --workers 2 --out docs/data/first-poses.json

Sketches are the modes of the mechanism, off by up to 20 degrees in all that they say but the
drivers. A sweep, one of forces, a motion that names the drivers, one that names nothing, an
equilibrium with the drivers held, one of the modes, a study, sensitivities, the page, exports and
the file of a design have to begin at one pose, or to refuse with one voice, and no
mode that `tests.reference.nearest_modes` finds may be nearer to the sketch. Discs with followers on
both sides are judged by a closed form. The exit code is 1 where something was wrong.
"""

from __future__ import annotations

import itertools
import math
import sys

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.values import Table
from tests.attack.exact_sketches import draw, off_sketch
from tests.reference.nearest_modes import disc_and_guide, planar_modes
from tests.reference.planar_closure import Closure
from tests.reference.truth import drawing
from tests.shared import attack
from tests.shared.begun import FURTHER, First

OFF = math.radians(20)
TIED = 1e-3
"""Difference of distances from a sketch below which two modes are not told apart here."""
CLOSE = 1e-8
FAMILIES = ("dyads", "geared", "groups", "disc")
STARTS, PORTION = 24, 20
SETS = 8
"""Mechanisms of each structure of pairs."""
MOST = 3
"""Modes of a mechanism that are sketched."""


def masses(mechanism):
    """Return a mechanism whose bodies have masses."""
    bodies = {
        name: md.Body(name, dict(own.points), mass=1.0, center=(0.05, 0.1), inertia=0.2)
        for name, own in mechanism.bodies.items()
    }
    return md.Mechanism(
        ground=mechanism.ground, bodies=Table(bodies), joints=mechanism.joints,
        sketch=mechanism.sketch,
    )  # fmt: skip


def of_bodies(linkage, pose):
    """Return place and angle of each body of a linkage in a pose by points and rotations."""
    found = {}
    for name in linkage.names:
        point, (c, s) = next(iter(linkage.points[name])), pose[name]
        (x, y), (px, py) = pose[f"{name}.{point}"], linkage.points[name][point]
        found[name] = (x - c * px + s * py, y - s * px - c * py, math.atan2(s, c))
    return found


def apart(one, other):
    """Return the largest difference of places and angles of bodies, without whole turns."""
    return max(
        max(abs(a - b) if k < 2 else abs(math.remainder(a - b, 2 * math.pi))
            for k, (a, b) in enumerate(zip(one[name], other[name], strict=True)))
        for name in one
    )  # fmt: skip


def varied(mechanism, rng):
    """Return the coordinate of a point of a body, by its name."""
    body = str(rng.choice(list(mechanism.bodies)))
    point = str(rng.choice(list(mechanism.bodies[body].points)))
    return f"{body}.{point}.x"


def closure_of(linkage):
    """Return the equations of a linkage of one driver, of kinds that are known there."""
    kinds = {"pin-in-slot": "slot"}
    joints, numbers = [], {}
    for body, points in linkage.points.items():
        for point, place in points.items():
            numbers |= {f"{body}.{point}.{axis}": v for axis, v in zip("xy", place, strict=True)}
    for name, (kind, a, first, b, second, keys) in linkage.joints.items():
        joints.append((kinds.get(kind, kind), name, f"{a}.{first}", f"{b}.{second}", keys))
        numbers |= {f"{name}.{key}": v for key, v in keys.items() if isinstance(v, float)}
    return Closure(linkage.names, joints, linkage.drivers[0], numbers, wide=False)


def rough(linkage, pose):
    """Return a sketch of a pose off by up to 20 degrees, or a tenth of the size in places."""
    sketch = linkage.sketch(pose)
    for key in sketch:
        if (key if "." in key else f"{key}.angle") in linkage.drivers:
            continue
        place = key.endswith((".slide", ".x", ".y"))
        sketch[key] += float(linkage.rng.uniform(-1, 1)) * (0.1 if place else OFF)
    return sketch


def judged(linkage, sketch, at, own, further=FURTHER):
    """Return what is wrong with the tasks of a sketched linkage; empty where nothing is."""
    drivers = {text: linkage.value(text, at) for text in linkage.drivers}
    mechanism = masses(linkage.mechanism(sketch))
    found = First(mechanism, drivers, varied(mechanism, linkage.rng), further)
    wrong, first = found.wrong(), found.poses["sweep"]
    if not isinstance(first, str) and own:
        far = off_sketch(linkage, sketch, of_bodies(linkage, first))
        least = min(off_sketch(linkage, sketch, pose) for pose in own)
        if far > least + TIED:
            wrong.append(f"the sweep is {far:.3g} from the sketch, another mode {least:.3g}")
    return wrong


def of_linkages(seed, family):
    """Return what was wrong with each sketch of mechanisms of one structure, by mechanism."""
    first = draw(seed, family)
    sets = [first, *(first.again(1000 * seed + k) for k in range(1, SETS))] if first else []
    return [
        [f"{family} {seed} set {k} {text}" if text else "" for text in of_linkage(linkage)]
        for k, linkage in enumerate(sets)
        if linkage is not None
    ]


def of_linkage(linkage):
    """Return what was wrong with each sketch of one mechanism, empty texts where nothing was."""
    modes = [linkage.pose]
    if len(linkage.drivers) == 1:
        near = [v for name in linkage.names for v in linkage.pose[name]]
        u = linkage.value(linkage.drivers[0], linkage.pose)
        every = planar_modes(closure_of(linkage), u, near, linkage.rng, STARTS)
        poses = [{n: tuple(q[3 * k : 3 * k + 3]) for k, n in enumerate(linkage.names)}
                 for q in every]  # fmt: skip
        modes += [pose for pose in poses if apart(pose, linkage.pose) > CLOSE]
        modes = [pose for pose in modes if linkage.sharp(pose)]
    own = modes if linkage.family == "dyads" else []  # others tell whole turns apart
    return [
        f"mode {k}: {'; '.join(wrong)}" if wrong else ""
        for k, pose in enumerate(modes[:MOST])
        for further in [[str(linkage.rng.choice(FURTHER))] if k else FURTHER]
        for wrong in [judged(linkage, rough(linkage, pose), pose, own, further)]
    ]


def of_groups(seed):
    """Return the fault of a mechanism of all kinds of joints and groups."""
    case = drawing.draw(seed)
    if case is None:
        return []
    mechanism = masses(case.mechanism(jitter=OFF))
    number = varied(mechanism, np.random.default_rng([seed, 9]))
    wrong = First(mechanism, {case.coordinate: case.s0}, number).wrong()
    return [f"groups {seed} ({case.family}): {'; '.join(wrong)}" if wrong else ""]


def disc_file(rng, roller):
    """Return the file of an eccentric disc with a follower on an upright guide, and its truth."""
    radius, away = float(rng.uniform(0.04, 0.07)), float(rng.uniform(0.005, 0.03))
    r = float(rng.uniform(0.005, 0.02)) if roller else 0.0
    across, turn = float(rng.uniform(-0.02, 0.02)), float(rng.uniform(-math.pi, math.pi))
    centre = (away * math.cos(turn), away * math.sin(turn))
    places = disc_and_guide(radius + r, centre, across)
    curve = {
        "kind": "curve", "between": ["cam.O", "follower.P"], "closed": True,
        "x": f"{away!r} + {radius!r}*cos(s)", "y": f"{radius!r}*sin(s)",
    }  # fmt: skip
    if roller:
        curve["roller_radius"] = r
    data = {
        "schema": 1, "gravity": [0, -9.81], "ground": {"points": {"O": [0, 0], "G": [across, 0]}},
        "bodies": {
            "cam": {"points": {"O": [0, 0]}, "mass": 1, "inertia": 0.01},
            "follower": {"points": {"P": [0, 0]}, "mass": 1},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "cam.O"]},
            "profile": curve,
            "guide": {"kind": "prismatic", "between": ["ground.G", "follower.P"], "axis_deg": 90},
        },
    }  # fmt: skip
    return data, turn, centre, (across, places)


def of_disc(seed):
    """Return the faults of a disc with a follower, sketched at each of its places."""
    rng = np.random.default_rng([seed, 3])
    data, turn, centre, (across, places) = disc_file(rng, seed % 2)
    answers = []
    for y in places:
        s = math.atan2(y - centre[1], across - centre[0]) - turn
        data["sketch"] = {
            "cam": turn, "follower": 0.0, "guide": y + float(rng.uniform(-1, 1)) * 0.002,
            "profile": s + float(rng.uniform(-1, 1)) * OFF,
        }  # fmt: skip
        found = First(from_dict(data).mechanism, {"cam.angle": turn}, "cam.O.x")
        wrong, first = found.wrong(), found.poses["sweep"]
        if isinstance(first, str) or abs(first["follower.P"][1] - y) > CLOSE:
            wrong.append(f"the sweep is {first}")
        answers.append(f"disc {seed} at {y:.6g}: {'; '.join(wrong)}" if wrong else "")
    return answers


def examine(seed, family):
    """Return the answers to the sketches of each mechanism of a seed."""
    if family in ("disc", "groups"):
        answers = of_disc(seed) if family == "disc" else of_groups(seed)
        return [answers] if answers else []
    return of_linkages(seed, family)


def main(arguments=None):
    options = attack.parser(__doc__, 2000, "mechanisms").parse_args(arguments)
    wrong, mechanisms, sketches, seed, figures = [], 0, 0, options.seed, {}
    with attack.processes(options.workers) as run:
        while mechanisms < options.count:
            jobs = [(k, FAMILIES[k % len(FAMILIES)]) for k in range(seed, seed + PORTION)]
            seed += PORTION
            for answers in run(examine, jobs, 4):
                mechanisms += len(answers)
                sketches += sum(map(len, answers))
                for answer in filter(None, itertools.chain(*answers)):
                    wrong.append(answer)
                    print(answer, file=sys.stderr, flush=True)
            figures = {
                "seeds": [options.seed, seed - 1], "mechanisms": mechanisms,
                "sketches": sketches, "wrong": wrong,
            }  # fmt: skip
            attack.kept(figures, options.out)
    return attack.ended(figures, options.out, wrong)


if __name__ == "__main__":
    sys.exit(main())

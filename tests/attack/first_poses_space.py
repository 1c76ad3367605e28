"""Tasks of one file begin at one pose: all kinds of tasks of random mechanisms in space.

    python -m tests.attack.first_poses_space --count 500 --out docs/data/first-poses-space.json

Structures of all joint kinds on one or two loops, with wheels and racks, plates on bars, are drawn
by `spatial_structures`, some sets of dimensions of each. Sketches are the modes of a mechanism, off
by up to 20 degrees in angles and a tenth of its unit in places. What is compared is that of
`tests.shared.begun`, and no mode that Newton's method finds in dual quaternions, from many
starts, may be nearer to the sketch. The exit code is 1 where something was wrong.
"""

from __future__ import annotations

import itertools
import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.values import Table
from mechdae.motion.kinematics.prepared import CacheOwner, keep_for
from tests.attack.spatial_poses import driver_of
from tests.attack.spatial_structures import WORDS, Drawn, draw, structure
from tests.reference.dual_quaternions import TURN, point_of
from tests.shared import attack
from tests.shared.begun import FURTHER, First, Pose

OFF, SHIFT = math.radians(20), 0.1
SETS, STARTS, ROUNDS, PORTION = 10, 64, 30, 5
MOST = 2
"""Modes of a mechanism that are sketched."""
TIED = 1e-3
"""Difference of distances from a sketch below which two modes are not told apart here."""
LENGTHS = ("slide", "x", "y", "z")


def masses(mechanism: md.Mechanism, drawn: Drawn, i: int) -> md.Mechanism:
    """Return a mechanism whose bodies have masses; those that spin have theirs on their line."""
    unit, bodies = float(drawn.unit[i]), {}
    idle = {f"b{k}" for k in drawn.structure.idle}
    for name, own in mechanism.bodies.items():
        keys: dict[str, Any] = {"inertia": np.array([0.2, 0.3, 0.4]) * unit**2}
        centre = np.zeros(3)
        if name in idle:
            keys, centre = {}, np.mean([np.array(p, float) for p in own.points.values()], axis=0)
        bodies[name] = md.Body(name, dict(own.points), mass=1.0, center=centre, **keys)
    return replace(mechanism, bodies=Table(bodies))


class Modes:
    """The modes of one mechanism: coordinates of joints in units of the structure, places."""

    def __init__(self, drawn: Drawn, i: int, rng: Any) -> None:
        self.drawn, self.i, self.unit = drawn, i, float(drawn.unit[i])
        loops = self.loops = drawn.loops.chosen(np.full(STARTS, i))
        c = np.repeat(drawn.start[0][i : i + 1], STARTS, 0).astype(float)
        wide = np.where(np.arange(STARTS) % 2, np.pi, 0.6)[:, None]
        wide[0] = 0.0
        c[:, loops.free] += wide * rng.uniform(-1, 1, (STARTS, len(loops.free)))
        spins = {}
        for k, q in drawn.start[1].items():
            spun = q[i] + (wide > 0) * rng.normal(size=(STARTS, 4))
            spins[k] = (spun / np.linalg.norm(spun, axis=1, keepdims=True)).astype(float)
        with np.errstate(all="ignore"):
            for _ in range(ROUNDS):
                _, gaps, slopes = loops.placed(c, spins)
                step = -loops.solve(slopes[..., loops.free], gaps)
                step *= np.minimum(1.0, 0.7 / np.abs(step).max(1, keepdims=True))
                c, spins = loops.corrected(c, spins, np.nan_to_num(step))
            bodies, gaps, _ = loops.placed(c, spins)
        self.closed = [int(k) for k in np.flatnonzero(np.abs(gaps).max(1) < 1e-12)]
        self.c, self.bodies = c, bodies
        self.every: list[int] = []
        """Starts that led to modes of their own, that drawn first."""
        for k in self.closed:
            if not any(self.same(self.places(k), self.places(j)) for j in self.every):
                self.every.append(k)

    def same(self, one: Pose, other: Pose) -> bool:
        return all(np.abs(at - other[n]).max() < 1e-6 for n, at in one.items() if n in other)

    def places(self, k: int) -> Pose:
        """Return the places of points in units; of links that spin, those of their ends."""
        found = {}
        for name, body, s in self.drawn.points:
            if body:
                at = point_of(self.bodies[body][k : k + 1], s[self.i : self.i + 1])
                found[f"b{body}.{name}"] = at[0].astype(float)
        return found

    def values(self, k: int) -> dict[str, float]:
        """Return the coordinates of joints by name, lengths in metres."""
        found, structure = {}, self.drawn.structure
        for n, joint in enumerate(structure.joints):
            for j, word in enumerate(WORDS.get(joint.letter, ())):
                value = float(self.c[k, self.loops.column((n, j))])
                if joint.letter == "U":  # the closure's second frame has the pin turned back
                    value = value + math.pi if j == 0 else -value
                found[f"J{n}.{word}"] = value * (self.unit if word in LENGTHS else 1.0)
        return found

    def told(self, k: int) -> dict[str, float]:
        """Return all that may be sketched of a mode."""
        found, idle = self.values(k), self.drawn.structure.idle
        for name, at in self.places(k).items():
            body, point = name.split(".")
            if int(body[1:]) not in idle or not point.startswith("Q"):
                found |= {
                    f"{name}.{x}": float(v) * self.unit for x, v in zip("xyz", at, strict=True)
                }
        return found

    def far(self, sketch: dict[str, float], k: int, scale: float) -> float:
        """Return how far a mode is from a sketch: radians without turns but of screws, sizes."""
        told, total = self.told(k), 0.0
        for name, wanted in sketch.items():
            gap, joint = told[name] - wanted, name.split(".")[0]
            if name.endswith(LENGTHS):
                total += (gap / scale) ** 2
                continue
            screw = self.drawn.structure.joints[int(joint[1:])].letter == "H"
            total += gap**2 if screw else math.remainder(gap, float(TURN)) ** 2
        return math.sqrt(total)


def rough(modes: Modes, k: int, driver: str, rng: Any) -> dict[str, float]:
    """Return a sketch of a mode that is off in all but the driver; some have places alone."""
    told, angles = modes.told(k), bool(rng.random() < 0.6)
    meshed = {f"J{n}" for n in modes.drawn.structure.meshed if modes.drawn.structure.mesh}
    sketch = {}
    for name, value in told.items():
        part, _, word = name.partition(".")
        if name == driver:
            sketch[name] = value
        elif "." in word or part in meshed or (angles and word.startswith("angle")):
            size = SHIFT * modes.unit if name.endswith(LENGTHS) else OFF
            sketch[name] = value + float(rng.uniform(-1, 1)) * size
    return sketch


def of_mechanism(drawn: Drawn, i: int, held: CacheOwner, rng: Any) -> list[str]:
    """Return what is wrong with each sketch of one mechanism, empty texts where nothing is."""
    driver, modes = driver_of(drawn), Modes(drawn, i, rng)
    number = f"b{drawn.structure.joints[0].second or 1}.{_point(drawn, 1)}.x"
    answers = []
    for k in modes.every[:MOST]:
        sketch = rough(modes, k, driver, rng)
        mechanism = replace(masses(drawn.mechanisms[i], drawn, i), sketch=Table(sketch))
        further = [str(rng.choice(FURTHER))] if answers else FURTHER
        with keep_for(held):
            found = First(mechanism, {driver: sketch[driver]}, number, further)
        wrong, first = found.wrong(), found.poses["sweep"]
        if not isinstance(first, str):
            pose = {n: at / modes.unit for n, at in first.items() if "." in n}
            own = [j for j in modes.every if modes.same(pose, modes.places(j))]
            far = {j: modes.far(sketch, j, mechanism.scale) for j in modes.every}
            if own and far[own[0]] > min(far.values()) + TIED:
                least = min(far.values())
                wrong.append(f"the sweep is {far[own[0]]:.3g} from the sketch, a mode {least:.3g}")
        answers.append(f"mode {len(answers)}: {'; '.join(wrong)}" if wrong else "")
    return answers


def _point(drawn: Drawn, body: int) -> str:
    return next(name for name, own, _ in drawn.points if own == body)


def examine(seed: int) -> list[list[str]]:
    """Return the answers to the sketches of each mechanism of a structure."""
    rng = np.random.default_rng((seed, 7))
    found = structure(rng, wheels=seed % 4 == 3)
    drawn = draw(found, rng, SETS, near=0.0)
    numbers = [n for n, _ in drawn.mechanisms[0].numbers()]
    held = CacheOwner(frozenset(n for n in numbers if n.count(".") == 2 and n.startswith("J")))
    return [
        [f"{found.name} {seed} set {i} {text}" if text else "" for text in answers]
        for i in range(SETS)
        for answers in [of_mechanism(drawn, i, held, rng)]
        if answers
    ]


def main() -> int:
    options = attack.parser(__doc__ or "", 500, "mechanisms").parse_args()
    wrong: list[str] = []
    mechanisms, sketches, seed = 0, 0, options.seed
    figures: dict[str, Any] = {}
    with attack.processes(options.workers) as run:
        while mechanisms < options.count:
            jobs = [(k,) for k in range(seed, seed + PORTION)]
            seed += PORTION
            for answers in run(examine, jobs):
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

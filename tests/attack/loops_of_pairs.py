"""Single loops of all sequences of R, P, C, S, U: is a regular pose refused, is a pose wrong?

python -m tests.attack.loops_of_pairs --sets 200 --longest 4 --out FILE

Points, axes and bodies lie anywhere; the loop is closed in the pose drawn, which is sketched. The
truth is a closure of its own: products of rigid motions, whose twists say by their singular values
whether a pose is regular, and Newton's method with them where it leads.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses
import itertools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.motion.kinematics.shapes import Held, held_by
from tests.attack.spatial_honesty import Case, case

FREEDOMS = {"R": 1, "P": 1, "C": 2, "U": 2, "S": 3}
WORDS = {"R": ("angle",), "P": ("slide",), "C": ("angle", "slide"), "U": ("angle", "angle2")}
REGULAR = 0.01
"""Least singular value of the twists of a pose that is regular; lengths are about 1."""
REACH, POSES = 0.02, 3


def sequences(longest: int) -> list[str]:
    """Return the loops of three and more pairs that move, each in one of its two directions."""
    found = []
    for count in range(3, longest + 1):
        for letters in itertools.product("RPCSU", repeat=count):
            loop = "".join(letters)
            if loop <= loop[::-1] and mobility(loop) >= 1:
                found.append(loop)
    return found


def spins(loop: str) -> int:
    """Return how many parts between two ball joints spin freely: those without the ground."""
    return max(loop.count("S") - 1, 0)


def mobility(loop: str) -> int:
    return sum(FREEDOMS[letter] for letter in loop) - 6 - spins(loop)


def skew(a: Any) -> Any:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def turn(a: Any) -> Any:
    """Return the rotation by a vector."""
    size = float(np.linalg.norm(a))
    if size == 0:
        return np.eye(3)
    K = skew(a / size)
    return np.eye(3) + np.sin(size) * K + (1 - np.cos(size)) * K @ K


@dataclass
class Freedom:
    """One freedom of a pair: axis and place in the pose drawn, whether it turns, its name."""

    joint: int
    word: str
    axis: Any
    place: Any
    turns: bool

    def motion(self, q: float) -> Any:
        T = np.eye(4)
        if self.turns:
            T[:3, :3] = turn(self.axis * q)
            T[:3, 3] = self.place - T[:3, :3] @ self.place
        else:
            T[:3, 3] = self.axis * q
        return T

    def twist(self, T: Any) -> Any:
        """Return turn and shift of the origin by this freedom, moved by T."""
        axis = T[:3, :3] @ self.axis
        if not self.turns:
            return np.concatenate([np.zeros(3), axis])
        place = T[:3, :3] @ self.place + T[:3, 3]
        return np.concatenate([axis, np.cross(place, axis)])


class Truth:
    """The loop as a product of motions about the pose drawn, where all coordinates are zero."""

    def __init__(self, found: Case) -> None:
        self.loop, self.free = found.name, list[Freedom]()
        self.case = found
        for k, letter in enumerate(self.loop):
            joint, place = found.mechanism.joints[f"J{k}"], found.planted[f"P{k}"]
            R = found.frames[joint.first_body][1]
            if letter == "S":
                for axis in np.eye(3):
                    self.free.append(Freedom(k, "", axis, place, True))
                continue
            a, n = R @ np.array(joint.axis, float), R @ np.array(joint.zero, float)
            for word in WORDS[letter]:
                axis = n if word == "angle2" else a
                self.free.append(Freedom(k, word, axis, place, word != "slide"))
        self.drivers: list[tuple[str, Any]] = []

    def places(self, q: Any) -> tuple[list[Any], Any]:
        """Return the motions of the bodies and of the end of the loop, and all twists (6, n)."""
        T, bodies, columns, last = np.eye(4), [], [], 0
        for own, value in zip(self.free, q, strict=True):
            if own.joint != last:
                bodies.append(T.copy())
                last = own.joint
            columns.append(own.twist(T))
            T = T @ own.motion(value)
        return [*bodies, T], np.array(columns).T

    def point(self, k: int, bodies: list[Any]) -> Any:
        place = self.case.planted[f"P{k + 1}"]
        return bodies[k][:3, :3] @ place + bodies[k][:3, 3]

    def rows(self, q: Any) -> tuple[Any, Any]:
        """Return values and slopes of the drivers: coordinates of pairs, of a point of body b1."""
        bodies, twists = self.places(q)
        values, slopes = [], []
        for _, own in self.drivers:
            if isinstance(own, int):
                values.append(q[own])
                slopes.append(np.eye(len(q))[own])
                continue
            k, axis = own
            place = self.point(k, bodies)
            moves = np.array([f.joint <= k for f in self.free], float)
            shift = (twists[3:] + np.cross(twists[:3].T, place).T) * moves
            values.append(place[axis])
            slopes.append(shift[axis])
        return np.array(values), np.array(slopes)

    def jacobian(self, q: Any) -> Any:
        return np.vstack([self.places(q)[1], self.rows(q)[1]])

    def least(self, q: Any) -> float:
        """Return the least singular value but for the spins."""
        return float(np.linalg.svd(self.jacobian(q), compute_uv=False)[-1])

    def choose(self, rng: Any) -> bool:
        """Choose drivers at random for all freedoms; return whether the pose drawn is regular."""
        named = [i for i, own in enumerate(self.free) if own.word]
        choices: list[tuple[str, Any]] = []
        for i in rng.permutation(named):
            own = self.free[i]
            choices.append((f"J{own.joint}.{own.word}", int(i)))
        for k in range(len(self.loop) - 1):
            if spins(self.loop) and self.loop[k + 1] != "S":
                continue  # a point beside the line would drive a spin
            choices += [(f"b{k + 1}.P{k + 1}.{w}", (k, j)) for j, w in enumerate("xyz")]
        return self._chosen(choices)

    def _chosen(self, choices: list[tuple[str, Any]]) -> bool:
        self.drivers, zero = [], np.zeros(len(self.free))
        for one in choices:
            before = list(self.drivers)
            self.drivers = [*before, one]
            if self.least(zero) < 5 * REGULAR:
                self.drivers = before
            if len(self.drivers) == mobility(self.loop):
                return True
        return False

    def followed(self, wanted: Any) -> Any:
        """Return the coordinates where drivers have some values, from the pose drawn, or None."""
        q = np.zeros(len(self.free))
        start = self.rows(q)[0]
        for share in np.linspace(0, 1, 6)[1:]:
            for _ in range(8):
                T = self.places(q)[0][-1]
                turned = [T[2, 1] - T[1, 2], T[0, 2] - T[2, 0], T[1, 0] - T[0, 1]]
                off = self.rows(q)[0] - (start + share * (wanted - start))
                gap = np.concatenate([np.array(turned) / 2, T[:3, 3], off])
                q = q - np.linalg.lstsq(self.jacobian(q), gap, rcond=None)[0]
        return q if np.abs(gap).max() < 1e-12 else None


def mechanism_of(found: Case) -> md.Mechanism:
    """Return the mechanism with all slides sketched too."""
    sketch = dict(found.mechanism.sketch)
    sketch |= {f"J{k}.slide": 0.0 for k, letter in enumerate(found.name) if letter in "PC"}
    sketch |= {f"J{k}.angle2": 0.0 for k, letter in enumerate(found.name) if letter == "U"}
    return dataclasses.replace(found.mechanism, sketch=sketch)


def judged(truth: Truth, held: Held, words: collections.Counter[str]) -> None:
    """Count what is said of the pose drawn and of those beside it."""
    names = [name for name, _ in truth.drivers]
    start = truth.rows(np.zeros(len(truth.free)))[0]
    ways = [
        md.Driver(name, from_=u - REACH, to=u + REACH) for name, u in zip(names, start, strict=True)
    ]
    task = md.Sweep(drivers=ways, poses=POSES, derivatives=0)
    at = [start + REACH * (2 * j / (POSES - 1) - 1) for j in range(POSES)]
    q = [truth.followed(u) for u in at]
    regular = [own is not None and truth.least(own) > REGULAR for own in q]
    if not all(regular):
        words["not regular"] += 1
        return
    try:
        with held_by(held):
            result = md.solve(mechanism_of(truth.case), task)
    except md.MechdaeError as error:
        words[f"{type(error).__name__}: {error.what[:60]}"] += 1
        return
    for j, status in enumerate(result.status):
        words[str(status)] += 1
        if status == "ok":
            words["wrong"] += int(off(truth, result, j, q[j]) > result.bound.length[j] + 1e-12)


def off(truth: Truth, result: md.Result, j: int, q: Any) -> float:
    """Return how far reported points are from the followed ones; those that spin have no place."""
    bodies, _ = truth.places(q)
    worst = 0.0
    for k in range(len(truth.loop) - 1):
        for point in (k, k + 1):
            name = f"b{k + 1}.P{point}"
            if name in result.points:
                place = truth.case.planted[f"P{point}"]
                own = bodies[k][:3, :3] @ place + bodies[k][:3, 3]
                worst = max(worst, float(np.abs(result.points[name].position[j] - own).max()))
    return worst


def run(loop: str, sets: int, seed: int) -> collections.Counter[str]:
    """Return how many sets of one sequence fare how."""
    words: collections.Counter[str] = collections.Counter()
    rng = np.random.default_rng([seed, *map(ord, loop)])
    held: dict[tuple[str, ...], Held] = {}
    while words["sets"] < sets:
        truth = Truth(case(rng, loop))
        if not truth.choose(rng):
            words["no choice"] += 1
            if words["no choice"] > 20 + 5 * words["sets"]:
                break
            continue
        words["sets"] += 1
        names = tuple(name for name, _ in truth.drivers)
        numbers = [n for n, _ in truth.case.mechanism.numbers()]
        free = frozenset(n for n in numbers if n.count(".") == 2 and n.startswith("J"))
        judged(truth, held.setdefault(names, Held(free)), words)
    return words


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--longest", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--loops", nargs="*")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    whole: collections.Counter[str] = collections.Counter()
    table = {}
    for loop in options.loops or sequences(options.longest):
        found = run(loop, options.sets, options.seed)
        whole += found
        table[loop] = dict(found)
        bad = {
            w: n
            for w, n in found.items()
            if w not in ("ok", "sets", "not regular", "no choice") and n
        }
        if bad:
            print(loop, bad, flush=True)
    print(dict(whole))
    if options.out:
        options.out.write_text(json.dumps({"whole": dict(whole), "loops": table}, indent=1) + "\n")


if __name__ == "__main__":
    main()

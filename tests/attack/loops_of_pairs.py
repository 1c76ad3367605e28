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
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

import mechdae as md
from mechdae.motion.kinematics.prepared import CacheOwner, keep_for
from tests.attack.spatial_honesty import Case, case

FREEDOMS = {"R": 1, "P": 1, "C": 2, "U": 2, "S": 3}
WORDS = {"R": ("angle",), "P": ("slide",), "C": ("angle", "slide"), "U": ("angle", "angle2")}
REGULAR = 0.01
"""Least singular value of the twists of a pose that is regular; lengths are about 1."""
REACH, POSES = 0.02, 3
STEPS, JUMP = 25, 0.25
"""Steps from the drawn pose, and the largest that is one along a motion."""
PORTION = 50
"""Sets with the same drivers, of one structure."""
Drivers: TypeAlias = "list[tuple[str, int | tuple[int, int]]]"
"""Names, and which freedom or which body's coordinate each is."""


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
    """Return the matrices (..., 3, 3) of cross products with vectors (..., 3)."""
    return np.cross(np.asarray(a, float)[..., None, :], np.eye(3)).swapaxes(-1, -2)


def turn(a: Any) -> Any:
    """Return the rotations (..., 3, 3) by vectors (..., 3)."""
    K, size = skew(a), np.linalg.norm(a, axis=-1)[..., None, None]
    shares = np.sinc(size / np.pi), np.sinc(size / (2 * np.pi)) ** 2 / 2
    return np.eye(3) + shares[0] * K + shares[1] * (K @ K)


@dataclass
class Freedom:
    """One freedom of a pair: axes and places (n, 3) in the poses drawn, whether it turns."""

    joint: int
    word: str
    axis: Any
    place: Any
    turns: bool

    def motion(self, q: Any) -> Any:
        """Return the motions (n, 4, 4) by values (n,)."""
        T = np.zeros((len(q), 4, 4))
        T[:, range(4), range(4)] = 1.0
        way = self.axis * q[:, None]
        if self.turns:
            T[:, :3, :3] = R = turn(way)
            way = self.place - np.einsum("nij,nj->ni", R, self.place)
        T[:, :3, 3] = way
        return T

    def twist(self, T: Any) -> Any:
        """Return turns and shifts (n, 6) of the origin by this freedom, moved by T."""
        axis = np.einsum("nij,nj->ni", T[:, :3, :3], self.axis)
        if not self.turns:
            return np.concatenate([np.zeros_like(axis), axis], axis=1)
        return np.concatenate([axis, np.cross(_carried(T, self.place), axis)], axis=1)


def _carried(T: Any, place: Any) -> Any:
    """Return points (n, 3) moved by motions."""
    return np.einsum("nij,nj->ni", T[:, :3, :3], place) + T[:, :3, 3]


class Truth:
    """Loops of one sequence as products of motions about the poses drawn, all coordinates zero."""

    def __init__(self, cases: Sequence[Case]) -> None:
        self.cases, self.loop, self.free = list(cases), cases[0].name, list[Freedom]()
        for k, letter in enumerate(self.loop):
            joints = [own.mechanism.joints[f"J{k}"] for own in cases]
            place = np.array([own.planted[f"P{k}"] for own in cases])
            if letter == "S":
                self.free += [Freedom(k, "", way + 0 * place, place, True) for way in np.eye(3)]
                continue
            R = np.array(
                [own.frames[j.first_body][1] for own, j in zip(cases, joints, strict=True)]
            )
            a = np.einsum("nij,nj->ni", R, np.array([j.axis for j in joints], float))
            n = np.einsum("nij,nj->ni", R, np.array([j.zero for j in joints], float))
            for word in WORDS[letter]:
                axis = n if word == "angle2" else a
                self.free.append(Freedom(k, word, axis, place, word != "slide"))
        self.zero = np.zeros((len(cases), len(self.free)))

    def places(self, q: Any) -> tuple[list[Any], Any]:
        """Return the motions of the bodies and of the loops' ends, and all twists (n, 6, F)."""
        T, bodies, columns, last = np.tile(np.eye(4), (len(q), 1, 1)), [], [], 0
        for own, value in zip(self.free, q.T, strict=True):
            if own.joint != last:
                bodies.append(T)
                last = own.joint
            columns.append(own.twist(T))
            T = T @ own.motion(value)
        return [*bodies, T], np.stack(columns, axis=2)

    def rows(self, q: Any, drivers: Drivers, found: Any = None) -> tuple[Any, Any]:
        """Return values (n, d) and slopes of drivers: coordinates of pairs, of points of bodies."""
        bodies, twists = found or self.places(q)
        values, slopes = (
            np.zeros((len(q), len(drivers))),
            np.zeros((len(q), len(drivers), q.shape[1])),
        )
        for d, (_, own) in enumerate(drivers):
            if isinstance(own, int):
                values[:, d], slopes[:, d, own] = q[:, own], 1.0
                continue
            k, axis = own
            place = self.point(k + 1, k, bodies)
            moves = np.array([f.joint <= k for f in self.free], float)
            turned = np.cross(twists[:, :3], place[:, :, None], axis=1)
            values[:, d] = place[:, axis]
            slopes[:, d] = (twists[:, 3:] + turned)[:, axis] * moves
        return values, slopes

    def point(self, j: int, k: int, bodies: list[Any]) -> Any:
        """Return the places (n, 3) of a pair's point on body k."""
        return _carried(bodies[k], np.array([own.planted[f"P{j}"] for own in self.cases]))

    def least(self, q: Any, drivers: Drivers) -> Any:
        """Return the least singular values (n,) but for the spins."""
        found = self.places(q)
        J = np.concatenate([found[1], self.rows(q, drivers, found)[1]], axis=1)
        return np.linalg.svd(J, compute_uv=False)[:, -1]

    def choose(self, rng: Any) -> Drivers:
        """Return drivers chosen at random for all freedoms of the first loop, none if it fails."""
        named = [i for i, own in enumerate(self.free) if own.word]
        choices: Drivers = []
        for i in rng.permutation(named):
            own = self.free[i]
            choices.append((f"J{own.joint}.{own.word}", int(i)))
        for k in range(len(self.loop) - 1):
            if spins(self.loop) and self.loop[k + 1] != "S":
                continue  # a point beside the line would drive a spin
            choices += [(f"b{k + 1}.P{k + 1}.{w}", (k, j)) for j, w in enumerate("xyz")]
        drivers: Drivers = []
        for one in choices:
            if self.least(self.zero, [*drivers, one])[0] > 5 * REGULAR:
                drivers.append(one)
            if len(drivers) == mobility(self.loop):
                return drivers
        return []

    def followed(self, drivers: Drivers, by: float) -> tuple[Any, Any]:
        """Return where drivers are further `by` all, from the poses drawn, and which led there."""
        q = self.zero
        start = self.rows(q, drivers)[0]
        led = np.full(len(q), True)
        for share in np.linspace(0, 1, STEPS + 1)[1:]:
            before = q
            for _ in range(8):
                found = self.places(q)
                T, twists = found[0][-1], found[1]
                values, slopes = self.rows(q, drivers, found)
                turned = np.stack([T[:, i, j] - T[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], 1)
                gap = np.concatenate([turned / 2, T[:, :3, 3], values - start - share * by], axis=1)
                J = np.concatenate([twists, slopes], axis=1)
                q = q - np.einsum("nij,nj->ni", np.linalg.pinv(J), gap)
                q = np.clip(q, -10, 10)
            led &= np.abs(q - before).max(1) < JUMP  # at a fold it would go on elsewhere
        return q, led & (np.abs(gap).max(1) < 1e-12)


def mechanism_of(found: Case) -> md.Mechanism:
    """Return the mechanism with all slides sketched too."""
    sketch = dict(found.mechanism.sketch)
    sketch |= {f"J{k}.slide": 0.0 for k, letter in enumerate(found.name) if letter in "PC"}
    sketch |= {f"J{k}.angle2": 0.0 for k, letter in enumerate(found.name) if letter == "U"}
    return dataclasses.replace(found.mechanism, sketch=sketch)


def judged(
    found: Case, drivers: Drivers, start: Any, poses: list[dict[str, Any]], held: CacheOwner
) -> collections.Counter[str]:
    """Return what is said of the pose drawn and of those beside it, whose points are known."""
    words: collections.Counter[str] = collections.Counter()
    ways = [
        md.Driver(name, from_=u - REACH, to=u + REACH)
        for (name, _), u in zip(drivers, start, strict=True)
    ]
    task = md.Sweep(drivers=ways, poses=POSES, derivatives=0)
    try:
        with keep_for(held):
            result = md.solve(mechanism_of(found), task)
    except md.MechdaeError as error:
        words[f"{type(error).__name__}: {error.what[:60]}"] += 1
        return words
    for j, status in enumerate(result.status):
        words[str(status)] += 1
        if status == "ok":
            words["wrong"] += int(off(result, j, poses[j]) > result.bound.length[j] + 1e-12)
    return words


def off(result: md.Result, j: int, places: dict[str, Any]) -> float:
    """Return how far reported points are from the followed ones; those that spin have no place."""
    told = {name: places[name] for name in places if name in result.points}
    return max(
        (float(np.abs(result.points[n].position[j] - at).max()) for n, at in told.items()),
        default=0.0,
    )


def portion(
    loop: str, sets: int, rng: Any, words: collections.Counter[str]
) -> tuple[Truth, Drivers, Any]:
    """Return loops that are regular where they were drawn, with drivers of the first of them."""
    for _ in range(20):
        drivers = Truth([first := case(rng, loop)]).choose(rng)
        if drivers:
            break
        words["no choice"] += 1
    else:
        return Truth([first]), [], []
    cases = [first]
    while len(cases) < sets:
        drawn = Truth([case(rng, loop) for _ in range(sets)])
        least = drawn.least(drawn.zero, drivers)
        cases += [own for own, s in zip(drawn.cases, least, strict=True) if s > 5 * REGULAR]
    truth = Truth(cases[:sets])
    return truth, drivers, truth.rows(truth.zero, drivers)[0]


def run(loop: str, sets: int, seed: int) -> collections.Counter[str]:
    """Return how many sets of one sequence fare how; those of a portion have the same drivers."""
    words: collections.Counter[str] = collections.Counter()
    rng = np.random.default_rng([seed, *map(ord, loop)])
    while words["sets"] < sets:
        truth, drivers, start = portion(loop, min(PORTION, sets - words["sets"]), rng, words)
        if not drivers:
            break
        words["sets"] += len(truth.cases)
        regular, poses = np.full(len(truth.cases), True), []
        for share in np.linspace(-1, 1, POSES):
            q, led = truth.followed(drivers, share * REACH)
            regular &= led & (truth.least(q, drivers) > REGULAR)
            bodies, count = truth.places(q)[0], len(loop)
            poses.append({f"b{k + 1}.P{j}": truth.point(j, k, bodies)
                          for k in range(count - 1) for j in (k, k + 1)})  # fmt: skip
        words["not regular"] += int((~regular).sum())
        numbers = [n for n, _ in truth.cases[0].mechanism.numbers()]
        held = CacheOwner(frozenset(n for n in numbers if n.count(".") == 2 and n.startswith("J")))
        for i in np.flatnonzero(regular):
            known = [{name: at[i] for name, at in own.items()} for own in poses]
            words += judged(truth.cases[i], drivers, start[i], known, held)
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

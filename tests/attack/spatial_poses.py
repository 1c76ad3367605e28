"""Random spatial mechanisms, many of one structure: poses that are `ok` against dual quaternions.

python -m tests.attack.spatial_poses --sets 1000 --most 20 --seed 2 --out FILE

Each structure is built once, and what it makes of many sets of dimensions is compared with a motion
that is followed from the pose in the middle of the sweep in steps of its own, in 80 bits. It can be
stopped, and goes on after the structures that are in the file.
"""

from __future__ import annotations

import argparse
import collections
import json
import time
import traceback
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.motion.kinematics.prepared import CacheOwner, keep_for
from tests.attack.spatial_structures import Drawn, draw, structure, told
from tests.reference.dual_quaternions import EXACT, length, moved, point_of, vector_by
from tests.reference.loop_tracks import tracked

POSES, REACH = 7, 0.3
CHUNK = 250
"""Sets of dimensions that are followed together."""
HOLDING = {
    "revolute": "R", "prismatic": "P", "screw": "H", "cylindrical": "C", "universal": "U",
    "spherical": "S", "planar": "E", "weld": "W", "distance": "D", "gears": "gG", "racks": "kK",
    "wheels with parallel axes": "=", "wheels with axes that meet": "^",
    "wheels on a moving link": "o", "two loops": "+", "plates": "plate",
}  # fmt: skip
"""What a structure's name says it holds: letters of its pairs, of wheels and racks, two chains."""
LENGTHS = (".slide", ".length", ".x", ".y")
"""How coordinates end that are lengths."""
WIDE = 1e-9
"""Of the unit of length: bounds above are counted, of poses away from limit positions."""
CLOSED = 1e-6
"""Largest correction of a pose drawn that closes with the dimensions rounded."""
BLURRED = 1e-13
"""Last step of Newton's method above which it has not found a solution: such poses are counted."""


def driver_of(drawn: Any) -> str:
    """Return the coordinate that is driven; of a structure of pairs it is that of a pair."""
    k, word = drawn.structure.driven
    return getattr(drawn.structure, "driver", f"J{k}.{word}")


def solved(
    drawn: Drawn, rng: Any, poses: int, reach: float
) -> tuple[list[Any], collections.Counter[str]]:
    """Return the results of all mechanisms (None: an error), and words of the errors."""
    numbers = [n for n, _ in drawn.mechanisms[0].numbers()]
    free = frozenset(n for n in numbers if n.count(".") == 2 and n.startswith("J"))
    held, found, words = CacheOwner(free), [], collections.Counter[str]()
    name, column = driver_of(drawn), drawn.loops.driven
    for i, mechanism in enumerate(drawn.mechanisms):
        unit = float(drawn.unit[i]) if name.endswith(LENGTHS) else 1.0
        middle = float(drawn.start[0][i, column]) * unit
        way = reach * float(rng.uniform(0.1, 1)) * unit
        driver = md.Driver(name, from_=middle - way, to=middle + way)
        try:
            with keep_for(held):
                task = md.Sweep(driver=driver, poses=poses, derivatives=0)
                found.append(md.solve(mechanism, task))
        except md.SolveError as error:
            words[type(error).__name__] += 1
            found.append(None)
        except md.MechdaeError as error:
            words[f"{type(error).__name__}: {error.what[:60]}"] += 1
            found.append(None)
    return found, words


class Reported:
    """What results say, as arrays of all sets (k, m): driver, status, bound, points, bodies."""

    def __init__(self, drawn: Drawn, results: list[Any], which: list[int]) -> None:
        self.drawn, self.which = drawn, which
        name, own = driver_of(drawn), [results[i] for i in which]
        self.unit = drawn.unit[which]
        self.straight = name.endswith(LENGTHS)
        self.u = np.array([r.drivers[name].position for r in own], EXACT)
        if self.straight:
            self.u /= self.unit[:, None].astype(EXACT)
        self.ok = np.array([[status == "ok" for status in r.status] for r in own])
        self.bound = np.array([r.bound.length for r in own]) / self.unit[:, None]
        self.turned = np.array([_bound_of_turns(r) for r in own])
        self.words = collections.Counter(str(w) for r in own for w in r.status)
        self.points: dict[tuple[int, str], Any] = {}
        for name, body, _ in drawn.points:
            at = f"b{body}.{name}"
            if body and at in own[0].points:
                self.points[body, name] = np.array([r.points[at].position for r in own])
                self.points[body, name] /= self.unit[:, None, None]
        self.turns = {}
        for body in range(1, drawn.structure.bodies + 1):
            if f"b{body}" in own[0].bodies:
                self.turns[body] = np.array([r.bodies[f"b{body}"].orientation for r in own])
        self.limits = [[x for x in r.summary.get("limits", ()) if x is not None] for r in own]
        self.angles = {
            (k, word): np.array([r.joints[f"J{k}"][word] for r in own])
            for k, joint in enumerate(drawn.structure.joints)
            for word in ("angle",)
            if f"J{k}" in own[0].joints and word in own[0].joints[f"J{k}"] and joint.letter in "RHC"
        }

    def state(self, m: Any, sets: Any) -> tuple[Any, Any]:
        """Return the closure's coordinates at the reported poses m (k,) of some sets."""
        drawn, every = self.drawn, np.array(self.which)[sets]
        bodies = self.bodies((sets, m), every, drawn.structure.bodies)
        loops = drawn.loops.chosen(every)
        near = {
            column: values[every]
            for column, values in told(drawn.structure, drawn.loops, drawn.values).items()
        }
        for (k, _), values in self.angles.items():
            near[drawn.loops.column((k, 0))] = values[sets, m]
        c, spins = loops.read(bodies, near)
        return loops.at(c, self.u[sets, m]), spins

    def bodies(self, pick: Any, every: Any, count: int) -> dict[int, Any]:
        """Return the places of bodies (k, 8) at some poses of sets, by points and orientations."""
        drawn, sets = self.drawn, pick[0]
        still = np.zeros((len(sets), 8), EXACT)
        still[:, 0] = 1
        bodies = {0: still}
        for body in range(1, count + 1):
            points = [(n, s) for n, b, s in drawn.points if b == body and (b, n) in self.points]
            q = self.turns[body][pick].astype(EXACT) if body in self.turns else None
            places = [self.points[body, n][pick].astype(EXACT) for n, _ in points[:2]]
            s = [s[every].astype(EXACT) for _, s in points[:2]]
            if q is None:
                q = _in_line(s[1] - s[0], places[1] - places[0])
            q = q / length(q)
            bodies[body] = moved(q, places[0] - vector_by(q, s[0]))
        return bodies

    def errors(self, bodies: list[Any], m: Any, sets: Any) -> tuple[Any, Any]:
        """Return how far points are from their places in bodies (k, 8), and how turned bodies."""
        every, far, off = np.array(self.which)[sets], [], []
        for name, body, s in self.drawn.points:
            if (body, name) in self.points:
                exact = point_of(bodies[body], s[every].astype(EXACT))
                far.append(np.abs(self.points[body, name][sets, m] - exact).max(axis=1))
        for body, turns in self.turns.items():
            q = turns[sets, m]
            same = np.sign((q * bodies[body][:, :4]).sum(axis=1, keepdims=True))
            off.append(2 * length(q - same * bodies[body][:, :4])[:, 0])
        return np.max(far, axis=0), np.max(off, axis=0)


def _bound_of_turns(result: md.Result) -> Any:
    return result.bound["angle"] if "angle" in result.bound else np.full(len(result), np.inf)


def _in_line(s: Any, way: Any) -> Any:
    """Return a turn that takes directions s to others: of a link that spins freely."""
    s, way = s / length(s), way / length(way)
    return np.concatenate([1 + (s * way).sum(-1, keepdims=True), np.cross(s, way)], axis=-1)


def judged(
    drawn: Any, rng: Any, poses: int = POSES, reach: float = REACH, kind: Any = None
) -> collections.Counter[str]:
    """Return counts: poses that are ok, those that are wrong, and other words.

    ``kind`` reads results of other structures than those of `spatial_structures`, as `Reported`.
    """
    results, words = solved(drawn, rng, poses, reach)
    which = [i for i, result in enumerate(results) if result is not None]
    words["mechanisms"] += len(which)
    words["lost"] += _lost(drawn, results)
    if not which:
        return words
    own = (kind or Reported)(drawn, results, which)
    words.update(own.words)
    middle = poses // 2
    first = (np.abs(np.arange(poses) - middle) + np.where(own.ok, 0, poses)).argmin(axis=1)
    sets = np.flatnonzero(own.ok.any(axis=1))
    if len(sets):
        seen = _followed(own, first[sets], sets, words)
        words["tracked"] += int((seen & own.ok).sum())
        _closed(own, seen, words)
        words["planted"] += _planted(own, drawn, first, sets)
    words["wide"] += int((own.ok & _far(own) & (own.bound > WIDE)).sum())
    return words


def _lost(drawn: Any, results: list[Any]) -> int:
    """Return how many mechanisms close at the pose drawn, and have none that is ok."""
    lost = [i for i, r in enumerate(results) if r is None or "ok" not in list(r.status)]
    if not lost:
        return 0
    loops, near = drawn.loops.chosen(np.array(lost)), drawn.start[0][lost]
    with np.errstate(all="ignore"):
        c, _, first, last = loops.newton(near, {k: q[lost] for k, q in drawn.start[1].items()})
        there = (first < CLOSED) & (last <= BLURRED) & (np.abs(c - near).max(axis=1) < CLOSED)
    return int(there.sum())


def _followed(own: Reported, first: Any, sets: Any, words: Any) -> Any:
    """Compare poses with tracks from the `first` that is ok; return which were reached (k, m)."""
    loops = own.drawn.loops.chosen(np.array(own.which)[sets])
    with np.errstate(all="ignore"):
        state = loops.newton(*own.state(first, sets))
    poses, seen = own.ok.shape[1], np.zeros(own.ok.shape, bool)
    for sense in (0, 1, -1):
        ahead = sense * np.arange(1, poses) if sense else np.zeros(1, int)
        goals = np.clip(first[:, None] + ahead, 0, poses - 1)
        found, reached = tracked(loops, state[:2], own.u[sets[:, None], goals])
        for j, pose in enumerate(found):
            m = goals[:, j]
            here = reached[:, j] & ~seen[sets, m]
            _compare(own, loops, pose, m, sets, here, words)
            words["refused"] += int((here & ~own.ok[sets, m]).sum())
            seen[sets, m] |= here
    return seen


def _closed(own: Reported, seen: Any, words: Any) -> None:
    """Compare poses that no track has reached, next to a fold mostly, with the closure there."""
    sets, m = np.nonzero(own.ok & ~seen)
    if not len(sets):
        return
    loops = own.drawn.loops.chosen(np.array(own.which)[sets])
    with np.errstate(all="ignore"):
        c, spins, _, last = loops.newton(*own.state(m, sets))
    here = last <= BLURRED
    words["blurred"] += int((~here).sum())
    words["closed"] += int(here.sum())
    _compare(own, loops, (c, spins, last), m, sets, here, words)


def _compare(
    own: Reported, loops: Any, pose: Any, m: Any, sets: Any, here: Any, words: Any
) -> None:
    """Count the poses that are ok and outside of their bound."""
    c, spins, last = pose
    here = here & own.ok[sets, m]
    if not here.any():
        return
    with np.errstate(all="ignore"):
        bodies = loops.placed(c, spins)[0]
        far, off = own.errors(bodies, m, sets)
        left = 8 * last  # of the closure itself
        bad = here & ~(far - left <= own.bound[sets, m])
        turned = here & ~(off - left <= own.turned[sets, m] + 4e-16)
    words["wrong"] += int(bad.sum())
    words["turned wrong"] += int((turned & ~bad).sum())
    for i in np.flatnonzero(bad | turned)[:3]:
        k = own.which[sets[i]]
        print(
            f"wrong {own.drawn.structure.name} set {k} ({own.drawn.near[k]}) pose {m[i]}:", end=" "
        )
        print(f"{float(far[i]):.2e} of {own.bound[sets[i], m[i]]:.2e}", end=" ")
        print(f"{float(off[i]):.2e} of {own.turned[sets[i], m[i]]:.2e}", flush=True)


def _far(own: Reported) -> Any:
    """Return which poses are away from limit positions."""
    far = np.ones(own.ok.shape, bool)
    for k, limits in enumerate(own.limits):
        for limit in limits:
            scale = own.unit[k] if own.straight else 1.0
            far[k] &= np.abs(own.u[k] - limit / scale) > 0.01
    return far


def _planted(own: Reported, drawn: Drawn, at: Any, sets: Any) -> int:
    """Return of how many sets the pose in the middle is the one that was drawn."""
    middle = own.ok.shape[1] // 2
    sets = sets[at[sets] == middle]
    if not len(sets):
        return 0
    loops = drawn.loops.chosen(np.array(own.which)[sets])
    start = (
        drawn.start[0][np.array(own.which)[sets]],
        {k: q[np.array(own.which)[sets]] for k, q in drawn.start[1].items()},
    )
    far, _ = own.errors(loops.placed(*start)[0], np.full(len(sets), middle), sets)
    return int((far < 1e-6).sum())


def main() -> None:
    run(str(__doc__), structure, draw, judged, by_kind, wheels=True)


def run(
    text: str, structures: Any, sets_of: Any, judge: Any, table: Any, wheels: bool = False
) -> None:
    """Draw structures and sets of them, judge these, write the counts: the command line.

    Parameters
    ----------
    text
        Description of the command.
    structures, sets_of, judge
        What `structure`, `draw` and `judged` are.
    table
        From entries of structures to counts of those that have something in common.
    wheels
        Whether ``structures`` may be asked for those with wheels alone.
    """
    parser = argparse.ArgumentParser(description=text)
    parser.add_argument("--structures", type=int, default=400)
    parser.add_argument("--sets", type=int, default=250)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--near", type=float, default=0.3, help="share of nearly singular sets")
    parser.add_argument("--poses", type=int, default=POSES)
    parser.add_argument("--reach", type=float, default=REACH)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="of CPU time at most")
    parser.add_argument(
        "--most",
        type=float,
        default=float("inf"),
        help="seconds of CPU time after which a structure gets no more sets",
    )
    if wheels:
        parser.add_argument(
            "--wheels", action="store_true", help="structures with wheels and racks"
        )
    parser.add_argument("--chunk", type=int, default=CHUNK, help="sets that are drawn together")
    parser.add_argument("--out", type=Path, help="a JSON file for the counts")
    options = parser.parse_args()
    kept = {"near": options.near, "seed": options.seed, "poses": options.poses,
            "reach": options.reach, "sets": options.sets}  # fmt: skip
    if wheels and options.wheels:
        kept["wheels"] = True
    done: list[dict[str, Any]] = []
    if options.out and options.out.exists():
        known = json.loads(options.out.read_text())
        if {name: known.get(name) for name in kept} == kept:
            done = known["structures"]
    for k in range(len(done), options.structures):
        if time.process_time() > options.seconds:
            break
        rng, start = np.random.default_rng((options.seed, k)), time.process_time()
        found = structures(rng, True) if wheels and options.wheels else structures(rng)
        try:
            words = collections.Counter[str]()
            for first in range(0, options.sets, options.chunk):
                count = min(options.chunk, options.sets - first)
                drawn = sets_of(found, rng, count, options.near)
                words.update(judge(drawn, rng, options.poses, options.reach))
                if time.process_time() - start > options.most:
                    break
        except Exception:  # whatever it is, it is no answer to a user
            traceback.print_exc()
            words = collections.Counter({"crash": 1})
        spent = round(time.process_time() - start, 2)
        done.append({"name": found.name, "driven": found.driven[1], "seconds": spent} | dict(words))
        print(k, done[-1], flush=True)
        if options.out:
            _write(options.out, kept, done, table)
    print("all", totals(done))


def totals(done: list[dict[str, Any]]) -> dict[str, int]:
    total: collections.Counter[str] = collections.Counter()
    for own in done:
        total.update({w: n for w, n in own.items() if isinstance(n, int)})
    return dict(total)


def by_kind(done: list[dict[str, Any]]) -> dict[str, dict[str, int]]:
    """Return structures, mechanisms, poses that are ok, wrong and refused that hold each kind."""
    table = {}
    for word, letters in HOLDING.items():
        own = [one for one in done if set(one["name"].split("@")[0]) & set(letters)]
        own = [one for one in own if (one["name"] == "plate") == (word == "plates")]
        table[word] = {"structures": len(own)} | {
            count: sum(one.get(count, 0) for one in own)
            for count in ("mechanisms", "ok", "wrong", "turned wrong", "refused")
        }
    return table


def _write(out: Path, kept: dict[str, Any], done: list[dict[str, Any]], table: Any) -> None:
    rows = ",\n  ".join(json.dumps(own) for own in done)
    counts = {"counts": totals(done), "by kind": table(done)}
    head = json.dumps(kept | {"drawn": len(done)} | counts, indent=1)[:-2]
    out.write_text(f'{head},\n "structures": [\n  {rows}\n ]\n}}\n')


if __name__ == "__main__":
    main()

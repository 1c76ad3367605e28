"""Sets of dimensions of structures of vector loops: a pose is drawn, what it measures is rounded.

Of a share of them the pose is nearly singular. Poses are drawn in 80 bits; the numbers that
vectors, bars and bodies have there are the dimensions, rounded to doubles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import mechdae as md
from tests.attack.spatial_structures import KINDS, Drawn
from tests.attack.vector_net import LETTERS, Net
from tests.reference.dual_quaternions import (
    EXACT,
    FREEDOMS,
    TURN,
    Pair,
    frame,
    length,
    moved,
    place_of,
    product,
    turned_back,
    vector_by,
)
from tests.reference.vector_nets import WORDS as TRIPLE
from tests.reference.vector_nets import Arrow, CacheOwner, Nets, Tie, read_triple

NEAR = ("parallel", "pole", "short", "folded", "folded")
"""What nearly happens, by 1e-9 to 1e-2: two vectors have one direction, a vector is upright, or has
no length, the determinant of the closure vanishes."""


@dataclass
class _Pose:
    """What is drawn of sets: frames of joints, values, turns, places on bodies, triples."""

    pairs: list[Pair]
    frames: dict[tuple[int, int, str], Any]
    values: list[Any]
    spins: dict[int, Any]
    local: dict[int, Any]
    triples: Any


def draw(found: Net, rng: Any, sets: int, near: float = 0.3, mechanisms: bool = True) -> Drawn:
    """Return sets of dimensions of a structure, a share of them nearly singular."""
    pose = _drawn(found, rng, sets)
    words = [str(rng.choice(NEAR)) if rng.uniform() < near else "" for _ in range(sets)]
    shares = 10.0 ** rng.uniform(-9, -2, sets)
    free = _open(found)
    for i, word in enumerate(words):
        if word and free:
            _strain(rng, word, shares[i], pose.triples[i], free)
    if "folded" in words:
        _folded(found, rng, pose, words, shares)
    turned = rng.uniform(size=(sets, len(found.lines))) < 0.2
    loops, start = _closure(found, pose, turned)
    points = [
        (f"P{k}{'ab'[side]}", body, pose.frames[k, side, "s"])
        for k, joint in enumerate(found.joints)
        for side, body in enumerate((joint.first, joint.second))
        if joint.letter != "F"
    ]
    for own in loops.held:
        body, name = found.places[own.point].owners[-1]
        if name.startswith("Q"):
            points.append((name, body, own.place))
    values, at = {}, 0
    for k, joint in enumerate(found.joints):
        count = len(FREEDOMS[joint.letter])
        values[k] = np.stack(pose.values[at : at + count], axis=1)
        at += count
    drawn = Drawn(found, loops, start, [], np.ones(sets), words, points, values)  # type: ignore[arg-type]
    if mechanisms:
        for i in range(sets):
            mechanism, unit = _mechanism(drawn, pose, i)
            drawn.mechanisms.append(mechanism)
            drawn.unit[i] = unit
    return drawn


def _drawn(found: Net, rng: Any, sets: int) -> _Pose:
    frames: dict[tuple[int, int, str], Any] = {}
    pairs, values, spins = [], [], {}
    still = np.zeros((sets, 4), EXACT)
    still[:, 0] = 1
    half = np.sqrt(EXACT(0.5)) * np.array([0, 1, 0, 1], EXACT)  # exchanges x and z
    pitch = rng.uniform(0.1, 0.5, sets) * rng.choice([-1, 1], sets)
    for k, joint in enumerate(found.joints):
        sides, letter = [], joint.letter
        for side in (0, 1):
            s = rng.uniform(-1, 1, (sets, 3)) * (letter != "F")
            axis, zero = (rng.normal(size=(sets, 3)) for _ in range(2))
            axis /= np.linalg.norm(axis, axis=1)[:, None]
            frames[k, side, "s"], frames[k, side, "axis"], frames[k, side, "zero"] = s, axis, zero
            turn = still if letter in "SF" else frame(axis.astype(EXACT), zero.astype(EXACT))
            if letter == "U" and side == 1:  # its axis is the second pin, which is x here
                turn = product(turn, half)
            sides.append(moved(turn, s.astype(EXACT)))
        frames[k, 0, "pitch"] = pitch
        number = pitch.astype(EXACT) / TURN if letter == "H" else None
        pairs.append(Pair(letter, joint.first, joint.second, *sides, number))
        for freedom in FREEDOMS[letter]:
            turns = freedom.split()[0] in ("turn", "screw")
            own = rng.uniform(-3, 3, sets) if turns else rng.uniform(-1, 1, sets)
            values.append(own * (freedom.split()[0] != "spin"))
        if letter in "SF":
            q = rng.normal(size=(sets, 4)).astype(EXACT)
            spins[k] = q / length(q)
    local = {
        i: rng.uniform(-1, 1, (sets, 3)) for i, place in enumerate(found.places) if place.owners
    }
    if found.places[0].owners == ((0, ""),):
        local[0] = np.zeros((sets, 3))
    triples = np.stack(
        [rng.uniform(0.3, 1.5, (sets, len(found.lines))),
         rng.uniform(-1.4, 1.4, (sets, len(found.lines))),
         rng.uniform(-3, 3, (sets, len(found.lines)))], axis=2,
    )  # fmt: skip
    return _Pose(pairs, frames, values, spins, local, triples)


def _open(found: Net) -> list[int]:
    """Return the vectors that are drawn; the others are what is left between two places."""
    known, free = {i for i, place in enumerate(found.places) if place.owners}, []
    for i, line in enumerate(found.lines):
        if not {line.tail, line.head} <= known:
            free.append(i)
        known |= {line.tail, line.head}
    return free


def _strain(rng: Any, word: str, share: float, triples: Any, free: list[int]) -> None:
    """Make two directions nearly one, a vector nearly upright, or without length."""
    k, j = int(rng.choice(free)), int(rng.integers(len(triples)))
    if word == "parallel":
        triples[k, 1:] = triples[j, 1:] + share * rng.uniform(-1, 1, 2)
    elif word == "pole":
        triples[k, 1] = rng.choice([-1, 1]) * (np.pi / 2 - share)
    elif word == "short":
        triples[k, 0] = share


def _folded(found: Net, rng: Any, pose: _Pose, words: list[str], shares: Any) -> None:
    """Move sets to where the determinant vanishes, but for a share of the way to another pose."""
    other = _drawn(found, rng, len(words)).triples
    first = pose.triples.copy()

    def sign(place: Any) -> Any:
        pose.triples = first + place[:, None, None] * (other - first)
        loops, start = _closure(found, pose, np.zeros(first.shape[:2], bool))
        slopes = loops.placed(start[0].astype(float), _plain(start[1]))[2]
        return np.linalg.slogdet(slopes[..., loops.free])[0]

    low, high = np.zeros(len(words)), np.ones(len(words))
    start = sign(low)
    there = (sign(high) != start) & np.array([word == "folded" for word in words])
    for _ in range(52):
        middle = (low + high) / 2
        same = sign(middle) == start
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    place = np.where(there, low - shares, 0.0)
    pose.triples = first + place[:, None, None] * (other - first)
    for i, word in enumerate(words):
        if word == "folded" and not there[i]:
            words[i] = ""


def _plain(spins: dict[int, Any]) -> dict[int, Any]:
    return {k: q.astype(float) for k, q in spins.items()}


def _closure(found: Net, pose: _Pose, turned: Any) -> tuple[Nets, tuple[Any, dict[int, Any]]]:
    """Return the closure of the rounded numbers and the pose that was drawn."""
    sets = len(pose.triples)
    values = np.stack(pose.values, axis=1) if pose.values else np.zeros((sets, 0))
    bodies = _bodies(pose, values, sets)
    local, places = dict(pose.local), {}
    balls = {second: first for kind, first, second in found.ties if kind == "ball"}
    for i, own in enumerate(found.places):
        if own.owners and i not in balls:
            body, name = own.owners[-1]
            if name.startswith("P"):
                local[i] = pose.frames[int(name[1:-1]), "ab".index(name[-1]), "s"]
            places[i] = _world(bodies[body], local[i])
    triples = _spanned(found, pose, places)
    for second, first in balls.items():
        places[second] = places[first]
        local[second] = _inside(bodies[found.places[second].owners[-1][0]], places[first])
    ties = [
        Tie(a, b, length(places[b] - places[a])[:, 0].astype(float) if kind == "bar" else None)
        for kind, a, b in found.ties
    ]
    arrows, columns = [], [values.astype(EXACT)]
    for i, line in enumerate(found.lines):
        unknown = [LETTERS[x] for x in line.unknown]
        own = _other(triples[i], unknown, turned[:, i])
        given = {word: own[word].astype(float) for word in TRIPLE if word not in unknown}
        arrows.append(Arrow(line.tail, line.head, given))
        columns += [own[word][:, None] for word in unknown]
    held = [
        CacheOwner(i, place.owners[-1][0], local[i])
        for i, place in enumerate(found.places)
        if place.owners
    ]
    k, word = found.driven
    place = found.words[k].index(word) if word else 0
    loops = Nets(pose.pairs, arrows, held, ties, (k, place), sets)
    return loops, (np.concatenate(columns, axis=1), pose.spins)


def _bodies(pose: _Pose, values: Any, sets: int) -> list[Any]:
    """Return the places of the ground and of all bodies (sets, 8)."""
    if not pose.pairs:
        still = np.zeros((sets, 8), EXACT)
        still[:, 0] = 1
        return [still]
    alone = Nets(pose.pairs, [], [CacheOwner(0, 0, np.zeros((sets, 3)))], [Tie(0, 0)], (0, 0), sets)
    return alone.placed(values.astype(EXACT), pose.spins)[0].bodies


def _spanned(found: Net, pose: _Pose, places: dict[int, Any]) -> list[dict[str, Any]]:
    """Write where the free points are; return the triples of all vectors, of the last by them."""
    triples = []
    for i, line in enumerate(found.lines):
        size, e, a = (pose.triples[:, i, n].astype(EXACT) for n in range(3))
        own = dict(zip(TRIPLE, (size, e, a), strict=True))
        u = np.stack([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)], axis=1)
        if line.tail in places and line.head in places:
            own = read_triple(places[line.head] - places[line.tail])
        elif line.tail in places:
            places[line.head] = places[line.tail] + size[:, None] * u
        else:
            places[line.tail] = places[line.head] - size[:, None] * u
        triples.append(own)
    return triples


def _other(own: dict[str, Any], unknown: list[str], turned: Any) -> dict[str, Any]:
    """Return the same vectors by another triple where nothing asks for the usual one."""
    pi = TURN / 2
    size, e, a = (own[word] for word in TRIPLE)
    if "length" in unknown and "elevation" not in unknown:
        return {
            "length": np.where(turned, -size, size), "elevation": np.where(turned, -e, e),
            "azimuth": np.where(turned, a + pi, a),
        }  # fmt: skip
    if not {"elevation", "azimuth"} <= set(unknown) and len(unknown) < 2:
        return own | {
            "elevation": np.where(turned, pi - e, e), "azimuth": np.where(turned, a - pi, a)
        }  # fmt: skip
    return own


def _mechanism(drawn: Drawn, pose: _Pose, i: int) -> tuple[md.Mechanism, float]:
    """Return one of the mechanisms, and its unit of length in metres."""
    unit = 2.0**drawn.structure.order
    for _ in range(2):  # the power of two that lengths are divided by is part of a structure
        made = _made(drawn, pose, i, unit)
        if made.order == 2.0**drawn.structure.order:
            return made, unit
        unit *= 2.0**drawn.structure.order / made.order
    return made, unit


def _made(drawn: Drawn, pose: _Pose, i: int, unit: float) -> md.Mechanism:
    found, loops = drawn.structure, drawn.loops
    points: list[dict[str, Any]] = [{} for _ in range(len(found.joints) + 1)]
    for k, joint in enumerate(found.joints):
        if joint.letter != "F":
            for side, body in enumerate((joint.first, joint.second)):
                points[body][f"P{k}{'ab'[side]}"] = (pose.frames[k, side, "s"][i] * unit).tolist()
    for held in loops.held:
        for body, name in found.places[held.point].owners[-1:]:
            if name and not name.startswith("P"):
                points[body][name] = (held.place[i] * unit).tolist()
    c = drawn.start[0][i].astype(float)
    sketch: dict[str, Any] = {}
    for n, words in enumerate(found.words):
        for word in words:
            at = loops.first[n] + words.index(word)
            scale = unit if word in ("slide", "length", "x", "y") else 1.0
            name = f"J{n}" if n < len(found.joints) else f"v{n - len(found.joints)}"
            if name[0] == "v" or word.startswith("angle") or (n, word) == found.driven:
                sketch[f"{name}.{word}"] = float(c[at]) * scale
    bodies = _bodies(pose, drawn.start[0][:, : len(pose.values)], len(pose.triples))
    for body in range(1, len(points)):
        for name, s in points[body].items():
            whole = _world(bodies[body][i : i + 1], np.array([s]) / unit)[0]
            sketch[f"b{body}.{name}"] = (whole.astype(float) * unit).tolist()
    vectors, texts = _texts(drawn, i, unit)
    return md.from_loops(
        vectors,
        texts,
        [md.Node(f"N{n}", _end(found, n)) for n in sorted(found.named)],
        ground=md.Ground(points[0]),
        bodies=[md.Body(f"b{k}", own) for k, own in enumerate(points) if k],
        joints=_joints(drawn, pose, i, unit),
        dimension=3,
        sketch=sketch,
    )


def _end(found: Net, place: int) -> str:
    """Return the end of a vector that is a point."""
    for k, line in enumerate(found.lines):
        for end, own in (("tail", line.tail), ("head", line.head)):
            if own == place:
                return f"v{k}.{end}"
    raise KeyError(place)


def _texts(drawn: Drawn, i: int, unit: float) -> tuple[list[md.Vector], dict[str, Any]]:
    """Return the vectors of one mechanism, with those fixed in bodies, and its loops."""
    found, vectors, texts = drawn.structure, [], {}
    for k, arrow in enumerate(drawn.loops.arrows):
        numbers = {word: float(value[i]) for word, value in arrow.given.items()}
        if "length" in numbers:
            numbers["length"] *= unit
        vectors.append(md.Vector(f"v{k}", **numbers))
    fixed: dict[tuple[int, str, str], str] = {}
    for n, loop in enumerate(found.loops):
        own = []
        for k, sense, there in loop:
            if not there:
                own.append(f"{sense}v{k}")
            elif (k, there, sense) in fixed:
                own.append(f"-{fixed[k, there, sense]}")
            else:
                if (k, sense, there) not in fixed:
                    fixed[k, sense, there] = name = f"s{len(fixed)}"
                    body = f"b{k}" if k else "ground"
                    ends = {"from_": f"{body}.{sense}", "to": f"{body}.{there}"}
                    vectors.append(md.Vector(name, **ends))
                own.append(fixed[k, sense, there])
        texts[f"L{n}"] = tuple(own)
    return vectors, texts


def _joints(drawn: Drawn, pose: _Pose, i: int, unit: float) -> list[Any]:
    found, joints = drawn.structure, []
    for k, joint in enumerate(found.joints):
        if joint.letter == "F":
            continue
        letter, keys = joint.letter, dict[str, Any]()
        body = f"b{joint.first}" if joint.first else "ground"
        ends = [f"{body}.P{k}a", f"b{joint.second}.P{k}b"]
        if letter != "S":
            for word, side, entry in (
                ("axis", 0, "axis"), ("zero", 0, "zero"), ("axis2", 1, "axis"), ("zero2", 1, "zero")
            ):  # fmt: skip
                keys[word] = pose.frames[k, side, entry][i].tolist()
        if letter == "H":
            keys["pitch"] = float(pose.frames[k, 0, "pitch"][i]) * unit
        joints.append(KINDS[letter](f"J{k}", *ends, **keys))
    for n, (kind, *ends) in enumerate(found.ties):
        names = [
            found.point(own) if found.places[own].owners or own in found.named
            else _end(found, own) for own in ends
        ]  # fmt: skip
        if kind == "bar":
            tie = drawn.loops.ties[n]
            joints.append(md.Distance(f"T{n}", *names, length=float(tie.length[i]) * unit))
        else:
            joints.append(md.Spherical(f"T{n}", *names))
    return joints


def _world(body: Any, s: Any) -> Any:
    return vector_by(body[:, :4], s.astype(EXACT)) + place_of(body)


def _inside(body: Any, place: Any) -> Any:
    back = turned_back(body)
    return (vector_by(back[:, :4], place.astype(EXACT)) + place_of(back)).astype(float)

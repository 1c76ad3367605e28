"""Structures of spatial vector loops drawn at random, alone and beside bodies; their dimensions.

Points are joined by paths of vectors, some of them points of the ground, of bodies on joints, or of
a plate that hangs on vectors alone; what is unknown of the vectors is drawn until there is one
freedom. A structure is what many mechanisms have in common. Of each a pose is drawn, in 80 bits;
the numbers that vectors, bars and bodies have there are its dimensions, rounded to doubles.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mechdae as md
from tests.attack.spatial_structures import KINDS, WORDS, Drawn, Joint
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
from tests.reference.vector_nets import Arrow, Held, Nets, Tie, read_triple

PATTERNS = {
    "": 0.18, "l": 0.2, "a": 0.12, "b": 0.17, "la": 0.05, "lb": 0.06, "ab": 0.18, "lab": 0.04,
}  # fmt: skip
"""What is unknown of a vector, and how often: length, elevation (a), azimuth (b)."""
LETTERS = dict(zip("lab", TRIPLE, strict=True))
MEETING = "RUS"
"""Joints whose two points are one place, through which a loop can run."""
NEAR = ("parallel", "pole", "short", "folded", "folded")
"""What nearly happens, by 1e-9 to 1e-2: two vectors have one direction, a vector is upright, or has
no length, the determinant of the closure vanishes."""


@dataclass(frozen=True)
class Place:
    """A point: the bodies that have it, with its names there; of none it is free."""

    owners: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True)
class Line:
    """A vector from place to place and the letters of what is unknown of it."""

    tail: int
    head: int
    unknown: str = ""


@dataclass
class Net:
    """A structure: a joint of each body, 1, 2, ..., places, vectors, ties, loops.

    ``ties`` are ("bar" or "ball", place, place). An entry of a loop is a vector's number and its
    sense, or a body with two points of it. ``driven`` is the number of a joint, or of a vector
    after them, and a word.
    """

    joints: list[Joint]
    places: list[Place]
    lines: list[Line]
    ties: list[tuple[str, int, int]]
    loops: list[list[tuple[int, str, str]]] = field(default_factory=list)
    driven: tuple[int, str] = (0, "")
    named: set[int] = field(default_factory=set)
    order: int = 0
    name: str = ""

    @property
    def bodies(self) -> int:
        return len(self.joints)

    @property
    def driver(self) -> str:
        k, word = self.driven
        return f"J{k}.{word}" if k < len(self.joints) else f"v{k - len(self.joints)}.{word}"

    @property
    def words(self) -> list[tuple[str, ...]]:
        """The words of the coordinates of joints, then of vectors."""
        return [
            *(WORDS.get(joint.letter, ()) for joint in self.joints),
            *(tuple(LETTERS[x] for x in line.unknown) for line in self.lines),
        ]

    def label(self, place: int) -> str:
        """Return what a free point is called in results: after its first end, or as a node."""
        if place in self.named:
            return f"N{place}"
        for i, line in enumerate(self.lines):
            for end, own in (("tail", line.tail), ("head", line.head)):
                if own == place:
                    return f"v{i}_{end}"
        raise KeyError(place)

    def point(self, place: int) -> str:
        """Return the name of a point in results and joints."""
        owners = self.places[place].owners
        if not owners:
            return f"{self.label(place)}.{self.label(place)}"
        body, name = owners[-1]
        return f"b{body}.{name}" if body else f"ground.{name}"


def structure(rng: Any) -> Net:
    """Return any structure of one freedom, on one to three loops or with a plate."""
    while True:
        found = _structure(rng)
        if found is not None and sound(found, rng) and not _needless(found):
            return found


def sound(found: Net, rng: Any) -> bool:
    """Return whether the structure moves with its driver alone, at a pose drawn at random."""
    drawn = draw(found, rng, 3, near=0.0, mechanisms=False)
    _, gaps, slopes = drawn.loops.placed(*drawn.start)
    J = slopes[..., drawn.loops.free]
    if J.shape[1] != J.shape[2] or np.abs(gaps).max() > 1e-12:
        return False
    sizes = np.linalg.svd(J, compute_uv=False)
    return bool((sizes[:, -1] > 1e-4 * sizes[:, 0]).any())


def _structure(rng: Any) -> Net | None:
    kind = str(rng.choice(["loops", "bodies", "plate"], p=[0.5, 0.4, 0.1]))
    made = _Drawing(rng, kind)
    if not made.equations:
        return None
    found = Net(made.joints, made.places, made.lines, made.ties)
    found.order = int(rng.integers(-18, 11))
    need = 1 + made.equations - sum(len(FREEDOMS[joint.letter]) for joint in found.joints)
    letters, odds = list(PATTERNS), np.array(list(PATTERNS.values()))
    for _ in range(200):
        own = [str(x) for x in rng.choice(letters, len(made.lines), p=odds / odds.sum())]
        if sum(map(len, own)) == need:
            break
    else:
        return None
    found.lines = [Line(*ends, x) for ends, x in zip(made.ends, own, strict=True)]
    loops = _loops(rng, found)
    if loops is None:
        return None
    found.loops = loops
    driven = [(k, word) for k, words in enumerate(found.words) for word in words]
    if not driven:
        return None
    found.driven = driven[int(rng.integers(len(driven)))]
    free = [i for i, place in enumerate(found.places) if not place.owners]
    found.named = {i for i in free if rng.uniform() < 0.5}
    joints = "".join(joint.letter for joint in found.joints)
    ties = "".join("=" if tie[0] == "bar" else "o" for tie in found.ties)
    kinds = "-".join(x or "." for x in own)
    found.name = f"{kind} {len(loops)}:{kinds}" + (f"@{joints}" if joints else "") + ties
    return found


def _needless(found: Net) -> bool:
    """Return whether both ends of a vector are fixed, or points of one body: it is refused."""
    still = {i for i, place in enumerate(found.places) if 0 in dict(place.owners)}
    given = [{line.tail, line.head} for line in found.lines if not line.unknown]
    for _ in given:
        still = still.union(*(ends for ends in given if ends & still))
    for line in found.lines:
        ends = {line.tail, line.head}
        bodies = [set(dict(found.places[end].owners)) for end in ends - still]
        if (line.unknown and ends <= still) or (len(bodies) == 2 and bodies[0] & bodies[1]):
            return True
    return False


class _Drawing:
    """Joints, places and the ends of vectors, path by path."""

    def __init__(self, rng: Any, kind: str) -> None:
        self.rng = rng
        self.joints: list[Joint] = []
        self.places: list[Place] = []
        self.ends: list[tuple[int, int]] = []
        self.ties: list[tuple[str, int, int]] = []
        self.lines: list[Line] = []
        self.equations = 0
        if kind == "loops":
            self._loops()
        elif kind == "bodies":
            self._bodies()
        else:
            self._plate()
        self.lines = [Line(*ends) for ends in self.ends]
        if kind != "plate" and rng.uniform() < 0.25:
            self._tie(kind)

    def place(self, *owners: tuple[int, str]) -> int:
        self.places.append(Place(tuple(owners)))
        return len(self.places) - 1

    def on(self, body: int) -> int:
        """Return a new point of a body."""
        return self.place((body, f"Q{len(self.places)}"))

    def path(self, start: int, end: int, count: int) -> None:
        """Join two places by vectors, run in any sense."""
        ways = [start, *(self.place() for _ in range(count - 1)), end]
        for one, other in itertools.pairwise(ways):
            self.ends.append((one, other) if self.rng.uniform() < 0.7 else (other, one))
        self.equations += 3

    def _loops(self) -> None:
        origin = self.place((0, ""))
        self.path(origin, origin, int(self.rng.integers(2, 6)))
        for _ in range(int(self.rng.choice([0, 1, 2], p=[0.35, 0.4, 0.25]))):
            start, end = (int(x) for x in self.rng.choice(len(self.places), 2, replace=False))
            self.path(start, end, int(self.rng.choice([1, 2, 3, 4], p=[0.15, 0.35, 0.35, 0.15])))

    def _bodies(self) -> None:
        rng = self.rng
        for k in range(int(rng.integers(1, 4))):
            parent = int(rng.integers(0, k + 1)) if rng.uniform() < 0.3 else 0
            letter = str(rng.choice(list("RRRRRRPCUSEH")))
            self.joints.append(Joint(letter, parent, k + 1))
            if letter in MEETING and rng.uniform() < 0.8:
                self.place((parent, f"P{k}a"), (k + 1, f"P{k}b"))
        left = list(range(1, len(self.joints) + 1))
        rng.shuffle(left)
        count = int(rng.integers(1, 4))
        while count > 0 or left:
            count -= 1
            start = self.on(left.pop()) if left else self._any()
            end = self.on(left.pop()) if left and rng.uniform() < 0.5 else self._any()
            if start != end:
                self.path(start, end, int(rng.choice([1, 2, 3], p=[0.4, 0.35, 0.25])))

    def _any(self) -> int:
        """Return a place there is, or a new one on any body or on the ground."""
        if self.places and self.rng.uniform() < 0.5:
            return int(self.rng.integers(len(self.places)))
        return self.on(int(self.rng.integers(0, len(self.joints) + 1)))

    def _plate(self) -> None:
        rng = self.rng
        crank = bool(rng.uniform() < 0.5)
        if crank:
            self.joints.append(Joint(str(rng.choice(list("RRRPCU"))), 0, 1))
        plate = len(self.joints) + 1
        self.joints.append(Joint("F", 0, plate))
        corners: list[int] = []
        for k in range(int(rng.integers(3, 7))):
            start = self.on(int(crank and k == 0))
            if len(corners) > 2 and rng.uniform() < 0.3:
                end = corners[int(rng.integers(len(corners)))]
            else:
                end = self.on(plate)
                corners.append(end)
            self.path(start, end, int(rng.choice([1, 2], p=[0.75, 0.25])))

    def _tie(self, kind: str) -> None:
        rng = self.rng
        free = [i for i, place in enumerate(self.places) if not place.owners]
        if not free:
            return
        first = free[int(rng.integers(len(free)))]
        if self.joints and rng.uniform() < 0.5:  # a point of a body at a node, by a ball joint
            second = self.on(int(rng.integers(1, len(self.joints) + 1)))
            self.ties.append(("ball", first, second))
            self.equations += 3
            return
        others = [i for i in free if i != first]
        if others and rng.uniform() < 0.5:
            second = others[int(rng.integers(len(others)))]
        else:
            second = self.on(int(rng.integers(0, len(self.joints) + 1)))
        self.ties.append(("bar", first, second))
        self.equations += 1


def _loops(rng: Any, found: Net) -> list[list[tuple[int, str, str]]] | None:
    """Return loops that pass all vectors and tell which ends meet, None where none do."""
    edges: dict[int, list[tuple[int, tuple[int, str, str]]]] = {
        i: [] for i in range(len(found.places))
    }
    for i, line in enumerate(found.lines):
        edges[line.tail].append((line.head, (i, "", "")))
        edges[line.head].append((line.tail, (i, "-", "")))
    for i, one in enumerate(found.places):
        for j, other in enumerate(found.places):
            if i == j:
                continue
            for body, name in one.owners:
                for own, there in other.owners:
                    if own == body and name and there:
                        edges[i].append((j, (body, name, there)))
    loops: list[list[tuple[int, str, str]]] = []
    done: set[int] = set()
    for i in range(len(found.lines)):
        if i in done:
            continue
        line = found.lines[i]
        back = _way(rng, edges, line.head, line.tail, i)
        if back is None:
            return None
        loop = [(i, "", ""), *back]
        if not _starts(found, loop):
            k = int(rng.integers(len(loop)))
            loop = loop[k:] + loop[:k]
        else:
            while _start(found, loop[0]) != 0:
                loop = loop[1:] + loop[:1]
        loops.append(loop)
        done |= {entry[0] for entry in loop if not entry[2]}
    return loops if _told(found, loops) else None


def _starts(found: Net, loop: list[tuple[int, str, str]]) -> bool:
    """Return whether a loop passes the origin of loops that hang on no point of the ground."""
    return any(_start(found, entry) == 0 for entry in loop)


def _start(found: Net, entry: tuple[int, str, str]) -> int:
    """Return the place where an entry of a loop starts, -1 for one of a body."""
    i, sense, there = entry
    if there:
        return -1
    return found.lines[i].head if sense else found.lines[i].tail


def _way(rng: Any, edges: Any, start: int, end: int, without: int) -> Any:
    """Return the entries of a short way from place to place that does not use a vector."""
    front, before = [start], {start: (start, (0, "", ""))}
    while front and end not in before:
        here = front.pop(0)
        for k in rng.permutation(len(edges[here])):
            there, entry = edges[here][k]
            if there not in before and not (entry[0] == without and not entry[2]):
                before[there] = here, entry
                front.append(there)
    if end not in before:
        return None if start != end else []
    way = []
    while end != start:
        end, entry = before[end]
        way.insert(0, entry)
    return way


def _told(found: Net, loops: list[list[tuple[int, str, str]]]) -> bool:
    """Return whether the loops join all ends at each place, and to a body that has it."""
    root: dict[Any, Any] = {}

    def top(x: Any) -> Any:
        while root.setdefault(x, x) != x:
            x = root[x]
        return x

    for loop in loops:
        if len(loop) < 2:
            return False
        ends = []
        for i, sense, there in loop:
            own = [(i, "tail"), (i, "head")] if not there else [(i, sense, 0), (i, there, 0)]
            ends.append(own[::-1] if sense == "-" and not there else own)
        for k, (start, _) in enumerate(ends):
            root[top(start)] = top(ends[k - 1][1])
    pure = found.places[0].owners == ((0, ""),)
    for number, place in enumerate(found.places):
        own = [
            (i, end)
            for i, line in enumerate(found.lines)
            for end, at in (("tail", line.tail), ("head", line.head))
            if at == number
        ]
        if not own:
            continue
        if place.owners and not (pure and number == 0):
            points = {top((*owner, 0)) for owner in place.owners}
            if not {top(end) for end in own} <= points:
                return False
        elif len({top(end) for end in own}) > 1:
            return False
    return not pure or _origin(found, loops)


def _origin(found: Net, loops: list[list[tuple[int, str, str]]]) -> bool:
    """Return whether the first vector that is given belongs to what hangs on the origin."""
    if _start(found, loops[0][0]) != 0:
        return False
    given = [i for i, line in enumerate(found.lines) if not line.unknown]
    if not given:
        return True
    first = next(i for loop in loops for i, *_ in loop if i in given)
    known = {found.lines[first].tail, found.lines[first].head}
    for _ in given:
        for i in given:
            if known & {found.lines[i].tail, found.lines[i].head}:
                known |= {found.lines[i].tail, found.lines[i].head}
    return 0 in known


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
        Held(i, place.owners[-1][0], local[i])
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
    alone = Nets(pose.pairs, [], [Held(0, 0, np.zeros((sets, 3)))], [Tie(0, 0)], (0, 0), sets)
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

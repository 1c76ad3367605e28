"""Structures of spatial vector loops drawn at random, alone and beside bodies.

Points are joined by paths of vectors, some of them points of the ground, of bodies on joints, or of
a plate that hangs on vectors alone; what is unknown of the vectors is drawn until there is one
freedom. A structure is what many mechanisms have in common.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from tests.attack.spatial_structures import Joint
from tests.attack.vector_net import Line, Net, Place
from tests.attack.vector_sets import draw
from tests.reference.dual_quaternions import FREEDOMS

PATTERNS = {
    "": 0.18, "l": 0.2, "a": 0.12, "b": 0.17, "la": 0.05, "lb": 0.06, "ab": 0.18, "lab": 0.04,
}  # fmt: skip
"""What is unknown of a vector, and how often: length, elevation (a), azimuth (b)."""
MEETING = "RUS"
"""Joints whose two points are one place, through which a loop can run."""


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

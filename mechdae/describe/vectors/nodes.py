"""Where vectors meet: their ends, joined to nodes by loops that are read head to tail."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence

from mechdae.describe.expression import evaluate
from mechdae.describe.mechanism import GROUND
from mechdae.describe.values import Number
from mechdae.describe.vectors.values import Closure, Node, Vector
from mechdae.errors import InputError, MechdaeError, UnknownName

TAIL, HEAD = "tail", "head"
GAP = 1e-9
"""How far given vectors may miss each other, by their lengths."""


class Merged:
    """Names in classes: which are the same; each class goes by the name that stands first."""

    def __init__(self, names: Iterable[str]) -> None:
        self._of = {name: name for name in names}
        self._rank = {name: rank for rank, name in enumerate(self._of)}

    def first(self, name: str) -> str:
        """Return the name by which the class of `name` goes."""
        while self._of[name] != name:
            name = self._of[name]
        return name

    def merge(self, one: str, other: str) -> None:
        keep, drop = sorted((self.first(one), self.first(other)), key=self._rank.__getitem__)
        self._of[drop] = keep


def signed(entry: str) -> tuple[str, bool]:
    """Return the vector of an entry of a loop, and whether it is run backwards."""
    return (entry[1:].strip(), True) if entry.startswith("-") else (entry.strip(), False)


def check_loops(vectors: Mapping[str, Vector], loops: Mapping[str, tuple[str, ...]]) -> None:
    """Raise for loops of vectors that are not there, or twice there, and for vectors in none."""
    used: set[str] = set()
    for name, entries in loops.items():
        try:
            merged: set[str] = set()
            for position, entry in enumerate(entries):
                vector, _ = signed(entry)
                if vector not in vectors:
                    raise UnknownName("vector", vector, vectors, where=f"[{position}]")
                if vector in merged:
                    raise InputError(
                        f"'{vector}' is in the loop twice", hint="a loop passes each vector once"
                    )
                merged.add(vector)
            if len(merged) < 2:
                raise InputError("a loop of two vectors at least is needed")
            used |= merged
        except MechdaeError as problem:
            raise problem.inside(f"loops.{name}") from None
    for name in vectors:
        if name not in used:
            raise InputError(
                "the vector is in no loop",
                where=f"vectors.{name}",
                hint="write it into a loop of [loops], or delete it",
            )


def nodes_of(vectors: Mapping[str, Vector], loops: Mapping[str, tuple[str, ...]]) -> Merged:
    """Return the nodes: ends ``rod.head`` of vectors and points ``@crank.B`` that are one place."""
    points = [f"@{text}" for v in vectors.values() for text in (v.from_, v.to) if text is not None]
    merged = meeting(vectors, loops, points)
    for name, vector in vectors.items():
        if vector.from_ is not None and vector.to is not None:
            merged.merge(f"{name}.{TAIL}", f"@{vector.from_}")
            merged.merge(f"{name}.{HEAD}", f"@{vector.to}")
    for name, entries in loops.items():
        for entry in entries:
            start, end = _ends(entry)
            if merged.first(start) == merged.first(end):
                raise InputError(
                    f"head and tail of '{signed(entry)[0]}' meet",
                    where=f"loops.{name}",
                    hint="loops read head to tail; a minus sign runs a vector backwards",
                )
    return merged


def meeting(
    vectors: Iterable[str], loops: Mapping[str, Iterable[str]], points: Iterable[str] = ()
) -> Merged:
    """Return the ends of vectors, and further points, in classes of those that meet in loops."""
    merged = Merged([*(f"{name}.{end}" for name in vectors for end in (TAIL, HEAD)), *points])
    for entries in loops.values():
        ends = [_ends(entry) for entry in entries]
        for (_, end), (start, _) in zip(ends, [*ends[1:], ends[0]], strict=True):
            merged.merge(end, start)
    return merged


def check_meeting(
    vector: Vector, first: Sequence[Number], second: Sequence[Number], known: Mapping[str, float]
) -> None:
    """Raise for a loop of given vectors that does not close: two places of the end of one."""
    both = zip(first, second, strict=True)
    gap = max(abs(evaluate(a, known) - evaluate(b, known)) for a, b in both)
    if gap > GAP * abs(evaluate(vector.length or 0.0, known)):
        raise InputError(
            f"given vectors do not close: '{vector.name}' ends {gap:.6g} m from where others "
            "put it",
            where=f"vectors.{vector.name}",
            hint="correct one of them, or leave out what the loop has to find",
        )


def check_names(closure: Closure, *words: str) -> None:
    """Raise for vectors that are called like a joint, a node, a body or the fixed link."""
    taken: dict[str, Container[str]] = {
        "joint": closure.joints, "node": closure.nodes, "body": closure.bodies,
        "fixed link": (GROUND,),
    }  # fmt: skip
    for name in closure.vectors:
        for word in words:
            if name in taken[word]:
                more = '; a vector of a body is v = { from = "body.A", to = "body.B" }'
                raise InputError(
                    f"a {word} is called '{name}' too",
                    where=f"vectors.{name}",
                    hint="rename one of them" + (more if word == "body" else ""),
                )


def place_of(text: str, closure: Closure, where: str) -> tuple[Number, ...]:
    """Return the place of a point ``body.point`` in its body, or raise `UnknownName`."""
    body, point = text.split(".")
    if body != GROUND and body not in closure.bodies:
        raise UnknownName("body", body, [GROUND, *closure.bodies], where=where)
    points = closure.points(body)
    if point not in points:
        raise UnknownName("point", text, [f"{body}.{name}" for name in points], where=where)
    return points[point]


def check_node(name: str, node: Node, vectors: Mapping[str, Vector]) -> None:
    """Raise for a node that is at no end of a vector."""
    vector, end = node.at.split(".")
    if vector not in vectors:
        raise UnknownName("vector", vector, vectors, where=f"nodes.{name}.at")
    if end not in (TAIL, HEAD):
        ends = [f"{vector}.{known}" for known in (HEAD, TAIL)]
        raise UnknownName("end", node.at, ends, where=f"nodes.{name}.at")


def check_tied(
    loops: Mapping[str, tuple[str, ...]], tails: Mapping[str, str], tied: Container[str]
) -> None:
    """Raise for a loop whose first vector has its tail at none of the nodes `tied` to the rest."""
    for name, entries in loops.items():
        if tails[signed(entries[0])[0]] not in tied:
            raise InputError(
                "the loop shares no vector and no tail with the others: nothing tells where it "
                "lies",
                where=f"loops.{name}",
                hint="let it pass a vector of another loop, the frame for example",
            )


def _ends(entry: str) -> tuple[str, str]:
    """Return where an entry of a loop starts and ends."""
    vector, backwards = signed(entry)
    tail, head = f"{vector}.{TAIL}", f"{vector}.{HEAD}"
    return (head, tail) if backwards else (tail, head)


def in_order(loops: Mapping[str, Iterable[str]]) -> list[str]:
    """Return the vectors in the order in which loops pass them."""
    return list(dict.fromkeys(signed(entry)[0] for entries in loops.values() for entry in entries))


def reached(start: Iterable[str], pairs: Iterable[tuple[str, str]]) -> list[str]:
    """Return what is connected with `start` by `pairs`, the start first."""
    neighbours: dict[str, list[str]] = {}
    for one, other in pairs:
        neighbours.setdefault(one, []).append(other)
        neighbours.setdefault(other, []).append(one)
    found = dict.fromkeys(start)
    front = list(found)
    while front:
        for other in neighbours.get(front.pop(), ()):
            if other not in found:
                found[other] = None
                front.append(other)
    return list(found)

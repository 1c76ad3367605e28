"""A spatial mechanism as closed vector loops of bars and sliding points; cycles of a graph."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import field, fields, replace

from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.spatial import SpatialJoint, largest
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.values import Number, Table
from mechdae.describe.vectors.expand import from_loops
from mechdae.describe.vectors.nodes import HEAD, TAIL, Merged
from mechdae.describe.vectors.values import Node, Vector, add, less, negative
from mechdae.errors import UnavailableError
from mechdae.records import dataclass

Cycle = list[tuple[str, bool]]
"""Edges in the order in which they are passed, and whether from their first end to the second."""


def shortest_cycles(edges: Mapping[str, tuple[str, str]], start: str) -> list[Cycle]:
    """Return independent cycles, as many as there are, shortest first (Horton's set).

    Parameters
    ----------
    edges
        Name -> its two vertices; several edges may join the same two.
    start
        A cycle that passes this vertex begins there.

    Source: J. D. Horton, A polynomial-time algorithm to find the shortest cycle basis of a graph,
    SIAM J. Comput. 16 (1987) 358-366.
    """
    vertices = list(dict.fromkeys([start, *(v for pair in edges.values() for v in pair)]))
    candidates: list[Cycle] = []
    for vertex in vertices:
        paths = _paths(edges, vertex)
        for name, (one, other) in edges.items():
            if one not in paths or other not in paths:
                continue
            there, back = paths[one], paths[other]
            if {edge for edge, _ in there} & {edge for edge, _ in back} or any(
                edge == name for edge, _ in (*there, *back)
            ):
                continue
            candidates.append(
                [*there, (name, True), *((edge, not way) for edge, way in reversed(back))]
            )
    order = {name: k for k, name in enumerate(edges)}
    candidates.sort(key=lambda cycle: (len(cycle), sorted(order[name] for name, _ in cycle)))
    basis: dict[int, int] = {}
    found: list[Cycle] = []
    for cycle in candidates:
        bits = sum(1 << order[name] for name, _ in cycle)
        for top in sorted(basis, reverse=True):
            if bits >> top & 1:
                bits ^= basis[top]
        if bits:
            basis[bits.bit_length() - 1] = bits
            found.append(_from(cycle, edges, start))
    return found


def joined(cycles: list[Cycle], edges: Mapping[str, tuple[str, str]]) -> list[Cycle]:
    """Return cycles of which any two that meet in a vertex alone are also passed as one.

    A cycle that shares no edge with those before it is replaced by its sum with one that it meets.
    """
    found: list[Cycle] = []
    left = list(cycles)
    while left:
        vertices = {vertex for cycle in found for vertex in _starts(cycle, edges)}
        near = (k for k, cycle in enumerate(left) if vertices & {*_starts(cycle, edges)})
        found.append(_passed_with(found, left.pop(next(near, 0)), edges))
    return found


def _passed_with(found: list[Cycle], cycle: Cycle, edges: Mapping[str, tuple[str, str]]) -> Cycle:
    """Return a cycle, with the first that it meets where it shares no edge with any."""
    if {name for other in found for name, _ in other} & {name for name, _ in cycle}:
        return cycle
    starts = {vertex: k for k, vertex in enumerate(_starts(cycle, edges))}
    for other in found:
        for k, vertex in enumerate(_starts(other, edges)):
            if vertex in starts:
                at = starts[vertex]
                return [*other[k:], *other[:k], *cycle[at:], *cycle[:at]]
    return cycle


def _starts(cycle: Cycle, edges: Mapping[str, tuple[str, str]]) -> list[str]:
    return [edges[name][0 if way else 1] for name, way in cycle]


def _paths(edges: Mapping[str, tuple[str, str]], start: str) -> dict[str, Cycle]:
    """Return a shortest path to each vertex, by breadth."""
    paths: dict[str, Cycle] = {start: []}
    front = [start]
    for vertex in front:  # grows while it is read
        for name, (one, other) in edges.items():
            for here, there, way in ((one, other, True), (other, one, False)):
                if here == vertex and there not in paths:
                    paths[there] = [*paths[vertex], (name, way)]
                    front.append(there)
    return paths


def _from(cycle: Cycle, edges: Mapping[str, tuple[str, str]], start: str) -> Cycle:
    """Return a cycle that begins at a vertex if it passes there."""
    for k, (name, way) in enumerate(cycle):
        if edges[name][0 if way else 1] == start:
            return cycle[k:] + cycle[:k]
    return cycle


Ends = tuple[str, str]
"""Tail and head as points ``body.point``."""


def bare(joint: Joint) -> bool:
    """Return whether a joint has nothing but its points and its length."""
    return not any(getattr(joint, entry.name) for entry in fields(joint)
                   if entry.name not in ("name", "first", "second", "length"))  # fmt: skip


@dataclass
class SpatialLoops:
    """The vectors of a spatial mechanism, their ends in it, and its loops.

    A bar between two balls is a vector of given length, the sphere of the modules with an unknown
    elevation and azimuth; a point that slides on the ground one of unknown length. Links between
    other joints stay bodies, that loops pass from point to point. Loops without such a vector are
    left to their joints, which hold axes and not points alone.

    ``gone`` are the bodies and joints that vectors stand for, ``beside`` further points of the
    ground.

    Raises
    ------
    UnavailableError
        None of its loops has such a vector.
    """

    base: Problem
    vectors: dict[str, Vector] = field(default_factory=dict)
    ends: dict[str, Ends] = field(default_factory=dict)
    loops: dict[str, list[str]] = field(default_factory=dict)
    gone: set[str] = field(default_factory=set)
    beside: dict[str, tuple[Number, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        joints = self.base.mechanism.joints.values()
        self.words: str = repr(
            (self.base.mechanism.loads, self.base.mechanism.outputs, self.base.tasks)
        )
        self._unknown()
        ends = dict.fromkeys(text for pair in self.ends.values() for text in pair)
        self.places: Merged = Merged([*(t for j in joints for t in (j.first, j.second)), *ends])
        for joint in joints:
            if joint.coincide:
                self.places.merge(joint.first, joint.second)
        self._segments()
        edges = {name: (self.places.first(tail), self.places.first(head))
                 for name, (tail, head) in self.ends.items()}  # fmt: skip
        start = next((e[0] for e in edges.values() if e[0].startswith(f"{GROUND}.")), "")
        balls = {self.places.first(joint.first) for joint in joints if joint.ball}
        cycles = [cycle for cycle in shortest_cycles(edges, start)
                  if any(self.vectors[name].body is None or balls & {*edges[name]}
                         for name, _ in cycle)]  # fmt: skip
        if not cycles:
            self._refuse()
        for k, cycle in enumerate(joined(cycles, edges), start=1):
            self.loops[f"loop_{k}"] = [name if way else f"-{name}" for name, way in cycle]
        passed = {name for cycle in cycles for name, _ in cycle}
        self.vectors = {name: vector for name, vector in self.vectors.items() if name in passed}
        self.ends = {name: self.ends[name] for name in self.vectors}

    # -- vectors --------------------------------------------------------------------------------

    def _unknown(self) -> None:
        """Make the vectors that have something unknown: bars, and points that slide."""
        mechanism = self.base.mechanism
        for joint in mechanism.joints.values():
            if joint.bar and bare(joint):
                self._vector(joint.name, Vector(joint.name, length=joint.length),  # type: ignore[attr-defined]
                             joint.first, joint.second, joint.name)  # fmt: skip
        for name in mechanism.bodies:
            joints = [j for j in mechanism.joints.values() if name in (j.first_body, j.second_body)]
            if self._replaceable(name):
                self._bar(name, joints)
                self._slider(name, joints)
                self._leg(name, joints)

    def _bar(self, body: str, joints: list[Joint]) -> None:
        """Make the vector of a body between a ball and a ball or a cross."""
        points = {joint.ends_at(body)[0]: joint for joint in joints}
        if len(points) == len(joints) == 2 and _turn_freely(*joints):
            (tail, first), (head, second) = points.items()
            vector = Vector(body, length=self._length(tail, head))
            self._vector(body, vector, first.ends_at(body)[1], second.ends_at(body)[1],
                         body, first.name, second.name)  # fmt: skip

    def _slider(self, body: str, joints: list[Joint]) -> None:
        """Make the vector of a body that slides on the ground and holds one point."""
        slides = [joint for joint in joints if _slides(joint) and joint.first_body == GROUND]
        others = [joint for joint in joints if joint not in slides]
        points = {joint.ends_at(body)[0] for joint in others}
        if len(slides) != 1 or len(points) != 1:
            return
        if not all(
            (joint.ball and _smooth(joint)) or (joint.bar and bare(joint)) for joint in others
        ):
            return
        slide, (head,) = slides[0], points
        tail = slide.first if head == slide.second else self._beside(slide, head)
        if tail is not None:
            elevation, azimuth = _angles(slide.axis)  # type: ignore[attr-defined]
            vector = Vector(slide.name, elevation=elevation, azimuth=azimuth)
            balls = (joint.name for joint in others if joint.ball)
            self._vector(slide.name, vector, tail, head, body, slide.name, *balls)

    def _beside(self, slide: Joint, head: str) -> str | None:
        """Return a point of the ground as far from the guide as a point of its slider is.

        None where numbers of frames that are turned against each other are expressions.
        """
        points = self.base.mechanism.bodies[slide.second_body].points
        ground = self.base.mechanism.ground.points[slide.first.split(".")[1]]
        start, end = (points[text.split(".")[1]] for text in (slide.second, head))
        away = tuple(less(b, a) for a, b in zip(start, end, strict=True))
        first, second = (_frame(slide, side) for side in (False, True))
        if first != second:
            if not first or not second or not all(isinstance(x, float) for x in away):
                return None
            parts = [sum(a * float(b) for a, b in zip(row, away, strict=True)) for row in second]
            away = tuple(sum(row[k] * part for row, part in zip(first, parts, strict=True))
                         for k in range(3))  # fmt: skip
        name = f"{slide.name}_{head.split('.')[1]}"
        self.beside[name] = tuple(add(a, b) for a, b in zip(ground, away, strict=True))
        return f"{GROUND}.{name}"

    def _leg(self, body: str, joints: list[Joint]) -> None:
        """Make the vector of a cylinder and its rod, of which nothing is given."""
        slide = next((j for j in joints if _slides(j) and j.first_body == body), None)
        if slide is None or not self._replaceable(slide.second_body):
            return
        rod = [joint for joint in self.base.mechanism.joints.values() if joint is not slide
               and slide.second_body in (joint.first_body, joint.second_body)]  # fmt: skip
        rest = [joint for joint in joints if joint is not slide]
        ends = slide.first, slide.second
        if len(rest) == len(rod) == 1 and _turn_freely(*rest, *rod) and ends == (
            rest[0].ends_at(body)[0], rod[0].ends_at(slide.second_body)[0]
        ):  # fmt: skip
            tail, head = rest[0].ends_at(body)[1], rod[0].ends_at(slide.second_body)[1]
            self._vector(slide.name, Vector(slide.name), tail, head, body, slide.second_body,
                         slide.name, rest[0].name, rod[0].name)  # fmt: skip

    def _vector(self, name: str, vector: Vector, tail: str, head: str, *gone: str) -> None:
        self.vectors[name], self.ends[name] = vector, (tail, head)
        self.gone |= set(gone)

    def _replaceable(self, body: str) -> bool:
        """Return whether a vector says all of a body: it has no mass, and nothing names it."""
        given = self.base.mechanism.bodies[body]
        named = re.search(rf"(?<![\w]){re.escape(body)}(?![\w])", self.words)
        return given.mass is None and given.inertia is None and named is None

    def _length(self, tail: str, head: str) -> Number:
        (body, one), (_, other) = tail.split("."), head.split(".")
        points = self.base.mechanism.bodies[body].points
        steps = [less(b, a) for a, b in zip(points[one], points[other], strict=True)]
        apart = [step for step in steps if step != 0]
        if len(apart) == 1:
            value = evaluate(apart[0], self.base.mechanism.parameter_values)
            return apart[0] if value > 0 else negative(apart[0])
        return "sqrt(" + " + ".join(f"({step})**2" for step in apart) + ")"

    def _segments(self) -> None:
        """Make the vectors of bodies, from the first of their places to each of the others."""
        used: dict[str, dict[str, str]] = {}
        joints = self.base.mechanism.joints.values()
        points = [text for joint in joints for text in (joint.first, joint.second)]
        for text in (*points, *(f"{GROUND}.{name}" for name in self.beside)):
            body = text.split(".")[0]
            if body not in self.gone:
                used.setdefault(body, {}).setdefault(self.places.first(text), text)
        taken = {*self.vectors, *self.base.mechanism.bodies, *self.base.mechanism.joints}
        for body, places in used.items():
            tail, *heads = places.values()
            for head in heads:
                name = f"{body}_{tail.split('.')[1]}{head.split('.')[1]}"
                while name in taken:
                    name += "_"
                taken.add(name)
                self._vector(name, Vector(name, from_=tail, to=head), tail, head)

    def _refuse(self) -> None:
        joints = self.base.mechanism.joints.values()
        pairs = {joint.name: (joint.first_body, joint.second_body) for joint in joints}
        cycles = shortest_cycles(pairs, GROUND)
        if not cycles:
            raise UnavailableError(
                "it has no loop: an open chain is no closed vector loop", where="joints"
            )
        named = [f"{joint.name} ({joint.kind})" for joint in joints
                 if not joint.ball and any(joint.name == n for n, _ in cycles[0])]  # fmt: skip
        raise UnavailableError(
            f"its loops are closed by axes, and a vector loop closes points alone: "
            f"{', '.join(named)}",
            where="joints",
            hint="loops of bars between ball joints, or with a point that slides on the ground",
        )

    # -- the problem ----------------------------------------------------------------------------

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism described by these loops, without sketch, loads and outputs."""
        base = self.base.mechanism
        rest = {name: body for name, body in base.bodies.items() if name not in self.gone}
        joints = {name: joint for name, joint in base.joints.items() if name not in self.gone}
        return from_loops(
            self.vectors,
            self.loops,
            self._nodes(),
            ground=replace(base.ground, points=Table({**base.ground.points, **self.beside})),
            bodies=Table(rest),
            joints=Table(joints),
            parameters=base.parameters,
            gravity=base.gravity,
            closure_tolerance=base.closure_tolerance,
            dimension=3,
        )

    def _nodes(self) -> list[Node]:
        """Return names of the points that are of no body any more: those that slid, or balls."""
        nodes: dict[str, Node] = {}
        for name, pair in self.ends.items():
            for side, text in zip((TAIL, HEAD), pair, strict=True):
                body, place = text.split(".")[0], self.places.first(text)
                if body in self.gone and place not in nodes:
                    nodes[place] = Node(body, f"{name}.{side}")
        return list(nodes.values())

    def points(self, made: Mechanism) -> Mapping[str, str]:
        """Return the points of what is gone by what they are called in the mechanism of loops."""
        assert made.closure is not None
        new = {self.places.first(end): text for name, pair in self.ends.items()
               for end, text in zip(pair, made.closure.ends[name], strict=True)}  # fmt: skip
        return {text: new[self.places.first(text)]
                for joint in self.base.mechanism.joints.values()
                for text in (joint.first, joint.second)
                if text.split(".")[0] in self.gone and self.places.first(text) in new}  # fmt: skip


def _smooth(joint: Joint) -> bool:
    """Return whether nothing rubs in a joint."""
    words = ("friction", "friction_static", "contact_length", "one_sided")
    return not any(getattr(joint, word, None) for word in words)


def _slides(joint: Joint) -> bool:
    return joint.guide and _smooth(joint)


def _turn_freely(*joints: Joint) -> bool:
    """Return whether joints leave a link between them its directions: balls, or one a cross."""
    turn = all(joint.coincide and joint.freedoms >= 2 and _smooth(joint) for joint in joints)
    return turn and any(joint.ball for joint in joints)


def _frame(joint: Joint, second: bool) -> tuple[tuple[float, ...], ...]:
    """Return normal, binormal and axis of a side of a joint, none of expressions."""
    assert isinstance(joint, SpatialJoint)
    given, key = joint.side(second)
    axis = getattr(joint, given)
    zero = getattr(joint, key) if key else None
    if not all(isinstance(x, float) for x in (*axis, *(zero or ()))):
        return ()
    a = _unit(axis)
    if zero is None:
        zero = tuple(float(k == (largest(axis) + 1) % 3) for k in range(3))
    along = sum(x * y for x, y in zip(a, zero, strict=True))
    n = _unit(tuple(z - along * x for z, x in zip(zero, a, strict=True)))
    cross = tuple(a[k - 2] * n[k - 1] - a[k - 1] * n[k - 2] for k in range(3))
    return n, cross, a


def _unit(vector: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(x / math.hypot(*vector) for x in vector)


def _angles(axis: tuple[Number, ...]) -> tuple[Number, Number]:
    """Return elevation and azimuth of a direction."""
    x, y, z = axis
    azimuth = 0.0 if z == 0 and isinstance(x, float) and x > 0 else f"atan2({z}, {x})"
    return 0.0 if y == 0 else f"atan2({y}, hypot({x}, {z}))", azimuth

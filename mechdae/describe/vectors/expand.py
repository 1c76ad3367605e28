"""Vector loops to a mechanism: links become bodies, nodes turning joints, slides sliding joints."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from mechdae.describe.expression import evaluate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.pairs import PinInSlot, Prismatic, Revolute
from mechdae.describe.mechanism import GROUND, Body, Ground, Mechanism, by_name, evaluate_all
from mechdae.describe.values import Number, Table, numbers_by_coordinate, numbers_by_name
from mechdae.describe.vectors.in_space import PointLoops, planar_only
from mechdae.describe.vectors.links import FIXED, Link, VectorDirections, VectorLinks
from mechdae.describe.vectors.nodes import (
    HEAD,
    TAIL,
    Merged,
    check_loops,
    check_names,
    check_node,
    check_tied,
    nodes_of,
    reached,
)
from mechdae.describe.vectors.values import Closure, Node, Vector, less
from mechdae.errors import InputError, MechdaeError, UnavailableError
from mechdae.records import dataclass

FRICTION = ("friction", "friction_static")


def from_loops(
    vectors: object, loops: Mapping[str, Iterable[str]], nodes: object = (), *,
    ground: Ground | None = None, bodies: object = (), joints: object = (),
    parameters: Mapping[str, Number] | None = None, sketch: Mapping[str, Number] | None = None,
    **rest: Any,
) -> Mechanism:  # fmt: skip
    """Return the mechanism that closed vector loops describe.

    Parameters
    ----------
    vectors
        `Vector` values; what they leave out is unknown or driven.
    loops
        Name -> vectors, head to tail; ``"-rod"`` runs a vector backwards.
    nodes
        `Node` values: names and friction of heads and tails.
    ground, bodies, joints
        What vectors do not make: bodies that ``from`` and ``to`` name; masses, centres and further
        points of links, in bodies of their names.
    parameters, sketch
        As of a `Mechanism`; a vector's name stands for its angle in the sketch.
    rest
        Other fields of `Mechanism`: loads, outputs, gravity.

    Returns
    -------
    Mechanism
        Links, pins and slides of the loops, with what was given besides.

    Raises
    ------
    InputError
        Loops that do not close or do not hang together, vectors that contradict each other; the
        message names the key.

    Examples
    --------
    >>> vectors = [md.Vector("crank", 0.1), md.Vector("rod", 0.3), md.Vector("slide", angle=0)]
    >>> mechanism = md.from_loops(vectors, {"loop": ["crank", "rod", "-slide"]})
    >>> list(mechanism.joints)
    ['crank_tail', 'crank_head', 'rod_head', 'slide_slide']
    """
    closure = Closure(
        by_name(vectors),
        Table({name: _entries(name, entries) for name, entries in loops.items()}),
        by_name(nodes),
        ground or Ground(),
        by_name(bodies),
        by_name(joints),
    )
    try:
        known = evaluate_all(numbers_by_name(parameters or {}))
    except MechdaeError as problem:
        raise (problem if problem.where else problem.inside("parameters")) from None
    if rest.get("dimension", 2) == 3:
        if rest.get("frames") is not None:
            raise UnavailableError(
                f"frames = '{rest['frames']}' is not computed beside vector loops by this version",
                where="frames",
                hint="points of bodies in frames of their own",
            )
        points = PointLoops(closure, known)
        return Mechanism(
            ground=points.ground,
            bodies=points.bodies,
            joints=points.joints,
            parameters=parameters or Table(),
            sketch=sketch or Table(),
            closure=replace(closure, joints=points.typed, ends=points.spans),
            **rest,
        )
    made = _Expansion(closure, known)
    try:
        rough = numbers_by_coordinate(sketch or {})
    except MechdaeError as problem:
        raise problem.inside("sketch") from None
    return Mechanism(
        ground=made.ground,
        bodies=made.bodies,
        joints=made.joints,
        parameters=parameters or Table(),
        sketch=Table(made.sketch(rough)),
        closure=replace(closure, aliases=made.aliases, directions=made.directed, ends=made.ends),
        **rest,
    )


def _entries(name: str, entries: object) -> tuple[str, ...]:
    if isinstance(entries, str) or not isinstance(entries, list | tuple):
        raise InputError("a list of vectors is needed", where=f"loops.{name}")
    for position, entry in enumerate(entries):
        if not isinstance(entry, str):
            raise InputError("the name of a vector is needed", where=f"loops.{name}[{position}]")
    return tuple(entries)


class LooseDirection(InputError):
    """A vector keeps the direction of a link that nothing of that direction joins it to."""

    def __init__(self, vector: str, of: str) -> None:
        super().__init__(
            f"keeps the direction of {of}, but no given lengths and no slides of that direction "
            "join them to one link",
            where=f"vectors.{vector}",
            hint="leave out its angle: the loop finds it; or parallel = true: a guide keeps it",
        )
        self.vector = vector


@dataclass
class _Expansion:
    """Bodies and joints of loops, and what the coordinates of vectors are called there."""

    closure: Closure
    known: Mapping[str, float]

    def __post_init__(self) -> None:
        closure = self.closure
        if not closure.loops:
            raise InputError("vectors need [loops] that they close", where="loops")
        self._check_names()
        for vector in closure.vectors.values():
            planar_only(vector)
        check_loops(closure.vectors, closure.loops)
        self.merged: Merged = nodes_of(closure.vectors, closure.loops)
        directions = VectorDirections(closure)
        held = any(GROUND in (j.first_body, j.second_body) for j in closure.joints.values())
        self.links = VectorLinks(directions, closure.loops, self.merged, self.known, held)
        self._check_connected()
        self.called = self._called()
        self.inside = self._pins_in_slots()
        self.points: dict[str, dict[str, str]] = {}
        bodies = {link.name: self._body(link) for link in self.links.all if self._kept(link)}
        ground = next((b for b in bodies.values() if isinstance(b, Ground)), closure.ground)
        self.ground = ground
        made = {name: body for name, body in bodies.items() if isinstance(body, Body)}
        rest = {name: body for name, body in closure.bodies.items() if name not in made}
        guides = {body.name: body for body in self._guides()}
        self.bodies: Table[Body] = Table({**made, **guides, **rest})
        joints = [*self._turning(), *self._sliding(), *self._guiding()]
        for joint in joints:
            if joint.name in closure.joints:
                raise InputError(
                    f"the loops have a joint '{joint.name}' of their own",
                    where=f"joints.{joint.name}",
                    hint="rename it",
                )
        joint_of = {joint.name: joint for joint in joints}
        self.joints: Table[Joint] = Table({**closure.joints, **joint_of})
        self.aliases, self.directed = self._aliases()
        self.ends = Table({
            name: (self._end(name, TAIL), self._end(name, HEAD)) for name in closure.vectors
        })  # fmt: skip

    # -- checks ----------------------------------------------------------------------------------

    def _check_names(self) -> None:
        check_names(self.closure, "joint", "node", "fixed link")
        for name in self.closure.nodes:
            if name in self.closure.joints or name in self.closure.bodies:
                raise InputError(
                    f"a body or joint is called '{name}' too", where=f"nodes.{name}",
                    hint="rename one of them",
                )  # fmt: skip

    def _check_connected(self) -> None:
        """Raise for a loop that hangs on nothing, and for links that nothing closes."""
        ends = {
            name: [self.links.node(f"{name}.{end}") for end in (TAIL, HEAD)]
            for name in self.closure.vectors
        }
        pairs = [(tail, head) for tail, head in ends.values()]
        tied = reached([self.links.origin], [*pairs, *self._ties()])
        check_tied(self.closure.loops, {name: texts[0] for name, texts in ends.items()}, tied)
        self.parallels: list[tuple[Link, Link]] = []
        for link in self.links.all:
            pairs = [
                (self.links.at(name, TAIL).name, self.links.at(name, HEAD).name)
                for name, vector in self.closure.vectors.items()
                if vector.slides and self.links.directions[name][0] == link.direction
            ]
            pairs += [(one.name, other.name) for one, other in self.parallels]
            same = [other for other in self.links.all if other.direction == link.direction]
            first = next((x for x in same if x.name == GROUND), same[0])
            if link.name in reached([first.name], pairs) or link.direction.startswith("@"):
                continue
            name = link.own or link.name
            if not self.closure.vectors[name].parallel:
                fixed = link.direction == FIXED
                raise LooseDirection(name, "the fixed frame" if fixed else f"'{first.name}'")
            self.parallels.append((first, link))

    def _ties(self) -> list[tuple[str, str]]:
        """Return pairs of nodes on bodies that are described by themselves."""
        found = []
        nodes: dict[str, list[str]] = {}
        for name, vector in self.closure.vectors.items():
            if vector.body is not None:
                nodes.setdefault(vector.body, []).append(self.links.node(f"{name}.{TAIL}"))
        for joint in self.closure.joints.values():
            nodes.setdefault(joint.first_body, []).append(joint.name)
            nodes.setdefault(joint.second_body, []).append(joint.name)
        for link in self.links.all:
            nodes.setdefault(link.name, []).extend(link.nodes)
        nodes.setdefault(GROUND, []).append(self.links.origin)
        for items in nodes.values():
            found += [(items[0], other) for other in items[1:]]
        return found

    # -- bodies ----------------------------------------------------------------------------------

    def _called(self) -> dict[str, Node]:
        """Return node -> its name and friction."""
        found: dict[str, Node] = {}
        for name, node in self.closure.nodes.items():
            check_node(name, node, self.closure.vectors)
            place = self.links.node(node.at)
            if place in found:
                where = f"nodes.{name}.at"
                raise InputError(f"'{found[place].name}' is the same place", where=where)
            found[place] = node
        return found

    def _name(self, node: str) -> str:
        """Return the name of a node by itself, which its joint has too."""
        if node in self.called:
            return self.called[node].name
        return node.removeprefix("@").replace(".", "_")

    def _pins_in_slots(self) -> dict[str, str]:
        """Return vector -> name of the body whose pin slides in it, for those without a block."""
        found = {}
        for name, vector in self.closure.vectors.items():
            if not vector.slides or not vector.in_slot:
                continue
            block, node = self.links.at(name, HEAD), self.links.node(f"{name}.{HEAD}")
            others = [link.name for link in self.links.on(node) if link is not block]
            if block.own != name or len(block.nodes) > 1 or not others:
                raise InputError(
                    "a pin in its slot is the end of one link of another direction",
                    where=f"vectors.{name}.pair",
                    hint='leave out pair, or pair = "block"',
                )
            found[name] = others[0]
        return found

    def _kept(self, link: Link) -> bool:
        return not (link.own in self.inside and link is self.links.at(link.own, HEAD))

    def _body(self, link: Link) -> Body | Ground:
        """Return a link as a body: the points of its nodes, and what the file says besides."""
        typed: Any = self.closure.ground if link.name == GROUND else None
        typed = typed or self.closure.bodies.get(link.name)
        along_itself = link.direction.removeprefix("@") == link.name or link.name == GROUND
        bound = (
            {n: p for n, (p, _) in self.links.bound(link.direction).items()} if along_itself else {}
        )
        points = dict(typed.points) if typed else {}
        named: dict[str, str] = {}
        for node, place in link.places.items():
            point = bound.get(node) or self._point(link, node)
            if node not in bound:
                if point in points:
                    raise InputError(
                        f"the vectors give the point '{point}' already",
                        where=f"bodies.{link.name}.points.{point}".removeprefix("bodies.ground."),
                        hint="rename it",
                    )
                points[point] = place
            named[node] = point
        self.points[link.name] = named
        if link.name == GROUND:
            ground: Ground = replace(self.closure.ground, points=Table(points))
            return ground
        return replace(typed or Body(link.name), points=Table(points))

    def _point(self, link: Link, node: str) -> str:
        """Return the name of a point of a link at a node."""
        if node in self.called:
            return self.called[node].name
        for end in (TAIL, HEAD):
            if link.own == link.name and self.links.node(f"{link.own}.{end}") == node:
                return end
        return self._name(node)

    # -- joints ----------------------------------------------------------------------------------

    def _turning(self) -> list[Joint]:
        """Return the revolutes of all nodes; the first link at a node carries its pins."""
        joints: list[Joint] = []
        typed = [(j.first, j.second) for j in self.closure.joints.values() if j.hinge]
        for node in dict.fromkeys(n for link in self.links.all for n in link.nodes):
            links = [link for link in self.links.on(node) if self._kept(link)]
            ends = {link.name: f"{link.name}.{self.points[link.name][node]}" for link in links}
            first, *others = links
            others = [x for x in others if ends[x.name] not in reached([ends[first.name]], typed)]
            called = self.called.get(node)
            numbers = {} if called is None else _given(called, (*FRICTION, "pin_radius"))
            for other in others:
                name = self._name(node)
                joints.append(
                    Revolute(
                        name if len(others) == 1 else f"{name}_{other.name}",
                        ends[first.name],
                        ends[other.name],
                        **numbers,
                    )
                )
            if called is not None and not others and numbers:
                raise InputError(
                    "nothing turns here", where=f"nodes.{called.name}.{next(iter(numbers))}",
                    hint="friction of a slide is a key of its vector",
                )  # fmt: skip
        return joints

    def _sliding(self) -> list[Joint]:
        """Return the sliding joint, or the pin in its slot, of each vector of unknown length."""
        joints: list[Joint] = []
        for name, vector in self.closure.vectors.items():
            if not vector.slides:
                continue
            guide, block = self.links.at(name, TAIL), self.links.at(name, HEAD)
            tail, head = (self.links.node(f"{name}.{end}") for end in (TAIL, HEAD))
            angle = self.links.directions[name][1]
            first = f"{guide.name}.{self.points[guide.name][tail]}"
            axis = less(angle, guide.turn)
            if name in self.inside:
                owner = self.inside[name]
                second = f"{owner}.{self.points[owner][head]}"
                numbers = _given(vector, ("friction", "pin_radius", "one_sided"))
                joints.append(PinInSlot(slide_of(name), first, second, axis=axis, **numbers))
            else:
                second = f"{block.name}.{self.points[block.name][head]}"
                numbers = _given(vector, (*FRICTION, "contact_length", "one_sided"))
                turn = less(block.turn, guide.turn)
                joints.append(
                    Prismatic(slide_of(name), first, second, axis=axis, turn=turn, **numbers)
                )
        return joints

    def _guides(self) -> list[Body]:
        """Return the bodies between links and those whose direction they keep."""
        made = [link.name for _, link in self.parallels]
        return [Body(f"{name}_parallel", points=Table({"P": (0.0, 0.0)})) for name in made]

    def _guiding(self) -> list[Joint]:
        """Return two slides across each other, which keep a direction and nothing else."""
        joints: list[Joint] = []
        for first, link in self.parallels:
            guide = f"{link.name}_parallel"
            ends = [f"{x.name}.{next(iter(self.points[x.name].values()))}" for x in (first, link)]
            turn = less(link.turn, first.turn)
            joints += [
                Prismatic(f"{guide}_x", ends[0], f"{guide}.P"),
                Prismatic(f"{guide}_y", f"{guide}.P", ends[1], axis=math.pi / 2, turn=turn),
            ]
        return joints

    # -- coordinates -----------------------------------------------------------------------------

    def _aliases(self) -> tuple[Table[str], Table[tuple[str, Number]]]:
        """Return coordinates of vectors by the names they have in the mechanism, and directions.

        A direction is a body, "" for the fixed frame, and the angle of the vector from it.
        """
        aliases: dict[str, str] = {}
        directed: dict[str, tuple[str, Number]] = {}
        for name, vector in self.closure.vectors.items():
            if vector.slides:
                aliases[f"{name}.length"] = f"{slide_of(name)}.slide"
            direction, angle = self.links.directions[name]
            same = [x for x in self.links.all if x.direction == direction and self._kept(x)]
            if direction == FIXED:
                directed[name] = "", angle
                continue
            same.sort(key=lambda x: (x.name != name, less(angle, x.turn) != 0))
            link = same[0]  # called after it, or with the frame along it
            directed[name] = link.name, less(angle, link.turn)
            if link.name != name and less(angle, link.turn) == 0:
                aliases |= dict.fromkeys((name, f"{name}.angle"), f"{link.name}.angle")
        return Table(aliases), Table(directed)

    def _end(self, vector: str, end: str) -> str:
        """Return an end of a vector as a point of the mechanism."""
        link, node = self.links.at(vector, end).name, self.links.node(f"{vector}.{end}")
        if end == HEAD and vector in self.inside:
            link = self.inside[vector]
        return f"{link}.{self.points[link][node]}"

    def sketch(self, rough: Mapping[str, Number]) -> dict[str, Number]:
        """Return a sketch with the coordinates of vectors under their names in the mechanism."""
        result: dict[str, Number] = {}
        for name, value in rough.items():
            vector, _, word = name.partition(".")
            key = name
            if vector in self.closure.vectors and word in ("", "angle", "length"):
                if word == "length":
                    if not self.closure.vectors[vector].slides:
                        raise InputError(
                            f"the length of '{vector}' is given", where=f"sketch.{name}"
                        )
                    key = slide_of(vector)
                else:
                    body, angle = self.directed[vector]
                    if not body:
                        raise InputError(f"'{vector}' does not turn", where=f"sketch.{name}")
                    key, value = body, value if body == vector else less(value, angle)
            if key in result and not _same(result[key], value, self.known):
                raise InputError(
                    f"{key} is sketched twice", where=f"sketch.{name}", hint="delete one of them"
                )
            result[key] = value
        return result


def slide_of(vector: str) -> str:
    """Return the name of the joint in which a vector of unknown length slides."""
    return f"{vector}_slide"


def _given(value: Node | Vector, words: tuple[str, ...]) -> dict[str, str]:
    return {word: getattr(value, word) for word in words if getattr(value, word) is not None}


def _same(one: Number, other: Number, known: Mapping[str, float]) -> bool:
    return evaluate(one, known) == evaluate(other, known)

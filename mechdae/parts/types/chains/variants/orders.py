"""Cyclic orders of the links of a loop: the same sum of vectors, another mechanism.

Closure is a sum, and a sum does not ask for an order: all orders of a loop have the same angles,
and different joints, paths, boxes, reactions and losses.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import permutations, product
from math import factorial, prod
from typing import Any

from mechdae.describe import Mechanism, Problem, Table, dumps
from mechdae.describe.expression import evaluate
from mechdae.describe.values import Number
from mechdae.describe.vectors.expand import LooseDirection, from_loops
from mechdae.describe.vectors.nodes import HEAD, TAIL, in_order, meeting, reached
from mechdae.errors import InputError, MechdaeError
from mechdae.parts.types.chains.variants.scheme import GROUND, Pose, Variant, made, reach
from mechdae.records import dataclass
from mechdae.types import Json


@dataclass(frozen=True)
class LoopLink:
    """Links of one direction that follow each other in a loop, joined by slides.

    ``entry`` and ``exit`` are the points ``body.point`` at which the loop comes and goes, ``pin``
    the revolute joint at the exit.
    """

    bodies: tuple[str, ...]
    entry: str
    exit: str
    pin: str

    @property
    def name(self) -> str:
        """The ground, or else its first link."""
        return GROUND if GROUND in self.bodies else self.bodies[0]


def cyclic(count: int) -> list[tuple[int, ...]]:
    """Return the cyclic orders of so many things up to direction, the first one in front."""
    rest = range(1, count)
    return [(0, *order) for order in permutations(rest) if count < 3 or order[0] < order[-1]]


def how_many(count: int) -> int:
    """Return (m - 1)!/2, or 1 for fewer than three."""
    return factorial(count - 1) // 2 if count > 2 else 1


class Orders:
    """All orders of the loops of a mechanism."""

    def __init__(self, problem: Problem, pose: Pose) -> None:
        self.problem, self.pose = problem, pose

    @cached_property
    def loops(self) -> dict[str, tuple[Any, ...]]:
        """The loops: vectors with their signs, or stretches of links."""
        closure = self.problem.mechanism.closure
        if closure is not None:
            return dict(closure.loops)
        return {"loop": tuple(loop_of(self.problem.mechanism))}

    @property
    def count(self) -> int:
        """How many there are, loops of several in every combination."""
        return prod(how_many(len(loop)) for loop in self.loops.values())

    def __iter__(self) -> Iterator[Variant]:
        for orders in product(*(cyclic(len(loop)) for loop in self.loops.values())):
            ordered = {
                name: [self.loops[name][k] for k in order]
                for name, order in zip(self.loops, orders, strict=True)
            }
            yield self.of(ordered)

    def of(self, loops: Mapping[str, Sequence[Any]]) -> Variant:
        """Return the variant with its loops in this order: of entries, or of stretches of links."""
        if self.problem.mechanism.closure is not None:
            return self._of_vectors(loops)
        return self._of_links(loops["loop"])

    # -- vectors -----------------------------------------------------------------------------

    def _of_vectors(self, loops: Mapping[str, Sequence[str]]) -> Variant:
        base = self.problem.mechanism
        assert base.closure is not None
        name = "__".join("-".join(text.lstrip("-") for text in loop) for loop in loops.values())
        words = "; ".join(", ".join(loop) for loop in loops.values())
        about: Json = {"order": {name: list(loop) for name, loop in loops.items()}}
        closed = _closed(loops)
        if closed > len(loops):
            about["closes"] = {"loops": closed, "given": len(loops)}
        try:
            mechanism = expanded(base, loops)
        except MechdaeError as error:
            text = _with_loops(self.problem, loops)
            return Variant(f"order-{name}", None, about, (), _fault(base, error), text)
        mechanism = replace(mechanism, sketch=Table(self._sketch(mechanism)))
        return made(self.problem, f"order-{name}", mechanism, f"order {words}", about)

    def _sketch(self, mechanism: Mechanism) -> dict[str, Number]:
        """Return the pose of the base as that of an order: all vectors have the same values."""
        old, new = self.problem.mechanism.closure, mechanism.closure
        assert old is not None
        assert new is not None
        angles, known = {"": 0.0, **self.pose.angles}, self.problem.mechanism.parameter_values
        sketch: dict[str, Number] = {
            name: value for name, value in self.pose.slides.items() if name in mechanism.joints
        }
        for name, (body, turn) in old.directions.items():
            link, off = new.directions[name]
            if link and body in angles:
                sketch[link] = angles[body] + evaluate(turn, known) - evaluate(off, known)
        return sketch

    # -- links -------------------------------------------------------------------------------

    def _of_links(self, order: Sequence[LoopLink]) -> Variant:
        """Return a single loop of links in another order; a pin stays at the end of its link."""
        base = self.problem.mechanism
        joints = dict(base.joints)
        for stretch, following in zip(order, [*order[1:], order[0]], strict=True):
            joint = base.joints[stretch.pin]
            other = "second" if joint.first == stretch.exit else "first"
            changes: dict[str, str] = {other: following.entry}
            joints[stretch.pin] = replace(joint, **changes)
        sketch = {**self.pose.angles, **self.pose.slides}
        names = [stretch.name for stretch in order]
        mechanism = replace(
            base, joints=Table(joints), sketch=Table(sketch), loads=Table(), outputs=Table()
        )
        name = "order-" + "-".join(names[1:])
        title = "order " + ", ".join(names)
        return made(self.problem, name, mechanism, title, {"order": names})


def expanded(base: Mechanism, loops: Mapping[str, Sequence[str]]) -> Mechanism:
    """Return the mechanism of a base's vectors in other loops, without sketch, loads and outputs.

    A vector that leaves the link whose direction it keeps gets a guide that keeps it; of the names
    of one place the first one stays.

    Raises
    ------
    InputError
        These loops make no mechanism.
    """
    closure = base.closure
    assert closure is not None
    vectors = closure.vectors
    merged = meeting(vectors, loops)
    nodes = {merged.first(node.at): node for node in reversed(closure.nodes.values())}
    for _ in range(len(vectors) + 1):
        try:
            return from_loops(
                vectors,
                loops,
                [node for node in closure.nodes.values() if node in nodes.values()],
                ground=closure.ground,
                bodies=closure.bodies,
                joints=closure.joints,
                parameters=base.parameters,
                gravity=base.gravity,
                closure_tolerance=base.closure_tolerance,
            )
        except LooseDirection as error:
            vectors = vectors.with_(error.vector, replace(vectors[error.vector], parallel=True))
    raise InputError("the directions of these loops are kept by nothing", where="loops")


def loop_of(mechanism: Mechanism) -> list[LoopLink]:
    """Return the one loop of a mechanism from the ground on, links joined by slides as one."""
    for name, joint in mechanism.joints.items():
        if not (joint.hinge or joint.guide):
            raise InputError(
                f"loops of links have revolute and prismatic joints, this is '{joint.kind}'",
                where=f"joints.{name}",
                hint="write the mechanism with [vectors] and [loops]",
            )
    of_link: dict[str, list[str]] = {name: [] for name in (GROUND, *mechanism.bodies)}
    for name, joint in mechanism.joints.items():
        for body in (joint.first_body, joint.second_body):
            of_link[body].append(name)
    odd = [name for name, pins in of_link.items() if len(pins) != 2]
    if odd:
        raise InputError(
            f"{odd[0]} has {len(of_link[odd[0]])} joints: orders are those of one loop of links",
            where="joints",
            hint="write several loops with [vectors] and [loops]",
        )
    walk = _walk(mechanism, of_link)
    if len(walk) != len(of_link):
        lost = next(name for name in of_link if name not in [body for body, _, _ in walk])
        raise InputError(f"{lost} is not in the loop of the ground", where="joints")
    pins = [k for k, (_, _, leaving) in enumerate(walk) if mechanism.joints[leaving].hinge]
    if not pins:
        raise InputError("a loop without pins has one order", where="joints")
    start = pins[-1] + 1
    walk = walk[start:] + walk[:start]  # begins behind a pin
    stretches: list[LoopLink] = []
    group: list[tuple[str, str, str]] = []
    for step in walk:
        group.append(step)
        if mechanism.joints[step[2]].hinge:
            entry, leave = (_end(mechanism, group[0][1], group[0][0]),
                            _end(mechanism, step[2], step[0]))  # fmt: skip
            stretches.append(LoopLink(tuple(move[0] for move in group), entry, leave, step[2]))
            group = []
    first = next(k for k, stretch in enumerate(stretches) if GROUND in stretch.bodies)
    return stretches[first:] + stretches[:first]


def _walk(mechanism: Mechanism, of_link: dict[str, list[str]]) -> list[tuple[str, str, str]]:
    """Return (body, joint by which it is reached, joint by which it is left) around the loop."""
    body, leaving = GROUND, of_link[GROUND][0]
    entering = of_link[GROUND][1]
    walk = [(body, entering, leaving)]
    while True:
        joint = mechanism.joints[leaving]
        body = joint.second_body if joint.first_body == body else joint.first_body
        if body == GROUND:
            return walk
        one, two = of_link[body]
        entering, leaving = leaving, two if one == leaving else one
        walk.append((body, entering, leaving))


def _end(mechanism: Mechanism, joint: str, body: str) -> str:
    pair = mechanism.joints[joint]
    first, point = reach(pair, "first")
    return f"{first}.{point}" if first == body else pair.second


def _closed(loops: Mapping[str, Sequence[str]]) -> int:
    """Return how many independent loops vectors close that meet as in these loops."""
    names = in_order(loops)
    merged = meeting(names, loops)
    ends = [[merged.first(f"{name}.{end}") for end in (TAIL, HEAD)] for name in names]
    nodes = {node for pair in ends for node in pair}
    parts = 0
    left = set(nodes)
    for node in sorted(nodes):
        if node in left:
            parts += 1
            left -= set(reached([node], ((tail, head) for tail, head in ends)))
    return len(names) - len(nodes) + parts


def _fault(base: Mechanism, error: MechdaeError) -> str:
    """Return why an order is no mechanism, with the length of a vector that it makes vanish."""
    assert base.closure is not None
    text = str(error).splitlines()[0]
    for name, vector in base.closure.vectors.items():
        if f"head and tail of '{name}' meet" in text and vector.length is not None:
            length = evaluate(vector.length, base.parameter_values)
            return f"{text}: its length would be 0, and is {length:.6g} m"
    return text


def _with_loops(problem: Problem, loops: Mapping[str, Sequence[str]]) -> str:
    """Return the problem's text with its loops in another order."""
    assert problem.mechanism.closure is not None
    text = dumps(replace(problem, expected=(), pattern=None))
    for name, old in problem.mechanism.closure.loops.items():
        for entries, then in ((old, loops[name]),):
            line = f"{name} = [" + ", ".join(f'"{text}"' for text in entries) + "]"
            new = f"{name} = [" + ", ".join(f'"{text}"' for text in then) + "]"
            text = text.replace(line, new, 1)
    return text

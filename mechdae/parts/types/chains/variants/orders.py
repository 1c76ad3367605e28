"""Cyclic orders of the links of a loop: the same sum of vectors, another mechanism.

Closure is a sum, and a sum does not ask for an order: all orders of a loop have the same angles,
and different joints, paths, boxes, reactions and losses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import permutations, product
from math import factorial, prod
from typing import Any

from mechdae.describe import Driver, Joint, Mechanism, Problem, Table, dumps
from mechdae.describe.loads import Load
from mechdae.describe.vectors.expand import from_loops
from mechdae.errors import InputError, MechdaeError
from mechdae.parts.types.chains.variants.scheme import GROUND, Pose, Variant, made, reach
from mechdae.records import dataclass


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
            if self.problem.mechanism.closure is not None:
                yield self._of_vectors(ordered)
            else:
                yield self._of_links(ordered["loop"])

    # -- vectors -----------------------------------------------------------------------------

    def _of_vectors(self, loops: dict[str, list[str]]) -> Variant:
        base = self.problem.mechanism
        assert base.closure is not None
        closure = base.closure
        name = "__".join("-".join(text.lstrip("-") for text in loop) for loop in loops.values())
        words = "; ".join(", ".join(loop) for loop in loops.values())
        about = {"order": {name: list(loop) for name, loop in loops.items()}}
        mechanism: Mechanism | None
        try:
            mechanism = from_loops(
                closure.vectors,
                loops,
                closure.nodes,
                ground=closure.ground,
                bodies=closure.bodies,
                joints=closure.joints,
                parameters=base.parameters,
                gravity=base.gravity,
                closure_tolerance=base.closure_tolerance,
            )
            sketch = {**base.sketch, **self.pose.angles, **self.pose.slides}
            known = {*mechanism.bodies, *mechanism.joints}
            rough = {k: v for k, v in sketch.items() if k.partition(".")[0] in known}
            mechanism = replace(mechanism, sketch=Table(rough))
        except MechdaeError as error:
            text = _with_loops(self.problem, loops)
            return Variant(f"order-{name}", None, about, (), str(error).splitlines()[0], text)
        return made(self.problem, f"order-{name}", mechanism, f"order {words}", about)

    # -- links -------------------------------------------------------------------------------

    def _of_links(self, order: list[LoopLink]) -> Variant:
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
        problem = self.problem
        if name != "order-" + "-".join(stretch.name for stretch in self.loops["loop"][1:]):
            problem = replace(problem, mechanism=self._without_pins(base, joints), pattern=None)
        return made(problem, name, mechanism, title, {"order": names}, self._driver(joints))

    def _driver(self, joints: dict[str, Joint]) -> Any:
        base = self.problem.mechanism

        def driver(given: Driver) -> Driver:
            return replace(given, coordinate=_absolute(base, joints, given.coordinate)[0])

        return driver

    def _without_pins(self, base: Mechanism, joints: dict[str, Joint]) -> Mechanism:
        """Return the mechanism with loads that act on angles of links, not on those of joints."""
        loads: dict[str, Load] = {}
        for name, load in base.loads.items():
            changes: dict[str, Any] = {}
            for word in ("coordinate", "along"):
                text = getattr(load, word, None)
                if text is None:
                    continue
                changes[word], swapped = _absolute(base, joints, text)
                if swapped:
                    changes |= _swapped(load, name)
            loads[name] = replace(load, **changes)
        return replace(base, loads=Table(loads))


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


def _absolute(mechanism: Mechanism, joints: dict[str, Joint], text: str) -> tuple[str, bool]:
    """Return a coordinate without angles of joints whose links changed, and if its sign did."""
    name, _, word = text.rpartition(".")
    joint = mechanism.joints.get(name)
    if joint is None or word != "angle" or joints[name] == joint:
        return text, False
    if joint.first_body == GROUND:
        return f"{joint.second_body}.angle", False
    if joint.second_body == GROUND:
        return f"{joint.first_body}.angle", True
    raise InputError(
        f"'{text}' is the angle between {joint.first_body} and {joint.second_body}, "
        "which other orders part",
        hint="angles of bodies have a meaning in all orders",
    )


def _swapped(load: Load, name: str) -> dict[str, object]:
    """Return the numbers of a load whose coordinate has the other sign now."""
    if load.kind == "resistance":
        resistance: Any = load
        return {"negative": resistance.positive, "positive": resistance.negative}
    raise InputError(
        f"a {load.kind} on the angle of the ground against a link has no other order",
        where=f"loads.{name}",
        hint="give the joint with the ground as its first link",
    )


def _with_loops(problem: Problem, loops: dict[str, list[str]]) -> str:
    """Return the problem's text with its loops in another order."""
    assert problem.mechanism.closure is not None
    text = dumps(replace(problem, expected=(), pattern=None))
    for name, old in problem.mechanism.closure.loops.items():
        for entries, then in ((old, loops[name]),):
            line = f"{name} = [" + ", ".join(f'"{text}"' for text in entries) + "]"
            new = f"{name} = [" + ", ".join(f'"{text}"' for text in then) + "]"
            text = text.replace(line, new, 1)
    return text

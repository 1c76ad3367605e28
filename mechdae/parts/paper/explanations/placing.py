"""How the pose of a dyad is found: circles that meet, a circle and a line, a right triangle.

Each formula is written once, as text: with letters, with their numbers, and its value.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from math import asin, atan2, degrees, pi, remainder

import numpy as np

from mechdae.describe import Joint
from mechdae.describe.expression import evaluate, parse
from mechdae.draw.formulas.tree import (
    Equation,
    Formula,
    Less,
    Letter,
    Norm,
    Note,
    Number,
    Part,
    Passage,
    Product,
    Quotient,
    Root,
    Square,
    Sum,
    Wording,
    number,
)
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import normal
from mechdae.parts.paper.explanations.subject import Subject

STEEP = 0.1
"""Slope of the line between two centres from which x is sought first."""
OFFSET = 1e-12
"""Distances below that share of the mechanism are none."""
SEEN = 1e-11
"""Angles below that are none [rad]."""


class Worked:
    """Formulas one after the other, and what their names stand for."""

    def __init__(self) -> None:
        self.letters: dict[str, Part] = {}
        self.values: dict[str, float] = {}
        self.units: dict[str, str] = {}

    def know(self, name: str, letter: Part, value: float, unit: str = "m") -> None:
        """Give a name to what is known."""
        self.letters[name], self.values[name], self.units[name] = letter, value, unit

    def know_place(self, name: str, letter: str, place: Array) -> None:
        """Give names to the coordinates of a point: x and y before its own."""
        for axis, value in zip("xy", place, strict=True):
            self.know(f"{axis}{name}", Letter(axis, (letter,)), float(value))

    def find(self, name: str, letter: Part, text: str, unit: str = "") -> Formula:
        """Return name = formula = formula with numbers = value."""
        value = evaluate(text, self.values)
        self.know(name, letter, value, unit)
        tree = parse(text)
        sides = (letter, self._shown(tree, False), self._shown(tree, True), number(value, unit))
        return Formula(Equation(sides))

    def _shown(self, node: ast.expr, figures: bool) -> Part:
        match node:
            case ast.Name(name):
                return self._figure(name) if figures else self.letters[name]
            case ast.Constant(value):
                return Number(str(value))
            case ast.UnaryOp(operand=inner):
                return Less(self._shown(inner, figures))
            case ast.Call(args=[inner]):
                return Root(self._shown(inner, figures))
            case ast.BinOp(left, ast.Pow(), _):
                return Square(self._shown(left, figures))
            case ast.BinOp(left, operation, right):
                one, other = self._shown(left, figures), self._shown(right, figures)
                match operation:
                    case ast.Mult():
                        return Product((one, other))
                    case ast.Div():
                        return Quotient(one, other)
                    case ast.Sub() if isinstance(other, Number) and other.digits.startswith("-"):
                        other = self._figure(ast.unparse(right), -1.0)
                    case ast.Sub():
                        other = Less(other)
                terms = one.terms if isinstance(one, Sum) else (one,)
                return Sum((*terms, other))
        raise TypeError(f"no formula of {type(node).__name__}")  # pragma: no cover

    def _figure(self, name: str, sign: float = 1.0) -> Number:
        return number(sign * self.values[name], of=self.units[name])


def found_by(subject: Subject, bodies: tuple[str, ...], joints: list[str]) -> Iterator[Passage]:
    """Yield how the angles of a group of two links with three pairs are found."""
    pairs = [subject.scene.mechanism.joints[name] for name in joints]
    inner = [joint for joint in pairs if set(joint.bodies) == set(bodies)]
    outer = [
        joint for body in bodies for joint in pairs if joint not in inner and body in joint.bodies
    ]
    if len(bodies) != 2 or len(inner) != 1 or len(outer) != 2 or len(pairs) != 3:
        return
    if {f"{name}.{word}" for name in (*bodies, *joints) for word in ("angle", "slide")} & set(
        subject.result.drivers
    ):
        return
    kinds = [joint.hinge for joint in (outer[0], inner[0], outer[1])]
    if not all(joint.hinge or joint.guide for joint in pairs):
        return
    if kinds == [True, True, True]:
        yield from _circles(subject, bodies, outer, inner[0])
    elif kinds == [True, False, True]:
        yield from _triangle(subject, bodies, outer, inner[0])
    elif kinds in ([True, True, False], [False, True, True]):
        turned = 0 if kinds[0] else 1
        yield from _line(subject, bodies[turned], outer[turned], inner[0], outer[1 - turned])


def _circles(
    subject: Subject, bodies: tuple[str, ...], outer: list[Joint], inner: Joint
) -> Iterator[Passage]:
    """Yield where two circles meet, and the law of cosines."""
    say, worked = subject.say, Worked()
    ends = [joint.ends_at(body) for joint, body in zip(outer, bodies, strict=True)]
    names, pin = [subject.letter(far) for _, far in ends], inner.ends_at(bodies[0])[0]
    one, other, there = (subject.place(point) for point in (ends[0][0], ends[1][0], pin))
    middle = subject.letter(pin)
    for mark, name, place in zip("12", names, (one, other), strict=True):
        worked.know_place(mark, name, place)
        length = float(np.hypot(*(there - place)))
        worked.know(f"l{mark}", Norm(Letter("r", (middle, name), vector=True)), length)
    way = other - one
    if not np.hypot(*way) > OFFSET * subject.scene.mechanism.scale:
        return
    x, y = ("x", "y") if abs(way[1]) >= STEEP * abs(way[0]) else ("y", "x")
    yield Note((say("circles", middle, *names),))
    for k in "12":
        yield worked.find(f"P{k}", Letter("P", (k,)), f"l{k}**2 - x{k}**2 - y{k}**2", "m²")
    yield worked.find("a", Letter("a"), f"(P1 - P2)/(2*({y}2 - {y}1))", "m")
    yield worked.find("b", Letter("b"), f"({x}2 - {x}1)/({y}2 - {y}1)")
    yield worked.find("p", Letter("p"), f"(b*{y}1 - {x}1 - a*b)/(1 + b**2)", "m")
    yield worked.find("q", Letter("q"), f"(a**2 - 2*a*{y}1 - P1)/(1 + b**2)", "m²")
    first, second = (Letter(axis, (middle,)) for axis in (x, y))
    sign = "+" if there["xy".index(x)] + worked.values["p"] >= 0 else "-"
    yield worked.find("u", first, f"-p {sign} sqrt(p**2 - q)", "m")
    yield worked.find("v", second, "a - b*u", "m")
    between = (names[1], names[0])
    worked.know("d", Norm(Letter("r", between, vector=True)), float(np.hypot(*way)))
    corner, arm = Letter("β", (names[0],)), there - one
    yield worked.find("c", Letter("cos β", (names[0],)), "(l1**2 + d**2 - l2**2)/(2*l1*d)")
    turn = _turn(way, arm)
    step = (corner if turn > 0 else Less(corner), turn)
    yield _angle(subject, bodies[0], Letter("∠r", between), way, step, arm=arm)
    yield _angle(subject, bodies[1], Letter("∠r", (middle, names[1])), there - other)


def _line(subject: Subject, body: str, pin: Joint, inner: Joint, guide: Joint) -> Iterator[Passage]:
    """Yield where a circle meets a line."""
    worked, scene = Worked(), subject.scene
    (near, far), (tip, on_guide) = pin.ends_at(body), inner.ends_at(body)
    start, middle = subject.letter(far), subject.letter(tip)
    base = guide.ends_at(on_guide.split(".")[0])[1]
    here, there = subject.place(near), subject.place(tip)
    axis = scene.axis(guide, subject.pose)
    arm = there - here
    yield Note((subject.say("circle and line", middle, start, guide.name),))
    worked.know_place("1", start, here)
    worked.know_place("2", subject.letter(base), subject.place(base))
    worked.know("c", Wording("cos α"), round(float(axis[0]), 15), "")
    worked.know("s", Wording("sin α"), round(float(axis[1]), 15), "")
    offset = float(normal(axis) @ (there - subject.place(base)))
    more = abs(offset) > OFFSET * scene.mechanism.scale
    if more:
        worked.know("e", Letter("e"), offset)
        yield Formula(Equation((Letter("e"), number(offset, "m"))))
    text = "(y2 - y1)*c - (x2 - x1)*s" + " + e" * more
    yield worked.find("h", Letter("h"), text, "m")
    worked.know("l", Norm(Letter("r", (middle, start), vector=True)), float(np.hypot(*arm)))
    yield worked.find("b", Wording("sin β"), "h/l")
    steps = _by_sine(worked.values["b"], float(arm @ axis), 1.0)
    yield _angle(subject, body, Letter("α"), axis, *steps, arm=arm)


def _triangle(
    subject: Subject, bodies: tuple[str, ...], outer: list[Joint], slot: Joint
) -> Iterator[Passage]:
    """Yield how a guide lies that turns about one pin and whose block hangs on another."""
    worked, scene = Worked(), subject.scene
    turned = bodies.index(slot.first_body)
    ends = [outer[k].ends_at(bodies[k]) for k in (turned, 1 - turned)]
    start, end = (subject.letter(far) for _, far in ends)
    here, there = (subject.place(near) for near, _ in ends)
    way, local = there - here, scene.numbers[f"{slot.name}.axis"]
    axis = scene.direction(slot.first_body, local, subject.pose)
    offset = float(normal(axis) @ way)
    if not np.hypot(*way) > OFFSET * scene.mechanism.scale:
        return
    yield Note((subject.say("right triangle", slot.name, start, end),))
    worked.know_place("1", start, here)
    worked.know_place("2", end, there)
    size = Norm(Letter("r", (end, start), vector=True))
    yield worked.find("d", size, "sqrt((x2 - x1)**2 + (y2 - y1)**2)", "m")
    worked.know("h", Letter("h"), offset)
    if abs(offset) > OFFSET * scene.mechanism.scale:
        yield Formula(Equation((Letter("h"), number(offset, "m"))))
        yield worked.find("b", Wording("sin β"), "h/d")
    steps = _by_sine(worked.values.get("b", 0.0), float(way @ axis), -1.0)
    yield _angle(subject, slot.first_body, Letter("∠r", (end, start)), way, *steps, local=local)
    first = scene.direction(slot.first_body, 0.0, subject.pose)
    letter = Letter("φ", (str(subject.numbers[slot.first_body]),))
    turn = scene.numbers[f"{slot.name}.turn"]
    yield _angle(subject, slot.second_body, letter, first, local=-turn)


def _turn(start: Array, end: Array) -> float:
    """Return the angle from one direction to another."""
    return float(atan2(start[0] * end[1] - start[1] * end[0], start @ end))


def _by_sine(sine: float, along: float, sign: float) -> Iterator[tuple[Part, float]]:
    """Yield the terms of an angle whose sine is known: β, or 180° without it."""
    turn, letter = asin(min(max(sine, -1.0), 1.0)), Letter("β")
    if along < 0:
        yield number(sign * 180.0, "°"), sign * pi
        sign = -sign
    yield letter if sign > 0 else Less(letter), sign * turn


def _angle(
    subject: Subject,
    body: str,
    base: Part,
    way: Array,
    *steps: tuple[Part, float],
    arm: Array | None = None,
    local: float | None = None,
) -> Formula:
    """Return the angle of a link: that of a direction and what is added to it.

    ``local`` is how the line so found lies in the link, by default as ``arm`` does in the pose.
    """
    value = float(subject.scene.angles[body][subject.pose])
    if local is None:
        local = float(np.arctan2(*(way if arm is None else arm)[::-1])) - value
    local = remainder(local, 2 * pi)
    turns = [(base, float(np.arctan2(way[1], way[0]))), *steps]
    turns.append((Wording(subject.say("in the link")), -local))
    rest = value - sum(turn for _, turn in turns)
    rounds = round(rest / (2 * pi))
    turns.append((number(360.0 * rounds, "°"), 2 * pi * rounds))
    turns = [turns[0], *(turn for turn in turns[1:] if abs(turn[1]) > SEEN)]
    figures = [number(degrees(turn), "°", 8) for _, turn in turns]
    sides: list[Part] = [Sum(tuple(letter for letter, _ in turns))]
    sides += [Sum(tuple(figures))] * (len(figures) > 1)
    left, shown = Letter("φ", (str(subject.numbers[body]),)), number(degrees(value), "°", 8)
    return Formula(Equation((left, *sides, shown)), abs(rest - 2 * pi * rounds), "rad")

"""Bounds of products along a way of joints, from the reaches of what its freedoms move.

A rotation stretches nothing. With A what is before a freedom of a way and C what is behind it, seen
from there, half the square of the distance of both ends is -A.C and terms without the freedom, and
a component of the end along a direction d of the beginning is d.C: a derivative by an angle is the
product of the parts of A and C normal to its axis, one by two angles i before j that of the part
moved by i and the part moved by j. Products of sines and cosines along the way would multiply
what here stays as long as the links are (Wittenburg, Dynamics of Multibody Systems, for trees).

Rounding: a product of a rotation with the next one is off by ten units of the roundoff at most, by
22 where its numbers are dense and by forty where they are computed; each counts as often as the way
is long.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca

from mechdae.equations.tree.joint_chains import Freedom, RigidPart, Way, WayProduct, back, joined
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX
ONE, ZERO = SX(1), SX(0)
TURN, BALL, DENSE, COMPUTED, PLACE, SUM = 10, 40, 22, 40, 12, 2
"""Roundings of a turn, of a ball, of constant rotations, of a place from its link, of a sum."""


def size_of(vector: Sym) -> Sym:
    """Return the length of a vector of constants."""
    elements: list[Sym] = SX(vector).elements()
    parts = [part for part in elements if not part.is_zero()]
    if len(parts) <= 1:
        return ca.fabs(parts[0]) if parts else ZERO
    return ca.sqrt(ca.sumsqr(ca.vertcat(*parts)))


def across(vector: Sym, axis: int) -> Sym:
    """Return the length of the part of a vector that is normal to a coordinate axis."""
    rest = SX(vector)
    rest[axis] = 0
    return size_of(rest)


@dataclass
class Side:
    """What lies on one side of each part of a way, up to that end.

    ``total`` bounds the length of all of it, ``after`` [k] of what lies beyond part k,
    ``moved`` [k] of what a freedom k turns, across its axis, ``scale`` [k] how much quaternions
    beyond k stretch.
    """

    total: Any
    after: list[Sym]
    moved: list[Any]
    scale: list[Sym]
    point: bool


Size = Callable[[Any], Any]
Norm = Callable[[Freedom], Any]


def side(way: Way, tip: Sym | None, size: Size, ball: Norm) -> Side:
    """Return what lies beyond each part of a way; `tip` as of a `WayProduct`."""
    point = tip is None
    length, stretch = (ZERO if point else size_of(tip)), ONE
    after: list[Sym] = []
    scale: list[Sym] = []
    for part in reversed(way):
        after.insert(0, length)
        scale.insert(0, stretch)
        if isinstance(part, RigidPart):
            length = length + (size_of(part.place) if point else 0)
        elif part.word == "ball":
            square = ball(part) ** 2
            length, stretch = length * square, stretch * square
        elif part.slides and point:
            length = length + _slid(part, size)
    moved = [_moved(way, k, tip, after) for k in range(len(way))]
    return Side(length, after, moved, scale, point)


def _slid(part: Freedom, size: Size) -> Sym:
    """Return how far a slide or a screw goes."""
    way = size(part.symbols[0])
    return ca.fabs(part.lead) * way if part.word == "screw" else way


def _moved(way: Way, k: int, tip: Sym | None, after: list[Sym]) -> Sym:
    """Return the length across the axis of a freedom of what it turns."""
    freedom = way[k]
    if isinstance(freedom, RigidPart) or not freedom.turns:
        return after[k]
    place, turn, last = SX(3, 1), SX.eye(3), k
    for j in range(k + 1, len(way)):
        part = way[j]
        if isinstance(part, RigidPart):
            place, turn = place + turn @ part.place, turn @ part.turn
        elif part.word != "slide" or not _alike(turn[:, part.axis], freedom.axis):
            break
        last = j
    if tip is None:
        return across(place, freedom.axis) + after[last]
    return across(turn @ tip, freedom.axis) if last == len(way) - 1 else after[k]


def _alike(direction: Sym, axis: int) -> bool:
    """Return whether a direction lies on a coordinate axis."""
    return all(entry.is_zero() for i, entry in enumerate(direction.elements()) if i != axis)


@dataclass
class Bounded:
    """Bounds of a product: of its size, of its first and second derivatives.

    ``symbols`` are the coordinates, ``first`` (n,) and ``second`` (n, n) belong to them.
    ``rounding`` and ``data`` say how much it changes by the rounding of its terms, in units of the
    roundoff, and when each parameter changes by its own size.
    """

    symbols: list[Any]
    size: Any
    first: list[Any]
    second: list[list[Any]]
    rounding: Any
    data: Any


def bounded(product: WayProduct, size: Size, ball: Norm, p: Sym) -> Bounded:
    """Return bounds of a product wherever its coordinates have their sizes.

    Parameters
    ----------
    size
        Gives the bound of the absolute value of a slide or of the angle of a screw.
    ball
        Gives the bound of the norm of a quaternion.
    p
        The parameters (np,) of `Bounded.data`.
    """
    way, factor = joined(product.way), ca.fabs(SX(product.factor))
    tip, start = side(way, product.tip, size, ball), side(back(way), product.start, size, ball)
    start = Side(start.total, start.after[::-1], start.moved[::-1], start.scale[::-1], start.point)
    one, other = (SX(1) if end is None else size_of(end) for end in (product.start, product.tip))
    length = one * other
    for end in (start, tip):
        length = length * (end.total if end.point else ONE)
    lever = tip.total if start.point and tip.point else one * other
    lever = lever if start.point or tip.point else ZERO
    free = [(k, part) for k, part in enumerate(way) if isinstance(part, Freedom)]
    each = [(k, part, symbol) for k, part in free for symbol in part.symbols]
    first = [factor * _first(k, part, start, tip, ball) for k, part, _ in each]
    second = [
        [factor * _second(way, min(i, j), max(i, j), start, tip, ball) for j, _, _ in each]
        for i, _, _ in each
    ]
    at_ends = [
        RigidPart(SX(3, 1), SX(end)) for end in (product.start, product.tip) if end is not None
    ]
    links = [*(part for part in way if isinstance(part, RigidPart)), *at_ends]
    balls = math.prod((ball(part) ** 2 for _, part in free if part.word == "ball"), start=ONE)
    reach = length * balls
    counted = reach * (_turned(links, free) + SUM * len(way) + PLACE)
    spread = [_spread(link.turn, p) * reach + _spread(link.place, p) * lever for link in links]
    data = sum(spread, ZERO) * factor + _spread(product.factor, p) * reach
    symbols = [symbol for _, _, symbol in each]
    rounding = factor * (counted + PLACE * reach)
    return Bounded(symbols, factor * reach, first, second, rounding, data)


def _first(k: int, part: Freedom, start: Side, tip: Side, ball: Norm) -> Sym:
    """Return the bound of a derivative by a coordinate of part k."""
    if part.word == "ball":
        return 2 * ball(part) * start.after[k] * tip.after[k]
    slid = ZERO
    if start.point and tip.point:
        slid = tip.total
    elif start.point or tip.point:
        slid = start.after[k] if tip.point else tip.after[k]
    if part.word == "slide":
        return slid
    turned = start.moved[k] * tip.moved[k]
    return turned + ca.fabs(part.lead) * slid if part.word == "screw" else turned


def _second(way: Way, i: int, j: int, start: Side, tip: Side, ball: Norm) -> Sym:
    """Return the bound of a second derivative by coordinates of the parts i <= j."""
    first, last = way[i], way[j]
    assert isinstance(first, Freedom)
    assert isinstance(last, Freedom)
    if i == j and first.word == "ball":
        return 2 * start.after[i] * tip.after[i]
    between = [part for part in way[i + 1 : j] if isinstance(part, Freedom) and part.word == "ball"]
    stretch = math.prod((ball(part) ** 2 for part in between), start=ONE)
    return _share(i, first, start, ball) * _share(j, last, tip, ball) * stretch


def _share(k: int, part: Freedom, end: Side, ball: Norm) -> Sym:
    """Return the bound of the derivative of what lies on one side by a coordinate of part k."""
    if part.word == "ball":
        return 2 * ball(part) * end.after[k]
    slid = ONE if end.point else ZERO
    if part.word == "slide":
        return slid
    return end.moved[k] + ca.fabs(part.lead) * slid if part.word == "screw" else end.moved[k]


def _turned(links: list[RigidPart], free: list[tuple[int, Freedom]]) -> int:
    """Return the roundings of all rotations of a way."""
    count = sum(BALL if part.word == "ball" else TURN for _, part in free)
    for link in links:
        entries = link.turn.elements()
        if not all(entry.is_constant() for entry in entries):
            count += COMPUTED
        elif any(abs(float(entry)) not in (0.0, 1.0) for entry in entries):
            count += DENSE
    return count


def _spread(value: Sym, p: Sym) -> Sym:
    """Return how much a constant changes when each parameter changes by its own size.

    Dense rotations of plain numbers are rounded themselves.
    """
    value = ca.vec(ca.densify(SX(value)))
    held = ca.jacobian(value, p)
    if held.nnz():
        columns = sorted(set(held.sparsity().get_triplet()[1]))
        return sum((size_of(held[:, j]) * ca.fabs(p[j]) for j in columns), ZERO)
    dense = any(abs(float(entry)) not in (0.0, 1.0) for entry in value.elements())
    return size_of(value) if dense else ZERO

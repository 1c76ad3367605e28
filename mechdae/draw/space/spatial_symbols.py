"""The symbols of pairs in space, after ISO 3952: barrels, sleeves, balls in sockets, crosses.

Each function gives the items of one symbol, and where the bars of both bodies begin. Places and
directions are (right, up, towards the eye) in units of the sheet.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field

import numpy as np

from mechdae.draw import style
from mechdae.draw.diagram.symbols import DOWN
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import unit
from mechdae.draw.space import solids
from mechdae.draw.space.depth import Facet, Item
from mechdae.records import dataclass

RADIUS, HALF = 5.2, 9.0
"""Of the barrel of a turning pair: radius and half length,"""
SHAFT = 7.0
"""and how far its shaft reaches out of it."""
SLEEVE = (11.0, 6.0)
"""Half length and half width of a sleeve."""
ROD = 22.0
"""How far a guide reaches beyond the ways of its sleeve."""
BALL, SOCKET = 4.6, 7.6
CROSS = 14.0
"""Half length of the pins of a universal joint, and radius of its forks."""
PLATE = (17.0, 11.0)
"""Half sides of the plates of a planar pair."""
STAND = 12.0
"""How far the hatching of a bearing is from its middle."""
ARROW = 15.0
"""Radius of the arrow of a driven turning pair."""


@dataclass(frozen=True)
class JointSide:
    """A body at a joint: what its bars go to.

    Parameters
    ----------
    body
        Its name; "ground" is fixed.
    color
        Of its lines.
    targets
        (k, 3) the other places of the body, to which it has bars.
    fixed
        Whether it is the ground, or welded to it.
    """

    body: str
    color: str
    targets: Array
    fixed: bool = False

    def way(self, center: Array) -> Array:
        """Return the mean direction (3,) from the joint to the body's other places, or zero."""
        if not len(self.targets):
            return np.zeros(3)
        away = self.targets - center
        sizes = np.linalg.norm(away, axis=1)
        mean: Array = (away[sizes > 0] / sizes[sizes > 0][:, None]).sum(axis=0)
        return mean


Start = Callable[[Array], Array]


@dataclass
class DrawnSymbol:
    """The items of a symbol, and where the bars of either body begin: of a target the place."""

    items: list[Item] = field(default_factory=list)
    first: Start | None = None
    second: Start | None = None


@dataclass(frozen=True)
class JointPlace:
    """Where a joint is: middle of its symbol, frame (rows normal, across, axis), ways of a slide.

    Parameters
    ----------
    center, other
        Middle of the symbol, and place of the point that slides.
    frame
        (3, 3) of the first side; ``pin`` the axis of the second one.
    span
        Least and greatest way of the second point along the axis, in units of the sheet.
    """

    name: str
    center: Array
    other: Array
    frame: Array
    pin: Array
    span: tuple[float, float] = (0.0, 0.0)
    left_handed: bool = False


def revolute(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A barrel of the first body about its axis, a shaft with collars of the second."""
    axis, gid = at.frame[2], f"joint-{at.name}-revolute"
    holder, shaft = (second, first) if second.fixed and not first.fixed else (first, second)
    drawn = DrawnSymbol()
    drawn.items.append(solids.barrel(at.center, axis, HALF, RADIUS, gid, holder.color))
    if holder.fixed:
        drawn.items.append(solids.pedestal(at.center, axis, HALF, STAND, f"support-{at.name}"))
    side = _shaft_side(at.center, axis, shaft)
    ends = {}
    for sign in (-1.0, 1.0):
        reach = HALF + (SHAFT if sign == side else 0.55 * SHAFT)
        start, end = at.center + sign * HALF * axis, at.center + sign * reach * axis
        drawn.items.append(solids.polyline(np.array([start, end]), gid, shaft.color, bridges=False))
        collar = at.center + sign * (HALF + 0.4 * SHAFT) * axis
        drawn.items.append(solids.disc(collar, axis, 0.62 * RADIUS, gid, shaft.color, shaft.color))
        ends[sign] = end

    def from_shaft(target: Array) -> Array:
        return np.asarray(ends[side])

    def from_barrel(target: Array) -> Array:
        return leaves(at.center, axis, target, HALF, RADIUS)

    swapped = holder is second
    drawn.first, drawn.second = (from_shaft, from_barrel) if swapped else (from_barrel, from_shaft)
    return drawn


def _shaft_side(center: Array, axis: Array, side: JointSide) -> float:
    """Return at which end of a shaft the bars of its body begin: the nearer to where they go."""
    along = float(side.way(center) @ axis)
    if abs(along) > 0.15:
        return float(np.sign(along))
    return 1.0 if axis[2] >= 0 else -1.0


def leaves(center: Array, axis: Array, target: Array, half: float, radius: float) -> Array:
    """Return where the way from the middle of a cylinder to a target leaves it."""
    away = target - center
    size = float(np.linalg.norm(away))
    if size == 0:
        return center
    away = away / size
    along = abs(float(away @ axis))
    beside = float(np.sqrt(max(1.0 - along**2, 0.0)))
    ends = [half / along] if along > 1e-9 else []
    walls = [radius / beside] if beside > 1e-9 else []
    place: Array = center + min([*ends, *walls, size]) * away
    return place


def _sleeve_and_rod(
    at: JointPlace, first: JointSide, second: JointSide, round_one: bool
) -> DrawnSymbol:
    """A guide of one body, a sleeve of the other: a fixed round sleeve holds, others slide."""
    axis = at.frame[2]
    held = round_one and first.fixed and not second.fixed
    sleeve, rod = (first, second) if held else (second, first)
    center, through = (at.center, at.other) if held else (at.other, at.center)
    gid = f"joint-{at.name}-sleeve"
    half, wide = SLEEVE
    drawn = DrawnSymbol()
    if round_one:
        drawn.items.append(solids.barrel(center, axis, half, wide, gid, sleeve.color))
    else:
        halves = np.array([wide, wide, half])
        drawn.items.append(solids.box(center, at.frame, halves, gid, sleeve.color))
    if sleeve.fixed:
        drawn.items.append(solids.pedestal(center, axis, half, STAND + 1.0, f"support-{at.name}"))
    drawn.items += _rod(at, rod, center, through, held)

    def from_sleeve(target: Array) -> Array:
        return leaves(center, axis, target, half, wide)

    def from_rod(target: Array) -> Array:
        return through

    drawn.first, drawn.second = (from_sleeve, from_rod) if held else (from_rod, from_sleeve)
    return drawn


def _rod(at: JointPlace, rod: JointSide, center: Array, through: Array, held: bool) -> list[Item]:
    """Return the guide as far as its sleeve comes, without what is inside of it."""
    axis, half = at.frame[2], SLEEVE[0]
    low, high = (-at.span[1], -at.span[0]) if held else at.span
    low, high = min(low, 0.0), max(high, 0.0)
    now = float((center - through) @ axis)
    low, high = min(low, now) - ROD, max(high, now) + ROD
    if held:  # a shaft ends at the place that it carries, and beyond its bearing
        low = low + ROD if low + ROD >= -1e-9 else low
        high = high - ROD if high - ROD <= 1e-9 else high
    items = []
    for a, b in ((low, now - half), (now + half, high)):
        if b - a > 0.5:
            ends = np.array([through + a * axis, through + b * axis])
            items.append(
                solids.polyline(ends, f"joint-{at.name}-guide", rod.color, bridges=not rod.fixed)
            )
    if rod.fixed:
        for end, sense in ((low, -1.0), (high, 1.0)):
            items.append(_wall(through + end * axis, sense * axis, f"support-{at.name}"))
    return items


def _wall(place: Array, out: Array, gid: str) -> Item:
    """Return the hatched wall at the end of a fixed guide."""
    along = unit(out[:2]) if np.hypot(*out[:2]) > 0.15 else np.array([0.0, -1.0])
    half = 8.0 * np.array([-along[1], along[0]])
    return solids.wall(place[:2] - half, place[:2] + half, along, float(place[2]), gid)


def prismatic(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A guide of the first body, a square sleeve of the second."""
    return _sleeve_and_rod(at, first, second, round_one=False)


def cylindrical(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A round sleeve about a rod."""
    return _sleeve_and_rod(at, first, second, round_one=True)


def screw(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A nut on a rod with a thread."""
    drawn = _sleeve_and_rod(at, first, second, round_one=True)
    axis = at.frame[2]
    sleeve = drawn.items[0]
    middle = at.center if first.fixed and not second.fixed else at.other
    lean = -0.45 if at.left_handed else 0.45
    u = solids.across(axis)[0]
    eye = np.array([0.0, 0.0, 1.0])
    towards = eye - axis * axis[2]
    size = float(np.linalg.norm(towards))
    towards = towards / size if size > 1e-6 else u
    beside = np.cross(axis, towards)
    for shift in (-0.55, 0.0, 0.55):
        turn = np.linspace(-1.1, 1.1, 9)
        place = (
            middle
            + (shift + lean * turn / 2.2)[:, None] * SLEEVE[0] * axis
            + SLEEVE[1] * (np.cos(turn)[:, None] * towards + np.sin(turn)[:, None] * beside)
        )
        sleeve.facets.insert(1, Facet(place[:, :2], closed=False, width=style.THIN))
    return drawn


def spherical(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A ball of the second body in a socket of the first."""
    gid = f"joint-{at.name}-ball"
    drawn = DrawnSymbol([solids.ball(at.center, BALL, gid, second.color)])
    back = first.way(at.center)[:2]
    if first.fixed or np.hypot(*back) < 1e-3:
        back = -second.way(at.center)[:2]
    if first.fixed and np.hypot(*back) < 1e-3:
        back = np.array([0.0, -1.0])
    middle = float(np.arctan2(back[1], back[0])) if np.hypot(*back) > 0 else -np.pi / 2
    turn = np.linspace(middle - 1.75, middle + 1.75, 22)
    cup = at.center[:2] + SOCKET * np.column_stack([np.cos(turn), np.sin(turn)])
    behind = np.column_stack([cup, np.full(len(cup), at.center[2] - 0.8 * BALL)])
    drawn.items.append(
        Item(behind, gid=f"joint-{at.name}-socket", color=first.color, width=1.6 * style.LINE,
             bridges=False)
    )  # fmt: skip
    if first.fixed:
        out = unit(back)
        drawn.items.append(
            _wall(at.center + np.array([*(out * (SOCKET + 1.5)), -BALL]), np.array([*out, 0.0]),
                  f"support-{at.name}")
        )  # fmt: skip

    def beside(radius: float) -> Start:
        def start(target: Array) -> Array:
            away = target - at.center
            size = float(np.linalg.norm(away))
            return at.center + min(radius, size) * away / size if size > 0 else at.center

        return start

    drawn.first, drawn.second = beside(SOCKET), beside(BALL)
    return drawn


def universal(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A cross of two pins, each in the fork of a body."""
    gid = f"joint-{at.name}-universal"
    drawn = DrawnSymbol()
    starts: list[Start] = []
    for own, pin in ((first, at.frame[2]), (second, at.pin)):
        pins = np.array([at.center - CROSS * pin, at.center, at.center + CROSS * pin])
        for half in (pins[:2], pins[1:]):
            drawn.items.append(
                solids.polyline(half, gid, style.INK, 1.5 * style.LINE, bridges=False)
            )
        way = own.way(at.center)
        way = way - pin * float(way @ pin)
        size = float(np.linalg.norm(way))
        way = way / size if size > 1e-9 else np.cross(pin, [0.0, 0.0, 1.0])
        for sign in (-1.0, 1.0):
            turn = np.linspace(0.0, np.pi / 2, 9)[:, None]
            fork = at.center + CROSS * (sign * np.cos(turn) * pin + np.sin(turn) * way)
            drawn.items.append(solids.polyline(fork, gid, own.color, bridges=False))
            tip = at.center + sign * CROSS * pin
            drawn.items.append(solids.disc(tip, pin, 2.6, gid, own.color, own.color))
        apex = at.center + CROSS * way
        starts.append(_always(apex))
    drawn.items.append(solids.ball(at.center, 2.6, gid))
    drawn.first, drawn.second = starts
    return drawn


def _always(place: Array) -> Start:
    return lambda target: place


def planar(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A plate of the second body on one of the first."""
    gid = f"joint-{at.name}-plane"
    n, m, a = at.frame
    drawn = DrawnSymbol()
    lift = 3.0 * (1.0 if float(second.way(at.other) @ a) >= 0 else -1.0)
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
    for own, half, shift, fill in (
        (first, PLATE[0], -lift / 2, style.FILL),
        (second, PLATE[1], lift / 2, style.PAPER),
    ):
        corners = at.other + shift * a + half * square @ np.array([n, m])
        drawn.items.append(
            Item(corners, closed=True, gid=gid, color=own.color, fill=fill, width=solids.EDGE)
        )
        if own.fixed:
            low = int(np.argmin(corners[:, 1] + np.roll(corners[:, 1], -1)))
            ends = corners[[low, (low + 1) % 4]]
            out = ends.mean(axis=0) - at.other
            drawn.items.append(
                _edge(ends, unit(out[:2]) if np.hypot(*out[:2]) > 0 else DOWN, at.name)
            )
    drawn.first = drawn.second = None
    return drawn


def _edge(ends: Array, side: Array, name: str) -> Item:
    normal = np.array([-1.0, 1.0]) * unit((ends[1] - ends[0])[:2])[::-1]
    normal, depth = normal if normal @ side > 0 else -normal, float(ends[:, 2].mean())
    return solids.wall(ends[0, :2], ends[1, :2], normal, depth, f"support-{name}")


def weld(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A rigid connection: a filled square, or the hatched ground."""
    half = 0.9 * style.PIN
    square = at.center[:2] + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    points = np.column_stack([square, np.full(4, at.center[2])])
    facets = [Facet(square, fill=style.INK)]
    item = Item(points, closed=True, solid=True, facets=facets, gid=f"joint-{at.name}-weld")
    drawn = DrawnSymbol([item])
    if first.fixed or second.fixed:
        low = at.center + np.array([0.0, -half, 0.0])
        drawn.items.append(_wall(low, np.array([0.0, -1.0, 0.0]), f"support-{at.name}"))
    return drawn


def distance(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A dashed line between two small balls."""
    ends = np.array([at.center, at.other])
    gid = f"joint-{at.name}-distance"
    drawn = DrawnSymbol([solids.polyline(ends, gid, width=style.LINE, dash=style.DASHED)])
    drawn.items += [solids.ball(end, 0.75 * style.PIN, gid) for end in ends]
    for end, own in zip(ends, (first, second), strict=True):
        if own.fixed:
            low = end + np.array([0.0, -style.PIN, 0.0])
            drawn.items.append(_wall(low, np.array([0.0, -1.0, 0.0]), f"support-{at.name}"))
    return drawn


SYMBOLS: Mapping[str, Callable[[JointPlace, JointSide, JointSide], DrawnSymbol]] = {
    "revolute": revolute,
    "prismatic": prismatic,
    "cylindrical": cylindrical,
    "screw": screw,
    "spherical": spherical,
    "universal": universal,
    "planar": planar,
    "weld": weld,
    "distance": distance,
}
"""Kind of joint -> its symbol."""

"""The symbols of pairs in space, after ISO 3952: barrels, sleeves, balls in sockets, crosses.

Each function gives the items of one symbol, and where the bars of both bodies begin. Places and
directions are (right, up, towards the eye) in units of the sheet.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field

import numpy as np

from mechdae.draw import style
from mechdae.draw.primitives import PAPER, Anchor, Array
from mechdae.draw.space import solids
from mechdae.draw.space.solids import Facet, Item
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
CUP = (-0.3, 0.45, 1.1)
"""Latitudes [rad] of the circles of a socket."""
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
    turn
        What its directions turn with, see `mechdae.draw.primitives.Anchor`.
    """

    body: str
    color: str
    targets: Array
    fixed: bool = False
    turn: str = ""

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
        Least and greatest way of a sleeve along its guide, zero among them, in units of the sheet.
    up
        (3,) direction that is upright.
    bases
        What places of ``center`` and ``other`` keep to; ``turn`` what the frame turns with.
    """

    name: str
    center: Array
    other: Array
    frame: Array
    pin: Array
    span: tuple[float, float] = (0.0, 0.0)
    left_handed: bool = False
    up: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    bases: tuple[str, str] = ("", "")
    turn: str = ""

    def stand(self, center: Array, half: float, reach: float) -> Item:
        """Return the stand of what turns or slides about the axis."""
        return solids.stand(center, self.frame[2], self.up, half, reach, f"support-{self.name}")

    def wall(self, place: Array, out: Array) -> Item:
        """Return a fixed plate across a direction."""
        return solids.wall(place, out, f"support-{self.name}")


def revolute(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A barrel of the first body about its axis, a shaft with collars of the second."""
    axis, gid = at.frame[2], f"joint-{at.name}-revolute"
    holder, shaft = (second, first) if second.fixed and not first.fixed else (first, second)
    drawn = DrawnSymbol()
    if holder.fixed:
        drawn.items.append(at.stand(at.center, HALF, STAND))
    drawn.items.append(solids.barrel(at.center, axis, HALF, RADIUS, gid, holder.color))
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
    return -1.0 if float(side.way(center) @ axis) < -0.15 else 1.0


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
    return center + min([*ends, *walls, size]) * away


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
    if sleeve.fixed:
        drawn.items.append(at.stand(center, half, STAND + 1.0))
    if round_one:
        drawn.items.append(solids.barrel(center, axis, half, wide, gid, sleeve.color))
    else:
        halves = np.array([wide, wide, half])
        drawn.items.append(solids.box(center, at.frame, halves, gid, sleeve.color))
    for item in drawn.items:
        item.anchor = Anchor((at.bases[not held],), at.turn)
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
    low, high = at.span
    now = float((center - through) @ axis)
    low, high = min(low, now) - ROD, max(high, now) + ROD
    if held:  # a shaft ends at the place that it carries, and beyond its bearing
        low = low + ROD if low + ROD >= -1e-9 else low
        high = high - ROD if high - ROD <= 1e-9 else high
    items = []
    sleeve = at.bases[not held]
    for a, b, base in ((low, now - half, "low"), (now + half, high, "high")):
        base = f"{at.name}/{base}"
        if b - a > 0.5:
            ends = np.array([through + a * axis, through + b * axis])
            items.append(
                solids.polyline(
                    ends, f"joint-{at.name}-guide", rod.color, bridges=not rod.fixed,
                    anchor=Anchor((base, sleeve) if a == low else (sleeve, base), at.turn),
                )
            )  # fmt: skip
    if rod.fixed:
        for end, sense, base in ((low, -1.0, "low"), (high, 1.0, "high")):
            items.append(at.wall(through + end * axis, sense * axis))
            items[-1].anchor = Anchor((f"{at.name}/{base}",), at.turn)
    return items


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
    u, v = solids.across(axis)
    turn = np.linspace(-1.1, 1.1, 9)[:, None]
    for side in np.linspace(0.0, 2 * np.pi, 5)[:-1]:  # the thread, seen where it faces the eye
        for shift in (-0.55, 0.0, 0.55):
            out = np.cos(side + turn) * u + np.sin(side + turn) * v
            along = (shift + lean * turn / 2.2) * SLEEVE[0] * axis
            if (np.cos(side) * u + np.sin(side) * v)[2] > 0.5:
                place = middle + along + SLEEVE[1] * out
                sleeve.facets.insert(1, Facet("line", place, width=style.THIN))
    return drawn


def spherical(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A ball of the second body in a cup of the first."""
    back = first.way(at.center)
    if first.fixed or float(np.linalg.norm(back)) < 1e-3:
        back = -at.up
    back = back / np.linalg.norm(back)
    rims = [
        solids.rim(at.center + SOCKET * np.sin(t) * back, back, SOCKET * np.cos(t)) for t in CUP
    ]
    facets = [Facet("hull", np.vstack(rims), True, edge=first.color, width=1.4 * style.LINE)]
    socket = solids.solid(facets, f"joint-{at.name}-socket", Anchor(at.bases[:1], first.turn))
    socket.points[:, 2] -= 0.8 * BALL
    ball = solids.ball(at.center, BALL, f"joint-{at.name}-ball", second.color, at.bases[0])
    drawn = DrawnSymbol([socket, ball])
    if first.fixed:
        drawn.items.append(at.wall(at.center + (SOCKET + 1.5) * back, back))

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
    for side, pin in ((first, at.frame[2]), (second, at.pin)):
        anchor = Anchor(at.bases[:1], side.turn)
        pins = np.array([at.center - CROSS * pin, at.center, at.center + CROSS * pin])
        for half in (pins[:2], pins[1:]):
            drawn.items.append(
                solids.polyline(half, gid, style.INK, 1.5 * style.LINE, bridges=False)
            )
        way = side.way(at.center)
        way = way - pin * float(way @ pin)
        size = float(np.linalg.norm(way))
        way = way / size if size > 1e-9 else np.cross(pin, [0.0, 0.0, 1.0])
        for sign in (-1.0, 1.0):
            turn = np.linspace(0.0, np.pi / 2, 9)[:, None]
            fork = at.center + CROSS * (sign * np.cos(turn) * pin + np.sin(turn) * way)
            drawn.items.append(solids.polyline(fork, gid, side.color, bridges=False))
            tip = at.center + sign * CROSS * pin
            drawn.items.append(solids.disc(tip, pin, 2.6, gid, side.color, side.color))
        for item in drawn.items:
            item.anchor = anchor if item.anchor is PAPER else item.anchor
        apex = at.center + CROSS * way
        starts.append(_always(apex))
    drawn.items.append(solids.ball(at.center, 2.6, gid, base=at.bases[0]))
    drawn.first, drawn.second = starts
    return drawn


def _always(place: Array) -> Start:
    return lambda target: place


def planar(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A plate of the second body on one of the first."""
    gid = f"joint-{at.name}-plane"
    rows, a = at.frame[:2], at.frame[2]
    drawn = DrawnSymbol()
    rise = 1.0 if float(second.way(at.other) @ a) >= 0 else -1.0
    for side, half, sign, fill in (
        (first, PLATE[0], -rise, style.FILL),
        (second, PLATE[1], rise, style.PAPER),
    ):
        middle = at.other + 1.5 * sign * a
        corners = middle + half * solids.SQUARE @ rows
        facets = [Facet("area", corners, edge=side.color, fill=fill, width=solids.EDGE)]
        if side.fixed:
            facets = solids.plate(middle, sign * a, at.frame[0], half, half)
        drawn.items.append(solids.solid(facets, gid, Anchor(at.bases[1:], at.turn)))
    return drawn


def weld(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A rigid connection: a filled square, or the hatched ground."""
    half = 0.9 * style.PIN
    square = at.center + half * np.hstack([solids.SQUARE, np.zeros((4, 1))])
    facets, anchor = [Facet("area", square, fill=style.INK)], Anchor(at.bases[:1], solids.EYE)
    drawn = DrawnSymbol([solids.solid(facets, f"joint-{at.name}-weld", anchor)])
    if first.fixed or second.fixed:
        drawn.items.append(at.wall(at.center - half * at.up, -at.up))
    return drawn


def distance(at: JointPlace, first: JointSide, second: JointSide) -> DrawnSymbol:
    """A dashed line between two small balls."""
    ends, gid = np.array([at.center, at.other]), f"joint-{at.name}-distance"
    line = solids.polyline(ends, gid, width=style.LINE, dash=style.DASHED, anchor=Anchor(at.bases))
    drawn = DrawnSymbol([line])
    for end, side, base in zip(ends, (first, second), at.bases, strict=True):
        drawn.items.append(solids.ball(end, 0.75 * style.PIN, gid, base=base))
        if side.fixed:
            drawn.items.append(at.wall(end - style.PIN * at.up, -at.up))
            drawn.items[-1].anchor = Anchor((base,))
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

"""Loads in the diagram: arrows of forces and torques, springs, dampers, gravity, masses.

The arrow of a force starts or ends at its point and lies on its line of action. Where the
description gives the values at the pose the arrows of forces are as long as they are large,
relative to the largest; where it does not the direction is what is known of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.loads import Force, Load, Resistance, Spring, TableLoad
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.amounts import acts, load_values, pushing
from mechdae.draw.diagram.driver import anchor_of, blocked, pivot_and_arm, travel_of, turn_arrow
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.diagram.places import AnyScene, Place, hull, places_of, within
from mechdae.draw.labels.layout import feet
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.sheet import Sheet, arc, normal, unit
from mechdae.draw.words import Words
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.results import SweepResult

RADII = (style.ARC + 8.0, style.ARC + 15.0)
"""Radii of the curved arrows of torques, outside the driver's."""
MANY = 4
"""With more loads their sizes are not written."""
ASIDE = style.BLOCK[1] + 5.0
"""Forces on a coordinate may be drawn so far beside it."""
SHORTEST, LONGEST = 34.0, 200.0
"""A spring on a coordinate is drawn at least so long, from zero at most so long."""
GRAVITY = 26.0
"""Length of the arrow of gravity."""
END_ON = 9.0
"""Arrows that look shorter than this are drawn as rings; such springs are not drawn."""


@dataclass(frozen=True)
class Mark:
    """A load that was drawn: its letter belongs to the lines given, on the sheet."""

    name: str
    text: str
    lines: tuple[tuple[Array, Array], ...]
    color: str = style.LOAD


def load_points(scene: PlacedScene, pose: int) -> list[Array]:
    """Return the points [m] at which forces and springs take hold, and centres of mass."""
    references: list[str] = []
    for load in scene.mechanism.loads.values():
        if isinstance(load, Force):
            references.append(load.point)
        elif isinstance(load, Spring):
            references += load.between or ()
    shown = [entry for entry in references if scene.shown(entry.split(".")[0], pose)]
    centers = [(name, center_and_foot(scene, name)) for name in heavy_bodies(scene, pose)]
    carried = [scene.carried(name, found[0], pose) for name, found in centers if found is not None]
    return [*(scene.place(entry, pose) for entry in shown), *carried]


def heavy_bodies(scene: PlacedScene, pose: int) -> list[str]:
    """Return the bodies shown that have a mass."""
    known = scene.mechanism.bodies
    return [name for name in known if known[name].mass is not None and scene.shown(name, pose)]


def peak_force(scene: PlacedScene, result: SweepResult, poses: Sequence[int]) -> float | None:
    """Return the largest of the forces with a straight arrow that are known, in some poses."""
    sizes = []
    for load in scene.mechanism.loads.values():
        if isinstance(load, Spring) or turns(scene, load):
            continue
        rows = [load_values(scene, result, load, pose) for pose in poses]
        sizes += [math.hypot(*row) for row in rows if row is not None]
    return max(sizes, default=0.0) or None


def turns(scene: PlacedScene, load: Load) -> bool:
    """Return whether a load acts about an axis, not along a line."""
    if isinstance(load, Force):
        return False
    return getattr(load, "body", None) is not None or coordinate_of(scene, load).is_angle


def acting(scene: PlacedScene, load: Load, pose: int) -> bool:
    """Return whether the bodies that a load acts on are shown."""
    ends = (load.point,) if isinstance(load, Force) else getattr(load, "between", None)
    body = getattr(load, "body", None)
    bodies = {end.split(".")[0] for end in ends or ()} if body is None else {body}
    if not bodies:
        entry = coordinate_of(scene, load)
        joint = scene.mechanism.joints.get(entry.part)
        bodies = {entry.part} if joint is None else set(joint.bodies)
    return all(scene.shown(body, pose) for body in bodies)


def coordinate_of(scene: PlacedScene, load: object) -> NamedCoordinate:
    """Return the coordinate along which a load works."""
    body = getattr(load, "body", None)
    along = getattr(load, "along", None) or getattr(load, "coordinate", None)
    return coordinate(scene.mechanism, f"{body}.angle" if body is not None else str(along))


def text_of(name: str, size: float | None, unit: str, words: Words) -> str:
    """Return what is written at a load: its name and, if it is known, its size."""
    return name if size is None else f"{name} = {words.amount(abs(size), unit)}"


@dataclass(frozen=True)
class StraightLoad:
    """A load with a straight arrow at a place [m]; without a way only its place is known.

    ``gap`` is the room between place and arrow; ``both``: there are heads at both ends.
    """

    load: Load
    place: Array
    way: Array | None
    size: float | None
    anchor: Anchor
    gap: float = style.PIN + 2.0
    both: bool = False


class DrawnLoads:
    """The loads of one pose of the plane, and what all of them have in common with those of space.

    Parameters
    ----------
    places
        Joint places of the pose.
    peak
        The force [N] whose arrow has full length; without it the largest in this pose.
    """

    def __init__(
        self, sheet: Sheet, scene: AnyScene, result: Any, pose: int, words: Words,
        peak: float | None = None, places: Sequence[Place] | None = None,
    ) -> None:  # fmt: skip
        self.sheet, self.scene, self.result, self.pose = sheet, scene, result, pose
        self.words, self.peak, self.marks = words, peak, list[Mark]()
        self.shortest: float = END_ON
        self.places: list[Place] = places_of(scene, pose) if places is None else [*places]
        known = scene.mechanism.loads.values()
        self.known: list[Load] = [load for load in known if acting(scene, load, pose)]

    def draw(self) -> list[Mark]:
        """Draw all loads whose bodies are shown; return what letters are attached to.

        A resistance whose coordinate stands still has heads at both ends.
        """
        self.springs()
        self.arrows()
        return self.masses()

    # -- where things are ------------------------------------------------------------------

    def at(self, place: Array) -> Array:
        """Return a place [m] on the sheet, in space with its depth."""
        return self.sheet.at(place)

    def seen(self, way: Array) -> Array:
        """Return a direction as it is seen."""
        return way

    def anchor(self, entry: NamedCoordinate) -> Anchor:
        """Return what is drawn at a coordinate moves with."""
        return anchor_of(self.scene, entry, self.places)

    def travel(self, entry: NamedCoordinate) -> tuple[Array, Array] | None:
        """Return the place [m] and the direction of a coordinate, if they are known."""
        return travel_of(self.scene, entry, self.pose)

    def pivot(self, entry: NamedCoordinate) -> Array:
        """Return where [m] an angle is drawn."""
        return pivot_and_arm(self.scene, entry, self.places, self.pose)[0]

    # -- arrows ----------------------------------------------------------------------------

    def arrows(self) -> None:
        """Draw the arrows of forces and torques."""
        pulls = [pull for load in self.known if (pull := self._pull(load)) is not None]
        peak = self.peak or max((pull.size for pull in pulls if pull.size), default=1.0)
        for pull in pulls:
            if pull.size != 0.0:
                self._straight(pull, 1.0 if pull.size is None else pull.size / peak)

    def _pull(self, load: Load) -> StraightLoad | None:
        """Return a load with a straight arrow; draw one that turns."""
        if isinstance(load, Spring):
            return None
        values = load_values(self.scene, self.result, load, self.pose)
        if isinstance(load, Force):
            given = None if values is None else np.array(values)
            vector = None if given is None else self.scene.in_world(load.frame, given, self.pose)
            size = None if vector is None else float(np.linalg.norm(vector))
            way = vector / size if vector is not None and size else None
            place = self.scene.place(load.point, self.pose)
            frame = "" if load.frame in ("world", GROUND) else load.frame
            return StraightLoad(load, place, way, size, Anchor((load.point,), frame))
        if self.couple(load, values):
            return None
        entry, resists = coordinate_of(self.scene, load), isinstance(load, Resistance)
        against = 1.0
        if isinstance(load, Resistance):
            against = pushing(self.scene, self.result, load, self.pose)
        size = None if values is None else values[0]
        turn = (against or 1.0) * (1.0 if size is None else float(np.sign(size)))
        if entry.is_angle:
            both = against == 0.0 or (size is None and not resists)
            if size != 0.0:
                self.turning(load, entry, turn, size, both)
            return None
        found = self.travel(entry)
        if found is None:
            return None
        way = None if size is None and isinstance(load, TableLoad) else turn * found[1]
        size, gap = None if size is None else abs(size), style.BLOCK[0] + 3.5
        return StraightLoad(load, found[0], way, size, self.anchor(entry), gap, against == 0.0)

    def couple(self, load: Load, values: tuple[float, ...] | None) -> bool:
        """Draw a torque about an axis of its own; return whether it was one."""
        return False

    def _straight(self, pull: StraightLoad, share: float) -> None:
        """Draw a straight arrow from or to its point, where it covers least."""
        name, point, sheet = pull.load.name, self.at(pull.place), self.sheet
        gid, text = f"load-{name}", text_of(name, pull.size, "N", self.words)
        if pull.way is None:  # the description does not tell the direction
            with sheet.held(pull.anchor):
                radius, dash = 2.0 * style.PIN, style.DASHED
                sheet.circle(point[:2], radius, edge=style.LOAD, dash=dash, gid=gid)
            self.marks.append(Mark(name, text, ((point[:2], point[:2] + 1e-3),)))
            return
        way, length = self.seen(pull.way), max(style.PULL[0], style.PULL[1] * share)
        if length * float(np.hypot(*way[:2])) < self.shortest:
            with sheet.held(pull.anchor):
                edge = symbols.end_on(sheet, point[:2], float(way[2]) > 0, gid)
            self.marks.append(Mark(name, text, ((point[:2], edge),)))
            return
        across = np.zeros(len(way))
        across[:2] = normal(unit(way[:2]))
        lines = [
            point + lift * across + np.outer((start, start + length), way)
            for lift in ((0.0, ASIDE, -ASIDE) if pull.gap > style.BLOCK[0] else (0.0,))
            for start in (pull.gap, -pull.gap - length)
        ]
        cost = [self._cost(line[:, :2]) + 2.0 * (k > 1) for k, line in enumerate(lines)]
        line = lines[int(np.argmin(np.round(cost, 6)))]
        self.arrow(line, gid, pull)
        self.marks.append(Mark(name, text, ((line[0, :2], line[1, :2]),)))

    def _cost(self, line: Array) -> float:
        outside = (line < 1.0).any() or (line > self.sheet.size - 1.0).any()
        return blocked(self.sheet, np.linspace(line[0], line[1], 9)) + 100.0 * bool(outside)

    def arrow(self, line: Array, gid: str, pull: StraightLoad) -> None:
        """Draw a straight arrow."""
        with self.sheet.held(pull.anchor):
            for points in (line, line[::-1])[: 1 + pull.both]:
                symbols.arrow(self.sheet, points, gid, style.LOAD)

    def turning(
        self, load: Load, entry: NamedCoordinate, turn: float, size: float | None, both: bool
    ) -> None:
        """Draw a curved arrow; one with two heads where the sense is not known."""
        pivot, arm = pivot_and_arm(self.scene, entry, self.places, self.pose)
        center, gid = self.sheet.at(pivot), f"load-{load.name}"
        options = [turn_arrow(self.sheet, center, arm, turn, radius) for radius in RADII]
        points = min(options, key=lambda line: round(blocked(self.sheet, line), 6))
        with self.sheet.held(self.anchor(entry)):
            for line in (points, points[::-1])[: 1 + both]:
                symbols.arrow(self.sheet, line, gid, style.LOAD)
        pieces = tuple(zip(points[0:-6:6], points[6::6], strict=True))
        self.marks.append(Mark(load.name, text_of(load.name, size, "N m", self.words), pieces))

    # -- springs, dampers ------------------------------------------------------------------

    def springs(self) -> None:
        """Draw springs and dampers."""
        for load in self.known:
            mark = self._spring(load) if isinstance(load, Spring) else None
            self.marks += [] if mark is None else [mark]

    def _spring(self, load: Spring) -> Mark | None:
        sheet, entry = self.sheet, None if load.between else coordinate_of(self.scene, load)
        if entry is not None and entry.is_angle:
            with sheet.held(self.anchor(entry)):
                return torsion_mark(sheet, load, self.at(self.pivot(entry))[:2])
        if entry is None:
            assert load.between is not None
            places = [self.scene.place(end, self.pose) for end in load.between]
            for end, place in zip(load.between, places, strict=True):
                if end.split(".")[0] == GROUND and not self._pinned(end):
                    self.support(end, self.at(place), load.name)
            ends = between_points(*(self.at(place)[:2] for place in places))
            held = Anchor(load.between, ">".join(load.between), span=True)
        else:
            found = self.travel(entry)
            if found is None:
                return None
            ends, zero = self._ends(entry, *found)
            held = self.beside(entry)
            if zero:
                joint = self.scene.mechanism.joints[entry.part]
                held = Anchor((joint.first, joint.second), held.turn, span=True)
        if float(np.hypot(*(ends[1] - ends[0]))) < END_ON:
            return None
        with sheet.held(held):
            return spring_mark(sheet, load, ends)

    def _pinned(self, reference: str) -> bool:
        return any(reference in place.references and place.joints for place in self.places)

    def support(self, reference: str, place: Array, name: str) -> None:
        """Draw the ground at the end of a spring."""
        with self.sheet.on(reference):
            symbols.support(self.sheet, place, f"support-{reference}")
            symbols.pin(self.sheet, place, f"load-{name}-pin")

    def beside(self, entry: NamedCoordinate) -> Anchor:
        """Return what a spring along a coordinate moves with."""
        return self.anchor(entry)

    def _ends(
        self, entry: NamedCoordinate, place: Array, way: Array
    ) -> tuple[tuple[Array, Array], bool]:
        """Return the ends of a spring on a slide or on a point's coordinate, and whether from zero.

        From where the coordinate is zero to the point, if that is long enough; else on the
        free side of the point.
        """
        center, axis, gap, value = self.at(place)[:2], self.seen(way)[:2], style.BLOCK[0], 0.0
        along = unit(axis)
        if entry.kind == "slide":
            joint = self.scene.mechanism.joints[entry.part]
            origin = self.at(self.scene.place(joint.first, self.pose))[:2]
            value = float((center - origin) @ along)
        if gap + SHORTEST < abs(value) < LONGEST:
            ends = np.array([center - value * along, center - np.sign(value) * gap * axis])
            lifts = (0.0, style.COIL + 1.0, -style.COIL - 1.0)
            rows = [ends + lift * normal(along) for lift in lifts]
            rest = [round(blocked(self.sheet, np.linspace(a, b, 17)[3:-3]), 6) for a, b in rows]
            chosen = rows[int(np.argmin(rest))]
            return (chosen[0], chosen[1]), True
        far = [center - sign * (gap + SHORTEST) * axis for sign in (1.0, -1.0)]
        near = [center - sign * gap * axis for sign in (1.0, -1.0)]
        cost = [blocked(self.sheet, np.linspace(a, b, 9)) for a, b in zip(far, near, strict=True)]
        k = int(np.argmin(np.round(cost, 6)))
        return (far[k], near[k]), False

    # -- gravity and masses ----------------------------------------------------------------

    def masses(self) -> list[Mark]:
        """Draw centres of mass that are no joints, and gravity; return the marks of all loads."""
        marks = self.marks
        if len(marks) > MANY:
            marks = [replace(mark, text=mark.name) for mark in marks]
        mechanism, numbers = self.scene.mechanism, self.scene.numbers
        heavy = heavy_bodies(self.scene, self.pose)
        for name in heavy:
            self._mass(name)
        pull = np.array([numbers.get(f"gravity.{axis}", 0.0) for axis in mechanism.axes])
        if not heavy or not pull.any():
            return marks
        way = self.seen(pull / float(np.linalg.norm(pull)))
        return [*marks, *gravity_mark(self.sheet, way[:2])]

    def _mass(self, name: str) -> None:
        """Draw a centre of mass, tied by a thin line to its link where it lies beside it."""
        found = center_and_foot(self.scene, name)
        if found is None:
            return
        local, foot = found
        points = [self.scene.local(f"{name}.{p}") for p in self.scene.mechanism.body(name).points]
        places = [self.scene.carried(name, own, self.pose) for own in (local, foot, *points)]
        if not np.isfinite(places).all():
            return
        center, end, *corners = (self.at(place)[:2] for place in places)
        border = np.array(corners)
        inside = len(border) > 2 and within(center[None], border[hull(border)])[0]
        if not inside and float(np.hypot(*(end - center))) > 2 * style.DOT:
            with self.sheet.held(self.on_body(name, "center", "foot")):
                self.sheet.line(
                    [center, end], color=style.GROUND, width=style.THIN, dash=style.DASHED,
                    z=style.Z_BAR, gid=f"mass-{name}-tie", weight=style.RING,
                )  # fmt: skip
        with self.sheet.held(self.on_body(name, "center")):
            symbols.mass_center(self.sheet, center, f"mass-{name}", self.turn(name))

    def turn(self, name: str) -> float:
        """Return the angle of a centre of mass."""
        return float(self.scene.angles[name][self.pose])

    def on_body(self, name: str, *places: str) -> Anchor:
        """Return what places of a body move with."""
        return Anchor((self.scene.points(name)[0],), name, "m")


def center_and_foot(scene: PlacedScene, name: str) -> tuple[Array, Array] | None:
    """Return the centre of mass of a body in its frame, and the place of its link nearest to it.

    None of bodies without a centre, and of those whose centre is a point of them.
    """
    body = scene.mechanism.body(name)
    if getattr(body, "center", None) is None:
        return None
    center = np.array([scene.numbers[f"{name}.center.{axis}"] for axis in scene.mechanism.axes])
    points = np.array([scene.local(f"{name}.{point}") for point in body.points])
    if (np.linalg.norm(points - center, axis=1) <= 1e-12).any():
        return None
    i, j = np.triu_indices(len(points))
    spots = feet(center, points[i], points[j])
    away = np.linalg.norm(spots - center, axis=1)
    return center, spots[int(np.argmin(np.round(away / away.max(), 9)))]


def kinds_of_spring(load: Spring) -> tuple[bool, bool]:
    """Return whether a spring and whether a damper is drawn of it."""
    elastic = acts(load, "stiffness") or acts(load, "preload") or not acts(load, "damping")
    return elastic, acts(load, "damping")


def between_points(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the ends of a spring between two points on the sheet, beside their pins."""
    along = unit(b - a)
    gap = min(style.PIN, 0.2 * float(np.hypot(*(b - a))))
    return a + gap * along, b - gap * along


def spring_mark(sheet: Sheet, load: Spring, ends: tuple[Array, Array]) -> Mark:
    """Draw a spring, a damper or both beside each other between two places on the sheet."""
    elastic, damped = kinds_of_spring(load)
    shift = style.SPREAD * normal(unit(ends[1] - ends[0])) if elastic and damped else np.zeros(2)
    for wanted, draw, side in (
        (elastic, symbols.spring, 1.0),
        (damped, symbols.damper, -1.0),
    ):
        if wanted:
            draw(sheet, ends[0] + side * shift, ends[1] + side * shift, f"load-{load.name}")
    if shift.any():
        for end in ends:
            tie = [end + 1.6 * shift, end - 1.6 * shift]
            sheet.line(tie, color=style.LOAD)
    return Mark(load.name, load.name, ((ends[0] + 2 * shift, ends[1] + 2 * shift),))


def torsion_mark(sheet: Sheet, load: Spring, center: Array) -> Mark:
    """Draw a torsion spring, a damper of turns or both around a place on the sheet."""
    elastic, damped = kinds_of_spring(load)
    if elastic:
        symbols.spiral(sheet, center, f"load-{load.name}")
    if damped:
        radius = 4.3 * style.PIN
        angles = np.deg2rad(135.0) + np.arange(24) * np.pi / 12
        cost = [blocked(sheet, arc(center, radius, a - 1.1, a + 0.6, 10)) for a in angles]
        angle = float(angles[int(np.argmin(np.round(cost, 6)))])
        symbols.brake(sheet, center, angle, f"load-{load.name}")
    reach = 4.2 * style.PIN
    box = ((-1, -1), (1, -1)), ((1, -1), (1, 1)), ((1, 1), (-1, 1)), ((-1, 1), (-1, -1))
    sides = tuple((center + reach * np.array(a), center + reach * np.array(b)) for a, b in box)
    return Mark(load.name, load.name, sides)


def gravity_mark(sheet: Sheet, way: Array) -> list[Mark]:
    """Draw the arrow of gravity in a corner that is free; `way` is shorter than 1 in perspective.

    None where it is seen end-on.
    """
    if float(np.hypot(*way)) < 0.3:
        return []
    step, edge = GRAVITY * way, 18.0
    low, high = np.minimum(step, 0.0), np.maximum(step, 0.0)
    floor = np.array([edge, edge + style.STRIP])
    starts = [
        np.where(side, sheet.size - edge - high, floor - low)
        for side in ((True, True), (False, True), (True, False), (False, False))
    ]
    lines = [np.array([start, start + step]) for start in starts]
    cost = [blocked(sheet, np.linspace(line[0], line[1], 9)) for line in lines]
    line = lines[int(np.argmin(np.round(cost, 6)))]
    symbols.arrow(sheet, line, "gravity", style.FAINT)
    return [Mark("gravity", "g", ((line[0], line[1]),), style.FAINT)]

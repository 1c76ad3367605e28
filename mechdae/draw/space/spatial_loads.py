"""Loads in space: arrows of forces and torques, springs, dampers, centres of mass, gravity.

Arrows have their length in space, so those that point towards the eye look short, and end-on a dot
in a ring is an arrow towards the eye, a cross one away from it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.loads import Force, Load, Resistance, Spring, TableLoad, Torque
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.amounts import load_axis, load_values, pushing
from mechdae.draw.diagram.driver import blocked
from mechdae.draw.diagram.loads import (
    MANY,
    Mark,
    acting,
    between_points,
    coordinate_of,
    gravity_mark,
    mass_mark,
    spring_mark,
    text_of,
    torsion_mark,
)
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.space.anchors import base_of
from mechdae.draw.space.solids import Item
from mechdae.draw.space.spatial_drivers import turning, with_head
from mechdae.draw.space.spatial_pose import SpatialPose, anchored
from mechdae.draw.space.spatial_symbols import ARROW, HALF, SHAFT
from mechdae.draw.words import Words

if TYPE_CHECKING:
    from mechdae.results import SweepResult


END_ON = 9.0
"""Arrows that look shorter than this are drawn as rings."""
ASIDE = 7.0
"""Radius of a torque's arrow beyond that of a driver, and of each further one beyond the last."""
HEADS = 2
"""Of the arrow of a torque, which tell it from a driver's."""
SHORTEST = 34.0
"""A spring on a slide is drawn at least so long."""
ALONG = 1e-6
"""Sine below which a torque has the direction of an axis."""


class SpatialLoads:
    """The loads of one pose.

    Parameters
    ----------
    pose
        The pose on its sheet.
    result
        Of which task.
    peak
        The force [N] whose arrow has full length; without it the largest in this pose.
    """

    def __init__(
        self, pose: SpatialPose, result: SweepResult, words: Words, peak: float | None = None
    ):
        self.pose, self.result, self.words, self.peak = pose, result, words, peak
        self.scene, self.sheet = pose.scene, pose.sheet
        self.marks: list[Mark] = []
        self._around: dict[tuple[float, ...], int] = {}
        known = [
            load
            for load in self.scene.mechanism.loads.values()
            if acting(self.scene, load, pose.pose)
        ]
        self.springs: list[Spring] = [load for load in known if isinstance(load, Spring)]
        self.others: list[Load] = [load for load in known if not isinstance(load, Spring)]

    # -- arrows ----------------------------------------------------------------------------

    def arrows(self) -> list[Item]:
        """Return the arrows of forces and torques, between what is near and far."""
        items, straight = list[Item](), list[tuple[Load, Array, Array | None, float | None]]()
        either = set[str]()
        for load in self.others:
            values = load_values(self.scene, self.result, load, self.pose.pose)
            if isinstance(load, (Force, Torque)):
                vector = None if values is None else self._in_space(load, np.array(values))
                if isinstance(load, Force):
                    place = self.scene.place(load.point, self.pose.pose)
                    size = None if vector is None else float(np.linalg.norm(vector))
                    way = None if vector is None or not size else vector / size
                    straight.append((load, place, way, size))
                else:
                    items += self._torque(load, vector)
                continue
            if isinstance(load, TableLoad) and load.body is not None:
                items += self._tabulated(load, load.body, values)
                continue
            entry = coordinate_of(self.scene, load)
            sign = 1.0
            if isinstance(load, Resistance):
                sign = pushing(self.scene, self.result, load, self.pose.pose)
            size = None if values is None else values[0]
            found = self._axis(entry)
            if found is None:
                continue
            place, axis = found
            if entry.is_angle:
                both = sign == 0.0 or (size is None and not isinstance(load, Resistance))
                if size != 0.0:
                    joint = self.scene.mechanism.joints[entry.part]
                    turn = (sign or 1.0) * (1.0 if size is None else float(np.sign(size)))
                    anchor = Anchor((base_of(joint, self.pose.moved),), self._holder(joint))
                    items += self._turning(load, anchor, turn * axis, size, both)
            else:
                turn = (sign or 1.0) * (1.0 if size is None else float(np.sign(size)))
                straight.append((load, place, turn * axis, None if size is None else abs(size)))
                either |= {load.name} if sign == 0.0 else set()
        largest = self.peak or max((row[3] for row in straight if row[3]), default=1.0)
        for load, place, direction, size in straight:
            if size != 0.0:
                items += self._straight(load, place, direction, size, largest, load.name in either)
        return items

    def _in_space(self, load: Force | Torque | TableLoad, value: Array) -> Array | None:
        """Return components of a frame in the fixed frame."""
        if load.frame == "world":
            return value
        turns = self.scene.turns.get(load.frame)
        if turns is None or not np.isfinite(turns[self.pose.pose]).all():
            return None
        turned: Array = turns[self.pose.pose] @ value
        return turned

    def _axis(self, entry: NamedCoordinate) -> tuple[Array, Array] | None:
        """Return a place [m] and the direction of a coordinate in the fixed frame."""
        pose = self.pose.pose
        joint = self.scene.mechanism.joints.get(entry.part)
        if joint is None:
            place = self.scene.place(f"{entry.part}.{entry.point}", pose)
            return place, np.eye(3)[entry.axis]
        frame = self.scene.frame(joint, pose)
        axis = self.scene.axis(joint, pose, second=entry.word == "angle2")
        if axis is None:
            return None
        if entry.word in ("x", "y") and frame is not None:
            axis = frame["xy".index(entry.word)]
        return self.scene.place(joint.second, pose), axis

    def _straight(
        self,
        load: Load,
        place: Array,
        way: Array | None,
        size: float | None,
        largest: float,
        both: bool,
    ) -> list[Item]:
        """Return the arrow of a force, with two heads where its sense is not known."""
        gid, center = f"load-{load.name}", self.pose.at(place)
        text = text_of(load.name, size, "N", self.words)
        if way is None:  # the description does not tell the direction
            radius = 2.0 * style.PIN
            self.sheet.circle(center[:2], radius, edge=style.LOAD, dash=style.DASHED, gid=gid)
            self.marks.append(Mark(load.name, text, ((center[:2], center[:2] + 1e-3),)))
            return []
        length = max(style.PULL[0], style.PULL[1] * (1.0 if size is None else size / largest))
        seen = self.pose.view.seen(way)
        if length * float(np.hypot(*seen[:2])) < END_ON:
            self.marks.append(self._end_on(load.name, text, center, float(seen[2])))
            return []
        gap = style.PIN + 2.0
        lines = [
            np.array([center + start * seen, center + (start + length) * seen])
            for start in (gap, -gap - length)
        ]
        cost = [self._cost(np.linspace(a[:2], b[:2], 9)) for a, b in lines]
        line = lines[int(np.argmin(np.round(cost, 6)))]
        self.marks.append(Mark(load.name, text, ((line[0, :2], line[1, :2]),)))
        self.sheet.keep(line[:, :2])
        points = np.linspace(line[0], line[1], 11)
        items = with_head(points, gid, style.LOAD)
        items += with_head(points[::-1], gid, style.LOAD) if both else []
        for item in items:  # seen in front of the body's own faces
            item.owner = load.point.split(".")[0] if isinstance(load, Force) else ""
        return anchored(items, self._anchor(load))

    def _anchor(self, load: Load) -> Anchor:
        """Return the place that the arrow of a force moves with, and what it turns with."""
        if isinstance(load, Force):
            return Anchor((load.point,), load.frame.removeprefix("world"))
        entry = coordinate_of(self.scene, load)
        joint = self.scene.mechanism.joints.get(entry.part)
        if joint is None:
            return Anchor((f"{entry.part}.{entry.point}",))
        return Anchor((joint.second,), self._holder(joint))

    def _holder(self, joint: Joint) -> str:
        """Return the body with which the axis of a joint turns."""
        return self.pose.turn(self.scene.holder(joint, self.pose.pose))

    def _cost(self, points: Array) -> float:
        out = (points < 3.0).any() or (points > self.sheet.size - 3.0).any()
        return blocked(self.sheet, points) + 100.0 * bool(out)

    def _end_on(self, name: str, text: str, center: Array, towards: float) -> Mark:
        """Draw an arrow that is seen end-on: a ring with a dot, or with a cross."""
        gid, radius, spot = f"load-{name}", 1.7 * style.PIN, center[:2]
        self.sheet.circle(spot, radius, edge=style.LOAD, width=style.LINE, gid=gid)
        if towards > 0:
            symbols.dot(self.sheet, spot, gid, style.LOAD)
        else:
            half = radius * np.sqrt(0.5) * np.array([(1.0, 1.0), (1.0, -1.0)])
            self.sheet.strokes(spot - half, spot + half, color=style.LOAD, gid=gid)
        edge = spot + np.array([radius, 0.0])
        return Mark(name, text, ((spot, edge),))

    def _torque(self, load: Torque, vector: Array | None) -> list[Item]:
        size = 0.0 if vector is None else float(np.linalg.norm(vector))
        if vector is None or not size:
            return []
        axis = vector / size
        return self._turning(load, self._seat(load, load.body, axis), axis, size, False)

    def _tabulated(
        self, load: TableLoad, body: str, values: tuple[float, ...] | None
    ) -> list[Item]:
        """Return the arrow of a table's torque, with two heads where its value is not known."""
        way = load_axis(self.scene, self.result, load, self.pose.pose)
        axis = None if way is None else self._in_space(load, np.array(way))
        if axis is None or values == (0.0,):
            return []
        size = None if values is None else values[0]
        axis = axis / np.linalg.norm(axis) * (-1.0 if size is not None and size < 0 else 1.0)
        size = None if size is None else abs(size)
        return self._turning(load, self._seat(load, body, axis), axis, size, size is None)

    def _seat(self, load: Torque | TableLoad, body: str, axis: Array) -> Anchor:
        """Return where a torque of a body is drawn: at a joint that turns about its axis."""
        turn = load.frame.removeprefix("world")
        joints = [pair for pair in self.scene.joints(self.pose.pose) if body in pair.bodies]
        for joint in joints:
            own_axis = self.scene.axis(joint, self.pose.pose) if joint.turns else None
            if own_axis is not None and float(np.linalg.norm(np.cross(own_axis, axis))) < ALONG:
                return Anchor((base_of(joint, self.pose.moved),), turn)
        return Anchor(tuple(self.scene.points(body)), turn)

    def _drawn(self, joint: Joint) -> Array:
        """Return where [m] the symbol of a joint is."""
        place = self.scene.place(joint.first, self.pose.pose)
        axis = self.scene.axis(joint, self.pose.pose)
        return place if axis is None else place + self.pose.moved.get(joint.name, 0.0) * axis

    def _turning(
        self, load: Load, anchor: Anchor, axis: Array, size: float | None, both: bool
    ) -> list[Item]:
        """Return an arrow around an axis, two of them where the sense is not known."""
        gid, seen = f"load-{load.name}", self.pose.view.seen(axis)
        center = np.mean([self.pose.at(self.pose.base(name)) for name in anchor.points], axis=0)
        key = tuple(np.round(center[:2], 0).tolist())
        count = self._around[key] = self._around.get(key, 0) + 1
        out = (HALF + 0.4 * SHAFT) * (1.0 if seen[2] >= 0 else -1.0)
        radius, center = ARROW + ASIDE * count, center + out * seen
        items = turning(center, seen, 1.0, gid, radius, style.LOAD, HEADS)
        if both:
            items += turning(center, seen, -1.0, gid, radius, style.LOAD, HEADS)
        text = text_of(load.name, size, "N m", self.words)
        points = np.vstack([item.points[:, :2] for item in items if not item.closed])
        pieces = tuple(zip(points[:-1:3], points[1::3], strict=False))
        self.marks.append(Mark(load.name, text, pieces))
        return anchored(items, anchor)

    # -- springs, masses -------------------------------------------------------------------

    def flat(self) -> list[Mark]:
        """Draw springs, dampers, centres of mass and gravity; return all marks of loads."""
        for load in self.springs:
            self._spring(load)
        marks = self.marks
        if len(marks) > MANY:
            marks = [replace(mark, text=mark.name) for mark in marks]
        heavy = [
            name for name, body in self.scene.mechanism.bodies.items() if body.mass is not None
        ]
        for name in heavy:
            self._mass(name)
        pull = np.array([self.scene.numbers.get(f"gravity.{axis}", 0.0) for axis in "xyz"])
        seen = self.pose.view.seen(pull)
        if not heavy or not pull.any():
            return marks
        size = float(np.linalg.norm(seen))
        return [*marks, *gravity_mark(self.sheet, seen[:2] / size)]

    def _spring(self, load: Spring) -> None:
        if load.between is None:
            entry = coordinate_of(self.scene, load)
            joint = self.scene.mechanism.joints.get(entry.part)
            if entry.is_angle and joint is not None:
                center = self.pose.at(self._drawn(joint))[:2]
                self.marks.append(torsion_mark(self.sheet, load, center))
                return
            found = self._axis(entry)
            if found is None:
                return
            ends = self._beside(*found)
        else:
            places = [self.scene.place(entry, self.pose.pose) for entry in load.between]
            a, b = (self.pose.at(place)[:2] for place in places)
            ends = between_points(a, b)
        if float(np.hypot(*(ends[1] - ends[0]))) >= END_ON:
            self.marks.append(spring_mark(self.sheet, load, ends))

    def _beside(self, place: Array, axis: Array) -> tuple[Array, Array]:
        """Return the ends of a spring on a slide, on the free side of what slides."""
        center, seen = self.pose.at(place), self.pose.view.seen(axis)
        rows = (
            [(center + sign * (style.BLOCK[0] + SHORTEST) * seen)[:2] for sign in (1.0, -1.0)],
            [(center + sign * style.BLOCK[0] * seen)[:2] for sign in (1.0, -1.0)],
        )
        cost = [self._cost(np.linspace(a, b, 9)) for a, b in zip(*rows, strict=True)]
        k = int(np.argmin(np.round(cost, 6)))
        return rows[0][k], rows[1][k]

    def _mass(self, name: str) -> None:
        body = self.scene.mechanism.bodies[name]
        if body.center is None or name not in self.scene.turns or not self.scene.points(name):
            return
        local = np.array([self.scene.numbers[f"{name}.center.{axis}"] for axis in "xyz"])
        places = [self.scene.local(f"{name}.{point}") for point in body.points]
        if any(float(np.linalg.norm(place - local)) <= 1e-12 for place in places):
            return
        turn, pose = self.scene.turns[name][self.pose.pose], self.pose.pose
        place = self.scene.origin(name)[pose] + turn @ local
        if np.isfinite(place).all():
            points = np.array([self.scene.place(ref, pose) for ref in self.scene.points(name)])
            known = points[np.isfinite(points).all(axis=1)]
            flat = self.sheet.at(self.pose.view.flat(known))
            mass_mark(self.sheet, self.pose.at(place)[:2], flat, name)

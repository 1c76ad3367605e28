"""Loads in space: what differs from those of the plane, for arrows have their length in space.

Those that point towards the eye look short, and end-on a dot in a ring is an arrow towards the eye,
a cross one away from it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.loads import Force, Load, Spring, TableLoad, Torque
from mechdae.draw import style
from mechdae.draw.diagram.amounts import load_axis
from mechdae.draw.diagram.loads import DrawnLoads, Mark, StraightLoad, text_of
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.space import solids
from mechdae.draw.space.anchors import base_of
from mechdae.draw.space.solids import Item
from mechdae.draw.space.spatial_drivers import turning, with_head
from mechdae.draw.space.spatial_pose import SpatialPose, anchored
from mechdae.draw.space.spatial_symbols import ARROW, HALF, SHAFT
from mechdae.draw.words import Words

if TYPE_CHECKING:
    from mechdae.results import SweepResult


ASIDE = 7.0
"""Radius of a torque's arrow beyond that of a driver, and of each further one beyond the last."""
HEADS = 2
"""Of the arrow of a torque, which tell it from a driver's."""
ALONG = 1e-6
"""Sine below which a torque has the direction of an axis."""


class SpatialLoads(DrawnLoads):
    """The loads of one pose in space.

    Parameters
    ----------
    rings
        Whether arrows seen end-on are rings: a page looks at them from other sides too.

    Attributes
    ----------
    items
        Arrows, between what is near and far, and grounds of springs.
    """

    def __init__(
        self, pose: SpatialPose, result: SweepResult, words: Words, peak: float | None = None,
        rings: bool = True,
    ) -> None:  # fmt: skip
        super().__init__(pose.sheet, pose.scene, result, pose.pose, words, peak)
        self.of, self.items = pose, list[Item]()
        self.shortest = self.shortest if rings else 1e-3
        self._around: dict[tuple[float, ...], int] = {}

    def at(self, place: Array) -> Array:
        """Return a place [m] on the sheet with its depth."""
        return self.of.at(place)

    def seen(self, way: Array) -> Array:
        """Return a direction: right, up, towards the eye."""
        return self.of.view.seen(way)

    def anchor(self, entry: NamedCoordinate) -> Anchor:
        joint = self.scene.mechanism.joints.get(entry.part)
        if joint is None:
            return Anchor((f"{entry.part}.{entry.point}",))
        if entry.is_angle:
            return Anchor((base_of(joint, self.of.moved),))
        return Anchor((joint.second,), self._holder(joint))

    def beside(self, entry: NamedCoordinate) -> Anchor:
        """Return what a spring along a coordinate moves with: a line of the picture."""
        held = self.anchor(entry)
        return Anchor(held.points, f"{entry.part}/low" if entry.kind == "slide" else "")

    def travel(self, entry: NamedCoordinate) -> tuple[Array, Array] | None:
        """Return a place [m] and the direction of a coordinate in the fixed frame."""
        joint = self.scene.mechanism.joints.get(entry.part)
        if joint is None:
            place = self.scene.place(f"{entry.part}.{entry.point}", self.pose)
            return place, np.eye(3)[entry.axis]
        frame = self.scene.frame(joint, self.pose)
        axis = self.scene.axis(joint, self.pose, second=entry.word == "angle2")
        if entry.word in ("x", "y") and frame is not None:
            axis = frame["xy".index(entry.word)]
        return None if axis is None else (self.scene.place(joint.second, self.pose), axis)

    def pivot(self, entry: NamedCoordinate) -> Array:
        """Return where [m] the symbol of a joint is."""
        return self.of.base(base_of(self.scene.mechanism.joints[entry.part], self.of.moved))

    def _holder(self, joint: Joint) -> str:
        """Return the body with which the axis of a joint turns."""
        return self.of.turn(self.scene.holder(joint, self.pose))

    def arrow(self, line: Array, gid: str, pull: StraightLoad) -> None:
        """Add a straight arrow, seen in front of the body's own faces."""
        self.sheet.keep(line[:, :2])
        points = np.linspace(line[0], line[1], 11)
        items = with_head(points, gid, style.LOAD)
        items += with_head(points[::-1], gid, style.LOAD) if pull.both else []
        for item in items:
            item.owner = pull.load.point.split(".")[0] if isinstance(pull.load, Force) else ""
        self.items += anchored(items, pull.anchor)

    def turning(
        self, load: Load, entry: NamedCoordinate, turn: float, size: float | None, both: bool
    ) -> None:
        """Add an arrow around the axis of a joint."""
        found, joint = self.travel(entry), self.scene.mechanism.joints[entry.part]
        if found is not None:
            held = Anchor(self.anchor(entry).points, self._holder(joint))
            self._turning(load, held, turn * found[1], size, both)

    def couple(self, load: Load, values: tuple[float, ...] | None) -> bool:
        """Add the arrow of a body's torque, with two heads where its value is not known."""
        if isinstance(load, Torque):
            vector, size = values, None
        elif isinstance(load, TableLoad) and load.body is not None:
            vector = load_axis(self.scene, self.result, load, self.pose)
            size = None if values is None else values[0]
        else:
            return False
        local = None if vector is None else np.array(vector)
        way = None if local is None else self.scene.in_world(load.frame, local, self.pose)
        long = 0.0 if way is None else float(np.linalg.norm(way))
        if way is None or not long or size == 0.0:
            return True
        axis = way / long * (-1.0 if size is not None and size < 0 else 1.0)
        both = isinstance(load, TableLoad) and size is None
        if isinstance(load, Torque):
            size = long
        self._turning(load, self._seat(load, str(load.body), axis), axis, size, both)
        return True

    def _seat(self, load: Torque | TableLoad, body: str, axis: Array) -> Anchor:
        """Return where a torque of a body is drawn: at a joint that turns about its axis."""
        turn = load.frame.removeprefix("world")
        joints = [pair for pair in self.scene.joints(self.pose) if body in pair.bodies]
        for joint in joints:
            turned = self.scene.axis(joint, self.pose) if joint.turns else None
            if turned is not None and float(np.linalg.norm(np.cross(turned, axis))) < ALONG:
                return Anchor((base_of(joint, self.of.moved),), turn)
        return Anchor((f"{body}/middle",), turn)

    def _turning(
        self, load: Load, anchor: Anchor, axis: Array, size: float | None, both: bool
    ) -> None:
        """Add an arrow around an axis, two of them where the sense is not known."""
        gid, seen = f"load-{load.name}", self.seen(axis)
        center = self.at(self.of.base(anchor.points[0]))
        key = tuple(np.round(center[:2], 0).tolist())
        count = self._around[key] = self._around.get(key, 0) + 1
        out = (HALF + 0.4 * SHAFT) * (1.0 if seen[2] >= 0 else -1.0)
        radius, center, items = ARROW + ASIDE * count, center + out * seen, list[Item]()
        for sense in (1.0, -1.0)[: 1 + both]:
            items += turning(center, seen, sense, gid, radius, style.LOAD, HEADS)
        text = text_of(load.name, size, "N m", self.words)
        points = np.vstack([item.points[:, :2] for item in items if not item.closed])
        pieces = tuple(zip(points[:-1:3], points[1::3], strict=False))
        self.marks.append(Mark(load.name, text, pieces))
        self.items += anchored(items, anchor)

    def arrows(self) -> None:
        """Add the arrows of forces and torques, and the grounds of springs."""
        super().arrows()
        for load in self.known:
            for end in (load.between or ()) if isinstance(load, Spring) else ():
                if end.startswith("ground.") and not self._pinned(end):
                    place, up = self.at(self.scene.place(end, self.pose)), self.of.up
                    wall = solids.wall(place - 5.0 * up, -up, f"support-{end}")
                    ball = solids.ball(place, 0.7 * style.PIN, f"load-{load.name}-pin")
                    self.items += anchored([wall, ball], Anchor((end,)))

    def support(self, reference: str, place: Array, name: str) -> None:
        """Draw nothing: the ground of a spring is among the items."""

    def turn(self, name: str) -> float:
        """Return the angle of a centre of mass, which is upright."""
        return 0.0

    def on_body(self, name: str, *places: str) -> Anchor:
        return Anchor(tuple(f"{name}/{place}" for place in places))

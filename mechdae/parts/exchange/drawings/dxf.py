"""A mechanism as a drawing for CAD, DXF of release 12: links, joints, guides, paths, names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.describe import GROUND, Joint
from mechdae.draw import style
from mechdae.draw.diagram.diagram import View, draw_pose, extent
from mechdae.draw.diagram.guides import guide_ends
from mechdae.draw.diagram.places import places_of, shape_of
from mechdae.draw.diagram.scene import DrawnScene, choose_pose, read_scene
from mechdae.draw.diagram.wheels import circles
from mechdae.draw.primitives import Primitive
from mechdae.draw.sheet import Sheet, normal
from mechdae.draw.smooth import traced
from mechdae.draw.words import ENGLISH
from mechdae.errors import UnavailableError
from mechdae.parts.exchange.drawings.dxf_read import SAME, UNDRAWN
from mechdae.results.status import stretches
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats, Points

CAPITAL = 0.7
"""Height of capitals, as a share of the size of letters."""
MILLIMETRE = 1000.0
LAYERS = {"LINKS": 7, "JOINTS": 5, "GROUND": 8, "GUIDES": 8, "PATHS": 1, "NAMES": 3}
"""Layers with their colours."""
DASHED = {"PATHS"}


def dxf(motion: ExportedMotion, pose: int | None = None) -> dict[str, str]:
    """Return the files of a motion's mechanism by their endings: one drawing."""
    if motion.mechanism.dimension != 2:
        raise UnavailableError(
            "a DXF drawing is made of mechanisms of the plane", hint="export --format mjcf or sdf"
        )
    scene = traced(read_scene(motion.result), motion.result, read_scene)
    return {"": _Drawing(motion, scene, choose_pose(scene, motion.result.kind, pose)).text()}


class _Drawing:
    """The diagram of a pose on layers; links and fixed guides, which are read back, by places."""

    def __init__(self, motion: ExportedMotion, scene: DrawnScene, pose: int) -> None:
        self.motion, self.scene, self.pose, self.out = motion, scene, pose, DxfText()
        view = View(loads=False, bare=True)
        self.sheet: Sheet = draw_pose(None, scene, motion.result, pose, view, style.LIGHT, ENGLISH)
        places = places_of(scene, pose)
        self.fixed = {entry for place in places if place.fixed for entry in place.references}

    def text(self) -> str:
        scene, motion, joints = self.scene, self.motion, self.scene.joints(self.pose)
        for name in scene.origins:
            if name != GROUND and scene.shown(name, self.pose):
                self._link(name)
        for joint in joints:
            if joint.straight and joint.first_body == GROUND:
                self._guide(joint)
        for shape in self.sheet.drawn:
            layer = self._layer(shape)
            if layer:
                self._symbol(layer, shape)
        welds = {shape.gid for shape in self.sheet.drawn}
        undrawn = [
            f"{joint.kind} {joint.name}"
            for joint in joints
            if (joint.wheels and not circles(scene, joint, self.pose))  # a ratio without radii
            or (joint.rigid and f"joint-{joint.name}-weld" not in welds)  # in a fixed pin
        ]
        remarks = [
            f"mechdae {__version__}: {motion.problem.name}, task {motion.task}, pose {self.pose}",
            "millimetres; circles of pins in the ground are on the layer GROUND",
        ]
        remarks += [f"{UNDRAWN}{', '.join(undrawn)}"] if undrawn else []
        return self.out.document(remarks)

    def _link(self, name: str) -> None:
        shape = shape_of(self.scene, name)
        points = self.scene.mechanism.body(name).points
        spots = {point: self.scene.place(f"{name}.{point}", self.pose) for point in points}
        if len(shape.points) > 1:
            corners = [spots[point] for point in shape.points]
            self.out.line("LINKS", corners, closed=shape.kind == "polygon")
        for point in shape.inner:  # a link to its nearest corner
            here = spots[point]
            near = min(shape.points, key=lambda name: float(np.hypot(*(spots[name] - here))))
            self.out.line("LINKS", [spots[near], here])

    def _guide(self, joint: Joint) -> None:
        """Write the line of a block on a fixed guide, or both sides of the slot of a pin."""
        scene, metre = self.scene, self.sheet.metre
        axis, size = scene.axis(joint, self.pose), extent(scene, self.pose, False)[2]
        reach, side = 1.6 * style.BLOCK[0] / metre, 1.3 * style.PIN / metre * normal(axis)
        ends = guide_ends(scene, joint, self.pose, size) + np.outer([-reach, reach], axis)
        for shift in (0.0,) if joint.keeps_angle else (1.0, -1.0):
            self.out.line("GUIDES", ends + shift * side)

    def _layer(self, shape: Primitive) -> str:
        """Return the layer of a primitive, "" of what is written by places, and of shading."""
        kind, _, name = (shape.gid or "").partition("-")
        joint, symbol = name.removesuffix("-pin-in-slot"), name.rpartition("-")[2]
        shading = shape.kind == "area" and (not kind or symbol == "corner")
        if shading or shape.color == style.PAPER or symbol in ("bar", "polygon"):
            return ""
        if symbol == "slot" and self.scene.mechanism.joints[joint].first_body == GROUND:
            return ""
        if kind != "joint" or (symbol in ("guide", "ground") and shape.color == style.GROUND):
            return "PATHS" if kind == "trace" else "NAMES"
        if symbol == "pin" and shape.anchor.points[0] in self.fixed:
            return "GROUND"
        return "LINKS" if symbol == "distance" else "JOINTS"

    def _symbol(self, layer: str, shape: Primitive) -> None:
        places, metre = self.sheet.back(shape.points), self.sheet.metre
        if shape.kind == "text":
            self.out.text(layer, places[0], CAPITAL * shape.font.size / metre, shape.text)
        elif shape.kind == "circle":
            joint = (shape.gid or "").removeprefix("joint-").removesuffix("-roller")
            real = self.scene.numbers.get(f"{joint}.roller_radius", shape.radius / metre)
            self.out.circle(layer, places[0], real)
        elif shape.kind == "strokes":
            for ends in places.reshape(-1, 2, 2):
                self.out.line(layer, ends)
        else:
            for first, last in stretches(np.isfinite(places).all(axis=1)):
                self.out.line(layer, places[first:last], shape.kind == "area")


class DxfText:
    """A drawing in the making; places are in metres."""

    def __init__(self) -> None:
        self.entities: list[str] = []
        self.low: Floats = np.full(2, np.inf)
        self.high: Floats = np.full(2, -np.inf)

    def _put(self, *pairs: tuple[int, float | str]) -> None:
        self.entities += [f"{code:3d}\n{_value(value)}" for code, value in pairs]

    def _place(self, place: Floats, code: int = 10) -> list[tuple[int, float]]:
        x, y = (MILLIMETRE * float(v) for v in place)
        self.low, self.high = np.minimum(self.low, (x, y)), np.maximum(self.high, (x, y))
        return [(code, x), (code + 10, y), (code + 20, 0.0)]

    def line(self, layer: str, places: Points | Sequence[Floats], closed: bool = False) -> None:
        """Put a line through places, closed also where it ends at its beginning."""
        if len(places) == 2:
            self._put((0, "LINE"), (8, layer), *self._place(places[0]), *self._place(places[1], 11))
            return
        far = float(np.ptp(places, axis=0).max())
        if float(np.hypot(*(places[0] - places[-1]))) <= SAME * far:
            places, closed = places[:-1], True
        self._put((0, "POLYLINE"), (8, layer), (66, 1), (10, 0.0), (20, 0.0), (30, 0.0))
        self._put((70, int(closed)))
        for place in places:
            self._put((0, "VERTEX"), (8, layer), *self._place(place))
        self._put((0, "SEQEND"), (8, layer))

    def circle(self, layer: str, center: Floats, radius: float) -> None:
        for corner in (-radius, radius):
            self._place(np.asarray(center, float) + corner)
        self._put((0, "CIRCLE"), (8, layer), *self._place(center), (40, MILLIMETRE * radius))

    def text(self, layer: str, place: Floats, height: float, words: str) -> None:
        """Put a text whose lower left corner is at a place."""
        self._put((0, "TEXT"), (8, layer), *self._place(place))
        self._put((40, MILLIMETRE * height), (1, _plain(words)))

    def document(self, remarks: Iterable[str] = ()) -> str:
        """Return the whole file."""
        low, high = self.low, self.high
        if not np.isfinite(low).all():
            low, high = np.zeros(2), np.ones(2)
        head: list[tuple[int, Any]] = [(999, _plain(remark)) for remark in remarks]
        head += [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009")]
        head += [(9, "$EXTMIN"), (10, low[0]), (20, low[1]), (30, 0.0)]
        head += [(9, "$EXTMAX"), (10, high[0]), (20, high[1]), (30, 0.0)]
        head += [(9, "$LUNITS"), (70, 2), (9, "$LTSCALE"), (40, 1.0), (0, "ENDSEC")]
        head += [(0, "SECTION"), (2, "TABLES")]
        head += [(0, "TABLE"), (2, "LTYPE"), (70, 2)]
        head += _line_type("CONTINUOUS", "Solid line", ())
        step = max(0.01 * float(np.max(high - low)), 1e-6)
        head += _line_type("DASHED", "__ __ __", (step, -0.5 * step))
        head += [(0, "ENDTAB"), (0, "TABLE"), (2, "LAYER"), (70, len(LAYERS))]
        for name, color in LAYERS.items():
            kind = "DASHED" if name in DASHED else "CONTINUOUS"
            head += [(0, "LAYER"), (2, name), (70, 0), (62, color), (6, kind)]
        head += [(0, "ENDTAB"), (0, "TABLE"), (2, "STYLE"), (70, 1), (0, "STYLE")]
        head += [(2, "STANDARD"), (70, 0), (40, 0.0), (41, 1.0), (50, 0.0), (71, 0)]
        head += [(42, 2.5), (3, "txt"), (4, ""), (0, "ENDTAB"), (0, "ENDSEC")]
        head += [(0, "SECTION"), (2, "ENTITIES")]
        lines = [f"{code:3d}\n{_value(value)}" for code, value in head]
        lines += [*self.entities, "  0\nENDSEC", "  0\nEOF"]
        return "\n".join(lines) + "\n"


def _line_type(name: str, text: str, parts: Sequence[float]) -> list[tuple[int, Any]]:
    total = float(sum(abs(part) for part in parts))
    head = [(0, "LTYPE"), (2, name), (70, 0), (3, text), (72, 65), (73, len(parts)), (40, total)]
    return [*head, *[(49, part) for part in parts]]


def _value(value: float | str) -> str:
    if isinstance(value, str | int):
        return f"{value:6d}" if isinstance(value, int) else value
    return repr(round(float(value), 12) + 0.0)


def _plain(text: str) -> str:
    """Return a text in one line of ASCII, as release 12 has it."""
    return " ".join(text.encode("ascii", "replace").decode().split())

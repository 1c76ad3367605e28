"""A mechanism as a drawing for CAD, DXF of release 12: links, joints, guides, paths, names."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.describe import GROUND, Joint
from mechdae.describe.joints.curve import follows_curve
from mechdae.draw.diagram.places import Place, edges, letters_of, numbers_of, places_of, shape_of
from mechdae.draw.diagram.scene import DrawnScene, choose_pose, read_scene
from mechdae.draw.diagram.wheels import circles, curve_points, rack_span
from mechdae.draw.smooth import traced
from mechdae.errors import UnavailableError
from mechdae.parts.exchange.drawings.dxf_read import SAME, UNDRAWN, distance
from mechdae.results.status import stretches
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats, Points

PIN = 0.012
"""Radius of pins,"""
BLOCK = (0.04, 0.022)
"""half the length and width of blocks,"""
LETTER = 0.028
"""and height of names, as shares of the drawing's size."""
ROUND = 8
"""Directions in which a name may stand."""
MILLIMETRE = 1000.0
LAYERS = {"LINKS": 7, "JOINTS": 5, "GROUND": 8, "GUIDES": 8, "PATHS": 1, "NAMES": 3}
"""Layers with their colours."""
DASHED = {"PATHS"}
Rims = dict[str, list[float]]


def dxf(motion: ExportedMotion, pose: int | None = None) -> dict[str, str]:
    """Return the files of a motion's mechanism by their endings: one drawing."""
    if motion.mechanism.dimension != 2:
        raise UnavailableError(
            "a DXF drawing is made of mechanisms of the plane", hint="export --format mjcf or sdf"
        )
    scene = traced(read_scene(motion.result), motion.result, read_scene)
    return {"": _Drawing(motion, scene, choose_pose(scene, motion.result.kind, pose)).text()}


class _Drawing:
    def __init__(self, motion: ExportedMotion, scene: DrawnScene, pose: int) -> None:
        self.motion, self.scene, self.pose = motion, scene, pose
        self.out = DxfText()
        self.size = self._size()
        self.lines: list[tuple[Floats, Floats]] = []
        self.undrawn: list[str] = []

    def _size(self) -> float:
        """Return the larger side of the links and paths [m]."""
        tracks = [track for track in self.scene.paths.values() if np.isfinite(track).any()]
        here = [
            self.scene.place(f"{name}.{point}", self.pose)[None]
            for name in self.scene.origins
            for point in self.scene.mechanism.body(name).points
            if self.scene.shown(name, self.pose)
        ]
        every = np.concatenate([*tracks, *here])
        return float(np.nanmax(np.ptp(every[np.isfinite(every).all(axis=1)], axis=0))) or 1.0

    def text(self) -> str:
        scene, motion = self.scene, self.motion
        for name in scene.origins:
            if name != GROUND and scene.shown(name, self.pose):
                self._link(name)
        places = places_of(scene, self.pose)
        rims: Rims = {}
        for joint in scene.joints(self.pose):
            self._joint(joint, rims)
        for place in places:
            self._pin(place)
        self._paths()
        self._names(places)
        remarks = [
            f"mechdae {__version__}: {motion.problem.name}, task {motion.task}, pose {self.pose}",
            "millimetres; circles of pins in the ground are on the layer GROUND",
        ]
        remarks += [f"{UNDRAWN}{', '.join(self.undrawn)}"] if self.undrawn else []
        return self.out.document(remarks)

    # -- links -----------------------------------------------------------------------------

    def _at(self, name: str, point: str) -> Floats:
        return self.scene.place(f"{name}.{point}", self.pose)

    def _link(self, name: str) -> None:
        shape = shape_of(self.scene, name)
        spots = {point: self._at(name, point) for point in self.scene.mechanism.body(name).points}
        if shape.kind == "polygon":
            self.out.polyline("LINKS", [spots[point] for point in shape.points], closed=True)
        elif shape.kind == "bar" and len(shape.points) > 2:
            self.out.polyline("LINKS", [spots[point] for point in shape.points])
        elif shape.kind == "bar":
            self.out.line("LINKS", *(spots[point] for point in shape.points))
        self.lines += [(spots[one], spots[other]) for one, other in edges(shape)]
        for point in shape.inner:  # a link to its nearest corner
            here = spots[point]
            near = min(shape.points, key=lambda name: float(np.hypot(*(spots[name] - here))))
            self.out.polyline("LINKS", [spots[near], spots[point]])

    # -- joints ----------------------------------------------------------------------------

    def _joint(self, joint: Joint, drawn: Rims) -> None:
        scene, pose, out = self.scene, self.pose, self.out
        if joint.straight:
            self._guide(joint)
        elif joint.bar:
            ends = [scene.place(reference, pose) for reference in (joint.first, joint.second)]
            out.line("LINKS", *ends)
            self.lines.append((ends[0], ends[1]))
        elif joint.rigid:
            center, half = scene.place(joint.second, pose), 0.5 * PIN * self.size
            corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
            out.polyline("JOINTS", [center + np.array(corner) for corner in corners], closed=True)
        elif follows_curve(joint):
            points = curve_points(scene, joint, pose)
            closed = bool(np.hypot(*(points[0] - points[-1])) <= SAME * self.size)
            out.polyline("JOINTS", points[:-1] if closed else points, closed)
            if joint.roller_radius is not None:
                radius = scene.numbers[f"{joint.name}.roller_radius"]
                out.circle("JOINTS", scene.place(joint.second, pose), radius)
        if joint.wheels:
            if joint.wheels == 1:
                start, end, _ = rack_span(scene, joint, pose)
                out.line("JOINTS", start, end)
            rims = circles(scene, joint, pose)
            if not rims:  # a ratio without radii
                self.undrawn.append(f"{joint.kind} {joint.name}")
            for reference, center, radius in rims:
                known = drawn.setdefault(reference, [])
                if not any(abs(radius - used) <= SAME * self.size for used in known):
                    out.circle("JOINTS", center, radius)
                    turns = np.linspace(0, 2 * np.pi, 25)[:, None]
                    self._keep_clear(center + radius * np.hstack([np.cos(turns), np.sin(turns)]))
                known.append(radius)
            if joint.strands and len(rims) == 2:
                self._strands(joint, *rims)

    def _strands(self, joint: Joint, first: Any, second: Any) -> None:
        """Draw the two strands of a belt: tangents of both wheels, crossed ones between them."""
        (_, a, one), (_, b, other) = first, second
        way = b - a
        far = float(np.hypot(*way))
        along = way / far
        across = np.array([-along[1], along[0]])
        other = joint.sense * other
        cosine = (one - other) / far
        if abs(cosine) >= 1:
            return
        for side in (1.0, -1.0):
            out = cosine * along + side * (1 - cosine**2) ** 0.5 * across
            self.out.line("JOINTS", a + one * out, b + other * out)
            self.lines.append((a + one * out, b + other * out))

    def _guide(self, joint: Joint) -> None:
        """Draw a block on its guide, or a slot around its pin."""
        scene, pose = self.scene, self.pose
        center = scene.place(joint.second, pose)
        axis = scene.direction(joint.first_body, scene.numbers[f"{joint.name}.axis"], pose)
        across = np.array([-axis[1], axis[0]])
        slides = scene.slide(joint)
        now = float(slides[pose])
        near = slides[np.isfinite(slides)] - now
        reach = 1.6 * BLOCK[0] * self.size
        offset = across * (across @ (scene.place(joint.first, pose) - center))
        start = center + offset + (float(near.min()) - reach) * axis
        end = center + offset + (float(near.max()) + reach) * axis
        fixed = joint.first_body == GROUND
        if joint.keeps_angle:
            layer = "GUIDES" if fixed else "JOINTS"
            self.out.line(layer, start, end)
            a, b = BLOCK[0] * self.size * axis, BLOCK[1] * self.size * across
            corners = [center - a - b, center + a - b, center + a + b, center - a + b]
            self.out.polyline("JOINTS", corners, closed=True)
            self._keep_clear([*corners, corners[0]])
            self.lines.append((start, end))
            return
        half = 1.3 * PIN * self.size * across
        for side in (half, -half):
            self.out.line("GUIDES" if fixed else "JOINTS", start + side, end + side)
            self.lines.append((start + side, end + side))

    def _keep_clear(self, places: Points | list[Floats]) -> None:
        """Let no name stand on the lines between places."""
        self.lines += list(itertools.pairwise(places))

    def _pin(self, place: Place) -> None:
        """Draw a pin, on a support where it is in the ground."""
        if not place.pinned or not place.references:
            return
        radius = PIN * self.size
        center = self.scene.place(place.references[0], self.pose)
        self.out.circle("GROUND" if place.fixed else "JOINTS", center, radius)
        if not place.fixed:
            return
        half, depth = 2.4 * radius, 3.2 * radius
        foot = [center + np.array([-half, -depth]), center + np.array([half, -depth])]
        top = radius * np.array([0.55, -0.84])
        for corner, side in ((foot[0], -1), (foot[1], 1)):
            self.out.line("NAMES", center + top * np.array([side, 1]), corner)
        wide = [center + np.array([s * 1.4 * half, -depth]) for s in (-1, 1)]
        self.out.line("NAMES", *wide)
        for k in range(5):
            begin = wide[0] + (wide[1] - wide[0]) * (k + 0.5) / 5
            self.out.line("NAMES", begin, begin - radius * np.array([0.8, 0.8]))
        self.lines += [(center, foot[0]), (center, foot[1]), (wide[0], wide[1])]

    # -- paths and names -------------------------------------------------------------------

    def _paths(self) -> None:
        """Draw the paths of the points, in pieces where a pose is not assembled."""
        for track in self.scene.paths.values():
            good = np.isfinite(track).all(axis=1)
            for first, last in stretches(good):
                piece = track[first:last]
                if len(piece) < 2:
                    continue
                closed = bool(np.hypot(*(piece[0] - piece[-1])) <= SAME * self.size)
                self.out.polyline("PATHS", piece[:-1] if closed else piece, closed)
                self._keep_clear(piece[:: max(1, len(piece) // 48)])

    def _names(self, places: list[Place]) -> None:
        """Put the letters of places where they cover no line, and the numbers of the links."""
        scene, height = self.scene, LETTER * self.size
        taken: list[Floats] = []
        letters: dict[str, str] = letters_of(scene, self.pose, places)
        named: set[str] = set()
        for reference, letter in letters.items():
            if letter not in named:
                named.add(letter)
                self._word(letter, scene.place(reference, self.pose), height, taken)
        numbers = numbers_of(scene.mechanism)
        for name, number in numbers.items():
            if not scene.shown(name, self.pose):
                continue
            points = [self._at(name, point) for point in scene.mechanism.body(name).points]
            if len(points) > 1:
                self._word(str(number), np.mean(points, axis=0), 0.8 * height, taken)

    def _word(self, word: str, place: Floats, height: float, taken: list[Floats]) -> None:
        """Put a word beside a place, in the direction that is farthest from lines and words."""
        wide = 0.8 * height * len(word)
        best, found = -np.inf, np.zeros(2)
        for far in (1.7, 2.6):
            for k in range(ROUND):
                angle = 2 * np.pi * (k + 0.5) / ROUND
                way = np.array([np.cos(angle), np.sin(angle)])
                middle = place + way * (far * PIN * self.size + 0.5 * np.hypot(wide, height))
                gap = min(
                    [distance(middle, *line) for line in self.lines]
                    + [0.7 * float(np.hypot(*(middle - place))) for place in taken],
                    default=1.0,
                )
                score = min(gap, 0.8 * np.hypot(wide, height)) - 0.1 * far * height
                if score > best:
                    best, found = score, middle
        taken.append(found)
        self.out.text("NAMES", found - np.array([wide, height]) / 2, height, word)


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

    def line(self, layer: str, start: Floats, end: Floats) -> None:
        self._put((0, "LINE"), (8, layer), *self._place(start), *self._place(end, 11))

    def polyline(self, layer: str, places: Iterable[Floats], closed: bool = False) -> None:
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

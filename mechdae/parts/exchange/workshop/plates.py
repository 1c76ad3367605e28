"""The plates of a planar mechanism: outlines, holes and slots in frames of links, their gaps."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np

from mechdae.describe import GROUND, Joint
from mechdae.draw.diagram.places import hull as corners_of
from mechdae.errors import InputError, UnavailableError
from mechdae.tasks import ExportedMotion
from mechdae.types import Booleans, Floats, Points


def distances(a: Points, b: Points) -> Floats:
    """Return the distance of convex polygons (n, i, 2) and (n, j, 2), 0 where they meet."""
    found = np.full(len(a), np.inf)
    for p, q in _sides(a):
        for r, s in _sides(b):
            found = np.minimum(found, _between(p, q, r, s))
    for polygon, point in ((a, b[:, 0]), (b, a[:, 0])):
        if polygon.shape[1] > 2:
            found = np.where(_inside(polygon, point), 0.0, found)
    return found


def _sides(polygon: Points) -> list[tuple[Points, Points]]:
    count = polygon.shape[1]
    if count < 3:
        return [(polygon[:, 0], polygon[:, count - 1])]
    return [(polygon[:, k], polygon[:, (k + 1) % count]) for k in range(count)]


def _between(p: Points, q: Points, r: Points, s: Points) -> Floats:
    """Return the distance of segments p-q and r-s, (n, 2) each."""
    ends = [_off(p, r, s), _off(q, r, s), _off(r, p, q), _off(s, p, q)]
    cross = (_turn(p, q, r) * _turn(p, q, s) < 0) & (_turn(r, s, p) * _turn(r, s, q) < 0)
    return np.where(cross, 0.0, np.min(ends, axis=0))


def _off(point: Points, start: Points, end: Points) -> Floats:
    way, to = end - start, point - start
    size = np.einsum("ij,ij->i", way, way)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(size > 0, np.einsum("ij,ij->i", to, way) / size, 0.0)
    off = to - np.clip(share, 0, 1)[:, None] * way
    found: Floats = np.hypot(off[:, 0], off[:, 1])
    return found


def _turn(a: Points, b: Points, c: Points) -> Floats:
    found: Floats = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return found


def _inside(polygon: Points, point: Points) -> Booleans:
    turns = [_turn(p, q, point) >= 0 for p, q in _sides(polygon)]
    found: Booleans = np.all(turns, axis=0)
    return found


PIN, NEAR = 0.042, 0.4
"""Diameter of pins where none is given, as a share of the mechanism's size and of the least
distance of two joints of a link; what is less of them."""
BROAD = 2.6
"""Width of plates where none is given, in diameters of pins."""
WALL = 1.15
"""Width of a plate at least, in diameters of its holes."""
IN_LINE = 1e-12
"""Area of a triangle of three points in line, over the square of the size of all."""
RING = 1.8
"""Outer diameter of spacers, in diameters of pins."""


@dataclass(frozen=True)
class PartSizes:
    """What parts are made with [m].

    Attributes
    ----------
    width
        Of plates; their ends are half circles.
    thickness
        Of the sheet: one layer.
    pin
        Diameter of pins.
    clearance
        By how much the radius of a hole is larger than that of its pin, where the file says none.
    air
        Least distance of what moves in the same layer.
    kerf
        Width of the cut: outlines are half of it larger, holes smaller.
    """

    width: float
    thickness: float
    pin: float
    clearance: float
    air: float
    kerf: float = 0.0

    @property
    def hole(self) -> float:
        """Radius of holes."""
        return self.pin / 2 + self.clearance


@dataclass
class Plate:
    """A link as a plate, in the frame of its body.

    Attributes
    ----------
    name, body
        Of the part, and the body that it moves with; None of a bar between two points.
    corners : (k, 2) array
        Middles of the circles that the plate is the convex hull of.
    holes
        Pins through it: name -> middle.
    slots
        Guides in it: name -> both ends of the middle line.
    ends
        Of a bar: its two points, as references.
    """

    name: str
    body: str | None
    corners: Points
    holes: dict[str, Floats] = field(default_factory=dict)
    slots: dict[str, Points] = field(default_factory=dict)
    ends: tuple[str, str] | None = None

    def add(self, *places: Floats) -> None:
        """Make the plate large enough for circles around places."""
        self.corners = hull(np.vstack([self.corners, *places]))


@dataclass(frozen=True)
class KitPin:
    """A pin through two plates: their names, and where it is in that of the second one."""

    name: str
    plates: tuple[str, str]


@dataclass(frozen=True)
class Kit:
    """All plates and pins of a mechanism; the frame's plate is that of the ground."""

    plates: dict[str, Plate]
    pins: dict[str, KitPin]
    sizes: PartSizes
    clearances: dict[str, float] = field(default_factory=dict)
    """Of joints that the file gives one."""

    def hole(self, pin: str) -> float:
        """Return the radius of a hole or slot: with the clearance of its joint where it has one."""
        joint = pin if pin in self.clearances else pin.rpartition(".")[0]
        return self.sizes.pin / 2 + self.clearances.get(joint, self.sizes.clearance)

    @property
    def moving(self) -> list[str]:
        """Names of the plates that move."""
        return [name for name in self.plates if name != GROUND]

    @cached_property
    def shafts(self) -> list[list[str]]:
        """Pins by the shaft that they are on: those at one place of a link are one."""
        found: list[list[str]] = []
        for name in self.pins:
            mine = [name]
            for known in list(found):
                if any(self._same(name, other) for other in known):
                    found.remove(known)
                    mine = known + mine
            found.append(mine)
        return found

    def _same(self, one: str, other: str) -> bool:
        shared = set(self.pins[one].plates) & set(self.pins[other].plates)
        holes = [self.plates[plate].holes for plate in shared]
        return any(one in at and other in at and np.array_equal(at[one], at[other]) for at in holes)

    def on_shaft(self, pins: list[str]) -> set[str]:
        """Return the plates on a shaft."""
        return {plate for pin in pins for plate in self.pins[pin].plates}


def hull(points: Points) -> Points:
    """Return the corners of the convex hull of points (n, 2), none in line with its neighbours."""
    distinct = np.unique(points, axis=0)
    if len(distinct) < 3:
        return distinct
    return distinct[corners_of(distinct, IN_LINE * float(np.ptp(points, axis=0).max()) ** 2)]


def kit_of(motion: ExportedMotion, given: dict[str, float]) -> Kit:
    """Return the plates and pins of a mechanism.

    Raises
    ------
    UnavailableError
        A joint of which no parts are made, or a mechanism in space.
    InputError
        PartSizes that do not fit, with the holes that meet.
    """
    mechanism = motion.mechanism
    if mechanism.dimension != 2:
        raise UnavailableError("parts are made of mechanisms of the plane", where="mechanism")
    for name, joint in mechanism.joints.items():
        if not (joint.hinge or joint.straight or joint.bar) or joint.wheels:
            raise UnavailableError(
                f"no parts are made of joints of kind {joint.kind}",
                where=f"joints.{name}",
                hint="revolute, prismatic, pin-in-slot and distance",
            )
    values = mechanism.values()

    def local(reference: str) -> Floats:
        return np.array([values[f"{reference}.{axis}"] for axis in "xy"])

    sizes = _sizes(motion, given)
    used = {end for joint in mechanism.joints.values() for end in (joint.first, joint.second)}
    plates = {}
    for body in (GROUND, *mechanism.bodies):
        references = [f"{body}.{point}" for point in mechanism.body(body).points]
        places = [local(r) for r in references if body != GROUND or r in used]
        plates[body] = Plate(body, body, hull(np.array(places).reshape(-1, 2)))
    pins: dict[str, KitPin] = {}
    for name, joint in mechanism.joints.items():
        first, second = plates[joint.first_body], plates[joint.second_body]
        if joint.hinge:
            pins[name] = KitPin(name, (first.name, second.name))
            first.holes[name], second.holes[name] = local(joint.first), local(joint.second)
        elif joint.bar:
            bar = Plate(name, None, np.zeros((0, 2)), ends=(joint.first, joint.second))
            length = values[f"{name}.length"]
            for k, (plate, reference) in enumerate(((first, joint.first), (second, joint.second))):
                pin, here = f"{name}.{k + 1}", np.array([k * length, 0.0])
                pins[pin] = KitPin(pin, (plate.name, name))
                plate.holes[pin], bar.holes[pin] = local(reference), here
                bar.add(here)
            plates[name] = bar
        else:
            _guide(motion, name, joint, plates, pins, sizes)
    given_by_file = {
        name: values[f"{name}.clearance"]
        for name in mechanism.joints
        if f"{name}.clearance" in values
    }
    made = Kit(plates, pins, sizes, given_by_file)
    _check(made)
    return made


def _guide(
    motion: ExportedMotion,
    name: str,
    joint: Joint,
    plates: dict[str, Plate],
    pins: dict[str, KitPin],
    sizes: PartSizes,
) -> None:
    """Add a slot in the first link and the pins of the second one that slide in it."""
    values = motion.mechanism.values()
    first, second = plates[joint.first_body], plates[joint.second_body]
    angle = values[f"{name}.axis"]
    along = np.array([np.cos(angle), np.sin(angle)])
    turns = [_angle(motion, body) for body in joint.bodies]
    way = _place(motion, joint.second) - _place(motion, joint.first)
    cos, sin = np.cos(turns[0]), np.sin(turns[0])
    inside = np.stack([cos * way[:, 0] + sin * way[:, 1], cos * way[:, 1] - sin * way[:, 0]], 1)
    inside = inside[motion.rows] + [values[f"{joint.first}.{axis}"] for axis in "xy"]
    slide = inside @ along
    across = np.array([-along[1], along[0]])
    line = across * float(np.mean(inside @ across))
    middle = np.array([values[f"{joint.second}.{axis}"] for axis in "xy"])
    half = sizes.width / 2 if joint.keeps_angle else 0.0
    turned = angle + float((turns[0] - turns[1])[motion.rows[0]])
    for k, side in enumerate((-1, 1) if joint.keeps_angle else (0,)):
        pin = f"{name}.{k + 1}" if joint.keeps_angle else name
        pins[pin] = KitPin(pin, (first.name, second.name))
        here = middle + side * half * np.array([np.cos(turned), np.sin(turned)])
        second.holes[pin] = here
        second.add(here)
    rest = half + sizes.pin / 2 + float(np.ptp(slide)) / max(len(slide) - 1, 1)
    ends = np.array([line + (f(slide) + s * rest) * along for f, s in ((min, -1), (max, 1))])
    first.slots[name] = ends
    first.add(*ends)


def _angle(motion: ExportedMotion, body: str) -> Floats:
    if body == GROUND:
        return np.zeros(len(motion.result))
    return np.asarray(motion.result.bodies[body].angle, float)


def _place(motion: ExportedMotion, reference: str) -> Points:
    body, _, _ = reference.partition(".")
    if body != GROUND:
        return np.asarray(motion.result.points[reference].position, float)
    values = motion.mechanism.values()
    here = [values[f"{reference}.{axis}"] for axis in "xy"]
    return np.tile(here, (len(motion.result), 1))


def _sizes(motion: ExportedMotion, given: dict[str, float]) -> PartSizes:
    """Return what is given, the rest by the mechanism's size."""
    for name, value in given.items():
        least = name in ("clearance", "kerf", "air")
        if not np.isfinite(value) or value < 0 or (value == 0 and not least):
            raise InputError(
                f"a length {'of 0 or more' if least else 'above 0'} is needed, not {value:g}",
                where=name,
            )
    pin = given.get("pin", min(PIN * motion.mechanism.scale, NEAR * _shortest(motion)))
    return PartSizes(
        given.get("width", BROAD * pin),
        given.get("thickness", 0.75 * pin),
        pin,
        given.get("clearance", 0.01 * pin),
        given.get("air", 0.1 * pin),
        given.get("kerf", 0.0),
    )


def _shortest(motion: ExportedMotion) -> float:
    """Return the least distance of two joints of a link [m]."""
    mechanism, values = motion.mechanism, motion.mechanism.values()
    ends = {end for joint in mechanism.joints.values() for end in (joint.first, joint.second)}
    found = [float("inf")]
    for one, other in combinations(sorted(ends), 2):
        if one.partition(".")[0] == other.partition(".")[0]:
            x, y = (values[f"{one}.{axis}"] - values[f"{other}.{axis}"] for axis in "xy")
            found += [float(np.hypot(x, y))] if x or y else []
    return min(found)


def _check(kit: Kit) -> None:
    """Raise for holes that meet, and walls that are none."""
    sizes = kit.sizes
    largest = max((kit.hole(pin) for pin in kit.pins), default=sizes.hole)
    if sizes.width < WALL * 2 * largest:
        raise InputError(
            f"plates {sizes.width * 1e3:.4g} mm wide have no wall around holes of "
            f"{2e3 * largest:.4g} mm",
            where="width",
            hint=f"at least {2e3 * WALL * largest:.4g} mm",
        )
    for plate in kit.plates.values():
        names = list(plate.holes)
        for i, one in enumerate(names):
            for other in names[i + 1 :]:
                far = float(np.hypot(*(plate.holes[one] - plate.holes[other])))
                if 0 < far < (kit.hole(one) + kit.hole(other)) * WALL:
                    raise InputError(
                        f"holes {one} and {other} of {plate.name} are {far * 1e3:.4g} mm apart, "
                        f"pins are {sizes.pin * 1e3:.4g} mm thick",
                        where="pin",
                        hint=f"at most {1e3 * far / WALL - 2e3 * sizes.clearance:.4g} mm",
                    )
        if plate.name != GROUND:
            check_slots(plate, sizes)


def check_slots(plate: Plate, sizes: PartSizes) -> None:
    """Raise for slots that meet holes or each other."""
    loops = {name: place[None] for name, place in plate.holes.items()}
    loops |= {f"slot {name}": ends for name, ends in plate.slots.items()}
    for one, other in combinations(loops, 2):
        if not (one.startswith("slot") or other.startswith("slot")):
            continue
        far = float(distances(loops[one][None], loops[other][None])[0])
        if far < 2 * sizes.hole * WALL:
            raise UnavailableError(
                f"{one} and {other} of {plate.name} are {far * 1e3:.4g} mm apart: "
                "they would be one hole",
                where=f"bodies.{plate.name}" if plate.name != GROUND else "ground",
                hint=f"--pin below {1e3 * far / WALL - 2e3 * sizes.clearance:.4g} mm"
                if far > 0
                else "offset one of them along the axis in another link",
            )

"""The plates of a planar mechanism: outlines, holes and slots in frames of links, their gaps."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from mechdae.describe import GROUND, Joint
from mechdae.draw.diagram.places import hull as corners_of
from mechdae.errors import InputError, UnavailableError
from mechdae.numerics.polygons import polygon_gaps
from mechdae.parts.exchange.workshop.bodies import Rigid, connected
from mechdae.parts.exchange.workshop.gearing import Gearing, Wheel, WheelPair, gearing_of
from mechdae.parts.exchange.workshop.outlines import Loop, turned
from mechdae.parts.exchange.workshop.teeth import Teeth, ToothedLoop
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats, Points

PIN, NEAR = 0.042, 0.4
"""Diameter of pins where none is given, as a share of the mechanism's size and of the least
distance of two joints of a link; what is less of them."""
BROAD = 2.6
"""Width of plates where none is given, in diameters of pins."""
WALL = 1.15
"""Width of a plate at least, in diameters of its holes."""
SAME = 1e-6
"""Distance of two holes that are one, in diameters of pins."""
IN_LINE = 1e-12
"""Area of a triangle of three points in line, over the square of the size of all."""
RING = 1.8
"""Outer diameter of spacers, in diameters of pins."""
HUB = 0.5
"""Diameter of pins at most, where none is given, as a share of the least root circle's radius."""
DOWELS = 12
"""Directions of the two dowels of a wheel that are tried."""
UNLIKE, ARMS = np.array([0.0, 1.95, 4.1]), np.array([1.0, 1.12])
"""Angles of a ring's dowels, arms of a wheel's: unlike, so that it fits in one way only."""


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
    teeth
        Of a wheel, a ring or a rack.
    """

    name: str
    body: str | None
    corners: Points
    holes: dict[str, Floats] = field(default_factory=dict)
    slots: dict[str, Points] = field(default_factory=dict)
    ends: tuple[str, str] | None = None
    teeth: Teeth | None = None

    def outline(self, width: float) -> Loop | ToothedLoop:
        """Return its outline, for plates of a width."""
        if self.teeth is None:
            return Loop(self.corners, width / 2)
        if self.teeth.inside:
            return Loop(self.corners, self.teeth.high + width)
        return ToothedLoop(self.teeth, width)

    def add(self, *places: Floats) -> None:
        """Make the plate large enough for circles around places."""
        self.corners = hull(np.vstack([self.corners, *places]))


@dataclass(frozen=True)
class Kit:
    """All plates and pins of a mechanism; the frame's plate is that of the ground."""

    plates: dict[str, Plate]
    sizes: PartSizes
    clearances: dict[str, float]
    """Of joints that the file gives one."""
    pins: dict[str, tuple[str, str]] = field(default_factory=dict)
    """The two plates that a pin is in; its place is known in the second one."""
    dowels: set[str] = field(default_factory=set)
    """Pins that hold a wheel to the plate of its body, without clearance."""
    meshes: list[tuple[str, str, WheelPair]] = field(default_factory=list)
    """Plates whose teeth mesh."""

    def put(self, pin: str, first: Plate, second: Plate, here: Floats, there: Floats) -> None:
        """Put a pin through two plates, at places in their frames."""
        self.pins[pin] = first.name, second.name
        first.holes[pin], second.holes[pin] = here, there

    def hole(self, pin: str) -> float:
        """Return the radius of a hole or slot: with the clearance of its joint where it has one."""
        if pin in self.dowels:
            return self.sizes.pin / 2
        joint = pin if pin in self.clearances else pin.rpartition(".")[0]
        return self.sizes.pin / 2 + self.clearances.get(joint, self.sizes.clearance)

    @property
    def moving(self) -> list[str]:
        """Names of the plates that move."""
        return [name for name in self.plates if name != GROUND]

    def trains(self) -> dict[str, str]:
        """Return for each plate the one that stands for all in its layer: those of a gear train."""
        meshing = [{one, mate} for one, mate, _ in self.meshes]
        groups = connected(self.plates, lambda one, other: {one, other} in meshing)
        return {name: group[0] for group in groups for name in group}

    @cached_property
    def shafts(self) -> list[list[str]]:
        """Pins by the shaft that they are on: those at one place of a link are one."""
        return connected(self.pins, self._same)

    def _same(self, one: str, other: str) -> bool:
        shared = set(self.pins[one]) & set(self.pins[other])
        holes = [self.plates[plate].holes for plate in shared]
        return any(one in at and other in at and np.array_equal(at[one], at[other]) for at in holes)

    def on_shaft(self, pins: list[str]) -> set[str]:
        """Return the plates on a shaft."""
        return {plate for pin in pins for plate in self.pins[pin]}


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
        Sizes that do not fit, with the holes that meet.
    """
    for name, value in given.items():
        least = name in ("clearance", "kerf", "air", "backlash")
        if not np.isfinite(value) or value < 0 or (value == 0 and not least):
            what = "number" if name == "teeth" else "length"
            bound = "of 0 or more" if least else "above 0"
            raise InputError(f"a {what} {bound} is needed, not {value:g}", where=name)
    mechanism = motion.mechanism
    if mechanism.dimension != 2:
        raise UnavailableError("parts are made of mechanisms of the plane", where="mechanism")
    for name, joint in mechanism.joints.items():
        welded = joint.coincide and joint.keeps_angle
        moves = joint.hinge or joint.straight or joint.bar or joint.wheels
        if joint.rim or not (moves or welded):
            raise UnavailableError(
                f"no parts are made of joints of kind {joint.kind}",
                where=f"joints.{name}",
                hint="revolute, prismatic, pin-in-slot, distance, weld, gear and rack",
            )
    values, rigid = mechanism.values(), Rigid(motion)
    gearing = gearing_of(motion, rigid, given)
    sizes = _sizes(motion, rigid, gearing, given)
    used = {end for joint in mechanism.joints.values() for end in (joint.first, joint.second)}
    places: dict[str, list[Floats]] = {}
    for body in (GROUND, *mechanism.bodies):
        references = [f"{body}.{point}" for point in mechanism.body(body).points]
        at = places.setdefault(rigid.root(body), [])
        at += [rigid.local(r) for r in references if body != GROUND or r in used]
    plates = {b: Plate(b, b, hull(np.array(p).reshape(-1, 2))) for b, p in places.items()}
    clearances = {n: values[key] for n in mechanism.joints if (key := f"{n}.clearance") in values}
    kit = Kit(plates, sizes, clearances)
    for name, joint in mechanism.joints.items():
        first, second = (plates[rigid.root(b)] for b in (joint.first_body, joint.second_body))
        if joint.hinge:
            kit.put(name, first, second, rigid.local(joint.first), rigid.local(joint.second))
        elif joint.bar:
            bar = Plate(name, None, np.zeros((0, 2)), ends=(joint.first, joint.second))
            length = values[f"{name}.length"]
            for k, (plate, reference) in enumerate(((first, joint.first), (second, joint.second))):
                here = np.array([k * length, 0.0])
                kit.put(f"{name}.{k + 1}", plate, bar, rigid.local(reference), here)
                bar.add(here)
            plates[name] = bar
        elif joint.straight:
            _guide(rigid, joint, first, second, kit)
    for plate in plates.values():
        for pin, place in plate.holes.items():  # what is one place but for rounding is one
            near = (p for p in plate.holes.values() if np.hypot(*(p - place)) <= SAME * sizes.pin)
            plate.holes[pin] = next(near)
    names = {wheel: _wheel(wheel, gearing, kit) for wheel in gearing.wheels}
    kit.meshes.extend((names[m.one], names[m.mate], m) for m in gearing.meshes)
    _check(kit)
    return kit


def _wheel(wheel: Wheel, gearing: Gearing, kit: Kit) -> str:
    """Give the plate of a body teeth, or lay a wheel of its own on it; return its name."""
    base, teeth, sizes = kit.plates[wheel.body], wheel.teeth, kit.sizes
    alone = sum(other.body == wheel.body for other in gearing.wheels) == 1
    turning = not (teeth.inside or teeth.straight)
    pins = np.array([*base.holes.values()] or [wheel.place]) - wheel.place
    fits = bool(
        np.hypot(*pins.T).max() + sizes.width / 2 <= teeth.low
        and np.hypot(*(base.corners - wheel.place).T).max() <= (1 + SAME) * wheel.radius
    )
    if fits and alone and turning and base.name != GROUND and not base.slots:
        base.teeth, base.corners = teeth, wheel.place[None]
        return base.name
    kind = "rack" if teeth.straight else "ring" if teeth.inside else "wheel"
    body = "frame" if base.name == GROUND else base.name
    same = sum(name.startswith(f"{body} {kind}") for name in kit.plates)
    name = f"{body} {kind}{f' {same + 1}' if same else ''}"
    plate = kit.plates[name] = Plate(name, base.body, teeth.frame(sizes.width), teeth=teeth)
    if turning:
        for pin, place in list(base.holes.items()):
            if np.hypot(*(place - wheel.place)) <= SAME * sizes.pin:
                kit.put(f"{pin}.{name}", plate, base, place, place)
    for k, place in enumerate(_dowels(base, teeth, kit)):
        pin = f"{name}.{k + 1}"
        kit.put(pin, plate, base, place, place)
        kit.dowels.add(pin)
        base.add(place)
    return name


def _dowels(base: Plate, teeth: Teeth, kit: Kit) -> list[Floats]:
    """Return where the dowels of a wheel, a ring or a rack are, as far from holes as can be."""
    sizes = kit.sizes
    hole = max((kit.hole(pin) for pin in base.holes), default=sizes.hole)
    far = 1.05 * WALL * 2 * hole
    room = ARMS[1] * far + WALL * sizes.pin / 2
    shares = np.arange(DOWELS) / DOWELS
    if teeth.straight:
        half = teeth.count * teeth.pitch / 2 - sizes.width / 2
        depth = teeth.bottom - sizes.width / 2
        ends = [np.array([[-x, depth], [x, depth]]) for x in half * (1 - 0.9 * shares)]
        places = [at @ turned(-teeth.phase) for at in ends]
    elif teeth.inside:
        rim = teeth.high + sizes.width / 2
        places = [rim * turned(np.pi / 2 + 2 * np.pi / 3 * s + UNLIKE)[..., 0] for s in shares]
    elif room > teeth.low:
        raise InputError(
            f"a wheel of {base.name} with {teeth.count} teeth has no room for two dowels of "
            f"{sizes.pin * 1e3:.4g} mm within {teeth.low * 1e3:.4g} mm",
            where="pin",
            hint=f"--pin below {sizes.pin / room * teeth.low * 1e3:.4g} mm",
        )
    else:
        arm = max(far, min(0.5 * teeth.low, 2 * far))
        opposite = np.array([0.0, np.pi])
        places = [arm * ARMS[:, None] * turned(np.pi * s + opposite)[..., 0] for s in shares]
    others = [place[None] for place in base.holes.values()] + list(base.slots.values())

    def room_at(here: Points) -> float:
        gaps = [float(polygon_gaps(p[None, None], hole[None])[0]) for p in here for hole in others]
        return round(min([*gaps, far]) / far, 6)  # but for rounding

    best: Points = max((teeth.place + at for at in places), key=room_at)
    return list(best)


def _guide(rigid: Rigid, joint: Joint, first: Plate, second: Plate, kit: Kit) -> None:
    """Add a slot in the first link and the pins of the second one that slide in it."""
    name, sizes = joint.name, kit.sizes
    angle = rigid.values[f"{name}.axis"] + rigid.turn(joint.first_body)
    along, across = turned(angle).T
    turns = [float(rigid.angle(plate.name)[0]) for plate in (first, second)]
    inside = rigid.seen(joint.second, joint.first)
    slide = inside @ along
    line = across * float(np.mean(inside @ across))
    middle = rigid.local(joint.second)
    half = sizes.width / 2 if joint.keeps_angle else 0.0
    way = angle + turns[0] - turns[1]
    for k, side in enumerate((-1, 1) if joint.keeps_angle else (0,)):
        pin = f"{name}.{k + 1}" if joint.keeps_angle else name
        kit.pins[pin] = first.name, second.name
        here = middle + side * half * turned(way)[:, 0]
        second.holes[pin] = here
        second.add(here)
    rest = half + sizes.pin / 2 + float(np.ptp(slide)) / max(len(slide) - 1, 1)
    ends = np.array([line + (f(slide) + s * rest) * along for f, s in ((min, -1), (max, 1))])
    first.slots[name] = ends
    first.add(*ends)


def _sizes(
    motion: ExportedMotion, rigid: Rigid, gearing: Gearing, given: dict[str, float]
) -> PartSizes:
    """Return what is given, the rest by the sizes of the mechanism and its wheels."""
    roots = [HUB * w.teeth.low for w in gearing.wheels if not w.straight]
    largest = min([PIN * motion.mechanism.scale, NEAR * _shortest(motion, rigid), *roots])
    pin = given.get("pin", largest)
    return PartSizes(
        given.get("width", BROAD * pin),
        given.get("thickness", 0.75 * pin),
        pin,
        given.get("clearance", 0.01 * pin),
        given.get("air", 0.1 * pin),
        given.get("kerf", 0.0),
    )


def _shortest(motion: ExportedMotion, rigid: Rigid) -> float:
    """Return the least distance of two joints of a link [m]."""
    joints = motion.mechanism.joints.values()
    ends = sorted({end for joint in joints for end in (joint.first, joint.second)})
    found = [float("inf")]
    for one, other in combinations(ends, 2):
        if len({rigid.root(end.partition(".")[0]) for end in (one, other)}) == 1:
            far = float(np.hypot(*(rigid.local(one) - rigid.local(other))))
            found += [far] if far > SAME * motion.mechanism.scale else []
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
        check_holes(plate if plate.name != GROUND else replace(plate, slots={}), kit)


def check_holes(plate: Plate, kit: Kit) -> None:
    """Raise for holes and slots of a plate that meet."""
    sizes = kit.sizes
    loops = {name: place[None] for name, place in plate.holes.items()}
    loops |= {f"slot {name}": ends for name, ends in plate.slots.items()}
    for one, other in combinations(loops, 2):
        far = float(polygon_gaps(loops[one][None], loops[other][None])[0])
        apart = f"{one} and {other} of {plate.name} are {far * 1e3:.4g} mm apart"
        widest = 1e3 * far / WALL - 2e3 * sizes.clearance
        if one in plate.holes and other in plate.holes:
            if 0 < far < (kit.hole(one) + kit.hole(other)) * WALL:
                raise InputError(
                    f"holes {apart}, pins are {sizes.pin * 1e3:.4g} mm thick",
                    where="pin",
                    hint=f"at most {widest:.4g} mm",
                )
        elif far < 2 * sizes.hole * WALL:
            raise UnavailableError(
                f"{apart}: they would be one hole",
                where=f"bodies.{plate.name}" if plate.name != GROUND else "ground",
                hint=f"--pin below {widest:.4g} mm"
                if far > 0
                else "offset one of them along the axis in another link",
            )

"""The toothed wheels and racks of a planar mechanism: numbers of teeth, phases, whether they pass.

Wheels that mesh have one module. Where the file gives no numbers of teeth, they are the smallest
ones in the ratio that are not undercut and pass each other.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import ceil, lcm

import numpy as np

from mechdae.describe.expression import evaluate
from mechdae.draw.diagram.wheels import pitch_radii
from mechdae.errors import InputError, UnavailableError
from mechdae.parts.exchange.workshop.bodies import Rigid, connected
from mechdae.parts.exchange.workshop.outlines import turned
from mechdae.parts.exchange.workshop.teeth import Teeth, addendum, contact_ratio, least_gap
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats

BACKLASH = 0.04
"""Backlash along the pitch circle where none is given, in modules."""
SAME = 1e-7
"""By how much lengths that are one may differ, as a share of the pitch radius."""
IN_PHASE = 1e-6
"""By how much teeth may be off each other, in pitches, and lie in each other, in modules."""
MOST_TEETH = 400
"""Teeth of the least wheel's counterpart in a ratio that is given as a number."""
TRIED = 24
"""Multiples of the smallest numbers of teeth that are tried."""
SHORTER = (1.0, 0.9, 0.8, 0.7, 0.6)
"""Shares of the addendum that are tried."""


@dataclass(eq=False)
class Wheel:
    """A wheel or a rack: its body, centre or place on the pitch line, radius, and teeth.

    Attributes
    ----------
    way
        Of a rack: direction of its pitch line, with the teeth on its left.
    reach
        Of a rack: where along it the wheel's centre is, least and most.
    """

    body: str
    place: Floats
    radius: float
    inside: bool = False
    way: float = 0.0
    reach: tuple[float, float] = (0.0, 0.0)
    count: int = 0
    teeth: Teeth = field(init=False)

    def __post_init__(self) -> None:
        self.straight = not np.isfinite(self.radius)


@dataclass
class WheelPair:
    """Two wheels that mesh; the first one is no ring or rack, and not the larger one.

    ``angles`` are the directions of the pitch point in the frames of both, in each pose; of a rack
    its place along it. ``given`` is the backlash of the joint, ``ratio`` the contact ratio,
    ``bound`` what the gap of teeth is proved to be at least over a pitch.
    """

    joint: str
    one: Wheel
    mate: Wheel
    far: float
    given: float | None
    pressure: float
    angles: tuple[Floats, Floats]
    backlash: float = 0.0
    ratio: float = 0.0
    bound: float = 0.0

    @property
    def sense(self) -> int:
        """How the second's teeth pass the pitch point when those of the first go on."""
        return -1 if self.mate.inside or self.mate.straight else 1

    def sums(self) -> Floats:
        """Return the sums of the teeth's places [pitches] in the poses."""
        one, mate = self.angles
        pitches = 2 * np.pi / self.one.count
        there = mate / (pitches * self.one.radius) if self.mate.straight else (
            mate * self.mate.count / (2 * np.pi)
        )  # fmt: skip
        found: Floats = one / pitches + self.sense * there
        return found


@dataclass
class Gearing:
    """All wheels of a mechanism, and where they mesh."""

    wheels: list[Wheel] = field(default_factory=list)
    meshes: list[WheelPair] = field(default_factory=list)

    def wheel(self, made: Wheel) -> Wheel:
        """Return the wheel that is there already at this place with this radius, or this one."""
        for known in self.wheels:
            same = known.body == made.body and known.inside == made.inside
            if same and not (made.straight or known.straight):
                off = max(np.abs(known.place - made.place).max(), abs(known.radius - made.radius))
                if off <= SAME * made.radius:
                    return known
        self.wheels.append(made)
        return made

    def trains(self) -> list[list[WheelPair]]:
        """Return the meshes by trains: of one train each wheel drives each other one."""
        return connected(self.meshes, lambda a, b: bool({a.one, a.mate} & {b.one, b.mate}))


def gearing_of(motion: ExportedMotion, rigid: Rigid, given: dict[str, float]) -> Gearing:
    """Return the wheels with their teeth.

    Raises
    ------
    UnavailableError
        Teeth that cannot be cut, or do not mesh in a closed train, with the joint and the figure.
    """
    found = Gearing()
    for name, joint in motion.mechanism.joints.items():
        if joint.wheels and not joint.rim:
            make = _pair if joint.wheels == 2 else _rack
            found.meshes.append(make(motion, rigid, name, found))
    values = motion.mechanism.parameter_values
    for mesh in found.meshes:
        counts = getattr(motion.mechanism.joints[mesh.joint], "teeth", None)
        if counts is not None:
            smaller, larger = sorted(round(evaluate(count, values)) for count in counts)
            mesh.one.count, mesh.mate.count = smaller, larger
    trains = found.trains()
    for option in ("module", "teeth"):
        if option in given and all(any(m.one.count for m in train) for train in trains):
            raise InputError("no teeth that the file leaves open", where=option)
    for train in trains:
        _teeth(train, given)
    return found


def _pair(motion: ExportedMotion, rigid: Rigid, name: str, gearing: Gearing) -> WheelPair:
    joint, values = motion.mechanism.joints[name], motion.mechanism.values()
    ends = joint.first, joint.second
    bodies = [rigid.root(body) for body in (joint.first_body, joint.second_body)]
    way = rigid.place(joint.second) - rigid.place(joint.first)
    lengths = np.hypot(*way.T)
    low, high, far = float(lengths.min()), float(lengths.max()), float(lengths.mean())
    if high - low > SAME * high or high == 0:
        raise UnavailableError(
            f"the distance of the wheels is between {low * 1e3:.6g} mm and {high * 1e3:.6g} mm: "
            "teeth need one above 0 in all poses",
            where=f"joints.{name}",
        )
    ratio = values[f"{name}.ratio"]
    radii = pitch_radii(far, ratio)
    if radii is None:
        raise UnavailableError(
            "a ring and its wheel have a ratio other than 1", where=f"joints.{name}"
        )
    wheels = [
        gearing.wheel(Wheel(body, rigid.local(end), radius, ratio > 0 and radius == max(radii)))
        for body, end, radius in zip(bodies, ends, radii, strict=True)
    ]
    toward = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    if ratio > 0 and radii[0] < radii[1]:
        toward = toward + np.pi  # the pitch point is beyond the smaller wheel
    angles = [
        toward + (np.pi if ratio < 0 and k else 0.0) - rigid.angle(body)
        for k, body in enumerate(bodies)
    ]
    backlash, pressure = values.get(f"{name}.backlash"), values[f"{name}.pressure_angle"]
    if f"{name}.backlash_angle" in values:
        backlash = values[f"{name}.backlash_angle"] * radii[0]
    k = int(radii[0] > radii[1])
    return WheelPair(
        name, wheels[k], wheels[1 - k], far, backlash, pressure, (angles[k], angles[1 - k])
    )


def _rack(motion: ExportedMotion, rigid: Rigid, name: str, gearing: Gearing) -> WheelPair:
    joint, values = motion.mechanism.joints[name], motion.mechanism.values()
    bodies = [rigid.root(body) for body in (joint.first_body, joint.second_body)]
    signed = values[f"{name}.radius"]
    radius = abs(signed)
    way = values[f"{name}.axis"] + rigid.turn(joint.second_body)
    way += 0.0 if signed > 0 else np.pi
    along, up = turned(way).T
    centre = rigid.seen(joint.first, joint.second)
    height, where = centre @ up, centre @ along
    if np.ptp(height) > SAME * radius:
        raise UnavailableError(
            f"the wheel's centre leaves its line along the rack by {np.ptp(height) * 1e3:.4g} mm",
            where=f"joints.{name}",
        )
    wheel = gearing.wheel(Wheel(bodies[0], rigid.local(joint.first), radius))
    line = up * (float(height.mean()) - radius)
    reach = float(where.min()), float(where.max())
    rack = Wheel(bodies[1], line, np.inf, way=way, reach=reach)
    gearing.wheels.append(rack)
    turns = way - np.pi / 2 + rigid.angle(bodies[1]) - rigid.angle(bodies[0])
    backlash, pressure = values.get(f"{name}.backlash"), values[f"{name}.pressure_angle"]
    return WheelPair(name, wheel, rack, radius, backlash, pressure, (turns, where))


# -- numbers of teeth ----------------------------------------------------------------------


def _teeth(train: list[WheelPair], given: dict[str, float]) -> None:
    """Give all wheels of a train their teeth."""
    pressure, where = train[0].pressure, f"joints.{train[0].joint}"
    if any(mesh.pressure != pressure for mesh in train):
        raise UnavailableError("wheels of one train have several pressure angles", where=where)
    wheels = [*dict.fromkeys(w for m in train for w in (m.one, m.mate) if not w.straight)]
    counts, reasons = [wheel.count for wheel in wheels], []
    for module in _modules(wheels, pressure, given, where):
        for wheel, count in zip(wheels, counts, strict=True):
            exact = 2 * wheel.radius / module
            wheel.count = count or round(exact)
            if abs(exact - wheel.count) > 1e-6:
                raise UnavailableError(
                    f"with the module {module * 1e3:.6g} mm of this train a wheel of "
                    f"{wheel.radius * 1e3:.6g} mm has {exact:.6g} teeth",
                    where=where,
                )
        reasons.append(_phased(train, module, pressure, given) or _passing(train))
        if not reasons[-1]:
            return
    raise UnavailableError(reasons[0])


def _modules(
    wheels: list[Wheel], pressure: float, given: dict[str, float], where: str
) -> list[float]:
    """Return the modules that are tried, the best one first."""
    for wheel in wheels:
        if wheel.count:
            return [2 * wheel.radius / wheel.count]
    least = min(wheels, key=lambda wheel: wheel.radius)
    shares = [
        Fraction(wheel.radius / least.radius).limit_denominator(MOST_TEETH) for wheel in wheels
    ]
    for wheel, share in zip(wheels, shares, strict=True):
        exact = wheel.radius / least.radius
        if abs(share - exact) > 1e-9 * exact:
            raise UnavailableError(
                f"the ratio {exact:.9g} is none of whole numbers of teeth; {share} is near",
                where=where,
                hint="ratio, or teeth = [z1, z2] with mesh",
            )
    smallest = lcm(*(share.denominator for share in shares))  # teeth of the least wheel
    if "teeth" in given:
        times, rest = divmod(given["teeth"], smallest)
        if rest or times < 1:
            raise InputError(
                f"the smaller wheel has {smallest} teeth or a multiple, not {given['teeth']:g}",
                where="teeth",
            )
        return [2 * least.radius / given["teeth"]]
    if "module" in given:
        times = max(1, round(2 * least.radius / given["module"] / smallest))
        return [2 * least.radius / (smallest * times)]
    uncut = ceil(2 / np.sin(pressure) ** 2 - 1e-9)
    first = ceil(uncut / smallest)
    return [2 * least.radius / (smallest * k) for k in range(first, first + TRIED)]


def _phased(train: list[WheelPair], module: float, pressure: float, given: dict[str, float]) -> str:
    """Turn all wheels to where their teeth mesh and thin them; return why they do not."""
    phases = {train[0].one: 0.0}
    thins: dict[Wheel, float] = {}
    left = list(train)
    while left:
        mesh = next(m for m in left if m.one in phases or m.mate in phases)
        left.remove(mesh)
        sums = mesh.sums()
        off = np.abs((sums - sums[0] + 0.5) % 1 - 0.5).max()
        if off > IN_PHASE:
            return f"joints.{mesh.joint}: teeth leave each other by {off:.4g} pitches"
        sense, want = mesh.sense, float(sums[0]) - 0.5
        play = given.get("backlash", BACKLASH * module) if mesh.given is None else mesh.given
        mesh.backlash = play
        for one, mate in ((mesh.one, mesh.mate), (mesh.mate, mesh.one)):
            if one in phases and mate not in phases:
                phase = phases[one]
                phases[mate] = sense * (want - phase) if one is mesh.one else want - sense * phase
                thins.setdefault(one, play / 2)
                thins[mate] = play - thins[one]
        rest = (phases[mesh.one] + sense * phases[mesh.mate] - want + 0.5) % 1 - 0.5
        if abs(rest) > IN_PHASE:
            return (
                f"joints.{mesh.joint}: in the closed train its teeth are {abs(rest):.4g} of a "
                "pitch off each other"
            )
        thick = thins[mesh.one] + thins[mesh.mate] - play
        if abs(thick) > SAME * module or min(thins.values()) < 0:
            return f"joints.{mesh.joint}: no thickness of teeth gives this backlash and the others"
    for mesh in train:
        for wheel in (mesh.one, mesh.mate):
            wheel.teeth = _made(wheel, module, pressure, phases[wheel], thins[wheel])
    return ""


def _made(wheel: Wheel, module: float, pressure: float, phase: float, thin: float) -> Teeth:
    """Return a wheel's teeth with one of them at a phase [pitches]."""
    if not wheel.straight:
        turn = phase * 2 * np.pi / wheel.count
        return Teeth(
            wheel.place, wheel.count, wheel.radius, module, pressure, turn, thin, wheel.inside
        )
    pitch, (begin, end) = np.pi * module, wheel.reach
    count = ceil((end - begin + 2 * module / np.tan(pressure)) / pitch) + 1
    start = (phase + (count - 1) / 2) * pitch
    middle = start + round(((begin + end) / 2 - start) / pitch) * pitch
    place = wheel.place + middle * turned(wheel.way)[:, 0]
    return Teeth(place, count, np.inf, module, pressure, wheel.way, thin)


def _passing(train: list[WheelPair]) -> str:
    """Give teeth the addendum with which they pass their mates; return why there is none."""
    reasons = []
    for share in SHORTER:
        tips: dict[Wheel, float] = {}
        for mesh in train:
            for wheel, other in ((mesh.one, mesh.mate), (mesh.mate, mesh.one)):
                tip = share * addendum(wheel.teeth, other.teeth, mesh.far)
                tips[wheel] = min(tip, tips.get(wheel, np.inf))
        for wheel, tip in tips.items():
            wheel.teeth = replace(wheel.teeth, tip=tip)
        reasons.append(next(filter(None, map(_meets, train)), ""))
        if not reasons[-1]:
            return ""
    return reasons[0]


def _meets(mesh: WheelPair) -> str:
    """Look at a pair over a pitch; return why it does not mesh."""
    one, mate = mesh.one.teeth, mesh.mate.teeth
    module, where = one.module, f"joints.{mesh.joint}"
    for teeth in (one, mate):
        if min(float(teeth.half(teeth.high)), teeth.tip) <= 0:
            return f"{where}: {teeth.count} teeth of this pressure angle and backlash are pointed"
    mesh.ratio = contact_ratio(one, mate, mesh.far)
    if mesh.ratio < 1:
        return f"{where}: the contact ratio is {mesh.ratio:.3f}, below 1"
    gap, mesh.bound = least_gap(one, mate, mesh.far)
    if gap < -IN_PHASE * module:
        return f"{where}: teeth meet by {-gap / module:.4g} modules off the line of action"
    return ""

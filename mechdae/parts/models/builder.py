"""A planar mechanism from places in one drawn pose, shown while it is built."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.pairs import Prismatic, Revolute, Weld
from mechdae.describe.loads import Force
from mechdae.describe.mechanism import GROUND, Body, Ground, Mechanism
from mechdae.describe.tasks.kinds import Driver, Modes, Sweep, Task
from mechdae.describe.units import units_of
from mechdae.describe.values import Table
from mechdae.draw import plot
from mechdae.equations.mobility import count_mobility
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.results import Named, Result, Series, Summary, SweepResult
from mechdae.tasks.solve import solve

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Place = Sequence[float]
Places = dict[str, tuple[float, float]]
"""By point [m]."""
DRAWN = 1e-9
"""Share of the drawing by which two places of one point may be apart."""
POSES = 181


def build(units: str = "m", title: str = "") -> DrawnMechanism:
    """Return a builder: bodies and joints by places in one drawn pose.

    Parameters
    ----------
    units, title
        As of `DrawnMechanism`.

    Returns
    -------
    DrawnMechanism
        Still without bodies.

    Examples
    --------
    >>> m = md.build(units="mm,deg").body("crank").body("rod").body("slider")
    >>> m = m.pin("O", "ground", "crank", at=(0, 0)).pin("B", "crank", "rod", at=(30, 40))
    >>> m = m.pin("C", "rod", "slider", at=(150, 0)).slide("guide", "ground.O", "slider.C")
    >>> len(m.solve(poses=5))
    5
    """
    return DrawnMechanism(units, title)


class DrawnMechanism:
    """Bodies and joints of a planar mechanism by places in one drawn pose.

    Every method that adds something returns the builder. In a notebook it shows itself,
    complete or not.

    Parameters
    ----------
    units
        Units of all numbers: ``"mm,deg"``.
    title
        What the mechanism is called in pictures.

    Examples
    --------
    >>> arm = md.DrawnMechanism("mm,deg").body("arm", P=(100, 50))
    >>> arm = arm.pin("O", "ground", "arm", at=(0, 0)).drive("arm", 0, 90)
    >>> arm.missing()
    []
    """

    def __init__(self, units: str = "m", title: str = "") -> None:
        chosen = units_of(units)
        self._length, self._angle = chosen.of("m").factor, chosen.of("rad").factor
        self._force, self._mass = chosen.of("N").factor, chosen.of("kg").factor
        self.title = title
        self._places: dict[str, Places] = {GROUND: {}}
        self._masses: dict[str, float] = {}
        self._joints: dict[str, Joint] = {}
        self._guides: dict[str, float] = {}
        self._turned: dict[str, float] = {}
        self._cylinders: list[str] = []
        self._forces: dict[str, Force] = {}
        self._outputs: dict[str, str] = {}
        self._drivers: list[Driver] = []

    # -- what it is made of ------------------------------------------------------------------

    def body(self, name: str, *, mass: float | None = None, **points: Place) -> DrawnMechanism:
        """Add the body `name`, or points to it: ``m.body("coupler", P=(60, 80))``.

        A `mass` is that of a point, the body's first one.
        """
        self._places.setdefault(name, {})
        for point, place in points.items():
            self._put(f"{name}.{point}", self._metres(place, f"{name}.{point}"))
        if mass is not None:
            self._masses[name] = mass / self._mass
        return self

    def pin(self, name: str, first: str, second: str, at: Place | None = None) -> DrawnMechanism:
        """Join two bodies by the pin `name` at a place, or at a point that one of them has already.

        `first` and `second` are bodies, ``"crank"``, or their points, ``"crank.B"``; without a
        point it is called as the joint.
        """
        return self._add(Revolute(name, *self._ends(name, first, second, at)))

    def weld(self, name: str, first: str, second: str, at: Place | None = None) -> DrawnMechanism:
        """Make two bodies one, as they are drawn; `name`, `first`, `second`, `at` as of `pin`."""
        return self._add(Weld(name, *self._ends(name, first, second, at)))

    def slide(
        self, name: str, first: str, second: str, at: Place | None = None, angle: float = 0.0
    ) -> DrawnMechanism:
        """Guide the second body along a line of the first through a place; `angle` as drawn.

        `name`, `first`, `second`, `at` are as of `pin`. Points that are there already may be apart,
        along the line: the slide is their distance.
        """
        turned = angle / self._angle
        ends = self._end(name, first), self._end(name, second)
        one, two = (self._known(end) for end in ends)
        if at is not None or one is None or two is None:
            ends = self._ends(name, first, second, at)
        else:
            off = abs((two[1] - one[1]) * math.cos(turned) - (two[0] - one[0]) * math.sin(turned))
            if off > DRAWN * self._size():
                raise InputError(
                    f"{ends[1]} is {off * self._length:.6g} off the line through {ends[0]}",
                    where=name,
                    hint="angle = ..., or at = (x, y), a place on the line",
                )
        self._guides[name] = turned
        return self._add(Prismatic(name, *ends))

    def cylinder(
        self, name: str, first: str, second: str, bore: float | None = None
    ) -> DrawnMechanism:
        """Put a cylinder between two points; it is driven unless another driver is named.

        `first` and `second` are points, ``"lever.A"``. With its `name` its length is
        ``NAME.slide``; with a `bore` the output ``NAME_pressure`` [Pa] is what forces need.
        """
        ends = [self._end(name, point) for point in (first, second)]
        places = [self._known(end) for end in ends]
        if None in places:
            lost = ends[places.index(None)]
            raise InputError(f"{lost} has no place yet", where=name, hint="m.body(..., P=(x, y))")
        one, two = (np.array(place) for place in places if place is not None)
        barrel, rod, along = f"{name}_barrel", f"{name}_rod", two - one
        for body, end, place in ((barrel, ends[0], one), (rod, ends[1], two)):
            point = end.split(".")[1]
            self._put(f"{body}.{point}", tuple(place))
            self._turned[body] = math.atan2(along[1], along[0])
            self._add(Revolute(f"{name}_{point}", end, f"{body}.{point}"))
        self._guides[name] = self._turned[barrel]
        self._cylinders.append(f"{name}.slide")
        points = [end.split(".")[1] for end in ends]
        self._add(Prismatic(name, f"{barrel}.{points[0]}", f"{rod}.{points[1]}"))
        if bore is not None:
            area = math.pi / 4 * (bore / self._length) ** 2
            self._outputs[f"{name}_pressure"] = f"{name}.effort/{area!r}"
        return self

    def joint(self, joint: Joint) -> DrawnMechanism:
        """Add any other joint, as a value: ``md.Gear(...)``, between points that have places."""
        for end in (joint.first, joint.second):
            if self._known(end) is None:
                raise InputError(f"{end} has no place yet", where=joint.name)
        return self._add(joint)

    def force(self, name: str, point: str, value: Place) -> DrawnMechanism:
        """Let a force of the `value` (x, y) act at a `point`, in the axes of the drawing.

        `name` is what results call it.
        """
        x, y = (float(part) / self._force for part in value)
        self._forces[name] = Force(name, self._end(name, point), (x, y))
        return self

    def drive(
        self,
        coordinate: str,
        start: float | None = None,
        end: float | None = None,
        speed: float | None = None,
    ) -> DrawnMechanism:
        """Drive a body's angle or a joint's slide, from `start` to `end` or all that assembles.

        `coordinate` is the name of the body or joint; `speed` its rate, 1 rad/s or m/s without one.
        """
        if coordinate in self._places:
            coordinate = f"{coordinate}.angle"
        elif coordinate in self._joints:
            coordinate = f"{coordinate}.{self._joints[coordinate].usual}"
        unit = self._angle if coordinate.endswith("angle") else self._length
        ways: dict[str, Any] = {"range": "assembled"}
        if start is not None and end is not None:
            ways = {"from_": start / unit, "to": end / unit}
        if speed is not None:
            ways["speed"] = speed / unit
        self._drivers.append(Driver(coordinate, **ways))
        return self

    # -- what comes of it ---------------------------------------------------------------------

    def mechanism(self) -> Mechanism:
        """Return the mechanism; its sketch is the drawing."""
        return self._made(self._places, self._joints)

    def problem(self) -> Problem:
        """Return the mechanism with a sweep of its driver, with forces where there are loads.

        Without a driver the first body on a pin of the ground is driven, or the first cylinder.
        """
        mechanism = self.mechanism()
        drivers = tuple(self._drivers or self._likely())
        if not drivers:
            raise InputError("nothing is driven", hint='m.drive("crank")')
        if len(drivers) > 1:
            drivers = tuple(self._held(driver, mechanism) for driver in drivers)
        poses = None if len(drivers) > 1 else POSES
        kind: Any = Sweep
        if self._forces or self._outputs or self._masses:
            from mechdae.describe.tasks.motion import Reactions

            kind = Reactions
        tasks: dict[str, Task] = {"move": kind(drivers=drivers, poses=poses)}
        held = tuple(self._held(driver, mechanism) for driver in drivers)
        tasks["modes"] = Modes(drivers=held)
        return Problem(mechanism, Table(tasks), title=self.title)

    def solve(self, task: str | None = None, **options: Any) -> Result:
        """Return ``md.solve`` of the problem: `task` is the name of one, `options` its keywords."""
        return solve(self.problem(), task, **options)

    def missing(self) -> list[str]:
        """Return what keeps it from being solved, in sentences; nothing where it is complete."""
        bodies = [name for name in self._places if name != GROUND]
        if not bodies:
            return ['no body yet: m.body("crank")']
        empty = [name for name in bodies if not self._places[name]]
        found = [f"{name} has no point and no joint" for name in empty]
        found += [f"no joint leads from {name} to the ground" for name in self._loose()]
        found = [line for line in found if line.split()[0] not in empty or "point" in line]
        if found:
            return found
        try:
            freedoms = count_mobility(self.mechanism())["W"]
            count = len(self._drivers) or 1
            hanging = [n for n in bodies if sum(n in j.bodies for j in self._joints.values()) < 2]
            if freedoms > count:
                one = "hang" if len(hanging) > 1 else "hangs"
                ends = f"; {', '.join(hanging)} {one} on one joint" if hanging else ""
                free = freedoms - count
                plural = "s of freedom have" if free > 1 else " of freedom has"
                return [f"{free} degree{plural} no driver{ends}"]
            held = [self._held(d, self.mechanism()) for d in self._drivers or self._likely()]
            solve(Problem(self.mechanism()), Sweep(drivers=tuple(held)))
        except MechdaeError as error:
            return [str(error)]
        return []

    def plot(self, **options: Any) -> Axes:
        """Return the diagram as drawn, complete or not; options are those of diagrams."""
        places = {name: dict(points) for name, points in self._places.items() if points}
        joints = dict(self._joints)
        if not set(places) - {GROUND}:
            raise InputError("nothing is there to draw", hint='m.body("crank", B=(30, 40))')
        for name in self._loose():
            if name in places:  # held as it is drawn
                point, place = next(iter(places[name].items()))
                end = f"{name}_{point}"
                places[GROUND] = {**places.get(GROUND, {}), end: place}
                joints[f"held_{name}"] = Weld(f"held_{name}", f"{GROUND}.{end}", f"{name}.{point}")
        mechanism = self._made(places, joints)
        known = {
            f"{name}.{point}": Series({"position": np.array([place])})
            for name, points in places.items()
            for point, place in points.items()
            if name != GROUND
        }
        turned = {
            name: Series({"angle": np.array([float(mechanism.sketch[name])])})
            for name in mechanism.bodies
        }
        driver = next(iter(self._drivers or self._likely()), Driver("none", at=(0.0,)))
        drawn = SweepResult(
            "drawing",
            "drawn",
            "sweep",
            mechanism,
            self.title or "as drawn",
            drivers=Named("driver", {}),
            bodies=Named("body", turned),
            points=Named("point", known),
            joints=Named("joint", {}),
            status=np.zeros(1, np.uint8),
            summary=Summary({}),
            definition=Sweep(driver=driver),
        )
        axes: Axes = plot(drawn, "diagram", **options)
        return axes

    def __repr__(self) -> str:
        """Return a line with what it is made of, and what is missing."""
        counts = f"{len(self._places) - 1} bodies, {len(self._joints)} joints"
        missing = self.missing()
        return f"<DrawnMechanism: {counts}; {'; '.join(missing) if missing else 'complete'}>"

    def _repr_html_(self) -> str:
        """Return the drawing and what is missing, for notebooks."""
        from mechdae.draw import figure

        try:
            picture = f'<img src="{figure.data_url(self.plot())}" alt="as drawn">'
        except MechdaeError:
            picture = ""
        return f"{picture}<pre>{html.escape(repr(self))}</pre>"

    # -- places --------------------------------------------------------------------------------

    def _metres(self, place: Place, where: str) -> tuple[float, float]:
        """Return a place [m] that was given in the builder's unit."""
        try:
            x, y = (float(part) / self._length for part in place)
        except (TypeError, ValueError):
            raise InputError(f"a place (x, y) is needed, not {place!r}", where=where) from None
        if not (math.isfinite(x) and math.isfinite(y)):
            raise InputError(f"a place (x, y) is needed, not {place!r}", where=where)
        return x, y

    def _size(self) -> float:
        """Return the extent of the drawing."""
        places = [place for points in self._places.values() for place in points.values()]
        return float(np.ptp(np.array(places), axis=0).max()) if places else 0.0

    def _known(self, end: str) -> tuple[float, float] | None:
        """Return the place of ``body.point``, None where it has none yet."""
        body, _, point = end.partition(".")
        if body not in self._places:
            raise UnknownName("body", body, self._places)
        return self._places[body].get(point)

    def _put(self, end: str, place: tuple[float, float]) -> None:
        """Give ``body.point`` a place, the same where it has one."""
        body, _, point = end.partition(".")
        known = self._places.setdefault(body, {}).setdefault(point, place)
        gap = math.dist(known, place)
        if gap > DRAWN * max(self._size(), gap):
            raise InputError(
                f"{end} is drawn {gap * self._length:.6g} away from that place", where=end,
                hint="all points of a joint have one place in the drawn pose",
            )  # fmt: skip

    def _end(self, joint: str, end: str) -> str:
        """Return ``body.point`` of a joint, the point called as the joint where there is none."""
        end = end if "." in end else f"{end}.{joint}"
        self._known(end)
        return end

    def _ends(self, joint: str, first: str, second: str, at: Place | None) -> tuple[str, str]:
        """Return both points of a joint that is at one place, and put them there."""
        ends = self._end(joint, first), self._end(joint, second)
        places = [place for end in ends if (place := self._known(end)) is not None]
        if at is not None:
            places.insert(0, self._metres(at, joint))
        if not places:
            raise InputError(
                f"joint {joint} has no place", where=joint, hint="at = (x, y), as it is drawn"
            )
        for end in ends:
            self._put(end, places[0])
        return ends

    def _add(self, joint: Joint) -> DrawnMechanism:
        if joint.name in self._joints:
            raise InputError("there is a joint of that name", where=joint.name)
        self._joints[joint.name] = joint
        return self

    # -- the mechanism -------------------------------------------------------------------------

    def _angle_of(self, body: str) -> float:
        """Return the direction of a body's x axis: from its first point to its second."""
        places = list(self._places[body].values())
        if body == GROUND or len(places) < 2:
            return self._turned.get(body, 0.0)
        (x, y), (a, b) = places[:2]
        return math.atan2(b - y, a - x)

    def _local(
        self, body: str, points: dict[str, tuple[float, float]]
    ) -> dict[str, tuple[float, float]]:
        """Return points in a body's own frame: its first point is the origin."""
        (x, y), turned = next(iter(points.values())), self._angle_of(body)
        c, s = math.cos(turned), math.sin(turned)
        places = {p: (a - x, b - y) for p, (a, b) in points.items()}
        local = {p: (a * c + b * s, b * c - a * s) for p, (a, b) in places.items()}
        for point in list(points)[1:2]:
            local[point] = (math.hypot(*places[point]), 0.0)
        return local

    def _made(self, places: dict[str, Places], joints: dict[str, Joint]) -> Mechanism:
        """Return the mechanism of places and joints."""
        angles = {name: self._angle_of(name) for name in [GROUND, *places]}
        placed: list[Joint] = []
        for joint in joints.values():
            turn = angles[joint.second_body] - angles[joint.first_body]
            numbers: dict[str, Any] = {"turn": turn} if joint.rigid else {}
            if joint.name in self._guides:
                axis = self._guides[joint.name] - angles[joint.first_body]
                numbers = {"turn": turn, "axis": axis}
            placed.append(replace(joint, **numbers))
        del angles[GROUND]
        bodies = [
            Body(
                name, points=self._local(name, places[name]), number=k, mass=self._masses.get(name)
            )
            for k, name in enumerate(angles, start=1)
        ]
        return Mechanism(
            ground=Ground(points=places.get(GROUND, {})),
            bodies=bodies,
            joints=placed,
            loads=list(self._forces.values()),
            outputs=self._outputs,
            sketch=angles | {name: self._slide(joints[name]) for name in self._guides},
        )

    def _loose(self) -> list[str]:
        """Return the bodies that no chain of joints connects to the ground."""
        reached, front = {GROUND}, [GROUND]
        for body in front:  # grows by bodies that are reached first
            for joint in self._joints.values():
                if body in joint.bodies:
                    front += [other for other in joint.bodies if other not in reached]
                    reached |= set(joint.bodies)
        return [name for name in self._places if name not in reached]

    def _likely(self) -> list[Driver]:
        """Return what is driven where nothing is said: a cylinder, a body on a fixed pin."""
        pinned = [
            f"{body}.angle"
            for joint in self._joints.values()
            if joint.hinge and GROUND in joint.bodies
            for body in joint.bodies
            if body != GROUND
        ]
        return [Driver(name, range="assembled") for name in [*self._cylinders, *pinned][:1]]

    def _held(self, driver: Driver, mechanism: Mechanism) -> Driver:
        """Return a driver at its value in the drawn pose."""
        part, _, word = driver.coordinate.rpartition(".")
        if part in mechanism.bodies:
            return Driver(driver.coordinate, at=(mechanism.sketch[part],))
        joint = self._joints[part]
        if word == "angle":
            turn = self._angle_of(joint.second_body) - self._angle_of(joint.first_body)
            return Driver(driver.coordinate, at=(turn,))
        return Driver(driver.coordinate, at=(self._slide(joint),))

    def _slide(self, joint: Joint) -> float:
        """Return how far apart the points of a guide are drawn, along it."""
        (x, y), (a, b) = (self._known(end) or (0.0, 0.0) for end in (joint.first, joint.second))
        along = self._guides.get(joint.name, 0.0)
        return (a - x) * math.cos(along) + (b - y) * math.sin(along)

"""How many poses groups of the plane have at most: theorems of the field."""

from __future__ import annotations

import dataclasses

from flint import arb

from .arithmetic import ONE, ZERO, need
from .counts import Theorems
from .plane import PlanarMechanism

CIRCLES = "circles and lines"


@dataclasses.dataclass
class PlanarGroup:
    """What theorems ask of a group, its joints with each other and with known bodies."""

    bodies: list[str]
    kinds: list[str] = dataclasses.field(default_factory=list)
    inner: list[set[str]] = dataclasses.field(default_factory=list)
    """Pairs of its bodies that joints link."""
    drivers: list[str] = dataclasses.field(default_factory=list)
    hubs: list[list[arb] | None] = dataclasses.field(default_factory=list)
    """Points of its bodies in joints; None of a rack of its own."""
    turn: arb = ZERO
    arm: set[str] = dataclasses.field(default_factory=set)
    """Turn of a wheel that is geared to a known one, for one of its carrier; both bodies."""

    @property
    def pins(self) -> int:
        return self.kinds.count("revolute")

    @property
    def slides(self) -> int:
        return self.kinds.count("prismatic")

    @property
    def gears(self) -> int:
        return self.kinds.count("gear")

    @property
    def lower(self) -> bool:
        """Whether pins and guides are all its joints."""
        return self.pins + self.slides == len(self.kinds)

    def is_shaped(self, bodies: int, joints: int, inner: int, drivers: int) -> bool:
        """Whether it has so many bodies, joints, joints between its bodies, and drivers."""
        counts = len(self.bodies), len(self.kinds), len(self.inner), len(self.drivers)
        return counts == (bodies, joints, inner, drivers)


def group_in_plane(m: PlanarMechanism, bodies: list[str], known: set[str]) -> PlanarGroup:
    """Return what theorems ask of bodies that joints link to known ones."""
    new = {*bodies}
    fresh = bodies and not known & new and len(new) == len(bodies)
    need(fresh, "groups", f"no bodies, or one stands there twice: {str(bodies)[:60]}")
    group, coordinates = PlanarGroup(bodies), set[str]()
    for name, joint in m.counted.items():
        one, other = joint["bodies"]
        touched = {one, other, joint["carrier"]}
        if not (touched & new and touched <= known | new):
            continue
        group.kinds.append(joint["kind"])
        group.inner += [{one, other}] if {one, other} <= new else []
        coordinates |= {f"{name}.slide"} | ({f"{name}.angle"} if name not in m.bodies else set())
        group.hubs += [m.points[body][point] for body, point in joint["ends"] if body in new]
        group.hubs += [None] if joint["kind"] == "rack" and other not in known else []
        if joint["kind"] == "gear" and one in known:
            group.turn, group.arm = ONE - ONE / joint["ratio"], {other, joint["carrier"]}
    for name in m.drivers:
        of_body = name.split(".")[0] in new and not name.endswith(".slide")
        group.drivers += [name] if name in coordinates or of_body else []
    return group


def most_in_plane(m: PlanarMechanism, bodies: list[str], known: set[str]) -> tuple[int, str]:
    """Return how many complex poses a group has at most, and by which theorem of the field."""
    g = group_in_plane(m, bodies, known)
    driver = g.drivers[0] if g.drivers else ""
    if g.kinds == ["weld"] or (g.is_shaped(1, 1, 0, 1) and g.lower and driver.count(".") == 1):
        return 1, ""
    if g.is_shaped(2, 3, 1, 0) and g.lower:
        return 2 if g.slides <= 1 else 1, CIRCLES
    if g.is_shaped(2, 2, 1, 2) and g.lower and not g.slides and driver[:-2] == g.drivers[1][:-2]:
        return 2, CIRCLES
    if g.is_shaped(1, 2, 0, 0) and _on_circle_or_line(g):
        two = "distance" in g.kinds or (g.pins and "slot" in g.kinds)
        return 2 if two else 1, CIRCLES
    if len(g.kinds) == 2 * g.gears == 2 * g.pins == 2 * len(bodies) and not g.drivers:
        return 1, ""  # turns are linear, then places
    if g.is_shaped(3, 4, 2, 1) and g.lower:
        if g.slides == 1 and driver.endswith(".slide"):
            return 2, CIRCLES
        if driver.count(".") == 2 and not g.slides:
            return 6, "Roberts 1875"
    geared = g.gears == 1 and g.pins == 4 and g.arm in g.inner and g.turn.is_integer()
    if g.is_shaped(3, 5, 2, 0) and geared:
        orders = (abs(int(float(k))) for k in (g.turn, g.turn - 1))
        return 2 * max(1, *orders), "degree in exp(i angle)"
    platform = any(sum(body in pair for pair in g.inner) == 3 for body in bodies)
    if g.is_shaped(4, 6, 3, 0) and g.lower and g.slides <= 2 and platform:
        return 6, "Gosselin, Sefrioui, Richard 1992"
    return 0, f"no theorem here tells how many poses {bodies} has"


def _on_circle_or_line(g: PlanarGroup) -> bool:
    """Whether a body on a pin or guide meets a circle or line; a rack rolls round its pin."""
    plain = g.pins + g.slides == 1 and not g.gears and "weld" not in g.kinds
    round_pin = g.slides or all(spot == g.hubs[0] for spot in g.hubs)
    return bool(plain and ("rack" not in g.kinds or round_pin))


def wheels(m: PlanarMechanism) -> list[set[str]]:
    """Return the bodies of each joint whose equations tell whole turns apart."""
    return [
        {joint["carrier"], *joint["bodies"]} - {"ground"}
        for joint in m.joints.values()
        if joint["kind"] in ("gear", "rack")
    ]


def alike_in_plane(
    m: PlanarMechanism, groups: list[list[str]], one: list[arb], other: list[arb]
) -> bool:
    """Whether two poses in balls may be one, whole turns aside.

    Theorems count the poses of a group for one pose of those before it. Where wheels or racks tell
    whole turns of these, poses with other turns of them are not counted twice: they are one.
    """
    wheeled = set[str]().union(*wheels(m))
    for group in groups:
        if not may_be_one(m, group, one, other):
            return False
        turns = [m.at[body, "angle"] for body in group if body in wheeled]
        if not all((one[k] - other[k]).contains(0) for k in turns):
            return True
    return True


def may_be_one(m: PlanarMechanism, group: list[str], one: list[arb], other: list[arb]) -> bool:
    """Whether poses of a group in balls may be one, whole turns aside."""
    places = [(word, m.at[body, word]) for body in group for word in m.words]
    halves = [(word, (one[k] - other[k]) / 2) for word, k in places]
    return all((v.sin() if word == "angle" else v).contains(0) for word, v in halves)


def aside_in_plane(m: PlanarMechanism, groups: list[list[str]], theorems: list[str]) -> str:
    """Return what poses of groups are counted without: whole turns that wheels would tell."""
    known, turning, several = {"ground"}, set[str](), False
    for group, theorem in zip(groups, theorems, strict=True):
        known |= {*group}
        if any(bodies <= known and bodies & turning for bodies in wheels(m)):
            return ", whole turns that wheels would tell aside"
        several = several or bool(theorem)
        turning |= {*group} if several else set()
    return ""


IN_PLANE = Theorems(most_in_plane, alike_in_plane, aside_in_plane)
